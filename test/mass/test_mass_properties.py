"""Mass, centre of mass and inertia: points, assemblies, and the parallel-axis theorem (theory 2.4)."""

import math
from dataclasses import FrozenInstanceError

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from rigid_body_sim import Body
from rigid_body_sim.mass.mass_properties import MassProperties, combine, mass_of, of_point_masses
from rigid_body_sim.values import inertia, rotation

pytestmark = pytest.mark.no_numba

seeds = st.integers(0, 10**6)


def cloud(seed, n=12):
    """Masses (n,) [kg] and positions (n, 3) [m], not centred anywhere in particular."""
    rng = np.random.default_rng(seed)
    return rng.uniform(0.1, 2.0, n), rng.normal(size=(n, 3)) + rng.normal(size=3)


def summed_entry_by_entry(masses, positions):
    """Theory (2.4.2) as printed."""
    total = np.zeros((3, 3))
    for m, (x, y, z) in zip(masses, positions, strict=True):
        total += m * np.array(
            ((y * y + z * z, -x * y, -x * z), (-y * x, z * z + x * x, -y * z), (-z * x, -z * y, x * x + y * y))
        )
    return total


@given(seeds)
def test_inertia_of_points_is_the_sum_2_4_2(seed):
    masses, positions = cloud(seed)
    expected = summed_entry_by_entry(masses, positions)
    found = inertia.of_point_masses(masses, positions)
    assert_allclose(found, expected, rtol=0, atol=3e-15 * np.trace(expected))  # measured 2.3e-16 of that
    assert_array_equal(found, found.T)


@given(seeds)
def test_points_are_the_same_about_their_centre_and_moved_back(seed):
    masses, positions = cloud(seed)
    found = of_point_masses(masses, positions)
    expected = summed_entry_by_entry(masses, positions)
    assert found.mass == pytest.approx(masses.sum(), rel=1e-15, abs=0)  # measured 0
    assert_allclose(
        found.center_of_mass, np.average(positions, axis=0, weights=masses), rtol=0, atol=1e-14
    )  # measured 8.9e-16
    assert_allclose(
        found.inertia_about((0, 0, 0)), expected, rtol=0, atol=3e-15 * np.trace(expected)
    )  # measured 2.1e-16


@given(seeds, seeds)
def test_turned_points_have_the_turned_tensor_2_4_11(seed, other):
    masses, positions = cloud(seed)
    q = rotation.normalize(np.random.default_rng(other).normal(size=4))
    turned = of_point_masses(masses, positions @ rotation.to_matrix(q).T)
    found = of_point_masses(masses, positions).placed(q=q)
    assert_allclose(found.inertia, turned.inertia, rtol=0, atol=3e-15 * np.trace(turned.inertia))  # measured 3.1e-16
    assert_allclose(found.center_of_mass, turned.center_of_mass, rtol=0, atol=1e-14)  # measured 8.9e-16
    assert_array_equal(found.inertia, found.inertia.T)


@given(st.lists(st.tuples(seeds, seeds), min_size=1, max_size=5))
def test_assembly_is_the_sum_over_all_points_of_its_placed_parts(parts):
    """Random assemblies of turned and moved point clouds, against one sum over every point in its place."""
    placed, all_masses, all_positions = [], [], []
    for seed, other in parts:
        masses, positions = cloud(seed)
        rng = np.random.default_rng(other)
        q, where = rng.normal(size=4), 3.0 * rng.normal(size=3)
        placed.append(of_point_masses(masses, positions).placed(where, q))
        all_masses.append(masses)
        all_positions.append(where + positions @ rotation.to_matrix(q).T)
    expected = of_point_masses(np.concatenate(all_masses), np.concatenate(all_positions))
    found = combine(placed)
    size = np.trace(expected.inertia)
    assert found.mass == pytest.approx(expected.mass, rel=5e-15, abs=0)  # measured 4.1e-16
    assert_allclose(found.center_of_mass, expected.center_of_mass, rtol=0, atol=2e-14)  # measured 1.8e-15
    assert_allclose(found.inertia, expected.inertia, rtol=0, atol=5e-15 * size)  # measured 4.4e-16


def test_dumb_bell_of_two_points():
    """m = 1 and 3 kg, 2 m apart along x: centre at 3/4, reduced mass 3/4 kg, I = 3 kg m² across, 0 along."""
    found = of_point_masses((1.0, 3.0), ((0, 0, 0), (2, 0, 0)))
    assert_array_equal(found.center_of_mass, (1.5, 0, 0))
    assert_array_equal(found.inertia, np.diag((0.0, 3.0, 3.0)))
    with pytest.raises(ValueError, match="not positive definite"):
        found.body()


def test_body_is_that_of_the_properties():
    found = MassProperties(2.0, (0.1, 0.2, 0.25), (1, 2, 3)).body()
    assert found == Body(2.0, (0.1, 0.2, 0.25), (1, 2, 3))


def test_part_that_is_not_moved_keeps_every_bit():
    part = MassProperties(2.0, (0.1, 0.2, 0.25, 0.01, 0.02, 0.03), (1, 2, 3))
    for same in (part.placed(), combine([part])):
        assert same.mass == part.mass
        assert_array_equal(same.center_of_mass, part.center_of_mass)
        assert_array_equal(same.inertia, part.inertia)


@pytest.mark.parametrize(
    ("masses", "positions", "message"),
    [
        ((1.0, 2.0), ((0, 0, 0),), r"masses have shape \(2,\) and positions \(1, 3\)"),
        ((1.0,), (0, 0, 0), r"\(n,\) and \(n, 3\) belong together"),
        ((-1.0,), ((0, 0, 0),), "a point mass is negative or not finite"),
        ((math.nan,), ((0, 0, 0),), "a point mass is negative or not finite"),
        ((1.0,), ((0, math.inf, 0),), "positions finite"),
        ((0.0,), ((0, 0, 0),), "mass of all points 0 kg is not a finite number greater than zero"),
        ((), np.zeros((0, 3)), "mass of all points 0 kg"),
    ],
)
def test_bad_points_are_refused(masses, positions, message):
    with pytest.raises(ValueError, match=message):
        of_point_masses(masses, positions)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((0.0, (1, 1, 1)), "mass 0 kg is not a finite number greater than zero"),
        ((1.0, (1, 1, math.nan)), "not finite"),
        ((1.0, (1, 1)), "inertia has shape"),
        ((1.0, (1, 1, 1), (0, 0)), "center_of_mass .* must be three finite numbers"),
    ],
)
def test_bad_properties_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        MassProperties(*arguments)


def test_assembly_needs_parts():
    with pytest.raises(ValueError, match="has no parts; give at least one"):
        combine([])


@pytest.mark.parametrize("given_values", [(None, None), (1.0, 1.0)])
def test_exactly_one_of_mass_and_density_is_given(given_values):
    with pytest.raises(ValueError, match="give exactly one of them"):
        mass_of(1.0, *given_values)


@pytest.mark.parametrize(
    ("given_values", "message"),
    [
        ((0.0, None), "^mass 0 kg"),
        ((None, -1.0), "^density -1 kg/m³"),
        ((None, 1e300), "^density 1e\\+300 kg/m³ is not between"),
        ((None, 1e99), "^mass from density and volume 1e\\+299 kg is not between"),
    ],
)
def test_mass_and_density_are_positive_and_finite(given_values, message):
    with pytest.raises(ValueError, match=message):
        mass_of(1e200, *given_values)


def test_mass_properties_cannot_be_changed_and_are_compared_as_the_things_they_are():
    one, same = (MassProperties(1.0, (1, 1, 1)) for _ in range(2))
    with pytest.raises(FrozenInstanceError):
        one.mass = 2.0
    assert one == one and one != same
