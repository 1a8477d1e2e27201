"""Theory 2.7's warning: an integrated rotation matrix stops being a rotation, a quaternion does not."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rigid_body_sim import Body, Simulation, State
from rigid_body_sim.theory.rotation_matrix import departure, euler_step, nearest_rotation, spin
from rigid_body_sim.values import rotation

pytestmark = pytest.mark.no_numba

W = np.array((1.0, -2.0, 2.0))  # rad/s, world; |ω| = 3
H = 0.01


def test_matrix_decays_as_its_step_says():
    """The determinant grows by 1 + h² ω² in each step: after 1000 steps of 0.03 rad it is 2.46, not 1."""
    determinant, shape = departure(spin(W, H, 1000))
    assert determinant + 1.0 == pytest.approx((1.0 + (3.0 * H) ** 2) ** 1000, rel=1e-11)  # measured 9.6e-14
    assert determinant > 1.4  # measured 1.46
    assert shape > 1.2  # measured 1.30: lengths across ω grow by half


def test_smaller_steps_only_delay_the_decay():
    decays = [departure(spin(W, 10.0 / steps, steps))[0] for steps in (1000, 2000, 4000)]
    assert decays[0] / decays[1] == pytest.approx(2.0, abs=0.6)  # first order; measured 2.57 and 2.27
    assert decays[1] / decays[2] == pytest.approx(2.0, abs=0.3)


def test_matrix_made_orthonormal_again_is_a_rotation_by_a_wrong_angle():
    R = spin(W, H, 1000, orthonormalise=True)
    assert np.abs(departure(R)).max() < 1e-13  # measured 6e-16
    turned = rotation.from_axis_angle(W, 1000 * math.atan(3.0 * H))
    assert rotation.angle_between(rotation.from_matrix(R), turned) < 1e-12
    assert 1000 * (3.0 * H - math.atan(3.0 * H)) > 8e-3  # rad behind the true angle


def test_quaternion_stays_a_rotation_where_the_matrix_does_not():
    body, state = Body(1.0, (0.2, 0.2, 0.2)), State(angular_velocity=W)
    for integrator in ("taylor", "semi_implicit_euler", "matrix_euler"):
        sim = Simulation(body, state, rate=1.0 / H, integrator=integrator)
        sim.step(1000)
        assert np.abs(departure(rotation.to_matrix(sim.state.orientation))).max() < 1e-14
        assert abs(rotation.norm(sim.state.orientation) - 1.0) < 1e-15


def test_integrator_matrix_euler_takes_the_step_of_the_matrix():
    """Its closed form for the nearest rotation against the matrix itself, for a body whose ω changes."""
    body, h = Body(1.0, (0.1, 0.2, 0.25)), 0.05
    sim = Simulation(body, State((0, 0, 0), (0.4, 0.2, -0.8, 0.4), (0, 0, 0), (1.1, -2.0, 0.7)), rate=1.0 / h,
                     integrator="matrix_euler")  # fmt: skip
    R, momentum = rotation.to_matrix(sim.state.orientation), sim.state.angular_momentum
    for _ in range(20):
        w_world = R @ (R.T @ momentum / body.principal_moments)
        R = nearest_rotation(euler_step(R, w_world, h))
        sim.step()
        assert_allclose(rotation.to_matrix(sim.state.orientation), R, rtol=0, atol=5e-14)


def test_reflection_has_no_nearest_rotation():
    with pytest.raises(ValueError, match="has no nearest rotation; its determinant must be greater than zero"):
        nearest_rotation(np.diag((1.0, 1.0, -1.0)))


def test_nearest_rotation_is_that_of_the_polar_decomposition():
    """Of R S with a symmetric positive S it is R, whether S stretches or shrinks."""
    R = rotation.to_matrix((0.4, 0.2, -0.8, 0.4))
    for size in (0.1, 1.0, 10.0):
        S = size * np.array(((2.0, 0.3, -0.1), (0.3, 1.5, 0.2), (-0.1, 0.2, 0.7)))
        assert_allclose(nearest_rotation(R @ S), R, rtol=0, atol=5e-15)  # measured 5.6e-16
