"""Entry point of pointing_controller, which turns a body to a target attitude and holds it there.

It answers every pair of ``pose`` and ``twist`` of one stamp with a torque on ``wrench``. Run it in the namespace of the
node that it controls: ``ros2 run rigid_body_sim pointing_controller --ros-args -p target.rpy:=[0.0,0.0,1.57]``.
"""

import sys

from ..ros import program


def main(args: list[str] | None = None) -> int:
    """Run the controller until Ctrl-C or SIGTERM. Returns the exit status: 0, or 1 when it cannot start."""
    program.open_standard_streams()
    stop = program.StopRequest()  # before anything slow is imported
    from ..ros import arguments

    try:
        given = arguments.read(args, "pointing_controller")
    except ValueError as reason:
        print(f"pointing_controller: {reason}", file=sys.stderr)
        return 1
    from .pointing_node import PointingController

    return program.run("pointing_controller", PointingController, stop, given)


if __name__ == "__main__":
    sys.exit(main())
