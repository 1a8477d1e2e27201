"""Energy and angular momentum against sums over the point masses of a body."""

import numpy as np
import pytest

from rigid_body_sim import Body, Simulation, State, Tether
from rigid_body_sim.terms import Terms
from rigid_body_sim.theory import invariants
from rigid_body_sim.values import rotation

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
    found = invariants.potential_energy(Terms(body_of_points(), GRAVITY), STATE)
    assert found == pytest.approx(expected, rel=2e-15, abs=0)  # measured 1.9e-16


def test_angular_momentum_about_the_origin_is_that_of_the_points():
    expected = np.sum(MASSES[:, None] * np.cross(POSITIONS, VELOCITIES), axis=0)
    state = Simulation(body_of_points(), STATE).state
    found = invariants.angular_momentum_about_origin(body_of_points(), state)
    assert found == pytest.approx(expected, rel=0, abs=1e-14)  # measured 4.4e-16


LIFT = [((0.1, -0.2, 0.3), (1.0, 2.0, 15.0)), ((0.0, 0.1, -0.2), (-0.5, 0.0, 3.0))]
TETHERS = [
    Tether((0.2, 0.1, -0.1), (0.0, 0.0, 0.0), rest_length=2.0, stiffness=40.0),
    Tether((-0.2, 0.0, 0.3), (1.0, 1.0, 3.0), rest_length=1.0, stiffness=15.0, slack=False),
    Tether(anchor=(1.0, 2.0, 2.0), rest_length=5.0, stiffness=1e6),  # slack
]


def test_potential_energy_of_forces_and_tethers_is_their_work():
    """Taken on a straight way from the origin for the forces, and from rest length for the tethers."""
    forces = -sum(np.array(f) @ (STATE.position + R @ np.array(p)) for p, f in LIFT)
    lengths = [np.linalg.norm(STATE.position + R @ np.array(t.body_point) - t.anchor) for t in TETHERS]
    springs = 0.5 * 40.0 * (lengths[0] - 2.0) ** 2 + 0.5 * 15.0 * (lengths[1] - 1.0) ** 2
    assert lengths[0] > 2.0 and lengths[2] < 5.0
    found = invariants.potential_energy(Terms(body_of_points(), forces=LIFT, tethers=TETHERS), STATE)
    assert found == pytest.approx(forces + springs, rel=2e-15, abs=0)  # measured 0


def test_energy_is_kept_by_gravity_constant_forces_and_tethers_together():
    """Over a second, in which each part takes and gives back many times what the sum is off by."""
    body = body_of_points()
    sim = Simulation(
        body, STATE, rate=200.0, integrator="rosenbrock", rtol=1e-10, gravity=GRAVITY, forces=LIFT, tethers=TETHERS[:2]
    )
    parts = []
    for _ in range(20):
        sim.step(10)
        parts_of = ({"gravity": GRAVITY}, {"forces": LIFT}, {"tethers": TETHERS[:2]})
        potential = [invariants.potential_energy(Terms(body, **part), sim.state) for part in parts_of]
        parts.append([invariants.kinetic_energy(body, sim.state), *potential])
    assert (np.ptp(parts, axis=0) > 10.0).all()  # J; measured 73, 94, 70 and 73
    assert np.ptp(np.sum(parts, axis=1)) < 1e-7  # J; measured 3.3e-9
