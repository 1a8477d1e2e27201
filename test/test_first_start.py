"""What is compiled before it is needed, by whom, and that it leaves nothing behind."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from rigid_body_sim import Actuator, Drag, Ground, Scene, Simulation, Tether, first_start
from rigid_body_sim.effects import REGISTRY as EFFECTS
from rigid_body_sim.effects.base import LoadEffect
from rigid_body_sim.integrators import REGISTRY, shortfall, steps_of
from rigid_body_sim.kernels import kernel_cache, state
from rigid_body_sim.scene import schema
from rigid_body_sim.terms import Terms
from rigid_body_sim.values.body import Body

pytest.importorskip("numba")

BODY = Body(1.0, (1.0, 2.0, 2.5))
JET = Actuator("jet", "thruster", 0.0, 1.0)
DRAG = {"drag.linear": [1.0, 1.0, 1.0]}


def names(requests):
    return sorted(kernel_cache.identity(request.function) for request in requests)


def of(terms, *more):
    return names(first_start.needed(terms, *more))


def test_what_a_plan_needs_is_what_its_simulation_makes_ready():
    """No more and no less: each is compiled already when the simulation asks for it."""
    for terms in (
        {},
        {"drag": Drag(linear=(1.0, 1.0, 1.0))},
        {"tethers": [Tether(stiffness=10.0)]},
        {"actuators": [JET]},
    ):
        sim = Simulation(BODY, **terms)
        needed = {kernel_cache.identity(one.function) for one in first_start.needed(sim.terms)}
        kernels = {kernel_cache.identity(function) for function in _made_ready(sim)}
        assert needed == kernels


def _made_ready(sim):
    yield state.read_motion
    for name in sim._stepping._made:
        yield steps_of(REGISTRY[name], sim.terms.kernels)


def test_parameters_say_what_is_needed_now_and_what_once_drag_is_set():
    now, later = first_start.of_parameters({"body.mass": 2.0, "use_sim_time": False})
    assert names(now) == of(Terms(BODY))
    assert names(later) == of(Terms(BODY, drag=Drag(linear=(1.0, 1.0, 1.0))))
    now, later = first_start.of_parameters(DRAG)
    assert (names(now), names(later)) == (of(Terms(BODY, drag=Drag(linear=(2.0, 1.0, 1.0)))), of(Terms(BODY)))


def test_what_has_names_neither_comes_nor_goes_by_setting():
    """A tether cannot be added, and one that is there always acts; drag may come to it."""
    tethers = {"tethers.rope.anchor": [0.0, 0.0, 1.0], "tethers.rope.rest_length": 1.0, "tethers.rope.stiffness": 9.0}
    now, later = first_start.of_parameters(tethers)
    tether = {"tethers": [Tether(stiffness=10.0)]}
    assert names(now) == of(Terms(BODY, **tether))
    assert names(later) == of(Terms(BODY, drag=Drag(linear=(1.0, 1.0, 1.0)), **tether))


def test_actuators_need_kernels_of_their_own():
    given = {"names": ["jet"], "jet": {"type": "thruster", "min": 0.0, "max": 1.0}}
    now, later = first_start.of_parameters(schema.flat({"actuators": given}))
    assert names(now) == of(Terms(BODY, actuators=[JET])) != of(Terms(BODY))
    with_drag = Terms(BODY, actuators=[JET], drag=Drag(linear=(1.0, 1.0, 1.0)))
    assert set(names(later)) == {*of(with_drag), *of(Terms(BODY))}  # limits of 0 and 0 let it do nothing


def test_everything_has_actuators_alone_and_with_each_kind_of_load():
    there = set(names(first_start.everything()))
    loads = [effect for effect in EFFECTS.values() if isinstance(effect, LoadEffect)]
    for given in ({}, *({effect.name: effect.present} for effect in loads)):
        terms = Terms(BODY, actuators=[JET], **given)
        methods = [name for name in ("auto", *REGISTRY) if name == "auto" or not shortfall(name, terms)]
        assert {"auto", "dop853"} < {*methods}
        for method in methods:
            assert there >= {*of(terms, method, True)}


def test_acceleration_is_needed_where_an_output_shows_it():
    with_imu, _ = first_start.of_parameters({"outputs": ["imu"]})
    assert len(with_imu) == 1 + len(first_start.of_parameters({})[0])


def test_integrator_that_is_asked_for_is_the_only_one():
    now, _ = first_start.of_parameters({"integrator.name": "rk4"})
    assert names(now) == of(Terms(BODY), "rk4") and len(now) == 2


@pytest.mark.parametrize(
    "bad", [{"no.such": 1.0}, {"body.mass": "heavy"}, {"integrator.name": "none"}, {"drag.linear": [-1.0, 0.0, 0.0]}]
)
def test_bad_parameters_need_nothing(bad):
    """Who reads them in full says what is wrong."""
    assert first_start.of_parameters(bad) == ([], [])


def test_no_file_is_read():
    """A mesh is read once, by the node; and this one is not there."""
    now, _ = first_start.of_parameters({"body.mesh_file": "/no/such.stl"})
    assert names(now) == of(Terms(BODY))
    with pytest.raises(ValueError, match="mesh_file"):
        Scene({"body.mesh_file": "/no/such.stl"})


ALONE = """
import os, sys
from rigid_body_sim import first_start
from rigid_body_sim.kernels import compiled

forked = []
fork = os.fork
os.fork = lambda: forked.append(1) or fork()
now, _ = first_start.of_parameters({"integrator.name": "rk4"})
first_start.compile_together(now, meanwhile=lambda: print("meanwhile"))
print(len(forked), len(first_start.missing(now)), sum(compiled.compilations().values()))
"""


def run(script, folder, cores=None):
    command = [sys.executable, "-c", script]
    if cores is not None:
        command = ["taskset", "-c", cores, *command]
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return done.stdout.split()


@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="one core")
def test_two_processes_share_what_is_missing(tmp_path):
    """Afterwards all is in the cache, of which this process compiled its part; the next compiles nothing."""
    said, forked, missing, compiled_here = run(ALONE, tmp_path)
    assert (said, forked, missing) == ("meanwhile", "1", "0") and 0 < int(compiled_here) < 21  # measured 18 of 21
    assert run(ALONE, tmp_path) == ["meanwhile", "0", "0", "0"]


def test_on_one_core_one_process_does_it(tmp_path):
    core = str(min(os.sched_getaffinity(0)))
    assert run(ALONE, tmp_path, core)[:3] == ["meanwhile", "0", "0"]


BACKGROUND = """
import sys, time
from rigid_body_sim import first_start

first_start.START_TAKES = 0.0
print(first_start.compile_in_background(first_start.everything()), flush=True)
time.sleep(60.0)
"""


def _state(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except FileNotFoundError:
        return None


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_what_compiles_in_the_background_is_nice_and_ends_with_its_parent(tmp_path, number):
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    with subprocess.Popen(
        [sys.executable, "-c", BACKGROUND], env=environment, stdout=subprocess.PIPE, text=True
    ) as parent:
        child = int(parent.stdout.readline())
        assert until(lambda: _state(child)[16] == "19")
        parent.send_signal(number)
        parent.wait()
        assert until(lambda: _state(child) is None or _state(child)[0] == "Z")


def until(condition, seconds=20.0):
    end = time.monotonic() + seconds
    while not (holds := condition()) and time.monotonic() < end:
        time.sleep(0.02)
    return holds


def test_everything_holds_what_any_scene_of_the_package_needs():
    every = names(first_start.everything())
    ground = Ground(stiffness=1.0, contacts=((0, 0, 0),))
    for terms in ({}, {"drag": Drag(linear=(1, 1, 1))}, {"tethers": [Tether(stiffness=1.0)]}, {"ground": ground}):
        assert set(of(Terms(BODY, **terms))) <= set(every)
