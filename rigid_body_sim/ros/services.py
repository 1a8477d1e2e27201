"""The node's services in std_srvs: each asks the loop for one thing and answers with a reason."""

from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger

from .loop import Loop, StoppedError


def create(node: Node, loop: Loop, reset: Callable[[], str]) -> None:
    """Offer ``~/reset``, ``~/pause``, ``~/step`` and ``~/clear_wrench``."""

    def clear_wrench() -> str:
        loop.simulation.clear_wrench()
        return "no wrench held"

    actions: dict[str, Callable[[], str]] = {"reset": reset, "step": loop.step, "clear_wrench": clear_wrench}
    for name, action in actions.items():
        node.create_service(Trigger, f"~/{name}", _answering(_whatever_is_asked(action)))
    node.create_service(SetBool, "~/pause", _answering(lambda request: loop.pause(request.data)))


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
