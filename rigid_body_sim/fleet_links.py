"""Bodies of a fleet with links between them: each set of them is advanced as one, by integrators.linked."""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from .effects import link
from .effects.link import Link
from .fleet_steps import FleetSteps
from .integrators import dop853
from .integrators.linked import Advance, ready_linked, work_size
from .kernels.arrays import Floats, Integers, zeros_on_a_line
from .kernels.motion import Acting
from .simulation import Simulation, SimulationError

_TOO_LONG = (
    "body {name}: what is held has more forces at points than there is room for in a fleet with links; "
    "hold fewer at a time"
)


class LinkedSet(NamedTuple):
    """Names of bodies that are held together, and all between them."""

    names: tuple[str, ...]
    links: tuple[Link, ...]


def sets_of(names: Sequence[str], links: Sequence[Link]) -> Iterator[LinkedSet]:
    """The sets of bodies that links hold together, directly or by others; names in their order."""
    group = {name: {name} for name in names}
    for one in links:
        first, second = (group[name] for name in one.bodies)
        if first is not second:
            first |= second
            group.update(dict.fromkeys(second, first))
    for name in names:
        if len(group[name]) > 1 and name == next(each for each in names if each in group[name]):
            among = tuple(each for each in names if each in group[name])
            yield LinkedSet(among, tuple(one for one in links if one.bodies[0] in group[name]))


class LinkedBodies:
    """One set of them, whose rows are those of ``steps``; all wait, go on and stop together.

    Raises ValueError for a body whose integrator would not see its links.
    """

    def __init__(self, held: LinkedSet, simulations: Mapping[str, Simulation], steps: FleetSteps):
        self.names = held.names
        self._simulations = [simulations[name] for name in held.names]
        self._steps = steps
        for name, one in zip(held.names, self._simulations, strict=True):
            if one.integrator is not dop853.INTEGRATOR:
                raise ValueError(
                    f"body {name}: bodies with links are advanced by {dop853.INTEGRATOR.name!r}, and not by "
                    f"{one.integrator.name!r}; make it with integrator={dop853.INTEGRATOR.name!r}"
                )
        places = list(simulations)
        self._which: Integers = np.array([places.index(name) for name in held.names])
        bodies = {name: one.body for name, one in zip(held.names, self._simulations, strict=True)}
        self._rows: Floats = np.concatenate([link.row(one, bodies) for one in held.links])
        self._work = zeros_on_a_line(work_size(len(held.names)))
        self._actings: tuple[Acting, ...] = ()
        self._make_ready()

    def _make_ready(self) -> Advance:
        """The kernel for what acts on the bodies now."""
        actings = tuple(one.terms.kernels for one in self._simulations)
        if self._actings != actings:
            self._actings, self._advance = actings, ready_linked(actings)
        return self._advance

    def step(self, n: int) -> None:
        """Advance all by n steps, or as far as can be. Raises SimulationError when that is not all."""
        left = n
        while left > 0:
            until = min((one.expiry - one.steps for one in self._simulations if one.expiry is not None), default=left)
            wanted = min(left, until)
            done = self._advance_by(wanted)
            for one in self._simulations:
                one.steps += done
            for one in self._simulations:
                one.end_what_is_due()
            if done < wanted:
                raise SimulationError(self._why_stopped())
            left -= done

    def _advance_by(self, n: int) -> int:
        for name, one in zip(self.names, self._simulations, strict=True):
            if not one.is_at_home:
                raise SimulationError(_TOO_LONG.format(name=name))
        steps, advance = self._steps, self._make_ready()
        return advance(steps.states, steps.models, steps.width, self._which, self._rows, self._work, steps.h, n)

    def _why_stopped(self) -> str:
        names, one = ", ".join(self.names), self._simulations[0]
        return (
            f"step {one.steps + 1} cannot be done: {names}, which are linked, would leave the range of finite numbers, "
            "or take too many sub-steps; give softer links, smaller wrenches or a higher rate"
        )
