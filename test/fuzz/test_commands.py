"""Any bytes, given to the very callbacks that the node subscribes with.

Nothing may escape or hang. What an ordinary, typed subscription would refuse is refused, counted once under the right
name, told in one sentence, and moves nothing, to the bit; what it would take has the effect that the numbers have.
"""

import math
import struct
from dataclasses import dataclass, field

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rigid_body_sim import Scene, Simulation, SimulationError

from .fuzzing import damaged, fuzz, often, sentence

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros
Float64MultiArray = pytest.importorskip("std_msgs.msg").Float64MultiArray
geometry = pytest.importorskip("geometry_msgs.msg")
serialization = pytest.importorskip("rclpy.serialization")
messages = pytest.importorskip("rigid_body_sim.ros.messages")
inputs = pytest.importorskip("rigid_body_sim.ros.inputs")
loops = pytest.importorskip("rigid_body_sim.ros.loop")

SCENE = Scene(
    {
        "rate": 1000.0,
        "publish_rate": 0.0,
        "wrench.topics": ["wrench", "gust"],
        "body.inertia": [0.1, 0.2, 0.25, 0.0, 0.0, 0.0],
        "body.center_of_mass": [0.1, 0.0, 0.0],
        "initial.angular_velocity": [0.3, 1.0, 0.2],
        "frames.hook.axes": "world",
        "frames.größe.position": [0.1, 0.2, 0.3],
    }
)
ACTUATED = SCENE.changed(
    {
        "actuators": {
            "names": ["rotor", "jet", "wheel"],
            "rotor": {"type": "rotor", "min": 0.0, "max": 900.0, "thrust_coefficient": 2e-5, "time_constant": 0.01},
            "jet": {"type": "thruster", "min": -5.0, "max": 5.0, "delay": 0.0033},
            "wheel": {"type": "wheel", "min": -1e60, "max": 1e60, "inertia": 1e-3, "max_speed": 90.0},
        }
    }
)
KINDS = {
    "wrench": geometry.WrenchStamped,
    "gust": geometry.WrenchStamped,
    "impulse": geometry.WrenchStamped,
    "set_pose": geometry.PoseStamped,
    "set_twist": geometry.TwistStamped,
    "actuator_commands": Float64MultiArray,
}
DOUBLES = {"set_pose": 7}  # all others have 6
STEPS = 2  # after each message


@dataclass
class Listener:
    """In place of a node: it keeps the callbacks of the subscriptions, and what is logged."""

    callbacks: dict = field(default_factory=dict)
    warnings: list = field(default_factory=list)
    subscriptions: tuple = ()
    publishers: tuple = ()

    def create_subscription(self, kind, topic, callback, depth, *, qos_overriding_options, raw):
        assert raw and KINDS[topic] is kind
        self.callbacks[topic] = callback

    def get_logger(self):
        return self

    def warning(self, text):
        self.warnings.append(text)

    def resolve_topic_name(self, topic):
        return f"/{topic}"


class Unheard:
    """In place of the outputs: nobody listens."""

    heard = False

    def passing(self, advance, _):
        return advance

    def publish(self, _):
        pass


class Subject:
    """What the node is made of, without a network: loop, simulation and inputs."""

    def __init__(self, scene):
        self.simulation = Simulation.from_scene(scene)
        self.loop = loops.Loop(scene, self.simulation, Unheard(), lambda _: None)
        self.node = Listener()
        self.inputs = inputs.Inputs(self.node, scene, self.loop, set())

    def fresh(self):
        self.loop.reset(time_too=True)
        self.inputs.forget()

    def send(self, topic, data):
        """Reason of the refusal, or an empty text."""
        before = self.inputs.refused.copy()
        self.inputs._warned.clear()  # else one sentence in five seconds
        self.node.warnings.clear()
        self.node.callbacks[topic](data)
        counted = self.inputs.refused - before
        assert counted.total() == len(self.node.warnings) <= 1
        if not counted:
            return ""
        ((reason, _),) = counted.items()
        said = sentence(self.node.warnings[0])
        assert "refused" in said or reason == messages.NOT_FINITE, said
        return reason


SUBJECT, WITH_ACTUATORS = Subject(SCENE), Subject(ACTUATED)
MODEL, ACTUATED_MODEL = map(Simulation.from_scene, (SCENE, ACTUATED))  # moved by typed messages
HOLD = SCENE["wrench.timeout"]


def typed(topic, data):
    """The message that an ordinary subscription would give, or None."""
    try:
        return serialization.deserialize_message(data, KINDS[topic])
    except RuntimeError:
        return None


def model_wrench(topic, message):
    """Move the model as a typed wrench or impulse would; returns the reason of a refusal, or an empty text."""
    try:
        wrench = messages.read_wrench(message, SCENE)
    except messages.RefusedError as refusal:
        return refusal.reason
    try:
        if topic == "impulse":
            MODEL.apply_impulse(wrench)
        else:
            MODEL.set_wrench(wrench, HOLD, topic)
    except ValueError:
        return messages.NOT_FINITE
    return ""


def step_both(subject, model):
    """Some steps; a simulation that stops does so in both, and is set going again."""
    subject.loop._advance(STEPS)
    try:
        model.step(STEPS)
    except SimulationError as reason:
        assert subject.loop.failure == str(reason)
    else:
        assert not subject.loop.failure
    assert subject.simulation.save() == model.save()
    if subject.loop.failure:
        subject.fresh()
        model.reset()


def check_wrenches(sent):
    SUBJECT.fresh()
    MODEL.reset()
    for topic, data in sent:
        before, message = SUBJECT.simulation.save(), typed(topic, data)
        reason = SUBJECT.send(topic, data)
        assert reason == (messages.MALFORMED if message is None else model_wrench(topic, message))
        if reason:
            assert SUBJECT.simulation.save() == before
        assert SUBJECT.simulation.save() == MODEL.save()
        step_both(SUBJECT, MODEL)


def check_actuators(sent):
    subject, model = WITH_ACTUATORS, ACTUATED_MODEL
    subject.fresh()
    model.reset()
    for topic, data in sent:
        before, message = subject.simulation.save(), typed(topic, data)
        reason = subject.send(topic, data)
        assert reason == (messages.MALFORMED if message is None else model_actuators(message.data))
        if reason:
            assert subject.simulation.save() == before
        assert subject.simulation.save() == model.save()
        assert subject.simulation.commands_limited == model.commands_limited
        step_both(subject, model)


def model_actuators(numbers):
    """Command the model as a typed message would; returns the reason of a refusal, or an empty text."""
    if len(numbers) != len(ACTUATED_MODEL.actuators):
        return messages.WRONG_LENGTH
    if not np.isfinite(numbers).all():
        return messages.NOT_FINITE
    ACTUATED_MODEL.set_actuators(numbers, HOLD)
    return ""


def check_states(sent):
    SUBJECT.fresh()
    for topic, data in sent:
        before, message = SUBJECT.simulation.save(), typed(topic, data)
        reason = SUBJECT.send(topic, data)
        if reason:
            assert SUBJECT.simulation.save() == before
        if message is None:
            assert reason == messages.MALFORMED
            continue
        if (frame := message.header.frame_id.removeprefix("/")) not in known_frames(topic):
            assert reason == messages.UNKNOWN_FRAME
        elif not reason:
            assert_taken(topic, frame, message)
        else:
            assert reason in (messages.NOT_FINITE, messages.NOT_A_ROTATION)
            assert not moderate(topic, message)
        SUBJECT.loop._advance(STEPS)
        if SUBJECT.loop.failure:
            assert SUBJECT.send(topic, data) == messages.STOPPED
            SUBJECT.fresh()
        assert np.isfinite(SUBJECT.simulation.motion).all()


def known_frames(topic):
    return {"", "world"} if topic == "set_pose" else {"", "world", "base_link"}


def numbers(topic, message):
    if topic == "set_pose":
        p, q = message.pose.position, message.pose.orientation
        return p.x, p.y, p.z, q.w, q.x, q.y, q.z
    v, w = message.twist.linear, message.twist.angular
    return v.x, v.y, v.z, w.x, w.y, w.z


def moderate(topic, message):
    """Whether the numbers are such as nobody may refuse."""
    values = numbers(topic, message)
    turn = topic != "set_pose" or max(map(abs, values[3:])) > 1e-6
    return turn and all(abs(value) < 1e100 for value in values)  # False for NaN


def assert_taken(topic, frame, message):
    """The motion is what the numbers say, to round-off where an attitude comes in, or a lever of 0.1 m."""
    motion, values = SUBJECT.simulation.motion, numbers(topic, message)
    if topic == "set_pose":
        largest = max(map(abs, values[3:]))
        scaled = [component / largest for component in values[3:]]
        unit = [component / math.hypot(*scaled) for component in scaled]
        assert_allclose(motion[3:7], unit, rtol=0, atol=1e-12)
        assert_allclose(motion[:3], values[:3], rtol=1e-12, atol=1e-12)
    else:
        found = motion[7:13] if frame == "world" else motion[13:19]
        scale = max(map(abs, values))
        assert_allclose(found, values, rtol=0, atol=1e-12 * scale + 1e-300)


# Bytes ----------------------------------------------------------------------------------------------------------------

PATTERNS = [
    *(struct.pack("<d", x) for x in (0.0, -0.0, 1.0, -2.5, 1e308, -1.7976931348623157e308, 5e-324, -1e-310, 2.3e-308)),
    *(struct.pack("<d", x) for x in (math.inf, -math.inf, math.nan, 1e150, 1e-150, 0.1, 3e5)),
    struct.pack("<Q", 0x7FF0000000000001),  # a signalling NaN
    struct.pack("<Q", 0xFFF8DEADBEEF0001),  # a NaN with a payload
]
FRAMES = [
    b"",
    b"\0",
    b"world\0",
    b"base_link\0",
    b"/world\0",
    b"hook\0",
    "größe\0".encode(),
    b"nowhere\0",
    b"//world\0",
]
FRAMES += [
    b"world",
    b"wor\0ld\0",
    b"\xff\xfe\0",
    b"a" * 5000 + b"\0",
    b"w\n\x1b[2Jorld\0",
    b"\xed\xa0\x80\0",
    b"\0\0\0\0",
]
HEADS = [
    b"\0\1\0\0",
    b"\0\0\0\0",
    b"\0\1\0\1",
    b"\0\3\0\0",
    b"\0\7\0\0",
    b"\xff\xff\xff\xff",
    b"\0\6\0\0",
    b"\0\x0b\0\0",
]
LENGTHS = [0, 1, 2**31 - 1, 2**31, 2**32 - 1, 2**16]


def double(chance):
    how = chance.randrange(3)
    if how == 0:
        return chance.choice(PATTERNS)
    return struct.pack("<d", chance.uniform(-9.0, 9.0)) if how == 1 else bits(chance, 8)


def bits(chance, count):
    return chance.getrandbits(8 * count).to_bytes(count, "little")


def serialised(chance, topic):
    """A message, whole or with something wrong about it."""
    frame, count = chance.choice(FRAMES), DOUBLES.get(topic, 6)
    doubles = b"".join(double(chance) for _ in range(count))
    little = often(chance)
    order = "<" if little else ">"
    head = (b"\0\1\0\0" if little else b"\0\0\0\0") if often(chance) else chance.choice(HEADS)
    length = len(frame) if often(chance) else chance.choice((*LENGTHS, chance.getrandbits(32)))
    if not little:
        doubles = struct.pack(f">{count}d", *struct.unpack(f"<{count}d", doubles))
    text = struct.pack(f"{order}I", length) + frame
    data = head + bits(chance, 8) + text + bytes(-(8 + len(text)) % 8) + doubles
    return data if often(chance) else damaged(chance, data)


def numbers_of(chance):
    """A Float64MultiArray, whole or with something wrong about it."""
    count, dimensions = chance.choice((3, 3, 3, 3, 0, 1, 2, 4, 40)), chance.choice((0, 0, 0, 1, 2))
    order = "<" if often(chance) else ">"
    layout = struct.pack(f"{order}I", dimensions)
    for _ in range(dimensions):
        label = chance.choice(FRAMES)
        layout += bytes(-len(layout) % 4) + struct.pack(f"{order}I", len(label)) + label
        layout += bytes(-len(layout) % 4) + bits(chance, 8)
    claimed = count if often(chance) else chance.choice((*LENGTHS, chance.getrandbits(32)))
    layout += bytes(-len(layout) % 4) + bits(chance, 4) + struct.pack(f"{order}I", claimed)
    doubles = struct.unpack(f"<{count}d", b"".join(double(chance) for _ in range(count)))
    head = (b"\0\1\0\0" if order == "<" else b"\0\0\0\0") if often(chance) else chance.choice(HEADS)
    data = head + layout + bytes(-len(layout) % 8) + struct.pack(f"{order}{count}d", *doubles)
    return data if often(chance) else damaged(chance, data)


def made(chance, topic):
    if not often(chance):
        return bits(chance, chance.randint(1, 120))
    return numbers_of(chance) if topic == "actuator_commands" else serialised(chance, topic)


def sent(*topics):
    """A function: up to three messages, one after the other, each with its topic."""

    def make(chance):
        chosen = [chance.choice(topics) for _ in range(chance.randint(1, 3))]
        return [(t, made(chance, t)) for t in chosen]

    return make


def test_wrenches_and_impulses(record_property):
    fuzz(record_property, check_wrenches, sent("wrench", "gust", "impulse"), 1000)


def test_states(record_property):
    fuzz(record_property, check_states, sent("set_pose", "set_twist"), 500)


def test_commands_to_actuators(record_property):
    fuzz(record_property, check_actuators, sent("actuator_commands"), 1000)
