"""Runge-Kutta-Munthe-Kaas of order 4: classical Runge-Kutta for the rotation vector θ of the step, not for q.

With q = q₀ ⊗ exp(θ/2), θ' = ω + ½ θ × ω + 1/12 θ × (θ × ω) + O(θ⁴) (ω in principal axes), so every stage has an
attitude that is a rotation. Source: Munthe-Kaas, BIT 38 (1998) 92; the series is the inverse of dexp, which may stop
here without loss of order. L is kept in the world, where L' = τ.
"""

from ..kernels.arrays import Floats
from ..kernels.compiled import kernel
from ..kernels.model import MASS, rates_principal
from ..kernels.motion import Acting
from ..kernels.state import L, P, Q, X, add_to_attitude
from ..kernels.vectors import cross, exponential_minus_one, qmultiply, qrotate
from ..kernels.wrench import force_world, torque_principal
from .base import SCRATCH, Integrator

_X, _TURN, _P, _L, _UNKNOWNS = 0, 3, 6, 9, 12  # unknowns of a step: x, θ, P, L
_STAGE = SCRATCH
_SLOPE = SCRATCH + _UNKNOWNS
_SUM = SCRATCH + 2 * _UNKNOWNS
WORK_SIZE = SCRATCH + 3 * _UNKNOWNS


@kernel
def step(acting: Acting, state: Floats, model: Floats, work: Floats, h: float) -> bool:
    """Advance by h [s]; see base.Integrator."""
    for i in range(_UNKNOWNS):
        work[_SUM + i] = 0.0
        work[_SLOPE + i] = 0.0
    for stage in range(4):
        before = 0.0 if stage == 0 else h if stage == 3 else 0.5 * h
        for i in range(3):
            work[_STAGE + _X + i] = state[X + i] + before * work[_SLOPE + _X + i]
            work[_STAGE + _TURN + i] = before * work[_SLOPE + _TURN + i]
            work[_STAGE + _P + i] = state[P + i] + before * work[_SLOPE + _P + i]
            work[_STAGE + _L + i] = state[L + i] + before * work[_SLOPE + _L + i]
        _derivative(state, model, work)
        weight = h / 3.0 if stage == 1 or stage == 2 else h / 6.0
        for i in range(_UNKNOWNS):
            work[_SUM + i] += weight * work[_SLOPE + i]
    for i in range(3):
        state[X + i] += work[_SUM + _X + i]
        state[P + i] += work[_SUM + _P + i]
        state[L + i] += work[_SUM + _L + i]
    t = _SUM + _TURN
    dw, dx, dy, dz = exponential_minus_one(work[t], work[t + 1], work[t + 2])
    dw, dx, dy, dz = qmultiply(state[Q], state[Q + 1], state[Q + 2], state[Q + 3], dw, dx, dy, dz)
    add_to_attitude(state, dw, dx, dy, dz)
    return True


@kernel
def _derivative(state: Floats, model: Floats, work: Floats) -> None:
    """Slopes of x, θ, P, L at the current stage."""
    s, k = _STAGE, _SLOPE
    ax, ay, az = work[s + _TURN], work[s + _TURN + 1], work[s + _TURN + 2]
    dw, dx, dy, dz = exponential_minus_one(ax, ay, az)
    qw, qx, qy, qz = qmultiply(state[Q], state[Q + 1], state[Q + 2], state[Q + 3], 1.0 + dw, dx, dy, dz)
    wx, wy, wz = rates_principal(model, qw, qx, qy, qz, work[s + _L], work[s + _L + 1], work[s + _L + 2])
    bx, by, bz = cross(ax, ay, az, wx, wy, wz)
    cx, cy, cz = cross(ax, ay, az, bx, by, bz)
    tx, ty, tz = torque_principal(model, qw, qx, qy, qz)
    for i in range(3):
        work[k + _X + i] = work[s + _P + i] / model[MASS]
    work[k + _TURN] = wx + 0.5 * bx + cx / 12.0
    work[k + _TURN + 1] = wy + 0.5 * by + cy / 12.0
    work[k + _TURN + 2] = wz + 0.5 * bz + cz / 12.0
    work[k + _P], work[k + _P + 1], work[k + _P + 2] = force_world(model, qw, qx, qy, qz)
    work[k + _L], work[k + _L + 1], work[k + _L + 2] = qrotate(qw, qx, qy, qz, tx, ty, tz)


INTEGRATOR = Integrator(
    name="rkmk4",
    order=4,
    explicit=True,
    step=step,
    work_size=WORK_SIZE,
    text=(
        "Runge-Kutta-Munthe-Kaas of order 4 on the rotation group: every stage has an attitude that is a rotation. "
        "For comparison: its error depends on the rate."
    ),
)
