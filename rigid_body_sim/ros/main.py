"""Entry point of rigid_body_node."""

import sys

from . import program


def main(args: list[str] | None = None) -> int:
    """Run the node until Ctrl-C or SIGTERM. Returns the exit status: 0, or 1 when the node cannot start."""
    stop = program.StopRequest()  # before anything slow is imported or compiled
    _load_kernels()
    from .node import RigidBodyNode

    return program.run("rigid_body_node", RigidBodyNode, stop, args)


def _load_kernels() -> None:
    """Compile the default kernels, or load them from the cache, before the node joins the network."""
    from ..integrators import taylor
    from ..physics.body import Body
    from ..physics.compiled import is_cached
    from ..simulation import Simulation

    if not is_cached(taylor.steps):
        print("rigid_body_node: compiling kernels, about ten seconds; the next start finds them", file=sys.stderr)
    Simulation(Body(mass=1.0, inertia=(1.0, 1.0, 1.0)))


if __name__ == "__main__":
    sys.exit(main())
