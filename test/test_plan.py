"""The plan: whatever ``auto`` leaves out changes nothing but the cost, and the choice follows what acts."""

import itertools
import math
from dataclasses import FrozenInstanceError

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from rigid_body_sim import Body, Drag, Simulation, SimulationError, State, Tether, Wrench
from rigid_body_sim.integrators import REGISTRY
from rigid_body_sim.scene import plan
from rigid_body_sim.terms import Terms
from rigid_body_sim.values import rotation

pytestmark = pytest.mark.no_numba

RATE, STEPS = 100.0, 50
OFFSET = (0.07, -0.04, 0.05)
BODIES = {
    "sphere": Body(2.5, (0.4, 0.4, 0.4)),
    "symmetric": Body(2.5, (0.3, 0.3, 0.5)),
    "general": Body(2.5, (0.31, 0.42, 0.53, -0.04, 0.06, 0.03), OFFSET),
}
STATES = {
    "at rest": State((1.0, 2.0, 3.0), (0.4, 0.2, -0.8, 0.4), (-0.5, 0.2, 1.0)),
    "spinning": State((1.0, 2.0, 3.0), (0.4, 0.2, -0.8, 0.4), (-0.5, 0.2, 1.0), (1.1, -2.0, 0.7)),
}
WRENCHES = {
    "nothing": Wrench(),
    "world force": Wrench(force_world=(-0.8, 1.7, 2.1)),
    "body force": Wrench(force_body=(0.9, -0.4, 1.3)),
    "body torque": Wrench(torque_body=(0.06, 0.04, -0.08)),
    "world torque": Wrench(torque_world=(-0.07, 0.1, 0.05)),
    "points": Wrench(points=[((0.4, 0.0, 0.1), (0.2, -0.4, 0.3)), ((-0.2, 0.3, 0.0), (0.4, 0.1, -0.2))]),
}
NO_GROWTH = "whose error does not grow with the steps"
TINY = 1e-30  # switches a term on and changes no digit


def every_term(wrench):
    """The same wrench with every term of it switched on, those that it lacks at (next to) zero."""
    values = [value or TINY for value in wrench.values]
    points = wrench.points or [((0.3, 0.1, 0.2), (TINY, 0.0, 0.0)), ((0.1, 0.2, 0.3), (0.0, TINY, 0.0))]
    return Wrench(*np.reshape(values, (4, 3)).tolist(), points)


def run(body, state, wrench, **options):
    sim = Simulation(body, state, rate=RATE, gravity=(0.0, 0.0, -1.6), **options)
    sim.set_wrench(wrench)
    sim.step(STEPS)
    return sim


def difference(a, b):
    """Attitude [rad] and the largest difference of all other numbers, relative to the largest number."""
    x, y = np.delete(a.state.values, slice(3, 7)), np.delete(b.state.values, slice(3, 7))
    return max(rotation.angle_between(a.state.orientation, b.state.orientation), np.abs(x - y).max() / np.abs(y).max())


CASES = list(itertools.product(BODIES, STATES, WRENCHES))


@pytest.mark.parametrize(("body", "state", "wrench"), CASES)
def test_what_is_left_out_changes_nothing(body, state, wrench):
    given = BODIES[body], STATES[state]
    reduced = run(*given, WRENCHES[wrench])
    full = run(*given, every_term(WRENCHES[wrench]), integrator="taylor")
    assert difference(reduced, full) < 3e-15  # measured at most 3.2e-16


@pytest.mark.parametrize(("body", "state", "wrench"), CASES)
def test_drag_and_tethers_at_zero_change_nothing(body, state, wrench):
    given = BODIES[body], STATES[state]
    reduced = run(*given, WRENCHES[wrench])
    full = run(*given, every_term(WRENCHES[wrench]), tethers=[Tether()], drag=Drag(), rtol=1e-13)
    assert full.plan.integrator == "dop853"
    assert difference(reduced, full) < 3e-14  # measured at most 2.2e-15, with rtol 1e-13 in each step


@pytest.mark.parametrize(
    ("body", "state", "wrench", "expected"),
    [
        ("general", "at rest", "nothing", "exact (nothing turns: a parabola in closed form)"),
        ("general", "at rest", "world force", "exact (nothing turns: a parabola in closed form)"),
        ("sphere", "spinning", "nothing", f"exact (no torque; sphere: one turn in closed form, {NO_GROWTH})"),
        (
            "symmetric",
            "spinning",
            "world force",
            f"exact (no torque; symmetric body: two turns in closed form, {NO_GROWTH})",
        ),
        (
            "general",
            "spinning",
            "nothing",
            f"exact (no torque; any body: elliptic functions in closed form, {NO_GROWTH})",
        ),
        ("general", "spinning", "body force", "taylor (the wrench is held between commands: series to round-off)"),
        ("sphere", "at rest", "world torque", "taylor (the wrench is held between commands: series to round-off)"),
        ("general", "at rest", "points", "taylor (the wrench is held between commands: series to round-off)"),
    ],
)
def test_plan_names_the_integrator_and_why(body, state, wrench, expected):
    assert str(run(BODIES[body], STATES[state], WRENCHES[wrench]).plan).startswith(expected)


def test_plan_lists_what_is_left_out():
    sim = Simulation(BODIES["sphere"], STATES["at rest"])
    everything_else = (
        "gravity",
        "rotation",
        "body-axes force",
        "body-axes torque",
        "world-axes torque",
        "forces at points",
        "drag",
        "tethers",
        "ground",
        "flow of the fluid",
        "added mass",
        "actuators",
    )
    assert sim.plan.left_out == everything_else
    sim.set_wrench(every_term(Wrench()))
    assert sim.plan.left_out == ("gravity", "gyroscopic term", *everything_else[-6:])
    assert Simulation(BODIES["general"], integrator="rk4").plan.reason == "as asked for"


@pytest.mark.parametrize(("stiffness", "expected"), [(1e-3, "dop853"), (1e4, "rosenbrock")])
def test_stiffness_decides_between_explicit_and_implicit(stiffness, expected):
    rate = 2.5 * stiffness * RATE  # of the linear drag on the body's mass of 2.5 kg
    sim = Simulation(BODIES["sphere"], rate=RATE, drag=Drag(linear=(rate, 0.0, 0.0)))
    assert sim.plan.integrator == expected
    assert f"stiff: fastest rate {stiffness:.2g} a step" in str(sim.plan)


def test_motion_that_grows_stiff_goes_on_implicitly_to_the_right_end():
    """Quadratic drag at rest has no rate at all; a force makes it fast: v = √(F / c) in the end."""
    drag, force = 1e4, 1e8
    sim = Simulation(Body(1e-3, (1e-6,) * 3), rate=10.0, drag=Drag(quadratic=(drag,) * 3))
    assert sim.plan.integrator == "dop853"
    sim.set_wrench(Wrench(force_world=(force, 0.0, 0.0)))
    sim.step(10)
    assert str(sim.plan).startswith("rosenbrock (drag, stiff: the motion is too fast for an explicit method)")
    assert sim.state.velocity[0] == pytest.approx(math.sqrt(force / drag), rel=1e-12)  # measured 0


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "terms",
    [
        {"tethers": [Tether(anchor=(0.0, 0.0, 1.0), stiffness=1e308)]},
        {"tethers": [Tether(anchor=(1e200, 0.0, 1.0), stiffness=1.0, damping=1e308)]},
        {"drag": Drag(quadratic=(1e308,) * 3)},
    ],
    ids=["stiffness", "damping", "drag"],
)
def test_terms_beyond_all_measure_are_stiff_and_give_a_finite_state_or_a_sentence(terms):
    sim = Simulation(BODIES["general"], STATES["spinning"], rate=RATE, **terms)
    assert sim.plan.integrator == "rosenbrock"
    try:
        sim.step()
    except SimulationError as reason:
        assert "cannot be done" in str(reason)
    assert np.isfinite(sim.state.values).all()


# Changes between two steps ----------------------------------------------------------------------------------------


def test_plan_follows_the_wrench_and_the_state_does_not_jump():
    sim = Simulation(BODIES["general"], STATES["spinning"], rate=RATE, gravity=(0.0, 0.0, -1.6))
    fixed = Simulation(BODIES["general"], STATES["spinning"], rate=RATE, gravity=(0.0, 0.0, -1.6), integrator="taylor")
    names = []
    for wrench in WRENCHES.values():
        before = sim.state.values
        for one in (sim, fixed):
            one.set_wrench(wrench)
        assert_array_equal(sim.state.values, before)
        names.append(sim.plan.integrator)
        for one in (sim, fixed):
            one.step(20)
    assert names == ["exact", "exact", "taylor", "taylor", "taylor", "taylor"]
    assert difference(sim, fixed) < 5e-15  # measured 5.2e-16


def test_held_wrench_that_runs_out_hands_over_to_the_closed_form():
    sim = Simulation(BODIES["general"], STATES["spinning"], rate=RATE)
    sim.set_wrench(WRENCHES["body torque"], hold=0.1)
    sim.step(10)
    assert sim.plan.integrator == "exact"
    momentum = sim.state.angular_momentum
    sim.step(10**6)
    assert_array_equal(sim.state.angular_momentum, momentum)


def test_equal_command_sent_again_starts_no_new_evaluation():
    sim, other = (Simulation(BODIES["general"], STATES["spinning"], rate=RATE) for _ in range(2))
    for _ in range(100):
        sim.set_wrench(Wrench(force_world=(0.0, 0.0, 1.0)))
        sim.step(3)
    other.set_wrench(Wrench(force_world=(0.0, 0.0, 1.0)))
    other.step(300)
    assert_array_equal(sim.state.values, other.state.values)


@pytest.mark.parametrize("wrench", ["nothing", "body torque"])
def test_changed_body_keeps_pose_and_velocities(wrench):
    sim = run(BODIES["general"], STATES["spinning"], WRENCHES[wrench])
    before = sim.state
    sim.change(body=Body(3.0, (0.2, 0.3, 0.4), (0.0, 0.1, 0.0)))
    assert_allclose(sim.state.values[:13], before.values[:13], rtol=0, atol=2e-15)  # measured 2.2e-16
    assert sim.wrench == WRENCHES[wrench]
    w, c = before.angular_velocity, np.array((0.0, 0.1, 0.0))
    v = before.velocity + rotation.rotate(before.orientation, np.cross(w, c))
    assert_allclose(sim.state.momentum, 3.0 * v, rtol=1e-14)  # measured 0


def test_changed_gravity_leaves_every_bit_of_the_state():
    sim = run(BODIES["general"], STATES["spinning"], WRENCHES["body torque"])
    before = sim.save().state
    sim.change(gravity=(0.0, 0.0, -9.8))
    assert sim.save().state == before
    assert sim.gravity.tolist() == [0.0, 0.0, -9.8]


def test_changes_between_steps_are_those_of_a_new_simulation():
    sim = run(BODIES["general"], STATES["spinning"], WRENCHES["body torque"])
    drag = Drag(linear=(1.0, 2.0, 3.0))
    sim.change(drag=drag, gravity=(0.0, 0.0, -9.8))
    fresh = Simulation(BODIES["general"], rate=RATE, gravity=(0.0, 0.0, -9.8), drag=drag)
    fresh.restore(sim.save())
    assert sim.plan.integrator == fresh.plan.integrator == "dop853"
    for one in (sim, fresh):
        one.step(20)
    assert_array_equal(sim.state.values, fresh.state.values)
    sim.change(drag=Drag())
    assert sim.plan.integrator == "taylor"


@pytest.mark.parametrize(
    ("integrator", "terms", "sentence"),
    [
        (
            "taylor",
            {"drag": Drag(linear=(1.0, 0.0, 0.0))},
            "integrator 'taylor' leaves out drag, tethers, ground and added mass",
        ),
        ("auto", {"gravity": (0.0, math.nan, 0.0)}, "gravity .* must be three finite numbers"),
        (
            "auto",
            {"forces": [((0.0, 0.0, 0.0), (math.inf, 0.0, 0.0))]},
            "force at a point .* must be three finite numbers",
        ),
    ],
)
def test_change_that_is_refused_changes_nothing(integrator, terms, sentence):
    sim = run(BODIES["general"], STATES["spinning"], WRENCHES["body torque"], integrator=integrator)
    before, line = sim.save(), sim.describe()
    with pytest.raises(ValueError, match=sentence):
        sim.change(**terms)
    assert (sim.save(), sim.describe()) == (before, line)
    sim.step()


@pytest.mark.parametrize("rtol", [2.0, 1e-14, 0.0, -0.5, math.nan])
def test_tolerance_that_is_none_is_refused(rtol):
    with pytest.raises(ValueError, match=f"rtol {rtol:g} is not between 1e-13 and 1; try 1e-9"):
        Simulation(BODIES["sphere"], rtol=rtol)


def test_terms_cannot_be_changed_behind_the_plan():
    with pytest.raises(FrozenInstanceError):
        Terms(BODIES["sphere"]).rtol = 0.5


def test_integrator_that_leaves_forces_at_points_out_is_refused_with_those_that_do_not():
    able = ", ".join(["auto", *(name for name in REGISTRY if name != "exact")])
    with pytest.raises(ValueError, match=f"^integrator 'exact' leaves out forces at points; choose one of {able}$"):
        Simulation(BODIES["sphere"], integrator="exact", forces=[((0.0, 0.0, 1.0), (1.0, 0.0, 0.0))])


def test_change_of_something_else_is_refused():
    with pytest.raises(TypeError, match="rate"):
        Simulation(BODIES["general"]).change(rate=10.0)


@pytest.mark.parametrize(
    ("turned", "stiffness", "expected"),
    [
        (False, None, "exact"),
        (True, None, "taylor"),
        (True, 0.0, "dop853"),
        (False, plan.STIFF, "dop853"),
        (False, plan.STIFF * 1.01, "rosenbrock"),
    ],
)
def test_choice_is_one_rule(turned, stiffness, expected):
    assert plan.choose(turned, stiffness) == expected
    assert expected in plan.within_reach(stiffness is not None)
