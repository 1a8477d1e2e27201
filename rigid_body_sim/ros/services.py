"""The node's services in std_srvs: each asks the loop for one thing and answers with a reason."""

from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger

from ..fleet import Fleet
from ..simulation import Simulation
from .loop import Loop, StoppedError


def create(node: Node, loop: Loop[Any], reset: Callable[[], str]) -> None:
    """Offer ``~/reset``, ``~/pause``, ``~/step`` and ``~/clear_wrench``."""
    clear_wrench = _clearing(loop.simulation)
    actions: dict[str, Callable[[], str]] = {"reset": reset, "step": loop.step, "clear_wrench": clear_wrench}
    for name, action in actions.items():
        node.create_service(Trigger, f"~/{name}", _answering(_whatever_is_asked(action)))
    node.create_service(SetBool, "~/pause", _answering(lambda request: loop.pause(request.data)))


def create_for(node: Node, name: str, simulation: Simulation, reset: Callable[[], str]) -> None:
    """Offer ``name/reset`` and ``name/clear_wrench`` of one of several bodies."""
    node.create_service(Trigger, f"{name}/reset", _answering(_whatever_is_asked(reset)))
    node.create_service(Trigger, f"{name}/clear_wrench", _answering(_whatever_is_asked(_clearing(simulation))))


def _clearing(simulation: Simulation | Fleet) -> Callable[[], str]:
    def clear_wrench() -> str:
        simulation.clear_wrench()
        return "no wrench held"

    return clear_wrench


def _whatever_is_asked(action: Callable[[], str]) -> Callable[[Any], str]:
    return lambda _: action()


def _answering(action: Callable[[Any], str]) -> Callable[[Any, Any], Any]:
    """A service's callback: success and what ``action`` returns, or no success and why it was stopped."""

    def answer(request: Any, response: Any) -> Any:
        try:
            response.message, response.success = action(request), True
        except StoppedError as reason:
            response.message, response.success = str(reason), False
        return response

    return answer
