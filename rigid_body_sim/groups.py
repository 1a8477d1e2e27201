"""Which kernel advances which of many bodies: those of one plan are one group."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import integrators
from .integrators import Integrator, many, taylor
from .integrators.script import NOTHING
from .kernels import compiled
from .kernels.arrays import Floats, Integers
from .kernels.model import MOMENTS
from .kernels.motion import Acting
from .kernels.state import SIZE, THIN, L
from .kernels.stiffness import spectral_radius
from .many_bodies import Bodies
from .scene import plan
from .stepping import request
from .values.wrench import Wrench

_TURNING = [0, 1, 2, 3, 4, 5, 9, 10, 11]  # of Wrench.values: all but the force in world axes

_ALL = list(integrators.REGISTRY.values())
_AT_ONCE = np.array([one is taylor.INTEGRATOR and compiled.ENABLED for one in _ALL])
_CLOSED = np.array([one.one_evaluation for one in _ALL])
_ENOUGH = 3  # bodies, from which on eight at once take less time than one by one
_KINDS = 32  # more than there are numbers of kinds: see find


# Reduces the wrenches of bodies that are not told when they change.
REDUCING = compiled.Request(many.reduce_wrenches, (np.zeros(1), 1, np.zeros(1, np.int64), np.zeros(1, np.int64)))


class Group(NamedTuple):
    """Bodies that one kernel advances."""

    which: Integers
    integrator: Integrator
    kernel: many.Many


class Groups:
    """The groups of bodies, for steps of h [s]; ``asked`` is None where the plan chooses.

    Raises ValueError where the integrator asked for leaves out what a body has.
    """

    def __init__(self, bodies: Bodies, asked: Integrator | None, h: float):
        self._models, self.asked, self._h = bodies.models, asked, h
        distinct = {id(one): one for one in bodies.terms}
        for one in distinct.values():
            if asked is not None and (shortfall := integrators.shortfall(asked.name, one)):
                raise ValueError(f"body {bodies.terms.index(one)}: {shortfall}")
        self._acting = list(dict.fromkeys(one.kernels for one in distinct.values()))
        number = {key: self._acting.index(one.kernels) for key, one in distinct.items()}
        self._acts = np.array([number[id(one)] for one in bodies.terms])
        self._loaded = np.array([bool(one.loads) for one in bodies.terms])
        self._with_loads = np.flatnonzero(self._loaded).tolist()
        self._actuated = np.array([one.actuated for one in bodies.terms])
        self._turning = np.array([one.turning for one in bodies.terms]) | self._actuated
        moments = bodies.models[:, MOMENTS : MOMENTS + 3]
        self._thin = moments.max(1) > THIN * moments.min(1)
        self.stiffness = np.full(len(bodies.terms), math.nan)
        self.wrench_kinds: Integers = np.full(len(bodies.terms), many.UNKNOWN)  # see many.wrench_kind
        self._kernels: dict[tuple[str, Acting, int | None], many.Many] = {}
        self.all: list[Group] = []
        self._code: Integers = np.zeros(0, np.int64)
        self.in_closed_form: NDArray[np.bool_] = np.zeros(0, bool)

    def measure(self, states: Floats, which: Integers) -> bool:
        """Find how stiff the motion of these bodies is, where that decides; see Stepping.prepare. False if nowhere."""
        loaded = [] if self.asked else which[self._loaded[which]].tolist()
        for i in loaded:
            acting = self._acting[self._acts[i]]
            self.stiffness[i] = spectral_radius(acting, states[i], self._models[i]) * self._h
        return bool(loaded)

    def turn_stiff(self, i: int) -> bool:
        """Count the motion of a body as stiff, as it grew too fast for the explicit method; False if it was."""
        if self.asked is not None or not self._loaded[i] or self.stiffness[i] > plan.STIFF:
            return False
        self.stiffness[i] = math.inf
        return True

    def keep_stiffness(self, i: int, stiffness: float | None) -> None:
        """Take over what a Simulation of a body came to."""
        self.stiffness[i] = math.nan if stiffness is None else stiffness

    @property
    def take_any(self) -> bool:
        """Whether all go on by the same integrators under any wrench; see Stepping.takes_any."""
        if self.asked is not None:
            return not self.asked.torque_free_only
        return bool((self._loaded | self._turning).all())

    def check(self, values: Floats) -> None:
        """Raise ValueError, with the number of the body, for a row that the integrator asked for cannot be given."""
        if self.asked is None or not self.asked.torque_free_only:
            return
        for i in np.flatnonzero(values[:, _TURNING].any(1))[:1].tolist():
            refusal = self.asked.refusal(Wrench(*values[i].reshape(4, 3).tolist()))
            raise ValueError(f"body {i}: {refusal}")

    def find(self) -> None:
        """Make the groups anew, where the kinds of the wrenches, or a stiffness, lead to others."""
        integrator = self._choices()
        kind = np.where(_AT_ONCE[integrator] & ~self._thin & ~self._actuated, 1 + self.wrench_kinds // 2, 0)
        code: Integers = (integrator * len(self._acting) + self._acts) * _KINDS + kind
        if np.array_equal(code, self._code):
            return
        self._code, self.in_closed_form = code, _CLOSED[integrator]
        self.all = [self._group(int(one), np.flatnonzero(code == one)) for one in np.unique(code)]

    def _group(self, code: int, which: Integers) -> Group:
        number, kind = divmod(code, _KINDS)
        integrator, acting = divmod(number, len(self._acting))
        one = _ALL[integrator]
        carried = (kind - 1) // 4 if kind and len(which) >= _ENOUGH else None
        return Group(which, one, self._kernel(one, self._acting[acting], carried))

    def by_speed(self, which: Integers, states: Floats) -> Integers:
        """Places of bodies in an order in which neighbours, which are advanced together, turn about as fast."""
        moments = self._models[which, MOMENTS : MOMENTS + 3]
        spin = np.linalg.norm(states[which, L : L + 3], axis=1) / moments.min(1)
        return np.argsort(spin, kind="stable")

    def group_of(self, i: int) -> Group:
        """The group of a body."""
        return next(group for group in self.all if i in group.which)

    @property
    def names(self) -> list[str]:
        """Name of the integrator that is right for each body."""
        return [_ALL[i].name for i in self._choices().tolist()]

    def _choices(self) -> Integers:
        """The same as places in the registry."""
        if self.asked is not None:
            return np.full(len(self._acts), _ALL.index(self.asked))
        turned = self._turning | (self.wrench_kinds % 2 == 1)
        found = np.where(turned, _place(True, None), _place(False, None))
        for i in self._with_loads:
            found[i] = _place(bool(turned[i]), float(self.stiffness[i]))
        return found

    def _kernel(self, integrator: Integrator, acting: Acting, carried: int | None) -> many.Many:
        if (key := (integrator.name, acting, carried)) not in self._kernels:
            self._kernels[key] = ready(integrator, acting, carried)
        return self._kernels[key]


def _place(turned: bool, stiffness: float | None) -> int:
    return _ALL.index(integrators.REGISTRY[plan.choose(turned, stiffness)])


def ready(integrator: Integrator, acting: Acting, carried: int | None) -> many.Many:
    """The kernel for bodies of one plan; ``carried`` vectors, where eight are advanced at once, else None."""
    if not compiled.ENABLED:
        return _in_python(integrator, acting)
    wanted = request_of(integrator, acting, carried)
    return compiled.ready(wanted.function, *wanted.examples)


def request_of(integrator: Integrator, acting: Acting, carried: int | None) -> compiled.Request:
    """What is to be compiled for that."""
    made = many.one_by_one(integrator, acting) if carried is None else many.eight_at_once(carried)
    numbers, whole = np.zeros(1), np.zeros(1, np.int64)
    return compiled.Request(made, (numbers, numbers, 1, whole, whole, numbers, numbers, 1.0, NOTHING))


def _in_python(integrator: Integrator, acting: Acting) -> many.Many:
    """The same where numba is not: there a step that cannot be done raises, which ``ready_steps`` takes care of."""
    steps = compiled.ready_steps(request(integrator, acting))

    def advance(
        states: Floats,
        models: Floats,
        width: int,
        which: Integers,
        counts: Integers,
        work: Floats,
        block: Floats,
        h: float,
        script: object,
    ) -> None:
        rows = states.reshape(-1, SIZE)
        for k, i in enumerate(which.tolist()):
            counts[k] = steps(rows[i], models[width * i : width * (i + 1)], work, h, int(counts[k]))

    return advance
