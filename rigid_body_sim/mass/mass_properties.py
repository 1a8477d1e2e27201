"""Mass, centre of mass and inertia of a thing, and of an assembly of several (theory 2.4)."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..kernels.arrays import Floats, Vector
from ..values import inertia as inertia_module
from ..values import rotation
from ..values.body import Body, positive
from ..values.wrench import ZERO, three_finite


@dataclass(frozen=True, eq=False, init=False)
class MassProperties:
    """What a mass distribution is to a rigid body.

    Unlike a Body it may be a point or a thin rod, whose tensor has zero moments: as part of an assembly these make
    sense.

    Parameters
    ----------
    mass : float
        Mass [kg], greater than zero.
    inertia : array_like
        Inertia [kg m²] about the centre of mass, given as for Body; kept as a matrix (3, 3).
    center_of_mass : array_like, shape (3,)
        Centre of mass [m] from the frame's origin, in the frame's axes.

    Raises
    ------
    ValueError
        Mass not positive, a value that is not finite, a wrong shape, a tensor that is not symmetric.
    """

    mass: float
    inertia: Floats
    center_of_mass: Floats

    def __init__(self, mass: float, inertia: ArrayLike, center_of_mass: Vector = ZERO):
        object.__setattr__(self, "mass", positive(mass, "mass", "kg"))
        object.__setattr__(self, "inertia", inertia_module.as_matrix(inertia))
        object.__setattr__(self, "center_of_mass", np.array(three_finite(center_of_mass, "center_of_mass")))

    def body(self) -> Body:
        """The Body of this mass distribution. Raises ValueError where it has no extent in some direction."""
        return Body(self.mass, self.inertia, self.center_of_mass)

    def with_mass(self, mass: float) -> "MassProperties":
        """The same shape, evenly heavier or lighter. Raises ValueError for a mass [kg] that is not positive."""
        return MassProperties(mass, self.inertia * (mass / self.mass), self.center_of_mass)

    def placed(self, position: Vector = ZERO, q: ArrayLike = (1.0, 0.0, 0.0, 0.0)) -> "MassProperties":
        """The same thing in another frame, in which its own frame has this position [m] and attitude; theory (2.4.11).

        ``q`` (w, x, y, z) takes components in its axes to those of the other frame. Raises ValueError for a bad value.
        """
        center = np.array(three_finite(position, "position")) + rotation.rotate(q, self.center_of_mass)
        return MassProperties(self.mass, inertia_module.turned(self.inertia, q), center)

    def inertia_about(self, point: Vector = ZERO) -> Floats:
        """Inertia [kg m²], shape (3, 3), about ``point`` [m, frame's axes]: the parallel-axis theorem."""
        arm = np.array(three_finite(point, "point")) - self.center_of_mass
        return inertia_module.about_point(self.inertia, self.mass, arm)


def of_point_masses(masses: ArrayLike, positions: ArrayLike) -> MassProperties:
    """Of n point masses [kg], shape (n,), at positions [m], shape (n, 3); theory (2.4.10) about their centre of mass.

    Raises ValueError for other shapes, a negative mass, no mass at all, or a value that is not finite.
    """
    inertia_module.of_point_masses(masses, positions)  # for its checks, before anything is divided
    m, r = np.asarray(masses, float), np.asarray(positions, float)
    mass = positive(m.sum(), "mass of all points", "kg")
    center = m @ r / mass
    return MassProperties(mass, inertia_module.of_point_masses(m, r - center), center)


def combine(parts: Iterable[MassProperties]) -> MassProperties:
    """One thing made of several parts, all in the same frame (see ``MassProperties.placed``).

    Masses add up, and so do the tensors once each is moved to the common centre of mass by the parallel-axis theorem.
    Raises ValueError when there are no parts.
    """
    parts = list(parts)
    if not parts:
        raise ValueError("an assembly has no parts; give at least one")
    mass = sum(part.mass for part in parts)
    center = sum((part.mass * part.center_of_mass for part in parts), np.zeros(3)) / mass
    return MassProperties(mass, sum((part.inertia_about(center) for part in parts), np.zeros((3, 3))), center)


def mass_of(volume: float, mass: float | None, density: float | None) -> float:
    """The mass [kg] of a solid of that volume [m³], given either itself or as a density [kg/m³].

    Raises ValueError when not exactly one of the two is given, or it is not a finite number greater than zero.
    """
    if mass is not None and density is None:
        return positive(mass, "mass", "kg")
    if density is not None and mass is None:
        return positive(positive(density, "density", "kg/m³") * volume, "mass from density and volume", "kg")
    raise ValueError(f"mass {mass} and density {density} are given; give exactly one of them")
