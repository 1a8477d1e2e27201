"""The node, held up when it has said that it is ready and before its loop: until there is a file at $HELD_UP_UNTIL."""

import os
import sys
import time
from pathlib import Path

from rigid_body_sim.ros import main, node


class HeldUpLogger:
    """A logger that is slow to return."""

    def __init__(self, logger):
        self._logger = logger

    def __getattr__(self, name):
        return getattr(self._logger, name)

    def info(self, text):
        self._logger.info(text)
        while text.startswith("ready") and not Path(os.environ["HELD_UP_UNTIL"]).exists():
            time.sleep(0.001)


class HeldUpNode(node.RigidBodyNode):
    """The node with that logger."""

    def get_logger(self):
        return HeldUpLogger(super().get_logger())


if __name__ == "__main__":
    node.RigidBodyNode = HeldUpNode
    sys.exit(main.main())
