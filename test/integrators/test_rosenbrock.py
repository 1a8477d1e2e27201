"""RODAS where it is needed: stiff drag, and error control to rtol."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rigid_body_sim import Body, Drag, Simulation, SimulationError, State, Tether

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
