"""What every integrator owes, over all that are registered: a new one needs no new test here.

The descriptor decides what is asked. ``order`` None means exact to round-off at every rate; order p means that the
error falls with the step h at least as h^p and not faster than h^(p + 1). A ``reversible`` method goes back the way it
came. An integrator is tried with the wrenches that its ``refusal`` lets pass.
"""

import dataclasses
import math
from fractions import Fraction
from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from rigid_body_sim import Body, Simulation, State, Wrench
from rigid_body_sim.integrators import REGISTRY, get
from rigid_body_sim.kernels.state import LOW
from rigid_body_sim.theory import invariants
from rigid_body_sim.values import rotation

pytestmark = pytest.mark.no_numba

BODY = Body(2.5, (0.31, 0.42, 0.53, -0.04, 0.06, 0.03), (0.07, -0.04, 0.05))
STATE = State((1.0, 2.0, 3.0), (0.4, 0.2, -0.8, 0.4), (-0.5, 0.2, 1.0), (1.1, -2.0, 0.7))
BODY_PART = Wrench(force_body=(0.9, -0.4, 1.3), torque_body=(0.06, 0.04, -0.08))
WORLD_PART = Wrench(force_world=(-0.8, 1.7, 2.1), torque_world=(-0.07, 0.1, 0.05))
POINTS = Wrench(points=[((0.4, 0.0, 0.1), (0.2, -0.4, 0.3)), ((-0.2, 0.3, 0.0), (0.4, 0.1, -0.2))])
EVERYTHING = Wrench(*np.reshape(BODY_PART.values[:6] + WORLD_PART.values[6:], (4, 3)).tolist(), POINTS.points)

FORCE = Wrench(force_world=(-0.8, 1.7, 2.1))
WRENCHES = {"force": FORCE, "body": BODY_PART, "world": WORLD_PART, "points": POINTS, "everything": EVERYTHING}


def over(wrenches, keep=lambda integrator: True):
    """Parametrise over integrators, each with those of the wrenches that it can be given."""
    cases = {
        f"{name}-{held}": (name, wrench)
        for name, integrator in REGISTRY.items()
        for held, wrench in wrenches.items()
        if keep(integrator) and not integrator.refusal(wrench)
    }
    return pytest.mark.parametrize(("integrator", "wrench"), cases.values(), ids=cases)


over_all_integrators = pytest.mark.parametrize("integrator", REGISTRY)
over_those_for_every_wrench = pytest.mark.parametrize(
    "integrator", [n for n, i in REGISTRY.items() if not i.refusal(EVERYTHING)]
)
over_all_wrenches = over(WRENCHES)
over_all_with_an_order = over(WRENCHES, lambda integrator: integrator.order is not None)
over_all_without_order = over(WRENCHES, lambda integrator: integrator.order is None)


def coarse_rate(integrator):
    """A rate [Hz] at which the error of the method stands out of round-off: low for those of high order."""
    return 100.0 if REGISTRY[integrator].order in (None, 1, 2, 4) else 4.0


def hardest(integrator):
    """The wrench with the most in it that an integrator can be given."""
    return FORCE if REGISTRY[integrator].refusal(EVERYTHING) else EVERYTHING


def simulate(integrator, wrench=None, steps=100, rate=100.0, body=BODY, state=STATE, gravity=(0.0, 0.0, 0.0)):
    """A simulation after so many steps, without error control inside them, so that the order shows."""
    sim = Simulation(body, state, rate=rate, gravity=gravity, integrator=integrator, rtol=1.0)
    if wrench is not None:
        sim.set_wrench(wrench)
    sim.step(steps)
    return sim


def attitude_error(one, other):
    return rotation.angle_between(one.orientation, other.orientation)


# At rest ----------------------------------------------------------------------------------------------------------


@over_all_integrators
@pytest.mark.parametrize("seed", range(5))
def test_body_at_rest_without_wrench_stays_to_the_bit(integrator, seed):
    random = np.random.default_rng(seed)
    at_rest = State(random.normal(size=3), random.normal(size=4))
    begin = simulate(integrator, state=at_rest, steps=0).save()
    assert simulate(integrator, state=at_rest, steps=100).save().state == begin.state


@over_all_integrators
def test_body_that_does_not_turn_keeps_its_attitude_in_flight(integrator):
    thrown = State(velocity=(1.0, 2.0, 3.0))
    end = simulate(integrator, Wrench(force_world=(1.0, 0.0, 0.0)), state=thrown, gravity=(0.0, 0.0, -9.81)).state
    assert_array_equal(end.orientation, (1, 0, 0, 0))
    assert_array_equal(end.angular_velocity, (0, 0, 0))


# Closed forms -----------------------------------------------------------------------------------------------------


def fall(integrator, steps, rate):
    """Error of height [m] and of velocity [m/s] in free fall, in rational numbers, and the time it took [s]."""
    body = Body(2.0, (0.1, 0.2, 0.25))
    state = State(position=(0, 0, 100.0), velocity=(1.0, 0, 4.0))
    end = simulate(integrator, body=body, state=state, steps=steps, rate=rate, gravity=(0, 0, -9.80665)).state
    t, g = Fraction(steps) / Fraction(rate), Fraction(-9.80665)
    position = Fraction(end.position[2]) - (100 + 4 * t + g * t * t / 2)
    velocity = Fraction(end.velocity[2]) - (4 + g * t)
    return float(position), float(velocity), float(t)


@over_all_integrators
def test_free_fall(integrator):
    position, velocity, t = fall(integrator, steps=512, rate=128.0)
    order = get(integrator).order
    if order == 1:
        assert abs(position) == pytest.approx(0.5 * 9.80665 * t / 128.0, rel=1e-11)  # ½ g h t; measured 3.7e-14
    else:
        assert abs(position) <= (0.0 if order is None else 1e-12)  # measured 0 and 5e-14
    assert abs(velocity) <= (0.0 if order is None else 1e-12)  # measured 0 and 1.2e-13


def symmetric_top(t):
    """Attitude and angular velocity [rad/s, body] of a torque-free body with moments (a, a, c) after t [s].

    It turns about its angular momentum at |L| / a, and about its own axis of symmetry at ω_z (1 − c / a).
    """
    a, c = TOP.principal_moments[1:]
    w = SPINNING.angular_velocity
    momentum = rotation.rotate(SPINNING.orientation, TOP.inertia @ w)
    about_momentum = rotation.from_axis_angle(momentum, np.linalg.norm(momentum) / a * t)
    about_axis = rotation.from_axis_angle((0, 0, 1), w[2] * (1 - c / a) * t)
    turned = rotation.multiply(rotation.multiply(about_momentum, SPINNING.orientation), about_axis)
    return State(orientation=turned, angular_velocity=rotation.rotate_back(about_axis, w))


TOP = Body(2.0, (0.2, 0.2, 0.3))
SPINNING = State(orientation=(0.5, -0.1, 0.7, 0.5), angular_velocity=(0.8, -0.6, 2.0))


@over_all_integrators
def test_torque_free_symmetric_body_follows_its_closed_form(integrator):
    errors = []
    for rate in (0.5 * coarse_rate(integrator), coarse_rate(integrator)):
        end = simulate(integrator, body=TOP, state=SPINNING, rate=rate, steps=round(5 * rate)).state
        errors.append(attitude_error(end, symmetric_top(5.0)))
        rates = np.linalg.norm(end.angular_velocity - symmetric_top(5.0).angular_velocity)
        assert rates < 10 * errors[-1] + 1e-14  # measured 4 times at most
    if get(integrator).order is None:
        assert max(errors) < 2e-14  # measured 1.2e-15
    else:
        assert_order(get(integrator).order, errors)


# Order ------------------------------------------------------------------------------------------------------------


def assert_order(p, errors):
    """Errors at a step h and at h / 2: they must fall at least as h^p, and not faster than h^(p + 1)."""
    observed = math.log2(errors[0] / errors[1])
    assert p - 0.25 <= observed <= p + 0.75, f"errors {errors} fall as h^{observed:.2f}, not as h^{p}"


@over_all_with_an_order
def test_error_falls_with_the_step_as_the_order_says(integrator, wrench):
    exact = simulate("taylor", wrench, rate=100.0, steps=200).state
    rates = (coarse_rate(integrator), 2 * coarse_rate(integrator))
    ends = [simulate(integrator, wrench, rate=rate, steps=round(2 * rate)).state for rate in rates]
    assert_order(get(integrator).order, [attitude_error(end, exact) for end in ends])
    assert_order(get(integrator).order, [np.linalg.norm(end.position - exact.position) for end in ends])


@over_all_without_order
def test_exact_integrator_depends_on_no_step(integrator, wrench):
    coarse, fine = (simulate(integrator, wrench, rate=rate, steps=round(2 * rate)).state for rate in (4.0, 400.0))
    assert attitude_error(coarse, fine) < 1e-14  # measured 1.1e-15
    assert_allclose(coarse.values, fine.values, rtol=0, atol=5e-14)  # measured 2.2e-15


@over_all_without_order
def test_exact_integrators_agree(integrator, wrench):
    one, other = (simulate(name, wrench).state for name in (integrator, "taylor"))
    assert attitude_error(one, other) < 1e-14  # measured 6.7e-16
    assert_allclose(one.values, other.values, rtol=0, atol=2e-14)  # measured 1.8e-15


# Backwards --------------------------------------------------------------------------------------------------------


def way_back(integrator, wrench):
    """How far [m, rad] a simulation ends from its start after 2 s forwards and 2 s with all momenta turned round."""
    rate = coarse_rate(integrator)
    end = simulate(integrator, wrench, rate=rate, steps=round(2 * rate)).state
    turned_round = State(end.position, end.orientation, -end.velocity, -end.angular_velocity)
    back = simulate(integrator, wrench, rate=rate, steps=round(2 * rate), state=turned_round).state
    return max(np.linalg.norm(back.position - STATE.position), attitude_error(back, STATE))


@over(WRENCHES, lambda integrator: integrator.reversible)
def test_reversible_method_goes_back_the_way_it_came(integrator, wrench):
    assert way_back(integrator, wrench) < 1e-13  # measured 1.1e-14


@over({"hardest": EVERYTHING}, lambda integrator: not integrator.reversible)
def test_other_methods_do_not_go_back(integrator, wrench):
    assert way_back(integrator, wrench) > 1e-12  # measured 3e-11 for rosenbrock, 8e-9 for rkmk4, 0.2 for matrix_euler


# The same motion, told differently --------------------------------------------------------------------------------


@over_all_integrators
def test_a_quaternion_and_its_negative_give_the_same_motion(integrator):
    other = State(STATE.position, -STATE.orientation, STATE.velocity, STATE.angular_velocity)
    end, end_of_other = (
        simulate(integrator, hardest(integrator), state=state).state.values for state in (STATE, other)
    )
    sign = np.where((np.arange(end.size) >= 3) & (np.arange(end.size) < 7), -1.0, 1.0)
    assert_array_equal(end_of_other, sign * end)


@over_all_integrators
@pytest.mark.parametrize(("length", "tolerance"), [(2.0, 0.0), (0.37, 2e-14)])  # measured 0 and 2.0e-15
def test_length_of_the_quaternion_given_does_not_matter(integrator, length, tolerance):
    other = State(STATE.position, length * STATE.orientation, STATE.velocity, STATE.angular_velocity)
    end, end_of_other = (
        simulate(integrator, hardest(integrator), state=state).state.values for state in (STATE, other)
    )
    assert_allclose(end_of_other, end, rtol=0, atol=tolerance)


@over_those_for_every_wrench
def test_wrench_along_the_axis_of_spin_is_the_same_in_body_and_world_axes(integrator):
    """The axis of spin stays where it is, so a force and a torque along it turn with nothing."""
    body = Body(2.0, (0.1, 0.2, 0.25))
    spinning = State(orientation=(0.5, -0.1, 0.7, 0.5), angular_velocity=(0.0, 0.0, 3.0))
    axis = rotation.rotate(spinning.orientation, (0, 0, 1))
    in_body = simulate(integrator, Wrench((0, 0, 1.5), (0, 0, 0.2)), body=body, state=spinning).state
    in_world = Wrench(force_world=(1.5 * axis).tolist(), torque_world=(0.2 * axis).tolist())
    end = simulate(integrator, in_world, body=body, state=spinning).state
    assert_allclose(end.values, in_body.values, rtol=0, atol=2e-14)  # measured 7.8e-15


@over_those_for_every_wrench
def test_wrench_on_a_body_that_does_not_turn_is_the_same_in_body_and_world_axes(integrator):
    state = State(orientation=(0.4, 0.2, -0.8, 0.4))
    force = np.array((0.9, -0.4, 1.3))
    against = np.cross(BODY.center_of_mass, force)  # keeps the force at the origin from turning the body
    in_body = simulate(integrator, Wrench(force.tolist(), against.tolist()), state=state).state
    in_world = simulate(integrator, Wrench(force_world=rotation.rotate(state.orientation, force).tolist()), state=state)
    assert_allclose(in_world.state.values, in_body.values, rtol=0, atol=1e-14)  # measured 2.8e-16


@over_those_for_every_wrench
def test_force_at_the_centre_of_mass_turns_nothing(integrator):
    force = (0.9, -0.4, 1.3)
    at_point = simulate(integrator, Wrench(points=[(BODY.center_of_mass.tolist(), force)])).state
    assert_allclose(at_point.values, simulate(integrator, Wrench(force_world=force)).state.values, rtol=0, atol=1e-13)


def round_off(integrator):
    """Round-off allowed after 100 steps; methods with an order may add up without low-order parts."""
    return 2e-14 if REGISTRY[integrator].order is None else 2e-13  # measured 7.1e-15 and 5.3e-14


TURN = rotation.from_axis_angle((1.0, 2.0, -0.5), 1.1)  # from the body axes of one description to those of the other


def turned_body():
    R = rotation.to_matrix(TURN)
    inertia = R @ BODY.inertia @ R.T
    return Body(BODY.mass, (inertia + inertia.T) / 2, R @ BODY.center_of_mass)


def turned_state():
    orientation = rotation.multiply(STATE.orientation, rotation.conjugate(TURN))
    return State(STATE.position, orientation, STATE.velocity, rotation.rotate(TURN, STATE.angular_velocity))


def turned_wrench(wrench):
    force, torque = (rotation.rotate(TURN, part).tolist() for part in (wrench.force_body, wrench.torque_body))
    points = [(rotation.rotate(TURN, point).tolist(), at_point) for point, at_point in wrench.points]
    return Wrench(force, torque, wrench.force_world.tolist(), wrench.torque_world.tolist(), points)


@over_all_wrenches
def test_body_described_in_turned_axes_moves_the_same(integrator, wrench):
    tolerance = round_off(integrator)
    end = simulate(integrator, wrench).state
    other = simulate(integrator, turned_wrench(wrench), body=turned_body(), state=turned_state()).state
    assert rotation.angle_between(rotation.multiply(other.orientation, TURN), end.orientation) < tolerance
    turned_back = rotation.rotate_back(TURN, other.angular_velocity)
    assert_allclose(turned_back, end.angular_velocity, rtol=0, atol=tolerance)
    for name in ("position", "velocity", "momentum", "angular_momentum"):
        assert_allclose(getattr(other, name), getattr(end, name), rtol=0, atol=tolerance)


@over_those_for_every_wrench
def test_world_turned_as_a_whole_turns_the_motion(integrator):
    tolerance = round_off(integrator)
    turn = partial(rotation.rotate, TURN)
    turned = State(
        turn(STATE.position), rotation.multiply(TURN, STATE.orientation), turn(STATE.velocity), STATE.angular_velocity
    )
    force, torque = WORLD_PART.force_world, WORLD_PART.torque_world
    wrench = Wrench(force_world=turn(force).tolist(), torque_world=turn(torque).tolist())
    end, other = simulate(integrator, WORLD_PART).state, simulate(integrator, wrench, state=turned).state
    assert_allclose(other.position, turn(end.position), rtol=0, atol=tolerance)
    assert rotation.angle_between(other.orientation, rotation.multiply(TURN, end.orientation)) < tolerance


@pytest.mark.parametrize("integrator", [n for n, i in REGISTRY.items() if i.refusal(EVERYTHING)])
@pytest.mark.parametrize(
    ("wrench", "named"),
    [
        (Wrench(force_body=(1, 0, 0)), "no force_body:"),
        (Wrench(torque_body=(0, 0, 1)), "no torque_body:"),
        (Wrench(torque_world=(0, 1, 0)), "no torque_world:"),
        (POINTS, "no points:"),
        (BODY_PART, "no force_body or torque_body:"),
    ],
)
def test_wrench_that_an_integrator_cannot_be_given_is_refused_and_changes_nothing(integrator, wrench, named):
    sim = simulate(integrator, FORCE, steps=10)
    before = sim.save()
    with pytest.raises(ValueError, match=f"^integrator '{integrator}' knows only .* {named} use force_world alone, or"):
        sim.set_wrench(wrench)
    with pytest.raises(ValueError, match="knows only"):
        sim.restore(dataclasses.replace(before, sources=(("", wrench, None),)))
    assert sim.save() == before
    assert sim.wrench == FORCE


# The same bits ----------------------------------------------------------------------------------------------------


@over_all_wrenches
def test_saved_simulation_goes_on_to_the_same_bits(integrator, wrench):
    sim = simulate(integrator, wrench, steps=37)
    saved = sim.save()
    sim.step(63)
    other = Simulation(BODY, rate=100.0, integrator=integrator)
    other.restore(saved)
    other.step(63)
    assert other.save() == sim.save()
    sim.restore(saved)
    sim.step(63)
    assert other.save() == sim.save()


def test_low_order_parts_belong_to_what_is_saved():
    """Without them the motion after a restore would be another one in its last bits."""
    sim = simulate("taylor", EVERYTHING, steps=37)
    saved = sim.save()
    assert sum(part != 0.0 for part in saved.state[LOW:]) > 6  # measured 12 of 13
    sim.step(63)
    rounded = simulate("taylor", EVERYTHING, steps=0)
    rounded.restore(dataclasses.replace(saved, state=saved.state[:LOW] + (0.0,) * 13))
    rounded.step(63)
    assert rounded.save().state[:LOW] != sim.save().state[:LOW]


@over_all_wrenches
def test_steps_done_in_two_calls_are_those_of_one_to_the_bit(integrator, wrench):
    sim = simulate(integrator, wrench, steps=0)
    for n in (1, 36, 63):
        sim.step(n)
    assert sim.save() == simulate(integrator, wrench, steps=100).save()


@over_all_integrators
def test_momenta_are_constant_to_the_bit_without_wrench(integrator):
    begin, end = (simulate(integrator, steps=n).state for n in (0, 300))
    assert_array_equal(end.momentum, begin.momentum)
    assert_array_equal(end.angular_momentum, begin.angular_momentum)


# Tumbling about the middle axis -----------------------------------------------------------------------------------

TUMBLING = Body(2.0, (0.1, 0.2, 0.3))
ENERGY_DRIFT = {  # relative; measured 7.8e-16, 7.8e-16, 2.0e-9, 1.3e-9, 2.4e-8, 6.0e-12 and 1.1e-15
    "taylor": 2e-15,
    "exact": 2e-15,
    "rk4": 1e-8,
    "rkmk4": 1e-8,
    "splitting": 1e-6,
    "splitting4": 1e-10,
    "dop853": 1e-13,
}
PERIODS = 7  # flips within 50 s


def tumble(integrator, seconds=50, rate=100.0):
    """Relative growth of energy, change of L [kg m²/s] and number of flips of a spin about the middle axis."""
    sim = Simulation(TUMBLING, State(angular_velocity=(0.01, 3.0, 0.02)), rate=rate, integrator=integrator)
    begin, flips, side = sim.state, 0, 1
    for _ in range(round(seconds * rate / 10)):
        sim.step(10)
        if sim.state.angular_velocity[1] * side < -1.0:
            flips, side = flips + 1, -side
    energies = [invariants.kinetic_energy(TUMBLING, state) for state in (begin, sim.state)]
    return energies[1] / energies[0] - 1.0, sim.state.angular_momentum - begin.angular_momentum, flips


@pytest.mark.parametrize("integrator", ENERGY_DRIFT)
def test_tumble_about_the_middle_axis_flips_and_keeps_energy_and_angular_momentum(integrator):
    growth, change, flips = tumble(integrator)
    assert flips == PERIODS
    assert abs(growth) < ENERGY_DRIFT[integrator]
    assert_array_equal(change, 0.0)


@pytest.mark.parametrize("integrator", ["splitting", "splitting4"])
def test_energy_error_of_a_symplectic_method_stays_bounded(integrator):
    """At 20 Hz, where the energy that Runge-Kutta loses grows with time."""
    bound = {"splitting": 5e-4, "splitting4": 1e-6}[integrator]  # measured 1.1e-4 and 4e-8
    for seconds in (5, 51, 250):
        assert abs(tumble(integrator, seconds, rate=20.0)[0]) < bound
    assert tumble("rk4", 250, rate=20.0)[0] < 4 * tumble("rk4", 50, rate=20.0)[0] < 0.0  # measured -3.8e-5 and -6.3e-6


@pytest.mark.parametrize("integrator", [name for name, i in REGISTRY.items() if i.order == 1])
def test_methods_of_first_order_make_energy_out_of_nothing(integrator):
    """They are there for comparison: a body that gains energy at constant L ends up spinning about another axis."""
    growth, change, flips = tumble(integrator)
    assert growth > 0.5  # measured 0.91: almost twice the energy after 50 s
    assert flips > 2 * PERIODS  # measured 34
    assert_array_equal(change, 0.0)
    assert tumble(integrator, rate=1000.0, seconds=20)[0] > 0.01  # measured 0.018, at ten times the rate
