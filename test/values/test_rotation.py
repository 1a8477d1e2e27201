"""Quaternion algebra (theory 2.7), the skew matrix (2.2.3) and the ways into and out of rotation matrices."""

import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from rigid_body_sim.kernels import vectors as kernels
from rigid_body_sim.theory import quaternion
from rigid_body_sim.theory.quaternion import inverse
from rigid_body_sim.values import rotation
from rigid_body_sim.values.rotation import conjugate, multiply, norm, rotate, to_matrix

pytestmark = pytest.mark.no_numba

ONE = np.array((1.0, 0.0, 0.0, 0.0))
I, J, K = np.eye(4)[1:]


components = st.floats(-10.0, 10.0).map(lambda x: x if abs(x) > 1e-9 else 0.0)


def arrays(size):
    return st.lists(components, min_size=size, max_size=size).map(np.array)


vectors = arrays(3)
quaternions = arrays(4).filter(lambda q: norm(q) > 1e-3)
rotations = quaternions.map(rotation.normalize)
axes = vectors.filter(lambda v: np.linalg.norm(v) > 1e-3).map(lambda v: v / np.linalg.norm(v))


@given(quaternions, quaternions)
def test_product_is_that_of_the_4x4_matrices_of_theory_2_7_25(a, b):
    product = quaternion.to_matrix_4x4(a) @ quaternion.to_matrix_4x4(b)
    scale = norm(a) * norm(b)
    assert_allclose(quaternion.to_matrix_4x4(multiply(a, b)), product, rtol=0, atol=1e-15 * scale)  # measured 1.8e-16


def test_units_become_the_matrices_printed_in_theory_2_7_23_and_2_7_24():
    assert_array_equal(quaternion.to_matrix_4x4(ONE), np.eye(4))
    printed_i = ((0, 1, 0, 0), (-1, 0, 0, 0), (0, 0, 0, -1), (0, 0, 1, 0))
    printed_j = ((0, 0, 1, 0), (0, 0, 0, 1), (-1, 0, 0, 0), (0, -1, 0, 0))
    printed_k = ((0, 0, 0, 1), (0, 0, -1, 0), (0, 1, 0, 0), (-1, 0, 0, 0))
    for unit, printed in zip((I, J, K), (printed_i, printed_j, printed_k), strict=True):
        assert_array_equal(quaternion.to_matrix_4x4(unit), printed)


@given(st.lists(rotations, min_size=1, max_size=4))
def test_matrices_of_many_are_those_of_each(found):
    q = np.array(found)
    matrices = rotation.to_matrix_each(q)
    assert matrices.shape == (len(found), 3, 3)
    for one, matrix in zip(q, matrices, strict=True):
        assert_array_equal(rotation.to_matrix_each(one), matrix)
        assert_allclose(matrix, to_matrix(one), rtol=0, atol=2e-15)  # measured 8.9e-16


@given(quaternions)
def test_4x4_matrix_goes_back_to_its_quaternion(q):
    assert_array_equal(quaternion.from_matrix_4x4(quaternion.to_matrix_4x4(q)), q)


@pytest.mark.parametrize("place", [(1, 0), (2, 1), (3, 3)])
def test_4x4_matrix_of_another_form_is_refused(place):
    matrix = quaternion.to_matrix_4x4((0.5, 0.1, -0.2, 0.3))
    matrix[place] += 1e-9
    with pytest.raises(ValueError, match="is not that of a quaternion"):
        quaternion.from_matrix_4x4(matrix)


def test_4x4_matrix_that_is_not_a_number_is_refused():
    with pytest.raises(ValueError, match="is not that of a quaternion"):
        quaternion.from_matrix_4x4(np.full((4, 4), np.nan))


@given(quaternions, quaternions, quaternions)
def test_product_distributes_over_sum_and_difference(a, b, c):
    scale = norm(a) * (norm(b) + norm(c))
    left = multiply(a, quaternion.add(b, c))
    assert_allclose(left, multiply(a, b) + multiply(a, c), rtol=0, atol=2e-15 * scale)  # measured 2.4e-16
    left = multiply(a, quaternion.subtract(b, c))
    assert_allclose(left, multiply(a, b) - multiply(a, c), rtol=0, atol=2e-15 * scale)  # measured 2.0e-16


def test_products_of_the_units_are_exact():
    for a, b, c in ((I, J, K), (J, K, I), (K, I, J)):
        assert_array_equal(multiply(a, b), c)
        assert_array_equal(multiply(b, a), -c)
        assert_array_equal(multiply(a, a), -ONE)


@given(quaternions, quaternions, quaternions)
def test_product_is_associative(a, b, c):
    scale = norm(a) * norm(b) * norm(c)
    left, right = multiply(multiply(a, b), c), multiply(a, multiply(b, c))
    assert_allclose(left, right, rtol=0, atol=3e-15 * scale)  # measured 2.3e-16


@given(quaternions, quaternions)
def test_norm_of_a_product_is_the_product_of_the_norms(a, b):
    assert norm(multiply(a, b)) == pytest.approx(norm(a) * norm(b), rel=2e-15, abs=0)  # measured 2.4e-16


@given(quaternions, quaternions)
def test_conjugate_reverses_a_product(a, b):
    assert_allclose(
        conjugate(multiply(a, b)),
        multiply(conjugate(b), conjugate(a)),
        rtol=0,
        atol=1e-15 * norm(a) * norm(b),  # measured 0
    )


@given(quaternions)
def test_inverse_undoes_from_both_sides(q):
    assert_allclose(multiply(q, inverse(q)), ONE, rtol=0, atol=1e-15)  # measured 2.2e-16
    assert_allclose(multiply(inverse(q), q), ONE, rtol=0, atol=1e-15)


@given(quaternions, quaternions)
def test_quotient_times_divisor_is_the_dividend(a, b):
    assert_allclose(multiply(quaternion.divide(a, b), b), a, rtol=0, atol=2e-15 * norm(a))  # measured 4.1e-16


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e200])
def test_inverse_and_norm_neither_overflow_nor_underflow(size):
    q = size * np.array((0.5, 0.5, -0.5, 0.5))
    assert norm(q) == pytest.approx(size, rel=1e-15, abs=0)
    assert_allclose(multiply(q, inverse(q)), ONE, rtol=0, atol=1e-15)


@given(rotations, vectors)
def test_rotation_of_a_vector_is_q_v_q_conjugate(q, v):
    expected = multiply(multiply(q, (0.0, *v)), conjugate(q))[1:]
    assert_allclose(rotate(q, v), expected, rtol=0, atol=3e-15 * np.linalg.norm(v))  # measured 6.5e-16


@given(quaternions, vectors)
def test_rotation_of_a_vector_is_that_of_the_matrix_for_any_length_of_q(q, v):
    assert_allclose(rotate(q, v), to_matrix(q) @ v, rtol=0, atol=3e-15 * np.linalg.norm(v))  # measured 2.5e-16


@given(quaternions, vectors)
def test_rotating_back_undoes_a_rotation(q, v):
    assert_allclose(
        rotation.rotate_back(q, rotate(q, v)), v, rtol=0, atol=3e-15 * np.linalg.norm(v)
    )  # measured 8.4e-16


@given(rotations, rotations, vectors)
def test_product_rotates_by_the_right_factor_first(a, b, v):
    expected = rotate(a, rotate(b, v))
    assert_allclose(rotate(multiply(a, b), v), expected, rtol=0, atol=5e-15 * np.linalg.norm(v))  # measured 5.6e-16


def test_quarter_turn_about_z_takes_x_to_y():
    q = rotation.from_axis_angle((0, 0, 2), math.pi / 2)
    assert_allclose(rotate(q, (1, 0, 0)), (0, 1, 0), rtol=0, atol=5e-16)  # measured 2.2e-16


@given(rotations)
def test_rotation_matrix_is_orthogonal_and_right_handed(q):
    R = to_matrix(q)
    assert_allclose(R @ R.T, np.eye(3), rtol=0, atol=3e-15)  # measured 1.1e-15
    assert np.linalg.det(R) == pytest.approx(1.0, rel=3e-15, abs=0)  # measured 1.1e-15


ANGLES = [1e-300, 1e-12, 1e-8, 1e-3, 1.0, math.pi - 1e-3, math.pi - 1e-8, math.pi - 1e-12, math.pi]


@pytest.mark.parametrize("angle", ANGLES)
@given(axis=axes)
def test_axis_and_angle_come_back(angle, axis):
    found_axis, found_angle = rotation.to_axis_angle(rotation.from_axis_angle(axis, angle))
    assert found_angle == pytest.approx(angle, rel=1e-15, abs=0)  # measured 2.2e-16
    if angle < math.pi:  # a half turn about an axis is one about its opposite
        assert_allclose(found_axis, axis, rtol=0, atol=1e-15)  # measured 2.2e-16


@given(axes, st.floats(-20.0, 20.0))
def test_angle_found_is_the_shorter_way_round(axis, angle):
    _, found = rotation.to_axis_angle(rotation.from_axis_angle(axis, angle))
    assert found == pytest.approx(abs(math.remainder(angle, 2 * math.pi)), abs=1e-14)  # measured 6.7e-16


def test_identity_has_angle_zero():
    axis, angle = rotation.to_axis_angle((-3.0, 0.0, 0.0, 0.0))
    assert_array_equal(axis, (1, 0, 0))
    assert angle == 0.0


SHEPPERD = {
    "w largest": (0.9, 0.1, -0.2, 0.3),
    "x largest": (0.1, -0.9, 0.3, 0.2),
    "y largest": (-0.2, 0.1, 0.9, 0.3),
    "z largest": (0.1, 0.2, 0.3, -0.9),
    "half turn about x": (0.0, 1.0, 0.0, 0.0),
    "half turn about y": (0.0, 0.0, 1.0, 0.0),
    "half turn about z": (0.0, 0.0, 0.0, 1.0),
    "half turn about a diagonal": (0.0, 0.6, 0.0, -0.8),
}


@pytest.mark.parametrize("q", SHEPPERD.values(), ids=SHEPPERD)
def test_matrix_goes_back_to_its_quaternion_whichever_component_is_largest(q):
    q = rotation.normalize(q)
    found = rotation.from_matrix(to_matrix(q))
    assert_allclose(found * np.sign(found @ q), q, rtol=0, atol=5e-16)  # measured 1.1e-16


@given(rotations)
def test_matrix_goes_back_to_its_quaternion(q):
    found = rotation.from_matrix(to_matrix(q))
    assert_allclose(found * np.sign(found @ q), q, rtol=0, atol=1e-15)  # measured 2.2e-16


@pytest.mark.parametrize(
    "R",
    [-np.eye(3), np.diag((1.0, 1.0, -1.0)), 1.001 * np.eye(3), np.full((3, 3), np.nan), np.eye(4)],
    ids=["point reflection", "mirror", "scaled", "not a number", "4x4"],
)
def test_matrix_that_is_no_rotation_is_refused(R):
    with pytest.raises(ValueError, match="is not a rotation"):
        rotation.from_matrix(R)


@pytest.mark.parametrize("angle", [0.0, 1e-300, 1e-12, 1e-6, 1.0, 3.0, math.pi])
def test_angle_between_from_tiny_to_half_a_turn(angle):
    turned = rotation.from_axis_angle((1, 0, 0), angle)
    assert rotation.angle_between(ONE, turned) == pytest.approx(angle, rel=1e-15, abs=0)
    assert rotation.angle_between(-ONE, turned) == pytest.approx(angle, rel=1e-15, abs=0)


@given(rotations, axes)
def test_angle_between_sees_a_picoradian_at_any_attitude(q, axis):
    turned = multiply(q, rotation.from_axis_angle(axis, 1e-12))
    assert rotation.angle_between(q, turned) == pytest.approx(1e-12, abs=2e-15)  # measured 2.0e-16


@given(quaternions, st.sampled_from([-1.0, 0.01, 7.0]))
def test_angle_between_attitudes_knows_neither_sign_nor_length(q, factor):
    assert rotation.angle_between(q, factor * q) < 2e-15  # measured 2.4e-16


@pytest.mark.parametrize("function", [rotation.normalize, quaternion.inverse, rotation.to_axis_angle, to_matrix])
@pytest.mark.parametrize("q", [(0, 0, 0, 0), (1e-7, 0, 0, 0), (math.nan, 0, 0, 1), (math.inf, 0, 0, 0)])
def test_quaternion_without_direction_is_refused(function, q):
    with pytest.raises(ValueError, match="an attitude needs finite components and a norm of at least 1e-06"):
        function(q)


@pytest.mark.parametrize("function", [norm, conjugate, rotation.normalize, rotation.norm_squared])
def test_quaternion_of_wrong_shape_is_refused(function):
    with pytest.raises(ValueError, match=r"quaternion has shape \(3,\); four numbers"):
        function((1.0, 0.0, 0.0))


def test_vector_of_wrong_shape_is_refused():
    with pytest.raises(ValueError, match=r"vector has shape \(4,\); three numbers"):
        rotate(ONE, ONE)


@pytest.mark.parametrize("axis", [(0, 0, 0), (math.nan, 0, 0)])
def test_axis_without_direction_is_refused(axis):
    with pytest.raises(ValueError, match="has no direction"):
        rotation.from_axis_angle(axis, 1.0)


@given(vectors, vectors)
def test_skew_matrix_times_a_vector_is_the_cross_product(v, w):
    assert_array_equal(rotation.skew(v).T, -rotation.skew(v))
    scale = np.linalg.norm(v) * np.linalg.norm(w)
    assert_allclose(rotation.skew(v) @ w, np.cross(v, w), rtol=0, atol=1e-15 * scale)  # measured 1.5e-16


def test_skew_matrix_is_printed_as_in_theory_2_2_3():
    assert_array_equal(rotation.skew((1, 2, 3)), ((0, -3, 2), (3, 0, -1), (-2, 1, 0)))


@given(quaternions, vectors, vectors)
def test_homogeneous_matrix_turns_and_then_moves_a_point(q, translation, point):
    moved = quaternion.to_homogeneous(q, translation) @ (*point, 1.0)
    assert_allclose(moved, (*(rotate(q, point) + translation), 1.0), rtol=0, atol=3e-14)  # measured 3.6e-15


@given(rotations, vectors)
def test_homogeneous_matrix_goes_back_to_quaternion_and_translation(q, translation):
    found, moved = quaternion.from_homogeneous(quaternion.to_homogeneous(q, translation))
    assert_allclose(found * np.sign(found @ q), q, rtol=0, atol=1e-15)  # measured 2.2e-16
    assert_array_equal(moved, translation)


@pytest.mark.parametrize(
    ("place", "value", "message"),
    [((3, 0), 0.1, "is not homogeneous"), ((3, 3), 2.0, "is not homogeneous"), ((0, 3), math.nan, "must be finite"),
     ((0, 0), 2.0, "is not a rotation")],
)  # fmt: skip
def test_matrix_that_is_not_homogeneous_is_refused(place, value, message):
    matrix = np.eye(4)
    matrix[place] = value
    with pytest.raises(ValueError, match=message):
        quaternion.from_homogeneous(matrix)


@pytest.mark.parametrize("function", [quaternion.from_homogeneous, quaternion.from_matrix_4x4])
@pytest.mark.parametrize("shape", [(), (3, 3), (5, 5), (4,), (4, 5), (16,), (1, 4, 4)])
def test_matrix_of_wrong_shape_is_refused(function, shape):
    with pytest.raises(ValueError, match=rf"matrix has shape {re.escape(str(shape))}; four rows of four numbers"):
        function(np.ones(shape))


def test_roll_pitch_yaw_turn_about_fixed_axes_in_this_order():
    quarter = math.pi / 2
    turn = rotation.from_roll_pitch_yaw(quarter, 0.0, quarter)  # y goes to z by the roll, and stays there in the yaw
    assert_allclose(rotate(turn, (0, 1, 0)), (0, 0, 1), rtol=0, atol=5e-16)  # measured 2.2e-16
    turn = rotation.from_roll_pitch_yaw(0.0, quarter, quarter)  # x goes to -z by the pitch
    assert_allclose(rotate(turn, (1, 0, 0)), (0, 0, -1), rtol=0, atol=5e-16)  # measured 2.2e-16
    assert_array_equal(rotation.from_roll_pitch_yaw(0.0, 0.0, 0.0), ONE)


@pytest.mark.parametrize("i", range(3))
def test_unit_vectors_are_the_rows_of_the_identity(i):
    assert kernels.unit_vector(i) == tuple(np.eye(3)[i])


@given(quaternions)
def test_axis_and_angle_are_those_of_the_rotation_not_of_the_sign_of_q(q):
    (axis, angle), (other_axis, other_angle) = (rotation.to_axis_angle(sign * np.array(q)) for sign in (1.0, -1.0))
    assert angle == other_angle
    if q[0] != 0.0 and angle != 0.0:  # a half turn about an axis is one about its opposite
        assert_array_equal(axis, other_axis)


def test_norm_squared_is_the_sum_of_squares():
    assert rotation.norm_squared((1.0, -2.0, 3.0, -5.0)) == 39.0
    for unit in np.eye(4):
        assert rotation.norm_squared(0.5 * unit) == 0.25


@pytest.mark.parametrize("shape", [(), (3,), (5,), (1, 4), (4, 1), (4, 4), (0,)])
def test_quaternion_of_any_other_shape_is_refused_with_its_shape(shape):
    with pytest.raises(ValueError, match=rf"quaternion has shape {re.escape(str(shape))}; four numbers \(w, x, y, z\)"):
        rotation.conjugate(np.ones(shape))


@pytest.mark.parametrize("shape", [(), (2,), (4,), (1, 3), (3, 1), (3, 3), (0,)])
def test_vector_of_any_other_shape_is_refused_with_its_shape(shape):
    with pytest.raises(ValueError, match=rf"vector has shape {re.escape(str(shape))}; three numbers \(x, y, z\)"):
        rotation.skew(np.ones(shape))


@given(vectors, vectors)
def test_cross_product_of_scalars_is_that_of_vectors(v, w):
    assert kernels.cross(*v, *w) == tuple(np.cross(v, w))


def test_homogeneous_matrix_without_a_translation_only_turns():
    q = rotation.normalize((0.4, 0.2, -0.8, 0.4))
    matrix = quaternion.to_homogeneous(q)
    assert_array_equal(matrix[:3, 3], 0.0)
    assert_array_equal(matrix[:3, :3], to_matrix(q))


def test_angles_are_exact_when_small_and_do_not_see_the_sign():
    angle = np.array([0.0, 1e-15, 1e-9, 0.3, 3.0])
    turned = np.stack([np.cos(angle / 2), 0 * angle, np.sin(angle / 2), 0 * angle], axis=1)
    still = np.array([[1.0, 0.0, 0.0, 0.0]] * 5)
    for sign in (1.0, -1.0):
        assert_allclose(rotation.angles_between(still, sign * turned), angle, rtol=1e-15)  # measured 0


def test_one_row_has_the_bits_of_many():
    rng = np.random.default_rng(7)
    q, a, b = rng.normal(size=(50, 4)), rng.normal(size=(50, 3)), rng.normal(size=(50, 3))
    assert_array_equal(rotation.cross_each(a, b), np.cross(a, b))
    assert_array_equal(rotation.cross_each(a, b), [rotation.cross_each(*row) for row in zip(a, b, strict=True)])
    assert_array_equal(rotation.rotate_each(q, a), [rotation.rotate_each(*row) for row in zip(q, a, strict=True)])
