"""Drake: a free body in a MultibodyPlant, propellers for what turns with it, its error-controlled integrators."""

import numpy as np

from rigid_body_sim.report.method import RTOL, SIMULATOR, Method
from rigid_body_sim.report.problems import End, Problem

MODULE, PACKAGE = "pydrake", "drake"
INTEGRATORS = {"RK3": "runge_kutta3", "RK5": "runge_kutta5"}
LONGEST_TURN = 1.0  # rad in a step: from one of many turns its error control does not find back
AXES = (("y", np.pi / 2), ("x", -np.pi / 2), ("z", 0.0))  # turns that take z to x, y and z


def methods() -> list[Method]:
    """Runge-Kutta of order 3, its default, and of order 5."""
    import pydrake.systems.analysis

    assert pydrake.systems.analysis.Simulator
    return [
        Method(
            f"Drake {name}",
            SIMULATOR,
            knob=lambda problem: RTOL,
            values=lambda problem, quick, name=name: _values(name, problem, quick),
            start=lambda problem, value, integrator=integrator: _Run(integrator, problem, value),
            refusal=_refusal,
        )
        for name, integrator in INTEGRATORS.items()
    ]


def _values(name: str, problem: Problem, quick: bool) -> list[float]:
    """Tolerances as long as a run takes seconds: 1000 rad at RK3's third order would take minutes."""
    finest = (8 if name == "RK3" else 14) - (4 if problem.name == "fast_spin" else 0)
    return [10.0**-k for k in (range(2, 7, 4) if quick else range(2, finest + 1, 2))]


def _refusal(problem: Problem) -> str:
    if problem.dragged:
        return (
            "it has no linear and quadratic drag in body axes; a system in Python at every stage would measure Python"
        )
    return ""


class _Run:
    def __init__(self, integrator: str, problem: Problem, rtol: float):
        from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

        self._problem = problem
        self._diagram, self._plant, self._body, self._inputs = _diagram(problem)
        self._context = self._diagram.CreateDefaultContext()
        self._simulator = Simulator(self._diagram, self._context)
        longest = min(problem.hold, LONGEST_TURN / problem.fastest_rate if problem.fastest_rate else problem.hold)
        ResetIntegratorFromFlags(self._simulator, integrator, longest)
        method = self._simulator.get_mutable_integrator()
        method.set_target_accuracy(rtol)
        method.set_maximum_step_size(longest)
        method.set_requested_minimum_step_size(1e-12)
        method.set_throw_on_minimum_step_size_violation(False)
        self._method = method

    def restart(self) -> None:
        from pydrake.common.eigen_geometry import Quaternion
        from pydrake.math import RigidTransform
        from pydrake.multibody.math import SpatialVelocity

        state, plant, context = self._problem.initial, self._plant, self._context
        mine = plant.GetMyMutableContextFromRoot(context)
        context.SetTime(0.0)
        q = state.orientation / np.linalg.norm(state.orientation)
        plant.SetFreeBodyPose(mine, self._body, RigidTransform(Quaternion(q), state.position))
        w = RigidTransform(Quaternion(q), np.zeros(3)).rotation() @ state.angular_velocity
        plant.SetFreeBodySpatialVelocity(mine, self._body, SpatialVelocity(w, state.velocity))
        self._give(self._problem.wrenches[0])
        self._simulator.Initialize()

    def _give(self, wrench) -> None:
        mine = self._inputs.GetMyMutableContextFromRoot(self._context)
        self._inputs.get_mutable_source_value(mine).SetFromVector(wrench.values[:6])

    def advance(self) -> End:
        for i, wrench in enumerate(self._problem.wrenches):
            if i:
                self._give(wrench)
            self._simulator.AdvanceTo((i + 1) * self._problem.hold)
        mine = self._plant.GetMyContextFromRoot(self._context)
        pose = self._plant.EvalBodyPoseInWorld(mine, self._body)
        motion = self._plant.EvalBodySpatialVelocityInWorld(mine, self._body)
        q = pose.rotation().ToQuaternion().wxyz()
        return End(pose.translation(), q, motion.translational(), pose.rotation().inverse() @ motion.rotational())

    def counts(self) -> dict[str, int | None]:
        method = self._method
        return {"steps": method.get_num_steps_taken(), "rhs": method.get_num_derivative_evaluations()}


def _diagram(problem: Problem):
    from pydrake.multibody.plant import MultibodyPlant, Propeller, PropellerInfo
    from pydrake.multibody.tree import RotationalInertia, SpatialInertia
    from pydrake.systems.framework import DiagramBuilder
    from pydrake.systems.primitives import ConstantVectorSource

    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    inertia = SpatialInertia.MakeFromCentralInertia(
        problem.body.mass, np.zeros(3), RotationalInertia(*problem.body.principal_moments)
    )
    body = plant.AddRigidBody("body", inertia)
    plant.mutable_gravity_field().set_gravity_vector(np.array(problem.gravity))
    plant.Finalize()
    inputs = builder.AddSystem(ConstantVectorSource(np.array(problem.wrenches[0].values[:6])))
    port = plant.get_applied_spatial_force_input_port()
    if points := problem.wrenches[0].points:
        builder.Connect(builder.AddSystem(_held_forces(body, points)).get_output_port(), port)
    elif any(any(wrench.values[:6]) for wrench in problem.wrenches):
        infos = [
            PropellerInfo(body.index(), _turned(*axis), float(thrust), float(not thrust))
            for thrust in (True, False)
            for axis in AXES
        ]
        propellers = builder.AddSystem(Propeller(infos))
        builder.Connect(inputs.get_output_port(), propellers.get_command_input_port())
        builder.Connect(plant.get_body_poses_output_port(), propellers.get_body_poses_input_port())
        builder.Connect(propellers.get_spatial_forces_output_port(), port)
    return builder.Build(), plant, body, inputs


def _turned(axis: str, angle: float):
    from pydrake.math import RigidTransform, RotationMatrix

    make = {"x": RotationMatrix.MakeXRotation, "y": RotationMatrix.MakeYRotation, "z": RotationMatrix.MakeZRotation}
    return RigidTransform(make[axis](angle), np.zeros(3))


def _held_forces(body, points):
    from pydrake.common.value import Value
    from pydrake.multibody.math import SpatialForce
    from pydrake.multibody.plant import ExternallyAppliedSpatialForce
    from pydrake.systems.primitives import ConstantValueSource

    held = []
    for point, force in points:
        one = ExternallyAppliedSpatialForce()
        one.body_index, one.p_BoBq_B = body.index(), np.array(point)
        one.F_Bq_W = SpatialForce(np.zeros(3), np.array(force))
        held.append(one)
    return ConstantValueSource(Value[list[ExternallyAppliedSpatialForce]](held))
