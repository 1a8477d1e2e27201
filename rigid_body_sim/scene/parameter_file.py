"""ROS parameter files and values, read strictly and in one way, with ROS and without.

A file has sections by the full names of nodes, with their parameters below ``ros__parameters``; names may be nested. In
the name of a section ``/*`` stands for any one name and ``/**`` for any number of them. A node takes all the sections
that its own name fits, the later ones over the earlier.
"""

import difflib
import os
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import yaml

from ..values.parameter import shown
from . import attitude, schema
from .file_path import beside

MOST_CHARACTERS = 1_000_000  # of a file; the scenes of this package have 1000
PARAMETERS = "ros__parameters"
_SHAPE = f"a parameter file has sections for nodes, such as '/**:', with '{PARAMETERS}:' below them"


@dataclass(frozen=True)
class ParameterFile:
    """What is in a file: the parameters below each name of a node, such as ``/ns/node`` or ``/**``, in their order."""

    folder: str
    sections: dict[str, Any]

    def has(self, node: str) -> bool:
        """Whether there is a section for the node of that full name."""
        return any(fits(section, node) for section in self.sections)

    def parameters(self, node: str) -> dict[str, Any]:
        """Dotted names and values for the node of that full name; paths of files that are read begin at ``folder``.

        Raises ValueError when there is no section for it, and for a name without a value or with two.
        """
        if not self.has(node):
            raise ValueError(f"has no section for {node}; it has {self.shown_sections}: name the node that is meant")
        values: dict[str, Any] = {}
        for section, tree in self.sections.items():
            if fits(section, node):
                values = attitude.over(values, given(tree, self.folder))
        return values

    @property
    def shown_sections(self) -> str:
        """The names of all sections, for messages."""
        return schema.shown_name(", ".join(self.sections))


def read(path: str | os.PathLike[str]) -> ParameterFile:
    """Raises OSError when a file cannot be read; ValueError, beginning with its path, when it is no such file."""
    with open(path, encoding="utf-8-sig") as file:
        try:
            text = file.read(MOST_CHARACTERS + 1)
            if len(text) > MOST_CHARACTERS:
                raise ValueError(f"has more than {MOST_CHARACTERS} characters; a parameter file has a few thousand")
            return ParameterFile(os.path.dirname(path), _sections(_document(text)))
        except UnicodeDecodeError as reason:
            found = f"byte {reason.object[reason.start]:#04x} is none"
            raise ValueError(f"{_told(path)}: is no text in UTF-8 ({found}); save it as UTF-8") from None
        except ValueError as reason:
            raise ValueError(f"{_told(path)}: {schema.one_line(reason)}") from None


def of_scene(path: str | os.PathLike[str], node: str) -> dict[str, Any]:
    """Dotted names and values, but for ROS's own, for the node of the full name ``node``.

    Raises OSError when the file cannot be read and ValueError, beginning with its path, when it is no such file or has
    nothing for that node.
    """
    file = read(path)
    try:
        values = file.parameters(f"/{node.strip('/')}")
    except ValueError as reason:
        raise ValueError(f"{_told(path)}: {schema.one_line(reason)}") from None
    return {name: value for name, value in values.items() if not schema.belongs_to_ros(name)}


def _told(path: str | os.PathLike[str]) -> str:
    return schema.shown_name(os.fspath(path))


def value(text: str) -> Any:
    """What a text means as the value of a parameter. Raises ValueError when it is not YAML."""
    return _document(text)


def fits(section: str, node: str) -> bool:
    """Whether the name of a section, with wildcards, is that of the node of this full name."""
    parts = re.split(r"(/\*\*?(?=/|$))", section)
    pattern = "".join({"/**": r"(/\w+)*", "/*": r"/\w+"}.get(part, re.escape(part)) for part in parts)
    return re.fullmatch(pattern, node) is not None


def given(tree: Mapping[Any, Any], folder: str = "") -> dict[str, Any]:
    """Dotted names and values in nested ones; paths of files that are read begin at ``folder``.

    Raises ValueError for a name without a value or with two.
    """
    values = schema.flat(tree)
    for name, value in values.items():
        if value is None:
            raise ValueError(f"parameter {schema.shown_name(name)} has no value; write one, or leave the name out")
        if schema.names_a_file(name) and isinstance(value, str):
            values[name] = beside(value, folder)
    return values


def _sections(document: Any) -> dict[str, Any]:
    if not isinstance(document, Mapping) or not document:
        raise ValueError(f"holds {shown(document) if document else 'nothing'}; {_SHAPE}")
    found: dict[str, Any] = {}
    for name, parameters in _nodes(document, ""):
        if parameters is not None and not isinstance(parameters, Mapping):
            raise ValueError(f"'{PARAMETERS}:' holds {shown(parameters)}; it needs names with values below it")
        if name in found:
            raise ValueError(f"section {schema.shown_name(name)} is given twice; give it once")
        found[name] = parameters or {}
    return found


def _nodes(tree: Mapping[str, Any], above: str) -> Iterator[tuple[str, Any]]:
    """Full names of nodes and what is below their ``ros__parameters``."""
    for key, below in tree.items():
        name = f"{above}/{key.strip('/')}"
        if key == PARAMETERS and above:
            yield above, below
        elif key == PARAMETERS or not isinstance(below, Mapping) or not below:
            raise ValueError(f"{_misplaced(key, above, tree)}; {_SHAPE}")
        else:
            yield from _nodes(below, name)


def _misplaced(key: str, above: str, tree: Mapping[str, Any]) -> str:
    """What is wrong about a name in a section that has no parameters below it."""
    if not above:
        return f"{shown(key)} stands at the top, and {'is empty' if not tree[key] else 'is no section'}"
    if PARAMETERS in tree:
        return f"{shown(key)} stands beside '{PARAMETERS}:', and not below it"
    meant = difflib.get_close_matches(PARAMETERS, [key, *above.split("/")], 1, 0.8)
    hint = f" (did you mean that by {shown(meant[0])}?)" if meant else ""
    return f"{shown(key)} in the section {schema.shown_name(above)} is not below '{PARAMETERS}:'{hint}"


# YAML -----------------------------------------------------------------------------------------------------------------


def _document(text: str) -> Any:
    try:
        return yaml.load(text, Loader=_StrictLoader)
    except yaml.YAMLError as reason:
        raise ValueError(f"is not YAML: {reason}") from None
    except RecursionError:
        raise ValueError("is nested too deeply; parameters are a few levels deep") from None


class _StrictLoader(yaml.SafeLoader):
    """YAML without surprises: no key twice, no aliases, and texts, numbers, truth values, lists and maps alone.

    1e-3 is a number, which PyYAML takes for a text; 2024-01-01 and 1:30 are texts, which it takes for a date and 90.
    Keys are what is written, also where that would be a number or, as no, a truth value.
    """

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            raise ValueError("has an alias (*name); write the value out, as ROS parameter files need")
        return super().compose_node(parent, index)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        if not isinstance(node, yaml.MappingNode):
            return super().construct_mapping(node, deep)  # which refuses it
        lines: dict[str, int] = {}
        values: dict[Any, Any] = {}
        for key, below in node.value:
            name, line = self._name(key), key.start_mark.line + 1
            if name in lines:
                raise ValueError(f"key {shown(name)} is given twice, in lines {lines[name]} and {line}; give it once")
            lines[name], values[name] = line, self.construct_object(below, deep=True)
        return values

    def _name(self, key: yaml.Node) -> str:
        if not isinstance(key, yaml.ScalarNode):
            found = shown(self.construct_object(key, deep=True))
            raise ValueError(f"key {found} is no name; parameters and their groups have names")
        return str(key.value)

    def construct_yaml_int(self, node: yaml.ScalarNode) -> int:
        return _number(self.construct_scalar(node), lambda text: int(text, 8 if _OCTAL.match(text) else 0))

    def construct_yaml_float(self, node: yaml.ScalarNode) -> float:
        return _number(
            self.construct_scalar(node), lambda text: float(text.replace(".inf", "inf").replace(".nan", "nan"))
        )

    def construct_yaml_bool(self, node: yaml.ScalarNode) -> bool:
        text = self.construct_scalar(node)
        if text.lower() not in self.bool_values:
            raise ValueError(f"{shown(text)} is no truth value; write true or false")
        return self.bool_values[text.lower()]


def _number(text: str, convert: Callable[[str], Any]) -> Any:
    try:
        return convert(text.lower())
    except ValueError:
        raise ValueError(f"{shown(text)} cannot be read as a number; write it as 2, 2.0 or 2e-3") from None


_TAG = "tag:yaml.org,2002:"
_OCTAL = re.compile(r"^[-+]?0\d")
_KINDS = ("null", "bool", "int", "float", "str", "seq", "map")
_NUMBERS = {
    "int": re.compile(r"^[-+]?(0[0-7]*|[1-9]\d*|0x[0-9a-fA-F]+)$"),
    "float": re.compile(r"^[-+]?((\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?|\.(inf|Inf|INF))$|^\.(nan|NaN|NAN)$"),
}
_StrictLoader.yaml_constructors = {_TAG + kind: getattr(_StrictLoader, f"construct_yaml_{kind}") for kind in _KINDS} | {
    None: yaml.SafeLoader.construct_undefined
}
_StrictLoader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if tag in (_TAG + "null", _TAG + "bool")]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
for _kind, _pattern in _NUMBERS.items():
    _StrictLoader.add_implicit_resolver(_TAG + _kind, _pattern, list("-+0123456789."))
