"""Environments of Gymnasium over an Ensemble: many bodies that learn at once, or one. Needs gymnasium, extra ``rl``.

On import it registers ``RigidBodyHover-v0``.
"""

try:
    import gymnasium
    from gymnasium.vector import AutoresetMode as AutoresetMode  # since 1.1
except ImportError as reason:
    raise ImportError(
        f"rigid_body_sim.envs needs gymnasium 1.1 or later, which cannot be imported ({reason}); "
        "pip install 'gymnasium>=1.1' brings it"
    ) from reason

from .env import RigidBodyEnv as RigidBodyEnv
from .hover import HoverTask as HoverTask
from .task import Task as Task
from .vector_env import RigidBodyVectorEnv as RigidBodyVectorEnv

gymnasium.register(
    "RigidBodyHover-v0",
    entry_point="rigid_body_sim.envs.hover:make_env",
    vector_entry_point="rigid_body_sim.envs.hover:make_vector_env",
    max_episode_steps=500,
)
