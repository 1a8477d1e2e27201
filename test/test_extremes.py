"""Extreme input: right to the stated tolerance, or refused with the reason, and never NaN, a warning or a hang.

Errors are taken with mpmath or in rational numbers, from the values of the doubles that were given.
"""

import dataclasses
import math
import re
import warnings
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from mpmath import mpf
from numpy.testing import assert_allclose

from rigid_body_sim import Body, Simulation, SimulationError, State, Wrench
from rigid_body_sim.effects.drag import NO_DRAG, Drag
from rigid_body_sim.effects.tether import Tether
from rigid_body_sim.integrators import REGISTRY
from rigid_body_sim.kernels import compiled
from rigid_body_sim.kernels.state import LOW, THIN
from rigid_body_sim.mass.shapes import SHAPES
from rigid_body_sim.report.reference.quaternions import conjugate, product, unit
from rigid_body_sim.terms import Terms
from rigid_body_sim.theory import invariants

EPS = np.finfo(float).eps
EXACT = [name for name, integrator in REGISTRY.items() if integrator.order is None]
over_the_exact_ones = pytest.mark.parametrize("integrator", EXACT)
over_all = pytest.mark.parametrize("integrator", REGISTRY)
needs_numba = pytest.mark.skipif(not compiled.ENABLED, reason="takes minutes in plain Python")


@pytest.fixture(autouse=True)
def strict():
    """Every warning, such as numpy's of an overflow, fails the test; mpmath works with 60 digits."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with mpmath.workdps(60):
            yield


# Free rotation of a symmetric body, in closed form -----------------------------------------------------------------


def turn(axis, angle):
    return [mpmath.cos(angle / 2), *(mpmath.sin(angle / 2) * x for x in unit(axis))]


def closed_form(moments, state, t):
    """Attitude and rates after t [s] from the given ones; the first two moments are equal."""
    a, _, c = [mpf(float(moment)) for moment in moments]
    q, w = unit([mpf(float(x)) for x in state.orientation]), [mpf(float(x)) for x in state.angular_velocity]
    L = product(product(q, [mpf(0), a * w[0], a * w[1], c * w[2]]), conjugate(q))[1:]
    about_axis = turn((0, 0, 1), w[2] * (1 - c / a) * mpf(t))
    end = product(product(turn(L, mpmath.norm(L) / a * mpf(t)), q), about_axis)
    return end, product(product(conjugate(about_axis), [mpf(0), *w]), about_axis)[1:]


def attitude_error(sim, q):
    """Angle [rad] between the attitude of a simulation and q, in multiple precision."""
    vector = product(conjugate(q), unit([mpf(float(x)) for x in sim.state.orientation]))[1:]
    return float(2 * mpmath.asin(min(mpf(1), mpmath.norm(vector))))


def errors(body, state, integrator, rate=1024.0, steps=1):
    """Errors of attitude [rad] and rates (relative to the fastest) after free rotation, over what is allowed."""
    sim = Simulation(body, state, rate=rate, integrator=integrator)
    sim.step(steps)
    found = sim.state
    q, w = closed_form(body.principal_moments, state, steps / mpf(rate))
    attitude = attitude_error(sim, q)
    fastest = mpmath.norm(w)
    rates = float(max(abs(mpf(float(a)) - b) for a, b in zip(found.angular_velocity, w, strict=True)) / fastest)
    allowed = tolerance(math.hypot(*state.angular_velocity) * steps / rate, body)
    return attitude / allowed, rates / allowed


def tolerance(angle, body):
    """Round-off of each radian, and of each sub-step, whose number grows as the angle: it tilts all that follow.

    Between moments that differ by less than 10 times, their ratio magnifies it; see THIN in kernels/state.py.
    """
    ratio = body.principal_moments.max() / body.principal_moments.min()
    return EPS * (2 + angle) * (2 + math.sqrt(angle)) * (ratio if ratio <= THIN else 1.0)


def tumbling(spin, seed):
    random = np.random.default_rng(seed)
    w = random.normal(size=3)
    return State(orientation=random.normal(size=4), angular_velocity=spin * w / np.linalg.norm(w))


@over_the_exact_ones
@pytest.mark.parametrize("size", [1e-12, 1e-6, 1.0, 1e6, 1e12])
@pytest.mark.parametrize("spin", [1e-200, 1e-9, 1.0, 1e3, 1e6])
def test_free_rotation_of_any_body_at_any_spin(integrator, size, spin):
    """Moments from 1e-12 to 1e12 kg m²; up to 1000 rad in each of 3 steps of 1 ms."""
    attitude, rates = errors(Body(size, (0.2 * size, 0.2 * size, 0.3 * size)), tumbling(spin, 1), integrator, steps=3)
    assert attitude < 1  # measured 0.30
    assert rates < 1  # measured 0.38


RATIOS = [1e-6, 1e-4, 1e-3, 1e-2, 0.3, 2.0]  # of the moment about the axis of symmetry to the others


@over_the_exact_ones
@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize(
    ("spin", "steps"), [pytest.param(200.0, 16, marks=pytest.mark.no_numba), (200.0, 1024), (1e6, 3)]
)
def test_thin_body_turns_as_exactly_as_any_other(integrator, ratio, spin, steps):
    """Spin about all axes, 3, 200 and 3000 rad: 4e-15, 7e-13 and 4e-11 rad are allowed, whatever the ratio.

    With low-order parts of Rᵀ L left out, it was 9e-8 rad at 1e-6: see the next test.
    """
    for seed in range(3):
        attitude, rates = errors(Body(1.0, (1.0, 1.0, ratio)), tumbling(spin, seed), integrator, steps=steps)
        assert attitude < 1  # measured 0.70
        assert rates < 1  # measured 0.66


@pytest.mark.parametrize("ratio", [1e-6, 1e-3])
def test_thin_body_whose_low_order_parts_are_lost_is_worse(ratio):
    body, state = Body(1.0, (1.0, 1.0, ratio)), tumbling(200.0, 0)
    sim = Simulation(body, state, rate=1024.0, integrator="taylor")
    for _ in range(1024):
        snapshot = sim.save()
        sim.restore(dataclasses.replace(snapshot, state=(*snapshot.state[:LOW], *(0.0,) * LOW)))
        sim.step()
    error = attitude_error(sim, closed_form(body.principal_moments, state, 1)[0])
    assert error > 0.1 * EPS * 200 / ratio  # measured 1.2e-8 at 1e-6, 1.4e-11 at 1e-3


@over_the_exact_ones
@pytest.mark.parametrize("ratio", [1e-6, 1e-3])
@pytest.mark.parametrize("tilt", [0.0, 1e-9, 1e-3])
@pytest.mark.parametrize("fast", ["thin axis", "across"])
def test_thin_body_that_spins_about_one_axis(integrator, ratio, tilt, fast):
    w = (100.0 * tilt, 50.0 * tilt, 100.0) if fast == "thin axis" else (100.0, 30.0, 100.0 * tilt)
    state = State(orientation=(0.3, -0.4, 0.5, 0.6), angular_velocity=w)
    attitude, rates = errors(Body(1.0, (1.0, 1.0, ratio)), state, integrator, steps=1024)
    assert attitude < 1  # measured 0.055
    assert rates < 1  # measured 0.0012


@needs_numba
@over_the_exact_ones
@pytest.mark.parametrize("spin", [1e3, 1e5, 1e6])
@pytest.mark.parametrize("ratio", [1e-6, 1.5])
def test_spin_at_ten_hertz_is_right_or_refused(integrator, spin, ratio):
    """100, 1e4 and 1e5 rad in one step. Whether taylor follows 1e5 depends on the axis; ``exact`` does."""
    body, state = Body(1.0, (1.0, 1.0, ratio)), tumbling(spin, 2)
    sim = Simulation(body, state, rate=10.0, integrator=integrator)
    before = sim.save()
    try:
        sim.step()
    except SimulationError as refusal:
        assert integrator == "taylor" and spin == 1e6
        assert "the state would turn by more than about 1e5 rad in one step; the last good state is" in str(refusal)
        assert sim.save() == before
        return
    attitude, rates = errors(body, state, integrator, rate=10.0)
    assert attitude < 1  # measured 0.077
    assert rates < 1  # measured 0.020


@over_the_exact_ones
def test_thin_disc_is_right_and_so_is_a_rod_that_has_its_radius(integrator):
    disc = SHAPES["thin_disc"].mass_properties((0.3,), mass=2.0).body()
    x, y, z = disc.principal_moments
    assert x + y == z  # the edge of the triangle inequality, to the last digit
    assert max(errors(disc, tumbling(30.0, 3), integrator, steps=1024)) < 1  # measured 0.017
    for radius in (1e-2, 1e-4, 1e-6, 4e-7):  # m, of a rod of 1 m; the last has moments 1e-12 : 1
        moment = 1.0 / 12.0 + radius**2 / 4.0
        rod = Body(1.0, (moment, moment, radius**2 / 2.0))
        assert max(errors(rod, tumbling(30.0, 3), integrator, steps=1024)) < 1  # measured 0.086


@pytest.mark.parametrize("shape", [("thin_rod", (0.5,)), ("point", ())], ids=lambda shape: shape[0])
def test_shape_with_a_zero_moment_is_refused_with_what_would_be_right(shape):
    name, dimensions = shape
    with pytest.raises(
        ValueError, match=r"one is zero, .*; give a thin rod its radius r \(I = m r²/2\), a point an extent"
    ):
        SHAPES[name].mass_properties(dimensions, mass=1.0).body()


# Translation, in rational numbers ----------------------------------------------------------------------------------


def flight(sim, force, mass, position, velocity, steps, rate):
    """Relative errors of position and velocity along x under a constant force, with the low-order parts."""
    sim.step(steps)
    t, a = Fraction(steps) / Fraction(rate), Fraction(force) / Fraction(mass)
    flat = sim.save().state
    x = Fraction(position) + Fraction(velocity) * t + a * t * t / 2
    v = Fraction(velocity) + a * t
    found_x, found_v = Fraction(flat[0]) + Fraction(flat[LOW]), Fraction(float(sim.state.velocity[0]))
    return abs(float(found_x / x - 1)), abs(float(found_v / v - 1))


@over_the_exact_ones
@pytest.mark.parametrize("mass", [1e-12, 1.0, 1e12])
@pytest.mark.parametrize("force", [1e-12, 1.0, 1e12])
def test_constant_force_on_any_mass(integrator, mass, force):
    """Accelerations from 1e-24 to 1e24 m/s²."""
    sim = Simulation(Body(mass, (0.1, 0.2, 0.25)), rate=1024.0, integrator=integrator)
    sim.set_wrench(Wrench(force_world=(force, 0.0, 0.0)))
    x, v = flight(sim, force, mass, 0.0, 0.0, steps=1000, rate=1024.0)
    assert x < 4e-16  # measured 1.0e-16
    assert v < 4e-16  # measured 1.2e-16


@needs_numba
@over_the_exact_ones
def test_a_nanometre_a_second_at_a_million_kilometres(integrator):
    """1e6 steps of 1e-12 m, where neighbouring floats are 1e-7 m apart; rk4, without low-order parts, stays there."""
    state, body = State((1e9, 0.0, 0.0), velocity=(1e-9, 0.0, 0.0)), Body(1.0, (0.1, 0.2, 0.25))
    sims = [Simulation(body, state, rate=1000.0, integrator=name) for name in (integrator, "rk4")]
    for sim in sims:
        sim.step(1_000_000)
    moved, stuck = (Fraction(sim.save().state[0]) + Fraction(sim.save().state[LOW]) - 1_000_000_000 for sim in sims)
    assert abs(float(moved / (Fraction(1e-9) * 1000) - 1)) < 3e-12  # measured 8.0e-13, so 8e-19 m
    assert stuck == 0
    assert abs(sims[0].state.position[0] - 1e9 - 1e-6) <= np.spacing(1e9) / 2  # what a float can show


@over_all
def test_tiny_mass_and_huge_force_are_refused_and_the_state_kept(integrator):
    sim = Simulation(Body(1e-12, (0.1, 0.2, 0.25)), State(velocity=(1.0, 0.0, 0.0)), rate=1.0, integrator=integrator)
    sim.step()
    sim.set_wrench(Wrench(force_world=(1e300, 0.0, 0.0)))
    with pytest.raises(SimulationError, match=r"^step \d cannot be done: the state would not be finite; the last good"):
        for _ in range(3):  # a method of order 1 moves with the momentum of the step before
            before = sim.save()
            sim.step()
    assert sim.save() == before


@needs_numba
@pytest.mark.timeout(10)  # it took a minute, in sub-steps of subnormal numbers
@pytest.mark.parametrize("torque", [1e50, 1e100, 1e150, 1e200])
def test_torque_beyond_all_measure_is_refused_at_once(torque):
    for direction in ((0.0, 0.0, 1.0), (1e-150, 1.0, 0.0), (1.0, 0.5, 0.2)):
        sim = Simulation(Body(1.0, (0.1, 0.2, 0.25)), State(angular_velocity=(0.3, 1.0, 0.2)), integrator="taylor")
        sim.set_wrench(Wrench(torque_body=[torque * x for x in direction]))
        before = sim.save()
        with pytest.raises(SimulationError, match=r"turn by more than about 1e5 rad in one step|not be finite"):
            sim.step()
        assert sim.save() == before


@over_all
@pytest.mark.parametrize("mass", [1e-30, 1.0])
def test_steps_end_before_a_velocity_is_infinite(integrator, mass):
    """A momentum may be finite where the velocity is not: 1e300 N s move 1e-30 kg at 1e330 m/s."""
    sim = Simulation(Body(mass, (0.1, 0.2, 0.25)), rate=1.0, integrator=integrator)
    sim.set_wrench(Wrench(force_world=(0.0, 1.1e306 * mass, 0.0)))
    with pytest.raises(SimulationError, match="would not be finite"):
        sim.step(1000)
    assert sim.steps == (0 if REGISTRY[integrator].adaptive else 9)  # estimates of an error overflow sooner
    assert np.isfinite(sim.motion).all()


# Subnormal numbers and minus zero -----------------------------------------------------------------------------------

TINY = [5e-324, -5e-324, 1e-310, -0.0]


@over_all
@pytest.mark.parametrize("tiny", TINY)
def test_subnormal_input_moves_nothing(integrator, tiny):
    """All of it at once, beside none of it: nothing differs by more than the subnormal numbers themselves."""
    t = (tiny,) * 3
    state = State(t, (1.0, tiny, tiny, tiny), t, t)
    wrench = Wrench(force_world=t) if REGISTRY[integrator].torque_free_only else Wrench(t, t, t, t, [(t, t)])
    sim = Simulation(Body(1.0, (0.1, 0.2, 0.25), t), state, gravity=t, integrator=integrator)
    sim.set_wrench(wrench)
    sim.step(100)
    still = Simulation(Body(1.0, (0.1, 0.2, 0.25)), integrator=integrator)
    still.step(100)
    difference = np.abs(np.subtract(sim.save().state, still.save().state))
    assert difference[3:7].max() <= EPS  # measured 7.5e-17, of ``exact``, which multiplies quaternions in every step
    assert np.delete(difference, range(3, 7)).max() <= 1e-306  # measured 2.1e-310


@over_all
@pytest.mark.parametrize("tiny", TINY)
def test_subnormal_input_beside_ordinary_input_changes_nothing(integrator, tiny):
    ends = []
    for c in (0.0, tiny):
        state = State((1.0, c, c), (1.0, c, 0.0, 0.0), (0.5, c, 2.0), (c, 1.5, 0.3))
        sim = Simulation(Body(1.0, (0.1, 0.2, 0.25)), state, gravity=(c, 0.0, -9.81), integrator=integrator)
        force = (0.1, c, 0.2)
        sim.set_wrench(Wrench(force_world=force) if REGISTRY[integrator].torque_free_only else Wrench(force, force))
        sim.step(100)
        ends.append(sim.state.values)
    assert_allclose(*ends, rtol=0, atol=1e-306)  # measured 1.1e-310: y moves by what was given


@pytest.mark.parametrize("tiny", [5e-324, 1e-200])
def test_tiny_force_at_a_point_does_not_hide_another(tiny):
    """Whether two forces are parallel is decided without products that vanish."""
    points = [((0.0, 0.0, 1.0), (tiny, 0.0, 0.0)), ((0.0, 0.0, 1.0), (0.0, 0.4, 0.0))]
    for given in (points, points[::-1]):
        sim = Simulation(Body(1.0, (0.1, 0.2, 0.25)))
        sim.set_wrench(Wrench(points=given))
        sim.step()
        assert sim.state.angular_momentum[0] == pytest.approx(-0.4e-3, rel=1e-6)  # r × F t; the arm turns by 1e-6 rad


@pytest.mark.parametrize("force", [5e-324, 1e-200, 1e-160])
def test_tiny_force_at_a_point_is_taken(force):
    sim = Simulation(Body(1.0, (0.1, 0.2, 0.25)))
    sim.set_wrench(Wrench(points=[((0.0, 0.0, 1.0), (force, 0.0, 0.0))]))
    sim.step(1000)
    assert sim.state.angular_momentum[1] == pytest.approx(force, rel=1e-12, abs=5e-322)  # measured 0


def test_subnormal_hold_time_is_one_step():
    sim = Simulation(Body(1.0, (0.1, 0.2, 0.25)))
    sim.set_wrench(Wrench(force_world=(1.0, 0.0, 0.0)), hold=5e-324)
    sim.step(10)
    assert sim.state.momentum[0] == 1e-3


# Everything at the ends of the range of floats, over every integrator -----------------------------------------------

BODY = {"mass": 1.0, "inertia": (0.1, 0.2, 0.25), "center_of_mass": (0.1, 0.2, 0.3)}
TETHER = {"body_point": (0.1, 0.0, 0.0), "anchor": (1.0, 2.0, 3.0), "stiffness": 1.0, "damping": 1.0, "slack": False}
GROUPS = ("force_body", "torque_body", "force_world", "torque_world")
HUGE = [1.7e308, -1e308, 1e160, 1e50, 1e12, 5e-324]


def inputs(v):
    """By name: what is given to body, state, wrench and so on, beside values that are ordinary."""
    vector, size = (v, 0.0, -v), abs(v)
    for name in ("position", "velocity", "angular_velocity"):
        yield name, {"state": {name: vector}}
    yield "orientation", {"state": {"orientation": (1.0, v, 0.0, 0.0)}}
    for name in GROUPS:
        yield name, {"wrench": {name: vector}}
    yield "all wrenches", {"wrench": dict.fromkeys(GROUPS, vector)}
    yield "point", {"wrench": {"points": [(vector, (1.0, 2.0, 3.0))]}}
    yield "force at a point", {"wrench": {"points": [((0.1, 0.2, 0.3), vector)]}}
    yield "two points", {"wrench": {"points": [((0.1, 0.2, 0.3), vector), (vector, (1.0, v, 0.0))]}}
    yield "gravity", {"gravity": vector}
    yield "mass", {"body": {"mass": v}}
    yield "moments", {"body": {"inertia": (v, v, v)}}
    yield "inertia", {"body": {"inertia": (v, v, v, 0.1 * v, 0.0, -0.1 * v)}}
    yield "centre of mass", {"body": {"center_of_mass": vector}}
    yield "rate", {"rate": v}
    yield "hold", {"hold": v}
    for name in ("linear", "quadratic", "angular_linear", "angular_quadratic"):
        yield f"drag {name}", {"drag": {name: (size, 0.0, size)}}
    for name in ("rest_length", "stiffness", "damping"):
        yield f"tether {name}", {"tether": {name: size}}
    for name in ("body_point", "anchor"):
        yield f"tether {name}", {"tether": {name: vector}}


def run(integrator, given):
    """A simulation with that input, stepped twice; raises what it is refused with."""
    state = State(**{"velocity": (1.0, 2.0, 3.0), "angular_velocity": (1.0, 2.0, 3.0), **given.get("state", {})})
    sim = Simulation(
        Body(**{**BODY, **given.get("body", {})}),
        state,
        rate=given.get("rate", 100.0),
        gravity=given.get("gravity", (0.0, 0.0, 0.0)),
        integrator=integrator,
        drag=Drag(**given["drag"]) if "drag" in given else NO_DRAG,
        tethers=[Tether(**{**TETHER, **given["tether"]})] if "tether" in given else (),
    )
    sim.set_wrench(Wrench(**given.get("wrench", {})), given.get("hold"))
    for _ in range(2):
        before = sim.save()
        try:
            sim.step()
        except SimulationError as refusal:
            assert sim.save() == before
            assert_finite(sim)
            raise ValueError(str(refusal)) from None
    return sim


def assert_finite(sim):
    assert np.isfinite(sim.save().state).all()
    state = sim.state
    assert np.isfinite(state.values).all()
    for energy in (
        invariants.kinetic_energy(sim.body, state),
        invariants.potential_energy(sim.terms, state),
    ):
        assert not math.isnan(energy)


CASES = {name: [dict(inputs(v))[name] for v in HUGE] for name in dict(inputs(1.0))}
SENTENCE = re.compile(r"^\w.{20,}", re.DOTALL)


@over_all
@pytest.mark.parametrize("name", CASES)
def test_no_number_makes_nan_a_warning_or_a_hang(integrator, name):
    outcomes = []
    for given in CASES[name]:
        try:
            assert_finite(run(integrator, given))
            outcomes.append("done")
        except ValueError as refusal:
            assert SENTENCE.match(str(refusal)) and "math domain" not in str(refusal)
            outcomes.append("refused")
    assert len(outcomes) == len(HUGE)


HUGE_FORCE = Wrench(force_world=(1e307, 0.0, 0.0))
HUGE_WRENCH = Wrench(force_world=(1e307, 0.0, 0.0), torque_body=(0.0, 1e60, 1e50))
OVERFLOWS = {f"{name}-force": (name, HUGE_FORCE) for name in REGISTRY} | {
    f"{name}-torque": (name, HUGE_WRENCH)
    for name, method in REGISTRY.items()
    if method.order is not None and not method.adaptive  # the others would follow it for minutes in plain Python
}


@pytest.mark.no_numba
@pytest.mark.parametrize(("integrator", "wrench"), OVERFLOWS.values(), ids=OVERFLOWS)
def test_run_that_ends_in_overflow_stops_at_the_last_step_that_can_be_done(integrator, wrench):
    """In one call as in single ones; plain Python raises where compiled code goes on with inf, also inside a run."""
    ends = []
    sims = [Simulation(Body(1.0, (0.1, 0.2, 0.25)), rate=1.0, integrator=integrator) for _ in range(3)]
    for sim in sims:
        sim.set_wrench(wrench)
    *stopped, another = sims
    for sim, calls in zip(stopped, ((16,), (1,) * 16), strict=True):
        with pytest.raises(SimulationError, match=r"^step ") as stop:
            for n in calls:
                sim.step(n)
        ends.append((sim.save(), str(stop.value)))
    assert ends[0] == ends[1]
    another.step(stopped[0].steps)
    assert another.save() == ends[0][0], "the state that is kept is not that of the last step"
    with pytest.raises(SimulationError):
        another.step()


def test_energy_too_large_for_a_float_is_infinite_and_no_warning():
    sim = Simulation(Body(1.0, (0.1, 0.2, 0.25)), State((1e200, 0.0, -1e200), velocity=(1e200, 0.0, 0.0)))
    assert invariants.kinetic_energy(sim.body, sim.state) == math.inf
    assert invariants.potential_energy(Terms(sim.body, (1e200, 0.0, 0.0)), sim.state) == -math.inf
    # Two terms of 1e400 that cancel: the rest is right.
    assert invariants.potential_energy(Terms(sim.body, (1e200, 0.0, 1e200)), sim.state) == 0.0
