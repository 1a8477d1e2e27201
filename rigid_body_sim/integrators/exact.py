"""Rotation without torque in closed form, for any time in one evaluation; see kernels.free_motion.

n steps are one evaluation over n h, so they cost what one costs, and the error of the attitude depends on the angle
turned since the wrench last changed, not on the number of steps.
"""

from ..kernels.arrays import Floats
from ..kernels.compiled import kernel
from ..kernels.free_motion import WORK_SIZE as _TURN_SIZE
from ..kernels.free_motion import turn_freely
from ..kernels.model import MASS
from ..kernels.state import SIZE, P, Q, X, add_compensated, copy, is_finite
from ..kernels.wrench import force_world, reduce_wrench
from .base import Integrator

_BACKUP = _TURN_SIZE  # the state before the steps
WORK_SIZE = _BACKUP + SIZE


@kernel
def steps(state: Floats, model: Floats, work: Floats, h: float, n: int) -> int:
    """Advance by up to n steps of h [s]; see base.Integrator."""
    reduce_wrench(model)
    copy(state, 0, work, _BACKUP)
    if _advance(state, model, work, n * h):
        return n
    done, too_many = 0, n
    while too_many - done > 1:  # how many can be done, by bisection
        trial = (done + too_many) // 2
        if _advance(state, model, work, trial * h):
            done = trial
        else:
            too_many = trial
    _advance(state, model, work, done * h)
    return done


@kernel
def _advance(state: Floats, model: Floats, work: Floats, t: float) -> bool:
    """The state t [s] after the one in the backup; False when there is none. For t = 0 it is that one.

    A force in body axes is right here as long as the body does not turn.
    """
    copy(work, _BACKUP, state, 0)
    if t == 0.0:
        return True
    m = model[MASS]
    fx, fy, fz = force_world(model, state[Q], state[Q + 1], state[Q + 2], state[Q + 3])
    add_compensated(state, X, (t / m) * (state[P] + 0.5 * t * fx))
    add_compensated(state, X + 1, (t / m) * (state[P + 1] + 0.5 * t * fy))
    add_compensated(state, X + 2, (t / m) * (state[P + 2] + 0.5 * t * fz))
    add_compensated(state, P, t * fx)
    add_compensated(state, P + 1, t * fy)
    add_compensated(state, P + 2, t * fz)
    return turn_freely(state, model, work, t) and is_finite(state, model)


INTEGRATOR = Integrator(
    name="exact",
    order=None,
    explicit=True,
    steps=steps,
    work_size=WORK_SIZE,
    reversible=True,
    torque_free_only=True,
    one_evaluation=True,
    text=(
        "Closed form of the motion without torque (Jacobi elliptic functions), for a force in world axes at most; any "
        "other wrench is refused. A run of any length is one evaluation, and its error does not depend on the rate."
    ),
)
