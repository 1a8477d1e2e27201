"""What moves: where a body is at a moment, and a recording of many moments."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..effects.actuators import Actuator
from ..kernels.arrays import Floats

NOTHING = (0.0, 0.0, 0.0)


class Moment(NamedTuple):
    """Pose of the body frame in the world at a time [s], and what pushes the body, where that is known.

    ``force`` [N] acts at the body frame's origin, ``torque`` [N m] about it; both are in body axes. ``levels`` are
    what the actuators do, as ``level`` gives it, in their order; empty where it is not known.
    """

    time: float
    position: Sequence[float]
    orientation: Sequence[float]  # w, x, y, z, body to world
    force: Sequence[float] = NOTHING
    torque: Sequence[float] = NOTHING
    levels: Sequence[float] = ()


def level(one: Actuator, value: float) -> float:
    """What an actuator does as a share of its most, from -1 to 1: a rotor's by the square of its speed, its thrust."""
    most = max(abs(one.min), abs(one.max))
    share = value / most if most > 0.0 else 0.0
    if one.type == "rotor":
        share = share * abs(share)
    return min(max(share, -1.0), 1.0)


class Wrenches(NamedTuple):
    """Commands in body axes, each held from its time [s] to the next one's: shapes (n,), (n, 3) and (n, 3)."""

    time: Floats
    force: Floats
    torque: Floats


class Levels(NamedTuple):
    """What the actuators do, each row held from its time [s] to the next one's: shapes (n,) and (n, k)."""

    time: Floats
    values: Floats


class Recording(NamedTuple):
    """The motion of one body: times [s], shape (n,), rising; positions (n, 3); quaternions w, x, y, z, (n, 4)."""

    time: Floats
    position: Floats
    orientation: Floats
    wrenches: Wrenches | None = None
    levels: Levels | None = None

    def at(self, time: float) -> Moment:
        """The latest state at a time, or the first one: nothing is made up between two states."""
        i = _latest(self.time, time)
        moment = Moment(float(self.time[i]), self.position[i].tolist(), self.orientation[i].tolist())
        if self.wrenches is not None and len(self.wrenches.time) and self.wrenches.time[0] <= time:
            j = _latest(self.wrenches.time, time)
            moment = moment._replace(force=self.wrenches.force[j].tolist(), torque=self.wrenches.torque[j].tolist())
        if self.levels is not None and len(self.levels.time) and self.levels.time[0] <= time:
            moment = moment._replace(levels=self.levels.values[_latest(self.levels.time, time)].tolist())
        return moment


def span(recordings: Mapping[str, Recording]) -> tuple[float, float]:
    """First and last time [s] of any of them."""
    times = [(one.time[0], one.time[-1]) for one in recordings.values()]
    return float(min(first for first, _ in times)), float(max(last for _, last in times))


def _latest(times: Floats, time: float) -> int:
    return max(0, int(np.searchsorted(times, time, side="right")) - 1)
