"""What the demo found, in words and numbers. No ROS."""

import math

import numpy as np
from numpy.typing import ArrayLike

from ..scene.loader import Scene
from .heard import NANOSECONDS, Budget, Heard, energy_budget, momentum_budget


def table(heard: Heard, scene: Scene, target: ArrayLike, diagnostics: list[dict[str, str]]) -> dict[str, str]:
    """A name and a line of text for each finding; ``diagnostics`` are the node's reports, key to value."""
    error, body = heard.error(target), scene.body()
    commanded = heard.commanded()
    return {
        "pointing error": f"{math.degrees(error[-1]):.3g} deg ({error[-1]:.3g} rad) after {heard.time[-1]:.1f} s, "
        f"{math.degrees(error[0]):.3g} deg at the start",
        "angular rate": f"{math.degrees(heard.rate()[-1]):.3g} deg/s, "
        f"{math.degrees(heard.rate()[0]):.3g} deg/s at the start",
        **_budget_rows("energy", energy_budget(commanded, body), "J", "work of the torque"),
        **_budget_rows("momentum", momentum_budget(commanded, body), "N m s", "torque over time"),
        "| |q| - 1 |": f"at most {heard.norm_error():.1e}",
        "poses": _poses_text(heard, scene.steps_per_publish / scene["rate"] * NANOSECONDS),
        "speed": _speed_text(diagnostics),
    }


def _budget_rows(name: str, budget: Budget, unit: str, source: str) -> dict[str, str]:
    change, supplied = (_numbers(value) for value in (budget.change, budget.supplied))
    return {
        f"{name} change": f"{change} {unit}",
        source: f"{supplied} {unit}",
        f"{name} mismatch": f"{budget.mismatch:.1e} {unit} ({budget.relative:.1e} of what was exchanged)",
    }


def _numbers(value: ArrayLike) -> str:
    values = [f"{number:.5g}" for number in np.atleast_1d(value)]
    return values[0] if len(values) == 1 else f"[{', '.join(values)}]"


def _poses_text(heard: Heard, period_ns: float) -> str:
    missing = heard.missing(period_ns)
    return (
        f"{len(heard.stamp_ns)} with their twists, {missing or 'none'} missing, stamps every "
        f"{period_ns / 1e6:g} ms to {heard.off_grid(period_ns):.0f} ns; {len(heard.command_ns)} commands"
    )


def _speed_text(diagnostics: list[dict[str, str]]) -> str:
    """Means over the reports; the first one covers a time before the body was let go."""
    reports = diagnostics[1:]
    if not reports:
        return "no diagnostics heard yet: they come once a second"
    rate, factor = (
        np.mean([float(report[key]) for report in reports]) for key in ("achieved rate [Hz]", "real-time factor")
    )
    late = max(float(report["largest lateness [s]"]) for report in reports)
    return f"{rate:.2f} steps/s, real-time factor {factor:.5f}, no step later than {1e3 * late:.1f} ms"
