"""docs/how-to/adding_an_effect.md: one file and one line, added to a copy of the package, pass the contract and act."""

import math
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

# In a field along z, a dipole along x of a body that turns about y alone is a pendulum: I θ'' = −m B sin θ.
PENDULUM = """
import numpy as np
from rigid_body_sim import Body, Simulation, State
from rigid_body_sim.effects.dipole import Dipole

sim = Simulation(
    Body(1.0, (0.2, 0.5, 0.3)),
    State(angular_velocity=(0.0, 0.01, 0.0), orientation=(np.sqrt(0.5), 0.0, -np.sqrt(0.5), 0.0)),
    rate=100.0, dipole=Dipole((2.0, 0.0, 0.0), (0.0, 0.0, 0.25)),
)
print(sim.plan.integrator, *[s for s in sim.plan.left_out if "magnetic" in s])
for _ in range(700):
    sim.step()
    print(sim.state.angular_velocity[1])
"""


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """A copy of package and tests with the file and the line of the page."""
    folder = tmp_path_factory.mktemp("copy")
    for part in ("rigid_body_sim", "test", "config"):
        shutil.copytree(ROOT / part, folder / part, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", folder)
    page = (ROOT / "docs" / "how-to" / "adding_an_effect.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```python\n# Fragment: rigid_body_sim/effects/dipole.py.*?\n(.*?)```", page, re.DOTALL)
    effects = folder / "rigid_body_sim" / "effects"
    (effects / "dipole.py").write_text(block, encoding="utf-8")
    registry = (effects / "__init__.py").read_text(encoding="utf-8")
    registry = registry.replace("constant_force, ", "constant_force, dipole, ", 1)
    registry = registry.replace("    constant_force.EFFECT,\n", "    constant_force.EFFECT,\n    dipole.EFFECT,\n")
    assert registry.count("dipole") == 2
    (effects / "__init__.py").write_text(registry, encoding="utf-8")
    return folder


def run(folder, *command):
    environment = {**os.environ, "PYTHONPATH": str(folder), "RIGID_BODY_SIM_NO_NUMBA": "1"}
    return subprocess.run(
        [sys.executable, *command], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )


def test_effect_of_the_page_keeps_the_contract(copy):
    done = run(copy, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test/effects/test_contract.py", "-k", "dipole")
    assert done.returncode == 0, done.stdout + done.stderr
    assert int(re.search(r"(\d+) passed", done.stdout)[1]) >= 10


def test_effect_of_the_page_swings_as_a_compass_needle(copy):
    """Small swings about the field at ω = √(m B / I) = 1 rad/s, held to round-off by the series."""
    done = run(copy, "-c", PENDULUM)
    assert done.returncode == 0, done.stderr
    first, *rates = done.stdout.splitlines()
    assert first == "taylor"
    swing = [float(rate) for rate in rates]
    expected = [0.01 * math.cos(math.sqrt(2.0 * 0.25 / 0.5) * 0.01 * (k + 1)) for k in range(len(swing))]
    assert max(abs(a - b) for a, b in zip(swing, expected, strict=True)) < 1e-6  # measured 4.4e-7: (0.01)² / 16 a swing
