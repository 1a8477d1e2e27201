"""What the command lines of all programs have in common: --help, --version, and one sentence for what is wrong."""

import argparse
import os
from collections.abc import Sequence
from typing import Any, NoReturn

from . import __version__

# Exit statuses of all programs: after arguments that they do not know, and after Ctrl-C.
WRONG, INTERRUPTED = 2, 130
# What to do where there is no rclpy.
GET_ROS = "source a ROS, or pip install 'ros-jazzy-rclpy[fastrtps]' ros-jazzy-common-interfaces"


class Parser(argparse.ArgumentParser):
    """argparse's, strict about names, with --version; ``wrong`` is the exit status for what it refuses."""

    def __init__(self, prog: str, description: str, wrong: int = WRONG, **others: Any):
        super().__init__(prog=prog, description=description, allow_abbrev=False, **others)
        self._wrong = wrong
        self.add_argument("--version", action="version", version=f"{prog} {__version__}")

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """As the base class does; ends the program where the working directory is gone, without which much else fails.

        ``parse_args`` calls this.
        """
        options = super().parse_known_args(args, namespace)
        try:
            os.getcwd()
        except OSError as reason:
            self.exit(
                1, f"{self.prog}: there is no working directory ({reason.strerror}); change to one that is there\n"
            )
        return options

    def error(self, message: str) -> NoReturn:
        """End the program with one sentence on stderr."""
        self.exit(self._wrong, f"{self.prog}: {message}; --help tells what can be given\n")


def takes_nothing(prog: str, description: str, args: Sequence[str] | None = None) -> None:
    """Answer --help and --version, and refuse anything else: for a program that needs no arguments."""
    Parser(prog, description).parse_args(args)
