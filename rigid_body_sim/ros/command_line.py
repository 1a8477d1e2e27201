"""The command line of a node but for ROS's part of it: answered before anything slow is imported."""

import argparse
import shlex
import sys
from collections.abc import Mapping, Sequence
from types import MappingProxyType

from ..command_line import Parser

BEGIN, END = "--ros-args", "--"
_OF_ROS = ("-p", "--param", "--params-file", "-r", "--remap", "-e", "--enclave")  # and all with "log" in them
_HELP = """arguments of ROS:
  --ros-args ...   parameters, names and logging, as for every node, up to the end or to --:
                   --params-file FILE, -p NAME:=VALUE, -r FROM:=TO, -r __ns:=/NAMESPACE, --log-level LEVEL

"""


def split(args: Sequence[str] | None) -> tuple[list[str], list[str]]:
    """Arguments (by default the program's) that are not ROS's, and ROS's: those from --ros-args to -- or the end."""
    own, ros, in_ros = list[str](), list[str](), False
    for argument in sys.argv[1:] if args is None else args:
        if argument == BEGIN or (in_ros and argument == END):
            in_ros = argument == BEGIN
        else:
            (ros if in_ros else own).append(argument)
    return own, ros


def answer(
    prog: str,
    description: str,
    example: str,
    args: Sequence[str] | None,
    switches: Mapping[str, str] = MappingProxyType({}),
) -> set[str]:
    """Answer --help and --version, and refuse what else is not ROS's; ``example`` is what to write after ``prog``.

    Returns which of the ``switches``, given with a text for --help, there are.
    """
    parser = Parser(
        prog,
        description,
        epilog=f"{_HELP}example:\n  {prog} {example}",
        usage=f"%(prog)s [-h] [--version] {''.join(f'[{switch}] ' for switch in switches)}[--ros-args ...]",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    for switch, text in switches.items():
        parser.add_argument(switch, action="append_const", const=switch, dest="switches", help=text)
    options, unknown = parser.parse_known_args(split(args)[0])
    if unknown := [argument for argument in unknown if argument != END]:
        parser.error(f"argument {shlex.quote(unknown[0])} is not known{_meant(prog, unknown)}")
    return set(vars(options).get("switches") or ())


def _meant(prog: str, unknown: Sequence[str]) -> str:
    """What would be right, where that can be seen."""
    first = unknown[0]
    if first in _OF_ROS or first.startswith(("--log-", "--enable-", "--disable-")):
        ros = shlex.join(unknown)
    elif first.startswith("-"):
        return ""
    elif ":=" in first:
        ros = f"{'-r' if first.startswith(('_', '/')) else '-p'} {shlex.quote(first)}"
    elif first.endswith((".yaml", ".yml")):
        ros = f"--params-file {shlex.quote(first)}"
    else:
        return f", and {prog} takes none but ROS's, after {BEGIN}"
    return f"; ROS's come after {BEGIN}: {prog} {BEGIN} {ros}"
