"""What a scene, a node's parameters or terms alone make a body look like."""

import numpy as np
import pytest

from rigid_body_sim.scene.fleet import by_name, load_any
from rigid_body_sim.scene.installed import installed_scene, installed_scenes
from rigid_body_sim.scene.loader import Scene, load_scene
from rigid_body_sim.view.look import UNKNOWN, of_terms, of_values

TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


SCENES = {file.stem: [*by_name(load_any(file)).values()][-1] for file in installed_scenes()}


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_every_scene_has_a_look(scene):
    look = of_values(scene.values)
    assert look.note == "" and look.extent > 0.0
    assert [one.name for one in look.actuators] == list(scene["actuators.names"])
    assert sorted(look.frames) == sorted(scene.frames)


def test_the_quadrotor_stands_on_its_ground_and_has_its_rotors():
    look = of_values(load_scene(installed_scene("quadrotor")).values)
    assert look.ground is not None and {one.type for one in look.actuators} == {"rotor"}
    assert look.extent >= max(float(np.linalg.norm(one.position)) for one in look.actuators)


def test_a_shape_is_shown_as_it_is():
    look = of_values(Scene({"body.shape": "box", "body.dimensions": [0.4, 0.2, 0.1]}).values)
    assert (look.solid.kind, tuple(look.solid.size)) == ("box", (0.4, 0.2, 0.1))


def test_terms_alone_are_an_ellipsoid_of_the_same_inertia():
    scene = Scene({"body.mass": 2.0, "body.inertia": [0.1, 0.2, 0.25, 0.0, 0.0, 0.0]})
    size = np.sort(np.asarray(of_terms(scene.terms()).solid.size))[::-1]
    a, b, c = 0.5 * size
    moments = 2.0 / 5.0 * np.array([b * b + c * c, a * a + c * c, a * a + b * b])
    assert np.allclose(moments, [0.1, 0.2, 0.25], rtol=1e-12)  # measured 1e-16


def test_a_mesh_is_shown_in_metres(tmp_path):
    pytest.importorskip("trimesh")
    (tmp_path / "a.obj").write_text(TETRAHEDRON)
    scene = Scene({"body.mesh_file": "a.obj", "body.mesh_scale": [2.0, 2.0, 2.0]}, tmp_path)
    look = of_values(scene.values, tmp_path)
    assert look.note == "" and look.mesh is not None
    assert look.mesh[0].shape == (4, 3) and look.extent == 2.0


def test_a_mesh_that_is_not_here_is_an_ellipsoid_and_said(tmp_path):
    pytest.importorskip("trimesh")
    (tmp_path / "a.obj").write_text(TETRAHEDRON)
    values = Scene({"body.mesh_file": "a.obj"}, tmp_path).values
    look = of_values(values, tmp_path / "elsewhere")
    assert look.solid.kind == "ellipsoid" and look.note.startswith("The mesh is not shown: ")


def test_who_tells_nothing_is_shown_as_a_box():
    assert UNKNOWN.solid.kind == "box" and UNKNOWN.extent > 0.0
