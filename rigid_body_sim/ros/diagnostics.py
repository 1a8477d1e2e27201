"""The node's health, once a second, as a DiagnosticArray."""

from collections import Counter
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from ..simulation import Simulation
from ..theory import invariants

NANOSECONDS = 1_000_000_000


class RecorderReading(NamedTuple):
    """How many messages are in the bag, how many are not, and why no more will be."""

    recorded: int = 0
    dropped: int = 0
    failure: str = ""


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
    recording: RecorderReading


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
    """ERROR after a step that could not be done or where recording has stopped, WARN when something was lost, else OK.

    Lost is time that slipped, commands that were refused, messages that were not recorded.
    """
    level, message = _verdict(before, now, mode, failure)
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
        **_actuators(simulation),
        "recorded": str(now.recording.recorded),
        "dropped": str(now.recording.dropped),
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


def _verdict(before: Reading, now: Reading, mode: str, failure: str) -> tuple[bytes, str]:
    """Level and message: the worst of what there is to say."""
    if failure or now.recording.failure:
        return DiagnosticStatus.ERROR, failure or f"{mode}, {now.recording.failure}"
    if slipped := (now.slipped_ns - before.slipped_ns) / NANOSECONDS:
        return DiagnosticStatus.WARN, f"{mode}, slower than real time by {slipped:.3f} s since the last report"
    if refused := now.refused.total() - before.refused.total():
        return DiagnosticStatus.WARN, f"{mode}, {refused} commands refused since the last report"
    if dropped := now.recording.dropped - before.recording.dropped:
        return DiagnosticStatus.WARN, f"{mode}, {dropped} messages found no room in the recorder since the last report"
    return DiagnosticStatus.OK, mode


def _actuators(simulation: Simulation) -> dict[str, str]:
    if not simulation.actuators:
        return {}
    limited = str(simulation.commands_limited)
    return {"actuators": str(len(simulation.actuators)), "actuator commands limited": limited}


def _motion(simulation: Simulation) -> dict[str, str]:
    state = simulation.state
    kinetic = invariants.energy_of_motion(simulation.terms, state)
    potential = invariants.potential_energy(simulation.terms, state)
    return {
        "kinetic energy [J]": repr(kinetic),
        "potential energy [J]": repr(potential),
        "momentum [kg m/s]": repr(state.momentum.tolist()),
        "angular momentum [kg m2/s]": repr(state.angular_momentum.tolist()),
        "|q| - 1": f"{float(np.linalg.norm(state.orientation)) - 1.0:.3e}",
    }
