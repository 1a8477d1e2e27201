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
    """Compile what any plan may need, or load it from the cache, before the node joins the network.

    A parameter may bring drag into a scene that has none, and the loop must not wait for a compiler then.
    """
    from ..integrators import REGISTRY
    from ..physics.body import Body
    from ..physics.compiled import is_cached
    from ..physics.resistance import Drag
    from ..scene.plan import within_reach
    from ..simulation import Simulation

    if not all(is_cached(REGISTRY[name].steps) for name in within_reach(False) | within_reach(True)):
        print("rigid_body_node: compiling kernels, up to a minute; the next start finds them", file=sys.stderr)
    for drag in (Drag(), Drag(linear=(1.0, 1.0, 1.0))):
        Simulation(Body(mass=1.0, inertia=(1.0, 1.0, 1.0)), drag=drag)


if __name__ == "__main__":
    sys.exit(main())
