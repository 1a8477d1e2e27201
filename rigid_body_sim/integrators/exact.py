"""Rotation without torque in closed form, for any time in one evaluation; see kernels.free_motion.

n steps are one evaluation over n h, so they cost what one costs, and the error of the attitude depends on the angle
turned since the wrench last changed, not on the number of steps.
"""

from ..kernels.arrays import Floats
from ..kernels.compiled import Steps, kernel
from ..kernels.free_motion import WORK_SIZE as _TURN_SIZE
from ..kernels.free_motion import turn_freely
from ..kernels.model import MASS
from ..kernels.motion import Acting
from ..kernels.state import SIZE, P, Q, X, add_compensated, copy, is_finite
from ..kernels.wrench import force_world, reduce_wrench
from .base import Integrator, Step

_BACKUP = _TURN_SIZE  # the state before the steps
WORK_SIZE = _BACKUP + SIZE


def at_once(step: Step, acting: Acting) -> Steps:
    """The kernel that does n steps in one evaluation of ``step``, or by bisection as many of them as can be done."""

    def steps(state: Floats, model: Floats, work: Floats, h: float, n: int) -> int:
        reduce_wrench(model)
        copy(state, 0, work, _BACKUP)
        done, too_many, trial = 0, n + 1, n
        while True:
            copy(work, _BACKUP, state, 0)
            fits = trial == 0 or (step(acting, state, model, work, trial * h) and is_finite(state, model))
            if fits and too_many - trial == 1:
                return trial
            if fits:
                done = trial
            else:
                too_many = trial
            trial = (done + too_many) // 2

    return steps


@kernel
def step(acting: Acting, state: Floats, model: Floats, work: Floats, t: float) -> bool:
    """The state t [s] later, however long that is; False when no digit of it would be left.

    A force in body axes is right here as long as the body does not turn.
    """
    m = model[MASS]
    fx, fy, fz = force_world(model, state[Q], state[Q + 1], state[Q + 2], state[Q + 3])
    add_compensated(state, X, (t / m) * (state[P] + 0.5 * t * fx))
    add_compensated(state, X + 1, (t / m) * (state[P + 1] + 0.5 * t * fy))
    add_compensated(state, X + 2, (t / m) * (state[P + 2] + 0.5 * t * fz))
    add_compensated(state, P, t * fx)
    add_compensated(state, P + 1, t * fy)
    add_compensated(state, P + 2, t * fz)
    return turn_freely(state, model, work, t)


INTEGRATOR = Integrator(
    name="exact",
    order=None,
    explicit=True,
    step=step,
    work_size=WORK_SIZE,
    reversible=True,
    torque_free_only=True,
    one_evaluation=True,
    loop=at_once,
    text=(
        "Closed form of the motion without torque (Jacobi elliptic functions), for a force in world axes at most; any "
        "other wrench is refused. A run of any length is one evaluation, and its error does not depend on the rate."
    ),
)
