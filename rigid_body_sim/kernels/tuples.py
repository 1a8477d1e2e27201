"""Vectors, attitudes, motions and loads as named tuples, for kernels that pass several of them on.

As fast as their numbers one by one, and what is what cannot be mixed up. ``vectors`` has the same of single scalars.
"""

from typing import NamedTuple

from .arrays import Floats
from .compiled import kernel
from .straight_line import straight_line
from .vectors import cross, qrotate, qrotate_back


class Vec(NamedTuple):
    """Three components; the axes are those that the name of the variable says."""

    x: float
    y: float
    z: float


class Quat(NamedTuple):
    """A quaternion, scalar first."""

    w: float
    x: float
    y: float
    z: float


class Motion(NamedTuple):
    """How a body moves, in world axes: q from body axes to the world, its centre of mass, and ω."""

    q: Quat
    x: Vec
    v: Vec
    w: Vec


class Load(NamedTuple):
    """Force [N] at the centre of mass and torque [N m] about it, world axes."""

    force: Vec
    torque: Vec


NOTHING = Vec(0.0, 0.0, 0.0)
NO_TURN = Quat(1.0, 0.0, 0.0, 0.0)


@straight_line
def rotate(q: Quat, v: Vec) -> Vec:
    """q v q̄ of a unit quaternion, theory (2.7.21)."""
    x, y, z = qrotate(q.w, q.x, q.y, q.z, v.x, v.y, v.z)
    return Vec(x, y, z)


@straight_line
def rotate_back(q: Quat, v: Vec) -> Vec:
    """q̄ v q of a unit quaternion: the inverse of ``rotate``."""
    x, y, z = qrotate_back(q.w, q.x, q.y, q.z, v.x, v.y, v.z)
    return Vec(x, y, z)


@straight_line
def crossed(a: Vec, b: Vec) -> Vec:
    """Cross product a × b."""
    x, y, z = cross(a.x, a.y, a.z, b.x, b.y, b.z)
    return Vec(x, y, z)


@straight_line
def dot(a: Vec, b: Vec) -> float:
    """Scalar product a · b."""
    return a.x * b.x + a.y * b.y + a.z * b.z


@straight_line
def plus(a: Vec, b: Vec) -> Vec:
    """Sum a + b."""
    return Vec(a.x + b.x, a.y + b.y, a.z + b.z)


@straight_line
def minus(a: Vec, b: Vec) -> Vec:
    """Difference a − b."""
    return Vec(a.x - b.x, a.y - b.y, a.z - b.z)


@straight_line
def scaled(s: float, a: Vec) -> Vec:
    """s a."""
    return Vec(s * a.x, s * a.y, s * a.z)


@kernel
def unit(i: int) -> Vec:
    """Unit vector along axis 0, 1 or 2."""
    return Vec(1.0 if i == 0 else 0.0, 1.0 if i == 1 else 0.0, 1.0 if i == 2 else 0.0)


@straight_line
def vec(numbers: Floats, at: int) -> Vec:
    """The three numbers from ``numbers[at]`` on."""
    return Vec(numbers[at], numbers[at + 1], numbers[at + 2])


@kernel
def added(a: Load, b: Load) -> Load:
    """Both loads at once."""
    return Load(plus(a.force, b.force), plus(a.torque, b.torque))
