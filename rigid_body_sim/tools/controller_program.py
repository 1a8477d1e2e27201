"""What the programs of the controllers share: how they start."""

import sys
from collections.abc import Callable
from typing import TYPE_CHECKING

from ..ros import command_line, program

if TYPE_CHECKING:
    from .answering_node import AnsweringNode


def run(
    name: str, description: str, example: str, args: list[str] | None, node: Callable[[], "type[AnsweringNode]"]
) -> int:
    """Run a controller until Ctrl-C or SIGTERM. Returns the exit status: 0, or 1 when it cannot start.

    ``description`` and ``example`` are for --help; ``node`` imports its class, which takes long, and returns it. Ends
    the program (SystemExit) after --help and --version with status 0, and with 2 for arguments that are not known.
    """
    program.open_standard_streams()
    stop = program.StopRequest()  # before anything slow is imported
    command_line.answer(name, description, example, args)
    from ..ros import arguments

    try:
        given = arguments.read(args, name)
    except ValueError as reason:
        print(f"{name}: {reason}", file=sys.stderr)
        return 1
    return program.run(name, node(), stop, given)
