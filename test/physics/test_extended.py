"""Twice the precision, against rational numbers."""

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigid_body_sim.physics import extended

pytestmark = pytest.mark.no_numba

moderate = st.floats(-1e100, 1e100).filter(lambda x: x == 0.0 or abs(x) > 1e-100)


def value(pair):
    return Fraction(pair[0]) + Fraction(pair[1])


@given(moderate, moderate)
def test_sum_and_product_with_what_rounding_dropped_are_exact(a, b):
    assert value(extended.two_sum(a, b)) == Fraction(a) + Fraction(b)
    assert value(extended.two_product(a, b)) == Fraction(a) * Fraction(b)
    assert extended.two_sum(a, b)[0] == a + b
    assert extended.two_product(a, b)[0] == a * b


@given(*[st.floats(-1.0, 1.0).filter(lambda x: x == 0.0 or abs(x) > 1e-20) for _ in range(4)])
def test_sum_and_product_of_extended_numbers(a, b, c, d):
    one, other = extended.two_sum(a, 2.0**-60 * b), extended.two_sum(c, 2.0**-60 * d)
    error = value(extended.xadd(*one, *other)) - (value(one) + value(other))
    assert abs(error) <= Fraction(2) ** -104 * (abs(value(one)) + abs(value(other)))
    error = value(extended.xmultiply(*one, *other)) - value(one) * value(other)
    assert abs(error) <= Fraction(2) ** -101 * abs(value(one) * value(other))
