"""Received bytes of a Float64MultiArray mean what the typed message means, or are refused; whatever they are."""

import struct
import sys
import types

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigid_body_sim import Scene

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros
std_msgs = pytest.importorskip("std_msgs.msg")
serialization = pytest.importorskip("rclpy.serialization")
messages = pytest.importorskip("rigid_body_sim.ros.messages")
actuator_inputs = pytest.importorskip("rigid_body_sim.ros.actuator_inputs")


def serialised(numbers, labels=()):
    message = std_msgs.Float64MultiArray(data=numbers)
    message.layout.dim = [std_msgs.MultiArrayDimension(label=label, size=1, stride=2) for label in labels]
    return bytes(serialization.serialize_message(message))


def expected(data):
    """The numbers that an ordinary subscription makes of the bytes, or the reason why there are none."""
    try:
        return repr(tuple(serialization.deserialize_message(data, std_msgs.Float64MultiArray).data))
    except RuntimeError:
        return messages.MALFORMED


def found(data):
    try:
        return repr(tuple(actuator_inputs.read_numbers(data)))  # NaN is not equal to itself, and its text is
    except messages.RefusedError as refusal:
        return refusal.reason


@pytest.mark.parametrize("numbers", ([], [1.0], [1.0, -2.0, float("inf"), float("nan")], [0.1] * 300), ids=len)
def test_message_is_read_by_offset(monkeypatch, numbers):
    data = serialised(numbers)
    wanted = expected(data)
    monkeypatch.setattr(messages, "deserialised", None)
    assert found(data) == wanted


@given(st.lists(st.floats(), max_size=6), st.lists(st.text("abc", max_size=9), max_size=3))
def test_message_of_any_layout_means_the_same_as_typed(numbers, labels):
    data = serialised(numbers, labels)
    assert found(data) == expected(data) != messages.MALFORMED


GOOD = serialised([1.0, 2.0, 3.0])
ODD = {
    "nothing": b"",
    "encoding alone": GOOD[:4],
    "one byte short": GOOD[:-1],
    "longer": GOOD + bytes(8),
    "big-endian": b"\x00\x00" + GOOD[2:],
    "unknown encoding": b"\xff\xff" + GOOD[2:],
    "a dimension that is not there": GOOD[:4] + struct.pack("<I", 1) + GOOD[8:],
    "endless dimensions": GOOD[:4] + struct.pack("<I", 2**32 - 1) + GOOD[8:],
    "endless numbers": GOOD[:12] + struct.pack("<I", 2**32 - 1) + GOOD[16:],
    "one number more": GOOD[:12] + struct.pack("<I", 4) + GOOD[16:],
    "one number less": GOOD[:12] + struct.pack("<I", 2) + GOOD[16:],
    "offset": GOOD[:8] + struct.pack("<I", 7) + GOOD[12:],
    "padding in use": GOOD[:16] + b"abcd" + GOOD[20:],
}


@pytest.mark.parametrize("data", ODD.values(), ids=ODD)
def test_odd_bytes_are_judged_as_by_an_ordinary_subscription(data):
    assert found(data) == expected(data)


@given(st.binary(max_size=80))
def test_any_bytes_are_judged_as_by_an_ordinary_subscription(data):
    assert found(data) == expected(data)


# Which topics ---------------------------------------------------------------------------------------------------------

ROTOR = {"type": "rotor", "min": 0.0, "max": 900.0, "thrust_coefficient": 2e-5}
JET = {"type": "thruster", "min": -1.0, "max": 1.0}


@pytest.fixture
def package(monkeypatch):
    """A module in place of actuator_msgs."""
    module = types.ModuleType("actuator_msgs")
    module.msg = types.ModuleType("actuator_msgs.msg")
    module.msg.Actuators = type("Actuators", (), {})
    monkeypatch.setitem(sys.modules, "actuator_msgs", module)
    monkeypatch.setitem(sys.modules, "actuator_msgs.msg", module.msg)


def topics(**given):
    return [*actuator_inputs.topics(Scene({"actuators": {"names": [*given], **given}} if given else {}))]


def test_topics_are_there_where_there_is_something_to_command(package):
    assert topics() == []
    assert topics(a=JET, b=ROTOR) == ["actuator_commands"]
    assert topics(a=ROTOR, b=ROTOR) == ["actuator_commands", "actuators"]


def test_without_the_package_there_is_one(monkeypatch):
    monkeypatch.setitem(sys.modules, "actuator_msgs.msg", None)  # a stand-in may be there
    assert topics(a=ROTOR) == ["actuator_commands"]
