"""The records of MCAP files, also of one that has no end because its writer was killed or it was cut.

rosbags reads none of the latter, and takes several times as long for the others: it looks at every message twice.
"""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

MAGIC = b"\x89MCAP0\r\n"
_HEAD = struct.Struct("<BQ")
_MESSAGE_HEAD = struct.Struct("<HIQQ")
_FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK = 2, 3, 4, 5, 6


class DamagedError(Exception):
    """A file that has an end, but not all of what lies before it."""


def is_mcap(path: Path) -> bool:
    """Whether a file begins as MCAP."""
    with path.open("rb") as file:
        return file.read(len(MAGIC)) == MAGIC


def lacks_end(path: Path) -> bool:
    """Whether a file that begins as MCAP does not end as such."""
    with path.open("rb") as file:
        file.seek(max(file.seek(0, 2) - len(MAGIC), 1))
        return is_mcap(path) and file.read() != MAGIC


def scan(path: Path) -> Iterator[tuple[Any, int, bytes]]:
    """Connection (of rosbags, without a count), log time [ns] and bytes of each message, in the order in the file.

    Of a file without an end, of those in whole records. Raises DamagedError for another file in which one is not whole.
    """
    whole, connections = not lacks_end(path), _Connections()
    with path.open("rb") as file:
        size = file.seek(0, 2)
        file.seek(len(MAGIC))
        while len(head := file.read(_HEAD.size)) == _HEAD.size:
            kind, length = _HEAD.unpack(head)
            if length > size - file.tell():
                break
            data = file.read(length)
            if kind == _FOOTER:
                return
            yield from _messages_in(_unpacked(data) if kind == _CHUNK else head + data, connections)
    if whole:
        raise DamagedError("a record reaches beyond the end of the file")


def _messages_in(records: bytes, connections: "_Connections") -> Iterator[tuple[Any, int, bytes]]:
    """The messages in records that follow one another; what they say of connections is noted."""
    at, unpack_head, unpack_message = 0, _HEAD.unpack_from, _MESSAGE_HEAD.unpack_from
    while at < len(records):
        kind, length = unpack_head(records, at)
        begin = at + _HEAD.size
        end = begin + length
        if end > len(records):
            raise DamagedError("a record reaches beyond the end of its chunk")
        if kind == _MESSAGE:
            number, _, log_ns, _ = unpack_message(records, begin)
            if number in connections:
                yield connections[number], log_ns, records[begin + _MESSAGE_HEAD.size : end]
        elif kind == _SCHEMA:
            connections.note_schema(records[begin:end])
        elif kind == _CHANNEL:
            connections.note_channel(records[begin:end])
        at = end


class _Connections(dict[int, Any]):
    """By number of the channel, as the records of the file tell."""

    def __init__(self) -> None:
        super().__init__()
        self._schemas: dict[int, tuple[str, Any]] = {}

    def note_schema(self, data: bytes) -> None:
        from rosbags.interfaces import MessageDefinition, MessageDefinitionFormat

        (number,) = struct.unpack_from("<H", data)
        name, at = _text(data, 2)
        encoding, at = _text(data, at)
        definition, _ = _text(data, at)
        kind = MessageDefinitionFormat.MSG if encoding == "ros2msg" else MessageDefinitionFormat.IDL
        self._schemas[number] = name, MessageDefinition(kind, definition)

    def note_channel(self, data: bytes) -> None:
        from rosbags.interfaces import Connection, ConnectionExtRosbag2, MessageDefinition, MessageDefinitionFormat

        number, schema = struct.unpack_from("<HH", data)
        topic, at = _text(data, 4)
        encoding, _ = _text(data, at)
        name, definition = self._schemas.get(schema, ("", MessageDefinition(MessageDefinitionFormat.NONE, "")))
        extra = ConnectionExtRosbag2(encoding, [])
        self.setdefault(number, Connection(number, topic, name, definition, "", 0, extra, None))


def _unpacked(chunk: bytes) -> bytes:
    from rosbags.rosbag2.storage_mcap import decompress

    size, checksum = struct.unpack_from("<QI", chunk, 16)
    compression, at = _text(chunk, 28)
    return decompress(chunk[at + 8 :], compression, size, checksum)


def _text(data: bytes, at: int) -> tuple[str, int]:
    """The text whose length is at ``at``, and where it ends."""
    (length,) = struct.unpack_from("<I", data, at)
    end = at + 4 + length
    if end > len(data):
        raise DamagedError("a text reaches beyond the end of its record")
    return data[at + 4 : end].decode(), end
