"""What an integrator is: a kernel and the facts about it that documentation, parameters and tests are derived from."""

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Integrator:
    """Descriptor of one integrator.

    ``steps(state, model, work, h, n)`` is a kernel that advances the flat state (see physics.state) in place by up to n
    steps of h [s] under the wrench held in ``model`` (see physics.forces) and returns how many steps it did. A step
    that cannot be done, because the new state would not be finite or would need too much work, leaves the state as it
    was before that step. It is a pure function of its arguments: ``work`` is scratch space of ``work_size`` floats that
    carries nothing over.
    """

    name: str
    order: int | None  # None: chosen in each step such that round-off sets the error
    explicit: bool
    steps: Callable
    work_size: int
    text: str
