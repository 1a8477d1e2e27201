"""Held wrenches and the rules for their numbers."""

import math
from decimal import Decimal

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from rigid_body_sim import Wrench

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


def test_wrench_too_large_to_be_added_up_is_refused():
    with pytest.raises(ValueError, match="is too large; the sum of its components must be a finite number"):
        Wrench(force_body=(1e308, 1e308, 0))


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
    assert Wrench(points=[((0, 0, 0), (1, 0, 0))]) != Wrench()


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
