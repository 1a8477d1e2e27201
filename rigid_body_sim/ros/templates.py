"""Messages as bytes that are made once, so that to publish one costs a stamp and a few doubles packed among them.

A text in a message shifts what follows it (see messages.cdr), so a template holds for one set of frame names. Nothing
of this is taken on trust: a Template finds its offsets in what ``serialize_message`` gives, and reads back what it has
written.
"""

import struct
from collections.abc import Callable, Sequence
from functools import partial
from operator import setitem
from typing import Any

from rclpy.serialization import deserialize_message, serialize_message

from ..messages.cdr import DOUBLE, NANOSECONDS, STAMP

HEADER_STAMP = "header.stamp"

_MARK_NS = 0x1A2B3C4D * NANOSECONDS + 0x2C3D4E5


class LayoutError(Exception):
    """A message whose bytes are not laid out as a Template needs; the text says what was found."""


class Typed:
    """Writes a stamp and floats into the fields of a typed message.

    Parameters
    ----------
    message : ROS message
        It holds everything that stays the same, and is written into.
    fields : sequence of str
        Dotted names of the float64 fields in the order of the values; an entry of an array is named by its index.
    stamp : str
        Dotted name of the stamp (builtin_interfaces/Time).
    """

    def __init__(self, message: Any, fields: Sequence[str], stamp: str = HEADER_STAMP):
        self.message = message
        self._stamp = _follow(message, stamp)
        self._setters = [_setter(_follow(message, path), name) for path, _, name in (f.rpartition(".") for f in fields)]

    def write(self, stamp_ns: int, values: Sequence[float]) -> Any:
        """The message with this stamp [ns] and these values: what ``Publisher.publish`` takes."""
        self._stamp.sec, self._stamp.nanosec = divmod(stamp_ns, NANOSECONDS)
        for set_to, value in zip(self._setters, values, strict=True):
            set_to(value)
        return self.message


class Template:
    """The same as Typed, into the bytes of the message.

    Raises LayoutError when the stamp or a field cannot be found in the bytes as little-endian integers and doubles, or
    when what is written does not come back on deserialising.
    """

    def __init__(self, message: Any, fields: Sequence[str], stamp: str = HEADER_STAMP):
        typed = Typed(message, fields, stamp)
        # Multiples of an irrational number: all bytes of each are used, so none is found twice or by chance.
        marks = [2.0**0.5 * (i + 1) for i in range(len(fields))]
        try:
            self._data = bytes(serialize_message(typed.write(_MARK_NS, marks)))
        except Exception as reason:  # whatever a type support makes of it
            raise LayoutError(f"it cannot be serialised: {reason}") from None
        at = self._place(STAMP.pack(*divmod(_MARK_NS, NANOSECONDS)), stamp)
        places = [self._place(DOUBLE.pack(mark), field) for mark, field in zip(marks, fields, strict=True)]
        if [at, *places] != sorted([at, *places]):
            raise LayoutError("its bytes have the stamp and the fields in another order")
        # The stamp and the first run in one call, all of most messages: 0.54 µs for a pose, 0.86 if written in place.
        self._head = self._data[:at]
        (_, self._gap, self._first), *self._more = _runs(self._data, at + STAMP.size, places)
        count = self._first.stop
        self._pack = struct.Struct(f"<{at}siI{len(self._gap)}s{count}d").pack
        self._tail = self._data[places[-1] + DOUBLE.size if places else at + STAMP.size :]
        self._verify(typed, len(fields))

    def write(self, stamp_ns: int, values: Sequence[float]) -> bytes:
        """The serialised message with this stamp [ns] and these values: what ``Publisher.publish`` takes."""
        data = self._pack(self._head, *divmod(stamp_ns, NANOSECONDS), self._gap, *values[self._first])
        for pack, gap, part in self._more:
            data += pack(gap, *values[part])
        return data + self._tail

    def _place(self, mark: bytes, name: str) -> int:
        found = self._data.count(mark)
        if found != 1:
            raise LayoutError(f"{name} occurs {found} times in its bytes, as little-endian numbers; it must occur once")
        return self._data.index(mark)

    def _verify(self, typed: Typed, count: int) -> None:
        for stamp_ns, scale in ((1, -1e-300), (2**31 * NANOSECONDS - 1, 1e300), (0, 0.0)):
            values = [scale / (i + 3) for i in range(count)]
            try:
                back = deserialize_message(self.write(stamp_ns, values), type(typed.message))
            except Exception as reason:  # whatever a type support makes of it
                raise LayoutError(f"its bytes cannot be read back: {reason}") from None
            if back != typed.write(stamp_ns, values):
                raise LayoutError("what is read back from its bytes is not what was written")


def writer(message: Any, fields: Sequence[str], stamp: str = HEADER_STAMP) -> tuple[Template | Typed, str]:
    """A Template for the message, or where its layout forbids that a Typed and the reason (else empty)."""
    try:
        return Template(message, fields, stamp), ""
    except LayoutError as reason:
        return Typed(message, fields, stamp), str(reason)


def _follow(message: Any, path: str) -> Any:
    for name in filter(None, path.split(".")):
        message = message[int(name)] if name.isdigit() else getattr(message, name)
    return message


def _setter(target: Any, name: str) -> Callable[[float], None]:
    return partial(setitem, target, int(name)) if name.isdigit() else partial(setattr, target, name)


def _runs(data: bytes, begin: int, places: Sequence[int]) -> list[tuple[Any, bytes, slice]]:
    """(pack, gap, part) for each longest run of values, a part of them, side by side in ``data`` from ``begin`` on.

    The gap is what stays the same before them, and ``pack(gap, *values[part])`` makes both; at least one, of no values.
    """
    starts = [i for i, place in enumerate(places) if i == 0 or place != places[i - 1] + DOUBLE.size] or [0]
    runs = []
    for first, end in zip(starts, [*starts, len(places)][1:], strict=True):
        gap = data[begin : places[first]] if places else b""
        runs.append((struct.Struct(f"<{len(gap)}s{end - first}d").pack, gap, slice(first, end)))
        begin = places[end - 1] + DOUBLE.size if places else begin
    return runs
