"""The motion of many bodies that a run has come to, as arrays."""

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from ..kernels.arrays import Floats, Integers
from ..sensors.instrument import Samples, named
from ..terms import Terms
from .schedule import WrenchSchedule
from .trajectory import States, Trajectory


class Trajectories(States):
    """States of n bodies at k steps: arrays of shape (k, n, ...), and ``trajectories[i]`` is the Trajectory of a body.

    Attributes
    ----------
    steps : array of int, shape (k,)
        Steps of the ensemble at which the states are.
    commands : WrenchSchedule or None
        What the run was given.
    stopped_bodies : mapping of int to str
        Bodies that could not go on, and why; their states stay as they were.
    stopped : str
        Why the run ended before its time: a sentence, empty where it did not.
    samples : mapping of str to Samples
        What each sensor measured on the way.
    """

    def __init__(
        self,
        terms: list[Terms],
        models: Floats,
        rate: float,
        stopped_bodies: Mapping[int, str],
        steps: Integers,
        states: Floats,
    ):
        super().__init__(states.reshape(len(steps), len(terms), -1), models)
        self._terms, self.rate, self.steps, self.stopped_bodies = terms, rate, steps, dict(stopped_bodies)
        steps.flags.writeable = False
        self.commands: WrenchSchedule | None = None
        self.stopped = ""
        self.samples: Mapping[str, Samples] = {}

    def __len__(self) -> int:
        return len(self._terms)

    def __getitem__(self, i: int) -> Trajectory:
        one = Trajectory(self._terms[i], self.rate, self.steps.copy(), np.ascontiguousarray(self._rows[:, i]))
        one.commands, one.stopped = self.commands, self.stopped_bodies.get(i, self.stopped)
        one.samples = {name: Samples(found.time, found.values[:, i]) for name, found in self.samples.items()}
        return one

    @property
    def time(self) -> Floats:
        """Simulated time [s], shape (k,)."""
        return self.steps / self.rate

    def sense(self, name: str) -> Samples:
        """What a sensor of each body measured, with values of shape (k, n, m): see Trajectory.sense."""
        found: Samples = named(self.samples, name)
        return found

    @cached_property
    def kinetic_energy(self) -> Floats:
        """Kinetic energy [J], shape (k, n)."""
        return self._energies("kinetic_energy")

    @cached_property
    def potential_energy(self) -> Floats:
        """Potential energy [J] in gravity, constant forces, tethers and contacts, shape (k, n)."""
        return self._energies("potential_energy")

    def _energies(self, name: str) -> Floats:
        return np.column_stack([getattr(self[i], name) for i in range(len(self))])

    def __repr__(self) -> str:
        told = f", {len(self.stopped_bodies)} stopped" if self.stopped_bodies else ""
        return (
            f"Trajectories({len(self)} bodies, {len(self.steps)} states from {self.time[0]:g} s to "
            f"{self.time[-1]:g} s at {self.rate:g} Hz{told}{', ' * bool(self.stopped)}{self.stopped})"
        )
