"""Energy and angular momentum against sums over the point masses of a body."""

import numpy as np
import pytest

from rigid_body_sim import Body, Simulation, State
from rigid_body_sim.physics import invariants, rotation

pytestmark = pytest.mark.no_numba

MASSES = np.array((0.3, 0.5, 0.7, 1.0))
POINTS = np.array(((0.1, 0.2, 0.3), (-0.4, 0.1, 0.0), (0.2, -0.5, 0.1), (0.0, 0.3, -0.2)))
CENTER = MASSES @ POINTS / MASSES.sum()
STATE = State((1.0, 2.0, 3.0), (0.4, 0.2, -0.8, 0.4), (-0.5, 0.2, 1.0), (1.1, -2.0, 0.7))
GRAVITY = np.array((0.3, -0.2, -9.81))
R = rotation.to_matrix(STATE.orientation)
POSITIONS = STATE.position + POINTS @ R.T
VELOCITIES = STATE.velocity + np.cross(STATE.angular_velocity, POINTS) @ R.T


def body_of_points():
    arms = POINTS - CENTER
    inertia = sum(m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in zip(MASSES, arms, strict=True))
    return Body(MASSES.sum(), (inertia + inertia.T) / 2, CENTER)


def test_kinetic_energy_is_that_of_the_points():
    expected = 0.5 * MASSES @ np.sum(VELOCITIES**2, axis=1)
    assert invariants.kinetic_energy(body_of_points(), STATE) == pytest.approx(expected, rel=2e-15, abs=0)  # measured 0


def test_potential_energy_is_that_of_the_points():
    expected = -MASSES @ POSITIONS @ GRAVITY
    found = invariants.potential_energy(body_of_points(), STATE, GRAVITY)
    assert found == pytest.approx(expected, rel=2e-15, abs=0)  # measured 1.9e-16


def test_angular_momentum_about_the_origin_is_that_of_the_points():
    expected = np.sum(MASSES[:, None] * np.cross(POSITIONS, VELOCITIES), axis=0)
    state = Simulation(body_of_points(), STATE).state
    found = invariants.angular_momentum_about_origin(body_of_points(), state)
    assert found == pytest.approx(expected, rel=0, abs=1e-14)  # measured 4.4e-16
