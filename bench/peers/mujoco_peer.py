"""MuJoCo: a free body, driven by motors at sites, which its Runge-Kutta evaluates at every stage; many by rollout."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from rigid_body_sim.kernels.vectors import qrotate_back
from rigid_body_sim.report import batch
from rigid_body_sim.report.batch import Batch, BatchMethod
from rigid_body_sim.report.method import SIMULATOR, STEP, Method, step_sizes, steps_held
from rigid_body_sim.report.problems import End, Problem

MODULE, PACKAGE = "mujoco", "mujoco"
STEP_COST = {"Euler": 1.5e-6, "implicit": 2e-6, "RK4": 6e-6}  # s, about

_XML = """<mujoco>
<option timestep="{h!r}" gravity="{g[0]!r} {g[1]!r} {g[2]!r}" integrator="{integrator}"><flag {flags}/></option>
<worldbody><site name="world"/><body><freejoint/>
<inertial pos="0 0 0" mass="{m!r}" diaginertia="{I[0]!r} {I[1]!r} {I[2]!r}"/>
<site name="centre"/>{sites}</body></worldbody>
<actuator>{motors}</actuator></mujoco>"""
# What a free body has not, so that no time is spent on looking for it.
_NOTHING_ELSE = 'constraint="disable" contact="disable" clampctrl="disable" warmstart="disable" sensor="disable"'
_AXES = np.eye(6, dtype=int)


def methods() -> list[Method]:
    """Its explicit, implicit and Runge-Kutta integrators."""
    import mujoco

    mujoco.set_mju_user_warning(lambda text: None)  # counted in mjData; by default printed and written to a file
    return [
        Method(
            f"MuJoCo {name}",
            SIMULATOR,
            knob=lambda problem: STEP,
            values=lambda problem, quick, cost=cost: step_sizes(problem, cost, quick, 2 if quick else 1),
            start=lambda problem, value, name=name: _Run(name, problem, value),
        )
        for name, cost in STEP_COST.items()
    ]


def batch_methods() -> list[BatchMethod]:
    """Its Runge-Kutta by ``mujoco.rollout``, whose threads share the bodies."""
    import mujoco.rollout

    assert mujoco.rollout.Rollout
    return [BatchMethod("MuJoCo RK4, rollout", SIMULATOR, _Rollout, most=50_000)]


class _Run:
    def __init__(self, integrator: str, problem: Problem, h: float):
        import mujoco

        self._mujoco, self._problem, self._each = mujoco, problem, steps_held(problem, h)
        self._model = mujoco.MjModel.from_xml_string(_xml(problem, integrator, h))
        # Tiny moments lie below the bound that the compiler of models checks, so they are given here.
        self._model.body_inertia[1] = problem.body.principal_moments
        self._data = mujoco.MjData(self._model)
        mujoco.mj_setConst(self._model, self._data)
        self._steps = self._each * len(problem.wrenches)
        self._stages = 4 if integrator == "RK4" else 1
        self._controls = [_controls(problem, wrench) for wrench in problem.wrenches]

    def restart(self) -> None:
        data, initial = self._data, self._problem.initial
        self._mujoco.mj_resetData(self._model, data)
        data.qpos[:3], data.qpos[3:], data.qvel[:3] = initial.position, initial.orientation, initial.velocity
        data.qvel[3:] = initial.angular_velocity
        self._mujoco.set_mjcb_passive(_drag(self._problem) if self._problem.dragged else None)

    def advance(self) -> End:
        mujoco, model, data, each = self._mujoco, self._model, self._data, self._each
        for control in self._controls:
            data.ctrl[:] = control
            mujoco.mj_step(model, data, each)
        mujoco.set_mjcb_passive(None)
        if any(warning.number for warning in data.warning):
            raise ArithmeticError("it diverged, and MuJoCo set the model back to its start")
        q, v = data.qpos.tolist(), data.qvel.tolist()
        return End(q[:3], q[3:], v[:3], v[3:])

    def counts(self) -> dict[str, int | None]:
        return {"steps": self._steps, "rhs": self._stages * self._steps}


class _Rollout:
    """A model of one body, a rollout for each; it keeps the states of all steps, of which the last is the end."""

    def __init__(self, given: Batch):
        import mujoco
        from mujoco.rollout import Rollout

        model = mujoco.MjModel.from_xml_string(_xml(given.problem, "RK4", batch.STEP, _NOTHING_ELSE))
        self._models, self._data = [model] * len(given), [mujoco.MjData(model) for _ in range(batch.CORES)]
        self._size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS.value)
        x, q, v, w = np.split(given.starts, (3, 7, 10), axis=1)
        self._starts = np.hstack((np.zeros((len(given), 1)), x, q, v, w))
        assert self._starts.shape[1] == self._size  # time, and the 13
        self._control = np.array(_controls(given.problem, given.problem.wrenches[0]))
        self._rollout = Rollout(nthread=batch.CORES)
        self._prepare(1)
        self.restart()

    def _prepare(self, steps: int) -> None:
        """Arrays for so many steps."""
        n = len(self._starts)
        self._controls = np.tile(self._control, (n, steps, 1))
        self._out, self._sensors = np.empty((n, steps, self._size)), np.empty((n, steps, 0))

    def restart(self) -> None:
        self._states = self._starts

    def advance(self, steps: int) -> None:
        if steps != self._out.shape[1]:
            self._prepare(steps)
        self._rollout.rollout(
            self._models, self._data, self._states, self._controls, skip_checks=True, nstep=steps, state=self._out,
            sensordata=self._sensors,
        )  # fmt: skip
        self._states = self._out[:, -1].copy()

    def ends(self, which: Sequence[int]) -> list[End]:
        return [End(*np.split(self._states[i, 1:], (3, 7, 10))) for i in which]


def _xml(problem: Problem, integrator: str, h: float, flags: str = "") -> str:
    wrench = problem.wrenches[0]
    sites, motors = "", [("centre", "", axis) for axis in _AXES]
    if any(wrench.values[9:]):
        motors += [("centre", "world", axis) for axis in _AXES[3:]]
    for i, (point, _) in enumerate(wrench.points):
        sites += f'<site name="point{i}" pos="{point[0]!r} {point[1]!r} {point[2]!r}"/>'
        motors += [(f"point{i}", "world", axis) for axis in _AXES[:3]]
    text = "".join(
        f'<motor site="{site}"{f" refsite={ref!r}" if ref else ""} gear="{" ".join(map(str, gear))}"/>'
        for site, ref, gear in motors
    )
    values = {"h": h, "g": problem.gravity, "m": problem.body.mass, "I": problem.body.principal_moments.tolist()}
    return _XML.format(**values, integrator=integrator, flags=flags, sites=sites, motors=text)


def _controls(problem: Problem, wrench: Any) -> list[float]:
    found = [*wrench.values[:6], *(wrench.values[9:] if any(problem.wrenches[0].values[9:]) else ())]
    return [*found, *(component for _, force in wrench.points for component in force)]


def _drag(problem: Problem) -> Any:
    """Passive forces, which MuJoCo asks for at every stage: world axes for the force, body axes for the torque."""
    linear, quadratic, angular, angular_quadratic = np.reshape(problem.drag.values, (4, 3)).tolist()

    def passive(model, data):
        (w, x, y, z), v = data.qpos[3:7].tolist(), data.qvel.tolist()
        along = qrotate_back(w, x, y, z, *v[:3])
        force = [-(linear[i] + quadratic[i] * abs(along[i])) * along[i] for i in range(3)]
        data.qfrc_passive[:3] = qrotate_back(w, -x, -y, -z, *force)
        data.qfrc_passive[3:] = [-(angular[i] + angular_quadratic[i] * abs(v[3 + i])) * v[3 + i] for i in range(3)]

    return passive
