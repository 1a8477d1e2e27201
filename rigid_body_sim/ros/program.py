"""What every program around one node does: start it or say why not, stop it on Ctrl-C and SIGTERM."""

import os
import re
import signal
import sys
from collections.abc import Callable
from typing import Protocol

from . import middleware


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

    def _on_signal(self, *_) -> None:
        if not self._defer:
            os._exit(0)
        self.requested = True


class Runnable(Protocol):
    """A node with a loop of its own."""

    def run(self, stop: StopRequest) -> None:
        """Serve until ``stop.requested``."""

    def destroy_node(self) -> None:
        """Leave the network."""


def run(name: str, make_node: Callable[[], Runnable], stop: StopRequest, args: list[str] | None) -> int:
    """Join the network, make the node and run it until ``stop``. Returns the exit status: 0, or 1 with one sentence."""
    import rclpy
    from rclpy.exceptions import NameValidationException, ParameterException

    from ..scene.schema import one_line

    stop.defer()
    middleware.use_profile()
    try:
        _init(args)
        node = make_node()
    except (ValueError, RuntimeError, NameValidationException, ParameterException) as reason:
        print(f"{name}: {one_line(reason)}", file=sys.stderr)
        rclpy.try_shutdown()
        stop.ignore_further()
        return 1
    try:
        node.run(stop)
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
        stop.ignore_further()
    return 0


def _init(args: list[str] | None) -> None:
    """rclpy.init. Raises ValueError with what is wrong about a file or an argument that rcl cannot read."""
    import rclpy

    try:
        rclpy.init(args=args, signal_handler_options=rclpy.SignalHandlerOptions.NO)
    except RuntimeError as reason:
        text = re.sub(r",? at /\S+:\d+", "", str(reason))
        if "log directory" in text:
            raise ValueError(f"{text}; set ROS_LOG_DIR to a folder that can be written") from None
        is_content = "params file" in text and "opening YAML file" not in text
        hint = (
            "; a parameter file has '/**:' with 'ros__parameters:' below it, a value for every name, "
            "and numbers of one kind in an array (0.0, not 0)"
        )
        raise ValueError(text + (hint if is_content else "")) from None
