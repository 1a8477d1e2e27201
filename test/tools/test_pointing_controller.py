"""The controller as a process and as a node."""

import os
import random
import signal
import subprocess
import sys

import numpy as np
import pytest

from rigid_body_sim.values import rotation

rclpy = pytest.importorskip("rclpy")
messages = pytest.importorskip("geometry_msgs.msg")
pytestmark = pytest.mark.ros

DOMAIN = {"ROS_DOMAIN_ID": str(random.randint(1, 100)), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
ORIENTATION, OMEGA = (0.5, -0.5, 0.5, 0.5), np.array((0.1, -0.2, 0.3))


def start(*settings: str) -> subprocess.Popen:
    command = [sys.executable, "-m", "rigid_body_sim.tools.pointing_controller", "--ros-args"]
    command += [part for setting in settings for part in ("-p", setting)]
    return subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env={**os.environ, **DOMAIN})


@pytest.mark.parametrize("number", (signal.SIGINT, signal.SIGTERM))
def test_ends_when_asked(number):
    controller = start()
    first = controller.stderr.readline()
    assert "ready" in first
    controller.send_signal(number)
    assert "Traceback" not in controller.communicate(timeout=30)[1]
    assert controller.returncode == 0


@pytest.mark.parametrize(
    ("setting", "reason"),
    (
        ("target:=[0,0,0,1]", "as x, y, z, w that is {w: 1, x: 0, y: 0, z: 0}; as w, x, y, z it is {w: 0, x: 0,"),
        ("target.orientation.w:=1", "given without target.orientation.x, target.orientation.y, target.orientation.z"),
        ("targt.rpy:=[0.0,0.0,1.0]", "did you mean target.rpy?"),
        ("max_torque:=-1.0", "greater than 0"),
        ("inertia:=[1.0]", "shape"),
    ),
)
def test_useless_parameter_is_one_sentence(setting, reason):
    controller = start(setting)
    said = controller.communicate(timeout=60)[1]
    assert controller.returncode == 1
    assert said.startswith("pointing_controller: ") and said.count("\n") == 1
    assert reason in said


@pytest.fixture
def make_controller(monkeypatch):
    """A function: a controller in this process, with this ``frame_id`` and other parameters."""
    from rclpy.parameter import Parameter

    from rigid_body_sim.tools.pointing_node import PointingController

    for name, value in DOMAIN.items():
        monkeypatch.setenv(name, value)
    context = rclpy.Context()
    rclpy.init(context=context)

    def make(frame_id, **others):
        given = [Parameter(name, value=value) for name, value in {"frame_id": frame_id, **others}.items()]
        return PointingController(context=context, parameter_overrides=given)

    yield make
    context.try_shutdown()


def test_target_is_given_as_angles_or_by_named_parts(make_controller):
    half = np.sqrt(0.5)
    angles = make_controller("", **{"target.rpy": [0.0, 0.0, np.pi / 2]})
    parts = make_controller("", **{f"target.orientation.{p}": v for p, v in zip("wxyz", (2.0, 0, 0, 2), strict=True)})
    for controller in (angles, parts):
        assert controller.law.target == pytest.approx((half, 0.0, 0.0, half), abs=1e-15)  # measured 1.1e-16
        assert controller.get_parameter("target.rpy").value == []
    assert make_controller("").law.target.tolist() == [1.0, 0.0, 0.0, 0.0]


def test_parameters_are_fixed_and_say_so(make_controller):
    from rclpy.parameter import Parameter

    controller = make_controller("")
    for name, value in {"max_torque": 1.0, "target.rpy": [0.0, 0.0, 1.0]}.items():
        (result,) = controller.set_parameters([Parameter(name, value=value)])
        said = f"parameter {name} = {value}: is read at start only; start the node again with another value for it"
        assert not result.successful and result.reason == f"{said}; so is every other"
        assert controller.describe_parameter(name).read_only
    (result,) = controller.set_parameters([Parameter("use_sim_time", value=True)])
    assert result.successful


def pair(omega: np.ndarray, twist_frame: str) -> tuple:
    pose, twist = messages.PoseStamped(), messages.TwistStamped()
    pose.header.frame_id, twist.header.frame_id = "world", twist_frame
    pose.header.stamp.sec = twist.header.stamp.sec = 7
    q, w = pose.pose.orientation, twist.twist.angular
    (q.w, q.x, q.y, q.z), (w.x, w.y, w.z) = ORIENTATION, omega.tolist()
    return pose, twist


def test_answer_is_in_body_axes_whatever_the_axes_of_twist(make_controller):
    body, world = make_controller(""), make_controller("base_link")
    answers = (
        body.answer(*pair(OMEGA, "base_link")),
        world.answer(*pair(rotation.rotate(ORIENTATION, OMEGA), "world")),
    )
    expected = body.law.torque(ORIENTATION, OMEGA)
    for answer in answers:
        torque = answer.wrench.torque
        assert np.allclose((torque.x, torque.y, torque.z), expected, rtol=0.0, atol=1e-15)  # N m; measured 0 and 7e-18
        assert (answer.header.frame_id, answer.header.stamp.sec) == ("base_link", 7)


def test_twist_in_world_axes_needs_the_body_frame(make_controller):
    with pytest.raises(ValueError, match="set frame_id"):
        make_controller("").answer(*pair(OMEGA, "world"))
