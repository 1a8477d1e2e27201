"""Processor time of a step: in one call for many steps, and with a call each, where several simulations take turns."""

import statistics
import time
from collections.abc import Callable, Mapping

import numpy as np

from .. import integrators
from ..kernels import compiled
from ..simulation import Simulation
from ..values.state import flatten
from ..values.wrench import Wrench

CALLS = 500
STEPS = 2000
LEAST = 1e-9  # s: what cannot be told from an empty call
TINY = 1e-30  # switches a term on and changes no digit

FULL_WRENCH = Wrench(
    (TINY,) * 3,
    (TINY,) * 3,
    (TINY,) * 3,
    (TINY,) * 3,
    points=[((0.3, 0.1, 0.2), (TINY, 0.0, 0.0)), ((0.1, 0.2, 0.3), (0.0, TINY, 0.0))],
)


def seconds(work: Callable[[], object]) -> float:
    """Processor time [s] that ``work`` takes: what other programs do meanwhile does not count."""
    begin = time.process_time()
    work()
    return time.process_time() - begin


def calls_of(simulation: Simulation) -> Callable[[int], object]:
    """The kernel that the plan calls, for a number of steps, on a state of its own."""
    h = 1.0 / simulation.rate
    model = simulation.terms.model(simulation.wrench, simulation.terms.memory(h))
    state, work = flatten(simulation.state, model), np.zeros(simulation.integrator.work_size)
    steps = integrators.steps_of(simulation.integrator, simulation.terms.kernels)
    kernel = compiled.ready(steps, state, model, work, h, 1)
    return lambda count: kernel(state, model, work, h, count)


def costs(simulations: Mapping[str, Simulation], rounds: int) -> dict[str, tuple[float, float]]:
    """Time per step [s] in one call, and with a call each, by name: medians over rounds in which all take turns."""
    calls = {name: calls_of(simulation) for name, simulation in simulations.items()}
    measured: dict[str, list[tuple[float, float, float]]] = {name: [] for name in simulations}
    for _ in range(rounds):
        for name, simulation in simulations.items():
            before = simulation.save()
            measured[name].append(_costs(simulation, calls[name]))
            simulation.restore(before)
    middle = {name: [statistics.median(column) for column in zip(*m, strict=True)] for name, m in measured.items()}
    return {name: (bulk, max(each - empty, LEAST)) for name, (bulk, each, empty) in middle.items()}


def _costs(simulation: Simulation, call: Callable[[int], object]) -> tuple[float, float, float]:
    """Time [s] of a step in one call, of a step with a call of its own, and of an empty call."""
    return (
        seconds(lambda: simulation.step(STEPS)) / STEPS,
        seconds(lambda: [call(1) for _ in range(CALLS)]) / CALLS,
        seconds(lambda: [call(0) for _ in range(CALLS)]) / CALLS,
    )
