"""The scenes that come with the package: they load, and they are what they say."""

from pathlib import Path

import numpy as np
import pytest

from rigid_body_sim import Simulation, Wrench, load_scene
from rigid_body_sim.physics import rotation
from rigid_body_sim.tools.demo import installed_scene

CONFIG = Path(__file__).parents[2] / "config"
SCENES = sorted(path.stem for path in CONFIG.glob("*.yaml"))


def test_all_are_here():
    assert {"satellite", "quadrotor", "tumbling_body", "point_mass"} <= set(SCENES)


@pytest.mark.parametrize("name", SCENES)
def test_loads_and_runs(name):
    simulation = Simulation.from_scene(load_scene(CONFIG / f"{name}.yaml"))
    simulation.step(100)
    assert np.isfinite(simulation.state.values).all()


@pytest.mark.parametrize("name", SCENES)
def test_ros_reads_every_number_as_a_float(name):
    """A ROS array that mixes 0 and 0.0 is refused by the ROS parameter parser."""
    for key, value in load_scene(CONFIG / f"{name}.yaml").values.items():
        if isinstance(value, tuple):
            assert all(isinstance(number, float) for number in value), key


def test_satellite_is_a_uniform_6u_box():
    """Moments from size and mass, to the digits of the file; three different ones."""
    scene = load_scene(CONFIG / "satellite.yaml")
    a, b, c = 0.2263, 0.1, 0.366  # m
    expected = np.array((b * b + c * c, a * a + c * c, a * a + b * b)) * scene["body.mass"] / 12.0
    assert np.allclose(scene["body.inertia"][:3], expected, rtol=0.0, atol=5e-7)
    assert scene["gravity"] == (0.0, 0.0, 0.0)


def test_quadrotor_hovers_on_its_rotors():
    """Hover thrust on all four rotors together leaves it where it is; one rotor alone makes it turn the right way."""
    scene = load_scene(CONFIG / "quadrotor.yaml")
    thrust = (0.0, 0.0, scene["body.mass"] * 9.80665 / 4.0)
    wrenches = [frame.wrench(thrust, (0.0, 0.0, 0.0)) for frame in scene.frames.values()]
    assert len(wrenches) == 4
    simulation = Simulation.from_scene(scene)
    force, torque = sum(w.force_body for w in wrenches), sum(w.torque_body for w in wrenches)
    simulation.set_wrench(Wrench(force_body=force, torque_body=torque))
    simulation.step(1000)
    assert np.linalg.norm(simulation.state.position - (0.0, 0.0, 2.0)) < 1e-12  # m; measured 0
    front = scene.frames["rotor_front"].wrench(thrust, (0.0, 0.0, 0.0))
    assert front.torque_body[1] == pytest.approx(-0.17 * thrust[2])  # lifting the nose turns about −y


def test_tumbling_body_turns_over():
    """The file's 10.7 s and 21.4 s: the spin about x changes sign then."""
    simulation = Simulation.from_scene(load_scene(CONFIG / "tumbling_body.yaml"))
    turns, before = [], 1.0
    for _ in range(600):
        simulation.step(100)
        now = simulation.state.angular_velocity[0]
        if now * before < 0.0:
            turns.append(simulation.time)
        before = now
    assert turns == pytest.approx([10.7, 32.1, 53.5], abs=0.1)  # s, looked at every 0.1 s; measured the same


def test_shot_flies_as_far_as_it_says():
    simulation = Simulation.from_scene(load_scene(CONFIG / "point_mass.yaml"))
    simulation.step(1820)
    x, _, z = simulation.state.position
    assert (x, z) == (pytest.approx(18.9, abs=0.05), pytest.approx(0.0, abs=0.02))  # m; measured 18.892 and -0.009


def test_installed_scene_is_found():
    assert rotation.norm(load_scene(installed_scene("satellite"))["initial.orientation"]) == pytest.approx(1.0)
    assert installed_scene("no_such_scene").name == "no_such_scene.yaml"
