"""The loop: takes the steps that are due, publishes, and keeps what pause, step and reset mean in one place."""

import math
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Generic, TypeVar

from ..fleet import Fleet
from ..scene.fleet import FleetScene
from ..scene.loader import Scene
from ..simulation import Simulation, SimulationError
from .messages import LATEST_STAMP_NS
from .outputs import FleetOutputs, Outputs
from .pacing import NANOSECONDS, Pacer

LONGEST_SLEEP_NS = NANOSECONDS // 10  # so that a request to stop is soon seen
BURST_NS = NANOSECONDS // 1000  # wall time between two looks at the commands, when stepping as fast as possible
LARGEST_BURST = 8192  # steps in one call of the simulation
PATIENCE_NS = NANOSECONDS // 100  # wall time of steps that are due together, after which the others wait once more
WAITING = "waiting for the first command"
CLOCK_NS = NANOSECONDS // 10  # wall time between two ticks of /clock while time stands still


Plant = TypeVar("Plant", Simulation, Fleet)


class StoppedError(Exception):
    """Something was asked for that a simulation cannot do in its present mode; the text says what would be right."""


@dataclass
class Run:
    """Steps asked for while paused, of which every turn of the loop takes some.

    ``on_progress(taken, left)`` is called after each turn, and at the end ``on_end(why)``, once: with no text when all
    steps are taken.
    """

    left: int
    on_progress: Callable[[int, int], None]
    on_end: Callable[[str], None]
    taken: int = 0


class Loop(Generic[Plant]):
    """One simulation, or a fleet of several, at its pace or by commands; between its steps everything else happens.

    ``epoch_ns`` is the stamp of simulated time zero, which ``start`` sets. While it is ``waiting``, steps pass without
    motion. ``complain`` is called with a sentence when a step cannot be done.
    """

    def __init__(
        self,
        scene: Scene | FleetScene,
        simulation: Plant,
        outputs: Outputs | FleetOutputs,
        complain: Callable[[str], object],
    ):
        self.simulation: Plant = simulation
        self.failure = ""
        self.paused = scene["start_paused"]
        self.lockstep = scene["lockstep"]
        self._outputs, self._complain = outputs, complain
        # Each body of a fleet waits by itself.
        self._start_on_command = isinstance(scene, Scene) and scene["start_on_command"]
        self._let_stay(self._start_on_command)
        self._steps_per_command = scene["steps_per_command"]
        self._every = scene.steps_per_publish
        self._keep_time = not scene["reset_time"]
        self._begin_at(0)
        self.pacer = Pacer(simulation.rate, time.monotonic_ns(), scene["real_time_factor"])
        self._clock_due_ns = 0
        self._unanswered = False  # in lockstep: a command came while paused, and nothing was published since
        self._run: Run | None = None

    @property
    def mode(self) -> str:
        """What it does now, in a word or some."""
        if self.by_clock:
            return WAITING if self.waiting else "running"
        return "stopped" if self.failure else "paused" if self.paused else "lockstep"

    @property
    def by_clock(self) -> bool:
        """Whether steps follow by themselves, as the clock says."""
        return not (self.failure or self.paused or self.lockstep)

    def start(self, clock_ns: Callable[[], int]) -> None:
        """Begin to count time, whose stamps begin with what ``clock_ns`` says now."""
        epoch_ns = clock_ns()  # first, so that no stamp is ahead of that clock
        self.pacer.start(time.monotonic_ns())
        self._begin_at(epoch_ns)

    def _begin_at(self, epoch_ns: int) -> None:
        self.epoch_ns = epoch_ns
        room = Fraction(LATEST_STAMP_NS - epoch_ns, NANOSECONDS)
        self._last_step = math.floor(room * Fraction(self.simulation.rate))

    def turn(self) -> None:
        """Take the steps that are due now."""
        now_ns = time.monotonic_ns()
        if self._run is not None:
            self._go_on(self._run, now_ns + BURST_NS)
        elif not self.by_clock:
            self._keep_clock_ticking(now_ns)
        elif self.pacer.free:
            self._advance(sys.maxsize, now_ns + BURST_NS)
        elif due := self.pacer.due(now_ns):
            self.pacer.give_back(self._advance(due, now_ns + PATIENCE_NS, paced=True))

    def idle_ns(self, now_ns: int) -> int:
        """Wall time [ns] until there is something to do, however small."""
        if self._run is not None:
            return 0
        if not self.by_clock:
            return LONGEST_SLEEP_NS
        left_ns = 0 if self.pacer.free else self.pacer.deadline_ns() - now_ns
        return left_ns if left_ns < LONGEST_SLEEP_NS else LONGEST_SLEEP_NS

    def publish(self) -> None:
        """Publish what is asked for of the present step, all with its stamp."""
        self._unanswered = False
        self._outputs.publish(self.stamp_ns)

    @property
    def in_haste(self) -> bool:
        """Whether steps are taken by the clock, so that whoever makes the loop wait makes it late."""
        return self.by_clock and not self.pacer.free

    @property
    def stamp_ns(self) -> int:
        """Time [ns] in the stamps of the present step."""
        return self.epoch_ns + self.simulation.time_ns

    def _advance(self, due: int, end_ns: float = math.inf, paced: bool = False) -> int:
        """Take ``due`` steps, publishing at each that is a multiple of steps_per_publish; returns how many are left.

        Some are left when a step cannot be done, or at the wall time ``end_ns``. Before that is looked at, one step is
        taken, then twice as many and so on: a command may make steps a thousand times as slow as those before it.
        Steps that the pacer gave out are ``paced``: it notes how late each was published.
        """
        simulation, every, heard, burst = self.simulation, self._every, self._outputs.heard, 1
        while due > 0:
            chunk = due if due < burst else burst
            if heard and chunk > (left := every - simulation.steps % every):
                chunk = left
            if not self._try_steps(chunk):
                break
            due -= chunk
            if published := heard and simulation.steps % every == 0:
                self.publish()
            now_ns = time.monotonic_ns()
            if published and paced:
                self.pacer.published(due, now_ns)
            if now_ns >= end_ns:
                break
            if burst < LARGEST_BURST:
                burst *= 2
        return due

    def _go_on(self, run: Run, end_ns: int) -> None:
        """Take steps of ``run`` until some time, one at least."""
        before = self.simulation.steps
        self._advance(run.left, end_ns)
        done = self.simulation.steps - before
        run.taken, run.left = run.taken + done, run.left - done
        run.on_progress(run.taken, run.left)
        if self.failure or not run.left:
            self.end_run(self.failure)

    def _publish_between(self) -> None:
        """Publish the present step, which ``_advance`` has done when it is a multiple of steps_per_publish."""
        if self.simulation.steps % self._every:
            self.publish()

    def _try_steps(self, n: int) -> bool:
        room = self._last_step - self.simulation.steps
        try:
            self._pass_steps(n if n < room else room)
            if n > room:
                raise SimulationError(self._beyond_stamps())
        except SimulationError as failure:
            self.failure = str(failure)
            self._complain(f"stopped; ~/reset starts afresh: {failure}")
            self.publish()
            return False
        return True

    def _beyond_stamps(self) -> str:
        return (
            f"step {self.simulation.steps + 1} cannot be done: its stamp would be of 2^31 s or more, which no message "
            f"of ROS holds; simulated time is {self.simulation.time:.9g} s, and a higher rate takes shorter steps"
        )

    def _keep_clock_ticking(self, now_ns: int) -> None:
        """Whoever waits for /clock must hear it while time stands still, too."""
        if now_ns >= self._clock_due_ns:
            self._outputs.tick(self.stamp_ns)
            self._clock_due_ns = now_ns + CLOCK_NS

    # What others ask for, between two steps ---------------------------------------------------------------------------

    def set_going(self) -> None:
        """After a command was accepted, or an impulse: a body that waited for it moves from the next step on."""
        if self.waiting:
            self._let_stay(False)

    def _let_stay(self, waiting: bool) -> None:
        """From here on steps pass without motion, or with it."""
        self.waiting = waiting
        advance: Callable[[int], None] = self.simulation.wait if waiting else self.simulation.step
        self._pass_steps = self._outputs.passing(advance, lambda: self.stamp_ns)

    def on_command(self) -> None:
        """In lockstep, a command advances the simulation; one that comes while paused does so when it goes on.

        Whoever has sent it waits for its answer, and sends no other.
        """
        if self.mode == "lockstep":
            if self._try_steps(self._steps_per_command):
                self.publish()
        else:
            self._unanswered = self.lockstep

    def on_changed_state(self) -> None:
        """After the state was set from outside: when no step follows by itself, show it."""
        if not self.by_clock:
            self.publish()

    def set_factor(self, factor: float) -> None:
        """Another pace from here on."""
        self.pacer.set_factor(factor, time.monotonic_ns())

    def pause(self, wanted: bool) -> str:
        """Pause or go on; returns what it does then. Raises StoppedError when it cannot go on."""
        if self.failure and not wanted:
            raise StoppedError(f"stopped; ~/reset starts afresh: {self.failure}")
        already = "already " if self.paused == wanted else ""
        if not wanted and self.paused:
            self.end_run("the simulation was set going")
            self.pacer.start(time.monotonic_ns())
        self.paused = wanted
        if self._unanswered and not wanted:
            self.on_command()
        return f"{already}{self.mode}"

    def step(self, n: int = 1) -> str:
        """Take n steps while paused and publish; returns where that led. Raises StoppedError when it cannot be done."""
        self._need_a_pause()
        self._advance(n)
        if self.failure:
            raise StoppedError(self.failure)
        self._publish_between()
        stays = "; the body stays until the first command" if self.waiting else ""
        return f"step {self.simulation.steps}, simulated time {self.simulation.time:.9g} s{stays}"

    def begin_run(self, run: Run) -> None:
        """Take the steps of ``run``, as fast as possible. Raises StoppedError when none can be taken now."""
        self._need_a_pause()
        self._run = run

    def end_run(self, why: str) -> None:
        """End the run that goes on, if there is one."""
        run, self._run = self._run, None
        if run is not None:
            if not self.failure:
                self._publish_between()
            run.on_end(why)

    def _need_a_pause(self) -> None:
        if self.failure or not self.paused:
            raise StoppedError(self.failure or "not paused; call ~/pause with true first")
        if self._run is not None:
            raise StoppedError(f"{self._run.left} steps asked for earlier are still to be taken; wait, or cancel them")

    def reset(self, *, state: bool = True, time_too: bool | None = None) -> str:
        """Back to the initial state, to time zero, or both; returns what became of the time.

        ``time_too`` None means as the parameter ``reset_time`` says. Where no stamp is left time begins anew.
        """
        is_at_end = self.simulation.steps >= self._last_step
        keep_time = (self._keep_time if time_too is None else not time_too) and not is_at_end
        self.end_run("the simulation was reset")
        if state or is_at_end:  # where no stamp was left, the state was good: another time is all that it needs
            self.failure = ""
        if state:
            self._let_stay(self._start_on_command)
            self.simulation.reset(keep_time=keep_time)
        elif not keep_time:
            self.simulation.restart_time()
        self.pacer.start(time.monotonic_ns())
        self.on_changed_state()
        what = "initial state, no wrench" if state else "state kept"
        return f"{what}, simulated time {'goes on' if keep_time else 'from zero'}"
