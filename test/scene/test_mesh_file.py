"""Mesh files as programs write them: which corners are one, and what is told about it."""

import math
import struct

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rigid_body_sim import Scene
from rigid_body_sim.scene.mesh_corners import joined

pytest.importorskip("trimesh")
pytestmark = pytest.mark.no_numba

CORNERS = np.array([(x, y, z) for x in (0, 0.3) for y in (0, 0.2) for z in (0, 0.1)])
SIDES = np.array([(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
                  (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)])  # fmt: skip
BOX = CORNERS[SIDES]  # three corners of each of twelve triangles


def text_stl(triangles, form="{!r}"):
    lines = ["solid part"]
    for triangle in np.asarray(triangles).tolist():
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex " + " ".join(form.format(number) for number in corner) for corner in triangle]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid part", ""]).encode()


def binary_stl(triangles, head=b"", count=None, after=b""):
    records = b"".join(
        struct.pack("<12fH", 0, 0, 0, *np.ravel(triangle).tolist(), 0) for triangle in np.asarray(triangles)
    )
    return head.ljust(80) + struct.pack("<I", len(triangles) if count is None else count) + records + after


def scene_of(tmp_path, data, name="part.stl", **given):
    (tmp_path / name).write_bytes(data)
    return Scene({"body": {"mesh_file": name, "density": 1000.0, **given}}, tmp_path)


def check_box(scene, atol=1e-12):
    """The box of CORNERS, of 1000 kg/m³."""
    assert scene["body.mass"] == pytest.approx(6.0, abs=atol)
    assert_allclose(scene["body.center_of_mass"], (0.15, 0.1, 0.05), rtol=0, atol=atol)
    assert_allclose(scene["body.inertia"], (0.025, 0.05, 0.065, 0, 0, 0), rtol=0, atol=atol)


def prism(n=12):
    """Triangles of a prism of n sides, radius 0.1 and height 0.2, whose last corner is the first, reckoned anew."""
    ring = [(0.1 * math.cos(2 * math.pi * k / n), 0.1 * math.sin(2 * math.pi * k / n)) for k in range(n + 1)]
    triangles = []
    for (a, b), (c, d) in zip(ring[:-1], ring[1:], strict=True):
        low, high, next_low, next_high = (a, b, 0.0), (a, b, 0.2), (c, d, 0.0), (c, d, 0.2)
        triangles += [((0, 0, 0), next_low, low), ((0, 0, 0.2), high, next_high)]
        triangles += [(low, next_low, next_high), (low, next_high, high)]
    return triangles


@pytest.mark.parametrize(("write", "atol"), [(text_stl, 1e-12), (binary_stl, 1e-6)])
def test_corner_that_is_nearly_zero_is_the_one_at_zero(tmp_path, write, atol):
    triangles = BOX.copy()
    triangles[0, 0, 0] = 1.2e-17
    scene = scene_of(tmp_path, write(triangles))
    check_box(scene, atol)  # measured 9e-16, 4.2e-7
    (note,) = scene.notes
    assert note.startswith("parameter body.mesh_file = 'part.stl': ")
    assert note.endswith("units away: 1")


@pytest.mark.parametrize(("write", "atol"), [(text_stl, 1e-12), (binary_stl, 1e-6)])
def test_seam_of_a_prism_closes(tmp_path, write, atol):
    scene = scene_of(tmp_path, write(prism()))
    assert scene["body.mass"] == pytest.approx(6.0, abs=atol)
    assert_allclose(scene["body.center_of_mass"], (0, 0, 0.1), rtol=0, atol=atol)
    moments = (0.0343301270189, 0.0343301270189, 0.0286602540378)
    assert_allclose(scene["body.inertia"][:3], moments, rtol=0, atol=atol)
    assert "units away: 2" in scene.notes[0]


@pytest.mark.parametrize("shift", [0.0, 1.0, 1000.0])
@pytest.mark.parametrize("seed", range(4))
def test_corners_that_straddle_any_border_are_one(tmp_path, seed, shift):
    """Each corner of each triangle off by up to 1.5 units of float32, at a place that no grid suits."""
    rng = np.random.default_rng(seed)
    moved = BOX + shift + rng.uniform(0, 1, 3)
    size = np.abs(moved).max()
    noise = 2.0**-23 * size
    scene = scene_of(tmp_path, text_stl(moved + rng.uniform(-1.5, 1.5, moved.shape) * noise))
    assert scene["body.mass"] == pytest.approx(6.0, rel=100 * noise)
    assert_allclose(scene["body.center_of_mass"], moved.reshape(-1, 3).min(axis=0) + (0.15, 0.1, 0.05), atol=3 * noise)


def test_equal_corners_leave_no_note(tmp_path):
    for data in (text_stl(BOX), binary_stl(BOX), text_stl(BOX - BOX[0, 0] * 0.0)):
        scene = scene_of(tmp_path, data)
        check_box(scene, 1e-6)
        assert scene.notes == ()


def test_text_of_six_digits_closes_within_the_sixth(tmp_path):
    """Programs that print %g round one point to two neighbouring numbers."""
    triangles = BOX * 0.4112334  # sizes 0.12337, 0.0822467, 0.0411233
    triangles[2, 0, 0] += 1e-6
    scene = scene_of(tmp_path, text_stl(triangles, "{:.6g}"))
    assert scene["body.mass"] == pytest.approx(6.0 * 0.4112334**3, rel=2e-5)
    with pytest.raises(ValueError, match="is open"):
        scene_of(tmp_path, text_stl(triangles, "{:.9g}"))


@pytest.mark.parametrize("gap", [1e-2, 1e-4, 1e-5, 3e-6])
def test_gap_wider_than_round_off_is_refused(tmp_path, gap):
    triangles = BOX.copy()
    triangles[0, 0] += 0.3 * gap
    with pytest.raises(ValueError, match=r"is open: \d edges .* such as that from \(.*0, .*\) to \(0"):
        scene_of(tmp_path, text_stl(triangles))


def test_hole_of_a_small_triangle_is_refused(tmp_path):
    """A corner cut off by a triangle of a ten-thousandth of the size that is not there."""
    e = 3e-5
    cut = [(e, 0, 0), (0, e, 0), (0, 0, e)]
    triangles = [triangle for triangle in BOX.tolist() if [0, 0, 0] not in triangle]
    a, b, c, d, f, g = CORNERS[[1, 2, 3, 4, 5, 6]].tolist()
    x, y, z = cut
    triangles += [(z, a, c), (z, c, b), (z, b, y), (x, d, f), (x, f, a), (x, a, z), (y, b, g), (y, g, d), (y, d, x)]
    with pytest.raises(ValueError, match=r"is open: 3 edges .*3e-05"):
        scene_of(tmp_path, text_stl(triangles))
    check_box(scene_of(tmp_path, text_stl([*triangles, (z, y, x)])), 1e-9)


def test_a_row_of_near_corners_does_not_collapse():
    """Each is within the tolerance of the next, the last far from the first: those that stay are apart."""
    limit = 4.0 * 2.0**-23
    row = np.array([(0.9 * limit * k, 0, 0) for k in range(50)] + [(1, 0, 0), (0, 1, 0)])
    strip = np.array([(k, k + 1, 51) for k in range(49)] + [(51, 49, 50), (0, 51, 50)])
    vertices, triangles, _ = joined(row, strip)
    assert np.ptp(vertices[np.unique(triangles)][:, 0]) == 1.0
    assert len(np.unique(triangles)) == len(row)  # the strip stays open, so nothing merges


def test_plate_thinner_than_the_tolerance_stays_where_its_corners_are_equal(tmp_path):
    plate = BOX * (1, 1, 1e-7)
    scene = scene_of(tmp_path, text_stl(plate))
    assert scene["body.mass"] == pytest.approx(6e-7, rel=1e-12)
    assert scene.notes == ()


def test_sliver_that_collapses_is_left_out(tmp_path):
    """A triangle between two corners that are one, and two that then lie back to back."""
    near, far = (1e-9, 0, 0), (2e-9, 0, 1e-9)
    for more in ([(CORNERS[0], near, CORNERS[7])], [(CORNERS[0], CORNERS[3], CORNERS[5]), (near, CORNERS[5], CORNERS[3])],
                 [(CORNERS[0], near, far)]):  # fmt: skip
        scene = scene_of(tmp_path, text_stl([*BOX.tolist(), *np.array(more).tolist()]))
        check_box(scene)


def test_eighty_thousand_noisy_triangles_close():
    """Every corner of every triangle its own; that it is quick shows in the time of the tests."""
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=6)
    rng = np.random.default_rng(1)
    corners = ball.triangles.reshape(-1, 3) + rng.uniform(-1e-7, 1e-7, (3 * len(ball.faces), 3))
    vertices, triangles, note = joined(corners, np.arange(len(corners)).reshape(-1, 3))
    assert len(triangles) == len(ball.faces) == 81920
    assert len(np.unique(triangles)) == len(ball.vertices)
    assert note.endswith(str(len(corners) - len(ball.vertices)))


def test_far_corner_does_not_make_a_part_one_point():
    """Beside a size of 1e9 the whole box is round-off; it stays open, and takes no time."""
    corners = np.concatenate([BOX[:-1].reshape(-1, 3) + 0.01 * k for k in range(900)] + [[(1e9, 0, 0)] * 3])
    corners[-3:] += np.eye(3)
    _, triangles, note = joined(corners, np.arange(len(corners)).reshape(-1, 3))
    assert (note, len(triangles)) == ("", 900 * 11 + 1)


def test_several_objects_that_touch_are_one_solid(tmp_path):
    lines = []
    for k, name in enumerate(("left", "right")):
        lines += [f"o {name}", *("v {} {} {}".format(*corner) for corner in CORNERS + (0.3 * k, 0, 0))]
        lines += ["f {} {} {}".format(*side) for side in SIDES + 1 + 8 * k]
    scene = scene_of(tmp_path, "\n".join(lines).encode(), "two.obj")
    assert scene["body.mass"] == pytest.approx(12.0, rel=1e-12)
    assert_allclose(scene["body.center_of_mass"], (0.3, 0.1, 0.05), rtol=0, atol=1e-12)
