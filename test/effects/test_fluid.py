"""A moving fluid: drag goes by the velocity through it."""

import copy
import dataclasses
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rigid_body_sim import Body, Drag, Ensemble, Fluid, Scene, Simulation, State, Wrench
from rigid_body_sim.effects.drag import passes_rest
from rigid_body_sim.kernels import compiled
from rigid_body_sim.kernels.model import LOADS
from rigid_body_sim.kernels.motion import fluid_velocity
from rigid_body_sim.terms import Terms
from rigid_body_sim.values.state import flatten

BODY = Body(2.0, (0.3, 0.4, 0.5, 0.02, -0.03, 0.04), (0.05, -0.02, 0.03))
BALL = Body(2.0, (0.1, 0.1, 0.1))
START = State((0.3, 0.2, 0.1), (0.9, 0.1, -0.3, 0.2), (1.0, -0.5, 0.3), (0.4, -1.0, 0.7))
DRAG = Drag((1.0, 2.0, 3.0), (4.0, 5.0, 6.0), (0.1, 0.2, 0.3), (0.4, 0.5, 0.6))
CURRENT = np.array((0.75, -1.5, 0.5))
ADDED = (3.0, 5.0, 4.0, 0.6, 0.8, 0.5)


@pytest.mark.parametrize("more", [{"drag": DRAG}, {"added_mass": ADDED}, {"drag": DRAG, "added_mass": ADDED}])
@pytest.mark.parametrize("method", ["dop853", "rosenbrock"])
def test_motion_is_that_in_a_still_fluid_seen_from_afar(more, method):
    """Galilei: whoever drifts with the fluid sees it at rest. Under gravity and a wrench, 2 s; measured 1e-11."""
    found = []
    for u in (np.zeros(3), CURRENT):
        begin = State(START.position, START.orientation, START.velocity + u, START.angular_velocity)
        sim = Simulation(
            BODY, begin, rate=10.0, gravity=(0.1, 0.2, -3.0), rtol=1e-11, integrator=method, fluid=Fluid(u), **more
        )
        sim.set_wrench(Wrench(force_body=(1.0, 0.5, -2.0), torque_world=(0.1, -0.2, 0.3)))
        sim.step(20)
        state = sim.state
        found.append((state.position - 2.0 * u, state.orientation, state.velocity - u, state.angular_velocity))
    for still, moving in zip(*found, strict=True):
        assert_allclose(moving, still, rtol=0, atol=1e-9)


def test_body_at_rest_is_carried_along():
    """v = u (1 − e^(−c t / m)); measured 4e-13."""
    sim = Simulation(BALL, rate=10.0, rtol=1e-12, drag=Drag((3.0,) * 3), fluid=Fluid(CURRENT))
    for _ in range(20):
        sim.step()
        assert_allclose(sim.state.velocity, CURRENT * -math.expm1(-1.5 * sim.time), rtol=0, atol=1e-11)


@pytest.mark.no_numba
def test_turn_of_the_flow_at_a_kink_is_followed():
    """Thrown against a push, the velocity through the fluid passes zero: tan before, tanh after it. Measured 3e-11."""
    push, c, m, u, against = 3.0, 4.0, BALL.mass, 1.25, -1.0
    root, rate = math.sqrt(push / c), math.sqrt(push * c) / m
    zero = math.atan(-against / root) / rate
    drag, fluid = Drag(quadratic=(c,) * 3), Fluid((u, 0, 0))
    sim = Simulation(BALL, State(velocity=(u + against, 0, 0)), rate=20.0, rtol=1e-10, drag=drag, fluid=fluid)
    sim.set_wrench(Wrench(force_world=(push, 0.0, 0.0)))
    while sim.time < 2.0 * zero:
        sim.step()
        since = rate * (sim.time - zero)
        through = root * (math.tanh(since) if since > 0.0 else math.tan(since))
        assert sim.state.velocity[0] == pytest.approx(u + through, abs=1e-9)


@pytest.mark.no_numba
@pytest.mark.parametrize(("u", "expected"), [(0.0, False), (1.1, True), (1.3, False)])
def test_kink_is_where_the_velocity_through_the_fluid_passes_zero(u, expected):
    """Of a velocity that goes from 1 to 1.2 m/s: at one in between, and not where the body comes to rest."""
    terms = Terms(BALL, drag=Drag(quadratic=(1.0, 0.0, 0.0)), fluid=Fluid((u, 0.0, 0.0)))
    model, work = terms.model(Wrench()), np.zeros(12)
    work[6] = 0.2 * BALL.mass
    assert passes_rest(model, int(model[LOADS + 1]), flatten(State(velocity=(1, 0, 0)), model), work, 0) == expected


def test_fluid_alone_changes_no_bit():
    """Without drag or added mass nothing feels it, and the plan is the same."""
    states = []
    for fluid in (Fluid(), Fluid(CURRENT)):
        sim = Simulation(BODY, START, rate=100.0, gravity=(0, 0, -9.8), fluid=fluid)
        sim.set_wrench(Wrench(force_body=(0.1, 0.2, -0.3), torque_world=(0.02, -0.01, 0.03)))
        sim.step(20)
        states.append((sim.plan.integrator, sim.save().state))
    assert states[0] == states[1]


@pytest.mark.no_numba
def test_changed_on_the_way_it_acts_from_the_next_step_on():
    """The same bits as with a new simulation from there, and nothing is compiled."""
    sim = Simulation(BODY, START, rate=100.0, drag=DRAG, added_mass=ADDED)
    sim.step(5)
    made = compiled.compilations()
    sim.change(fluid=Fluid(CURRENT))
    other = Simulation(BODY, START, rate=100.0, drag=DRAG, added_mass=ADDED, fluid=Fluid(CURRENT))
    other.restore(sim.save())
    for each in (sim, other):
        each.step(20)
    assert sim.save() == other.save() and sim.fluid == other.fluid
    assert compiled.compilations() == made


def test_it_may_speed_the_body_up():
    """So a spin that ends a run may come from drag, too, which in a fluid at rest it cannot."""
    assert not Terms(BODY, drag=DRAG).driven
    assert Terms(BODY, drag=DRAG, fluid=Fluid(CURRENT)).driven
    assert not Terms(BODY, fluid=Fluid(CURRENT)).driven


def test_what_is_not_finite_is_refused():
    with pytest.raises(ValueError, match="fluid velocity"):
        Fluid((0.0, math.nan, 0.0))
    with pytest.raises(ValueError, match=r"parameter fluid\.velocity = .* is not finite"):
        Scene({"fluid.velocity": [0.0, math.inf, 0.0]})


# Gusts ----------------------------------------------------------------------------------------------------------------

GUSTY = Fluid((6.0, -2.0, 1.0), gust_intensity=1.5, gust_length_scale=20.0, gust_seed=7)


def gusty(fluid=GUSTY, **options):
    return Simulation(BODY, START, rate=50.0, drag=DRAG, fluid=fluid, **options)


def flow(sim):
    """The velocity of the fluid now."""
    return np.array(fluid_velocity(sim._model))


def test_gusts_are_those_of_the_model_in_its_axes():
    """Mean, variance along and across the mean flow: of 60 000 steps, within 5 standard deviations of each estimate."""
    along = np.array(GUSTY.velocity) / math.hypot(*GUSTY.velocity)
    sim = Simulation(Body(1e6, (1e6,) * 3), rate=2.0, drag=Drag((1e-9,) * 3), fluid=GUSTY)
    found = np.array([(sim.step(), flow(sim) - GUSTY.velocity)[1] for _ in range(60_000)])
    n = math.hypot(*GUSTY.velocity) / 20.0 / 2.0  # a step, in units of L / V
    spread = math.sqrt(2.0 / len(found) / math.tanh(n))  # of the variance of what forgets by e⁻ⁿ a step
    across = found - np.outer(found @ along, along)
    assert np.var(found @ along) == pytest.approx(1.5**2, rel=5 * spread)
    assert np.sum(across**2) / len(found) == pytest.approx(2 * 1.5**2, rel=5 * spread)
    assert np.abs(found.mean(0)).max() < 5 * 1.5 * math.sqrt(1.0 / math.tanh(n / 2.0) / len(found))


@pytest.mark.no_numba
def test_gusts_repeat_to_the_bit_and_differ_by_seed():
    """Step by step or at once, saved and restored, copied, and after a reset."""
    once, other = gusty(), gusty(dataclasses.replace(GUSTY, gust_seed=8))
    for sim in (once, other):
        sim.step(12)
    assert once.save().state != other.save().state
    again = gusty()
    for _ in range(5):
        again.step()
    saved, copied = again.save(), copy.deepcopy(again)
    for sim in (again, copied):
        sim.step(7)
        assert sim.save() == once.save()
    fresh = gusty()
    fresh.restore(saved)
    fresh.step(7)
    assert fresh.save() == once.save()
    fresh.reset()
    fresh.step(12)
    assert fresh.save() == once.save()


@pytest.mark.no_numba
def test_intensity_of_zero_changes_no_bit():
    states = []
    for fluid in (Fluid(GUSTY.velocity), Fluid(GUSTY.velocity, 0.0, 5.0, 3)):
        sim = gusty(fluid)
        sim.step(10)
        states.append(sim.save())
    assert states[0] == states[1] and not states[0].memory


def test_mean_flow_may_change_while_gusts_go_on():
    """Its velocity alone: the gusts go on, about the new one at once. Another seed begins anew."""
    sim = gusty()
    sim.step(5)
    gust = flow(sim) - GUSTY.velocity
    sim.change(fluid=dataclasses.replace(GUSTY, velocity=(9.0, -3.0, 1.5)))  # the same way, so the same axes
    assert_allclose(flow(sim) - (9.0, -3.0, 1.5), gust, rtol=0, atol=1e-14)
    sim.change(gravity=(0.0, 0.0, -1.0))
    assert_allclose(flow(sim) - (9.0, -3.0, 1.5), gust, rtol=0, atol=1e-14)
    sim.change(fluid=dataclasses.replace(GUSTY, gust_seed=9))
    assert_allclose(flow(sim), flow(gusty(dataclasses.replace(GUSTY, gust_seed=9))), rtol=0, atol=0)


def test_many_bodies_have_the_gusts_of_each_alone():
    """To the bit, after a reset too."""
    ensemble = Ensemble(
        BODY.mass, BODY.inertia, center_of_mass=BODY.center_of_mass, n=3, rate=50.0, drag=DRAG, fluid=GUSTY,
        position=START.position, orientation=START.orientation, velocity=START.velocity,
        angular_velocity=START.angular_velocity,
    )  # fmt: skip
    alone = gusty()
    alone.step(12)
    for _ in range(2):
        ensemble.step(12)
        assert np.array_equal(ensemble.state.position[1], alone.state.position)
        ensemble.reset()


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ({"fluid.gust.intensity": 1.5}, r"fluid\.gust\.intensity 1\.5 in a fluid at rest: .* give it a velocity"),
        ({"fluid.gust.intensity": -1.0}, r"fluid\.gust\.intensity = -1\.0: is out of range"),
        ({"fluid.gust.length_scale": 0.0}, r"fluid\.gust\.length_scale = 0\.0: is out of range"),
        ({"fluid.gust.seed": -1}, r"fluid\.gust\.seed = -1: is out of range"),
    ],
)
def test_gusts_that_cannot_be_are_refused(given, reason):
    with pytest.raises(ValueError, match=rf"^parameter {reason}"):
        Scene(given)


def test_gusts_of_a_fluid_that_cannot_be_are_refused():
    for fields, reason in (
        ({"gust_intensity": math.nan}, "gust_intensity nan is not a finite number of at least 0"),
        ({"gust_length_scale": 0.0}, "gust_length_scale 0 is not a finite number above 0"),
        ({"gust_seed": None}, "gust_seed None is not a number"),
        ({"gust_seed": 1.5}, "gust_seed 1.5 is not a whole number"),
        ({"gust_seed": math.nan}, "gust_seed nan is not a whole number"),
        ({"gust_seed": 10**9 + 1}, "gust_seed 1000000001 is not a whole number from 0 to 1000000000"),
        ({"gust_intensity": 1.0}, "gust_intensity 1 in a fluid at rest"),
    ):
        with pytest.raises(ValueError, match=reason):
            Fluid(**fields)
