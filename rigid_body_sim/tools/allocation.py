"""Which commands to actuators make a wanted wrench: the least ones, by the pseudo-inverse. No ROS."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..effects.actuators import Actuator, wrench_of
from ..kernels.arrays import Floats
from ..values import rotation
from ..values.body import Body

AXES = ("force along x", "force along y", "force along z", "torque about x", "torque about y", "torque about z")
_REACHED = 1e-9  # of 1: what rounding leaves of a direction that the actuators cannot give


class Allocation(NamedTuple):
    """Actuators of one type, and how they make a wrench: six numbers, force [N] and torque about the centre of mass
    [N m], both in body axes.

    ``effect``, shape (6, n), is that of a unit of each level: of a thruster's force [N], of the square of a rotor's
    speed [rad²/s²], of the torque of a wheel's motor [N m], which pushes the body the other way.
    """

    actuators: tuple[Actuator, ...]
    effect: Floats
    inverse: Floats  # (n, 6)

    def commands(self, wrench: ArrayLike) -> Floats:
        """Commands [N, rad/s or N m], shape (n,), for a wrench, shape (6,); a share of it where it is beyond a limit.

        All are then lessened alike, so that the wrench keeps its direction; a rotor that would have to turn the other
        way stands still.
        """
        levels = self.inverse @ np.asarray(wrench, float)
        rotors = self.actuators[0].type == "rotor"
        ends = [(0.0, one.max**2) if rotors else (one.min, one.max) for one in self.actuators]
        levels = levels * min(1.0, *(_share(level, *end) for level, end in zip(levels.tolist(), ends, strict=True)))
        return np.sqrt(np.maximum(levels, 0.0)) if rotors else levels


def _share(level: float, least: float, most: float) -> float:
    """How much of a level is within its limits, the least of which is 0 for a rotor: that lessens nothing."""
    limit = most if level > 0.0 else least
    return limit / level if abs(level) > abs(limit) > 0.0 else 1.0


def allocation(actuators: Sequence[Actuator], body: Body, needed: ArrayLike) -> Allocation:
    """The allocation to actuators of one type, which must be able to give the ``needed`` ones of the six numbers.

    ``needed`` is a mask, shape (6,). Raises ValueError when they cannot, and for a thruster or wheel that pushes one
    way only, which a pseudo-inverse does not know.
    """
    for one in actuators:
        if not (one.type == "rotor" or one.min < 0.0 < one.max):
            raise ValueError(f"{one}: pushes one way only, from {one.min:g} to {one.max:g}; give min below 0 < max")
    effect = np.column_stack([_effect(one, body) for one in actuators])
    inverse: Floats = np.linalg.pinv(effect, rcond=_REACHED).astype(float)
    for i in np.flatnonzero(np.asarray(needed, bool)).tolist():
        if abs(1.0 - float(effect[i] @ inverse[:, i])) > 1e-6:
            names = ", ".join(one.name for one in actuators)
            raise ValueError(f"the actuators {names} cannot give a {AXES[i]} alone; give the plant some that can")
    return Allocation(tuple(actuators), effect, inverse)


def _effect(one: Actuator, body: Body) -> Floats:
    """Force and torque about the centre of mass, body axes, by a unit of its level."""
    if one.type == "wheel":
        axis = np.array(one.axis)
        return np.concatenate((np.zeros(3), -axis / np.linalg.norm(axis)))
    wrench = wrench_of(one, body)
    turned = [rotation.rotate(body.q_body_principal, part) for part in (wrench[:3], wrench[3:])]
    return np.concatenate(turned)
