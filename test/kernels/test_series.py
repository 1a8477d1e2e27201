"""The rows of the Taylor series against the same series written down as its equations are, in extended precision."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rigid_body_sim import Body, State, Wrench
from rigid_body_sim.kernels import series
from rigid_body_sim.kernels import state as flat
from rigid_body_sim.kernels.model import ARMS, CARRIED, FORCE, MOMENTS, TORQUE
from rigid_body_sim.kernels.wrench import reduce_wrench
from rigid_body_sim.terms import Terms
from rigid_body_sim.values import rotation
from rigid_body_sim.values.state import flatten

BODY = Body(2.0, (0.1, 0.2, 0.25))
STATE = State(orientation=(0.5, 0.1, -0.3, 0.7), angular_velocity=(0.4, -0.3, 0.9))
TORQUE_BODY = (0.05, -0.02, 0.03)
ONE = Wrench((0.3, -0.2, 0.5), TORQUE_BODY, points=[((0.1, -0.2, 0.3), (0.1, 0.2, -0.3))])
WRENCHES = {
    0: Wrench((0.3, -0.2, 0.5), TORQUE_BODY),
    1: ONE,
    3: Wrench(torque_body=TORQUE_BODY, points=[*ONE.points, ((0.2, 0.1, 0.0), (0.3, 0.0, 0.1))]),
}
H = 0.7  # s
LONG = np.longdouble


def filled(carried, careful):
    """A model, a state, and the rows of all orders."""
    model = Terms(BODY).model(WRENCHES[carried])
    reduce_wrench(model)
    state, work = flatten(STATE, model), np.zeros(series.SIZE)
    series.set_rates(state, model, work)
    series.carry(carried)(state, model, work)
    series.begin(carried)(work, model, H)
    series.first_orders(carried, series.NARROW, careful)(work, model)
    series.more_orders(carried)(work, model, series.NARROW, 12)
    series.more_orders(carried)(work, model, 12, series.HIGHEST_ORDER)
    return model, state, work


def crossed(a, b):
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def reference(model, state, carried):
    """Q (w, x, y, z) and η by order, term by term, from Euler's equation as it stands in theory (2.5.5)."""
    inertia = model[MOMENTS : MOMENTS + 3].astype(LONG)
    w = rotation.rotate_back(state[flat.Q : flat.Q + 4], state[flat.L : flat.L + 3]) / inertia
    vectors, arms = model[CARRIED : CARRIED + 9].reshape(3, 3), model[ARMS : ARMS + 27].astype(LONG).reshape(3, 3, 3)
    q, eta = [np.array([1, 0, 0, 0], LONG)], [LONG(H) / 2 * w]
    b = [[rotation.rotate_back(state[flat.Q : flat.Q + 4], one) for one in vectors[:carried]]]
    for k in range(series.HIGHEST_ORDER):
        pairs = [(j, k - j) for j in range(k + 1)]
        scalar = -sum(q[j][1:] @ eta[i] for j, i in pairs)
        vector = sum(q[j][0] * eta[i] + crossed(q[j][1:], eta[i]) for j, i in pairs)
        torque = sum((arms[n] @ b[k][n] for n in range(carried)), np.zeros(3, LONG))
        torque = torque + (model[TORQUE : TORQUE + 3] if k == 0 else 0)
        gyroscopic = 2 * sum(crossed(inertia * eta[j], eta[i]) for j, i in pairs)
        q.append(np.array([scalar, *vector]) / (k + 1))
        eta.append((gyroscopic + LONG(H) ** 2 / 2 * torque) / inertia / (k + 1))
        b.append([2 * sum(crossed(b[j][n], eta[i]) for j, i in pairs) / (k + 1) for n in range(carried)])
    return np.array(q), np.array(eta)


@pytest.mark.no_numba
@pytest.mark.parametrize("careful", [0, 5])
@pytest.mark.parametrize("carried", [0, 1, 3])
def test_every_order_is_that_of_the_equations(carried, careful):
    model, state, work = filled(carried, careful)
    q, eta = reference(model, state, carried)
    for k in range(series.HIGHEST_ORDER + 1):
        x, y, z, w, ex, ey, ez, _ = work[series.TERMS + k * series.STRIDE :][:8]
        largest = np.abs((*q[k], *eta[k])).max()
        assert_allclose((w, x, y, z), q[k].astype(float), rtol=0, atol=2e-14 * largest)  # measured 5.8e-15
        assert_allclose((ex, ey, ez), eta[k].astype(float), rtol=0, atol=2e-14 * largest)


@pytest.mark.no_numba
def test_sums_of_a_whole_and_of_a_part_of_the_step():
    model, state, work = filled(1, 5)
    q, eta = reference(model, state, 1)
    for f in (1.0, 0.4):
        series.gain_part(work, f)
        powers = LONG(f) ** np.arange(1, series.HIGHEST_ORDER + 1)
        true = (np.hstack((q[1:, 1:], q[1:, :1], eta[1:])) * powers[:, None]).sum(0)
        assert_allclose(work[series.GAIN : series.GAIN + 7], true.astype(float), rtol=0, atol=5e-16)  # measured 9.7e-17
    whole = filled(1, 5)[2]
    series.gain_whole(whole)
    series.gain_part(work, 1.0)
    assert_allclose(whole[series.GAIN :][:7], work[series.GAIN :][:7], rtol=0, atol=2e-16)  # measured 4.2e-17


@pytest.mark.no_numba
@pytest.mark.parametrize("f", [1.0, 0.4])
def test_impulse_of_a_force_that_turns_with_the_body(f):
    """∫ R F dθ and ∬ R F dθ², with more than twice as many nodes."""
    model, state, work = filled(0, 5)
    q, _ = reference(model, state, 0)
    series.set_impulse(work, model, series.HIGHEST_ORDER, f)

    def turned(theta):
        turn = np.polynomial.polynomial.polyval(f * theta, q.astype(float))
        return rotation.rotate(turn, model[FORCE : FORCE + 3])

    nodes, weights = np.polynomial.legendre.leggauss(20)
    nodes, weights = (nodes + 1) / 2, weights / 2
    forces = np.array([turned(theta) for theta in nodes])
    assert_allclose(work[series.IMPULSE :][:3], weights @ forces, rtol=0, atol=3e-16)  # measured 5.6e-17
    assert_allclose(work[series.IMPULSE + 4 :][:3], (weights * (1 - nodes)) @ forces, rtol=0, atol=2e-16)


@pytest.mark.no_numba
@pytest.mark.parametrize(("order", "h"), [(6, 0.00095), (8, 0.019)])  # 0.001 and 0.02 rad
def test_few_orders_are_enough_for_the_impulse_of_a_short_step(order, h):
    model = Terms(BODY).model(WRENCHES[0])
    reduce_wrench(model)
    state, work = flatten(STATE, model), np.zeros(series.SIZE)
    series.set_rates(state, model, work)
    series.carry(0)(state, model, work)
    series.begin(0)(work, model, h)
    series.first_orders(0, order, 2)(work, model)
    series.short_impulse(order)(work, model)
    short = work[series.IMPULSE : series.IMPULSE + 7].copy()
    series.set_impulse(work, model, order, 1.0)
    assert_allclose(short, work[series.IMPULSE : series.IMPULSE + 7], rtol=0, atol=3e-16)  # measured 1.1e-16


@pytest.mark.parametrize("nodes", [series.THREE_NODES, series.FOUR_NODES, series.EIGHT_NODES])
def test_nodes_and_weights_are_those_of_gauss(nodes):
    times, weights, second_weights = nodes
    found, found_weights = np.polynomial.legendre.leggauss(len(times))
    assert_allclose(times, (1 + found) / 2, rtol=0, atol=2e-16)  # measured 1.1e-16
    assert_allclose(weights, found_weights / 2, rtol=0, atol=1e-15)  # measured 4e-16, numpy's
    assert_allclose(second_weights, weights * (1 - times), rtol=0, atol=3e-17)
