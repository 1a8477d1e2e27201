"""Budgets of energy and momentum on a recording whose truth is known."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rigid_body_sim import Body, Simulation, State, Wrench
from rigid_body_sim.tools.heard import Heard, energy_budget, momentum_budget
from rigid_body_sim.values import rotation

BODY = Body(12.0, (0.144, 0.185, 0.061, 0.01, -0.02, 0.005), (0.01, -0.02, 0.03))
STEP_NS = 1_000_000
LATE = 3  # steps from a pose to the command that answers it


@pytest.fixture(scope="module")
def recording() -> Heard:
    """10 s of a tumble under a torque that changes 100 times a second, each time some steps after a pose."""
    simulation = Simulation(
        BODY, State(orientation=(0.5, -0.5, 0.5, 0.5), angular_velocity=(0.3, -0.2, 0.4)), rate=1000.0
    )
    states, torques = [], []
    for k in range(1001):
        states.append(simulation.state)
        torques.append(0.02 * np.array((math.sin(0.02 * k), math.cos(0.013 * k), math.sin(0.007 * k + 1.0))))
        simulation.step(LATE)
        simulation.set_wrench(Wrench(torque_body=torques[-1]))
        simulation.step(10 - LATE)
    stamps = 1_700_000_000_000_000_000 + 10 * STEP_NS * np.arange(1001)
    return Heard(
        stamps,
        np.array([state.orientation for state in states]),
        np.array([state.angular_velocity for state in states]),
        stamps + LATE * STEP_NS,
        np.array(torques),
    )


def test_energy_adds_up(recording):
    budget = energy_budget(recording, BODY)
    assert abs(budget.change) > 1e-3  # J: there is something to explain
    assert budget.relative < 2e-6  # measured 3.6e-7


def test_momentum_adds_up(recording):
    budget = momentum_budget(recording, BODY)
    assert np.linalg.norm(budget.change) > 1e-2  # N m s
    assert budget.relative < 2e-6  # measured 2.3e-7


@pytest.mark.parametrize("wrong", ("late", "scaled", "world axes"))
def test_wrong_torques_do_not_add_up(recording, wrong):
    """A torque history that did not act shows, by hundreds of times the tolerance above."""
    torque = recording.torque
    if wrong == "late":
        recording = replace(recording, command_ns=recording.command_ns + 10 * STEP_NS)
    elif wrong == "scaled":
        recording = replace(recording, torque=1.01 * torque)
    else:
        turned = [rotation.rotate(q, t) for q, t in zip(recording.orientation, torque, strict=True)]
        recording = replace(recording, torque=np.array(turned))
    assert energy_budget(recording, BODY).relative > 5e-4  # measured 3.6e-3, 1.2e-3, 0.5
    assert momentum_budget(recording, BODY).relative > 5e-4  # measured 3.0e-3, 1.9e-3, 0.4


def test_sign_of_quaternions_does_not_matter(recording):
    signs = np.where(np.arange(1001) % 2, 1.0, -1.0)[:, None]
    flipped = replace(recording, orientation=signs * recording.orientation)
    assert np.array_equal(momentum_budget(flipped, BODY).supplied, momentum_budget(recording, BODY).supplied)


def test_without_commands_nothing_is_supplied(recording):
    silent = replace(recording, command_ns=np.zeros(0, np.int64), torque=np.zeros((0, 3)))
    assert energy_budget(silent, BODY).supplied == 0.0
    assert np.array_equal(silent.commanded().stamp_ns, recording.stamp_ns)


def test_commanded_begins_with_the_first_command(recording):
    part = replace(recording, command_ns=recording.command_ns[500:], torque=recording.torque[500:]).commanded()
    assert part.stamp_ns[0] == recording.stamp_ns[501]
    assert momentum_budget(part, BODY).relative < 2e-6  # measured 2.5e-7


def test_missing_and_irregular_stamps_are_seen(recording):
    assert recording.missing(10 * STEP_NS) == 0
    assert recording.off_grid(10 * STEP_NS) == 0.0
    kept = np.delete(recording.stamp_ns, (7, 8, 500))
    assert replace(recording, stamp_ns=kept).missing(10 * STEP_NS) == 3
    shifted = recording.stamp_ns + np.where(np.arange(1001) == 9, 40, 0)
    assert replace(recording, stamp_ns=shifted).off_grid(10 * STEP_NS) == 40.0


def test_error_and_norm(recording):
    assert recording.error(recording.orientation[3])[3] < 1e-15  # rad; measured 0
    assert recording.norm_error() < 1e-15  # measured 2.2e-16
    stretched = replace(recording, orientation=1.001 * recording.orientation)
    assert stretched.norm_error() == pytest.approx(1e-3, rel=1e-9)
