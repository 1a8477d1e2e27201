"""The truths of the maps are true: closed forms and fine runs agree with other methods at the least tolerance."""

import math

import numpy as np
import pytest

from bench.reference import make_added_mass, make_turning
from rigid_body_sim import Simulation, State
from rigid_body_sim.report.stability import (
    actuator,
    added_mass,
    controller,
    damping,
    free,
    ground,
    long_run,
    step_size,
    tether,
    turning,
)
from rigid_body_sim.report.stability.outcome import largest_error
from rigid_body_sim.values import rotation


def error_of(case, integrator):
    """Error of a case's run with the least tolerance."""
    simulation = case.simulation(integrator)
    simulation.change(rtol=1e-13)
    return largest_error(case.follow(simulation), case.truth, case.scale)


@pytest.mark.parametrize("integrator", ["dop853", "rosenbrock"])
@pytest.mark.parametrize("rate", [10.0, 1000.0])
def test_closed_form_of_a_damped_spin(integrator, rate):
    assert error_of(damping.case(rate, 0.01), integrator) < 3e-14  # measured at most 2.6e-15


@pytest.mark.parametrize("integrator", ["taylor", "dop853", "rosenbrock"])
@pytest.mark.parametrize("lag", [1e-4, 0.02])
def test_closed_form_of_lagging_thrusters(integrator, lag):
    assert error_of(actuator.case(lag, 0.01), integrator) < 1e-12  # measured at most 2.3e-16, 4.2e-14 and 2.3e-14


@pytest.mark.parametrize("integrator", ["dop853", "rosenbrock"])
@pytest.mark.parametrize("ratio", [0.0, 0.5])
def test_closed_form_of_a_tether(integrator, ratio):
    assert error_of(tether.case(100.0, 0.001, ratio), integrator) < 3e-13  # measured at most 4.1e-14


@pytest.mark.parametrize("integrator", ["dop853", "rosenbrock"])
@pytest.mark.parametrize("frequency", [10.0, 100.0])
def test_closed_form_of_a_bounce(integrator, frequency):
    """Still in the ground at the end, and out of it."""
    assert error_of(ground.bouncing(frequency, 0.001), integrator) < 2e-13  # measured at most 2.0e-14


@pytest.mark.parametrize("integrator", ["dop853", "rosenbrock"])
@pytest.mark.parametrize("slip_speed", [0.5, 0.1])
def test_closed_form_of_a_slide(integrator, slip_speed):
    """Also where it creeps from half of its speed on, and for most of the way."""
    assert error_of(ground.sliding(slip_speed, 0.001), integrator) < 2e-12  # measured at most 1.6e-13


def test_closed_form_of_free_rotation_needs_no_short_step():
    """Turned by ω t in one second, it is what a simulation over t gives."""
    orientation, w_body = free.turned(damping.BODY, (3.0, -20.0, 5.0), 0.1)
    simulation = Simulation(damping.BODY, State(angular_velocity=(3.0, -20.0, 5.0)), rate=1000.0, integrator="taylor")
    simulation.step(100)
    assert rotation.angle_between(orientation, simulation.state.orientation) < 1e-14  # rad; measured 4.2e-16
    assert w_body == pytest.approx(simulation.state.angular_velocity, rel=1e-13)


@pytest.mark.parametrize("integrator", ["dop853", "rosenbrock"])
@pytest.mark.parametrize("ratio", ["1e-4", "1e2", "1e6"])
def test_solutions_with_added_mass(integrator, ratio):
    assert error_of(added_mass.case(ratio, 0.1), integrator) < 3e-13  # measured at most 3.5e-14


def test_solutions_with_added_mass_are_those_that_the_script_makes():
    scene, *ratios = added_mass.solutions()
    assert added_mass.solutions()[scene] == make_added_mass.BODY
    for ratio in ratios:
        assert added_mass.solutions()[ratio]["added_mass"] == make_added_mass.added_mass(ratio)
    assert tuple(ratios) == make_added_mass.RATIOS


@pytest.mark.parametrize("gain", [0.1, 0.95])
def test_loop_of_the_controller_is_known_to_round_off(gain):
    case = controller.case(gain, controller.PERIOD)
    assert error_of(case, "taylor") < 3e-14  # measured at most 3.0e-15


def test_loop_is_stable_up_to_its_limit_and_not_beyond():
    """2 ζ ω_n T < 2: the rates die away below it, and grow until the loop is a tumble above it."""
    for gain, settles in ((0.95, True), (1.01, False)):
        rates = np.linalg.norm(controller.truth(gain)[-10:, 10:13], axis=1)
        assert bool(rates.max() < 1e-2) is settles  # rad/s; measured 2.3e-5 and 560


def test_solutions_are_those_that_the_script_makes():
    cases, found = make_turning.cases(), turning.solutions()
    assert {name: list(rows) for name, rows in cases.items()} == {name: list(rows) for name, rows in found.items()}
    for name, rows in cases.items():
        for row, (moments, rates, torque) in rows.items():
            one = found[name][row]
            assert (one["moments"], one["rates"], one["torque"]) == (list(moments), list(rates), list(torque))
            assert float(one["agreement"]) < 1e-30


@pytest.mark.parametrize("name", turning.NAMES)
def test_solutions_agree_with_taylor(name):
    """At a hundredth of a radian in a step; the separatrix where errors have not grown yet."""
    row = {"spin": 1e3, "mass": 1e-6, "inertia": 1e3, "edge": 1e-8, "separatrix": 1e-1}[name]
    assert error_of(turning.case(name, row, 0.01), "taylor") < 1e-13  # measured at most 1.7e-14


@pytest.mark.parametrize("acting", step_size.ACTING)
@pytest.mark.parametrize("h", [1e-3, 10.0])
def test_fine_runs_of_two_methods_agree(acting, h):
    resisted = any(term in acting for term in ("drag", "tether"))
    other = step_size.fine(acting, h, "rosenbrock" if resisted else "taylor")
    case = step_size.case(acting, h)
    assert largest_error([other], case.truth, case.scale) < 3e-10  # measured at most 3.0e-11


def test_closed_form_of_the_symmetric_body_is_the_one_of_exact():
    start = long_run.start(3)
    simulation = Simulation(long_run.SYMMETRIC, start, rate=long_run.RATE, integrator="exact")
    q0 = simulation.state.orientation
    simulation.step(1000)
    true = long_run.closed_form(q0, start.angular_velocity, 1000)
    assert rotation.angle_between(true, simulation.state.orientation) < 1e-14  # rad, of 20; measured 8.8e-16


def test_spin_of_random_states_is_the_one_that_is_said():
    for seed in range(3):
        assert math.hypot(*long_run.start(seed).angular_velocity) == pytest.approx(long_run.SPIN, rel=1e-14)
    assert (long_run.start(1).values == long_run.start(1).values).all()
    assert (long_run.start(1).values != long_run.start(2).values).any()
