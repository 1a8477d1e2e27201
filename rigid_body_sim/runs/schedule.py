"""Commands that are known before a run: which wrench is held from which step on."""

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..kernels.arrays import Floats, Integers
from ..values.wrench import Wrench

if TYPE_CHECKING:
    from ..scene.loader import Scene

Truths = NDArray[np.bool_]
KINDS = ("force_body", "torque_body", "force_world", "torque_world")
MOST_STEPS = 1e15
_TURNING = [0, 1, 2, 3, 4, 5, 9, 10, 11]  # of Wrench.values, all but the force in world axes


class WrenchSchedule:
    """Wrenches by the steps of a run, counted from its beginning: each is held from its step on, up to the next.

    Parameters
    ----------
    steps : array_like of int, shape (k,)
        Steps at which the wrenches take effect, 0 for the beginning; each greater than the one before.
    force_body, torque_body, force_world, torque_world : array_like, shape (k, 3) or (3,)
        Forces [N] and torques [N m], one row for each step or one for all, with the meanings that they have in Wrench.

    Raises
    ------
    ValueError
        Steps that are not whole, negative or not in order; a shape that does not fit; a row that is not finite.
    """

    def __init__(
        self,
        steps: ArrayLike,
        force_body: ArrayLike | None = None,
        torque_body: ArrayLike | None = None,
        force_world: ArrayLike | None = None,
        torque_world: ArrayLike | None = None,
    ):
        self.steps = _in_order(steps)
        given = zip(KINDS, (force_body, torque_body, force_world, torque_world), strict=True)
        self.values: Floats = np.hstack([_rows(name, rows, len(self.steps)) for name, rows in given])
        with np.errstate(over="ignore", invalid="ignore"):
            self._refuse(~np.isfinite(self.values.sum(1)), "must be finite, and so must their sum")
        # Of each row, what Wrench.turns is: whether it may turn a body, or turns with it.
        self.turns: Truths = np.any(self.values[:, _TURNING], axis=1)
        self._changes = np.flatnonzero(self.turns[1:] != self.turns[:-1]) + 1
        for array in (self.steps, self.values, self.turns):
            array.flags.writeable = False

    def _refuse(self, bad: Truths, rule: str) -> None:
        if bad.any():
            row = int(np.argmax(bad))
            raise ValueError(
                f"row {row} of the schedule, for step {self.steps[row]}: {self.values[row].tolist()} {rule}"
            )

    @classmethod
    def of(cls, steps: ArrayLike, wrenches: Sequence[Wrench]) -> "WrenchSchedule":
        """The schedule that holds each of these wrenches from its step on.

        Raises ValueError for forces at points, and TypeError for what is no Wrench.
        """
        for row, wrench in enumerate(wrenches):
            if not isinstance(wrench, Wrench):
                raise TypeError(f"row {row} of the schedule: {wrench!r} is no Wrench")
            if wrench.points:
                raise ValueError(f"row {row} of the schedule: {wrench!r} has forces at points; a schedule takes none")
        values = np.array([wrench.values for wrench in wrenches]).reshape(-1, 12)
        return cls(steps, *np.split(values, 4, axis=1))

    @classmethod
    def from_bag(
        cls,
        path: str | os.PathLike[str],
        scene: "Scene | str | os.PathLike[str] | None" = None,
        *,
        topics: str | Sequence[str] = (),
        pose: str | None = None,
        times: str | None = None,
        start: str | None = None,
        recover: bool = False,
        body: str | None = None,
    ) -> "WrenchSchedule":
        """The commands of a bag, by the steps of a scene, as rigid_body_resim understands them.

        More in ``docs/how-to/whole_runs.md``.

        Frames, limits and timeouts are the scene's: the end of a hold is a row of zeros, or of what other topics
        still hold, and what is held on several topics is a row of sums. Step 0 has the stamp of the first pose, of
        the start of a node that kept a journal, or without poses of the first command; in lockstep it is the initial
        state. The schedule ends with the bag's last pose. It holds commands only: the state to begin with is the
        scene's, or where the bag begins later ``scenarios.scenario.prepare(bag, scene).start``.

        From there a run of the scene gives the same bits as the re-simulation, but for the last digits where what was
        held ends and comes again in one step while nothing turns the body: there the closed form begins anew.

        Parameters
        ----------
        path : path
            A folder or a lone file of rosbag2.
        scene : Scene or path, optional
            A Scene or a parameter file; else what the bag's journal has, or without one the node's defaults.
        topics : str or sequence of str
            With the commands, the first leads in lockstep; else those of ``wrench.topics``, or the only one.
        pose : str, optional
            The topic with the poses; else ``pose``, ``odom`` or the only one.
        times : "header" or "receive", optional
            When commands took effect; else as the bag tells.
        start : "scene" or "bag", optional
            Where the run begins; else at the scene's initial state where the first pose is that.
        recover : bool
            Of a bag that is not whole, take what is.
        body : str, optional
            Of a bag of several bodies, the one whose commands are meant.

        Raises
        ------
        BagError
            Of ``rigid_body_sim.bags.rosbags_support``: a bag that cannot be read or simulated again, or has what no
            schedule holds: a force at a point (a command in a frame with ``axes: world``), or in a journal an impulse,
            a reset, a state or parameters that were set.
        ValueError
            A parameter file that cannot be read or is none, an option that is not known.
        """
        from ..scenarios import command_rows
        from ..scenarios.scenario import Choices

        names = (topics,) if isinstance(topics, str) else tuple(topics)
        return cls.of(*command_rows.of_bag(path, scene, Choices(names, pose, times, start), recover, body))

    def __len__(self) -> int:
        return len(self.steps)

    def wrench(self, row: int) -> Wrench:
        """The wrench of a row."""
        f, t, g, u = self.values[row].reshape(4, 3).tolist()
        return Wrench(f, t, g, u)

    def same_kind_up_to(self, row: int) -> int:
        """The first row after it that turns the body where it does not, or the other way round; else how many rows."""
        after = int(np.searchsorted(self._changes, row, side="right"))
        return int(self._changes[after]) if after < len(self._changes) else len(self)

    def __repr__(self) -> str:
        if not len(self):
            return "WrenchSchedule(no commands)"
        kinds = [name for i, name in enumerate(KINDS) if self.values[:, 3 * i : 3 * i + 3].any()]
        return (
            f"WrenchSchedule({len(self)} commands from step {self.steps[0]} to {self.steps[-1]}: "
            f"{', '.join(kinds) or 'zero'})"
        )


def _in_order(steps: ArrayLike) -> Integers:
    given = np.array(steps)
    if given.ndim != 1:
        raise ValueError(f"steps of the schedule have shape {given.shape}; give one whole number for each command")
    with np.errstate(invalid="ignore"):
        numbers = given.astype(float) if given.dtype.kind in "iuf" else np.full(len(given), np.nan)
    whole = (numbers >= 0) & (numbers <= MOST_STEPS) & (numbers == np.floor(numbers))
    if not whole.all():
        row = int(np.argmin(whole))
        raise ValueError(
            f"row {row} of the schedule: step {given[row]} is no whole number from 0 to {MOST_STEPS:g}; "
            "count steps from the beginning of the run"
        )
    if (back := np.diff(numbers) <= 0).any():
        row = int(np.argmax(back))
        raise ValueError(
            f"rows {row} and {row + 1} of the schedule: step {given[row + 1]} follows step {given[row]}; "
            "give steps in order, each once"
        )
    return numbers.astype(np.int64)


def _rows(name: str, given: ArrayLike | None, count: int) -> Floats:
    if given is None:
        return np.zeros((count, 3))
    try:
        rows = np.array(given, float)
    except (TypeError, ValueError):
        raise ValueError(f"{name} of the schedule holds what is no number, or rows of different lengths") from None
    if rows.shape not in ((3,), (count, 3)):
        raise ValueError(
            f"{name} of the schedule has shape {rows.shape}; "
            f"its {count} steps need shape ({count}, 3), or (3,) for the same in all"
        )
    return np.broadcast_to(rows, (count, 3))
