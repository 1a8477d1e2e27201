"""Mass properties of a solid bounded by triangles: volume integrals by the divergence theorem (theory 2.4.5, note 3).

Each triangle makes a tetrahedron with a common point. Those that face away from it count positive, those that face it
negative, and what is outside the solid cancels; the integrals over a tetrahedron are polynomials in its corners.
"""

import numpy as np
from numpy.typing import ArrayLike

from . import inertia
from .arrays import Floats, Integers
from .mass_properties import MassProperties, mass_of

# A volume this small beside area times extent is the round-off of a surface that encloses nothing.
_FLAT = 1e-13


def of_mesh(
    vertices: ArrayLike, triangles: ArrayLike, mass: float | None = None, density: float | None = None
) -> MassProperties:
    """Of the solid inside a closed surface, evenly filled, from its mass [kg] or its density [kg/m³].

    Parameters
    ----------
    vertices : array_like, shape (n, 3)
        Corners [m].
    triangles : array_like, shape (m, 3)
        Indices of corners, counter-clockwise seen from outside. Holes inside the solid are surfaces too, seen from the
        material.

    A surface that cuts through itself is not noticed: what lies inside twice counts twice. So is a part that is inside
    out and happens to lie in the box around another one: it is taken for a hole.

    Raises
    ------
    ValueError
        One sentence for each: wrong shapes, corners that are not finite, indices of no corner, a triangle that has a
        corner twice, an open surface, an edge of more than two triangles, triangles of opposite orientation side by
        side, a surface or part of one that is inside out, no volume, mass and density both given or both missing.
    """
    corners, indices = _checked(vertices, triangles)
    _check_edges(indices)
    # About a point of its own, a solid far from the origin loses no digits.
    middle = corners.mean(axis=0)
    volumes, tetrahedra = _tetrahedra(corners - middle, indices)
    volume = volumes.sum()
    _check_volume(volume, tetrahedra)
    _check_parts(indices, volumes, corners)
    from_middle = volumes @ tetrahedra.sum(axis=1) / (4.0 * volume)
    total = mass_of(volume, mass, density)
    volumes, tetrahedra = _tetrahedra(corners - middle - from_middle, indices)
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


def _check_edges(indices: Integers) -> None:
    """Every edge of a closed surface belongs to two triangles, which run along it in opposite directions."""
    edges = np.concatenate((indices[:, :2], indices[:, 1:], indices[:, (2, 0)]))
    low, high = edges.min(axis=1), edges.max(axis=1)
    keys, which, count = np.unique(low * (indices.max() + 1) + high, return_inverse=True, return_counts=True)
    forward = np.bincount(which, weights=edges[:, 0] < edges[:, 1])
    for wrong, reason in (
        (count == 1, "is open: {n} edges belong to one triangle only, such as that of vertices {edge}; close it"),
        (count > 2, "is not a surface: {n} edges belong to more than two triangles, such as that of vertices {edge}"),
        (forward * 2 != count, "turns inside out: at {n} edges, such as that of vertices {edge}, two triangles run the "
         "same way; all must be counter-clockwise seen from outside"),
    ):  # fmt: skip
        if wrong.any():
            edge = divmod(int(keys[wrong][0]), int(indices.max()) + 1)
            raise ValueError("mesh " + reason.format(n=wrong.sum(), edge=edge))


def _check_parts(indices: Integers, volumes: Floats, corners: Floats) -> None:
    """A closed part that is inside out must be a hole: it lies in the box around a part that is not."""
    names, part = np.unique(_parts(indices, len(corners)), return_inverse=True)
    volume = np.bincount(part, weights=volumes)
    low, high = np.full((len(names), 3), np.inf), np.full((len(names), 3), -np.inf)
    np.minimum.at(low, part, corners[indices].min(axis=1))
    np.maximum.at(high, part, corners[indices].max(axis=1))
    solid = volume > 0.0
    for k in np.flatnonzero(volume < -_FLAT * volume.sum()):
        if not ((low[solid] <= low[k]) & (high[k] <= high[solid])).all(axis=1).any():
            raise ValueError(
                f"mesh is inside out where vertex {names[k]} is: that part has the volume {volume[k]:.6g} m³ and is no "
                "hole in another; its triangles must be counter-clockwise seen from outside"
            )


def _parts(indices: Integers, n: int) -> Integers:
    """The smallest number of a vertex to which each triangle is connected, shape (m,)."""
    label = np.arange(n)
    while True:
        found = label[indices]
        lowest = found.min(axis=1)
        if (found == lowest[:, None]).all():
            return lowest
        # A label is the number of a vertex: giving that one the lower label moves all that carry it at once.
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
