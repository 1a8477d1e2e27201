"""What an integrator is: a kernel and the facts about it that documentation, parameters and tests are derived from."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

from ..effects.base import NOTHING_ACTS
from ..kernels.arrays import Floats
from ..kernels.compiled import Steps
from ..kernels.drive import NO_DRIVE
from ..kernels.lock import giving_way
from ..kernels.motion import Acting
from ..kernels.state import SIZE, copy, is_finite
from ..kernels.wrench import reduce_wrench
from ..values.wrench import Wrench
from .script import Scripted, scripted, without_lock

Step = Callable[[Acting, Floats, Floats, Floats, float], bool]
Loop = Callable[[Step, Acting], Steps]

BACKUP = 0  # in ``work``: the state before the step
SCRATCH = SIZE  # in ``work``: where what is an integrator's own begins
# Steps, some tens of microseconds, for which other threads are kept waiting. Two threads that let each other run during
# every single step, or every three, took up to 2.5 times as long as one that does the work of both.
FEW = 100
TINY = 0.001  # rad; a step of ``taylor`` that turns the body by less takes six orders, nearly always


def step_by_step(step: Step, acting: Acting) -> Steps:
    """The kernel that repeats ``step``; one that cannot be done leaves the state as it was before it."""

    def steps(state: Floats, model: Floats, work: Floats, h: float, n: int) -> int:
        reduce_wrench(model)
        for done in range(n):
            copy(state, 0, work, BACKUP)
            if not (step(acting, state, model, work, h) and is_finite(state, model)):
                copy(work, BACKUP, state, 0)
                return done
            acting.advance(model, h)
        return n

    return steps


def in_pieces(step: Step, acting: Acting) -> Steps:
    """The same where there are actuators: a step is divided at what happens within it (see kernels.drive)."""
    drive = acting.drive

    def steps(state: Floats, model: Floats, work: Floats, h: float, n: int) -> int:
        reduce_wrench(model)
        drive.hold(model)
        for done in range(n):
            copy(state, 0, work, BACKUP)
            drive.begin_step(model)
            passed, good = 0.0, True
            while good and passed < h:
                end = drive.until(model, passed, h)
                good = step(acting, state, model, work, end - passed)
                passed = end
            if not (good and is_finite(state, model)):
                copy(work, BACKUP, state, 0)
                drive.take_back(model)
                drive.settle(model)
                return done
            acting.advance(model, h)
        drive.settle(model)
        return n

    return steps


@dataclass(frozen=True)
class Integrator:
    """Descriptor of one integrator.

    ``step(acting, state, model, work, h)`` is a kernel that advances the flat state (see kernels.state) in place by h
    [s] under the wrench held in ``model`` (see kernels.model) and, where ``resisted``, the loads of ``acting``. It
    returns False for a step that would need too much work; such a one, and one whose new state is not finite,
    ``loop`` takes back. It is a pure function of its arguments: ``work`` is scratch space of ``work_size`` floats,
    its own from SCRATCH on, that carries nothing over. ``driven`` is the step where there are actuators, which also
    lets the time pass for them (``drive.advance``); None where it leaves them out.

    With ``one_evaluation``, n steps are one evaluation over n h, by a ``loop`` of its own: a caller that always
    starts from the state at which the wrench last changed accumulates no error, and gets the same bits however the
    steps are divided into calls.
    """

    name: str
    order: int | None  # None: chosen in each step such that round-off sets the error
    explicit: bool
    step: Step
    work_size: int
    text: str
    driven: Step | None = None
    reversible: bool = False  # with all momenta turned round, it goes back the way that it came, to round-off
    torque_free_only: bool = False  # needs a wrench that neither turns the body nor turns with it: see ``refusal``
    one_evaluation: bool = False
    loop: Loop = step_by_step
    resisted: bool = False  # whether it takes loads into account: drag, tethers, ground
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


@cache
def steps_of(integrator: Integrator, acting: Acting) -> Steps:
    """The kernel ``steps(state, model, work, h, n)``: up to n steps of h [s] under loads, and how many were done."""
    # A step that chooses its sub-steps may take seconds.
    return giving_way(loop_of(integrator, acting), 0 if integrator.adaptive else FEW)


@cache
def script_of(integrator: Integrator, acting: Acting) -> Scripted:
    """The same for whole runs: see ``scripted``."""
    return without_lock(scripted(loop_of(integrator, acting)))


def loop_of(integrator: Integrator, acting: Acting) -> Steps:
    """The same as part of another kernel, which gives up Python's lock itself."""
    if integrator.driven and acting.drive is not NO_DRIVE:
        return in_pieces(
            integrator.driven, acting if integrator.resisted else NOTHING_ACTS._replace(drive=acting.drive)
        )
    return integrator.loop(integrator.step, acting if integrator.resisted else NOTHING_ACTS)
