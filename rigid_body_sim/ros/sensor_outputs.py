"""The messages of sensors: for each type one that holds all that stays the same, and which of its fields change."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from sensor_msgs.msg import FluidPressure, Imu, MagneticField, NavSatFix, NavSatStatus, Range

from ..scene.loader import Scene
from ..sensors.instrument import Instrument
from ..sensors.range_finder import RADIATION
from .messages import inside

Fields = tuple[str, ...]
Numbers = tuple[float, ...]
_UNKNOWN = [-1.0] + 8 * [0.0]  # covariance of what a message does not have, by sensor_msgs/Imu


def _diagonal(*variances: float) -> list[float]:
    return np.diag(variances).reshape(-1).tolist()


def _xyz(path: str) -> Fields:
    return tuple(f"{path}.{axis}" for axis in "xyz")


def _imu(one: Instrument) -> tuple[Any, Fields]:
    gyroscope, accelerometer = one.variances
    message = Imu(
        orientation_covariance=_UNKNOWN,
        angular_velocity_covariance=_diagonal(*3 * [gyroscope]),
        linear_acceleration_covariance=_diagonal(*3 * [accelerometer]),
    )
    return message, _xyz("angular_velocity") + _xyz("linear_acceleration")


def _magnetometer(one: Instrument) -> tuple[Any, Fields]:
    return MagneticField(magnetic_field_covariance=_diagonal(*3 * one.variances)), _xyz("magnetic_field")


def _gnss(one: Instrument) -> tuple[Any, Fields]:
    horizontal, vertical = one.variances
    message = NavSatFix(
        status=NavSatStatus(status=NavSatStatus.STATUS_FIX, service=NavSatStatus.SERVICE_GPS),
        position_covariance=_diagonal(horizontal, horizontal, vertical),
        position_covariance_type=NavSatFix.COVARIANCE_TYPE_DIAGONAL_KNOWN,
    )
    return message, ("latitude", "longitude", "altitude")


def _barometer(one: Instrument) -> tuple[Any, Fields]:
    return FluidPressure(variance=one.variances[0]), ("fluid_pressure",)


def _range(one: Instrument) -> tuple[Any, Fields]:
    sensor: Any = one.sensor
    message = Range(
        radiation_type=RADIATION.index(sensor.radiation),
        field_of_view=sensor.field_of_view,
        min_range=sensor.min_range,
        max_range=sensor.range,
    )
    if hasattr(message, "variance"):  # since Jazzy
        message.variance = one.variances[0]
    return message, ("range",)


def _pose(one: Instrument) -> tuple[Any, Fields]:
    translation, turn = one.variances
    message = PoseWithCovarianceStamped()
    message.pose.covariance = _diagonal(*3 * [translation], *3 * [turn])
    return message, _xyz("pose.pose.position") + tuple(f"pose.pose.orientation.{part}" for part in "xyzw")


MESSAGES: dict[str, Callable[[Instrument], tuple[Any, Fields]]] = {  # by type
    "imu": _imu,
    "magnetometer": _magnetometer,
    "gnss": _gnss,
    "barometer": _barometer,
    "range": _range,
    "pose": _pose,
}


# Where what a type shows is not in the order of its message's fields, what puts it there.
ORDERS: dict[str, Callable[[Numbers], Numbers]] = {"pose": lambda shown: (*shown[:3], *shown[4:], shown[3])}


def message_of(one: Instrument, scene: Scene, space: str = "") -> tuple[Any, Fields]:
    """What an instrument publishes, and the fields in it that change. Names of frames begin with the body's, if any."""
    message, fields = MESSAGES[one.type.name](one)
    message.header.frame_id = scene["world_frame_id"] if one.type.name == "pose" else inside(space, one.sensor.frame_id)
    return message, fields


def frames(made: Sequence[Instrument], scene: Scene, space: str = "") -> list[Any]:
    """The transforms from the body's frame to those of sensors."""
    transforms = []
    for one in made:
        transform = TransformStamped(child_frame_id=inside(space, one.sensor.frame_id))
        transform.header.frame_id = scene["body.frame_id"]
        t, r = transform.transform.translation, transform.transform.rotation
        t.x, t.y, t.z = one.sensor.position
        r.w, r.x, r.y, r.z = one.sensor.orientation
        transforms.append(transform)
    return transforms
