"""What an effect is: what acts on a body beside a held wrench, described so that everything else follows from it.

An effect is a *series*: forces and couples whose vectors are fixed in the world and whose arms are fixed in the body,
which are polynomial in the attitude, so that a step stays exact to round-off. Or it is a *load*, a function of the
motion with its exact Jacobian, for which ``auto`` takes a method that controls its error. Or it is a *drive*, what
actuators do in body axes as a function of time alone, which leaves a step exact too. Or a *transform*, which makes of
all that acts what the body's own momenta change by. Or a *medium*, which is what loads and transforms depend on.
"""

import dataclasses
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from ..kernels.arrays import Floats, Vector
from ..kernels.compiled import kernel
from ..kernels.drive import NO_DRIVE, Drive
from ..kernels.model import LOADS
from ..kernels.motion import Acting, Passed, held_load
from ..kernels.tuples import Load, Motion, Quat, added
from ..values.body import Body
from ..values.parameter import OPEN, Parameter, dotted
from ..values.state import Motions


class Lever(NamedTuple):
    """A vector fixed in the world that acts on an arm fixed in the body.

    As a force: the vector [N] at a point ``arm`` [m, body axes from the body frame's origin]. As a couple: the torque
    arm × vector alone [N m], whatever their units.
    """

    arm: Sequence[float]
    vector: Sequence[float]
    is_force: bool = True

    def turns(self, body: Body) -> bool:
        """Whether it may turn the body."""
        return any(self.vector) and not (self.is_force and tuple(self.arm) == tuple(body.center_of_mass.tolist()))


@kernel
def _smooth(model: Floats, at: int, state: Floats, work: Floats, z: int) -> bool:
    return False


@kernel
def _calm(model: Floats, at: int, state: Floats, h: float) -> float:
    return 0.0


@kernel
def _settled(model: Floats, at: int, body: Motion) -> None:
    return


@kernel
def _never(model: Floats, at: int, before: Motion, after: Motion, h: float) -> Passed:
    return Passed(-1.0, 1.0)


@kernel
def _lasting(model: Floats, at: int, memory: int, h: float) -> None:
    return


def _no_memory(one: Any, body: Body, h: float) -> Floats:
    return np.zeros(0)


@dataclass(frozen=True, eq=False, kw_only=True)
class Effect:
    """Descriptor of one effect: series, load, drive, transform or medium; see docs/how-to/adding_an_effect.md.

    ``make`` makes one of it from its parameters, by the names of ``fields``: a dataclass or a NamedTuple. ``zero`` is
    one without any strength, ``example`` one that acts in all ways it can: the contract tests take them, and what is
    ``beside`` it where it acts only through others. With ``many`` a scene may have any number, each with a name of its
    own; else a parameter ``group.<name>.field`` is of a field ``group`` that is a sequence. ``world`` names the fields
    that are vectors of the world. ``energy(one, body, state)`` is its potential energy [J], of one state or of many
    (see values.state.Motions), ``kinetic(one, body, state, u)`` the kinetic energy of what it moves along in a fluid of
    the velocity u [m/s, world]; with ``dissipates`` it takes energy out, of these and of the motion.
    """

    name: str  # the keyword of Simulation
    make: Callable[..., Any]
    zero: Any
    example: Any
    parameters: tuple[Parameter, ...]
    left_out: str  # what the plan says a scene without it leaves out
    group: str = ""  # of its parameters, where that is not the name
    many: bool = False
    order: str = ""  # of many: the parameter that has their names, each the field ``name`` of one
    check: Callable[[Any], Any] | None = None  # of what a user gave, where other forms are taken
    acts: Callable[[Any], bool] = lambda one: True
    world: tuple[str, ...] = ()
    energy: Callable[[Any, Body, Motions], Any] | None = None
    kinetic: Callable[[Any, Body, Motions, Vector], Any] | None = None
    dissipates: bool = False
    beside: Mapping[str, Any] = dataclasses.field(default_factory=dict)

    @property
    def dynamic(self) -> bool:
        """Whether it may be changed while the node runs."""
        return any(parameter.dynamic for parameter in self.parameters)

    @property
    def groups(self) -> tuple[str, ...]:
        """Of one that is not ``many``: the fields that are sequences, one for each name of the user's in a group."""
        opened = (parameter.name.split(OPEN)[0] for parameter in self.parameters if OPEN in parameter.name)
        return () if self.many else tuple(opened)

    @property
    def fields(self) -> dict[str, str]:
        """Name of the parameter of each field of what users write: ``fluid.gust.seed`` of ``gust_seed``, say."""
        names = [parameter.name for parameter in self.parameters if parameter.name != self.order]
        return {self._field(name): name for name in names}

    def _field(self, name: str) -> str:
        first = name.split(".")[0]
        begin = f"{self.group or self.name}." + "<name>." * self.many
        return first if first in self.groups else name.removeprefix(begin).replace(".", "_")

    @property
    def absent(self) -> Any:
        """What a user gives who wants none of it."""
        return () if self.many else self.zero

    @property
    def present(self) -> Any:
        """What a user gives who wants one like the example."""
        return (self.example,) if self.many else self.example

    def checked(self, given: Any) -> Any:
        """What a user gave, as it is kept. Raises ValueError for what cannot be, TypeError for what is none of it."""
        if self.check is not None:
            return self.check(given)
        try:
            ones = tuple(given) if self.many else (given,)
        except TypeError:
            ones = (given,)
        for one in ones:
            if not isinstance(one, type(self.example)):
                kind = type(self.example).__name__
                raise TypeError(f"{self.name}: {one!r} is no {kind}; give {'a sequence of ' * self.many}{kind}")
        return ones if self.many else given

    def acting(self, given: Any) -> tuple[Any, ...]:
        """Those of it that act."""
        return tuple(one for one in (given if self.many else (given,)) if self.acts(one))

    def fixed(self, one: Any) -> tuple[Any, ...]:
        """What of one cannot be changed while the node runs: where that is the same, what it remembers stays."""
        dynamic = {row.name for row in self.parameters if row.dynamic}
        lasting = (field for field, name in self.fields.items() if name not in dynamic)
        return tuple(getattr(one, field, None) for field in ("name", *lasting))

    def restored(self, plain: Any) -> Any:
        """What was given, from what JSON made of it: a dataclass became an object, a NamedTuple a list."""

        def made(one: Any) -> Any:
            return self.make(**one) if isinstance(one, dict) else self.make(*one)

        return tuple(map(made, plain)) if self.many else made(plain)

    def read(self, values: Mapping[str, Any], members: Callable[[str], Sequence[str]]) -> Any:
        """What parameters of a scene describe; ``members(group)``: names of the user's in a group, in order."""
        if self.many:
            return tuple(self._made(values, member) for member in self._in_order(values, members(self.name)))
        made = {}
        for field, name in self.fields.items():
            places = [name.replace("<name>", one) for one in members(field)] if field in self.groups else []
            made[field] = tuple(values[place] for place in places) if field in self.groups else values[name]
        return self.make(**made)

    def _made(self, values: Mapping[str, Any], member: str) -> Any:
        """One of many."""
        name = {"name": member} if self.order else {}
        return self.make(**name, **{f: values[at.replace("<name>", member)] for f, at in self.fields.items()})

    def _in_order(self, values: Mapping[str, Any], members: Sequence[str]) -> Sequence[str]:
        """The members as ``order`` has them. Raises ValueError for one that is in one of the two alone."""
        if not self.order:
            return members
        names: Sequence[str] = values[self.order]
        for name in names:
            if "." in name:
                raise ValueError(f"parameter {self.order} = {list(names)}: {dotted(name)}")
        for member in members:
            if member not in names:
                raise ValueError(f"parameter {self.order} = {list(names)}: lacks {member}, whose parameters are given")
        for name in names:
            if name not in members:
                raise ValueError(
                    f"parameter {self.order} = {list(names)}: {name} has no parameters; give {self.name}.{name}.type"
                )
        return names


@dataclass(frozen=True, eq=False, kw_only=True)
class SeriesEffect(Effect):
    """An effect that is the sum of ``levers(one, body)``."""

    levers: Callable[[Any, Body], Iterable[Lever]]


@dataclass(frozen=True, eq=False, kw_only=True)
class KernelEffect(Effect):
    """An effect by kernels; ``row(one, body)`` are its ``size`` numbers in the model, which begin at ``model[at]``.

    Of what is several loads in one they are several rows, shape (n, size).

    A load that begins and ends to act has *events*. ``settle(model, at, body)`` notes in its row whether it acts, from
    the motion at the beginning of a sub-step; until it is settled again that stays, so that it is smooth, and
    ``passed(model, at, before, after, h)`` tells whether it should have changed in between (see kernels.motion.Passed):
    the sub-step is then ended there.
    ``memory(one, body, h)`` are numbers that go on from step to step of h [s], as they are at the start, of which
    ``memory_size`` says how many; ``advance(model, at, memory, h)`` lets a step pass for those from model[memory] on.
    """

    size: int
    row: Callable[[Any, Body], Floats]
    memory_size: int = 0
    memory: Callable[[Any, Body, float], Floats] = _no_memory
    advance: Callable[[Floats, int, int, float], None] = _lasting

    def by_kernels(self, one: Any) -> bool:
        """Whether one that acts does so by kernels of its own."""
        return True


@dataclass(frozen=True, eq=False, kw_only=True)
class MediumEffect(KernelEffect):
    """An effect that acts through loads and transforms alone, which find its ``numbers(one)`` where model[place] says.

    They lie next to it. Where it ``stirs(one)``, they change from step to step: then its memory begins with them, and
    ``show(model, at, memory)`` works them out from the rest of it where no step passes.
    """

    place: int
    numbers: Callable[[Any], Vector]
    stirs: Callable[[Any], bool]
    show: Callable[[Floats, int, int], None]

    def by_kernels(self, one: Any) -> bool:
        """Whether it stirs."""
        return self.stirs(one)


@dataclass(frozen=True, eq=False, kw_only=True)
class TransformEffect(KernelEffect):
    """An effect on the answer of the body to all that acts, which a scene has once at most.

    ``load(model, at, body, load)`` makes of the sum of all else the force and torque by which the body's own momenta
    change. ``jacobian(model, at, body, load, out, o)`` makes of the whole Jacobian of the others (see
    kernels.motion.jacobian) that of what comes of them; ``load`` is again their sum.
    """

    load: Callable[[Floats, int, Motion, Load], Load]
    jacobian: Callable[[Floats, int, Motion, Load, Floats, int], None]


@dataclass(frozen=True, eq=False, kw_only=True)
class LoadEffect(KernelEffect):
    """An effect that is a function of the motion, by kernels.

    ``load(model, at, body)`` is its force and torque; ``add_jacobian(model, at, body, taut, out, o)`` adds their exact
    derivatives (see rows), with ``taut`` those of a load that does not act now and may later.
    ``passes_kink(model, at, state, work, z)`` says whether a kink lies within the increments work[z:z + 12] (see
    integrators.substep), and ``ringing(model, at, state, h)`` is ω² [1/s²] of what it makes vibrate throughout a step.
    """

    load: Callable[[Floats, int, Motion], Load]
    add_jacobian: Callable[[Floats, int, Motion, bool, Floats, int], None]
    passes_kink: Callable[[Floats, int, Floats, Floats, int], bool] = _smooth
    ringing: Callable[[Floats, int, Floats, float], float] = _calm
    settle: Callable[[Floats, int, Motion], None] = _settled
    passed: Callable[[Floats, int, Motion, Motion, float], Passed] = _never


@dataclass(frozen=True, eq=False, kw_only=True)
class DriveEffect(Effect):
    """What actuators do, by the kernels of kernels.drive; a scene has one kind at most.

    ``row(all_of_it, body)`` are their numbers in the model, ``memory(all_of_it, h)`` what goes on from step to step of
    h [s], as it is at the start.
    """

    drive: Drive
    row: Callable[[tuple[Any, ...], Body], Floats]
    memory: Callable[[tuple[Any, ...], float], Floats]


@kernel
def _no_load(model: Floats, body: Motion, load: Load) -> Load:
    return load


@kernel
def _no_jacobian(model: Floats, body: Motion, taut: bool, out: Floats, o: int) -> None:
    return


@kernel
def _no_kink(model: Floats, state: Floats, work: Floats, z: int) -> bool:
    return False


@kernel
def _no_ringing(model: Floats, state: Floats, h: float) -> float:
    return 0.0


@kernel
def _nothing_settled(model: Floats, body: Motion) -> None:
    return


@kernel
def _no_event(model: Floats, before: Motion, after: Motion, h: float) -> Passed:
    return Passed(-1.0, 1.0)


@kernel
def _no_memories(model: Floats, h: float) -> None:
    return


@kernel
def _no_transform_jacobian(model: Floats, q: Quat, body: Motion, out: Floats, o: int) -> None:
    return


NOTHING_ACTS = Acting(
    _no_load,
    _no_jacobian,
    _no_kink,
    _no_ringing,
    _nothing_settled,
    _no_event,
    _no_memories,
    NO_DRIVE,
    _no_load,
    _no_transform_jacobian,
)


@cache
def together(effects: tuple[tuple[int, KernelEffect], ...], drive: Drive = NO_DRIVE) -> Acting:
    """The kernels of all these, each with its number in the registry, which says where the model tells of it."""
    acting = NOTHING_ACTS if drive is NO_DRIVE else NOTHING_ACTS._replace(drive=drive)
    for number, one in effects:
        if isinstance(one, LoadEffect):
            acting = _and(acting, one, LOADS + 3 * number)
        elif one.memory_size:
            acting = acting._replace(advance=_advancing(acting, one, LOADS + 3 * number))
    for number, one in effects:
        if isinstance(one, TransformEffect):
            acting = _transformed(acting, one, LOADS + 3 * number)
    return acting


@cache
def _and(others: Acting, one: LoadEffect, slot: int) -> Acting:
    """The others, then each of one kind: ``model[slot]`` of them from ``model[slot + 1]`` on; then where memory is."""
    load_of, jacobian_of, kink_of, ringing_of, size = one.load, one.add_jacobian, one.passes_kink, one.ringing, one.size
    load_others, jacobian_others, kink_others, ringing_others, *_ = others
    settle_of, passed_of, settle_others, passed_others = one.settle, one.passed, others.settle, others.passed

    @kernel
    def add_load(model: Floats, body: Motion, load: Load) -> Load:
        load = load_others(model, body, load)
        for i in range(int(model[slot])):
            load = added(load, load_of(model, int(model[slot + 1]) + size * i, body))
        return load

    @kernel
    def add_jacobian(model: Floats, body: Motion, taut: bool, out: Floats, o: int) -> None:
        jacobian_others(model, body, taut, out, o)
        for i in range(int(model[slot])):
            jacobian_of(model, int(model[slot + 1]) + size * i, body, taut, out, o)

    @kernel
    def passes_kink(model: Floats, state: Floats, work: Floats, z: int) -> bool:
        for i in range(int(model[slot])):
            if kink_of(model, int(model[slot + 1]) + size * i, state, work, z):
                return True
        return kink_others(model, state, work, z)

    @kernel
    def ringing(model: Floats, state: Floats, h: float) -> float:
        fastest = ringing_others(model, state, h)
        for i in range(int(model[slot])):
            fastest = max(fastest, ringing_of(model, int(model[slot + 1]) + size * i, state, h))
        return fastest

    @kernel
    def settle(model: Floats, body: Motion) -> None:
        settle_others(model, body)
        for i in range(int(model[slot])):
            settle_of(model, int(model[slot + 1]) + size * i, body)

    @kernel
    def passed(model: Floats, before: Motion, after: Motion, h: float) -> Passed:
        by, peak = passed_others(model, before, after, h)
        for i in range(int(model[slot])):
            other = passed_of(model, int(model[slot + 1]) + size * i, before, after, h)
            by, peak = max(by, other.by), min(peak, other.peak)
        return Passed(by, peak)

    # Of loads without events, or without memory, nothing is compiled that looks for some.
    acting = others._replace(add_load=add_load, add_jacobian=add_jacobian, passes_kink=passes_kink, ringing=ringing)
    if passed_of is not _never:
        acting = acting._replace(settle=settle, passed=passed)
    return acting._replace(advance=_advancing(others, one, slot)) if one.memory_size else acting


@cache
def _advancing(others: Acting, one: KernelEffect, slot: int) -> Callable[[Floats, float], None]:
    """Lets a step pass for the memories of the others, then for that of each of one kind."""
    advance_others, advance_of, size, memory_size = others.advance, one.advance, one.size, one.memory_size

    @kernel
    def advance(model: Floats, h: float) -> None:
        advance_others(model, h)
        for i in range(int(model[slot])):
            advance_of(model, int(model[slot + 1]) + size * i, int(model[slot + 2]) + memory_size * i, h)

    return advance


@cache
def _transformed(loads: Acting, one: TransformEffect, slot: int) -> Acting:
    """What comes of these loads by a transform, whose numbers begin at ``model[slot + 1]``."""
    transform_of, jacobian_of, add_loads = one.load, one.jacobian, loads.add_load

    @kernel
    def transform(model: Floats, body: Motion, load: Load) -> Load:
        return transform_of(model, int(model[slot + 1]), body, load)

    @kernel
    def add_load(model: Floats, body: Motion, load: Load) -> Load:
        return transform_of(model, int(model[slot + 1]), body, add_loads(model, body, load))

    @kernel
    def transform_jacobian(model: Floats, q: Quat, body: Motion, out: Floats, o: int) -> None:
        jacobian_of(model, int(model[slot + 1]), body, add_loads(model, body, held_load(model, q)), out, o)

    return loads._replace(add_load=add_load, transform=transform, transform_jacobian=transform_jacobian)
