"""Added mass: a reference of 30 digits, what Kirchhoff's equations keep, Fossen's, closed forms, any ratio."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rigid_body_sim import Actuator, AddedMass, Body, Drag, Fluid, Scene, Simulation, State, Tether, Wrench
from rigid_body_sim.integrators import substep
from rigid_body_sim.kernels import motion
from rigid_body_sim.kernels.wrench import reduce_wrench
from rigid_body_sim.report.reference import load
from rigid_body_sim.terms import Terms
from rigid_body_sim.theory import invariants
from rigid_body_sim.values import rotation
from rigid_body_sim.values.state import flatten

REFERENCE = load.stored("added_mass.json")
SCENE = REFERENCE["scene"]
RATIOS = [name for name in REFERENCE if name != "scene"]
BODY = Body(2.0, (0.3, 0.4, 0.5, 0.02, 0.01, -0.03), (0.02, -0.01, 0.03))
START = State((0.3, 0.2, 0.1), (0.9, 0.1, -0.3, 0.2), (1.0, -0.5, 0.3), (0.4, -1.0, 0.7))
CURRENT = (0.7, -1.5, 0.4)
GENERAL = AddedMass(tuple(REFERENCE["1e0"]["added_mass"]))


def of_reference(ratio, **options):
    body = Body(SCENE["mass"], SCENE["inertia"], SCENE["center_of_mass"])
    start = State((0, 0, 0), SCENE["orientation"], SCENE["velocity"], SCENE["angular_velocity"])
    sim = Simulation(
        body,
        start,
        gravity=SCENE["gravity"],
        drag=Drag(linear=SCENE["drag"], angular_linear=SCENE["angular_drag"]),
        forces=[(SCENE["lift_point"], SCENE["lift"])],
        fluid=Fluid(SCENE["fluid_velocity"]),
        added_mass=REFERENCE[ratio]["added_mass"],
        **options,
    )
    sim.set_wrench(Wrench(force_body=SCENE["force_body"], torque_body=SCENE["torque_body"]))
    return sim


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize(("rtol", "allowed"), [(1e-9, 4e-10), (1e-12, 1e-12)])
def test_against_a_reference_of_30_digits(ratio, rtol, allowed):
    """A general matrix, a centre of mass off the origin, a current; see bench/reference/make_added_mass.py.

    By ``auto``, 2 s: measured 1.2e-10 at rtol 1e-9 and 1.4e-14 at 1e-12 at most in steps of 1 s; in steps of 0.1 s
    2.0e-11 and 2.7e-13.
    """
    expected = np.array(REFERENCE[ratio]["end"], float)
    for rate in (1.0, 10.0):
        sim = of_reference(ratio, rate=rate, rtol=rtol)
        sim.step(round(SCENE["time"] * rate))
        assert_allclose(sim.state.values[:13], expected, rtol=0, atol=allowed)


def test_implicit_method_agrees_with_the_reference():
    """Its exact Jacobian carries the error estimate; measured 3e-10 at rtol 1e-9."""
    for ratio in ("1e0", "1e2"):
        sim = of_reference(ratio, rate=10.0, rtol=1e-9, integrator="rosenbrock")
        sim.step(20)
        assert_allclose(sim.state.values[:13], np.array(REFERENCE[ratio]["end"], float), rtol=0, atol=1e-9)


def momenta(sim, u=(0.0, 0.0, 0.0)):
    """Momentum, and angular momentum about a point that drifts with the fluid, of body and fluid, world axes."""
    state, one = sim.state, sim.terms.given["added_mass"]
    R = rotation.to_matrix(state.orientation)
    fluid = one.matrix @ np.concatenate((R.T @ (state.velocity - u), state.angular_velocity))
    p = R @ fluid[:3]
    x = state.position - np.multiply(u, sim.time)
    own = state.momentum - sim.body.mass * np.asarray(u)
    center = invariants.center_of_mass_position(sim.body, state) - np.multiply(u, sim.time)
    return own + p, state.angular_momentum + np.cross(center, own) + R @ fluid[3:] + np.cross(x, p)


@pytest.mark.parametrize("u", [(0.0, 0.0, 0.0), CURRENT])
@pytest.mark.parametrize("one", [GENERAL, AddedMass((55.0, 127.0, 145.7, 0.0, 12.0, 30.0))])
def test_energy_and_momenta_of_body_and_fluid_are_kept(one, u):
    """Without forces (Lamb 1932, section 119), in a current too; measured 2e-12 of each after 10 s at rtol 1e-12."""
    sim = Simulation(BODY, START, rate=10.0, rtol=1e-12, added_mass=one, fluid=Fluid(u))
    energy, (p, l), own = sim.kinetic_energy, momenta(sim, u), sim.state.momentum
    sim.step(100)
    assert sim.kinetic_energy == pytest.approx(energy, rel=1e-11)
    now = momenta(sim, u)
    assert_allclose(now[0], p, rtol=0, atol=1e-11 * np.linalg.norm(p))
    assert_allclose(now[1], l, rtol=0, atol=1e-11 * np.linalg.norm(l))
    assert np.linalg.norm(sim.state.momentum - own) > 0.05 * np.linalg.norm(own)  # the body alone keeps none


def coriolis(matrix, nu):
    """Fossen 2011, (3.46) and (6.44)."""
    first, second = rotation.skew(matrix[:3] @ nu), rotation.skew(matrix[3:] @ nu)
    return np.block([[np.zeros((3, 3)), -first], [-first, -second]])


@pytest.mark.no_numba
def test_accelerations_are_those_of_fossens_equations():
    """(8.2) about the body frame's origin, with C from each matrix, solved by numpy; measured 1e-15 of each."""
    sim = Simulation(BODY, START, gravity=(0.3, -0.2, -9.8), added_mass=GENERAL, fluid=Fluid(CURRENT))
    sim.set_wrench(Wrench(force_body=(1.0, -2.0, 0.5), torque_body=(0.3, 0.2, -0.1)))
    R, w, c = rotation.to_matrix(START.orientation), START.angular_velocity, rotation.skew(BODY.center_of_mass)
    m, flow = BODY.mass, R.T @ CURRENT
    own = np.block([[m * np.eye(3), -m * c], [m * c, BODY.inertia - m * c @ c]])
    nu = np.concatenate((R.T @ START.velocity, w))
    relative = nu - np.concatenate((flow, np.zeros(3)))
    weight = m * R.T @ (0.3, -0.2, -9.8)
    tau = np.array((1.0, -2.0, 0.5, 0.3, 0.2, -0.1)) + np.concatenate((weight, c @ weight))
    turning = np.concatenate((-np.cross(w, flow), np.zeros(3)))
    right = tau - coriolis(own, nu) @ nu - coriolis(GENERAL.matrix, relative) @ relative + GENERAL.matrix @ turning
    change = np.linalg.solve(own + GENERAL.matrix, right)
    expected = np.concatenate((R @ (change[:3] + np.cross(w, nu[:3])), change[3:]))
    assert_allclose(sim.acceleration, expected, rtol=0, atol=1e-13)


@pytest.mark.parametrize("ratio", [1e-6, 1.0, 1e3, 1e6, 1e12])
def test_any_ratio_to_the_mass_is_stable(ratio):
    """A ball that is pushed and turned: v = F t / (m + A), ω = τ t / (I + D). A second in one step or in 1000.

    Those who add the fluid's force from the last step's acceleration diverge from a ratio of 1 on. Measured 2e-14.
    """
    mass, moment = 2.0 * ratio, 0.1 * ratio
    for rate in (1.0, 1000.0):
        ball = Body(2.0, (0.1, 0.1, 0.1))
        sim = Simulation(ball, rate=rate, added_mass=(*(mass,) * 3, *(moment,) * 3))
        sim.set_wrench(Wrench(force_world=(3.0, 0.0, 0.0), torque_body=(0.0, 0.2, 0.0)))
        sim.step(round(rate))
        assert sim.state.velocity[0] == pytest.approx(3.0 / (2.0 + mass), rel=1e-12)
        assert sim.state.angular_velocity[1] == pytest.approx(0.2 / (0.1 + moment), rel=1e-12)


def test_bubble_rises_at_twice_gravity():
    """A sphere of next to no mass has half the added mass of what it displaces: a = 2 g (Lamb, section 92)."""
    displaced, mass = 1.0, 1e-6
    bubble = Body(mass, (1e-8,) * 3)
    sim = Simulation(
        bubble, rate=100.0, gravity=(0, 0, -9.8), forces=[((0, 0, 0), (0, 0, 9.8))], added_mass=(0.5,) * 3 + (0.0,) * 3
    )
    expected = 9.8 * (displaced - mass) / (mass + 0.5)
    sim.step(50)
    assert sim.state.velocity[2] == pytest.approx(expected * 0.5, rel=1e-12)  # measured 1e-15


def test_body_that_moves_broadside_swings_as_munks_moment_says():
    """Small swings of one that moves along y, the axis of the larger mass: ω² = p² (1/M_x − 1/M_y) / J."""
    m_x, m_y, j, speed = 3.0, 8.0, 0.9, 2.0
    body, swing = Body(2.0, (0.5, 0.6, 0.4)), 1e-5
    sim = Simulation(
        body, State(velocity=(0, speed, 0), angular_velocity=(0, 0, swing)), rate=100.0, rtol=1e-12,
        added_mass=(1.0, 6.0, 1.0, 0.1, 0.1, 0.5),
    )  # fmt: skip
    omega = m_y * speed * math.sqrt((1 / m_x - 1 / m_y) / j)
    for _ in range(20):
        sim.step(7)
        expected = swing * math.cos(omega * sim.time)
        assert sim.state.angular_velocity[2] == pytest.approx(expected, abs=1e-9 * swing)  # measured 3e-11


@pytest.mark.no_numba
def test_impulse_is_shared_with_the_fluid():
    """(M + M_A) Δν = J about the origin; measured 2e-16."""
    impulse = Wrench(force_body=(1.0, -2.0, 0.5), torque_body=(0.3, 0.2, -0.1))
    sim = Simulation(BODY, START, added_mass=GENERAL, fluid=Fluid(CURRENT))
    before = sim.state
    sim.apply_impulse(impulse)
    R, c, m = rotation.to_matrix(START.orientation), rotation.skew(BODY.center_of_mass), BODY.mass
    own = np.block([[m * np.eye(3), -m * c], [m * c, BODY.inertia - m * c @ c]])
    gain = R.T @ (sim.state.velocity - before.velocity), sim.state.angular_velocity - before.angular_velocity
    found = (own + GENERAL.matrix) @ np.concatenate(gain)
    assert_allclose(found, (1.0, -2.0, 0.5, 0.3, 0.2, -0.1), rtol=0, atol=1e-14)


def jacobian_of(terms, model, y):
    """The Jacobian, and differences of the fourth order."""
    matrix, work, h = np.zeros(144), np.zeros(37), 1e-4

    def slope(z):
        work[:12] = z
        substep.slope(terms.kernels, y, model, work, 0, 12, 25)
        return work[25:].copy()

    motion.jacobian(terms.kernels, model, y, 0, False, matrix, 0)
    differences = [(8 * (slope(d) - slope(-d)) - slope(2 * d) + slope(-2 * d)) / (12 * h) for d in h * np.eye(12)]
    return matrix.reshape(12, 12), np.transpose(differences)


def test_jacobian_is_exact_with_all_loads_at_once():
    """Drag in a current, a taut tether, a held wrench with a force at a point, gravity: by differences, 3e-10."""
    terms = Terms(
        BODY,
        (0.3, -0.2, -9.8),
        drag=Drag((1.0, 2.0, 3.0), (4.0, 5.0, 6.0), (0.1, 0.2, 0.3), (0.4, 0.5, 0.6)),
        tethers=[Tether((0.1, -0.2, 0.3), (0.5, 0.0, 2.0), 0.5, 40.0, 3.0, False)],
        fluid=Fluid(CURRENT),
        added_mass=GENERAL,
    )
    model = terms.model(Wrench((0.1, 0.2, -0.3), (0.1, 0.0, 0.3), (1, 2, 3), (0.02, 0, 0), [((1, 2, 0), (0, 1, 3))]))
    reduce_wrench(model)
    found, expected = jacobian_of(terms, model, flatten(START, model))
    assert_allclose(found, expected, rtol=0, atol=1e-8)


def test_six_numbers_are_the_diagonal_of_twenty_one():
    six, upper = (1.0, 2.0, 3.0, 0.4, 0.5, 0.6), np.zeros((6, 6))
    np.fill_diagonal(upper, six)
    states = []
    for values in (six, tuple(upper[np.triu_indices(6)].tolist())):
        sim = Simulation(BODY, START, rate=100.0, added_mass=values)
        sim.step(20)
        states.append(sim.save().state)
    assert states[0] == states[1]


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        (("x",) * 6, "is not a number"),
        ((1.0, 2.0, 3.0), "has 3 entries; give 6, the diagonal, or 21, the upper triangle row by row"),
        (
            (-5.5, 12.7, 14.57, 0.12, 0.12, 0.12),
            "is not positive semidefinite: .* negative energy; give the negative of",
        ),
        ((1.0, 1.5, *(0.0,) * 4, 1.0, *(0.0,) * 14), "is not positive semidefinite"),
        ((0.0, 1e-3, *(0.0,) * 4, 1.0, *(0.0,) * 14), "is not positive semidefinite"),
        ((1.0, 1.0, math.inf, 0.0, 0.0, 0.0), "is not finite"),
        ((1e308,) * 6, r"has an entry beyond 1e\+100; give smaller ones"),
    ],
)
def test_what_cannot_be_is_refused(values, reason):
    """In a sentence, by Simulation and by a scene, which names the parameter."""
    with pytest.raises(ValueError, match=rf"^added_mass .*{reason}"):
        Simulation(BODY, added_mass=values)
    with pytest.raises(ValueError, match=r"^parameter body\.added_mass .*(entr|semidefinite|not finite|not a number)"):
        Scene({"body.added_mass": list(values)})


@pytest.mark.no_numba
def test_semidefinite_matrix_is_taken():
    """A flat plate moves no fluid along itself, and a rank of one is enough."""
    rank_one = np.outer((1, 2, 3, 0, 1, 2), (1, 2, 3, 0, 1, 2))
    for values in ((0, 0, 4.0, 0, 0, 0), rank_one[np.triu_indices(6)]):
        sim = Simulation(BODY, START, rate=100.0, added_mass=values)
        energy = sim.kinetic_energy
        sim.step(100)
        assert sim.kinetic_energy == pytest.approx(energy, rel=1e-9)


def with_a_wheel(**options):
    """A wheel that spins already is sped up further."""
    wheel = Actuator("wheel", "wheel", axis=(1.0, 2.0, -1.0), min=-1.0, max=1.0, inertia=0.02, initial=150.0)
    sim = Simulation(BODY, START, rate=10.0, rtol=1e-12, added_mass=GENERAL, actuators=[wheel], **options)
    sim.set_actuators([0.5])
    return sim


def test_momenta_are_kept_where_a_wheel_spins_up():
    """Of body, wheel and fluid: what the motor does is inside. Measured 4e-14 after 2 s, by both methods."""
    for integrator in ("dop853", "rosenbrock"):
        sim = with_a_wheel(fluid=Fluid(CURRENT), integrator=integrator)
        p, l = momenta(sim, CURRENT)
        spin = sim.state.angular_velocity
        sim.step(20)
        now = momenta(sim, CURRENT)
        assert_allclose(now[0], p, rtol=0, atol=1e-12 * np.linalg.norm(p))
        assert_allclose(now[1], l, rtol=0, atol=1e-12 * np.linalg.norm(l))
        assert np.linalg.norm(sim.state.angular_velocity - spin) > 0.5


def test_jacobian_is_exact_where_a_wheel_spins():
    """The rate of the whole angular momentum changes with ω as that of body and wheel; by differences, 3e-10."""
    sim = with_a_wheel(gravity=(0.3, -0.2, -9.8))
    sim.step(1)
    found, expected = jacobian_of(sim.terms, sim._model, sim._state)
    assert_allclose(found, expected, rtol=0, atol=1e-8)
