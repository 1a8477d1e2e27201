"""A receiver of satellite navigation: where its antenna is on the ellipsoid WGS-84, by pyproj (PROJ)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from .base import NO_NOISE, Group, Noise, Numbers, Seen, Sensor, SensorType, Triple, noise_rows, place, row

_FURTHEST = {"origin_latitude": 90.0, "origin_longitude": 180.0}


@dataclass(frozen=True)
class Gnss(Sensor):
    """A Sensor of latitude [°], longitude [°] and altitude [m] above the ellipsoid.

    The world's axes are east, north and up where its origin is, at ``origin_latitude`` [°], ``origin_longitude`` [°]
    and ``origin_altitude`` [m]. The noise is one of metres, ``horizontal`` to the east and north, and ``vertical``,
    there. Raises ValueError beyond ±90° and ±180°, and where pyproj is not installed.
    """

    type: ClassVar[str] = "gnss"
    groups: ClassVar[tuple[Group, ...]] = (
        Group("horizontal", "horizontal.", 2, ("noise_density", "bias", "random_walk", "quantization")),
        Group("vertical", "vertical.", 1, ("noise_density", "bias", "random_walk", "quantization")),
    )

    origin_latitude: float = 0.0
    origin_longitude: float = 0.0
    origin_altitude: float = 0.0
    horizontal: Noise = NO_NOISE
    vertical: Noise = NO_NOISE

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("origin_latitude", "origin_longitude", "origin_altitude"):
            value = self._number(name, getattr(self, name), least=-_FURTHEST.get(name, 1e308))
            if value > _FURTHEST.get(name, 1e308):
                raise ValueError(
                    f"{self}: {name} {value:g} is more than {_FURTHEST[name]:g}; give degrees, north and east positive"
                )
            self._set(name, value)


def _pyproj(gnss: Gnss) -> Any:
    try:
        import pyproj
    except ImportError as reason:
        raise ValueError(
            f"{gnss}: type gnss needs pyproj, which cannot be imported ({reason}); install it (apt install "
            "python3-pyproj, or pip install pyproj) or leave the sensor out"
        ) from None
    return pyproj


def to_geodetic(gnss: Gnss) -> Callable[[float, float, float], Numbers]:
    """What makes longitude [°], latitude [°] and altitude [m] of metres to the east, north and up of the origin.

    By earth-centred axes, so the Earth is round at any distance. PROJ's way back from those is within 2e-6 m up to
    10 km above the ellipsoid, and within 2 mm at 400 km.
    """
    at = f"+lat_0={gnss.origin_latitude!r} +lon_0={gnss.origin_longitude!r} +h_0={gnss.origin_altitude!r}"
    steps = f"+step +inv +proj=topocentric +ellps=WGS84 {at} +step +inv +proj=cart +ellps=WGS84"
    pipeline = f"+proj=pipeline {steps} +step +proj=unitconvert +xy_in=rad +xy_out=deg"
    transform: Callable[[float, float, float], Numbers] = _pyproj(gnss).Transformer.from_pipeline(pipeline).transform
    return transform


def _truth(gnss: Gnss) -> Callable[[Seen], Sequence[Triple]]:
    def truth(seen: Seen) -> Sequence[Triple]:
        x, y, z = place(gnss, seen.motion)
        return (x, y, 0.0), (z, 0.0, 0.0)

    return truth


def _show(gnss: Gnss) -> Callable[[Sequence[Triple], Seen], Numbers]:
    transform = to_geodetic(gnss)

    def show(values: Sequence[Triple], seen: Seen) -> Numbers:
        longitude, latitude, altitude = transform(values[0][0], values[0][1], values[1][0])
        return latitude, longitude, altitude

    return show


TYPE = SensorType(
    make=Gnss,
    columns=("latitude", "longitude", "altitude"),
    truth=_truth,
    show=_show,
    own=("origin.latitude", "origin.longitude", "origin.altitude"),
    parameters=(
        row(
            "origin.latitude",
            float,
            0.0,
            "Of gnss: of the world's origin, whose axes are east, north, up.",
            "°",
            least=-90.0,
            most=90.0,
        ),
        row("origin.longitude", float, 0.0, "The same.", "°", least=-180.0, most=180.0),
        row(
            "origin.altitude",
            float,
            0.0,
            "The same, above the ellipsoid WGS-84; of a barometer, above mean sea level.",
            "m",
        ),
        *noise_rows(Gnss.groups[0], "m", "the position of gnss, to the east and north"),
        *noise_rows(Gnss.groups[1], "m", "the altitude of gnss"),
    ),
    example=Gnss(
        "example",
        10.0,
        (0.3, -0.2, 0.1),
        seed=7,
        origin_latitude=47.397742,
        origin_longitude=8.545594,
        origin_altitude=488.0,
        horizontal=Noise(0.3, (1.0, -2.0), 0.01, 0.01),
        vertical=Noise(0.6, (3.0,), 0.02, 0.01),
    ),
)
