"""Inertia tensors: how they may be given, one failing example for each rule, and principal axes (theory 2.4.12)."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from rigid_body_sim.values import inertia, rotation

pytestmark = pytest.mark.no_numba


def turned(moments, q):
    """R diag(moments) Rᵀ, theory (2.4.11)."""
    return inertia.turned(np.diag(moments), q)


def test_the_three_ways_to_give_an_inertia_agree():
    moments = inertia.as_matrix((1.0, 2.0, 3.0 - 0.5))
    assert_array_equal(moments, np.diag((1.0, 2.0, 2.5)))
    assert_array_equal(inertia.as_matrix((1.0, 2.0, 2.5, 0, 0, 0)), moments)
    assert_array_equal(inertia.as_matrix(moments), moments)


def test_six_entries_are_in_the_order_of_urdf():
    expected = ((1.0, 0.1, 0.2), (0.1, 2.0, 0.3), (0.2, 0.3, 2.5))
    assert_array_equal(inertia.as_matrix((1.0, 2.0, 2.5, 0.1, 0.2, 0.3)), expected)


def test_matrix_given_is_copied():
    given_matrix = np.eye(3)
    inertia.as_matrix(given_matrix)[0, 0] = 7.0
    assert given_matrix[0, 0] == 1.0


@pytest.mark.parametrize("wrong", [(1.0, 2.0), (1.0,) * 9, 1.0, np.eye(2), np.ones((3, 3, 1))])
def test_wrong_shape_is_refused(wrong):
    with pytest.raises(ValueError, match=r"inertia has shape .* give 3 principal moments, 6 entries \[ixx, iyy, izz"):
        inertia.as_matrix(wrong)


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", range(6))
def test_entry_that_is_not_finite_is_refused(wrong, place):
    entries = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]
    entries[place] = wrong
    with pytest.raises(ValueError, match="has an entry that is not finite"):
        inertia.as_matrix(entries)


@pytest.mark.parametrize("entry", [(0, 1), (0, 2), (1, 2)])
def test_matrix_that_is_not_symmetric_is_refused(entry):
    matrix = np.eye(3)
    matrix[entry] = 1e-9
    with pytest.raises(ValueError, match="is not symmetric; entry"):
        inertia.as_matrix(matrix)


@pytest.mark.parametrize("entries", [(-1.0, 1.0, 1.0), (1.0, 1.0, 1.0, 1.5, 0.0, 0.0)])
def test_inertia_that_is_not_positive_definite_is_refused(entries):
    with pytest.raises(ValueError, match="is not positive definite; every principal moment"):
        inertia.check(inertia.as_matrix(entries))


ROD = "one is zero, or round-off, so the spin L/I about its axis is undefined; give a thin rod its radius r"


@pytest.mark.parametrize("moments", [(0.0, 1.0, 1.0), (1.0, 0.0, 1.0), (1.0, 1.0, -0.0), (0.0, 0.0, 0.0)])
def test_zero_moment_is_refused_with_what_would_be_right(moments):
    with pytest.raises(ValueError, match=ROD):
        inertia.check(inertia.as_matrix(moments))


def test_zero_moment_is_recognised_in_a_turned_thin_rod():
    """Turned, the zero is round-off of either sign: of 1000 about half would pass for a very thin rod."""
    random, positive = np.random.default_rng(6), 0
    for _ in range(1000):
        tensor = turned((0.0, 0.3, 0.3), random.normal(size=4))
        positive += np.linalg.eigvalsh(tensor)[0] > 0.0
        with pytest.raises(ValueError, match=ROD):
            inertia.check(tensor)
    assert positive > 100  # measured 410


def test_small_moment_of_a_turned_rod_is_no_zero():
    inertia.check(turned((1e-12, 0.3, 0.3), (0.3, 0.5, -0.7, 0.4)))


@pytest.mark.parametrize("size", [1e-100, 1e-12, 1.0, 1e12, 1e99])
def test_moments_in_the_range_of_bodies(size):
    inertia.check(inertia.as_matrix((size, 1.5 * size, 2.0 * size)))


@pytest.mark.parametrize("size", [5e-324, 1e-310, 9e-101])
def test_moment_whose_products_underflow_is_refused(size):
    with pytest.raises(ValueError, match="has one below 1e-100 kg m², where products underflow"):
        inertia.check(inertia.as_matrix((size, size, size)))


@pytest.mark.parametrize("size", [2e100, 1e200, 1.7e308])
@pytest.mark.parametrize("off_diagonal", [0.0, 0.1, -0.1])
def test_moment_whose_products_overflow_is_refused(size, off_diagonal):
    with pytest.raises(ValueError, match=r"has an entry beyond 1e\+100 kg m²; products of larger ones overflow"):
        inertia.as_matrix((size, size, size, off_diagonal * size, 0.0, 0.0))


@pytest.mark.parametrize("moments", [(1.0, 1.0, 2.01), (1.0, 2.01, 1.0), (2.01, 1.0, 1.0)])
@pytest.mark.parametrize("q", [(1.0, 0.0, 0.0, 0.0), (0.3, 0.5, -0.7, 0.4)], ids=["diagonal", "turned"])
def test_triangle_inequality_holds_for_every_moment(moments, q):
    with pytest.raises(ValueError, match=r"\[1, 1, 2.01\] kg m² breaks the triangle inequality"):
        inertia.check(turned(moments, q))


@pytest.mark.parametrize("moments", [(1.0, 1.0, 2.0), (0.1, 0.2, 0.3), (1.0, 2.0, 3.0 * (1 + 1e-13))])
def test_flat_body_is_allowed_in_spite_of_round_off(moments):
    inertia.check(inertia.as_matrix(moments))


@pytest.mark.parametrize("moments", [(1.0, 1.0, 2.0), (1.0, 2.0, 3.0), (1e-3, 1.0, 1.001)])
@pytest.mark.parametrize("digits", [17, 6])
def test_flat_body_is_allowed_at_any_attitude_and_with_six_digits(moments, digits):
    """Thin discs, plates and strips; with five digits some are refused, so the rule is as strict as it can be."""
    random, refused = np.random.default_rng(8), 0
    for _ in range(1000):
        tensor = turned(np.multiply(moments, 10.0 ** random.uniform(-1, 1)), random.normal(size=4))
        entries = tensor[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)]
        inertia.check(inertia.as_matrix(rounded(entries, digits)))
        refused += breaks_the_triangle_inequality(rounded(entries, 5))
    assert refused > 10  # measured 149 at least


def rounded(numbers, digits):
    return [float(f"{number:.{digits - 1}e}") for number in numbers]


def breaks_the_triangle_inequality(entries):
    try:
        inertia.check(inertia.as_matrix(entries))
    except ValueError as refusal:
        return "triangle inequality" in str(refusal)
    return False


BODIES = {"plate": (1.0, 0.5, 0.0), "strip": (1.0, 0.02, 0.0), "rod": (1.0, 1e-3, 1e-3), "thin rod": (1.0, 1e-6, 1e-6)}


@pytest.mark.parametrize("second_moments", BODIES.values(), ids=BODIES)
def test_what_rounding_has_made_impossible_becomes_a_body(second_moments):
    """At any attitude none is refused, and what is used is no further from the true tensor than its digits allow."""
    random, mended, furthest = np.random.default_rng(3), 0, 0.0
    for style in 300 * (".2e", ".3e", ".5e", ".4f", ".6f"):
        moments = np.sum(second_moments) - np.array(second_moments)
        true = turned(moments * 10.0 ** random.uniform(-1, 1), random.normal(size=4))
        printed, rounding = as_printed(true, style)
        found = inertia.within_rounding(printed, rounding)
        inertia.check(found)
        mended += found is not printed
        furthest = max(furthest, np.linalg.norm(found - true) / np.linalg.norm(rounding))
    assert mended > 40  # measured 57 of 1500, thick rods, to 784, thin ones
    assert furthest < 1.0  # measured 0.99; it is 1 where every digit is off by half


def as_printed(tensor, style):
    """The tensor with each entry in that format, and half a unit of the last digit of each."""
    texts = np.vectorize(lambda entry: format(entry, style))(tensor)
    exponents = np.vectorize(lambda text: int(text.partition("e")[2] or 0))(texts)
    return texts.astype(float), 0.5 * 10.0 ** (exponents - float(style[1]))


IMPOSSIBLE = [(0.0, 1.0, 1.0), (1.0, 1.0, 2.04), (-1.0, 2.0, 2.0), (0.0, 0.0, 0.0)]


@pytest.mark.parametrize("moments", [(1.0, 1.0, 1.5), (1.0, 1.0, 2.0), *IMPOSSIBLE])
def test_what_is_right_or_what_rounding_does_not_explain_is_given_back(moments):
    matrix = inertia.as_matrix(moments)
    assert inertia.within_rounding(matrix, np.full((3, 3), 0.01)) is matrix


@pytest.mark.parametrize(("digits", "taken"), [(3, True), (6, True), (9, False), (15, False)])
def test_ideal_rod_is_a_body_only_when_few_digits_are_printed(digits, taken):
    """A rod at 45° without thickness: with few digits it may have had some, with many it has none."""
    matrix = inertia.as_matrix((1 / 24, 1 / 24, 1 / 12, -1 / 24, 0, 0))
    matrix = inertia.as_matrix(rounded(matrix[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)], digits))
    found = inertia.within_rounding(matrix, 0.05 * 10.0**-digits * np.ones((3, 3)))
    assert (found is not matrix) == taken
    if taken:
        inertia.check(found)


def test_triangle_inequality_is_missed_by_three_parts_in_a_hundred_thousand():
    with pytest.raises(ValueError, match="triangle"):
        inertia.check(inertia.as_matrix((1.0, 2.0, 3.0 * (1 + 3e-5))))


attitudes = st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4).filter(lambda q: math.hypot(*q) > 0.1)
moments_of_bodies = st.lists(st.floats(0.01, 1.0), min_size=3, max_size=3).map(lambda d: np.sum(d) - np.array(d))


@given(moments_of_bodies, attitudes)
def test_principal_axes_give_the_inertia_back(moments, q):
    matrix = turned(moments, q)
    found, q_body_principal = inertia.principal_axes(matrix)
    R = rotation.to_matrix(q_body_principal)
    assert_allclose(R @ np.diag(found) @ R.T, matrix, rtol=0, atol=1e-14)  # measured 8.9e-16
    assert_allclose(np.sort(found), np.sort(moments), rtol=0, atol=1e-14)  # measured 1.3e-15
    assert np.linalg.det(R) == pytest.approx(1.0, abs=1e-14)  # measured 2.2e-16


@pytest.mark.parametrize("moments", [(3.0, 1.0, 2.5), (1.0, 1.0, 1.0), (2.0, 1.0, 2.0), (1.0, 1.0 + 2.0**-52, 1.5)])
def test_diagonal_inertia_keeps_its_axes_and_their_order_exactly(moments):
    found, q = inertia.principal_axes(np.diag(moments))
    assert_array_equal(found, moments)
    assert_array_equal(q, (1, 0, 0, 0))


@pytest.mark.parametrize("moments", [(1.0, 1.0, 0.5), (1.0, 1.0, 1.9), (1.0, 1.0, 1.0 + 1e-13)])
def test_equal_moments_have_principal_axes_too(moments):
    matrix = turned(moments, (0.3, 0.5, -0.7, 0.4))
    found, q = inertia.principal_axes(matrix)
    R = rotation.to_matrix(q)
    assert_allclose(R @ np.diag(found) @ R.T, matrix, rtol=0, atol=3e-15)  # measured 2.8e-16
    assert_allclose(np.sort(found), np.sort(moments), rtol=0, atol=3e-15)  # measured 3.3e-16


def test_principal_axes_are_those_nearest_to_the_body_axes():
    tilt = rotation.from_axis_angle((1.0, 2.0, 3.0), 0.3)
    found, q = inertia.principal_axes(turned((3.0, 1.0, 2.5), tilt))
    assert_allclose(q, tilt, rtol=0, atol=1e-14)  # measured 1.1e-16
    assert_allclose(found, (3.0, 1.0, 2.5), rtol=0, atol=1e-14)  # measured 8.9e-16


def test_tensor_turned_in_floating_point_is_symmetric_enough():
    """R I₀ Rᵀ misses symmetry by an ulp or so: measured up to 5e-17 here."""
    R = rotation.to_matrix((0.3, -0.5, 0.2, 0.8))
    turned = R @ np.diag((0.1, 0.2, 0.25)) @ R.T
    turned[0, 1] += 2e-17
    matrix = inertia.as_matrix(turned)
    assert (matrix == matrix.T).all()
    with pytest.raises(ValueError, match="not symmetric"):
        inertia.as_matrix(turned + np.triu(np.full((3, 3), 1e-9), 1))


PAIR = {  # principal moments [kg m²] with two equal, and the axis of the third
    "oblate": ((1.0, 1.0, 1.9), (0.2, -0.3, 0.9)),
    "prolate": ((1.0, 1.0, 0.1), (0.2, -0.3, 0.9)),
    "about x": ((1.0, 1.0, 1.9), (-0.9, 0.3, 0.2)),
    "about y": ((1.0, 1.0, 0.1), (0.3, -0.9, 0.2)),
    "between two axes": ((1.0, 1.0, 1.9), (1.0, 1.0, 0.0)),
    "between three": ((1.0, 1.0, 0.1), (1.0, -1.0, 1.0)),
}


@pytest.mark.parametrize(("moments", "axis"), PAIR.values(), ids=PAIR)
def test_equal_moments_always_get_the_same_axes(moments, axis):
    """The tensor a 1 + b n nᵀ, disturbed in the last bits, keeps its axes: round-off does not choose them."""
    n = np.array(axis) / np.linalg.norm(axis)
    matrix = moments[0] * np.eye(3) + (moments[2] - moments[0]) * np.outer(n, n)
    matrix = (matrix + matrix.T) / 2
    found, q = inertia.principal_axes(matrix)
    assert len(set(found.tolist())) == 2  # the two are equal to the last bit
    rng = np.random.default_rng(5)
    for _ in range(50):
        noise = rng.uniform(-5e-16, 5e-16, (3, 3))
        again, p = inertia.principal_axes(matrix + noise + noise.T)
        assert_allclose(p, q, rtol=0, atol=1e-14)  # measured 8.0e-16
        assert_allclose(again, found, rtol=0, atol=1e-14)  # measured 2.4e-15
    third = rotation.to_matrix(q)[:, _odd(found)]
    assert_allclose(abs(third @ n), 1.0, rtol=0, atol=1e-15)  # measured 1.1e-16


def _odd(moments):
    return next(k for k in range(3) if np.count_nonzero(moments == moments[k]) == 1)


def test_sphere_out_of_round_off_keeps_the_body_axes():
    noise = np.array(((0, 3, -2), (3, 1, 1), (-2, 1, -1))) * 1e-16
    found, q = inertia.principal_axes(0.4 * np.eye(3) + noise)
    assert_array_equal(q, (1, 0, 0, 0))
    assert len(set(found.tolist())) == 1


def test_symmetric_body_turns_its_axes_as_little_as_it_can():
    tilt = rotation.from_axis_angle((1.0, 2.0, 0.0), 0.3)  # about an axis across z: no turn about z itself
    found, q = inertia.principal_axes(turned((1.0, 1.0, 0.3), tilt))
    assert_allclose(q, tilt, rtol=0, atol=1e-14)  # measured 1.1e-16
    assert_allclose(found, (1.0, 1.0, 0.3), rtol=0, atol=1e-15)  # measured 1.7e-16


def test_moments_that_differ_by_a_trillionth_are_not_made_equal():
    found, _ = inertia.principal_axes(turned((1.0, 1.0 + 1e-12, 0.5), (0.3, 0.5, -0.7, 0.4)))
    assert np.sort(found)[2] - np.sort(found)[1] == pytest.approx(1e-12, abs=1e-14)  # measured 2.1e-16


@given(attitudes)
def test_axes_at_any_attitude_are_right_handed(q):
    for moments in ((1.0, 1.5, 2.0), (1.0, 1.0, 1.5), (1.0, 1.5, 1.5)):
        matrix = turned(moments, q)
        found, p = inertia.principal_axes(matrix)
        R = rotation.to_matrix(p)
        assert np.linalg.det(R) == pytest.approx(1.0, abs=1e-14)  # measured 4.4e-16
        assert_allclose(R @ np.diag(found) @ R.T, matrix, rtol=0, atol=1e-14)  # measured 1.1e-15
