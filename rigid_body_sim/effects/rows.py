"""Rows of the Jacobian of a load: three of the force, then three of the torque, of 12 columns each.

Columns are changes of position, attitude (the small rotation b), velocity and rates, in world axes.
"""

from typing import NamedTuple

from ..kernels.arrays import Floats
from ..kernels.compiled import kernel
from ..kernels.tuples import Vec


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
def add_turning(out: Floats, at: int, a: Vec) -> None:
    """Three rows at out[at:]: a vector a that turns with the body changes by b × a with the small rotation b."""
    out[at + 4], out[at + 5] = out[at + 4] + a.z, out[at + 5] - a.y
    out[at + 15], out[at + 17] = out[at + 15] - a.z, out[at + 17] + a.x
    out[at + 27], out[at + 28] = out[at + 27] + a.y, out[at + 28] - a.x
