"""The files by which the package is installed name what is there."""

import ast
import re
import sys

import pytest

from .doc_pages import ROOT
from .test_command_lines import PROGRAMS


def extras():
    tree = ast.parse((ROOT / "setup.py").read_text(encoding="utf-8"))
    (found,) = (node.value for node in ast.walk(tree) if isinstance(node, ast.keyword) and node.arg == "extras_require")
    return {key.value for key in found.keys}


def test_image_installs_what_it_copies():
    """.dockerignore leaves away all that it does not name: the build needs what setup.py reads."""
    kept = {line[1:] for line in (ROOT / ".dockerignore").read_text("utf-8").splitlines() if line.startswith("!")}
    read = set(re.findall(r'glob\("(\w+)/', (ROOT / "setup.py").read_text("utf-8")))
    assert (
        read and read | {"rigid_body_sim", "resource", "README.md", "setup.py", "setup.cfg", "pyproject.toml"} <= kept
    )
    assert all((ROOT / name).exists() for name in kept)


def test_image_names_extras_that_there_are():
    text = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    (names,) = re.findall(r'"/src\[(.*)\]"', text)
    for ros in ("jazzy", "kilted"):
        assert set(names.replace("${ROS}", ros).split(",")) <= extras()
    (program,) = re.findall(r'^ENTRYPOINT \["(.*)"\]$', text, re.M)
    assert program in {name for name, *_ in PROGRAMS}


@pytest.mark.skipif(sys.version_info < (3, 11), reason="tomllib comes with Python 3.11")
def test_pixi_names_extras_and_programs_that_there_are():
    import tomllib

    pixi = tomllib.loads((ROOT / "pixi.toml").read_text(encoding="utf-8"))
    assert set(pixi["tasks"].values()) <= {name for name, *_ in PROGRAMS}
    assert {name for features in pixi["environments"].values() for name in features} == set(pixi["feature"])
    for feature in pixi["feature"].values():
        ours = feature["pypi-dependencies"]["rigid_body_sim"]
        assert set(ours["extras"]) <= extras() and (ROOT / ours["path"] / "setup.py").exists()


def test_sdist_has_every_folder_that_the_tests_need():
    text = (ROOT / "MANIFEST.in").read_text(encoding="utf-8")
    named = re.findall(r"^(?:graft|include) (.*)$", text, re.M)
    assert all((ROOT / name).exists() for line in named for name in line.split())
    assert {"test", "bench", "docs", "stubs"} <= set(re.findall(r"^graft (\S+)$", text, re.M))
