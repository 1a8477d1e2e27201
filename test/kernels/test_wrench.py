"""The kernels' view of a held wrench against a direct sum over forces and their arms (theory 2.3.4)."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rigid_body_sim import Body, Drag, Ground, Tether, Wrench
from rigid_body_sim.effects import ground as of_ground
from rigid_body_sim.effects import tether
from rigid_body_sim.kernels import model as layout
from rigid_body_sim.kernels import wrench as wrench_kernels
from rigid_body_sim.terms import Terms
from rigid_body_sim.values import rotation

pytestmark = pytest.mark.no_numba

BODY = Body(2.5, (0.31, 0.42, 0.53, -0.04, 0.06, 0.03), (0.07, -0.04, 0.05))
GRAVITY = np.array((0.3, -0.2, -9.81))
DOWN = (0.2, -0.4, -1.0)
ONE_POINT = [((0.4, 0.0, 0.1), DOWN)]
PARALLEL = [((0.4, 0.0, 0.1), DOWN), ((-0.2, 0.3, 0.0), (-0.4, 0.8, 2.0)), ((0.0, 0.1, 0.5), (0.0, 0.0, 0.0))]
OBLIQUE = [((0.4, 0.0, 0.1), DOWN), ((-0.2, 0.3, 0.0), (0.4, 0.1, -0.2)), ((0.0, -0.35, -0.15), (-0.3, 0.5, 0.1))]
BODY_PART = {"force_body": (0.9, -0.4, 1.3), "torque_body": (0.06, 0.04, -0.08)}
WORLD_TORQUE = {"torque_world": (-0.07, 0.1, 0.05)}

WRENCHES = {  # the wrench, and how many carried vectors it needs
    "none": (Wrench(), 0),
    "body axes": (Wrench(**BODY_PART), 0),
    "world axes": (Wrench(force_world=(-0.8, 1.7, 12.1), **WORLD_TORQUE), 1),
    "one point": (Wrench(points=ONE_POINT), 1),
    "parallel forces": (Wrench(points=PARALLEL), 1),
    "oblique forces": (Wrench(points=OBLIQUE), 3),
    "two oblique forces": (Wrench(points=OBLIQUE[:2]), 3),
    "the last one oblique": (Wrench(points=[*PARALLEL, OBLIQUE[2]]), 3),
    "one point and a world torque": (Wrench(points=ONE_POINT, **WORLD_TORQUE), 3),
    "zero force first": (Wrench(points=[((0.1, 0.2, 0.3), (0.0, 0.0, 0.0)), *ONE_POINT]), 3),
    "zero force alone": (Wrench(points=[((0.1, 0.2, 0.3), (0.0, 0.0, 0.0))]), 3),
    "everything": (Wrench(force_world=(-0.8, 1.7, 12.1), points=OBLIQUE, **BODY_PART, **WORLD_TORQUE), 3),
}
over_all_wrenches = pytest.mark.parametrize(("wrench", "carried"), WRENCHES.values(), ids=WRENCHES)


CENTRED = Body(1.0, (0.1, 0.2, 0.25))
over_single_components = pytest.mark.parametrize(
    "torque", [*np.eye(3).tolist(), *(-np.eye(3)).tolist()], ids=["x", "y", "z", "-x", "-y", "-z"]
)


def reduced(wrench):
    model = Terms(BODY, GRAVITY).model(wrench)
    wrench_kernels.reduce_wrench(model)
    return model


def direct_sum(wrench, q_world_body):
    """Force and torque about the centre of mass [world], each force with its own arm."""
    R, c = rotation.to_matrix(q_world_body), BODY.center_of_mass
    force = R @ wrench.force_body + wrench.force_world + BODY.mass * GRAVITY
    torque = R @ (wrench.torque_body - np.cross(c, wrench.force_body)) + wrench.torque_world
    for point, at_point in wrench.points:
        force = force + at_point
        torque = torque + np.cross(R @ (point - c), at_point)
    return force, torque


@over_all_wrenches
@pytest.mark.parametrize("seed", range(10))
def test_force_and_torque_are_the_direct_sum_at_any_attitude(wrench, carried, seed):
    q_world_body = rotation.normalize(np.random.default_rng(seed).normal(size=4))
    q = rotation.multiply(q_world_body, BODY.q_body_principal)
    model = reduced(wrench)
    force, torque = direct_sum(wrench, q_world_body)
    assert_allclose(wrench_kernels.force_world(model, *q), force, rtol=0, atol=3e-14)  # measured 3.6e-15
    found = rotation.rotate(q, wrench_kernels.torque_principal(model, *q))
    assert_allclose(found, torque, rtol=0, atol=3e-15)  # measured 7.8e-16


@over_all_wrenches
def test_only_as_many_vectors_are_carried_as_the_wrench_needs(wrench, carried):
    assert reduced(wrench)[layout.N_CARRIED] == carried


@pytest.mark.parametrize(
    ("name", "closed"), [("none", 1), ("world axes", 1), ("body axes", 0), ("one point", 0), ("everything", 0)]
)
def test_angular_momentum_is_a_closed_form_only_when_all_torque_is_fixed_in_the_world(name, closed):
    centred = Body(1.0, (0.1, 0.2, 0.25))
    model = Terms(centred, GRAVITY).model(WRENCHES[name][0])
    wrench_kernels.reduce_wrench(model)
    assert model[layout.ONLY_WORLD_TORQUE] == closed


@over_single_components
def test_torque_of_one_component_is_noticed_in_either_axes(torque):
    in_world, in_body = (
        Terms(CENTRED, GRAVITY).model(Wrench(**{name: torque})) for name in ("torque_world", "torque_body")
    )
    wrench_kernels.reduce_wrench(in_world)
    assert (in_world[layout.N_CARRIED], in_world[layout.ONLY_WORLD_TORQUE]) == (1, 1)
    wrench_kernels.reduce_wrench(in_body)
    assert (in_body[layout.N_CARRIED], in_body[layout.ONLY_WORLD_TORQUE]) == (0, 0)


def test_everything_given_has_a_place_of_its_own_in_the_model():
    drag = Drag((1, 2, 3), (4, 5, 6), (7, 8, 9), (10, 11, 12))
    tethers = [Tether((k, 2, 3), (4, 5, 6), 7.0, 8.0, 9.0) for k in range(3)]
    wrench = WRENCHES["everything"][0]
    ground = Ground(stiffness=1e4, contacts=((1, 2, 3), (4, 5, 6)))
    model = Terms(BODY, GRAVITY, rtol=1e-7, drag=drag, tethers=tethers, forces=PARALLEL, ground=ground).model(wrench)
    acting = [*wrench.points, *(one for one in PARALLEL if any(one[1]))]
    x, y, z = BODY.principal_moments
    given = {
        layout.MASS: BODY.mass,
        layout.MOMENTS: BODY.principal_moments,
        layout.Q_BODY_PRINCIPAL: BODY.q_body_principal,
        layout.CENTER_OF_MASS: BODY.center_of_mass,
        layout.GRAVITY: GRAVITY,
        layout.WRENCH: wrench.values,
        layout.N_LEVERS: len(acting),
        layout.EULER: ((y - z) / x, (z - x) / y, (x - y) / z),
        layout.RTOL: 1e-7,
        layout.MOST_MOMENTUM: layout.FASTEST * BODY.mass,
        layout.SAFE_ANGULAR_MOMENTUM: layout.FASTEST * min(x, y, z) / (1.0 + math.hypot(*BODY.center_of_mass)),
        layout.LEVERS: [(*point, *force, 1.0) for point, force in acting],
        len(model) - 66: drag.values,
        len(model) - 54: [tether.EFFECT.row(one, BODY) for one in tethers],
        len(model) - 24: of_ground.EFFECT.row(ground, BODY),
    }
    for at, values in given.items():
        assert model[at : at + np.size(values)].tolist() == np.ravel(values).tolist(), at
    assert sum(map(np.size, given.values())) == len(model) - (layout.LEVERS - layout.LOADS), "given places overlap"
    # drag, tethers and contacts: how many, where, and where their memory would be; it is empty, and no actuators are
    loads = 1, len(model) - 66, len(model), 3, len(model) - 54, len(model), 2, len(model) - 24, len(model)
    assert tuple(model[layout.LOADS : layout.LOADS + 9]) == loads
    assert model[layout.MEMORY] == len(model) and model[layout.DRIVE] == 0.0


def test_principal_axes_lead_back_to_body_axes():
    model, v = reduced(Wrench()), (0.3, -0.7, 0.2)
    assert_allclose(layout.to_body(model, *layout.to_principal(model, *v)), v, rtol=0, atol=1e-15)  # measured 1.1e-16
    assert_allclose(layout.to_body(model, *v), rotation.rotate(BODY.q_body_principal, v), rtol=0, atol=1e-15)


def test_force_at_the_origin_turns_a_body_whose_centre_of_mass_is_elsewhere():
    model = reduced(Wrench(force_body=(0.9, -0.4, 1.3)))
    torque = rotation.rotate(BODY.q_body_principal, model[layout.TORQUE : layout.TORQUE + 3])
    assert_allclose(torque, np.cross((0.9, -0.4, 1.3), BODY.center_of_mass), rtol=0, atol=1e-16)  # measured 6.9e-18
    assert model[layout.ONLY_WORLD_TORQUE] == 0


def test_reducing_twice_changes_nothing():
    model = reduced(WRENCHES["everything"][0])
    again = model.copy()
    wrench_kernels.reduce_wrench(again)
    assert (model == again).all()


def test_angular_velocity_is_that_of_theory_2_4_3():
    q_world_body = rotation.normalize((0.4, 0.2, -0.8, 0.4))
    R, L = rotation.to_matrix(q_world_body), np.array((0.3, -0.5, 0.8))
    expected = np.linalg.solve(BODY.inertia, R.T @ L)
    q = rotation.multiply(q_world_body, BODY.q_body_principal)
    found = rotation.rotate(BODY.q_body_principal, layout.rates_principal(reduced(Wrench()), *q, *L))
    assert_allclose(found, expected, rtol=0, atol=3e-15)  # measured 6.7e-16
