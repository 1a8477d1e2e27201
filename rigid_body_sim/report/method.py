"""What is compared: a method, of this package or of another, with one knob that trades error for time."""

import gc
import statistics
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from .problems import End, Problem, errors

OURS, LIBRARY, SIMULATOR = "this package", "library", "robotics simulator"
STEP, RTOL = "step [s]", "rtol"
FLOOR = 3e-15  # below it nothing is left to be gained
LONG_ENOUGH = 0.1  # s: repeats are added until they take this long together
FEWEST, MOST = 3, 101  # repeats
LONG_RUN = 2.0  # s: of a run that takes longer, one is enough
COARSEST_TURN = 1.0  # rad in the longest step that is tried


class Run(Protocol):
    """One problem, ready to be solved with one value of the knob."""

    def restart(self) -> None:
        """Back to the start. This is not timed."""
        ...

    def advance(self) -> End:
        """From the start to the end, every command on the way, and the end state read. This is timed."""
        ...

    def counts(self) -> dict[str, int | None]:
        """``steps`` and ``rhs`` (evaluations of the right-hand side) of the last run, None where nobody counts."""
        ...


@dataclass(frozen=True)
class Method:
    """A method and how to use it.

    ``kind``: OURS, LIBRARY or SIMULATOR. ``knob``: STEP or RTOL, or what of both it is for a problem. ``values``: of
    the knob, coarse first, for a problem and whether it must be quick. ``start``: a Run; what it compiles takes
    ``compile_seconds`` of it, if it has that attribute. ``refusal``: why it cannot be given a problem, or empty.
    ``bodies``: how many equal ones a Run solves at once; the times are those of one of them.
    """

    name: str
    kind: str
    knob: Callable[[Problem], str]
    values: Callable[[Problem, bool], Iterable[float]]
    start: Callable[[Problem, float], Run]
    refusal: Callable[[Problem], str] = lambda problem: ""
    bodies: int = 1


def measure(method: Method, problem: Problem, quick: bool) -> dict[str, Any]:
    """Errors and times of a method for every value of its knob, as JSON; or ``refused`` with the reason."""
    if reason := method.refusal(problem):
        return {"refused": reason}
    points: list[dict[str, Any]] = []
    for value in method.values(problem, quick):
        points.append({"value": value, **_point(method, problem, value, quick)})
        if _no_more_to_gain([point.get("error") for point in points]):
            break
    return {"knob": method.knob(problem), "kind": method.kind, "bodies": method.bodies, "points": points}


def _point(method: Method, problem: Problem, value: float, quick: bool) -> dict[str, Any]:
    try:
        run = method.start(problem, value)
        run.restart()
        end = run.advance()  # warms up, too
    except Exception as reason:
        return {"refused": f"{type(reason).__name__}: {reason}"[:300]}
    return {
        **errors(problem, end),
        **run.counts(),
        **_times(run, problem.duration * method.bodies, quick),
        "compile_seconds": getattr(run, "compile_seconds", None),
    }


def _no_more_to_gain(found: Sequence[float | None]) -> bool:
    """Whether round-off is reached: the error is tiny, or, small already, has grown twice. Never a matter of time."""
    if found[-1] is None:
        return False
    if found[-1] < FLOOR:
        return len(found) > 1
    last = [error for error in found[-3:] if error is not None]
    return len(last) == 3 and last[0] < last[1] < last[2] and last[0] < 1e-9


def _times(run: Run, duration: float, quick: bool) -> dict[str, float]:
    """Process CPU time [s] for each second of ``duration``: median and quartiles of the repeats, and how many."""
    enough = LONG_ENOUGH / 5 if quick else LONG_ENOUGH
    used: list[float] = []
    gc.disable()
    try:
        while sum(used) < LONG_RUN and (len(used) < FEWEST or (sum(used) < enough and len(used) < MOST)):
            run.restart()
            begin = time.process_time_ns()
            run.advance()
            used.append((time.process_time_ns() - begin) * 1e-9)
    finally:
        gc.enable()
    low, middle, high = statistics.quantiles(used if len(used) > 1 else 2 * used, n=4, method="inclusive")
    return {"cpu": middle / duration, "cpu_low": low / duration, "cpu_high": high / duration, "repeats": len(used)}


def step_sizes(problem: Problem, step_cost: float, quick: bool, doublings: int = 2) -> Iterable[float]:
    """Steps [s] from about COARSEST_TURN down, as far as a run of steps of that cost [s] stays short.

    They are powers of two, or that share of the time a command is held, so that no error comes from rounding them.
    """
    longest = COARSEST_TURN / problem.fastest_rate if problem.fastest_rate else problem.hold
    h = problem.hold if len(problem.wrenches) > 1 else min(problem.hold, 2.0**10)
    if len(problem.wrenches) == 1:
        h = 1.0
        while h > longest:
            h /= 2.0
    while h > longest:
        h /= 2.0
    most = (0.008 if quick else 0.25) / step_cost
    while problem.duration / h <= most or h > longest / 4:
        yield h
        h /= 2.0**doublings


def steps_held(problem: Problem, h: float) -> int:
    """Steps of h [s] while one command is held."""
    return round(problem.hold / h)
