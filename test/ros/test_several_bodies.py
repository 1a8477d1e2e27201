"""Several bodies in one node: topics, services, frames and reports of each, and none minds what becomes of another."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from rigid_body_sim import Fleet, FleetScene, Simulation, Wrench
from rigid_body_sim.scene import parameter_file
from rigid_body_sim.scene.loader import DEFAULT_NODE

from .remote import stamp_ns

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros

ROOT = Path(__file__).parents[2]
LOCKSTEP = {
    "bodies": ["red", "blue"],
    "lockstep": True,
    "steps_per_command": 5,
    "lockstep_on": ["red", "blue"],
    "body.inertia": [0.1, 0.2, 0.25, 0.0, 0.0, 0.0],
    "initial.angular_velocity": [0.3, -1.0, 0.2],
    "blue.body.mass": 3.0,
    "blue.wrench.frame": "world",
}
ROUNDS = 20


class Fleets:
    """A node of several bodies, and the other side of its topics."""

    def __init__(self, context, process, names, in_lockstep):
        from geometry_msgs.msg import PoseStamped, TwistStamped, WrenchStamped
        from rclpy.node import Node
        from rclpy.qos import DurabilityPolicy, QoSProfile
        from std_srvs.srv import Trigger

        from rigid_body_sim.ros.executor import executor_for

        self.process, self.names, self._wrench = process, names, WrenchStamped
        self.node = Node("fleet_observer", namespace=process.namespace, context=context, enable_rosout=False)
        self._executor = executor_for(self.node)
        self.poses, self.twists = {name: [] for name in names}, {name: [] for name in names}
        self._commands, self.resets = {}, {}
        # In lockstep the node keeps the latest message for whoever comes late.
        durability = DurabilityPolicy.TRANSIENT_LOCAL if in_lockstep else DurabilityPolicy.VOLATILE
        profile = QoSProfile(depth=1000, durability=durability)
        for name in names:
            self.node.create_subscription(PoseStamped, f"{name}/pose", self.poses[name].append, profile)
            self.node.create_subscription(TwistStamped, f"{name}/twist", self.twists[name].append, profile)
            self._commands[name] = self.node.create_publisher(WrenchStamped, f"{name}/wrench", 100)
            self.resets[name] = self.node.create_client(Trigger, f"{name}/reset")
        process.wait_ready()
        for name in names:
            self.wait(lambda n=name: self._commands[n].get_subscription_count() > 0, f"{name}/wrench")
            self.wait(self.resets[name].service_is_ready, f"{name}/reset")

    def wait(self, condition, what, seconds=60.0):
        import time

        deadline = time.monotonic() + seconds
        while not condition():
            assert self.process.popen.poll() is None, f"the node ended: {self.process.stderr}"
            assert time.monotonic() < deadline, f"no {what} within {seconds} s: {self.process.stderr}"
            self._executor.spin_once(timeout_sec=0.02)

    def wait_for_more(self, name, count):
        """Until there are more poses and twists of a body than so many."""
        both = self.poses[name], self.twists[name]
        self.wait(lambda: all(len(each) > count for each in both), f"poses and twists of {name}")

    def send(self, name, torque, frame=""):
        message = self._wrench()
        message.header.frame_id = frame
        message.wrench.torque.x, message.wrench.torque.y, message.wrench.torque.z = map(float, torque)
        self._commands[name].publish(message)

    def call(self, client, request):
        future = client.call_async(request)
        self.wait(future.done, client.srv_name)
        return future.result()

    def listen(self, kind, topic):
        messages = []
        self.node.create_subscription(kind, topic, messages.append, 100)
        return messages

    def close(self):
        self._executor.shutdown()
        self.node.destroy_node()


@pytest.fixture
def fleet_of(context, run_node):
    """Start a node of several bodies in a namespace of its own."""
    made = []

    def start(parameters, names=("red", "blue"), **options):
        namespace = f"/f{len(made)}_{abs(hash(json.dumps(parameters))) % 10**6}"
        process = run_node(parameters, arguments=["-r", f"__ns:={namespace}"], **options)
        process.namespace = namespace
        made.append(Fleets(context, process, names, parameters.get("lockstep", False)))
        return made[-1]

    yield start
    for one in made:
        one.close()
        one.process.assert_stopped_cleanly()


def torque(round_, name):
    return (0.1 * np.sin(round_), 0.2 if name == "red" else -0.3, 0.05 * round_)


def in_lockstep(fleet):
    """Poses and twists of all rounds of commands to both bodies."""
    rows = {name: [] for name in fleet.names}
    for round_ in range(ROUNDS):
        before = {name: len(fleet.poses[name]) for name in fleet.names}
        fleet.send("red", torque(round_, "red"))
        fleet.send("blue", torque(round_, "blue"))
        for name in fleet.names:
            fleet.wait_for_more(name, before[name])
            assert len(fleet.poses[name]) == before[name] + 1
            rows[name].append(numbers(fleet.poses[name][-1].pose, fleet.twists[name][-1].twist))
    return {name: np.array(found) for name, found in rows.items()}


def numbers(pose, twist):
    p, q, v, w = pose.position, pose.orientation, twist.linear, twist.angular
    return p.x, p.y, p.z, q.w, q.x, q.y, q.z, v.x, v.y, v.z, w.x, w.y, w.z


def offline(name):
    scene = FleetScene(LOCKSTEP).scenes[name]
    simulation, rows = Simulation.from_scene(scene), []
    for round_ in range(ROUNDS):
        kind = "torque_body" if name == "red" else "torque_world"
        simulation.set_wrench(Wrench(**{kind: torque(round_, name)}), scene["wrench.timeout"])
        simulation.step(5)
        motion = simulation.motion
        rows.append((*motion[0:7], *motion[13:19]))
    return np.array(rows)


def test_lockstep_waits_for_both_and_gives_the_bits_of_each_alone(fleet_of):
    fleet = fleet_of(LOCKSTEP)
    fleet.wait(lambda: all((*fleet.poses.values(), *fleet.twists.values())), "the first poses and twists")
    found = in_lockstep(fleet)
    for name in fleet.names:
        assert_array_equal(found[name], offline(name))
        assert fleet.poses[name][-1].header.frame_id == "world"
        assert fleet.twists[name][-1].header.frame_id == f"{name}/base_link"


def test_one_clock_one_report_with_a_status_for_each_and_parameters_under_names(fleet_of):
    from diagnostic_msgs.msg import DiagnosticArray
    from rcl_interfaces.msg import Parameter as Message
    from rcl_interfaces.msg import ParameterType, ParameterValue
    from rcl_interfaces.srv import GetParameters, SetParameters
    from rosgraph_msgs.msg import Clock

    fleet = fleet_of({"bodies": ["red", "blue"], "outputs": ["clock", "odom"], "blue.body.mass": 3.0, "rate": 100.0})
    clocks, reports = fleet.listen(Clock, "/clock"), fleet.listen(DiagnosticArray, "/diagnostics")
    name = f"{fleet.process.namespace}/rigid_body_node"
    fleet.wait(lambda: clocks, "clock")

    def told():
        """Names of the statuses of this node; others report on that topic, too."""
        return {one.name for report in reports for one in report.status if one.name.startswith(f"{name}: ")}

    fleet.wait(told, "a report")
    assert told() == {f"{name}: red", f"{name}: blue"}
    assert len(fleet.node.get_publishers_info_by_topic("/clock")) == 1

    setting = fleet.node.create_client(SetParameters, "rigid_body_node/set_parameters")
    getting = fleet.node.create_client(GetParameters, "rigid_body_node/get_parameters")

    def set_to(name, value):
        given = ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=value)
        return fleet.call(setting, SetParameters.Request(parameters=[Message(name=name, value=given)])).results[0]

    fleet.wait(setting.service_is_ready, "the service")
    assert set_to("body.mass", 5.0).successful
    request = GetParameters.Request(names=["body.mass", "red.body.mass", "blue.body.mass"])
    masses = [value.double_value for value in fleet.call(getting, request).values]
    assert masses == [5.0, 5.0, 3.0]  # blue has its own
    assert set_to("red.body.mass", 7.0).successful
    assert [v.double_value for v in fleet.call(getting, request).values] == [5.0, 7.0, 3.0]
    refused = set_to("red.rate", 7.0)
    assert not refused.successful and "red.rate" in refused.reason
    refused = set_to("blue.body.mass", -1.0)
    assert not refused.successful and "blue.body.mass = -1.0: is out of range" in refused.reason


def test_parameter_of_a_counted_body_is_there_once_it_is_set(fleet_of):
    from rcl_interfaces.msg import Parameter as Message
    from rcl_interfaces.msg import ParameterType, ParameterValue
    from rcl_interfaces.srv import GetParameters, SetParameters

    names = ("body_0", "body_1")
    fleet = fleet_of({"bodies.count": 2, "rate": 100.0, "body.mass": 2.0}, names)
    setting = fleet.node.create_client(SetParameters, "rigid_body_node/set_parameters")
    getting = fleet.node.create_client(GetParameters, "rigid_body_node/get_parameters")
    fleet.wait(setting.service_is_ready, "the service")
    given = ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=4.0)
    request = SetParameters.Request(parameters=[Message(name="body_1.body.mass", value=given)])
    assert fleet.call(setting, request).results[0].successful
    found = fleet.call(getting, GetParameters.Request(names=["body.mass", "body_1.body.mass"])).values
    assert [value.double_value for value in found] == [2.0, 4.0]


def test_body_that_cannot_go_on_stops_alone_and_is_reset_alone(fleet_of):
    from std_srvs.srv import Trigger

    fleet = fleet_of({"bodies": ["red", "blue"], "rate": 100.0, "publish_rate": 50.0, "red.gravity": [1e307, 0.0, 0.0]})
    fleet.process.wait_for_output("red has stopped; red/reset starts it afresh: step ", 60.0)
    red, blue = fleet.poses["red"], fleet.poses["blue"]  # red has stopped maybe before it could be heard

    def latest(poses):
        return stamp_ns(poses[-1]) if poses else 0

    fleet.wait(lambda: blue, "blue's poses")
    begin_ns = stamp_ns(blue[0])
    fleet.wait(lambda: latest(blue) > max(latest(red), begin_ns) + 5e8, "half a second of blue alone")
    then_ns = latest(blue)
    answer = fleet.call(fleet.resets["red"], Trigger.Request())
    assert answer.success and answer.message == "red: initial state, no wrench; time and the other bodies go on"
    fleet.wait(lambda: latest(red) > then_ns, "red's poses again")


def test_killed_controller_is_missed_by_its_own_body_alone(fleet_of, tmp_path):
    """The other controller's commands arrive at each of its body's steps, and its body feels nothing else."""
    from diagnostic_msgs.msg import DiagnosticArray

    fleet = fleet_of({"bodies": ["red", "blue"], "rate": 200.0, "wrench.timeout": 0.2, "body.mass": 1.0})
    reports = fleet.listen(DiagnosticArray, "/diagnostics")
    commander = str(ROOT / "test" / "ros" / "commander.py")
    started = [
        subprocess.Popen([sys.executable, commander, f"{fleet.process.namespace}/{name}", "100", "1.0"], cwd=tmp_path)
        for name in fleet.names
    ]
    try:
        for name in fleet.names:
            twists = fleet.twists[name]
            fleet.wait(lambda t=twists: bool(t) and t[-1].twist.linear.x > 0.1, f"{name} to move")
        started[0].send_signal(signal.SIGKILL)
        started[0].wait()

        def settled(name):
            speeds = [one.twist.linear.x for one in fleet.twists[name][-20:]]
            return len(set(speeds)) == 1

        fleet.wait(lambda: settled("red"), "red to coast")
        assert not settled("blue")
        fleet.wait(lambda: ages(reports, "red") > 0.2, "the report that red's command is old")
        assert ages(reports, "blue") < 0.2
        coasting = fleet.twists["red"][-1].twist.linear.x
        count = len(fleet.twists["red"]) + 50
        fleet.wait(lambda: len(fleet.twists["red"]) > count, "more twists")
        assert fleet.twists["red"][-1].twist.linear.x == coasting and not settled("blue")
    finally:
        for one in started:
            one.kill()
            one.wait()


def ages(reports, name):
    """Age of the latest wrench of a body in the latest report [s]."""
    for report in reversed(reports):
        for status in report.status:
            if status.name.endswith(f": {name}"):
                values = {each.key: each.value for each in status.values}
                return float(values["wrench age [s]"]) if values["wrench age [s]"] != "none yet" else 0.0
    return 0.0


def test_recorded_bodies_are_simulated_again_to_the_bit(fleet_of, tmp_path):
    bag = tmp_path / "bag"
    fleet = fleet_of({"bodies": ["red", "blue"], "rate": 200.0, "record.path": str(bag), "blue.body.mass": 3.0})
    for round_ in range(10):
        fleet.send("red", torque(round_, "red"))
        fleet.send("blue", torque(round_, "blue"), "world")
        fleet.wait_for_more("blue", len(fleet.poses["blue"]) + 3)
    from std_srvs.srv import Trigger

    fleet.call(fleet.resets["red"], Trigger.Request())
    count = len(fleet.poses["red"]) + 5
    fleet.wait(lambda: len(fleet.poses["red"]) > count, "poses")
    fleet.process.assert_stopped_cleanly()
    done = resim(bag)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count("Equal to the bit") == 2
    done = resim(bag, "--body", "red", "--out", str(tmp_path / "again"))
    assert done.returncode == 0 and "/red/pose" in done.stdout and "/blue/pose" not in done.stdout
    done = resim(bag, "--body", "green")
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == "rigid_body_resim: no body is called 'green'; the bodies are red, blue\n"


def test_linked_bodies_wait_together_and_are_simulated_again_to_the_bit(fleet_of, tmp_path):
    from geometry_msgs.msg import WrenchStamped

    bag, names = tmp_path / "bag", ("drone", "load")
    scene = ROOT / "config" / "slung_load.yaml"
    given = parameter_file.of_scene(scene, DEFAULT_NODE)
    fleet = fleet_of({**given, "rate": 200.0, "record.path": str(bag)}, names)
    fleet.wait_for_more("load", 5)
    assert fleet.poses["load"][-1].pose.position.z == given["load.initial.position"][2]
    for round_ in range(10):
        message = WrenchStamped()
        message.header.frame_id = "world"
        message.wrench.force.x, message.wrench.force.z = 0.1 * round_, 1.8 * 9.80665
        fleet._commands["drone"].publish(message)
        fleet.wait_for_more("load", len(fleet.poses["load"]) + 3)
    assert fleet.poses["load"][-1].pose.position.x > 0.0
    fleet.process.assert_stopped_cleanly()
    done = resim(bag)
    assert done.returncode == 0 and done.stdout.count("Equal to the bit") == 2, done.stdout + done.stderr
    done = resim(bag, "--body", "load", "--vary", "body.mass=1,2")
    assert (done.returncode, "--vary is for bodies without links" in done.stderr) == (1, True)


def resim(bag, *arguments):
    command = [sys.executable, "-m", "rigid_body_sim.tools.resim_main", str(bag), *arguments]
    return subprocess.run(command, capture_output=True, text=True, cwd=ROOT, timeout=200, check=False)


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({"bodies": ["red", "wrench"]}, "a body cannot be called 'wrench', which is the name of a parameter"),
        ({"bodies": ["red", "red"]}, "'red' is given twice; give it once"),
        ({"bodies": ["red", "7"]}, "'7' cannot be the name of a body"),
        ({"bodies": ["red"], "red.wrench.topics": ["pose"]}, "/red/pose, which this node uses already"),
        ({"bodies": ["red"], "blue.body.mass": 2.0}, "no body is called 'blue'"),
    ],
)
def test_node_refuses_to_start_with_a_sentence(run_node, parameters, said):
    process = run_node(parameters)
    assert process.wait_end(60.0) == 1
    assert said in process.stderr and "Traceback" not in process.stderr
    assert len(process.stderr.strip().splitlines()) == 1


def test_fleet_without_ros_has_what_the_node_has():
    fleet = Fleet.from_scene(FleetScene(LOCKSTEP))
    for round_ in range(ROUNDS):
        fleet["red"].set_wrench(Wrench(torque_body=torque(round_, "red")), 0.5)
        fleet["blue"].set_wrench(Wrench(torque_world=torque(round_, "blue")), 0.5)
        fleet.step(5)
    for name in fleet:
        assert_array_equal((*fleet[name].motion[0:7], *fleet[name].motion[13:19]), offline(name)[-1])
