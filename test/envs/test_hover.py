"""The hover task: what is seen and rewarded, and that it is neither impossible nor trivial."""

import gymnasium
import numpy as np
import pytest

from rigid_body_sim.envs import HoverTask
from rigid_body_sim.values import rotation

ID = "rigid_body_sim.envs:RigidBodyHover-v0"
G = 9.80665


def proportional(observations, task):
    """Push towards the target and against the velocity; turn the thrust there, and against the spin."""
    offset, v_world, w_body = (observations[:, i : i + 3].astype(float) for i in (0, 12, 15))
    R_world_body = observations[:, 3:12].reshape(-1, 3, 3)
    a_body = np.einsum("nji,nj->ni", R_world_body, (0.0, 0.0, G) - 4.0 * offset - 3.0 * v_world)
    tilt = np.cross((0.0, 0.0, 1.0), a_body) / np.linalg.norm(a_body, axis=1, keepdims=True)
    torque = task.inertia * (60.0 * tilt - 12.0 * w_body)
    return np.column_stack((a_body[:, 2] / G - 1.0, torque / task.most_torque)).clip(-1.0, 1.0)


def play(policy, n=40):
    """Return and length of the first episode of each environment, and distance [m] from the target after 500 steps."""
    env = gymnasium.make_vec(ID, n)
    observations, _ = env.reset(seed=0)
    going, returns, lengths = np.ones(n, bool), np.zeros(n), np.zeros(n)
    for _ in range(500):
        observations, rewards, terminated, truncated, _ = env.step(policy(observations))
        returns, lengths = returns + rewards * going, lengths + going
        going &= ~(terminated | truncated)
    return returns, lengths, np.linalg.norm(observations[:, :3], axis=1)


def test_a_proportional_controller_hovers():
    returns, lengths, distances = play(lambda observations: proportional(observations, HoverTask()))
    assert (lengths == 500).all()
    assert distances.max() < 1e-5  # 5.1e-7 m of 200, where float32 ends
    assert returns.min() > 440  # 449


def test_random_actions_do_not():
    space = gymnasium.spaces.Box(-1.0, 1.0, (40, 4), seed=0)
    returns, lengths, _ = play(lambda observations: space.sample())
    assert lengths.max() < 250  # 115 of 200
    assert returns.max() < 100  # 41


def test_what_is_seen_is_the_state():
    task = HoverTask(target=(1.0, -1.0, 3.0))
    ensemble = task.ensemble(5, 1)
    ensemble.set_state(**task.initial_states([np.random.default_rng(i) for i in range(5)]))
    state, seen = ensemble.state, task.observations(ensemble.state)
    for i in range(5):
        offset, R, v_world, w_body = np.split(seen[i], (3, 12, 15))
        assert np.allclose(offset, state.position[i] - (1.0, -1.0, 3.0), rtol=0, atol=1e-7)  # 3e-8
        assert np.allclose(R.reshape(3, 3), rotation.to_matrix(state.orientation[i]), rtol=0, atol=1e-7)  # 3e-8
        assert np.array_equal(v_world, state.velocity[i].astype(np.float32))
        assert np.array_equal(w_body, state.angular_velocity[i].astype(np.float32))
        assert 1.0 / (1.0 + 4.0 * np.sum((state.position[i] - (1.0, -1.0, 3.0)) ** 2)) == pytest.approx(
            task.rewards(state, np.zeros((5, 4)))[i], rel=1e-15
        )


def test_episodes_begin_near_the_target():
    task = HoverTask(start=0.5)
    ensemble = task.ensemble(1000, 1)
    ensemble.set_state(**task.initial_states([np.random.default_rng(i) for i in range(1000)]))
    state, straight = ensemble.state, np.array([1.0, 0.0, 0.0, 0.0])
    assert 0.45 < np.abs(state.position - task.target).max() <= 0.5
    tilts = [rotation.angle_between(straight, q) for q in state.orientation]
    assert 0.4 < max(tilts) < 0.5  # 0.46 rad
    assert not task.terminated(state).any()


@pytest.mark.parametrize(
    ("state", "ends"),
    [
        ({"position": (0, 0, 5.1)}, True),
        ({"position": (0, 0, 4.9)}, False),
        ({"velocity": (0, 15.1, 0)}, True),
        ({"angular_velocity": (0, 0, -20.1)}, True),
        ({"velocity": (0, 14.9, 0), "angular_velocity": (19, 19, -19)}, False),
    ],
)
def test_what_ends_an_episode_lies_beyond_what_is_seen(state, ends):
    task = HoverTask()
    ensemble = task.ensemble(2, 1)
    ensemble.set_state(**{name: [values, (0, 0, 0)] for name, values in state.items()})
    ensemble.set_state(position=(0, 0, 2), which=[1])
    assert task.terminated(ensemble.state).tolist() == [ends, False]
    seen = task.observations(ensemble.state)
    assert all(task.observation_space.contains(one) for one in seen)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"radius": 0.0}, "radius 0.0 must be greater than zero"),
        ({"start": -1.0}, "start -1.0 must be greater than zero"),
        ({"most_torque": (0.1, 0.0, 0.1)}, r"most_torque \[0.1, 0.0, 0.1\] must be greater than zero"),
        ({"target": (0.0, 1.0)}, r"target \[0.0, 1.0\] must be three finite numbers"),
    ],
)
def test_what_cannot_be_a_task(options, sentence):
    with pytest.raises(ValueError, match=sentence):
        HoverTask(**options)
