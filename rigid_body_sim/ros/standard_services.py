"""The services and the action of simulation_interfaces 1.5.1, offered where that package can be imported.

They ask the loop and the simulation for what ``services`` and ``inputs`` ask of them, in the words of the standard.
"""

import importlib
import importlib.util
import math
import re
import time
from collections.abc import Callable
from typing import Any, Protocol

from geometry_msgs.msg import Accel, Pose, Twist
from rclpy.action import ActionServer, CancelResponse
from rclpy.node import Node
from rclpy.task import Future

from ..commands import RefusedError
from ..values import rotation
from ..values.parameter import shown
from ..values.state import BodyState, State
from . import messages
from .loop import Loop, Run, StoppedError
from .outputs import Motion
from .plant import Part, Plant

PACKAGE = "simulation_interfaces"
INTERFACES = {
    "srv": (
        "GetSimulatorFeatures",
        "GetSimulationState",
        "SetSimulationState",
        "StepSimulation",
        "ResetSimulation",
        "GetEntities",
        "GetEntityInfo",
        "GetEntityState",
        "SetEntityState",
    ),
    "action": ("SimulateSteps",),
    "msg": ("Bounds", "EntityCategory", "Result", "SimulationState", "SimulatorFeatures"),
}
MOST_STEPS = 100_000  # in one call of step_simulation, during which the node hears nothing else
FEEDBACK_EVERY = 0.1  # s of wall time


class Reset(Protocol):
    """What a reset does: see Loop.reset."""

    def __call__(self, *, state: bool, time_too: bool) -> str:
        """Reset the state, the time, or both."""


class FailedError(Exception):
    """A request that is not granted: ``code`` is a result of the standard, the text says what would be right."""

    def __init__(self, code: int, text: str):
        super().__init__(text)
        self.code = code


def create(node: Node, plant: Plant, reset: Reset, quit_program: Callable[[], None]) -> None:
    """Offer them under ``~/``, all or none: none where the package is missing, or with a warning does not fit."""
    if importlib.util.find_spec(PACKAGE) is None:
        return
    try:
        _check_package()
    except ImportError as reason:
        node.get_logger().warning(f"{PACKAGE} is there, but its services cannot be offered: {reason}")
        return
    simulation = SimulationServices(node, plant.loop, reset, quit_program)
    EntityServices(node, plant)
    StepAction(node, plant.loop)
    simulation.tell_features(len(plant.parts))


def _check_package() -> None:
    """Raise ImportError when the package lacks an interface that version 1.5.1 has."""
    for part, names in INTERFACES.items():
        module = importlib.import_module(f"{PACKAGE}.{part}")
        if missing := [name for name in names if not hasattr(module, name)]:
            raise ImportError(f"{PACKAGE}.{part} has no {', '.join(missing)}; version 1.5.1 has")


def _offer(node: Node, kind: type, name: str, action: Callable[[Any, Any], None]) -> None:
    """Service ``~/name`` whose ``action(request, response)`` fills the response in, or raises why it does not."""
    from simulation_interfaces.msg import Result

    def answer(request: Any, response: Any) -> Any:
        try:
            response.result.result = Result.RESULT_OK
            action(request, response)
        except FailedError as reason:
            response.result = Result(result=reason.code, error_message=str(reason))
        except StoppedError as reason:
            response.result = Result(result=Result.RESULT_OPERATION_FAILED, error_message=str(reason))
        return response

    node.create_service(kind, f"~/{name}", answer)


class SimulationServices:
    """Features, state, steps and reset of the simulation.

    It counts as stopped, in the standard's word, when it is paused where STATE_STOPPED has put it.
    """

    def __init__(self, node: Node, loop: Loop[Any], reset: Reset, quit_program: Callable[[], None]):
        from simulation_interfaces import msg, srv

        self._node, self._loop, self._reset, self._quit = node, loop, reset, quit_program
        self._Result, self._State, self._Features = msg.Result, msg.SimulationState, msg.SimulatorFeatures
        self._stopped_at: int | None = None
        self._kinds = srv
        _offer(node, srv.GetSimulationState, "get_simulation_state", self._get_state)
        _offer(node, srv.SetSimulationState, "set_simulation_state", self._set_state)
        _offer(node, srv.StepSimulation, "step_simulation", self._step)
        _offer(node, srv.ResetSimulation, "reset_simulation", self._reset_scope)

    def tell_features(self, bodies: int) -> None:
        """Offer ``~/get_simulator_features``, last: whoever finds it finds the others, too."""
        f = self._Features
        features = [
            f.ENTITY_STATE_GETTING,
            f.ENTITY_STATE_SETTING,
            f.ENTITY_INFO_GETTING,
            f.SIMULATION_RESET,
            f.SIMULATION_RESET_TIME,
            f.SIMULATION_RESET_STATE,
            f.SIMULATION_STATE_GETTING,
            f.SIMULATION_STATE_SETTING,
            f.SIMULATION_STATE_PAUSE,
            f.STEP_SIMULATION_SINGLE,
            f.STEP_SIMULATION_MULTIPLE,
            f.STEP_SIMULATION_ACTION,
        ]

        told = "one rigid body" if bodies == 1 else f"{bodies} rigid bodies"

        def answer(_: Any, response: Any) -> Any:
            response.features.features = features
            response.features.custom_info = f"rigid_body_sim: {told}; see its docs/reference/interface.md"
            return response

        self._node.create_service(self._kinds.GetSimulatorFeatures, "~/get_simulator_features", answer)

    @property
    def _state(self) -> int:
        """A simulation that has failed is paused, until a reset, whatever it was before."""
        loop, states = self._loop, self._State
        if not (loop.paused or loop.failure):
            return states.STATE_PLAYING
        stopped = loop.paused and loop.simulation.steps == self._stopped_at
        return states.STATE_STOPPED if stopped else states.STATE_PAUSED

    def _get_state(self, _: Any, response: Any) -> None:
        response.state.state = self._state
        response.result.error_message = self._loop.failure

    def _set_state(self, request: Any, response: Any) -> None:
        wanted, states, codes = request.state.state, self._State, self._kinds.SetSimulationState.Response
        if wanted == states.STATE_QUITTING:
            self._quit()
        elif wanted not in (states.STATE_STOPPED, states.STATE_PLAYING, states.STATE_PAUSED):
            known = "STATE_STOPPED 0, STATE_PLAYING 1, STATE_PAUSED 2 or STATE_QUITTING 3"
            text = f"state {wanted} cannot be set: give {known}"
            raise FailedError(self._Result.RESULT_FEATURE_UNSUPPORTED, text)
        elif wanted == self._state:
            raise FailedError(codes.ALREADY_IN_TARGET_STATE, f"already in state {wanted}")
        elif wanted == states.STATE_STOPPED:
            self._loop.pause(True)
            self._reset(state=True, time_too=True)
            self._stopped_at = self._loop.simulation.steps
        elif wanted == states.STATE_PLAYING:
            self._play(codes.STATE_TRANSITION_ERROR)
        elif self._state == states.STATE_STOPPED:
            text = "stopped: it stands still, and steps can be taken; pausing follows STATE_PLAYING"
            raise FailedError(codes.INCORRECT_TRANSITION, text)
        else:
            self._loop.pause(True)

    def _play(self, code: int) -> None:
        try:
            self._loop.pause(False)
        except StoppedError as reason:
            raise FailedError(code, str(reason)) from None
        self._stopped_at = None

    def _step(self, request: Any, _: Any) -> None:
        if request.steps > MOST_STEPS:
            text = f"{request.steps} steps are more than the {MOST_STEPS} of one call; use the action ~/simulate_steps"
            raise FailedError(self._Result.RESULT_OPERATION_FAILED, text)
        self._loop.step(request.steps)

    def _reset_scope(self, request: Any, _: Any) -> None:
        """Nothing can be spawned: that scope alone is refused, and beside others there is nothing to do for it."""
        scopes = self._kinds.ResetSimulation.Request
        scope = request.scope or scopes.SCOPE_ALL
        state, time_too = bool(scope & scopes.SCOPE_STATE), bool(scope & scopes.SCOPE_TIME)
        if not (state or time_too):
            text = f"scope {scope}: give SCOPE_TIME 1, SCOPE_STATE 2, both, or SCOPE_ALL 255; nothing is spawned here"
            raise FailedError(self._Result.RESULT_FEATURE_UNSUPPORTED, text)
        self._reset(state=state, time_too=time_too)


class EntityServices:
    """The entities, which are the bodies. The name of an only one is that of the body frame, else it is the body's."""

    def __init__(self, node: Node, plant: Plant):
        from simulation_interfaces import msg, srv

        self._parts = {part.name or part.scene["body.frame_id"]: part for part in plant.parts}
        self._world = plant.parts[0].scene["world_frame_id"]
        self._Result, self._Bounds, self._category = msg.Result, msg.Bounds, msg.EntityCategory.CATEGORY_OBJECT
        self._invalid_pose = srv.SetEntityState.Response.INVALID_POSE
        _offer(node, srv.GetEntities, "get_entities", self._get_entities)
        _offer(node, srv.GetEntityInfo, "get_entity_info", self._get_info)
        _offer(node, srv.GetEntityState, "get_entity_state", self._get_state)
        _offer(node, srv.SetEntityState, "set_entity_state", self._set_state)

    def _get_entities(self, request: Any, response: Any) -> None:
        filters = request.filters
        if filters.categories or filters.tags.tags:
            text = "filters by category or tag are not supported; filter by name or by a sphere"
            raise FailedError(self._Result.RESULT_FEATURE_UNSUPPORTED, text)
        wanted = self._pattern(filters.filter)
        named = [name for name in self._parts if wanted.search(name)]
        response.entities = [name for name in named if self._is_within(filters.bounds, self._parts[name])]

    def _pattern(self, pattern: str) -> re.Pattern[str]:
        try:
            return re.compile(pattern)
        except re.error as reason:
            text = f"filter {shown(pattern)} is not a regular expression: {reason}"
            raise FailedError(self._Result.RESULT_OPERATION_FAILED, text) from None

    def _is_within(self, bounds: Any, part: Part) -> bool:
        """Whether the body frame's origin is; the body has a mass and an inertia, and no surface."""
        if bounds.type == self._Bounds.TYPE_EMPTY:
            return True
        if bounds.type != self._Bounds.TYPE_SPHERE:
            text = f"bounds of type {bounds.type} are not supported; give TYPE_SPHERE {self._Bounds.TYPE_SPHERE}"
            raise FailedError(self._Result.RESULT_FEATURE_UNSUPPORTED, text)
        if len(bounds.points) != 2:
            text = f"a sphere has 2 points, its centre and one whose x is its radius, and not {len(bounds.points)}"
            raise FailedError(self._Result.RESULT_OPERATION_FAILED, text)
        center, radius = _xyz(bounds.points[0]), bounds.points[1].x
        return math.dist(center, part.simulation.pose[0:3]) <= radius

    def _part(self, entity: str) -> Part:
        if entity not in self._parts:
            names = list(self._parts)
            there = f"the only one is {names[0]!r}" if len(names) == 1 else f"they are {', '.join(names)}"
            raise FailedError(self._Result.RESULT_NOT_FOUND, f"no entity {shown(entity)}: {there}")
        return self._parts[entity]

    def _get_info(self, request: Any, response: Any) -> None:
        part = self._part(request.entity)
        response.info.category.category = self._category
        response.info.description = part.simulation.describe()

    def _get_state(self, request: Any, response: Any) -> None:
        """Pose of the body frame's origin, and velocity and acceleration of it in world axes."""
        part = self._part(request.entity)
        motion, state = Motion(part.simulation), response.state
        state.header.frame_id = self._world
        messages.stamp(state.header, part.seen.stamp_ns)
        _write_pose(state.pose, motion.pose)
        _write_pair(state.twist, motion.twist_world)
        _write_pair(state.acceleration, motion.acceleration_world)

    def _set_state(self, request: Any, _: Any) -> None:
        """From version 2 on, flags say which parts are meant; without them both pose and twist are."""
        part = self._part(request.entity)
        if part.seen.failure:
            text = "the simulation has stopped; reset_simulation starts afresh"
            raise FailedError(self._Result.RESULT_INCORRECT_STATE, text)
        try:
            messages.check_frame("state", request.state.header.frame_id, {self._world})
        except RefusedError as reason:
            raise FailedError(self._Result.RESULT_OPERATION_FAILED, str(reason)) from None
        position, orientation = self._pose_meant(request, part.simulation.state)
        velocity, w_world = self._twist_meant(request, part.simulation.state)
        try:
            w_body = rotation.rotate_back(orientation, w_world)
            part.simulation.set_state(State(position, orientation, velocity, w_body))
        except ValueError as reason:
            raise FailedError(self._Result.RESULT_OPERATION_FAILED, f"state refused: {reason}") from None
        part.seen.on_changed_state()

    def _pose_meant(self, request: Any, now: BodyState) -> tuple[Any, Any]:
        """Position [m] and quaternion w, x, y, z, body → world."""
        if not getattr(request, "set_pose", True):
            return now.position, now.orientation
        p, q = _xyz(request.state.pose.position), request.state.pose.orientation
        try:
            return p, State(p, (q.w, q.x, q.y, q.z)).orientation
        except ValueError as reason:
            raise FailedError(self._invalid_pose, f"pose refused: {reason}") from None

    @staticmethod
    def _twist_meant(request: Any, now: BodyState) -> tuple[Any, Any]:
        """Velocity of the body frame's origin [m/s] and angular velocity [rad/s], both in world axes."""
        if not getattr(request, "set_twist", True):
            return now.velocity, rotation.rotate(now.orientation, now.angular_velocity)
        return _xyz(request.state.twist.linear), _xyz(request.state.twist.angular)


class StepAction:
    """The action ``~/simulate_steps``: the loop takes the steps between what else it has to do."""

    def __init__(self, node: Node, loop: Loop[Any]):
        from simulation_interfaces.action import SimulateSteps
        from simulation_interfaces.msg import Result

        self._loop, self._kind, self._Result = loop, SimulateSteps, Result
        accept = CancelResponse.ACCEPT
        ActionServer(node, SimulateSteps, "~/simulate_steps", self._execute, cancel_callback=lambda _: accept)

    async def _execute(self, goal: Any) -> Any:
        ended = Future()
        try:
            self._loop.begin_run(Run(goal.request.steps, self._telling(goal), ended.set_result))
            why = await ended
        except StoppedError as reason:
            why = str(reason)
        if not why:
            goal.succeed()
        elif goal.is_cancel_requested:
            goal.canceled()
        else:
            goal.abort()
        code = self._Result.RESULT_OPERATION_FAILED if why else self._Result.RESULT_OK
        return self._kind.Result(result=self._Result(result=code, error_message=why))

    def _telling(self, goal: Any) -> Callable[[int, int], None]:
        """What to do as a run goes on: send feedback now and then, and at the end; look whether it is still wanted."""
        told = time.monotonic()

        def on_progress(taken: int, left: int) -> None:
            nonlocal told
            now = time.monotonic()
            if not left or now - told >= FEEDBACK_EVERY:
                told = now
                goal.publish_feedback(self._kind.Feedback(completed_steps=taken, remaining_steps=left))
            if left and goal.is_cancel_requested:
                self._loop.end_run(f"cancelled after {taken} of {taken + left} steps")

        return on_progress


def _xyz(vector: Any) -> tuple[float, float, float]:
    return vector.x, vector.y, vector.z


def _write_pose(pose: Pose, values: tuple[float, ...]) -> None:
    p, q = pose.position, pose.orientation
    p.x, p.y, p.z, q.x, q.y, q.z, q.w = map(float, values)


def _write_pair(pair: Twist | Accel, values: tuple[float, ...]) -> None:
    a, b = pair.linear, pair.angular
    a.x, a.y, a.z, b.x, b.y, b.z = map(float, values)
