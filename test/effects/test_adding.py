"""docs/how-to/adding_an_effect.md: one file and one line, added to a copy of the package, pass the contract and act."""

import math

import pytest

from ..page_copy import copy_with, passed, run

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
    entries = (
        ("constant_force, ", "constant_force, dipole, "),
        ("    constant_force.EFFECT,\n", "    constant_force.EFFECT,\n    dipole.EFFECT,\n"),
    )
    copy_with(folder, "adding_an_effect.md", "rigid_body_sim/effects/dipole.py", entries)
    return folder


def test_effect_of_the_page_keeps_the_contract(copy):
    assert passed(copy, "test/effects/test_contract.py", "dipole") >= 10


def test_effect_of_the_page_swings_as_a_compass_needle(copy):
    """Small swings about the field at ω = √(m B / I) = 1 rad/s, held to round-off by the series."""
    done = run(copy, "-c", PENDULUM)
    assert done.returncode == 0, done.stderr
    first, *rates = done.stdout.splitlines()
    assert first == "taylor"
    swing = [float(rate) for rate in rates]
    expected = [0.01 * math.cos(math.sqrt(2.0 * 0.25 / 0.5) * 0.01 * (k + 1)) for k in range(len(swing))]
    assert max(abs(a - b) for a, b in zip(swing, expected, strict=True)) < 1e-6  # measured 4.4e-7: (0.01)² / 16 a swing
