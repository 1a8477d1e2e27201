"""Parameters changed while the node runs: between two steps, all or none, refused with the reason, in closed form."""

import array
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigid_body_sim import Scene, Simulation, State
from rigid_body_sim.scene import schema

from .remote import Parameter

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros
parameters = pytest.importorskip("rigid_body_sim.ros.parameters")

RATE, MASS, FORCE, TORQUE = 100.0, 2.0, 6.0, 0.2
INERTIA = [0.1, 0.1, 0.1, 0.0, 0.0, 0.0]
SCENE = {
    "rate": RATE,
    "publish_rate": 0.0,
    "start_paused": True,
    "wrench.timeout": 0.0,
    "wrench.frame": "world",
    "body.mass": MASS,
    "body.inertia": INERTIA,
}
BOX = {"body.shape": "box", "body.dimensions": [1.0, 2.0, 3.0], "body.mass": MASS}
STIFFNESS, HELD_UP = 50.0, 4.0
HUNG = {
    **SCENE,
    "tethers.spring.anchor": [0.0, 0.0, 0.0],
    "tethers.spring.rest_length": 0.0,
    "tethers.spring.stiffness": STIFFNESS,
    "tethers.spring.slack": False,
    "forces.lift.force": [0.0, 0.0, HELD_UP],
    "forces.lift.body_point": [0.0, 0.0, 0.3],
}
LIFTED = {name: value for name, value in HUNG.items() if not name.startswith("tethers")}
ROPES = {
    **HUNG,
    "tethers.rope.anchor": [0.0, 0.0, -5.0],  # taut
    "tethers.rope.rest_length": 4.9,
    "tethers.rope.stiffness": 100.0,
    "tethers.loose.anchor": [0.0, 0.0, 1.0],
    "tethers.loose.rest_length": 2.0,
    "tethers.loose.stiffness": 100.0,
}
SCENES = {
    "free": SCENE,
    "box": {**SCENE, **BOX},
    "dense": {**SCENE, **BOX, "body.density": 0.5, "body.mass": 3.0},
    "taylor": {**SCENE, "integrator.name": "taylor"},
    "hung": HUNG,
    "lifted": LIFTED,
    "ropes": ROPES,
}
for _name in ("box", "dense"):
    del SCENES[_name]["body.inertia"]
DYNAMIC = [p.name for p in schema.TABLE if p.dynamic and "<name>" not in p.name]


@pytest.fixture(scope="module")
def nodes(connect_shared):
    started = {name: connect_shared(scene) for name, scene in SCENES.items()}
    return {name: node.ready() for name, node in started.items()}


def at_start(node, scene):
    """Paused at rest with the parameters of the beginning."""
    given = {name: value for name, value in scene.items() if schema.find(name).dynamic}
    rest = {name: value for name, value in schema.defaults().items() if name in DYNAMIC and name.startswith("drag")}
    result = node.set_together({**{n: list(v) for n, v in rest.items()}, "gravity": [0.0, 0.0, 0.0], **given})
    assert result.successful, result.reason
    node.pause(True)
    node.fresh()
    return node


@pytest.fixture
def node(nodes):
    return at_start(nodes["free"], SCENE)


def push(node):
    """A force along x and a torque about z, in the world, held for ever."""
    node.send("world", force=(FORCE, 0.0, 0.0), torque=(0.0, 0.0, TORQUE))
    node.wait_arrived("wrench")


def steps(node, count):
    for _ in range(count):
        assert node.call("step").success


def track_over_change(node, values):
    """20 steps, the change, 20 steps: row 0 is the state before the first."""
    steps(node, 20)
    result = node.set_together(values)
    assert result.successful, result.reason
    steps(node, 20)
    track = node.collect(41)
    assert set(np.diff(track.stamp_ns).tolist()) == {10_000_000}, "the change was published, or a step is missing"
    return track


T = np.arange(21) / RATE


def ramp(first, second):
    """What starts at zero with one slope and goes on with another, and its integral."""
    v = np.concatenate([first * T, first * T[-1] + second * T[1:]])
    x = first * T**2 / 2.0
    return v, np.concatenate([x, x[-1] + first * T[-1] * T[1:] + second * T[1:] ** 2 / 2.0])


# What acts ------------------------------------------------------------------------------------------------------------


def test_another_mass_keeps_pose_and_twist_and_the_force_over_it_follows(node):
    push(node)
    track = track_over_change(node, {"body.mass": 3.0})
    v, x = ramp(FORCE / MASS, FORCE / 3.0)
    # The body turns about z, so velocities in its axes turn against that.
    angle = ramp(TORQUE / 0.1, TORQUE / 0.1)[1]
    assert track.linear == pytest.approx(in_body(v, angle), rel=0, abs=2e-15)  # measured 3.3e-16
    assert track.position[:, 0] == pytest.approx(x, rel=0, abs=1e-15)  # measured 8.3e-17


def in_body(v, angle):
    return np.stack([v * np.cos(angle), -v * np.sin(angle), 0.0 * v], axis=1)


def test_another_inertia_keeps_pose_and_twist_and_the_torque_over_it_follows(node):
    push(node)
    track = track_over_change(node, {"body.inertia": [0.3, 0.3, 0.4, 0.0, 0.0, 0.0]})
    w, angle = ramp(TORQUE / 0.1, TORQUE / 0.4)
    assert track.angular == pytest.approx(np.stack([0 * w, 0 * w, w], axis=1), rel=0, abs=1e-15)  # measured 5.6e-17
    turned = 2.0 * np.arctan2(track.orientation[:, 3], track.orientation[:, 0])
    assert turned == pytest.approx(angle, rel=0, abs=1e-15)  # measured 2.8e-17


def test_another_gravity(node):
    track = track_over_change(node, {"gravity": [0.0, 0.0, -9.81]})
    v, x = ramp(0.0, -9.81)
    assert track.linear[:, 2] == pytest.approx(v, rel=0, abs=1e-15)  # measured 0
    assert track.position[:, 2] == pytest.approx(x, rel=0, abs=1e-15)  # measured 6.9e-18


def test_drag_comes_and_goes(node):
    """v' = −(c/m) v while it is there; the plan that follows is told."""
    node.send("world", force=(MASS * 4.0, 0.0, 0.0), topic="impulse")
    node.wait_report(lambda _, values: values["momentum [kg m/s]"] == "[8.0, 0.0, 0.0]", "the blow")
    node.wait(lambda: len(node.twists) == 2, "the blow's velocity, shown while paused")
    node.settle()
    node.clear()
    for linear in (3.0, 0.0):
        assert node.set_parameter("drag.linear", [linear] * 3).successful
        steps(node, 20)
    speed = node.collect(40).linear[:, 0]
    decay = 4.0 * np.exp(-3.0 / MASS * T[1:])
    assert speed == pytest.approx(np.concatenate([decay, [decay[-1]] * 20]), rel=0, abs=2e-9)  # measured 8.9e-16
    assert "plan: dop853 (drag, not stiff" in node.process.stderr
    assert "plan: exact (nothing turns" in node.process.stderr.rpartition("plan: dop853")[2]


def test_each_kind_of_drag_acts(node):
    """Seen in the acceleration at a known twist: after 1e-2 s of weak drag, the change is −D h to first order."""
    for name, place in {"linear": 0, "quadratic": 0, "angular_linear": 1, "angular_quadratic": 1}.items():
        at_start(node, SCENE)
        node.send_twist("base_link", (2.0, 0.0, 0.0), (0.0, 0.0, 2.0))
        node.wait(lambda: len(node.twists) == 2, "the twist")
        assert node.set_parameter(f"drag.{name}", [1e-4, 1e-4, 1e-4]).successful
        steps(node, 1)
        track = node.collect(3)
        speed = np.linalg.norm([track.linear, track.angular], axis=2)[:, 1:]
        resistance = 1e-4 * (4.0 if "quadratic" in name else 2.0)
        lost = np.zeros(2)
        lost[place] = resistance / (MASS if place == 0 else INERTIA[2]) / RATE
        assert speed[:, 0] - speed[:, 1] == pytest.approx(lost, rel=1e-3, abs=1e-14), name  # measured 2.0e-4


def test_drag_that_comes_while_running_finds_its_kernels_loaded(node):
    """Compiling takes most of a minute, in which time would slip away."""
    node.pause(False)
    before = float(node.report()[1]["slipped time [s]"])
    assert node.set_parameter("drag.quadratic", [1.0, 1.0, 1.0]).successful
    node.clear()
    node.collect(20)
    _, values = node.report()
    assert "dop853" in values["plan"]
    assert float(values["slipped time [s]"]) - before < 10.0
    node.pause(True)


def test_anchor_of_a_spring_is_moved(nodes):
    """At rest at the anchor, which goes a to the side: x = a (1 − cos √(k/m) t). The lift is set to zero with it."""
    node = at_start(nodes["hung"], {**HUNG, "forces.lift.force": [0.0, 0.0, 0.0]})
    track = track_over_change(node, {"tethers.spring.anchor": [0.2, 0.0, 0.0]})
    frequency = math.sqrt(STIFFNESS / MASS)
    x = 0.2 * (1.0 - np.cos(frequency * T[1:]))
    expected = np.concatenate([np.zeros(21), x])
    assert track.position[:, 0] == pytest.approx(expected, rel=0, abs=1e-13)  # measured 1.2e-16
    assert "plan: dop853 (tethers, not stiff" in node.process.stderr


def test_another_constant_force_and_where_it_acts(nodes):
    """It turns the body as little as where it stood over the centre of mass; elsewhere I dω/dt = p × F from rest."""
    node = at_start(nodes["lifted"], LIFTED)
    track = track_over_change(node, {"forces.lift.force": [0.0, 0.0, -2.0]})
    v, z = ramp(HELD_UP / MASS, -2.0 / MASS)
    assert track.linear[:, 2] == pytest.approx(v, rel=0, abs=1e-15)  # measured 5.6e-17
    assert track.position[:, 2] == pytest.approx(z, rel=0, abs=1e-15)  # measured 1.4e-17
    assert node.set_parameter("forces.lift.body_point", [0.0, 0.1, 0.0]).successful
    steps(node, 1)
    turning = node.collect(42).angular[-1]
    assert turning == pytest.approx([0.1 * -2.0 / 0.1 / RATE, 0.0, 0.0], rel=1e-8)  # measured 1.0e-9: it turns


CHANGED = {
    "tethers.rope.body_point": [0.1, 0.0, 0.2],
    "tethers.rope.anchor": [1.0, 0.0, -5.0],
    "tethers.rope.rest_length": 4.0,
    "tethers.rope.stiffness": 5000.0,
    "tethers.rope.damping": 30.0,
    "tethers.loose.slack": False,
    "forces.lift.body_point": [0.0, 0.1, 0.0],
}


@pytest.mark.parametrize("name", CHANGED)
def test_each_parameter_of_a_member_acts_as_in_the_scene_that_has_it(nodes, name):
    """To the bit, and otherwise than without the change."""
    usual = {"tethers.rope.body_point": [0.0] * 3, "tethers.rope.damping": 0.0, "tethers.loose.slack": True}
    node = at_start(nodes["ropes"], {**ROPES, **usual})
    track = track_over_change(node, {name: CHANGED[name]})
    ends = []
    for scene in (ROPES, {**ROPES, name: CHANGED[name]}):
        alone = Simulation.from_scene(Scene(ROPES))
        alone.step(20)
        alone.change(**Scene(scene).terms().dynamic())
        alone.step(20)
        ends.append((*alone.motion[:7], *alone.motion[13:19]))
    got = np.concatenate([part[-1] for part in (track.position, track.orientation, track.linear, track.angular)])
    assert got.tolist() == list(ends[1]) != list(ends[0])


def test_body_of_a_shape_follows_with_its_inertia(nodes):
    """Of the box 1 m x 2 m x 3 m, I_zz = m (1² + 2²)/12."""
    node = at_start(nodes["box"], SCENES["box"])
    push(node)
    track = track_over_change(node, {"body.mass": 12.0})
    w, _ = ramp(TORQUE / (MASS * 5.0 / 12.0), TORQUE / 5.0)
    assert track.angular[:, 2] == pytest.approx(w, rel=1e-14)  # measured 2.1e-16
    mass, inertia = node.get_parameters("body.mass", "body.inertia")
    assert (mass, list(inertia)) == (12.0, pytest.approx([13.0, 10.0, 5.0, 0.0, 0.0, 0.0], rel=1e-15))


def test_file_that_is_gone_or_another_changes_no_body(connect, tmp_path):
    """A mass of 2 kg stays when the file has 7 kg, and gravity can be set when it is gone."""
    file = tmp_path / "hull.urdf"
    text = (
        '<robot name="r"><link name="hull"><inertial><mass value="2"/>'
        '<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.25"/></inertial></link></robot>'
    )
    file.write_text(text)
    node = connect({**{n: v for n, v in SCENE.items() if n != "body.inertia"}, "body.urdf_file": str(file)}).ready()
    for change in (lambda: file.write_text(text.replace('"2"', '"7"')), file.unlink):
        change()
        assert node.set_parameter("gravity", [0.0, 0.0, -1.0]).successful
        assert node.get_parameters("body.mass") == [2.0]


def test_change_is_told_as_a_parameter_event_with_all_that_follows(nodes):
    from rcl_interfaces.msg import ParameterEvent

    node = at_start(nodes["box"], SCENES["box"])
    events = node.listen(ParameterEvent, "/parameter_events")

    def changed():
        return [{p.name for p in event.changed_parameters} for event in events if event.node == node.name]

    node.wait(lambda: node.set_parameter("real_time_factor", 1.0) and changed(), "an event, once connected")
    assert node.set_parameter("body.mass", 12.0).successful
    node.wait(lambda: any("body.mass" in names for names in changed()), "the event")
    assert changed()[-1] == {"body.mass", "body.inertia"}


# Refusals -------------------------------------------------------------------------------------------------------------

NAN = math.nan
REFUSED = {  # node, values set together, what the reason must say
    "negative mass": ("free", {"body.mass": -1.0}, "parameter body.mass = -1.0: is out of range"),
    "zero mass": ("free", {"body.mass": 0.0}, "body.mass = 0.0: is out of range; give a number that is finite and gr"),
    "NaN mass": ("free", {"body.mass": NAN}, "parameter body.mass = nan: is not finite; give finite numbers"),
    "huge mass": ("free", {"body.mass": 1e200}, "parameter body.mass = 1e+200: mass 1e+200 kg is not between"),
    "text": (
        "free",
        {"body.mass": "2.0"},
        "parameter body.mass = '2.0': is a text; write 2.0, with a point in every number",
    ),
    "no value": (
        "free",
        {"body.mass": None},
        "parameter body.mass = None: is no value, and parameters cannot be taken away; give one",
    ),
    "triangle": ("free", {"body.inertia": [0.1, 0.1, 0.3, 0.0, 0.0, 0.0]}, "triangle inequality"),
    "five entries": ("free", {"body.inertia": [0.1, 0.1, 0.1, 0.0, 0.0]}, "has 5 entries; give 6"),
    "infinite gravity": ("free", {"gravity": [0.0, 0.0, -math.inf]}, "parameter gravity"),
    "negative drag": ("free", {"drag.linear": [0.0, -1.0, 0.0]}, "each at least 0"),
    "NaN drag": ("free", {"drag.angular_quadratic": [0.0, NAN, 0.0]}, "parameter drag.angular_quadratic"),
    "negative limit": ("free", {"wrench.max_force": -1.0}, "parameter wrench.max_force = -1.0: is out of range"),
    "negative pace": ("free", {"real_time_factor": -1.0}, "out of range"),
    "NaN pace": ("free", {"real_time_factor": NAN}, "real_time_factor = nan: is not finite; give finite"),
    "simulated time": ("free", {"use_sim_time": True}, "this node makes the simulated time"),
    "read at start": (
        "free",
        {"rate": 50.0},
        "parameter rate = 50.0: is read at start only; start the node again with",
    ),
    "what may be set": (
        "free",
        {"rate": 50.0},
        "these may be set now: real_time_factor, wrench.max_force, wrench.max_torque",
    ),
    "ROS's own": ("free", {"start_type_description_service": False}, "_service = False: is read at start only; start"),
    "list of two kinds": (
        "free",
        {"gravity": "[0, 0, -9.81]"},  # what `ros2 param set` makes of it
        "parameter gravity = '[0, 0, -9.81]': is a text; write [0.0, 0.0, -9.81], with a point in every number",
    ),
    "exponent": ("free", {"body.mass": "1e3"}, "parameter body.mass = '1e3': is a text; write 1000.0, with a point"),
    "text for an array": ("free", {"gravity": "down"}, "gravity = 'down': is a text; give 3 finite numbers"),
    "bool": ("free", {"body.mass": True}, "parameter body.mass = True: True is not a number; give a value such as 1.0"),
    "number for an array": ("free", {"gravity": -9.81}, "parameter gravity = -9.81: is not an array; give 3 numbers"),
    "attitude": ("free", {"initial.rpy": [0.0, 0.0, 1.0]}, "initial.rpy = [0.0, 0.0, 1.0]: is read at start only"),
    "unknown": ("free", {"body.mas": 3.0}, "parameter body.mas is not known; did you mean body.mass?"),
    "unknown frame": (
        "free",
        {"frames.arm.position": [1, 0, 0]},
        "frames.arm.position = [1.0, 0.0, 0.0]: is read at start only",
    ),
    "one good, one bad": ("free", {"body.mass": 3.0, "body.inertia": [0.1, 0.1, 0.3, 0, 0, 0]}, "triangle inequality"),
    "one good, one read-only": (
        "free",
        {"body.mass": 3.0, "gravity": [1.0, 0.0, 0.0], "rate": 5.0},
        "rate = 5.0: is read at",
    ),
    "an attitude in a row": (
        "free",
        {"initial.orientation": [0.0, 0.0, 0.0, 1.0]},
        "as x, y, z, w that is {w: 1.0, x: 0.0, y: 0.0, z: 0.0}; as w, x, y, z it is {w: 0.0, x: 0.0, y: 0.0, z: 1.0}",
    ),
    "one good, one unknown": (
        "free",
        {"body.mass": 3.0, "nonsense": 1},
        "parameter nonsense is not known; the parameters are rate, ",
    ),
    "one good, simulated time": ("free", {"body.mass": 3.0, "use_sim_time": True}, "makes the simulated time"),
    "inertia against a shape": ("box", {"body.inertia": INERTIA}, "contradicts body.shape, from which"),
    "mass against a density": (
        "dense",
        {"body.mass": 4.0},
        "parameter body.mass = 4.0: contradicts body.density, from",
    ),
    "drag left out": ("taylor", {"drag.linear": [1.0, 1.0, 1.0]}, "taylor"),
    "good mass, drag left out": ("taylor", {"body.mass": 3.0, "drag.linear": [1.0, 1.0, 1.0]}, "taylor"),
}


@pytest.mark.parametrize(("which", "values", "reason"), REFUSED.values(), ids=REFUSED)
def test_refused_with_the_reason_and_nothing_changed(nodes, which, values, reason):
    node = at_start(nodes[which], SCENES[which])
    before = [plain(value) for value in node.get_parameters(*DYNAMIC)]
    values = {n: [float(x) for x in v] if isinstance(v, list) else v for n, v in values.items()}
    result = node.set_together(values)
    assert not result.successful and reason in result.reason
    assert [plain(value) for value in node.get_parameters(*DYNAMIC)] == before
    push(node)
    steps(node, 1)
    mass = {"dense": 3.0}.get(which, MASS)
    assert node.collect(2).linear[1, 0] == pytest.approx(
        FORCE / mass / RATE, rel=1e-7
    )  # measured 5e-9: it turns a little


def plain(value):
    return list(value) if isinstance(value, array.array) else value


OF_MEMBERS = {  # node, values set together, what the reason must say
    "no such member": (
        "ropes",
        {"tethers.chain.anchor": [0.0, 0.0, 1.0]},
        "parameter tethers.chain.anchor = [0.0, 0.0, 1.0]: there is no tethers.chain, and none is added while the node "
        "runs; those there are tethers.loose, tethers.rope, tethers.spring",
    ),
    "a whole one, and none there": (
        "lifted",
        {"tethers.a.anchor": [0.0, 0.0, 1.0], "tethers.a.rest_length": 1.0, "tethers.a.stiffness": 1.0},
        "there is no tethers.a, and none is added while the node runs; there are no tethers; give them at the start",
    ),
    "no such parameter": (
        "ropes",
        {"tethers.rope.restlength": 1.0},
        "parameter tethers.rope.restlength is not known; did you mean tethers.<name>.rest_length?",
    ),
    "no stiffness": ("ropes", {"tethers.rope.stiffness": 0.0}, "tethers.rope.stiffness = 0.0: is out of range; give"),
    "NaN anchor": ("ropes", {"tethers.spring.anchor": [NAN, 0.0, 0.0]}, "tethers.spring.anchor = [nan, 0.0, 0.0]: is"),
    "two entries": (
        "ropes",
        {"forces.lift.force": [1.0, 0.0]},
        "forces.lift.force = [1.0, 0.0]: has 2 entries; give 3",
    ),
    "number for a bool": ("ropes", {"tethers.rope.slack": 1}, "tethers.rope.slack = 1: is not of type bool"),
    "one good, one bad": (
        "ropes",
        {"tethers.rope.anchor": [0.0, 0.0, 9.0], "body.mass": 3.0, "tethers.rope.damping": -1.0},
        "parameter tethers.rope.damping = -1.0: is out of range",
    ),
    "one good, one of nobody": (
        "ropes",
        {"tethers.rope.anchor": [0.0, 0.0, 9.0], "forces.push.force": [1.0, 0.0, 0.0]},
        "there is no forces.push, and none is added while the node runs; those there are forces.lift",
    ),
    "what may be set": (
        "lifted",
        {"rate": 50.0},
        "fluid.velocity, forces.lift.body_point, forces.lift.force",
    ),
}


@pytest.mark.parametrize(("which", "values", "reason"), OF_MEMBERS.values(), ids=OF_MEMBERS)
def test_member_refused_with_the_reason_and_nothing_changed(nodes, which, values, reason):
    node = at_start(nodes[which], SCENES[which])
    names = [name for name in Scene(SCENES[which]).values if schema.find(name).dynamic]
    before = [plain(value) for value in node.get_parameters(*names)]
    result = node.set_together(values)
    assert not result.successful and reason in result.reason
    assert [plain(value) for value in node.get_parameters(*names)] == before
    steps(node, 5)
    alone = Simulation.from_scene(Scene(SCENES[which]))
    alone.step(5)
    assert node.collect(6).position[-1].tolist() == list(alone.motion[:3])


def test_set_one_after_the_other_each_stands_for_itself(node):
    """set_parameters, unlike set_parameters_atomically, takes what is good."""
    assert not node.set_parameter("body.mass", -3.0).successful
    assert node.set_parameter("gravity", [1.0, 0.0, 0.0]).successful
    assert [plain(v) for v in node.get_parameters("body.mass", "gravity")] == [MASS, [1.0, 0.0, 0.0]]


def test_whole_numbers_are_taken_for_floats(node):
    assert node.set_together({"body.mass": 3, "gravity": [1, 0, -2], "wrench.max_force": 4}).successful
    values = [plain(value) for value in node.get_parameters("body.mass", "gravity", "wrench.max_force")]
    assert values == [3.0, [1.0, 0.0, -2.0], 4.0] and isinstance(values[0], float)
    node.set_parameter("wrench.max_force", 0)


def test_value_of_a_type_that_does_not_exist_does_not_end_the_node(node):
    node.set_value_of_type("body.mass", 42)
    node.wait(lambda: "request ignored: 42 is not a valid Parameter.Type" in node.process.stderr, "the log")
    assert node.get_parameters("body.mass") == [MASS]


def test_dynamic_ones_are_those_that_descriptions_call_so(node):
    names = list(schema.BY_NAME)
    names = [name for name in names if "<name>" not in name]
    described = node.describe(*names)
    assert [d.name for d in described if not d.read_only] == [name for name in names if name in DYNAMIC]


# Anything at all, without another process -----------------------------------------------------------------------------


class Hooks:
    """What of a node Changes uses."""

    def get_parameter(self, name):  # use_sim_time
        return Parameter(name, value=False)

    def has_parameter(self, name):
        return True

    def add_pre_set_parameters_callback(self, callback):
        self.complete = callback

    def add_on_set_parameters_callback(self, callback):
        self.set = callback


numbers = st.floats() | st.sampled_from([0.0, 1.0, 1e-300, 1e300, 1e308])
odd = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(2**63), 2**63 - 1),
    numbers,
    st.text(max_size=5),
    st.lists(numbers, min_size=1, max_size=7),
    st.lists(numbers, min_size=3, max_size=3),
    st.lists(st.integers(-(2**63), 2**63 - 1), min_size=3, max_size=6),
    st.lists(st.booleans(), min_size=1, max_size=3),
    st.lists(st.text(max_size=3), min_size=1, max_size=3),
    st.lists(st.binary(min_size=1, max_size=1), min_size=1, max_size=3),
)
MEMBERS = [name for name in Scene(ROPES).values if name.count(".") == 2 and schema.find(name).dynamic]
OTHERS = ["use_sim_time", "nonsense", "", "tethers.chain.anchor", "forces.push.force"]
names = st.sampled_from([*DYNAMIC, *DYNAMIC, *MEMBERS, *schema.BY_NAME, *OTHERS])


@given(st.lists(st.tuples(names, odd), max_size=4))
def test_no_value_makes_a_callback_raise_and_what_is_refused_changes_nothing(values):
    """Not even many at once, nor one name twice; what is taken is the last of each name."""
    scene, hooks = Scene({**ROPES, "drag.quadratic": (0.1, 0.0, 0.0)}), Hooks()
    simulation, taken = Simulation.from_scene(scene), [scene]
    simulation.set_state(State(velocity=(3.0, 0.0, 0.0), angular_velocity=(1.0, 2.0, 3.0)))

    def take(new):
        terms = new.terms()
        simulation.change(**terms.dynamic())
        taken.append(new)

    parameters.Changes(hooks, scene, take)
    before = (simulation.save(), simulation.body, simulation.terms)
    result = hooks.set(hooks.complete([Parameter(name, value=value) for name, value in values]))
    if result.successful:
        assert taken[-1].terms() == simulation.terms
    else:
        assert result.reason and len(taken) == 1
        assert before == (simulation.save(), simulation.body, simulation.terms)
