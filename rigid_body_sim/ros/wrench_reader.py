"""Wrench commands from the bytes that the middleware delivers."""

from geometry_msgs.msg import WrenchStamped

from .. import commands
from ..messages import cdr
from ..scene.loader import Scene
from ..values.wrench import Wrench
from . import messages


class WrenchReader:
    """Reads serialised WrenchStamped messages, as a subscription with ``raw=True`` gives them.

    What a frame means is worked out once for each name. Bytes that are not laid out as usual (another encoding, say)
    are left to ``deserialize_message``, as with an ordinary subscription, and so is the verdict on bad ones. ``what``
    they carry is how messages about refusals call it; ``limit`` is applied to each force and torque.
    """

    def __init__(self, scene: Scene, what: str = "wrench", limit: commands.Limit = commands.unlimited):
        self._scene, self._what, self._limit = scene, what, limit
        self.frame = b""  # of the latest command, as bytes that end with a NUL
        self._meanings: dict[bytes, commands.Meaning] = {}  # by the bytes of a known frame: a few, whatever is sent

    def read(self, data: bytes) -> Wrench:
        """The wrench that the bytes mean. Raises RefusedError when it cannot be accepted."""
        parts = cdr.split_wrench(data)
        if parts is None:
            return self._read_slowly(data)
        frame, numbers = parts
        meaning = self._meanings.get(frame)
        if meaning is None:
            if frame.find(0) != len(frame) - 1:  # not one text that ends with a NUL, nor nothing at all
                return self._read_slowly(data)
            try:
                frame_id = frame[:-1].decode()
            except UnicodeDecodeError:
                return self._read_slowly(data)
            meaning = self._meanings[frame] = commands.meaning(frame_id, self._scene, self._what)
        self.frame = frame
        return commands.make_wrench(meaning, numbers[:3], numbers[3:], self._what, self._limit)

    def _read_slowly(self, data: bytes) -> Wrench:
        message = messages.deserialised(data, WrenchStamped, self._what)
        self.frame = message.header.frame_id.encode() + b"\x00"
        return messages.read_wrench(message, self._scene, self._what, self._limit)
