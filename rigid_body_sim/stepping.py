"""By which kernel a simulation of some terms advances: which it may need, which is right for a wrench, made ready."""

import math
from typing import Any

import numpy as np

from . import integrators
from .integrators import Integrator, script_of, steps_of
from .integrators.script import NOTHING, Scripted
from .kernels import compiled
from .kernels.arrays import Floats, zeros_on_a_line
from .kernels.motion import Acting
from .kernels.state import SIZE
from .kernels.stiffness import spectral_radius
from .scene import plan
from .terms import Terms
from .values.wrench import Wrench


class IntegratorError(ValueError):
    """A wrench that the integrator asked for cannot be given."""


def asked_for(name: str) -> Integrator | None:
    """The integrator of that name; None for ``auto``. Raises ValueError for one that is not known."""
    return None if name == integrators.AUTO else integrators.get(name)


def within_reach(terms: Terms, asked: Integrator | None) -> list[Integrator]:
    """Every integrator to which a wrench or a stiff motion leads: the one asked for, or those of ``auto``."""
    if asked is not None:
        return [asked]
    return [integrators.REGISTRY[name] for name in plan.within_reach(bool(terms.loads))]


def request(integrator: Integrator, acting: Acting) -> compiled.Request:
    """What is to be compiled for an integrator under loads."""
    return compiled.Request(steps_of(integrator, acting), _examples(integrator))


def _script_request(integrator: Integrator, acting: Acting) -> compiled.Request:
    """The same for whole runs."""
    return compiled.Request(script_of(integrator, acting), (*_examples(integrator), NOTHING, 0))


def _examples(integrator: Integrator) -> tuple[Any, ...]:
    return np.zeros(SIZE), np.zeros(1), np.zeros(integrator.work_size), 1.0, 1


class Stepping:
    """Integrators of some terms with their kernels, for steps of h [s]; ``asked`` is None where the plan chooses.

    Raises ValueError where the integrator asked for leaves out what the terms have.
    """

    def __init__(self, terms: Terms, asked: Integrator | None, h: float):
        if asked is not None and (shortfall := integrators.shortfall(asked.name, terms)):
            raise ValueError(shortfall)
        self.terms, self.asked, self.stiffness = terms, asked, None if asked or not terms.loads else math.nan
        self._h = h
        self._made: dict[str, tuple[compiled.Steps, Floats]] = {}
        self._scripts: dict[str, Scripted] = {}

    def changed(self, terms: Terms) -> "Stepping":
        """The same for other terms: what was made ready stays, where the same loads act. Raises as the constructor."""
        other = Stepping(terms, self.asked, self._h)
        if terms.kernels == self.terms.kernels:
            other._made, other._scripts = self._made, self._scripts
        return other

    def prepare(self, state: Floats, model: Floats) -> None:
        """Make ready every integrator within reach, and measure how stiff the motion is, where that decides."""
        for integrator in within_reach(self.terms, self.asked):
            if integrator.name not in self._made:
                steps = compiled.ready_steps(request(integrator, self.terms.kernels))
                self._made[integrator.name] = steps, zeros_on_a_line(integrator.work_size)
        if self.stiffness is not None:
            self.stiffness = spectral_radius(self.terms.kernels, state, model) * self._h

    def for_wrench(self, wrench: Wrench) -> Integrator:
        """The integrator that is right. Raises IntegratorError when the one asked for cannot be given the wrench."""
        if self.asked is None:
            return integrators.REGISTRY[plan.choose(self.terms.turned_by(wrench), self.stiffness)]
        if refusal := self.asked.refusal(wrench):
            raise IntegratorError(refusal)
        return self.asked

    def kernel(self, integrator: Integrator) -> tuple[compiled.Steps, Floats]:
        """The kernel ``steps(state, model, work, h, n)`` and its scratch space, of one that was made ready."""
        return self._made[integrator.name]

    def script(self, integrator: Integrator) -> tuple[Scripted, Floats]:
        """The same for whole runs. Its first use compiles it."""
        if integrator.name not in self._scripts:
            wanted = _script_request(integrator, self.terms.kernels)
            self._scripts[integrator.name] = compiled.ready(wanted.function, *wanted.examples)
        return self._scripts[integrator.name], self._made[integrator.name][1]

    def takes_any(self, integrator: Integrator) -> bool:
        """Whether it goes on under any wrench without points."""
        return bool(self.terms.loads) if self.asked is None else not integrator.torque_free_only

    def turn_stiff(self) -> bool:
        """Count the motion as stiff, as it grew too fast for the explicit integrator of ``auto``; False if it was."""
        if self.stiffness is None or self.stiffness > plan.STIFF:
            return False
        self.stiffness = math.inf
        return True

    def explain(self, integrator: Integrator, wrench: Wrench, turning: bool) -> plan.Plan:
        """The plan in words; ``turning``: the spin is not zero."""
        return plan.explain(integrator.name, self.asked is None, self.terms, wrench, turning, self.stiffness)
