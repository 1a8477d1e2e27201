"""The scenes that come with the package: they load, and they are what they say."""

import math
from pathlib import Path

import numpy as np
import pytest

from rigid_body_sim import Fleet, Scene, Simulation, load_scene
from rigid_body_sim.scene.fleet import load_any
from rigid_body_sim.theory import invariants
from rigid_body_sim.values import rotation

CONFIG = Path(__file__).parents[2] / "config"
SCENES = sorted(path.stem for path in CONFIG.glob("*.yaml"))


def test_all_are_here():
    assert {"satellite", "tumbling_body", "point_mass", "underwater_vehicle", "tethered_drone"} < set(SCENES)
    assert {"quadrotor", "satellite_wheels", "bluerov2_heavy"} < set(SCENES)


@pytest.mark.parametrize("name", SCENES)
def test_loads_and_runs(name):
    scene = load_any(CONFIG / f"{name}.yaml")
    fleet = Fleet({"": Simulation.from_scene(scene)}) if isinstance(scene, Scene) else Fleet.from_scene(scene)
    fleet.step(100)
    assert not fleet.stopped and all(np.isfinite(one.state.values).all() for one in fleet.values())


@pytest.mark.parametrize("name", SCENES)
def test_ros_reads_every_number_as_a_float(name):
    """A ROS array that mixes 0 and 0.0 is refused by the ROS parameter parser."""
    scene = load_any(CONFIG / f"{name}.yaml")
    for key, value in scene.values.items():
        if scene.parameter(key).type is tuple:
            assert all(isinstance(number, float) for number in value), key


def test_satellite_is_a_uniform_6u_box():
    """Moments from size and mass, to the digits of the file; three different ones."""
    scene = load_scene(CONFIG / "satellite.yaml")
    a, b, c = 0.2263, 0.1, 0.366  # m
    expected = np.array((b * b + c * c, a * a + c * c, a * a + b * b)) * scene["body.mass"] / 12.0
    assert np.allclose(scene["body.inertia"][:3], expected, rtol=0.0, atol=5e-7)
    assert scene["gravity"] == (0.0, 0.0, 0.0)


def test_quadrotor_hovers_on_its_rotors():
    """Where all turn at the speed of the closed form it stays where it is; the front one faster lifts the nose."""
    scene = load_scene(CONFIG / "quadrotor.yaml").changed({"initial.position": (0.0, 0.0, 5.0)})
    sim = Simulation.from_scene(scene)
    speed = math.sqrt(scene["body.mass"] * 9.80665 / (4.0 * 8.54858e-06))
    assert speed == pytest.approx(453.0, abs=0.5)  # rad/s: what the file says
    sim.set_actuators([speed] * 4)
    sim.step(500)  # 40 time constants: it falls until they are that fast, and on from there at the same rate
    before = sim.state.velocity
    sim.step(500)
    assert np.linalg.norm(sim.state.velocity - before) < 1e-12  # m/s; measured 1.3e-15
    assert np.linalg.norm(sim.state.angular_velocity) < 1e-12  # rad/s; measured 0
    sim.set_actuators([1.02 * speed, speed, 0.98 * speed, speed])
    sim.step(100)
    assert sim.state.angular_velocity[1] < -0.1  # lifting the nose turns about −y


def test_quadrotor_stands_on_its_feet_as_deep_as_its_file_says():
    sim, energies = run("quadrotor", 2)
    depth = 0.716 * 9.80665 / (4.0 * 3510.8)
    assert depth == pytest.approx(0.5e-3, rel=1e-4)  # m: what the file says
    assert [one.penetration for one in sim.contacts] == pytest.approx([depth] * 4, rel=1e-12)  # measured 7e-15
    force = 0.716 * 9.80665 / 4.0  # N
    assert [one.normal_force for one in sim.contacts] == pytest.approx([force] * 4, rel=1e-12)  # measured 1e-14
    assert np.abs(sim.state.velocity).max() < 1e-12 and np.ptp(energies) < 1e-11  # measured 3e-16 and 5e-14


def test_rotors_wheels_and_thrusters_have_the_numbers_of_their_sources():
    """Thrust at the top speed, momentum at the top speed, and the unit of each scene's limits."""
    rotors, wheels, thrusters = (
        Simulation.from_scene(load_scene(CONFIG / f"{name}.yaml")).actuators
        for name in ("quadrotor", "satellite_wheels", "bluerov2_heavy")
    )
    for rotor in rotors:
        assert rotor.thrust_coefficient * rotor.max**2 == pytest.approx(6.0, abs=0.01)  # N
        assert rotor.torque_coefficient == pytest.approx(0.016 * rotor.thrust_coefficient, rel=1e-8)
        assert rotor.inertia == pytest.approx(0.009 * 0.2**2 / 12.0, rel=1e-12)
    for wheel in wheels:
        assert wheel.inertia * wheel.max_speed == pytest.approx(0.02, rel=1e-4)  # N m s
        assert wheel.max_speed == pytest.approx(6500.0 * 2.0 * math.pi / 60.0, rel=1e-4)
    for thruster in thrusters:
        limits = np.array((-4.1, 5.25)) * 9.80665
        assert (thruster.min, thruster.max) == pytest.approx(limits, abs=0.05)  # N


def test_two_scenes_of_one_vehicle_have_one_body():
    own, other = (load_scene(CONFIG / f"{name}.yaml") for name in ("bluerov2_heavy", "underwater_vehicle"))
    assert not [k for k, v in other.values.items() if not k.startswith("actuators.") and own.values[k] != v]
    own, other = (load_scene(CONFIG / f"{name}.yaml") for name in ("satellite_wheels", "satellite"))
    assert own["body.inertia"] == other["body.inertia"] and own["body.mass"] == other["body.mass"]


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


def run(name, seconds):
    """The scene after that many seconds without a command, and its energies [J] at the start and every 0.05 s."""
    sim = Simulation.from_scene(load_scene(CONFIG / f"{name}.yaml"))
    energies = [energy(sim)]
    for _ in range(20 * seconds):
        sim.step(round(0.05 * sim.rate))
        energies.append(energy(sim))
    return sim, energies


def energy(sim):
    potential = invariants.potential_energy(sim.terms, sim.state)
    return invariants.energy_of_motion(sim.terms, sim.state) + potential


def tilt(state):
    """Angle [rad] between the body's z axis and the world's."""
    return np.arccos(min(1.0, rotation.to_matrix(state.orientation)[2, 2]))


def test_underwater_vehicle_rights_itself_and_rises_where_drag_meets_buoyancy():
    """Terminal velocity: 5.18 v + 36.99 v² = buoyancy less weight, the drag along z of an upright vehicle."""
    sim, energies = run("underwater_vehicle", 40)
    lift = sim.forces[0][1][2] - 11.5 * 9.80665
    speed = (np.sqrt(5.18**2 + 4.0 * 36.99 * lift) - 5.18) / (2.0 * 36.99)
    assert speed == pytest.approx(0.174, abs=5e-4)  # m/s: what the file says
    assert sim.state.velocity[2] == pytest.approx(speed, rel=1e-7, abs=0)  # measured 6.0e-9
    assert tilt(sim.state) < 5e-4  # rad, from 1.05; measured 1.1e-4
    assert np.linalg.norm(sim.state.angular_velocity) < 2e-3  # rad/s; measured 2.4e-4
    assert (np.diff(energies) < 0.0).all()


def test_underwater_vehicle_rocks_as_its_file_says():
    """Small angles: ω² = buoyancy times its arm c about the centre of mass, over the moment that answers a torque.

    That is I + D + A c² − (A c)² / (m + A), with the added mass A across about the origin: the vehicle yields sideways.
    """
    sim, _ = run("underwater_vehicle", 5)
    crossings, before = [], sim.state.orientation[1]
    while len(crossings) < 3:
        sim.step()
        now = sim.state.orientation[1]
        if now * before < 0.0:
            crossings.append(sim.time)
        before = now
    moment = 0.16 + 0.12 + 12.7 * 0.02**2 - (12.7 * 0.02) ** 2 / (11.5 + 12.7)
    period = 2.0 * np.pi / np.sqrt(114.8 * 0.02 / moment)
    assert period == pytest.approx(2.2, abs=0.05)  # s: what the file says
    assert crossings[2] - crossings[0] == pytest.approx(period, rel=0.02)  # measured 0.4 %, seen every 5 ms


def test_tethered_drone_hovers_above_its_anchor():
    """The cord's stretch is net thrust over stiffness; the swing to the side is the slowest to die away."""
    sim, energies = run("tethered_drone", 20)
    (cord,), lift = sim.tethers, 10.0 - 0.716 * 9.80665
    stretch = np.linalg.norm(invariants.point_position(sim.state, cord.body_point) - cord.anchor) - cord.rest_length
    assert stretch == pytest.approx(lift / 2957.0, rel=1e-3, abs=0)  # measured 1.1e-6
    assert stretch == pytest.approx(1e-3, abs=5e-5)  # m: what the file says
    assert np.linalg.norm(sim.state.position[:2]) < 0.05  # m, from 0.5; measured 0.017
    assert tilt(sim.state) < 2e-3  # rad, from 0.17; measured 1.3e-3
    assert np.max(np.diff(energies)) < 1e-12  # J, of 60; measured 4e-14, at rest: round-off
    sim.step(100_000)
    assert sim.state.position == pytest.approx((0.0, 0.0, 20.0 + 0.06 + lift / 2957.0), abs=1e-6)  # m; measured 7.7e-8
    assert np.abs(sim.state.values[7:13]).max() < 1e-6  # m/s and rad/s at rest; measured 7.5e-8


def test_tethered_drone_is_caught_by_its_cord():
    """It arrives with 2.5 m/s; the cord stretches by 36 mm and throws it back."""
    sim = Simulation.from_scene(load_scene(CONFIG / "tethered_drone.yaml"))
    lengths, speeds = [], []
    for _ in range(2000):
        sim.step()
        lengths.append(np.linalg.norm(invariants.point_position(sim.state, sim.tethers[0].body_point)))
        speeds.append(sim.state.velocity[2])
    assert min(lengths) < 19.0 and 20.005 < max(lengths) < 20.06  # m; measured 18.947 and 20.036
    assert max(speeds) > 1.5 and min(speeds) < -1.0  # m/s; measured 2.54 and -2.03
