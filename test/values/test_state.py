"""The state that users read and write, the flat state that kernels advance, and the way between them."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from rigid_body_sim import Body, State, Wrench
from rigid_body_sim.kernels import model as layout
from rigid_body_sim.kernels import state as flat
from rigid_body_sim.terms import Terms
from rigid_body_sim.values import rotation
from rigid_body_sim.values.state import body_state, flatten

pytestmark = pytest.mark.no_numba

BODY = Body(
    2.5, (0.31, 0.42, 0.53, -0.04, 0.06, 0.03), (0.07, -0.04, 0.05)
)  # principal axes turned, CoM off the origin
STATE = State((1.0, 2.0, 3.0), (0.4, 0.2, -0.8, 0.4), (-0.5, 0.2, 1.0), (1.1, -2.0, 0.7))


def flattened(state, body=BODY):
    return flatten(state, Terms(body, (0, 0, 0)).model(Wrench()))


def read_out(flat_state, body=BODY):
    return body_state(flat.read_motion(flat_state, Terms(body).model(Wrench())), flat_state)


def matrix(q):
    """Rotation matrix of a unit quaternion by theory (2.7.26): (s² − v·v) + 2 v vᵀ + 2 s v*."""
    s, v = q[0], np.asarray(q[1:])
    skew = np.array(((0, -v[2], v[1]), (v[2], 0, -v[0]), (-v[1], v[0], 0)))
    return (s * s - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * s * skew


def test_orientation_is_normalised():
    assert_allclose(State(orientation=(3.0, 0.0, 0.0, -4.0)).orientation, (0.6, 0, 0, -0.8), rtol=0, atol=2e-16)


@pytest.mark.parametrize("name", ["position", "velocity", "angular_velocity"])
@pytest.mark.parametrize("value", [(0.0, 0.0, math.nan), (math.inf, 0.0, 0.0), (0.0, 0.0), 1.0, ("a", "b", "c"), None])
def test_value_that_is_not_three_finite_numbers_is_refused_by_name(name, value):
    with pytest.raises(ValueError, match=rf"^{name} .* must be three finite numbers \(x, y, z\)"):
        State(**{name: value})


@pytest.mark.parametrize("orientation", [(0, 0, 0, 0), (math.nan, 0, 0, 0), (1, 0, 0)])
def test_orientation_without_direction_is_refused(orientation):
    with pytest.raises(ValueError, match="quaternion"):
        State(orientation=orientation)


def test_state_cannot_be_changed():
    with pytest.raises(ValueError, match="read-only"):
        STATE.position[0] = 7.0


def test_state_shown_can_be_typed_in_again():
    assert_array_equal(eval(repr(STATE)).values, STATE.values)


def test_position_and_momentum_are_those_of_the_centre_of_mass():
    R, c, w = matrix(STATE.orientation), BODY.center_of_mass, STATE.angular_velocity
    found = flattened(STATE)
    assert_allclose(found[flat.X : flat.X + 3], STATE.position + R @ c, rtol=0, atol=2e-15)  # measured 0
    velocity = STATE.velocity + np.cross(R @ w, R @ c)
    assert_allclose(found[flat.P : flat.P + 3], BODY.mass * velocity, rtol=0, atol=3e-15)  # measured 5.6e-17


def test_angular_momentum_is_inertia_times_angular_velocity_seen_from_the_world():
    R = matrix(STATE.orientation)
    expected = R @ BODY.inertia @ STATE.angular_velocity
    assert_allclose(flattened(STATE)[flat.L : flat.L + 3], expected, rtol=0, atol=3e-15)  # measured 2.2e-16


def test_angular_momentum_is_that_of_point_masses_about_their_centre():
    """Four point masses: inertia, momentum and angular momentum by sums over them (theory 2.4.10)."""
    masses = np.array((0.3, 0.5, 0.7, 1.0))
    points = np.array(((0.1, 0.2, 0.3), (-0.4, 0.1, 0.0), (0.2, -0.5, 0.1), (0.0, 0.3, -0.2)))
    center = masses @ points / masses.sum()
    arms = points - center
    inertia = sum(m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in zip(masses, arms, strict=True))
    body = Body(masses.sum(), (inertia + inertia.T) / 2, center)
    R, w = matrix(STATE.orientation), STATE.angular_velocity
    velocities = STATE.velocity + np.cross(w, points) @ R.T
    found = read_out(flattened(STATE, body), body)
    assert_allclose(found.momentum, masses @ velocities, rtol=0, atol=5e-15)  # measured 1.1e-16
    expected = np.sum(masses[:, None] * np.cross(arms @ R.T, velocities), axis=0)
    assert_allclose(found.angular_momentum, expected, rtol=0, atol=5e-15)  # measured 5.6e-17


def test_attitude_in_the_flat_state_is_that_of_the_principal_axes():
    q_world_principal = flattened(STATE)[flat.Q : flat.Q + 4]
    R = matrix(q_world_principal)
    expected = matrix(STATE.orientation) @ BODY.inertia @ matrix(STATE.orientation).T
    assert_allclose(R @ np.diag(BODY.principal_moments) @ R.T, expected, rtol=0, atol=1e-15)  # measured 1.1e-16


@pytest.mark.parametrize("seed", range(20))
def test_state_comes_back_from_the_flat_state(seed):
    random = np.random.default_rng(seed)
    given = State(*(random.normal(size=n) for n in (3, 4, 3, 3)))
    found = read_out(flattened(given))
    assert_allclose(found.values[:13], given.values, rtol=0, atol=1e-14)  # measured 1.3e-15


def test_sphere_at_the_origin_comes_back_to_the_bit():
    body = Body(2.0, (0.5, 0.5, 0.5))
    given = State((1.0, 2.0, 3.0), velocity=(0.1, 0.2, 0.3))
    assert_array_equal(read_out(flattened(given, body), body).values[:13], given.values)


def test_sums_keep_what_plain_addition_loses():
    numbers = np.zeros(flat.SIZE)
    numbers[0] = 1.0
    for _ in range(1000):
        flat.add_compensated(numbers, 0, 1e-17)  # one unit in the last place of 1 is 2.2e-16
    assert numbers[0] + numbers[flat.LOW] == pytest.approx(1.0 + 1e-14, abs=3e-16)
    assert numbers[0] - 1.0 == pytest.approx(1e-14, abs=2.3e-16)
    assert 1.0 + 1e-17 == 1.0


@pytest.mark.parametrize("terms", [(1.0, 1e17), (1e17, 1.0)])
def test_sum_keeps_the_smaller_part_whichever_comes_first(terms):
    numbers = np.zeros(flat.SIZE)
    for term in terms:
        flat.add_compensated(numbers, 0, term)
    assert (numbers[0], numbers[flat.LOW]) == (1e17, 1.0)


@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")  # of numpy, without numba
@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", [0, flat.Q, flat.LOW - 1])
def test_one_number_that_is_not_finite_is_noticed(wrong, place):
    numbers, model = np.full(flat.SIZE, 1e300), Terms(Body(1.0, (1.0, 1.0, 1.0)), (0.0, 0.0, 0.0)).model(Wrench())
    assert flat.is_finite(numbers, model)
    numbers[place] = wrong
    assert not flat.is_finite(numbers, model)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize(
    ("motion", "most"),
    [
        ("velocity", layout.FASTEST),
        ("angular_velocity", layout.FASTEST / 2.0),  # the centre of mass lies 1 m off, and moves with the rest of it
    ],
)
def test_momenta_count_as_finite_up_to_where_velocities_do(motion, most, axis):
    """Whatever the axis: the smallest moment does not bound the angular momentum about the others."""
    body = Body(2.0, (1.0, 1.0, 1e-99), center_of_mass=(0.0, 0.0, 1.0))
    model = Terms(body, (0.0, 0.0, 0.0)).model(Wrench())
    for share, fits in ((0.99, True), (1.01, False), (-0.99, True), (-1.01, False)):
        numbers = flatten(State(**{motion: np.eye(3)[axis]}), model)
        numbers[flat.P : flat.LOW] *= share * most
        assert flat.is_finite(numbers, model) == fits


def test_attitude_in_the_flat_state_has_unit_length():
    assert rotation.norm(flattened(STATE)[flat.Q : flat.Q + 4]) == pytest.approx(1.0, abs=5e-16)


def test_attitude_is_aligned_with_the_angular_momentum_that_is_known_better():
    """By turning the body until Rᵀ L is what it should be: a change l × δ of it is followed to its first order."""
    numbers = flattened(STATE, Body(1.0, (1.0, 1.0, 1e-3)))
    high, low = np.reshape(flat.body_momentum(numbers), (3, 2)).T
    change = np.cross(high, (1e-12, -2e-12, 3e-12))
    flat.align(numbers, *np.transpose((high, low + change)).ravel().tolist())
    found_high, found_low = np.reshape(flat.body_momentum(numbers), (3, 2)).T
    assert_allclose((found_high - high) + (found_low - low), change, rtol=0, atol=1e-22)  # measured 9e-24


@pytest.mark.parametrize("spin", [0.0, 1e-290])
def test_attitude_is_not_aligned_with_an_angular_momentum_that_has_no_low_order_parts(spin):
    """Below 1e-280 kg m²/s they underflow, and there is nothing to correct."""
    thin = Body(1.0, (1.0, 1.0, 1e-6))
    numbers = flattened(State(orientation=STATE.orientation, angular_velocity=(0.0, spin, 0.0)), thin)
    before = numbers.copy()
    flat.align(numbers, spin, 0.0, spin, 0.0, 0.0, 0.0)
    assert_array_equal(numbers, before)
