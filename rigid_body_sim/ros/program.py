"""What every program around one node does: start it or say why not, stop it on Ctrl-C and SIGTERM."""

import os
import re
import signal
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

from . import middleware

if TYPE_CHECKING:
    from .arguments import Arguments


def open_standard_streams() -> None:
    """Open on nothing whichever of stdin, stdout and stderr a program was started without. To be called first.

    Else the next file that it opens takes the number of one, and what libraries print goes into that file.
    """
    while (descriptor := os.open(os.devnull, os.O_RDWR)) <= 2:
        os.set_inheritable(descriptor, True)
    os.close(descriptor)
    sys.stdout, sys.stderr = (
        stream if stream is not None else os.fdopen(number, "w", closefd=False)
        for number, stream in ((1, sys.stdout), (2, sys.stderr))
    )


class StopRequest:
    """Set by SIGINT and SIGTERM: they end a starting program at once, and ask one whose loop runs to stop.

    At once means without unwinding: Python code called by a compiler or a C library drops exceptions, and a program
    that has not joined the network yet leaves nothing behind. rclpy's own handlers are not used: they invalidate the
    context under whatever uses it at that moment.
    """

    def __init__(self) -> None:
        self.requested = False
        self._defer = False
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._on_signal)

    def defer(self) -> None:
        """From now on only note the request; the caller's loop looks at ``requested`` at least ten times a second."""
        self._defer = True

    def ignore_further(self) -> None:
        """At the end: while Python ends it gives back to these signals their default, which is to die of them."""
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_IGN)

    def _on_signal(self, *_: object) -> None:
        if not self._defer:
            os._exit(0)
        self.requested = True


class Runnable(Protocol):
    """A node with a loop of its own."""

    def run(self, stop: StopRequest) -> None:
        """Serve until ``stop.requested``."""

    def destroy_node(self) -> None:
        """Leave the network."""

    def get_logger(self) -> Any:
        """rclpy's, of the node."""


def run(name: str, make_node: Callable[..., Runnable], stop: StopRequest, given: "Arguments") -> int:
    """Join the network, make the node and run it until ``stop``. Returns the exit status: 0, or 1 with one sentence.

    ``make_node`` takes parameters by dotted name as ``given``, and those for rclpy as it does.
    """
    import rclpy
    from rclpy.exceptions import NameValidationException, ParameterException

    from ..scene.schema import belongs_to_ros, one_line
    from . import parameters

    stop.defer()
    try:
        _init(given.ros)
        middleware.use_profile(middleware.libraries(), middleware.has_many_writers(given.parameters))
        own = {name: value for name, value in given.parameters.items() if not belongs_to_ros(name)}
        node = make_node(given=own, parameter_overrides=parameters.of_ros(given.parameters))
    except (ValueError, RuntimeError, NameValidationException, ParameterException) as reason:
        print(f"{name}: {one_line(reason)}", file=sys.stderr)
        rclpy.try_shutdown()
        stop.ignore_further()
        return 1
    for note in given.notes:
        node.get_logger().warning(note)
    try:
        node.run(stop)
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
        stop.ignore_further()
    return 0


def _init(args: list[str]) -> None:
    """rclpy.init. Raises ValueError with what is wrong about an argument that rcl cannot read."""
    import rclpy

    try:
        rclpy.init(args=args, signal_handler_options=rclpy.SignalHandlerOptions.NO)
    except RuntimeError as reason:
        raise ValueError(_said_by_rcl(reason)) from None


def _said_by_rcl(reason: RuntimeError) -> str:
    """What rcl means, without its lines of C and its lexemes."""
    text = re.sub(r",? at /\S+:\d+", "", str(reason)).removeprefix("failed to initialize rcl: ")
    if type(reason).__name__ == "UnknownROSArgsError":
        return f"{text.strip('[]')} after --ros-args is none of ROS's arguments; write what is the program's before it"
    if rule := re.match(r"Couldn't parse remap rule: '(.*)'\. Error: ", text):
        return f"{rule[1]}: renames nothing; write -r FROM:=TO, such as -r wrench:=/force, -r __node:=a or -r __ns:=/a"
    return text + ("; set ROS_LOG_DIR to a folder that can be written" if "log directory" in text else "")
