"""Several bodies in time, each a Simulation with a name, advanced together. No ROS."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from operator import index
from typing import NamedTuple

from .effects import link
from .effects.link import Link
from .fleet_links import LinkedBodies, sets_of
from .fleet_steps import FleetSteps
from .rate import Rate, Timed
from .scene.fleet import FleetScene
from .scene.loader import Scene
from .simulation import MOST_AT_ONCE, Simulation, SimulationError
from .snapshot import Snapshot

Make = Callable[[Scene], Simulation]


class FleetSnapshot(NamedTuple):
    """Everything that decides the future of a Fleet: see Fleet.save. It can be pickled."""

    steps: int
    bodies: dict[str, Snapshot]
    waiting: frozenset[str]
    stopped: dict[str, str]


class Fleet(Timed, Mapping[str, Simulation]):
    """Several bodies that share a count of steps; ``fleet["red"]`` is the Simulation of one, to be commanded.

    What becomes of a body does not depend on those to which no link holds it: its numbers are the same bits as those of
    a Simulation of it alone. A body whose step cannot be done stays where it was, with the reason in ``stopped``, and
    the others go on. Bodies in ``waiting`` stay, too, while their time passes, until ``set_going``. ``on_stop(name)``
    is called when a body stops.

    Parameters
    ----------
    simulations : mapping of str to Simulation
        At least one, all at the same rate and at step 0. Only the fleet advances them from here on.
    starts_on_command : collection of str
        Names of the bodies that wait from the start, and after each ``reset``.
    links : sequence of Link
        What holds bodies together. Those are advanced as one, by ``dop853``, and wait, stop and are reset together.

    Raises
    ------
    ValueError
        No simulation, rates that differ, one that has been advanced already, a link between bodies that are none, or
        one of a body whose integrator is another.
    """

    def __init__(
        self,
        simulations: Mapping[str, Simulation],
        starts_on_command: Collection[str] = (),
        links: Sequence[Link] = (),
    ):
        self._simulations = dict(simulations)
        _check(self._simulations, starts_on_command)
        rates = {one.rate for one in self._simulations.values()}
        if len(rates) > 1:
            given = ", ".join(f"{rate:g}" for rate in sorted(rates))
            raise ValueError(f"the rates of the bodies are {given} Hz; give all bodies of a fleet the same rate")
        self._rate = Rate(rates.pop())
        self._together = FleetSteps(tuple(self._simulations.values()), self._rate.h)
        self._linked = self._held_together(links)
        self._starts_on_command = frozenset(each for name in starts_on_command for each in self._with(name))
        self.waiting = set(self._starts_on_command)
        self.steps = 0
        self.stopped: dict[str, str] = {}
        self.on_stop: Callable[[str], object] = lambda name: None

    @classmethod
    def from_scene(cls, scene: FleetScene, make: Make = Simulation.from_scene) -> "Fleet":
        """The bodies that a scene describes; ``make`` makes the simulation of one. Raises ValueError as it does."""
        simulations = {}
        for name, one in scene.scenes.items():
            try:
                simulations[name] = make(one)
            except ValueError as reason:
                raise ValueError(f"body {name}: {reason}") from None
        waiting = [name for name, one in scene.scenes.items() if one["start_on_command"]]
        return cls(simulations, waiting, scene.links)

    def _held_together(self, links: Sequence[Link]) -> dict[str, LinkedBodies]:
        """By name of each body that a link holds, those with which it is advanced."""
        bodies = {name: one.body for name, one in self.items()}
        for one in links:
            link.row(one, bodies)  # which raises for a body that is none
        sets = [LinkedBodies(held, self._simulations, self._together) for held in sets_of(list(self), links)]
        return {name: one for one in sets for name in one.names}

    def go_on_meanwhile(self) -> None:
        """Wait for no kernel to be compiled: until one is, bodies are advanced one by one, to the same bits."""
        self._together.awaited = False

    def __getitem__(self, name: str) -> Simulation:
        return self._simulations[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._simulations)

    def __len__(self) -> int:
        return len(self._simulations)

    def step(self, n: int = 1) -> None:
        """Advance by n steps all that have not stopped and do not wait. Raises ValueError for n below 0."""
        n = index(n)
        if n < 0:
            raise ValueError(f"step({n}): time does not run backwards; give a number of steps of at least 0")
        for done in range(0, n, MOST_AT_ONCE):
            self._step(min(n - done, MOST_AT_ONCE))

    def _step(self, n: int) -> None:
        not_together = self.stopped.keys() | self.waiting | self._linked.keys()
        self._together.step([i for i, name in enumerate(self._simulations) if name not in not_together], n)
        self.steps += n
        for name, one in self._simulations.items():
            if one.steps != self.steps:
                self._advance(name, one, self.steps - one.steps)

    def _advance(self, name: str, one: Simulation, n: int) -> None:
        if name in self.stopped:
            return
        if name in self.waiting:
            one.wait(n)
            return
        linked = self._linked.get(name)
        try:
            (one if linked is None else linked).step(n)
        except SimulationError as reason:
            stopped = (name,) if linked is None else linked.names
            self.stopped.update(dict.fromkeys(stopped, str(reason)))
            for each in stopped:
                self.on_stop(each)

    def _with(self, name: str) -> tuple[str, ...]:
        """A body, and those to which it is linked."""
        return self._linked[name].names if name in self._linked else (name,)

    def wait(self, n: int) -> None:
        """Let the time of n steps pass without motion. Raises ValueError for n below 0."""
        for one in self._simulations.values():
            one.wait(n)
        self.steps += n

    def set_going(self, name: str) -> None:
        """A body that waits moves from the next step on, and those to which it is linked. Raises KeyError."""
        _ = self[name]
        self.waiting.difference_update(self._with(name))

    def clear_wrench(self) -> None:
        """No body holds a wrench, from any source."""
        for one in self._simulations.values():
            one.clear_wrench()

    def reset(self, name: str | None = None, *, keep_time: bool = False) -> None:
        """All go to their initial states, hold no wrench and count steps from zero, unless ``keep_time``.

        With a name that body alone does, with those to which it is linked, and time goes on.
        """
        if name is not None:
            _ = self[name]
        for each in self if name is None else self._with(name):
            self._catch_up(each)
            self[each].reset(keep_time=keep_time or name is not None)
            if each in self._starts_on_command:
                self.waiting.add(each)
        if name is None and not keep_time:
            self.steps = 0

    def _catch_up(self, name: str) -> None:
        """One that had stopped goes on, from where it stopped, at the time of all."""
        if self.stopped.pop(name, None) is not None:
            self[name].wait(self.steps - self[name].steps)

    def restart_time(self) -> None:
        """Count steps from zero. The motions go on, and each held wrench for what is left of its time."""
        for one in self._simulations.values():
            one.restart_time()
        self.steps = 0

    def save(self) -> FleetSnapshot:
        """Everything that decides the future of all bodies, exact to the bit."""
        bodies = {name: one.save() for name, one in self._simulations.items()}
        return FleetSnapshot(self.steps, bodies, frozenset(self.waiting), dict(self.stopped))

    def restore(self, snapshot: FleetSnapshot) -> None:
        """Continue from a snapshot of a fleet made in the same way: the same bits follow.

        Raises ValueError, and changes nothing, for one of other bodies, and as Simulation.restore does.
        """
        if snapshot.bodies.keys() != self.keys():
            raise ValueError(f"the snapshot is of {sorted(snapshot.bodies)}; give one of a fleet of {sorted(self)}")
        before = self.save()
        try:
            self._restore(snapshot)
        except ValueError:
            self._restore(before)
            raise

    def _restore(self, snapshot: FleetSnapshot) -> None:
        for name, one in self._simulations.items():
            one.restore(snapshot.bodies[name])
        self.steps, self.waiting, self.stopped = snapshot.steps, set(snapshot.waiting), dict(snapshot.stopped)

    def __repr__(self) -> str:
        told = f", {len(self.stopped)} stopped" if self.stopped else ""
        return f"Fleet({len(self)} bodies at {self.time:g} s, {self.rate:g} Hz{told})"


def _check(simulations: Mapping[str, Simulation], starts_on_command: Collection[str]) -> None:
    """Raise TypeError or ValueError for what cannot be the bodies of a fleet."""
    if not simulations:
        raise ValueError("a fleet without bodies: give at least one simulation")
    seen: dict[int, str] = {}
    for name, one in simulations.items():
        if not isinstance(one, Simulation):
            raise TypeError(f"body {name}: {one!r} is no Simulation; give a mapping of names to simulations")
        if one.steps:
            raise ValueError(f"body {name}: has done {one.steps} steps; give simulations at step 0")
        if (other := seen.setdefault(id(one), name)) != name:
            raise ValueError(f"body {name}: is the same simulation as {other}; give each body one of its own")
    for name in starts_on_command:
        if name not in simulations:
            raise ValueError(f"starts_on_command: there is no body {name!r}; there are {', '.join(simulations)}")
