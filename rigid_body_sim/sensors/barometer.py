"""A barometer: static pressure by the International Standard Atmosphere, ISO 2533:1975 (ICAO Doc 7488/3)."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

from .base import NO_NOISE, Group, Noise, Seen, Sensor, SensorType, Triple, place

_RADIUS = 6_356_766.0  # m, of the Earth in ISO 2533
_G_M_BY_R = 9.80665 * 0.0289644 / 8.31432  # K/m: gravity, molar mass of air, gas constant as they are there
_SEA_LEVEL = 101_325.0  # Pa
_LAYERS = (  # geopotential altitude [m] at which it begins, temperature there [K], and how that changes [K/m]
    (0.0, 288.15, -0.0065),
    (11_000.0, 216.65, 0.0),
    (20_000.0, 216.65, 0.001),
    (32_000.0, 228.65, 0.0028),
    (47_000.0, 270.65, 0.0),
    (51_000.0, 270.65, -0.0028),
    (71_000.0, 214.65, -0.002),
    (80_000.0, 196.65, 0.0),  # where the standard ends
)
_TOPS = (*(begin for begin, _, _ in _LAYERS[1:]), math.inf)
_LOWEST = -5_000.0  # m, where Doc 7488/3 begins


@dataclass(frozen=True)
class Barometer(Sensor):
    """A Sensor of pressure [Pa], at the height z of the world above ``origin_altitude`` [m above mean sea level].

    Above 80 km the air is taken as of one temperature, and below -5 km the pressure as that there.
    """

    type: ClassVar[str] = "barometer"
    groups: ClassVar[tuple[Group, ...]] = (Group("noise", "", 1),)

    origin_altitude: float = 0.0
    noise: Noise = NO_NOISE

    def __post_init__(self) -> None:
        super().__post_init__()
        self._set("origin_altitude", self._number("origin_altitude", self.origin_altitude, -math.inf))


def pressure(altitude: float) -> float:
    """Pressure [Pa] at a geometric altitude [m], by layers in which temperature is linear in the geopotential one.

    dp/dh = −p g M / (R T) gives p = p_b (T_b / T)^(g M / (R β)), or an exponential where the slope β is 0.
    """
    altitude = max(altitude, _LOWEST)
    h, p = altitude / (1.0 + altitude / _RADIUS), _SEA_LEVEL
    for (begin, warmth, slope), top in zip(_LAYERS, _TOPS, strict=True):
        if h < begin and begin > 0.0:
            break
        rise = min(h, top) - begin
        if slope == 0.0:
            p *= math.exp(-_G_M_BY_R * rise / warmth)
        else:
            p *= (1.0 + slope * rise / warmth) ** (-_G_M_BY_R / slope)
    return p


def _truth(one: Barometer) -> Callable[[Seen], Sequence[Triple]]:
    def truth(seen: Seen) -> Sequence[Triple]:
        return ((pressure(one.origin_altitude + place(one, seen.motion)[2]), 0.0, 0.0),)

    return truth


TYPE = SensorType(
    make=Barometer,
    columns=("pressure",),
    truth=_truth,
    show=lambda one: lambda values, seen: values[0][:1],
    own=("origin.altitude",),
    example=Barometer(
        "example", 50.0, (0.3, -0.2, 0.1), seed=7, origin_altitude=488.0, noise=Noise(1.0, (50.0,), 0.1, 0.5, 1.2e5)
    ),
)
