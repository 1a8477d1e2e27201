"""Tethers: a spring and damper between a body-fixed point and a point fixed in the world."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..kernels.arrays import Floats, Vector
from ..kernels.compiled import kernel
from ..kernels.motion import body_attitude, mobility
from ..kernels.state import Q, X
from ..kernels.tuples import NOTHING, Load, Motion, Quat, Vec, crossed, dot, plus, rotate, scaled, unit, vec
from ..values import rotation
from ..values.body import Body
from ..values.parameter import Parameter
from ..values.state import Motions
from ..values.wrench import ZERO, three_finite
from . import spring
from .base import LoadEffect
from .rows import Row, add_force_row

# body point 3 (from the centre of mass), anchor 3, then:
_SPRING = 6
_REST_LENGTH, _STIFFNESS, _DAMPING, _SLACK, SIZE = (_SPRING + i for i in range(spring.SIZE + 1))
_ANCHOR = 3
DIED_AWAY = 20.0  # e-foldings in a step after which a vibration is over: e⁻²⁰ is 2e-9


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
        spring.check(self, "tether")


def _row(tether: Tether, body: Body) -> Floats:
    arm = np.subtract(tether.body_point, body.center_of_mass)
    return np.array((*arm, *tether.anchor, *spring.numbers(tether)), float)


def _energy(tether: Tether, body: Body, state: Motions) -> Any:
    """½ k s² [J] of the stretch s, which is zero while it is slack."""
    point = state.position + rotation.rotate_each(state.orientation, np.asarray(tether.body_point, float))
    return spring.energy(tether, point.astype(np.longdouble) - tether.anchor)


class Pull(NamedTuple):
    """Unit vector from the anchor to the body point, world axes; length [m]; tension [N]."""

    n: Vec
    length: float
    tension: float


@kernel
def tether_direction(model: Floats, at: int, point: Vec) -> Vec:
    """Unit vector from the anchor of the tether at ``model[at]`` to a point; zero where that is the anchor itself."""
    a = at + _ANCHOR
    x, y, z = point.x - model[a], point.y - model[a + 1], point.z - model[a + 2]
    length = math.sqrt(x * x + y * y + z * z)
    if length == 0.0:
        return NOTHING
    return Vec(x / length, y / length, z / length)


@kernel
def _pull(model: Floats, at: int, body: Motion, arm: Vec) -> Pull:
    """How the tether at ``model[at]`` pulls; ``arm``: body point from the centre of mass, world axes.

    At length zero there is no direction and no force.
    """
    a = at + _ANCHOR
    x, y, z = body.x.x + arm.x - model[a], body.x.y + arm.y - model[a + 1], body.x.z + arm.z - model[a + 2]
    length = math.sqrt(x * x + y * y + z * z)
    if length == 0.0:
        return Pull(NOTHING, 0.0, 0.0)
    n = Vec(x / length, y / length, z / length)
    rate = dot(n, plus(body.v, crossed(body.w, arm)))
    return Pull(n, length, spring.tension(model, at + _SPRING, length, rate))


@kernel
def tether_load(model: Floats, at: int, body: Motion) -> Load:
    """Force and torque of the tether at ``model[at]``."""
    arm = rotate(body.q, vec(model, at))
    pull = _pull(model, at, body, arm)
    force = scaled(-pull.tension, pull.n)
    return Load(force, crossed(arm, force))


class _Stiffness(NamedTuple):
    """What a tether's force changes with: δF = −s δp − n (g · δp) − damping n (n · δu), with its tension.

    p is where the body point is and u its velocity; n is the unit vector from the anchor.
    """

    tension: float
    n: Vec
    g: Vec
    s: float


@kernel
def _stiffness(model: Floats, at: int, taut: bool, body: Motion, arm: Vec) -> _Stiffness:
    """All zero where the tether does not pull, unless ``taut``."""
    n, length, tension = _pull(model, at, body, arm)
    if model[at + _SLACK] != 0.0 and tension <= 0.0 and not taut:
        return _Stiffness(0.0, NOTHING, NOTHING, 0.0)
    if length == 0.0:  # without a direction only a spring of no rest length is smooth: it pulls alike all round
        return _Stiffness(0.0, NOTHING, NOTHING, model[at + _STIFFNESS] if model[at + _REST_LENGTH] == 0.0 else 0.0)
    s = tension / length
    u = plus(crossed(body.w, arm), body.v)
    across = model[at + _DAMPING] / length
    along = model[at + _STIFFNESS] - s - across * dot(n, u)
    return _Stiffness(tension, n, plus(scaled(along, n), scaled(across, u)), s)


@kernel
def add_tether_jacobian(model: Floats, at: int, body: Motion, taut: bool, out: Floats, o: int) -> None:
    """Add the derivative of ``tether_load``; see rows.

    The arm r turns with the body, so the point moves by δp = δx + b × r and δu = δv + δω × r + ω × (b × r), and with
    τ = r × F: δτ = r × δF + (b × r) × F. ``taut`` counts the tether as pulling even where it is slack.
    """
    r = rotate(body.q, vec(model, at))
    tension, n, g, s = _stiffness(model, at, taut, body, r)
    force = scaled(-tension, n)
    d = scaled(model[at + _DAMPING], n)
    h = crossed(r, plus(g, crossed(d, body.w)))
    e = crossed(r, d)
    for i in range(3):
        axis = unit(i)
        j = crossed(r, axis)
        along = dot(n, axis)
        by_x = plus(scaled(s, axis), scaled(along, g))
        row = Row(by_x, plus(scaled(s, j), scaled(along, h)), scaled(along, d), scaled(along, e))
        add_force_row(out, o, i, r, force, -1.0, row)


@kernel
def ringing(model: Floats, at: int, state: Floats, h: float) -> float:
    """ω² [1/s²] of the vibration along the tether when it still rings at the end of a step h [s]; else 0."""
    q = Quat(state[Q], state[Q + 1], state[Q + 2], state[Q + 3])
    arm = rotate(body_attitude(model, q), vec(model, at))
    n = tether_direction(model, at, plus(vec(state, X), arm))
    ease = mobility(model, q, arm, n)
    if 0.5 * model[at + _DAMPING] * ease * h < DIED_AWAY:
        return model[at + _STIFFNESS] * ease
    return 0.0


EFFECT = LoadEffect(
    name="tethers",
    make=Tether,
    zero=Tether(),
    example=Tether((0.1, -0.2, 0.3), (0.5, 0.0, 2.0), 0.5, 40.0, 0.0, False),
    many=True,
    world=("anchor",),
    left_out="tethers",
    parameters=(
        Parameter(
            "tethers.<name>.body_point",
            tuple,
            ZERO,
            "Where a tether is fastened to the body, from the body frame's origin, body axes.",
            "m",
            length=3,
            dynamic=True,
        ),
        Parameter(
            "tethers.<name>.anchor",
            tuple,
            ZERO,
            "Where its other end is, world axes.",
            "m",
            length=3,
            required=True,
            dynamic=True,
        ),
        *spring.parameters("tethers", dynamic=True),
    ),
    energy=_energy,
    size=SIZE,
    row=_row,
    load=tether_load,
    add_jacobian=add_tether_jacobian,
    ringing=ringing,
)
