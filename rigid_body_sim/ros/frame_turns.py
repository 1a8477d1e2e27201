"""Commands that replace each other because they come in several frames on one topic."""

import math
from collections.abc import Callable

from ..scene.loader import Scene
from ..simulation import steps_held

ENOUGH = 3  # changes of the frame in a row: four commands, of four rotors say


class FrameTurns:
    """Notes the frames of the commands on one topic; when they take turns, ``warn`` gets a sentence, once.

    A change counts when the command before still acts, and the frame changes with every command: a controller that
    goes over to another frame stays there.
    """

    def __init__(self, scene: Scene, topic: str, warn: Callable[[str], None]):
        self._scene, self._topic, self._warn = scene, topic, warn
        timeout = scene["wrench.timeout"]
        self._held = steps_held(timeout, scene["rate"]) if timeout else math.inf
        self._bytes: bytes | None = None
        self._frames: list[str] = []
        self._told = False

    def note(self, frame: bytes, age: float) -> None:
        """A command came in a frame (the bytes of its name), ``age`` steps after the one before."""
        if frame != self._bytes:
            self._change(frame, age)
        elif self._frames:
            self._frames.clear()

    def _change(self, frame: bytes, age: float) -> None:
        former, self._bytes = self._bytes, frame
        if former is None:
            return
        before, name = self._name(former), self._name(frame)
        if age >= self._held or name == before:
            self._frames.clear()
            return
        self._frames = [*(self._frames or [before]), name]
        if len(self._frames) > ENOUGH and not self._told:
            self._told = True
            self._warn(
                f"commands on {self._topic} come in turn in the frames {', '.join(dict.fromkeys(self._frames))}: each "
                "replaces the one before, and the latest alone acts; where they are to add up, give each a topic of "
                "its own in wrench.topics"
            )

    def _name(self, frame: bytes) -> str:
        """The frame that is meant, by its name."""
        name = frame.rstrip(b"\x00").decode(errors="replace").removeprefix("/")
        usual = "body.frame_id" if self._scene["wrench.frame"] == "body" else "world_frame_id"
        return name or str(self._scene[usual])
