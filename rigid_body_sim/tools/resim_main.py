"""Entry point of rigid_body_resim: can be stopped before anything slow is imported."""

import os
import signal
import sys

from ..command_line import INTERRUPTED


def main() -> int:
    """Run rigid_body_resim. Ctrl-C and SIGTERM end it with status 130, at once while it starts, else after clean-up.

    At once means without unwinding: nothing is begun yet, and a traceback out of an import tells nobody anything.
    """
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _end_at_once)
    from . import resim

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)
    return resim.main()


def _end_at_once(*_: object) -> None:
    os._exit(INTERRUPTED)


if __name__ == "__main__":
    sys.exit(main())
