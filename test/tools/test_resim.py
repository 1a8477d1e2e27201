"""rigid_body_resim as it is called: what it says, what it leaves behind, and its exit status."""

import math
import os
import signal
import subprocess
import sys

import numpy as np
import pytest
import yaml
from numpy.testing import assert_array_equal

pytest.importorskip("rosbags")

from rigid_body_sim import Scene
from rigid_body_sim.bags.reading import read
from rigid_body_sim.tools import resim, resim_plot

from ..bags import making
from ..resim import runs

BASE = Scene(runs.SCENE)
SECONDS = 1.0


def write_scene(path, **changes):
    """The scene of the runs as a parameter file."""
    path.write_text(yaml.safe_dump({"/**": {"ros__parameters": {**runs.SCENE, **changes}}}))
    return path


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder to work in, with the bag ``run`` and the ``scene.yaml`` of its run."""
    monkeypatch.chdir(tmp_path)
    making.make(tmp_path / "run", runs.in_real_time(BASE, runs.sends(BASE, SECONDS), SECONDS))
    write_scene(tmp_path / "scene.yaml")
    return tmp_path


def call(capsys, *arguments):
    """Exit status, and what is written to standard output and to standard error."""
    try:
        status = resim.main([str(argument) for argument in arguments])
    except SystemExit as ended:
        status = ended.code
    out, err = capsys.readouterr()
    return status, out, err


def refusal(capsys, *arguments):
    """The one sentence of a call that fails."""
    before = sorted(os.listdir())
    status, _, err = call(capsys, *arguments)
    assert status == 1
    assert err.startswith("rigid_body_resim: ") and err.count("\n") == 1
    assert sorted(os.listdir()) == before
    return err


def test_same(folder, capsys):
    status, out, _ = call(capsys, "run", "--scene", "scene.yaml", "--compare")
    assert status == 0
    assert "run: 94 commands on /wrench, 51 poses on /pose" in out
    assert "Equal to the bit: 51 poses" in out and "Same within 1e-09 m, 1e-09 rad" in out


def test_section_of_another_node_is_taken_only_when_it_is_named(folder, capsys):
    (folder / "other.yaml").write_text(yaml.safe_dump({"/x/sat": {"ros__parameters": runs.SCENE}}))
    said = refusal(capsys, "run", "--scene", "other.yaml")
    assert "other.yaml: has no section for /rigid_body_node; it has /x/sat: name the node that is meant" in said
    assert call(capsys, "run", "--scene", "other.yaml", "--node", "/x/sat")[0] == 0


def test_compared_when_nothing_else_is_asked(folder, capsys):
    assert "Equal to the bit" in call(capsys, "run", "--scene", "scene.yaml")[1]


def test_different(folder, capsys):
    """Another mass: positions differ, attitudes do not before forces with a lever come in."""
    write_scene(folder / "other.yaml", **{"body.mass": 2.1})
    status, out, _ = call(capsys, "run", "--scene", "other.yaml")
    assert status == 2
    assert "Different: above 1e-09 m, 1e-09 rad from 0.0" in out
    assert "Position error: rms" in out and "Attitude error: rms" in out
    status, out, _ = call(capsys, "run", "--scene", "other.yaml", "--tolerance", "10", "7")
    assert status == 0 and "Same within 10 m, 7 rad" in out


def test_scene_of_the_journal(folder, capsys):
    making.make(folder / "own", runs.with_journal(BASE, runs.sends(BASE, SECONDS), SECONDS))
    status, out, _ = call(capsys, "own")
    assert status == 0
    assert "own: 94 journal entries, 51 poses on /pose" in out
    assert "Scene: as the node recorded it." in out and "Equal to the bit" in out


def test_one_is_not_many(folder, capsys):
    given = runs.sends(BASE, SECONDS)[:1]
    making.make(folder / "one", runs.in_real_time(BASE, given, SECONDS))
    making.make(folder / "own", runs.with_journal(BASE, given, 0.01))
    assert "one: 1 command on /wrench, 51 poses" in call(capsys, "one", "--scene", "scene.yaml")[1]
    out = call(capsys, "own")[1]
    assert "own: 1 journal entry, 1 pose on /pose" in out and "Equal to the bit: 1 pose\n" in out


def test_defaults_of_the_node_where_nothing_tells_the_scene(folder, capsys):
    status, out, _ = call(capsys, "run", "--start", "scene")
    assert status == 2
    assert "Scene: the node's defaults, because neither --scene nor a journal gives one." in out


def with_poses_lost(messages, lost, instead=math.nan):
    """Of the poses, those numbered so have nothing but that in all places."""
    poses = (i for i, entry in enumerate(messages) if entry[0] == "/pose")
    for k, i in enumerate(poses):
        if k in lost:
            topic, receive_ns, pose = messages[i]
            stamp = pose.header.stamp
            nothing = making.pose_stamped(stamp.sec * 10**9 + stamp.nanosec, "world", [instead] * 7)
            messages[i] = topic, receive_ns, nothing
    return messages


def test_poses_that_are_none_are_left_out(folder, capsys):
    given = runs.sends(BASE, SECONDS)
    making.make(folder / "own", with_poses_lost(runs.with_journal(BASE, given, SECONDS), {0, 20}))
    making.make(folder / "lost", with_poses_lost(runs.in_real_time(BASE, given, SECONDS), {20, 50}))
    making.make(folder / "zero", with_poses_lost(runs.in_real_time(BASE, given, SECONDS), {20, 50}, instead=0.0))
    by_times = ("--scene", "scene.yaml")
    for arguments, first in ((("own",), 1), (("lost", *by_times), 21), (("zero", *by_times), 21)):
        status, out, _ = call(capsys, *arguments)
        assert status == 0 and "Equal to the bit: 49 poses" in out
        assert "2 of 51 poses on /pose are not finite or have a quaternion of zeros" in out
        assert f"the first is message {first}, stamped 17000000" in out
    making.make(folder / "none", with_poses_lost(runs.in_real_time(BASE, given, SECONDS), range(51)))
    assert "51 of 51 poses on /pose are not finite" in refusal(capsys, "none", *by_times)


def test_bag_is_written_and_can_be_compared_again(folder, capsys):
    status, out, _ = call(capsys, "run", "--scene", "scene.yaml", "--out", "again")
    assert status == 0 and "Written: again" in out and "Equal" not in out
    recorded, written = read("run"), read("again")
    for topic in ("/pose", "/twist"):
        first, second = ((recording.poses | recording.twists)[topic] for recording in (recorded, written))
        assert_array_equal(first.stamp_ns, second.stamp_ns)
        assert_array_equal(first.values, second.values)
        assert_array_equal(first.frame_ids, second.frame_ids)
        assert_array_equal(first.receive_ns, second.receive_ns)
    assert sorted(os.listdir("again")) == ["again_0.mcap", "metadata.yaml"]
    assert sorted(os.listdir()) == ["again", "run", "scene.yaml"]


def test_twist_in_world_axes_is_written_as_recorded(folder, capsys):
    scene = BASE.changed({"twist_frame": "world"})
    making.make(folder / "world", runs.in_real_time(scene, runs.sends(scene, SECONDS), SECONDS))
    write_scene(folder / "world.yaml", twist_frame="world")
    assert call(capsys, "world", "--scene", "world.yaml", "--out", "again")[0] == 0
    twists = [read(bag).twists["/twist"] for bag in ("world", "again")]
    assert_array_equal(twists[0].values, twists[1].values)
    assert set(twists[1].frame_ids) == {"world"}


def test_commands_alone_are_simulated_and_cannot_be_compared(folder, capsys):
    messages = [e for e in runs.in_real_time(BASE, runs.sends(BASE, SECONDS), SECONDS) if e[0] == "/wrench"]
    making.make(folder / "commands", messages)
    assert call(capsys, "commands", "--scene", "scene.yaml", "--out", "again")[0] == 0
    assert len(read("again").poses["/pose"]) > 45
    said = refusal(capsys, "commands", "--scene", "scene.yaml", "--compare")
    assert "has no topic with poses to compare with, of type geometry_msgs/PoseStamped" in said
    assert "it has /wrench (geometry_msgs/msg/WrenchStamped); give --out alone" in said


def test_odometry_is_compared_and_written_as_pose_and_twist(folder, capsys):
    messages = runs.told_by(
        runs.in_real_time(BASE, runs.sends(BASE, SECONDS), SECONDS), runs.odometry(topic="/ns/odom")
    )
    making.make(folder / "odom", messages)
    status, out, _ = call(capsys, "odom", "--scene", "scene.yaml", "--out", "again", "--compare")
    assert status == 0 and "odom: 94 commands on /wrench, 51 poses on /ns/odom" in out and "Equal to the bit" in out
    written, recorded = read("again"), read("odom")
    assert written.types == {"/ns/pose": "geometry_msgs/msg/PoseStamped", "/ns/twist": "geometry_msgs/msg/TwistStamped"}
    assert_array_equal(written.poses["/ns/pose"].values, recorded.poses["/ns/odom"].values)
    assert_array_equal(written.twists["/ns/twist"].values, recorded.twists["/ns/odom"].values)


def test_free_motion(folder, capsys):
    making.make(folder / "free", runs.in_real_time(BASE, [], SECONDS))
    status, out, _ = call(capsys, "free", "--scene", "scene.yaml")
    assert status == 0 and "free: no commands, 51 poses on /pose" in out and "Equal to the bit: 51 poses" in out
    assert call(capsys, "free", "--scene", "scene.yaml", "--vary", "body.mass=2,3", "--workers", "1")[0] == 0
    assert "2.0,0.0,0.0,0.0,0.0," in (folder / "free.csv").read_text()


def test_lockstep_that_differs_for_commands_that_are_missing(folder, capsys):
    scene = BASE.changed({"lockstep": True, "steps_per_command": 5, "publish_rate": 100.0})
    write_scene(folder / "lock.yaml", lockstep=True, steps_per_command=5, publish_rate=100.0)
    messages = runs.in_lockstep(scene, [runs.Send(0, "world", (k, 1, 0, 0, 0, 0), stamp_ns=0) for k in range(30)])
    early = ("/wrench", making.EPOCH_NS - 1, messages[-3][2])
    making.make(folder / "lock", [early, *messages])
    status, out, _ = call(capsys, "lock", "--scene", "lock.yaml")
    assert (
        status == 2
        and "At every pose more commands had been received than lead to it, by 1 or more" in out.splitlines()[-1]
    )
    assert "(ros2 topic pub -w 2), or let the node record" in out.splitlines()[-1]


def test_recovers_what_is_whole(folder, capsys):
    file = folder / "run" / "run.mcap"
    file.write_bytes(file.read_bytes()[:-100])
    (folder / "run" / "metadata.yaml").unlink()
    assert "has no end" in refusal(capsys, "run", "--scene", "scene.yaml")
    status, out, _ = call(capsys, "run", "--scene", "scene.yaml", "--recover")
    assert status == 0 and "run.mcap has no end: what is whole in it is taken." in out


# The picture ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("mass", "status"), ((2.0, 0), (2.1, 2)))
def test_picture_is_drawn(folder, capsys, mass, status):
    pytest.importorskip("matplotlib")
    write_scene(folder / "other.yaml", **{"body.mass": mass})
    assert call(capsys, "run", "--scene", "other.yaml", "--plot")[0] == status
    assert (folder / "run.png").read_bytes().startswith(b"\x89PNG")
    assert call(capsys, "run", "--scene", "other.yaml", "--plot", "errors.svg")[0] == status
    text = (folder / "errors.svg").read_text()
    assert text.startswith("<?xml")


def test_where_all_is_equal_the_motion_is_drawn(folder, monkeypatch, capsys):
    pytest.importorskip("matplotlib")
    drawn = []
    monkeypatch.setattr(resim_plot.picture, "save", lambda figure, path: drawn.append(figure))
    write_scene(folder / "other.yaml", **{"body.mass": 2.1})
    for scene in ("scene.yaml", "other.yaml"):
        call(capsys, "run", "--scene", scene, "--plot")
    equal, different = drawn
    assert equal.get_suptitle() == "run simulated again: all 51 poses are equal to the bit"
    assert [panel.get_ylabel() for panel in equal.axes] == ["position [m]", "attitude [deg]"]
    height = read(folder / "run").poses["/pose"].values[:, 2]
    assert_array_equal(equal.axes[0].lines[2].get_ydata(), height)
    assert [panel.get_ylabel() for panel in different.axes] == ["position error [m]", "attitude error [rad]"]


def test_picture_that_cannot_be(folder, capsys, monkeypatch):
    pytest.importorskip("matplotlib")
    assert "--plot none/run.png: there is no such folder" in refusal(capsys, "run", "--plot", "none/run.png")
    assert "--plot run.docx: its ending names no known format; give one of" in refusal(
        capsys, "run", "--plot", "run.docx"
    )
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    assert "--plot needs matplotlib" in refusal(capsys, "run", "--plot")


def test_every_peak_is_in_the_picture():
    errors = np.zeros(100_001)
    errors[[1, 5_000, 77_777, 100_000]] = (3.0, 1.0, 2.0, 4.0)
    _, line = resim_plot.thinned(np.arange(100_001), errors)
    assert len(line) <= resim_plot.MOST_POINTS
    assert sorted(line[line > 0]) == [1.0, 2.0, 3.0, 4.0]


# What cannot be done --------------------------------------------------------------------------------------------------


def test_bags_that_cannot_be_used(folder, capsys):
    making.make(folder / "empty", [])
    making.make(folder / "talk", [("/chatter", 1, making.text("hello"))])
    (folder / "plain").mkdir()
    for arguments, said in (
        (("none",), "none: does not exist; give the folder of a bag"),
        (("plain",), "plain: is a folder without metadata.yaml"),
        (("scene.yaml",), "scene.yaml: is no bag"),
        (("empty",), "empty: holds no message"),
        (
            ("talk",),
            "TransformStamped, or nav_msgs/Odometry; it has /chatter (std_msgs/msg/String)",
        ),
        (("run", "--topic", "pose"), "run: topic /pose is of type geometry_msgs/msg/PoseStamped"),
        (("run", "--scene", "none.yaml"), "--scene none.yaml: cannot be read (No such file or directory); give a"),
        (("run", "--scene", "plain"), "--scene plain: cannot be read (Is a directory); give a parameter file"),
        (("run", "--pose", "nowhere"), "run: has no topic nowhere"),
        (("run", "--out", "plain"), "--out plain: exists already"),
        (("run", "--out", "none/again"), "there is no folder"),
        (("run", "--csv", "rows.csv"), "--csv is for many runs; give --vary, too"),
    ):
        assert said in refusal(capsys, *arguments)


def test_nothing_is_left_of_a_bag_whose_simulation_fails(folder, capsys):
    """A force that no float can follow."""
    send = runs.Send(201_000_000, "world", (1e305, 0, 0, 0, 0, 0))
    message = ("/wrench", making.EPOCH_NS + send.at_ns, runs.message(send, making.EPOCH_NS))
    messages = runs.in_real_time(BASE, runs.sends(BASE, SECONDS), SECONDS)
    making.make(folder / "wild", sorted([*messages, message], key=lambda entry: entry[1]))
    write_scene(folder / "light.yaml", **{"body.mass": 1e-20, "body.inertia": [1e-20, 1e-20, 1e-20, 0.0, 0.0, 0.0]})
    said = refusal(capsys, "wild", "--scene", "light.yaml", "--out", "again", "--start", "scene")
    assert "cannot be done" in said


def test_nothing_is_left_of_a_bag_that_cannot_be_written(folder, capsys, monkeypatch):
    from rigid_body_sim.tools import resim_output

    def full(*_):
        raise OSError(28, "No space left on device")
        yield

    monkeypatch.setattr(resim_output, "_messages", full)
    assert "No space left on device" in refusal(capsys, "run", "--scene", "scene.yaml", "--out", "again")


def test_choices_that_a_journal_makes(folder, capsys):
    making.make(folder / "own", runs.with_journal(BASE, runs.sends(BASE, SECONDS), SECONDS))
    assert "are for bags without a journal" in refusal(capsys, "own", "--times", "header")


@pytest.mark.parametrize(
    "arguments", (("run", "--tolerance", "-1", "1"), ("run", "--tolerance", "x", "1"), ("run", "--colour"), ())
)
def test_bad_command_line_is_an_error_not_a_difference(folder, capsys, arguments):
    assert "; --help tells what can be given" in refusal(capsys, *arguments)


def test_as_a_program(folder):
    """With its exit status, and no progress bar where there is no terminal."""
    write_scene(folder / "other.yaml", **{"body.mass": 2.1})
    for scene, status in (("scene.yaml", 0), ("other.yaml", 2), ("none.yaml", 1)):
        command = [sys.executable, "-m", "rigid_body_sim.tools.resim_main", "run", "--scene", scene]
        ended = subprocess.run(command, capture_output=True, text=True)
        assert ended.returncode == status
        assert len(ended.stderr.splitlines()) == (status == 1)


@pytest.mark.parametrize("number", (signal.SIGINT, signal.SIGTERM))
def test_stopped_while_it_starts(folder, number):
    """In the middle of the imports: one of the modules sends the signal."""
    text = (
        f"import os, time\nos.kill(os.getpid(), {int(number)})\ntime.sleep(60)\nraise AssertionError('not stopped')\n"
    )
    (folder / "yaml.py").write_text(text)
    command = [sys.executable, "-m", "rigid_body_sim.tools.resim_main", "run"]
    ended = subprocess.run(command, capture_output=True, text=True)
    assert (ended.returncode, ended.stdout, ended.stderr) == (130, "", "")


@pytest.mark.parametrize("number", (signal.SIGINT, signal.SIGTERM))
def test_stopped_while_it_writes(folder, number):
    """Nothing of the bag is left, neither under its name nor beside it."""
    there = sorted(os.listdir())
    text = f"""
import os, signal, sys
from rigid_body_sim.tools import resim_main, resim_output
whole = resim_output._messages
def stopped(*given):
    yield next(whole(*given))
    assert any(name.startswith(".again.") for name in os.listdir())
    os.kill(os.getpid(), {int(number)})
    yield from whole(*given)
resim_output._messages = stopped
sys.argv = ["rigid_body_resim", "run", "--scene", "scene.yaml", "--out", "again"]
sys.exit(resim_main.main())
"""
    ended = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True)
    assert (ended.returncode, ended.stderr) == (130, "rigid_body_resim: interrupted\n")
    assert sorted(os.listdir()) == there
