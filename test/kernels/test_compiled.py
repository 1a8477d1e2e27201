"""Where compiled kernels are kept."""

import importlib
import inspect
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from rigid_body_sim.kernels import compiled, kernel_cache, vectors

pytest.importorskip("numba")

PACKAGE = Path(compiled.__file__).parents[1]


def test_another_installation_has_a_cache_of_its_own(tmp_path):
    """numba finds only what was compiled from the same path, so what the other has compiled must not count."""
    for folder in ("kernels", "effects", "integrators"):
        shutil.copytree(PACKAGE / folder, tmp_path / "rigid_body_sim" / folder)
    (tmp_path / "rigid_body_sim" / "__init__.py").touch()
    script = "from rigid_body_sim.kernels import compiled as c; print(c.sources_digest(), c.FOLDER)"
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    other = subprocess.run(
        [sys.executable, "-c", script], env=environment, cwd=tmp_path, capture_output=True, text=True, check=True
    )
    digest, folder = other.stdout.split(maxsplit=1)
    assert digest == compiled.sources_digest()
    assert digest in folder and Path(folder.strip()) != compiled.FOLDER


PLANS = """
import importlib
import inspect
import json
import sys
from rigid_body_sim import Body, Drag, Simulation, Tether, Wrench, integrators
from rigid_body_sim.kernels import compiled, kernel_cache, vectors

BODY = Body(mass=1.0, inertia=(1.0, 1.0, 1.0))
chosen = sys.argv[1:] or integrators.REGISTRY
for name in chosen:
    Simulation(BODY, integrator=name).step(3)
for scene in ({"drag": Drag(linear=(1e5, 1.0, 1.0))}, {"tethers": [Tether(stiffness=10.0)]}):
    simulation = Simulation(BODY, **scene)
    simulation.set_wrench(Wrench(torque_body=(1.0, 0.0, 0.0)))
    simulation.step(3)
    simulation.state, simulation.pose, simulation.motion, simulation.acceleration
    simulation.apply_impulse(Wrench())
print(json.dumps([compiled.compilations(), str(compiled.FOLDER)]))
"""


@pytest.fixture(scope="module", params=[("exact", "rk4"), pytest.param((), id="all", marks=pytest.mark.nightly)])
def plans(tmp_path_factory, request):
    """Compilations of each kernel in two processes, one after the other, with a new cache; and its folder."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path_factory.mktemp("cache"))}

    def run():
        command = [sys.executable, "-c", PLANS, *request.param]
        return json.loads(subprocess.run(command, env=environment, capture_output=True, check=True).stdout)

    (first, folder), (second, _) = run(), run()
    return first, second, Path(folder)


def test_a_kernel_is_compiled_once(plans):
    """For each types of arguments: a number that stands in a call, as the axis in add_compensated, makes no other."""
    counts, _, _ = plans
    assert len(counts) > 100  # measured 133
    assert [name for name, count in counts.items() if count != 1 and not takes_kernels(name)] == []


def takes_kernels(name):
    """Whether a kernel has others as arguments: it is compiled once for each of those."""
    module, _, function = name.rpartition(".")
    kernel = getattr(importlib.import_module(module), function, None) if "<" not in name else None
    return kernel is not None and bool({"acting", "step"} & set(inspect.signature(kernel).parameters))


def test_another_process_compiles_nothing(plans):
    _, counts, _ = plans
    assert counts == {}


def test_only_what_python_calls_has_a_file(plans):
    """Measured 17, of 1.9 MB together; with a file for each kernel there were 265, of 8 MB."""
    _, _, folder = plans
    files = list(folder.glob("*.nbc"))
    assert len(files) < 40
    assert sum(file.stat().st_size for file in files) < 4e6


def test_kernel_called_from_python_is_plain_python():
    """What numba makes of it has no wrapper: a call from Python that reached it would end the process."""
    assert type(vectors.cross).__name__ == "function"
    assert vectors.cross(1, 0, 0, 0, 1, 0) == (0, 0, 1) and type(vectors.cross(1, 0, 0, 0, 1, 0)[2]) is int


def doubled(step):
    def run(x):
        return step(step(x))

    return run


def half(x):
    return 0.5 * x


def test_closures_are_told_apart_by_what_they_are_made_over():
    """Their names, lines and code are the same: without that the cache would give one for the other."""
    first, again, other = doubled(compiled.kernel(half)), doubled(half), doubled(vectors.cross)
    assert kernel_cache.identity(first) == kernel_cache.identity(again) != kernel_cache.identity(other)
    assert compiled.ready(first, 1.0)(8.0) == 2.0


QUICK = """
import contextlib, sys
from numba.core import codegen, types
from rigid_body_sim.kernels import compiled
of_numba = types.BaseFunction.get_call_type, codegen.CPUCodeLibrary._optimize_final_module
if sys.argv[1] == "slow":
    compiled.quick_compiling = contextlib.nullcontext
from rigid_body_sim import Body, Drag, Simulation, State, Wrench
drags = {"taylor": Drag(), "rk4": Drag(linear=(1.0, 2.0, 3.0), quadratic=(0.1, 0.2, 0.3))}
for method in sys.argv[2:]:
    body, state = Body(1.0, (0.1, 0.2, 0.25)), State(angular_velocity=(1.0, 2.0, 3.0))
    sim = Simulation(body, state, integrator=method, drag=drags[method])
    sim.set_wrench(Wrench((1.0, 2.0, 3.0), (0.1, 0.2, 0.3)))
    sim.step(100)
    print(sim.save().state, sim.motion)
assert of_numba == (types.BaseFunction.get_call_type, codegen.CPUCodeLibrary._optimize_final_module)
"""


@pytest.mark.parametrize("method", ["rk4", pytest.param("taylor", marks=pytest.mark.nightly)])
def test_compiling_quickly_changes_no_bit_and_leaves_numba_as_it_was(method, tmp_path):
    """What it leaves out is done again, or would be found again."""

    def run(how):
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / how)}
        command = [sys.executable, "-c", QUICK, how, method]
        done = subprocess.run(command, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stdout

    quick = run("quick")
    assert len(quick) > 500 and quick == run("slow")


THREADS = """
import threading
from numba.core import codegen, types
of_numba = types.BaseFunction.get_call_type, codegen.CPUCodeLibrary._optimize_final_module
from rigid_body_sim.kernels import compiled, vectors

def many(kernel, count):
    compiled.ready(kernel, *[1.0] * count)

kernels = (vectors.cross, 6), (vectors.qmultiply, 8), (vectors.qrotate, 7)
threads = [threading.Thread(target=many, args=one) for one in kernels]
[thread.start() for thread in threads]
[thread.join() for thread in threads]
assert of_numba == (types.BaseFunction.get_call_type, codegen.CPUCodeLibrary._optimize_final_module)
print(compiled.ready(vectors.cross, *[1.0] * 6)(1.0, 0.0, 0.0, 0.0, 1.0, 0.0))
"""


def test_several_threads_may_compile(tmp_path):
    """One after the other: what one has changed of numba for a moment, another must not take for numba's own."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", THREADS], env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "(0.0, 0.0, 1.0)\n"), done.stderr
