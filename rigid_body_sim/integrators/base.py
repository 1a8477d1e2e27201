"""What an integrator is: a kernel and the facts about it that documentation, parameters and tests are derived from."""

from dataclasses import dataclass

from ..kernels.compiled import Steps
from ..values.wrench import Wrench


@dataclass(frozen=True)
class Integrator:
    """Descriptor of one integrator.

    ``steps(state, model, work, h, n)`` is a kernel that advances the flat state (see kernels.state) in place by up to n
    steps of h [s] under the wrench held in ``model`` (see kernels.model) and returns how many steps it did. A step
    that cannot be done, because the new state would not be finite or would need too much work, leaves the state as it
    was before that step. It is a pure function of its arguments: ``work`` is scratch space of ``work_size`` floats that
    carries nothing over.

    Each file has the few lines of this loop itself: made from a step by a function here it would be a closure, which
    numba compiles anew in every process instead of finding it in the cache.

    With ``one_evaluation``, n steps are one evaluation over n h: a caller that always starts from the state at which
    the wrench last changed accumulates no error, and gets the same bits however the steps are divided into calls.
    """

    name: str
    order: int | None  # None: chosen in each step such that round-off sets the error
    explicit: bool
    steps: Steps
    work_size: int
    text: str
    reversible: bool = False  # with all momenta turned round, it goes back the way that it came, to round-off
    torque_free_only: bool = False  # needs a wrench that neither turns the body nor turns with it: see ``refusal``
    one_evaluation: bool = False
    resisted: bool = False  # whether it takes drag and tethers into account
    adaptive: bool = False  # whether it keeps its error below rtol inside each step

    def refusal(self, wrench: Wrench) -> str:
        """Why this integrator cannot be given ``wrench``, as a sentence; empty when it can."""
        if not self.torque_free_only:
            return ""
        values, zero = wrench.values, (0.0, 0.0, 0.0)
        groups = (("force_body", values[0:3]), ("torque_body", values[3:6]), ("torque_world", values[9:12]))
        given = [name for name, value in groups if value != zero] + ["points"] * bool(wrench.points)
        if not given:
            return ""
        return (
            f"integrator {self.name!r} knows only motion without torque and takes no {' or '.join(given)}: "
            "use force_world alone, or an integrator for every wrench, such as 'taylor'"
        )
