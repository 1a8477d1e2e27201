"""Mesh files as programs write them: which corners are one, and what is told about it."""

import itertools
import math
import re
import struct

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rigid_body_sim import Scene, load_scene
from rigid_body_sim.scene.mesh_corners import _representatives, joined

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
    for (a, b), (c, d) in itertools.pairwise(ring):
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
    assert ": 1 of its corners is merged with another at most " in note


@pytest.mark.parametrize(("write", "atol"), [(text_stl, 1e-12), (binary_stl, 1e-6)])
def test_seam_of_a_prism_closes(tmp_path, write, atol):
    scene = scene_of(tmp_path, write(prism()))
    assert scene["body.mass"] == pytest.approx(6.0, abs=atol)
    assert_allclose(scene["body.center_of_mass"], (0, 0, 0.1), rtol=0, atol=atol)
    moments = (0.0343301270189, 0.0343301270189, 0.0286602540378)
    assert_allclose(scene["body.inertia"][:3], moments, rtol=0, atol=atol)
    assert ": 2 of its corners are merged with another at most " in scene.notes[0]


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
    assert_allclose(
        scene["body.center_of_mass"], np.add(moved.reshape(-1, 3).min(axis=0), (0.15, 0.1, 0.05)), atol=3 * noise
    )


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
    with pytest.raises(ValueError, match=r"is open: \d edges .* such as that from \[.*0, .*\] to \[0"):
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
    row = np.array([(0.9 * limit * k, 0, 0) for k in range(50)])
    joins = _representatives(row, limit)
    assert joins.tolist() == [k - k % 2 for k in range(50)]


def test_plate_thinner_than_the_tolerance_stays_where_its_corners_are_equal(tmp_path):
    plate = BOX * (1, 1, 1e-7)
    scene = scene_of(tmp_path, text_stl(plate))
    assert scene["body.mass"] == pytest.approx(6e-7, rel=1e-12)
    assert scene.notes == ()


def test_sliver_that_collapses_is_left_out(tmp_path):
    """A triangle between two corners that are one, and two that then lie back to back."""
    near, far = (1e-9, 0, 0), (2e-9, 0, 1e-9)
    zero, a, b = CORNERS[[0, 3, 5]]
    for more in ([(zero, near, a)], [(zero, a, b), (near, b, a)], [(zero, near, far)]):
        scene = scene_of(tmp_path, text_stl([*BOX.tolist(), *np.array(more).tolist()]))
        check_box(scene)


def test_eighty_thousand_noisy_triangles_close():
    """Every corner of every triangle its own; that it is quick shows in the time of the tests."""
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=6)
    rng = np.random.default_rng(1)
    corners = ball.triangles.reshape(-1, 3) + rng.uniform(-1e-7, 1e-7, (3 * len(ball.faces), 3))
    _, triangles, note = joined(corners, np.arange(len(corners)).reshape(-1, 3))
    assert len(triangles) == len(ball.faces) == 81920
    assert len(np.unique(triangles)) == len(ball.vertices)
    assert note.startswith(str(len(corners) - len(ball.vertices)))


def test_far_corner_does_not_make_a_part_one_point():
    """Beside a size of 1e9 the whole box is round-off; it stays open, and takes no time."""
    corners = np.concatenate([BOX[:-1].reshape(-1, 3) + 0.01 * k for k in range(900)] + [[(1e9, 0, 0)] * 3])
    corners[-3:] += np.eye(3)
    _, triangles, note = joined(corners, np.arange(len(corners)).reshape(-1, 3))
    assert (note, len(triangles)) == ("", 900 * 11 + 1)


def test_several_objects_that_touch_are_one_solid(tmp_path):
    lines = []
    for k, name in enumerate(("left", "right")):
        lines += [f"o {name}", *("v {} {} {}".format(*corner) for corner in np.add(CORNERS, (0.3 * k, 0, 0)))]
        lines += ["f {} {} {}".format(*side) for side in SIDES + 1 + 8 * k]
    scene = scene_of(tmp_path, "\n".join(lines).encode(), "two.obj")
    assert scene["body.mass"] == pytest.approx(12.0, rel=1e-12)
    assert_allclose(scene["body.center_of_mass"], (0.3, 0.1, 0.05), rtol=0, atol=1e-12)


MM = [0.001, 0.001, 0.001]


def test_scale_makes_metres_of_any_unit(tmp_path):
    scene = scene_of(tmp_path, text_stl(BOX * 1000), mesh_scale=MM)
    check_box(scene)  # measured 1e-15
    assert scene.notes == ()
    check_box(scene_of(tmp_path, text_stl(BOX / (2, 3, 4)), mesh_scale=[2, 3, 4]))
    mesh = scene.changed({"body.density": 0.0, "body.mass": 12.0})
    assert_allclose(mesh["body.inertia"], 2 * np.array(scene["body.inertia"]), rtol=1e-14)


def test_scale_is_part_of_what_was_read(tmp_path):
    """Two scenes that share what was read, of one file and two scales."""
    scene = scene_of(tmp_path, text_stl(BOX))
    large = scene.changed({"body.mesh_scale": (2.0, 2.0, 2.0)})
    assert large["body.mass"] == pytest.approx(48.0, rel=1e-12)
    (tmp_path / "part.stl").unlink()
    assert large.changed({"body.mesh_scale": (1.0, 1.0, 1.0)}).values == scene.values


def test_refusal_names_coordinates_of_the_file_whatever_the_scale(tmp_path):
    with pytest.raises(ValueError, match=r"from \[0, 0, 0\] to \[0, 0, 100\]"):
        scene_of(tmp_path, text_stl(np.round(BOX[1:] * 1000)), mesh_scale=MM)


@pytest.mark.parametrize(
    ("scale", "message"),
    [
        ([1, 1], r"body\.mesh_scale = \[1, 1\]: has 2 entries; give 3, such as \[1\.0, 1\.0, 1\.0\]"),
        ([1, 1, -1], r"body\.mesh_scale = .* is out of range; give 3 finite numbers, each greater than 0"),
        ([0, 1, 1], r"body\.mesh_scale = .* is out of range"),
        ([1, 1, math.inf], r"body\.mesh_scale = .* is not finite"),
        (0.001, r"body\.mesh_scale = 0\.001: is not an array; give 3 numbers such as"),
    ],
)
def test_bad_scale_is_refused(tmp_path, scale, message):
    with pytest.raises(ValueError, match=message):
        scene_of(tmp_path, text_stl(BOX), mesh_scale=scale)


def test_scale_without_a_mesh_is_refused():
    with pytest.raises(ValueError, match=r"body\.mesh_scale = .*: needs body\.mesh_file; give both or neither"):
        Scene({"body.mesh_scale": MM})


DENSITIES = {  # parameters beside a box of 0.3, 0.2, 0.1 times a factor, that factor, and what the note must say
    "mesh in mm": ({"mass": 6.0}, 1000, r"mass 6 kg in a volume of 6e\+06 m³ is a density of 1e-06 kg/m³, less than "
                   r"any solid has, 0\.1 kg/m³; .*: give body\.mesh_scale: \[0\.001, 0\.001, 0\.001\]$"),
    "mesh in m taken as mm": ({"mass": 6.0, "mesh_scale": MM}, 1, r"density of 1e\+12 kg/m³, more than any solid has, "
                              r"22590 kg/m³; .*: give body\.mesh_scale: \[1\.0, 1\.0, 1\.0\]$"),
    "too light": ({"mass": 1e-7}, 1, r"density of 1\.66667e-05 kg/m³, less than .*; lengths in mm .*explain"),
    "far too light": ({"mass": 1e-15}, 1, r"density of 1\.66667e-13 kg/m³, less than .*; check mass and size$"),
    "lead of a hundred": ({"mass": 6e3}, 1, r"density of 1e\+06 kg/m³, more than .*; check mass and size$"),
    "density in kg/mm³": ({"density": 1e-6}, 1000, r"mass 6 kg .*: give body\.mesh_scale: \[0\.001, 0\.001, 0\.001\] "
                          r"and body\.density: 1000$"),
}  # fmt: skip


@pytest.mark.parametrize(("body", "factor", "message"), DENSITIES.values(), ids=DENSITIES)
def test_density_that_no_solid_has_is_told(tmp_path, body, factor, message):
    (tmp_path / "part.stl").write_bytes(text_stl(BOX * factor))
    mesh = Scene({"body": {"mesh_file": "part.stl", **body}}, tmp_path)
    assert len(mesh.notes) == 1
    assert re.search(message, mesh.notes[0]), mesh.notes[0]
    if "mesh_scale" not in body:
        sizes = [0.3 * factor, 0.2 * factor, 0.1 * factor]
        shape = Scene({"body": {"shape": "box", "dimensions": sizes, **body}})
        assert shape.notes[0].startswith("parameter body.shape = 'box': mass ")
        assert ("give body.dimensions: [0.3, 0.2, 0.1]" in shape.notes[0]) == (factor == 1000), shape.notes[0]


@pytest.mark.parametrize("density", [0.11, 1.0, 1000.0, 22_500.0])
def test_what_there_is_leaves_no_note(tmp_path, density):
    assert scene_of(tmp_path, text_stl(BOX), density=density).notes == ()
    assert Scene({"body": {"shape": "box", "dimensions": [1, 1, 1], "mass": density}}).notes == ()
    assert Scene({"body": {"shape": "thin_disc", "dimensions": [1]}}).notes == ()


def test_loading_a_scene_tells_its_notes_once(tmp_path, caplog):
    (tmp_path / "part.stl").write_bytes(text_stl(BOX * 1000))
    file = tmp_path / "scene.yaml"
    file.write_text("/**: {ros__parameters: {body: {mesh_file: part.stl, mass: 6.0}}}", encoding="utf-8")
    scene = load_scene(file)
    scene.changed({"gravity": (0.0, 0.0, -9.81)}).changed({"body.mass": 7.0})
    (record,) = caplog.records
    assert (record.name, record.levelname) == ("rigid_body_sim", "WARNING")
    assert record.getMessage() == f"{file}: {scene.notes[0]}"


TEXT = text_stl(BOX)
VERTICES = "".join("v {} {} {}\n".format(*corner) for corner in CORNERS)
QUADS = "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n"
FROM_ZERO = "".join(f"4 {' '.join(str(int(k) - 1) for k in line.split()[1:])}\n" for line in QUADS.splitlines())
PLY = (
    "ply\nformat ascii 1.0\ncomment by hand\nelement vertex 8\nproperty double x\nproperty double y\n"
    "property double z\nelement face 6\nproperty list uchar int vertex_indices\nend_header\n"
)
TAKEN = {  # files of the box of CORNERS
    "binary of text's first word.stl": binary_stl(BOX, b"solid by a program"),
    "binary of text's words.stl": binary_stl(BOX, b"solid facet normal vertex 1 2 3 endsolid"),
    "bytes after the last triangle.stl": binary_stl(BOX, after=b"\nend"),
    "zeros after the last triangle.stl": binary_stl(BOX, after=bytes(1000)),
    "count not known at the head.stl": binary_stl(BOX, count=0),
    "several solids.stl": text_stl(BOX[:5]) + text_stl(BOX[5:]),
    "name of reserved words.stl": TEXT.replace(b"part", b"solid vertex normal 1 2 3"),
    "lines of Windows.stl": TEXT.replace(b"\n", b"\r\n"),
    "lines of old Macs.stl": TEXT.replace(b"\n", b"\r"),
    "one line.stl": TEXT.replace(b"\n", b" "),
    "tabs.stl": TEXT.replace(b"vertex ", b"\t\tvertex\t"),
    "UPPER.STL": TEXT.upper(),
    "exponents.stl": text_stl(BOX, "{:+.17E}"),
    "normals that are none.stl": TEXT.replace(b"normal 0 0 0", b"normal nan -nan(ind) inf"),
    "no end.stl": TEXT.replace(b"endsolid part", b""),
    "byte order mark.stl": b"\xef\xbb\xbf" + TEXT,
    "name in Latin-1.stl": TEXT.replace(b"part", b"pi\xe8ce"),
    "quads.obj": VERTICES + QUADS,
    "triangles and quads.obj": VERTICES + QUADS.replace("f 1 2 4 3", "f 1 2 4\nf 1 4 3"),
    "from the end.obj": VERTICES + re.sub(r"\b\d\b", lambda k: str(int(k[0]) - 9), QUADS),
    "colours.obj": VERTICES.replace("\n", " 0.5 0.25 1\n") + QUADS,
    "weights.obj": VERTICES.replace("\n", " 1.0\n") + QUADS,
    "lines that go on.obj": VERTICES + QUADS.replace("1 2 4 3", "1 2 \\\n 4 3"),
    "groups.obj": f"g a\n{VERTICES}s off\ng b c\nusemtl x\nl 1 2\np 1\n{QUADS}",
    "texture and normal.obj": VERTICES + "vt 0 0\nvn 0 0 1\n" + re.sub(r"(?<= )(\d)", r"\1/1/1", QUADS),
    "normal.obj": VERTICES + "vn 0 0 1\n" + re.sub(r"(?<= )(\d)", r"\1//1", QUADS),
    "tabs.obj": (VERTICES + QUADS).replace(" ", "\t"),
    "comments.obj": f"# a box\n{VERTICES}{QUADS}".replace("\n", " # so\n"),
    "text.ply": PLY + VERTICES.replace("v ", "") + FROM_ZERO,
    "text.off": "OFF\n8 6 0\n" + VERTICES.replace("v ", "") + FROM_ZERO,
}
REFUSED = {  # data, and what the message must say
    "fewer than the head says.stl": (binary_stl(BOX, count=13), "head says 13 triangles, and its 684 bytes hold 12; "),
    "more than the head says.stl": (binary_stl(BOX, count=11), "head says 11 triangles, and its 684 bytes hold 12"),
    "cut.stl": (binary_stl(BOX)[:-20], "head says 12 triangles, and its 664 bytes hold 11; .* save it anew"),
    "decimal comma.stl": (TEXT.replace(b"0.3", b"0,3"), "vertex 36 times, 18 times before three numbers, in 12 facets"),
    "four corners.stl": (TEXT.replace(b"endloop", b"vertex 1 2 3\nendloop"), "vertex 48 times, .* in 12 facets; each"),
    "only slivers.stl": (text_stl([[(1, 2, 3)] * 3]), "holds only triangles that have a corner twice"),
    "two coordinates.obj": (re.sub(r" \S+\n", "\n", VERTICES) + QUADS, "not three coordinates|holds no triangles"),
    "corner 0.obj": (VERTICES + QUADS + "f 0 1 2", r"the face 'f 0 1 2' has the corner 0; numbers .* begin at 1"),
    "corner 99.obj": (VERTICES + QUADS + "f 99 1 2", "a face has a corner that is none of its vertices"),
    "corner -99.obj": (VERTICES + QUADS + "f -99 1 2", "a face has a corner that is none of its vertices"),
    "billions.ply": (PLY.replace("vertex 8", "vertex 4000000000"), "cannot be read as PLY|holds no triangles"),
    **{f"part.{kind}": (b"PK", r"is neither \.stl, \.obj, \.ply nor \.off; save the mesh in one of these: Blender")
       for kind in ("dae", "step", "stp", "3mf", "glb", "gltf")},
}  # fmt: skip


@pytest.mark.parametrize("name", TAKEN)
def test_file_as_other_programs_write_it_is_taken(tmp_path, name):
    data = TAKEN[name]
    scene = scene_of(tmp_path, data if isinstance(data, bytes) else data.encode(), name)
    check_box(scene, 1e-6)  # measured 4.2e-7 where the file has float32
    assert scene.notes == ()


@pytest.mark.parametrize("kind", ["ply", "off", "obj", "stl"])
def test_file_that_trimesh_writes_is_taken(tmp_path, kind):
    import trimesh

    data = trimesh.Trimesh(CORNERS, SIDES, process=False).export(file_type=kind)
    check_box(scene_of(tmp_path, data if isinstance(data, bytes) else data.encode(), f"part.{kind}"), 1e-6)


def test_polygons_of_an_l_are_its_triangles(tmp_path):
    """Of six corners, one of them turned inwards: 0.75 m² by 1 m."""
    outline = [(0.5, 1), (0, 1), (0, 0), (1, 0), (1, 0.5), (0.5, 0.5)]
    lines = [f"v {x} {y} {z}" for z in (0, 1) for x, y in outline] + ["f 6 5 4 3 2 1", "f 7 8 9 10 11 12"]
    lines += [f"f {k + 1} {(k + 1) % 6 + 1} {(k + 1) % 6 + 7} {k + 7}" for k in range(6)]
    scene = scene_of(tmp_path, "\n".join(lines).encode(), "l.obj")
    assert scene["body.mass"] == pytest.approx(750.0, rel=1e-12)
    assert_allclose(scene["body.center_of_mass"], (5 / 12, 5 / 12, 0.5), rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", REFUSED)
def test_file_that_cannot_be_taken_is_refused_in_a_sentence(tmp_path, name):
    data, message = REFUSED[name]
    with pytest.raises(ValueError, match=message) as told:
        scene_of(tmp_path, data if isinstance(data, bytes) else data.encode(), name)
    assert str(told.value).startswith("parameter body.mesh_file = ")


def test_negative_corners_of_an_obj_are_counted_from_where_they_stand(tmp_path):
    """Vertices that come later, here of a larger box without faces, change nothing."""
    corners = [(x, y, z) for x in (0, 1) for y in (0, 2) for z in (0, 3)]
    faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
             (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]  # fmt: skip
    lines = ["v {} {} {}".format(*corner) for corner in corners]
    lines += ["f {} {}/-1 {}/-1/-1".format(*(k - 8 for k in face)) for face in faces]
    lines += ["v {} {} {}".format(*(2 * x for x in corner)) for corner in corners]
    (tmp_path / "box.obj").write_text("\n".join(lines))
    scene = Scene({"body.mesh_file": str(tmp_path / "box.obj"), "body.density": 5.0})
    assert scene["body.mass"] == pytest.approx(30.0, rel=1e-15)


@pytest.mark.parametrize(("factor", "told"), [(1000.0, True), (30.0, False)])
def test_mass_of_a_ship_that_follows_from_a_density_is_told(tmp_path, factor, told):
    """With a density given, lengths in mm show in the mass alone: 6e9 kg instead of 6."""
    notes = scene_of(tmp_path, binary_stl(BOX * factor)).notes
    text = "m³ makes a mass of 6e+09 kg; lengths in mm taken as m may explain it: then give body.mesh_scale: [0.001, "
    assert [text in note for note in notes] == [True] * told
