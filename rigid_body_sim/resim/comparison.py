"""How far a motion is from a recorded one: errors of position and attitude over time, and where they begin."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..kernels.arrays import Floats, Integers
from ..values.rotation import angles_between

NANOSECONDS = 1_000_000_000


@dataclass(frozen=True)
class Tolerance:
    """What still counts as the same: position [m] and attitude [rad]."""

    position: float
    attitude: float

    def __str__(self) -> str:
        return f"{self.position:g} m, {self.attitude:g} rad"


@dataclass(frozen=True)
class Comparison:
    """Poses (x, y, z, qw, qx, qy, qz), shape (n, 7), at ``stamp_ns``, shape (n,): recorded, and simulated again."""

    stamp_ns: Integers
    recorded: Floats
    simulated: Floats

    @cached_property
    def time(self) -> Floats:
        """Seconds since the first stamp, shape (n,)."""
        return (self.stamp_ns - self.stamp_ns[0]) / NANOSECONDS

    @cached_property
    def position_error(self) -> Floats:
        """Distance [m], shape (n,)."""
        return np.linalg.norm(self.simulated[:, :3] - self.recorded[:, :3], axis=1)

    @cached_property
    def attitude_error(self) -> Floats:
        """Angle [rad] between the attitudes, the same for q and −q, shape (n,)."""
        return angles_between(self.recorded[:, 3:7], self.simulated[:, 3:7])

    @cached_property
    def first_unequal(self) -> int | None:
        """Index of the first pose that is not equal to the bit; None when all are."""
        same = np.ascontiguousarray(self.recorded).view(np.int64) == np.ascontiguousarray(self.simulated).view(np.int64)
        return _first(~same.all(axis=1))

    def divergence(self, tolerance: Tolerance) -> int | None:
        """Index of the first pose above the tolerance; None when there is none."""
        within = (self.position_error <= tolerance.position) & (self.attitude_error <= tolerance.attitude)
        return _first(~within)  # what is not a number is not within

    def figures(self) -> dict[str, float]:
        """Largest and root mean square errors."""
        return {
            "position_max": float(self.position_error.max()),
            "position_rms": _rms(self.position_error),
            "attitude_max": float(self.attitude_error.max()),
            "attitude_rms": _rms(self.attitude_error),
        }


def _first(true: NDArray[np.bool_]) -> int | None:
    return int(np.argmax(true)) if true.any() else None


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
