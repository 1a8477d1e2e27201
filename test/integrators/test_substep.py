"""What error-controlled integrators share: an error counts by what it leads to, however stiff the scene is."""

import math

import mpmath
import numpy as np
import pytest
from mpmath import mpf
from numpy.testing import assert_allclose

from rigid_body_sim import Body, Simulation, State, Tether
from rigid_body_sim.integrators import substep

FREQUENCY, SPAN, STEPS = 10**4.5, 0.1, 1000  # rad/s, s: 3.2 rad a step, 3162 rad in all


@pytest.mark.parametrize(("integrator", "tolerance"), [("dop853", 1e-6), ("rosenbrock", 3e-7)])
def test_fast_vibration_is_followed(integrator, tolerance):
    """A mass on a spring: its amplitude is 30 µm, a ten-thousandth of the radius of gyration.

    An error of 1e-9 radii of gyration in each step is nothing to the position, but a hundred thousandth of the motion.
    Measured: velocity off by 1.9e-7 and 3.8e-8 of its amplitude; by 1.3e-3 for dop853 with lengths weighed against the
    radius of gyration alone.
    """
    body, spring = Body(2.0, (0.1, 0.2, 0.25)), Tether(rest_length=1.0, stiffness=2.0 * FREQUENCY**2, slack=False)
    start = State(position=(1.0, 0.0, 0.0), velocity=(1.0, 0.0, 0.0))
    sim = Simulation(body, start, rate=STEPS / SPAN, tethers=[spring], integrator=integrator)
    sim.step(STEPS)
    true = math.cos(FREQUENCY * SPAN), math.sin(FREQUENCY * SPAN) / FREQUENCY
    assert sim.state.velocity[0] == pytest.approx(true[0], abs=tolerance)  # m/s, of an amplitude of 1
    assert sim.state.position[0] - 1.0 == pytest.approx(true[1], abs=tolerance / FREQUENCY)
    assert np.abs(sim.state.values[[1, 2, 8, 9, 10, 11, 12]]).max() == 0.0


@pytest.mark.no_numba
@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-3, 0.0099, 0.0101, 0.3, 1.0, 3.0])
def test_rate_of_the_rotation_vector_is_its_closed_form(angle):
    """ω − ½ θ × ω + (1 − ½ t cot ½t) / t² θ × (θ × ω) with t = |θ|, in 40 digits; by a series below 0.01 rad."""
    theta, w = angle * np.array((2.0, -1.0, 2.0)) / 3.0, np.array((0.7, -1.1, 0.4))
    with mpmath.workdps(40):
        t = mpmath.norm([mpf(float(x)) for x in theta])
        factor = float((1 - t / 2 * mpmath.cot(t / 2)) / t**2) if angle else 1.0 / 12.0
    once = np.cross(theta, w)
    expected = w - 0.5 * once + factor * np.cross(theta, once)
    found = substep.inverse_dexp(*theta.tolist(), *w.tolist())
    assert_allclose(found, expected, rtol=0, atol=1e-15)  # measured 5.6e-17


@pytest.mark.no_numba
@pytest.mark.parametrize(("tried", "hopeless"), [(100, False), (101, True), (1000, True)])
def test_step_is_hopeless_when_its_pace_asks_for_more_substeps_than_there_may_be(tried, hopeless):
    """A tenth of the most, 1000, tell the pace; here a sub-step is 0.99 or 1.01 thousandths of the step."""
    assert substep.is_hopeless(0.99e-3 * tried, 1.0, tried, 1000) is hopeless
    assert not substep.is_hopeless(1.01e-3 * tried, 1.0, tried, 1000)
