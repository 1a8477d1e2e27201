"""Commands to actuators: what each may be, until when they hold, and what the actuators do now."""

import math
import struct
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from .effects.actuators import EFFECT as ACTUATORS
from .effects.actuators import Actuator
from .kernels import drive
from .kernels.arrays import Floats, Integers
from .kernels.model import DRIVE, MEMORY
from .values.parameter import shown


class ActuatorState(NamedTuple):
    """What an actuator does now.

    ``command`` within its limits [N, rad/s or N m]; ``speed`` of a rotor or wheel relative to the body [rad/s], else 0;
    ``effort``: force of a thruster [N], drag torque of a rotor, torque of a wheel's motor [N m].
    """

    command: float
    speed: float
    effort: float


class Actuation:
    """Commands to actuators, in their order, held until the step ``end``; None = for ever.

    ``limited`` counts the commands that had a number beyond a limit.
    """

    def __init__(self, actuators: Sequence[Actuator]):
        self.actuators, self.limited = tuple(actuators), 0
        self.commands: tuple[float, ...] = (0.0,) * len(self.actuators)
        self.end: int | None = None
        self._acting = [i for i, one in enumerate(self.actuators) if ACTUATORS.acts(one)]
        self._limits = [(one.min, one.max) for one in self.actuators]

    def of(self, actuators: Sequence[Actuator]) -> "Actuation":
        """The same of other actuators: held where they have the same names, else at rest."""
        other = Actuation(actuators)
        if [one.name for one in actuators] == [one.name for one in self.actuators]:
            other.commands, other.end = self.commands, self.end
        other.limited = self.limited
        return other

    def take(self, commands: Sequence[float], end: int | None) -> None:
        """Hold these from here on. Raises ValueError, and changes nothing, for a wrong number of them, or a bad one."""
        try:
            values, total = tuple(map(float, commands)), sum(commands)  # which texts have none of
        except (TypeError, ValueError, OverflowError):
            values, total = (), math.nan
        if len(values) != len(self._limits) or not math.isfinite(total) or isinstance(commands, bytes):
            values = self._checked(commands)
        self.commands, self.end = values, end
        for value, (least, most) in zip(values, self._limits, strict=True):
            if not least <= value <= most:
                self.limited += 1
                break

    def _checked(self, commands: Sequence[float]) -> tuple[float, ...]:
        """The commands. Raises ValueError for what is not as many finite numbers as there are actuators."""
        refused, count = f"actuator commands {shown(commands)} refused", len(self._limits)
        names = ", ".join(one.name for one in self.actuators)
        wanted = f"give {count} numbers, for {names}" if count else "there are no actuators"
        if isinstance(commands, str | bytes):
            raise ValueError(f"{refused}: they are no numbers; {wanted}")
        try:
            values = tuple(math.nan if isinstance(value, str | bytes) else float(value) for value in commands)
        except OverflowError:
            raise ValueError(f"{refused}: not all are finite; {wanted}") from None
        except (TypeError, ValueError):
            raise ValueError(f"{refused}: they are no numbers; {wanted}") from None
        if len(values) != count:
            raise ValueError(f"{refused}: they are {len(values)} numbers; {wanted}")
        if not all(map(math.isfinite, values)):
            raise ValueError(f"{refused}: not all are finite; {wanted}")
        return values

    def rest(self) -> None:
        """Hold all at 0, for ever."""
        self.commands, self.end = (0.0,) * len(self.actuators), None

    @property
    def within(self) -> list[float]:
        """The commands within their limits."""
        pairs = zip(self.commands, self._limits, strict=True)
        return [least if value < least else most if value > most else value for value, (least, most) in pairs]

    def writer(self, model: Floats) -> Callable[[Sequence[float]], None]:
        """What lets a model have commands within their limits."""
        if not self._acting:
            return lambda within: None
        pack = partial(struct.Struct(f"{len(self._acting)}d").pack_into, model.data.cast("B"), 8 * int(model[MEMORY]))
        if len(self._acting) == len(self.actuators):
            return lambda within: pack(*within)
        return lambda within: pack(*(within[i] for i in self._acting))

    def states(self, model: Floats, w_body: Sequence[float]) -> tuple[ActuatorState, ...]:
        """What each does now, on a body that turns with ``w_body`` [rad/s].

        One without lag and delay does what it is commanded now, as it will when a step begins.
        """
        within = self.within
        levels, spins = within.copy(), [0.0] * len(self.actuators)
        if self._acting:
            memory, count = int(model[MEMORY]), int(model[int(model[DRIVE]) + drive.COUNT])
            for k, i in enumerate(self._acting):
                offset, late = model[memory + drive.OFFSETS * count + k], model[memory + drive.LENGTHS * count + k]
                if self.actuators[i].time_constant > 0.0 or offset or late:
                    levels[i] = float(model[memory + drive.LEVELS * count + k])
                spins[i] = float(model[memory + drive.SPINS * count + k])
        each = zip(self.actuators, within, levels, spins, strict=True)
        return tuple(_state(*one, w_body) for one in each)


def write_commands(actuators: Sequence[Actuator], models: Floats, which: Integers, commands: Floats) -> None:
    """Let models (rows ``which``, all of bodies with these actuators) have their rows of commands, within limits."""
    acting = [i for i, one in enumerate(actuators) if ACTUATORS.acts(one)]
    least, most = ([getattr(actuators[i], limit) for i in acting] for limit in ("min", "max"))
    at = models[which, MEMORY].astype(int)[:, None] + np.arange(len(acting))
    models[which[:, None], at] = np.clip(commands[which[:, None], acting], least, most)


def commands_in(actuators: Sequence[Actuator], model: Floats) -> tuple[float, ...]:
    """The commands that a model holds; 0 for an actuator that does nothing."""
    held = iter(model[int(model[MEMORY]) :].tolist())
    return tuple(next(held) if ACTUATORS.acts(one) else 0.0 for one in actuators)


def _state(one: Actuator, command: float, level: float, spin: float, w_body: Sequence[float]) -> ActuatorState:
    if one.type == "thruster":
        return ActuatorState(command, 0.0, level)
    if one.type == "rotor":
        return ActuatorState(command, level, one.torque_coefficient * level * level)
    along = sum(a * w for a, w in zip(one.axis, w_body, strict=True)) / math.hypot(*one.axis)
    return ActuatorState(command, spin / one.inertia - along, level)
