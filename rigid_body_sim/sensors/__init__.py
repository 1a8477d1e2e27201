"""Sensors, which see of the motion what real ones do: one file a type, and the registry that names them."""

from collections.abc import Mapping, Sequence
from typing import Any

from ..values.parameter import Parameter
from ..values.wrench import ZERO
from . import barometer, gnss, imu, magnetometer, pose, range_finder
from .base import Group, Sensor, SensorType, noise_rows, row

_ALL = (imu.TYPE, magnetometer.TYPE, gnss.TYPE, barometer.TYPE, range_finder.TYPE, pose.TYPE)
REGISTRY: dict[str, SensorType] = {kind.name: kind for kind in _ALL}

OF_ALL: tuple[Parameter, ...] = (
    row("type", str, "imu", "What it is.", choices=tuple(REGISTRY), required=True),
    row(
        "rate",
        float,
        0.0,
        "Measurements a second of simulated time; must divide rate; 0 = every step.",
        "Hz",
        least=0.0,
    ),
    row("position", tuple, ZERO, "Where it is, from the body frame's origin, body axes.", "m", length=3),
)
ROWS: tuple[Parameter, ...] = (
    row("seed", int, 0, "Of its noise, which is a function of this, its name and the sample.", least=0),
    row(
        "delay",
        float,
        0.0,
        "From a measurement to its message, whose stamp is of the former; whole steps.",
        "s",
        least=0.0,
    ),
    row("frame_id", str, "", "Name of its frame in headers and on /tf_static; empty = its own name.", optional=True),
    *noise_rows(Group("noise", "", 3), "T, Pa, m", "a magnetometer, barometer or range"),
    *(one for kind in _ALL for one in kind.parameters),
)


def read(name: str, values: Mapping[str, Any], orientation: Sequence[float]) -> Sensor:
    """The sensor of that name in the parameters of a scene. Raises ValueError for one that its type does not have."""
    kind = REGISTRY[values[f"sensors.{name}.type"]]
    for one in ROWS:
        full = one.name.replace("<name>", name)
        if not kind.has(one) and values.get(full, one.default) != one.default:
            raise ValueError(
                f"parameter {full}: a sensor of type {kind.name} has no such parameter, but {', '.join(kind.names)}; "
                "leave it out"
            )
    sensor: Sensor = kind.read(name, values, orientation)
    return sensor


__all__ = ["OF_ALL", "REGISTRY", "ROWS", "Sensor", "SensorType", "read"]
