"""The pointing law: which way it turns, how it is limited, and that it gets there."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from rigid_body_sim import Simulation, Wrench, load_scene
from rigid_body_sim.tools.control import pointing_law, shortened
from rigid_body_sim.values import rotation

INERTIA = (0.144, 0.185, 0.061, 0.01, -0.02, 0.005)
MATRIX = np.array(((0.144, 0.01, -0.02), (0.01, 0.185, 0.005), (-0.02, 0.005, 0.061)))
SATELLITE = Path(__file__).parents[2] / "config/satellite.yaml"


def law(target=(1.0, 0.0, 0.0, 0.0), inertia=INERTIA, natural_frequency=1.5, damping_ratio=0.9, max_torque=1e9):
    return pointing_law(target, inertia, natural_frequency, damping_ratio, max_torque)


def test_small_error_makes_an_oscillator():
    """τ = −I (ω_n² θ + 2 ζ ω_n ω) for a small rotation vector θ, whatever the target."""
    theta, omega = np.array((2e-6, -1e-6, 3e-6)), np.array((1e-6, 4e-6, -2e-6))
    target = rotation.normalize((0.3, -0.5, 0.7, 0.2))
    q = rotation.multiply(target, rotation.from_axis_angle(theta, float(np.linalg.norm(theta))))
    expected = -MATRIX @ (1.5**2 * theta + 2 * 0.9 * 1.5 * omega)
    torque = law(target).torque(q, omega)
    assert np.linalg.norm(torque - expected) < 1e-9 * np.linalg.norm(expected)  # measured 6e-12


@pytest.mark.parametrize("degrees", (10.0, 170.0, 179.0, 181.0, 190.0, 350.0))
def test_takes_the_short_way(degrees):
    """A quaternion of 190° about z is 170° the other way round: the torque follows the way below half a turn."""
    q = rotation.from_axis_angle((0.0, 0.0, 1.0), math.radians(degrees))
    torque = law(inertia=(1.0, 1.0, 1.0)).torque(q, (0.0, 0.0, 0.0))
    assert torque[2] * (180.0 - degrees) < 0.0
    assert np.array_equal(torque, law(inertia=(1.0, 1.0, 1.0)).torque(-q, (0.0, 0.0, 0.0)))


def test_exactly_half_a_turn_away_still_turns():
    assert np.linalg.norm(law().torque((0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0))) > 0.1


def test_limit_keeps_the_direction():
    q, omega = (0.5, 0.5, 0.5, 0.5), (0.3, -0.2, 0.1)
    free, limited = law().torque(q, omega), law(max_torque=0.05).torque(q, omega)
    assert np.linalg.norm(free) > 0.05
    assert np.linalg.norm(limited) == pytest.approx(0.05, rel=1e-15)
    assert np.allclose(np.cross(free, limited), 0.0, atol=1e-16)
    assert free @ limited > 0.0


def test_from_far_away_it_turns_with_the_greatest_rate():
    """No torque where the rate is that already, whichever the way; near the target the limit is none."""
    limited = dataclasses.replace(law(), max_rate=0.2)
    axis = np.array((2.0, -1.0, 2.0)) / 3.0
    far, near = (rotation.from_axis_angle(axis, angle) for angle in (2.0, 0.01))
    assert np.linalg.norm(limited.torque(far, -0.2 * axis)) < 1e-16  # N m; measured 0
    assert np.linalg.norm(limited.torque(far, -0.1 * axis)) > 0.01
    assert np.array_equal(limited.torque(near, 0.1 * axis), law().torque(near, 0.1 * axis))


def test_natural_frequency_may_differ_from_axis_to_axis():
    """Each axis of a body without products of inertia is the oscillator that it is told to be."""
    frequency = np.array((1.0, 2.0, 4.0))
    own = dataclasses.replace(law(inertia=(1.0, 1.0, 1.0)), natural_frequency=frequency)
    theta = np.array((2e-6, -1e-6, 3e-6))
    q = rotation.from_axis_angle(theta, float(np.linalg.norm(theta)))
    assert own.torque(q, np.zeros(3)) == pytest.approx(-(frequency**2) * theta, rel=1e-9)  # measured 4e-12


def test_short_torque_is_left_alone():
    vector = np.array((0.01, 0.02, -0.03))
    assert shortened(vector, 0.05) is vector


@pytest.mark.parametrize(
    ("change", "reason"),
    (
        ({"target": (0.0, 0.0, 0.0, 0.0)}, "norm"),
        ({"natural_frequency": 0.0}, "natural_frequency"),
        ({"damping_ratio": math.nan}, "damping_ratio"),
        ({"max_torque": -1.0}, "max_torque"),
        ({"inertia": (1.0, 1.0, 3.0)}, "inertia|moment"),
        ({"inertia": (1.0, 1.0)}, "shape"),
    ),
)
def test_useless_settings_are_refused(change, reason):
    with pytest.raises(ValueError, match=reason):
        law(**change)


@pytest.mark.parametrize(
    "q, omega", (((math.nan, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0)), ((1.0, 0.0, 0.0, 0.0), (math.inf, 0.0, 0.0)))
)
def test_no_torque_from_nonsense(q, omega):
    with pytest.raises(ValueError, match=r"norm|not finite"):
        law().torque(q, omega)


@pytest.mark.parametrize("delay", (0, 3), ids=("at once", "3 steps late"))
def test_closed_loop_arrives(delay):
    """The demo offline: 100 commands a second for 20 s, from 120° away, tumbling."""
    scene = load_scene(SATELLITE)
    simulation = Simulation.from_scene(scene)
    controller = law(inertia=scene["body.inertia"], damping_ratio=1.0, max_torque=0.05)
    for _ in range(2000):
        state = simulation.state
        torque = controller.torque(state.orientation, state.angular_velocity)
        simulation.step(delay)
        simulation.set_wrench(Wrench(torque_body=torque))
        simulation.step(10 - delay)
    error = rotation.angle_between((1.0, 0.0, 0.0, 0.0), simulation.state.orientation)
    assert error < 1e-8  # rad; measured 2.5e-10 at once, 3.1e-10 three steps late
    assert np.linalg.norm(simulation.state.angular_velocity) < 1e-8  # rad/s; measured 3.4e-10 and 4.2e-10
