"""What game engines do: momenta first, then position and attitude from the new momenta, all to first order."""

from ..kernels.arrays import Floats
from ..kernels.compiled import kernel
from ..kernels.model import MASS, rates_principal
from ..kernels.motion import Acting, loads
from ..kernels.state import L, P, Q, X, add_to_attitude
from ..kernels.tuples import Quat
from ..kernels.vectors import qmultiply
from .base import SCRATCH, Integrator


@kernel
def step(acting: Acting, state: Floats, model: Floats, work: Floats, h: float) -> bool:
    """Advance by h [s]; see base.Integrator."""
    qw, qx, qy, qz = state[Q], state[Q + 1], state[Q + 2], state[Q + 3]
    f, t = loads(acting, model, state, 0, Quat(qw, qx, qy, qz))
    state[P], state[P + 1], state[P + 2] = state[P] + h * f.x, state[P + 1] + h * f.y, state[P + 2] + h * f.z
    state[L], state[L + 1], state[L + 2] = state[L] + h * t.x, state[L + 1] + h * t.y, state[L + 2] + h * t.z
    for i in range(3):
        state[X + i] += h * state[P + i] / model[MASS]
    wx, wy, wz = rates_principal(model, qw, qx, qy, qz, state[L], state[L + 1], state[L + 2])
    half = 0.5 * h
    dw, dx, dy, dz = qmultiply(qw, qx, qy, qz, 0.0, half * wx, half * wy, half * wz)
    add_to_attitude(state, dw, dx, dy, dz)
    return True


INTEGRATOR = Integrator(
    name="semi_implicit_euler",
    order=1,
    explicit=True,
    step=step,
    work_size=SCRATCH,
    resisted=True,
    text="Semi-implicit Euler with a normalised quaternion, as in game engines, for comparison: first order.",
)
