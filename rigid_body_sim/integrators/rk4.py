"""The classical Runge-Kutta method of order 4 on (x, q, P, L), with the quaternion normalised after each step.

The wrench is evaluated where the body is at each stage, so a body-axes wrench turns with the body inside the step.
"""

import math

from ..physics.compiled import kernel
from ..physics.forces import MASS, force_world, rates_principal, reduce_wrench, torque_principal
from ..physics.rotation import qmultiply, qrotate
from ..physics.state import LOW, SIZE, L, P, Q, X, add_to_attitude, copy, is_finite
from .base import Integrator

_STAGE = 0  # the state at the current stage, 13
_SLOPE = LOW  # its derivative, 13
_SUM = 2 * LOW  # weighted sum of the derivatives, 13
_BACKUP = 3 * LOW  # the state before the step
WORK_SIZE = _BACKUP + SIZE


@kernel
def steps(state, model, work, h, n):
    """Advance by up to n steps of h [s]; see base.Integrator."""
    reduce_wrench(model)
    for done in range(n):
        copy(state, 0, work, _BACKUP)
        _step(state, model, work, h)
        if not is_finite(state):
            copy(work, _BACKUP, state, 0)
            return done
    return n


@kernel
def _step(state, model, work, h):
    for i in range(LOW):
        work[_STAGE + i] = state[i]
        work[_SUM + i] = 0.0
    for stage in range(4):
        derivative(model, work, _STAGE, work, _SLOPE)
        weight = h / 3.0 if stage == 1 or stage == 2 else h / 6.0
        ahead = 0.5 * h if stage < 2 else h
        for i in range(LOW):
            work[_SUM + i] += weight * work[_SLOPE + i]
            work[_STAGE + i] = state[i] + ahead * work[_SLOPE + i]
    for i in range(LOW):
        if not Q <= i < Q + 4:
            state[i] += work[_SUM + i]
    q = _SUM + Q
    add_to_attitude(state, work[q], work[q + 1], work[q + 2], work[q + 3])


@kernel
def derivative(model, state, at, slope, to):
    """dY/dt of the state that begins at ``state[at]`` into ``slope[to:to + 13]``; theory (2.6.1) with q for R.

    Between the stages q is not of unit length, and a rotation needs it to be: without that, the error depends on which
    way the body axes were chosen to point.
    """
    a, b = at, to
    w, x, y, z = state[a + Q], state[a + Q + 1], state[a + Q + 2], state[a + Q + 3]
    unit = 1.0 / math.sqrt(w * w + x * x + y * y + z * z)
    qw, qx, qy, qz = unit * w, unit * x, unit * y, unit * z
    wx, wy, wz = rates_principal(model, qw, qx, qy, qz, state[a + L], state[a + L + 1], state[a + L + 2])
    tx, ty, tz = torque_principal(model, qw, qx, qy, qz)
    for i in range(3):
        slope[b + X + i] = state[a + P + i] / model[MASS]
    slope[b + Q], slope[b + Q + 1], slope[b + Q + 2], slope[b + Q + 3] = qmultiply(
        w, x, y, z, 0.0, 0.5 * wx, 0.5 * wy, 0.5 * wz
    )
    slope[b + P], slope[b + P + 1], slope[b + P + 2] = force_world(model, qw, qx, qy, qz)
    slope[b + L], slope[b + L + 1], slope[b + L + 2] = qrotate(qw, qx, qy, qz, tx, ty, tz)


INTEGRATOR = Integrator(
    name="rk4",
    order=4,
    explicit=True,
    steps=steps,
    work_size=WORK_SIZE,
    text="Classical Runge-Kutta of order 4, quaternion normalised, for comparison: its error depends on the rate.",
)
