"""rigid_body_view beside running nodes: what it shows in a browser, what its buttons and sliders do."""

import re
import signal

import pytest

from ..report.browser_page import BrowserPage, differing, until

pytest.importorskip("rclpy")
pytest.importorskip("viser")
pytestmark = pytest.mark.ros

VIEW = "rigid_body_sim.tools.view"
SPINNING = {
    "rate": 200.0,
    "publish_rate": 200.0,
    "body.shape": "box",
    "body.dimensions": [0.6, 0.3, 0.2],
    "initial.angular_velocity": [0.0, 0.0, 1.0],
    "wrench.timeout": 0.0,
}


@pytest.fixture
def view(run_node):
    """Start rigid_body_view for a namespace: ``view(namespace, *arguments)`` gives its process and its address."""
    started = []

    def run(namespace, *arguments):
        ros = ["-r", f"__ns:={namespace}", "--", "--port", "0", *arguments]
        process = run_node(None, arguments=ros, module=VIEW)
        started.append(process)
        process.wait_for_output("http://", 60.0)
        return process, re.search(r"http://\S+", process.stdout)[0]

    yield run
    for process in started:
        process.assert_stopped_cleanly()


@pytest.fixture
def seen(tmp_path, chromium):
    """Open a page in a browser: ``seen(url)``."""
    pages = []

    def opened(url):
        pages.append(BrowserPage(chromium, tmp_path, url))
        return pages[-1]

    yield opened
    for page in pages:
        page.close()


def test_a_running_node_is_seen_and_the_buttons_act(connect, view, seen):
    node = connect(SPINNING).ready()
    page = seen(view(node.name.rpartition("/")[0])[1])
    page.wait_for("real-time factor")
    page.wait_for("running")
    first = page.scene()
    until(lambda: differing(first, page.scene()) > 0.003, "motion on the page")  # measured 0.02

    page.click("Pause")
    page.wait_for("Pause: paused")
    page.wait_for("real-time factor 0.00, paused")
    until(lambda: differing(page.scene(), page.scene()) == 0.0, "picture that stands still")
    node.settle()
    node.clear()
    page.click("Step")
    page.wait_for("Step: ")
    node.wait(lambda: node.poses, "the pose of the step")
    node.settle()
    assert len(node.poses) == 1

    page.click("Reset")
    page.wait_for("Reset: ")
    node.wait(lambda: len(node.poses) == 2, "the pose of the reset")
    assert node.poses[-1].pose.orientation.w == 1.0


def test_a_slider_that_is_on_commands_the_body(connect, view, seen):
    node = connect({**SPINNING, "initial.angular_velocity": [0.0, 0.0, 0.0]}).ready()
    from geometry_msgs.msg import WrenchStamped

    page = seen(view(node.name.rpartition("/")[0])[1])
    page.wait_for("running")
    wrenches = node.listen(WrenchStamped, "wrench")
    page.click("Command")
    page.wait_for("Send a wrench")
    page.set_number("Force x [N]", 2.0)
    assert not wrenches
    page.click("Send a wrench")
    node.wait(lambda: wrenches, "commands")
    node.wait(lambda: wrenches[-1].wrench.force.x == 2.0, "the force")
    assert wrenches[-1].header.frame_id == "base_link"
    node.clear()
    node.wait(lambda: node.poses and node.poses[-1].pose.position.x > 0.01, "motion along x")
    page.click("Send a wrench")
    node.wait(lambda: wrenches[-1].wrench.force.x == 0.0, "the zero")


def test_two_nodes_below_one_namespace_are_two_bodies(run_node, view, seen):
    for name, y in (("red", -1.0), ("blue", 1.0)):
        scene = {**SPINNING, "initial.position": [0.0, y, 0.0]}
        run_node(scene, arguments=["-r", f"__ns:=/pair/{name}"]).wait_ready()
    _, url = view("/pair")
    page = seen(url)
    for name in ("red", "blue", "Reset which"):
        page.wait_for(name)
    found = view("/pair", "--bodies", "red")[1]
    page.go(found)
    page.wait_for("red")
    page.wait_for("Hz")
    assert "blue" not in page.text()


def test_what_is_wrong_is_told_in_one_sentence(run_node):
    for arguments, said in (
        (["--", "no_such_bag"], "no_such_bag"),
        (["--", "--scene", "a.yaml"], "--scene is for a bag; leave it out: "),
        (["--", "--host", "192.0.2.1"], "nothing can listen on 192.0.2.1, port 8080 "),
    ):
        process = run_node(None, arguments=arguments, module=VIEW)
        assert process.wait_end(60.0) == 1
        assert process.stderr.startswith("rigid_body_view: ") and process.stderr.count("\n") == 1
        assert said in process.stderr


def test_sigterm_ends_it_too(run_node):
    process = run_node(None, arguments=["-r", "__ns:=/nobody", "--", "--port", "0"], module=VIEW)
    process.wait_for_output("http://", 60.0)
    assert process.stop(signal.SIGTERM)[0] == 0
    assert process.stderr == ""


@pytest.mark.parametrize(
    ("given", "value"),
    [
        ({"type": 1, "bool_value": True}, True),
        ({"type": 2, "integer_value": 3}, 3),
        ({"type": 3, "double_value": 0.5}, 0.5),
        ({"type": 4, "string_value": "a"}, "a"),
        ({"type": 8, "double_array_value": [1.0, 2.0]}, (1.0, 2.0)),
        ({"type": 9, "string_array_value": ["a"]}, ("a",)),
        ({}, None),
    ],
)
def test_values_of_parameters_are_pythons(given, value):
    from rcl_interfaces.msg import ParameterValue

    from rigid_body_sim.tools import view_node

    assert view_node.plain(ParameterValue(**given)) == value


def test_a_bodys_own_parameters_are_over_the_shared():
    from rigid_body_sim.tools import view_node

    values = {"rate": 100.0, "body.mass": 1.0, "red.body.mass": 2.0, "reds.body.mass": 3.0}
    assert view_node.of_body(values, "red")["body.mass"] == 2.0
    assert view_node.of_body(values, "blue")["body.mass"] == 1.0


def test_a_pose_is_read_from_its_bytes():
    from geometry_msgs.msg import PoseStamped
    from rclpy.serialization import serialize_message

    from rigid_body_sim.messages.cdr import split_pose

    for frame in ("", "w", "world", "a/longer/name"):
        message = PoseStamped()
        message.header.frame_id = frame
        message.header.stamp.sec, message.header.stamp.nanosec = 3, 14
        p, q = message.pose.position, message.pose.orientation
        p.x, p.y, p.z, q.x, q.y, q.z, q.w = numbers = (1.0, 2.0, 3.0, 0.1, 0.2, 0.3, 0.4)
        data = bytes(serialize_message(message))
        assert split_pose(data) == (3_000_000_014, numbers)
        assert split_pose(data[:-1]) is None and split_pose(b"\x00\x00" + data[2:]) is None
