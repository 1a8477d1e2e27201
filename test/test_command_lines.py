"""Every program answers --help and --version at once, and refuses what it does not know in one sentence."""

import ast
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from rigid_body_sim import __version__

ROOT = Path(__file__).parents[1]
WRONG = {
    "rigid_body_resim": 1,
    "rigid_body_plot": 1,
}  # there 2 means that the motion differs; of all others it is the status
# What takes long, or joins a network, or may not be there: to answer needs none of it.
IMPORTS = "import os, sys\n"
PRELUDE = IMPORTS + "for name in ('rclpy', 'numba', 'matplotlib', 'rosbags', 'tqdm'): sys.modules[name] = None\n"


def programs():
    """Name, module and function of every console script in setup.py."""
    tree = ast.parse((ROOT / "setup.py").read_text(encoding="utf-8"))
    (call,) = (node for node in ast.walk(tree) if isinstance(node, ast.keyword) and node.arg == "entry_points")
    return [
        re.fullmatch(r"(\S+) = (\S+):(\S+)", script).groups()
        for script in ast.literal_eval(call.value)["console_scripts"]
    ]


PROGRAMS = programs()
BENCHMARKS = [
    *((name, f"bench.{name}", "main") for name in ("step_cost", "plan_cost", "env_cost", "readme")),
    ("doc_tables", "bench.doc_tables", "main"),
    ("make bench-node", "bench.node_bench.__main__", "main"),
]
over_all = pytest.mark.parametrize(("name", "module", "function"), PROGRAMS, ids=[name for name, *_ in PROGRAMS])


def run(code, *arguments, cwd=None, prelude=PRELUDE):
    """(exit status, stdout, stderr) of a Python that runs a text with arguments."""
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
    ended = subprocess.run(
        [sys.executable, "-c", prelude + code, *arguments],
        capture_output=True,
        text=True,
        timeout=60,
        cwd=cwd,
        stdin=subprocess.DEVNULL,
        env={**os.environ, "PYTHONPATH": path},
    )
    return ended.returncode, ended.stdout, ended.stderr


def script(module, function):
    """As the console script is."""
    return f"from {module} import {function}\nsys.exit({function}())"


def as_module(module):
    """As ``python -m`` is."""
    return f"import runpy\nrunpy.run_module('{module.removesuffix('.__main__')}', run_name='__main__', alter_sys=True)"


@over_all
def test_help_tells_what_can_be_given(name, module, function):
    status, out, err = run(script(module, function), "--help")
    assert (status, err) == (0, "")
    assert out.startswith(f"usage: {name} ") and "--version" in out and len(out.splitlines()) > 8


@pytest.mark.parametrize(
    ("name", "module", "function"), [*PROGRAMS, *BENCHMARKS], ids=[name for name, *_ in (*PROGRAMS, *BENCHMARKS)]
)
def test_version_is_that_of_the_package(name, module, function):
    assert run(as_module(module), "--version") == (0, f"{name} {__version__}\n", "")


@over_all
def test_what_is_not_known_is_refused(tmp_path, name, module, function):
    status, out, err = run(script(module, function), "--frobnicate", "3", cwd=tmp_path)
    assert (status, out) == (WRONG.get(name, 2), "")
    assert err.count("\n") == 1 and err.startswith(f"{name}: ") and err.endswith("; --help tells what can be given\n")
    assert not any(tmp_path.iterdir())


@over_all
def test_a_working_directory_that_is_gone_is_told_in_one_sentence(tmp_path, name, module, function):
    gone = IMPORTS + "os.rmdir(os.getcwd())\n"
    arguments = ["a_bag"] if name in WRONG else []
    status, out, err = run(script(module, function), *arguments, cwd=tmp_path, prelude=gone)
    assert (status, out, err.count("\n")) == (1, "", 1)
    assert err.startswith(f"{name}: there is no working directory (") and err.endswith("change to one that is there\n")


@pytest.mark.parametrize("name", ["rigid_body_node", "pointing_controller", "actuator_controller"])
def test_node_answers_beside_arguments_of_ros_too(name):
    (module, function) = next(rest for found, *rest in PROGRAMS if found == name)
    ros = ("--ros-args", "-r", "__ns:=/a", "--params-file", "/nowhere.yaml")
    assert run(script(module, function), *ros, "--", "--version")[:2] == (0, f"{name} {__version__}\n")
    status, _, err = run(script(module, function), "scene.yaml", *ros)
    assert status == 2 and "--ros-args --params-file scene.yaml" in err
