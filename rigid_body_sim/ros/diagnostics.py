"""The node's health, once a second, as a DiagnosticArray."""

from collections import Counter
from dataclasses import dataclass

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from ..physics import invariants
from ..simulation import Simulation

NANOSECONDS = 1_000_000_000


@dataclass(frozen=True)
class Reading:
    """What the loop has counted at a moment of wall time [ns]; the difference of two readings gives rates."""

    wall_ns: int
    steps: int
    slipped_ns: int
    latest_ns: int  # largest lateness of a step since the reading before
    p99_ns: int  # lateness that 99 of 100 publications kept to since then
    refused: Counter[str]
    limited: int  # commands that were scaled down


def status(
    name: str,
    simulation: Simulation,
    before: Reading,
    now: Reading,
    *,
    mode: str,
    failure: str,
    ages: dict[str, float | None],
) -> DiagnosticStatus:
    """ERROR after a step that could not be done, WARN when time slipped or commands were refused, else OK."""
    slipped = (now.slipped_ns - before.slipped_ns) / NANOSECONDS
    refused = now.refused.total() - before.refused.total()
    level, message = DiagnosticStatus.OK, mode
    if failure:
        level, message = DiagnosticStatus.ERROR, failure
    elif slipped:
        level, message = (
            DiagnosticStatus.WARN,
            f"{mode}, slower than real time by {slipped:.3f} s since the last report",
        )
    elif refused:
        level, message = DiagnosticStatus.WARN, f"{mode}, {refused} commands refused since the last report"
    seconds = (now.wall_ns - before.wall_ns) / NANOSECONDS
    achieved = (now.steps - before.steps) / seconds if seconds > 0.0 else 0.0
    values = {
        "plan": simulation.describe(),
        "mode": mode,
        "simulated time [s]": f"{simulation.time:.9g}",
        "steps": str(simulation.steps),
        "achieved rate [Hz]": f"{achieved:.3f}",
        "real-time factor": f"{achieved / simulation.rate:.6f}",
        "largest lateness [s]": f"{now.latest_ns / NANOSECONDS:.6f}",
        "lateness p99 [s]": f"{now.p99_ns / NANOSECONDS:.6f}",
        "slipped time [s]": f"{now.slipped_ns / NANOSECONDS:.6f}",
        "wrench held": "yes" if simulation.wrench.points or any(simulation.wrench.values) else "no",
        **{f"{topic} age [s]": "none yet" if age is None else f"{age:.6f}" for topic, age in ages.items()},
        "commands limited": str(now.limited),
        **{f"refused: {reason}": str(count) for reason, count in sorted(now.refused.items())},
        **_motion(simulation),
    }
    return DiagnosticStatus(
        level=level,
        name=name,
        message=message,
        hardware_id="rigid_body_sim",
        values=[KeyValue(key=key, value=value) for key, value in values.items()],
    )


def _motion(simulation: Simulation) -> dict[str, str]:
    state = simulation.state
    kinetic = invariants.kinetic_energy(simulation.body, state)
    potential = invariants.potential_energy(
        simulation.body, state, simulation.gravity, simulation.forces, simulation.tethers
    )
    return {
        "kinetic energy [J]": repr(kinetic),
        "potential energy [J]": repr(potential),
        "momentum [kg m/s]": repr(state.momentum.tolist()),
        "angular momentum [kg m2/s]": repr(state.angular_momentum.tolist()),
        "|q| - 1": f"{float(np.linalg.norm(state.orientation)) - 1.0:.3e}",
    }
