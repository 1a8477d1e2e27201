"""How a run goes on: commands and a controller between steps, states kept on the way, Ctrl-C heard."""

import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from operator import index
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..kernels.arrays import Floats, Integers
from ..sensors.instrument import Record
from ..values.state import BodyState
from ..values.wrench import Wrench
from .schedule import MOST_STEPS, WrenchSchedule

Controller = Callable[[BodyState, float], Wrench | Sequence[float] | None]

_LEAST, _MOST = 0.03, 0.1  # s between two moments at which Ctrl-C is heard
_FIRST = 256  # steps up to the first of them
_SHOWN_AFTER = 2.0  # s


class Advancing(Protocol):
    """What a run needs of a simulation, or of an ensemble."""

    steps: int

    @property
    def time(self) -> float: ...
    @property
    def state(self) -> Any: ...
    def step(self, n: int) -> None: ...
    def set_wrench(self, wrench: Any) -> None: ...


class Inside(NamedTuple):
    """What a run has of the inside of a simulation.

    ``now()`` are flat states, and ``made(steps, rows of them)`` is what the run returns. ``takes()`` says of which
    ``Wrench.turns`` a command may be in the midst of ``follow``; it is empty where that cannot be called.
    ``follow(n, commands, kept, since, every)`` is a script of integrators.script. ``record`` takes what is measured.
    """

    now: Callable[[], Floats]
    made: Callable[[Integers, Floats], Any]
    wrenches: tuple[type, ...]  # what ``set_wrench`` takes
    command: Callable[[Any], None] | None  # of actuators, where there are some
    takes: Callable[[], tuple[bool, ...]]
    follow: Callable[[int, Floats, Floats, int, int], int]
    record: Record | None = None


class Run:
    """n steps of a simulation, of which every so many are kept.

    Raises ValueError for commands beyond the run, and for more states than memory holds.
    """

    def __init__(self, simulation: Advancing, inside: Inside, n: int, every: int, commands: WrenchSchedule):
        if len(commands) and commands.steps[-1] >= n:
            row = int(np.searchsorted(commands.steps, n))
            raise ValueError(
                f"row {row} of the schedule is for step {commands.steps[row]}, but the run has {n} steps, "
                f"of which the last begins at step {n - 1}"
            )
        self._simulation, self._inside, self._n, self._every, self._commands = simulation, inside, n, every, commands
        self._first, self._next, self._rows = simulation.steps, 0, 0
        self._table: Floats = np.column_stack((commands.steps, commands.values)).astype(float)
        try:
            self._kept = np.empty((n // every + 2, len(inside.now())))
        except (MemoryError, ValueError):
            raise ValueError(
                f"{n // every} states are more than memory holds; keep fewer, with a larger every"
            ) from None
        self._stopped = ""
        self._keep()
        self._measure()

    @property
    def trajectory(self) -> Any:
        """What was kept up to now, with the present state as the last."""
        rows, steps = self._rows, [*range(self._first, self._first + self._done + 1, self._every)]
        if self._done % self._every:
            self._kept[rows] = self._inside.now()
            rows, steps = rows + 1, [*steps, self._simulation.steps]
        found = self._inside.made(np.array(steps), self._kept[:rows].copy())
        found.commands, found.stopped = self._commands, self._stopped
        found.samples = {} if self._inside.record is None else self._inside.record.taken(found.rate)
        return found

    def go(self, controller: Callable[[Any, float], Any] | None, control_every: int, progress: bool | None) -> None:
        """Advance to the end, or to where Ctrl-C comes. Raises what the simulation raises."""
        bar = _Bar(self._n, progress)
        with _hearing_interrupts() as interrupted, closing(bar):
            ahead = _FIRST
            while self._done < self._n:
                begin = time.perf_counter()
                self._advance(min(self._n, self._done + ahead), controller, control_every)
                took = time.perf_counter() - begin
                ahead = ahead * 2 if took < _LEAST else max(1, ahead // 2) if took > _MOST else ahead
                bar.tell(self._done)
                if interrupted():
                    self._stopped = f"stopped by Ctrl-C after {self._done} of {self._n} steps"
                    warnings.warn(f"run {self._stopped}; what was done is returned", stacklevel=3)
                    return

    @property
    def _done(self) -> int:
        return self._simulation.steps - self._first

    @property
    def _now(self) -> Floats:
        """The present step, in the place where commands have theirs."""
        return np.array([self._done, *(0.0,) * 12])

    def _advance(self, until: int, controller: Callable[[Any, float], Any] | None, control_every: int) -> None:
        if controller is None:
            self._forward(until)
        while (done := self._done) < until:
            if done % control_every == 0:
                self._control(controller)
            self._forward(min(until, done + control_every - done % control_every))

    def _control(self, controller: Any) -> None:
        before = self._simulation.steps
        wrench = controller(self._simulation.state, self._simulation.time)
        if self._simulation.steps != before:
            raise RuntimeError(
                f"the controller took the simulation from step {before} to {self._simulation.steps}; "
                "time is the run's: give a wrench, and leave steps and resets to it"
            )
        if wrench is None:
            return
        if isinstance(wrench, self._inside.wrenches):
            self._simulation.set_wrench(wrench)
        elif self._inside.command is not None:
            self._inside.command(wrench)
        else:
            given, wanted = f"{wrench!r} at {self._simulation.time:g} s", self._inside.wrenches[0].__name__
            raise TypeError(f"the controller gave {given}; give a {wanted}, or None to go on as before")

    def _forward(self, until: int) -> None:
        """Advance to a step of the run, in calls as long as can be."""
        while (done := self._done) < until:
            if self._at(self._next) == done:
                self._simulation.set_wrench(self._commands.wrench(self._next))
                self._next += 1
            if (end := min(until, self._followed_to())) > done:
                self._follow(end - done)
            else:
                self._step(min(until, self._at(self._next), done + self._until_kept(done)) - done)

    def _until_kept(self, done: int) -> int:
        """Steps to the next state that is kept, or the next measurement."""
        left, record = self._every - done % self._every, self._inside.record
        return left if record is None else min(left, record.until(self._simulation.steps))

    def _at(self, row: int) -> int:
        """Step of a command; beyond the run after the last one."""
        return int(self._commands.steps[row]) if row < len(self._commands) else self._n

    def _followed_to(self) -> int:
        """Step up to which nothing comes that a script does not take."""
        kinds = self._inside.takes() if self._inside.record is None else ()
        if not kinds:
            return self._done
        if len(kinds) == 2 or self._next == len(self._commands):
            return self._n
        row = self._next
        return self._at(self._commands.same_kind_up_to(row) if self._commands.turns[row] in kinds else row)

    def _follow(self, n: int) -> None:
        first, last = self._next, int(np.searchsorted(self._commands.steps, self._done + n))
        commands, since = self._table[first:last] - self._now, self._done % self._every
        done = self._inside.follow(n, commands.reshape(-1), self._kept[self._rows :].reshape(-1), since, self._every)
        self._rows += (since + done) // self._every
        if given := int(np.searchsorted(commands[:, 0], done, side="right")):
            self._next = first + given
            self._simulation.set_wrench(self._commands.wrench(self._next - 1))
        if done < n:
            self._step(1)  # another integrator may be able to; else it says why this step cannot be done

    def _step(self, n: int) -> None:
        self._simulation.step(n)
        if self._done % self._every == 0:
            self._keep()
        self._measure()

    def _measure(self) -> None:
        if self._inside.record is not None:
            self._inside.record.take(self._simulation.steps)

    def _keep(self) -> None:
        self._kept[self._rows] = self._inside.now()
        self._rows += 1


def agreed(commands: WrenchSchedule | None, controller: Any) -> WrenchSchedule:
    """The commands of a run. Raises ValueError where a controller is given, too, TypeError for what is neither."""
    if commands is not None and not isinstance(commands, WrenchSchedule):
        raise TypeError(f"commands={commands!r}: give a WrenchSchedule")
    if controller is not None and not callable(controller):
        raise TypeError(f"controller={controller!r}: give a function of state and time")
    if commands is not None and controller is not None:
        raise ValueError("run takes commands or a controller, not both; a controller can follow a schedule itself")
    return WrenchSchedule([]) if commands is None else commands


def counted(duration: float | None, steps: int | None, rate: float) -> int:
    """How many steps are asked for. Raises ValueError for a duration that is not a whole number of them."""
    if (duration is None) == (steps is None):
        raise ValueError("run needs either a duration in seconds or steps=, one of the two")
    if steps is not None:
        return positive("steps", steps, least=0)
    assert duration is not None
    wanted = float(duration) * rate
    if not 0.0 <= wanted <= MOST_STEPS:
        raise ValueError(f"run({duration!r}): a duration is a time from 0 to {MOST_STEPS:g} steps")
    whole = round(wanted)
    if abs(wanted - whole) > 1e-6 + 4e-16 * wanted:
        raise ValueError(
            f"run({duration!r}): that is {wanted:.9g} steps at {rate:g} Hz; give a whole number of them, "
            f"such as {whole / rate:.12g} s or steps={whole}"
        )
    return whole


def positive(name: str, value: int, least: int = 1) -> int:
    """A whole number of steps. Raises ValueError below ``least`` and TypeError for anything but a whole number."""
    if (number := index(value)) < least:
        raise ValueError(f"{name}={value}: give a whole number of at least {least}")
    return number


@contextmanager
def _hearing_interrupts() -> Iterator[Callable[[], bool]]:
    """Within it the first Ctrl-C is noted, so that nothing is broken off half-way; the second acts at once."""
    usual = signal.default_int_handler
    if threading.current_thread() is not threading.main_thread() or signal.getsignal(signal.SIGINT) is not usual:
        yield lambda: False
        return
    heard = threading.Event()

    def note(number: int, frame: Any) -> None:
        heard.set()
        signal.signal(signal.SIGINT, usual)

    signal.signal(signal.SIGINT, note)
    try:
        yield heard.is_set
    finally:
        signal.signal(signal.SIGINT, usual)


class _Bar:
    """A progress bar: on a terminal, for a run that takes longer, where tqdm is there; ``progress`` says yes or no."""

    def __init__(self, steps: int, progress: bool | None):
        self._wanted = sys.stderr.isatty() if progress is None else progress
        self._steps = steps
        self._bar: Any = None
        self._shown_from = time.perf_counter() + (0.0 if progress else _SHOWN_AFTER)

    def tell(self, done: int) -> None:
        """So many steps are done."""
        if not self._wanted or time.perf_counter() < self._shown_from:
            return
        if self._bar is None:
            try:
                from tqdm import tqdm
            except ImportError:
                self._wanted = False
                return
            self._bar = tqdm(total=self._steps, unit=" steps", unit_scale=True)
        self._bar.update(done - self._bar.n)

    def close(self) -> None:
        """Let what is shown stay."""
        if self._bar is not None:
            self._bar.close()
