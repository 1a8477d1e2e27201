"""Rotation without torque in closed form against solutions known to 35 digits: every kind of body, every side."""

import mpmath
import numpy as np
import pytest
from mpmath import mpf
from numpy.testing import assert_allclose, assert_array_equal

from rigid_body_sim import Body, Simulation, State, Wrench
from rigid_body_sim.kernels import compiled, free_motion
from rigid_body_sim.kernels import state as flat
from rigid_body_sim.report.reference import load
from rigid_body_sim.terms import Terms
from rigid_body_sim.values import rotation

pytestmark = pytest.mark.no_numba

CASES = load.stored("torque_free.json")
EPS = np.finfo(float).eps


def model_of(moments):
    return Terms(Body(1.0, moments), (0, 0, 0)).model(Wrench())


def turned(model, q, L, t):
    """Flat state after a free rotation of t [s]."""
    state, work = np.zeros(flat.SIZE), np.zeros(free_motion.WORK_SIZE)
    state[flat.Q : flat.Q + 4], state[flat.L : flat.L + 3] = q, L
    assert compiled.ready(free_motion.turn_freely, state, model, work, t)(state, model, work, t)
    return state


def attitude_error(found, true):
    """Angle [rad] between an attitude and the true one, given in 35 digits."""
    a, b = [mpf(float(c)) for c in found], [mpf(c) for c in true]
    a, b = ([c / mpmath.norm(v) for c in v] for v in (a, b))
    dots = mpmath.fdot(a, b)
    return float(2 * mpmath.asin(min(mpf(1), mpmath.norm([x - dots * y for x, y in zip(a, b, strict=True)]))))


@pytest.mark.parametrize("name", CASES)
def test_attitude_is_right_to_round_off(name):
    case = CASES[name]
    with mpmath.workdps(40):
        end = turned(model_of(case["moments"]), case["q"], case["L"], case["time"])
        angle = angle_turned(case)
        error = attitude_error(end[flat.Q : flat.Q + 4], case["end"])
    assert error < 4 * EPS + 1e-15 * angle  # 1e-13 rad per 100 rad; measured 3.2e-16 times the angle
    assert tuple(end[flat.L : flat.L + 3]) == tuple(case["L"])


def angle_turned(case):
    """|ω| t [rad], with the initial ω; at least |L| t / I_max, which ω never falls below."""
    w = rotation.rotate_back(case["q"], case["L"]) / np.array(case["moments"])
    return float(np.linalg.norm(w / np.abs(w).max()) * np.abs(w).max() * case["time"])


def test_two_parts_make_the_whole_on_every_side_of_the_separatrix():
    model = model_of((0.1, 0.2, 0.25))
    random = np.random.default_rng(5)
    for _ in range(200):
        q, L = random.normal(size=4), random.normal(size=3) * 0.4
        t, share = random.uniform(0.0, 20.0), random.uniform()
        half = turned(model, q, L, share * t)[flat.Q : flat.Q + 4]
        end, whole = turned(model, half, L, t - share * t), turned(model, q, L, t)
        assert rotation.angle_between(end[flat.Q : flat.Q + 4], whole[flat.Q : flat.Q + 4]) < 2e-13  # measured 2.8e-14


def test_quaternion_is_continuous_in_time():
    """No change of sign where the body turns over or a period ends."""
    for spin in ((0.3, 3.0, 0.2), (2.0, 0.5, 0.1), (0.1, 0.5, -2.0), (-1.0, 0.0, 1.0)):
        states = [turned(model_of((0.1, 0.2, 0.25)), (1, 0, 0, 0), spin, 0.01 * k) for k in range(1, 400)]
        attitudes = np.array([state[flat.Q : flat.Q + 4] for state in states])
        assert (np.sum(attitudes[1:] * attitudes[:-1], axis=1) > 0.9).all()


@pytest.mark.parametrize("moments", [(0.1, 0.1, 0.1), (0.1, 0.1, 0.15), (0.1, 0.2, 0.25)])
def test_angle_without_a_right_digit_is_refused(moments):
    state, work, model = np.zeros(flat.SIZE), np.zeros(free_motion.WORK_SIZE), model_of(moments)
    state[flat.Q], state[flat.L] = 1.0, 0.1
    before = state.copy()
    assert not free_motion.turn_freely(state, model, work, 1e16)
    assert (state == before).all()


@pytest.mark.parametrize("moments", [(0.1, 0.1, 0.1), (0.1, 0.2, 0.25)])
def test_low_order_parts_of_the_attitude_are_taken_in_and_those_of_the_others_left(moments):
    model, work = model_of(moments), np.zeros(free_motion.WORK_SIZE)
    one = np.zeros(flat.SIZE)
    one[flat.Q : flat.Q + 4], one[flat.L : flat.L + 3] = (0.4, 0.2, -0.8, 0.4), (0.3, -0.2, 0.5)
    low = flat.LOW + np.arange(flat.LOW)
    one[low] = [1e-17, 2e-17, 3e-17, 0.0, 0.0, 0.0, 0.0, 4e-17, 5e-17, 6e-17, 0.0, 0.0, 0.0]
    other, part = one.copy(), 2.0**-40  # the same attitude, told in parts
    other[flat.Q : flat.Q + 4] -= part
    other[flat.LOW + flat.Q : flat.LOW + flat.Q + 4] = part
    given = one[low].copy()
    for state in (one, other):
        assert compiled.ready(free_motion.turn_freely, state, model, work, 0.7)(state, model, work, 0.7)
        assert_array_equal(state[low], given)
    assert_allclose(other, one, rtol=0, atol=1e-15)  # measured 1.2e-16


def test_run_of_any_length_accumulates_no_error():
    """A million calls of one step end at the bits of one call of a million steps, and at those of another rate."""
    calls = 1_000_000 if compiled.ENABLED else 1000
    body, state = Body(1.0, (0.1, 0.2, 0.25)), State((0, 0, 0), (1, 2, 3, 4), (1, 0, 0), (1.0, -0.5, 2.0))
    one, other = (Simulation(body, state, rate=1024.0, integrator="exact") for _ in range(2))
    for _ in range(calls):
        one.step()
    other.step(calls)
    assert one.save() == other.save()
    slow = Simulation(body, state, rate=1.024, integrator="exact")
    slow.step(calls // 1000)
    assert rotation.angle_between(slow.state.orientation, one.state.orientation) < 1e-12  # measured 0
