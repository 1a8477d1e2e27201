"""Acceleration: the numeric derivative of the velocities, with everything that can act, and closed forms."""

import numpy as np
import pytest

from rigid_body_sim import Actuator, Body, Simulation, State, Wrench
from rigid_body_sim.effects.drag import Drag
from rigid_body_sim.effects.tether import Tether
from rigid_body_sim.values.rotation import rotate

BODY = Body(2.0, (0.3, 0.5, 0.6, 0.02, -0.03, 0.04), (0.1, -0.2, 0.15))
MOVING = State((1.0, 2.0, 3.0), (0.4, 0.2, -0.8, 0.4), (-0.5, 0.2, 1.0), (1.1, -2.0, 0.7))
GRAVITY = (0.3, -0.2, -9.8)
EVERY = Wrench((1.0, -2.0, 3.0), (0.3, 0.2, -0.4), (2.0, 1.0, -1.0), (-0.2, 0.5, 0.1), [((0.3, 0.1, -0.2), (1, 2, 3))])
DRAG = Drag((0.3, 0.2, 0.1), (0.2, 0.1, 0.4), (0.03, 0.02, 0.01), (0.02, 0.03, 0.01))
ACTUATORS = (
    Actuator("rotor", "rotor", 0.0, 900.0, (0.2, -0.1, 0.0), (0.1, 0.0, 1.0), 0.05, 0.0, 2e-5, 3e-7, "cw", 2e-4),
    Actuator("jet", "thruster", -5.0, 5.0, (0.0, 0.3, 0.1), (1.0, 1.0, 0.0), initial=1.0, time_constant=0.2),
    Actuator("wheel", "wheel", -0.2, 0.2, axis=(1.0, 1.0, 0.0), inertia=1e-3, initial=200.0),
)
TETHER = Tether((0.2, 0.1, 0.0), (0.0, 0.0, 5.0), 1.0, 30.0, 2.0)
# Ninth central difference: exact for polynomials of degree 8.
WEIGHTS = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0.0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])


@pytest.mark.parametrize(
    ("wrench", "options", "error"),
    [
        (Wrench(), {}, 1e-11),  # measured 4.1e-13
        (EVERY, {}, 1e-11),  # measured 4e-13
        (EVERY, {"integrator": "rk4", "drag": DRAG, "tethers": (TETHER,)}, 2e-9),  # measured 1.8e-10, which is rk4's
        (EVERY, {"actuators": ACTUATORS}, 1e-11),  # measured 2.4e-13
        (EVERY, {"actuators": ACTUATORS, "drag": DRAG, "rtol": 1e-13}, 1e-11),  # measured 1.4e-13
    ],
    ids=["free", "held wrench", "drag and tether", "actuators", "actuators and drag"],
)
def test_acceleration_is_the_derivative_of_the_velocities(wrench, options, error):
    """Of a turned, spinning body whose centre of mass is off the origin of its frame."""
    rate = 1000.0
    sim = Simulation(BODY, MOVING, rate=rate, gravity=GRAVITY, **options)
    sim.set_wrench(wrench)
    sim.set_actuators([600.0, -3.0, 0.15][: len(sim.actuators)])
    velocities, acceleration = [], ()
    for k in range(9):
        state = sim.state
        velocities.append((*state.velocity, *state.angular_velocity))
        acceleration = sim.acceleration if k == 4 else acceleration
        sim.step()
    assert np.linalg.norm(acceleration) > 1.0
    np.testing.assert_allclose(acceleration, rate * WEIGHTS @ velocities, rtol=0, atol=error)


def test_acceleration_of_a_point_carried_round():
    """Closed form: an origin at −c from the centre of mass of a body that spins about z is drawn to it by ω² |c|."""
    sim = Simulation(Body(1.0, (1.0, 1.0, 1.0), (0.5, 0.0, 0.0)), State(angular_velocity=(0.0, 0.0, 4.0)))
    np.testing.assert_allclose(sim.acceleration, (8.0, 0.0, 0.0, 0.0, 0.0, 0.0), rtol=0, atol=1e-14)  # measured 0


@pytest.mark.no_numba
def test_free_fall_and_euler():
    """Gravity alone for a body that does not turn; Euler's equation (theory 2.5.6) for one that does."""
    still = Simulation(BODY, State(), gravity=GRAVITY)
    np.testing.assert_allclose(still.acceleration, (*GRAVITY, 0.0, 0.0, 0.0), rtol=0, atol=1e-14)  # measured 0
    turning = Simulation(Body(1.0, (1.0, 2.0, 3.0 - 1e-9)), State(angular_velocity=(1.0, 2.0, 3.0)))
    spin = turning.acceleration[3:]
    np.testing.assert_allclose(spin, (-6.0, 3.0, -2.0 / 3.0), rtol=0, atol=1e-8)  # measured 6e-9, from 1e-9 in I_z


def test_held_wrench_about_the_origin_has_the_same_effect():
    """At that moment: as a wrench in body axes it accelerates the body as the one that it sums up."""
    sim = Simulation(BODY, MOVING, gravity=GRAVITY)
    sim.set_wrench(EVERY)
    before = sim.acceleration
    numbers = EVERY.about_origin(sim.state.orientation, BODY.center_of_mass)
    sim.set_wrench(Wrench(numbers[:3], numbers[3:]))
    np.testing.assert_allclose(sim.acceleration, before, rtol=0, atol=1e-13)  # measured 3.6e-15
    assert np.linalg.norm(before - np.array(Simulation(BODY, MOVING, gravity=GRAVITY).acceleration)) > 1.0


@pytest.mark.no_numba
def test_force_about_the_origin_in_closed_form():
    """A world force acts at the centre of mass, a point force at its point: theory (2.3.4)."""
    q, force, point = MOVING.orientation, np.array((1.0, 2.0, 3.0)), np.array((0.3, 0.1, -0.2))
    for wrench, arm in ((Wrench(force_world=force), BODY.center_of_mass), (Wrench(points=[(point, force)]), point)):
        numbers = wrench.about_origin(q, BODY.center_of_mass)
        np.testing.assert_allclose(rotate(q, numbers[:3]), force, rtol=0, atol=1e-14)  # measured 1.8e-15
        np.testing.assert_allclose(numbers[3:], np.cross(arm, numbers[:3]), rtol=0, atol=1e-15)  # measured 0
