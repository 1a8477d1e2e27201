"""Quaternion feedback: the torque that turns a body to a target attitude and holds it there. No ROS."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..kernels.arrays import Floats
from ..scene import schema
from ..values import inertia as inertia_module
from ..values import rotation
from ..values.parameter import Parameter

# The inertia is that of config/satellite.yaml.
PARAMETERS = (
    *schema.attitude("target", "the attitude to hold, body to world"),
    Parameter(
        "inertia",
        tuple,
        (0.143956, 0.185168, 0.061212, 0.0, 0.0, 0.0),
        "ixx, iyy, izz, ixy, ixz, iyz, body axes.",
        "kg m²",
    ),
    Parameter("natural_frequency", float, 1.5, "Of the closed loop for small angles.", "rad/s", above=0.0),
    Parameter("damping_ratio", float, 1.0, "Of the closed loop for small angles; 1 = no overshoot.", above=0.0),
    Parameter(
        "max_torque",
        float,
        0.05,
        "Longest torque vector commanded; a longer one is shortened and keeps its direction.",
        "N m",
        above=0.0,
    ),
    Parameter(
        "frame_id",
        str,
        "",
        "Body frame for the commands' headers; empty = the one that twist is expressed in.",
        optional=True,
    ),
)


@dataclass(frozen=True)
class PointingLaw:
    """τ = −I (2 ω_n² ε + 2 ζ ω_n ω), with ε the vector part of target⁻¹ ⊗ q; Wie & Barba, J. Guidance 8 (1985) 360.

    For small angles every axis behaves as an oscillator of natural frequency ω_n [rad/s], one for all or one for each
    body axis, shape (3,), and damping ratio ζ. A torque longer than ``max_torque`` [N m] is shortened and keeps its
    direction. ω_n ε is no longer than ζ ``max_rate``, so that from far away the body turns with that rate [rad/s]
    (Wie & Lu, J. Guidance 18 (1995) 1372).
    """

    target: Floats  # unit quaternion (w, x, y, z), body → world
    inertia: Floats  # (3, 3) [kg m²], as the controller believes it to be, body axes
    natural_frequency: float | Floats
    damping_ratio: float
    max_torque: float = math.inf
    max_rate: float = math.inf

    def torque(self, orientation: ArrayLike, angular_velocity: ArrayLike) -> Floats:
        """Torque [N m], body axes, shape (3,), for an attitude (w, x, y, z) and an angular velocity [rad/s].

        The attitude is body → world, the angular velocity in body axes. Raises ValueError when either is not finite or
        the attitude is no direction.
        """
        w, *vector_part = rotation.multiply(rotation.conjugate(self.target), rotation.normalize(orientation))
        omega = np.asarray(angular_velocity, float)
        if not np.isfinite(omega).all():
            raise ValueError(f"angular velocity {omega.tolist()} is not finite")
        # q and −q are one attitude; the sign of w picks the way that is shorter than half a turn.
        error = math.copysign(1.0, w) * np.array(vector_part)
        pull = shortened(self.natural_frequency * error, self.damping_ratio * self.max_rate)
        acceleration = 2.0 * self.natural_frequency * (pull + self.damping_ratio * omega)
        return shortened(-self.inertia @ acceleration, self.max_torque)


def pointing_law(
    target: ArrayLike, inertia: ArrayLike, natural_frequency: float, damping_ratio: float, max_torque: float
) -> PointingLaw:
    """The law, its numbers checked. Raises ValueError with the reason when one of them is of no use."""
    for name, value in (
        ("natural_frequency", natural_frequency),
        ("damping_ratio", damping_ratio),
        ("max_torque", max_torque),
    ):
        if not 0.0 < value < math.inf:
            raise ValueError(f"{name} {value:g} is not a finite number greater than zero")
    matrix = inertia_module.as_matrix(inertia)
    inertia_module.check(matrix)
    return PointingLaw(rotation.normalize(target), matrix, natural_frequency, damping_ratio, max_torque)


def shortened(vector: Floats, longest: float) -> Floats:
    """``vector``, or the vector of the same direction and the length ``longest`` when it is longer."""
    length = float(np.linalg.norm(vector))
    return vector if length <= longest else vector * (longest / length)
