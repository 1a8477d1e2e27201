"""Tasks that the tests of environments share."""

import numpy as np
from gymnasium import spaces

from rigid_body_sim import Drag, Ensemble, Wrenches
from rigid_body_sim.envs import Task


class BrakeTask(Task):
    """Stop a body in a fluid by pushing it along x, or not, or along -x; an episode ends at rest, or far away."""

    observation_space = spaces.Box(-100.0, 100.0, (4,))
    action_space = spaces.Discrete(3)
    steps_per_action = 3

    def __init__(self, more=0):
        self.more = more  # bodies than it is told to make

    def ensemble(self, n, threads):
        drag = Drag(linear=(0.1, 0.2, 0.3), angular_linear=(0.01, 0.01, 0.01))
        return Ensemble(2.0, (0.1, 0.2, 0.25), n=n + self.more, rate=20.0, drag=drag, threads=threads)

    def initial_states(self, randoms):
        return {"velocity": [random.uniform(-2.0, 2.0, 3) for random in randoms], "angular_velocity": (0.1, 2.0, 0.1)}

    def wrenches(self, actions, state):
        force = np.zeros((len(actions), 3))
        force[:, 0] = actions - 1.0
        return Wrenches(force_world=force, torque_body=-0.01 * state.angular_velocity)

    def observations(self, state):
        return np.hstack((state.velocity, state.position[:, :1])).astype(np.float32)

    def rewards(self, state, actions):
        return -np.abs(state.velocity[:, 0]) - 0.1 * (actions != 1)

    def terminated(self, state):
        return (np.abs(state.velocity[:, 0]) < 0.05) | (np.abs(state.position[:, 0]) > 3.0)
