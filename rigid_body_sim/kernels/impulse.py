"""What an impulse does to the state, within no time."""

from .arrays import Floats
from .compiled import kernel
from .motion import Acting, body_attitude, held_load
from .state import L, P, Q, X, add_compensated
from .tuples import NOTHING, Motion, Quat, vec
from .wrench import reduce_wrench


@kernel
def add_impulse(acting: Acting, state: Floats, model: Floats) -> None:
    """Add to P and L the impulse J [N s] and its moment [N m s] that ``model`` holds as its wrench, without gravity.

    They are those of the wrench at the present attitude: ΔP = J, ΔL = r × J about the centre of mass, theory (2.3.4);
    of the two, where there is added mass, what a load leaves to the body.
    """
    reduce_wrench(model)
    q = Quat(state[Q], state[Q + 1], state[Q + 2], state[Q + 3])
    at_rest = Motion(body_attitude(model, q), vec(state, X), NOTHING, NOTHING)
    change = acting.transform(model, at_rest, held_load(model, q))
    add_compensated(state, P, change.force.x)
    add_compensated(state, P + 1, change.force.y)
    add_compensated(state, P + 2, change.force.z)
    add_compensated(state, L, change.torque.x)
    add_compensated(state, L + 1, change.torque.y)
    add_compensated(state, L + 2, change.torque.z)
