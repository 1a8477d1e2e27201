"""Forces and torques held constant between two commands."""

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ..kernels.arrays import Floats, Vector, plain
from ..kernels.vectors import cross, qrotate_back

PointForce = tuple[Sequence[float], Sequence[float]]  # where [m, body axes from its origin], force there [N, world]

ZERO = (0.0, 0.0, 0.0)
NO_POINTS: tuple[()] = ()
_LEAST, _MOST = -math.inf, math.inf


class Wrench:
    """Forces and torques on a body, each held in its own axes; everything given adds up.

    Parameters
    ----------
    force_body, torque_body : sequence of 3 floats
        Force [N] at the body frame's origin and torque [N m], body axes: they turn with the body.
    force_world, torque_world : sequence of 3 floats
        Force [N] at the centre of mass and torque [N m], world axes: they keep their direction while the body turns.
    points : iterable of (point, force)
        Forces [N] in world axes, each at a body-fixed point [m] given from the body frame's origin in body axes. The
        force keeps its direction, its arm turns with the body; theory (2.3.4).

    Raises
    ------
    ValueError
        A value that is not finite, or not three of them.
    """

    __slots__ = ("points", "turns", "values")

    def __init__(
        self,
        force_body: Sequence[float] = ZERO,
        torque_body: Sequence[float] = ZERO,
        force_world: Sequence[float] = ZERO,
        torque_world: Sequence[float] = ZERO,
        points: Iterable[PointForce] = NO_POINTS,
    ):
        # This runs once per command, at up to 10 kHz: unpacking checks the length, one sum the finiteness.
        values: tuple[float, ...] | None
        try:
            fx, fy, fz = force_body
            tx, ty, tz = torque_body
            gx, gy, gz = force_world
            ux, uy, uz = torque_world
            total = fx + fy + fz + tx + ty + tz + gx + gy + gz + ux + uy + uz
            values = (fx, fy, fz, tx, ty, tz, gx, gy, gz, ux, uy, uz) if _LEAST < total < _MOST else None
        except (TypeError, ValueError, OverflowError):
            values = None
        if values is None:
            fx, fy, fz, tx, ty, tz, gx, gy, gz, ux, uy, uz = values = self._read_with_care(
                force_body=force_body, torque_body=torque_body, force_world=force_world, torque_world=torque_world
            )
        self.values = values
        self.points = points if points is NO_POINTS else tuple(map(_point, points))
        # Whether it may turn a body, or turns with it: whether it is anything but a force in world axes.
        self.turns = bool(tx or ty or tz or fx or fy or fz or ux or uy or uz or self.points)

    @property
    def force_body(self) -> Floats:
        """Force [N] at the body frame's origin, body axes, shape (3,)."""
        return np.array(self.values[0:3], float)

    @property
    def torque_body(self) -> Floats:
        """Torque [N m], body axes, shape (3,)."""
        return np.array(self.values[3:6], float)

    @property
    def force_world(self) -> Floats:
        """Force [N] at the centre of mass, world axes, shape (3,)."""
        return np.array(self.values[6:9], float)

    @property
    def torque_world(self) -> Floats:
        """Torque [N m], world axes, shape (3,)."""
        return np.array(self.values[9:12], float)

    def about_origin(self, q: Sequence[float], center_of_mass: Sequence[float]) -> tuple[float, ...]:
        """Everything added up, as force [N] and torque [N m] about the body frame's origin, body axes: 6 numbers.

        At the attitude q, a unit quaternion body → world, of a body with that centre of mass [m, body axes].
        """
        fx, fy, fz, tx, ty, tz = self.values[0:6]
        ux, uy, uz = qrotate_back(*q, *self.values[9:12])
        tx, ty, tz = tx + ux, ty + uy, tz + uz
        for arm, force in ((center_of_mass, self.values[6:9]), *self.points):
            gx, gy, gz = qrotate_back(*q, *force)
            ax, ay, az = arm
            ux, uy, uz = cross(ax, ay, az, gx, gy, gz)
            fx, fy, fz = fx + gx, fy + gy, fz + gz
            tx, ty, tz = tx + ux, ty + uy, tz + uz
        return fx, fy, fz, tx, ty, tz

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Wrench) and self.values == other.values and self.points == other.points

    def __repr__(self) -> str:
        f, t, g, u = (list(self.values[i : i + 3]) for i in (0, 3, 6, 9))
        points = f", points={plain(self.points)}" if self.points else ""
        return f"Wrench(force_body={f}, torque_body={t}, force_world={g}, torque_world={u}{points})"

    @staticmethod
    def _read_with_care(**given: Sequence[float]) -> tuple[float, ...]:
        """The twelve values as floats. Raises the sentence for the first that breaks a rule, or for their sum."""
        values = tuple(number for name, value in given.items() for number in three_finite(value, name))
        if not math.isfinite(sum(values)):
            shown = ", ".join(f"{name} {plain(value)}" for name, value in given.items())
            raise ValueError(f"wrench {shown} is too large; the sum of its components must be a finite number")
        return values


def total(wrenches: Iterable[Wrench]) -> Wrench:
    """All of them at once, the same to the bit in any order. Raises ValueError when the sum is not finite."""
    given = tuple(wrenches)
    try:
        values = tuple(map(math.fsum, zip(*(wrench.values for wrench in given), strict=True))) or (0.0,) * 12
    except OverflowError:
        raise ValueError(f"the wrenches {list(given)} add up to more than a float holds; give smaller ones") from None
    points = [point for wrench in given for point in wrench.points]
    return Wrench(values[0:3], values[3:6], values[6:9], values[9:12], points or NO_POINTS)


def number(value: Any, name: str) -> float:
    """``value`` as a float, which may not be finite. Raises ValueError, naming ``name``, when it is none."""
    try:
        return _float(value)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{name} {plain(value)!r} is not a number") from None


def _float(value: Any) -> float:
    """Python also makes numbers of texts."""
    if isinstance(value, str | bytes | bytearray):
        raise TypeError
    return float(value)


def three_finite(value: Vector, name: str) -> tuple[float, float, float]:
    """``value`` as three finite floats. Raises ValueError, naming ``name``, when it is anything else."""
    try:
        numbers = () if isinstance(value, bytes) else tuple(map(_float, value))
    except (TypeError, ValueError, OverflowError):
        numbers = ()
    if len(numbers) != 3 or not all(math.isfinite(component) for component in numbers):
        raise ValueError(f"{name} {plain(value)!r} must be three finite numbers (x, y, z)")
    return numbers


def _point(entry: tuple[Sequence[float], Sequence[float]]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    try:
        point, force = entry
    except (TypeError, ValueError):
        raise ValueError(
            f"point {plain(entry)!r} must be a pair: where (x, y, z), and the force there (x, y, z)"
        ) from None
    return three_finite(point, "point"), three_finite(force, "force at a point")
