"""Commands that replace each other because they come in several frames on one topic."""

import math
from collections import deque
from collections.abc import Callable

from ..held import steps_held
from ..scene.loader import Scene

ENOUGH = 3  # changes of the frame, as by four commands of four rotors
WITHIN = 50  # commands, of which a controller in one frame sends the most, and a gust in another a few


class FrameTurns:
    """Notes the frames of the commands on one topic; when they take turns, ``warn`` gets a sentence, once.

    A change counts when the command before still acts, and others follow within a few commands: a controller that goes
    over to another frame stays there, and what two senders mix goes back and forth, however often each of them sends.
    """

    def __init__(self, scene: Scene, topic: str, warn: Callable[[str], object]):
        self._scene, self._topic, self._warn = scene, topic, warn
        timeout = scene["wrench.timeout"]
        self._held = steps_held(timeout, scene["rate"]) if timeout else math.inf
        self._bytes: bytes | None = None
        self._count = 0
        self._changes: deque[tuple[int, str, str]] = deque(maxlen=ENOUGH)  # at which command, from and to which frame
        self._told = False

    def note(self, frame: bytes, age: float) -> None:
        """A command came in a frame (the bytes of its name), ``age`` steps after the one before."""
        self._count += 1
        if frame != self._bytes:
            self._change(frame, age)

    def _change(self, frame: bytes, age: float) -> None:
        former, self._bytes = self._bytes, frame
        if former is None or self._told:
            return
        before, name = self._name(former), self._name(frame)
        if age >= self._held:
            self._changes.clear()
        elif name != before:
            self._changes.append((self._count, before, name))
            if len(self._changes) == ENOUGH and self._count - self._changes[0][0] < WITHIN:
                self._tell()

    def _tell(self) -> None:
        self._told = True
        names = dict.fromkeys(name for _, *names in self._changes for name in names)
        self._warn(
            f"commands on {self._topic} come in turn in the frames {', '.join(names)}: each replaces the one before, "
            "and the latest alone acts; where they are to add up, give each a topic of its own in wrench.topics"
        )

    def _name(self, frame: bytes) -> str:
        """The frame that is meant, by its name."""
        name = frame.rstrip(b"\x00").decode(errors="replace").removeprefix("/")
        usual = "body.frame_id" if self._scene["wrench.frame"] == "body" else "world_frame_id"
        return name or str(self._scene[usual])
