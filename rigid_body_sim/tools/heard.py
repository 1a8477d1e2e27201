"""What was recorded from a body's topics, and whether energy and momentum add up. No ROS."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ..kernels.arrays import Floats
from ..values import rotation
from ..values.body import Body

NANOSECONDS = 1_000_000_000


@dataclass(frozen=True)
class Heard:
    """Attitudes and rates at ``stamp_ns``, and the torques that acted, each from its ``command_ns`` until the next.

    Orientations are (w, x, y, z), body to world; angular velocity [rad/s] and torque [N m] are in body axes.
    """

    stamp_ns: Floats  # (n,), rising
    orientation: Floats  # (n, 4)
    angular_velocity: Floats  # (n, 3)
    command_ns: Floats  # (m,), rising
    torque: Floats  # (m, 3)

    @cached_property
    def time(self) -> Floats:
        """Seconds since the first stamp, shape (n,)."""
        return (self.stamp_ns - self.stamp_ns[0]) / NANOSECONDS

    @cached_property
    def command_time(self) -> Floats:
        """Seconds from the first stamp to each command, shape (m,)."""
        return (self.command_ns - self.stamp_ns[0]) / NANOSECONDS

    def commanded(self) -> "Heard":
        """The part from the first command on: what acted before may not have been heard."""
        begun = self.stamp_ns >= self.command_ns[:1].sum()
        return replace(
            self,
            stamp_ns=self.stamp_ns[begun],
            orientation=self.orientation[begun],
            angular_velocity=self.angular_velocity[begun],
        )

    def error(self, target: ArrayLike) -> Floats:
        """Angle [rad] between each attitude and ``target``, shape (n,)."""
        return np.array([rotation.angle_between(target, q) for q in self.orientation])

    def rate(self) -> Floats:
        """Magnitude of the angular velocity [rad/s], shape (n,)."""
        return np.linalg.norm(self.angular_velocity, axis=1)

    def norm_error(self) -> float:
        """Largest | |q| − 1 | of all attitudes."""
        return float(np.abs(np.linalg.norm(self.orientation, axis=1) - 1.0).max())

    def missing(self, period_ns: float) -> int:
        """How many stamps are missing from a row of one every ``period_ns``, first to last."""
        return round((self.stamp_ns[-1] - self.stamp_ns[0]) / period_ns) + 1 - len(self.stamp_ns)

    def off_grid(self, period_ns: float) -> float:
        """Largest distance [ns] of a stamp from the row of one every ``period_ns`` that begins with the first."""
        since_first = (self.stamp_ns - self.stamp_ns[0]).astype(float)
        return float(np.abs(since_first - np.round(since_first / period_ns) * period_ns).max())


@dataclass(frozen=True)
class Budget:
    """A quantity's change, and what the torque should have changed it by; ``exchanged`` sizes the mismatch."""

    change: float | Floats
    supplied: float | Floats
    exchanged: float

    @property
    def mismatch(self) -> float:
        """Length of the difference, in the unit of the quantity."""
        return float(np.linalg.norm(np.subtract(self.change, self.supplied)))

    @property
    def relative(self) -> float:
        """Mismatch as a part of all that was exchanged back and forth; the mismatch itself when nothing was."""
        return self.mismatch / (self.exchanged or 1.0)


def energy_budget(heard: Heard, body: Body) -> Budget:
    """Change of the rotational energy ½ ω·I ω [J] against the work ∫ ω·τ dt."""
    energy = 0.5 * np.einsum("ni,ij,nj->n", heard.angular_velocity, body.inertia, heard.angular_velocity)
    span, _, omega, torque = pieces(heard)
    work = (omega * torque).sum(axis=1) * span
    return Budget(energy[-1] - energy[0], work.sum(), np.abs(work).sum())


def momentum_budget(heard: Heard, body: Body) -> Budget:
    """Change of the angular momentum R I ω [N m s], world axes, about the centre of mass, against ∫ R τ dt."""
    first, last = (rotation.rotate(heard.orientation[k], body.inertia @ heard.angular_velocity[k]) for k in (0, -1))
    span, orientation, _, torque = pieces(heard)
    impulse = _rotate(orientation, torque) * span[:, None]
    return Budget(last - first, impulse.sum(axis=0), float(np.linalg.norm(impulse, axis=1).sum()))


def pieces(heard: Heard) -> tuple[Floats, Floats, Floats, Floats]:
    """The heard cut at every stamp and every command: span [s], and attitude, rate and torque in its middle.

    The torque is constant on a piece; attitude and rate are interpolated between the two stamps around it.
    """
    time, command_time = heard.time, heard.command_time
    cuts = np.union1d(time, command_time[(command_time > 0.0) & (command_time < time[-1])])
    middle = 0.5 * (cuts[1:] + cuts[:-1])
    omega = _interpolate(middle, time, heard.angular_velocity)
    orientation = _interpolate(middle, time, _continuous(heard.orientation))
    held = np.searchsorted(command_time, middle, side="right")  # the piece's command, and 0 before the first
    return np.diff(cuts), orientation, omega, np.vstack((np.zeros(3), heard.torque.reshape(-1, 3)))[held]


def _interpolate(at: Floats, time: Floats, values: Floats) -> Floats:
    return np.stack([np.interp(at, time, column) for column in values.T], axis=1)


def _continuous(orientation: Floats) -> Floats:
    """The same attitudes with signs such that neighbours are near each other: q and −q may alternate."""
    turns = np.sign((orientation[1:] * orientation[:-1]).sum(axis=1))
    return orientation * np.concatenate(([1.0], np.cumprod(turns)))[:, None]


def _rotate(orientation: Floats, vectors: Floats) -> Floats:
    return np.array([rotation.rotate(q, v) for q, v in zip(orientation, vectors, strict=True)])
