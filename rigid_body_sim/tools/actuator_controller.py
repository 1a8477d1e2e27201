"""Entry point of actuator_controller, which drives a plant by its actuators: to hover, to point or to hold a pose.

It answers every pair of ``pose`` and ``twist`` of one stamp on ``actuator_commands``. Run it in the namespace of the
node that it controls: ``ros2 run rigid_body_sim actuator_controller --ros-args -p plant:=config/quadrotor.yaml``.
"""

import sys

from ..ros import command_line, program

NAME = "actuator_controller"
DESCRIPTION = """Drives a plant by its actuators: answers pose and twist with commands on actuator_commands.

By rotors it hovers, by reaction wheels it points, by thrusters it holds position and attitude; what the actuators do it
reads from the scene of the plant. Run it in the namespace of the node that it controls."""
EXAMPLE = "--ros-args -p plant:=config/quadrotor.yaml -p target.position:='[0.0, 0.0, 2.0]' -r __ns:=/drone"


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
    from .actuator_node import ActuatorController

    return program.run(NAME, ActuatorController, stop, given)


if __name__ == "__main__":
    sys.exit(main())
