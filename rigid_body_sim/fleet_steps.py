"""Steps of a fleet: one call of a kernel for all bodies of one plan, as long as nothing happens to any of them."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import groups
from .integrators import Integrator, many, taylor
from .integrators.script import NOTHING
from .kernels import compiled
from .kernels.arrays import Floats, Integers, zeros_on_a_line
from .kernels.model import LEVER_SIZE
from .kernels.motion import Acting
from .kernels.state import SIZE, THIN
from .simulation import Simulation

LOOK_EVERY = 1000  # steps between two looks for a kernel that is compiled elsewhere
ENOUGH = 3  # bodies, from which on one call takes less time than one for each
_ROOM = 16 * LEVER_SIZE  # in a row beside the model: so many forces at points make no model too long
_KINDS = 32  # more than there are numbers of kinds: see groups


class _Plan(NamedTuple):
    """What bodies have in common that are advanced in one way, whatever they hold."""

    integrator: Integrator
    acting: Acting


class _Group(NamedTuple):
    """Bodies of one plan, and of one kind of wrench where the kernel depends on that."""

    code: int
    integrator: Integrator
    which: Integers
    members: list[Simulation]


class FleetSteps:
    """Advances simulations, which live in rows of its arrays from here on; all are at step 0.

    Each has the bits that its own ``step`` would give. ``step(which, n)`` advances those of ``which`` that hold what
    they hold for n steps; the others, and those that stopped on the way, are for their own ``step``. So are those whose
    kernel is not compiled yet, where that is not ``awaited``. ``states`` and ``models`` are flat, the latter of rows of
    so many numbers as ``width`` says; a step is h [s] long.
    """

    awaited = True

    def __init__(self, simulations: Sequence[Simulation], h: float):
        self._simulations, self.h = simulations, h
        n, width = len(simulations), max(one.model_size for one in simulations) + _ROOM
        self.width = -(-width // 8) * 8
        self.models, self.states = zeros_on_a_line(n * self.width), zeros_on_a_line(n * SIZE)
        self._rows, self._origins = self.states.reshape(n, SIZE), np.zeros((n, SIZE))
        for one, *rows in zip(simulations, self._rows, self._origins, self.models.reshape(n, -1), strict=True):
            one.move(*rows)
        self._plans: list[_Plan] = []
        self._plan: Integers = np.zeros(n, np.int64)  # of each body
        self._in_lanes: NDArray[np.bool_] = np.zeros(n, bool)  # whether eight of its plan are advanced at once
        self._kinds: Integers = np.zeros(n, np.int64)
        self._seen: list[Callable[[int], int]] = []  # what advanced the bodies that were free in the step before
        self._known: list[Callable[[int], int] | None] = [None] * n  # what advances each whose plan is known
        self._bodies: Integers = np.zeros(0, np.int64)
        self._code: Integers = np.zeros(0, np.int64)
        self._groups: list[_Group] = []
        self._kernels: dict[int, many.Many] = {}
        self._looks = 0
        self._work: dict[str, Floats] = {}
        self._block = zeros_on_a_line(many.BLOCK_SIZE)
        self._reduce = compiled.ready(groups.REDUCING.function, *groups.REDUCING.examples)

    def step(self, which: Sequence[int], n: int) -> None:
        """Advance these bodies by n steps, or by as many as can be; each counts its own."""
        ones = self._simulations
        free = [i for i in which if ((e := ones[i].expiry) is None or e > ones[i].steps + n) and ones[i].is_at_home]
        if len(free) < ENOUGH:
            return
        seen = [ones[i].run_kernel for i in free]
        if seen != self._seen:
            self._look_at(free, seen)
        for one in self._grouped():
            if kernel := self._kernel(one.code):
                self._advance(kernel, one, n)

    def _grouped(self) -> list[_Group]:
        """The bodies that are free, as the wrenches group them that they hold now."""
        bodies, kinds = self._bodies, self._kinds
        self._reduce(self.models, self.width, bodies, kinds)
        code = self._plan[bodies] * _KINDS + np.where(self._in_lanes[bodies], 1 + kinds[bodies] // 2, 0)
        if not np.array_equal(code, self._code):
            found = [(one, bodies[code == one]) for one in np.unique(code).tolist()]
            self._groups = [self._group(one, members) for one, members in found if len(members) >= ENOUGH]
            self._code = code
        return self._groups

    def _group(self, code: int, which: Integers) -> _Group:
        members = [self._simulations[i] for i in which.tolist()]
        return _Group(code, self._plans[code // _KINDS].integrator, which, members)

    def _look_at(self, free: Sequence[int], seen: list[Callable[[int], int]]) -> None:
        """Find the plans of these bodies, which are advanced by what is ``seen``."""
        self._bodies, self._code, self._seen = np.array(free), np.zeros(0, np.int64), seen
        for i, kernel in zip(free, seen, strict=True):
            if self._known[i] is not kernel:
                self._known[i] = kernel
                self._find_plan(i)

    def _find_plan(self, i: int) -> None:
        one = self._simulations[i]
        plan, principal = _Plan(one.integrator, one.terms.kernels), one.body.principal_moments
        if plan not in self._plans:
            self._plans.append(plan)
        self._plan[i] = self._plans.index(plan)
        able = one.integrator is taylor.INTEGRATOR and compiled.ENABLED and not one.terms.actuated
        self._in_lanes[i] = able and principal.max() <= THIN * principal.min()

    def _advance(self, kernel: many.Many, group: _Group, n: int) -> None:
        integrator, which, members = group.integrator, group.which, group.members
        counts: Integers = np.full(len(members), n)
        if integrator.one_evaluation:
            since = np.array([one.steps - (one.origin_steps or 0) for one in members])
            counts, self._rows[which] = counts + since, self._origins[which]
        scratch = self._work_of(integrator), self._block
        kernel(self.states, self.models, self.width, which, counts, *scratch, self.h, NOTHING)
        if integrator.one_evaluation:
            counts -= since
        for one, done in zip(members, counts.tolist(), strict=True):
            one.steps += done

    def _kernel(self, code: int) -> many.Many | None:
        """Of bodies of a plan and a kind; None where it is not there yet."""
        if code in self._kernels:
            return self._kernels[code]
        (integrator, acting), kind = self._plans[code // _KINDS], code % _KINDS
        carried = (kind - 1) // 4 if kind else None
        if not (self.awaited or self._is_there(groups.request_of(integrator, acting, carried))):
            return None
        self._kernels[code] = groups.ready(integrator, acting, carried)
        return self._kernels[code]

    def _is_there(self, wanted: compiled.Request) -> bool:
        """Whether a kernel is in the cache, where a look takes some 50 us; so not at each step."""
        self._looks += 1
        return self._looks % LOOK_EVERY == 1 and wanted.is_met

    def _work_of(self, integrator: Integrator) -> Floats:
        if integrator.name not in self._work:
            self._work[integrator.name] = zeros_on_a_line(integrator.work_size)
        return self._work[integrator.name]
