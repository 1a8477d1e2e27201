"""What decides a simulation's future."""

from dataclasses import dataclass
from typing import Any

from .values.wrench import Wrench


@dataclass(frozen=True)
class Snapshot:
    """Everything that decides a simulation's future, exact to the bit: see Simulation.save. It can be pickled."""

    steps: int
    state: tuple[float, ...]
    sources: tuple[tuple[str, Wrench, int | None], ...]  # name, wrench held, step at which it ends
    origin: tuple[int, tuple[float, ...]] | None = None  # step and state from which ``exact`` evaluates
    stiffness: float | None = None  # by which ``auto`` chose
    memory: tuple[float, ...] = ()  # of effects: see Terms.memory
    actuators: tuple[tuple[float, ...], int | None] = ((), None)  # commands, and the step at which they end
    remembers: tuple[Any, ...] = ()  # what the memory is of: see Terms.remembers
