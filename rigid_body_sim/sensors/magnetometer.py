"""A magnetometer: the flux density of a field that is the same everywhere, or of a dipole, in its own axes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..kernels.arrays import Floats, Vector
from ..kernels.tuples import Quat, Vec, rotate_back
from ..values.wrench import ZERO
from .base import NO_NOISE, Group, Noise, Seen, Sensor, SensorType, Triple, place, row

_PER_DIPOLE = 1e-7  # μ₀ / 4π [T m/A]


@dataclass(frozen=True)
class Magnetometer(Sensor):
    """A Sensor of the sum of a uniform ``field`` [T, world axes] and that of a ``dipole_moment`` [A m², world axes].

    The dipole is at ``dipole_position`` [m, world axes]; where the sensor is there, too, it shows the former alone.
    """

    type: ClassVar[str] = "magnetometer"
    groups: ClassVar[tuple[Group, ...]] = (Group("noise", "", 3),)

    field: Vector = ZERO
    dipole_moment: Vector = ZERO
    dipole_position: Vector = ZERO
    noise: Noise = NO_NOISE

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("field", "dipole_moment", "dipole_position"):
            self._vector(name)


def dipole_field(moment: Vector, r: Floats) -> Floats:
    """μ₀/4π (3 r̂ (m · r̂) − m) / |r|³ [T] at r [m] from the dipole (Jackson, Classical Electrodynamics, 5.56)."""
    distance = float(np.linalg.norm(r))
    if distance == 0.0:
        return np.zeros(3)
    along = r / distance
    return _PER_DIPOLE * (3.0 * along * np.dot(moment, along) - moment) / distance**3


def _truth(one: Magnetometer) -> Callable[[Seen], Sequence[Triple]]:
    uniform, turn = Vec(*one.field), Quat(*one.orientation)

    def truth(seen: Seen) -> Sequence[Triple]:
        field = uniform
        if any(one.dipole_moment):
            r = np.subtract(place(one, seen.motion), one.dipole_position)
            field = Vec(*np.add(uniform, dipole_field(one.dipole_moment, r)).tolist())
        return (rotate_back(turn, rotate_back(Quat(*seen.motion[3:7]), field)),)

    return truth


TYPE = SensorType(
    make=Magnetometer,
    columns=("bx", "by", "bz"),
    truth=_truth,
    show=lambda one: lambda values, seen: values[0],
    own=("field", "dipole.moment", "dipole.position"),
    parameters=(
        row("field", tuple, ZERO, "Of a magnetometer: uniform magnetic field, world axes.", "T", length=3),
        row("dipole.moment", tuple, ZERO, "Of a magnetometer: a dipole beside that, world axes.", "A m²", length=3),
        row("dipole.position", tuple, ZERO, "Where that dipole is, world axes.", "m", length=3),
    ),
    example=Magnetometer(
        "example",
        50.0,
        (0.3, -0.2, 0.1),
        (0.4, 0.2, -0.8, 0.4),
        7,
        field=(2e-5, 1e-6, -4e-5),
        dipole_moment=(10.0, -20.0, 40.0),
        dipole_position=(1.0, 2.0, -3.0),
        noise=Noise(1e-8, (1e-6, -2e-6, 3e-6), 1e-9, 1e-7, 1e-4),
    ),
)
