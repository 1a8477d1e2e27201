"""What ROS's part of a command line gives a node: arguments for rclpy, and parameters, which are read by our rules.

rcl reads parameter files in C, more strictly (no 0 among floats) and less (a name may be there twice) than load_scene;
here both have one reader. rclpy gets the other arguments, and the parameters as the node's.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from ..scene import attitude, parameter_file
from ..scene.schema import one_line, shown_name
from ..values.parameter import shown
from .command_line import BEGIN, split

_PARAMETER, _FILE, _REMAP = ("-p", "--param"), ("--params-file",), ("-r", "--remap")
_RULE = re.compile(r"(?:(?P<node>[^:]*):)?(?P<what>__node|__name|__ns):=(?P<name>.*)")
_ASSIGNMENT = re.compile(r"(?:(?P<node>\w+):)?(?P<name>[^:=]+):=(?P<value>.*)", re.DOTALL)


@dataclass
class Arguments:
    """``ros`` is for rclpy; ``parameters`` have dotted names; ``notes`` are to be logged."""

    ros: list[str] = field(default_factory=list)
    parameters: dict[str, Any] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def read(args: Sequence[str] | None, name: str) -> Arguments:
    """The arguments of the node that is called ``name`` unless they say otherwise.

    Parameters of files come in their order, the later over the earlier, and those of -p over all of them. Raises
    ValueError for a file or an assignment that cannot be read.
    """
    _, ros = split(args)
    files, assignments, rest = list[str](), list[str](), list[str]()
    for flag, value in _pairs(ros):
        kept = files if flag in _FILE else assignments if flag in _PARAMETER else None
        if kept is None:
            rest += [flag] if value is None else [flag, value]
        elif value is None:
            raise ValueError(f"{flag} has nothing behind it; give {flag} {'FILE' if kept is files else 'NAME:=VALUE'}")
        else:
            kept.append(value)
    node = full_name(rest, name)
    found = Arguments([BEGIN, *rest] if rest else [])
    for path in files:
        found.parameters = attitude.over(found.parameters, _of_file(path, node, found.notes))
    found.parameters = attitude.over(found.parameters, _assigned(assignments, node, found.notes))
    return found


def _pairs(ros: Sequence[str]) -> Iterator[tuple[str, str | None]]:
    """Each flag that has a value with that, and every other argument alone."""
    waiting = iter(ros)
    for argument in waiting:
        yield argument, next(waiting, None) if argument in (*_PARAMETER, *_FILE, *_REMAP) else None


def full_name(ros: Sequence[str], name: str) -> str:
    """Namespace and name of the node as rcl makes them, the name first; of several rules that fit the first counts."""
    rules = [match for flag, value in _pairs(ros) if flag in _REMAP and (match := _RULE.fullmatch(value or ""))]
    for rule in rules:
        if rule["what"] != "__ns" and rule["node"] in (None, name):
            name = rule["name"]
            break
    fitting = (rule["name"] for rule in rules if rule["what"] == "__ns" and rule["node"] in (None, name))
    return f"{next(fitting, '').rstrip('/')}/{name}"


def _of_file(path: str, node: str, notes: list[str]) -> dict[str, Any]:
    try:
        file = parameter_file.read(path)
    except OSError as reason:
        raise ValueError(
            f"--params-file {shown_name(path)}: cannot be read ({reason.strerror}); give a parameter file"
        ) from None
    if not file.has(node):
        notes.append(
            f"{shown_name(path)} has nothing for this node, {node}: it has parameters for {file.shown_sections}"
        )
        return {}
    try:
        return file.parameters(node)
    except ValueError as reason:
        raise ValueError(f"{shown_name(path)}: {one_line(reason)}") from None


def _assigned(assignments: Sequence[str], node: str, notes: list[str]) -> dict[str, Any]:
    """The parameters that -p gives. Raises ValueError for what assigns nothing, or to one name twice."""
    values: dict[str, Any] = {}
    for text in assignments:
        shown_text = f"-p {shown_name(text)}"
        try:
            whose, given = _read_assignment(text)
            if whose and f"/{whose}" != node:
                notes.append(f"{shown_text} is for the node /{whose}, and this one is {node}")
                continue
            for name in given.keys() & values.keys():
                raise ValueError(f"parameter {name} is given twice, first as {shown(values[name])}; give it once")
        except ValueError as reason:
            raise ValueError(f"{shown_text}: {one_line(reason)}") from None
        values.update(given)
    return values


def _read_assignment(text: str) -> tuple[str, dict[str, Any]]:
    """The node that it is for, or "", and what it gives: several parameters where the value is a map."""
    if match := _ASSIGNMENT.fullmatch(text):
        return match["node"] or "", parameter_file.given({match["name"]: parameter_file.value(match["value"])})
    name, equals, value = text.partition("=")
    if equals and not name.endswith(":"):
        raise ValueError(f"has '=' where ':=' is needed; write -p {name}:={value}")
    raise ValueError("assigns nothing; write -p NAME:=VALUE, such as -p body.mass:=2.0")
