"""DOP853: its coefficients, closed forms with drag and a tether, error control, refusal where it is too stiff."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate._ivp import dop853_coefficients as published

from rigid_body_sim import Body, Drag, Simulation, SimulationError, State, Tether, Wrench
from rigid_body_sim.integrators import dop853
from rigid_body_sim.kernels import stiffness
from rigid_body_sim.terms import Terms
from rigid_body_sim.values import rotation
from rigid_body_sim.values.state import flatten

BALL = Body(2.0, (0.1, 0.1, 0.1))
G = 9.80665


def tableau():
    A = np.zeros((dop853.STAGES, dop853.STAGES))
    for stage, row in enumerate(dop853.A, start=1):
        A[stage, : len(row)] = row
    return A, np.array(dop853.B)


def test_coefficients_are_those_published():
    A, B = tableau()
    n = dop853.STAGES
    assert_array_equal(A, published.A[:n, :n])
    assert_array_equal(B, published.B)
    assert_array_equal(dop853.ERROR_3, published.E3[:n])
    assert_array_equal(dop853.ERROR_5, published.E5[:n])
    assert_allclose(A.sum(axis=1), published.C[:n], rtol=0, atol=1e-14)  # measured 3.6e-15


@pytest.mark.parametrize("k", range(1, 9))
def test_quadrature_and_chain_conditions_hold_up_to_order_eight(k):
    """Σ b c^(k−1) = 1/k, and b Aᵏ⁻¹ 1 = 1/k!, the conditions of the bushy and of the tall tree with k nodes."""
    A, B = tableau()
    c = A.sum(axis=1)
    assert B @ c ** (k - 1) == pytest.approx(1.0 / k, rel=0, abs=1e-14)
    assert B @ np.linalg.matrix_power(A, k - 1) @ np.ones(12) == pytest.approx(
        1.0 / math.factorial(k), rel=0, abs=1e-14
    )  # measured 1.4e-15


def test_ninth_order_does_not_hold():
    A, B = tableau()
    assert abs(B @ A.sum(axis=1) ** 8 - 1.0 / 9.0) > 1e-7


def run(seconds, state, rate=20.0, rtol=1e-10, **what):
    sim = Simulation(BALL, state, rate=rate, integrator="dop853", rtol=rtol, **what)
    sim.step(round(seconds * rate))
    return sim.state


def test_linear_drag_and_gravity():
    """v = −g τ + (v₀ + g τ) e^(−t/τ) with τ = m / c."""
    end = run(1.5, State(velocity=(0, 0, 5.0)), gravity=(0, 0, -G), drag=Drag(linear=(1.0, 2.0, 3.0)))
    tau = 2.0 / 3.0
    decay = math.exp(-1.5 / tau)
    assert end.velocity[2] == pytest.approx(-G * tau + (5.0 + G * tau) * decay, abs=1e-11)
    assert end.position[2] == pytest.approx(-G * tau * 1.5 + (5.0 + G * tau) * tau * (1 - decay), abs=1e-11)


def test_fall_with_quadratic_drag_and_its_terminal_velocity():
    """v = −v_t tanh(g t / v_t), z = −v_t² / g ln cosh(g t / v_t), with v_t = √(m g / c)."""
    terminal = math.sqrt(2.0 * G / 0.8)
    end = run(0.7, State(), gravity=(0, 0, -G), drag=Drag(quadratic=(0.8, 0.8, 0.8)))
    assert end.velocity[2] == pytest.approx(-terminal * math.tanh(G * 0.7 / terminal), rel=1e-10)
    assert end.position[2] == pytest.approx(-(terminal**2) / G * math.log(math.cosh(G * 0.7 / terminal)), rel=1e-10)
    later = run(30.0, State(), gravity=(0, 0, -G), drag=Drag(quadratic=(0.8, 0.8, 0.8)))
    assert later.velocity[2] == pytest.approx(-terminal, rel=1e-10)


def turned_round(terminal, start, seconds):
    """Velocity and distance under v' = −g − g |v| v / v_t²: up to v = 0, and the fall as above.

    Up, v = v_t tan(φ − g t / v_t) with φ = atan(v₀ / v_t), to z = −v_t² / g ln cos φ.
    """
    phi = math.atan(start / terminal)
    fall = seconds - terminal / G * phi
    distance = -(terminal**2) / G * math.log(math.cos(phi) * math.cosh(G * fall / terminal))
    return -terminal * math.tanh(G * fall / terminal), distance


@pytest.mark.no_numba
@pytest.mark.parametrize("across", [0.0, 0.8])
@pytest.mark.parametrize("rtol", [1e-6, 1e-9, 1e-12])
def test_throw_with_quadratic_drag_passes_the_kink_at_its_apex(rtol, across):
    """−c |v| v is not smooth there.

    Measured 4e-10, 2e-14 and 3e-15; 4e-10, 1e-12 and 6e-14 when errors there are weighed as those of a smooth motion.
    """
    what = {"drag": Drag(quadratic=(across, across, 0.8)), "gravity": (0, 0, -G)}
    sim = Simulation(BALL, State(velocity=(0, 0, 5.0)), rate=0.5, integrator="dop853", rtol=rtol, **what)
    sim.step()
    velocity, height = turned_round(math.sqrt(2.0 * G / 0.8), 5.0, 2.0)
    assert sim.state.velocity[2] == pytest.approx(velocity, rel=0.01 * rtol, abs=0)
    assert sim.state.position[2] == pytest.approx(height, rel=0.01 * rtol, abs=0)


@pytest.mark.no_numba
@pytest.mark.parametrize("across", [0.0, 0.04])
@pytest.mark.parametrize("rtol", [1e-6, 1e-9, 1e-12])
def test_torque_turns_a_spin_round_that_quadratic_drag_slows(rtol, across):
    """The same kink, where the body stands still for a moment: τ = −I g, and c = 0.4 I."""
    drag = Drag(angular_quadratic=(across, across, 0.04))
    sim = Simulation(BALL, State(angular_velocity=(0, 0, 5.0)), rate=0.5, integrator="dop853", rtol=rtol, drag=drag)
    sim.set_wrench(Wrench(torque_world=(0, 0, -0.1 * G)))
    sim.step()
    rate, angle = turned_round(math.sqrt(G / 0.4), 5.0, 2.0)
    assert sim.state.angular_velocity[2] == pytest.approx(rate, rel=0.01 * rtol, abs=0)
    true = (math.cos(angle / 2), 0.0, 0.0, math.sin(angle / 2))
    # Measured 1.1e-10, 9e-14 and 1.9e-13, and 2e-11, 1e-13 and 1e-15 for the rate.
    assert rotation.angle_between(sim.state.orientation, true) < 0.01 * rtol + 1e-12


@pytest.mark.parametrize("seconds", [0.5, 10.0])
def test_mass_on_a_spring_swings_as_a_cosine(seconds):
    spring = Tether(stiffness=2.0 * 30.0**2, slack=False)  # 30 rad/s: 1.5 rad in a step
    end = run(seconds, State(position=(0.0, 0.0, -1.0)), tethers=[spring])
    assert end.position[2] == pytest.approx(-math.cos(30.0 * seconds), abs=1e-9)  # measured 1.6e-10
    assert end.velocity[2] == pytest.approx(30.0 * math.sin(30.0 * seconds), abs=3e-9)  # 5.2e-10


def test_tighter_tolerance_gives_a_smaller_error():
    errors = []
    for rtol in (1e-4, 1e-7, 1e-10):
        end = run(10.0, State(position=(0, 0, -1.0)), rtol=rtol, tethers=[Tether(stiffness=1800.0, slack=False)])
        errors.append(abs(end.position[2] + math.cos(300.0)))
    assert errors[0] > 10 * errors[1] > 100 * errors[2]
    assert errors[0] < 2e-3 and errors[1] < 3e-6 and errors[2] < 1e-9  # measured 4.5e-4, 6.0e-7, 1.6e-10


def test_step_that_is_too_stiff_is_refused_with_the_state_kept():
    drag = Drag(linear=(2e10, 2e10, 2e10))  # λ h = 1e8
    sim = Simulation(BALL, State(velocity=(1.0, 2.0, 3.0)), rate=100.0, integrator="dop853", drag=drag)
    before = sim.save()
    with pytest.raises(SimulationError, match="cannot be done"):
        sim.step()
    assert sim.save() == before


def caught(integrator):
    """A ball caught after a fall of 0.1 m: the damper's force begins with a jump."""
    tether = Tether((0, 0, 0.2), (0, 0, 0), 1.0, 2.0 * 200.0**2, 240.0, slack=True)
    sim = Simulation(
        BALL, State((0, 0, -1.1)), rate=50.0, gravity=(0, 0, -G), integrator=integrator, rtol=1e-9, tethers=[tether]
    )
    sim.step(10)
    return sim.state.values


def test_tether_that_begins_to_pull_with_a_jump_is_passed():
    assert_allclose(caught("dop853"), caught("rosenbrock"), rtol=0, atol=3e-7)  # measured 8.6e-8


# Spectral radius --------------------------------------------------------------------------------------------------


def radius(state, body=BALL, drag=None, tethers=()):
    terms = Terms(body, (0, 0, -G), drag=drag or Drag(), tethers=tethers)
    model = terms.model(Wrench())
    return stiffness.spectral_radius(terms.kernels, flatten(state, model), model)


def test_spectral_radius_of_drag_is_its_damping_rate():
    assert radius(State(), drag=Drag(linear=(1.0, 3.0, 8.0))) == pytest.approx(4.0, rel=1e-9)
    assert radius(State(), drag=Drag(angular_linear=(0.1, 0.3, 0.8))) == pytest.approx(8.0, rel=1e-9)
    moving = State(velocity=(0.0, 0.0, -5.0))
    assert radius(moving, drag=Drag(quadratic=(0, 0, 3.0))) == pytest.approx(2 * 3.0 * 5.0 / 2.0, rel=1e-9)


@pytest.mark.parametrize("height", [-1.5, -0.5])  # taut, and slack
def test_spectral_radius_of_a_tether_is_its_frequency_slack_or_not(height):
    tether = Tether(rest_length=1.0, stiffness=2.0 * 50.0**2)
    found = radius(State(position=(0, 0, height)), tethers=[tether])
    assert found == pytest.approx(50.0, rel=1e-6)


def test_spectral_radius_of_a_body_without_resistance_is_its_spin():
    assert radius(State(angular_velocity=(0, 0, 7.0))) <= 7.0 + 1e-9
    assert radius(State()) < 1e-6
