"""What tethers and links have in common: a spring and damper along a line, which may go slack."""

import math
from typing import Any

import numpy as np

from ..kernels.arrays import Floats
from ..kernels.compiled import kernel
from ..values.parameter import Parameter
from ..values.wrench import number

NUMBERS = ("rest_length", "stiffness", "damping")
# From where the numbers of one begin:
REST_LENGTH, STIFFNESS, DAMPING, SLACK, SIZE = 0, 1, 2, 3, 4


def check(one: Any, what: str) -> None:
    """Make floats of the numbers of a frozen dataclass. Raises ValueError for one that cannot be."""
    for name in NUMBERS:
        value = number(getattr(one, name), f"{what} {name}")
        if not 0.0 <= value < math.inf:
            raise ValueError(f"{what} {name} {value:g} is not a finite number of at least 0")
        object.__setattr__(one, name, value)


def numbers(one: Any) -> tuple[float, ...]:
    """What ``tension`` reads."""
    return (one.rest_length, one.stiffness, one.damping, one.slack)


@kernel
def tension(row: Floats, at: int, length: float, rate: float) -> float:
    """Tension [N] at a length [m] and a rate of lengthening [m/s], of the numbers that begin at ``row[at]``."""
    stretch = length - row[at + REST_LENGTH]
    pull = row[at + STIFFNESS] * stretch + row[at + DAMPING] * rate
    if row[at + SLACK] != 0.0 and (stretch <= 0.0 or pull <= 0.0):
        pull = 0.0
    return pull


def energy(one: Any, away: Any) -> Any:
    """½ k s² [J] of the stretch s, which is zero while it is slack; ``away``: from one end to the other, (..., 3)."""
    stretch = np.sqrt((away * away).sum(-1)) - one.rest_length
    stretch = np.maximum(stretch, 0.0) if one.slack else stretch
    return one.stiffness * stretch * stretch / 2


def parameters(group: str, dynamic: bool) -> tuple[Parameter, ...]:
    """The rows of the numbers, and of ``slack``."""
    return (
        Parameter(
            f"{group}.<name>.rest_length",
            float,
            1.0,
            "Its length when nothing pulls.",
            "m",
            least=0.0,
            required=True,
            dynamic=dynamic,
        ),
        Parameter(
            f"{group}.<name>.stiffness",
            float,
            1000.0,
            "Tension by what the length exceeds rest_length; of a cable EA / length.",
            "N/m",
            above=0.0,
            required=True,
            dynamic=dynamic,
        ),
        Parameter(
            f"{group}.<name>.damping",
            float,
            0.0,
            "Tension by the rate of lengthening.",
            "N s/m",
            least=0.0,
            dynamic=dynamic,
        ),
        Parameter(
            f"{group}.<name>.slack",
            bool,
            True,
            "A rope: it pulls and never pushes; false = a spring.",
            dynamic=dynamic,
        ),
    )
