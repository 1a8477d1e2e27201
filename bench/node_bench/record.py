"""What the benchmark finds: one record per figure, printed and written as JSON."""

import json
import os
import platform
import statistics
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from importlib import metadata
from pathlib import Path
from typing import Any

AT_MOST, BELOW, AT_LEAST = "at most", "below", "at least"


Goal = tuple[str, float]  # such as (AT_MOST, 1.0)


@dataclass(frozen=True)
class Figure:
    """One figure. ``value`` is None when it could not be measured, and ``how`` says why.

    ``goal`` is a word (AT_MOST, BELOW, AT_LEAST) and a number, or None where there is no goal; ``spread`` is the
    smallest and the largest of what ``value`` is the median of.
    """

    name: str
    value: float | None
    unit: str
    how: str
    goal: Goal | None = None
    spread: tuple[float, float] | None = None
    load: float = field(default_factory=lambda: os.getloadavg()[0])  # of the machine, when it was measured

    @classmethod
    def median(
        cls, name: str, values: Sequence[float], unit: str, how: str, goal: tuple[str, float] | None = None
    ) -> "Figure":
        """The median of ``values``, which are at least one."""
        return cls(name, statistics.median(values), unit, how, goal, (min(values), max(values)))

    @classmethod
    def missing(cls, name: str, reason: object) -> "Figure":
        """A figure that could not be measured."""
        return cls(name, None, "", f"not measured: {reason}")

    @property
    def met(self) -> bool | None:
        """Whether the goal is met; None where there is none, or no value."""
        if self.goal is None or self.value is None:
            return None
        word, bound = self.goal
        return {AT_MOST: self.value <= bound, BELOW: self.value < bound, AT_LEAST: self.value >= bound}[word]

    def record(self) -> dict[str, Any]:
        """For JSON: all fields, the goal in words, and whether it is met."""
        return {**asdict(self), "goal": self.goal and f"{self.goal[0]} {self.goal[1]:g}", "met": self.met}

    def line(self) -> str:
        """For the terminal."""
        if self.value is None:
            return f"{self.name}: {self.how}"
        spread = f" ({self.spread[0]:.4g} to {self.spread[1]:.4g})" if self.spread else ""
        goal = f"; goal {self.goal[0]} {self.goal[1]:g}: {'met' if self.met else 'NOT met'}" if self.goal else ""
        return f"{self.name}: {self.value:.4g} {self.unit}{spread}{goal}\n    {self.how}"


def machine() -> dict[str, str]:
    """Name, processor and versions, and how busy the machine is, which moves every figure."""
    versions = {name: _version(name) for name in ("numpy", "numba", "ros-rclpy")}
    return {
        "machine": f"{platform.node()}, {platform.machine()}, {os.cpu_count()} processors",
        "system": f"{platform.system()} {platform.release()}",
        "python": platform.python_version(),
        **versions,
        "rmw": os.environ.get("RMW_IMPLEMENTATION", "default"),
        "load before": f"{os.getloadavg()[0]:.2f}",
    }


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "not installed by pip"


def write(path: Path, where: dict[str, str], figures: Sequence[Figure]) -> None:
    """One JSON object: ``machine`` and the list ``figures``."""
    content = {"machine": where, "figures": [figure.record() for figure in figures]}
    path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
