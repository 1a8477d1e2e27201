"""What a simulation says of itself: what it is, and why a step cannot be done."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from .integrators import Integrator
from .kernels import compiled
from .scene.plan import Plan
from .terms import Terms
from .values.body import Body
from .values.state import State
from .values.wrench import Wrench


def description(body: Body, rate: float, plan: Plan) -> str:
    """One line for the log: what is simulated, and how."""
    moments = ", ".join(f"{moment:.6g}" for moment in body.principal_moments)
    return (
        f"mass {body.mass:g} kg, principal moments [{moments}] kg m2, rate {rate:g} Hz, "
        f"integrator {plan}{'' if compiled.ENABLED else ' (plain Python: numba is not in use)'}"
    )


class How(NamedTuple):
    """How a simulation advances: by steps of h [s], and for how many since the origin of a closed form.

    ``commands`` are those to its actuators, within limits.
    """

    terms: Terms
    integrator: Integrator
    h: float
    since: int | None
    commands: Sequence[float]


def why_stopped(step: int, state: State, wrench: Wrench, how: How) -> str:
    """Why ``step`` cannot be done, from the state that was kept and the wrench held."""
    names = [one.name for one in how.terms.given["actuators"]]
    commanded = ", ".join(f"{name} {value:g}" for name, value in zip(names, how.commands, strict=True))
    spin, speed = math.hypot(*state.angular_velocity), math.hypot(*state.velocity)  # norms that cannot overflow
    return (
        f"step {step} cannot be done: the state {_cause(spin * how.h, wrench, how)}; the last good state is kept "
        f"(spin {spin:.3g} rad/s, speed {speed:.3g} m/s, held {wrench!r}{', commanded ' * bool(names)}{commanded}); "
        f"use a smaller wrench{' or smaller commands' * bool(names)}"
        f"{', a looser rtol' if how.integrator.adaptive else ''} or a higher rate"
    )


def _cause(angle: float, wrench: Wrench, how: How) -> str:
    """What is known about why; ``angle`` [rad] is what the spin turns the body by in a step."""
    limit, cause = 5e4, "would turn by more than about 1e5 rad in one step"
    if how.since is not None:
        angle, limit = angle * how.since, 5e14
        cause = "would have turned by more than about 1e15 rad, with no digit left, since the wrench last changed"
    if angle >= limit:
        return cause
    # It is not the spin, then; a torque may still be the cause.
    causes = ["would not be finite"]
    if how.terms.turned_by(wrench) or how.terms.driven:
        causes.append(cause)
    if how.terms.loads:
        loads = " or ".join(how.terms.loads)
        causes.append(f"is driven by {loads} too stiff, or ringing too fast, for the integrator and its rtol")
    return ", or ".join(causes)
