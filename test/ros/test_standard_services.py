"""The services and the action of simulation_interfaces, over DDS.

With that package where it is installed, else with the stand-in of stand_in.py under its name. One node stands paused in
between tests; its body is turned, spins, and has its centre of mass off its origin.
"""

import importlib.util
import json
import os
from types import SimpleNamespace

import numpy as np
import pytest

from rigid_body_sim import Fleet, FleetScene, Simulation
from rigid_body_sim.scene.loader import Scene
from rigid_body_sim.values import rotation

from . import policy, stand_in
from .analysis import derivative
from .node_process import ROOT
from .remote import stamp_ns

pytest.importorskip("rclpy")
pytestmark = [pytest.mark.ros, pytest.mark.timeout(900)]  # making the stand-in takes a minute where busy

IS_INSTALLED = importlib.util.find_spec(stand_in.PACKAGE) is not None
without_the_package = pytest.mark.skipif(IS_INSTALLED, reason="the real package takes the place of the stand-in")
RATE = 200
PERIOD = 5_000_000  # ns
SCENE = {
    "rate": float(RATE),
    "publish_rate": 0.0,
    "wrench.timeout": 0.0,
    "start_paused": True,
    "outputs": ["clock"],  # stamps begin at zero
    "body.mass": 2.0,
    "body.inertia": [0.2, 0.3, 0.4, 0.01, 0.0, 0.02],
    "body.center_of_mass": [0.1, -0.05, 0.2],
    "initial.position": [0.3, -0.2, 0.5],
    "initial.orientation": {"w": 0.4, "x": 0.2, "y": -0.8, "z": 0.4},
    "initial.linear_velocity": [0.5, 0.2, 3.0],
    "initial.angular_velocity": [1.1, -2.0, 0.7],
    "gravity": [0.0, 0.0, -9.8],
}
SERVICES = {
    "get_simulator_features": "GetSimulatorFeatures",
    "get_simulation_state": "GetSimulationState",
    "set_simulation_state": "SetSimulationState",
    "step_simulation": "StepSimulation",
    "reset_simulation": "ResetSimulation",
    "get_entities": "GetEntities",
    "get_entity_info": "GetEntityInfo",
    "get_entity_state": "GetEntityState",
    "set_entity_state": "SetEntityState",
}
STOPPED, PLAYING, PAUSED, QUITTING = range(4)
UNSUPPORTED, OK, NOT_FOUND, INCORRECT_STATE, FAILED = range(5)
INVALID_POSE = ALREADY = 101
TRANSITION_ERROR, INCORRECT_TRANSITION = 102, 103
SUCCEEDED, CANCELED, ABORTED = 4, 5, 6  # of action_msgs/GoalStatus
MANY = 10**18
TOO_MUCH = 1e9  # N m: 10⁵ rad and more in one step
TYPE_HASHES = {  # of version 1.5.1, by its own definitions; each covers the messages within
    "srv/GetSimulatorFeatures": "abb9439c8cf196722a469fb6c68b44b484f198c2a1356ac38849a29c2a20a794",
    "srv/GetSimulationState": "3362dcebee4b1afebbf9c4beee5c79c1455385aded62092a892d61fde8644f30",
    "srv/SetSimulationState": "a868b916dce49974f637ba252141258c4b07b0c06858b88af560e3eb6bfbcb30",
    "srv/StepSimulation": "913fe0653690ce6bf8f09f316e6a626747012e9fca31e26719910d417aa8565c",
    "srv/ResetSimulation": "4ce285d7ff9b8ac70dcc95161f32bf54c05a6f4b13427990e41ab40c36c39646",
    "srv/GetEntities": "cb90004c48cd50f37732fb008e22c34c261dd680a723bf0f85d8437ea4498bf7",
    "srv/GetEntityInfo": "953b7ab6bfc35063f5c9a72463c6ce489baa10249a7fa510926d342a34b0d29e",
    "srv/GetEntityState": "749c91f2a2353d98367b64f2995a0f5842ce92a08ec1ffb3e185540a91557fb5",
    "srv/SetEntityState": "ca210e7d2b66629ae133c8e1edf5246e618106d75c78ed0556c0e7a33c59ee5e",
    "action/SimulateSteps": "f0837c898e1219cd73bf4c041feab41e8c533e8e1057e982744dba7b093467eb",
}


@pytest.fixture(scope="module")
def folder(stand_in_for):
    """Where the stand-in is; None where the real package is installed."""
    return stand_in_for(stand_in.PACKAGE, stand_in.INTERFACES)


@pytest.fixture(scope="module")
def environment(folder):
    """Of a node that can import the package."""
    paths = [str(ROOT), str(folder or ""), os.environ.get("PYTHONPATH", "")]
    return {"PYTHONPATH": os.pathsep.join(filter(None, paths))}


class Standard:
    """Calls the standard services of one node."""

    def __init__(self, remote):
        from simulation_interfaces import action, msg, srv

        self.remote, self.msg, self._srv, self.Steps = remote, msg, srv, action.SimulateSteps
        self._clients = {
            name: remote._node.create_client(getattr(srv, kind), f"rigid_body_node/{name}")
            for name, kind in SERVICES.items()
        }

    def ready(self):
        self.remote.ready()
        self.remote.wait(lambda: all(c.service_is_ready() for c in self._clients.values()), "the standard services")
        # Answers are lost until the node knows a client, see Remote.
        for name in SERVICES:
            self.remote._repeat(lambda name=name: self._answers(name), f"an answer of {name}")
        return self

    def _answers(self, name):
        client = self._clients[name]
        request = client.srv_type.Request()
        if name == "set_simulation_state":
            request.state.state = 255  # refused
        elif name == "reset_simulation":
            request.scope = 4
        elif name == "step_simulation":
            request.steps = 0
        future = client.call_async(request)
        self.remote._serve_until(future.done, 1.0)
        return future.done()

    def call(self, name, **fields):
        """Answer of a service."""
        client = self._clients[name]
        future = client.call_async(client.srv_type.Request(**fields))
        self.remote.wait(future.done, f"the answer of {name}")
        return future.result()

    def result(self, name, **fields):
        """Code in the answer of a service, and the sentence with it, which every failure must have."""
        result = self.call(name, **fields).result
        assert bool(result.error_message) == (result.result != OK), result
        return result.result, result.error_message

    @property
    def state(self):
        return self.call("get_simulation_state").state.state

    def set(self, state):
        return self.result("set_simulation_state", state=self.msg.SimulationState(state=state))

    def entity(self):
        answer = self.call("get_entity_state", entity="base_link")
        assert answer.result.result == OK
        return answer.state

    def start_action(self, steps):
        """Goal handle of simulate_steps, and the list of its feedback."""
        from rclpy.action import ActionClient

        feedback = []
        client = ActionClient(self.remote._node, self.Steps, "rigid_body_node/simulate_steps")
        self.remote.wait(client.server_is_ready, "the action")
        goal = client.send_goal_async(self.Steps.Goal(steps=steps), lambda m: feedback.append(m.feedback))
        self.remote.wait(goal.done, "the goal's answer")
        assert goal.result().accepted
        return goal.result(), feedback

    def end_of(self, handle):
        """Status, code and sentence of an action's end."""
        future = handle.get_result_async()
        self.remote.wait(future.done, "the action's result")
        answer = future.result()
        return answer.status, answer.result.result.result, answer.result.result.error_message


@pytest.fixture(scope="module")
def started(connect_shared, environment):
    return Standard(connect_shared(SCENE, environment=environment)).ready()


@pytest.fixture
def node(started):
    """Paused, and not stopped, at its initial state and at time zero."""
    return at_start(started)


def at_start(node):
    node.remote.pause(True)
    node.set(PLAYING)  # refused where a step could not be done
    node.remote.pause(True)
    assert node.result("reset_simulation", scope=0) == (OK, "")
    node.remote.settle()
    node.remote.clear()
    return node


@pytest.fixture
def quiet(connect, environment):
    """The same, which publishes a step in 10⁹, of which it takes as many a second: the observer reads what there is."""
    return at_start(Standard(connect({**SCENE, "publish_rate": 2e-7}, environment=environment)).ready())


def test_policy_has_them_and_nothing_else_of_that_kind(started):
    """Together with test_security: each name in the policy is one that a node uses."""
    namespace = started.remote.name.rsplit("/", 1)[0]
    allowed = policy.allowed("rigid_body_node", namespace)
    of_that_kind = allowed.only(lambda name: name in allowed.reply or "_action" in name)
    used = policy.used(started.remote._node, "rigid_body_node", namespace, of_that_kind)
    assert used.reply == allowed.reply
    assert used.only(lambda name: "_action" in name).publish == of_that_kind.publish


def core():
    return Simulation.from_scene(Scene(SCENE))


# What is offered ----------------------------------------------------------------------------------------------------


@without_the_package
def test_stand_in_has_the_types_of_version_1_5_1(folder):
    """By the hashes under which ROS compares types; a client of the real package finds these services."""
    for name, digest in TYPE_HASHES.items():
        described = json.loads((folder / stand_in.PACKAGE / f"{name}.json").read_text())["type_hashes"][0]
        assert described["hash_string"] == f"RIHS01_{digest}", name


def test_features_are_those_offered(node):
    """Each feature by the standard's number; nothing about spawning, worlds, bounds, tags or categories."""
    features = node.call("get_simulator_features").features
    assert list(features.features) == [10, 11, 12, 20, 21, 22, 24, 25, 26, 31, 32, 33]
    assert list(features.spawn_formats) == [] and "rigid_body_sim" in features.custom_info


def _services_of(remote):
    """Names of the services that a node offers, without its own."""
    names = [name for name, _ in remote._node.get_service_names_and_types()]
    return {name.removeprefix(f"{remote.name}/") for name in names if name.startswith(f"{remote.name}/")}


@without_the_package
def test_nothing_is_offered_without_the_package(connect):
    """The node runs as it did, and says nothing of it."""
    remote = connect(SCENE).ready()
    assert remote.call("step").success
    names = _services_of(remote)
    assert {"reset", "pause", "step", "clear_wrench"} <= names
    assert not names & {*SERVICES, "simulate_steps/_action/send_goal"}
    assert stand_in.PACKAGE not in remote.process.stderr + remote.process.stdout


@pytest.mark.parametrize(
    ("file", "said"),
    [
        (f"{stand_in.PACKAGE}.py", "is not a package"),
        (f"{stand_in.PACKAGE}/srv/__init__.py", "has no GetSimulatorFeat"),
    ],
)
def test_package_that_does_not_fit_is_warned_about(connect, tmp_path, file, said):
    """The node runs without, and offers none of the services rather than some."""
    (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / file).touch()
    paths = [str(tmp_path), str(ROOT), os.environ.get("PYTHONPATH", "")]
    remote = connect(SCENE, environment={"PYTHONPATH": os.pathsep.join(filter(None, paths))}).ready()
    assert remote.call("step").success
    assert f"{stand_in.PACKAGE} is there, but its services cannot be offered: " in remote.process.stderr
    assert said in remote.process.stderr
    assert not _services_of(remote) & {*SERVICES, "simulate_steps/_action/send_goal"}


# State of the simulation --------------------------------------------------------------------------------------------


def test_states_and_transitions(node):
    """Every one of the nine: from stopped, playing and paused to each of them."""
    assert node.state == PAUSED
    assert node.set(PAUSED)[0] == ALREADY
    assert node.set(PLAYING) == (OK, "") and node.state == PLAYING
    assert node.set(PLAYING)[0] == ALREADY
    assert node.set(STOPPED) == (OK, "") and node.state == STOPPED
    assert node.set(STOPPED)[0] == ALREADY
    code, why = node.set(PAUSED)
    assert code == INCORRECT_TRANSITION and "STATE_PLAYING" in why and node.state == STOPPED
    assert node.set(PLAYING) == (OK, "") and node.state == PLAYING
    assert node.set(PAUSED) == (OK, "") and node.state == PAUSED
    assert node.set(STOPPED) == (OK, "") and node.state == STOPPED


@pytest.mark.parametrize("state", [4, 5, 77])
def test_states_that_make_no_sense_here(node, state):
    code, why = node.set(state)
    assert code == UNSUPPORTED and f"state {state} cannot be set" in why
    assert node.state == PAUSED


def test_stopping_resets_state_and_time(node):
    node.result("step_simulation", steps=30)
    assert node.set(STOPPED) == (OK, "")
    now = node.entity()
    assert _pose(now) == list(core().pose) and stamp_ns(now) == 0


def test_stopped_is_left_by_a_step(node):
    node.set(STOPPED)
    assert node.result("step_simulation", steps=1) == (OK, "")
    assert node.state == PAUSED


def test_playing_is_what_the_pause_service_ends(node):
    """One simulation, two ways to speak of it."""
    node.set(PLAYING)
    assert node.remote.pause(False).message == "already running"
    assert node.remote.pause(True).message == "paused"
    assert node.state == PAUSED


def test_failed_simulation_is_paused_and_says_why(node):
    node.remote.send("base_link", torque=(0.0, 0.0, TOO_MUCH))
    codes = set()
    while FAILED not in codes:  # until the command has arrived
        code, why = node.result("step_simulation", steps=1)
        codes.add(code)
    assert "cannot be done" in why
    answer = node.call("get_simulation_state")
    assert answer.state.state == PAUSED and "cannot be done" in answer.result.error_message
    code, why = node.set(PLAYING)
    assert code == TRANSITION_ERROR and "cannot be done" in why
    code, why = node.result("set_entity_state", entity="base_link", state=node.entity())
    assert code == INCORRECT_STATE and "reset_simulation starts afresh" in why
    assert node.result("reset_simulation", scope=2) == (OK, "")
    assert node.set(PLAYING) == (OK, "")


def test_quitting_ends_the_process(connect, environment):
    node = Standard(connect(SCENE, environment=environment)).ready()
    client = node._clients["set_simulation_state"]
    client.call_async(client.srv_type.Request(state=node.msg.SimulationState(state=QUITTING)))
    node.remote._serve_until(lambda: node.remote.process.popen.poll() is not None, 20.0)
    assert node.remote.process.wait_end(0.0) == 0, node.remote.process.stderr
    assert "Traceback" not in node.remote.process.stderr


# Steps and resets ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("steps", [1, 7, 500])
def test_steps_lead_where_the_core_gets(node, steps):
    """To the bit; each step is published, once."""
    assert node.result("step_simulation", steps=steps) == (OK, "")
    node.remote.collect(steps)  # more at once than Fast DDS's shared memory takes, and then it sends the rest again
    node.remote.settle()
    assert [stamp_ns(message) for message in node.remote.poses] == [PERIOD * (k + 1) for k in range(steps)]
    simulation = core()
    simulation.step(steps)
    now = node.entity()
    assert _pose(now) == list(simulation.pose) and stamp_ns(now) == PERIOD * steps
    assert node.state == PAUSED


def test_step_while_playing_fails(node):
    node.set(PLAYING)
    code, why = node.result("step_simulation", steps=1)
    assert code == FAILED and "not paused" in why


def test_too_many_steps_for_one_call(node):
    code, why = node.result("step_simulation", steps=100_001)
    assert code == FAILED and "100001 steps are more than the 100000 of one call" in why and "simulate_steps" in why
    assert stamp_ns(node.entity()) == 0


@pytest.mark.parametrize(
    ("scope", "state", "time"),
    [(0, True, True), (1, False, True), (2, True, False), (3, True, True), (6, True, False), (255, True, True)],
)
def test_scopes_of_a_reset(node, scope, state, time):
    node.result("step_simulation", steps=40)
    simulation = core()
    simulation.step(40)
    assert node.result("reset_simulation", scope=scope) == (OK, "")
    now = node.entity()
    assert _pose(now) == list(core().pose if state else simulation.pose)
    assert stamp_ns(now) == (0 if time else 40 * PERIOD)
    assert node.state == PAUSED


def test_time_set_back_leaves_the_wrench_and_its_age(node):
    _hold(node, force=(2.0, 0.0, 0.0))
    node.result("step_simulation", steps=40)
    before = node.entity()
    assert node.result("reset_simulation", scope=1) == (OK, "")
    values = node.remote.report()[1]
    assert (values["wrench age [s]"], values["steps"]) == ("0.200000", "0")
    assert node.entity().acceleration == before.acceleration


def test_nothing_is_spawned(node):
    code, why = node.result("reset_simulation", scope=4)
    assert code == UNSUPPORTED and "nothing is spawned here" in why


# The entity ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("pattern", "found"), [("", True), ("base_link", True), ("^base_.*k$", True), ("link|arm", True), ("arm", False)]
)
def test_entities_by_name(node, pattern, found):
    answer = node.call("get_entities", filters=node.msg.EntityFilters(filter=pattern))
    assert answer.result.result == OK and list(answer.entities) == (["base_link"] if found else [])


@pytest.mark.parametrize(("radius", "found"), [(0.49, False), (0.51, True)])
def test_entities_within_a_sphere(node, radius, found):
    """About a point 0.5 m from the body frame's origin."""
    from geometry_msgs.msg import Vector3

    x, y, z = SCENE["initial.position"]
    points = [Vector3(x=x + 0.3, y=y, z=z - 0.4), Vector3(x=radius)]
    answer = node.call("get_entities", filters=node.msg.EntityFilters(bounds=node.msg.Bounds(type=3, points=points)))
    assert answer.result.result == OK and list(answer.entities) == (["base_link"] if found else [])


def test_filters_that_cannot_be_applied(node):
    m = node.msg
    for filters, code, said in (
        (m.EntityFilters(categories=[m.EntityCategory()]), UNSUPPORTED, "category or tag"),
        (m.EntityFilters(tags=m.TagsFilter(tags=["red"])), UNSUPPORTED, "category or tag"),
        (m.EntityFilters(bounds=m.Bounds(type=1)), UNSUPPORTED, "bounds of type 1"),
        (m.EntityFilters(bounds=m.Bounds(type=3)), FAILED, "a sphere has 2 points"),
        (m.EntityFilters(filter="("), FAILED, "not a regular expression"),
    ):
        answer = node.call("get_entities", filters=filters)
        assert answer.result.result == code and said in answer.result.error_message
        assert list(answer.entities) == []


def test_entity_that_is_not_there(node):
    for name in ("get_entity_state", "set_entity_state", "get_entity_info"):
        code, why = node.result(name, entity="arm")
        assert code == NOT_FOUND and "the only one is 'base_link'" in why


def test_info_of_the_entity(node):
    info = node.call("get_entity_info", entity="base_link").info
    assert "mass 2 kg" in info.description and info.category.category == 0 and list(info.tags) == []


def test_entity_state_is_the_motion_in_world_axes(node):
    """Twist and acceleration are the numeric derivatives of pose and twist: of the body frame's origin, world axes."""
    _hold(node, force=(3.0, -2.0, 5.0), torque=(0.1, 0.2, -0.1))
    states = []
    for _ in range(9):
        states.append(node.entity())
        node.result("step_simulation", steps=1)
    position = np.array([_pose(state)[:3] for state in states])
    velocity, omega = (np.array([_xyz(getattr(s.twist, part)) for s in states]) for part in ("linear", "angular"))
    middle = states[4]
    assert middle.header.frame_id == "world"
    for samples, given in (
        (position, middle.twist.linear),
        (velocity, middle.acceleration.linear),
        (omega, middle.acceleration.angular),
    ):
        assert derivative(samples, 1 / RATE)[0] == pytest.approx(_xyz(given), rel=1e-9, abs=1e-9)


def test_state_set_and_got(node):
    """Each number comes back; the quaternion normalised; held wrench and time stay."""
    node.result("step_simulation", steps=10)
    wanted = _entity_state(node)
    assert node.result("set_entity_state", entity="base_link", state=wanted) == (OK, "")
    got = node.entity()
    assert _pose(got) == pytest.approx([1.0, 2.0, -3.0, 0.8, 0.0, 0.6, 0.0], abs=4e-16)
    assert _xyz(got.twist.linear) == pytest.approx((0.1, 0.2, 0.3), abs=4e-15)
    assert _xyz(got.twist.angular) == pytest.approx((1.0, -2.0, 0.5), abs=4e-15)
    assert stamp_ns(got) == 10 * PERIOD


def test_set_state_moves_on_as_world_axes_say(node):
    """One step: the body turns about the world's axis that was given, although it is turned itself."""
    wanted = _entity_state(node)
    wanted.twist.linear.x = wanted.twist.linear.y = wanted.twist.linear.z = 0.0
    node.result("set_entity_state", entity="base_link", state=wanted)
    before = node.entity()
    node.result("step_simulation", steps=1)
    q0, q1 = (np.array(_pose(state)[3:]) for state in (before, node.entity()))
    turn = rotation.multiply(q1, rotation.conjugate(q0))
    assert 2.0 * RATE * turn[1:] == pytest.approx([1.0, -2.0, 0.5], abs=0.05)  # to first order in the step


@pytest.mark.parametrize(
    ("spoil", "code", "said"),
    [
        (lambda s: setattr(s.pose.orientation, "w", float("nan")), INVALID_POSE, "pose refused"),
        (lambda s: setattr(s.pose.position, "x", float("inf")), INVALID_POSE, "pose refused"),
        (
            lambda s: (setattr(s.pose.orientation, "w", 0.0), setattr(s.pose.orientation, "y", 0.0)),
            INVALID_POSE,
            "pose",
        ),
        (lambda s: setattr(s.twist.linear, "x", float("nan")), FAILED, "state refused"),
        (lambda s: setattr(s.twist.angular, "z", float("inf")), FAILED, "state refused"),
        (lambda s: setattr(s.header, "frame_id", "base_link"), FAILED, "'base_link' refused: send it in world"),
    ],
)
def test_state_that_cannot_be_set(node, spoil, code, said):
    before, state = node.entity(), _entity_state(node)
    spoil(state)
    got, why = node.result("set_entity_state", entity="base_link", state=state)
    assert got == code and said in why
    assert node.entity() == before


def part(name, scene, simulation, changed=lambda: None):
    """One body, as its entity sees it."""
    seen = SimpleNamespace(failure="", stamp_ns=simulation.time_ns, on_changed_state=changed)
    return SimpleNamespace(name=name, scene=scene, simulation=simulation, seen=seen)


def test_each_of_several_bodies_is_an_entity_of_its_name(folder):
    services = pytest.importorskip("rigid_body_sim.ros.standard_services")
    from geometry_msgs.msg import Vector3
    from simulation_interfaces import msg, srv

    offered, shown = {}, []
    node = SimpleNamespace(create_service=lambda _, name, answer: offered.update({name: answer}))
    scene = FleetScene({"bodies": ["red", "blue"], "blue.initial.position": [3.0, 0.0, 0.0]})
    fleet = Fleet.from_scene(scene)
    parts = [part(name, scene.scenes[name], fleet[name], lambda n=name: shown.append(n)) for name in fleet]
    services.EntityServices(node, SimpleNamespace(parts=parts))

    def asked(service, kind, **fields):
        return offered[f"~/{service}"](kind.Request(**fields), kind.Response())

    def named(**filters):
        return list(asked("get_entities", srv.GetEntities, filters=msg.EntityFilters(**filters)).entities)

    near = msg.Bounds(type=msg.Bounds.TYPE_SPHERE, points=[Vector3(x=3.0), Vector3(x=1.0)])
    assert (named(), named(filter="^b"), named(bounds=near)) == (["red", "blue"], ["blue"], ["blue"])
    state = asked("get_entity_state", srv.GetEntityState, entity="blue").state
    assert (state.pose.position.x, state.header.frame_id) == (3.0, "world")
    state.pose.position.y = 2.0
    assert asked("set_entity_state", srv.SetEntityState, entity="blue", state=state).result.result == OK
    assert shown == ["blue"] and fleet["blue"].pose[:3] == (3.0, 2.0, 0.0) and fleet["red"].pose[:3] == (0.0, 0.0, 0.0)
    refused = asked("get_entity_state", srv.GetEntityState, entity="base_link").result
    assert (refused.result, refused.error_message) == (NOT_FOUND, "no entity 'base_link': they are red, blue")


@pytest.mark.parametrize(("set_pose", "set_twist"), [(True, False), (False, True), (True, True)])
def test_flags_of_later_versions_are_obeyed(folder, set_pose, set_twist):
    """Version 2 says in the request what is meant. Without DDS: there are no such types here."""
    services = pytest.importorskip("rigid_body_sim.ros.standard_services")
    from simulation_interfaces import msg, srv

    offered = {}
    node = SimpleNamespace(create_service=lambda _, name, answer: offered.update({name: answer}))
    simulation, before = core(), core().state
    services.EntityServices(node, SimpleNamespace(parts=[part("", Scene(SCENE), simulation)]))
    state = _entity_state(SimpleNamespace(msg=msg))
    request = SimpleNamespace(entity="base_link", state=state, set_pose=set_pose, set_twist=set_twist)
    assert offered["~/set_entity_state"](request, srv.SetEntityState.Response()).result.result == OK
    now = simulation.state
    old_spin, new_spin = (rotation.rotate(s.orientation, s.angular_velocity) for s in (before, now))
    assert now.position == pytest.approx([1.0, 2.0, -3.0] if set_pose else before.position, abs=4e-16)
    assert now.velocity == pytest.approx([0.1, 0.2, 0.3] if set_twist else before.velocity, abs=4e-15)
    assert new_spin == pytest.approx([1.0, -2.0, 0.5] if set_twist else old_spin, abs=4e-15)


# The action ---------------------------------------------------------------------------------------------------------


def test_action_takes_its_steps(node):
    handle, feedback = node.start_action(500)
    assert node.end_of(handle) == (SUCCEEDED, OK, "")
    assert (feedback[-1].completed_steps, feedback[-1].remaining_steps) == (500, 0)
    simulation = core()
    simulation.step(500)
    assert _pose(node.entity()) == list(simulation.pose)
    assert node.state == PAUSED


def test_action_can_be_cancelled_while_the_node_serves_others(quiet):
    """10¹⁸ steps would take thousands of years."""
    handle, feedback = quiet.start_action(MANY)
    quiet.remote.wait(lambda: len(feedback) > 1, "feedback")
    assert all(f.completed_steps + f.remaining_steps == MANY for f in feedback)
    code, why = quiet.result("step_simulation", steps=1)
    assert code == FAILED and "still to be taken" in why
    other, _ = quiet.start_action(1)
    assert quiet.end_of(other)[:2] == (ABORTED, FAILED)
    assert quiet.state == PAUSED
    cancelled = handle.cancel_goal_async()
    quiet.remote.wait(cancelled.done, "the answer to the cancellation")
    status, code, why = quiet.end_of(handle)
    assert (status, code) == (CANCELED, FAILED) and why.startswith("cancelled after ")
    assert quiet.result("step_simulation", steps=1) == (OK, "")


def test_action_ends_when_the_simulation_is_set_going(quiet):
    handle, feedback = quiet.start_action(MANY)
    quiet.remote.wait(lambda: feedback, "feedback")
    assert quiet.set(PLAYING) == (OK, "")
    status, code, why = quiet.end_of(handle)
    assert (status, code, why) == (ABORTED, FAILED, "the simulation was set going")


def test_action_while_playing_fails(node):
    node.set(PLAYING)
    handle, _ = node.start_action(3)
    status, code, why = node.end_of(handle)
    assert (status, code) == (ABORTED, FAILED) and "not paused" in why


def _hold(node, **wrench):
    """Send a wrench in body axes, and wait until the node holds it."""
    node.remote.send("base_link", **wrench)
    node.remote.wait_report(lambda _, values: values["wrench age [s]"] != "none yet", "a held wrench")


def _entity_state(node):
    """A pose turned about y, and a twist, in a frame_id left empty: the world."""
    state = node.msg.EntityState()
    p, q, v, w = state.pose.position, state.pose.orientation, state.twist.linear, state.twist.angular
    p.x, p.y, p.z, q.w, q.x, q.y, q.z = 1.0, 2.0, -3.0, 1.6, 0.0, 1.2, 0.0
    v.x, v.y, v.z, w.x, w.y, w.z = 0.1, 0.2, 0.3, 1.0, -2.0, 0.5
    return state


def _no_direction():
    from geometry_msgs.msg import Quaternion

    return Quaternion(x=0.0, y=0.0, z=0.0, w=0.0)


def _xyz(vector):
    return vector.x, vector.y, vector.z


def _pose(state):
    """Position and quaternion w, x, y, z, as in Simulation.pose."""
    p, q = state.pose.position, state.pose.orientation
    return [p.x, p.y, p.z, q.w, q.x, q.y, q.z]
