"""A pose in the world, as motion capture gives it: of markers that are fixed to the body."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

from ..kernels.tuples import NOTHING
from ..values import rotation
from .base import NO_NOISE, Group, Noise, Numbers, Seen, Sensor, SensorType, Triple, noise_rows, place


@dataclass(frozen=True)
class PoseSensor(Sensor):
    """A Sensor of the pose of its own frame in the world: position [m] and quaternion (w, x, y, z).

    The noise of ``translation`` [m] is along the world's axes; that of ``rotation`` [rad] is a small rotation vector in
    its own axes, by which the attitude is turned on.
    """

    type: ClassVar[str] = "pose"
    groups: ClassVar[tuple[Group, ...]] = (
        Group("translation", "translation.", 3, ("noise_density", "bias", "random_walk", "quantization")),
        Group("rotation", "rotation.", 3, ("noise_density", "bias", "random_walk")),
    )

    translation: Noise = NO_NOISE
    rotation: Noise = NO_NOISE


def _truth(one: PoseSensor) -> Callable[[Seen], Sequence[Triple]]:
    def truth(seen: Seen) -> Sequence[Triple]:
        return place(one, seen.motion), NOTHING

    return truth


def _show(one: PoseSensor) -> Callable[[Sequence[Triple], Seen], Numbers]:
    def show(values: Sequence[Triple], seen: Seen) -> Numbers:
        q = rotation.multiply(seen.motion[3:7], one.orientation)
        if any(values[1]):
            q = rotation.multiply(q, rotation.from_axis_angle(values[1], math.hypot(*values[1])))
        return *values[0], *q.tolist()

    return show


TYPE = SensorType(
    make=PoseSensor,
    columns=("x", "y", "z", "qw", "qx", "qy", "qz"),
    truth=_truth,
    show=_show,
    parameters=(
        *noise_rows(PoseSensor.groups[0], "m", "each coordinate of a pose"),
        *noise_rows(PoseSensor.groups[1], "rad", "each small angle of a pose"),
    ),
    example=PoseSensor(
        "example",
        100.0,
        (0.3, -0.2, 0.1),
        (0.4, 0.2, -0.8, 0.4),
        7,
        translation=Noise(1e-3, (0.01, 0.02, -0.03), 1e-4, 1e-4),
        rotation=Noise(1e-3, (0.01, -0.01, 0.02), 1e-4),
    ),
)
