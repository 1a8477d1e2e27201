"""What an effect is: what acts on a body beside a held wrench, described so that everything else follows from it.

An effect is either a *series*: forces and couples whose vectors are fixed in the world and whose arms are fixed in the
body, which are polynomial in the attitude, so that a step stays exact to round-off. Or it is a *load*, a function of
the motion with its exact Jacobian, for which ``auto`` takes a method that controls its error.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

from ..kernels.arrays import Floats
from ..kernels.compiled import kernel
from ..kernels.model import LOADS
from ..kernels.motion import Acting
from ..kernels.tuples import Load, Motion, added
from ..values.body import Body
from ..values.parameter import Parameter
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


@dataclass(frozen=True, eq=False, kw_only=True)
class Effect:
    """Descriptor of one effect, which is a SeriesEffect or a LoadEffect; see docs/adding_an_effect.md.

    ``make`` makes one of it from its parameters, by their last names: a dataclass or a NamedTuple. ``zero`` is one
    without any strength, ``example`` one that acts in all ways it can: the contract tests take them. With ``many`` a
    scene may have any number, each with a name of its own. ``world`` names the fields that are vectors of the world.
    ``energy(one, body, state)`` is its potential energy [J], of one state or of many (see values.state.Motions);
    with ``dissipates`` it takes energy out.
    """

    name: str  # of the group of parameters, and the keyword of Simulation
    make: Callable[..., Any]
    zero: Any
    example: Any
    parameters: tuple[Parameter, ...]
    left_out: str  # what the plan says a scene without it leaves out
    many: bool = False
    check: Callable[[Any], tuple[Any, ...]] | None = None  # of what a user gave, where other forms are taken
    acts: Callable[[Any], bool] = lambda one: True
    world: tuple[str, ...] = ()
    energy: Callable[[Any, Body, Motions], Any] | None = None
    dissipates: bool = False

    @property
    def dynamic(self) -> bool:
        """Whether it may be changed while the node runs."""
        return any(parameter.dynamic for parameter in self.parameters)

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

    def restored(self, plain: Any) -> Any:
        """What was given, from what JSON made of it: a dataclass became an object, a NamedTuple a list."""

        def made(one: Any) -> Any:
            return self.make(**one) if isinstance(one, dict) else self.make(*one)

        return tuple(map(made, plain)) if self.many else made(plain)

    def read(self, values: Mapping[str, Any], members: Sequence[str]) -> Any:
        """What parameters of a scene describe; ``members``: names of the user's, where there may be many."""
        fields = [parameter.name.rpartition(".")[2] for parameter in self.parameters]
        if not self.many:
            return self.make(**{field: values[f"{self.name}.{field}"] for field in fields})
        return tuple(
            self.make(**{field: values[f"{self.name}.{member}.{field}"] for field in fields}) for member in members
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class SeriesEffect(Effect):
    """An effect that is the sum of ``levers(one, body)``."""

    levers: Callable[[Any, Body], Iterable[Lever]]


@dataclass(frozen=True, eq=False, kw_only=True)
class LoadEffect(Effect):
    """An effect that is a function of the motion, by kernels.

    ``row(one, body)`` are its ``size`` numbers in the model, which begin at ``model[at]`` for the kernels.
    ``load(model, at, body)`` is its force and torque; ``add_jacobian(model, at, body, taut, out, o)`` adds their exact
    derivatives (see rows), with ``taut`` those of a load that does not act now and may later.
    ``passes_kink(model, at, state, work, z)`` says whether a kink lies within the increments work[z:z + 12] (see
    integrators.substep), and ``ringing(model, at, state, h)`` is ω² [1/s²] of what it makes vibrate throughout a step.
    """

    size: int
    row: Callable[[Any, Body], Floats]
    load: Callable[[Floats, int, Motion], Load]
    add_jacobian: Callable[[Floats, int, Motion, bool, Floats, int], None]
    passes_kink: Callable[[Floats, int, Floats, Floats, int], bool] = _smooth
    ringing: Callable[[Floats, int, Floats, float], float] = _calm


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


NOTHING_ACTS = Acting(_no_load, _no_jacobian, _no_kink, _no_ringing)


@cache
def together(loads: tuple[tuple[int, LoadEffect], ...]) -> Acting:
    """The kernels of all these loads, each with its number in the registry, which says where the model tells of it."""
    acting = NOTHING_ACTS
    for number, one in loads:
        acting = _and(acting, one, LOADS + 2 * number)
    return acting


@cache
def _and(others: Acting, one: LoadEffect, slot: int) -> Acting:
    """The others, then each of one kind: ``model[slot]`` of them from ``model[slot + 1]`` on."""
    load_of, jacobian_of, kink_of, ringing_of, size = one.load, one.add_jacobian, one.passes_kink, one.ringing, one.size
    load_others, jacobian_others, kink_others, ringing_others = others

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

    return Acting(add_load, add_jacobian, passes_kink, ringing)
