"""Where a scene's inertia comes from: shape, mesh, URDF link, or given; one source, and no contradictions."""

import contextlib
import importlib.util

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from rigid_body_sim import Scene, load_scene
from rigid_body_sim.mass.shapes import SHAPES

pytestmark = pytest.mark.no_numba

needs_trimesh = pytest.mark.skipif(not importlib.util.find_spec("trimesh"), reason="trimesh is not installed")

CORNERS = [(x, y, z) for x in (0, 0.3) for y in (0, 0.5) for z in (0, 0.2)]
TRIANGLES = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
             (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]  # fmt: skip
URDF = (
    '<robot name="r"><link name="hull"><inertial><origin xyz="0.1 0.2 0.3" rpy="0 0 1.5707963267948966"/>'
    '<mass value="2.5"/><inertia ixx="0.3" ixy="0" ixz="0" iyy="0.4" iyz="0" izz="0.5"/></inertial></link></robot>'
)


def stl(triangles=TRIANGLES):
    """Text of an STL file of the box of CORNERS."""
    lines = ["solid box"]
    for triangle in triangles:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex {} {} {}".format(*CORNERS[k]) for k in triangle]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid box", ""])


def obj():
    """Text of an OBJ file of the same box, its corners written once for each triangle, with a material."""
    lines = ["mtllib nowhere.mtl", "usemtl steel"]
    for k, triangle in enumerate(TRIANGLES):
        lines += ["v {} {} {}".format(*CORNERS[corner]) for corner in triangle]
        lines.append(f"f {3 * k + 1} {3 * k + 2} {3 * k + 3}")
    return "\n".join([*lines, ""])


@pytest.fixture
def folder(tmp_path):
    """A folder with box.stl, box.obj, open.stl, text.stl and hull.urdf."""
    for name, text in {
        "box.stl": stl(),
        "box.obj": obj(),
        "open.stl": stl(TRIANGLES[:-1]),
        "text.stl": "nothing to see",
        "hull.urdf": URDF,
    }.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def test_shape_gives_the_inertia_and_leaves_the_rest():
    scene = Scene(
        {"body.shape": "box", "body.dimensions": (0.3, 0.5, 0.2), "body.mass": 2.0, "body.center_of_mass": (1, 2, 3)}
    )
    expected = SHAPES["box"].mass_properties((0.3, 0.5, 0.2), mass=2.0)
    body = scene.body()
    assert (body.mass, body.center_of_mass.tolist()) == (2.0, [1, 2, 3])
    assert_array_equal(body.inertia, expected.inertia)
    assert scene["body.inertia"] == tuple(body.inertia_entries)


def test_density_gives_the_mass():
    scene = Scene({"body.shape": "sphere", "body.dimensions": [1], "body.density": 3.0})
    assert scene["body.mass"] == scene.body().mass == 4 * np.pi


def test_mass_not_given_is_the_default():
    assert Scene({"body.shape": "sphere", "body.dimensions": [1]})["body.mass"] == 1.0


@needs_trimesh
@pytest.mark.parametrize("file", ["box.stl", "box.obj"])
def test_mesh_file_gives_inertia_and_centre_of_mass(folder, file):
    scene = Scene({"body.mesh_file": file, "body.density": 700.0}, folder)
    box = SHAPES["box"].mass_properties((0.3, 0.5, 0.2), density=700.0)
    body = scene.body()
    assert body.mass == pytest.approx(box.mass, rel=2e-15, abs=0)  # measured 1.7e-16
    assert_allclose(body.center_of_mass, (0.15, 0.25, 0.1), rtol=0, atol=1e-16)  # measured 0
    assert_allclose(body.inertia, box.inertia, rtol=0, atol=2e-15)  # measured 2.2e-16


def test_urdf_gives_mass_inertia_and_centre_of_mass(folder):
    for link in ("", "hull"):
        scene = Scene({"body.urdf_file": "hull.urdf", "body.urdf_link": link}, folder)
        assert (scene["body.mass"], scene["body.center_of_mass"]) == (2.5, (0.1, 0.2, 0.3))
        assert_allclose(scene.body().inertia, np.diag((0.4, 0.3, 0.5)), rtol=0, atol=1e-15)  # measured 2.2e-17


def test_paths_begin_at_the_scene_file_or_the_working_directory(folder, monkeypatch):
    (folder / "scene.yaml").write_text("/**: {ros__parameters: {body: {urdf_file: hull.urdf}}}", encoding="utf-8")
    assert load_scene(folder / "scene.yaml")["body.mass"] == 2.5
    with pytest.raises(ValueError, match=r"parameter body\.urdf_file = 'hull\.urdf': .*No such file"):
        Scene({"body.urdf_file": "hull.urdf"})
    monkeypatch.chdir(folder)
    assert Scene({"body.urdf_file": "hull.urdf"})["body.mass"] == 2.5
    assert Scene({"body.urdf_file": str(folder / "hull.urdf")}, "/nowhere")["body.mass"] == 2.5


@needs_trimesh
@pytest.mark.parametrize("file", ["box.stl", "hull.urdf"])
def test_files_are_read_once(folder, file, monkeypatch):
    """What becomes of a file later changes no body, and a change that has nothing to do with it goes on."""
    source = "body.mesh_file" if file.endswith("stl") else "body.urdf_file"
    scene = Scene({source: str(folder / file), "gravity": (0.0, 0.0, -9.81)})
    (folder / file).write_text(stl(TRIANGLES[:-1]) if file.endswith("stl") else URDF.replace("2.5", "7"))
    with pytest.raises(ValueError, match="is open") if file.endswith("stl") else contextlib.nullcontext():
        assert Scene({source: str(folder / file)})["body.mass"] == 7.0
    for _ in range(2):
        scene = scene.changed({"gravity": (0.0, 0.0, -1.62)})
        assert scene.body() == Scene({source: str(folder / file)}, files=scene._files).body()
        (folder / file).unlink(missing_ok=True)
    assert scene["body.mass"] == (1.0 if file.endswith("stl") else 2.5)
    with pytest.raises(ValueError, match="No such file"):
        scene.changed({source: str(folder / f"other_{file}")})


@needs_trimesh
def test_inertia_of_a_mesh_follows_its_mass_without_its_file(folder):
    scene = Scene({"body.mesh_file": str(folder / "box.stl"), "body.mass": 3.0})
    heavy = Scene({"body.mesh_file": str(folder / "box.stl"), "body.mass": 4.5})
    (folder / "box.stl").unlink()
    assert scene.changed({"body.mass": 4.5})["body.inertia"] == heavy["body.inertia"]
    assert_allclose(heavy["body.inertia"], 1.5 * np.array(scene["body.inertia"]), rtol=1e-15, atol=1e-18)  # 1.4e-16
    by_density = Scene({"body.mesh_file": str(folder / "box.obj"), "body.density": 100.0})
    assert_allclose(by_density["body.inertia"], scene["body.inertia"], rtol=1e-15, atol=1e-18)  # measured 1.9e-16


def test_values_of_a_scene_make_the_same_scene(folder):
    """What a node holds, all defaults and what follows included, can be given to another node."""
    for given in (
        {},
        {"body.shape": "cone", "body.dimensions": (0.3, 0.8), "body.density": 700.0},
        {"body.shape": "cone", "body.dimensions": (0.3, 0.8), "body.mass": 3.0},
        {"body.urdf_file": "hull.urdf"},
    ):
        scene = Scene(given, folder)
        assert Scene(scene.values, folder).values == scene.values


BALL = {"body.shape": "sphere", "body.dimensions": (1.0,)}
HULL = {"body.urdf_file": "hull.urdf"}
BAD = {  # parameters, and what the message must say
    "shape and inertia": (
        {**BALL, "body.inertia": (1, 1, 1, 0, 0, 0)},
        r"parameter body\.inertia = \[1\.0, 1\.0.*: contradicts body\.shape, from which \[0\.4.* follows; give one",
    ),
    "shape and mesh": ({**BALL, "body.mesh_file": "box.stl"}, r"body\.shape and body\.mesh_file are given; .* one"),
    "all three": ({**BALL, **HULL, "body.mesh_file": "a"}, r"body\.shape and body\.mesh_file and body\.urdf_file are"),
    "mass and density": (
        {**BALL, "body.density": 2.0, "body.mass": 1.0},
        r"body\.mass = 1\.0: contradicts body\.density, from which 8\.37758.* follows",
    ),
    "URDF and mass": ({**HULL, "body.mass": 1.0}, r"body\.mass = 1\.0: contradicts body\.urdf_file, from which 2\.5"),
    "URDF and centre": ({**HULL, "body.center_of_mass": (0, 0, 0)}, r"body\.center_of_mass .* contradicts body\.urdf"),
    "URDF and density": ({**HULL, "body.density": 1.0}, r"body\.density = 1\.0: needs body\.shape or body\.mesh_file"),
    "dimensions alone": ({"body.dimensions": (1.0,)}, r"body\.dimensions = \[1\.0\]: needs body\.shape; give both or"),
    "density alone": ({"body.density": 2.0}, r"body\.density = 2\.0: needs body\.shape or body\.mesh_file"),
    "link alone": ({"body.urdf_link": "hull"}, r"body\.urdf_link = 'hull': needs body\.urdf_file"),
    "unknown shape": ({"body.shape": "ball"}, "is not allowed; give empty or one of sphere, hollow_sphere, box"),
    "no dimensions": ({"body.shape": "box"}, r"parameter body\.shape = 'box': box is given 0 dimensions; it needs 3"),
    "bad dimension": ({**BALL, "body.dimensions": (-1.0,)}, r"parameter body\.shape = 'sphere': sphere: radius -1 m"),
    "dimension is not finite": ({**BALL, "body.dimensions": (np.nan,)}, r"body\.dimensions .* is not finite"),
    "dimensions are a text": ({**BALL, "body.dimensions": "1"}, r"is not an array; give some numbers such as \[1\.0"),
    "thin rod": ({"body.shape": "thin_rod", "body.dimensions": (1.0,)}, r"inertia .* not positive definite"),
    "point": ({"body.shape": "point"}, r"body\.shape = 'point': inertia .* not positive definite"),
    "disc of a density": ({"body.shape": "thin_disc", "body.dimensions": (1,), "body.density": 1.0}, "has no volume"),
    "no URDF": ({"body.urdf_file": "no.urdf"}, r"parameter body\.urdf_file = 'no\.urdf': .*No such file"),
    "folder": ({"body.urdf_file": "."}, r"parameter body\.urdf_file = '\.': .*[Dd]irectory"),
    "package": ({"body.urdf_file": "package://none_such/b.urdf"}, "package 'none_such' is not installed in any of"),
    "URL": ({"body.mesh_file": "http://a/b.stl"}, r"parameter body\.mesh_file .* http:// is not supported, as files"),
    "other format": ({"body.mesh_file": "hull.urdf"}, r"is neither \.stl, \.obj, \.ply nor \.off; save"),
    "zero byte": ({"body.urdf_file": "a\0b"}, r"parameter body\.urdf_file .* null byte"),
}  # fmt: skip


@pytest.mark.parametrize(("given", "message"), BAD.values(), ids=BAD)
def test_source_that_is_not_one_or_contradicted_is_refused(folder, given, message):
    with pytest.raises(ValueError, match=message):
        Scene(given, folder)


@needs_trimesh
@pytest.mark.parametrize(
    ("file", "message"),
    [
        ("open.stl", r"parameter body\.mesh_file = 'open\.stl': mesh is open: 3 edges"),
        ("text.stl", r"body\.mesh_file = 'text\.stl': file .*text\.stl (cannot be read as STL|holds no triangles)"),
        ("none.stl", r"body\.mesh_file = 'none\.stl': .*No such file"),
    ],
)
def test_bad_mesh_file_is_refused(folder, file, message):
    with pytest.raises(ValueError, match=message):
        Scene({"body.mesh_file": file}, folder)


@needs_trimesh
@pytest.mark.parametrize("source", ["body.mesh_file", "body.urdf_file"])
def test_path_too_long_is_shown_as_it_begins(source):
    """A file that cannot be opened is named twice, by us and by the system; neither in full."""
    with pytest.raises(ValueError, match=r"name too long: .*\.\.\. \(\d+ characters\)") as told:
        Scene({source: f"/{'a' * 3000}.stl"})
    assert len(str(told.value)) < 500  # measured 491


def test_mesh_contradicted_by_a_centre_of_mass_is_refused(folder):
    with pytest.raises(ValueError, match=r"body\.center_of_mass = .* contradicts body\.mesh_file"):
        Scene({"body.mesh_file": "box.stl", "body.center_of_mass": (0, 0, 0)}, folder)


def test_mesh_file_without_trimesh_says_what_to_install(folder, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "trimesh", None)
    with pytest.raises(ValueError, match=r"read with trimesh, which is not installed: pip install trimesh"):
        Scene({"body.mesh_file": "box.obj"}, folder)


@needs_trimesh
def test_triangle_that_collapses_when_corners_are_merged_is_left_out(folder):
    (folder / "sliver.stl").write_text(stl([*TRIANGLES, (0, 1, 1)]), encoding="utf-8")
    whole, sliver = (Scene({"body.mesh_file": name}, folder)["body.inertia"] for name in ("box.stl", "sliver.stl"))
    assert_allclose(sliver, whole, rtol=0, atol=1e-16)  # measured 0
