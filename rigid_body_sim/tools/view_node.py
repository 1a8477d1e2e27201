"""ROS side of rigid_body_view: finds bodies, asks their nodes for what they look like, and does what the page asks."""

import time
from collections.abc import Callable
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import ParameterValue
from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.client import Client
from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import SetBool, Trigger

from ..ros.executor import executor_for
from ..ros.program import StopRequest
from ..scene.schema import one_line
from ..view import live
from ..view.moment import Moment
from ..view.page import RATE
from ..view.stage import Stage
from .view_links import Found, Link, Values, bodies

LOOK_EVERY = 1.0  # s between two looks at who is there
ANSWER_WITHIN = 5.0  # s
PERIOD = 1.0 / RATE
TRIGGERS = {live.STEP: "step", live.RESET: "reset"}
_HEALTH = "achieved rate [Hz]", "real-time factor", "simulated time [s]"
_FIELDS = ("bool_value", "integer_value", "double_value", "string_value")  # by ParameterValue.type, from 1 on
_ARRAYS = ("byte_array_value", "bool_array_value", "integer_array_value", "double_array_value", "string_array_value")


class Viewer:
    """Shows on ``stage`` what is heard, and is the panel's Controls.

    Of two nodes of rclpy's, ``node`` is served by an executor; the other has the subscriptions to motion, which are
    not: see view_links.
    """

    def __init__(self, stage: Stage, wanted: tuple[str, ...] = ()):
        self._node, self._ears = (
            Node(name, start_parameter_services=False, enable_rosout=False)
            for name in ("rigid_body_view", "rigid_body_view_ears")
        )
        self._executor = executor_for(self._node)
        self._stage, self._wanted = stage, wanted
        self._panel = live.Panel(stage)
        stage.add_switches()
        self._links: dict[str, Link] = {}
        self._found: dict[str, Found] = {}
        self._asked: dict[str, float] = {}  # by node, when its parameters were asked for
        self._values: dict[str, Values] = {}  # by node, once they are known; empty where it does not tell
        self._health: dict[str, dict[str, str]] = {}  # by name of the status: of a node's only body, or of each
        self._clients: dict[str, Client] = {}
        self._look_at = 0.0
        self._node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 10)

    def run(self, stop: StopRequest) -> None:
        """Show until ``stop.requested``."""
        due = time.monotonic()
        while not stop.requested:
            self._turn()
            due = max(due + PERIOD, time.monotonic())
            while not stop.requested and (left := due - time.monotonic()) > 0.0:
                self._executor.spin_once(timeout_sec=left)  # answers and diagnostics

    def destroy_node(self) -> None:
        """Leave the network; the executor first, which else looks at what is gone."""
        self._executor.shutdown()
        self._ears.destroy_node()
        self._node.destroy_node()

    def _turn(self) -> None:
        if time.monotonic() >= self._look_at:
            self._look_at = time.monotonic() + LOOK_EVERY
            for found in bodies(self._node, self._wanted):
                self._take_up(found)
        self._panel.serve(self)
        moments = {name: moment for name, link in self._links.items() if (moment := link.moment()) is not None}
        self._stage.show(moments)
        self._stage.tell(self._status(moments))

    # Who is there -----------------------------------------------------------------------------------------------------

    def _take_up(self, found: Found) -> None:
        """Show one more body, once its node has said what it looks like or has had the time to."""
        if found.name in self._links:
            self._found[found.name] = found
            return
        first = self._asked.setdefault(found.node, time.monotonic())
        if found.node not in self._values:
            if time.monotonic() < first + ANSWER_WITHIN:
                self._look_at = 0.0
                self._ask_for_names(found.node)
                return
            self._values[found.node] = {}
        link = self._link(found)
        self._found[found.name], self._links[found.name] = found, link
        self._stage.add(found.name, link.look)
        self._panel.add(found.name, link.look)

    def _link(self, found: Found) -> Link:
        try:
            return Link(self._ears, found.prefix, of_body(self._values[found.node], found.name))
        except (KeyError, ValueError) as reason:  # of a node that is none of ours, or of another version
            self._panel.tell(f"{found.name}: its parameters tell no shape ({one_line(reason)})")
            return Link(self._ears, found.prefix, {})

    def _ask_for_names(self, node: str) -> None:
        self._call(ListParameters, f"{node}/list_parameters", ListParameters.Request(), partial(self._ask_for, node))

    def _ask_for(self, node: str, answer: Any) -> None:
        names = list(answer.result.names)
        self._call(
            GetParameters,
            f"{node}/get_parameters",
            GetParameters.Request(names=names),
            partial(self._note, node, names),
        )

    def _note(self, node: str, names: list[str], answer: Any) -> None:
        self._values[node] = {name: plain(value) for name, value in zip(names, answer.values, strict=True)}

    def _call(self, kind: type, service: str, request: Any, then: Callable[[Any], None]) -> bool:
        """Call a service unless a call of it is under way; False where it is not there."""
        if service not in self._clients:
            self._clients[service] = self._node.create_client(kind, service)
        client = self._clients[service]
        if not client.service_is_ready():
            return False
        future = client.call_async(request)
        future.add_done_callback(lambda done: _answered(done, then))
        return True

    # What it tells ----------------------------------------------------------------------------------------------------

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            health = {item.key: item.value for item in status.values}
            if {*_HEALTH, "mode"} <= health.keys():
                self._health[status.name] = health

    def _status(self, moments: dict[str, Moment]) -> str:
        if not moments:
            return f"Waiting for `pose` and `twist` in `{self._node.get_namespace()}`."
        return "\n\n".join(f"**{name}** {self._told(name, moment)}" for name, moment in moments.items())

    def _told(self, name: str, moment: Moment) -> str:
        node = self._found[name].node
        health = self._health.get(f"{node}: {name.rpartition('/')[2]}") or self._health.get(f"{node}: simulation")
        if health is None:
            return f"{moment.time:.1f} s"
        rate, factor, time = (float(health[key]) for key in _HEALTH)
        return f"{time:.1f} s, {rate:.0f} Hz, real-time factor {factor:.2f}, {health['mode']}"

    # Controls ---------------------------------------------------------------------------------------------------------

    def ask(self, what: str, body: str) -> None:
        """Pause, go on, step or reset, by the services of the nodes."""
        if not self._found:
            self._panel.tell("Nobody is there to be asked.")
        names = list(self._found) if body == live.ALL else [body]
        if what == live.RESET and body != live.ALL and self._is_one_of_several(body):
            self._trigger(what, f"{self._found[body].prefix}reset")
            return
        for node in dict.fromkeys(self._found[name].node for name in names):
            if what in TRIGGERS:
                kind, service, request = Trigger, TRIGGERS[what], Trigger.Request()
            else:
                kind, service, request = SetBool, "pause", SetBool.Request(data=what == live.PAUSE)
            told = partial(self._tell, what)
            if not self._call(kind, f"{node}/{service}", request, told):
                self._panel.tell(f"{what}: {node} has no service {service}.")

    def _is_one_of_several(self, body: str) -> bool:
        node = self._found[body].node
        return sum(found.node == node for found in self._found.values()) > 1

    def _trigger(self, what: str, service: str) -> None:
        if not self._call(Trigger, service, Trigger.Request(), partial(self._tell, what)):
            self._panel.tell(f"{what}: there is no service {service}.")

    def _tell(self, what: str, answer: Any) -> None:
        self._panel.tell(f"{what}: {answer.message}")

    def send_wrench(self, body: str, force: tuple[float, ...], torque: tuple[float, ...]) -> None:
        """Publish a wrench."""
        self._links[body].send_wrench(force, torque)

    def send_actuators(self, body: str, values: tuple[float, ...]) -> None:
        """Publish commands to the actuators."""
        self._links[body].send_actuators(values)


def _answered(done: Future, then: Callable[[Any], None]) -> None:
    if done.result() is not None:
        then(done.result())


def plain(value: ParameterValue) -> Any:
    """The value of a parameter as Python has it; None for one that is not set."""
    if 1 <= value.type <= len(_FIELDS):
        return getattr(value, _FIELDS[value.type - 1])
    if len(_FIELDS) < value.type <= len(_FIELDS) + len(_ARRAYS):
        return tuple(getattr(value, _ARRAYS[value.type - len(_FIELDS) - 1]))
    return None


def of_body(values: Values, name: str) -> dict[str, Any]:
    """The parameters of one body among those of its node: its own, without its name before them, over the shared."""
    own = {key.removeprefix(f"{name}."): value for key, value in values.items() if key.startswith(f"{name}.")}
    return {**values, **own}
