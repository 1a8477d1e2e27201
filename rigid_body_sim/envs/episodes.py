"""Episodes of a task on many bodies at once: what one environment and many environments have in common."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from ..kernels.arrays import Floats, Integers
from ..runs import running
from .task import Task, Truths


class Outcome(NamedTuple):
    """What a step has come to, a row for each body."""

    rewards: Floats
    terminated: Truths
    truncated: Truths


class Episodes:
    """An episode on each of n bodies; ``max_episode_steps`` actions end it, or nothing but the task where None.

    Raises ValueError where the task makes another number of bodies, and later on where its arrays have other shapes
    than they should.
    """

    def __init__(self, task: Task, n: int, max_episode_steps: int | None, threads: int = 1):
        n = running.positive("num_envs", n)
        self._most = None if max_episode_steps is None else running.positive("max_episode_steps", max_episode_steps)
        self.task, self.ensemble = task, task.ensemble(n, threads)
        if len(self.ensemble) != n:
            raise ValueError(
                f"{type(task).__name__}.ensemble made {len(self.ensemble)} bodies where {n} were asked for; "
                "make as many as it is told to"
            )
        self._actions = batch_space(task.action_space, n)
        self._lengths: Integers = np.zeros(n, np.int64)
        self._state = self.ensemble.state

    @property
    def observations(self) -> NDArray[Any]:
        """What is seen of all bodies now, shape (n, ...): an array of its own."""
        return self._rows("observations", self.task.observations(self._state), self.task.observation_space.shape)

    def begin(self, which: Integers, randoms: Sequence[np.random.Generator]) -> None:
        """Begin anew on these bodies (indices), each with its generator; nothing of their past stays."""
        self.ensemble.reset(which)
        self.ensemble.set_state(**self.task.initial_states(randoms), which=which)
        self._lengths[which] = 0
        self._state = self.ensemble.state

    def step(self, actions: ArrayLike) -> Outcome:
        """Go on under these actions, shape (n, ...). Raises ValueError for others than the action space has.

        Numbers beyond a Box are taken as the nearest within it. An episode is also terminated where the body's step
        cannot be done: see ``told``.
        """
        checked = self._checked(actions)
        self.ensemble.set_wrench(self.task.wrenches(checked, self._state))
        self.ensemble.step(self.task.steps_per_action)
        self._lengths += 1
        self._state = self.ensemble.state
        rewards = self._rows("rewards", np.array(self.task.rewards(self._state, checked), float))
        terminated = self._rows("terminated", np.array(self.task.terminated(self._state), bool))
        if self.ensemble.stopped:
            terminated[list(self.ensemble.stopped)] = True
        truncated = np.zeros(len(terminated), bool) if self._most is None else self._lengths >= self._most
        return Outcome(rewards, terminated, truncated)

    def told(self, i: int) -> dict[str, Any]:
        """The info of a body: why its step cannot be done, as ``stopped``, where that is so."""
        return {"stopped": self.ensemble.stopped[i]} if i in self.ensemble.stopped else {}

    def _rows(self, name: str, given: NDArray[Any], shape: tuple[int, ...] = ()) -> NDArray[Any]:
        if given.shape != (wanted := (len(self.ensemble), *shape)):
            raise ValueError(
                f"{type(self.task).__name__}.{name} gave shape {given.shape}; give {wanted}, a row for each body"
            )
        return given

    def _checked(self, actions: ArrayLike) -> NDArray[Any]:
        space, given = self._actions, np.asarray(actions)
        if given.shape != space.shape:
            raise ValueError(f"actions have shape {given.shape}; give {space.shape}, a row for each body")
        if not isinstance(space, spaces.Box):
            if not space.contains(given):
                raise ValueError(f"actions {given.tolist()} are not those of {space}")
            return given
        numbers = given.astype(float)
        if not np.isfinite(numbers).all():
            row = int(np.argwhere(~np.isfinite(numbers))[0, 0])
            raise ValueError(
                f"action {numbers[row].tolist()} of body {row} is not finite; give one of {self.task.action_space}"
            )
        return numbers.clip(space.low, space.high)


def refuse_options(options: Mapping[str, Any] | None, known: str = "none is known") -> None:
    """Raise ValueError, which says what is known, where there are any."""
    if options:
        raise ValueError(f"options {sorted(options)} of reset are not known; {known}")
