"""Elliptic integrals and functions against mpmath, errors in units of round-off."""

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mpf

from rigid_body_sim.kernels import elliptic

pytestmark = pytest.mark.no_numba

EPS = np.finfo(float).eps
exponents = st.floats(-30.0, 0.0)


def units(found, true, size=None):
    """Error in units of round-off, of the true value or of ``size``."""
    return abs(float((mpf(found) - true) / (true if size is None else size))) / EPS


@given(exponents)
def test_quarter_period(exponent):
    with mpmath.workdps(50):
        mc = 10.0**exponent
        assert units(elliptic.quarter_period(mc), mpmath.ellipk(1 - mpf(mc))) < 5  # measured 2.2


@given(exponents, st.floats(-1.0, 1.0))
def test_jacobi_functions(exponent, share):
    with mpmath.workdps(50):
        mc = 10.0**exponent
        u = share * elliptic.quarter_period(mc)
        found = elliptic.jacobi(u, mc, np.zeros(elliptic.JACOBI_WORK))
        for name, value in zip(("sn", "cn", "dn"), found, strict=True):
            assert units(value, mpmath.ellipfun(name, mpf(u), m=1 - mpf(mc)), size=1) < 5  # measured 1.3


@given(st.floats(-30.0, 30.0))
def test_jacobi_functions_on_the_separatrix_are_hyperbolic(u):
    found = elliptic.jacobi(u, 0.0, np.zeros(elliptic.JACOBI_WORK))
    for value, true in zip(found, (mpmath.tanh(u), mpmath.sech(u), mpmath.sech(u)), strict=True):
        assert units(value, true, size=1) < 3


def test_hyperbolic_functions_far_out_do_not_overflow():
    assert elliptic.jacobi(-1e6, 0.0, np.zeros(elliptic.JACOBI_WORK)) == (-1.0, 0.0, 0.0)


@given(exponents, exponents, st.booleans())
def test_carlson_rf(one, other, zero):
    with mpmath.workdps(50):
        x, y = 0.0 if zero else 10.0**one, 10.0**other
        assert units(elliptic.carlson_rf(x, y, 1.0), mpmath.elliprf(x, y, 1)) < 6  # measured 2.1


@given(exponents, exponents, st.floats(0.001, 1.0))
def test_carlson_rj(one, other, share):
    with mpmath.workdps(50):
        x, y = sorted((10.0**one, 10.0**other))
        p = x + share * (y - x)
        delta = float((mpf(p) - x) * (mpf(p) - y) * (mpf(p) - 1))
        assert units(elliptic.carlson_rj(x, y, 1.0, p, max(delta, 0.0)), mpmath.elliprj(x, y, 1, p)) < 8  # measured 3.0
