"""Misprints of the theory chapter in what the package computes: the printed form fails, the package's holds."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rigid_body_sim import Body, Simulation, State
from rigid_body_sim.kernels import model as layout
from rigid_body_sim.mass.density import of_solid
from rigid_body_sim.terms import Terms
from rigid_body_sim.theory import dynamics, quaternion
from rigid_body_sim.values import inertia, rotation
from rigid_body_sim.values.wrench import Wrench

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
    euler = Terms(Body(1.0, MOMENTS), (0, 0, 0)).model(Wrench())[layout.EULER : layout.EULER + 3]
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
    with_inverse = rotation.multiply(rotation.multiply(Q, (0, *V)), quaternion.inverse(Q))[1:]
    assert_allclose(printed, with_conjugate, rtol=0, atol=1e-14)  # measured 1.5e-15
    assert abs(printed - with_inverse).max() > 1.0  # measured 5.6
    assert_allclose(printed / rotation.norm_squared(Q), with_inverse, rtol=0, atol=1e-15)  # measured 2.2e-16
    assert_allclose(rotation.rotate(Q, V), with_inverse, rtol=0, atol=1e-15)  # measured 1.1e-16


def test_2_4_1_needs_skew_matrices_where_it_prints_products_of_vectors():
    """−Σ m r·r ω, the only reading of lines 3 and 4 as printed that gives a vector, is no angular momentum."""
    masses = np.array((0.5, 1.0, 2.0))
    positions = np.array(((0.3, -0.1, 0.2), (0.1, 0.4, -0.3), (-0.2, 0.2, 0.5)))
    L = dynamics.angular_momentum_of_points(masses, positions, np.cross(RATES, positions))
    with_skew = -sum(m * rotation.skew(r) @ rotation.skew(r) @ RATES for m, r in zip(masses, positions, strict=True))
    printed = -sum(m * (r @ r) * RATES for m, r in zip(masses, positions, strict=True))
    assert_allclose(with_skew, L, rtol=0, atol=1e-15)  # measured 0
    assert_allclose(inertia.of_point_masses(masses, positions) @ RATES, L, rtol=0, atol=1e-15)  # measured 1.1e-16
    assert np.abs(printed - L).max() > 1.0  # measured 2.8; it even points the other way
    assert printed @ L < 0.0


def test_dL_of_2_4_4_adds_up_to_an_angular_momentum_and_not_to_an_angular_acceleration():
    """A box that turns at a constant rate has no angular acceleration, and yet ∭ dL = I ω."""
    lower, upper, density = (-0.1, -0.2, -0.3), (0.1, 0.2, 0.3), 5.0
    n = 20
    cell = [np.linspace(a, b, n, endpoint=False) + (b - a) / (2 * n) for a, b in zip(lower, upper, strict=True)]
    r = np.stack(np.meshgrid(*cell), axis=-1).reshape(-1, 3)
    elements = np.full(len(r), density * 0.2 * 0.4 * 0.6 / n**3)  # ρ dV
    total = dynamics.angular_momentum_of_points(elements, r, np.cross(RATES, r))
    box = of_solid(density, lower, upper)
    assert_allclose(total, box.inertia @ RATES, rtol=3e-3)  # measured 2.5e-3 = 1/n²
    steady = dynamics.angular_momentum(box.inertia, RATES)
    torque = np.cross(RATES, steady)  # what keeps the rate constant
    acceleration = dynamics.angular_acceleration_euler(box.inertia, RATES, torque)
    assert_allclose(acceleration, 0.0, rtol=0, atol=1e-15)  # measured 0
    assert np.linalg.norm(total) > 0.01  # measured 0.014


def test_2_5_4_needs_R_behind_each_skew_matrix():
    """Printed R⁻¹ω* is no skew matrix of anything; R⁻¹ω*R is that of ω in body axes, and (2.5.5) follows."""
    q = rotation.normalize(Q)
    R, tensor, torque = rotation.to_matrix(q), np.diag(MOMENTS), np.array((0.3, 0.1, -0.2))
    w = R @ RATES
    alpha = dynamics.angular_acceleration_from_momentum(tensor, q, inertia.turned(tensor, q) @ w, torque)
    right = R.T @ rotation.skew(w) @ R
    printed = R.T @ rotation.skew(w)
    assert_allclose(right, rotation.skew(RATES), rtol=0, atol=1e-15)  # measured 4.4e-16
    expected = tensor @ R.T @ alpha
    assert_allclose(R.T @ torque - (right @ tensor - tensor @ right) @ RATES, expected, rtol=0, atol=1e-15)  # 8.3e-17
    assert np.abs(R.T @ torque - (printed @ tensor - tensor @ printed) @ RATES - expected).max() > 0.1  # measured 0.27


ANGLE = 0.4
E1 = np.array((0.6, 0.0, 0.8))
AXIS = np.array((0.0, 1.0, 0.0))
E2 = rotation.rotate(rotation.from_axis_angle(AXIS, ANGLE), E1)
V1, V2 = np.array((0.0, *E1)), np.array((0.0, *E2))


def test_quaternion_of_two_unit_vectors_is_2_7_14_to_2_7_17():
    q = rotation.multiply(V2, rotation.conjugate(V1))
    assert_allclose(q, (E1 @ E2, *np.cross(E1, E2)), rtol=0, atol=1e-15)  # measured 0
    assert_allclose(q, (np.cos(ANGLE), *np.sin(ANGLE) * AXIS), rtol=0, atol=1e-15)  # measured 1.1e-16


def test_2_7_18_relates_V2_and_not_its_conjugate_to_the_turned_vector():
    """(q V₁ q̄) V̄₂ = V₂ V̄₁: q V₁ q̄ lies beyond V₂ as V₂ lies beyond V₁, so q turns by twice the angle."""
    q = rotation.multiply(V2, rotation.conjugate(V1))
    turned = rotation.multiply(rotation.multiply(q, V1), rotation.conjugate(q))
    assert_allclose(rotation.multiply(turned, rotation.conjugate(V2)), q, rtol=0, atol=1e-15)  # measured 1.1e-16
    assert angle(turned[1:], E2) == pytest.approx(ANGLE, rel=1e-14, abs=0)  # measured 2.8e-16: V₂ and q V₁ q̄
    assert angle(E1, E2) == pytest.approx(ANGLE, rel=1e-14, abs=0)  # measured 2.8e-16: V₁ and V₂
    assert angle(turned[1:], E1) == pytest.approx(2 * ANGLE, rel=1e-14, abs=0)  # measured 2.8e-16
    conjugate_of_V2, conjugate_of_V1 = rotation.conjugate(V2)[1:], rotation.conjugate(V1)[1:]
    assert angle(turned[1:], conjugate_of_V2) == pytest.approx(np.pi - ANGLE)  # the printed pair, 2.7 rad apart
    assert angle(E2, conjugate_of_V1) == pytest.approx(np.pi - ANGLE)  # and that of the text below it


def angle(a, b):
    """Angle [rad] between two unit vectors."""
    return np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)
