"""The package's own controller of actuators, a process that knows only topics, in lockstep and in real time."""

import math

import pytest
import yaml

from rigid_body_sim import Scene, Simulation
from rigid_body_sim.scene import attitude
from rigid_body_sim.tools.actuator_laws import Sensed, controller, kind_of

from .node_process import ROOT
from .remote import Remote, pose_message, stamp_ns, twist_message

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros

CONTROLLER = "rigid_body_sim.tools.actuator_controller"
LOCKSTEP = {"lockstep": True, "lockstep_on": "actuators", "publish_rate": 0.0}
# By scene: steps by which a command advances it, and where the controller is to hold it.
SCENES = {
    "quadrotor": (5, {"target.position": [1.0, -0.5, 3.0], "target.yaw": 0.7}),
    "satellite_wheels": (10, {}),
    "bluerov2_heavy": (4, {"target.position": [1.0, 0.5, -9.0], "target.rpy": [0.0, 0.0, 1.0]}),
}
ROUNDS = 300


def path_of(name):
    return ROOT / "config" / f"{name}.yaml"


def parameters_of(name, **others):
    (section,) = yaml.safe_load(path_of(name).read_text()).values()
    return {**section["ros__parameters"], **others}


def arguments(namespace, name, target):
    given = [part for key, value in target.items() for part in ("-p", f"{key}:={value}")]
    return ["-r", f"__ns:={namespace}", "-p", f"plant:={path_of(name)}", *given]


def offline(name, rounds=ROUNDS):
    """Poses (x, y, z, w, x, y, z) by step, without ROS."""
    steps, target = SCENES[name]
    scene = Scene(parameters_of(name))
    table = {row.name: row for row in kind_of(scene).parameters}
    law, sim = controller(scene, attitude.read(target, table)), Simulation.from_scene(scene)
    poses = {0: sim.pose}
    for _ in range(rounds):
        motion = sim.motion
        sensed = Sensed(motion[0:3], motion[3:7], motion[13:16], motion[16:19])
        sim.set_actuators(law.commands(sensed), scene["wrench.timeout"])
        sim.step(steps)
        poses[sim.steps] = sim.pose
    return poses


def heard(remote, rate):
    """The same of what a node has published."""
    parts = ((stamp_ns(m), m.pose.position, m.pose.orientation) for m in remote.poses)
    return {round(ns * rate / 1e9): (p.x, p.y, p.z, q.w, q.x, q.y, q.z) for ns, p, q in parts}


@pytest.fixture
def run_pairs(run_node):
    """A function: so many nodes with these parameters, each in a namespace with a controller of that scene's plant.

    It gives who listens to each node, since before its controller began. All must stop cleanly after the test.
    """
    remotes, processes = [], []

    def run(name, target, count=1, **others):
        for i in range(count):
            namespace = f"/{name}_{i}"
            parameters, ros = parameters_of(name, **others), ["-r", f"__ns:={namespace}"]
            processes.append(run_node(parameters, arguments=ros, namespace=namespace))
            remotes.append(Remote(processes[-1], namespace))
        for i, remote in enumerate(remotes):
            remote.process.wait_ready()
            remote.wait(lambda remote=remote: remote._node.get_publishers_info_by_topic("pose"), "the node")
            given = arguments(f"/{name}_{i}", name, target)
            processes.insert(0, run_node(None, module=CONTROLLER, arguments=given))
        return remotes

    yield run
    try:
        for process in processes:
            process.assert_stopped_cleanly()
    finally:
        for remote in remotes:
            remote.close()


@pytest.mark.parametrize("name", SCENES)
def test_two_runs_in_lockstep_are_equal_to_the_bit_and_equal_to_one_without_ros(run_pairs, name):
    steps, target = SCENES[name]
    remotes, expected = run_pairs(name, target, 2, **LOCKSTEP, steps_per_command=steps), offline(name)
    start = expected.pop(0)
    for remote in remotes:
        remote.wait(lambda remote=remote: len(remote.poses) > ROUNDS, f"{ROUNDS} answers")
        found = heard(remote, parameters_of(name)["rate"])
        assert {step: found[step] for step in expected} == expected
    assert max(abs(a - b) for a, b in zip(start, expected[ROUNDS * steps], strict=True)) > 0.2  # worth comparing


def test_vehicle_goes_to_its_target_by_the_clock_with_twists_in_world_axes_too(run_pairs):
    target = {"target.position": [0.4, 0.0, -10.0], "target.rpy": [0.0, 0.0, 0.5]}
    (remote,) = run_pairs("bluerov2_heavy", target, real_time_factor=4.0, twist_frame="world")

    def is_there():
        p, q = remote.poses[-1].pose.position, remote.poses[-1].pose.orientation
        return abs(p.x - 0.4) < 0.05 and abs(p.z + 10.0) < 0.05 and abs(q.z - math.sin(0.25)) < 0.02

    remote.wait(lambda: remote.poses and is_there(), "the vehicle at its target")


def test_velocities_are_in_body_axes_whatever_the_axes_of_twist():
    """A body that heads along the world's y axis: its x axis."""
    from rigid_body_sim.tools.answering_node import in_body_axes

    pose = pose_message("world", (0.0, 0.0, 0.0), (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)))
    velocities = (0.0, 2.0, 0.0), (0.5, 0.0, 0.0)
    v, w = in_body_axes(pose, twist_message("world", *velocities))
    assert v == pytest.approx((2.0, 0.0, 0.0), abs=1e-15) and w == pytest.approx((0.0, -0.5, 0.0), abs=1e-15)
    v, w = in_body_axes(pose, twist_message("base_link", *velocities))
    assert (tuple(v), tuple(w)) == velocities


@pytest.mark.parametrize(
    ("settings", "reason"),
    [
        ([], "parameter plant is not given; give the scene of the plant, such as config/quadrotor.yaml"),
        (["plant:=/nowhere.yaml"], "parameter plant = /nowhere.yaml: cannot be read: No such file or directory"),
        ([f"plant:={path_of('satellite')}"], "the plant has no actuators; give one with actuators of one type: rotor"),
        ([f"plant:={path_of('satellite_wheels')}", "target.position:=[0.0,0.0,1.0]"], "target.position is not known"),
    ],
)
def test_useless_parameter_is_one_sentence(run_node, settings, reason):
    given = [part for setting in settings for part in ("-p", setting)]
    process = run_node(None, module=CONTROLLER, arguments=given)
    assert process.wait_end(60.0) == 1
    assert process.stderr.startswith("actuator_controller: ") and process.stderr.count("\n") == 1
    assert reason in process.stderr
