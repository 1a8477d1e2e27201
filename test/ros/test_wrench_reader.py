"""Received bytes mean what the typed message means, or are refused; whatever they are."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigid_body_sim import Scene

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros
WrenchStamped = pytest.importorskip("geometry_msgs.msg").WrenchStamped
serialization = pytest.importorskip("rclpy.serialization")
messages = pytest.importorskip("rigid_body_sim.ros.messages")
WrenchReader = pytest.importorskip("rigid_body_sim.ros.wrench_reader").WrenchReader

SCENE = Scene(
    {
        "frames.thruster.position": (-0.3, 0.2, 0.1),
        "frames.thruster.orientation": {"w": 0.4, "x": 0.2, "y": -0.8, "z": 0.4},
        "frames.hook.axes": "world",
        "frames.größe.axes": "world",  # five letters, seven bytes
    }
)
FRAMES = ("", "base_link", "world", "thruster", "hook", "größe")
READER = WrenchReader(SCENE)  # one for all examples, so that what it remembers is tested too
frames = st.sampled_from([*FRAMES, *(f"/{frame}" for frame in FRAMES)]) | st.text(max_size=20).filter(
    lambda text: "\0" not in text and text.isascii()
)
floats = st.lists(st.floats(), min_size=6, max_size=6)


def serialised(frame_id, numbers):
    message = WrenchStamped()
    message.header.frame_id = frame_id
    f, t = message.wrench.force, message.wrench.torque
    f.x, f.y, f.z, t.x, t.y, t.z = numbers
    return bytes(serialization.serialize_message(message))


def outcome(read):
    """The wrench, or the reason and text of the refusal."""
    try:
        return read()
    except messages.RefusedError as refusal:
        return refusal.reason, str(refusal)


def expected(data):
    """What an ordinary subscription makes of the bytes, or None when they are not a message."""
    try:
        message = serialization.deserialize_message(data, WrenchStamped)
    except RuntimeError:
        return None
    return outcome(lambda: messages.read_wrench(message, SCENE))


def assert_same(data):
    found, wanted = outcome(lambda: READER.read(data)), expected(data)
    if wanted is None:
        assert found[0] == messages.MALFORMED
    else:
        assert repr(found) == repr(wanted)  # NaN is not equal to itself, and its text is


@given(frames, floats)
def test_message_means_the_same_as_typed(frame_id, numbers):
    assert_same(serialised(frame_id, numbers))


@pytest.mark.parametrize("frame_id", FRAMES)
def test_message_is_read_by_offset(monkeypatch, frame_id):
    monkeypatch.setattr(WrenchReader, "_read_slowly", None)
    data = serialised(frame_id, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    assert WrenchReader(SCENE).read(data) == expected(data)


@st.composite
def damaged(draw):
    """A message with some bytes changed, and then cut or lengthened."""
    data = bytearray(serialised(draw(frames), draw(floats)))
    for _ in range(draw(st.integers(0, 4))):
        data[draw(st.integers(0, len(data) - 1))] = draw(st.integers(0, 255))
    return (
        bytes(data[: draw(st.integers(0, len(data)))]) + draw(st.binary(max_size=16)) if draw(st.booleans()) else data
    )


@given(damaged() | st.binary(max_size=200))
def test_damaged_bytes_are_judged_as_by_an_ordinary_subscription(data):
    assert_same(bytes(data))


GOOD = serialised("base_link", [1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
DAMAGED = {
    "nothing": b"",
    "encoding alone": GOOD[:4],
    "one byte short": GOOD[:-1],
    "no numbers": GOOD[:28],
    "big-endian": b"\x00\x00" + GOOD[2:],
    "unknown encoding": b"\xff\xff" + GOOD[2:],
    "endless text": GOOD[:12] + struct.pack("<I", 2**32 - 1) + GOOD[16:],
    "long text": GOOD[:12] + struct.pack("<I", 2**31 - 1) + GOOD[16:],
}


@pytest.mark.parametrize("data", DAMAGED.values(), ids=DAMAGED)
def test_malformed_bytes_are_refused_by_a_sentence(data):
    with pytest.raises(messages.RefusedError, match=rf"wrench of {len(data)} bytes refused: .*; send one") as caught:
        READER.read(data)
    assert caught.value.reason == messages.MALFORMED


ODD = {  # accepted by an ordinary subscription
    "text without length": GOOD[:12] + struct.pack("<I", 0) + GOOD[16:],
    "no NUL": GOOD[:25] + b"x" + GOOD[26:],
    "NUL in the text": GOOD[:18] + b"\0" + GOOD[19:],
    "not UTF-8": GOOD[:16] + b"\xff\xfe" + GOOD[18:],
    "longer": GOOD + bytes(8),
    "padding in use": GOOD[:26] + b"ab" + GOOD[28:],
}


@pytest.mark.parametrize("data", ODD.values(), ids=ODD)
def test_odd_bytes_are_judged_as_by_an_ordinary_subscription(data):
    assert expected(data) is not None
    assert_same(data)


def test_big_endian_message_is_read():
    text = b"world\0"
    data = b"\x00\x00\x00\x00" + struct.pack(">iII", 1, 2, len(text)) + text + bytes(6) + struct.pack(">6d", *range(6))
    assert_same(data)


def test_what_is_sent_in_unknown_frames_is_not_remembered():
    reader = WrenchReader(SCENE)
    for number in range(1000):
        assert outcome(lambda number=number: reader.read(serialised(f"f{number}", [0.0] * 6)))[0] == "unknown frame"
    for frame in FRAMES:
        reader.read(serialised(frame, [0.0] * 6))
    assert len(reader._meanings) == len(FRAMES)
