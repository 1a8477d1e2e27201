"""An inertial measurement unit: angular velocity and specific force where it is mounted, in its own axes (REP-145)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

from ..kernels import compiled, sensing
from ..kernels.compiled import Request
from .base import NO_NOISE, Group, Noise, Seen, Sensor, SensorType, Triple, noise_rows


@dataclass(frozen=True)
class Imu(Sensor):
    """A Sensor with a ``gyroscope`` [rad/s] and an ``accelerometer`` [m/s²], which shows +g upwards at rest.

    Its accelerations are those of the model, none is differentiated; see kernels.sensing.inertial.
    """

    type: ClassVar[str] = "imu"
    groups: ClassVar[tuple[Group, ...]] = (
        Group("gyroscope", "gyroscope.", 3),
        Group("accelerometer", "accelerometer.", 3),
    )

    gyroscope: Noise = NO_NOISE
    accelerometer: Noise = NO_NOISE


_EXAMPLES = (0.0,) * 19, (0.0,) * 6, (0.0,) * 3, (0.0,) * 7


def _truth(imu: Imu) -> Callable[[Seen], Sequence[Triple]]:
    mount = (*imu.position, *imu.orientation)
    inertial = compiled.ready(sensing.inertial, *_EXAMPLES)

    def truth(seen: Seen) -> Sequence[Triple]:
        wx, wy, wz, fx, fy, fz = inertial(seen.motion, seen.acceleration, seen.gravity, mount)
        return (wx, wy, wz), (fx, fy, fz)

    return truth


TYPE = SensorType(
    make=Imu,
    columns=("wx", "wy", "wz", "ax", "ay", "az"),
    truth=_truth,
    show=lambda imu: lambda values, seen: (*values[0], *values[1]),
    parameters=(
        *noise_rows(Imu.groups[0], "rad/s", "each rate of an imu"),
        *noise_rows(Imu.groups[1], "m/s²", "each specific force of an imu"),
    ),
    accelerations=True,
    kernels=(Request(sensing.inertial, _EXAMPLES),),
    example=Imu(
        "example",
        100.0,
        (0.3, -0.2, 0.1),
        (0.4, 0.2, -0.8, 0.4),
        7,
        gyroscope=Noise(1e-3, (0.01, -0.02, 0.03), 1e-4, 1e-3, 5.0),
        accelerometer=Noise(1e-2, (0.1, 0.2, -0.3), 1e-3, 5e-3, 20.0),
    ),
)
