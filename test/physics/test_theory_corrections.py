"""Misprints of the theory chapter in what the package computes: the printed form fails, the package's holds."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rigid_body_sim import Body, Simulation, State
from rigid_body_sim.physics import forces, rotation
from rigid_body_sim.physics.wrench import Wrench

pytestmark = pytest.mark.no_numba

Q = np.array((1.0, 2.0, -0.5, 0.7))  # not of unit length
V = np.array((0.3, -1.2, 0.8))
MOMENTS = np.array((0.1, 0.2, 0.25))
RATES = np.array((0.7, -1.1, 1.9))


def measured_angular_acceleration():
    """dω/dt [rad/s², body] at t = 1 ms of a torque-free body, by differences of the fourth order, and ω there."""
    sim = Simulation(Body(1.0, MOMENTS), State(angular_velocity=RATES), rate=2000.0)
    rates = []
    for _ in range(5):
        rates.append(sim.state.angular_velocity)
        sim.step()
    return (rates[0] - 8 * rates[1] + 8 * rates[3] - rates[4]) * sim.rate / 12, rates[2]


def test_euler_equation_2_5_6_takes_its_products_in_cyclic_order():
    alpha, (x, y, z) = measured_angular_acceleration()
    euler = forces.new_model(Body(1.0, MOMENTS), (0, 0, 0), Wrench())[forces.EULER : forces.EULER + 3]
    assert_allclose(euler * (y * z, z * x, x * y), alpha, rtol=0, atol=1e-11)  # measured 2.8e-13
    printed = euler * (y * z, y * z, y * z)
    assert abs(printed - alpha)[1:].min() > 0.5  # measured 2.6 and 0.53 rad/s²; row 1 is printed right
    assert abs(printed - alpha)[0] < 1e-11


def test_euler_equation_2_5_5_is_the_change_of_angular_momentum_seen_from_the_body():
    alpha, w = measured_angular_acceleration()
    skew, inertia = rotation.skew(w), np.diag(MOMENTS)
    assert_allclose(inertia @ alpha, -(skew @ inertia - inertia @ skew) @ w, rtol=0, atol=1e-12)  # measured 5.6e-14


def test_what_2_7_11_calls_the_norm_is_its_square():
    length = np.sqrt(Q @ Q)
    assert rotation.norm(Q) == pytest.approx(length, rel=1e-15, abs=0)
    assert rotation.norm_squared(Q) == pytest.approx(length**2, rel=1e-15, abs=0)
    assert rotation.norm(2 * Q) == 2 * rotation.norm(
        Q
    )  # a norm grows with its argument, the printed one with its square
    assert rotation.norm_squared(2 * Q) == 4 * rotation.norm_squared(Q)


def printed_matrix_2_7_26(q):
    s, x, y, z = q
    return np.array(
        (
            (s * s + x * x - y * y - z * z, 2 * x * y - 2 * s * z, 2 * x * z + 2 * s * y),
            (2 * x * y + 2 * s * z, s * s - x * x + y * y - z * z, 2 * y * z - 2 * s * x),
            (2 * x * z - 2 * s * y, 2 * y * z + 2 * s * x, s * s - x * x - y * y + z * z),
        )
    )


def test_matrix_2_7_26_is_that_of_q_v_conjugate_and_not_of_q_v_inverse():
    printed = printed_matrix_2_7_26(Q) @ V
    with_conjugate = rotation.multiply(rotation.multiply(Q, (0, *V)), rotation.conjugate(Q))[1:]
    with_inverse = rotation.multiply(rotation.multiply(Q, (0, *V)), rotation.inverse(Q))[1:]
    assert_allclose(printed, with_conjugate, rtol=0, atol=1e-14)  # measured 1.5e-15
    assert abs(printed - with_inverse).max() > 1.0  # measured 5.6
    assert_allclose(printed / rotation.norm_squared(Q), with_inverse, rtol=0, atol=1e-15)  # measured 2.2e-16
    assert_allclose(rotation.rotate(Q, V), with_inverse, rtol=0, atol=1e-15)  # measured 1.1e-16
