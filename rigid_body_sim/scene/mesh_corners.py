"""Which corners of a file's triangles are one: equal ones and, where these leave it open, nearly equal ones."""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ..kernels.arrays import Floats, Integers
from ..mass.mesh import open_corners

_Number = TypeVar("_Number", np.float64, np.int64)
_FLOAT32 = 4.0 * 2.0**-23  # of the size: what programs that reckon in float32 make of one point
_MOST_PAIRS = 4_000_000  # or 64 a corner: more are no round-off but a part that is far smaller than the size
_DIGITS = 6  # what C and C++ print where nothing else is said
_NOTE = (
    "{count} of its corners {are} merged with another at most {limit:.3g} away (in the file's units), without which it "
    "would be open"
)
_HALF = [(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) > (0, 0, 0)]


def joined(corners: Floats, triangles: Integers) -> tuple[Floats, Integers, str]:
    """The vertices, the triangles that are left, and a sentence about what was merged beyond equal corners, or "".

    Corners, shape (n, 3), that are equal become one vertex. Where a surface is open then, so do those on its rim that
    differ by no more than one of the ``tolerances`` along any axis, if that closes it; each merges with one that stays,
    so that a row of corners does not collapse. Triangles, shape (m, 3), that thereby have a corner twice enclose
    nothing and are left out, as are two that come to lie back to back.
    """
    vertices, number = _distinct(corners + 0.0)  # no -0.0
    triangles = _without_collapsed(number[triangles])
    if not np.isfinite(vertices).all() or not len(triangles) or not (rim := open_corners(triangles)).size:
        return vertices, triangles, ""
    for limit in tolerances(vertices):
        names = np.arange(len(vertices))
        names[rim] = rim[_representatives(vertices[rim], limit)]
        found = _without_flaps(_without_collapsed(names[triangles]))
        if len(found) and not open_corners(found).size:
            count = int((names != np.arange(len(names))).sum())
            return vertices, found, _NOTE.format(count=count, are="is" if count == 1 else "are", limit=limit)
    return vertices, triangles, ""


def tolerances(vertices: Floats) -> list[float]:
    """By how much one point may differ from itself, in the unit of the vertices, the least first.

    A few units of float32's last digit, at the largest number or extent; where all numbers are printed with six digits,
    and most use the sixth, also one unit of that.
    """
    size = float(max(np.abs(vertices).max(), np.ptp(vertices, axis=0).max()))
    if not 0.0 < size < np.inf:
        return []
    numbers = np.unique(np.abs(vertices[np.abs(vertices) > _FLOAT32 * size]))
    unit = 10.0 ** (np.floor(np.log10(numbers)) + 1 - _DIGITS)
    digits = np.rint(numbers / unit)
    printed = np.abs(numbers / unit - digits).max() < 1e-6 and np.mean(digits % 10 != 0) > 0.5
    return [_FLOAT32 * size, *([1.01 * float(unit.max())] if printed else [])]


def _without_collapsed(triangles: Integers) -> Integers:
    return triangles[~(triangles == np.roll(triangles, 1, axis=1)).any(axis=1)]


def _distinct(rows: NDArray[_Number]) -> tuple[NDArray[_Number], Integers]:
    """The different rows, ascending, and which of them each is; as np.unique(axis=0), which takes ten times as long."""
    order = np.lexsort(rows.T[::-1])
    first = np.ones(len(rows), bool)
    first[1:] = (rows[order[1:]] != rows[order[:-1]]).any(axis=1)
    which = np.empty(len(rows), np.int64)
    which[order] = np.cumsum(first) - 1
    return rows[order[first]], which


def _without_flaps(triangles: Integers) -> Integers:
    rising = (triangles < np.roll(triangles, -1, axis=1)).sum(axis=1) == 2  # the corners follow each other upwards
    _, which = _distinct(np.sort(triangles, axis=1))
    count, upwards = np.bincount(which), np.bincount(which, weights=rising)
    return triangles[~((count == 2) & (upwards == 1.0))[which]]


def _representatives(points: Floats, limit: float) -> Integers:
    """The point with which each merges, shape (n,), itself for those that stay; what stays merges with nothing."""
    names = list(range(len(points)))
    for a, b in zip(*(side.tolist() for side in _pairs(points, limit).T), strict=True):
        if names[a] == a and names[b] == b:
            names[b] = a
    return np.array(names, np.int64)


def _pairs(points: Floats, limit: float) -> Integers:
    """The pairs (a, b), a < b, in order, of points that differ by no more than ``limit`` along any axis, shape (k, 2).

    Not one where there would be too many. Points share a cell of a grid, or lie in neighbouring ones.
    """
    cells = np.floor((points - points.min(axis=0)) / (2.0 * limit)).astype(np.int64) + 1
    strides = np.array([(span := cells.max(axis=0) + 2)[1] * span[2], span[2], 1])
    order = np.argsort(keys := cells @ strides, kind="stable")
    found, start, count = np.unique(keys[order], return_index=True, return_counts=True)
    meetings: list[tuple[Integers, Integers]] = [(np.arange(len(found)), np.arange(len(found)))]
    for offset in np.array(_HALF) @ strides:
        at = np.minimum(np.searchsorted(found, found + offset), len(found) - 1)
        near = np.flatnonzero(found[at] == found + offset)
        meetings.append((near, at[near]))
    a, b = (np.concatenate(sides) for sides in zip(*meetings, strict=True))
    if (count[a] * count[b]).sum() > max(_MOST_PAIRS, 64 * len(points)):
        return np.zeros((0, 2), np.int64)
    pairs = order[_products(start[a], count[a], start[b], count[b])]
    pairs = pairs[np.abs(points[pairs[:, 0]] - points[pairs[:, 1]]).max(axis=1) <= limit]
    low, high = pairs.min(axis=1), pairs.max(axis=1)
    keys = np.sort((low * len(points) + high)[low != high])
    keys = keys[np.append(True, keys[1:] != keys[:-1])[: len(keys)]]  # those of one cell come both ways
    return np.stack(np.divmod(keys, len(points)), axis=1)


def _products(start_a: Integers, count_a: Integers, start_b: Integers, count_b: Integers) -> Integers:
    """All pairs of a number in start_a[k] + range(count_a[k]) and one in the same of b, for every k, shape (n, 2)."""
    total = count_a * count_b
    which = np.repeat(np.arange(len(total)), total)
    rank = np.arange(total.sum()) - np.repeat(np.cumsum(total) - total, total)
    return np.stack((start_a[which] + rank // count_b[which], start_b[which] + rank % count_b[which]), axis=1)
