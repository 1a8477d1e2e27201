"""The benchmarks that asv runs measure what they say; asv itself is not needed for that."""

import math
import subprocess
import sys
from importlib.util import find_spec, module_from_spec, spec_from_file_location
from pathlib import Path

import numpy as np
import pytest

from rigid_body_sim.report.problems import problem

BENCHMARKS = Path(__file__).parents[1] / "bench" / "asv" / "benchmarks"


def load(name):
    spec = spec_from_file_location(name, BENCHMARKS / f"{name}.py")
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


steps, start = load("steps"), load("start")


@pytest.mark.parametrize("plan", steps.PLANS)
@pytest.mark.parametrize("measured", ["time_1000_steps", "time_1000_calls"])
def test_steps_of_a_plan_begin_at_the_same_state_and_take_a_second(plan, measured):
    """``setup`` has taken them once before, and raises where the plan has another integrator than it is named for."""
    benchmark, (body, state, *_) = steps.Step(), steps.PLANS[plan]
    benchmark.setup(plan)
    assert benchmark.simulation.steps == 0 and benchmark.simulation.body.mass == body.mass
    assert benchmark.simulation.state.angular_velocity == pytest.approx(state.angular_velocity, rel=1e-15)
    getattr(benchmark, measured)(plan)
    assert benchmark.simulation.time == pytest.approx(1.0, rel=1e-15)
    assert math.hypot(*benchmark.simulation.state.orientation) == pytest.approx(1.0, abs=1e-15)


def test_a_plan_with_another_integrator_is_told(monkeypatch):
    monkeypatch.setitem(steps.PLANS, "torque-free", (*steps.PLANS["torque-free"][:-1], "taylor"))
    with pytest.raises(AssertionError, match="the plan of 'torque-free' takes exact, not taylor"):
        steps.Step().setup("torque-free")


def test_the_error_is_that_of_a_problem_of_the_report(monkeypatch):
    top = problem("asymmetric_top")
    assert tuple(top.end["orientation"].astype(float)) == steps.TRUE
    assert np.array_equal(steps.ASYMMETRIC.inertia, top.body.inertia) and top.wrenches[0] == steps.WEIGHT_AT_A_POINT
    assert steps.Error().track_attitude() < 1e-13  # rad; measured 1.8e-14
    q = np.array(steps.TRUE)
    w, x, y, z = math.cos(0.005), 0.0, math.sin(0.005), 0.0
    turned = (
        q[0] * w - q[1] * x - q[2] * y - q[3] * z,
        q[0] * x + q[1] * w + q[2] * z - q[3] * y,
        q[0] * y - q[1] * z + q[2] * w + q[3] * x,
        q[0] * z + q[1] * y - q[2] * x + q[3] * w,
    )
    monkeypatch.setattr(steps, "TRUE", turned)
    assert steps.Error().track_attitude() == pytest.approx(0.01, rel=1e-11)  # measured 0.01 to 2e-12


@pytest.mark.skipif(find_spec("trimesh") is None, reason="trimesh is not installed")
def test_the_mesh_is_a_ball():
    benchmark = start.MeshRead()
    benchmark.setup()
    try:
        benchmark.time_mesh_of_20480_triangles()
    finally:
        benchmark.teardown()
    ball = 2 / 5 * 2.0 * 1.0**2
    assert benchmark.scene["body.inertia"][:3] == pytest.approx([ball] * 3, rel=1e-3)  # measured 3.6e-4
    assert not benchmark.file.exists()


def test_the_import_runs_in_a_python_of_its_own():
    subprocess.run([sys.executable, "-c", start.timeraw_import()], check=True, timeout=120)
