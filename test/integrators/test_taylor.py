"""The series integrator against solutions known to 35 digits and against closed forms: its error is round-off.

Errors are taken with mpmath, so that neither the reference nor the comparison adds its own round-off.
"""

import math
from functools import partial

import mpmath
import numpy as np
import pytest
from mpmath import mpf
from numpy.testing import assert_allclose, assert_array_equal

from rigid_body_sim import Body, SimulationError, State, Wrench
from rigid_body_sim import simulation as home
from rigid_body_sim.integrators import steps_of
from rigid_body_sim.integrators.taylor import INTEGRATOR
from rigid_body_sim.kernels import compiled
from rigid_body_sim.kernels import state as flat
from rigid_body_sim.report.reference.quaternions import conjugate, product, unit
from rigid_body_sim.terms import Terms
from rigid_body_sim.theory import invariants
from rigid_body_sim.values import rotation
from rigid_body_sim.values.state import flatten

Simulation = partial(home.Simulation, integrator="taylor")
EPS = np.finfo(float).eps
RATES = (10.0, 100.0, 1000.0)
needs_numba = pytest.mark.skipif(not compiled.ENABLED, reason="takes minutes in plain Python")


@pytest.fixture(autouse=True)
def digits():
    """40 digits in mpmath within a test, and what was set before after it."""
    with mpmath.workdps(40):
        yield


# Quaternions and vectors in mpmath --------------------------------------------------------------------------------


def exact(numbers):
    """Doubles or decimal strings as multiple-precision numbers of exactly that value."""
    return [mpf(n) if isinstance(n, str) else mpf(float(n)) for n in numbers]


def length(v):
    return mpmath.sqrt(mpmath.fsum(x * x for x in v))


def turn(axis, angle):
    return [mpmath.cos(angle / 2), *(mpmath.sin(angle / 2) * x for x in unit(axis))]


def attitude_error(found, true):
    """Angle [rad] between an attitude and the true one, of quaternions of any length."""
    vector = product(conjugate(unit(true)), unit(exact(found)))[1:]
    return float(2 * mpmath.asin(min(mpf(1), length(vector))))


def relative_error(found, true):
    """Length of the difference of two vectors, over the length of the true one or over 1 when that is shorter."""
    difference = length([a - b for a, b in zip(exact(found), true, strict=True)])
    return float(difference / max(mpf(1), length(true)))


# Reference solutions ----------------------------------------------------------------------------------------------


def wrench_of(held):
    parts = (held[name].tolist() for name in ("force_body", "torque_body", "force_world", "torque_world"))
    return Wrench(*parts, [(point.tolist(), force.tolist()) for point, force in held["points"]])


def solve(problem, rate, integrator="taylor"):
    """States of a reference problem at its sample times."""
    body, initial = problem["body"], problem["initial"]
    sim = Simulation(
        Body(body["mass"], body["inertia"], body["center_of_mass"]),
        State(initial["position"], initial["orientation"], initial["velocity"], initial["angular_velocity"]),
        rate=rate,
        gravity=problem["gravity"],
        integrator=integrator,
    )
    states = {}
    for end in sorted({part["until"] for part in problem["wrenches"]} | {part["time"] for part in problem["samples"]}):
        sim.set_wrench(wrench_of(next(held for held in problem["wrenches"] if end <= held["until"])))
        sim.step(round(end * rate) - sim.steps)
        states[end] = sim.state
    return [states[sample["time"]] for sample in problem["samples"]]


def attitude_tolerance(name):
    """Attitude error [rad] allowed: 1e-13, or what it grows to as exp(λ t) where the motion is unstable."""
    return {"torque_free_middle_axis": 2e-11, "flat_body": 5e-13}.get(name, 1e-13)


@pytest.mark.parametrize("rate", RATES)
def test_reference_solution_is_met_to_round_off_at_every_rate(problem_name, rate, load_problem, printed_digits):
    problem, printed = load_problem(problem_name), printed_digits(problem_name)["samples"]
    tolerance = attitude_tolerance(problem_name)
    for state, sample in zip(solve(problem, rate), printed, strict=True):
        true = {name: exact(values) for name, values in sample.items() if name != "time"}
        # Measured 2.6e-14 at most, 5.1e-12 for torque_free_middle_axis, and 1.4e-13 for flat_body.
        assert attitude_error(state.orientation, true["orientation"]) <= tolerance
        assert relative_error(state.angular_velocity, true["angular_velocity"]) <= 2 * tolerance  # much the same
        assert relative_error(state.angular_momentum, true["angular_momentum"]) <= max(1e-14, 0.1 * tolerance)
        assert relative_error(state.momentum, true["momentum"]) <= max(1e-14, 0.1 * tolerance)  # measured 1.2e-14
        assert relative_error(state.position, true["position"]) <= 1e-12  # measured 1.3e-13
        assert relative_error(state.velocity, true["velocity"]) <= max(
            1e-13, tolerance
        )  # measured 1.9e-12 beside 2e-11


def test_the_three_rates_agree_with_one_another(problem_name, load_problem):
    problem = load_problem(problem_name)
    tolerance = 2 * attitude_tolerance(problem_name)
    ends = [solve(problem, rate)[-1] for rate in RATES]
    for one, other in zip(ends, [*ends[1:], ends[0]], strict=True):
        assert rotation.angle_between(one.orientation, other.orientation) <= tolerance  # measured 5.6e-12 beside 4e-11
        assert_allclose(one.position, other.position, rtol=0, atol=1e-12)  # measured 3.2e-13


def test_runge_kutta_of_order_4_is_not_exact_at_these_rates(problem_name, load_problem, printed_digits):
    problem, true = load_problem(problem_name), printed_digits(problem_name)["samples"][-1]["orientation"]
    end = solve(problem, 100.0, "rk4")[-1]
    assert attitude_error(end.orientation, exact(true)) > 1e-8  # measured 2.7e-8 to 2.7 (fast_spin: 2 rad a step)


@pytest.mark.filterwarnings("ignore:Descending:DeprecationWarning")  # mpmath's own
def test_script_that_makes_the_reference_solutions_makes_those_in_the_file(make_reference):
    assert make_reference.check() < mpf("1e-24")  # measured 3e-31


def test_a_wrong_solution_would_be_noticed(load_problem, printed_digits):
    """Turning the last sample by 1e-11 rad is seen, so the tolerances above mean something."""
    true = exact(printed_digits("body_wrench")["samples"][-1]["orientation"])
    end = solve(load_problem("body_wrench"), 100.0)[-1]
    turned = rotation.multiply(end.orientation, rotation.from_axis_angle((1, 1, 1), 1e-11))
    assert attitude_error(turned, true) == pytest.approx(1e-11, rel=1e-3)


# The heavy top ----------------------------------------------------------------------------------------------------

ARM, WEIGHT = 0.05, 4.905  # m, N
TOP_MOMENTS = np.array((0.002, 0.002, 0.003))


def integrals_of_the_top(state):
    """Energy [J], and angular momentum [N m s] about the vertical and about the axis of symmetry: all constant."""
    axis = rotation.rotate(state.orientation, (0, 0, 1))
    w = state.angular_velocity
    return 0.5 * TOP_MOMENTS @ w**2 + WEIGHT * ARM * axis[2], state.angular_momentum[2], state.angular_momentum @ axis


def test_heavy_top_keeps_its_three_integrals_while_it_nutates():
    body = Body(0.5, TOP_MOMENTS)
    sim = Simulation(body, State(orientation=(0.9, 0.3, 0.1, -0.3), angular_velocity=(0.5, -0.3, 20.0)), rate=50.0)
    sim.set_wrench(Wrench(points=[((0, 0, ARM), (0, 0, -WEIGHT))]))
    begin, heights = integrals_of_the_top(sim.state), []
    for _ in range(1000):
        sim.step()
        heights.append(rotation.rotate(sim.state.orientation, (0, 0, 1))[2])
        assert_allclose(integrals_of_the_top(sim.state), begin, rtol=1e-14)  # measured 8.4e-16
    assert np.ptp(heights) > 0.1  # measured 0.195: it does nod


# Without torque ---------------------------------------------------------------------------------------------------


@needs_numba
def test_angular_momentum_without_torque_does_not_change_by_one_bit_in_a_million_steps():
    body = Body(2.5, (0.31, 0.42, 0.53, -0.04, 0.06, 0.03), (0.07, -0.04, 0.05))
    sim = Simulation(body, State(angular_velocity=(1.1, -2.0, 0.7)), gravity=(0.0, 0.0, -9.81))
    sim.set_wrench(Wrench(force_world=(0.3, 0.0, 12.0)))
    begin = sim.state.angular_momentum
    sim.step(1_000_000)
    assert_array_equal(sim.state.angular_momentum, begin)


STABLE = Body(1.0, (0.1, 0.2, 0.25))
SPIN = State(orientation=(0.5, 0.1, -0.3, 0.7), angular_velocity=(0.02, 0.03, 1.5))


def units_gained(integrator, steps):
    """Units in the last place by which |L| in body axes and the energy differ from their start, at 10 ms a step."""
    sim = Simulation(STABLE, SPIN, rate=100.0, integrator=integrator)
    gains = []
    begin = sim.state
    sim.step(steps)
    for quantity in (
        lambda state: np.linalg.norm(STABLE.inertia @ state.angular_velocity),
        lambda state: invariants.kinetic_energy(STABLE, state),
    ):
        gains.append((quantity(sim.state) - quantity(begin)) / np.spacing(quantity(begin)))
    return np.abs(gains)


@needs_numba
def test_ten_million_steps_lose_nothing():
    """More than a day of spin at 10 ms a step; 1.5e5 rad."""
    assert units_gained("taylor", 10_000_000).max() <= 4  # measured 1 and 3
    assert units_gained("rk4", 10_000_000).max() > 1e6  # measured 2.3e6 units in the energy


@needs_numba
def test_energy_does_not_grow_with_the_number_of_long_steps():
    """0.67 rad each. With 1/I rounded once for all steps, not divided by I in each, it gains 7.0e-13."""
    body = Body(1.0, (0.1, 0.2, 0.25))
    sim = Simulation(body, State(orientation=SPIN.orientation, angular_velocity=(1.0, -2.0, 1.5)), rate=4.0)
    begin = invariants.kinetic_energy(body, sim.state)
    sim.step(300_000)
    assert invariants.kinetic_energy(body, sim.state) == pytest.approx(begin, rel=2e-13)  # measured 1.4e-13


# Against the closed form of a symmetric body, at 40 digits --------------------------------------------------------

A, C = 0.2, 0.3  # moments [kg m²]
SYMMETRIC = Body(2.0, (A, A, C))


def closed_form(begin, t):
    """Attitude after t [s] from a flat state: a turn about L by |L| t / A and one about the body's axis of symmetry."""
    q, L = unit(exact(begin[flat.Q : flat.Q + 4])), exact(begin[flat.L : flat.L + 3])
    a, c = exact((A, C))
    spin = product(product(conjugate(q), [mpf(0), *L]), q)[3] / c
    return product(product(turn(L, length(L) / a * t), q), turn((0, 0, 1), spin * (1 - c / a) * t))


SMALL_ANGLES = (1e-9, 1e-6, 1e-3, 0.1, 0.6, 1.0, 3.0, 10.0)  # rad; the others take seconds in plain Python
ANGLES = [*(pytest.param(angle, marks=pytest.mark.no_numba) for angle in SMALL_ANGLES), 100.0, 1e3, 1e4]


def attitude_after(steps, h, state, compensated=True):
    """Error [rad] of the attitude after so many steps of h [s], with the low-order parts of the state or without."""
    terms = Terms(SYMMETRIC)
    model = terms.model(Wrench())
    numbers, work = flatten(state, model), np.zeros(INTEGRATOR.work_size)
    advance = compiled.ready(steps_of(INTEGRATOR, terms.kernels), numbers, model, work, h, 1)
    true = closed_form(numbers, steps * mpf(h))
    for _ in range(steps):
        advance(numbers, model, work, h, 1)
        if not compensated:
            numbers[flat.LOW :] = 0.0
    return attitude_error(numbers[flat.Q : flat.Q + 4], true)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("angle", ANGLES)
def test_one_step_turns_the_body_by_any_angle_to_round_off(angle, seed):
    """Up to 17000 sub-steps: round-off in each tilts the spin, so the error grows as the angle to the power 3/2."""
    random = np.random.default_rng(seed)
    spin = random.normal(size=3)
    state = State(orientation=random.normal(size=4), angular_velocity=angle * spin / np.linalg.norm(spin))
    error = attitude_after(1, 1.0, state)
    assert error < EPS * (1 + angle) * (2 + math.sqrt(angle))  # measured 0.43 of that at most


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("angle", ANGLES)
def test_one_step_of_an_asymmetric_body_agrees_with_the_closed_form(angle, seed):
    """From h |ω| = 1e-9 to 1e4. The error is that of the series: ``exact`` has one of about EPS times the angle."""
    random = np.random.default_rng(seed)
    spin = random.normal(size=3)
    state = State(orientation=random.normal(size=4), angular_velocity=angle * spin / np.linalg.norm(spin))
    ends = []
    for integrator in ("taylor", "exact"):
        sim = Simulation(Body(2.0, (0.1, 0.2, 0.25)), state, rate=1.0, integrator=integrator)
        sim.step()
        ends.append(sim.state.orientation)
    difference = rotation.angle_between(*ends)
    assert difference < EPS * (1 + angle) * (4 + 8 * math.sqrt(angle))  # measured 0.29 of that at most


@needs_numba
def test_sums_without_their_low_order_parts_are_worse():
    """Small steps, where an increment has few digits left beside the number that it is added to."""
    state = State(orientation=(0.5, -0.1, 0.7, 0.5), angular_velocity=(0.8, -0.6, 2.0))
    kept = attitude_after(100_000, 2.0**-13, state)
    lost = attitude_after(100_000, 2.0**-13, state, compensated=False)
    assert kept < 3e-15  # measured 1.4e-15
    assert lost > 8 * kept  # measured 2.2e-14


# A wrench in body axes --------------------------------------------------------------------------------------------

FORCE, TORQUE = np.array((0.7, -0.3, 1.1)), np.array((0.05, -0.02, 0.03))


def with_wrench_in_body_axes(rate):
    sim = Simulation(STABLE, State(angular_velocity=(1.0, -0.5, 2.0)), rate=rate)
    sim.set_wrench(Wrench(FORCE.tolist(), TORQUE.tolist()))
    sim.step(round(rate))
    return sim.state


def with_wrench_held_in_world_axes_over_each_step(rate):
    sim = Simulation(STABLE, State(angular_velocity=(1.0, -0.5, 2.0)), rate=rate)
    for _ in range(round(rate)):
        q = sim.state.orientation
        sim.set_wrench(
            Wrench(force_world=rotation.rotate(q, FORCE).tolist(), torque_world=rotation.rotate(q, TORQUE).tolist())
        )
        sim.step()
    return sim.state


def test_wrench_in_body_axes_turns_with_the_body_within_a_step():
    exact_end = with_wrench_in_body_axes(10.0)
    assert_allclose(with_wrench_in_body_axes(1000.0).values, exact_end.values, rtol=0, atol=2e-15)  # measured 2.2e-16
    held = [with_wrench_held_in_world_axes_over_each_step(rate) for rate in (64.0, 128.0, 256.0)]
    for part in ("position", "angular_momentum"):
        errors = [np.linalg.norm(getattr(end, part) - getattr(exact_end, part)) for end in held]
        assert errors[0] > 1e-4  # measured 3.1e-3 m and 6.6e-4 N m s
        assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.05)  # measured 2.013: holding it is of first order
        assert errors[1] / errors[2] == pytest.approx(2.0, rel=0.05)  # measured 2.006


# What cannot be done ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "wrench",
    [
        Wrench(force_world=(1e308, 0, 0)),
        Wrench(force_body=(0, 1e307, 0)),
        Wrench(torque_world=(0, 0, 1e300)),
        Wrench(torque_body=(1e300, 0, 0)),
        Wrench(points=[((0, 0, 1), (1e300, 0, 0))]),
    ],
    ids=[
        "force in world axes",
        "force in body axes",
        "torque in world axes",
        "torque in body axes",
        "force at a point",
    ],
)
def test_wrench_that_would_overflow_stops_at_the_last_good_state(wrench):
    sim = Simulation(Body(0.01, (0.1, 0.2, 0.25)), State(angular_velocity=(0.1, 0.2, 0.3)), rate=1.0)
    sim.step(3)
    sim.set_wrench(wrench)
    with pytest.raises(SimulationError, match=r"^step \d+ cannot be done: .*; use a smaller wrench or a higher rate$"):
        for _ in range(100):
            before = sim.save()
            sim.step()
    assert sim.save() == before
    assert np.isfinite(before.state).all()


def test_state_after_a_refused_step_can_be_continued():
    sim = Simulation(STABLE, SPIN)
    sim.set_wrench(Wrench(torque_world=(0, 0, 1e300)))
    with pytest.raises(SimulationError):
        sim.step()
    sim.clear_wrench()
    sim.step(10)
    untouched = Simulation(STABLE, SPIN)
    untouched.step(10)
    assert sim.save() == untouched.save()


@needs_numba
def test_more_than_about_a_hundred_thousand_radians_in_one_step_are_refused():
    fast = Simulation(SYMMETRIC, State(angular_velocity=(0, 0, 5e4)), rate=1.0)
    fast.step()
    assert fast.steps == 1
    too_fast = Simulation(SYMMETRIC, State(angular_velocity=(0, 0, 3e5)), rate=1.0)
    before = too_fast.save()
    with pytest.raises(SimulationError, match=r"would turn by more than about 1e5 rad in one step.*spin 3e\+05 rad/s"):
        too_fast.step()
    assert too_fast.save() == before


def test_many_steps_at_once_stop_at_the_one_that_cannot_be_done():
    sim = Simulation(Body(1.0, (0.1, 0.2, 0.25)), rate=1.0)
    sim.set_wrench(Wrench(force_world=(1.9e306, 0, 0)))
    with pytest.raises(SimulationError, match=r"^step 6 cannot be done"):
        sim.step(100)
    assert sim.steps == 5
    assert sim.state.position[0] == 2.375e307  # ½ F t² / m; the next step would end at 1.1e307 m/s
