"""Mass properties of a solid by its density integral, theory (2.4.5)."""

from collections.abc import Callable, Sequence

import numpy as np

from ..kernels.arrays import Floats
from ..values import inertia
from .mass_properties import MassProperties

Grid = Floats  # coordinates at all nodes, shape (n, n, n)

Density = float | Callable[[Grid, Grid, Grid], Grid]
Place = Callable[[Grid, Grid, Grid], tuple[Grid, Grid, Grid]]

# Points a side of the rules tried one after another; 64³ points are a quarter of a million densities.
_POINTS = (8, 12, 16, 24, 32, 48, 64)


def of_solid(
    density: Density,
    lower: Sequence[float],
    upper: Sequence[float],
    place: Place | None = None,
    rtol: float = 1e-10,
) -> MassProperties:
    """Mass, centre of mass and inertia of a solid by Gauss-Legendre quadrature; theory (2.4.4) and (2.4.5).

    Parameters
    ----------
    density : float or callable
        ρ(x, y, z) [kg/m³], at least zero: takes and returns arrays of one shape.
    lower, upper : sequence of 3 floats
        Ends of the three coordinates over which the integral runs.
    place : callable, optional
        Where those coordinates (u, v, w) are: returns x, y, z [m], arrays of their shape. Without it they are x, y and
        z themselves, and the solid is a box. For a ball give (r, θ, φ) and their Cartesian coordinates. Its Jacobian
        is found here.
    rtol : float
        Two successive rules must agree to this part of the mass and of the largest moment.

    Limits: density and place must be smooth inside the region. Where a density jumps, integrate piece by piece and
    ``combine``; a shape that no smooth coordinates describe wants a mesh.

    Raises
    ------
    ValueError
        Bounds that are not three finite increasing pairs, a density that is negative or not finite, a place that folds
        the region over itself, no mass at all, or no agreement with 64 points a side.
    """
    ends = np.array((lower, upper), float)
    if ends.shape != (2, 3) or not np.isfinite(ends).all() or not (ends[0] < ends[1]).all():
        raise ValueError(f"bounds {lower} to {upper} must be three finite numbers each, lower before upper")
    previous = None
    for n in _POINTS:
        found = _with_points(n, density, ends, place or (lambda x, y, z: (x, y, z)))
        miss = np.inf if previous is None else _difference(previous, found)
        if miss <= rtol:
            return found
        previous = found
    raise ValueError(
        f"the density integral still changes by {miss:.1e} of its value at {n} points a side, rtol being {rtol:g}; "
        "density and place must be smooth: integrate piece by piece where they are not, or give a larger rtol"
    )


def _with_points(n: int, density: Density, ends: Floats, place: Place) -> MassProperties:
    nodes, weights = np.polynomial.legendre.leggauss(n)
    half = (ends[1] - ends[0]) / 2.0
    grid = np.meshgrid(*(ends[0, k] + half[k] * (nodes + 1.0) for k in range(3)), indexing="ij")
    points = np.stack([np.broadcast_to(np.asarray(c, float), (n, n, n)) for c in place(*grid)])
    if not np.isfinite(points).all():
        raise ValueError("place gives a coordinate that is not finite; every point of the solid is somewhere")
    masses = np.einsum("i,j,k->ijk", weights, weights, weights) * _volume_ratio(points, nodes)
    masses = (masses * _density_at(points, density)).ravel()
    return _properties(masses, points.reshape(3, -1).T)


def _properties(masses: Floats, points: Floats) -> MassProperties:
    total = masses.sum()
    if not total > 0.0:
        raise ValueError("the solid has no mass; its density must be greater than zero somewhere")
    center = masses @ points / total
    arms = points - center
    return MassProperties(total, inertia.from_second_moment((masses[:, None] * arms).T @ arms), center)


def _density_at(points: Floats, density: Density) -> Floats:
    values = np.asarray(density(*points) if callable(density) else density, float)
    if not (np.isfinite(values) & (values >= 0.0)).all():
        raise ValueError("density is negative or not finite somewhere in the solid; it is at least zero everywhere")
    return values


def _volume_ratio(points: Floats, nodes: Floats) -> Floats:
    """|det ∂(x, y, z)/∂(nodes)| at every node, from the polynomials through the nodes."""
    D = _differentiation_matrix(nodes)
    points = points - points.mean(axis=(1, 2, 3), keepdims=True)  # so that a distance to the origin costs no digits
    columns = (
        np.einsum("ai,cijk->cajk", D, points),
        np.einsum("aj,cijk->ciak", D, points),
        np.einsum("ak,cijk->cija", D, points),
    )
    determinant = np.einsum("cijk,cijk->ijk", columns[0], np.cross(columns[1], columns[2], axis=0))
    determinant *= np.sign(determinant.sum()) or 1.0
    # Round-off makes small ones negative next to a pole, where the coordinates degenerate.
    if determinant.min() < -1e-6 * determinant.max():
        raise ValueError("place folds the solid over itself: its Jacobian changes sign; each point must come up once")
    return determinant


def _differentiation_matrix(nodes: Floats) -> Floats:
    """D with (D f)_i = p′(x_i) for the polynomial p through f at the nodes: barycentric form.

    Source: Berrut & Trefethen, SIAM Review 46 (2004) 501, section 9.3. The diagonal makes constants exact.
    """
    gaps = nodes[:, None] - nodes
    np.fill_diagonal(gaps, 1.0)
    weights = 1.0 / gaps.prod(axis=1)
    D = weights / weights[:, None] / gaps
    np.fill_diagonal(D, 0.0)
    np.fill_diagonal(D, -D.sum(axis=1))
    return D


def _difference(a: MassProperties, b: MassProperties) -> float:
    moments = np.abs(a.inertia - b.inertia).max() / np.abs(b.inertia).max()
    radius = np.sqrt(np.trace(b.inertia) / b.mass)
    center = np.linalg.norm(a.center_of_mass - b.center_of_mass) / radius
    return max(abs(a.mass - b.mass) / b.mass, moments, center)
