"""The kernels by which a simulation advances, made ready with their scratch space."""

from collections.abc import Iterable

import numpy as np

from ..kernels import compiled
from ..kernels.arrays import Floats
from ..kernels.motion import Acting
from ..kernels.state import SIZE
from .base import Integrator, steps_of


def request(integrator: Integrator, acting: Acting) -> compiled.Request:
    """What is to be compiled for an integrator under loads."""
    state, work = np.zeros(SIZE), np.zeros(integrator.work_size)
    return compiled.Request(steps_of(integrator, acting), (state, np.zeros(1), work, 1.0, 1))


class Stepping:
    """By integrator, the kernel ``steps(state, model, work, h, n)`` under loads, and its scratch space."""

    def __init__(self, acting: Acting):
        self.acting = acting
        self._made: dict[str, tuple[compiled.Steps, Floats]] = {}

    def make_ready(self, integrators: Iterable[Integrator]) -> None:
        """Compile these where they are not yet."""
        for integrator in integrators:
            if integrator.name not in self._made:
                steps = compiled.ready_steps(request(integrator, self.acting))
                self._made[integrator.name] = steps, np.zeros(integrator.work_size)

    def of(self, integrator: Integrator) -> tuple[compiled.Steps, Floats]:
        """Kernel and scratch space of one that was made ready."""
        return self._made[integrator.name]
