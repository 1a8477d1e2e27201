"""Without numba the same kernels run as plain Python and give the same bits.

Run as a script, this file prints the final states that it computes, in hexadecimal.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from rigid_body_sim import Body, Simulation, State, Wrench
from rigid_body_sim.integrators import REGISTRY
from rigid_body_sim.kernels import compiled

ROOT = Path(__file__).parents[1]
BODY = Body(2.5, (0.31, 0.42, 0.53, -0.04, 0.06, 0.03), (0.07, -0.04, 0.05))
POINTS = [((0.4, 0.0, 0.1), (0.2, -0.4, 0.3)), ((-0.2, 0.3, 0.0), (0.4, 0.1, -0.2))]
WRENCHES = {
    "none": Wrench(),
    "body": Wrench(force_body=(0.9, -0.4, 1.3), torque_body=(0.06, 0.04, -0.08)),
    "world": Wrench(force_world=(-0.8, 1.7, 12.1), torque_world=(-0.07, 0.1, 0.05)),
    "force": Wrench(force_world=(-0.8, 1.7, 12.1)),
    "one point": Wrench(points=POINTS[:1]),
    "everything": Wrench((0.9, -0.4, 1.3), (0.06, 0.04, -0.08), (-0.8, 1.7, 12.1), (-0.07, 0.1, 0.05), POINTS),
}
SPINS = {"at rest": (0.0, 0.0, 0.0), "slow": (1.1, -2.0, 0.7), "sub-steps": (18.0, 28.0, -22.0)}


def final_states():
    """Flat state and state read out after some steps of 20 ms, in hexadecimal, by integrator, wrench and spin."""
    found = {}
    for integrator in REGISTRY:
        for held, wrench in WRENCHES.items():
            if REGISTRY[integrator].refusal(wrench):
                continue
            for name, spin in SPINS.items():
                state = State((1.0, 2.0, 3.0), (0.4, 0.2, -0.8, 0.4), (-0.5, 0.2, 1.0), spin)
                sim = Simulation(BODY, state, rate=50.0, gravity=(0.0, 0.0, -9.81), integrator=integrator)
                sim.set_wrench(wrench)
                sim.step(8)
                numbers = [*sim.save().state, *sim.state.values.tolist(), *sim.pose]
                found[f"{integrator}, {held}, {name}"] = [number.hex() for number in numbers]
    return found


def run_elsewhere(*arguments, **environment):
    """What another Python process prints that finds the package as this one does."""
    given = {**os.environ, "PYTHONPATH": str(ROOT), **environment}
    done = subprocess.run([sys.executable, *arguments], env=given, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.skipif(not compiled.ENABLED, reason="compares with the compiled kernels")
def test_plain_python_gives_the_bits_of_the_compiled_kernels():
    plain = json.loads(run_elsewhere(__file__, RIGID_BODY_SIM_NO_NUMBA="1"))
    assert plain.pop("compiled") is False
    assert plain == final_states()


def test_package_works_where_numba_is_not_installed():
    """numba is hidden from the import system, as if it were not there."""
    script = (
        "import sys; sys.modules['numba'] = None\n"
        "import rigid_body_sim as r\n"
        "sim = r.Simulation(r.Body(1.0, (0.1, 0.2, 0.25)), r.State(angular_velocity=(1.0, 2.0, 3.0)))\n"
        "sim.step(3)\n"
        "print(sim.describe())"
    )
    assert "plain Python: numba is not in use" in run_elsewhere("-c", script, RIGID_BODY_SIM_NO_NUMBA="")


@pytest.mark.no_numba
def test_kernels_are_plain_functions_when_numba_is_switched_off():
    switched_off = bool(os.environ.get("RIGID_BODY_SIM_NO_NUMBA"))
    assert not (switched_off and compiled.ENABLED)
    if not compiled.ENABLED:
        assert not hasattr(REGISTRY["taylor"].step, "_numba_type_")
        assert compiled.Request(REGISTRY["taylor"].step, ()).is_met and compiled.compilations() == {}


@pytest.mark.no_numba
def test_description_says_when_numba_is_not_in_use():
    assert ("plain Python" in Simulation(BODY).describe()) == (not compiled.ENABLED)


if __name__ == "__main__":
    print(json.dumps({"compiled": compiled.ENABLED, **final_states()}))
