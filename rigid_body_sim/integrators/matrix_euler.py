"""Explicit Euler for the rotation matrix, R ← R + h R ω*, made a rotation again after each step (theory 2.7's warning).

The rotation nearest to R (1 + h ω*), its polar factor, turns R about ω by arctan(h |ω|): 1 + h ω* leaves the axis alone
and turns and stretches the plane across it. So the step needs no matrix here, and the state keeps its quaternion; that
both are the same is tested. Without re-orthonormalisation R stops being a rotation, which no attitude can express: see
theory.rotation_matrix for that.
"""

import math

from ..kernels.arrays import Floats
from ..kernels.compiled import kernel
from ..kernels.model import MASS, rates_principal
from ..kernels.motion import Acting
from ..kernels.state import L, P, Q, X, add_to_attitude
from ..kernels.vectors import qmultiply, qrotate
from ..kernels.wrench import force_world, torque_principal
from .base import SCRATCH, Integrator


@kernel
def step(acting: Acting, state: Floats, model: Floats, work: Floats, h: float) -> bool:
    """All four unknowns from their rates at the start of the step."""
    qw, qx, qy, qz = state[Q], state[Q + 1], state[Q + 2], state[Q + 3]
    wx, wy, wz = rates_principal(model, qw, qx, qy, qz, state[L], state[L + 1], state[L + 2])
    fx, fy, fz = force_world(model, qw, qx, qy, qz)
    tx, ty, tz = torque_principal(model, qw, qx, qy, qz)
    tx, ty, tz = qrotate(qw, qx, qy, qz, tx, ty, tz)
    for i in range(3):
        state[X + i] += h * state[P + i] / model[MASS]
    state[P], state[P + 1], state[P + 2] = state[P] + h * fx, state[P + 1] + h * fy, state[P + 2] + h * fz
    state[L], state[L + 1], state[L + 2] = state[L] + h * tx, state[L + 1] + h * ty, state[L + 2] + h * tz
    ax, ay, az = h * wx, h * wy, h * wz
    # tan(½ arctan a) ω / |ω| = t ω h, as a = tan φ gives tan(φ/2) = a / (1 + √(1 + a²)): q ⊗ (1, t h ω), not normalised
    t = 1.0 / (1.0 + math.sqrt(1.0 + (ax * ax + ay * ay + az * az)))
    dw, dx, dy, dz = qmultiply(qw, qx, qy, qz, 0.0, t * ax, t * ay, t * az)
    add_to_attitude(state, dw, dx, dy, dz)
    return True


INTEGRATOR = Integrator(
    name="matrix_euler",
    order=1,
    explicit=True,
    step=step,
    work_size=SCRATCH,
    text=(
        "Explicit Euler for a rotation matrix, re-orthonormalised after each step: the method that the theory chapter "
        "warns of. First order, and it gains energy."
    ),
)
