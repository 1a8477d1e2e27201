"""Many steps in one call: commands that are known beforehand take effect on the way, and states are kept."""

from ..kernels.arrays import Floats
from ..kernels.compiled import Script, Steps, kernel
from ..kernels.lock import give_up_lock, take_back_lock
from ..kernels.model import WRENCH
from ..kernels.state import copy

COMMAND_SIZE = 13  # of a command: the step at which it takes effect, counted from the first, and Wrench.values


def scripted(steps: Steps) -> Script:
    """The kernel that does up to n steps of h [s] by ``steps``, and returns how many were done.

    Each of the ``commands``, which are in order, is held from its step on. Every so many steps the state is ``kept``,
    ``stride`` numbers after the one before; ``since`` is the number of steps since the last that was.
    """
    advance = kernel(steps)

    def script(
        state: Floats,
        model: Floats,
        work: Floats,
        h: float,
        n: int,
        commands: Floats,
        kept: Floats,
        stride: int,
        since: int,
        every: int,
    ) -> int:
        done = at = to = 0
        while done < n:
            while at < len(commands) and int(commands[at]) <= done:
                for i in range(12):
                    model[WRENCH + i] = commands[at + 1 + i]
                at += COMMAND_SIZE
            until = min(n, done + every - since)
            if at < len(commands):
                until = min(until, int(commands[at]))
            taken = advance(state, model, work, h, until - done)
            since += taken
            done += taken
            if since == every:
                copy(state, 0, kept, to)
                to += stride
                since = 0
            if done < until:
                break
        return done

    return script


def without_lock(script: Script) -> Script:
    """The same for Python to call, which lets other threads run meanwhile."""
    inner = kernel(script)

    def entry(
        state: Floats,
        model: Floats,
        work: Floats,
        h: float,
        n: int,
        commands: Floats,
        kept: Floats,
        stride: int,
        since: int,
        every: int,
    ) -> int:
        thread = give_up_lock()
        done = inner(state, model, work, h, n, commands, kept, stride, since, every)
        take_back_lock(thread)
        return done

    return entry
