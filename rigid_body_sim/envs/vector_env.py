"""Many bodies that learn a task, as a vector environment of Gymnasium."""

from collections.abc import Mapping, Sequence
from operator import index
from typing import Any

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from ..ensemble import Ensemble
from ..kernels.arrays import Floats, Integers
from .episodes import Episodes, refuse_options
from .task import Task, Truths

_KNOWN = "reset_mask, an array of bool that says which environments to reset, is"


class RigidBodyVectorEnv(VectorEnv):  # type: ignore[misc]  # Any, as gymnasium's types are not looked into
    """A task on many bodies, each an environment: what SyncVectorEnv makes of as many RigidBodyEnv, to the bit.

    Parameters
    ----------
    task : Task
    num_envs : int
    max_episode_steps : int, optional
        After so many actions an episode is truncated.
    autoreset_mode : gymnasium.vector.AutoresetMode or str
        What follows the end of an episode. NEXT_STEP: the next ``step`` resets, whatever the action, with reward 0;
        SAME_STEP: the same ``step`` does, and its infos have ``final_obs`` and ``final_info``; DISABLED: ``reset`` with
        the option ``reset_mask`` has to.
    threads : int
        How many share the bodies, among the cores of the machine.
    """

    def __init__(
        self,
        task: Task,
        num_envs: int = 1,
        *,
        max_episode_steps: int | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        threads: int = 1,
    ):
        self._episodes = Episodes(task, num_envs, max_episode_steps, threads)
        self.num_envs, self._mode = len(self.ensemble), AutoresetMode(autoreset_mode)
        self.metadata = {"render_modes": [], "autoreset_mode": self._mode}
        self.single_observation_space, self.single_action_space = task.observation_space, task.action_space
        self.observation_space = batch_space(task.observation_space, self.num_envs)
        self.action_space = batch_space(task.action_space, self.num_envs)
        self._generators: dict[int, tuple[np.random.Generator, int]] = {}
        self._ended: Truths | None = None  # None before the first reset

    @property
    def ensemble(self) -> Ensemble:
        """The bodies: their exact states, time and wrenches."""
        return self._episodes.ensemble

    @property
    def np_random(self) -> tuple[np.random.Generator, ...]:
        """The generator of each environment."""
        return tuple(self._seeded(i)[0] for i in range(self.num_envs))

    @property
    def np_random_seed(self) -> tuple[int, ...]:
        """The seed of each environment."""
        return tuple(self._seeded(i)[1] for i in range(self.num_envs))

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[NDArray[Any], dict[str, Any]]:
        """Begin all episodes, or those of the option ``reset_mask``; return all observations and an empty dictionary.

        From one seed, environment k gets seed + k, and then does what one of RigidBodyEnv with that seed does; or there
        is a seed for each, or None where its generator is to go on. Raises ValueError for other options or numbers of
        seeds, and ResetNeeded for a mask before anything has begun.
        """
        others = dict(options or {})
        which = self._masked(others.pop("reset_mask", None))
        refuse_options(others, _KNOWN)
        self._seed(seed, which)
        self._begin(which)
        if self._ended is None:
            self._ended = np.zeros(self.num_envs, bool)
        self._ended[which] = False
        return self._episodes.observations, {}

    def step(self, actions: ArrayLike) -> tuple[NDArray[Any], Floats, Truths, Truths, dict[str, Any]]:
        """Go on under these actions, a row for each environment; return an array of each kind, and the infos.

        Where a body's step could not be done they have ``stopped``, a sentence. Raises ResetNeeded before the first
        ``reset``, or where an ended episode goes on that is not reset by itself, and ValueError for actions of another
        shape, or not finite.
        """
        before = self._may_go_on()
        rewards, terminated, truncated = self._episodes.step(actions)
        infos: dict[str, Any] = {}
        if before.any():
            self._begin(np.flatnonzero(before))
            rewards[before], terminated[before], truncated[before] = 0.0, False, False
        ended = terminated | truncated
        if self._mode is AutoresetMode.SAME_STEP and ended.any():
            infos = self._final(np.flatnonzero(ended), infos)
            self._begin(np.flatnonzero(ended))
        for i in self.ensemble.stopped:
            infos = self._add_info(infos, self._episodes.told(i), i)
        self._ended = ended
        return self._episodes.observations, rewards, terminated, truncated, infos

    def _may_go_on(self) -> Truths:
        """Which are to be reset by the step that comes."""
        if self._ended is None:
            raise ResetNeeded("step before the first reset: call reset() to begin episodes")
        if self._mode is AutoresetMode.DISABLED and self._ended.any():
            ended = np.flatnonzero(self._ended).tolist()
            raise ResetNeeded(
                f"the episodes of environments {ended} have ended, and nothing resets them by itself; "
                "call reset(options={'reset_mask': terminated | truncated})"
            )
        return self._ended if self._mode is AutoresetMode.NEXT_STEP else np.zeros(self.num_envs, bool)

    def _final(self, which: Integers, infos: dict[str, Any]) -> dict[str, Any]:
        """The infos with what these environments have come to at their ends."""
        final = self._episodes.observations
        for i in which.tolist():
            infos = self._add_info(infos, {"final_obs": final[i], "final_info": self._episodes.told(i)}, i)
        return infos

    def _begin(self, which: Integers) -> None:
        self._episodes.begin(which, [self._seeded(i)[0] for i in which.tolist()])

    def _masked(self, mask: Any) -> Integers:
        """Which environments are to be reset."""
        if mask is None:
            return np.arange(self.num_envs)
        given = np.asarray(mask)
        if self._ended is None:
            raise ResetNeeded("the first reset begins all episodes: call it without reset_mask")
        if given.shape != (self.num_envs,) or given.dtype != bool or not given.any():
            raise ValueError(
                f"reset_mask {given.tolist()} says not which of {self.num_envs} environments to reset; "
                "give True or False for each, at least one of them True"
            )
        return np.flatnonzero(given)

    def _seed(self, seed: int | Sequence[int | None] | None, which: Integers) -> None:
        if seed is None:
            return
        seeds = [*seed] if isinstance(seed, Sequence) else [index(seed) + i for i in range(self.num_envs)]
        if len(seeds) != self.num_envs:
            raise ValueError(f"there are {len(seeds)} seeds for {self.num_envs} environments; give one for each")
        for i in which.tolist():
            if seeds[i] is not None:
                self._generators[i] = seeding.np_random(seeds[i])

    def _seeded(self, i: int) -> tuple[np.random.Generator, int]:
        """Generator and seed of an environment; where none was given, from the machine's entropy."""
        if i not in self._generators:
            self._generators[i] = seeding.np_random()
        return self._generators[i]
