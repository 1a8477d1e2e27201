"""The classical Runge-Kutta method of order 4 on (x, q, P, L), with the quaternion normalised after each step.

The wrench is evaluated where the body is at each stage, so a body-axes wrench turns with the body inside the step.
"""

from ..kernels.arrays import Floats
from ..kernels.compiled import kernel
from ..kernels.motion import Acting, derivative
from ..kernels.state import LOW, Q, add_to_attitude
from .base import SCRATCH, Integrator

_STAGE = SCRATCH  # the state at the current stage, 13
_SLOPE = SCRATCH + LOW  # its derivative, 13
_SUM = SCRATCH + 2 * LOW  # weighted sum of the derivatives, 13
WORK_SIZE = SCRATCH + 3 * LOW


@kernel
def step(acting: Acting, state: Floats, model: Floats, work: Floats, h: float) -> bool:
    """Advance by h [s]; see base.Integrator."""
    for i in range(LOW):
        work[_STAGE + i] = state[i]
        work[_SUM + i] = 0.0
    for stage in range(4):
        derivative(acting, model, work, _STAGE, work, _SLOPE)
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
    return True


INTEGRATOR = Integrator(
    name="rk4",
    order=4,
    explicit=True,
    step=step,
    work_size=WORK_SIZE,
    resisted=True,
    text="Classical Runge-Kutta of order 4, quaternion normalised, for comparison: its error depends on the rate.",
)
