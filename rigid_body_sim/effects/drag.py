"""Drag at the centre of mass, component by component in body axes, by the velocity v through the fluid.

    F_i = −(linear_i + quadratic_i |v_i|) v_i        τ_i = −(angular_linear_i + angular_quadratic_i |ω_i|) ω_i

(the diagonal damping matrices of Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2011, section 6.4).
"""

from dataclasses import dataclass

import numpy as np

from ..kernels.arrays import Floats, Vector
from ..kernels.compiled import kernel
from ..kernels.motion import fluid_velocity, velocities_body
from ..kernels.tuples import Load, Motion, Vec, crossed, dot, minus, rotate, rotate_back, unit
from ..values.body import Body
from ..values.parameter import Parameter
from ..values.wrench import ZERO, three_finite
from .base import LoadEffect
from .rows import Row, add_row, add_turning

SIZE = 12


@dataclass(frozen=True)
class Drag:
    """Coefficients along the body axes: linear [N s/m], quadratic [N s²/m²], angular [N m s/rad], [N m s²/rad²].

    Raises ValueError for a coefficient that is negative or not finite: drag takes energy out.
    """

    linear: Vector = ZERO
    quadratic: Vector = ZERO
    angular_linear: Vector = ZERO
    angular_quadratic: Vector = ZERO

    def __post_init__(self) -> None:
        for name in ("linear", "quadratic", "angular_linear", "angular_quadratic"):
            values = three_finite(getattr(self, name), f"drag {name}")
            if min(values) < 0.0:
                raise ValueError(
                    f"drag {name} {list(values)} has a negative entry; drag takes energy out, so none may be below 0"
                )
            object.__setattr__(self, name, values)

    @property
    def values(self) -> tuple[float, ...]:
        """The twelve coefficients in the order of the fields."""
        return (*self.linear, *self.quadratic, *self.angular_linear, *self.angular_quadratic)


NO_DRAG = Drag()


def _row(drag: Drag, body: Body) -> Floats:
    return np.array(drag.values)


@kernel
def _along(model: Floats, linear: int, u: Vec) -> Vec:
    """−(linear + quadratic |u|) u along each axis, with the linear coefficients at model[linear]."""
    q = linear + 3
    return Vec(
        -(model[linear] + model[q] * abs(u.x)) * u.x,
        -(model[linear + 1] + model[q + 1] * abs(u.y)) * u.y,
        -(model[linear + 2] + model[q + 2] * abs(u.z)) * u.z,
    )


@kernel
def drag_load(model: Floats, at: int, body: Motion) -> Load:
    """Force and torque of the drag at ``model[at]``."""
    v_body, w_body = rotate_back(body.q, minus(body.v, fluid_velocity(model))), rotate_back(body.q, body.w)
    return Load(rotate(body.q, _along(model, at, v_body)), rotate(body.q, _along(model, at + 6, w_body)))


@kernel
def add_drag_jacobian(model: Floats, at: int, body: Motion, taut: bool, out: Floats, o: int) -> None:
    """Add the derivative of ``drag_load``; see rows. Along each axis n the force is −f(n · v) n, and n turns along."""
    load = drag_load(model, at, body)
    add_turning(out, o, load.force)
    add_turning(out, o + 36, load.torque)
    zero, v = Vec(0.0, 0.0, 0.0), minus(body.v, fluid_velocity(model))
    for k in range(3):
        n = rotate(body.q, unit(k))
        f = model[at + k] + 2.0 * model[at + 3 + k] * abs(dot(n, v))
        t = model[at + 6 + k] + 2.0 * model[at + 9 + k] * abs(dot(n, body.w))
        by_force = Row(zero, crossed(n, v), n, zero)
        by_torque = Row(zero, crossed(n, body.w), zero, n)
        for i in range(3):
            component = n.x if i == 0 else n.y if i == 1 else n.z
            add_row(out, o + 12 * i, -f * component, by_force)
            add_row(out, o + 36 + 12 * i, -t * component, by_torque)


@kernel
def passes_rest(model: Floats, at: int, state: Floats, work: Floats, z: int) -> bool:
    """Whether |u| u has its kink within the increments work[z:]: a component of v or ω in body axes passes zero."""
    quadratic = 0.0
    for i in range(3):
        quadratic += model[at + 3 + i] + model[at + 9 + i]
    if quadratic == 0.0:
        return False
    p, w = velocities_body(state, model, work, z, 0.0)
    q, s = velocities_body(state, model, work, z, 1.0)
    return (
        (model[at + 3] != 0.0 and p.x * q.x < 0.0)
        or (model[at + 4] != 0.0 and p.y * q.y < 0.0)
        or (model[at + 5] != 0.0 and p.z * q.z < 0.0)
        or (model[at + 9] != 0.0 and w.x * s.x < 0.0)
        or (model[at + 10] != 0.0 and w.y * s.y < 0.0)
        or (model[at + 11] != 0.0 and w.z * s.z < 0.0)
    )


def _coefficients(name: str, text: str, unit_of: str) -> Parameter:
    return Parameter(f"drag.{name}", tuple, ZERO, text, unit_of, least=0.0, length=3, dynamic=True)


EFFECT = LoadEffect(
    name="drag",
    make=Drag,
    zero=NO_DRAG,
    example=Drag((0.5, 0.8, 1.0), (0.2, 0.0, 0.4), (0.02, 0.05, 0.03), (0.01, 0.02, 0.0)),
    acts=lambda drag: any(drag.values),
    left_out="drag",
    parameters=(
        _coefficients(
            "linear",
            "Drag force along each body axis, at the centre of mass, by its velocity through the fluid.",
            "N s/m",
        ),
        _coefficients("quadratic", "The same by the square of the velocity along that axis.", "N s²/m²"),
        _coefficients("angular_linear", "Drag torque about each body axis by the angular velocity.", "N m s/rad"),
        _coefficients(
            "angular_quadratic", "The same by the square of the angular velocity about that axis.", "N m s²/rad²"
        ),
    ),
    dissipates=True,
    size=SIZE,
    row=_row,
    load=drag_load,
    add_jacobian=add_drag_jacobian,
    passes_kink=passes_rest,
)
