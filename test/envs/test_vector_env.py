"""Many bodies as a vector environment: each is what an environment of it alone is, and ends as Gymnasium says."""

import re
import warnings
from functools import partial

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers.vector import RecordEpisodeStatistics

from rigid_body_sim.envs import HoverTask, RigidBodyEnv, RigidBodyVectorEnv

from .tasks import BrakeTask

ID = "rigid_body_sim.envs:RigidBodyHover-v0"
N = 11  # a block of eight, and three
SHORT = {"rate": 10.0, "radius": 1.2}  # with episodes of 3 to 12 steps
SPUN = (1e-3, 1e-3, 1e14)  # N m, of which the last one is too much to be followed
TASKS = {
    "hover": (partial(HoverTask, **SHORT), 12),
    "brake": (BrakeTask, 12),
    "some stop": (partial(HoverTask, most_torque=SPUN), 6),
}


def same(a, b):
    """Whether two things are the same to the bit, arrays and dictionaries included.

    In sentences numbers of steps count for nothing: an ensemble goes on counting where one of its episodes ends.
    """
    if isinstance(a, dict):
        return isinstance(b, dict) and a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, tuple) or (isinstance(a, np.ndarray) and a.dtype == object):
        return type(a) is type(b) and len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, np.ndarray):
        return isinstance(b, np.ndarray) and (a.dtype, a.shape) == (b.dtype, b.shape) and a.tobytes() == b.tobytes()
    return re.sub(r"^step \d+", "", a) == re.sub(r"^step \d+", "", b) if isinstance(a, str) else a == b


def made(name, mode, **options):
    """A vector environment, and one that Gymnasium makes of as many single ones."""
    task, most = TASKS[name]
    ours = RigidBodyVectorEnv(task(), N, max_episode_steps=most, autoreset_mode=mode, **options)
    singles = [partial(RigidBodyEnv, task(), max_episode_steps=most)] * N
    return ours, SyncVectorEnv(singles, autoreset_mode=mode)


def sampled(env, count, name):
    """Actions of all environments; where some are to stop, that is number 3."""
    env.action_space.seed(2)
    for _ in range(count):
        actions = env.action_space.sample()
        if name == "some stop":
            actions[:, 3] = np.arange(N) == 3
        yield actions


@pytest.mark.parametrize("mode", ["NextStep", "SameStep", "Disabled"])
@pytest.mark.parametrize("name", TASKS)
def test_it_does_what_as_many_single_environments_do(name, mode):
    ours, theirs = made(name, mode)
    assert same(ours.reset(seed=5), theirs.reset(seed=5))
    assert ours.observation_space == theirs.observation_space and ours.action_space == theirs.action_space
    assert ours.metadata == theirs.metadata
    ends = 0
    for actions in sampled(theirs, 40, name):
        found, wanted = ours.step(actions), theirs.step(actions)
        assert same(found, wanted), (found, wanted)
        ended = found[2] | found[3]
        ends += ended.sum()
        if mode == "Disabled" and ended.any():
            found, wanted = (one.reset(options={"reset_mask": ended}) for one in (ours, theirs))
            assert same(found, wanted)
    assert ends > 2 * N
    assert same(ours.reset(seed=6), theirs.reset(seed=6))


def test_environment_k_is_the_single_one_with_seed_plus_k():
    ours = gymnasium.make_vec(ID, N)
    observations, _ = ours.reset(seed=20)
    singles = [gymnasium.make(ID) for _ in range(N)]
    for k, single in enumerate(singles):
        assert same(observations[k], single.reset(seed=20 + k)[0])
    assert ours.unwrapped.np_random_seed == tuple(range(20, 20 + N))
    ours.action_space.seed(0)
    for _ in range(20):
        actions = ours.action_space.sample()
        observations, rewards, *_ = ours.step(actions)
        for k, single in enumerate(singles):
            observation, reward, *_ = single.step(actions[k])
            assert same(observations[k], observation) and rewards[k] == reward


@pytest.mark.parametrize("mode", AutoresetMode)
def test_what_has_ended(mode):
    """By the time limit: the observation of the end, and that of a new beginning."""
    env = RigidBodyVectorEnv(HoverTask(), 2, max_episode_steps=2, autoreset_mode=mode)
    env.reset(seed=0)
    still = np.zeros((2, 4))
    env.step(still)
    last, rewards, terminated, truncated, infos = env.step(still)
    assert truncated.all() and not terminated.any() and (rewards > 0).all()
    if mode is AutoresetMode.SAME_STEP:
        assert infos["_final_obs"].all() and not same(infos["final_obs"][0], last[0])
    elif mode is AutoresetMode.NEXT_STEP:
        first, rewards, terminated, truncated, infos = env.step(still)
        assert not (rewards.any() or terminated.any() or truncated.any() or infos)
        assert not same(first, last) and not env.step(still)[3].any()
    else:
        with pytest.raises(ResetNeeded, match=r"the episodes of environments \[0, 1\] have ended, and nothing resets"):
            env.step(still)
        env.reset(options={"reset_mask": np.array([True, False])})
        with pytest.raises(ResetNeeded, match=r"environments \[1\] have ended"):
            env.step(still)


def test_seeds_of_some():
    env, other = (RigidBodyVectorEnv(HoverTask(), 3) for _ in range(2))
    env.reset(seed=[5, 9, 7])
    second = env.reset()[0]
    other.reset(seed=5)
    found = other.reset(seed=[None, 9, None])[0]
    assert same(found[0], second[0])
    assert same(found[1], env.reset(seed=[0, 9, 0])[0][1])
    assert other.np_random_seed == (5, 9, 7)
    before = other.reset(seed=1)[0]
    found = other.reset(seed=2, options={"reset_mask": np.array([False, True, False])})[0]
    assert same(found[[0, 2]], before[[0, 2]]) and same(found[1], before[2])  # both with seed 3


def test_without_a_seed_all_differ():
    observations, _ = RigidBodyVectorEnv(HoverTask(), 3).reset()
    assert len({one.tobytes() for one in observations}) == 3
    assert len(set(RigidBodyVectorEnv(HoverTask(), 3).np_random)) == 3


def test_gymnasium_makes_it_without_a_word():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make_vec(ID, 3, autoreset_mode="SameStep", radius=2.0, threads=2)
    assert env.spec.id == "RigidBodyHover-v0" and env.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP
    assert env.single_observation_space.high[0] == 2.0
    counted = RecordEpisodeStatistics(env)
    counted.reset(seed=0)
    for _ in range(500):
        *_, infos = counted.step(np.zeros((3, 4), np.float32))
        if "episode" in infos:
            break
    assert infos["episode"]["l"].max() > 1
    env.close()
    assert isinstance(gymnasium.make_vec(ID, 2, vectorization_mode="sync"), SyncVectorEnv)


def test_threads_change_no_bit():
    task = HoverTask(rate=1000.0)
    task.steps_per_action = 40  # so that the work is worth a thread
    one, two = (RigidBodyVectorEnv(task, 400, threads=threads) for threads in (1, 2))
    assert same(one.reset(seed=0), two.reset(seed=0))
    one.action_space.seed(0)
    for _ in range(3):
        actions = one.action_space.sample()
        assert same(one.step(actions), two.step(actions))


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"seed": [1, 2]}, "there are 2 seeds for 3 environments; give one for each"),
        ({"options": {"reset_mask": np.ones(2, bool)}}, r"reset_mask \[True, True\] says not which of 3 environments"),
        ({"options": {"reset_mask": np.zeros(3, bool)}}, "at least one of them True"),
        ({"options": {"reset_mask": [0, 1, 1]}}, "give True or False for each"),
        ({"options": {"low": 0.0}}, r"options \['low'\] of reset are not known; reset_mask, an array of bool"),
    ],
)
def test_a_reset_that_cannot_be_changes_nothing(given, sentence):
    env = RigidBodyVectorEnv(HoverTask(), 3)
    env.reset(seed=0)
    before = env.ensemble.state
    with pytest.raises(ValueError, match=sentence):
        env.reset(**given)
    assert same(env.ensemble.state.position, before.position)


def test_what_cannot_be_asked_of_it():
    with pytest.raises(ValueError, match="num_envs=0: give a whole number of at least 1"):
        RigidBodyVectorEnv(HoverTask(), 0)
    env = RigidBodyVectorEnv(HoverTask(), 3)
    with pytest.raises(ResetNeeded, match="step before the first reset"):
        env.step(np.zeros((3, 4)))
    with pytest.raises(ResetNeeded, match="the first reset begins all episodes: call it without reset_mask"):
        env.reset(options={"reset_mask": np.array([True, False, True])})
    env.reset()
    with pytest.raises(ValueError, match=r"action \[0.0, inf, 0.0, 0.0\] of body 1 is not finite"):
        env.step([[0, 0, 0, 0], [0, np.inf, 0, 0], [0, 0, 0, 0]])
    with pytest.raises(ValueError, match="'Later' is not a valid AutoresetMode"):
        RigidBodyVectorEnv(HoverTask(), 3, autoreset_mode="Later")
