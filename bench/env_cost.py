"""What a step of the hover environment costs, one and a thousand, beside the same task on MuJoCo and another's.

All figures come from one run in which the candidates take turns, so that they see the same machine. A figure is the
median over rounds; times on a shared machine drift, the ratios do not.
"""

import contextlib
import io
import platform
import statistics
import sys
import time
import warnings
from collections.abc import Callable, Sequence
from typing import Any, Protocol, cast

import numpy as np

from rigid_body_sim.command_line import takes_nothing
from rigid_body_sim.envs import HoverTask, RigidBodyEnv, RigidBodyVectorEnv
from rigid_body_sim.envs.hover import GRAVITY
from rigid_body_sim.kernels import compiled
from rigid_body_sim.kernels.arrays import Floats
from rigid_body_sim.runs.trajectory import States

ROUNDS = 15
MANY = 1000
STEPS = {1: 1000, MANY: 40}  # by number of environments, in a round
# Random ones turn the bodies at some rad/s, and episodes end after about 66 steps; as slowly as those of the others do
# bodies turn that hover, by less than 0.02 rad in a step.
ACTIONS = {"random actions": 1.0, "a hundredth of random actions": 0.01}
COMPARED = 50  # actions, 1 s, after which the positions are compared

Rows = Any  # arrays with a row for each environment


class Environments(Protocol):
    """What is measured."""

    def reset(self, *, seed: int) -> object: ...
    def step(self, actions: Rows) -> object: ...


class One:
    """A single environment that begins anew where its episode ends, as what runs it has to."""

    def __init__(self, env: Any):
        self.env = env

    def reset(self, *, seed: int) -> None:
        """Begin."""
        self.env.reset(seed=seed)

    def step(self, actions: Rows) -> None:
        """Go on under the only action."""
        _, _, terminated, truncated, _ = self.env.step(actions[0])
        if terminated or truncated:
            self.env.reset()


class MujocoHover:
    """The hover task on MuJoCo: the same arithmetic on the same arrays, but for who moves the bodies.

    ``substeps`` steps make one of the environment; ``threads`` share a rollout, or Python calls mj_step for each body.
    """

    def __init__(self, task: HoverTask, n: int, *, integrator: str = "Euler", substeps: int = 1, threads: int = 0):
        import mujoco
        from mujoco import rollout

        self._mujoco, self._task, self._substeps, self._threads = mujoco, task, substeps, threads
        text = _MUJOCO.format(integrator=integrator, h=1.0 / (task.rate * substeps), mass=task.mass, I=task.inertia)
        self._model = mujoco.MjModel.from_xml_string(text)
        self._data = [mujoco.MjData(self._model) for _ in range(threads or n)]
        self._all = mujoco.mjtState.mjSTATE_FULLPHYSICS
        self.states: Floats = np.zeros((n, mujoco.mj_stateSize(self._model, self._all)))
        self._rollout = rollout.Rollout(nthread=threads if threads > 1 else 0) if threads else None
        self._ended = np.zeros(n, bool)

    def reset(self, *, seed: int) -> None:
        """Begin all, as the environments of this package do."""
        self._randoms = [np.random.default_rng(seed + i) for i in range(len(self.states))]
        self._begin(np.arange(len(self.states)))

    def step(self, actions: Rows) -> tuple[Rows, Floats, Rows]:
        """Observations, rewards and which have ended; what has ended before begins anew."""
        clipped = actions.astype(float).clip(-1.0, 1.0)
        thrust = self._task.mass * GRAVITY * (1.0 + clipped[:, :1])
        self._advance(np.hstack((thrust, self._task.most_torque * clipped[:, 1:])))
        seen = cast(States, _Seen(self.states))
        rewards, before = self._task.rewards(seen, clipped), self._ended
        self._ended = self._task.terminated(seen) & ~before
        if before.any():
            self._begin(np.flatnonzero(before))
        return self._task.observations(seen), rewards, self._ended

    def _begin(self, which: Rows) -> None:
        drawn = self._task.initial_states([self._randoms[i] for i in which])
        q = np.asarray(drawn["orientation"])
        q = q / np.linalg.norm(q, axis=1, keepdims=True)
        begun = np.hstack((drawn["position"], q, drawn["velocity"], drawn["angular_velocity"]))
        self.states[which, 1:14], self._ended[which] = begun, False
        if self._rollout is None:
            for i in which:
                self._mujoco.mj_setState(self._model, self._data[i], self.states[i], self._all)

    def _advance(self, controls: Floats) -> None:
        if self._rollout is not None:
            found = self._rollout.rollout(self._model, self._data, self.states, controls[:, None], nstep=self._substeps)
            self.states = found[0][:, -1].copy()
            return
        step, read, model = self._mujoco.mj_step, self._mujoco.mj_getState, self._model
        for data, control, row in zip(self._data, controls, self.states, strict=True):
            data.ctrl[:] = control
            step(model, data, self._substeps)
            read(model, data, row, self._all)


class _Seen:
    """States of MuJoCo as a task takes them: views, also of what is written into them later."""

    def __init__(self, states: Floats):
        self.position, self.orientation = states[:, 1:4], states[:, 4:8]
        self.velocity, self.angular_velocity = states[:, 8:11], states[:, 11:14]


_MUJOCO = """<mujoco><option timestep="{h}" gravity="0 0 -9.80665" integrator="{integrator}"/>
<worldbody><body><freejoint/><inertial pos="0 0 0" mass="{mass}" diaginertia="{I[0]} {I[1]} {I[2]}"/><site name="c"/>
</body></worldbody><actuator><motor site="c" gear="0 0 1 0 0 0"/><motor site="c" gear="0 0 0 1 0 0"/>
<motor site="c" gear="0 0 0 0 1 0"/><motor site="c" gear="0 0 0 0 0 1"/></actuator></mujoco>"""


def candidates(n: int) -> dict[str, Environments]:
    """What is measured for so many environments, ours first."""
    task = HoverTask()
    if n == 1:
        ours: dict[str, Environments] = {"RigidBodyEnv": One(RigidBodyEnv(task, max_episode_steps=500))}
        return {**ours, "RigidBodyVectorEnv": _vector(task, 1, 1), **_mujoco(task, 1), **_drone()}
    ours = {
        f"RigidBodyVectorEnv, {threads} thread{'s' * (threads > 1)}": _vector(task, n, threads) for threads in (1, 2)
    }
    return {**ours, **_mujoco(task, n)}


def _vector(task: HoverTask, n: int, threads: int) -> RigidBodyVectorEnv:
    return RigidBodyVectorEnv(task, n, max_episode_steps=500, threads=threads)


def _mujoco(task: HoverTask, n: int) -> dict[str, Environments]:
    cuts = {"Euler 20 ms": ("Euler", 1), "RK4 20 ms": ("RK4", 1), "Euler 2 ms": ("Euler", 10)}
    ways = {"mj_step": 0} if n == 1 else {"rollout, 1 thread": 1, "rollout, 2 threads": 2}
    try:
        each: dict[str, Environments] = {}
        if n > 1:
            each["MuJoCo Euler 20 ms, mj_step of each"] = MujocoHover(task, n)
        return each | {
            f"MuJoCo {cut}, {way}": MujocoHover(task, n, integrator=integrator, substeps=substeps, threads=threads)
            for cut, (integrator, substeps) in cuts.items()
            for way, threads in ways.items()
        }
    except ImportError:
        return {}


def _drone() -> dict[str, Environments]:
    """HoverAviary of gym-pybullet-drones as it comes: 30 actions a second on 240 steps of PyBullet; its own task."""
    try:
        with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
            warnings.simplefilter("ignore")
            from gym_pybullet_drones.envs import HoverAviary

            return {"gym-pybullet-drones, 8 steps of 4.2 ms": _Drone(HoverAviary())}
    except ImportError:
        return {}


class _Drone(One):
    """It hovers, and is left to that: any other action soon ends an episode, and a reset costs some steps."""

    def step(self, actions: Rows) -> None:
        super().step(np.zeros((1, 1, 4), np.float32))


def costs(n: int, share: float) -> dict[str, tuple[float, float]]:
    """Processor time and time [s] that a step of one of n environments takes, the medians over rounds."""
    envs = candidates(n)
    taken: dict[str, list[tuple[float, float]]] = {}
    for env in envs.values():
        env.reset(seed=0)
    random = np.random.default_rng(0)
    for _ in range(ROUNDS):
        actions = share * random.uniform(-1.0, 1.0, (STEPS[n], n, 4)).astype(np.float32)
        for name, env in envs.items():
            taken.setdefault(name, []).append(_elapsed(env.step, actions))
    return {name: _medians(rounds, n * STEPS[n]) for name, rounds in taken.items()}


def _elapsed(step: Callable[[Rows], object], actions: Rows) -> tuple[float, float]:
    begin, began = time.process_time(), time.perf_counter()
    for each in actions:
        step(each)
    return time.process_time() - begin, time.perf_counter() - began


def _medians(rounds: Sequence[tuple[float, float]], steps: int) -> tuple[float, float]:
    cpu, wall = (statistics.median(one) / steps for one in zip(*rounds, strict=True))
    return cpu, wall


def distances() -> dict[str, float]:
    """How far [m] each way of MuJoCo's is from this package after COMPARED random actions, the median of many."""
    task, actions = HoverTask(radius=1e6), np.random.default_rng(0).uniform(-1.0, 1.0, (COMPARED, MANY, 4))
    ours = _vector(task, MANY, 1)
    others = {name: env for name, env in _mujoco(task, MANY).items() if "1 thread" in name}
    for env in (ours, *others.values()):
        env.reset(seed=0)
        for each in actions:
            env.step(each)
    found = {}
    for name, env in others.items():
        assert isinstance(env, MujocoHover)
        apart = np.linalg.norm(env.states[:, 1:4] - ours.ensemble.state.position, axis=1)
        found[name.partition(",")[0]] = float(np.median(apart))
    return found


def main(args: Sequence[str] | None = None) -> int:
    """Print all figures with the machine's name."""
    takes_nothing("env_cost", "Measures what a step of the hover environment costs, one and a thousand.", args)
    numba = "numba" if compiled.ENABLED else "plain Python"
    print(f"{platform.node()}, {platform.machine()}, Python {platform.python_version()}, kernels in {numba}")
    for n in STEPS:
        for name, share in ACTIONS.items():
            print(f"\n{n} environments, {name}: µs of the processor and µs for a step of one, and steps a second")
            for candidate, (cpu, wall) in costs(n, share).items():
                print(f"  {candidate:38s} {1e6 * cpu:8.2f} {1e6 * wall:8.2f} {1.0 / wall:12,.0f}")
    print(f"\nDistance from the exact motion after {COMPARED} random actions of 20 ms, m: the median of {MANY}")
    for name, distance in distances().items():
        print(f"  {name:38s} {distance:.1e}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
