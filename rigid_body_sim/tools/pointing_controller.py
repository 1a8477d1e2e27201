"""Entry point of pointing_controller, which turns a body to a target attitude and holds it there.

It answers every pair of ``pose`` and ``twist`` of one stamp with a torque on ``wrench``. Run it in the namespace of the
node that it controls: ``ros2 run rigid_body_sim pointing_controller --ros-args -p target.rpy:=[0.0,0.0,1.57]``.
"""

import sys

from ..ros import command_line, program

NAME = "pointing_controller"
DESCRIPTION = """Turns a body to a target attitude and holds it there: answers pose and twist with torques on wrench.

Run it in the namespace of the node that it controls."""
EXAMPLE = "--ros-args -p target.rpy:='[0.0, 0.0, 1.57]' -r __ns:=/satellite"


def main(args: list[str] | None = None) -> int:
    """Run the controller until Ctrl-C or SIGTERM. Returns the exit status: 0, or 1 when it cannot start.

    Ends the program (SystemExit) after --help and --version with status 0, and with 2 for arguments that are not known.
    """
    program.open_standard_streams()
    stop = program.StopRequest()  # before anything slow is imported
    command_line.answer(NAME, DESCRIPTION, EXAMPLE, args)
    from ..ros import arguments

    try:
        given = arguments.read(args, NAME)
    except ValueError as reason:
        print(f"{NAME}: {reason}", file=sys.stderr)
        return 1
    from .pointing_node import PointingController

    return program.run(NAME, PointingController, stop, given)


if __name__ == "__main__":
    sys.exit(main())
