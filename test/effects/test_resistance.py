"""Drag and tethers: closed forms, equilibria, energy, and the exact derivative that implicit integrators use."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from rigid_body_sim import Body, Drag, Simulation, State, Tether, Wrench
from rigid_body_sim.integrators import substep
from rigid_body_sim.kernels import motion
from rigid_body_sim.kernels import wrench as wrench_kernels
from rigid_body_sim.kernels.tuples import Quat
from rigid_body_sim.terms import Terms
from rigid_body_sim.theory import invariants
from rigid_body_sim.values import rotation
from rigid_body_sim.values.state import flatten

BODY = Body(2.0, (0.3, 0.4, 0.5, 0.02, -0.03, 0.04), (0.05, -0.02, 0.03))
BALL = Body(2.0, (0.1, 0.1, 0.1))
TURNED = (0.3, -0.5, 0.2, 0.8)
DRAG = Drag((1.0, 2.0, 3.0), (4.0, 5.0, 6.0), (0.1, 0.2, 0.3), (0.4, 0.5, 0.6))
TETHERS = [
    Tether((0.1, 0.2, 0.3), (1.0, 1.0, 2.0), 0.5, 30.0, 2.0),
    Tether((-0.1, 0, 0.3), (-1, 1, -2), 3.9, 30.0, 2.0, False),
]


def run(seconds, state, body=BALL, rate=200.0, integrator="rosenbrock", **what):
    sim = Simulation(body, state, rate=rate, integrator=integrator, rtol=1e-10, **what)
    sim.step(round(seconds * rate))
    return sim.state


def test_linear_drag_slows_exponentially_along_each_body_axis():
    v_body = np.array((1.0, -2.0, 0.5))
    start = State(orientation=TURNED, velocity=rotation.rotate(TURNED, v_body))
    end = run(1.5, start, drag=Drag(linear=(1.0, 3.0, 0.2)))
    expected = rotation.rotate(TURNED, v_body * np.exp(-1.5 / 2.0 * np.array((1.0, 3.0, 0.2))))
    assert_allclose(end.velocity, expected, rtol=0, atol=1e-9)  # measured 3e-12


def test_quadratic_drag_slows_hyperbolically():
    end = run(1.5, State(velocity=(3.0, 0.0, 0.0)), drag=Drag(quadratic=(0.8, 0.0, 0.0)))
    assert end.velocity[0] == pytest.approx(3.0 / (1.0 + 0.8 * 3.0 * 1.5 / 2.0), rel=1e-9)  # measured 2e-12
    assert end.position[0] == pytest.approx(2.0 / 0.8 * math.log(1.0 + 0.8 * 3.0 * 1.5 / 2.0), rel=1e-9)  # 1e-12


def test_angular_drag_slows_a_spin():
    linear = run(1.5, State(angular_velocity=(0, 0, 4.0)), drag=Drag(angular_linear=(0, 0, 0.05)))
    assert linear.angular_velocity[2] == pytest.approx(4.0 * math.exp(-0.05 * 1.5 / 0.1), rel=1e-9)
    quadratic = run(1.5, State(angular_velocity=(0, 0, 4.0)), drag=Drag(angular_quadratic=(0, 0, 0.05)))
    assert quadratic.angular_velocity[2] == pytest.approx(4.0 / (1.0 + 0.05 * 4.0 * 1.5 / 0.1), rel=1e-9)


def test_mass_on_a_spring_swings_as_a_cosine():
    spring = Tether(anchor=(0, 0, 0), rest_length=0.0, stiffness=8.0, slack=False)  # ω = 2 rad/s
    end = run(3.0, State(position=(0.0, 0.0, -1.0)), tethers=[spring])
    assert_allclose(end.position, (0, 0, -math.cos(6.0)), rtol=0, atol=1e-8)  # measured 1e-11


def test_body_hangs_still_below_its_anchor():
    tether = Tether((0, 0, 0.2), (0, 0, 0), rest_length=1.0, stiffness=2000.0, damping=200.0)
    end = run(
        30.0,
        State(position=(0.01, 0, -1.1)),
        gravity=(0, 0, -9.80665),
        tethers=[tether],
        drag=Drag((2.0,) * 3, angular_linear=(0.1,) * 3),
    )
    assert_allclose(end.position, (0, 0, -1.2 - 2.0 * 9.80665 / 2000.0), rtol=0, atol=1e-6)
    assert_allclose(end.velocity, 0.0, rtol=0, atol=1e-6)


def test_slack_tether_neither_pulls_nor_pushes():
    tether = Tether(anchor=(0, 0, 0), rest_length=5.0, stiffness=1e4, damping=1e3)
    end = run(1.0, State(position=(1.0, 0, 0), velocity=(0.5, 0.25, 0)), tethers=[tether])
    assert_allclose(end.velocity, (0.5, 0.25, 0), rtol=0, atol=1e-13)
    stick = Tether(anchor=(0, 0, 0), rest_length=5.0, stiffness=1e4, damping=1e3, slack=False)
    assert run(0.01, State(position=(1.0, 0, 0)), tethers=[stick]).velocity[0] > 1.0  # pushed towards its length


def test_resistance_only_takes_energy():
    sim = Simulation(
        BODY, State(velocity=(1, 2, 3), angular_velocity=(3, -2, 1)), integrator="rk4", rate=1000.0, drag=DRAG
    )
    energies = []
    for _ in range(50):
        energies.append(invariants.kinetic_energy(BODY, sim.state))
        sim.step(20)
    assert (np.diff(energies) < 0.0).all()


def jacobian_and_differences(terms, wrench, state):
    """Derivative (12, 12) of the slope by the twelve unknowns: as given, and from differences of the fourth order."""
    model = terms.model(wrench)
    wrench_kernels.reduce_wrench(model)
    y, work = flatten(state, model), np.zeros(12 + 13 + 12)

    def slope(z):
        work[:12] = z
        substep.slope(terms.kernels, y, model, work, 0, 12, 25)
        return work[25:].copy()

    h, matrix = 1e-4, np.zeros(144)
    motion.jacobian(terms.kernels, model, y, 0, False, matrix, 0)
    steps = h * np.eye(12)
    differences = [(8 * (slope(d) - slope(-d)) - slope(2 * d) + slope(-2 * d)) / (12 * h) for d in steps]
    return matrix.reshape(12, 12), np.transpose(differences)


@pytest.mark.no_numba
def test_jacobian_is_the_derivative_of_the_motion():
    """One wrong sign shows as an error of order 1."""
    wrench = Wrench((1, 2, 3), (0.1, 0.2, 0.3), (1, 0, -1), (0.3, 0.2, 0.1), [((0.1, 0.2, 0.3), (3, 2, 1))])
    terms = Terms(BODY, (0, 0, -9.8), drag=DRAG, tethers=TETHERS)
    state = State((0.3, 0.2, 0.1), TURNED, (1.0, -0.5, 0.3), (0.4, -1.0, 0.7))
    assert_allclose(*jacobian_and_differences(terms, wrench, state), rtol=0, atol=1e-8)  # measured 2e-10


@pytest.mark.no_numba
def test_spring_of_no_rest_length_pulls_alike_all_round_its_anchor():
    """There it has no direction: F = −k (p − anchor), whose derivative is the same from all sides."""
    spring = Tether((0.1, 0.2, 0.3), (1.0, 1.0, 2.0), stiffness=30.0, slack=False)
    state = State(np.subtract((1.0, 1.0, 2.0), (0.1, 0.2, 0.3)), velocity=(1.0, -0.5, 0.3))
    terms = Terms(Body(2.0, (0.3, 0.4, 0.5)), (0, 0, 0), tethers=[spring])
    found, differences = jacobian_and_differences(terms, Wrench(), state)
    assert_allclose(found, differences, rtol=0, atol=1e-8)  # measured 3e-12
    assert_allclose(found[6:9, 0:3], -30.0 * np.eye(3), rtol=0, atol=1e-13)


@pytest.mark.no_numba
@pytest.mark.parametrize("slack", [True, False])
def test_tether_of_some_length_at_its_anchor_pulls_and_pushes_nowhere(slack):
    """It has no direction there, and gives the implicit integrators none to lean on."""
    tether = Tether(anchor=(1.0, 1.0, 2.0), rest_length=0.5, stiffness=30.0, damping=2.0, slack=slack)
    state = State((1.0, 1.0, 2.0), velocity=(1.0, -0.5, 0.3))
    terms = Terms(BALL, (0, 0, 0), tethers=[tether])
    model = terms.model(Wrench())
    y, matrix = flatten(state, model), np.zeros(144)
    motion.jacobian(terms.kernels, model, y, 0, True, matrix, 0)
    assert_array_equal(motion.loads(terms.kernels, model, y, 0, Quat(1.0, 0.0, 0.0, 0.0)), 0.0)
    assert_array_equal(matrix.reshape(12, 12)[6:], 0.0)


@pytest.mark.no_numba
@pytest.mark.parametrize("bad", [(-1.0, 0, 0), (0, -1e-9, 0), (math.nan, 0, 0), (1.0, 2.0)])
def test_drag_that_is_none_is_refused(bad):
    with pytest.raises(ValueError, match="drag quadratic"):
        Drag(quadratic=bad)


@pytest.mark.no_numba
@pytest.mark.parametrize("name", ["rest_length", "stiffness", "damping"])
def test_tether_that_is_none_is_refused(name):
    with pytest.raises(ValueError, match=f"tether {name} -1 is not a finite number of at least 0"):
        Tether(**{name: -1.0})


def test_integrator_that_leaves_drag_out_is_refused():
    with pytest.raises(
        ValueError, match="integrator 'taylor' leaves out drag, tethers, ground and added mass; choose one of auto, "
    ):
        Simulation(BALL, drag=DRAG, integrator="taylor")
