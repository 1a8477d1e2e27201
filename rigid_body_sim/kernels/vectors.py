"""Vectors and quaternions as scalars, the smallest kernels.

Quaternions are scalar first, (w, x, y, z) = [s, v] as in theory (2.7.3).
"""

import math

from .compiled import kernel
from .straight_line import straight_line


@straight_line
def qmultiply(
    aw: float, ax: float, ay: float, az: float, bw: float, bx: float, by: float, bz: float
) -> tuple[float, float, float, float]:
    """Product a ⊗ b of two quaternions, theory (2.7.6)."""
    return (
        aw * bw - (ax * bx + ay * by + az * bz),
        aw * bx + bw * ax + (ay * bz - az * by),
        aw * by + bw * ay + (az * bx - ax * bz),
        aw * bz + bw * az + (ax * by - ay * bx),
    )


@straight_line
def cross(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> tuple[float, float, float]:
    """Cross product a × b."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@kernel
def unit_vector(i: int) -> tuple[float, float, float]:
    """Unit vector along axis 0, 1 or 2."""
    return 1.0 if i == 0 else 0.0, 1.0 if i == 1 else 0.0, 1.0 if i == 2 else 0.0


@straight_line
def qrotate(w: float, x: float, y: float, z: float, vx: float, vy: float, vz: float) -> tuple[float, float, float]:
    """q v q̄ for a unit quaternion, theory (2.7.21): v + w t + u × t with u = (x, y, z) and t = 2 u × v."""
    tx, ty, tz = 2.0 * (y * vz - z * vy), 2.0 * (z * vx - x * vz), 2.0 * (x * vy - y * vx)
    return vx + w * tx + (y * tz - z * ty), vy + w * ty + (z * tx - x * tz), vz + w * tz + (x * ty - y * tx)


@straight_line
def qrotate_back(w: float, x: float, y: float, z: float, vx: float, vy: float, vz: float) -> tuple[float, float, float]:
    """q̄ v q for a unit quaternion: the inverse of ``qrotate``."""
    return qrotate(w, -x, -y, -z, vx, vy, vz)


@kernel
def exponential_minus_one(x: float, y: float, z: float) -> tuple[float, float, float, float]:
    """Unit quaternion of the rotation vector (x, y, z) [rad], less 1, to round-off for small angles too."""
    angle = math.sqrt(x * x + y * y + z * z)
    quarter = math.sin(0.25 * angle)
    # sin(θ/2) / θ; below 1e-8 its next term, θ²/48, is under round-off
    share = 0.5 if angle < 1e-8 else math.sin(0.5 * angle) / angle
    return -2.0 * quarter * quarter, share * x, share * y, share * z


@kernel
def power_of_two(exponent: int) -> float:
    """2 to that power, or the nearest from 2⁻¹⁰⁰⁰ to 2¹⁰⁰⁰: what it multiplies is not rounded."""
    return math.ldexp(1.0, max(-1000, min(1000, exponent)))
