"""Messages as the bytes in a bag: many at once, read by offset and made by offset. No ROS.

A message here is CDR: 4 bytes that name the encoding, perhaps a header (stamp, length of the frame's name, the name and
a NUL), then doubles, which lie at multiples of 8 counted from byte 4. So the length of the name fixes all offsets.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..physics.arrays import Floats, Integers

NANOSECONDS = 1_000_000_000
_LITTLE_ENDIAN = b"\x00\x01\x00\x00"
_TEXT_AT = 16  # encoding 4, stamp 8, length of the text 4


class Layout(NamedTuple):
    """What is in a message: a header or none, and how many doubles."""

    stamped: bool
    doubles: int


LAYOUTS = {
    "geometry_msgs/msg/Wrench": Layout(False, 6),
    "geometry_msgs/msg/WrenchStamped": Layout(True, 6),
    "geometry_msgs/msg/PoseStamped": Layout(True, 7),
    "geometry_msgs/msg/TwistStamped": Layout(True, 6),
}


class Decoded(NamedTuple):
    """The contents of n messages, and the indices of those that are not laid out as usual and hold nothing here."""

    stamp_ns: Integers  # (n,), zero without a header
    frame_ids: NDArray[np.object_]  # (n,) of str, empty without a header
    values: Floats  # (n, doubles)
    unusual: Integers  # (k,)


def decode(messages: Sequence[bytes], layout: Layout) -> Decoded:
    """The stamps [ns], frames and doubles of serialised messages that all have that layout."""
    count = len(messages)
    stamp_ns, values = np.zeros(count, np.int64), np.zeros((count, layout.doubles))
    frame_ids = np.full(count, "", object)
    usual = np.zeros(count, bool)
    lengths = np.fromiter(map(len, messages), np.int64, count)
    for length in np.unique(lengths):
        if length < _TEXT_AT:
            continue
        at = np.flatnonzero(lengths == length)
        data = np.frombuffer(b"".join([messages[i] for i in at.tolist()]), np.uint8).reshape(len(at), length)
        plain = (data[:, :4] == np.frombuffer(_LITTLE_ENDIAN, np.uint8)).all(axis=1)
        texts = _column(data, _TEXT_AT - 4, "<u4") if layout.stamped else np.zeros(len(at), np.uint32)
        for text in np.unique(texts[plain]):
            first = _doubles_at(int(text)) if layout.stamped else len(_LITTLE_ENDIAN)
            if length != first + 8 * layout.doubles:
                continue
            mine = np.flatnonzero(plain & (texts == text))
            rows, chosen = data[mine], at[mine]
            if layout.stamped:
                names, good = _names(rows[:, _TEXT_AT : _TEXT_AT + int(text)])
                rows, chosen = rows[good], chosen[good]
                frame_ids[chosen] = names[good]
                stamp_ns[chosen] = _column(rows, 4, "<i4") * np.int64(NANOSECONDS) + _column(rows, 8, "<u4")
            values[chosen] = np.ascontiguousarray(rows[:, first:]).view("<f8")
            usual[chosen] = True
    return Decoded(stamp_ns, frame_ids, values, np.flatnonzero(~usual))


def encode(stamp_ns: Integers, frame_id: str, values: Floats) -> list[bytes]:
    """Serialised messages with a header and doubles: stamps [ns], shape (n,), the frame, and values, shape (n, k)."""
    text = frame_id.encode() + b"\0"
    first = _doubles_at(len(text))
    data = np.zeros((len(stamp_ns), first + 8 * values.shape[1]), np.uint8)
    head = np.frombuffer(_LITTLE_ENDIAN, np.uint8)
    data[:, : len(head)] = head
    seconds, nanoseconds = np.divmod(stamp_ns, NANOSECONDS)
    data[:, 4:8] = _bytes_of(seconds, "<i4")
    data[:, 8:12] = _bytes_of(nanoseconds, "<u4")
    data[:, 12:16] = _bytes_of(np.full(len(stamp_ns), len(text)), "<u4")
    data[:, _TEXT_AT : _TEXT_AT + len(text)] = np.frombuffer(text, np.uint8)
    data[:, first:] = np.ascontiguousarray(values, "<f8").view(np.uint8)
    whole, size = data.tobytes(), data.shape[1]
    return [whole[at : at + size] for at in range(0, len(whole), size)]


def _doubles_at(text: int) -> int:
    """Where the doubles begin after a header whose text, with its NUL, has that length."""
    end = _TEXT_AT + text
    return end + (4 - end) % 8


def _column(rows: NDArray[np.uint8], at: int, kind: str) -> Integers:
    return np.ascontiguousarray(rows[:, at : at + 4]).view(kind)[:, 0]


def _bytes_of(numbers: Integers, kind: str) -> NDArray[np.uint8]:
    return np.ascontiguousarray(numbers.astype(kind)[:, None]).view(np.uint8)


def _names(texts: NDArray[np.uint8]) -> tuple[NDArray[np.object_], NDArray[np.bool_]]:
    """Names in rows of bytes, and which of the rows are one text that ends with its only NUL."""
    whole, size = texts.tobytes(), texts.shape[1]
    rows = [whole[at : at + size] for at in range(0, len(whole), size)]
    meanings = {row: _name(row) for row in set(rows)}
    names = [meanings[row] for row in rows]
    return np.array(names, object), np.array([name is not None for name in names], bool)


def _name(text: bytes) -> str | None:
    if text.find(0) != len(text) - 1:
        return None
    try:
        return text[:-1].decode()
    except UnicodeDecodeError:
        return None
