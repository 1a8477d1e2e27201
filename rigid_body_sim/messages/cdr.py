"""CDR, the encoding of messages: 4 bytes that name it, then every field at a multiple of its size counted from there.

A message here has perhaps a header (stamp, length of the frame's name, the name and a NUL), perhaps the name of another
frame, then doubles. So the lengths of the names fix all offsets.
"""

import struct
from typing import NamedTuple

NANOSECONDS = 1_000_000_000
LITTLE_ENDIAN = b"\x00\x01\x00\x00"  # plain CDR, as the middleware writes it here
TEXT_AT = 16  # encoding 4, stamp 8, length of the text 4
STAMP = struct.Struct("<iI")
DOUBLE = struct.Struct("<d")
_LENGTH = struct.Struct("<I")
_WRENCH = struct.Struct("<6d")
_POSE = struct.Struct("<7d")
_NUMBERS = struct.Struct("<4sIII")  # encoding, how many dimensions, offset, how many numbers; then 4 bytes of padding
_NUMBERS_AT = 20

ENCODINGS = {  # of those that have the fields in a row: order of bytes, and what doubles are aligned to
    b"\x00\x00": (">", 8),
    b"\x00\x01": ("<", 8),
    b"\x00\x06": (">", 4),  # version 2
    b"\x00\x07": ("<", 4),
}
OTHER_ENCODINGS = {b"\x00\x02": "PL_CDR", b"\x00\x03": "PL_CDR", b"\x00\x08": "D_CDR2", b"\x00\x09": "D_CDR2"}
OTHER_ENCODINGS |= {b"\x00\x0a": "PL_CDR2", b"\x00\x0b": "PL_CDR2"}
MOST_PADDING = 7  # bytes behind the last field


class Layout(NamedTuple):
    """What is in a message: how many names, the first of which has a stamp before it, and how many doubles."""

    names: int
    doubles: int


LAYOUTS = {
    "geometry_msgs/msg/Wrench": Layout(0, 6),
    "geometry_msgs/msg/WrenchStamped": Layout(1, 6),
    "geometry_msgs/msg/PoseStamped": Layout(1, 7),
    "geometry_msgs/msg/TwistStamped": Layout(1, 6),
    "geometry_msgs/msg/PoseWithCovarianceStamped": Layout(1, 7 + 36),
    "geometry_msgs/msg/TwistWithCovarianceStamped": Layout(1, 6 + 36),
    "geometry_msgs/msg/TransformStamped": Layout(2, 7),
    "nav_msgs/msg/Odometry": Layout(2, 7 + 36 + 6 + 36),
}


def aligned(end: int, size: int) -> int:
    """Where a number of that size begins that comes after ``end``, which counts the bytes of the encoding, too."""
    return end + (len(LITTLE_ENDIAN) - end) % size


def split_wrench(data: bytes) -> tuple[bytes, tuple[float, ...]] | None:
    """Frame (UTF-8 and a NUL) and force and torque, 6 floats, of a serialised WrenchStamped.

    None for bytes of another encoding or length, which whoever knows all encodings must judge.
    """
    if len(data) < TEXT_AT or data[:4] != LITTLE_ENDIAN:
        return None
    end = TEXT_AT + _LENGTH.unpack_from(data, TEXT_AT - 4)[0]
    at = end + (4 - end) % 8  # ``aligned``, without a call: this runs once a command
    if len(data) != at + _WRENCH.size:
        return None
    return data[TEXT_AT:end], _WRENCH.unpack_from(data, at)


def split_pose(data: bytes) -> tuple[int, tuple[float, ...]] | None:
    """Stamp [ns], and position and quaternion x, y, z, w, 7 floats, of a serialised PoseStamped.

    None for bytes of another encoding or length, which whoever knows all encodings must judge.
    """
    if len(data) < TEXT_AT or data[:4] != LITTLE_ENDIAN:
        return None
    at = aligned(TEXT_AT + _LENGTH.unpack_from(data, TEXT_AT - 4)[0], DOUBLE.size)
    if len(data) != at + _POSE.size:
        return None
    seconds, nanoseconds = STAMP.unpack_from(data, len(LITTLE_ENDIAN))
    return seconds * NANOSECONDS + nanoseconds, _POSE.unpack_from(data, at)


def split_numbers(data: bytes) -> tuple[float, ...] | None:
    """The numbers in a serialised Float64MultiArray whose layout has no dimensions.

    None for bytes of another encoding, layout or length, which whoever knows all of them must judge.
    """
    if len(data) < _NUMBERS_AT:
        return None
    encoding, dimensions, _, count = _NUMBERS.unpack_from(data)
    if encoding != LITTLE_ENDIAN or dimensions or len(data) != _NUMBERS_AT + 8 * count:
        return None
    return struct.unpack_from(f"<{count}d", data, _NUMBERS_AT)


def serialised_text(text: str) -> bytes:
    """The text as a serialised std_msgs/msg/String."""
    data = text.encode() + b"\x00"
    return LITTLE_ENDIAN + _LENGTH.pack(len(data)) + data
