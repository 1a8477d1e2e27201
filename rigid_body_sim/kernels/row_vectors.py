"""Vectors and attitudes as rows of four numbers: a vector is (x, y, z, x), a quaternion (w, x, y, z) or (x, y, z, w).

The fourth number of a vector makes both permutations of a cross product vectors again.
"""

from .extended import two_sum, xadd, xmultiply
from .symbols import Row

YZX, ZXY = [1, 2, 0, 1], [2, 0, 1, 2]


def dot(a: Row, b: Row) -> Row:
    """The scalar product of two vectors, in each lane."""
    products = a * b
    return (products[[0] * 4] + products[[1] * 4]) + products[[2] * 4]


def crossed(a: Row, b: Row) -> Row:
    """The cross product a × b; the fourth number of each may be any."""
    return a[YZX] * b[ZXY] - a[ZXY] * b[YZX]


def rotated(q: Row, v: Row) -> Row:
    """q v q̄ of a unit quaternion (w, x, y, z), theory (2.7.21)."""
    u = q[[1, 2, 3, 1]]
    t = 2.0 * crossed(u, v)
    return v + (q[[0] * 4] * t + crossed(u, t))


def rotated_back(q: Row, v: Row) -> Row:
    """q̄ v q of (w, x, y, z), right to first order in |q|² − 1: (w² − u·u) v + 2 (u·v) u − 2 w u × v.

    It never adds v to rounded products of it: for a constant v, as L is without torque, that rounds one way each time.
    """
    w, u = q[[0] * 4], q[[1, 2, 3, 1]]
    ww, uu = w * w, dot(u, u)
    turned = ((ww - uu) * v + (2.0 * dot(u, v)) * u) - (2.0 * w) * crossed(u, v)
    return (2.0 - (ww + uu)) * turned


def xrotated_back(q: Row, ql: Row, v: Row, vl: Row) -> tuple[Row, Row]:
    """``rotated_back`` in twice the precision, over |q|², which is within some round-off of 1: high and low rows."""
    u, ul = q[[1, 2, 3, 1]], ql[[1, 2, 3, 1]]
    (ww, wwl), (uu, uul) = _first(*xmultiply(q, ql, q, ql)), _sum_of_three(*xmultiply(u, ul, u, ul))
    uv, uvl = _sum_of_three(*xmultiply(u, ul, v, vl))
    crossed_row = xadd(*xmultiply(u[YZX], ul[YZX], v[ZXY], vl[ZXY]), *xmultiply(-u[ZXY], -ul[ZXY], v[YZX], vl[YZX]))
    along = xadd(*xmultiply(*xadd(ww, wwl, -uu, -uul), v, vl), *xmultiply(2.0 * uv, 2.0 * uvl, u, ul))
    across = xmultiply(-2.0 * q[[0] * 4], -2.0 * ql[[0] * 4], *crossed_row)
    high, low = xadd(*along, *across)
    size, size_low = xadd(ww, wwl, uu, uul)
    return two_sum(high, low - high * ((size - 1.0) + size_low))


def _first(high: Row, low: Row) -> tuple[Row, Row]:
    return high[[0] * 4], low[[0] * 4]


def _sum_of_three(high: Row, low: Row) -> tuple[Row, Row]:
    x, y, z = ((high[[i] * 4], low[[i] * 4]) for i in range(3))
    return xadd(*xadd(*x, *y), *z)
