"""The chapter's equations (2.1.1) to (2.6.1), each against points, differences in time, or the simulation."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from rigid_body_sim import Body, Simulation, State, Wrench
from rigid_body_sim.theory import dynamics
from rigid_body_sim.values import inertia, rotation

pytestmark = pytest.mark.no_numba

MASS = 2.0
TENSOR = inertia.as_matrix((0.31, 0.42, 0.53, -0.04, 0.06, 0.03))
Q = rotation.normalize((0.9, 0.3, -0.2, 0.1))
W_BODY = np.array((0.7, -1.1, 1.9))
TORQUE_BODY = np.array((0.06, 0.04, -0.08))
FORCE = np.array((0.9, -0.4, 1.3))

seeds = st.integers(0, 10**6)


def points(seed, n=9):
    """Masses (n,), positions (n, 3) and an angular velocity (3,) of a cloud of points that turns about the origin."""
    rng = np.random.default_rng(seed)
    return rng.uniform(0.1, 2.0, n), rng.normal(size=(n, 3)), rng.normal(size=3)


def rate_of(function, h=1e-3):
    """Time derivative at t = 0 by differences of the fourth order."""
    return (function(-2 * h) - 8 * function(-h) + 8 * function(h) - function(2 * h)) / (12 * h)


def attitude_after(t):
    """Attitude of a body that turns with the constant W_BODY, seen from Q at t = 0."""
    return rotation.multiply(Q, rotation.from_axis_angle(W_BODY, t * np.linalg.norm(W_BODY)))


@pytest.fixture(scope="module")
def measured():
    """Rates of x, R, P, L and ω by differences over a simulated motion, and the state in the middle of it."""
    sim = Simulation(Body(MASS, TENSOR), State((1, 2, 3), Q, (0.1, 0.2, 0.3), W_BODY), rate=1000.0)
    sim.set_wrench(Wrench(torque_body=TORQUE_BODY.tolist(), force_world=FORCE.tolist()))
    states = []
    for _ in range(5):
        states.append(sim.state)
        sim.step()

    def difference(read):
        f = [read(state) for state in states]
        return (f[0] - 8 * f[1] + 8 * f[3] - f[4]) * sim.rate / 12

    reads = {
        "x": lambda s: s.position,
        "R": lambda s: rotation.to_matrix(s.orientation),
        "P": lambda s: s.momentum,
        "L": lambda s: s.angular_momentum,
        "w_body": lambda s: s.angular_velocity,
        "w_world": lambda s: rotation.rotate(s.orientation, s.angular_velocity),
    }
    return {name: difference(read) for name, read in reads.items()}, states[2]


def test_point_mass_moves_by_2_1_1_to_2_1_4(measured):
    rates, state = measured
    velocity, momentum_rate = dynamics.particle_rates(MASS, state.momentum, FORCE)
    assert_allclose(velocity, rates["x"], rtol=0, atol=1e-12)  # measured 9.7e-14
    assert_allclose(momentum_rate, rates["P"], rtol=0, atol=2e-13)  # measured 1.2e-14


def test_state_changes_as_2_6_1_says(measured):
    rates, state = measured
    R = rotation.to_matrix(state.orientation)
    found = dynamics.state_rates(MASS, TENSOR, R, state.momentum, state.angular_momentum, FORCE, R @ TORQUE_BODY)
    for name, rate in zip(("x", "R", "P", "L"), found, strict=True):
        assert_allclose(rate, rates[name], rtol=0, atol=3e-11)  # measured 3.1e-12


def test_rotation_matrix_changes_as_2_2_2_and_2_2_5_say():
    R, w = rotation.to_matrix(Q), rotation.rotate(Q, W_BODY)
    found = dynamics.rotation_matrix_rate(R, w)
    by_columns = np.stack([np.cross(w, column) for column in R.T], axis=1)
    assert_allclose(found, by_columns, rtol=0, atol=1e-15)  # measured 1.1e-16
    assert_allclose(
        found, rate_of(lambda t: rotation.to_matrix(attitude_after(t))), rtol=0, atol=1e-11
    )  # measured 1.8e-12


@given(seeds)
def test_angular_momentum_of_turning_points_is_the_tensor_times_their_rate_2_4_3(seed):
    masses, positions, w = points(seed)
    by_points = dynamics.angular_momentum_of_points(masses, positions, np.cross(w, positions))
    tensor = inertia.of_point_masses(masses, positions)
    assert_allclose(dynamics.angular_momentum(tensor, w), by_points, rtol=0, atol=3e-15 * np.trace(tensor))  # 2.0e-16
    found = dynamics.angular_velocity(tensor, by_points)
    assert_allclose(found, w, rtol=0, atol=1e-14)  # measured 6.7e-16


@given(seeds)
def test_angular_momentum_of_free_points_changes_by_the_torque_2_3_2_to_2_3_5(seed):
    rng = np.random.default_rng(seed)
    masses, positions, _ = points(seed)
    velocities, forces = rng.normal(size=(2, *positions.shape))

    def L(t):
        accelerations = forces / masses[:, None]
        return dynamics.angular_momentum_of_points(
            masses, positions + velocities * t + accelerations * t * t / 2, velocities + accelerations * t
        )

    torque = dynamics.total_torque(zip(forces, positions, strict=True))
    assert_allclose(rate_of(L), torque, rtol=0, atol=3e-11)  # measured 3.0e-12


def test_tensor_in_the_world_changes_as_2_5_2_says():
    w = rotation.rotate(Q, W_BODY)
    found = dynamics.inertia_rate(inertia.turned(TENSOR, Q), w)
    assert_allclose(
        found, rate_of(lambda t: inertia.turned(TENSOR, attitude_after(t))), rtol=0, atol=3e-11
    )  # measured 6.0e-12


def test_both_routes_to_angular_acceleration_give_the_motion(measured):
    rates, state = measured
    q, w = state.orientation, state.angular_velocity
    by_euler = dynamics.angular_acceleration_euler(TENSOR, w, TORQUE_BODY)
    by_momentum = dynamics.angular_acceleration_from_momentum(
        TENSOR, q, state.angular_momentum, rotation.rotate(q, TORQUE_BODY)
    )
    assert_allclose(by_euler, rates["w_body"], rtol=0, atol=2e-12)  # measured 1.0e-13
    assert_allclose(by_momentum, rates["w_world"], rtol=0, atol=3e-11)  # measured 3.7e-12
    assert_allclose(by_momentum, rotation.rotate(q, by_euler), rtol=0, atol=5e-15)  # measured 4.4e-16: ω × ω = 0


@given(seeds)
def test_change_of_angular_momentum_is_what_turns_and_what_speeds_up_2_5_1(seed):
    """τ = I' ω + I ω' with both rates from their own equations, for any attitude, spin and torque."""
    rng = np.random.default_rng(seed)
    q, w, torque = rotation.normalize(rng.normal(size=4)), rng.normal(size=3), rng.normal(size=3)
    I = inertia.turned(TENSOR, q)
    w_dot = dynamics.angular_acceleration_from_momentum(TENSOR, q, dynamics.angular_momentum(I, w), torque)
    assert_allclose(dynamics.inertia_rate(I, w) @ w + I @ w_dot, torque, rtol=0, atol=1e-14)  # measured 8.9e-16


def test_euler_of_principal_moments_is_2_5_6():
    a, b, c = 0.1, 0.2, 0.25
    x, y, z = W_BODY
    products = np.array(((b - c) * y * z, (c - a) * z * x, (a - b) * x * y))
    expected = (TORQUE_BODY + products) / (a, b, c)
    found = dynamics.angular_acceleration_euler(np.diag((a, b, c)), W_BODY, TORQUE_BODY)
    assert_allclose(found, expected, rtol=0, atol=1e-14)  # measured 6.7e-16


def test_force_at_a_point_makes_the_torque_of_its_arm():
    force, torque = dynamics.force_at_point((0, 0, 5), (2, 0, 0))
    assert_array_equal(force, (0, 0, 5))
    assert_array_equal(torque, (0, -10, 0))


def test_force_at_a_point_does_what_the_simulation_does_with_it():
    point, center = np.array((0.4, 0.1, -0.2)), np.array((0.1, -0.2, 0.3))
    sims = [Simulation(Body(MASS, TENSOR, center), State(orientation=Q), rate=1000.0) for _ in range(2)]
    sims[0].set_wrench(Wrench(points=[(point, FORCE)]))
    arm = rotation.rotate(Q, point - center)
    force, torque = dynamics.force_at_point(FORCE, arm)
    sims[1].set_wrench(Wrench(force_world=force.tolist(), torque_world=torque.tolist()))
    for sim in sims:
        sim.step()
    one, other = (sim.state for sim in sims)
    assert_allclose(one.momentum, other.momentum, rtol=0, atol=1e-18)  # measured 0
    # In the first step the arm turns by 1e-6 rad, of a torque of 0.7 N m, over 1 ms.
    assert_allclose(one.angular_momentum, other.angular_momentum, rtol=0, atol=3e-10)  # measured 3.1e-11
    assert np.linalg.norm(one.angular_momentum) > 1e-4


def test_impulse_is_a_great_force_for_a_short_time():
    """Velocities jump by J/m and I⁻¹ (r × J): a thousandth of a second's force comes nearer as it gets shorter."""
    J, arm = np.array((0.3, -0.2, 0.1)), np.array((0.1, 0.3, -0.2))
    momentum, angular_momentum = dynamics.impulse_at_point(J, rotation.rotate(Q, arm))
    misses = []
    for rate in (1e4, 1e5):
        sim = Simulation(Body(MASS, TENSOR), State(orientation=Q), rate=rate)
        sim.set_wrench(Wrench(points=[(arm, (J * rate).tolist())]))
        sim.step()
        assert_allclose(sim.state.momentum, momentum, rtol=0, atol=1e-15)  # measured 5.6e-17
        misses.append(np.abs(sim.state.angular_momentum - angular_momentum).max())
        jump = dynamics.angular_velocity(TENSOR, rotation.rotate_back(Q, angular_momentum))
        assert_allclose(sim.state.angular_velocity, jump, rtol=0, atol=0.05 / rate)  # measured 0.005 / rate
    assert misses[0] < 1e-5
    assert misses[0] / misses[1] == pytest.approx(10.0, rel=1e-4)  # measured 8.6e-6


@pytest.mark.parametrize("function", [dynamics.force_at_point, dynamics.impulse_at_point])
@pytest.mark.parametrize(("vector", "arm"), [((1, 2), (0, 0, 0)), ((1, 2, 3), (0, 0, np.nan)), (None, (0, 0, 0))])
def test_what_is_not_a_vector_is_refused(function, vector, arm):
    with pytest.raises(ValueError, match=r"^(force|impulse|arm) .* must be three finite numbers"):
        function(vector, arm)
