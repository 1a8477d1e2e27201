"""Command line of the node's benchmark."""

import argparse
import contextlib
import math
import os
import random
import sys
from collections.abc import Sequence
from pathlib import Path

from rigid_body_sim.command_line import GET_ROS, INTERRUPTED, Parser

from . import record

NAMES = (
    "ordinary",
    "10khz",
    "1khz",
    "recording",
    "wake_up",
    "middleware",
    "free",
    "command",
    "start",
    "cold_start",
    "memory",
    "fleet",
)


def main(args: list[str] | None = None) -> int:
    """Measure and print. Returns the exit status: 0 whether or not goals are met, 1 without rclpy, 130 after Ctrl-C."""
    arguments = _parser().parse_args(args)
    os.environ["ROS_DOMAIN_ID"] = str(random.randint(1, 100))
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    found: list[record.Figure] = []
    where = record.machine()
    print("\n".join(f"{name}: {value}" for name, value in where.items()), flush=True)
    try:
        _measure(arguments.only or NAMES, arguments.seconds, found)
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return INTERRUPTED
    except ImportError as reason:
        print(f"{reason}; rclpy is needed: {GET_ROS}", file=sys.stderr)
        return 1
    finally:
        if arguments.out:
            record.write(arguments.out, where, found)
    return 0


def _measure(names: Sequence[str], seconds: float, found: list[record.Figure]) -> None:
    import rclpy

    from .figures import measure

    # Signals stay with Python here: they end the nodes first.
    rclpy.init(args=[], signal_handler_options=rclpy.SignalHandlerOptions.NO)
    try:
        for i, name in enumerate(names):
            print(f"[{i + 1}/{len(names)}] {name} ...", file=sys.stderr, flush=True)
            for figure in measure(name, seconds):
                found.append(figure)
                print(figure.line(), flush=True)
            print(f"(load {os.getloadavg()[0]:.2f})", flush=True)
    finally:
        with contextlib.suppress(KeyboardInterrupt):
            rclpy.try_shutdown()


def _parser() -> argparse.ArgumentParser:
    parser = Parser(
        "make bench-node",
        "Measures rigid_body_node as a process over real DDS; docs/explanation/benchmarks.md says what each figure is.",
    )
    parser.add_argument(
        "--seconds", type=_seconds, default=60.0, metavar="S", help="how long a measurement takes (default 60)"
    )
    parser.add_argument("--only", action="append", choices=NAMES, help="this measurement; may be given several times")
    parser.add_argument("--out", type=_file, metavar="FILE", help="write all figures as JSON")
    return parser


def _seconds(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 1.0 <= value < math.inf:
        raise argparse.ArgumentTypeError(f"{text} is not a finite number of seconds of at least 1")
    return value


def _file(text: str) -> Path:
    path = Path(text)
    if not path.absolute().parent.is_dir():
        raise argparse.ArgumentTypeError(f"{text}: there is no such folder")
    return path


if __name__ == "__main__":
    sys.exit(main())
