"""Arrows between the parts of the package point one way only; ROS, numba and gymnasium stay where they belong."""

import ast
import re
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

pytestmark = pytest.mark.no_numba

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "rigid_body_sim"
PHYSICS = {"kernels", "values", "mass", "effects", "terms", "theory"}
CORE = {
    *PHYSICS,
    "sensors",
    "integrators",
    "scene",
    "held",
    "actuation",
    "rate",
    "snapshot",
    "stepping",
    "runs",
    "simulation",
}
MANY = {"many_bodies", "groups", "simulation"}
ALLOWED = {  # a part, and the other parts of the package that it may import
    "command_line": set(),
    "messages": set(),
    "kernels": set(),
    "values": {"kernels"},
    "mass": {"kernels", "values"},
    "effects": {"kernels", "values"},
    "terms": {"kernels", "values", "effects"},
    "theory": {"kernels", "values", "effects", "terms"},
    "integrators": {"kernels", "effects", "terms", "values"},
    "sensors": {"kernels", "values"},
    "scene": PHYSICS - {"theory"} | {"sensors"},
    "held": {"values"},
    "actuation": {"kernels", "values", "effects"},
    "rate": set(),
    "snapshot": {"values"},
    "sentences": {"kernels", "values", "terms", "integrators", "scene"},
    "stepping": {"kernels", "values", "terms", "integrators", "scene"},
    "fleet_steps": {"kernels", "integrators", "terms", "simulation", "groups"},
    "fleet_links": {"kernels", "effects", "integrators", "simulation", "fleet_steps"},
    "fleet": {"effects", "fleet_links", "rate", "scene", "simulation", "snapshot", "fleet_steps"},
    "bags": {"kernels", "values", "messages", "scene"},
    "commands": {"values", "scene"},
    "scenarios": {"kernels", "values", "integrators", "scene", "held", "commands", "bags"},
    "view": {"kernels", "values", "effects", "terms", "scene"},
    "runs": {
        *("kernels", "values", "terms", "theory", "sensors", "integrators", "scene", "rate"),
        *("bags", "scenarios", "view"),
    },
    "simulation": {
        *PHYSICS,
        "sensors",
        "integrators",
        "scene",
        "held",
        "rate",
        "snapshot",
        "sentences",
        "stepping",
        "runs",
        "actuation",
    },
    "many_bodies": {"kernels", "values", "terms"},
    "groups": {"kernels", "values", "terms", "integrators", "scene", "stepping", "many_bodies"},
    "ensemble": {
        *PHYSICS,
        "sensors",
        "actuation",
        "integrators",
        "scene",
        "rate",
        "snapshot",
        "sentences",
        "stepping",
        "runs",
        *MANY,
    },
    "envs": {"kernels", "values", "runs", "ensemble"},
    "first_start": {*CORE, "groups", "fleet_links"},
    "resim": {*CORE, "fleet", "commands", "bags", "scenarios", "ensemble"},
    "ros": {*CORE, "fleet", "first_start", "commands", "messages", "bags", "resim", "command_line"},
    "report": {*CORE, "ensemble", "command_line"},
    "tools": {
        *CORE,
        "first_start",
        "ros",
        "commands",
        "messages",
        "bags",
        "scenarios",
        "resim",
        "view",
        "command_line",
    },
    "": {*CORE, "ensemble", "fleet"},  # the package's own __init__
}
WITH_ROS = {"ros", "tools"}
ROS_PACKAGES = {
    "rclpy",
    "rosgraph_msgs",
    "rcl_interfaces",
    "builtin_interfaces",
    "simulation_interfaces",
    "ament_index_python",
}
NUMBA_HOMES = tuple(
    f"kernels.{name}" for name in ("compiled", "kernel_cache", "lock", "quick_compiling", "straight_line")
)
NOT_INSTALLED = {"bench", "test"}
FOR_ALL = "rigid_body_sim.__version__"  # stands at the very top, and imports nothing


def imports_of(text, module):
    """Absolute names of all modules that a module's text imports, wherever in the text it does so.

    ``module`` is its dotted name; a package's is that of its ``__init__``: "rigid_body_sim.values.__init__".
    """
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = module.split(".")[: -node.level] if node.level else []
            base = ".".join([*above, *([node.module] if node.module else [])])
            yield from (f"{base}.{alias.name}" for alias in node.names)


def part_of(name):
    """The part of the package to which a dotted name belongs; "" for the package itself, None for anything outside."""
    root, *rest = name.split(".")
    if root != "rigid_body_sim":
        return None
    return rest[0] if rest and rest[0] in ALLOWED else ""


def is_ros(name):
    root = name.split(".")[0]
    return root in ROS_PACKAGES or root.endswith(("_msgs", "_srvs")) or root.startswith("rcl")


def complaints(text, module):
    """What is wrong with a module's imports, one sentence each."""
    home = part_of(module)
    for name in imports_of(text, module):
        target = None if name == FOR_ALL else part_of(name)
        if target is not None and target != home and target not in ALLOWED[home]:
            yield f"{module} imports {name}: {home or 'the package'} must not know {target or 'the whole package'}"
        if name.split(".")[0] in NOT_INSTALLED:
            yield f"{module} imports {name}: {name.split('.')[0]} is not installed with the package"
        if is_ros(name) and home not in WITH_ROS:
            yield f"{module} imports {name}: only ros and tools may use ROS"
        if name.split(".")[0] == "numba" and module.removeprefix("rigid_body_sim.") not in NUMBA_HOMES:
            yield f"{module} imports {name}: only {' and '.join(NUMBA_HOMES)} may use numba"
        if name.split(".")[0] == "viser" and home != "view":
            yield f"{module} imports {name}: only view may use viser"
        if name.split(".")[0] == "gymnasium" and home != "envs":
            yield f"{module} imports {name}: only envs may use gymnasium"


MODULES = {".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts): path for path in PACKAGE.rglob("*.py")}


@pytest.mark.parametrize("module", sorted(MODULES))
def test_imports_follow_the_arrows(module):
    assert list(complaints(MODULES[module].read_text(encoding="utf-8"), module)) == []


def test_modules_are_found():
    assert {"rigid_body_sim.__init__", "rigid_body_sim.kernels.state", "rigid_body_sim.ros.node"} <= set(MODULES)


def test_every_folder_of_the_package_has_its_place():
    parts = {path.name for path in PACKAGE.iterdir() if (path / "__init__.py").exists()}
    parts |= {path.stem for path in PACKAGE.glob("*.py") if path.stem != "__init__"}
    assert parts <= set(ALLOWED)


def test_arrows_have_no_circle():
    list(TopologicalSorter(ALLOWED).static_order())  # raises CycleError, with the circle


def modules_used(texts):
    """By module, the others among ``texts`` that it imports, wherever in its text; a package is its ``__init__``."""
    known = {module.removesuffix(".__init__") for module in texts}
    used = {}
    for module, text in texts.items():
        names = [name for name in imports_of(text, module) if name != FOR_ALL]
        found = {name if name in known else name.rpartition(".")[0] for name in names}
        used[module.removesuffix(".__init__")] = found & known
    return used


def test_modules_have_no_circle():
    """Not even by imports inside functions."""
    used = modules_used({module: path.read_text("utf-8") for module, path in MODULES.items()})
    assert "rigid_body_sim.tools.resim" in used["rigid_body_sim.tools.resim_main"]  # which imports it in a function
    list(TopologicalSorter(used).static_order())  # raises CycleError, with the circle


@pytest.mark.parametrize("late", ["from . import a", "def f():\n    from .a import INTERRUPTED", "from . import get"])
def test_a_circle_is_noticed(late):
    texts = {"p.__init__": "from . import a", "p.a": "from . import b", "p.b": "import p.c", "p.c": late}
    with pytest.raises(CycleError) as circle:
        list(TopologicalSorter(modules_used(texts)).static_order())
    assert {"p.a", "p.b", "p.c"} <= set(circle.value.args[1])


@pytest.mark.parametrize("path", sorted(ROOT.glob("bench/**/*.py")), ids=lambda path: path.stem)
def test_bench_needs_no_test(path):
    module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
    assert not [name for name in imports_of(path.read_text("utf-8"), module) if name.split(".")[0] == "test"]


def test_only_where_peers_are_found_is_bench_named():
    named = {module for module, path in MODULES.items() if re.search(r"[\"']bench\b", path.read_text("utf-8"))}
    assert named == {"rigid_body_sim.report.peers"}


BAD = {  # a module, its text, and what is said about it
    "upwards": ("values.body", "from ..simulation import Simulation", "values must not know simulation"),
    "upwards by name": ("values.body", "from .. import scene", "values must not know scene"),
    "absolute": ("integrators.rk4", "import rigid_body_sim.scene.loader", "integrators must not know scene"),
    "sideways": ("scene.loader", "from ..integrators import get", "scene must not know integrators"),
    "whole package": ("values.body", "from .. import Body", "values must not know the whole package"),
    "from an __init__": ("values.__init__", "from ..ros import node", "values must not know ros"),
    "package itself": ("__init__", "from .tools import demo", "the package must not know tools"),
    "report and ROS side": ("report.page", "from ..ros import pacing", "report must not know ros"),
    "late": (
        "scene.loader",
        "def f():\n    if True:\n        from ..simulation import Simulation",
        "must not know simulation",
    ),
    "bench": ("report.main", "def f():\n    from bench import peers", "bench is not installed"),
    "bench by a path": ("report.peers", "import bench.peers.jax_peer", "bench is not installed"),
    "rclpy below": ("simulation", "import rclpy", "only ros and tools may use ROS"),
    "messages below": (
        "simulation",
        "def f():\n    from geometry_msgs.msg import Pose",
        "only ros and tools may use ROS",
    ),
    "services in the report": ("report.page", "import std_srvs.srv as s", "only ros and tools may use ROS"),
    "numba elsewhere": (
        "integrators.taylor",
        "from numba import njit",
        "only kernels.compiled and kernels.kernel_cache and kernels.lock and kernels.quick_compiling and "
        "kernels.straight_line may use numba",
    ),
    "viser elsewhere": ("tools.view", "def f():\n    import viser", "only view may use viser"),
    "gymnasium elsewhere": ("runs.running", "from gymnasium import spaces", "only envs may use gymnasium"),
}


@pytest.mark.parametrize(("module", "text", "said"), BAD.values(), ids=BAD)
def test_import_in_the_wrong_direction_is_noticed(module, text, said):
    found = list(complaints(text, f"rigid_body_sim.{module}"))
    assert len(found) == 1
    assert said in found[0]


@pytest.mark.parametrize(
    ("module", "text"),
    [
        ("integrators.rk4", "from ..kernels.state import X\nfrom .base import Integrator\nimport math"),
        ("simulation", "from . import integrators\nfrom .kernels import compiled\nfrom .scene.loader import Scene"),
        ("ros.node", "import rclpy\nfrom geometry_msgs.msg import Pose\nfrom ..simulation import Simulation"),
        ("tools.demo", "from ..ros import pacing\nfrom rclpy.node import Node\nfrom . import findings"),
        ("kernels.compiled", "import numba"),
        ("values.__init__", "from . import body"),
    ],
)
def test_import_in_the_right_direction_is_let_through(module, text):
    assert list(complaints(text, f"rigid_body_sim.{module}")) == []
