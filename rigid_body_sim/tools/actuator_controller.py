"""Entry point of actuator_controller, which drives a plant by its actuators: to hover, to point or to hold a pose.

It answers every pair of ``pose`` and ``twist`` of one stamp on ``actuator_commands``. Run it in the namespace of the
node that it controls: ``ros2 run rigid_body_sim actuator_controller --ros-args -p plant:=config/quadrotor.yaml``.
"""

import sys
from typing import TYPE_CHECKING

from . import controller_program

if TYPE_CHECKING:
    from .actuator_node import ActuatorController

NAME = "actuator_controller"
DESCRIPTION = """Drives a plant by its actuators: answers pose and twist with commands on actuator_commands.

By rotors it hovers, by reaction wheels it points, by thrusters it holds position and attitude; what the actuators do it
reads from the scene of the plant. Run it in the namespace of the node that it controls."""
EXAMPLE = "--ros-args -p plant:=config/quadrotor.yaml -p target.position:='[0.0, 0.0, 2.0]' -r __ns:=/drone"


def _node() -> "type[ActuatorController]":
    from .actuator_node import ActuatorController

    return ActuatorController


def main(args: list[str] | None = None) -> int:
    """Run the controller until Ctrl-C or SIGTERM: see controller_program.run."""
    return controller_program.run(NAME, DESCRIPTION, EXAMPLE, args, _node)


if __name__ == "__main__":
    sys.exit(main())
