import enum
from collections.abc import Callable, Coroutine
from typing import Any

from rclpy.node import Node

class CancelResponse(enum.Enum):
    ACCEPT = ...

class ActionServer:
    def __init__(
        self,
        node: Node,
        action_type: type,
        action_name: str,
        execute_callback: Callable[[Any], Coroutine[Any, Any, Any]],
        *,
        cancel_callback: Callable[[Any], CancelResponse],
    ) -> None: ...
