"""The solid that a body is shown as: its shape, its mesh, or the ellipsoid of its mass and inertia."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..values.body import Body

Numbers = tuple[float, ...]

ELLIPSOID, BOX, CYLINDER, MESH = "ellipsoid", "box", "cylinder", "mesh"
# Kind and its size along the axes, from the dimensions of a shape.
_SHAPES: dict[str, tuple[str, Callable[..., Numbers]]] = {
    "sphere": (ELLIPSOID, lambda r: (2 * r, 2 * r, 2 * r)),
    "hollow_sphere": (ELLIPSOID, lambda r, _: (2 * r, 2 * r, 2 * r)),
    "ellipsoid": (ELLIPSOID, lambda x, y, z: (2 * x, 2 * y, 2 * z)),
    "box": (BOX, lambda x, y, z: (x, y, z)),
    "cylinder": (CYLINDER, lambda r, length: (2 * r, 2 * r, length)),
    "tube": (CYLINDER, lambda r, _, length: (2 * r, 2 * r, length)),
}
_NO_TURN = (1.0, 0.0, 0.0, 0.0)


class Solid(NamedTuple):
    """Kind, size along its axes [m], and where it sits in the body frame: point [m] and quaternion w, x, y, z.

    A cylinder's axis is z. The size of a mesh is the length of its units.
    """

    kind: str
    size: Sequence[float]
    point: Sequence[float]
    q_body_solid: Sequence[float]


def solid(values: Mapping[str, Any], body: Body) -> Solid:
    """By parameters ``body.*`` of a scene. A body of no shape known here is the even ellipsoid of its mass and inertia.

    Of that I_x = m (b² + c²) / 5.
    """
    if values["body.mesh_file"]:
        return Solid(MESH, values["body.mesh_scale"], (0.0, 0.0, 0.0), _NO_TURN)
    center = body.center_of_mass.tolist()
    if values["body.shape"] in _SHAPES:
        kind, size = _SHAPES[values["body.shape"]]
        return Solid(kind, size(*values["body.dimensions"]), center, _NO_TURN)
    return ellipsoid(body)


def ellipsoid(body: Body) -> Solid:
    """The even ellipsoid that has the mass and inertia of a body, about its centre of mass."""
    moments = body.principal_moments / body.mass
    size = 2.0 * np.sqrt(np.maximum(0.0, 2.5 * (moments.sum() - 2.0 * moments)))
    # RViz does not show what has no extent along an axis, as a thin disc's ellipsoid has not.
    flat = np.maximum(size, 0.01 * size.max()).tolist()
    return Solid(ELLIPSOID, flat, body.center_of_mass.tolist(), body.q_body_principal.tolist())
