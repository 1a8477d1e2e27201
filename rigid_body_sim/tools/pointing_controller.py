"""Entry point of pointing_controller, which turns a body to a target attitude and holds it there.

It answers every pair of ``pose`` and ``twist`` of one stamp with a torque on ``wrench``. Run it in the namespace of the
node that it controls: ``ros2 run rigid_body_sim pointing_controller --ros-args -p target.rpy:=[0.0,0.0,1.57]``.
"""

import sys
from typing import TYPE_CHECKING

from . import controller_program

if TYPE_CHECKING:
    from .pointing_node import PointingController

NAME = "pointing_controller"
DESCRIPTION = """Turns a body to a target attitude and holds it there: answers pose and twist with torques on wrench.

Run it in the namespace of the node that it controls."""
EXAMPLE = "--ros-args -p target.rpy:='[0.0, 0.0, 1.57]' -r __ns:=/satellite"


def _node() -> "type[PointingController]":
    from .pointing_node import PointingController

    return PointingController


def main(args: list[str] | None = None) -> int:
    """Run the controller until Ctrl-C or SIGTERM: see controller_program.run."""
    return controller_program.run(NAME, DESCRIPTION, EXAMPLE, args, _node)


if __name__ == "__main__":
    sys.exit(main())
