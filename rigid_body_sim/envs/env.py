"""One body that learns a task, as an environment of Gymnasium."""

from collections.abc import Mapping
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from numpy.typing import ArrayLike

from ..ensemble import Ensemble
from .episodes import Episodes, refuse_options
from .task import Task


class RigidBodyEnv(gymnasium.Env):  # type: ignore[misc]  # Any, as gymnasium's types are not looked into
    """A task on one body.

    Parameters
    ----------
    task : Task
    max_episode_steps : int, optional
        After so many actions an episode is truncated; without it none is, except by a wrapper: ``gymnasium.make`` puts
        one around what it makes.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": []}

    def __init__(self, task: Task, *, max_episode_steps: int | None = None):
        self._episodes = Episodes(task, 1, max_episode_steps)
        self.observation_space, self.action_space = task.observation_space, task.action_space
        self._begun = False

    @property
    def ensemble(self) -> Ensemble:
        """The body, as an ensemble of one: its exact state, time and wrench."""
        return self._episodes.ensemble

    def reset(self, *, seed: int | None = None, options: Mapping[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode; return the observation and an empty dictionary. Raises ValueError for any option."""
        super().reset(seed=seed)
        refuse_options(options)
        self._episodes.begin(np.zeros(1, int), [self.np_random])
        self._begun = True
        return self._episodes.observations[0], {}

    def step(self, action: ArrayLike) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Go on under an action; return observation, reward, terminated, truncated and a dictionary.

        It has ``stopped``, a sentence, where the body's step could not be done. Raises ResetNeeded before the first
        ``reset``, and ValueError for an action of another shape, or one that is not finite.
        """
        if not self._begun:
            raise ResetNeeded("step before the first reset: call reset() to begin an episode")
        rewards, terminated, truncated = self._episodes.step(np.asarray(action)[None])
        told = self._episodes.told(0)
        return self._episodes.observations[0], float(rewards[0]), bool(terminated[0]), bool(truncated[0]), told
