"""The usual shapes against their density integral, their mesh, and each other where one is a limit of another."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from rigid_body_sim.mass.density import of_solid
from rigid_body_sim.mass.mass_properties import combine, of_point_masses
from rigid_body_sim.mass.mesh import of_mesh
from rigid_body_sim.mass.shapes import SHAPES

pytestmark = pytest.mark.no_numba

TURN = 2 * math.pi


def shell_coordinates(a, b, c):
    return lambda s, theta, phi: (
        a * s * np.sin(theta) * np.cos(phi),
        b * s * np.sin(theta) * np.sin(phi),
        c * s * np.cos(theta),
    )


def tube_coordinates(r, phi, z):
    return r * np.cos(phi), r * np.sin(phi), z


def cone_coordinates(s, phi, t):
    """Radius 0.3 m at t = 0, none at t = 1, height 0.8 m."""
    return 0.3 * (1 - t) * s * np.cos(phi), 0.3 * (1 - t) * s * np.sin(phi), 0.8 * t


HALF_BALL = ((0, 0, 0), (1, math.pi / 2, TURN))
PIECES = {  # shape and dimensions [m], and the pieces of its density integral: bounds, coordinates
    ("sphere", (0.3,)): [((0, 0, 0), (1, math.pi, TURN), shell_coordinates(0.3, 0.3, 0.3))],
    ("hollow_sphere", (0.3, 0.2)): [((2 / 3, 0, 0), (1, math.pi, TURN), shell_coordinates(0.3, 0.3, 0.3))],
    ("ellipsoid", (0.3, 0.5, 0.2)): [((0, 0, 0), (1, math.pi, TURN), shell_coordinates(0.3, 0.5, 0.2))],
    ("box", (0.3, 0.5, 0.2)): [((-0.15, -0.25, -0.1), (0.15, 0.25, 0.1), None)],
    ("cylinder", (0.3, 0.8)): [((0, 0, -0.4), (0.3, TURN, 0.4), tube_coordinates)],
    ("tube", (0.3, 0.2, 0.8)): [((0.2, 0, -0.4), (0.3, TURN, 0.4), tube_coordinates)],
    ("cone", (0.3, 0.8)): [((0, 0, 0), (1, TURN, 1), cone_coordinates)],
    ("capsule", (0.3, 0.8)): [
        ((0, 0, -0.4), (0.3, TURN, 0.4), tube_coordinates),
        (*HALF_BALL, lambda *p: np.add(shell_coordinates(0.3, 0.3, 0.3)(*p), [[[[0]]], [[[0]]], [[[0.4]]]])),
        (*HALF_BALL, lambda *p: np.add(shell_coordinates(0.3, 0.3, -0.3)(*p), [[[[0]]], [[[0]]], [[[-0.4]]]])),
    ],
}


@pytest.mark.parametrize(("key", "pieces"), PIECES.items(), ids=[name for name, _ in PIECES])
def test_shape_is_its_density_integral_2_4_5(key, pieces):
    name, dimensions = key
    expected = combine([of_solid(700.0, *piece) for piece in pieces])
    found = SHAPES[name].mass_properties(dimensions, density=700.0)
    assert found.mass == pytest.approx(expected.mass, rel=2e-14, abs=0)  # measured 1.8e-15
    assert_allclose(
        found.inertia, expected.inertia, rtol=0, atol=2e-14 * np.trace(expected.inertia)
    )  # measured 1.4e-15


def test_every_shape_with_a_volume_is_compared():
    assert {name for name, _ in PIECES} == {name for name, shape in SHAPES.items() if shape.volume}


def revolved(profile, sides):
    """Vertices and triangles of a closed surface: a profile of (radius, z) turned about z, first and last radius 0."""
    phi = TURN * np.arange(sides) / sides
    rings = [[(r * math.cos(a), r * math.sin(a), z) for a in phi] for r, z in profile[1:-1]]
    vertices = [(0, 0, profile[0][1]), *(v for ring in rings for v in ring), (0, 0, profile[-1][1])]
    last = len(vertices) - 1
    triangles = []
    for a in range(sides):
        b = (a + 1) % sides
        triangles.append((0, 1 + b, 1 + a))
        for k in range(len(rings) - 1):
            low, high = 1 + k * sides, 1 + (k + 1) * sides
            triangles += [(low + a, low + b, high + b), (low + a, high + b, high + a)]
        top = 1 + (len(rings) - 1) * sides
        triangles.append((last, top + a, top + b))
    return np.array(vertices, float), np.array(triangles)


def arc(radius, start, end, n, z=0.0):
    """Profile points of a circle about (0, z) between two angles from −z to +z."""
    return [(radius * math.sin(a), z - radius * math.cos(a)) for a in np.linspace(start, end, n + 1)]


def profile_of(name, n):
    straight = {
        "cylinder": [(0, -0.4), (0.3, -0.4), (0.3, 0.4), (0, 0.4)],
        "cone": [(0, -0.2), (0.3, -0.2), (0, 0.6)],
    }
    half = math.pi / 2
    round_ones = {
        "sphere": arc(0.3, 0, math.pi, n),
        "capsule": arc(0.3, 0, half, n, -0.4) + arc(0.3, half, math.pi, n, 0.4),
    }
    return straight.get(name) or round_ones[name]


@pytest.mark.parametrize("name", ["sphere", "cylinder", "capsule", "cone"])
def test_mesh_of_a_round_shape_comes_nearer_as_the_square_of_its_sides(name):
    dimensions = (0.3,) if name == "sphere" else (0.3, 0.8)
    exact = SHAPES[name].mass_properties(dimensions, density=700.0)
    misses = []
    for n in (32, 64):
        found = of_mesh(*revolved(profile_of(name, n), n), density=700.0)
        misses.append(np.abs(found.inertia - exact.inertia).max() / np.trace(exact.inertia))
        assert_allclose(found.center_of_mass, 0.0, rtol=0, atol=1e-15)  # measured 5.6e-17
    assert misses[0] < 0.01  # measured 0.0032 to 0.0056
    assert 3.9 < misses[0] / misses[1] < 4.1  # measured 3.976 to 3.991


BOX_CORNERS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
BOX_TRIANGLES = np.array(
    [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
     (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]
)  # fmt: skip


def test_mesh_of_a_box_is_the_box():
    found = of_mesh(BOX_CORNERS * (0.15, 0.25, 0.1), BOX_TRIANGLES, density=700.0)
    exact = SHAPES["box"].mass_properties((0.3, 0.5, 0.2), density=700.0)
    assert found.mass == pytest.approx(exact.mass, rel=2e-15, abs=0)  # measured 1.7e-16
    assert_allclose(found.inertia, exact.inertia, rtol=0, atol=2e-15)  # measured 2.2e-16


def test_cloud_of_points_comes_nearer_to_the_box_as_the_square_of_its_number():
    exact = SHAPES["box"].mass_properties((0.3, 0.5, 0.2), mass=2.0)
    misses = []
    for n in (10, 20):
        middles = [(np.arange(n) + 0.5) / n - 0.5] * 3
        points = np.stack(np.meshgrid(*middles), axis=-1).reshape(-1, 3) * (0.3, 0.5, 0.2)
        found = of_point_masses(np.full(n**3, 2.0 / n**3), points)
        misses.append(np.abs(found.inertia - exact.inertia).max() / np.trace(exact.inertia))
    assert misses[0] / misses[1] == pytest.approx(
        4.0, rel=1e-9, abs=0
    )  # measured 6.5e-12; the midpoint rule misses by 1/n²


def moments(name, *dimensions):
    return np.diag(SHAPES[name].mass_properties(dimensions, mass=2.0).inertia)


@pytest.mark.parametrize(
    ("shape", "limit"),
    [
        (("hollow_sphere", 0.3, 0.0), ("sphere", 0.3)),
        (("ellipsoid", 0.3, 0.3, 0.3), ("sphere", 0.3)),
        (("tube", 0.3, 0.0, 0.8), ("cylinder", 0.3, 0.8)),
        (("capsule", 0.3, 1e-12), ("sphere", 0.3)),
        (("capsule", 1e-12, 0.8), ("thin_rod", 0.8)),
        (("cylinder", 1e-9, 0.8), ("thin_rod", 0.8)),
        (("cylinder", 0.3, 1e-9), ("thin_disc", 0.3)),
        (("box", 1e-9, 1e-9, 0.8), ("thin_rod", 0.8)),
        (("sphere", 1e-9), ("point",)),
    ],
)
def test_shape_becomes_another_in_the_limit(shape, limit):
    assert_allclose(moments(*shape), moments(*limit), rtol=0, atol=1e-12)  # measured 3.6e-13


def test_thin_shell_is_the_limit_of_a_thick_one():
    assert_allclose(moments("hollow_sphere", 0.3, 0.3), 2 / 3 * 2.0 * 0.09, rtol=1e-15)  # measured 0
    assert_allclose(moments("hollow_sphere", 0.3, 0.3 * (1 - 1e-12)), 2 / 3 * 2.0 * 0.09, rtol=2e-12)  # measured 1e-12


def test_hollow_sphere_and_tube_are_what_the_hole_leaves():
    for hollow, whole, hole in [
        (("hollow_sphere", (0.3, 0.2)), ("sphere", (0.3,)), ("sphere", (0.2,))),
        (("tube", (0.3, 0.2, 0.8)), ("cylinder", (0.3, 0.8)), ("cylinder", (0.2, 0.8))),
    ]:
        found, solid, removed = (SHAPES[n].mass_properties(d, density=700.0) for n, d in (hollow, whole, hole))
        assert found.mass == pytest.approx(solid.mass - removed.mass, rel=2e-15, abs=0)  # measured 1.6e-16
        assert_allclose(found.inertia, solid.inertia - removed.inertia, rtol=0, atol=1e-14)  # measured 8.9e-16


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
def test_mass_is_a_factor_and_the_centre_of_mass_the_origin(shape):
    dimensions = [0.5, 0.3, 0.4][: len(shape.dimensions)]
    one, two = (shape.mass_properties(dimensions, mass=mass) for mass in (1.0, 2.0))
    assert_array_equal(two.inertia, 2.0 * one.inertia)
    assert_array_equal(one.center_of_mass, (0, 0, 0))


@pytest.mark.parametrize(
    "shape", [s for s in SHAPES.values() if s.name not in ("thin_rod", "point")], ids=lambda s: s.name
)
def test_shape_with_extent_makes_a_body(shape):
    assert shape.mass_properties([0.5, 0.3, 0.4][: len(shape.dimensions)], mass=1.0).body().mass == 1.0


@pytest.mark.parametrize("name", ["thin_rod", "point"])
def test_shape_with_a_zero_moment_makes_none_and_says_so(name):
    properties = SHAPES[name].mass_properties([0.5][: len(SHAPES[name].dimensions)], mass=1.0)
    with pytest.raises(ValueError, match="is not positive definite"):
        properties.body()


@pytest.mark.parametrize(
    ("name", "dimensions", "given_values", "message"),
    [
        ("box", (1.0, 2.0), {"mass": 1.0}, "box is given 2 dimensions; it needs 3: size x, size y, size z"),
        ("point", (1.0,), {"mass": 1.0}, "point is given 1 dimensions; it needs 0: none"),
        ("sphere", (0.0,), {"mass": 1.0}, "sphere: radius 0 m is not a finite number greater than zero"),
        ("cone", (0.1, math.nan), {"mass": 1.0}, "cone: height nan m is not a finite number"),
        ("tube", (0.1, 0.2, 1.0), {"mass": 1.0}, "tube: inner radius 0.2 m is not between 0 and outer radius 0.1 m"),
        ("tube", (0.1, -0.1, 1.0), {"mass": 1.0}, "inner radius -0.1 m is not between"),
        ("hollow_sphere", (0.1, math.nan), {"mass": 1.0}, "inner radius nan m is not between"),
        ("thin_rod", (1.0,), {"density": 1.0}, "has no volume for a density; give its mass"),
        ("hollow_sphere", (0.1, 0.1), {"density": 1.0}, "has no volume for a density"),
        ("sphere", (1e120,), {"density": 1.0}, "is not between 1e-100 and 1e\\+100 m"),
        ("sphere", (1e200,), {"mass": 1.0}, "is not between 1e-100 and 1e\\+100 m"),
        ("sphere", (1.0,), {}, "give exactly one of them"),
        ("sphere", (1.0,), {"mass": 1.0, "density": 1.0}, "give exactly one of them"),
    ],
)
def test_bad_dimensions_are_refused(name, dimensions, given_values, message):
    with pytest.raises(ValueError, match=message):
        SHAPES[name].mass_properties(dimensions, **given_values)
