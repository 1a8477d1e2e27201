"""A range finder: the distance along its x axis to the ground."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

from ..kernels.tuples import Quat, Vec, dot, rotate, unit
from ..values.parameter import shown
from .base import NO_NOISE, Group, Noise, Numbers, Seen, Sensor, SensorType, Triple, place, row

RADIATION = ("ultrasound", "infrared")  # in the order of sensor_msgs/Range


@dataclass(frozen=True)
class RangeFinder(Sensor):
    """A Sensor of the distance [m] from its origin along its x axis to the plane of the ground, by default z = 0.

    What is beyond ``range`` [m], or not there, shows as +inf, and what is nearer than ``min_range`` as -inf (REP-117).
    ``field_of_view`` [rad] and ``radiation`` are for messages: it measures along a line. Raises ValueError for a range
    that is not above min_range.
    """

    type: ClassVar[str] = "range"
    groups: ClassVar[tuple[Group, ...]] = (
        Group("noise", "", 1, ("noise_density", "bias", "random_walk", "quantization")),
    )

    range: float = 0.0
    min_range: float = 0.0
    field_of_view: float = 0.0
    radiation: str = "infrared"
    noise: Noise = NO_NOISE

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("range", "min_range", "field_of_view"):
            self._set(name, self._number(name, getattr(self, name)))
        if self.range <= self.min_range:
            raise ValueError(f"{self}: range {self.range:g} m is not above min_range {self.min_range:g} m; give more")
        if self.radiation not in RADIATION:
            raise ValueError(f"{self}: radiation {shown(self.radiation)} is not known; give {' or '.join(RADIATION)}")


def _truth(one: RangeFinder) -> Callable[[Seen], Sequence[Triple]]:
    axis_body = rotate(Quat(*one.orientation), unit(0))

    def truth(seen: Seen) -> Sequence[Triple]:
        normal, axis = Vec(*seen.ground.unit_normal.tolist()), rotate(Quat(*seen.motion[3:7]), axis_body)
        above, nearing = dot(normal, Vec(*place(one, seen.motion))) - seen.ground.height, -dot(normal, axis)
        return ((above / nearing if nearing > 0.0 else math.inf, 0.0, 0.0),)

    return truth


def _show(one: RangeFinder) -> Callable[[Sequence[Triple], Seen], Numbers]:
    def show(values: Sequence[Triple], seen: Seen) -> Numbers:
        distance = values[0][0]
        return (math.inf if distance > one.range else -math.inf if distance < one.min_range else distance,)

    return show


TYPE = SensorType(
    make=RangeFinder,
    columns=("range",),
    truth=_truth,
    show=_show,
    own=("range", "min_range", "field_of_view", "radiation"),
    parameters=(
        row(
            "min_range",
            float,
            0.0,
            "Of range: what is nearer shows as -inf, and what is beyond its range, which must be given, as +inf.",
            "m",
            least=0.0,
        ),
        row("field_of_view", float, 0.0, "Of range: what its messages say.", "rad", least=0.0),
        row("radiation", str, "infrared", "Of range: what its messages say.", choices=RADIATION),
    ),
    example=RangeFinder(
        "example",
        50.0,
        (0.3, -0.2, 0.1),
        (0.5**0.5, 0.0, 0.5**0.5, 0.0),
        7,
        range=30.0,
        min_range=0.2,
        noise=Noise(1e-3, (0.01,), 1e-2, 1e-3),
    ),
)
