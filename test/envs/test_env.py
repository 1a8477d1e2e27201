"""One body as an environment: what Gymnasium asks of it, seeds, and that the motion is that of a Simulation."""

import subprocess
import sys
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils import seeding
from gymnasium.utils.env_checker import check_env

from rigid_body_sim import Body, Simulation, State, Wrench
from rigid_body_sim.envs import HoverTask, RigidBodyEnv

from .tasks import BrakeTask

ID = "rigid_body_sim.envs:RigidBodyHover-v0"
NO_THRUST = (-1.0, 0.0, 0.0, 0.0)


def actions(count, seed=0):
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (count, 4)).astype(np.float32)


def test_gymnasium_has_nothing_to_say_against_it():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gymnasium.make(ID).unwrapped)


def test_gymnasium_has_nothing_to_say_against_another_task():
    gymnasium.register("RigidBodyBrake-v0", lambda: RigidBodyEnv(BrakeTask()))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gymnasium.make("RigidBodyBrake-v0").unwrapped)


def test_motion_is_that_of_a_simulation_to_the_bit():
    task = HoverTask(rate=40.0)
    env = RigidBodyEnv(task)
    env.reset(seed=4)
    start = {name: rows[0] for name, rows in task.initial_states([seeding.np_random(4)[0]]).items()}
    body, gravity = Body(task.mass, task.inertia), (0.0, 0.0, -9.80665)
    single = Simulation(body, State(**start), rate=40.0, gravity=gravity)
    for action in actions(60):
        env.step(action)
        thrust, *shares = action.astype(float).tolist()
        torque = [most * share for most, share in zip(task.most_torque.tolist(), shares, strict=True)]
        single.set_wrench(Wrench((0.0, 0.0, task.mass * 9.80665 * (1.0 + thrust)), torque))
        single.step()
    assert env.ensemble.simulation(0).save().state == single.save().state


def played(env, seed, count=30):
    return [env.reset(seed=seed)[0].tobytes()] + [
        (observation.tobytes(), *rest) for observation, *rest in map(env.step, actions(count))
    ]


def test_a_seed_gives_the_same_bits_whatever_was_before():
    env = gymnasium.make(ID)
    first = played(env, 7)
    assert played(env, 8) != first
    assert played(env, 7) == first
    assert played(gymnasium.make(ID), 7) == first


def test_reset_without_a_seed_goes_on_with_the_generator():
    env, other = (RigidBodyEnv(HoverTask()) for _ in range(2))
    for one in (env, other):
        one.reset(seed=3)
    assert not np.array_equal(env.reset()[0], env.reset(seed=3)[0])
    assert np.array_equal(env.reset()[0], other.reset()[0])


def test_time_limit_truncates():
    env = RigidBodyEnv(HoverTask(), max_episode_steps=3)
    for _ in range(2):
        env.reset(seed=0)
        assert [env.step(np.zeros(4))[2:4] for _ in range(4)] == [(False, False)] * 2 + [(False, True)] * 2
    made = gymnasium.make(ID, max_episode_steps=3)
    made.reset(seed=0)
    assert [made.step(np.zeros(4, np.float32))[3] for _ in range(3)] == [False, False, True]


def test_an_action_beyond_the_space_is_the_nearest_within():
    env = RigidBodyEnv(HoverTask())
    env.reset(seed=0)
    env.step((-3.0, 0.5, 9.0, 0.0))
    assert env.ensemble.wrench(0) == Wrench(torque_body=(0.05, 0.1, 0.0))


def test_a_step_that_cannot_be_done_ends_the_episode_and_says_why():
    env = RigidBodyEnv(HoverTask(most_torque=(1e-3, 1e-3, 1e14)))
    env.reset(seed=0)
    _, _, terminated, truncated, info = env.step((0.0, 0.0, 0.0, 1.0))
    assert (terminated, truncated) == (True, False)
    assert info["stopped"].startswith("step 1 cannot be done: the state would not be finite, or would turn by")
    env.reset()
    assert env.step(NO_THRUST)[2:] == (False, False, {})


@pytest.mark.parametrize(
    ("action", "sentence"),
    [
        (np.zeros(3), r"actions have shape \(1, 3\); give \(1, 4\), a row for each body"),
        (0.5, r"actions have shape \(1,\); give \(1, 4\)"),
        ((0.0, np.nan, 0.0, 0.0), r"action \[0.0, nan, 0.0, 0.0\] of body 0 is not finite; give one of Box\(-1.0, 1.0"),
    ],
)
def test_an_action_that_is_none_changes_nothing(action, sentence):
    env = RigidBodyEnv(HoverTask())
    env.reset(seed=0)
    before = env.ensemble.simulation(0).save()
    with pytest.raises(ValueError, match=sentence):
        env.step(action)
    assert env.ensemble.simulation(0).save() == before


@pytest.mark.parametrize("name", ["rewards", "observations", "terminated"])
def test_arrays_of_a_task_have_a_row_for_each_body(name):
    task = BrakeTask()
    setattr(task, name, lambda *given: np.zeros((2, 3)))
    env = RigidBodyEnv(task)
    with pytest.raises(ValueError, match=rf"BrakeTask\.{name} gave shape \(2, 3\); give \(1,.*\), a row for each body"):
        env.reset(seed=0)
        env.step(1)


def test_what_cannot_be_asked_of_it():
    env = RigidBodyEnv(HoverTask())
    with pytest.raises(ResetNeeded, match=r"step before the first reset: call reset\(\)"):
        env.step(np.zeros(4))
    with pytest.raises(ValueError, match=r"options \['low'\] of reset are not known; none is known"):
        env.reset(options={"low": 1})
    with pytest.raises(ValueError, match="max_episode_steps=0: give a whole number of at least 1"):
        RigidBodyEnv(HoverTask(), max_episode_steps=0)
    with pytest.raises(ValueError, match=r"BrakeTask\.ensemble made 3 bodies where 1 were asked for"):
        RigidBodyEnv(BrakeTask(2))
    brake = RigidBodyEnv(BrakeTask())
    brake.reset()
    with pytest.raises(ValueError, match=r"actions \[3\] are not those of MultiDiscrete\(\[3\]\)"):
        brake.step(3)


def test_without_gymnasium_it_says_what_to_install():
    text = "import sys; sys.modules['gymnasium'] = None; import rigid_body_sim.envs"
    ended = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True)
    assert ended.returncode == 1
    assert "ImportError: rigid_body_sim.envs needs gymnasium" in ended.stderr
    assert ended.stderr.endswith("; pip install 'gymnasium>=1.1' brings it\n")
