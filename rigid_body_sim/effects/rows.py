"""Rows of the Jacobian of a load: three of the force, then three of the torque, of 12 columns each.

Columns are changes of position, attitude (the small rotation b), velocity and rates, in world axes.
"""

from typing import NamedTuple

from ..kernels.arrays import Floats
from ..kernels.compiled import kernel
from ..kernels.tuples import Vec, crossed, dot, unit


class Row(NamedTuple):
    """What one component changes by, for each of the four."""

    x: Vec
    b: Vec
    v: Vec
    w: Vec


@kernel
def add_row(out: Floats, at: int, s: float, row: Row) -> None:
    """out[at:at + 12] += s row."""
    _add(out, at, s, row.x)
    _add(out, at + 3, s, row.b)
    _add(out, at + 6, s, row.v)
    _add(out, at + 9, s, row.w)


@kernel
def _add(out: Floats, at: int, s: float, a: Vec) -> None:
    out[at], out[at + 1], out[at + 2] = out[at] + s * a.x, out[at + 1] + s * a.y, out[at + 2] + s * a.z


@kernel
def add_force_row(out: Floats, o: int, i: int, r: Vec, force: Vec, s: float, row: Row) -> None:
    """What component i of a force at the arm r changes by, s row, and what that of its torque τ = r × F does.

    The arm turns with the body: δτ = r × δF + (b × r) × F, of which the second is r (b · F) − b (r · F).
    """
    axis = unit(i)
    j = crossed(r, axis)
    add_row(out, o + 12 * i, s, row)
    add_row(out, o + 36, s * j.x, row)
    add_row(out, o + 48, s * j.y, row)
    add_row(out, o + 60, s * j.z, row)
    t, across, moment = o + 36 + 12 * i + 3, dot(r, axis), dot(force, r)
    out[t] += across * force.x - moment * axis.x
    out[t + 1] += across * force.y - moment * axis.y
    out[t + 2] += across * force.z - moment * axis.z


@kernel
def add_turning(out: Floats, at: int, a: Vec) -> None:
    """Three rows at out[at:]: a vector a that turns with the body changes by b × a with the small rotation b."""
    out[at + 4], out[at + 5] = out[at + 4] + a.z, out[at + 5] - a.y
    out[at + 15], out[at + 17] = out[at + 15] - a.z, out[at + 17] + a.x
    out[at + 27], out[at + 28] = out[at + 27] + a.y, out[at + 28] - a.x
