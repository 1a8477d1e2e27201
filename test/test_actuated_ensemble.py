"""Actuators of many bodies, and in whole runs: the bits of single steps, and rates that know what spins inside."""

import copy
import dataclasses

import numpy as np
import pytest

from rigid_body_sim import Actuator, Body, Drag, Ensemble, Simulation, State

WHEEL = Actuator("wheel", "wheel", -0.1, 0.1, axis=(1.0, 0.0, 1.0), time_constant=0.02, inertia=1e-3, max_speed=50.0)
PUSH = Actuator("push", "thruster", -2.0, 2.0, (0.1, 0.0, 0.0), (0.0, 1.0, 0.0), time_constant=0.05, delay=0.013)
MASS, INERTIA = 2.0, (0.3, 0.4, 0.5)
SPIN = (0.1, -0.2, 0.3)
COMMANDS = [[0.1, 1.0], [-0.05, -2.0], [0.02, 9.0], [0.0, 0.5], [-0.1, 0.1]]


def single(commands, **extra):
    sim = Simulation(Body(MASS, INERTIA), State(angular_velocity=SPIN), rate=100.0, actuators=[WHEEL, PUSH], **extra)
    sim.set_actuators(commands)
    return sim


def ensemble(**extra):
    made = Ensemble(MASS, INERTIA, n=5, angular_velocity=SPIN, rate=100.0, actuators=[WHEEL, PUSH], **extra)
    made.set_actuators(COMMANDS)
    return made


@pytest.mark.no_numba
@pytest.mark.parametrize("extra", [{}, {"drag": Drag(linear=(0.1, 0.2, 0.3))}], ids=["taylor", "loads"])
def test_bodies_of_an_ensemble_have_the_bits_of_simulations(extra):
    """Each with commands of its own; a Simulation taken out of it goes on with the same bits, as does a copy."""
    together = ensemble(**extra)
    together.step(7)
    other = copy.deepcopy(together)
    taken = together.simulation(1)
    for one in (together, other, taken):
        one.step(6)
    for i, commands in enumerate(COMMANDS):
        sim = single(commands, **extra)
        sim.step(13)
        for state in (together.state, other.state):
            assert np.array_equal(state.angular_velocity[i], sim.state.angular_velocity)
            assert np.array_equal(state.angular_momentum[i], sim.state.angular_momentum)
            assert np.array_equal(state.position[i], sim.state.position)
        if i == 1:
            assert taken.save().state == sim.save().state and taken.save().memory == sim.save().memory


def test_run_keeps_what_single_steps_show():
    """The rates among them: with the wheel's spin as it was at each state, not as it is at the end."""
    sim, other = single(COMMANDS[0]), single(COMMANDS[0])
    run = sim.run(steps=20, every=3)
    for k, step in enumerate(run.steps):
        other.step(int(step) - other.steps)
        assert np.array_equal(run.angular_velocity[k], other.state.angular_velocity)
        assert np.array_equal(run.angular_momentum[k], other.state.angular_momentum)
    runs = ensemble().run(steps=20, every=3)
    assert np.array_equal(runs.angular_velocity[:, 0], run.angular_velocity)
    assert np.array_equal(runs[0].angular_velocity, run.angular_velocity)
    assert np.ptp(run.angular_velocity[:, 0]) > 0.01


def test_controller_of_a_run_may_command_actuators():
    """Once a step, or every third; a body with none is told what to give."""
    sim, other, given = single([0.0, 0.0]), single([0.0, 0.0]), iter(COMMANDS)
    run = sim.run(steps=15, controller=lambda state, time: next(given), control_every=3)
    for commands in COMMANDS:
        other.set_actuators(commands)
        other.step(3)
    assert sim.save() == other.save() and len(run) == 16
    with pytest.raises(TypeError, match="give a Wrench, or None"):
        Simulation(Body(MASS, INERTIA)).run(steps=1, controller=lambda state, time: [1.0])


@pytest.mark.no_numba
def test_reset_bodies_begin_anew():
    together, first = ensemble(), ensemble()
    together.step(9)
    together.reset([0, 3])
    together.set_actuators(COMMANDS)
    together.step(4)
    first.step(4)
    for i in (0, 3):
        assert np.array_equal(together.state.angular_velocity[i], first.state.angular_velocity[i])
    assert not np.array_equal(together.state.angular_velocity[1], first.state.angular_velocity[1])


@pytest.mark.no_numba
@pytest.mark.parametrize(
    ("commands", "sentence"),
    [
        ([[0.0, 1.0]] * 4, "numbers of bodies differ|4"),
        (None, "commands are None; give a row of numbers"),
        ([[10**400, 1.0]] * 5, "commands holds what is no number"),
        ([0.0, 1.0, 2.0], r"commands has shape \(3,\)"),
        ([[0.0, 1.0]] * 4 + [[0.0, np.nan]], "row 4 of commands"),
    ],
)
def test_bad_commands_are_refused_and_nothing_moves(commands, sentence):
    together = ensemble()
    before = together._bodies.models.copy()
    with pytest.raises(ValueError, match=sentence):
        together.set_actuators(commands)
    assert np.array_equal(together._bodies.models, before)


@pytest.mark.no_numba
def test_bodies_with_other_actuators_take_no_commands_in_rows():
    bodies = [single([0.0, 0.0]).terms, Simulation(Body(MASS, INERTIA), actuators=[dataclasses.replace(PUSH)]).terms]
    together = Ensemble(MASS, INERTIA, n=2)
    together._bodies.terms[:] = bodies
    with pytest.raises(ValueError, match=r"different numbers of actuators, \[1, 2\]"):
        together.set_actuators([0.0])
