"""Messages as the bytes in a bag: many at once, read by offset and made by offset. No ROS.

How they lie there is in messages.cdr.
"""

import struct
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..kernels.arrays import Floats, Integers
from ..messages.cdr import (
    ENCODINGS,
    LITTLE_ENDIAN,
    MOST_PADDING,
    NANOSECONDS,
    OTHER_ENCODINGS,
    TEXT_AT,
    Layout,
    aligned,
    split_numbers,
)

Bytes = NDArray[np.uint8]


class Decoded(NamedTuple):
    """The contents of n messages, and the indices of those that are not laid out as usual and hold nothing here."""

    stamp_ns: Integers  # (n,), zero without a header
    frame_ids: NDArray[np.object_]  # (n,) of str, empty without a header
    child_ids: NDArray[np.object_]  # (n,) of str, empty without a second name
    values: Floats  # (n, doubles)
    unusual: Integers  # (k,)


class NotCdrError(Exception):
    """Bytes that are not a message of its layout; the text says why, after "the message"."""


def decode(messages: Sequence[bytes], layout: Layout) -> Decoded:
    """The stamps [ns], names and doubles of serialised messages that all have that layout."""
    count = len(messages)
    names = np.full(count, "", object), np.full(count, "", object)
    found = Decoded(np.zeros(count, np.int64), *names, np.zeros((count, layout.doubles)), np.arange(count))
    usual = np.zeros(count, bool)
    lengths = np.fromiter(map(len, messages), np.int64, count)
    for length in np.unique(lengths).tolist():
        if length >= TEXT_AT:
            chosen = np.flatnonzero(lengths == length)
            rows = np.frombuffer(b"".join([messages[i] for i in chosen.tolist()]), np.uint8).reshape(-1, length)
            plain = (rows[:, :4] == np.frombuffer(LITTLE_ENDIAN, np.uint8)).all(axis=1)
            _decode_rows(rows[plain], chosen[plain], layout, found, usual)
    return found._replace(unusual=np.flatnonzero(~usual))


def _decode_rows(rows: Bytes, chosen: Integers, layout: Layout, found: Decoded, usual: NDArray[np.bool_]) -> None:
    """Put what is in messages of one length, whose indices are ``chosen``, where it belongs; note which are usual."""
    parts = [(rows, chosen, TEXT_AT - 4 if layout.names else len(LITTLE_ENDIAN))]
    for names in (found.frame_ids, found.child_ids)[: layout.names]:
        parts = [part for wider in parts for part in _by_name(*wider, names)]
    for part, indices, end in parts:
        first = aligned(end, 8)
        if part.shape[1] != first + 8 * layout.doubles:
            continue
        if layout.names:
            found.stamp_ns[indices] = _column(part, 4, "<i4") * np.int64(NANOSECONDS) + _column(part, 8, "<u4")
        found.values[indices] = np.ascontiguousarray(part[:, first:]).view("<f8")
        usual[indices] = True


def _by_name(
    rows: Bytes, chosen: Integers, end: int, names: NDArray[np.object_]
) -> Iterator[tuple[Bytes, Integers, int]]:
    """Parts of the rows in which the next name, which is noted, has one length, and where it ends."""
    begin = aligned(end, 4) + 4
    if begin > rows.shape[1]:
        return
    lengths = _column(rows, begin - 4, "<u4")
    for length in np.unique(lengths).tolist():
        if 0 < length <= rows.shape[1] - begin:
            mine = np.flatnonzero(lengths == length)
            texts, good = _names(rows[mine, begin : begin + length])
            mine = mine[good]
            names[chosen[mine]] = texts[good]
            yield rows[mine], chosen[mine], begin + length


class One(NamedTuple):
    """The contents of one message."""

    stamp_ns: int
    frame_id: str
    child_id: str
    values: list[float]


def decode_one(data: bytes, layout: Layout) -> One:
    """A message in any encoding that has the fields in a row. Raises NotCdrError for what is none of that layout."""
    fields = _Fields(data)
    stamp_ns = fields.number("i") * NANOSECONDS + fields.number("I") if layout.names else 0
    frame_id, child_id = (fields.text() if place < layout.names else "" for place in range(2))
    values = [fields.number("d") for _ in range(layout.doubles)]
    fields.end()
    return One(int(stamp_ns), frame_id, child_id, values)


def decode_text(data: bytes) -> str:
    """The text in a serialised std_msgs/msg/String. Raises NotCdrError for what is none."""
    fields = _Fields(data)
    text = fields.text()
    fields.end()
    return text


def decode_numbers(data: bytes) -> tuple[float, ...]:
    """The numbers in a serialised std_msgs/msg/Float64MultiArray. Raises NotCdrError for what is none."""
    if (numbers := split_numbers(data)) is not None:
        return numbers
    fields = _Fields(data)
    for _ in range(fields.number("I")):
        fields.text(), fields.number("I"), fields.number("I")
    fields.number("I")
    numbers = tuple(fields.number("d") for _ in range(fields.number("I")))
    fields.end()
    return numbers


class _Fields:
    """The fields of a message, one after the other."""

    def __init__(self, data: bytes):
        encoding = data[:2]
        if encoding not in ENCODINGS:
            known = OTHER_ENCODINGS.get(encoding, f"0x{encoding.hex()}" if encoding else "nothing")
            raise NotCdrError(f"is encoded as {known}; plain CDR would be right")
        self._data, self._at = data, len(LITTLE_ENDIAN)
        self._order, self._most = ENCODINGS[encoding]

    def number(self, kind: str) -> Any:
        """The next number, of that kind of struct."""
        size = struct.calcsize(kind)
        begin = aligned(self._at, min(size, self._most))
        self._at = begin + size
        if self._at > len(self._data):
            raise NotCdrError("is too short")
        return struct.unpack_from(self._order + kind, self._data, begin)[0]

    def text(self) -> str:
        length = self.number("I")
        text = self._data[self._at : self._at + length]
        self._at += length
        name = _name(text) if text else ""  # without even the NUL, as some write it
        if name is None or len(text) < length:
            raise NotCdrError("has no text where one must be")
        return name

    def end(self) -> None:
        if len(self._data) - self._at > MOST_PADDING:
            raise NotCdrError("is too long")


def encode(stamp_ns: Integers, frame_id: str, values: Floats) -> list[bytes]:
    """Serialised messages with a header and doubles: stamps [ns], shape (n,), the frame, and values, shape (n, k)."""
    text = frame_id.encode() + b"\0"
    first = aligned(TEXT_AT + len(text), 8)
    data = np.zeros((len(stamp_ns), first + 8 * values.shape[1]), np.uint8)
    head = np.frombuffer(LITTLE_ENDIAN, np.uint8)
    data[:, : len(head)] = head
    seconds, nanoseconds = np.divmod(stamp_ns, NANOSECONDS)
    data[:, 4:8] = _bytes_of(seconds, "<i4")
    data[:, 8:12] = _bytes_of(nanoseconds, "<u4")
    data[:, 12:16] = _bytes_of(np.full(len(stamp_ns), len(text)), "<u4")
    data[:, TEXT_AT : TEXT_AT + len(text)] = np.frombuffer(text, np.uint8)
    data[:, first:] = np.ascontiguousarray(values, "<f8").view(np.uint8)
    whole, size = data.tobytes(), data.shape[1]
    return [whole[at : at + size] for at in range(0, len(whole), size)]


def _column(rows: Bytes, at: int, kind: str) -> Integers:
    return np.ascontiguousarray(rows[:, at : at + 4]).view(kind)[:, 0]


def _bytes_of(numbers: Integers, kind: str) -> Bytes:
    return np.ascontiguousarray(numbers.astype(kind)[:, None]).view(np.uint8)


def _names(texts: Bytes) -> tuple[NDArray[np.object_], NDArray[np.bool_]]:
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
