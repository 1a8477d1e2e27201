"""Tether."""

import math
from dataclasses import dataclass

import numpy as np

from ..kernels.arrays import Floats, Vector
from ..values.wrench import ZERO, three_finite


@dataclass(frozen=True)
class Tether:
    """A spring and damper between a body point [m, body axes from the body frame's origin] and an anchor [m, world].

    The tension is stiffness [N/m] times what the length exceeds rest_length [m], plus damping [N s/m] times the rate of
    lengthening. With ``slack`` it pulls only while stretched, and never pushes. Raises ValueError for a value that is
    negative or not finite.
    """

    body_point: Vector = ZERO
    anchor: Vector = ZERO
    rest_length: float = 0.0
    stiffness: float = 0.0
    damping: float = 0.0
    slack: bool = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "body_point", three_finite(self.body_point, "tether body_point"))
        object.__setattr__(self, "anchor", three_finite(self.anchor, "tether anchor"))
        for name in ("rest_length", "stiffness", "damping"):
            value = float(getattr(self, name))
            if not 0.0 <= value < math.inf:
                raise ValueError(f"tether {name} {value:g} is not a finite number of at least 0")
            object.__setattr__(self, name, value)

    def row(self, center_of_mass: Floats) -> Floats:
        """The numbers that the kernels need, shape (10,): the point is taken from the centre of mass."""
        arm = np.subtract(self.body_point, center_of_mass)
        return np.array((*arm, *self.anchor, self.rest_length, self.stiffness, self.damping, self.slack), float)
