"""Wrenches held side by side, each by a source and until a step."""

import math
from collections.abc import Mapping

from .values.wrench import Wrench, total

MOST_STEPS = 1e15


class Held:
    """What each source holds, and until which step: name -> (wrench, step at which it ends, or None)."""

    __slots__ = ("sources",)

    def __init__(self, sources: Mapping[str, tuple[Wrench, int | None]] | None = None):
        self.sources = dict(sources or {})

    def having(self, source: str, wrench: Wrench, end: int | None) -> "Held":
        """The same with another wrench of one source."""
        return Held({**self.sources, source: (wrench, end)})

    def left_at(self, step: int) -> "Held":
        """Those that have not ended."""
        return Held({name: held for name, held in self.sources.items() if held[1] is None or held[1] > step})

    def later(self, steps: int) -> "Held":
        """The same, each until so many steps later."""
        return Held(
            {name: (wrench, None if end is None else end + steps) for name, (wrench, end) in self.sources.items()}
        )

    @property
    def total(self) -> Wrench:
        """All of them at once. Raises ValueError when the sum is not finite."""
        return total(wrench for wrench, _ in self.sources.values())

    @property
    def end(self) -> int | None:
        """Step at which the first of them ends."""
        return min((end for _, end in self.sources.values() if end is not None), default=None)


def earlier(one: int | None, other: int | None) -> int | None:
    """The earlier of two ends, None being that of what is held for ever."""
    if one is None or other is None:
        return other if one is None else one
    return min(one, other)


def steps_held(hold: float, rate: float) -> int:
    """Steps of a ``rate`` [Hz] for which a wrench is held: as many as fit into ``hold`` [s], and at least one.

    A millionth of a step, or the last digits of a long time, is taken for round-off: 0.29 s at 100 Hz are 29 steps,
    though their product is just below. Raises ValueError for a time of zero or less, or of more than 1e15 steps.
    """
    steps = hold * rate
    if not 0.0 < steps <= MOST_STEPS:
        raise ValueError(
            f"hold {hold:g} s is not a time greater than zero and of at most {MOST_STEPS:g} steps; "
            "leave it out to hold for ever"
        )
    return max(1, math.floor(steps + max(1e-6, 4e-16 * steps)))
