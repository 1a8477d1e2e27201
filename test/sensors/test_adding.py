"""docs/how-to/adding_a_sensor.md: one file and one line, added to a copy of the package, keep the contract."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TURNING = """
from rigid_body_sim import Body, Scene, Simulation

scene = Scene({"sensors.air.type": "airspeed", "sensors.air.position": [0.0, -0.5, 0.0],
               "initial.linear_velocity": [3.0, 0.0, 0.0], "initial.angular_velocity": [0.0, 0.0, 2.0]})
print(*Simulation.from_scene(scene).sense("air"))
"""


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """A copy of package and tests with the file and the line of the page."""
    folder = tmp_path_factory.mktemp("copy")
    for part in ("rigid_body_sim", "test"):
        shutil.copytree(ROOT / part, folder / part, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", folder)
    page = (ROOT / "docs" / "how-to" / "adding_a_sensor.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```python\n# Fragment: rigid_body_sim/sensors/airspeed.py.*?\n(.*?)```", page, re.DOTALL)
    sensors = folder / "rigid_body_sim" / "sensors"
    (sensors / "airspeed.py").write_text(block, encoding="utf-8")
    registry = (sensors / "__init__.py").read_text(encoding="utf-8")
    registry = registry.replace("import barometer,", "import airspeed, barometer,")
    registry = registry.replace("pose.TYPE)", "pose.TYPE, airspeed.TYPE)")
    assert registry.count("airspeed") == 2
    (sensors / "__init__.py").write_text(registry, encoding="utf-8")
    return folder


def run(folder, *command):
    environment = {**os.environ, "RIGID_BODY_SIM_NO_NUMBA": "1"}
    environment["PYTHONPATH"] = os.pathsep.join(filter(None, [str(folder), os.environ.get("PYTHONPATH")]))
    return subprocess.run(
        [sys.executable, *command], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )


def test_sensor_of_the_page_keeps_the_contract(copy):
    done = run(copy, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test/sensors/test_contract.py", "-k", "airspeed")
    assert done.returncode == 0, done.stdout + done.stderr
    assert int(re.search(r"(\d+) passed", done.stdout)[1]) >= 8


def test_sensor_of_the_page_measures_where_it_is(copy):
    """3 m/s forwards, and half a metre to the right of an axis that turns by 2 rad/s."""
    done = run(copy, "-c", TURNING)
    assert done.stdout == "4.0\n", done.stderr
