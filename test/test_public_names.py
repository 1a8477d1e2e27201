"""What ``import rigid_body_sim`` gives: public names, each imported when it is first used."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import rigid_body_sim

pytestmark = pytest.mark.no_numba

HOMES = rigid_body_sim._HOMES


@pytest.mark.parametrize("name", HOMES)
def test_public_name_is_what_its_home_defines(name):
    found = getattr(rigid_body_sim, name)
    assert (found.__name__, found.__module__) == (name, f"rigid_body_sim.{HOMES[name]}")


def test_star_gives_exactly_the_public_names():
    found = {}
    exec("from rigid_body_sim import *", found)
    assert sorted(found.keys() - {"__builtins__"}) == sorted(HOMES)


def test_type_checkers_see_the_same_names_from_the_same_homes():
    tree = ast.parse(Path(rigid_body_sim.__file__).read_text(encoding="utf-8"))
    (block,) = (node for node in tree.body if isinstance(node, ast.If))
    seen = {each.asname: (each.name, line.module) for line in block.body for each in line.names}
    assert seen == {name: (name, home) for name, home in HOMES.items()}


def test_what_is_no_public_name_is_refused_by_name():
    with pytest.raises(AttributeError, match="'rigid_body_sim' has no attribute 'Planet'"):
        _ = rigid_body_sim.Planet


def test_package_alone_imports_nothing_slow():
    text = (
        "import sys, rigid_body_sim; print(*sorted({'numpy', 'numba', 'rigid_body_sim.simulation'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True).stdout == "\n"
