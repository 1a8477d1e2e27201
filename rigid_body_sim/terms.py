"""What the equations of motion are made of, the held wrench apart: a body, gravity, and the effects that act on it."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any

import numpy as np

from .effects import REGISTRY
from .effects.base import (
    DriveEffect,
    KernelEffect,
    Lever,
    MediumEffect,
    SeriesEffect,
    TransformEffect,
    together,
)
from .kernels.arrays import Floats, Vector, python_floats, zeros_on_a_line
from .kernels.drive import NO_DRIVE
from .kernels.model import (
    CENTER_OF_MASS,
    DIFFERENCES,
    DRIVE,
    EULER,
    FASTEST,
    GRAVITY,
    GYRO,
    INVERSE,
    LEVERS,
    LOADS,
    MASS,
    MEMORY,
    MOMENT_ROW,
    MOMENTS,
    MOST_MOMENTUM,
    N_LEVERS,
    Q_BODY_PRINCIPAL,
    RTOL,
    SAFE_ANGULAR_MOMENTUM,
    WRENCH,
)
from .kernels.motion import Acting
from .kernels.wrench import write_arms
from .values.body import Body
from .values.wrench import ZERO, Wrench, three_finite

DEFAULT_RTOL = 1e-9
NO_MEMORY = np.zeros(0)
_LOADS = [effect for effect in REGISTRY.values() if isinstance(effect, KernelEffect)]
_SERIES = [effect for effect in REGISTRY.values() if isinstance(effect, SeriesEffect)]
_DRIVES = [effect for effect in REGISTRY.values() if isinstance(effect, DriveEffect)]
_BEGINS, _MEMORIES = (slice(LOADS + at, LOADS + 3 * len(_LOADS), 3) for at in (1, 2))
_MEDIA = [effect for effect in REGISTRY.values() if isinstance(effect, MediumEffect)]


@dataclass(frozen=True, init=False)
class Terms:
    """A body and all that acts on it without being sent.

    ``gravity``: acceleration of free fall [m/s²], world axes. ``rtol``: relative error that an error-controlled
    integrator may make in a step. The effects are given by their names in the registry, ``drag=Drag(...)`` for one.
    Raises ValueError for a value that is not finite or not in range, and TypeError for an effect that is not known.
    """

    body: Body
    gravity: tuple[float, float, float]
    rtol: float
    given: dict[str, Any]  # by effect, what a user gave
    acting: dict[str, tuple[Any, ...]] = field(compare=False)  # by effect, each one that acts

    def __init__(self, body: Body, gravity: Vector = ZERO, rtol: float = DEFAULT_RTOL, **given: Any):
        if unknown := given.keys() - REGISTRY.keys():
            raise TypeError(f"{', '.join(sorted(unknown))}: not a term; there are gravity, rtol, {', '.join(REGISTRY)}")
        if not 1e-13 <= float(rtol) <= 1.0:
            raise ValueError(f"rtol {float(rtol):g} is not between 1e-13 and 1; try 1e-9")
        kept = {name: effect.checked(given.get(name, effect.absent)) for name, effect in REGISTRY.items()}
        object.__setattr__(self, "body", body)
        object.__setattr__(self, "gravity", three_finite(gravity, "gravity"))
        object.__setattr__(self, "rtol", float(rtol))
        object.__setattr__(self, "given", kept)
        object.__setattr__(self, "acting", {name: REGISTRY[name].acting(one) for name, one in kept.items()})

    def __reduce__(self) -> tuple[Any, ...]:
        """For pickle: what was given; kernels are made anew."""
        return partial(Terms, self.body, **self.optional()), ()

    def changed(self, **terms: Any) -> "Terms":
        """The same with other terms, by the names that the constructor has for them. Raises as that does."""
        return Terms(**{"body": self.body, **self.optional(), **terms})

    def optional(self) -> dict[str, Any]:
        """All but the body, by the names that the constructor of a Simulation has for them."""
        return {"gravity": self.gravity, "rtol": self.rtol, **self.given}

    def dynamic(self) -> dict[str, Any]:
        """What may be changed while the node runs, by the same names."""
        effects = {name: given for name, given in self.given.items() if REGISTRY[name].dynamic}
        return {"body": self.body, "gravity": self.gravity, **effects}

    @cached_property
    def loads(self) -> tuple[str, ...]:
        """Names of the loads and transforms that act, which need error control."""
        return tuple(effect.name for effect in _LOADS if self.acting[effect.name] and effect not in _MEDIA)

    @cached_property
    def _by_kernels(self) -> dict[str, tuple[Any, ...]]:
        """Those of each effect that act by kernels of their own; a medium does where something feels it."""
        return {
            effect.name: tuple(one for one in self.acting[effect.name] if effect.by_kernels(one)) if self.loads else ()
            for effect in _LOADS
        }

    @cached_property
    def remembering(self) -> tuple[str, ...]:
        """Names of the effects of which something goes on from step to step."""
        drive = (self._drive.name,) if self._drive else ()
        return (*drive, *(effect.name for effect in _LOADS if effect.memory_size and self._by_kernels[effect.name]))

    @cached_property
    def kernels(self) -> Acting:
        """The kernels of the effects that act by some, and of actuators."""
        effects = tuple((k, effect) for k, effect in enumerate(_LOADS) if self._by_kernels[effect.name])
        return together(effects, self._drive.drive if self._drive else NO_DRIVE)

    @cached_property
    def _drive(self) -> DriveEffect | None:
        return next((effect for effect in _DRIVES if self.acting[effect.name]), None)

    @property
    def actuated(self) -> bool:
        """Whether there are actuators."""
        return self._drive is not None

    @property
    def bare(self) -> "Terms":
        """The body, and how it answers to what acts, but nothing that does."""
        transforms = {effect.name: self.given[effect.name] for effect in _LOADS if isinstance(effect, TransformEffect)}
        return Terms(self.body, **transforms)

    @cached_property
    def levers(self) -> tuple[Lever, ...]:
        """Those of all effects that are series."""
        return tuple(
            lever for effect in _SERIES for one in self.acting[effect.name] for lever in effect.levers(one, self.body)
        )

    @property
    def driven(self) -> bool:
        """Whether something acts that may speed the body up, as no drag does in a fluid at rest."""
        effects = [REGISTRY[name] for name in self.loads]
        carried = any(self.acting[effect.name] for effect in _MEDIA)
        return any(carried or effect.energy is not None or not effect.dissipates for effect in effects)

    @property
    def turning(self) -> bool:
        """Whether a lever acts that may turn the body: a force beside the centre of mass, or a couple."""
        return any(lever.turns(self.body) for lever in self.levers)

    def turned_by(self, wrench: Wrench) -> bool:
        """Whether a torque may act, or a force that turns with the body."""
        return wrench.turns or self.turning or self.actuated

    @property
    def left_out(self) -> list[str]:
        """Words for the effects that do not act: series, then what acts by kernels, then drives."""
        return [one.left_out for one in (*_SERIES, *_LOADS, *_DRIVES) if not self.acting[one.name]]

    def memory(self, h: float, before: "Terms | None" = None, kept: Floats = NO_MEMORY) -> Floats:
        """What goes on from step to step of h [s]: of actuators, then of loads.

        As it is at the start, or where an effect is as ``before``, but for what may change while the node runs, as in
        ``kept``, the memory of the terms before.
        """
        fresh, at = self._memories(h), 0
        if before is not None:
            for name, old in before._memories(h).items():
                if name in fresh and self._fixed(name) == before._fixed(name):
                    fresh[name] = kept[at : at + len(old)]
                at += len(old)
        return np.concatenate((*fresh.values(), ()))

    def _memories(self, h: float) -> dict[str, Floats]:
        """By effect, as they are at the start."""
        return {name: self._memory_of(REGISTRY[name], h) for name in self.remembering}

    def _memory_of(self, effect: Any, h: float) -> Floats:
        if isinstance(effect, DriveEffect):
            return effect.memory(self.acting[effect.name], h)
        return np.concatenate([effect.memory(one, self.body, h) for one in self._by_kernels[effect.name]])

    def remembers(self, h: float) -> tuple[Any, ...]:
        """What memory is of, for steps of h [s]: where that is the same, it fits. Empty where there is none."""
        return (h, *self._remembered) if self._remembered else ()

    @cached_property
    def _remembered(self) -> tuple[Any, ...]:
        return tuple((name, *self._fixed(name)) for name in self.remembering)

    def _fixed(self, name: str) -> list[tuple[Any, ...]]:
        return [REGISTRY[name].fixed(one) for one in self.acting[name]]

    def model(self, wrench: Wrench, memory: Floats = NO_MEMORY) -> Floats:
        """The kernels' view of all this, a held wrench, and what goes on from step to step: see kernels.model."""
        levers = [*(Lever(*point) for point in wrench.points), *self.levers]
        rows = [number for arm, vector, is_force in levers for number in (*arm, *vector, float(is_force))]
        loads, drive, begin = self._load_rows, self._drive_row, LEVERS + len(rows)
        at = begin + len(loads)
        at += -at % 8 if self._drive else 0
        end = at + len(drive)
        model = zeros_on_a_line(end + len(memory))
        model[:LEVERS], model[LEVERS:begin], model[begin : begin + len(loads)] = self._header, rows, loads
        model[at:end], model[end:] = drive, memory
        model[WRENCH : WRENCH + 12] = wrench.values
        model[N_LEVERS], model[MEMORY] = len(levers), end
        model[_BEGINS] += begin
        model[_MEMORIES] += len(model)
        write_arms(model)
        self.write_media(model)
        if self._drive and len(memory):
            model[DRIVE] = at
            self._drive.drive.settle(python_floats(model))
        return model

    def is_another_flow(self, before: "Terms", changed: Iterable[str]) -> bool:
        """Whether a model of the terms before needs but other numbers of media, where these effects were changed."""
        return self.kernels is before.kernels and all(
            isinstance(effect := REGISTRY.get(name), MediumEffect)
            and effect.fixed(self.given[name]) == effect.fixed(before.given[name])
            for name in changed
        )

    def write_media(self, model: Floats) -> None:
        """Write the numbers of the media into a model that holds everything else."""
        for medium in _MEDIA:
            one, slot = self.given[medium.name], LOADS + 3 * _LOADS.index(medium)
            numbers, place = medium.numbers(one), medium.place
            model[place] = place + 1
            model[place + 1 : place + 1 + len(numbers)] = numbers
            if model[slot] and model[MEMORY] < len(model):
                at, memory = int(model[slot + 1]), int(model[slot + 2])
                model[place], model[at : at + medium.size] = memory, medium.row(one, self.body)
                medium.show(python_floats(model), at, memory)

    @cached_property
    def _header(self) -> Floats:
        """All of the model that stays while wrenches come and go, up to where the levers begin."""
        body, model = self.body, np.zeros(LEVERS)
        model[MASS] = body.mass
        model[MOMENTS : MOMENTS + 3] = body.principal_moments
        model[Q_BODY_PRINCIPAL : Q_BODY_PRINCIPAL + 4] = body.q_body_principal
        model[CENTER_OF_MASS : CENTER_OF_MASS + 3] = body.center_of_mass
        model[GRAVITY : GRAVITY + 3] = self.gravity
        model[RTOL] = self.rtol
        x, y, z = map(float, body.principal_moments)
        differences = y - z, z - x, x - y
        model[EULER : EULER + 3] = differences[0] / x, differences[1] / y, differences[2] / z
        for lane, axis in enumerate((0, 1, 2, 0)):
            moment = body.principal_moments[axis]
            model[DIFFERENCES + lane], model[MOMENT_ROW + lane] = 2.0 * differences[axis], moment
            model[GYRO + lane], model[INVERSE + lane] = 2.0 * model[EULER + axis], 1.0 / moment
        self._set_places(model)
        model[MOST_MOMENTUM] = FASTEST * body.mass
        model[SAFE_ANGULAR_MOMENTUM] = FASTEST * min(x, y, z) / (1.0 + math.hypot(*body.center_of_mass))
        return model

    def _set_places(self, model: Floats) -> None:
        """Of each kind of load: how many, where they begin after the levers, and their memory before the end."""
        begin = end = 0
        for number, effect in enumerate(_LOADS):
            count = len(self._rows_of[effect.name])
            model[LOADS + 3 * number], model[LOADS + 3 * number + 1] = count // effect.size, begin
            begin += count
        for number, effect in reversed(list(enumerate(_LOADS))):
            end -= effect.memory_size * len(self._by_kernels[effect.name])
            model[LOADS + 3 * number + 2] = end

    @cached_property
    def _drive_row(self) -> Floats:
        return self._drive.row(self.acting[self._drive.name], self.body) if self._drive else NO_MEMORY

    @cached_property
    def _load_rows(self) -> Floats:
        return np.concatenate([NO_MEMORY, *self._rows_of.values()])

    @cached_property
    def _rows_of(self) -> dict[str, Floats]:
        """The numbers of each kind of load, and of whatever else has kernels."""
        rows = {effect.name: [effect.row(one, self.body) for one in self._by_kernels[effect.name]] for effect in _LOADS}
        return {name: np.concatenate([NO_MEMORY, *map(np.ravel, each)]) for name, each in rows.items()}
