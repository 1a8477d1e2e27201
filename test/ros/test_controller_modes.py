"""The package's own controller with the node in each of its modes; lockstep has more in test_lockstep.py."""

import numpy as np
import pytest

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros

CONTROLLER = "rigid_body_sim.tools.pointing_controller"
INERTIA = [0.144, 0.185, 0.061, 0.0, 0.0, 0.0]
SCENE = {
    "rate": 200.0,
    "publish_rate": 100.0,
    "body": {"mass": 12.0, "inertia": INERTIA},
    "initial": {"rpy": [0.0, 0.0, 0.3]},
}
# By the mode's name: what the node is given, beside that, and what the controller is.
MODES = {
    "real time, paused at first": ({"start_paused": True}, []),
    "following its clock": ({"outputs": ["clock"]}, ["-p", "use_sim_time:=true"]),
    "twist in world axes": ({"twist_frame": "world"}, ["-p", "frame_id:=base_link"]),
    "lockstep, paused at first": ({"lockstep": True, "start_paused": True}, []),
}
LAW = ["-p", "natural_frequency:=6.0", "-p", "max_torque:=2.0"]  # settles within a second


def angle(remote):
    """From the target, which is no turn at all [rad]."""
    q = remote.poses[-1].pose.orientation
    return 2.0 * np.arcsin(min(1.0, np.hypot(np.hypot(q.x, q.y), q.z)))


@pytest.fixture
def run_both(connect, run_node):
    """A function: node and controller in one namespace, both ready; the controller is asked to end after the test."""
    started = []

    def run(scene, arguments):
        remote = connect(scene)
        namespace = remote.name.removesuffix("/rigid_body_node")
        started.append(run_node(None, module=CONTROLLER, arguments=["-r", f"__ns:={namespace}", *arguments]))
        started[-1].wait_ready()
        remote.process.wait_ready()
        return remote

    yield run
    for controller in started:
        controller.assert_stopped_cleanly()


@pytest.mark.parametrize("mode", MODES)
def test_controller_turns_the_body_to_its_target(run_both, mode):
    given, arguments = MODES[mode]
    remote = run_both({**SCENE, **given}, [*LAW, *arguments])
    if "start_paused" in given:
        remote.wait_report(lambda _, values: values["mode"] == "paused", "a report")
        if "lockstep" in given:  # it is answered before time runs
            remote.wait_report(lambda _, values: values["wrench age [s]"] == "0.000000", "the controller's command")
        assert remote.pause(False).success
    remote.wait(lambda: remote.poses and angle(remote) < 0.03, "a tenth of the angle")


def test_controller_answers_a_node_that_runs_as_fast_as_it_can(run_both):
    """Its answers are late by seconds of simulated time there, so that they arrive is all that can be asked for."""
    remote = run_both({**SCENE, "rate": 1e4, "real_time_factor": 0.0}, LAW)
    remote.wait_report(lambda _, values: values["wrench age [s]"] != "none yet", "a command")
