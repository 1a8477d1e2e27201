"""Held wrenches and the rules for their numbers."""

import math
from collections.abc import Hashable
from decimal import Decimal

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from rigid_body_sim import Wrench
from rigid_body_sim.values import rotation
from rigid_body_sim.values.wrench import total

pytestmark = pytest.mark.no_numba

NAMES = ["force_body", "torque_body", "force_world", "torque_world"]


def test_wrench_is_zero_when_nothing_is_given():
    assert Wrench().values == (0.0,) * 12
    assert Wrench().points == ()


def test_each_part_is_read_back_under_its_own_name():
    parts = {name: [3.0 * k, 3.0 * k + 1, 3.0 * k + 2] for k, name in enumerate(NAMES)}
    wrench = Wrench(**parts)
    for name in NAMES:
        assert_array_equal(getattr(wrench, name), parts[name])


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    "value", [(math.nan, 0, 0), (0, math.inf, 0), (0, 0, -math.inf), (1, 2), (1, 2, 3, 4), None, 1.0, ("1", "2", "x")]
)
def test_part_that_is_not_three_finite_numbers_is_refused_by_name(name, value):
    with pytest.raises(ValueError, match=rf"^{name} .* must be three finite numbers \(x, y, z\)"):
        Wrench(**{name: value})


def test_infinities_of_opposite_sign_do_not_cancel():
    with pytest.raises(ValueError, match=r"^force_body .* finite"):
        Wrench(force_body=(math.inf, 0, 0), torque_body=(-math.inf, 0, 0))


@pytest.mark.parametrize("other", range(1, 12))
@pytest.mark.parametrize("sign", [1, -1])
def test_wrench_too_large_to_be_added_up_is_refused(other, sign):
    values = np.zeros(12)
    values[[0, other]] = sign * 1e308
    with pytest.raises(ValueError, match="is too large; the sum of its components must be a finite number"):
        Wrench(*values.reshape(4, 3).tolist())


@pytest.mark.parametrize(
    ("points", "name"),
    [
        ([((0, 0, math.nan), (1, 0, 0))], "^point "),
        ([((0, 0), (1, 0, 0))], "^point "),
        ([((0, 0, 1), (1, 0, math.inf))], "^force at a point "),
        ([((0, 0, 1), (1, 0, 0)), ((0, 0, 1), None)], "^force at a point "),
    ],
)
def test_point_that_is_not_finite_is_refused(points, name):
    with pytest.raises(ValueError, match=f"{name}.* must be three finite numbers"):
        Wrench(points=points)


def test_points_may_come_from_a_generator():
    wrench = Wrench(points=(((k, 0, 0), (0, 0, 1)) for k in range(2)))
    assert wrench.points == (((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))


def test_wrenches_are_equal_when_all_their_parts_are():
    assert Wrench(force_body=(1, 0, 0)) == Wrench((1.0, 0.0, 0.0))
    assert Wrench(force_body=(1, 0, 0)) != Wrench(force_world=(1, 0, 0))
    assert Wrench(force_world=(1, 0, 0)) != Wrench(force_body=(1, 0, 0))
    assert Wrench(points=[((0, 0, 0), (1, 0, 0))]) != Wrench()
    assert not isinstance(Wrench(), Hashable)


def test_wrench_shown_can_be_typed_in_again():
    wrench = Wrench((1, 2, 3), (4, 5, 6), (7, 8, 9), (1, 1, 1), [((0.1, 0.2, 0.3), (4, 5, 6))])
    assert eval(repr(wrench)) == wrench


@pytest.mark.parametrize(
    "force",
    [np.eye(3), "123", (1j, 0.0, 0.0), (10**400, 0, 0), 5.0, None],
    ids=["matrix", "text", "complex", "huge", "number", "none"],
)
def test_force_that_is_none_is_refused_by_its_name(force):
    with pytest.raises(ValueError, match=r"(?s)force_body .* must be three finite numbers"):
        Wrench(force_body=force)


def test_numbers_of_other_types_are_taken():
    assert Wrench(force_body=(Decimal("0.5"), 1, np.float32(2))).values[:3] == (0.5, 1.0, 2.0)


def test_points_may_be_an_array():
    assert Wrench(points=np.ones((2, 2, 3))).points == (((1.0, 1.0, 1.0), (1.0, 1.0, 1.0)),) * 2


def test_point_without_a_force_is_refused():
    with pytest.raises(ValueError, match="must be a pair"):
        Wrench(points=[(1.0, 2.0, 3.0)])


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("axis", range(3))
def test_each_component_alone_turns_the_body_unless_it_is_a_force_in_world_axes(name, axis):
    wrench = Wrench(**{name: [-1e-300 * (k == axis) for k in range(3)]})
    assert wrench.turns is (name != "force_world")


def test_forces_at_points_may_turn_the_body_and_nothing_does_not():
    assert Wrench(points=[((0, 0, 0), (1, 0, 0))]).turns is True
    assert Wrench().turns is False


def test_wrenches_that_differ_in_their_points_alone_are_not_equal():
    one, other = (Wrench((1, 2, 3), points=[((0, 0, 0), (k, 0, 0))]) for k in (1, 2))
    assert one != other and one == Wrench((1, 2, 3), points=[((0, 0, 0), (1, 0, 0))])
    assert one != "Wrench"


MANY = [Wrench((0.1, 1, 2), (3, 4, 5), (6, 7, 8), (9, 10, 11), [((1, 2, 3), (4, 5, 6))]),
        Wrench((0.2, 0, 1), (1, 0, 2), (2, 0, 1), (0, 3, 1)),
        Wrench((0.3, 0, 0), points=[((0, 1, 0), (7, 8, 9))])]  # fmt: skip


def test_total_adds_each_component_and_keeps_all_points():
    sums = np.sum([wrench.values for wrench in MANY], axis=0)
    assert total(MANY).values == (0.6, *sums[1:])  # rounded once: 0.1 + 0.2 + 0.3 is 0.6000000000000001
    assert total(MANY).points == (*MANY[0].points, *MANY[2].points)
    assert total(reversed(MANY)).values == total(MANY).values
    assert total([]) == Wrench()


@pytest.mark.parametrize("greatest", [1e308, 1.7e308])
def test_total_beyond_the_range_of_floats_is_refused(greatest):
    for axis in range(12):
        one = Wrench(*np.split(np.where(np.arange(12) == axis, greatest, 0.0), 4))
        with pytest.raises(ValueError, match="add up to more than a float holds; give smaller ones"):
            total([one, one])
        assert total([one, Wrench(*(-part for part in np.split(np.array(one.values), 4)))]) == Wrench()


def test_wrench_about_the_origin_is_what_its_parts_are_by_the_rotation_matrix():
    wrench, center, q = MANY[0], np.array((0.3, -0.2, 0.5)), rotation.normalize((0.3, -0.5, 0.7, 0.2))
    to_body = rotation.to_matrix(q).T
    ((point, force),) = wrench.points
    forces = [(np.zeros(3), wrench.force_body), (center, to_body @ wrench.force_world), (point, to_body @ force)]
    moments = sum(np.cross(arm, force) for arm, force in forces)
    expected = *sum(force for _, force in forces), *(moments + wrench.torque_body + to_body @ wrench.torque_world)
    # measured 7.1e-15
    assert_allclose(wrench.about_origin(q, center), expected, rtol=0, atol=2e-14)
