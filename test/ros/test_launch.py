"""The launch file and the wrappers fit what is installed. No ROS in here."""

import ast
import os
import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LAUNCH_FILES = sorted((ROOT / "launch").glob("*.xml"))
WRAPPERS = sorted((ROOT / "wrappers").iterdir())
PACKAGE = "rigid_body_sim"


@pytest.fixture(scope="module")
def programs():
    """Name and target of every console script in setup.py."""
    call = next(
        node
        for node in ast.walk(ast.parse((ROOT / "setup.py").read_text()))
        if isinstance(node, ast.keyword) and node.arg == "entry_points"
    )
    return dict(re.split(r"\s*=\s*", script) for script in ast.literal_eval(call.value)["console_scripts"])


def test_there_are_launch_files_and_wrappers():
    assert LAUNCH_FILES and WRAPPERS


@pytest.mark.parametrize("file", LAUNCH_FILES, ids=lambda file: file.name)
def test_launch_file_names_an_installed_program(file, programs):
    nodes = list(ElementTree.parse(file).getroot().iter("node"))
    assert nodes
    for node in nodes:
        assert node.get("pkg") == PACKAGE
        assert node.get("exec") in programs


@pytest.mark.parametrize("file", LAUNCH_FILES, ids=lambda file: file.name)
def test_every_variable_of_a_launch_file_is_an_argument(file):
    root = ElementTree.parse(file).getroot()
    declared = {argument.get("name") for argument in root.iter("arg")}
    used = set(re.findall(r"\$\(var (\w+)\)", file.read_text()))
    assert used == declared
    assert all(argument.get("description") for argument in root.iter("arg"))


@pytest.mark.parametrize("file", LAUNCH_FILES, ids=lambda file: file.name)
def test_default_scene_exists(file):
    defaults = {a.get("name"): a.get("default") for a in ElementTree.parse(file).getroot().iter("arg")}
    assert defaults["params_file"] == f"$(find-pkg-share {PACKAGE})/config/$(var scene).yaml"
    assert (ROOT / "config" / f"{defaults['scene']}.yaml").is_file()


def test_every_program_has_a_wrapper_and_every_wrapper_a_program(programs):
    assert {file.name for file in WRAPPERS} == set(programs)


@pytest.mark.parametrize("file", WRAPPERS, ids=lambda file: file.name)
def test_wrapper_is_an_executable_script(file):
    assert os.access(file, os.X_OK)
    assert file.read_text().startswith("#!")


def test_every_program_can_be_found(programs):
    """Module and function exist, by their text: importing some of them needs rclpy."""
    for target in programs.values():
        module, function = target.split(":")
        source = ROOT.joinpath(*module.split(".")).with_suffix(".py")
        assert source.is_file(), target
        functions = [node.name for node in ast.parse(source.read_text()).body if isinstance(node, ast.FunctionDef)]
        assert function in functions, target
