"""rigid_body_plot as it is called: what is in its picture, and what it refuses."""

import numpy as np
import pytest
import yaml

pytest.importorskip("rosbags")
pytest.importorskip("matplotlib")

from rigid_body_sim import Scene, Simulation
from rigid_body_sim.runs import plot
from rigid_body_sim.scenarios.motion import recorded
from rigid_body_sim.tools import bag_plot

from ..bags import making
from ..resim import runs

FREE = Scene({**runs.SCENE, "gravity": [0.0, 0.0, -9.80665]})
SECONDS = 0.5


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder to work in: ``plain``, a bag without a journal, ``own`` with one, and the scene of both."""
    monkeypatch.chdir(tmp_path)
    sends = runs.sends(FREE, SECONDS, frames=("base_link",))
    making.make(tmp_path / "plain", runs.in_real_time(FREE, sends, SECONDS))
    making.make(tmp_path / "own", runs.with_journal(FREE, [], SECONDS))
    (tmp_path / "scene.yaml").write_text(yaml.safe_dump({"/**": {"ros__parameters": runs.SCENE}}))
    return tmp_path


def call(capsys, *arguments):
    """Exit status, and what is written to standard output and to standard error."""
    status = bag_plot.main([str(argument) for argument in arguments])
    return status, *capsys.readouterr()


def names(panels):
    return [panel.name.split("\n")[0] for panel in panels]


def test_picture_is_named_by_the_bag(folder, capsys):
    status, out, _ = call(capsys, "plain")
    assert status == 0 and "Picture: plain.png" in out and "give --scene" in out
    assert (folder / "plain.png").read_bytes().startswith(b"\x89PNG")


def test_several_pictures(folder, capsys):
    assert call(capsys, "own", "--out", "a.svg", "--out", "b.png")[0] == 0
    text = (folder / "a.svg").read_text()
    assert text.startswith("<?xml") and (folder / "b.png").stat().st_size > 20_000
    assert sorted(path.name for path in folder.iterdir() if "." in path.name) == ["a.svg", "b.png", "scene.yaml"]


def test_scene_brings_the_energy(folder, capsys):
    assert "energy is not drawn" in call(capsys, "plain")[1]
    assert "energy is not drawn" not in call(capsys, "plain", "--scene", "scene.yaml")[1]
    motion = recorded("plain")
    without = [
        "position [m]",
        "attitude [deg]",
        "velocity",
        "angular velocity",
        "force on wrench",
        "torque on wrench",
    ]
    assert names(bag_plot.panels(motion, None)) == without
    assert names(bag_plot.panels(motion, FREE)) == [*without, "energy [J]"]


def test_energy_of_a_free_body_is_that_of_the_simulation(folder):
    *_, panel = bag_plot.panels(recorded("own"), FREE)
    simulation = Simulation.from_scene(FREE)
    whole = simulation.kinetic_energy + simulation.potential_energy
    assert panel.name == "energy [J]" and np.ptp(panel.values[:, 0]) > 1.0  # it falls
    np.testing.assert_allclose(panel.values[:, 2], whole, rtol=1e-12)  # measured 4e-14


def test_actuators_have_their_names_in_the_picture(folder):
    at = making.EPOCH_NS
    sent = ("/actuator_commands", at, making.numbers((1.0, 2.0)))
    making.make(folder / "driven", [sent, ("/pose", at, making.pose_stamped(at, "world", (1, 2, 3, 1, 0, 0, 0)))])
    names = ["left", "right"]
    one = {"type": "thruster", "min": -1.0, "max": 1.0, "axis": [1.0, 0.0, 0.0]}
    driven = {f"actuators.{name}.{key}": value for name in names for key, value in one.items()}
    scene = Scene({"actuators.names": names, **driven})
    for given, shown in ((scene, names), (None, ["number 0", "number 1"])):
        (panel,) = (panel for panel in bag_plot.panels(recorded("driven"), given) if panel.name.startswith("commands"))
        assert [label for label, _ in panel.lines] == shown and panel.held


def test_each_of_several_bodies_has_its_picture(folder, capsys):
    at, poses = making.EPOCH_NS, {"red": (1, 2, 3, 1, 0, 0, 0), "blue": (4, 5, 6, 1, 0, 0, 0)}
    messages = [(f"/{name}/pose", at, making.pose_stamped(at, "world", pose)) for name, pose in poses.items()]
    making.make(folder / "pair", messages)
    text = yaml.safe_dump({"/**": {"ros__parameters": {"bodies": list(poses)}}})
    (folder / "pair.yaml").write_text(text)
    assert call(capsys, "pair", "--scene", "pair.yaml")[0] == 0
    assert (folder / "pair.red.png").exists() and (folder / "pair.blue.png").exists()
    assert "/red/pose" in call(capsys, "pair")[2]  # without the scene there is no telling which


def test_long_lines_keep_their_peaks():
    values = np.zeros(100_001)
    values[[1, 5_000, 77_777, 100_000]] = (3.0, -1.0, 2.0, 4.0)
    _, line = plot.outline(np.arange(100_001.0), values)
    assert len(line) <= plot.MOST_POINTS and sorted(line[line != 0.0]) == [-1.0, 2.0, 3.0, 4.0]


def test_what_cannot_be_drawn_is_refused_and_leaves_nothing(folder, capsys):
    before = sorted(folder.iterdir())
    making.make(folder / "silent", [("/wrench", 1, making.wrench_stamped(1, "world", range(6)))])
    for arguments, said in (
        (("none",), "none: does not exist"),
        (("plain", "--out", "x.docx"), "--out x.docx: its ending names no known format"),
        (("plain", "--out", "nowhere/x.png"), "--out nowhere/x.png: there is no such folder"),
        (("plain", "--scene", "none.yaml"), "none.yaml"),
        (("silent",), "silent: has no topic with poses"),
    ):
        status, out, err = call(capsys, *arguments)
        assert (status, out) == (1, "") and err.startswith("rigid_body_plot: ") and err.count("\n") == 1
        assert said in err
    assert sorted(folder.iterdir()) == sorted([*before, folder / "silent"])
