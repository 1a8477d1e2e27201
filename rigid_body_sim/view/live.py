"""The panel of a running simulation: buttons for time, sliders for commands. What they do is somebody else's."""

import queue
from collections.abc import Callable
from functools import partial
from typing import Any, Protocol

from ..effects.actuators import UNITS, Actuator
from .look import Look
from .stage import Stage

PAUSE, GO_ON, STEP, RESET = "Pause", "Go on", "Step", "Reset"
TO_ACTUATORS, A_WRENCH = "Send to actuators", "Send a wrench"
ALL = "all"
_MOST_ACCELERATION = 10.0  # m/s² and rad/s²: of sliders where a scene limits no command
_AXES = "xyz"


class Controls(Protocol):
    """What the panel asks for, of whoever reaches the simulation. ``tell`` of the panel takes the answers."""

    def ask(self, what: str, body: str) -> None:
        """PAUSE, GO_ON, STEP or RESET, of a body or of ALL."""

    def send_wrench(self, body: str, force: tuple[float, ...], torque: tuple[float, ...]) -> None:
        """Command a force [N] and a torque [N m], body axes."""

    def send_actuators(self, body: str, values: tuple[float, ...]) -> None:
        """Command the actuators, in their order."""


Row = tuple[str, float, float]  # what a slider says, and from where to where it goes
Do = Callable[[Controls, tuple[float, ...]], None]


class Panel:
    """Buttons and sliders. Their callbacks run in threads of viser's; ``serve`` does what they ask in the caller's."""

    def __init__(self, stage: Stage):
        self._gui, self._asked = stage.server.gui, queue.SimpleQueue[tuple[str, str]]()
        self._buttons = self._gui.add_button_group("Time", (PAUSE, GO_ON, STEP, RESET))
        self._buttons.on_click(lambda event: self._asked.put((event.target.value, self._which())))
        self._body: Any = None
        self._answer = self._gui.add_markdown("")
        self._senders: list[Callable[[Controls], None]] = []
        self._names: list[str] = []

    def _which(self) -> str:
        return self._body.value if self._body is not None else ALL

    def add(self, name: str, look: Look) -> None:
        """The sliders of one more body."""
        self._names.append(name)
        if len(self._names) > 1:
            if self._body is not None:
                self._body.remove()
            self._body = self._gui.add_dropdown("Reset which", (ALL, *self._names))
        title = "Command" if len(self._names) == 1 else f"Command {name}"
        with self._gui.add_folder(title, expand_by_default=False):
            if look.actuators:
                self._add(TO_ACTUATORS, _actuator_rows(look.actuators), partial(_actuate, name))
            self._add(A_WRENCH, _wrench_rows(look), partial(_push, name))

    def _add(self, title: str, rows: list[Row], do: Do) -> None:
        self._senders.append(_Sliders(self._gui, title, rows, do).send)

    def tell(self, text: str) -> None:
        """Show the answer to what was asked."""
        self._answer.content = text

    def serve(self, controls: Controls) -> None:
        """Do what was asked since the last time, and send what the sliders say."""
        while not self._asked.empty():
            controls.ask(*self._asked.get())
        for send in self._senders:
            send(controls)


class _Sliders:
    """A row of sliders, whose values are sent while the box above is ticked, and zeros once when it no longer is."""

    def __init__(self, gui: Any, title: str, rows: list[Row], do: Do):
        self._do, self._was_on = do, False
        self._on = gui.add_checkbox(title, False)
        self._sliders = [
            gui.add_slider(text, least, most, (most - least) / 200.0, min(max(0.0, least), most))
            for text, least, most in rows
        ]
        zero = gui.add_button("All to zero")
        zero.on_click(lambda _: self._to_zero())

    def _to_zero(self) -> None:
        for slider in self._sliders:
            slider.value = min(max(0.0, slider.min), slider.max)

    def send(self, controls: Controls) -> None:
        """The values, where they are to be sent."""
        on = bool(self._on.value)
        if on:
            self._do(controls, tuple(float(slider.value) for slider in self._sliders))
        elif self._was_on:
            self._do(controls, (0.0,) * len(self._sliders))
        self._was_on = on


def _push(body: str, controls: Controls, values: tuple[float, ...]) -> None:
    controls.send_wrench(body, values[:3], values[3:])


def _actuate(body: str, controls: Controls, values: tuple[float, ...]) -> None:
    controls.send_actuators(body, values)


def _wrench_rows(look: Look) -> list[Row]:
    force = look.most_force or look.mass * max(_MOST_ACCELERATION, 2.0 * look.gravity)
    torque = look.most_torque or look.inertia * _MOST_ACCELERATION
    limits = [(f"Force {axis} [N]", force) for axis in _AXES] + [(f"Torque {axis} [N m]", torque) for axis in _AXES]
    return [(text, -rounded, rounded) for text, most in limits for rounded in [float(f"{most:.2g}")]]


def _actuator_rows(actuators: tuple[Actuator, ...]) -> list[Row]:
    rows = [(f"{one.name} [{UNITS[one.type]}]", one.min, one.max) for one in actuators]
    return [(text, least, most if most > least else least + 1.0) for text, least, most in rows]
