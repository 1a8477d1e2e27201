"""Forces that always act, each at a body-fixed point: buoyancy, say. They keep their direction while the body turns."""

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np

from ..values import rotation
from ..values.body import Body
from ..values.parameter import Parameter
from ..values.state import Motions
from ..values.wrench import ZERO, PointForce, Wrench
from .base import Lever, SeriesEffect


class ConstantForce(NamedTuple):
    """Where [m, body axes from the body frame's origin], and the force there [N, world axes]."""

    body_point: tuple[float, float, float] = ZERO
    force: tuple[float, float, float] = ZERO


def _checked(given: Iterable[PointForce]) -> tuple[PointForce, ...]:
    try:
        points = tuple(given)
    except TypeError:
        raise TypeError(
            f"forces: {given!r} is no sequence; give pairs of where (x, y, z) and the force there"
        ) from None
    return Wrench(points=points).points


def _lever(force: PointForce, body: Body) -> Iterator[Lever]:
    yield Lever(*force)


def _energy(given: PointForce, body: Body, state: Motions) -> Any:
    """−f · p [J], with the point p in the world: none at its origin."""
    point, force = given
    places = state.position + rotation.rotate_each(state.orientation, np.asarray(point, float))
    return -(places @ np.asarray(force, np.longdouble))


EFFECT = SeriesEffect(
    name="forces",
    make=ConstantForce,
    zero=ConstantForce(),
    example=ConstantForce((0.1, 0.2, -0.1), (0.5, -1.0, 2.0)),
    many=True,
    check=_checked,
    acts=lambda given: any(given[1]),
    world=("force",),
    left_out="forces at points",
    parameters=(
        Parameter(
            "forces.<name>.body_point",
            tuple,
            ZERO,
            "Where a force that always acts is applied, from the body frame's origin, body axes.",
            "m",
            length=3,
            dynamic=True,
        ),
        Parameter(
            "forces.<name>.force",
            tuple,
            (0.0, 0.0, 1.0),
            "That force, world axes: it keeps its direction while the point turns with the body.",
            "N",
            length=3,
            required=True,
            dynamic=True,
        ),
    ),
    energy=_energy,
    levers=_lever,
)
