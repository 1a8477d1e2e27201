"""Ground: a plane that body-fixed points cannot pass: a one-sided spring and damper each, with friction.

A contact whose depth below the plane is d, and which moves with the velocity u, is pushed along the normal n by

    N = max(0, k d − c n · u)    while d > 0,

and across it by friction, −μ N φ u_t / |u_t| with u_t = u − n (n · u). Coulomb's law, φ = 1, is regularised below the
slip speed s by a polynomial with two continuous derivatives; with x = |u_t| / s,

    φ = (15 x − 10 x³ + 3 x⁵) / 8    for x < 1.

So what slides faster than s feels Coulomb's friction itself. What Coulomb's law would keep at rest creeps, slower than
s: on a slope of the angle θ with tan θ < μ at the speed for which φ = tan θ / μ, which is about 8 s tan θ / 15 μ where
it is small. No force pulls a contact to the ground. Stored is ½ k d², and energy is only taken out: c and μ take theirs
and what is left in a spring when N comes to zero before the contact is out of the ground is lost.
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..kernels.arrays import Floats, Vector, python_floats
from ..kernels.compiled import kernel
from ..kernels.model import GRAVITY, MASS, MOMENTS
from ..kernels.motion import Passed, body_attitude, mobility
from ..kernels.state import Q
from ..kernels.tuples import NOTHING, Load, Motion, Quat, Vec, crossed, dot, plus, rotate, scaled, unit, vec
from ..values import rotation
from ..values.body import Body
from ..values.parameter import Parameter, is_array, shown
from ..values.state import Motions
from ..values.wrench import ZERO, three_finite
from .base import LoadEffect
from .rows import Row, add_force_row

UP = (0.0, 0.0, 1.0)
SLIP_SPEED, SLOWEST = 1e-3, 1e-9  # m/s, of what creeps
# Of a contact: its place 3 (from the centre of mass, body axes), the normal 3, then:
_NORMAL, _HEIGHT, _STIFFNESS, _DAMPING, _FRICTION, _SLIP_SPEED, _TOUCHES, SIZE = 3, 6, 7, 8, 9, 10, 11, 12
_ROUND_OFF = 2.0**-50  # a few units in the last place
_SHORTEST, _LONGEST = 0.1, 0.9  # share of a sub-step at which it is looked at once more


@dataclass(frozen=True)
class Ground:
    """The plane n · x = height [m] of world axes, what it is made of, and the points of the body that it keeps out.

    ``normal`` n, of any length, points out of the ground. Each of the ``contacts`` [m, body axes from the body frame's
    origin], shape (n, 3), has a spring of ``stiffness`` [N/m] and a damper of ``damping`` [N s/m] along it, and the
    Coulomb coefficient ``friction`` across, regularised below ``slip_speed`` [m/s]; see effects.ground. Raises
    ValueError for what is not finite or below 0, for a normal without direction, for contacts on a ground without
    stiffness, for a ground of some stiffness that nothing touches, and for a slip speed below 1e-9 m/s.
    """

    height: float = 0.0
    normal: Vector = UP
    stiffness: float = 0.0
    damping: float = 0.0
    friction: float = 0.0
    slip_speed: float = SLIP_SPEED
    contacts: tuple[Vector, ...] = ()

    def __post_init__(self) -> None:
        for name in ("height", "stiffness", "damping", "friction", "slip_speed"):
            object.__setattr__(self, name, self._number(name))
        object.__setattr__(self, "normal", three_finite(self.normal, "ground normal"))
        if not any(self.normal):
            raise ValueError("ground normal [0.0, 0.0, 0.0] has no direction; give one that points out of the ground")
        object.__setattr__(self, "contacts", self._points())
        if self.contacts and self.stiffness == 0.0:
            raise ValueError(
                f"ground stiffness 0 holds none of the {len(self.contacts)} contacts; give one above 0 [N/m], such as "
                "m g / (n d) for a body of mass m that sinks in by d on n of them"
            )
        if self.stiffness > 0.0 and not self.contacts:
            raise ValueError(
                f"ground stiffness {self.stiffness:g} without contacts: no point of the body can touch the ground; "
                "give contacts, or leave the stiffness at 0 for no ground"
            )

    def _number(self, name: str) -> float:
        given = getattr(self, name)
        try:
            value = math.nan if isinstance(given, str | bytes) else float(given)
        except (TypeError, ValueError, OverflowError):
            value = math.nan
        least = {"height": -math.inf, "slip_speed": SLOWEST}.get(name, 0.0)
        if not (math.isfinite(value) and value >= least):
            rule = f" of at least {least:g}" if least > -math.inf else ""
            raise ValueError(f"ground {name} {shown(given)} is not a finite number{rule}")
        return value

    def _points(self) -> tuple[Vector, ...]:
        if not is_array(self.contacts):
            raise ValueError(f"ground contacts {shown(self.contacts)} must be points of the body, (x, y, z) each")
        return tuple(three_finite(point, "ground contact") for point in self.contacts)

    @property
    def unit_normal(self) -> Floats:
        """Unit vector out of the ground, world axes, shape (3,)."""
        normal = np.array(self.normal) / max(map(abs, self.normal))
        return np.asarray(normal / np.linalg.norm(normal))


class Contact(NamedTuple):
    """How a contact stands to the ground: see Simulation.contacts.

    ``penetration`` [m] is its depth below the plane, negative above it; ``normal_force`` [N] pushes it out;
    ``slip_velocity`` [m/s, world axes, shape (3,)] is that along the plane.
    """

    penetration: float
    normal_force: float
    slip_velocity: Floats


def _row(ground: Ground, body: Body) -> Floats:
    arms = np.array(ground.contacts, float).reshape(-1, 3) - body.center_of_mass
    numbers = (ground.height, ground.stiffness, ground.damping, ground.friction, ground.slip_speed, 0.0)
    return np.hstack((arms, np.tile((*ground.unit_normal, *numbers), (len(arms), 1))))


def _energy(ground: Ground, body: Body, state: Motions) -> Any:
    """½ k d² [J] of all contacts that are below the plane."""
    energy: Any = 0.0
    for point in ground.contacts:
        place = state.position + rotation.rotate_each(state.orientation, np.asarray(point, float))
        depth = np.maximum(ground.height - place.astype(np.longdouble) @ ground.unit_normal, 0.0)
        energy = energy + ground.stiffness * depth * depth / 2
    return energy


class Place(NamedTuple):
    """Of a contact, world axes: r from the centre of mass, its velocity u, depth below the plane [m] and its rate."""

    r: Vec
    u: Vec
    depth: float
    rate: float


@kernel
def _place(model: Floats, at: int, body: Motion) -> Place:
    r, n = rotate(body.q, vec(model, at)), vec(model, at + _NORMAL)
    u = plus(body.v, crossed(body.w, r))
    return Place(r, u, model[at + _HEIGHT] - dot(n, body.x) - dot(n, r), -dot(n, u))


@kernel
def _margin(model: Floats, at: int, place: Place) -> float:
    """A length [m] that is above 0 where the contact acts: below the plane, and with N above 0."""
    damped = model[at + _DAMPING] * place.rate / model[at + _STIFFNESS]
    return place.depth + min(0.0, damped)


@kernel
def settle(model: Floats, at: int, body: Motion) -> None:
    """Note whether the contact at ``model[at]`` acts; see base.LoadEffect."""
    model[at + _TOUCHES] = 1.0 if _margin(model, at, _place(model, at, body)) >= 0.0 else 0.0


@kernel
def passed(model: Floats, at: int, before: Motion, after: Motion, h: float) -> Passed:
    """Whether the contact touched down or lifted off in a sub-step of h [s], or may have done both."""
    place = _place(model, at, after)
    x, r, touches = after.x, place.r, model[at + _TOUCHES] != 0.0
    far = _size(x) + _size(r) + abs(model[at + _HEIGHT]) + math.sqrt(model[MOMENTS] / model[MASS])
    by = _margin(model, at, place) / (_ROUND_OFF * far)
    if touches or by > 0.0 or place.rate >= 0.0:
        return Passed(-by if touches else by, 1.0)
    begin = _place(model, at, before)
    if begin.rate <= 0.0:
        return Passed(by, 1.0)
    square = (h * _size(before.w)) ** 2
    # 1/384 of the fourth derivative is what a cubic leaves out, and that of the arm's turning is at most |r| |ω|⁴.
    return Passed(by, _peak(begin, place, h, _size(r) * square * square / 384.0))


@kernel
def _size(a: Vec) -> float:
    return abs(a.x) + abs(a.y) + abs(a.z)


@kernel
def _peak(a: Place, b: Place, h: float, error: float) -> float:
    """Where within h [s] the depth is largest, as a share of h, and 1 where it stays below 0 by that error.

    The depth is taken for the cubic d + s t + q t² + c t³ that it and its rate, above 0 first and below it then, give.
    """
    s, e, rise = h * a.rate, h * b.rate, b.depth - a.depth
    q, c = 3.0 * rise - 2.0 * s - e, s + e - 2.0 * rise
    t = s / (math.sqrt(max(0.0, q * q - 3.0 * c * s)) - q)
    if a.depth + t * (s + t * (q + t * c)) + error <= 0.0:
        return 1.0
    return max(_SHORTEST, min(_LONGEST, t))


class Friction(NamedTuple):
    """Velocity u_t along the plane; p = φ / |u_t|, so that 1 N brakes by −μ p u_t; and p' = dp / d(|u_t|²)."""

    u: Vec
    p: float
    slope: float


@kernel
def _friction(model: Floats, at: int, u: Vec, rate: float) -> Friction:
    """For the velocity u and the rate −n · u; below the slip speed p is a polynomial in |u_t|²."""
    along = plus(u, scaled(rate, vec(model, at + _NORMAL)))
    square, s = dot(along, along), model[at + _SLIP_SPEED]
    x = square / (s * s)
    if x < 1.0:
        return Friction(along, (15.0 - x * (10.0 - 3.0 * x)) / (8.0 * s), (6.0 * x - 10.0) / (8.0 * s * s * s))
    speed = math.sqrt(square)
    return Friction(along, 1.0 / speed, -0.5 / (speed * square))


@kernel
def _normal_force(model: Floats, at: int, place: Place) -> float:
    return model[at + _STIFFNESS] * place.depth + model[at + _DAMPING] * place.rate


@kernel
def ground_load(model: Floats, at: int, body: Motion) -> Load:
    """Force and torque of the contact at ``model[at]``, if it touches as it was settled."""
    if model[at + _TOUCHES] == 0.0:
        return Load(NOTHING, NOTHING)
    place = _place(model, at, body)
    slip, n = _friction(model, at, place.u, place.rate), vec(model, at + _NORMAL)
    along = plus(n, scaled(-model[at + _FRICTION] * slip.p, slip.u))
    force = scaled(_normal_force(model, at, place), along)
    return Load(force, crossed(place.r, force))


@kernel
def add_ground_jacobian(model: Floats, at: int, body: Motion, taut: bool, out: Floats, o: int) -> None:
    """Add the derivative of ``ground_load``; see rows.

    With F = N a, a = n − μ p u_t and N = k d − c n · u, a point that moves by δp changes its force by
    δF = −a (k n · δp + c n · δu) − μ N (p δu_t + 2 p' u_t (u_t · δu)); δp and δu are those of tethers.
    ``taut`` counts the contact as one on which the whole weight rests: nothing is stiffer for long.
    """
    if model[at + _TOUCHES] == 0.0 and not taut:
        return
    place, n = _place(model, at, body), vec(model, at + _NORMAL)
    force_n, slip = _normal_force(model, at, place), _friction(model, at, place.u, place.rate)
    if taut:
        force_n, slip = max(0.0, -model[MASS] * dot(n, vec(model, GRAVITY))), _friction(model, at, NOTHING, 0.0)
    mu = model[at + _FRICTION]
    a = plus(n, scaled(-mu * slip.p, slip.u))
    for i in range(3):
        axis = unit(i)
        by_x = scaled(-model[at + _STIFFNESS] * dot(a, axis), n)
        across = plus(axis, scaled(-dot(n, axis), n))
        curved = scaled(2.0 * slip.slope * dot(slip.u, axis), slip.u)
        by_v = plus(
            scaled(-model[at + _DAMPING] * dot(a, axis), n), scaled(-mu * force_n, plus(scaled(slip.p, across), curved))
        )
        by_b = crossed(place.r, plus(by_x, crossed(by_v, body.w)))
        row = Row(by_x, by_b, by_v, crossed(place.r, by_v))
        add_force_row(out, o, i, place.r, scaled(force_n, a), 1.0, row)


@kernel
def ringing(model: Floats, at: int, state: Floats, h: float) -> float:
    """ω² [1/s²] of the vibration of a contact that touches: none may die away unseen, as it may end in the air."""
    if model[at + _TOUCHES] == 0.0:
        return 0.0
    q = Quat(state[Q], state[Q + 1], state[Q + 2], state[Q + 3])
    arm = rotate(body_attitude(model, q), vec(model, at))
    return model[at + _STIFFNESS] * mobility(model, q, arm, vec(model, at + _NORMAL))


def contacts_at(ground: Ground, body: Body, state: Motions) -> tuple[Contact, ...]:
    """How each contact stands to the ground in one state."""
    q, w_world = Quat(*state.orientation.tolist()), rotation.rotate(state.orientation, state.angular_velocity)
    arm = rotation.rotate(state.orientation, body.center_of_mass)
    x, v = state.position + arm, state.velocity + np.cross(w_world, arm)
    motion = Motion(q, Vec(*x.tolist()), Vec(*v.tolist()), Vec(*w_world.tolist()))
    return tuple(_contact(python_floats(row), motion) for row in _row(ground, body))


def _contact(row: Floats, motion: Motion) -> Contact:
    settle(row, 0, motion)
    place = _place(row, 0, motion)
    force = _normal_force(row, 0, place) if row[_TOUCHES] else 0.0
    return Contact(place.depth, force, np.array(_friction(row, 0, place.u, place.rate).u))


EFFECT = LoadEffect(
    name="ground",
    make=Ground,
    zero=Ground(),
    example=Ground(
        0.3, (0.1, -0.2, 2.0), 300.0, 3.0, 0.3, 0.05, ((0.2, 0.0, -0.3), (-0.2, 0.2, -0.2), (-0.1, -0.2, -0.2))
    ),
    acts=lambda ground: bool(ground.contacts),
    world=("normal",),
    left_out="ground",
    parameters=(
        Parameter(
            "ground.height",
            float,
            0.0,
            "Where the ground is: the plane normal · x = height, world axes.",
            "m",
            dynamic=True,
        ),
        Parameter(
            "ground.normal", tuple, UP, "Which way is out of it, world axes; any length.", length=3, dynamic=True
        ),
        Parameter(
            "ground.stiffness",
            float,
            0.0,
            "Force of each contact by how deep it is; needed with contacts, and 0 without.",
            "N/m",
            least=0.0,
            dynamic=True,
        ),
        Parameter(
            "ground.damping", float, 0.0, "The same by how fast it goes deeper.", "N s/m", least=0.0, dynamic=True
        ),
        Parameter("ground.friction", float, 0.0, "Coulomb coefficient of friction.", least=0.0, dynamic=True),
        Parameter(
            "ground.slip_speed",
            float,
            SLIP_SPEED,
            "Speed from which on the friction is Coulomb's; below it is less, so that what rests on a slope creeps.",
            "m/s",
            least=SLOWEST,
            dynamic=True,
        ),
        Parameter(
            "contacts.<name>.position",
            tuple,
            ZERO,
            "A point of the body that the ground keeps out, from the body frame's origin, body axes.",
            "m",
            length=3,
            required=True,
        ),
    ),
    energy=_energy,
    dissipates=True,
    size=SIZE,
    row=_row,
    load=ground_load,
    add_jacobian=add_ground_jacobian,
    ringing=ringing,
    settle=settle,
    passed=passed,
)
