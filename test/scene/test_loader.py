"""Scene files: ROS parameter files, read strictly, and what they describe."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from rigid_body_sim import Body, Drag, Scene, Simulation, Tether, load_scene
from rigid_body_sim.kernels import wrench as wrench_kernels
from rigid_body_sim.scene.fleet import by_name, load_any
from rigid_body_sim.terms import Terms
from rigid_body_sim.values import rotation

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
    for scene in by_name(load_any(path)).values():
        sim = Simulation.from_scene(scene)
        sim.step(3)
        assert np.isfinite(sim.state.values).all()


def test_package_has_scenes():
    assert CONFIG


def test_missing_file_is_an_os_error_with_the_path(tmp_path):
    with pytest.raises(OSError, match=r"nowhere\.yaml"):
        load_scene(tmp_path / "nowhere.yaml")


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
    assert scene.effect("drag") == Drag((1, 2, 3), angular_quadratic=(4, 5, 6))
    boom = Tether((0.1, 0.2, 0.3), (1, 0, 0), 0.0, 5.0, 0.5, False)
    assert scene.effect("tethers") == (boom, Tether((0, 0, 0), (0, 0, 5), 2.0, 1000.0, 0.0, True))
    assert scene.effect("forces") == (((0, 0, 0), (0, 0, 9)), ((0, 0, 0.4), (1, 0, 0)))


def test_scene_without_them_has_none():
    assert tuple(map(Scene().effect, ("drag", "tethers", "forces"))) == (Drag(), (), ())


# Wrenches sent in a frame fixed to the body -------------------------------------------------------------------------

BODY = Body(2.0, (0.3, 0.4, 0.5), (0.1, -0.2, 0.3))
POSITION, ORIENTATION = (0.4, 0.1, -0.2), (0.4, 0.2, -0.8, 0.4)
FORCE, TORQUE = np.array((1.0, -2.0, 3.0)), np.array((0.3, 0.2, -0.1))


def force_and_torque(wrench, q):
    """Force and torque about the centre of mass [world] of a wrench on a body at the attitude q."""
    model = Terms(BODY, (0, 0, 0)).model(wrench)
    wrench_kernels.reduce_wrench(model)
    return wrench_kernels.force_world(model, *q), rotation.rotate(q, wrench_kernels.torque_principal(model, *q))


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


@pytest.mark.parametrize(("rate", "timeout", "told"), [(3.0, 0.1, True), (3.0, 1 / 3, False), (3.0, 0.0, False)])
def test_timeout_shorter_than_a_step_is_told(rate, timeout, told):
    notes = Scene({"rate": rate, "publish_rate": 0.0, "wrench.timeout": timeout}).notes
    text = "parameter wrench.timeout = 0.1: is shorter than a step of 0.333333 s, and a command acts for one step"
    assert notes == ((text,) if told else ())


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"lockstep_on": "actuators"}, "parameter lockstep_on: actuators needs actuators, and there are none; name"),
        ({"outputs": ["imu", "actuator_states"]}, "parameter outputs: actuator_states needs actuators, and there are"),
    ],
    ids=["lockstep", "output"],
)
def test_what_needs_actuators_is_refused_without(given, said):
    with pytest.raises(ValueError, match=said):
        Scene(given)
    jet = {"type": "thruster", "min": 0.0, "max": 1.0}
    assert Scene({**given, "actuators": {"names": ["jet"], "jet": jet}})
