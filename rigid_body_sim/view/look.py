"""What is shown of a body that stays the same in its frame: solid, frames, actuators, tethers; and the ground."""

import os
from collections.abc import Mapping
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..effects import REGISTRY
from ..effects.actuators import Actuator
from ..effects.ground import Ground
from ..effects.tether import Tether
from ..kernels.arrays import Floats, Integers
from ..scene import attitude, file_path, mesh_file, schema, solid
from ..scene.solid import MESH, Solid
from ..terms import Terms
from ..values.body import Body

Place = tuple[tuple[float, ...], tuple[float, ...]]  # position [m] and quaternion w, x, y, z, in the body frame
LEAST_EXTENT = 0.05  # m: of a point mass


class Look(NamedTuple):
    """What is shown of a body, in its frame; ``note`` is a sentence about what could not be shown, mostly empty."""

    solid: Solid
    mesh: tuple[Floats, Integers] | None = None  # vertices (n, 3) in units of the file, and triangles (m, 3)
    frames: Mapping[str, Place] = {}
    actuators: tuple[Actuator, ...] = ()
    tethers: tuple[Tether, ...] = ()
    ground: Ground | None = None
    most_force: float = 0.0  # N, of a command; 0 = not limited
    most_torque: float = 0.0  # N m
    mass: float = 1.0  # kg
    inertia: float = 0.1  # kg m², the mean of the principal moments
    gravity: float = 0.0  # m/s²
    note: str = ""

    @property
    def extent(self) -> float:
        """How far it reaches from the origin of its frame [m], about."""
        size = np.asarray(self.solid.size, float)
        if self.mesh is not None:
            size = 2.0 * np.abs(self.mesh[0] * size).max(axis=0)
        reach = [_length(self.solid.point) + 0.5 * float(size.max())]
        return max(LEAST_EXTENT, *reach, *(_length(one.position) for one in self.actuators))


UNKNOWN = Look(Solid(solid.BOX, (0.4, 0.3, 0.2), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)))


def of_terms(terms: Terms) -> Look:
    """The look of a body of which no more than its terms is known: an ellipsoid, and what acts on it."""
    return _look(terms.body, solid.ellipsoid(terms.body), terms.given)._replace(gravity=_length(terms.gravity))


def of_values(values: Mapping[str, Any], folder: str | os.PathLike[str] = "") -> Look:
    """The look that parameters by dotted name describe: those of a scene, ``scene.values``, or a node's.

    A mesh that cannot be read here is shown as the ellipsoid, and ``note`` says why.
    """
    body = Body(values["body.mass"], values["body.inertia"], values["body.center_of_mass"])
    members = partial(schema.members, names=values)
    given = {name: REGISTRY[name].read(values, members) for name in ("ground", "actuators", "tethers")}
    look = _look(body, solid.solid(values, body), given)._replace(
        frames={name: _frame(values, name) for name in members("frames")},
        most_force=values["wrench.max_force"],
        most_torque=values["wrench.max_torque"],
        gravity=_length(values["gravity"]),
    )
    return _with_mesh(look, body, values["body.mesh_file"], folder) if look.solid.kind == MESH else look


def _look(body: Body, shown: Solid, given: Mapping[str, Any]) -> Look:
    return Look(
        shown,
        actuators=given["actuators"],
        tethers=given["tethers"],
        ground=given["ground"] if given["ground"].stiffness > 0.0 else None,
        mass=body.mass,
        inertia=float(np.mean(body.principal_moments)),
    )


def _length(vector: Any) -> float:
    return float(np.linalg.norm(vector))


def _frame(values: Mapping[str, Any], name: str) -> Place:
    q = attitude.quaternion(values, f"frames.{name}")
    return tuple(values[f"frames.{name}.position"]), tuple(q)


def _with_mesh(look: Look, body: Body, name: str, folder: str | os.PathLike[str]) -> Look:
    try:
        vertices, triangles, _ = mesh_file.read(file_path.located(name, folder))
    except (OSError, ValueError) as reason:
        return look._replace(solid=solid.ellipsoid(body), note=f"The mesh is not shown: {reason}.")
    return look._replace(mesh=(vertices, triangles))
