"""What a trajectory gives: arrays, a table, a file, a picture, a line that says what it is."""

import numpy as np
import pytest

from rigid_body_sim import Body, Simulation, State, WrenchSchedule
from rigid_body_sim.runs.plot import roll_pitch_yaw
from rigid_body_sim.values import rotation

BODY = Body(2.0, (0.1, 0.2, 0.25))


def trajectory(n=200, every=10):
    sim = Simulation(BODY, State(angular_velocity=(0.1, 2.0, 0.1)), rate=100.0, gravity=(0, 0, -9.8))
    return sim.run(steps=n, every=every, commands=WrenchSchedule([0, 10], torque_body=[(0.1, 0, 0), (0, 0, 0)]))


@pytest.mark.no_numba
def test_shapes_and_units():
    found = trajectory(20)
    assert len(found) == 3 and found.time.tolist() == [0.0, 0.1, 0.2]
    shapes = {"position": 3, "orientation": 4, "velocity": 3, "angular_velocity": 3, "momentum": 3}
    for name, width in shapes.items():
        assert getattr(found, name).shape == (3, width)
    assert found.kinetic_energy.shape == found.potential_energy.shape == (3,)
    np.testing.assert_allclose(np.linalg.norm(found.orientation, axis=1), 1.0, rtol=0, atol=3e-16)
    fall = -9.8 * found.time**2 / 2
    np.testing.assert_allclose(found.position[:, 2], fall, rtol=1e-15, atol=0)  # measured 0
    np.testing.assert_allclose(found.momentum, 2.0 * found.velocity, rtol=1e-15, atol=0)


def test_arrays_are_not_to_be_changed():
    found = trajectory()
    for name in ("steps", "position", "momentum", "kinetic_energy"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(found, name)[0] = 1.0


def test_repr_says_what_it_is():
    text = repr(trajectory())
    assert text.startswith("Trajectory(21 states from 0 s to 2 s at 100 Hz: within 19.6 m, at most 2.")
    assert text.endswith("J)")


def test_saved_arrays_come_back(tmp_path):
    found = trajectory()
    found.save(tmp_path / "x.npz")
    with np.load(tmp_path / "x.npz") as arrays:
        for name in ("time", "steps", "position", "orientation", "angular_momentum", "potential_energy"):
            assert np.array_equal(arrays[name], getattr(found, name))
        assert arrays["command_steps"].tolist() == [0, 10]
        assert np.array_equal(arrays["command_values"], found.commands.values)
    with pytest.raises(ValueError, match=r"x\.csv does not end in \.npz"):
        found.save(tmp_path / "x.csv")


def test_table():
    pandas = pytest.importorskip("pandas")
    found = trajectory()
    table = found.to_pandas()
    assert isinstance(table, pandas.DataFrame) and table.index.name == "time"
    assert list(table.columns[:7]) == [
        *("position.x", "position.y", "position.z"),
        *("orientation.w", "orientation.x", "orientation.y", "orientation.z"),
    ]
    assert np.array_equal(table["orientation.w"], found.orientation[:, 0])
    assert np.array_equal(table["kinetic_energy"], found.kinetic_energy)


def test_picture(tmp_path):
    pytest.importorskip("matplotlib")
    figure = trajectory().plot()
    assert [panel.get_ylabel().split(" [")[0].split("\n")[0] for panel in figure.axes] == [
        *("position", "attitude", "angular velocity", "energy"),
    ]
    roll, pitch, yaw = (line.get_ydata()[-1] for line in figure.axes[1].lines)
    true = rotation.from_roll_pitch_yaw(*np.radians((roll, pitch, yaw)))
    assert rotation.angle_between(true, trajectory().orientation[-1]) < 1e-12  # measured 2e-16
    figure.savefig(tmp_path / "x.png")
    assert (tmp_path / "x.png").stat().st_size > 20_000


@pytest.mark.no_numba
def test_angles_do_not_jump():
    turns = np.linspace(0.0, 9.0, 50)
    for axis in (0, 2):
        angles = np.zeros((50, 3))
        angles[:, axis] = turns
        attitudes = np.array([rotation.from_roll_pitch_yaw(*row) for row in angles])
        np.testing.assert_allclose(roll_pitch_yaw(attitudes), angles, rtol=0, atol=1e-14)  # measured 3.6e-15
