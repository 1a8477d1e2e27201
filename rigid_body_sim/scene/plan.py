"""The plan: what of the equations of motion a scene uses, the method that is right for it, and what is left out.

An integrator computes only what the model holds, so a plan leaves terms out without changing the result. The names are
those of the registry; ``Simulation`` follows the choice and makes it anew whenever something in it changes.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from ..effects import constant_force
from ..terms import Terms
from ..values.wrench import Wrench

# Fastest rate times the step above which the implicit method takes over. Measured, a step of dop853 and of rosenbrock
# cost the same with drag near 5 to 10, and with a damped tether, as long as it swings and has to be followed, near 800.
STIFF = 50.0
LINKED = "dop853"  # of bodies with links between them, which are advanced as one


@dataclass(frozen=True)
class Plan:
    """How a simulation advances: the integrator's name, why it, and the terms that its steps leave out."""

    integrator: str
    reason: str
    left_out: tuple[str, ...]

    def __str__(self) -> str:
        left_out = f"; left out: {', '.join(self.left_out)}" if self.left_out else ""
        return f"{self.integrator} ({self.reason}){left_out}"


def choose(turned: bool, stiffness: float | None) -> str:
    """Name of the integrator that is right: the one rule of ``auto``.

    Without a torque that is the closed form, for its error: it does not grow with the steps. Any number of them in one
    call costs one evaluation; called step by step it costs up to five times what the series does. Where there is no
    closed form it is the cheapest of the others.

    ``turned``: a torque may act, or a force that turns with the body. ``stiffness``: spectral radius of the Jacobian
    times the step where loads act, else None.
    """
    if stiffness is not None:
        return "rosenbrock" if stiffness > STIFF else "dop853"
    return "taylor" if turned else "exact"


def within_reach(loaded: bool) -> list[str]:
    """Names of the integrators to which the choice can lead as long as loads stay or stay away, the larger first."""
    stiffnesses = (math.inf, 0.0) if loaded else (None,)
    return list(dict.fromkeys(choose(turned, stiffness) for turned in (False, True) for stiffness in stiffnesses))


def explain(
    integrator: str, automatic: bool, terms: Terms, wrench: Wrench, turning: bool, stiffness: float | None
) -> Plan:
    """The plan in words, for a simulation that advances by ``integrator``; ``turning``: its spin is not zero."""
    still = not (turning or terms.loads or terms.turned_by(wrench))
    reason = _reason(integrator, terms, still, stiffness) if automatic else "as asked for"
    return Plan(integrator, reason, tuple(_left_out(terms, wrench, still)))


def _reason(integrator: str, terms: Terms, still: bool, stiffness: float | None) -> str:
    if stiffness is not None:
        what = " and ".join(terms.loads)
        if stiffness == math.inf:
            return f"{what}, stiff: the motion is too fast for an explicit method"
        return f"{what}, {'stiff' if stiffness > STIFF else 'not stiff'}: fastest rate {stiffness:.2g} a step"
    if integrator == "taylor":
        return "the wrench is held between commands: series to round-off"
    if still:
        return "nothing turns: a parabola in closed form"
    kinds = {1: "sphere: one turn", 2: "symmetric body: two turns", 3: "any body: elliptic functions"}
    kind = kinds[len(set(terms.body.principal_moments.tolist()))]
    return f"no torque; {kind} in closed form, whose error does not grow with the steps"


def _left_out(terms: Terms, wrench: Wrench, still: bool) -> Iterator[str]:
    values, moments = wrench.values, terms.body.principal_moments
    if not any(terms.gravity):
        yield "gravity"
    if still:
        yield "rotation"
    elif moments.min() == moments.max():
        yield "gyroscopic term"
    if not any(values[0:3]):
        yield "body-axes force"
    if not any(values[3:6]):
        yield "body-axes torque"
    if not any(values[9:12]):
        yield "world-axes torque"
    for words in terms.left_out:
        if not (wrench.points and words == constant_force.EFFECT.left_out):  # of which a wrench may have some itself
            yield words
