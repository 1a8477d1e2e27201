"""An inertial unit against the numeric derivatives of an exact trajectory, at rest, and in free fall."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from rigid_body_sim import Body, Drag, Imu, Simulation, State, Wrench
from rigid_body_sim.values import rotation

RATE = 200.0
GRAVITY = np.array([0.3, -0.2, -9.8])
ARM, TURN = (0.4, -0.25, 0.15), rotation.normalize((0.5, -0.3, 0.7, 0.4))
BODY = Body(2.0, (0.3, 0.4, 0.5, 0.02, 0.01, -0.03), (0.1, -0.05, 0.2))
START = State((0.3, 0.2, 0.1), (0.9, 0.1, -0.3, 0.2), (1.0, -0.5, 0.3), (1.1, -2.0, 0.7))
WRENCH = Wrench(force_body=(3.0, 2.0, -3.0), torque_body=(0.2, -0.1, 0.3), force_world=(1.0, 0.5, 0.2))
# Central differences that are exact for polynomials of degree 8 and 9.
FIRST = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0.0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])
SECOND = np.array([-1 / 560, 8 / 315, -1 / 5, 8 / 5, -205 / 72, 8 / 5, -1 / 5, 8 / 315, -1 / 560])


def derivative(rows, weights):
    return sum(w * rows[i : len(rows) - 8 + i] for i, w in enumerate(weights))


@pytest.fixture(params=["exact", "drag"])
def flown(request):
    """A trajectory of a turning body, whose unit is far from its centre of mass, and where the unit was."""
    drag = {"drag": Drag(linear=(0.5, 0.7, 0.3), angular_linear=(0.02, 0.01, 0.03))} if request.param == "drag" else {}
    sim = Simulation(BODY, START, rate=RATE, gravity=GRAVITY, sensors=[Imu("imu", 0.0, ARM, TURN)], rtol=1e-13, **drag)
    sim.set_wrench(WRENCH)
    run = sim.run(steps=120)
    return run, run.position + rotation.rotate_each(run.orientation, np.array(ARM))


def test_specific_force_is_the_second_derivative_of_its_own_place_less_gravity(flown):
    """Measured: 3.7e-11 m/s² of 1.8, the round-off of the differences."""
    run, place = flown
    force_world = derivative(place, SECOND) * RATE**2 - GRAVITY
    q = np.array([rotation.multiply(one, TURN) for one in run.orientation[4:-4]])
    found = rotation.rotate_each(q, run.sense("imu").values[4:-4, 3:])
    assert_allclose(found, force_world, rtol=0, atol=2e-10)
    assert np.abs(force_world + GRAVITY - derivative(run.position, SECOND) * RATE**2).max() > 1.0, "no lever arm"


def test_rates_are_those_of_its_own_axes(flown):
    """R' Rᵀ of the unit's attitude. Measured: 1.6e-13 rad/s of 3.4."""
    run, _ = flown
    axes = rotation.to_matrix_each(np.array([rotation.multiply(one, TURN) for one in run.orientation]))
    spin = np.swapaxes(axes[4:-4], 1, 2) @ derivative(axes, FIRST) * RATE
    expected = np.stack((spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]), axis=1)
    assert_allclose(run.sense("imu").values[4:-4, :3], expected, rtol=0, atol=1e-12)


@pytest.mark.no_numba
def test_it_shows_g_upwards_at_rest_and_nothing_in_free_fall():
    """REP-145: +g along what points up."""
    sim = Simulation(
        Body(2.0, (0.1, 0.2, 0.3)), gravity=(0.0, 0.0, -9.8), sensors=[Imu("imu"), Imu("side", 0.0, ARM, TURN)]
    )
    assert_array_equal(sim.sense("imu"), np.zeros(6))
    sim.set_wrench(Wrench(force_world=(0.0, 0.0, 19.6)))
    assert_array_equal(sim.sense("imu"), (0.0, 0.0, 0.0, 0.0, 0.0, 9.8))
    assert_allclose(sim.sense("side")[3:], rotation.rotate_back(TURN, (0.0, 0.0, 9.8)), rtol=1e-15)


@pytest.mark.no_numba
def test_a_unit_on_a_spinning_wheel_feels_the_pull_inwards():
    """ω² r towards the axis, and ω' r along the rim."""
    body, w, r = Body(1.0, (0.2, 0.2, 0.4)), 3.0, 0.5
    sim = Simulation(body, State(angular_velocity=(0.0, 0.0, w)), sensors=[Imu("imu", 0.0, (r, 0.0, 0.0))])
    sim.set_wrench(Wrench(torque_body=(0.0, 0.0, 0.8)))
    assert_allclose(sim.sense("imu"), (0.0, 0.0, w, -(w**2) * r, 2.0 * r, 0.0), rtol=1e-15, atol=1e-15)
