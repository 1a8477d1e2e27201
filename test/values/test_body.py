"""A body and the rules that it must obey."""

import math
from collections.abc import Hashable

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from rigid_body_sim import Body

pytestmark = pytest.mark.no_numba

SPHERE = (0.1, 0.1, 0.1)


@pytest.mark.parametrize("mass", [0.0, -1.0, math.nan, math.inf])
def test_mass_that_is_not_a_finite_positive_number_is_refused(mass):
    with pytest.raises(ValueError, match=f"mass {mass:g} kg is not a finite number greater than zero"):
        Body(mass, SPHERE)


@pytest.mark.parametrize("center", [(0.0, 0.0), (0.0, 0.0, math.nan), (math.inf, 0.0, 0.0), 1.0])
def test_center_of_mass_that_is_not_three_finite_numbers_is_refused(center):
    with pytest.raises(ValueError, match=r"center_of_mass .* must be three finite numbers in m"):
        Body(1.0, SPHERE, center)


@pytest.mark.parametrize(
    ("inertia", "rule"),
    [
        ((0.1, 0.1, math.nan), "not finite"),
        ((0.1, 0.1), "has shape"),
        ([[1, 0, 0], [0.1, 1, 0], [0, 0, 1]], "not symmetric"),
        ((0.1, 0.1, 0.0), "not positive definite"),
        ((0.1, 0.1, 0.3), "triangle inequality"),
    ],
)
def test_body_obeys_every_rule_of_inertia(inertia, rule):
    with pytest.raises(ValueError, match=rule):
        Body(1.0, inertia)


def test_inertia_comes_back_in_the_order_of_urdf():
    entries = (0.31, 0.42, 0.53, -0.04, 0.06, 0.03)
    assert_array_equal(Body(1.0, entries).inertia_entries, entries)


def test_body_cannot_be_changed_behind_the_back_of_a_simulation():
    body = Body(1.0, SPHERE)
    for array in (body.inertia, body.center_of_mass, body.principal_moments, body.q_body_principal):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 2.0


def test_body_does_not_follow_the_array_that_it_was_made_from():
    center = np.zeros(3)
    body = Body(1.0, SPHERE, center)
    center[0] = 1.0
    assert_array_equal(body.center_of_mass, (0, 0, 0))


def test_bodies_are_equal_when_mass_inertia_and_center_of_mass_are():
    assert Body(1.0, SPHERE) == Body(1.0, np.diag(SPHERE))
    assert Body(1.0, SPHERE) != Body(2.0, SPHERE)
    assert Body(1.0, SPHERE) != Body(1.0, (0.1, 0.1, 0.11))
    assert Body(1.0, SPHERE) != Body(1.0, SPHERE, (0.0, 0.0, 0.1))
    assert Body(1.0, SPHERE) != "a body"
    assert not isinstance(Body(1.0, SPHERE), Hashable)


def test_body_shown_can_be_typed_in_again():
    body = Body(2.5, (0.31, 0.42, 0.53, -0.04, 0.06, 0.03), (0.07, -0.04, 0.05))
    assert eval(repr(body)) == body


def test_centre_of_mass_is_the_origin_unless_it_is_given():
    assert Body(1.0, (1, 1, 1)).center_of_mass.tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("mass", [1e-100, 1e100])
def test_bounds_of_mass_and_centre_of_mass_are_themselves_allowed(mass):
    assert Body(mass, (1, 1, 1), (0.0, -1e100, 0.0)).mass == mass


@pytest.mark.parametrize("mass", [math.nextafter(1e-100, 0.0), math.nextafter(1e100, math.inf), 1e-300, 1e300])
def test_mass_beyond_its_bounds_is_refused(mass):
    with pytest.raises(ValueError, match=r"mass .* kg is not between 1e-100 and 1e\+100 kg; beyond these, products of"):
        Body(mass, (1, 1, 1))


@pytest.mark.parametrize("far", [math.nextafter(1e100, math.inf), -1e300])
@pytest.mark.parametrize("axis", range(3))
def test_centre_of_mass_too_far_away_is_refused(far, axis):
    with pytest.raises(ValueError, match=r"center_of_mass .* is farther than 1e\+100 m from the origin"):
        Body(1.0, (1, 1, 1), [far * (k == axis) for k in range(3)])


def test_lighter_and_heavier_bodies_differ_whichever_is_asked():
    light, heavy = Body(1.0, (1, 1, 1)), Body(2.0, (1, 1, 1))
    assert light != heavy and heavy != light
