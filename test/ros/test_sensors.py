"""Sensors over DDS: the bits of the library, at their own rates and delays, whoever listens; and what messages say."""

import math
import sys
import types

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from rigid_body_sim import Fleet, FleetScene, Scene, Simulation, Wrench
from rigid_body_sim.sensors import REGISTRY

from . import bag
from .remote import stamp_ns

pytest.importorskip("rclpy")
pytest.importorskip("pyproj")
pytestmark = pytest.mark.ros
messages = pytest.importorskip("sensor_msgs.msg")
geometry = pytest.importorskip("geometry_msgs.msg")
outputs = pytest.importorskip("rigid_body_sim.ros.outputs")
sensor_outputs = pytest.importorskip("rigid_body_sim.ros.sensor_outputs")
deserialize_message = pytest.importorskip("rclpy.serialization").deserialize_message

RATE, PER_COMMAND, LATE = 500, 5, 7


def noise(**more):
    """An object of its own for each: parameter files know no aliases."""
    return {"noise_density": 1e-3, "random_walk": 1e-2, "quantization": 1e-4, **more}


SCENE = {
    "rate": RATE,
    "publish_rate": 0,
    "lockstep": True,
    "reset_time": True,
    "steps_per_command": PER_COMMAND,
    "wrench.timeout": 0,
    "body.mass": 2.0,
    "body.inertia": [0.1, 0.2, 0.25, 0.0, 0.0, 0.0],
    "gravity": [0.0, 0.0, -9.80665],
    "initial.position": [0.0, 0.0, 5.0],
    "initial.angular_velocity": [0.3, 1.0, 0.2],
    "sensors": {
        "felt": {
            "type": "imu",
            "position": [0.1, 0.2, -0.3],
            "rpy": [0.3, -0.2, 0.9],
            "frame_id": "felt_link",
            "gyroscope": noise(),
            "accelerometer": noise(range=20.0),
        },
        "mag": {"type": "magnetometer", "rate": 100.0, "field": [2e-5, 0.0, -4e-5], "noise_density": 1e-8},
        "gps": {
            "type": "gnss",
            "rate": 50.0,
            "delay": LATE / RATE,
            "origin": {"latitude": 47.397742, "longitude": 8.545594, "altitude": 488.0},
            "horizontal": {"noise_density": 0.3},
            "vertical": {"noise_density": 0.6},
        },
        "baro": {"type": "barometer", "rate": 100.0, "noise_density": 1.0, "origin": {"altitude": 488.0}},
        "sonar": {"type": "range", "rate": 100.0, "range": 30.0, "rpy": [0.0, math.pi / 2, 0.0]},
        "mocap": {"type": "pose", "rate": 250.0, "translation": noise(), "rotation": {"noise_density": 1e-4}},
    },
}
KINDS = {
    "felt": messages.Imu,
    "mag": messages.MagneticField,
    "gps": messages.NavSatFix,
    "baro": messages.FluidPressure,
    "sonar": messages.Range,
    "mocap": geometry.PoseWithCovarianceStamped,
}
COMMANDS = [((0.1 * i, -0.2, 20.0 + i), (0.02, -0.01 * i, 0.03)) for i in range(12)]


def _xyz(v):
    return v.x, v.y, v.z


NUMBERS = {
    "felt": lambda m: (*_xyz(m.angular_velocity), *_xyz(m.linear_acceleration)),
    "mag": lambda m: _xyz(m.magnetic_field),
    "gps": lambda m: (m.latitude, m.longitude, m.altitude),
    "baro": lambda m: (m.fluid_pressure,),
    "sonar": lambda m: (m.range,),
    "mocap": lambda m: (*_xyz(m.pose.pose.position), *(getattr(m.pose.pose.orientation, part) for part in "wxyz")),
}


def offline(every=1):
    """What the library senses of the same run, by name: stamps [ns] and rows; and the motion at the end of it all."""
    sim = Simulation.from_scene(Scene(SCENE))
    found = {name: {sim.time_ns: sim.sense(name)} for name in KINDS}
    for force, torque in COMMANDS:
        sim.set_wrench(Wrench(force_body=force, torque_body=torque))
        for _ in range(0, PER_COMMAND, every):
            sim.step(every)
            for name, one in sim.instruments.items():
                if sim.steps % one.every == 0:
                    found[name][sim.time_ns] = sim.sense(name)
    return found, sim.motion


def told(heard, name):
    return {stamp_ns(message): np.array(NUMBERS[name](message)) for message in heard}


@pytest.fixture(scope="module")
def runs(connect_shared):
    """Of two nodes, to one of which nobody listens: messages by sensor, and the track."""
    found = []
    for listens in (True, False):
        remote = connect_shared(SCENE).ready()
        heard = {name: remote.listen(kind, name) for name, kind in KINDS.items() if listens}
        prompt = [heard[name] for name in heard if name != "gps"]  # which is late, and no step is taken
        remote.reset_until_heard(*prompt)
        remote.settle()
        remote.clear()
        remote.call("reset")
        remote.settle()
        remote.clear()
        for messages_of in heard.values():
            messages_of.clear()
        for done, (force, torque) in enumerate(COMMANDS, 1):
            remote.send("base_link", force, torque)
            remote.collect(done)
        found.append((heard, remote.track(len(COMMANDS)), remote))
    return found


def test_messages_have_the_bits_of_the_library_at_every_instant(runs):
    (heard, _, remote), _ = runs
    expected, _ = offline()
    for name in KINDS:
        end = len(COMMANDS) * PER_COMMAND * 10**9 // RATE - (LATE * 10**9 // RATE if name == "gps" else 0)
        rows = {stamp: row for stamp, row in expected[name].items() if 0 < stamp <= end}
        remote.wait(lambda n=name, r=rows: r.keys() <= told(heard[n], n).keys(), f"every message of {name}")
        found = told(heard[name], name)
        assert found.keys() - {0} == rows.keys(), name
        for stamp, row in rows.items():
            assert_array_equal(found[stamp], np.float32(row) if name == "sonar" else row, err_msg=f"{name} at {stamp}")


def test_a_listener_changes_no_bit_of_the_motion(runs):
    (_, heard, _), (_, unheard, _) = runs
    _, motion = offline()
    for track in (heard, unheard):
        assert (*track.position[-1], *track.orientation[-1]) == motion[:7]
    assert_array_equal(heard.position, unheard.position)
    assert_array_equal(heard.angular, unheard.angular)


def test_messages_say_frames_and_covariances(runs):
    """White noise and quantization; no orientation, so -1 (sensor_msgs/Imu, REP-145)."""
    (heard, *_), _ = runs
    first = {name: found[0] for name, found in heard.items()}
    assert {name: message.header.frame_id for name, message in first.items()} == {
        **{name: name for name in KINDS},
        "felt": "felt_link",
        "mocap": "world",
    }
    imu, q = first["felt"], 1e-8 / 12
    assert imu.orientation_covariance[0] == -1.0
    for covariance in (imu.angular_velocity_covariance, imu.linear_acceleration_covariance):
        np.testing.assert_allclose(np.reshape(covariance, (3, 3)), (1e-6 * RATE + q) * np.eye(3), rtol=1e-12)
    np.testing.assert_allclose(np.diag(np.reshape(first["mag"].magnetic_field_covariance, (3, 3))), 1e-16 * 100.0)
    gps = first["gps"]
    assert gps.position_covariance_type == gps.COVARIANCE_TYPE_DIAGONAL_KNOWN
    np.testing.assert_allclose(np.diag(np.reshape(gps.position_covariance, (3, 3))), [4.5, 4.5, 18.0], rtol=1e-12)
    assert first["baro"].variance == pytest.approx(100.0)
    pose = np.diag(np.reshape(first["mocap"].pose.covariance, (6, 6)))
    np.testing.assert_allclose(pose, 3 * [1e-6 * 250.0 + q] + 3 * [1e-8 * 250.0], rtol=1e-12)
    assert (first["sonar"].min_range, first["sonar"].max_range) == (0.0, 30.0)


def test_every_type_has_a_message():
    assert sensor_outputs.MESSAGES.keys() == REGISTRY.keys()
    assert {one["type"] for one in SCENE["sensors"].values()} == REGISTRY.keys()


# Without a process ----------------------------------------------------------------------------------------------------


class Passing:
    """The outputs of a simulation, and what they send: (topic, stamp [ns], step at which)."""

    def __init__(self, context, **scene):
        import rclpy.node

        self.scene = Scene({"rate": 1000.0, "outputs": [], **scene})
        self.simulation = Simulation.from_scene(self.scene)
        self.node = rclpy.node.Node("sensing", context=context, namespace=f"/s{id(self)}")
        self.outputs = outputs.Outputs(self.node, self.scene, self.simulation)
        self.sent, self.measured = [], []
        for channel in self.outputs.channels:
            channel.record(lambda data, topic=channel.output.topic: self.sent.append((topic, data)))
        measured = self.simulation.measured
        self.simulation.measured = lambda one: self.measured.append(self.simulation.steps) or measured(one)
        self.advance = self.outputs.passing(self.simulation.step, lambda: self.simulation.time_ns)

    def heard(self, kind, topic="felt"):
        return [deserialize_message(data, kind) for name, data in self.sent if name == topic]

    def stamps(self, topic, kind):
        return [stamp_ns(message) // 10**6 for message in self.heard(kind, topic)]


@pytest.fixture
def passing(context):
    made = []

    def make(**scene):
        made.append(Passing(context, **scene))
        return made[-1]

    yield make
    for one in made:
        one.node.destroy_node()


def test_a_delayed_message_comes_later_with_the_stamp_of_its_measurement(passing):
    one = passing(**{"sensors.felt.type": "imu", "sensors.felt.rate": 200.0, "sensors.felt.delay": 0.007})
    came = []
    for step in range(1, 31):
        before = len(one.stamps("felt", messages.Imu))
        one.advance(1)
        came += [(step, stamp) for stamp in one.stamps("felt", messages.Imu)[before:]]
    assert came == [(5 + 7, 5), (10 + 7, 10), (15 + 7, 15), (20 + 7, 20)]
    strides = passing(**{"sensors.felt.type": "imu", "sensors.felt.rate": 200.0, "sensors.felt.delay": 0.007})
    strides.advance(30)
    assert strides.stamps("felt", messages.Imu) == [5, 10, 15, 20]
    assert strides.heard(messages.Imu) == one.heard(messages.Imu)


def test_what_waits_is_gone_where_time_begins_anew(passing):
    one = passing(**{"sensors.felt.type": "imu", "sensors.felt.rate": 100.0, "sensors.felt.delay": 0.015})
    one.advance(20)
    one.simulation.reset()
    one.outputs.publish(0)
    one.advance(30)
    assert one.stamps("felt", messages.Imu) == [0, 10]


def test_a_sensor_that_nobody_hears_measures_nothing(passing):
    one = passing(**{"sensors.felt.type": "imu", "sensors.baro.type": "barometer", "sensors.baro.rate": 100.0})
    felt = next(channel for channel in one.outputs.channels if channel.output.topic == "felt")
    felt.record(None)
    one.measured.clear()
    one.advance(30)
    assert one.measured == [10, 20, 30]
    assert one.stamps("baro", messages.FluidPressure) == [10, 20, 30]


def test_a_step_is_measured_once_however_often_it_is_published(passing):
    one = passing(**{"sensors.felt.type": "imu"})
    one.outputs.publish(0)
    one.outputs.publish(0)
    one.advance(2)
    one.outputs.publish(2_000_000)
    assert one.stamps("felt", messages.Imu) == [0, 1, 2]


def test_after_a_reset_the_present_step_is_measured_again(passing):
    """Whoever resets at the beginning waits for what was measured there."""
    one = passing(**{"sensors.felt.type": "imu"})
    one.outputs.publish(0)
    one.advance = one.outputs.passing(one.simulation.step, lambda: one.simulation.time_ns)
    one.outputs.publish(0)
    one.advance(1)
    assert one.stamps("felt", messages.Imu) == [0, 0, 1]


def test_without_sensors_steps_are_taken_as_they_were(passing):
    one = passing()
    assert one.advance == one.simulation.step


def test_frames_of_sensors_are_where_they_are_mounted():
    one = Simulation.from_scene(Scene({"sensors": {"felt": SCENE["sensors"]["felt"]}})).instruments["felt"]
    (transform,) = sensor_outputs.frames([one], Scene(SCENE))
    assert (transform.header.frame_id, transform.child_frame_id) == ("base_link", "felt_link")
    assert _xyz(transform.transform.translation) == (0.1, 0.2, -0.3)
    q = transform.transform.rotation
    assert (q.w, q.x, q.y, q.z) == one.sensor.orientation != (1.0, 0.0, 0.0, 0.0)


def test_frames_are_sent_once(context, monkeypatch):
    """With another type in place of that of tf2_msgs, which is not on PyPI."""
    import rclpy.node
    from sensor_msgs.msg import MultiDOFJointState

    class TFMessage(MultiDOFJointState):
        def __init__(self, transforms):
            super().__init__(transforms=[one.transform for one in transforms])

    module = types.ModuleType("tf2_msgs.msg")
    module.TFMessage = TFMessage
    monkeypatch.setitem(sys.modules, "tf2_msgs", types.ModuleType("tf2_msgs"))
    monkeypatch.setitem(sys.modules, "tf2_msgs.msg", module)
    monkeypatch.setattr(outputs.sensor_outputs, "frames", lambda made, scene, space: [geometry.TransformStamped()])
    monkeypatch.setattr(outputs, "Output", lambda *given, stamp: _output(*given, stamp="header.stamp"))
    node = rclpy.node.Node("frames", context=context, namespace="/frames")
    channel, sent = outputs.FramesChannel(node, Scene(), [], lambda: None), []
    channel.record(sent.append)
    for stamp in (5, 6):
        channel.publish(stamp, None)
    assert len(sent) == 1
    assert channel.end.qos_profile.durability.name == "TRANSIENT_LOCAL"
    node.destroy_node()


_output = outputs.Output


def test_sensors_of_several_bodies_are_in_their_namespaces(context):
    """With the bits of a simulation of each alone, at rates of their own."""
    import rclpy.node

    scene = FleetScene(
        {
            "bodies": ["red", "blue"],
            "sensors.felt.type": "imu",
            "sensors.felt.gyroscope.noise_density": 0.1,
            "red.sensors.felt.rate": 500.0,
            "blue.initial.angular_velocity": [0.0, 0.0, 1.0],
        }
    )
    fleet, node = Fleet.from_scene(scene), rclpy.node.Node("several", context=context, namespace="/several")
    each = {name: outputs.Outputs(node, one, fleet[name], name) for name, one in scene.scenes.items()}
    together, heard = outputs.FleetOutputs(each, fleet.stopped), {}
    for channel in together.channels:
        if (topic := channel.output.topic).endswith("felt"):
            heard[topic] = []
            channel.record(lambda data, to=heard[topic]: to.append(deserialize_message(data, messages.Imu)))
    together.passing(fleet.step, lambda: fleet.time_ns)(7)
    assert [len(heard[topic]) for topic in ("red/felt", "blue/felt")] == [3, 7]
    for name, one in scene.scenes.items():
        sim, rows = Simulation.from_scene(one), told(heard[f"{name}/felt"], "felt")
        assert {message.header.frame_id for message in heard[f"{name}/felt"]} == {f"{name}/felt"}
        for stamp, row in rows.items():
            sim.step(stamp // 10**6 - sim.steps)
            assert_array_equal(row, sim.sense("felt"))
    node.destroy_node()


def test_recorded_sensors_are_sensed_again_to_the_bit(connect, tmp_path):
    """A run that is recorded, with resets and a set state in it, simulated again from its journal."""
    pytest.importorskip("rosbags")
    from rigid_body_sim.bags import journal
    from rigid_body_sim.resim.journaled import replay

    folder = tmp_path / "bag"
    felt = {"sensors": {"felt": SCENE["sensors"]["felt"]}}
    remote = connect({**SCENE, **felt, "lockstep": False, "reset_time": True, "record.path": str(folder)}).ready()
    remote.send("base_link", (0.1, 0.2, 20.0), (0.02, -0.01, 0.03))
    remote.collect(50)
    remote.send_pose("world", (1.0, 2.0, 3.0), (0.4, 0.2, -0.8, 0.4))
    remote.clear()
    remote.collect(50)
    remote.process.stop()
    recorded = bag.read(folder, remote.name.rpartition("/")[0])
    rows = [(time_ns, deserialize_message(data, messages.Imu)) for time_ns, data in recorded.messages["/felt"]]
    entries = recorded.entries
    assert len(rows) == len(recorded.messages["/pose"]) >= 60
    assert "set_state" in recorded.calls()
    simulation = Simulation.from_scene(journal.beginning(entries).scene)
    times = [(time_ns, stamp_ns(message)) for time_ns, message in rows]
    again = replay(entries, simulation, times)
    for (_, message), sim in zip(rows, again, strict=True):
        assert_array_equal(sim.sense("felt"), NUMBERS["felt"](message))
