"""The state of a rigid body as users read and write it; the flat layout that kernels advance is in kernels.state."""

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..kernels.arrays import Floats, Vector, python_floats
from ..kernels.model import FASTEST
from ..kernels.state import LOW, SIZE, P, write_state
from . import rotation
from .wrench import three_finite


class Motions(Protocol):
    """Any number of states: what State has, as arrays of shape (..., 3) and (..., 4)."""

    @property
    def position(self) -> Floats: ...
    @property
    def orientation(self) -> Floats: ...
    @property
    def velocity(self) -> Floats: ...
    @property
    def angular_velocity(self) -> Floats: ...


class State:
    """Position, attitude and velocities of a body frame.

    Parameters
    ----------
    position : array_like, shape (3,)
        Position [m] of the body frame's origin, world axes.
    orientation : array_like, shape (4,)
        Quaternion (w, x, y, z), body → world; normalised here.
    velocity : array_like, shape (3,)
        Velocity [m/s] of the body frame's origin, world axes.
    angular_velocity : array_like, shape (3,)
        Angular velocity [rad/s] in body axes.

    Raises
    ------
    ValueError
        A value that is not finite, a wrong shape, or an orientation without direction.
    """

    __slots__ = ("values",)

    def __init__(
        self,
        position: Vector = (0.0, 0.0, 0.0),
        orientation: ArrayLike = (1.0, 0.0, 0.0, 0.0),
        velocity: Vector = (0.0, 0.0, 0.0),
        angular_velocity: Vector = (0.0, 0.0, 0.0),
    ):
        self.values = np.concatenate(
            (
                three_finite(position, "position"),
                rotation.normalize(orientation),
                three_finite(velocity, "velocity"),
                three_finite(angular_velocity, "angular_velocity"),
            )
        )
        self.values.flags.writeable = False

    @property
    def position(self) -> Floats:
        """Position [m] of the body frame's origin, world axes, shape (3,)."""
        return self.values[0:3]

    @property
    def orientation(self) -> Floats:
        """Unit quaternion (w, x, y, z), body → world, shape (4,)."""
        return self.values[3:7]

    @property
    def velocity(self) -> Floats:
        """Velocity [m/s] of the body frame's origin, world axes, shape (3,)."""
        return self.values[7:10]

    @property
    def angular_velocity(self) -> Floats:
        """Angular velocity [rad/s], body axes, shape (3,)."""
        return self.values[10:13]

    def __repr__(self) -> str:
        p, q, v, w = (self.values[a:b].tolist() for a, b in ((0, 3), (3, 7), (7, 10), (10, 13)))
        return f"{type(self).__name__}(position={p}, orientation={q}, velocity={v}, angular_velocity={w})"


class BodyState(State):
    """State of a given body at one moment: a State with its momentum, as ``Simulation.state`` gives it."""

    __slots__ = ()

    def __init__(self, values: Floats):
        self.values = values
        values.flags.writeable = False

    @property
    def momentum(self) -> Floats:
        """Momentum P [kg m/s], world axes, shape (3,)."""
        return self.values[13:16]

    @property
    def angular_momentum(self) -> Floats:
        """Angular momentum L [kg m²/s] about the centre of mass, world axes, shape (3,)."""
        return self.values[16:19]


def body_state(motion: Sequence[float], flat: Floats) -> BodyState:
    """What users read of a flat state and the ``motion`` that kernels.state.read_motion makes of it."""
    return BodyState(np.array((*motion[:10], *motion[16:], *flat[P:LOW].tolist())))


def is_slow_enough(motion: Sequence[float]) -> bool:
    """Whether a pose is finite, and its velocities are in whatever axes; NaN is not."""
    return all(map(math.isfinite, motion)) and max(map(abs, (*motion[7:10], *motion[16:19]))) < FASTEST


def flatten(state: State, model: Floats) -> Floats:
    """The 26 numbers of a state for the body in ``model`` (see Terms.model). Raises ValueError on overflow."""
    flat = np.zeros(SIZE)
    write_state(state.values[:13].tolist(), python_floats(model), python_floats(flat))
    if not np.isfinite(flat).all():
        raise ValueError(f"{state!r} {BEYOND}")
    return flat


BEYOND = (
    "puts the centre of mass or a momentum beyond the range of floats; "
    "give a smaller position, smaller velocities, mass or inertia"
)
