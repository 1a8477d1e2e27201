"""Scene files: ROS parameter files, read strictly, and what they describe."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from rigid_body_sim import Body, Drag, Scene, Simulation, Tether, load_scene
from rigid_body_sim.physics import forces, rotation
from rigid_body_sim.scene.loader import parameters_in

pytestmark = pytest.mark.no_numba

CONFIG = sorted((Path(__file__).parents[2] / "config").glob("*.yaml"))


@pytest.fixture
def scene_of(tmp_path):
    """A function: the scene in a file with this text."""

    def load(text):
        path = tmp_path / "scene.yaml"
        path.write_text(text, encoding="utf-8")
        return load_scene(path)

    return load


def with_parameters(*lines):
    return "\n".join(["/**:", "  ros__parameters:", *(f"    {line}" for line in lines)]) + "\n"


@pytest.mark.parametrize("path", CONFIG, ids=lambda path: path.stem)
def test_scene_of_the_package_can_be_simulated(path):
    sim = Simulation.from_scene(load_scene(path))
    sim.step(3)
    assert np.isfinite(sim.state.values).all()


def test_package_has_scenes():
    assert CONFIG


def test_nested_and_dotted_names_are_the_same(scene_of):
    nested = scene_of(with_parameters("body:", "  mass: 2.0", "initial:", "  position: [1.0, 2.0, 3.0]"))
    dotted = scene_of(with_parameters("body.mass: 2.0", "initial.position: [1.0, 2.0, 3.0]"))
    assert nested.values == dotted.values
    assert nested["body.mass"] == 2.0


def test_section_may_have_any_name(scene_of):
    assert scene_of("my_body:\n  ros__parameters:\n    rate: 10.0\n    publish_rate: 0.0\n")["rate"] == 10.0


def test_scene_without_parameters_has_the_defaults(scene_of):
    assert scene_of("/**:\n  ros__parameters:\n").values == Scene().values


@pytest.mark.parametrize(
    ("text", "number"),
    [("1e-3", 1e-3), ("1E3", 1e3), ("5e2", 500.0), (".5", 0.5), ("2", 2.0), ("+2.", 2.0), ("2.5e+1", 25.0)],
)
def test_number_is_read_as_ros_reads_it(scene_of, text, number):
    assert scene_of(with_parameters(f"body.mass: {text}"))["body.mass"] == number


BAD = {  # the text of a file, and what the message must say
    "key twice": (with_parameters("rate: 1.0", "rate: 2.0"), "key 'rate' is given twice in one section; give it once"),
    "group twice": (with_parameters("body:", "  mass: 1.0", "body:", "  mass: 2.0"), "key 'body' is given twice"),
    "nested and dotted": (with_parameters("body.mass: 1.0", "body:", "  mass: 2.0"), r"body\.mass is given twice"),
    "alias": (with_parameters("body.inertia: &a [1, 1, 1, 0, 0, 0]", "gravity: *a"), "has an alias"),
    "bomb": ("a: &a [x, x]\nb: &b [*a, *a]\nc: &c [*b, *b]\nd: [*c, *c]\n", "has an alias"),
    "empty": ("", r"holds one section, such as '/\*\*:', with 'ros__parameters:' below it"),
    "a list": ("- 1\n- 2\n", "holds one section"),
    "a number": ("1\n", "holds one section"),
    "two sections": ("a: {ros__parameters: }\nb: {ros__parameters: }\n", "holds one section"),
    "no ros__parameters": ("/**:\n  rate: 1.0\n", "holds 'ros__parameters:' and nothing beside it"),
    "something beside": ("/**:\n  ros__parameters: {}\n  rate: 1.0\n", "and nothing beside it"),
    "section is a number": ("/**: 1\n", "and nothing beside it"),
    "parameters are a list": ("/**:\n  ros__parameters: [1, 2]\n", "needs names with values below it"),
    "not YAML": ("/**: [\n", "expected"),
    "python object": ("/**: !!python/object/apply:os.getcwd []\n", "could not determine a constructor"),
    "key that is no text": ("/**:\n  ros__parameters:\n    ? [1, 2]\n    : 3\n", "."),
    "unknown parameter": (with_parameters("body.maas: 1.0"), r"did you mean body\.mass\?"),
    "bad value": (with_parameters("body.mass: -1.0"), r"parameter body\.mass = -1\.0: is out of range"),
}


@pytest.mark.parametrize(("text", "message"), BAD.values(), ids=BAD)
def test_bad_file_is_refused_by_a_sentence_that_begins_with_its_path(scene_of, tmp_path, text, message):
    with pytest.raises(ValueError, match=message) as caught:
        scene_of(text)
    assert str(caught.value).startswith(f"{tmp_path / 'scene.yaml'}: ")
    assert "\n" not in str(caught.value)


def test_file_that_is_not_text_is_refused_with_its_path(tmp_path):
    path = tmp_path / "scene.yaml"
    path.write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(ValueError) as caught:
        load_scene(path)
    assert str(caught.value).startswith(f"{path}: ")


def test_missing_file_is_an_os_error_with_the_path(tmp_path):
    with pytest.raises(OSError, match=r"nowhere\.yaml"):
        load_scene(tmp_path / "nowhere.yaml")


def test_parameters_come_out_with_dotted_names():
    document = {"/**": {"ros__parameters": {"a": {"b": {"c": 1}}, "d.e": 2}}}
    assert parameters_in(document) == {"a.b.c": 1, "d.e": 2}


def test_scene_describes_its_body_and_state():
    scene = Scene(
        {
            "body.mass": 2.0,
            "body.inertia": (0.3, 0.4, 0.5, 0.01, 0.02, 0.03),
            "body.center_of_mass": (0.1, 0.2, 0.3),
            "initial.position": (1, 2, 3),
            "initial.orientation": {"w": 0, "x": 0, "y": 0, "z": 2},
            "initial.linear_velocity": (4, 5, 6),
            "initial.angular_velocity": (7, 8, 9),
        }
    )
    assert scene.body() == Body(2.0, (0.3, 0.4, 0.5, 0.01, 0.02, 0.03), (0.1, 0.2, 0.3))
    assert_array_equal(scene.initial_state().values, (1, 2, 3, 0, 0, 0, 1, 4, 5, 6, 7, 8, 9))


def test_scene_describes_its_drag_tethers_and_forces(scene_of):
    scene = scene_of(
        with_parameters(
            "drag: {linear: [1.0, 2.0, 3.0], angular_quadratic: [4.0, 5.0, 6.0]}",
            "tethers:",
            "  line: {anchor: [0.0, 0.0, 5.0], rest_length: 2.0, stiffness: 1e3}",
            "  boom: {anchor: [1.0, 0.0, 0.0], rest_length: 0, stiffness: 5, damping: 0.5, slack: false,",
            "         body_point: [0.1, 0.2, 0.3]}",
            "forces: {lift: {force: [0.0, 0.0, 9.0]}, wind: {force: [1.0, 0.0, 0.0], body_point: [0.0, 0.0, 0.4]}}",
        )
    )
    assert scene.drag() == Drag((1, 2, 3), angular_quadratic=(4, 5, 6))
    boom = Tether((0.1, 0.2, 0.3), (1, 0, 0), 0.0, 5.0, 0.5, False)
    assert scene.tethers() == (boom, Tether((0, 0, 0), (0, 0, 5), 2.0, 1000.0, 0.0, True))
    assert scene.forces() == (((0, 0, 0), (0, 0, 9)), ((0, 0, 0.4), (1, 0, 0)))


def test_scene_without_them_has_none():
    assert (Scene().drag(), Scene().tethers(), Scene().forces()) == (Drag(), (), ())


# Wrenches sent in a frame fixed to the body -------------------------------------------------------------------------

BODY = Body(2.0, (0.3, 0.4, 0.5), (0.1, -0.2, 0.3))
POSITION, ORIENTATION = (0.4, 0.1, -0.2), (0.4, 0.2, -0.8, 0.4)
FORCE, TORQUE = np.array((1.0, -2.0, 3.0)), np.array((0.3, 0.2, -0.1))


def force_and_torque(wrench, q):
    """Force and torque about the centre of mass [world] of a wrench on a body at the attitude q."""
    model = forces.new_model(BODY, (0, 0, 0), wrench)
    forces.reduce_wrench(model)
    return forces.force_world(model, *q), rotation.rotate(q, forces.torque_principal(model, *q))


@pytest.mark.parametrize("axes", ["body", "world"])
def test_wrench_in_a_frame_acts_at_its_origin_and_in_its_axes(axes):
    orientation = dict(zip("wxyz", ORIENTATION, strict=True))
    given = {"position": POSITION, "orientation": orientation, "axes": axes}
    frame = Scene({"frames": {"nozzle": given}}).frames["nozzle"]
    q = rotation.normalize((0.9, 0.3, -0.2, 0.1))
    to_world = rotation.to_matrix(q) @ rotation.to_matrix(ORIENTATION) if axes == "body" else np.eye(3)
    arm = rotation.to_matrix(q) @ (np.array(POSITION) - BODY.center_of_mass)
    force, torque = force_and_torque(frame.wrench(tuple(FORCE), tuple(TORQUE)), q)
    assert_allclose(force, to_world @ FORCE, rtol=0, atol=5e-15)  # measured 5.0e-16
    assert_allclose(torque, to_world @ TORQUE + np.cross(arm, to_world @ FORCE), rtol=0, atol=5e-15)  # measured 2.2e-16


def test_deep_nesting_is_refused(tmp_path):
    file = tmp_path / "deep.yaml"
    file.write_text("a: " + 5000 * "[" + 5000 * "]")
    with pytest.raises(ValueError, match=r"deep\.yaml: is nested too deeply"):
        load_scene(file)
