"""The scenes with actuators in closed loop, without ROS: what the laws promise, and what the plants are."""

import math
from pathlib import Path

import numpy as np
import pytest

from rigid_body_sim import Scene, Simulation, Wrench, load_scene
from rigid_body_sim.scene import attitude
from rigid_body_sim.tools.actuator_laws import PositionLaw, Sensed, controller, kind_of
from rigid_body_sim.values import rotation

CONFIG = Path(__file__).parents[2] / "config"
HOVER_SPEED = math.sqrt(0.716 * 9.80665 / (4.0 * 8.54858e-06))  # rad/s, of each rotor


class Loop:
    """The plant of a scene and its controller, which answers every state that the node would publish."""

    def __init__(self, name, **given):
        scene = load_scene(CONFIG / f"{name}.yaml")
        table = {row.name: row for row in kind_of(scene).parameters}
        self.controller = controller(scene, attitude.read(given, table))
        self.sim, self._steps = Simulation.from_scene(scene), scene.steps_per_publish

    def sensed(self):
        motion = self.sim.motion
        return Sensed(motion[0:3], motion[3:7], motion[13:16], motion[16:19])

    def run(self, seconds):
        """Advance, and return the states of the actuators after each command."""
        seen = []
        for _ in range(round(seconds * self.sim.rate / self._steps)):
            self.sim.set_actuators(self.controller.commands(self.sensed()))
            self.sim.step(self._steps)
            seen.append(self.sim.actuator_states)
        return seen


def test_position_law_is_an_oscillator_near_its_target_and_no_faster_than_it_may():
    law = PositionLaw(np.array((1.0, 2.0, 3.0)), 2.0, 0.7, 0.5)
    e, v = np.array((0.01, -0.02, 0.03)), np.array((0.1, 0.2, -0.1))
    assert np.abs(law.acceleration(law.target + e, v) + 4.0 * e + 2.8 * v).max() < 1e-14  # m/s²; measured 6e-17
    assert np.abs(law.acceleration(np.array((-99.0, 2.0, 3.0)), np.array((0.5, 0.0, 0.0)))).max() < 1e-15  # measured 0


def test_drone_stands_until_it_is_told_to_take_off():
    """Its feet carry it, and none of them does a moment later; it hovers 1 m above where it stood."""
    loop = Loop("quadrotor", **{"target.position": [0.0, 0.0, 1.0595]})
    loop.sim.step(1000)
    assert all(one.normal_force > 1.0 for one in loop.sim.contacts)  # N
    assert np.linalg.norm(loop.sim.state.position - (0.0, 0.0, 0.0595)) < 1e-6  # m; measured 2.7e-9
    loop.run(0.1)
    assert all(one.normal_force == 0.0 and one.penetration < 0.0 for one in loop.sim.contacts)
    loop.run(15.0)
    assert np.linalg.norm(loop.sim.state.position - (0.0, 0.0, 1.0595)) < 1e-7  # m; measured 9e-9


@pytest.mark.parametrize("frequency", [1.0, 2.0])
def test_drone_hovers_at_its_target_at_the_speed_of_the_closed_form(frequency):
    loop = Loop(
        "quadrotor", **{"target.position": [1.0, -0.5, 3.0], "target.yaw": 0.7, "position.natural_frequency": frequency}
    )
    seen = loop.run(25.0)
    state = loop.sim.state
    assert np.linalg.norm(state.position - (1.0, -0.5, 3.0)) < 1e-6  # m; measured 2.5e-8 and 1.4e-14
    assert (
        rotation.angle_between(rotation.from_axis_angle((0, 0, 1), 0.7), state.orientation) < 1e-8
    )  # rad; measured 1.4e-9
    assert [one.speed for one in seen[-1]] == pytest.approx([HOVER_SPEED] * 4, rel=1e-9)  # measured 1.7e-10 and 5e-13
    assert pytest.approx(453.0, abs=0.5) == HOVER_SPEED  # what the file says
    assert loop.sim.commands_limited == 0


def test_gust_moves_the_drone_by_what_its_spring_gives():
    """A steady push F along x is met by leaning: m ω_n² e = F. Nothing integrates it away."""
    loop = Loop("quadrotor", **{"target.position": [0.0, 0.0, 2.0]})
    loop.sim.set_wrench(Wrench(force_world=(0.3, 0.0, 0.0)), source="gust")
    loop.run(20.0)
    offset = 0.3 / (0.716 * 1.5**2)
    assert loop.sim.state.position == pytest.approx((offset, 0.0, 2.0), abs=1e-8)  # m, of 0.19; measured 2.2e-10
    lean = math.atan2(0.3, 0.716 * 9.80665)
    assert rotation.angle_between((1, 0, 0, 0), loop.sim.state.orientation) == pytest.approx(
        lean, abs=1e-9
    )  # measured 2.5e-11


def test_satellite_points_and_its_angular_momentum_stays_to_the_bit():
    loop = Loop("satellite_wheels")
    before = loop.sim.state.angular_momentum.copy()
    seen = loop.run(150.0)
    state = loop.sim.state
    assert rotation.angle_between((1, 0, 0, 0), state.orientation) < 1e-9  # rad, from 2.1; measured 6e-12
    assert np.linalg.norm(state.angular_velocity) < 1e-9  # rad/s, from 0.07; measured 1.2e-12
    assert np.array_equal(state.angular_momentum, before) and np.linalg.norm(before) > 5e-3
    assert max(abs(one.speed) for step in seen for one in step) < 0.9 * 680.7  # rad/s; measured 499
    # At rest along the world's axes, all of it is in the wheels.
    spins = [
        2.938e-05 * one.speed * np.array(a.axis) / math.sqrt(3)
        for a, one in zip(loop.sim.actuators, seen[-1], strict=True)
    ]
    assert np.sum(spins, axis=0) == pytest.approx(before, abs=1e-11)  # N m s, of 0.01; measured 1.1e-13


def test_vehicle_holds_depth_heading_and_position():
    target = rotation.from_roll_pitch_yaw(0.0, 0.0, 1.0)
    loop = Loop("bluerov2_heavy", **{"target.position": [1.0, 0.5, -9.0], "target.rpy": [0.0, 0.0, 1.0]})
    seen = loop.run(60.0)
    assert np.linalg.norm(loop.sim.state.position - (1.0, 0.5, -9.0)) < 1e-10  # m; measured 2.4e-13
    assert rotation.angle_between(target, loop.sim.state.orientation) < 1e-10  # rad; measured 3e-15
    # Four upright thrusters share what buoyancy exceeds the weight by.
    lift = 114.8 - 11.5 * 9.80665
    assert [one.effort for one in seen[-1]] == pytest.approx(
        [0.0] * 4 + [-lift / 4.0] * 4, abs=1e-10
    )  # N; measured 3e-14


def test_vehicle_is_held_on_its_side_against_its_buoyancy():
    """The law knows the torque of buoyancy, and no angle is left."""
    loop = Loop("bluerov2_heavy", **{"target.position": [0.0, 0.0, -10.0], "target.rpy": [0.6, -0.4, 0.2]})
    loop.run(60.0)
    target = rotation.from_roll_pitch_yaw(0.6, -0.4, 0.2)
    assert rotation.angle_between(target, loop.sim.state.orientation) < 1e-10  # rad; measured 1.8e-14
    assert np.linalg.norm(loop.sim.state.position - (0.0, 0.0, -10.0)) < 1e-10  # m; measured 2.3e-15


def test_no_commands_from_nonsense():
    loop = Loop("quadrotor")
    with pytest.raises(ValueError, match=r"position \[nan, 0.0, 0.0\].* is not finite"):
        loop.controller.commands(loop.sensed()._replace(position=(math.nan, 0.0, 0.0)))


def test_plants_without_actuators_or_with_several_types_are_refused():
    with pytest.raises(
        ValueError, match="the plant has no actuators; give one with actuators of one type: rotor, wheel"
    ):
        kind_of(load_scene(CONFIG / "satellite.yaml"))
    one = {"type": "thruster", "min": -1.0, "max": 1.0}
    mixed = {"names": ["a", "b"], "a": one, "b": {**one, "type": "wheel", "inertia": 1e-3}}
    with pytest.raises(ValueError, match="has actuators of the types thruster, wheel; give one"):
        kind_of(Scene({"actuators": mixed}))
