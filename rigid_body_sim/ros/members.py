"""Several bodies in one loop: each as its inputs and services see it, and for whose commands lockstep waits."""

from collections.abc import Callable, Mapping, Sequence

from ..fleet import Fleet
from ..simulation import Simulation
from .inputs import Inputs
from .loop import WAITING, Loop
from .outputs import Outputs


class Rendezvous:
    """In lockstep: ``go()`` is called once every body that is waited for has got a command since the last time.

    Those are the ``named`` ones, or else all that somebody commands. Whoever sends two before the others send one has
    the second take the place of the first.
    """

    def __init__(self, named: Sequence[str], go: Callable[[], None]):
        self._named, self._go = frozenset(named), go
        self._commanded: set[str] = set()
        self._missing: frozenset[str] = frozenset()
        self.inputs: Mapping[str, Inputs] = {}

    def note(self, name: str) -> None:
        """After a command to that body."""
        self._commanded.add(name)
        self._missing -= {name}
        if not self._missing:
            self.look()

    def look(self) -> None:
        """Go on where nobody is waited for any more: one who commanded may have gone."""
        self._missing = self.awaited - self._commanded
        if self._commanded and not self._missing:
            self._commanded.clear()
            self._missing = self.awaited
            self._go()

    @property
    def awaited(self) -> frozenset[str]:
        """Names of the bodies that are waited for."""
        return self._named or frozenset(name for name, one in self.inputs.items() if one.is_commanded)


class Member:
    """One body of a fleet as its inputs, services and entity see the loop: see inputs.Commanded."""

    def __init__(self, name: str, loop: Loop[Fleet], outputs: Outputs, rendezvous: Rendezvous):
        self._name, self._loop, self._outputs, self._rendezvous = name, loop, outputs, rendezvous
        self._fleet = loop.simulation
        self.simulation: Simulation = self._fleet[name]

    @property
    def failure(self) -> str:
        """Why it has stopped, or nothing."""
        return self._loop.failure or self._fleet.stopped.get(self._name, "")

    @property
    def waiting(self) -> bool:
        """Whether it stays until its first command."""
        return self._name in self._fleet.waiting

    @property
    def mode(self) -> str:
        """What it does now."""
        return "stopped" if self.failure else WAITING if self.waiting and self._loop.by_clock else self._loop.mode

    @property
    def stamp_ns(self) -> int:
        """Time [ns] in the stamps of its present step."""
        return self._loop.epoch_ns + self.simulation.time_ns

    def set_going(self) -> None:
        """A body that waited for a command moves from the next step on."""
        self._fleet.set_going(self._name)

    def on_command(self) -> None:
        """In lockstep, all bodies go on when each has its command."""
        if self._loop.lockstep:
            self._rendezvous.note(self._name)

    def on_changed_state(self) -> None:
        """After the state was set from outside: when no step follows by itself, show it."""
        if not self._loop.by_clock:
            self.publish()

    def publish(self) -> None:
        """Publish the present step of this body alone."""
        self._outputs.publish(self.stamp_ns)

    def reset(self) -> str:
        """Back to its initial state, while time and the other bodies go on."""
        self._fleet.reset(self._name)
        self._outputs.look_again()
        self.on_changed_state()
        return f"{self._name}: initial state, no wrench; time and the other bodies go on"
