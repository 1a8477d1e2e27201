"""What a rigid body is: mass, inertia and where its centre of mass sits."""

import math

import numpy as np
from numpy.typing import ArrayLike

from ..kernels.arrays import Floats, plain
from . import inertia as inertia_module


class Body:
    """A rigid body with a body frame fixed to it.

    Parameters
    ----------
    mass : float
        Mass [kg], from 1e-100 to 1e100.
    inertia : array_like
        Inertia [kg m²] about the centre of mass in body axes: 3 principal moments, 6 entries (ixx, iyy, izz, ixy, ixz,
        iyz) as in URDF, or a matrix (3, 3).
    center_of_mass : array_like, shape (3,)
        Centre of mass [m] from the body frame's origin, body axes.

    Raises
    ------
    ValueError
        Mass not positive, inertia that no body can have, a value that is not finite or beyond the range of masses,
        moments and lengths (values.inertia.LEAST, MOST), a wrong shape: each with its reason.

    Attributes
    ----------
    principal_moments : array, shape (3,)
        Diagonal of I₀ [kg m²]; theory (2.4.12).
    q_body_principal : array, shape (4,)
        Unit quaternion, principal axes → body axes.
    """

    def __init__(self, mass: float, inertia: ArrayLike, center_of_mass: ArrayLike = (0.0, 0.0, 0.0)):
        self.mass = positive(mass, "mass", "kg")
        self.inertia = inertia_module.as_matrix(inertia)
        inertia_module.check(self.inertia)
        self.center_of_mass = np.array(center_of_mass, float)
        if self.center_of_mass.shape != (3,) or not np.isfinite(self.center_of_mass).all():
            raise ValueError(f"center_of_mass {plain(center_of_mass)!r} must be three finite numbers in m")
        if np.abs(self.center_of_mass).max() > inertia_module.MOST:
            raise ValueError(
                f"center_of_mass {plain(center_of_mass)!r} is farther than {inertia_module.MOST:g} m from the origin"
            )
        self.principal_moments, self.q_body_principal = inertia_module.principal_axes(self.inertia)
        for array in (self.inertia, self.center_of_mass, self.principal_moments, self.q_body_principal):
            array.flags.writeable = False

    @property
    def inertia_entries(self) -> Floats:
        """(ixx, iyy, izz, ixy, ixz, iyz) [kg m²], body axes, about the centre of mass."""
        return self.inertia[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)]

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Body):
            return NotImplemented
        return (
            self.mass == other.mass
            and np.array_equal(self.inertia, other.inertia)
            and np.array_equal(self.center_of_mass, other.center_of_mass)
        )

    def __repr__(self) -> str:
        return (
            f"Body(mass={self.mass!r}, inertia={self.inertia_entries.tolist()}, "
            f"center_of_mass={self.center_of_mass.tolist()})"
        )


def positive(value: float, name: str, unit: str) -> float:
    """``value`` as a float. Raises ValueError, naming it, unless it is positive, and from inertia.LEAST to MOST."""
    number = float(value)
    if not 0.0 < number < math.inf:
        raise ValueError(f"{name} {number:g} {unit} is not a finite number greater than zero")
    if not inertia_module.LEAST <= number <= inertia_module.MOST:
        raise ValueError(
            f"{name} {number:g} {unit} is not between {inertia_module.LEAST:g} and {inertia_module.MOST:g} {unit}; "
            "beyond these, products of floats under- or overflow"
        )
    return number
