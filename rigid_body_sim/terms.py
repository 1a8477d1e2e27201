"""What the equations of motion are made of, the held wrench apart."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .effects.drag import NO_DRAG, Drag
from .effects.tether import Tether
from .kernels.arrays import Floats, Vector
from .kernels.model import (
    CENTER_OF_MASS,
    DRAG,
    EULER,
    FASTEST,
    GRAVITY,
    MASS,
    MOMENTS,
    MOST_MOMENTUM,
    N_POINTS,
    N_TETHERS,
    POINTS,
    Q_BODY_PRINCIPAL,
    RESISTED,
    RTOL,
    SAFE_ANGULAR_MOMENTUM,
    TETHERS_AT,
    WRENCH,
)
from .kernels.resistance import TETHER_SIZE
from .values.body import Body
from .values.wrench import ZERO, PointForce, Wrench, three_finite


@dataclass(frozen=True)
class Terms:
    """A body and all that acts on it without being sent.

    ``gravity``: acceleration of free fall [m/s²], world axes. ``forces``: (point [m, body axes, from the body frame's
    origin], force [N, world axes]) that always act. ``rtol``: relative error that an error-controlled integrator may
    make in a step. Raises ValueError for a value that is not finite or not in range.
    """

    body: Body
    gravity: Vector = ZERO
    drag: Drag = NO_DRAG
    tethers: Sequence[Tether] = ()
    forces: Sequence[PointForce] = ()
    rtol: float = 1e-9

    def __post_init__(self) -> None:
        object.__setattr__(self, "gravity", three_finite(self.gravity, "gravity"))
        object.__setattr__(self, "tethers", tuple(self.tethers))
        object.__setattr__(self, "forces", Wrench(points=self.forces).points)
        object.__setattr__(self, "rtol", float(self.rtol))
        if not 1e-13 <= self.rtol <= 1.0:
            raise ValueError(f"rtol {self.rtol:g} is not between 1e-13 and 1; try 1e-9")

    @property
    def dragged(self) -> bool:
        """Whether drag acts."""
        return any(self.drag.values)

    @property
    def resisted(self) -> bool:
        """Whether drag or a tether acts."""
        return bool(self.tethers) or self.dragged

    @property
    def lever(self) -> bool:
        """Whether a constant force acts beside the centre of mass, and so turns the body."""
        center = tuple(self.body.center_of_mass.tolist())
        return any(any(force) and point != center for point, force in self.forces)

    def optional(self) -> dict[str, Any]:
        """All but the body, by the names that the constructor of a Simulation has for them."""
        return {field.name: getattr(self, field.name) for field in fields(self) if field.name != "body"}

    def model(self, wrench: Wrench) -> Floats:
        """The kernels' view of all this and a held wrench."""
        return new_model(self.body, self.gravity, wrench, self.drag, self.tethers, self.rtol, self.forces)

    def turned_by(self, wrench: Wrench) -> bool:
        """Whether a torque may act, or a force that turns with the body."""
        return wrench.turns or self.lever


def new_model(
    body: Body,
    gravity: ArrayLike,
    wrench: Wrench,
    drag: Drag = NO_DRAG,
    tethers: Sequence[Tether] = (),
    rtol: float = 1e-9,
    forces: Sequence[PointForce] = (),
) -> Floats:
    """Model array for a body [SI, body axes], gravity [m/s², world], a held wrench, drag, tethers and constant forces.

    Constant forces are points that act beside those of the wrench, whichever it is.
    """
    points = (*wrench.points, *forces)
    tethers_at = POINTS + 6 * len(points)
    model = np.zeros(tethers_at + TETHER_SIZE * len(tethers))
    model[MASS] = body.mass
    model[MOMENTS : MOMENTS + 3] = body.principal_moments
    model[Q_BODY_PRINCIPAL : Q_BODY_PRINCIPAL + 4] = body.q_body_principal
    model[CENTER_OF_MASS : CENTER_OF_MASS + 3] = body.center_of_mass
    model[GRAVITY : GRAVITY + 3] = gravity
    model[WRENCH : WRENCH + 12] = wrench.values
    model[N_POINTS] = len(points)
    model[POINTS:tethers_at] = np.ravel(points)
    model[DRAG : DRAG + 12] = drag.values
    model[N_TETHERS], model[TETHERS_AT] = len(tethers), tethers_at
    for k, tether in enumerate(tethers):
        row = tethers_at + TETHER_SIZE * k
        model[row : row + TETHER_SIZE] = tether.row(body.center_of_mass)
    model[RESISTED] = 1.0 if tethers or any(drag.values) else 0.0
    model[RTOL] = rtol
    x, y, z = map(float, body.principal_moments)
    model[EULER : EULER + 3] = (y - z) / x, (z - x) / y, (x - y) / z
    model[MOST_MOMENTUM] = FASTEST * body.mass
    model[SAFE_ANGULAR_MOMENTUM] = FASTEST * min(x, y, z) / (1.0 + math.hypot(*body.center_of_mass))
    return model
