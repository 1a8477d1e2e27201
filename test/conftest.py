"""What several test files share: the reference solutions, loaded by path because the folder is no package."""

import importlib.util
import json
from pathlib import Path
from types import ModuleType

import pytest
from hypothesis import settings

# The first call of a kernel compiles it, and a tolerance must hold for the same examples everywhere.
settings.register_profile("rigid_body_sim", deadline=None, derandomize=True)
settings.load_profile("rigid_body_sim")

REFERENCE = Path(__file__).with_name("reference")


def _module(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"reference_{name}", REFERENCE / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


_LOADER = _module("load")


@pytest.fixture(scope="module", params=_LOADER.names())
def problem_name(request) -> str:
    """The name of each reference problem in turn."""
    return request.param


@pytest.fixture(scope="module")
def load_problem():
    """A function: reference problem by name, with floats and arrays."""
    return _LOADER.load


@pytest.fixture(scope="module")
def printed_digits():
    """A function: reference problem by name, with its numbers as the decimal strings of 35 digits in the file."""
    problems = json.loads(_LOADER.FILE.read_text(encoding="utf-8"))["problems"]
    return problems.__getitem__


@pytest.fixture(scope="module")
def make_reference() -> ModuleType:
    """The script that makes the reference solutions."""
    return _module("make_reference")
