"""Entry point of rigid_body_node."""

import sys
from collections.abc import Mapping
from functools import partial
from importlib import import_module
from typing import Any

from ..command_line import WRONG
from . import command_line, middleware, program

NAME = "rigid_body_node"
DESCRIPTION = """Simulates rigid bodies: wrenches or commands to actuators in, pose, twist and what sensors measure out.

Without parameters it is a body of 1 kg at rest. All parameters, topics and services: docs/reference/interface.md."""
EXAMPLE = "--ros-args --params-file config/satellite.yaml -p body.mass:=2.0 -r __ns:=/satellite"

COMPILE = "--compile"
COMPILE_TEXT = "compile what any scene may need into the cache, for images and CI, and end"


def main(args: list[str] | None = None) -> int:
    """Run the node until Ctrl-C or SIGTERM. Returns the exit status: 0, or 1 when the node cannot start.

    Ends the program (SystemExit) after --help and --version with status 0, and with 2 for arguments that are not known.
    """
    program.open_standard_streams()
    stop = program.StopRequest()  # before anything slow is imported or compiled
    if command_line.answer(NAME, DESCRIPTION, EXAMPLE, args, {COMPILE: COMPILE_TEXT}) == {COMPILE}:
        return _compile_everything(args)
    from . import arguments

    try:
        given = arguments.read(args, NAME)
        if warning := middleware.avoid_full_memory():
            print(f"{NAME}: {warning}", file=sys.stderr)
    except ValueError as reason:
        print(f"{NAME}: {reason}", file=sys.stderr)
        return 1
    _compile(given.parameters)
    from .node import RigidBodyNode

    return program.run(NAME, RigidBodyNode, stop, given)


def _compile(given: Mapping[str, Any]) -> None:
    """What the scene needs, before the node joins the network; what parameters may bring into it, meanwhile."""
    from .. import first_start
    from ..kernels import compiled

    now, later = first_start.of_parameters(given)
    if first_start.missing(now):
        found = "; the next start finds them" if compiled.FOLDER else ""
        print(f"{NAME}: compiling kernels for this scene, some seconds{found}", file=sys.stderr, flush=True)
    first_start.compile_together(now, meanwhile=partial(import_module, ".node", __package__))
    first_start.compile_in_background(later)


def _compile_everything(args: list[str] | None) -> int:
    if command_line.split(args)[1]:
        print(f"{NAME}: {COMPILE} is for every scene; give it no arguments of ROS", file=sys.stderr)
        return WRONG
    from .. import first_start
    from ..kernels import compiled

    if compiled.FOLDER is None:
        print(f"{NAME}: {compiled.NO_FOLDER or 'numba is not in use, so there is nothing to compile'}", file=sys.stderr)
        return 1
    missing = first_start.missing(first_start.everything())
    first_start.compile_together(missing)
    print(f"{NAME}: compiled {len(missing)} kernels into {compiled.FOLDER}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
