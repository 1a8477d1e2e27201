"""Hovering: a body with a thrust along its z axis and three torques, as a quadrotor has, is to stay at one point."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from numpy.typing import ArrayLike, NDArray

from ..ensemble import Ensemble
from ..kernels.arrays import Floats, Vector, plain
from ..runs.trajectory import States
from ..values import rotation
from ..values.wrench import three_finite
from ..values.wrenches import Wrenches
from .env import RigidBodyEnv
from .task import Task, Truths
from .vector_env import RigidBodyVectorEnv

GRAVITY = 9.80665  # m/s²
FASTEST, FASTEST_SPIN = 15.0, 20.0  # m/s, rad/s: an episode with a component beyond them ends


class HoverTask(Task):
    """Hover at ``target``. By default the body is the quadrotor of config/quadrotor.yaml.

    An action has four numbers in [-1, 1]: the thrust along body z, from none (-1) over the weight (0) to twice the
    weight (1), and the torques about body x, y and z as shares of ``most_torque``.

    What is seen has 18 numbers: position - target [m], world axes; the rotation matrix body → world, row by row; the
    velocity [m/s], world axes; the angular velocity [rad/s], body axes. They are clipped to the space.

    The reward of a step is 1 / (1 + 4 d²) with the distance d [m] from the target. An episode begins within ``start``
    of it in each direction, tilted by up to 0.5 rad and slowly moving; it ends further away than ``radius``, or beyond
    15 m/s or 20 rad/s along an axis.

    Parameters
    ----------
    mass : float
        [kg]
    inertia : array_like
        As Body takes it [kg m²].
    most_torque : array_like, shape (3,)
        About body x, y and z [N m].
    target : array_like, shape (3,)
        World axes [m].
    start, radius : float
        [m]
    rate : float
        Actions, each held for one exact step, a second [Hz].

    Raises
    ------
    ValueError
        Torques, ``start`` or ``radius`` that are not greater than zero; what Ensemble raises comes with the bodies.
    """

    def __init__(
        self,
        *,
        mass: float = 0.716,
        inertia: ArrayLike = (0.0075236, 0.0075236, 0.0130404),
        most_torque: Vector = (0.1, 0.1, 0.02),
        target: Vector = (0.0, 0.0, 2.0),
        start: float = 1.0,
        radius: float = 3.0,
        rate: float = 50.0,
    ):
        self.mass, self.inertia, self.rate = mass, inertia, rate
        self.most_torque = np.array(three_finite(most_torque, "most_torque"))
        self.target = np.array(three_finite(target, "target"))
        self.start, self.radius = start, radius
        for name, value in (("most_torque", self.most_torque), ("start", start), ("radius", radius)):
            if not np.all(np.greater(value, 0.0)):
                raise ValueError(f"{name} {plain(value)} must be greater than zero")
        bounds = np.repeat((radius, 1.0, FASTEST, FASTEST_SPIN), (3, 9, 3, 3)).astype(np.float32)
        self.observation_space = spaces.Box(-bounds, bounds)
        self.action_space = spaces.Box(-1.0, 1.0, (4,))

    def ensemble(self, n: int, threads: int) -> Ensemble:
        """n bodies, all alike."""
        return Ensemble(self.mass, self.inertia, n=n, rate=self.rate, gravity=(0.0, 0.0, -GRAVITY), threads=threads)

    def initial_states(self, randoms: Sequence[np.random.Generator]) -> Mapping[str, ArrayLike]:
        """Twelve numbers from each generator."""
        drawn = np.array([random.uniform(-1.0, 1.0, 12) for random in randoms])
        # 0.14 in each direction: |(x, y, z)| up to tan(0.25), which as (1, x, y, z) is a turn by up to 0.5 rad.
        return {
            "position": self.target + self.start * drawn[:, 0:3],
            "orientation": np.insert(0.14 * drawn[:, 3:6], 0, 1.0, axis=1),
            "velocity": 0.5 * drawn[:, 6:9],
            "angular_velocity": 0.5 * drawn[:, 9:12],
        }

    def wrenches(self, actions: NDArray[Any], state: States) -> Wrenches:
        """Thrust and torques in body axes."""
        force = np.zeros((len(actions), 3))
        force[:, 2] = self.mass * GRAVITY * (1.0 + actions[:, 0])
        return Wrenches(force_body=force, torque_body=self.most_torque * actions[:, 1:4])

    def observations(self, state: States) -> NDArray[Any]:
        """Shape (n, 18), float32."""
        seen = np.empty((len(state.position), 18), np.float32)
        seen[:, 0:3] = state.position - self.target
        seen[:, 3:12] = rotation.to_matrix_each(state.orientation).reshape(-1, 9)
        seen[:, 12:15], seen[:, 15:18] = state.velocity, state.angular_velocity
        return seen.clip(self.observation_space.low, self.observation_space.high, out=seen)

    def rewards(self, state: States, actions: NDArray[Any]) -> Floats:
        """In (0, 1], shape (n,)."""
        return 1.0 / (1.0 + 4.0 * self._squared_distance(state))

    def terminated(self, state: States) -> Truths:
        """Too far away, or too fast."""
        fast = (np.abs(state.velocity) > FASTEST) | (np.abs(state.angular_velocity) > FASTEST_SPIN)
        return fast.any(1) | (self._squared_distance(state) > self.radius**2)

    def _squared_distance(self, state: States) -> Floats:
        x, y, z = (state.position - self.target).T
        return x * x + y * y + z * z


def make_env(*, max_episode_steps: int | None = None, **options: Any) -> RigidBodyEnv:
    """What ``gymnasium.make`` calls: ``options`` are those of HoverTask."""
    return RigidBodyEnv(HoverTask(**options), max_episode_steps=max_episode_steps)


def make_vector_env(
    num_envs: int = 1,
    *,
    max_episode_steps: int | None = None,
    autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
    threads: int = 1,
    **options: Any,
) -> RigidBodyVectorEnv:
    """What ``gymnasium.make_vec`` calls: ``options`` are those of HoverTask."""
    task = HoverTask(**options)
    return RigidBodyVectorEnv(
        task, num_envs, max_episode_steps=max_episode_steps, autoreset_mode=autoreset_mode, threads=threads
    )
