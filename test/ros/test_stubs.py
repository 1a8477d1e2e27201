"""stubs/rclpy, by which mypy judges ros/, says nothing that the installed rclpy does not have."""

import ast
import enum
import importlib
import inspect
from pathlib import Path

import pytest

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros

STUBS = Path(__file__).parents[2] / "stubs"
FILES = sorted(STUBS.rglob("*.pyi"))


def module_of(path):
    parts = path.relative_to(STUBS).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def complaints(tree, real, name):
    """What ``tree``, the stub of ``real``, has that it has not, one sentence each."""
    for stub in tree.body:
        if isinstance(stub, ast.ClassDef | ast.FunctionDef) and stub.name != "__init__" and not has(real, stub.name):
            yield f"{name} has no {stub.name}"
        elif isinstance(stub, ast.ClassDef):
            yield from complaints(stub, getattr(real, stub.name), f"{name}.{stub.name}")
        elif isinstance(stub, ast.FunctionDef) and not stub.decorator_list:
            yield from missing_arguments(stub, getattr(real, stub.name), f"{name}.{stub.name}")
        elif isinstance(stub, ast.Assign | ast.AnnAssign):
            target = stub.target if isinstance(stub, ast.AnnAssign) else stub.targets[0]
            if not has(real, target.id):
                yield f"{name} has no {target.id}"


def has(real, attribute):
    """Whether there is such a thing in a module or a class, or an object of the class gets it when it is made."""
    if hasattr(real, attribute):
        return True
    if not inspect.isclass(real) or issubclass(real, enum.Enum):
        return False
    return any(f"self.{attribute}" in inspect.getsource(kind) for kind in real.__mro__ if is_python(kind))


def is_python(kind):
    try:
        return bool(inspect.getsource(kind))
    except (OSError, TypeError):
        return False


def missing_arguments(stub, real, name):
    try:
        taken = inspect.signature(real).parameters
    except ValueError:  # of C++, which does not tell
        return
    if any(each.kind is each.VAR_KEYWORD for each in taken.values()):
        return
    for argument in (*stub.args.args, *stub.args.kwonlyargs):
        if argument.arg not in taken:
            yield f"{name} takes no {argument.arg}"
        elif argument in stub.args.args and taken[argument.arg].kind is inspect.Parameter.KEYWORD_ONLY:
            yield f"{name} takes {argument.arg} by name alone"


@pytest.mark.parametrize("path", FILES, ids=module_of)
def test_stub_says_what_is_there(path):
    module = module_of(path)
    assert list(complaints(ast.parse(path.read_text(encoding="utf-8")), importlib.import_module(module), module)) == []


def test_stubs_are_found():
    assert {"rclpy", "rclpy.node", "rclpy.qos"} <= set(map(module_of, FILES))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("class Knot: ...", "has no Knot"),
        ("class Node:\n    def knot(self) -> None: ...", "has no knot"),
        ("class Node:\n    knot: int", "has no knot"),
        ("class Node:\n    def get_parameter(self, knot: str) -> None: ...", "get_parameter takes no knot"),
        ("class Node:\n    def resolve_topic_name(self, topic: str, only_expand: bool) -> str: ...", "by name alone"),
    ],
)
def test_what_is_not_there_is_noticed(text, said):
    (found,) = complaints(ast.parse(text), importlib.import_module("rclpy.node"), "rclpy.node")
    assert said in found
