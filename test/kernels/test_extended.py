"""Twice the precision, against rational numbers."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigid_body_sim.kernels import extended

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


def test_vector_turned_back_in_twice_the_precision():
    """Rational numbers know |q|² Rᵀ v, theory (2.7.21), exactly; a rounded rotation misses it by 1e-16."""
    random = np.random.default_rng(3)
    worst = 0
    for _ in range(200):
        numbers = [extended.two_sum(*pair) for pair in (random.normal(size=(7, 2)) * (1.0, 1e-17)).tolist()]
        (w, *u), v = [value(pair) for pair in numbers[:4]], [value(pair) for pair in numbers[4:]]
        found = extended.xrotate_back(*[part for pair in numbers for part in pair])
        uu, uv = dot(u, u), dot(u, v)
        odd = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
        true = [(w * w - uu) * v[i] + 2 * uv * u[i] - 2 * w * odd[i] for i in range(3)]
        assert abs(value(found[0:2]) - (w * w + uu)) <= Fraction(2) ** -100 * (w * w + uu)
        errors = [abs(value(found[2 + 2 * i : 4 + 2 * i]) - true[i]) for i in range(3)]
        worst = max(worst, float(max(errors) / ((w * w + uu) * max(map(abs, v)))))
    assert worst < 2.0**-100  # 7.9e-31; measured 4.6e-32


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def test_division_by_a_number_next_to_one():
    qq = extended.two_sum(1.0, 3e-16)
    quotient = value(extended.xunscale(0.3, 1e-18, *qq))
    exact = (Fraction(0.3) + Fraction(1e-18)) / value(qq)
    assert abs(quotient / exact - 1) < 1e-30  # measured 7.9e-32
