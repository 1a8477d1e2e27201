"""The density integral (2.4.5): solids whose density varies, coordinates of any kind, and what it refuses."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rigid_body_sim.mass.density import of_solid

pytestmark = pytest.mark.no_numba

UNIT = ((0, 0, 0), (1, 1, 1))


def polar(r, phi, z):
    return r * np.cos(phi), r * np.sin(phi), z


def test_box_whose_density_grows_along_x():
    """ρ = x in the unit cube: m = 1/2, centre (2/3, 1/2, 1/2), and the variances below times m."""
    found = of_solid(lambda x, y, z: x, *UNIT)
    assert found.mass == pytest.approx(1 / 2, rel=1e-14, abs=0)  # measured 6.7e-16
    assert_allclose(found.center_of_mass, (2 / 3, 1 / 2, 1 / 2), rtol=0, atol=1e-14)  # measured 5.6e-16
    across, along = 1 / 12, 1 / 18  # variance of y or z, and of x with the weight 2x
    expected = 0.5 * np.diag((2 * across, across + along, across + along))
    assert_allclose(found.inertia, expected, rtol=0, atol=1e-15)  # measured 5.6e-17


def test_products_of_inertia_have_the_sign_of_2_4_5():
    """ρ = x + y: m = 1, centre 7/12 in x and y, ∭ρxy = 1/3, so −∭ρ (x − 7/12)(y − 7/12) = 49/144 − 1/3 = 1/144."""
    found = of_solid(lambda x, y, z: x + y, *UNIT)
    assert_allclose(found.inertia[0, 1], 1 / 144, rtol=1e-14)  # measured 5.0e-16


def test_gaussian_ball_with_its_own_coordinates():
    """ρ = exp(−r²) inside r = 1: I = 8π/3 ∫ r⁴ exp(−r²) dr, worked out with erf."""
    found = of_solid(
        lambda x, y, z: np.exp(-(x * x + y * y + z * z)),
        (0, 0, 0),
        (1, math.pi, 2 * math.pi),
        lambda r, t, p: (r * np.sin(t) * np.cos(p), r * np.sin(t) * np.sin(p), r * np.cos(t)),
    )
    root = math.sqrt(math.pi) / 2 * math.erf(1.0)
    r2 = (root - math.exp(-1)) / 2  # ∫ r² exp(−r²) dr
    r4 = 3 / 2 * r2 - math.exp(-1) / 2
    assert found.mass == pytest.approx(4 * math.pi * r2, rel=1e-14, abs=0)  # measured 9.3e-16
    assert_allclose(found.inertia, 8 * math.pi / 3 * r4 * np.eye(3), rtol=0, atol=1e-14)  # measured 4.4e-16


def test_left_handed_coordinates_give_the_same():
    right = of_solid(2.0, (0.1, 0, 0), (1, 3, 1), polar)
    left = of_solid(2.0, (0.1, 0, 0), (1, 3, 1), lambda r, phi, z: polar(r, 3 - phi, z))
    assert left.mass == pytest.approx(right.mass, rel=2e-15, abs=0)  # measured 1.5e-16
    assert_allclose(left.inertia, right.inertia, rtol=0, atol=2e-15)  # measured 1.1e-16


def test_solid_far_away_is_as_good():
    near, far = (of_solid(1.0, (c, 0, 0), (c + 1, 1, 1)) for c in (0.0, 1000.0))
    assert_allclose(far.inertia, near.inertia, rtol=0, atol=1e-13)  # measured 5.4e-15


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((1.0, (0, 0), (1, 1, 1)), "must be three finite numbers each|inhomogeneous"),
        ((1.0, (0, 0, 0), (1, 0, 1)), "lower before upper"),
        ((1.0, (0, 0, 0), (1, -1, 1)), "lower before upper"),
        ((1.0, (0, 0, 0), (1, math.inf, 1)), "must be three finite numbers each"),
        ((-1.0, *UNIT), "density is negative or not finite"),
        ((lambda x, y, z: np.log(x - 2), *UNIT), "density is negative or not finite"),
        ((0.0, *UNIT), "has no mass"),
        ((1.0, *UNIT, lambda x, y, z: ((x - 0.5) ** 2, y, z)), "folds the solid over itself"),
        ((1.0, *UNIT, lambda x, y, z: (x / 0.0, y, z)), "a coordinate that is not finite"),
        ((lambda x, y, z: np.where(x < 0.3, 1.0, 0.0), *UNIT), r"still changes by .* at 64 points a side"),
    ],
)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_what_cannot_be_integrated_is_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        of_solid(*arguments)
