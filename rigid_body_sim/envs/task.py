"""What a task is: which bodies there are, what an action does to them, what is seen of them, and what counts."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..ensemble import Ensemble
from ..kernels.arrays import Floats
from ..runs.trajectory import States
from ..values.wrenches import Wrenches

Truths = NDArray[np.bool_]


class Task(ABC):
    """What bodies are to learn. Every array has a row for each body, and what is said of one depends on its row alone.

    Where it is to be the same to the bit for one body and for many, use arithmetic, square roots and ``np.clip``,
    which numpy does alike in arrays of any size, and not sums along an axis, matrix products or functions such as exp.

    Attributes
    ----------
    observation_space, action_space : gymnasium.spaces.Space
        Of one body, of those spaces that have arrays or numbers as members: Box, Discrete, MultiDiscrete, MultiBinary.
    steps_per_action : int
        Steps of the ensemble under each action.
    """

    observation_space: Any
    action_space: Any
    steps_per_action: int = 1

    @abstractmethod
    def ensemble(self, n: int, threads: int) -> Ensemble:
        """n bodies that may be in any state, one for each environment."""

    @abstractmethod
    def initial_states(self, randoms: Sequence[np.random.Generator]) -> Mapping[str, ArrayLike]:
        """States in which episodes begin, one drawn from each generator: what Ensemble.set_state takes, by its names.

        Each has a row for each generator, or is one for all.
        """

    @abstractmethod
    def wrenches(self, actions: NDArray[Any], state: States) -> Wrenches:
        """What n bodies in these states hold from now on, by actions of the action space, shape (n, ...)."""

    @abstractmethod
    def observations(self, state: States) -> NDArray[Any]:
        """What is seen of n bodies, shape (n, ...), a new array in the observation space."""

    @abstractmethod
    def rewards(self, state: States, actions: NDArray[Any]) -> Floats:
        """What n bodies are given for having come to these states by these actions, shape (n,)."""

    @abstractmethod
    def terminated(self, state: States) -> Truths:
        """Whose episodes end in these states, shape (n,), whatever time is left."""
