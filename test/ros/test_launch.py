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
        if node.get("pkg") != "rviz2":
            assert node.get("pkg") == PACKAGE
            assert node.get("exec") in programs


@pytest.mark.parametrize("file", LAUNCH_FILES, ids=lambda file: file.name)
def test_every_variable_of_a_launch_file_is_an_argument(file):
    root = ElementTree.parse(file).getroot()
    declared = {argument.get("name") for argument in root.iter("arg")}
    used = set(re.findall(r"\$\(var (\w+)\)", file.read_text()))
    assert used == declared | {let.get("name") for let in root.iter("let")}
    assert all(argument.get("description") for argument in root.iter("arg"))


@pytest.mark.parametrize("file", LAUNCH_FILES, ids=lambda file: file.name)
def test_default_scene_exists(file):
    defaults = {a.get("name"): a.get("default") for a in ElementTree.parse(file).getroot().iter("arg")}
    assert defaults["params_file"] == f"$(find-pkg-share {PACKAGE})/config/$(var scene).yaml"
    assert (ROOT / "config" / f"{defaults['scene']}.yaml").is_file()


@pytest.mark.parametrize("file", LAUNCH_FILES, ids=lambda file: file.name)
def test_files_that_a_launch_file_names_are_there(file):
    named = re.findall(rf"\$\(find-pkg-share {PACKAGE}\)/([\w./]+)", file.read_text())
    assert "rviz/rigid_body.rviz" in named
    assert all((ROOT / name).exists() for name in named if "$" not in name)


LAUNCHES = {  # arguments of the launch file, and what each program that starts has among its arguments
    "as it is": ({}, {"rigid_body_node": []}),
    "all": (
        {"controller": "true", "use_view": "true", "view_port": "0", "record": "a bag", "bodies": "[red, blue]"},
        {
            "rigid_body_node": ["-p", "bodies:=[red, blue]", "-p", "record.path:='a bag'"],
            "actuator_controller": ["-p"],
            "rigid_body_view": ["--port", "0"],
        },
    ),
    "rviz": ({"rviz": "true"}, {"rigid_body_node": ["-p", "outputs:=[marker, odom, wrench_applied, tf]"], "rviz2": []}),
}


@pytest.mark.parametrize(("given", "expected"), LAUNCHES.values(), ids=LAUNCHES)
def test_launch_starts_what_its_arguments_say(monkeypatch, tmp_path, given, expected):
    """By the launch packages themselves, which come with a ROS and not from PyPI; nothing is started."""
    launch = pytest.importorskip("launch", reason="launch comes with an installed ROS")
    actions = pytest.importorskip("launch_ros.actions", reason="launch_ros comes with an installed ROS")
    pytest.importorskip("launch_xml", reason="launch_xml comes with an installed ROS")
    from launch.launch_description_sources import AnyLaunchDescriptionSource
    from launch.utilities import perform_substitutions

    index = tmp_path / "share/ament_index/resource_index/packages"
    index.mkdir(parents=True)
    for package in (PACKAGE, "rviz2"):
        (index / package).touch()
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path), prepend=os.pathsep)
    started = {}

    def execute(node, context):
        parts = [node.node_executable, *node._Node__arguments]
        name, *arguments = (
            perform_substitutions(context, part if isinstance(part, list) else [part]) for part in parts
        )
        started[name] = arguments

    monkeypatch.setattr(actions.Node, "execute", execute)
    file = AnyLaunchDescriptionSource(str(LAUNCH_FILES[0]))
    service = launch.LaunchService(argv=[])
    include = launch.actions.IncludeLaunchDescription(file, launch_arguments=given.items())
    service.include_launch_description(launch.LaunchDescription([include]))
    assert service.run() == 0
    assert set(started) == set(expected)
    for program, arguments in expected.items():
        assert [part for part in started[program] if part in arguments] == arguments


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
