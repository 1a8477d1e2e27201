"""Which commands make a wrench: exact where the actuators can, a share of it where they cannot."""

import math
from pathlib import Path

import numpy as np
import pytest

from rigid_body_sim import Actuator, Body, Simulation, load_scene
from rigid_body_sim.tools.allocation import allocation

CONFIG = Path(__file__).parents[2] / "config"
BODY = Body(2.0, (0.1, 0.2, 0.25, 0.01, -0.02, 0.005), (0.02, -0.01, 0.03))
ALL = (True,) * 6
TORQUES = (False, False, False, True, True, True)


def thruster(name, position, axis, least=-10.0, most=10.0):
    return Actuator(name, "thruster", least, most, position, axis)


def of_scene(name, needed):
    terms = load_scene(CONFIG / f"{name}.yaml").terms()
    return terms, allocation(terms.given["actuators"], terms.body, needed)


def acceleration_by(body, actuators, commands):
    """Of a body at rest: of its origin [m/s², world] and of its turning [rad/s²], as the simulation has it."""
    sim = Simulation(body, rate=1000.0, actuators=actuators)
    sim.set_actuators(commands)
    return np.array(sim.acceleration)


def test_simulation_feels_the_wrench_that_was_asked_for():
    """Eight thrusters, in no order and with oblique axes, on a body with products of inertia and an offset centre."""
    rng = np.random.default_rng(3)
    thrusters = [thruster(f"t{i}", rng.normal(size=3), rng.normal(size=3)) for i in range(8)]
    wrench = np.array((0.3, -0.5, 0.4, 0.02, 0.05, -0.03))
    found = acceleration_by(BODY, thrusters, allocation(thrusters, BODY, ALL).commands(wrench))
    alpha = np.linalg.solve(BODY.inertia, wrench[3:])
    of_origin = wrench[:3] / BODY.mass - np.cross(alpha, BODY.center_of_mass)
    assert np.abs(found - (*of_origin, *alpha)).max() < 1e-14  # measured 2e-15


def test_rotors_give_thrust_and_three_torques():
    terms, rotors = of_scene("quadrotor", (False, False, True, True, True, True))
    wrench = np.array((0.0, 0.0, 8.0, 0.1, -0.2, 0.02))
    commands = rotors.commands(wrench)
    assert np.abs(rotors.effect @ commands**2 - wrench).max() < 1e-14  # measured 4e-15
    front, left, back, right = commands
    assert left > right and front > back  # rolls to the right, lifts the nose
    assert front**2 + back**2 > left**2 + right**2  # and the clockwise ones turn it to the left
    hover = rotors.commands((0.0, 0.0, terms.body.mass * 9.80665, 0.0, 0.0, 0.0))
    speed = math.sqrt(0.716 * 9.80665 / (4.0 * 8.54858e-06))
    assert hover == pytest.approx([speed] * 4, rel=1e-14)  # measured 3e-16


def test_wheels_push_the_body_the_other_way():
    """By the least commands: none of what the pyramid can do within itself."""
    terms, wheels = of_scene("satellite_wheels", TORQUES)
    torque = np.array((1e-3, -2e-3, 5e-4))
    commands = wheels.commands((0.0, 0.0, 0.0, *torque))
    found = acceleration_by(terms.body, wheels.actuators, commands)
    assert np.abs(found[3:] - np.linalg.solve(terms.body.inertia, torque)).max() < 1e-15  # rad/s²; measured 5e-18
    assert abs(commands @ (1.0, -1.0, 1.0, -1.0)) < 1e-17  # measured 9e-19


@pytest.mark.parametrize("name", ["satellite_wheels", "bluerov2_heavy"])
def test_beyond_a_limit_the_direction_stays(name):
    _, made = of_scene(name, TORQUES)
    wrench = np.array((0.0, 0.0, 0.0, 70.0, -30.0, 50.0))
    commands = made.commands(wrench)
    reached = made.effect @ commands
    assert all(one.min - 1e-12 <= c <= one.max + 1e-12 for one, c in zip(made.actuators, commands, strict=True))
    assert any(min(c - one.min, one.max - c) < 1e-12 for one, c in zip(made.actuators, commands, strict=True))
    assert np.abs(np.cross(reached[3:], wrench[3:])).max() < 1e-12 and reached @ wrench > 0.0  # measured 5e-13


def test_rotor_that_would_have_to_turn_back_stands_still():
    _, rotors = of_scene("quadrotor", (False, False, True, True, True, True))
    commands = rotors.commands((0.0, 0.0, 1.0, 0.0, 0.3, 0.0))  # N m: more than the thrust can give
    assert commands[0] == 0.0 and commands[2] > 0.0


@pytest.mark.parametrize(
    ("actuators", "needed", "said"),
    [
        (
            [thruster("a", (0, 1, 0), (1, 0, 0))],
            ALL,
            "the actuators a cannot give a force along x alone; give the plant some",
        ),
        (
            [Actuator("w", "wheel", -1.0, 1.0, axis=(1, 1, 0), inertia=1e-3)],
            TORQUES,
            "the actuators w cannot give a torque about x alone",
        ),
        ([thruster("jet", (0, 0, 0), (1, 0, 0), least=0.0)], ALL, "'jet': pushes one way only, from 0 to 10; give min"),
    ],
)
def test_what_cannot_be_done_is_told(actuators, needed, said):
    with pytest.raises(ValueError, match=said):
        allocation(actuators, BODY, needed)
