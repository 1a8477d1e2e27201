"""Options of the programs that read a bag: the scene that it is of, the topic with its poses, and what to do if cut."""

import argparse
from pathlib import Path

from ..scene.loader import DEFAULT_NODE


def add(parser: argparse.ArgumentParser) -> None:
    """Add them."""
    parser.add_argument(
        "--scene",
        type=Path,
        metavar="FILE",
        help="parameter file of the node (default: the scene in the bag's journal)",
    )
    parser.add_argument(
        "--node",
        default=DEFAULT_NODE,
        metavar="NAME",
        help="full name of the node whose section of that file is taken (default %(default)s)",
    )
    parser.add_argument(
        "--pose", metavar="NAME", help="topic with the poses of the body (default: pose, else odom, else the only one)"
    )
    parser.add_argument(
        "--body",
        action="append",
        default=[],
        metavar="NAME",
        help="of a bag of several bodies, one that is wanted (default: all of them); several times for several",
    )
    parser.add_argument("--recover", action="store_true", help="of a bag that is not whole, take what is")
