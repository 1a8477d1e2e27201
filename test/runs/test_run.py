"""Whole runs: the same bits as single steps, whatever acts; nothing moves on bad input, nothing is lost on Ctrl-C."""

import signal
import subprocess
import sys
import textwrap
import threading

import numpy as np
import pytest

from rigid_body_sim import Body, Drag, Simulation, SimulationError, State, Tether, Wrench, WrenchSchedule

BODY = Body(1.5, (0.12, 0.2, 0.27), (0.01, 0.02, 0.03))
START = State(position=(0, 0, 1), velocity=(0.2, 0, 0), angular_velocity=(0.1, 0.3, 1.0))
ARRAYS = ("position", "orientation", "velocity", "angular_velocity", "momentum", "angular_momentum")
TETHER = Tether(body_point=(0, 0, 0.1), anchor=(0, 0, 2), rest_length=0.8, stiffness=4000.0, damping=3.0)
SCENES = {
    "auto": {},
    "taylor": {"integrator": "taylor"},
    "rk4": {"integrator": "rk4"},
    "drag": {"drag": Drag(linear=(0.1, 0.2, 0.3), angular_linear=(0.01, 0.01, 0.01))},
    "tether": {"tethers": [TETHER], "rtol": 1e-6},
    "force": {"forces": [((0.1, 0, 0), (0, 0, 3.0))]},
}


def simulation(**options):
    return Simulation(BODY, START, rate=1000.0, gravity=(0, 0, -9.8), **options)


def schedule(seed, count, steps):
    """Commands at random steps, some of which do not turn the body, which ``auto`` then follows in closed form."""
    random = np.random.default_rng(seed)
    at = np.sort(random.choice(steps, count, replace=False))
    turning = random.random((count, 1)) > 0.3
    return WrenchSchedule(at, torque_body=turning * random.normal(size=(count, 3)), force_world=random.normal(size=3))


def assert_same(trajectory, row, state):
    for name in ARRAYS:
        assert np.array_equal(getattr(trajectory, name)[row], getattr(state, name)), name


@pytest.mark.no_numba
@pytest.mark.parametrize("every", [1, 7])
@pytest.mark.parametrize("name", SCENES)
def test_bits_are_those_of_single_steps(name, every):
    n = 100
    commands = schedule(3, 25, n)
    whole, single = simulation(**SCENES[name]), simulation(**SCENES[name])
    trajectory = whole.run(steps=n, every=every, commands=commands)
    by_step = {int(step): commands.wrench(row) for row, step in enumerate(commands.steps)}
    states = {0: single.state}
    for step in range(n):
        if step in by_step:
            single.set_wrench(by_step[step])
        single.step()
        states[step + 1] = single.state
    assert trajectory.steps.tolist() == [*range(0, n, every), n]
    for row, step in enumerate(trajectory.steps.tolist()):
        assert_same(trajectory, row, states[step])
    assert whole.save() == single.save()


def test_runs_follow_one_another():
    """A held source with an end, a second run after the first, and one without commands."""
    whole, single = simulation(), simulation()
    for sim in (whole, single):
        sim.set_wrench(Wrench(torque_body=(0.1, 0, 0)), hold=0.013, source="other")
        sim.step(3)
    first = whole.run(0.02, commands=WrenchSchedule([2], force_body=(0, 0, 1)))
    second = whole.run(steps=10, every=4)
    single.step(2)
    single.set_wrench(Wrench(force_body=(0, 0, 1)))
    single.step(18)
    assert_same(first, -1, single.state)
    assert_same(second, 0, single.state)
    single.step(10)
    assert second.steps.tolist() == [23, 27, 31, 33]
    assert_same(second, -1, single.state)
    assert whole.save() == single.save()


def test_a_controller_is_asked_each_so_many_steps():
    seen = []

    def controller(state, time):
        seen.append(time)
        return Wrench(torque_body=-0.5 * state.angular_velocity) if len(seen) < 8 else None

    sim, single = simulation(), simulation()
    trajectory = sim.run(0.1, controller=controller, control_every=10, every=5)
    for k in range(10):
        if k < 7:
            single.set_wrench(Wrench(torque_body=-0.5 * single.state.angular_velocity))
        single.step(10)
    assert seen == pytest.approx([0.01 * k for k in range(10)], abs=1e-12)
    assert_same(trajectory, -1, single.state)


def test_energies_are_those_of_single_states():
    sim = simulation(**SCENES["tether"], forces=[((0.1, 0, 0), (0, 0, 3.0))])
    trajectory = sim.run(steps=3)
    assert trajectory.kinetic_energy[-1] == sim.kinetic_energy
    assert trajectory.potential_energy[-1] == sim.potential_energy
    # ½ m v² + ½ ω·I ω, m g z, the point's force, the stretched tether: by hand
    start = simulation(**SCENES["tether"], forces=[((0.1, 0, 0), (0, 0, 3.0))])
    v = np.array([0.2, 0, 0]) + np.cross((0.1, 0.3, 1.0), BODY.center_of_mass)
    w = np.array([0.1, 0.3, 1.0])
    assert start.kinetic_energy == pytest.approx(0.75 * v @ v + 0.5 * w @ BODY.inertia @ w, rel=1e-15)
    stretch = np.linalg.norm((0, 0, 1.1 - 2.0)) - 0.8
    by_hand = 1.5 * 9.8 * (1 + 0.03) - 3.0 * 1.0 + 0.5 * 4000.0 * stretch**2
    assert start.potential_energy == pytest.approx(by_hand, rel=1e-14)


def test_energy_of_a_free_body_is_kept_over_a_run():
    sim = Simulation(BODY, START, rate=1000.0)
    energy = sim.run(5.0, every=100).kinetic_energy
    assert np.ptp(energy) < 2e-15 * energy[0]  # measured 6.5e-16


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({}, "run needs either a duration in seconds or steps=, one of the two"),
        ({"duration": 1.0, "steps": 3}, "one of the two"),
        ({"duration": 0.0015}, r"run\(0\.0015\): that is 1\.5 steps at 1000 Hz; give a whole number of them"),
        ({"duration": -1.0}, r"run\(-1\.0\): a duration is a time from 0"),
        ({"duration": float("nan")}, "a duration is a time from 0"),
        ({"steps": -2}, "steps=-2: give a whole number of at least 0"),
        ({"steps": 5, "every": 0}, "every=0: give a whole number of at least 1"),
        ({"steps": 5, "control_every": 0}, "control_every=0: give a whole number"),
        (
            {"steps": 5, "commands": WrenchSchedule([0, 5, 7])},
            "row 1 of the schedule is for step 5, but the run has 5 steps, of which the last begins at step 4",
        ),
        ({"steps": 5, "commands": WrenchSchedule([0]), "controller": print}, "commands or a controller, not both"),
        ({"steps": 10**15}, "more than memory holds; keep fewer, with a larger every"),
    ],
)
def test_what_cannot_be_run_moves_nothing(arguments, sentence):
    sim = simulation()
    before = sim.save()
    with pytest.raises(ValueError, match=sentence):
        sim.run(**arguments)
    assert sim.save() == before


def test_commands_that_the_integrator_cannot_be_given_move_nothing():
    sim = simulation(integrator="exact")
    before = sim.save()
    with pytest.raises(ValueError, match=r"row 1 of the schedule: integrator 'exact' knows only motion without torque"):
        sim.run(steps=9, commands=WrenchSchedule([0, 4], torque_body=[(0, 0, 0), (1, 0, 0)]))
    assert sim.save() == before


def test_steps_must_be_whole():
    with pytest.raises(TypeError):
        simulation().run(steps=2.5)


def test_commands_and_controller_must_be_such():
    with pytest.raises(TypeError, match=r"commands=\[1, 2\]: give a WrenchSchedule"):
        simulation().run(steps=5, commands=[1, 2])
    with pytest.raises(TypeError, match="controller=3: give a function of state and time"):
        simulation().run(steps=5, controller=3)


@pytest.mark.parametrize("meddle", [lambda sim: sim.step(3), lambda sim: sim.reset()], ids=["steps", "resets"])
def test_a_controller_leaves_time_alone(meddle):
    sim = simulation()
    sim.step(5)
    with pytest.raises(
        RuntimeError, match=r"the controller took the simulation from step 5 to [08]; time is the run's"
    ):
        sim.run(steps=5, controller=lambda state, time: meddle(sim))


def test_a_controller_that_gives_something_else_is_told_so():
    with pytest.raises(TypeError, match=r"the controller gave \[0, 0, 1\] at 0 s; give a Wrench"):
        simulation().run(steps=5, controller=lambda state, time: [0, 0, 1])


def test_a_step_that_cannot_be_done_keeps_what_was():
    """A torque that spins the body up to more than can be followed, held from the middle of the run on."""
    sim = simulation()
    commands = WrenchSchedule([0, 50], torque_body=[(0, 0, 0.1), (0, 0, 1e13)])
    with pytest.raises(SimulationError, match=r"step 5[0-9] cannot be done") as stopped:
        sim.run(steps=100, every=10, commands=commands)
    trajectory = stopped.value.trajectory
    assert trajectory.steps[:6].tolist() == [0, 10, 20, 30, 40, 50]
    assert trajectory.steps[-1] == sim.steps and sim.wrench == commands.wrench(1)
    assert_same(trajectory, -1, sim.state)


PROGRAM = """
    import os, signal, threading, time
    from rigid_body_sim import Body, Simulation, State

    def interrupt():
        while sim.steps < 100_000:
            time.sleep(0.001)
        os.kill(os.getpid(), signal.SIGINT)

    sim = Simulation(Body(1, (1, 2, 3)), State(angular_velocity=(1, 2, 3)), rate=1000.0, integrator="rk4")
    threading.Thread(target=interrupt).start()
    trajectory = sim.run(steps=10**11, every=10**6)
    assert trajectory.steps[-1] == sim.steps, (trajectory.steps, sim.steps)
    print(trajectory.stopped)
"""


def test_ctrl_c_keeps_what_was_done():
    program = textwrap.dedent(PROGRAM)
    child = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=True)
    assert child.stdout.startswith("stopped by Ctrl-C after ") and "of 100000000000 steps" in child.stdout
    assert "UserWarning: run stopped by Ctrl-C" in child.stderr


def test_a_run_in_another_thread_leaves_signals_alone():
    handler = signal.getsignal(signal.SIGINT)
    done = []
    thread = threading.Thread(target=lambda: done.append(simulation().run(steps=50)))
    thread.start()
    thread.join(60)
    assert len(done[0]) == 51 and signal.getsignal(signal.SIGINT) is handler


def test_a_bar_is_shown_where_it_is_asked_for(capfd):
    pytest.importorskip("tqdm")
    simulation().run(steps=2000, progress=True)
    assert "2.00k/2.00k" in capfd.readouterr().err
    simulation().run(steps=2000)
    assert capfd.readouterr().err == ""  # a test has no terminal
