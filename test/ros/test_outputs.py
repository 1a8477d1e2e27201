"""Every output of a turned, spinning body whose centre of mass is off its origin, over DDS.

Against the numeric derivatives of pose and twist, and against the commands sent. Two nodes at 300 Hz, paused between
runs, publish every step: one with twist in body axes and one with twist in world axes.
"""

import sys
import types

import numpy as np
import pytest

from rigid_body_sim import Body, Scene, Simulation
from rigid_body_sim.scene import schema

from .analysis import derivative, matrices
from .remote import stamp_ns

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros
geometry = pytest.importorskip("geometry_msgs.msg")
templates = pytest.importorskip("rigid_body_sim.ros.templates")
outputs = pytest.importorskip("rigid_body_sim.ros.outputs")

RATE = 300
GRAVITY = np.array([0.3, -0.2, -9.8])
COM = np.array([0.1, -0.05, 0.2])
THRUSTER, HOOK = np.array([-0.3, 0.2, 0.1]), np.array([0.25, 0.15, -0.1])
FORCE, TORQUE = np.array([3.0, -2.0, 5.0]), np.array([1.5, -2.0, 2.5])
SCENE = {
    "rate": RATE,
    "publish_rate": 0,
    "start_paused": True,
    "wrench.timeout": 0,
    "gravity": GRAVITY.tolist(),
    "outputs": ["odom", "accel", "imu", "wrench_applied", "marker", "clock"],
    "body.mass": 2.0,
    "body.shape": "box",
    "body.dimensions": [0.8, 1.2, 1.5],
    "body.center_of_mass": COM.tolist(),
    "initial.position": [0.3, -0.2, 0.5],
    "initial.orientation": {"w": 0.4, "x": 0.2, "y": -0.8, "z": 0.4},
    "initial.linear_velocity": [0.5, 0.2, 3.0],
    "initial.angular_velocity": [1.1, -2.0, 0.7],
    "frames.thruster.position": THRUSTER.tolist(),
    "frames.hook.position": HOOK.tolist(),
    "frames.hook.axes": "world",
}
# The numbers of each message, in the order of the package: quaternions are w, x, y, z.
NUMBERS = {
    "odom": lambda m: (*_pose(m.pose.pose), *_twist(m.twist.twist)),
    "accel": lambda m: _twist(m.accel),
    "imu": lambda m: (*_wxyz(m.orientation), *_xyz(m.angular_velocity), *_xyz(m.linear_acceleration)),
    "wrench_applied": lambda m: (*_xyz(m.wrench.force), *_xyz(m.wrench.torque)),
    "marker": lambda m: _pose(m.pose),
}


def _xyz(v):
    return v.x, v.y, v.z


def _wxyz(q):
    return q.w, q.x, q.y, q.z


def _pose(pose):
    return *_xyz(pose.position), *_wxyz(pose.orientation)


def _twist(twist):
    return *_xyz(twist.linear), *_xyz(twist.angular)


class Watched:
    """A node, and the messages of all its outputs by topic and stamp."""

    def __init__(self, remote):
        from nav_msgs.msg import Odometry
        from rosgraph_msgs.msg import Clock
        from sensor_msgs.msg import Imu
        from visualization_msgs.msg import Marker

        self.remote = remote.ready()
        kinds = {"odom": Odometry, "accel": geometry.AccelStamped, "imu": Imu}
        kinds |= {"wrench_applied": geometry.WrenchStamped, "marker": Marker}
        self.heard = {topic: remote.listen(kind, topic) for topic, kind in kinds.items()}
        self.ticks = remote.listen(Clock, "/clock")
        remote.reset_until_heard(*self.heard.values(), self.ticks)

    def run(self, count, frame_id="thruster", force=FORCE, torque=TORQUE):
        """Track of ``count`` steps from the initial state under a wrench, and the rows of the other outputs."""
        remote = self.remote
        remote.call("reset")
        remote.send(frame_id, force=force, torque=torque)
        remote.wait_report(lambda _, values: values["wrench held"] == "yes", "the wrench")
        remote.settle()
        remote.clear()
        remote.pause(False)
        remote.wait(lambda: min(len(remote.poses), len(remote.twists)) >= count, f"{count} messages")
        remote.pause(True)
        track = remote.track(count)
        assert set(np.diff(track.stamp_ns).tolist()) == {3_333_333, 3_333_334}, "a step is missing"
        return track, {topic: self.rows(topic, track.stamp_ns.tolist()) for topic in self.heard}

    def rows(self, topic, stamps):
        def messages():
            return {stamp_ns(message): message for message in self.heard[topic]}

        self.remote.wait(lambda: set(stamps) <= set(messages()), f"{topic} of every step")
        return np.array([NUMBERS[topic](messages()[stamp]) for stamp in stamps])


@pytest.fixture(scope="module")
def nodes(connect_shared):
    return {axes: Watched(connect_shared({**SCENE, "twist_frame": axes})) for axes in ("body", "world")}


@pytest.fixture(scope="module")
def runs(nodes):
    """100 steps of each node under the same wrench, in the thruster's axes."""
    return {axes: watched.run(100) for axes, watched in nodes.items()}


def in_body(track, vectors):
    return np.einsum("nji,nj->ni", matrices(track.orientation), vectors)


def test_odom_is_pose_and_twist_in_the_child_frame(runs, nodes):
    track, rows = runs["body"]
    assert rows["odom"][:, :3].tolist() == track.position.tolist()
    assert rows["odom"][:, 3:7].tolist() == track.orientation.tolist()
    velocity = in_body(track, np.pad(derivative(track.position, 1 / RATE), ((4, 4), (0, 0))))
    assert rows["odom"][4:-4, 7:10] == pytest.approx(velocity[4:-4], rel=0.0, abs=2e-12)  # measured 5.4e-14
    assert rows["odom"][:, 10:].tolist() == track.angular.tolist()
    message = nodes["body"].heard["odom"][-1]
    assert (message.header.frame_id, message.child_frame_id) == ("world", "base_link")
    assert not message.pose.covariance.any() and not message.twist.covariance.any()


def test_odom_twist_does_not_depend_on_the_axes_of_twist(runs):
    track, rows = runs["world"]
    assert rows["odom"][:, 7:10] == pytest.approx(in_body(track, track.linear), rel=0.0, abs=1e-13)  # measured 8.9e-16
    assert rows["odom"][:, 10:] == pytest.approx(in_body(track, track.angular), rel=0.0, abs=1e-13)  # measured 8.9e-16
    assert np.abs(rows["odom"][:, 7:10] - track.linear).max() > 1.0


def test_accel_is_the_derivative_of_twist_in_world_axes(runs, nodes):
    track, rows = runs["world"]
    expected = derivative(np.hstack((track.linear, track.angular)), 1 / RATE)
    assert rows["accel"][4:-4] == pytest.approx(expected, rel=0.0, abs=1e-11)  # measured 4.3e-13
    assert np.linalg.norm(expected, axis=1).min() > 1.0
    assert nodes["world"].heard["accel"][-1].header.frame_id == "world"


def test_accel_is_the_same_vector_in_body_axes(runs, nodes):
    """Not the derivative of the components in body axes, which leaves out that those axes turn."""
    track, rows = runs["body"]
    velocity = np.einsum("nij,nj->ni", matrices(track.orientation), track.linear)
    acceleration = in_body(track, np.pad(derivative(velocity, 1 / RATE), ((4, 4), (0, 0))))
    assert rows["accel"][4:-4, :3] == pytest.approx(acceleration[4:-4], rel=0.0, abs=1e-11)  # measured 4.9e-13
    spin = derivative(track.angular, 1 / RATE)
    assert rows["accel"][4:-4, 3:] == pytest.approx(spin, rel=0.0, abs=1e-11)  # measured 3.3e-13
    assert np.abs(rows["accel"][4:-4, :3] - derivative(track.linear, 1 / RATE)).max() > 1.0
    assert nodes["body"].heard["accel"][-1].header.frame_id == "base_link"


def test_imu_shows_specific_force(runs, nodes):
    """R' (a − g) at the origin of the body frame, attitude and rates: REP-145."""
    track, rows = runs["body"]
    velocity = np.einsum("nij,nj->ni", matrices(track.orientation), track.linear)
    specific = in_body(track, np.pad(derivative(velocity, 1 / RATE), ((4, 4), (0, 0))) - GRAVITY)
    assert rows["imu"][4:-4, 7:] == pytest.approx(specific[4:-4], rel=0.0, abs=1e-11)  # measured 4.9e-13
    assert rows["imu"][:, :4].tolist() == track.orientation.tolist()
    assert rows["imu"][:, 4:7].tolist() == track.angular.tolist()
    message = nodes["body"].heard["imu"][-1]
    assert message.header.frame_id == "base_link"
    assert not message.linear_acceleration_covariance.any()  # unknown; a field that is absent has −1 first


def test_wrench_applied_is_what_was_sent_about_the_origin(nodes):
    """In body axes. A force in world axes turns against the body; a world wrench acts at the centre of mass."""
    meanings = {
        "base_link": lambda R: (FORCE, TORQUE),
        "thruster": lambda R: (FORCE, TORQUE + np.cross(THRUSTER, FORCE)),
        "world": lambda R: (R.T @ FORCE, R.T @ TORQUE + np.cross(COM, R.T @ FORCE)),
        "hook": lambda R: (R.T @ FORCE, R.T @ TORQUE + np.cross(HOOK, R.T @ FORCE)),
    }
    for frame_id, meaning in meanings.items():
        track, rows = nodes["body"].run(20, frame_id)
        expected = np.array([np.concatenate(meaning(R)) for R in matrices(track.orientation)])
        assert rows["wrench_applied"] == pytest.approx(expected, rel=0.0, abs=1e-13), frame_id  # measured 2.4e-15
    assert nodes["body"].heard["wrench_applied"][-1].header.frame_id == "base_link"


def test_wrench_applied_is_zero_when_nothing_is_held(nodes):
    watched = nodes["body"]
    watched.remote.call("clear_wrench")
    watched.remote.settle()
    watched.remote.clear()
    watched.remote.call("step")
    track = watched.remote.collect(1)
    assert not watched.rows("wrench_applied", track.stamp_ns.tolist()).any()


def test_marker_is_the_shape_about_the_centre_of_mass(runs, nodes):
    track, rows = runs["body"]
    middle = track.position + np.einsum("nij,j->ni", matrices(track.orientation), COM)
    assert rows["marker"][:, :3] == pytest.approx(middle, rel=0.0, abs=1e-14)  # measured 1.1e-16
    assert rows["marker"][:, 3:].tolist() == track.orientation.tolist()
    message = nodes["body"].heard["marker"][-1]
    assert (message.type, _xyz(message.scale)) == (message.CUBE, (0.8, 1.2, 1.5))
    assert message.header.frame_id == "world" and message.color.a > 0.0


def test_clock_ticks_with_the_stamps(runs, nodes):
    stamps = {tick.clock.sec * 10**9 + tick.clock.nanosec for tick in nodes["body"].ticks}
    assert set(runs["body"][0].stamp_ns.tolist()) <= stamps


# What needs no other process ------------------------------------------------------------------------------------------


def marker_of(**given):
    """The marker message of a scene, its pose filled in for a body at (1, 2, 3) turned by 90° about z."""
    state = {"initial.position": (1.0, 2.0, 3.0), "initial.orientation": {"w": 1.0, "x": 0.0, "y": 0.0, "z": 1.0}}
    scene = Scene({**state, **{name.replace("__", "."): value for name, value in given.items()}})
    simulation = Simulation.from_scene(scene)
    output = outputs.KINDS["marker"](scene, simulation)
    return templates.Typed(output.message, output.fields).write(0, output.values(outputs.Motion(simulation)))


SHAPES = {  # dimensions, kind of marker, size
    "sphere": ((0.5,), "SPHERE", (1.0, 1.0, 1.0)),
    "hollow_sphere": ((0.5, 0.4), "SPHERE", (1.0, 1.0, 1.0)),
    "ellipsoid": ((0.5, 1.0, 1.5), "SPHERE", (1.0, 2.0, 3.0)),
    "box": ((0.5, 1.0, 1.5), "CUBE", (0.5, 1.0, 1.5)),
    "cylinder": ((0.5, 2.0), "CYLINDER", (1.0, 1.0, 2.0)),
    "tube": ((0.5, 0.4, 2.0), "CYLINDER", (1.0, 1.0, 2.0)),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_marker_of_a_shape(shape):
    dimensions, kind, size = SHAPES[shape]
    marker = marker_of(body__shape=shape, body__dimensions=dimensions, body__center_of_mass=(0.5, 0.0, 0.0))
    assert (marker.type, _xyz(marker.scale)) == (getattr(marker, kind), size)
    assert _xyz(marker.pose.position) == pytest.approx((1.0, 2.5, 3.0), abs=1e-15)
    assert _wxyz(marker.pose.orientation) == pytest.approx((0.5**0.5, 0.0, 0.0, 0.5**0.5), abs=1e-15)


def test_marker_without_a_shape_is_an_ellipsoid_of_the_same_inertia():
    """I_x = m (b² + c²)/5 gives the semi-axes back, and the ellipsoid is turned as the principal axes are."""
    a, b, c = 0.5, 1.0, 1.5
    moments = np.diag([(b * b + c * c) / 5, (c * c + a * a) / 5, (a * a + b * b) / 5])
    R = matrices(np.array([[np.cos(0.25), np.sin(0.25), 0.0, 0.0]]))[0]
    inertia = R @ moments @ R.T
    entries = inertia[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)].tolist()
    marker = marker_of(body__mass=1.0, body__inertia=entries, initial__orientation=schema.PARTS)
    assert marker.type == marker.SPHERE
    axes = matrices(np.array([_wxyz(marker.pose.orientation)]))[0]
    semi = np.array(_xyz(marker.scale)) / 2
    assert sorted(semi) == pytest.approx([a, b, c], rel=1e-14)
    assert axes @ np.diag(semi**2) @ axes.T == pytest.approx(R @ np.diag([a * a, b * b, c * c]) @ R.T, abs=1e-14)


def test_marker_follows_a_body_that_is_changed():
    """Four times the inertia of the same mass: an ellipsoid of twice the size; and what is sent as bytes says so."""
    scene = Scene({"body.mass": 1.0, "body.inertia": (0.2, 0.3, 0.4, 0.0, 0.0, 0.0)})
    simulation = Simulation.from_scene(scene)
    output = outputs.KINDS["marker"](scene, simulation)
    deserialize_message = pytest.importorskip("rclpy.serialization").deserialize_message

    def size():
        data = templates.Template(output.message, output.fields).write(0, output.values(outputs.Motion(simulation)))
        return np.array(_xyz(deserialize_message(data, type(output.message)).scale))

    before = size()
    simulation.change(body=Body(1.0, (0.8, 1.2, 1.6)))
    assert before.min() > 0.0
    assert size() == pytest.approx(2.0 * before, rel=1e-15)  # measured 0
    simulation.change(body=Body(4.0, (0.8, 1.2, 1.6)))
    assert size() == pytest.approx(before, rel=1e-15)  # measured 0


def test_marker_of_a_flat_body_keeps_some_thickness():
    marker = marker_of(body__shape="thin_disc", body__dimensions=(0.5,))
    assert marker.scale.x == marker.scale.y == 100 * marker.scale.z > 0.0


def test_marker_of_a_mesh_is_its_file(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    file = tmp_path / "box.stl"
    trimesh.creation.box((1.0, 2.0, 3.0)).apply_translation((0.5, 0.0, 0.0)).export(file)
    marker = marker_of(body__mesh_file=str(file), body__mesh_scale=(1.0, 0.5, 2.0))
    assert (marker.type, marker.mesh_resource) == (marker.MESH_RESOURCE, f"file://{file}")
    assert _xyz(marker.scale) == (1.0, 0.5, 2.0)
    assert _xyz(marker.pose.position) == pytest.approx(
        (1.0, 2.0, 3.0), abs=1e-15
    )  # of the body frame, as the file's numbers


def test_transform_is_the_pose(monkeypatch):
    """With a stand-in for tf2_msgs, which is not on PyPI."""
    message = types.ModuleType("tf2_msgs.msg")
    message.TFMessage = types.SimpleNamespace
    monkeypatch.setitem(sys.modules, "tf2_msgs", types.ModuleType("tf2_msgs"))
    monkeypatch.setitem(sys.modules, "tf2_msgs.msg", message)
    scene = Scene({name: value for name, value in SCENE.items() if name.startswith("initial.")})
    simulation = Simulation.from_scene(scene)
    output = outputs.KINDS["tf"](scene, simulation)
    written = templates.Typed(output.message, output.fields, output.stamp).write(
        3 * 10**9 + 5, simulation_pose(simulation)
    )
    assert output.values(outputs.Motion(simulation)) == simulation_pose(simulation)
    (transform,) = written.transforms
    assert (output.topic, transform.header.frame_id, transform.child_frame_id) == ("/tf", "world", "base_link")
    assert (transform.header.stamp.sec, transform.header.stamp.nanosec) == (3, 5)
    assert _xyz(transform.transform.translation) == (0.3, -0.2, 0.5)
    assert _wxyz(transform.transform.rotation) == pytest.approx((0.4, 0.2, -0.8, 0.4), abs=1e-15)


def simulation_pose(simulation):
    x, y, z, qw, qx, qy, qz = simulation.pose
    return x, y, z, qx, qy, qz, qw


def test_transform_without_tf2_msgs_is_refused_by_a_sentence(monkeypatch):
    monkeypatch.setitem(sys.modules, "tf2_msgs", None)
    scene = Scene()
    with pytest.raises(ValueError, match=r"parameter outputs: 'tf' needs the package tf2_msgs, .* or leave 'tf' out"):
        outputs.KINDS["tf"](scene, Simulation.from_scene(scene))


def test_every_output_that_a_scene_may_name_exists():
    assert {*outputs.KINDS} == {*outputs.ALWAYS, *schema.OUTPUTS}


# Who listens ----------------------------------------------------------------------------------------------------------


def executors():
    from rclpy.executors import SingleThreadedExecutor

    experimental = pytest.importorskip("rclpy.experimental")
    return {"events": experimental.EventsExecutor, "single-threaded": SingleThreadedExecutor}


@pytest.mark.parametrize("name", ["events", "single-threaded"])
def test_outputs_are_made_for_listeners_alone(context, name):
    """Of those that come and go: none before the first, each counted, none after the last."""
    from rclpy.node import Node

    node = Node(f"outputs_{name.partition('-')[0]}", context=context)
    other = Node(f"listener_{name.partition('-')[0]}", context=context)
    scene = Scene({"outputs": ("odom",)})
    own = outputs.Outputs(node, scene, Simulation.from_scene(scene))
    executor = executors()[name](context=context)
    executor.add_node(node)
    sent = []
    for channel in own.channels:
        channel._send = lambda _, topic=channel.output.topic: sent.append(topic)

    def wait_for(listeners):
        deadline = 400
        while [channel.listeners for channel in own.channels] != listeners and deadline:
            executor.spin_once(timeout_sec=0.05)
            deadline -= 1
        assert [channel.listeners for channel in own.channels] == listeners
        sent.clear()
        own.publish(0)
        assert sent == [c.output.topic for c, count in zip(own.channels, listeners, strict=True) if count]

    wait_for([0, 0, 0])
    first = other.create_subscription(geometry.PoseStamped, "pose", print, 10)
    wait_for([1, 0, 0])
    second = other.create_subscription(geometry.PoseStamped, "pose", print, 10)
    third = other.create_subscription(geometry.TwistStamped, "twist", print, 10)
    wait_for([2, 1, 0])
    other.destroy_subscription(first)
    wait_for([1, 1, 0])
    other.destroy_subscription(second)
    other.destroy_subscription(third)
    wait_for([0, 0, 0])
    executor.remove_node(node)
    executor.shutdown()
    node.destroy_node()
    other.destroy_node()


# What is recorded -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["bytes", "field by field"])
def test_recorded_bytes_are_those_of_the_message(context, monkeypatch, kind):
    """Whether or not anybody listens, and also where a message cannot be written as bytes."""
    from rclpy.node import Node
    from rclpy.serialization import deserialize_message

    if kind != "bytes":
        monkeypatch.setattr(templates, "writer", lambda *layout: (templates.Typed(*layout), "as a test"))
    node = Node("recorded", context=context)
    scene = Scene({"initial.position": [1.0, 2.0, 3.0], "twist_frame": "world"})
    own = outputs.Outputs(node, scene, Simulation.from_scene(scene))
    recorded = {}
    assert not own.heard
    for channel in own.channels:
        channel.record(lambda data, topic=channel.output.topic: recorded.setdefault(topic, data))
    assert own.heard
    own.publish(5_000_000_007)
    node.destroy_node()
    pose = deserialize_message(recorded["pose"], geometry.PoseStamped)
    twist = deserialize_message(recorded["twist"], geometry.TwistStamped)
    assert (pose.pose.position.x, pose.pose.position.y, pose.pose.position.z) == (1.0, 2.0, 3.0)
    assert (stamp_ns(pose), twist.header.frame_id) == (5_000_000_007, "world")
