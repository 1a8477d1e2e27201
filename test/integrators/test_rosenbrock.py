"""RODAS where it is needed: stiff drag, and error control to rtol."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from rigid_body_sim import Body, Drag, Simulation, SimulationError, State, Tether, Wrench
from rigid_body_sim.values import rotation

BALL = Body(2.0, (0.1, 0.1, 0.1))
G = (0.0, 0.0, -9.80665)


def falling(integrator, damping, rate=100.0):
    """A ball thrown into a thick fluid, with the damping rate λ = damping / m [1/s]."""
    state = State(velocity=(3.0, 0.0, 5.0), angular_velocity=(10.0, 0.0, 0.0))
    drag = Drag(linear=(damping,) * 3, angular_linear=(damping,) * 3)
    return Simulation(BALL, state, rate=rate, gravity=G, integrator=integrator, drag=drag)


@pytest.mark.parametrize("damping", [1e2, 1e5, 1e8, 2e10])  # λ h from 0.5 to 1e8
def test_stiff_drag_goes_to_terminal_velocity_and_stays_bounded(damping):
    sim = falling("rosenbrock", damping)
    for _ in range(20):
        sim.step()
        assert np.abs(sim.state.velocity).max() <= 5.0 + 1e-9
    sim.step(80)
    terminal = 2.0 * G[2] / damping
    assert sim.state.velocity[2] == pytest.approx(terminal, rel=1e-9)  # measured 1e-15
    assert np.abs(sim.state.velocity[:2]).max() < 1e-9 * abs(terminal) + 1e-15
    assert np.abs(sim.state.angular_velocity).max() < 1e-12


def test_explicit_method_blows_up_there():
    sim = falling("rk4", 1e5)
    with pytest.raises(SimulationError, match="cannot be done"):
        sim.step(1000)


def damped_tumble(integrator, rate, rtol=1e-9):
    body = Body(2.0, (0.3, 0.4, 0.5, 0.02, -0.03, 0.04), (0.05, -0.02, 0.03))
    sim = Simulation(
        body, State((0.3, 0.2, 0.1), (1, 2, 3, 4), (1, 2, -1), (1, -2, 0.5)),
        rate=rate, gravity=G, integrator=integrator,
        drag=Drag((1, 2, 3), (4, 5, 6), (0.1, 0.2, 0.3), (0.4, 0.5, 0.6)),
        tethers=[Tether((0.1, 0.2, 0.3), (1, 1, 2), 0.5, 30.0, 2.0)], rtol=rtol,
    )  # fmt: skip
    sim.step(round(2 * rate))
    return sim.state.values


def test_error_follows_the_tolerance():
    exact = damped_tumble("rk4", 20_000.0)
    errors = [np.abs(damped_tumble("rosenbrock", 10.0, rtol) - exact).max() for rtol in (1e-5, 1e-7, 1e-9)]
    assert errors[0] < 1e-4 and errors[1] < 1e-6 and errors[2] < 1e-8  # measured 4.1e-6, 4e-8, 4e-10
    assert errors[0] > errors[1] > errors[2]


def test_stiff_spin_down_agrees_with_radau():
    """ω' = −(a + b |ω|) ω / I with a / I = 1e4 1/s, from an independent implicit solver."""
    drag = Drag(angular_linear=(1e3, 0, 0), angular_quadratic=(50.0, 0, 0))
    sim = Simulation(
        BALL, State(angular_velocity=(10.0, 0, 0)), rate=1e4, integrator="rosenbrock", drag=drag, rtol=1e-10
    )
    sim.step(5)
    reference = solve_ivp(
        lambda _, w: -(1e3 + 50.0 * np.abs(w)) * w / 0.1, (0.0, 5e-4), [10.0], method="Radau", rtol=1e-12, atol=1e-14
    )
    assert sim.state.angular_velocity[0] == pytest.approx(reference.y[0, -1], rel=1e-8)


# Extreme stiffness ------------------------------------------------------------------------------------------------

RATE = 100.0
STIFFNESS = [1.0, 1e2, 1e4, 1e6, 1e8]  # λ h


@pytest.mark.parametrize("stiffness", STIFFNESS)
@pytest.mark.parametrize("rtol", [1e-6, 1e-9])
def test_linear_drag_follows_its_closed_form(stiffness, rtol):
    """v = v_end + (v₀ − v_end) e^(−λt) and ω = ω_end + (ω₀ − ω_end) e^(−λt), weighed as the integrator weighs them."""
    rate = stiffness * RATE
    drag = Drag(linear=(2.0 * rate,) * 3, angular_linear=(0.1 * rate,) * 3)
    state = State(velocity=(1.0, 0, 0), angular_velocity=(0, 0, 2.0))
    sim = Simulation(BALL, state, rate=RATE, integrator="rosenbrock", drag=drag, rtol=rtol)
    sim.set_wrench(Wrench(force_world=(rate, 0, 0), torque_world=(0, 0, 0.05 * rate)))
    for steps in (1, 2, 7):
        sim.step(steps)
        decay = math.exp(-min(rate * sim.time, 700.0))
        # measured: at most 0.07 rtol
        assert sim.state.velocity[0] == pytest.approx(0.5 + 0.5 * decay, rel=0, abs=2 * rtol)
        assert sim.state.angular_velocity[2] == pytest.approx(0.5 + 1.5 * decay, rel=0, abs=4 * rtol)


@pytest.mark.parametrize("stiffness", STIFFNESS)
@pytest.mark.parametrize("rtol", [1e-6, 1e-9])
def test_quadratic_drag_follows_its_closed_form(stiffness, rtol):
    """v = v₀ / (1 + λ t) with λ = c v₀ / m: the damping rate falls as the body slows."""
    rate = stiffness * RATE
    drag = Drag(quadratic=(2.0 * rate, 0, 0), angular_quadratic=(0.05 * rate, 0, 0))
    state = State(velocity=(1.0, 0, 0), angular_velocity=(2.0, 0, 0))
    sim = Simulation(BALL, state, rate=RATE, integrator="rosenbrock", drag=drag, rtol=rtol)
    for _ in range(5):  # measured: at most 0.002 rtol
        sim.step()
        slowed = 1.0 / (1.0 + rate * sim.time)
        assert sim.state.velocity[0] == pytest.approx(slowed, rel=0, abs=2 * rtol)
        assert sim.state.angular_velocity[0] == pytest.approx(2.0 * slowed, rel=0, abs=4 * rtol)


def hanging(frequency, ratio, rtol=1e-6, integrator="rosenbrock"):
    """A ball that moves down at 1 m/s on a tether of ``frequency`` rad a step and that damping ratio, and ω."""
    w = frequency * RATE
    tether = Tether((0, 0, 0.2), (0, 0, 0), 1.0, 2.0 * w * w, 4.0 * ratio * w, slack=False)
    state = State((0, 0, -1.2), velocity=(0, 0, -1.0))
    return Simulation(BALL, state, rate=RATE, gravity=G, integrator=integrator, rtol=rtol, tethers=[tether]), w


def bobbing(w, ratio, t):
    """Height over the equilibrium [m] and velocity [m/s] of ``hanging`` after t [s], for a ratio below 1."""
    x, v, turn = -G[2] / w**2, -1.0, w * math.sqrt(1.0 - ratio**2)
    decay, c, s = math.exp(-ratio * w * t), math.cos(turn * t), math.sin(turn * t)
    height = x * c + (v + ratio * w * x) / turn * s
    return decay * height, decay * (v * c - (x * w * w + ratio * w * v) / turn * s)


@pytest.mark.parametrize("ratio", [0.02, 0.5])
@pytest.mark.parametrize("frequency", [1.0, 1e2, 1e4])
def test_damped_tether_follows_its_closed_form_and_comes_to_rest(frequency, ratio):
    sim, w = hanging(frequency, ratio)
    rest = -1.2 + G[2] / w**2
    for _ in range(3):
        sim.step()
        height, velocity = bobbing(w, ratio, sim.time)
        assert sim.state.position[2] - rest == pytest.approx(height, rel=0, abs=1e-6)  # measured 9e-10
        assert sim.state.velocity[2] == pytest.approx(velocity, rel=0, abs=4e-6)  # measured 1.9e-6 at 1e4
    if frequency * ratio > 1.0:
        sim.step(30)
        assert sim.state.position[2] == pytest.approx(rest, rel=0, abs=1e-12)
        assert abs(sim.state.velocity[2]) < 1e-9


@pytest.mark.parametrize("frequency", [1.0, 1e2, 1e4])
def test_undamped_tether_keeps_ringing(frequency):
    """An L-stable method must not take the vibration away unseen; 1e4 rad a step take half a million sub-steps."""
    sim, w = hanging(frequency, 0.0)
    sim.step()
    height, velocity = bobbing(w, 0.0, sim.time)
    assert sim.state.position[2] - (-1.2 + G[2] / w**2) == pytest.approx(height, rel=0, abs=1e-6)
    assert sim.state.velocity[2] == pytest.approx(velocity, rel=0, abs=1e-6)  # measured 8e-9, 5e-9, 3.3e-7


@pytest.mark.parametrize(("damping", "frequency"), [(1e2, None), (1e6, None), (None, 1e2), (None, 1e4)])
def test_explicit_method_of_fixed_step_explodes_on_each_of_them(damping, frequency):
    sim = falling("rk4", 2.0 * RATE * damping) if damping else hanging(frequency, 0.5, integrator="rk4")[0]
    with pytest.raises(SimulationError, match="cannot be done"):
        sim.step(1000)


def test_stiff_tether_far_from_the_origin_comes_to_rest():
    """There the force of the tether is mostly round-off of the position, which no sub-step makes smaller."""
    w = 1e4 * RATE
    tether = Tether((0, 0, 0.2), (1e3, -2e3, 5e2), 1.0, 2.0 * w * w, 2.0 * w, slack=False)
    state = State((1e3, -2e3, 498.8), velocity=(0, 0, -1.0))
    sim = Simulation(BALL, state, rate=RATE, gravity=G, integrator="rosenbrock", rtol=1e-6, tethers=[tether])
    sim.step(20)
    assert sim.state.position[2] == pytest.approx(498.8, rel=0, abs=1e-9)
    assert abs(sim.state.velocity[2]) < 1e-6


@pytest.mark.no_numba
def test_ringing_tether_is_followed_alike_whichever_way_the_world_is_turned():
    """How fast it rings beside the centre of mass decides the first sub-step, and so all that follow.

    Turned so that x becomes y, y becomes z and z becomes x: errors are weighed component by component.
    """
    turn, ends = (0.5, 0.5, 0.5, 0.5), []
    orientation, point = rotation.normalize((0.4, 0.2, -0.8, 0.4)), (0.3, -0.2, 0.1)
    position = np.array((0.6, 0.0, -0.8)) - rotation.rotate(orientation, point)  # the tether is just taut
    tether = Tether(point, rest_length=1.0, stiffness=2.0 * (20.0 * RATE) ** 2, slack=False)
    for q in ((1.0, 0.0, 0.0, 0.0), turn):
        placed = rotation.rotate(q, position), rotation.multiply(q, orientation), rotation.rotate(q, (0.3, 0.1, -1.0))
        body, state = Body(2.0, (0.1, 0.2, 0.25)), State(*placed, (0.5, -0.3, 0.2))
        sim = Simulation(body, state, rate=RATE, integrator="rosenbrock", rtol=1e-4, tethers=[tether])
        sim.step()
        ends.append((*rotation.rotate_back(q, sim.state.velocity), *sim.state.angular_velocity))
    assert_allclose(ends[1], ends[0], rtol=0, atol=1e-11)  # measured 3.2e-13
