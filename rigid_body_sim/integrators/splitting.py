"""Symmetric, symplectic splitting: rotations about the principal axes, with the wrench as kicks.

The energy ½ Σ l_i² / I_i falls into three parts. Under each, the body turns about one principal axis at the constant
rate l_i / I_i while L stays where it is in the world; half a turn about the first, half about the second, a whole one
about the third and back again is a method of order 2. Half a kick by force and torque goes before and after (Strang).
Source: Dullweber, Leimkuhler, McLachlan, J. Chem. Phys. 107 (1997) 5840. Order 4 is the composition of five such steps
by Suzuki, Phys. Lett. A 146 (1990) 319. Both are time-reversible, so the energy error stays bounded.
"""

import math

from ..kernels.arrays import Floats
from ..kernels.compiled import kernel
from ..kernels.model import MASS, MOMENTS
from ..kernels.motion import Acting
from ..kernels.state import L, P, Q, X, add_compensated, add_to_attitude
from ..kernels.vectors import qmultiply, qrotate, qrotate_back
from ..kernels.wrench import force_world, torque_principal
from .base import SCRATCH, Integrator

_OUTER = 1.0 / (4.0 - 4.0 ** (1.0 / 3.0))  # Suzuki's step, taken twice before and twice after the one in the middle
_INNER = 1.0 - 4.0 * _OUTER
_BODY_L = SCRATCH  # angular momentum in principal axes, 3
_ATTITUDE = SCRATCH + 3  # quaternion, 4
WORK_SIZE = SCRATCH + 7


@kernel
def step(acting: Acting, state: Floats, model: Floats, work: Floats, h: float) -> bool:
    """Advance by h [s]; see base.Integrator."""
    _kick(state, model, 0.5 * h)
    for i in range(3):
        add_compensated(state, X + i, h * state[P + i] / model[MASS])
    _turn(state, model, work, h)
    _kick(state, model, 0.5 * h)
    return True


@kernel
def step4(acting: Acting, state: Floats, model: Floats, work: Floats, h: float) -> bool:
    """Advance by h [s], order 4; see base.Integrator."""
    for stage in range(5):
        step(acting, state, model, work, (_INNER if stage == 2 else _OUTER) * h)
    return True


@kernel
def _kick(state: Floats, model: Floats, h: float) -> None:
    """P and L under the force and torque at this attitude, for h [s]."""
    qw, qx, qy, qz = state[Q], state[Q + 1], state[Q + 2], state[Q + 3]
    fx, fy, fz = force_world(model, qw, qx, qy, qz)
    tx, ty, tz = torque_principal(model, qw, qx, qy, qz)
    tx, ty, tz = qrotate(qw, qx, qy, qz, tx, ty, tz)
    add_compensated(state, P, h * fx)
    add_compensated(state, P + 1, h * fy)
    add_compensated(state, P + 2, h * fz)
    add_compensated(state, L, h * tx)
    add_compensated(state, L + 1, h * ty)
    add_compensated(state, L + 2, h * tz)


@kernel
def _turn(state: Floats, model: Floats, work: Floats, h: float) -> None:
    """Turns about the principal axes, in the order of the moments: that does not depend on the axes' names."""
    qw, qx, qy, qz = state[Q], state[Q + 1], state[Q + 2], state[Q + 3]
    b, a, m = _BODY_L, _ATTITUDE, MOMENTS
    work[b], work[b + 1], work[b + 2] = qrotate_back(qw, qx, qy, qz, state[L], state[L + 1], state[L + 2])
    work[a], work[a + 1], work[a + 2], work[a + 3] = qw, qx, qy, qz
    first, second, third = 0, 1, 2
    if model[m + first] > model[m + second]:
        first, second = second, first
    if model[m + second] > model[m + third]:
        second, third = third, second
    if model[m + first] > model[m + second]:
        first, second = second, first
    _turn_about(work, model, first, 0.5 * h)
    _turn_about(work, model, second, 0.5 * h)
    _turn_about(work, model, third, h)
    _turn_about(work, model, second, 0.5 * h)
    _turn_about(work, model, first, 0.5 * h)
    add_to_attitude(state, work[a] - qw, work[a + 1] - qx, work[a + 2] - qy, work[a + 3] - qz)


@kernel
def _turn_about(work: Floats, model: Floats, i: int, h: float) -> None:
    """Turn about principal axis i for h [s] at the rate l_i / I_i."""
    half = 0.5 * h * work[_BODY_L + i] / model[MOMENTS + i]
    sine, cosine = math.sin(half), math.cos(half)
    x, y, z = sine if i == 0 else 0.0, sine if i == 1 else 0.0, sine if i == 2 else 0.0
    a, b = _ATTITUDE, _BODY_L
    work[a], work[a + 1], work[a + 2], work[a + 3] = qmultiply(
        work[a], work[a + 1], work[a + 2], work[a + 3], cosine, x, y, z
    )
    work[b], work[b + 1], work[b + 2] = qrotate_back(cosine, x, y, z, work[b], work[b + 1], work[b + 2])


INTEGRATOR = Integrator(
    name="splitting",
    order=2,
    explicit=True,
    step=step,
    work_size=WORK_SIZE,
    reversible=True,
    text=(
        "Symmetric, symplectic splitting of order 2 into turns about the principal axes and kicks: time-reversible, "
        "with an energy error that stays bounded. For comparison."
    ),
)
INTEGRATOR4 = Integrator(
    name="splitting4",
    order=4,
    explicit=True,
    step=step4,
    work_size=WORK_SIZE,
    reversible=True,
    text="Five steps of `splitting` composed to order 4 (Suzuki), with the same properties. For comparison.",
)
