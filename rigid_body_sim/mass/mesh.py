"""Mass properties of a solid bounded by triangles: volume integrals by the divergence theorem (theory 2.4.5, note 3).

Each triangle makes a tetrahedron with a common point. Those that face away from it count positive, those that face it
negative, and what is outside the solid cancels; the integrals over a tetrahedron are polynomials in its corners.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..kernels.arrays import Floats, Integers, Vector
from ..values import inertia
from ..values.body import positive
from .mass_properties import MassProperties, mass_of

# A volume this small beside area times extent is the round-off of a surface that encloses nothing.
_FLAT = 1e-13
_NEAR = 1e-6  # of an edge's length: a vertex so near to it lies on it, for a message
_SAME_ANGLE = 1e-4  # rad: two triangles on one edge lie on each other
_MOST_LOOKED_AT = 100  # open edges, for that message


def of_mesh(
    vertices: ArrayLike,
    triangles: ArrayLike,
    mass: float | None = None,
    density: float | None = None,
    scale: Vector = (1.0, 1.0, 1.0),
) -> MassProperties:
    """Of the solid inside a closed surface, evenly filled, from its mass [kg] or its density [kg/m³].

    Parameters
    ----------
    vertices : array_like, shape (n, 3)
        Corners, in units of ``scale``. Messages name them by these numbers.
    triangles : array_like, shape (m, 3)
        Indices of corners, counter-clockwise seen from outside. Holes inside the solid are surfaces too, seen from the
        material.
    scale : array_like, shape (3,)
        Length [m] of one of these units along each axis, greater than zero.

    Closed parts may touch in a corner, along an edge or over a face: a wall of two triangles back to back counts for
    nothing. A surface that cuts through itself is not noticed: what lies inside twice counts twice. So is a part that
    is inside out and happens to lie in the box around another one: it is taken for a hole.

    Raises
    ------
    ValueError
        One sentence for each: wrong shapes, corners that are not finite, indices of no corner, a triangle that has a
        corner twice, an open surface, an edge of more than two triangles that do not bound parts, triangles of opposite
        orientation side by side, a triangle that is there twice, parts that overlap where they touch, a sheet without
        thickness, a surface or part of one that is inside out, no volume, a scale that is not positive, mass and
        density both given or both missing.
    """
    corners, indices = _checked(vertices, triangles)
    edges = _edges(indices)
    _check_edges(edges, corners)
    _check_sheets(edges, indices, corners)
    _check_turns(edges, indices, corners)
    sized = corners * [positive(unit, "scale of a mesh", "m") for unit in scale]
    # About a point of its own, a solid far from the origin loses no digits.
    middle = sized.mean(axis=0)
    volumes, tetrahedra = _tetrahedra(sized - middle, indices)
    volume = volumes.sum()
    _check_volume(volume, tetrahedra)
    _check_parts(edges, indices, volumes, corners)
    from_middle = volumes @ tetrahedra.sum(axis=1) / (4.0 * volume)
    total = mass_of(volume, mass, density)
    volumes, tetrahedra = _tetrahedra(sized - middle - from_middle, indices)
    tensor = inertia.from_second_moment(_second_moment(volumes, tetrahedra)) * (total / volume)
    return MassProperties(total, tensor, middle + from_middle)


def _tetrahedra(corners: Floats, indices: Integers) -> tuple[Floats, Floats]:
    """Signed volumes [m³], shape (m,), of the tetrahedra over the triangles, and these, shape (m, 3, 3)."""
    tetrahedra = corners[indices]
    a, b, c = tetrahedra.transpose(1, 0, 2)
    return np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0, tetrahedra


def _second_moment(volumes: Floats, tetrahedra: Floats) -> Floats:
    """∭ r rᵀ dV [m⁵], shape (3, 3): V/20 (Σ v vᵀ + s sᵀ) for a tetrahedron of corners v, one at 0, and s = Σ v."""
    corners = np.einsum("i,ika,ikb->ab", volumes, tetrahedra, tetrahedra)
    sums = tetrahedra.sum(axis=1)
    return (corners + (volumes[:, None] * sums).T @ sums) / 20.0


def _checked(vertices: ArrayLike, triangles: ArrayLike) -> tuple[Floats, Integers]:
    corners, indices = np.asarray(vertices, float), np.asarray(triangles)
    if corners.ndim != 2 or corners.shape[1] != 3 or indices.ndim != 2 or indices.shape[1] != 3 or not len(indices):
        raise ValueError(
            f"mesh has vertices of shape {corners.shape} and triangles of shape {indices.shape}; "
            "(n, 3) and (m, 3) with at least one triangle are needed"
        )
    if not np.isfinite(corners).all():
        raise ValueError("mesh has a vertex that is not finite; every vertex is three finite numbers in m")
    if indices.dtype.kind not in "iu" or indices.min() < 0 or indices.max() >= len(corners):
        raise ValueError(
            f"mesh has a triangle with a corner that is no vertex; give whole numbers 0 to {len(corners) - 1}"
        )
    twice = np.flatnonzero((indices == np.roll(indices, 1, axis=1)).any(axis=1))
    if twice.size:
        raise ValueError(f"mesh triangle {twice[0]} has one corner twice; the corners of a triangle are three vertices")
    return corners, indices.astype(np.int64)


@dataclass(frozen=True, eq=False)
class _Edges:
    """The k edges of m triangles.

    ``ends`` are their vertices, shape (k, 2), the lower number first; ``of`` the edges of each triangle, (m, 3), from
    each corner to the next; ``sign`` is 1 where it goes from the lower end, else -1; ``count`` is of triangles, (k,),
    and ``surplus`` the sum of the signs: 0 where as many go one way as the other, as on every edge of a closed surface.
    """

    ends: Integers
    of: Integers
    sign: Integers
    count: Integers
    surplus: Integers


def _edges(indices: Integers) -> _Edges:
    following = np.roll(indices, -1, axis=1)
    width = indices.max() + 1
    keys = np.minimum(indices, following) * width + np.maximum(indices, following)
    found, of, count = np.unique(keys, return_inverse=True, return_counts=True)
    of, sign = of.reshape(indices.shape), np.where(indices < following, 1, -1)
    surplus = np.bincount(of.ravel(), weights=sign.ravel()).astype(np.int64)
    return _Edges(np.stack(np.divmod(found, width), axis=1), of, sign, count, surplus)


def open_corners(triangles: Integers) -> Integers:
    """The vertices, ascending, at edges along which not as many triangles go one way as the other."""
    edges = _edges(triangles)
    return np.flatnonzero(np.bincount(edges.ends[edges.surplus != 0].ravel()))


def _check_edges(edges: _Edges, vertices: Floats) -> None:
    """Along every edge of a closed surface as many triangles go one way as the other, several where parts touch."""
    for wrong, reason in (
        (edges.count == 1, "is open: {n} edges belong to one triangle only, such as that {edge}; close it"),
        (edges.count > 2, "is not a surface: {n} edges belong to more than two triangles that are not the sides of "
         "closed parts, such as that {edge}; leave out what is not the skin of a solid"),
        (edges.count == 2, "turns inside out: at {n} edges, such as that {edge}, two triangles run the same way; "
         "all must be counter-clockwise seen from outside"),
    ):  # fmt: skip
        if (wrong := wrong & (edges.surplus != 0)).any():
            ends = edges.ends[wrong]
            edge = _t_junction(ends, vertices) or _between(*vertices[ends[0]])
            raise ValueError("mesh " + reason.format(n=len(ends), edge=edge))


def _t_junction(ends: Integers, vertices: Floats) -> str:
    """Words for one of the first edges on which another of these edges ends; empty where there is none."""
    others = vertices[np.unique(ends)]
    for a, b in vertices[ends[:_MOST_LOOKED_AT]]:
        along = (others - a) @ (b - a) / ((b - a) @ (b - a))
        off = np.abs(others - a - along[:, None] * (b - a)).max(axis=1)
        on = (along > _NEAR) & (along < 1.0 - _NEAR) & (off < _NEAR * np.abs(b - a).max())
        if on.any():
            return f"{_between(a, b)}, on which {_shown(others[on][0])} lies as a corner of other triangles only"
    return ""


def _between(a: Floats, b: Floats) -> str:
    return f"from {_shown(a)} to {_shown(b)}"


def _shown(vertex: Floats) -> str:
    """As in a file, whose numbers may be float32."""
    return f"[{', '.join(f'{number + 0.0:.9g}' for number in vertex)}]"


def _check_sheets(edges: _Edges, indices: Integers, vertices: Floats) -> None:
    """No triangle is there twice, and none lies back to back with another that nothing else joins: a fin."""
    opposite = np.roll(indices, 1, axis=1)
    total = np.bincount(edges.of.ravel(), weights=opposite.ravel())
    fin = (edges.count[edges.of] == 2) & (total[edges.of] == 2 * opposite)
    if fin.any():
        edge = edges.ends[edges.of[fin][0]]
        raise ValueError(
            f"mesh has a sheet without thickness, with an edge {_between(*vertices[edge])} of two triangles that have "
            "the same corners; leave it out or give it a thickness"
        )
    many = indices[(edges.count[edges.of] > 2).all(axis=1)]
    turned = np.take_along_axis(many, (many.argmin(axis=1)[:, None] + np.arange(3)) % 3, axis=1)
    found, count = np.unique(turned, axis=0, return_counts=True)
    if (count > 1).any():
        corners = ", ".join(map(_shown, vertices[found[count > 1][0]]))
        raise ValueError(f"mesh has {np.sum(count > 1)} triangles twice, such as that of {corners}; leave one out")


def _check_turns(edges: _Edges, indices: Integers, vertices: Floats) -> None:
    """Around an edge where parts touch, what is inside is inside once: going round, it is entered and left in turn."""
    many = edges.count[edges.of] > 2
    if not many.any():
        return
    order = np.argsort(edges.of[many], kind="stable")
    edge, sign = edges.of[many][order], edges.sign[many][order]
    a, b = vertices[edges.ends[edge]].transpose(1, 0, 2)
    begins = np.flatnonzero(np.append(True, edge[1:] != edge[:-1]))
    angle, flat = _angles(b - a, vertices[np.roll(indices, 1, axis=1)[many]][order] - a, begins, edge)
    order = np.lexsort((angle, edge))
    angle = angle[order]
    starts = np.flatnonzero(np.append(True, (edge[1:] != edge[:-1]) | (np.diff(angle) > _SAME_ANGLE)))
    inside = np.cumsum(np.add.reduceat(sign[order], starts))  # 0 again behind the last of each edge
    of_edge = np.searchsorted(starts, begins)
    spread = np.maximum.reduceat(inside, of_edge) - np.minimum.reduceat(inside, of_edge)
    wrong = (spread > 1) & ~np.logical_or.reduceat(flat, begins)
    if wrong.any():
        ends = vertices[edges.ends[edge[begins[wrong][0]]]]
        raise ValueError(
            f"mesh has parts that overlap, or of which one is inside out, at {wrong.sum()} edges, such as that "
            f"{_between(*ends)}; parts may touch there, all counter-clockwise seen from outside"
        )


def _angles(along: Floats, away: Floats, begins: Integers, edge: Integers) -> tuple[Floats, NDArray[np.bool_]]:
    """From the first triangle at its edge to each, about the edge [rad]; and which have too little width to tell."""
    along = along / np.abs(along).max(axis=1, keepdims=True)  # whose squares do not underflow
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    away = away - along * np.einsum("ij,ij->i", away, along)[:, None]
    width = np.linalg.norm(away, axis=1)
    first = away[begins][np.cumsum(np.append(0, edge[1:] != edge[:-1]))]
    sine, cosine = np.einsum("ij,ij->i", along, np.cross(first, away)), np.einsum("ij,ij->i", first, away)
    angle = np.arctan2(sine, cosine) % (2.0 * np.pi)
    return np.where(angle > 2.0 * np.pi - _SAME_ANGLE, 0.0, angle), width < _NEAR * width.max()


def _check_parts(edges: _Edges, indices: Integers, volumes: Floats, vertices: Floats) -> None:
    """A closed part that is inside out must be a hole: it lies in the box around a part that is not."""
    _, first, part = np.unique(_parts(edges), return_index=True, return_inverse=True)
    volume = np.bincount(part, weights=volumes)
    low, high = np.full((len(first), 3), np.inf), np.full((len(first), 3), -np.inf)
    np.minimum.at(low, part, vertices[indices].min(axis=1))
    np.maximum.at(high, part, vertices[indices].max(axis=1))
    solid = volume > 0.0
    for k in np.flatnonzero(volume < -_FLAT * volume.sum()):
        if not ((low[solid] <= low[k]) & (high[k] <= high[solid])).all(axis=1).any():
            raise ValueError(
                f"mesh is inside out where the vertex {_shown(vertices[indices[first[k], 0]])} is: that part has the "
                f"volume {volume[k]:.6g} m³ and is no hole in another; its triangles must be counter-clockwise seen "
                "from outside"
            )


def _parts(edges: _Edges) -> Integers:
    """A number for each triangle, shape (m,), the same for those of one closed part.

    Parts may touch along an edge: it joins only triangles that would be open without it.
    """
    many, k = edges.count[edges.of] > 2, len(edges.ends)
    apart = np.where(many, k + np.arange(edges.of.size).reshape(-1, 3), edges.of)
    part = _connected(apart, k + edges.of.size)
    if not many.any():
        return part
    keys = np.stack((edges.of[many], np.broadcast_to(part[:, None], many.shape)[many]), axis=1)
    _, which = np.unique(keys, axis=0, return_inverse=True)
    surplus = np.bincount(which.ravel(), weights=edges.sign[many])[which.ravel()]
    apart[many] = np.where(surplus != 0, edges.of[many], apart[many])
    return _connected(apart, k + edges.of.size)


def _connected(indices: Integers, n: int) -> Integers:
    """The smallest of n numbers to which each row of indices is connected by common ones, shape (m,)."""
    label = np.arange(n)
    while True:
        found = label[indices]
        lowest = found.min(axis=1)
        if (found == lowest[:, None]).all():
            return lowest
        # A label is one of the numbers: giving that one the lower label moves all that carry it at once.
        np.minimum.at(label, found, lowest[:, None])
        while (label[label] != label).any():
            label = label[label]


def _check_volume(volume: float, tetrahedra: Floats) -> None:
    a, b, c = tetrahedra.transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2.0
    if not abs(volume) > _FLAT * area * np.abs(tetrahedra).max():
        raise ValueError(f"mesh encloses no volume ({volume:.3g} m³); a solid has one")
    if volume < 0.0:
        raise ValueError(
            f"mesh is inside out: its volume is {volume:.6g} m³; "
            "all triangles must be counter-clockwise seen from outside"
        )
