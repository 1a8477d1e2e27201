"""Added mass: the fluid that moves along with the body, by Kirchhoff's equations.

    p = A v + B ω,  h = Bᵀ v + D ω        the fluid's momentum, about the centre of mass, body axes
    f = −p' − ω × p,  t = −h' − ω × h − v × p        what it does to the body, with v the velocity through the fluid

(Kirchhoff 1869; Lamb, Hydrodynamics, 1932, section 124; Fossen, Handbook of Marine Craft Hydrodynamics and Motion
Control, 2011, equations 6.43 and 8.2). The accelerations in p' and h' are unknowns beside those of the body: with all
else that acts they follow from six linear equations, and no past acceleration is fed back. So a step is stable however
large the added mass is. What spins inside the body, with the angular momentum h, adds ω × h + h' to ω × I ω.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..kernels.arrays import Floats, Vector
from ..kernels.compiled import kernel
from ..kernels.model import INTERNAL, INTERNAL_SLOPE, to_body
from ..kernels.motion import fluid_velocity
from ..kernels.tuples import (
    NOTHING,
    Load,
    Motion,
    Vec,
    added,
    crossed,
    dot,
    minus,
    plus,
    rotate,
    rotate_back,
    scaled,
    unit,
    vec,
)
from ..values import rotation
from ..values.body import Body
from ..values.inertia import MOST
from ..values.parameter import Parameter
from ..values.state import Motions
from ..values.wrench import number
from .base import TransformEffect

_DIAGONAL, _TRIANGLE = 6, 21
_ROUNDED = 1e-9  # an eigenvalue of the scaled matrix so little below zero is what rounding leaves of zero

# In the model, matrices row by row: the added mass about the centre of mass, 6 x 6; G = M (M + M_A)⁻¹ of the body's own
# M; the right half of 1 − G, 6 x 3; inertia of the body, body axes
_ANSWER = 36
_TURNED = 72
_INERTIA = 90
SIZE = 99


@dataclass(frozen=True)
class AddedMass:
    """Added mass of the fluid about the body frame's origin, body axes: linear x, y, z [kg], then rotations [kg m²].

    Six numbers are the diagonal of the symmetric 6 x 6 matrix, 21 its upper triangle, row by row. They are the negative
    hydrodynamic derivatives: −X_u̇, −Y_v̇, and so on. Raises ValueError for another number of them, for what is not
    finite or beyond 1e100, and for a matrix that is not positive semidefinite: of which the fluid's energy would be
    negative.
    """

    added_mass: tuple[float, ...] = (0.0,) * _DIAGONAL

    def __post_init__(self) -> None:
        values = tuple(number(value, "added_mass") for value in self.added_mass)
        if len(values) not in (_DIAGONAL, _TRIANGLE):
            raise ValueError(
                f"added_mass has {len(values)} entries; give 6, the diagonal, or 21, the upper triangle row by row"
            )
        if not np.isfinite(values).all():
            raise ValueError(f"added_mass {list(values)} is not finite; give finite numbers")
        if max(map(abs, values)) > MOST:
            raise ValueError(f"added_mass {list(values)} has an entry beyond {MOST:g}; give smaller ones")
        object.__setattr__(self, "added_mass", values)
        self._check_energy()

    @property
    def matrix(self) -> Floats:
        """The symmetric matrix, shape (6, 6)."""
        if len(self.added_mass) == _DIAGONAL:
            return np.diag(self.added_mass)
        upper = np.zeros((6, 6))
        upper[np.triu_indices(6)] = self.added_mass
        return upper + np.triu(upper, 1).T

    def about_center_of_mass(self, body: Body) -> Floats:
        """The same matrix for the velocity of the centre of mass c in place of the origin's, v_o = v_c + c × ω."""
        shift = np.eye(6)
        shift[:3, 3:] = rotation.skew(body.center_of_mass)
        moved = shift.T @ self.matrix @ shift
        return (moved + moved.T) / 2

    def _check_energy(self) -> None:
        """Kilograms and kg m² are compared as shares of the diagonal."""
        matrix = self.matrix
        diagonal = matrix.diagonal()
        sizes = np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
        if diagonal.min() < 0.0 or np.linalg.eigvalsh(matrix / sizes / sizes[:, None]).min() < -_ROUNDED:
            raise ValueError(
                f"added_mass {list(self.added_mass)} is not positive semidefinite: in some motion the fluid would have "
                "negative energy; give the negative of the hydrodynamic derivatives, 5.5 for an X_u̇ of -5.5 kg"
            )


def _checked(given: AddedMass | Sequence[float]) -> AddedMass:
    if isinstance(given, AddedMass):
        return given
    try:
        return AddedMass(tuple(given))
    except TypeError:
        raise TypeError(f"added_mass: {given!r} is no AddedMass; give 6 or 21 numbers") from None


def _row(one: AddedMass, body: Body) -> Floats:
    moved, own = one.about_center_of_mass(body), np.zeros((6, 6))
    own[:3, :3], own[3:, 3:] = body.mass * np.eye(3), body.inertia
    sizes = np.sqrt((own + moved).diagonal())  # so that kilograms and kg m² weigh alike
    whole = (own + moved) / sizes / sizes[:, None]
    answer = np.linalg.solve(whole, own.T / sizes[:, None]).T / sizes
    turned = np.linalg.solve(whole, moved.T / sizes[:, None]).T / sizes
    return np.concatenate((moved.ravel(), answer.ravel(), turned[:, 3:].ravel(), body.inertia.ravel()))


def _kinetic(one: AddedMass, body: Body, state: Motions, u: Vector) -> Any:
    """½ νᵀ M_A ν + u · p [J], with the velocities ν through the fluid and its momentum p: what the motion adds."""
    u_world = np.broadcast_to(np.asarray(u, float), state.velocity.shape)
    back = state.orientation * (1.0, -1.0, -1.0, -1.0)
    v_body, u_body = rotation.rotate_each(back, state.velocity - u_world), rotation.rotate_each(back, u_world)
    nu = np.concatenate((v_body, state.angular_velocity), axis=-1).astype(np.longdouble)
    momentum = nu @ one.matrix
    return (nu * momentum).sum(-1) / 2 + (u_body * momentum[..., :3]).sum(-1)


@kernel
def _row_times(model: Floats, at: int, a: Vec, b: Vec) -> float:
    m = model
    return m[at] * a.x + m[at + 1] * a.y + m[at + 2] * a.z + m[at + 3] * b.x + m[at + 4] * b.y + m[at + 5] * b.z


@kernel
def _times(model: Floats, at: int, a: Vec, b: Vec) -> Load:
    """The 6 x 6 matrix from ``model[at]`` on times (a, b)."""
    return Load(
        Vec(_row_times(model, at, a, b), _row_times(model, at + 6, a, b), _row_times(model, at + 12, a, b)),
        Vec(_row_times(model, at + 18, a, b), _row_times(model, at + 24, a, b), _row_times(model, at + 30, a, b)),
    )


@kernel
def _rows_times(model: Floats, at: int, a: Vec) -> Vec:
    """The 3 x 3 matrix from ``model[at]`` on times a."""
    return Vec(dot(vec(model, at), a), dot(vec(model, at + 3), a), dot(vec(model, at + 6), a))


@kernel
def _kirchhoff(model: Floats, at: int, one: Load, other: Load) -> Load:
    """Force and torque of the fluid but for accelerations, body axes: linear in each of two velocities (v, ω).

    Those of the motion ν are those of (ν, ν). Accelerations are counted as those of the centre of mass in the world,
    v' + ω × v.
    """
    momentum = _times(model, at, other.force, other.torque)
    along = _times(model, at, crossed(one.torque, other.force), NOTHING)
    munk = crossed(one.force, momentum.force)
    return Load(
        minus(along.force, crossed(one.torque, momentum.force)),
        minus(minus(along.torque, crossed(one.torque, momentum.torque)), munk),
    )


@kernel
def _answer(model: Floats, at: int, load: Load, gyroscopic: Vec) -> Load:
    """What the body's momenta change by, body axes: G load + (1 − G) gyroscopic, so that neither cancels the other."""
    own = _times(model, at + _ANSWER, load.force, load.torque)
    t = at + _TURNED
    return added(own, Load(_rows_times(model, t, gyroscopic), _rows_times(model, t + 9, gyroscopic)))


@kernel
def _in_body(model: Floats, at: int) -> Vec:
    x, y, z = to_body(model, model[at], model[at + 1], model[at + 2])
    return Vec(x, y, z)


@kernel
def _angular_momentum(model: Floats, at: int, w: Vec) -> Vec:
    """Of the body with what spins inside, body axes."""
    return plus(_rows_times(model, at + _INERTIA, w), _in_body(model, INTERNAL))


@kernel
def _velocities(model: Floats, body: Motion) -> Load:
    """Velocity of the centre of mass through the fluid, and ω, body axes."""
    return Load(rotate_back(body.q, minus(body.v, fluid_velocity(model))), rotate_back(body.q, body.w))


@kernel
def transformed_load(model: Floats, at: int, body: Motion, load: Load) -> Load:
    """Force and torque by which the body's own momenta change, of all that acts besides the fluid it moves along."""
    nu = _velocities(model, body)
    here = added(Load(rotate_back(body.q, load.force), rotate_back(body.q, load.torque)), _kirchhoff(model, at, nu, nu))
    turning = crossed(nu.torque, _angular_momentum(model, at, nu.torque))
    own = _answer(model, at, here, plus(turning, _in_body(model, INTERNAL_SLOPE)))
    return Load(rotate(body.q, own.force), rotate(body.q, own.torque))


@kernel
def transform_jacobian(model: Floats, at: int, body: Motion, load: Load, out: Floats, o: int) -> None:
    """Columns of the last six rows: from what all else changes by to what ``transformed_load`` does.

    The first six rows tell what v and ω change by: those of the attitude are of b' = ω − ½ b × ω.
    """
    nu, own = _velocities(model, body), transformed_load(model, at, body, load)
    v, inertia = minus(body.v, fluid_velocity(model)), at + _INERTIA
    for c in range(12):
        b = unit(c - 3) if 3 <= c < 6 else NOTHING
        dv, dw = _column(out, o + c), plus(_column(out, o + 36 + c), scaled(0.5, crossed(b, body.w)))
        change = Load(_turned_back(body, dv, v, b), _turned_back(body, dw, body.w, b))
        here = Load(
            _turned_back(body, _column(out, o + 72 + c), load.force, b),
            _turned_back(body, _column(out, o + 108 + c), load.torque, b),
        )
        here = added(here, added(_kirchhoff(model, at, change, nu), _kirchhoff(model, at, nu, change)))
        spin, other = nu.torque, change.torque
        gyroscopic = plus(
            crossed(other, _angular_momentum(model, at, spin)), crossed(spin, _rows_times(model, inertia, other))
        )
        found = _answer(model, at, here, gyroscopic)
        _set_column(out, o + 72 + c, plus(rotate(body.q, found.force), crossed(b, own.force)))
        _set_column(out, o + 108 + c, plus(rotate(body.q, found.torque), crossed(b, own.torque)))


@kernel
def _turned_back(body: Motion, change: Vec, a: Vec, b: Vec) -> Vec:
    """Change of Rᵀ a, where a changes and the body turns by b."""
    return rotate_back(body.q, plus(change, crossed(a, b)))


@kernel
def _column(out: Floats, at: int) -> Vec:
    return Vec(out[at], out[at + 12], out[at + 24])


@kernel
def _set_column(out: Floats, at: int, a: Vec) -> None:
    out[at], out[at + 12], out[at + 24] = a.x, a.y, a.z


EFFECT = TransformEffect(
    name="added_mass",
    group="body",
    make=AddedMass,
    zero=AddedMass(),
    example=AddedMass(
        (
            3.0,
            0.2,
            -0.1,
            0.05,
            0.3,
            -0.2,
            5.0,
            0.3,
            -0.25,
            0.1,
            0.15,
            4.0,
            0.1,
            0.2,
            -0.1,
            0.6,
            0.02,
            0.03,
            0.8,
            -0.04,
            0.5,
        )
    ),
    check=_checked,
    acts=lambda one: any(one.added_mass),
    left_out="added mass",
    parameters=(
        Parameter(
            "body.added_mass",
            tuple,
            (0.0,) * _DIAGONAL,
            "Added mass of the fluid about the body frame's origin, body axes: 6 numbers = diagonal (x, y, z, then "
            "rotations), 21 = upper triangle row by row.",
            "kg, kg m, kg m²",
        ),
    ),
    kinetic=_kinetic,
    size=SIZE,
    row=_row,
    load=transformed_load,
    jacobian=transform_jacobian,
)
