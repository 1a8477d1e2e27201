"""Actuators over DDS: commands in, states out, the same on every run; what is refused, and how long a command acts."""

import hashlib
import math
import os
import struct

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from rigid_body_sim import Scene, Simulation

from . import stand_in
from .node_process import ROOT
from .remote import stamp_ns

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros
AccelStamped = pytest.importorskip("geometry_msgs.msg").AccelStamped
Float64MultiArray = pytest.importorskip("std_msgs.msg").Float64MultiArray
JointState = pytest.importorskip("sensor_msgs.msg").JointState

TOPIC = "actuator_commands"
NAMES = ["left", "right", "jet", "wheel"]


def rotor(y, direction):
    return {
        "type": "rotor",
        "position": [0.1, y, 0.05],
        "min": 0.0,
        "max": 900.0,
        "time_constant": 0.03,
        "thrust_coefficient": 2e-5,
        "torque_coefficient": 3e-7,
        "direction": direction,
        "inertia": 1e-4,
    }


SCENE = {
    "rate": 500.0,
    "publish_rate": 0.0,
    "lockstep": True,
    "lockstep_on": "actuators",
    "reset_time": True,
    "steps_per_command": 3,
    "wrench.timeout": 0.1,
    "outputs": ["actuator_states", "accel"],
    "body.mass": 2.0,
    "body.inertia": [0.1, 0.2, 0.25, 0.0, 0.0, 0.0],
    "initial.angular_velocity": [0.3, 1.0, 0.2],
    "gravity": [0.0, 0.0, -9.80665],
    "actuators": {
        "names": NAMES,
        "left": rotor(0.3, "ccw"),
        "right": rotor(-0.3, "cw"),
        "jet": {"type": "thruster", "min": -5.0, "max": 5.0, "axis": [1.0, 0.0, 0.0], "delay": 0.003},
        "wheel": {"type": "wheel", "min": -0.2, "max": 0.2, "inertia": 0.002, "max_speed": 500.0},
    },
}
ROUNDS = 60


def commands(count=ROUNDS):
    """Some of them beyond the limits."""
    random = np.random.default_rng(4)
    return (random.uniform((0.0, 0.0, -6.0, -0.2), (950.0, 900.0, 6.0, 0.2), (count, 4))).tolist()


class Driver:
    """Who commands the actuators of a node, and hears what they do."""

    def __init__(self, remote, topic=TOPIC, kind=Float64MultiArray):
        self.remote = remote.ready()
        self.states = remote.listen(JointState, "actuator_states")
        self._publisher = remote.publisher(topic, kind)
        self.remote.reset_until_heard(self.states)
        self.fresh()

    def fresh(self):
        self.states.clear()
        self.remote.call("reset")
        self.remote.wait(lambda: self.states, "the states after a reset")
        self.remote.settle()
        self.remote.clear()
        self.states.clear()

    def send(self, numbers):
        self.send_as_is(Float64MultiArray(data=numbers))

    def send_as_is(self, message):
        self._publisher.publish(message)

    def collect(self, count):
        """Poses and twists, and the states, of so many steps."""
        self.remote.wait(lambda: len(self.states) >= count, f"{count} states")
        track = self.remote.collect(count)
        assert [stamp_ns(one) for one in self.states[:count]] == track.stamp_ns.tolist()
        return track, self.states[:count]


@pytest.fixture(scope="module")
def drivers(connect_shared):
    both = [Driver(connect_shared(SCENE)) for _ in range(2)]
    both[0].remote.listen(AccelStamped, "accel")  # who listens changes nothing
    return both


def lockstep(driver):
    """Motion and states of a run, as rows of numbers."""
    driver.fresh()
    for done, numbers in enumerate(commands(), 1):
        driver.send(numbers)
        driver.collect(done)
    driver.remote.settle()
    track, states = driver.collect(ROUNDS)
    assert len(driver.states) == ROUNDS, "more answers than commands"
    told = np.array([(*one.velocity, *one.effort) for one in states])
    return track, np.hstack((track.position, track.orientation, track.linear, track.angular, told))


def offline():
    """The same without ROS."""
    sim, rows = Simulation.from_scene(Scene(SCENE)), []
    for numbers in commands():
        sim.set_actuators(numbers, SCENE["wrench.timeout"])
        sim.step(SCENE["steps_per_command"])
        states = sim.actuator_states
        told = (*(one.speed for one in states), *(one.effort for one in states))
        rows.append((*sim.motion[0:7], *sim.motion[13:19], *told))
    return np.array(rows)


def digest(rows):
    return hashlib.sha256(rows.tobytes()).hexdigest()


def test_two_runs_in_lockstep_are_equal_to_the_bit_and_equal_to_one_without_ros(drivers):
    runs = [lockstep(driver) for driver in drivers]
    assert digest(runs[0][1]) == digest(runs[1][1])
    for track, rows in runs:
        assert_array_equal(track.stamp_ns, 6_000_000 * np.arange(1, ROUNDS + 1))
        assert_array_equal(rows, offline())


def test_the_run_is_one_worth_comparing():
    rows = offline()
    assert np.ptp(rows[:, 13:15], axis=0).min() > 200.0 and np.ptp(rows[:, 16]) > 2.0  # rad/s of rotors and wheel
    assert np.ptp(rows[:, 19]) > 9.0  # N


def test_states_name_the_actuators_in_their_order(drivers):
    driver = drivers[0]
    driver.fresh()
    driver.send([100.0, 200.0, 1.0, 0.1])
    _, (state,) = driver.collect(1)
    assert state.name == NAMES
    assert len(state.position) == 0 and len(state.velocity) == len(state.effort) == 4
    assert state.velocity[2] == 0.0 and state.effort[3] == 0.1


def test_wrench_is_held_and_advances_nothing(drivers):
    driver = drivers[0]
    driver.fresh()
    driver.remote.send("world", force=(4.0, 0.0, 0.0))
    driver.remote.wait_arrived("wrench")
    assert not driver.states
    driver.send([0.0, 0.0, 0.0, 0.0])
    track, _ = driver.collect(1)
    assert np.linalg.norm(track.linear[0]) == pytest.approx(math.hypot(2.0, 9.80665) * 0.006, rel=1e-3)


WHOLE = b"\0\1\0\0" + struct.pack("<IIII", 0, 0, 4, 0) + struct.pack("<4d", 100.0, 0.0, 1.0, 0.0)
REFUSED = {
    "wrong length": [[1.0, 2.0, 3.0], [], [1.0] * 5],
    "not finite": [[1.0, math.nan, 0.0, 0.0], [1.0, 0.0, math.inf, 0.0]],
    "malformed": [WHOLE[:-8], b"\xff\xff" + WHOLE[2:], b"\0\1"],
}
SENTENCES = (
    "actuator commands [1.0, 2.0, 3.0] refused: they are 3 numbers; give 4 numbers, for left, right, jet, wheel",
    "actuator commands [1.0, nan, 0.0, 0.0] refused: not all are finite; give 4 numbers, for left, right, jet, wheel",
    "actuator_commands of 44 bytes refused: they are not a serialised std_msgs/Float64MultiArray; send one with",
)


def test_bad_commands_are_refused_in_a_sentence_counted_and_move_nothing(drivers):
    driver = drivers[0]
    driver.fresh()
    for sent in (one for several in REFUSED.values() for one in several):
        driver.send_as_is(sent if isinstance(sent, bytes) else Float64MultiArray(data=sent))
    wanted = {f"refused: {reason}": str(len(sent)) for reason, sent in REFUSED.items()}
    _, values = driver.remote.wait_report(lambda _, values: wanted.items() <= values.items(), "the refusals")
    assert (values["steps"], values["actuator_commands age [s]"], driver.states) == ("0", "none yet", [])
    assert all(sentence in driver.remote.process.stderr for sentence in SENTENCES), driver.remote.process.stderr
    driver.send_as_is(WHOLE)
    _, (state,) = driver.collect(1)
    assert state.velocity[0] > 0.0


def test_command_beyond_a_limit_is_the_limit_and_is_counted(drivers):
    driver = drivers[0]
    driver.fresh()
    before = int(driver.remote.report()[1]["actuator commands limited"])
    driver.send([0.0, 0.0, -7.0, 0.3])
    driver.send([0.0, 0.0, -5.0, 0.2])
    _, states = driver.collect(2)
    assert [one.effort[3] for one in states] == [0.2, 0.2] and states[1].effort[2] == -5.0
    _, values = driver.remote.report()
    assert values["actuators"] == "4"
    assert int(values["actuator commands limited"]) == before + 1


ALONE = {
    "rate": 200.0,
    "start_paused": True,
    "publish_rate": 0.0,
    "wrench.timeout": 0.25,
    "outputs": ["actuator_states"],
    "body.mass": 2.0,
    "actuators": {"names": ["jet"], "jet": {"type": "thruster", "min": -5.0, "max": 5.0, "axis": [0.0, 2.0, 0.0]}},
}


def test_command_acts_until_its_timeout_and_no_longer(connect):
    """In real time: 3 N on 2 kg for 0.25 s."""
    driver = Driver(connect(ALONE))
    driver.send([3.0])
    driver.remote.wait_arrived(TOPIC)
    driver.remote.pause(False)
    track, states = driver.collect(60)
    assert [one.effort[0] for one in states] == [3.0] * 49 + [0.0] * 11  # what it does from that step on
    assert track.linear[-1] == pytest.approx((0.0, 3.0 * 0.25 / 2.0, 0.0), rel=0, abs=1e-15)  # measured 0


def test_what_a_scene_does_not_have_is_not_there(connect):
    remote = connect({"lockstep": True}).ready()
    assert not remote.subscriptions_to(TOPIC) and not remote.subscriptions_to("actuators")
    _, values = remote.report()
    assert not [key for key in values if "actuator" in key or key == "refused: wrong length"]


def test_topic_of_wrenches_may_not_be_that_of_actuators(run_node):
    process = run_node({**ALONE, "wrench.topics": [TOPIC]})
    assert process.wait_end(160) == 1
    assert "'actuator_commands' is /actuator_commands, which this node uses already" in process.stderr


def test_quality_of_service_can_be_overridden(run_node):
    from rclpy.qos import ReliabilityPolicy

    from .remote import Remote

    namespace = "/of_quality"
    quality = {f"qos_overrides.{namespace}/{TOPIC}.subscription.reliability": "best_effort"}
    process = run_node({**ALONE, **quality}, arguments=["-r", f"__ns:={namespace}"])
    remote = Remote(process, namespace)
    try:
        (own,) = remote.ready().subscriptions_to(TOPIC)
        assert own.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT
        process.assert_stopped_cleanly()
    finally:
        remote.close()


# Recorded, and simulated again ----------------------------------------------------------------------------------------


def test_recorded_run_in_real_time_is_simulated_again_to_the_bit(connect, tmp_path, capfd):
    """With refused commands in between, a change of gravity, an impulse, and a pause after the timeout."""
    pytest.importorskip("rosbags")
    from rigid_body_sim.tools import resim

    from ..bags import making

    scene = {**SCENE, "lockstep": False, "lockstep_on": "wrench", "reset_time": False}
    remote = connect({**scene, "record.path": str(tmp_path / "bag")}).ready()
    commanded = remote.publisher(TOPIC, Float64MultiArray)
    remote.clear()
    for i, numbers in enumerate(commands(40)):
        commanded.publish(Float64MultiArray(data=numbers if i % 9 else numbers[:2]))
        remote.collect(4 * (i + 1))
        if i == 15:
            remote.send("world", (0.1, 0.0, 0.0), (0.0, 0.02, 0.0), topic="impulse")
        if i == 25:
            assert remote.set_together({"gravity": [0.0, 0.1, -1.62], "body.mass": 2.5}).successful
    remote.collect(4 * 40 + 60)
    remote.process.assert_stopped_cleanly()
    kept = {topic.rpartition("/")[2]: kind for topic, _, (kind, _) in making.without_journal(tmp_path / "bag")}
    assert (kept[TOPIC], kept["actuator_states"]) == ("std_msgs/msg/Float64MultiArray", "sensor_msgs/msg/JointState")
    assert resim.main([str(tmp_path / "bag")]) == resim.SAME
    assert "Equal to the bit" in capfd.readouterr().out


def test_first_command_lets_a_body_go_that_waits_for_it(connect, tmp_path, capfd):
    """A refused one does not; and the journal tells."""
    pytest.importorskip("rosbags")
    from rigid_body_sim.tools import resim

    scene = {**ALONE, "start_on_command": True, "gravity": [0.0, 0.0, -9.8], "record.path": str(tmp_path / "bag")}
    driver = Driver(connect(scene))
    driver.send([math.nan])
    driver.remote.wait_report(lambda _, values: values["refused: not finite"] == "1", "the refusal")
    for count in (1, 2):
        driver.remote.call("step")
        assert not driver.collect(count)[0].linear.any()
    driver.send([3.0])
    driver.remote.wait_arrived(TOPIC)
    driver.remote.call("step")
    assert driver.collect(3)[0].linear[-1] == pytest.approx((0.0, 0.0075, -0.049), rel=0, abs=1e-15)
    driver.remote.process.assert_stopped_cleanly()
    topic = driver.remote.name.replace("rigid_body_node", TOPIC)
    assert topic in driver.remote.process.stdout + driver.remote.process.stderr  # where it is waited for
    assert resim.main([str(tmp_path / "bag")]) == resim.SAME
    assert "Equal to the bit" in capfd.readouterr().out


def test_run_in_lockstep_is_simulated_again_from_its_commands_alone(connect, tmp_path, capfd):
    pytest.importorskip("rosbags")
    import yaml

    from rigid_body_sim.tools import resim

    from ..bags import making

    driver = Driver(connect({**SCENE, "record.path": str(tmp_path / "own")}))
    for done, numbers in enumerate(commands(), 1):
        driver.send(numbers)
        driver.collect(done)
    driver.remote.process.assert_stopped_cleanly()
    messages = making.without_journal(tmp_path / "own")
    last_reset = max(i for i, (topic, _, (_, data)) in enumerate(messages) if not any(data[4:12]) and "pose" in topic)
    making.make(tmp_path / "bag", messages[last_reset:])
    (tmp_path / "scene.yaml").write_text(yaml.safe_dump({"/**": {"ros__parameters": SCENE}}))
    assert resim.main([str(tmp_path / "bag"), "--scene", str(tmp_path / "scene.yaml")]) == resim.SAME
    assert f"Equal to the bit: {ROUNDS + 1} poses" in capfd.readouterr().out


# Commands of Gazebo's multicopters ------------------------------------------------------------------------------------


@pytest.mark.timeout(900)  # making the stand-in takes a minute where busy
def test_speeds_of_rotors_as_gazebo_takes_them(connect, stand_in_for, tmp_path):
    """The same motion as by the other topic, to the bit; both lead in lockstep, and both are recorded."""
    pytest.importorskip("rosbags")
    folder = stand_in_for(stand_in.ACTUATORS, stand_in.OF_ACTUATORS)
    from actuator_msgs.msg import Actuators

    from ..bags import making

    actuators = {"names": ["left", "right"], "left": rotor(0.3, "ccw"), "right": rotor(-0.3, "cw")}
    scene = {**SCENE, "actuators": actuators, "record.path": str(tmp_path / "bag")}
    paths = [str(ROOT), str(folder or ""), os.environ.get("PYTHONPATH", "")]
    remote = connect(scene, environment={"PYTHONPATH": os.pathsep.join(filter(None, paths))})
    driver = Driver(remote)
    speeds = remote.publisher("actuators", Actuators)
    sim = Simulation.from_scene(Scene(scene))
    for done, (left, right, *_) in enumerate(commands(20), 1):
        if done % 2:
            speeds.publish(Actuators(velocity=[left, right], normalized=[0.5]))
        else:
            driver.send([left, right])
        sim.set_actuators([left, right], SCENE["wrench.timeout"])
        sim.step(SCENE["steps_per_command"])
        track, _ = driver.collect(done)
        assert (*track.position[-1], *track.orientation[-1]) == sim.motion[:7]
    speeds.publish(Actuators(velocity=[1.0, 2.0, 3.0], normalized=[1.0]))
    driver.remote.wait_report(lambda _, values: values["refused: wrong length"] == "1", "the refusal")
    remote.process.assert_stopped_cleanly()
    kept = [(topic.rpartition("/")[2], kind) for topic, _, (kind, _) in making.without_journal(tmp_path / "bag")]
    assert kept.count(("actuators", "actuator_msgs/msg/Actuators")) == 11
