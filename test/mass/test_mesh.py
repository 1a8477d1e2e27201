"""Volume integrals of closed triangle meshes, and one failing mesh for each rule."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from rigid_body_sim.mass.mass_properties import combine, of_point_masses
from rigid_body_sim.mass.mesh import _edges, _parts, of_mesh
from rigid_body_sim.values import rotation

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
    assert set(_parts(_edges(order[triangles])).tolist()) == {0}
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


BOX = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
SIDES = np.array([(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
                  (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)])  # fmt: skip


def merged(corners, triangles):
    vertices, number = np.unique(corners, axis=0, return_inverse=True)
    return vertices, number.ravel()[triangles]


def touching(where, flip=False):
    """A box, one like it at x, y, z, perhaps inside out, and a large one elsewhere.

    Where the last of ``where`` is 1, other diagonals part the second one's sides.
    """
    x, y, z, turned = where
    second = (1, 0, 0) + BOX * (-1, 1, 1) if turned else BOX
    sides = SIDES[:, ::-1] if bool(turned) != flip else SIDES
    return merged(
        np.concatenate((BOX, np.add(second, (x, y, z)), 2 * BOX + 5)), np.concatenate((SIDES, sides + 8, SIDES + 16))
    )


def t_junction():
    """A box one of whose edges has a vertex in the middle on one side only."""
    faces = np.concatenate((SIDES[(SIDES != (0, 4, 5)).any(axis=1)], [(0, 8, 5), (8, 4, 5)]))
    return np.concatenate((BOX, [(0.5, 0, 0)])), faces


@pytest.mark.parametrize("where", [(0, 1, 1, 0), (1, 1, 1, 0), (0, 0, 1, 0), (0, 0, 1, 1), (1, 0, 0, 1), (0, 1, 0, 1)])
def test_closed_parts_may_share_an_edge_a_corner_or_a_face(where):
    found = of_mesh(*touching(where), density=3.0)
    one = of_mesh(BOX, SIDES, density=3.0)
    expected = combine([one, one.placed(where[:3]), of_mesh(2 * BOX + 5, SIDES, density=3.0)])
    assert found.mass == pytest.approx(30.0, rel=1e-14, abs=0)
    assert_allclose(found.center_of_mass, expected.center_of_mass, rtol=0, atol=1e-13)
    assert_allclose(found.inertia, expected.inertia, rtol=0, atol=1e-11)


BAD = {  # vertices, triangles, and what the message must say
    "open": (
        TETRAHEDRON,
        FACES[:3],
        r"mesh is open: 3 edges belong to one triangle only, such as that from \[1, 0, 0\] to \[0, 1, 0\]",
    ),
    "inside out": (TETRAHEDRON, FACES[:, ::-1], r"mesh is inside out: its volume is -0\.166667 m³"),
    "one flipped": (TETRAHEDRON, with_flipped(FACES, 1), "mesh turns inside out: at 3 edges"),
    "one part inside out": (
        np.concatenate((TETRAHEDRON, 2.0 + TETRAHEDRON / 4)),
        np.concatenate((FACES, FACES[:, ::-1] + 4)),
        r"mesh is inside out where the vertex \[2\.25, 2, 2\] is: that part has the volume -0\.00260417 m³ and is no h",
    ),
    "fin": (
        np.concatenate((TETRAHEDRON, [(1, 1, 1)])),
        np.concatenate((FACES, [(0, 1, 4), (0, 4, 1)])),
        r"mesh has a sheet without thickness, with an edge from \[1, 0, 0\] to \[1, 1, 1\] of two triangles that",
    ),
    "three triangles at an edge": (
        np.concatenate((TETRAHEDRON, [(1, 1, 1)])),
        np.concatenate((FACES, [(0, 1, 4), (4, 1, 3), (3, 0, 4)])),
        r"mesh is not a surface: 3 edges belong to more than two triangles .* from \[0, 0, 0\] to \[1, 0, 0\]",
    ),
    "twice the same": (
        TETRAHEDRON,
        np.concatenate((FACES, FACES)),
        r"mesh has 4 triangles twice, such as that of \[0, ",
    ),
    "one of two that share an edge inside out": (
        *touching((0, 1, 1, 0), flip=True),
        r"of which one is inside out, at 1 edges, such as that from \[0, 1, 1\] to \[1, 1, 1\]",
    ),
    "one of two that share a corner inside out": (
        *touching((1, 1, 1, 0), flip=True),
        "mesh is inside out where the vert",
    ),
    "one of two that share a face inside out": (*touching((0, 0, 1, 0), flip=True), "mesh has 2 triangles twice"),
    "the same with other diagonals": (
        *touching((0, 0, 1, 1), flip=True),
        "of which one is inside out, at 4 edges, such",
    ),
    "one in the other along an edge": (
        *merged(np.concatenate((BOX, BOX * (0.5, 0.5, 1))), np.concatenate((SIDES, SIDES + 8))),
        r"parts that overlap, .* at 1 edges, such as that from \[0, 0, 0\] to \[0, 0, 1\]",
    ),
    "T-junction": (*t_junction(), r"is open: 3 edges .* to .*, on which \[0\.5, 0, 0\] lies as a corner of other"),
    "flat": (TETRAHEDRON * (1, 1, 0), FACES, "mesh encloses no volume"),
    "two-sided sheet": (TETRAHEDRON, np.array([(0, 1, 2), (0, 2, 1)]), "mesh has a sheet without thickness"),
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
