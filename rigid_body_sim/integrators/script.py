"""Many steps in one call: commands that are known beforehand take effect on the way, and states are kept."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..kernels.arrays import Floats
from ..kernels.compiled import Steps, kernel
from ..kernels.lock import give_up_lock, take_back_lock
from ..kernels.model import WRENCH
from ..kernels.state import copy

COMMAND_SIZE = 13  # of a command: the step at which it takes effect, counted from the first, and Wrench.values


class Script(NamedTuple):
    """What happens on the way through many steps.

    Each of the ``commands``, which are in order, is held from its step on. Every so many steps the state is ``kept``,
    ``stride`` numbers after the one before; ``since`` is the number of steps since the last that was.
    """

    commands: Floats
    kept: Floats
    stride: int
    since: int
    every: int


NOTHING = Script(np.zeros(0), np.zeros(0), 1, 0, 2**62)

# ``run(state, model, work, h, n, script, first)``: see ``scripted``.
Scripted = Callable[[Floats, Floats, Floats, float, int, Script, int], int]


def scripted(steps: Steps) -> Scripted:
    """The kernel that does up to n steps of h [s] by ``steps`` under a script, and returns how many were done.

    What is kept first goes to ``kept[first]`` and on.
    """
    advance = kernel(steps)

    def run(state: Floats, model: Floats, work: Floats, h: float, n: int, script: Script, first: int) -> int:
        commands, since = script.commands, script.since
        done, at, to = 0, 0, first
        while done < n:
            while at < len(commands) and int(commands[at]) <= done:
                for i in range(12):
                    model[WRENCH + i] = commands[at + 1 + i]
                at += COMMAND_SIZE
            until = min(n, done + script.every - since)
            if at < len(commands):
                until = min(until, int(commands[at]))
            taken = advance(state, model, work, h, until - done)
            since += taken
            done += taken
            if since == script.every:
                copy(state, 0, script.kept, to)
                to += script.stride
                since = 0
            if done < until:
                break
        return done

    return run


def without_lock(run: Scripted) -> Scripted:
    """The same for Python to call, which lets other threads run meanwhile."""
    inner = kernel(run)

    def entry(state: Floats, model: Floats, work: Floats, h: float, n: int, script: Script, first: int) -> int:
        thread = give_up_lock()
        done = inner(state, model, work, h, n, script, first)
        take_back_lock(thread)
        return done

    return entry
