"""Entry point of rigid_body_node."""

import sys

from . import middleware, program


def main(args: list[str] | None = None) -> int:
    """Run the node until Ctrl-C or SIGTERM. Returns the exit status: 0, or 1 when the node cannot start."""
    program.open_standard_streams()
    stop = program.StopRequest()  # before anything slow is imported or compiled
    from . import arguments

    try:
        given = arguments.read(args, "rigid_body_node")
        if warning := middleware.avoid_full_memory():
            print(f"rigid_body_node: {warning}", file=sys.stderr)
    except ValueError as reason:
        print(f"rigid_body_node: {reason}", file=sys.stderr)
        return 1
    _load_kernels()
    from .node import RigidBodyNode

    return program.run("rigid_body_node", RigidBodyNode, stop, given)


def _load_kernels() -> None:
    """Before the node joins the network, and for all of its life: a parameter may bring drag into a scene without."""
    from ..physics import compiled
    from ..simulation import kernels_are_cached, load_kernels

    if not kernels_are_cached():
        found = "; the next start finds them" if compiled.FOLDER else ""
        print(f"rigid_body_node: compiling kernels, up to a minute{found}", file=sys.stderr)
    load_kernels()


if __name__ == "__main__":
    sys.exit(main())
