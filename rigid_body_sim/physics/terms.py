"""What the equations of motion are made of, the held wrench apart."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

from .arrays import Floats, Vector
from .body import Body
from .forces import new_model
from .resistance import NO_DRAG, Drag, Tether
from .wrench import ZERO, PointForce, Wrench, three_finite


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
