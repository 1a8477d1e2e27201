"""Messages as bytes: every output is written as its typed message is, and what is not understood is written typed."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigid_body_sim import Scene, Simulation

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros
PoseStamped = pytest.importorskip("geometry_msgs.msg").PoseStamped
Marker = pytest.importorskip("visualization_msgs.msg").Marker
deserialize_message = pytest.importorskip("rclpy.serialization").deserialize_message
templates = pytest.importorskip("rigid_body_sim.ros.templates")
outputs = pytest.importorskip("rigid_body_sim.ros.outputs")

JET = {"type": "thruster", "min": 0.0, "max": 1.0}
ACTUATORS = {"actuators": {"names": ["jet", "main_jet", "jets"], "jet": JET, "main_jet": JET, "jets": JET}}
SCENE = Scene({"body.shape": "box", "body.dimensions": (0.2, 0.3, 0.4), **ACTUATORS})
SIMULATION = Simulation.from_scene(SCENE)
POSE = outputs.KINDS["pose"](SCENE, SIMULATION).fields
numbers = st.floats(allow_nan=False)
stamps = st.integers(0, 2**31 * templates.NANOSECONDS - 1)


def pose_in(frame_id):
    message = PoseStamped()
    message.header.frame_id = frame_id
    return message


@pytest.mark.parametrize("kind", [kind for kind in outputs.KINDS if kind != "tf"])
def test_bytes_say_what_the_typed_message_says(kind):
    first, second = (outputs.KINDS[kind](SCENE, SIMULATION) for _ in range(2))
    template = templates.Template(first.message, first.fields, first.stamp)
    typed = templates.Typed(second.message, second.fields, second.stamp)

    @given(stamps, st.lists(numbers, min_size=len(first.fields), max_size=len(first.fields)))
    def compare(stamp_ns, values):
        read = deserialize_message(template.write(stamp_ns, values), type(first.message))
        assert read == typed.write(stamp_ns, values)

    compare()


@pytest.mark.parametrize("length", range(1, 18))
def test_length_of_the_frame_moves_the_fields(length):
    template = templates.Template(pose_in("f" * length), POSE)
    message = deserialize_message(template.write(3_000_000_007, range(1, 8)), PoseStamped)
    p, q = message.pose.position, message.pose.orientation
    assert (p.x, p.y, p.z, q.x, q.y, q.z, q.w) == (1, 2, 3, 4, 5, 6, 7)
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (3, 7)
    assert message.header.frame_id == "f" * length


def test_what_was_given_out_does_not_change_later():
    template = templates.Template(pose_in("world"), POSE)
    first = template.write(1, [1.0] * 7)
    kept = bytes(first)
    template.write(2, [2.0] * 7)
    assert first == kept


def test_wrong_number_of_values_is_an_error():
    for kind in (templates.Template, templates.Typed):
        with pytest.raises(Exception, match=r"expected|shorter|longer"):
            kind(pose_in("world"), POSE).write(0, [0.0] * 6)


def swapped(message, serialize=templates.serialize_message):
    """Another representation: pairs of bytes the other way round."""
    data = bytearray(serialize(message))
    data[0::2], data[1::2] = data[1::2], data[0::2]
    return bytes(data)


STRANGE = {  # what is put in place of a function of rclpy, and the reason given
    "other byte order": ("serialize_message", swapped, r"header\.stamp occurs 0 times"),
    "does not serialise": ("serialize_message", lambda message: 1 / 0, "cannot be serialised: division by zero"),
    "does not read back": ("deserialize_message", lambda data, kind: 1 / 0, "cannot be read back: division by zero"),
    "reads back wrongly": ("deserialize_message", lambda data, kind: kind(), "is not what was written"),
}


@pytest.mark.parametrize(("name", "function", "said"), STRANGE.values(), ids=STRANGE)
def test_strange_layout_is_written_typed(monkeypatch, name, function, said):
    monkeypatch.setattr(templates, name, function)
    writer, reason = templates.writer(pose_in("world"), POSE)
    assert isinstance(writer, templates.Typed)
    with pytest.raises(templates.LayoutError, match=said) as caught:
        templates.Template(pose_in("world"), POSE)
    assert str(caught.value) == reason
    message = writer.write(5_000_000_001, [1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0])
    assert (message.header.stamp.sec, message.pose.position.z, message.pose.orientation.w) == (5, 3.0, 1.0)


def test_field_that_is_no_double_is_refused():
    with pytest.raises(templates.LayoutError, match=r"color\.r occurs 0 times"):
        templates.Template(Marker(), ("color.r",))


@pytest.mark.parametrize(
    ("fields", "stamp"),
    [(("pose.position.y", "pose.position.x"), "header.stamp"), (("pose.position.x",), "lifetime")],
    ids=["fields", "stamp"],
)
def test_another_order_than_that_of_the_bytes_is_refused(fields, stamp):
    with pytest.raises(templates.LayoutError, match="in another order"):
        templates.Template(Marker(), fields, stamp)


def test_field_that_is_named_twice_is_refused():
    with pytest.raises(templates.LayoutError, match=r"pose\.position\.x occurs 0 times"):
        templates.Template(PoseStamped(), ("pose.position.x", "pose.position.x"))
