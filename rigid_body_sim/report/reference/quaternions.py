"""Quaternions (w, x, y, z) and vectors as lists of any numbers: for truths with more digits than doubles have."""

from collections.abc import Sequence
from typing import Any


def product(a: Sequence[Any], b: Sequence[Any]) -> list[Any]:
    """a ⊗ b."""
    (aw, ax, ay, az), (bw, bx, by, bz) = a, b
    return [
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + bw * ax + ay * bz - az * by,
        aw * by + bw * ay + az * bx - ax * bz,
        aw * bz + bw * az + ax * by - ay * bx,
    ]


def conjugate(q: Sequence[Any]) -> list[Any]:
    """The turn back, of a unit quaternion."""
    return [q[0], -q[1], -q[2], -q[3]]


def unit(v: Sequence[Any]) -> list[Any]:
    """v over its length, with the digits that mpmath has at the moment."""
    import mpmath

    size = mpmath.sqrt(mpmath.fsum(x * x for x in v))
    return [x / size for x in v]
