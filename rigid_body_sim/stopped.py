"""Why a step cannot be done, in a sentence, from the state that was kept."""

import math

from .integrators import Integrator
from .terms import Terms
from .values.state import State
from .values.wrench import Wrench


def why(
    step: int, state: State, wrench: Wrench, *, terms: Terms, integrator: Integrator, h: float, since: int | None
) -> str:
    """The sentence for ``step`` of h [s] from ``state``; ``since``: steps since the origin of a closed form."""
    spin, speed = math.hypot(*state.angular_velocity), math.hypot(*state.velocity)  # norms that cannot overflow
    return (
        f"step {step} cannot be done: the state {_cause(spin * h, wrench, terms, since)}; the last good state is kept "
        f"(spin {spin:.3g} rad/s, speed {speed:.3g} m/s, held {wrench!r}); use a smaller wrench"
        f"{', a looser rtol' if integrator.adaptive else ''} or a higher rate"
    )


def _cause(angle: float, wrench: Wrench, terms: Terms, since: int | None) -> str:
    """What is known about why; ``angle`` [rad] is what the spin turns the body by in a step."""
    limit, cause = 5e4, "would turn by more than about 1e5 rad in one step"
    if since is not None:
        angle, limit = angle * since, 5e14
        cause = "would have turned by more than about 1e15 rad, with no digit left, since the wrench last changed"
    if angle >= limit:
        return cause
    # It is not the spin, then; a torque may still be the cause.
    causes = ["would not be finite"]
    if terms.turned_by(wrench) or terms.driven:
        causes.append(cause)
    if terms.loads:
        causes.append("is driven by drag or a tether too stiff, or ringing too fast, for the integrator and its rtol")
    return ", or ".join(causes)
