"""Volume integrals of closed triangle meshes, and one failing mesh for each rule."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from rigid_body_sim.physics import rotation
from rigid_body_sim.physics.mass_properties import combine, of_point_masses
from rigid_body_sim.physics.mesh import _parts, of_mesh

pytestmark = pytest.mark.no_numba

TETRAHEDRON = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
FACES = np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])


def test_tetrahedron_of_the_unit_axes():
    """V = 1/6, centre (1/4, 1/4, 1/4), ∭x² = 1/60 and ∭xy = 1/120 about the corner."""
    found = of_mesh(TETRAHEDRON, FACES, density=1.0)
    assert found.mass == pytest.approx(1 / 6, rel=1e-15, abs=0)  # measured 0
    assert_allclose(found.center_of_mass, 0.25, rtol=0, atol=1e-16)  # measured 0
    about_corner = np.full((3, 3), -1 / 120) + (2 / 60 + 1 / 120) * np.eye(3)
    assert_allclose(found.inertia_about((0, 0, 0)), about_corner, rtol=0, atol=1e-16)  # measured 6.9e-18


@given(st.integers(0, 10**6))
def test_any_tetrahedron_is_four_corners_and_a_middle(seed):
    """A solid tetrahedron has the inertia of m/20 at each corner and 4m/5 at its centre."""
    corners = np.random.default_rng(seed).normal(size=(4, 3)) + 3.0
    if np.linalg.det(corners[1:] - corners[0]) < 0:
        corners = corners[[0, 2, 1, 3]]
    found = of_mesh(corners, FACES, mass=2.0)
    expected = of_point_masses([0.1] * 4 + [1.6], [*corners, corners.mean(axis=0)])
    assert_allclose(found.center_of_mass, expected.center_of_mass, rtol=0, atol=1e-14)  # measured 8.9e-16
    assert_allclose(found.inertia, expected.inertia, rtol=0, atol=1e-12)  # measured 9.0e-14


@given(st.integers(0, 10**6))
def test_moved_and_turned_mesh_has_moved_and_turned_properties(seed):
    rng = np.random.default_rng(seed)
    q, where = rotation.normalize(rng.normal(size=4)), 10.0 * rng.normal(size=3)
    expected = of_mesh(TETRAHEDRON, FACES, mass=2.0).placed(where, q)
    found = of_mesh(where + TETRAHEDRON @ rotation.to_matrix(q).T, FACES, mass=2.0)
    assert_allclose(found.center_of_mass, expected.center_of_mass, rtol=0, atol=5e-14)  # measured 3.6e-15
    assert_allclose(found.inertia, expected.inertia, rtol=0, atol=1e-14)  # measured 5.3e-16


def test_mesh_a_kilometre_away_loses_no_digits_of_its_own():
    near, far = (of_mesh(TETRAHEDRON + shift, FACES, mass=1.0) for shift in (0.0, 1024.0))
    assert_allclose(
        far.inertia, near.inertia, rtol=0, atol=1e-16
    )  # measured 0: 1024 adds no round-off to these corners


def test_hole_is_a_surface_seen_from_the_material():
    outer, inner = of_mesh(TETRAHEDRON, FACES, density=3.0), of_mesh(0.1 + TETRAHEDRON / 4, FACES, density=3.0)
    both = of_mesh(
        np.concatenate((TETRAHEDRON, 0.1 + TETRAHEDRON / 4)), np.concatenate((FACES, FACES[:, ::-1] + 4)), density=3.0
    )
    assert both.mass == pytest.approx(outer.mass - inner.mass, rel=2e-15, abs=0)  # measured 2.3e-16
    difference = outer.inertia_about((0, 0, 0)) - inner.inertia_about((0, 0, 0))
    assert_allclose(both.inertia_about((0, 0, 0)), difference, rtol=0, atol=1e-16)  # measured 1.0e-17


def test_parts_side_by_side_are_one_thing():
    two = np.concatenate((TETRAHEDRON, 2.0 + TETRAHEDRON)), np.concatenate((FACES, FACES + 4))
    one = of_mesh(TETRAHEDRON, FACES, density=3.0)
    found, expected = of_mesh(*two, density=3.0), combine([one, one.placed((2, 2, 2))])
    assert found.mass == pytest.approx(expected.mass, rel=1e-15, abs=0)  # measured 0
    assert_allclose(found.inertia, expected.inertia, rtol=0, atol=1e-14)  # measured 8.9e-16


def test_long_strip_is_one_part():
    """A tube of 2000 rings, numbered so that neighbours are far apart."""
    n = 2000
    ring = [(math.cos(a), math.sin(a)) for a in (0.0, 2.1, 4.2)]
    corners = np.array([(x, y, z) for z in np.linspace(0, 50, n) for x, y in ring])
    sides = [(3 * k + a, 3 * k + b, 3 * k + 3 + b) for k in range(n - 1) for a, b in ((0, 1), (1, 2), (2, 0))]
    sides += [(3 * k + a, 3 * k + 3 + b, 3 * k + 3 + a) for k in range(n - 1) for a, b in ((0, 1), (1, 2), (2, 0))]
    triangles = np.array([*sides, (0, 2, 1), (3 * n - 3, 3 * n - 2, 3 * n - 1)])
    order = np.random.default_rng(1).permutation(len(corners))
    shuffled = np.empty_like(corners)
    shuffled[order] = corners
    assert set(_parts(order[triangles], len(corners)).tolist()) == {0}
    (a, b), (c, d) = np.subtract(ring[1], ring[0]), np.subtract(ring[2], ring[0])
    area = (a * d - b * c) / 2
    assert of_mesh(shuffled, order[triangles], density=1.0).mass == pytest.approx(
        50 * area, rel=1e-14, abs=0
    )  # measured 4.4e-16


def test_vertices_that_no_triangle_uses_do_not_matter():
    more = np.concatenate((TETRAHEDRON, [(50, 60, 70)]))
    found = of_mesh(more, FACES, mass=1.0)
    assert_allclose(
        found.inertia, of_mesh(TETRAHEDRON, FACES, mass=1.0).inertia, rtol=0, atol=2e-13
    )  # measured 1.5e-14


def with_flipped(faces, k):
    flipped = faces.copy()
    flipped[k] = flipped[k, ::-1]
    return flipped


BAD = {  # vertices, triangles, and what the message must say
    "open": (TETRAHEDRON, FACES[:3], r"mesh is open: 3 edges belong to one triangle only, such as .*\(1, 2\)"),
    "inside out": (TETRAHEDRON, FACES[:, ::-1], r"mesh is inside out: its volume is -0\.166667 m³"),
    "one flipped": (TETRAHEDRON, with_flipped(FACES, 1), "mesh turns inside out: at 3 edges"),
    "one part inside out": (
        np.concatenate((TETRAHEDRON, 2.0 + TETRAHEDRON / 4)),
        np.concatenate((FACES, FACES[:, ::-1] + 4)),
        r"mesh is inside out where vertex 4 is: that part has the volume -0\.00260417 m³ and is no hole",
    ),
    "fin": (
        np.concatenate((TETRAHEDRON, [(1, 1, 1)])),
        np.concatenate((FACES, [(0, 1, 4), (0, 4, 1)])),
        r"mesh is not a surface: 1 edges belong to more than two triangles, such as that of vertices \(0, 1\)",
    ),
    "flat": (TETRAHEDRON * (1, 1, 0), FACES, "mesh encloses no volume"),
    "two-sided sheet": (TETRAHEDRON, np.array([(0, 1, 2), (0, 2, 1)]), "mesh encloses no volume"),
    "all in a point": (np.zeros((4, 3)), FACES, "mesh encloses no volume"),
    "corner twice": (TETRAHEDRON, np.array([(0, 1, 1)]), "mesh triangle 0 has one corner twice"),
    "no such vertex": (TETRAHEDRON, np.array([(0, 1, 4)]), "a corner that is no vertex; give whole numbers 0 to 3"),
    "negative index": (TETRAHEDRON, np.array([(0, 1, -1)]), "a corner that is no vertex"),
    "broken index": (TETRAHEDRON, np.array([(0, 1, 2.0)]), "a corner that is no vertex"),
    "not a number": (TETRAHEDRON * (1, 1, math.nan), FACES, "a vertex that is not finite"),
    "no triangles": (TETRAHEDRON, np.zeros((0, 3), int), "with at least one triangle are needed"),
    "quads": (TETRAHEDRON, np.array([(0, 1, 2, 3)]), r"triangles of shape \(1, 4\)"),
    "plane vertices": (TETRAHEDRON[:, :2], FACES, r"vertices of shape \(4, 2\)"),
    "vertices in a row": (TETRAHEDRON.ravel(), FACES, r"vertices of shape \(12,\)"),
    "triangles in a row": (TETRAHEDRON, FACES.ravel(), r"triangles of shape \(12,\)"),
}


@pytest.mark.parametrize(("vertices", "triangles", "message"), BAD.values(), ids=BAD)
def test_mesh_that_bounds_no_solid_is_refused(vertices, triangles, message):
    with pytest.raises(ValueError, match=message):
        of_mesh(vertices, triangles, density=1.0)


def test_thin_plate_is_a_solid():
    """A millionth of its length thick: V = 1e-6/6, far above what is called flat."""
    assert of_mesh(TETRAHEDRON * (1, 1, 1e-6), FACES, density=1.0).mass == pytest.approx(
        1e-6 / 6, rel=2e-15, abs=0
    )  # measured 1.6e-16


@pytest.mark.parametrize("name", ["icosphere", "torus", "capsule"])
def test_trimesh_finds_the_same(name):
    trimesh = pytest.importorskip("trimesh")
    arguments = {"torus": (1.0, 0.3), "capsule": (0.7, 0.2)}.get(name, ())
    mesh = getattr(trimesh.creation, name)(*arguments)
    mesh.apply_transform(trimesh.transformations.rotation_matrix(1.1, (1, 2, 3)))
    mesh.apply_translation((0.3, -0.4, 0.5))
    found = of_mesh(mesh.vertices, mesh.faces, density=2.0)
    mesh.density = 2.0
    assert found.mass == pytest.approx(mesh.mass, rel=2e-15, abs=0)  # measured 2.1e-16
    assert_allclose(found.center_of_mass, mesh.center_mass, rtol=0, atol=2e-15)  # measured 2.2e-16
    assert_allclose(found.inertia, mesh.moment_inertia, rtol=0, atol=3e-14)  # measured 2.7e-15
