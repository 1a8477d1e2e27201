"""Entry point of rigid_body_node."""

import sys

from . import command_line, middleware, program

NAME = "rigid_body_node"
DESCRIPTION = """Simulates a rigid body: wrench commands in, pose and twist out, at a fixed rate.

Without parameters it is a body of 1 kg at rest. All parameters, topics and services: docs/interface.md."""
EXAMPLE = "--ros-args --params-file config/satellite.yaml -p body.mass:=2.0 -r __ns:=/satellite"


def main(args: list[str] | None = None) -> int:
    """Run the node until Ctrl-C or SIGTERM. Returns the exit status: 0, or 1 when the node cannot start.

    Ends the program (SystemExit) after --help and --version with status 0, and with 2 for arguments that are not known.
    """
    program.open_standard_streams()
    stop = program.StopRequest()  # before anything slow is imported or compiled
    command_line.answer(NAME, DESCRIPTION, EXAMPLE, args)
    from . import arguments

    try:
        given = arguments.read(args, NAME)
        if warning := middleware.avoid_full_memory():
            print(f"{NAME}: {warning}", file=sys.stderr)
    except ValueError as reason:
        print(f"{NAME}: {reason}", file=sys.stderr)
        return 1
    _load_kernels()
    from .node import RigidBodyNode

    return program.run(NAME, RigidBodyNode, stop, given)


def _load_kernels() -> None:
    """Before the node joins the network, and for all of its life: a parameter may bring drag into a scene without."""
    from ..kernels import compiled
    from ..simulation import kernels_are_cached, load_kernels

    if not kernels_are_cached():
        found = "; the next start finds them" if compiled.FOLDER else ""
        print(f"rigid_body_node: compiling kernels, up to a minute{found}", file=sys.stderr)
    load_kernels()


if __name__ == "__main__":
    sys.exit(main())
