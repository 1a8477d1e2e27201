"""What comes of a run: one of four outcomes, told from its states and from those of the true motion."""

import enum
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from ...kernels.arrays import Floats
from ...simulation import Simulation, SimulationError
from ...values import rotation

ACCURATE = 1e-3  # error, as a share of the motion's own scales, up to which a run counts as accurate
TOO_MUCH = 100.0  # times the largest speed or spin of the true motion: from there on a run counts as diverged


class Outcome(enum.Enum):
    """What a cell of a map says."""

    ACCURATE = "stable and accurate"
    WRONG = "stable but wrong"
    DIVERGED = "diverged"
    REFUSED = "refused"


BAD = (Outcome.WRONG, Outcome.DIVERGED)


@dataclass(frozen=True)
class Scale:
    """What errors are measured against: length [m], angle [rad], speed [m/s] and spin [rad/s] of the true motion."""

    length: float
    angle: float
    speed: float
    spin: float


@dataclass(frozen=True)
class Case:
    """One run, whatever the integrator.

    ``simulation`` makes it ready for the integrator of a name; ``follow`` advances it and gives its states (13 numbers
    each: State.values) at the moments of ``truth``, shape (moments, 13).
    """

    simulation: Callable[[str], Simulation]
    follow: Callable[[Simulation], Sequence[Floats]]
    truth: Floats
    scale: Scale


@dataclass(frozen=True)
class Cell:
    """Outcome of one run; ``error`` is None unless it came to its end, ``said`` is why it did not."""

    outcome: str
    error: float | None = None
    said: str = ""


def attempt(case: Case, integrator: str) -> dict[str, object]:
    """Do the run with one integrator; the cell as a dictionary."""
    try:
        simulation = case.simulation(integrator)
    except ValueError as refusal:
        return asdict(Cell(Outcome.REFUSED.value, said=str(refusal)))
    try:
        states = np.array(case.follow(simulation))
    except SimulationError as stopped:
        return asdict(Cell(_stopped(simulation, case.scale).value, said=str(stopped)))
    if _grown(states, case.scale):
        return asdict(Cell(Outcome.DIVERGED.value))
    error = largest_error(states, case.truth, case.scale)
    return asdict(Cell((Outcome.ACCURATE if error <= ACCURATE else Outcome.WRONG).value, error))


def _stopped(simulation: Simulation, scale: Scale) -> Outcome:
    """Whether a run that stopped had diverged: a method without error control stops at infinity alone."""
    integrator = simulation.integrator
    controlled = integrator.adaptive or integrator.order is None
    grown = _grown(simulation.state.values[None, :13], scale)
    return Outcome.REFUSED if controlled and not grown else Outcome.DIVERGED


def _grown(states: Floats, scale: Scale) -> bool:
    speed, spin = np.abs(states[:, 7:10]).max(), np.abs(states[:, 10:13]).max()
    return bool(speed > TOO_MUCH * scale.speed or spin > TOO_MUCH * scale.spin)


def largest_error(states: Floats, truth: Floats, scale: Scale) -> float:
    """Largest error of attitude, position, velocity and angular velocity over all moments, each in its scale."""
    return max(error(one, true, scale) for one, true in zip(states, truth, strict=True))


def error(state: Floats, truth: Floats, scale: Scale) -> float:
    """The same at one moment."""
    away = state - truth
    return float(
        max(
            np.linalg.norm(away[0:3]) / scale.length,
            rotation.angle_between(truth[3:7], state[3:7]) / scale.angle,
            np.linalg.norm(away[7:10]) / scale.speed,
            np.linalg.norm(away[10:13]) / scale.spin,
        )
    )
