"""A simulation that tells its journal of every call that decides its motion, and the run repeated by what it told."""

import contextlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from fractions import Fraction
from functools import partial
from typing import Any, cast

import numpy as np

from ..bags.journal import COMMANDS, LOST, STATE, Entry, Values, hole, starts_on_command
from ..bags.rosbags_support import BagError
from ..effects import REGISTRY
from ..fleet import Fleet
from ..rate import NANOSECONDS
from ..simulation import Simulation, SimulationError
from ..values.body import Body
from ..values.state import BodyState, State
from ..values.wrench import Wrench

Tell = Callable[[int, str, Values], None]


class JournaledSimulation(Simulation):
    """A Simulation that tells ``journal(step, call, values)`` of each call that decides its motion, once it is done.

    ``step`` is the count of steps before the call, and ``values`` hold what never changes: ``text`` makes an entry of
    it, later and elsewhere. What is read from the simulation is not told, nor are steps, those without motion included
    (the scene and the calls tell where they are: see ``replay``), and ``restore`` is refused.
    """

    journal: Tell | None = None

    def _tell(self, step: int, call: str, **values: Any) -> None:
        if self.journal is not None:
            self.journal(step, call, values)

    def set_wrench(self, wrench: Wrench, hold: float | None = None, source: str = "") -> None:
        """As Simulation.set_wrench."""
        super().set_wrench(wrench, hold, source)
        self._tell(self.steps, "set_wrench", wrench=wrench, hold=hold, source=source)

    def clear_wrench(self) -> None:
        """As Simulation.clear_wrench."""
        super().clear_wrench()
        self._tell(self.steps, "clear_wrench")

    def set_actuators(self, commands: Sequence[float], hold: float | None = None) -> None:
        """As Simulation.set_actuators."""
        super().set_actuators(commands, hold)
        self._tell(self.steps, "set_actuators", commands=self._actuation.commands, hold=hold)

    def change(self, **terms: Any) -> None:
        """As Simulation.change."""
        super().change(**terms)
        self._tell(self.steps, "change", **terms)

    def apply_impulse(self, impulse: Wrench) -> None:
        """As Simulation.apply_impulse."""
        super().apply_impulse(impulse)
        self._tell(self.steps, "apply_impulse", impulse=impulse)

    def set_state(self, state: State) -> None:
        """As Simulation.set_state."""
        super().set_state(state)
        self._tell(self.steps, "set_state", state=state)

    def reset(self, state: State | None = None, *, keep_time: bool = False) -> None:
        """As Simulation.reset."""
        step = self.steps
        super().reset(state, keep_time=keep_time)
        self._tell(step, "reset", keep_time=keep_time, **({} if state is None else {"state": state}))

    def restart_time(self) -> None:
        """As Simulation.restart_time."""
        step = self.steps
        super().restart_time()
        self._tell(step, "restart_time")

    def restore(self, snapshot: Any) -> None:
        """Raises RuntimeError: a journal does not tell what led to a snapshot."""
        raise RuntimeError("a simulation that keeps a journal cannot be restored; restore one without")


class JournaledFleet(Fleet):
    """A Fleet of JournaledSimulations. What is done to one of them is told with its name, what to all without one."""

    _journal: Tell | None = None

    @property
    def journal(self) -> Tell | None:
        """What is told: see JournaledSimulation."""
        return self._journal

    @journal.setter
    def journal(self, journal: Tell) -> None:
        self._journal = journal
        for name, one in self.items():
            cast(JournaledSimulation, one).journal = partial(_tell_of, name, journal)

    def reset(self, name: str | None = None, *, keep_time: bool = False) -> None:
        """As Fleet.reset."""
        step = self.steps
        with self._silence(name is None):
            super().reset(name, keep_time=keep_time)
        if name is None and self._journal is not None:
            self._journal(step, "reset", {"keep_time": keep_time})

    def restart_time(self) -> None:
        """As Fleet.restart_time."""
        step = self.steps
        with self._silence():
            super().restart_time()
        if self._journal is not None:
            self._journal(step, "restart_time", {})

    @contextlib.contextmanager
    def _silence(self, wanted: bool = True) -> Iterator[None]:
        """What is told once for all is not told by each."""
        ones = [cast(JournaledSimulation, one) for one in self.values()] if wanted else []
        kept = [one.journal for one in ones]
        for one in ones:
            one.journal = None
        try:
            yield
        finally:
            for one, journal in zip(ones, kept, strict=True):
                one.journal = journal


def _tell_of(name: str, journal: Tell, step: int, call: str, values: Values) -> None:
    journal(step, call, {**values, "of": name})


# Replay ---------------------------------------------------------------------------------------------------------------


def replay(
    entries: Iterable[Entry], simulation: Simulation, messages: Iterable[tuple[int, int]]
) -> Iterator[Simulation]:
    """Repeat a run: ``simulation`` (of the journal's scene, fresh) at each message, given as (log time, stamp) [ns].

    Messages come in the order of their log times. The simulation is yielded after the entries logged before the
    message and at the step that its stamp names; read ``motion`` before going on. Where the recorded scene has
    ``start_on_command``, steps before the first command, and after a reset, pass without motion. Raises BagError when
    the journal has a hole, or does not fit the messages.
    """
    calls = iter(entries)
    first = next(calls)
    epoch_ns, waits = first.values["epoch_ns"], starts_on_command(first)
    rate, waiting = Fraction(simulation.rate), waits
    coming = next(calls, None)
    for log_ns, stamp_ns in messages:
        while coming is not None and coming.time_ns < log_ns:
            _repeat(coming, simulation, waiting)
            waiting = waits and (coming.call == "reset" or (waiting and coming.call not in COMMANDS))
            coming = next(calls, None)
        step = round((stamp_ns - epoch_ns) * rate / NANOSECONDS)
        _go_to(simulation, step, waiting, f"the message stamped {stamp_ns} ns")
        if epoch_ns + simulation.time_ns != stamp_ns:
            raise BagError(f"the message stamped {stamp_ns} ns belongs to no step of the journal's run")
        yield simulation


def replay_fleet(
    entries: Iterable[Entry], fleet: Fleet, messages: Iterable[tuple[int, int, str]]
) -> Iterator[tuple[str, Simulation]]:
    """The same of several bodies: ``fleet`` is of the journal's scene, and a message is (log time, stamp, body's name).

    The name and the simulation of that body are yielded.
    """
    first, *calls = entries
    epoch_ns, rate, at = first.values["epoch_ns"], Fraction(fleet.rate), 0
    for log_ns, stamp_ns, name in messages:
        while at < len(calls) and calls[at].time_ns < log_ns:
            _repeat_of_fleet(calls[at], fleet)
            at += 1
        step = round((stamp_ns - epoch_ns) * rate / NANOSECONDS)
        if name not in fleet.stopped:
            _advance(fleet, step, f"the message of {name} stamped {stamp_ns} ns")
        yield name, fleet[name]


def _repeat_of_fleet(entry: Entry, fleet: Fleet) -> None:
    if entry.call == LOST:
        raise hole(entry)
    what = f"{entry.call} at step {entry.step}"
    if entry.body not in fleet.stopped:
        _advance(fleet, entry.step, what)
    try:
        if entry.call == "reset":
            fleet.reset(entry.body or None, keep_time=entry.values["keep_time"])
        elif not entry.body:
            fleet.restart_time()
        else:
            _CALLS[entry.call](fleet[entry.body], **entry.values)
    except (AttributeError, KeyError, TypeError, ValueError) as reason:
        raise BagError(f"{what} of the journal cannot be repeated: {type(reason).__name__}: {reason}") from None
    if entry.call in COMMANDS:
        fleet.set_going(entry.body)


def _advance(fleet: Fleet, step: int, what: str) -> None:
    if step < fleet.steps:
        raise BagError(f"{what} lies before step {fleet.steps}, which the journal had reached; they do not fit")
    fleet.step(step - fleet.steps)


def _repeat(entry: Entry, simulation: Simulation, waiting: bool) -> None:
    if entry.call == LOST:
        raise hole(entry)
    _go_to(simulation, entry.step, waiting, f"{entry.call} at step {entry.step}", may_stop=entry.call == "reset")
    try:
        _CALLS[entry.call](simulation, **entry.values)
    except (AttributeError, KeyError, TypeError, ValueError) as reason:
        told = f"{type(reason).__name__}: {reason}" if not isinstance(reason, ValueError) else reason
        raise BagError(f"{entry.call} at step {entry.step} of the journal cannot be repeated: {told}") from None


def _go_to(simulation: Simulation, step: int, waiting: bool, what: str, may_stop: bool = False) -> None:
    """Advance to a step. One of several bodies ``may_stop`` before, where a reset sets it going again."""
    if step < simulation.steps:
        raise BagError(f"{what} lies before step {simulation.steps}, which the journal had reached; they do not fit")
    advance = simulation.wait if waiting else simulation.step
    try:
        advance(step - simulation.steps)
    except SimulationError as reason:
        if may_stop:
            simulation.wait(step - simulation.steps)
        if simulation.steps != step:  # else the recorded run stopped here, too
            raise BagError(f"{what} cannot be reached: {reason}") from None


def _state(values: Values) -> State:
    """The very numbers: State would normalise the quaternion once more."""
    return BodyState(np.concatenate([values[name] for name in STATE]))


def _change(simulation: Simulation, **terms: Any) -> None:
    if "body" in terms:
        terms["body"] = Body(**terms["body"])
    for name in REGISTRY.keys() & terms:
        terms[name] = REGISTRY[name].restored(terms[name])
    simulation.change(**terms)


_CALLS: dict[str, Callable[..., None]] = {  # by their names in bags.journal
    "set_wrench": lambda simulation, wrench, hold, source: simulation.set_wrench(Wrench(**wrench), hold, source),
    "clear_wrench": Simulation.clear_wrench,
    "set_actuators": Simulation.set_actuators,
    "change": _change,
    "apply_impulse": lambda simulation, impulse: simulation.apply_impulse(Wrench(**impulse)),
    "set_state": lambda simulation, state: simulation.set_state(_state(state)),
    "reset": lambda simulation, keep_time, state=None: simulation.reset(
        None if state is None else _state(state), keep_time=keep_time
    ),
    "restart_time": Simulation.restart_time,
}
