"""The simulation that users and the node hold in their hands: commands, time, and going back."""

import copy
import math
import pickle
from fractions import Fraction

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from rigid_body_sim import Actuator, Body, BodyState, Drag, Scene, Simulation, SimulationError, State, Tether, Wrench
from rigid_body_sim.held import steps_held
from rigid_body_sim.stepping import IntegratorError
from rigid_body_sim.values import rotation
from rigid_body_sim.values.wrench import total

pytestmark = pytest.mark.no_numba

BODY = Body(mass=2.0, inertia=(0.1, 0.2, 0.25))
MOVING = State((1.0, 2.0, 3.0), (0.4, 0.2, -0.8, 0.4), (-0.5, 0.2, 1.0), (1.1, -2.0, 0.7))
PUSH = Wrench(force_world=(2.0, 0.0, 0.0))


def simulation(state=None, **options):
    return Simulation(BODY, state, **{"rate": 1000.0, **options})


def test_a_second_of_free_fall():
    sim = Simulation(
        Body(mass=2.0, inertia=(0.1, 0.2, 0.25)), State(), rate=1000.0, gravity=(0, 0, -9.80665), integrator="taylor"
    )
    sim.step(1000)
    assert_allclose(sim.state.position, (0, 0, -9.80665 / 2), rtol=0, atol=1e-15)  # measured 0
    assert_allclose(sim.state.velocity, (0, 0, -9.80665), rtol=0, atol=2e-15)  # measured 0
    assert_array_equal(sim.state.momentum, 2.0 * sim.state.velocity)
    assert sim.time == 1.0


def test_simulation_starts_at_the_state_given():
    assert_allclose(simulation(MOVING).state.values[:13], MOVING.values, rtol=0, atol=1e-15)  # measured 2.2e-16
    assert_array_equal(simulation().state.values[:13], State().values)


def test_pose_is_position_and_orientation():
    sim = simulation(MOVING)
    sim.step(10)
    assert sim.pose == (*sim.state.position, *sim.state.orientation)


def test_motion_is_pose_and_velocities_in_world_and_body_axes():
    sim = simulation(MOVING)
    sim.step(10)
    state, motion = sim.state, np.array(sim.motion)
    assert tuple(motion[:7]) == sim.pose
    world = (*state.velocity, *rotation.rotate(state.orientation, state.angular_velocity))
    body = (*rotation.rotate_back(state.orientation, state.velocity), *state.angular_velocity)
    assert_allclose(motion[7:], (*world, *body), rtol=0, atol=1e-15)  # measured 0


def test_state_read_is_a_copy_that_does_not_move_on():
    sim = simulation(MOVING)
    before = sim.state
    position = before.position.copy()
    sim.step()
    assert isinstance(before, BodyState)
    assert_array_equal(before.position, position)
    assert (sim.state.position != position).any()


# Time -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("rate", [3.0, 44100.0, 0.1, 1000.0, 1e6, 7.3, 1 / 3])
@pytest.mark.parametrize("steps", [0, 1, 2, 3, 1000, 123_456_789, 10**15 + 1])
def test_time_in_nanoseconds_is_exact_however_awkward_the_rate(rate, steps):
    sim = simulation(rate=rate)
    sim.steps = steps
    exact = Fraction(steps) * 10**9 / Fraction(rate)
    assert isinstance(sim.time_ns, int)
    assert sim.time_ns == math.floor(exact + Fraction(1, 2))


def test_time_in_nanoseconds_never_drifts():
    sim = simulation(rate=3.0)
    stamps = []
    for _ in range(7):
        stamps.append(sim.time_ns)
        sim.step()
    assert stamps == [0, 333_333_333, 666_666_667, 1_000_000_000, 1_333_333_333, 1_666_666_667, 2_000_000_000]


def test_time_in_seconds_is_the_step_count_over_the_rate():
    sim = simulation(rate=44100.0)
    sim.step(441)
    assert sim.time == 0.01
    assert sim.steps == 441


@pytest.mark.parametrize("rate", [0.0, -1.0, math.nan, math.inf, 1.1e6, 5e-324])
def test_rate_out_of_range_is_refused(rate):
    with pytest.raises(ValueError, match=r"rate .* Hz is not between 1e-09 and 1e\+06 Hz"):
        simulation(rate=rate)


@pytest.mark.parametrize("gravity", [(0, 0), (0, 0, math.nan), -9.81])
def test_gravity_that_is_not_three_finite_numbers_is_refused(gravity):
    with pytest.raises(ValueError, match=r"^gravity .* must be three finite numbers"):
        simulation(gravity=gravity)


def test_unknown_integrator_is_refused_with_those_there_are():
    with pytest.raises(
        ValueError, match="integrator 'euler' is not known; choose one of auto, taylor, exact, rk4, rkmk4"
    ):
        simulation(integrator="euler")


# Commands ---------------------------------------------------------------------------------------------------------


def impulse_received(sim):
    """Steps for which PUSH has acted: it gives 2e-3 N s in a step of 1 ms."""
    return round(sim.state.momentum[0] / 2e-3, 9)


def test_wrench_is_held_until_the_next_one():
    sim = simulation()
    sim.set_wrench(PUSH)
    sim.step(10)
    sim.step(10)
    assert impulse_received(sim) == 20
    assert sim.wrench == PUSH
    sim.set_wrench(Wrench(force_world=(-2.0, 0.0, 0.0)))
    sim.step(5)
    assert impulse_received(sim) == 15


def test_wrench_cleared_acts_no_more():
    sim = simulation()
    sim.set_wrench(PUSH)
    sim.step(10)
    sim.clear_wrench()
    sim.step(10)
    assert impulse_received(sim) == 10
    assert sim.wrench == Wrench()


@pytest.mark.parametrize("one_by_one", [True, False], ids=["one by one", "at once"])
@pytest.mark.parametrize(
    ("hold", "steps"), [(0.005, 5), (0.0052, 5), (0.0059, 5), (1e-9, 1), (0.001, 1), (0.1, 100), (1e6, 200)]
)
def test_wrench_with_a_time_to_hold_acts_for_that_many_steps(hold, steps, one_by_one):
    sim = simulation()
    sim.step(7)
    sim.set_wrench(PUSH, hold=hold)
    for _ in range(200 if one_by_one else 1):
        sim.step(1 if one_by_one else 200)
    assert impulse_received(sim) == steps
    assert sim.wrench == (PUSH if steps == 200 else Wrench())
    assert sim.steps == 207


@pytest.mark.parametrize(
    ("rate", "hold", "steps"),
    [
        (3.0, 0.5, 1),  # 0.333 s
        (10.0, 0.35, 3),
        (3.0, 0.1, 1),  # at least one
        (100.0, 0.29, 29),  # though 0.29 · 100 = 28.999999999999996
        (1000.0, 0.007, 7),
        (3.0, 1.0 / 3.0, 1),
        (1000.0 / 3.0, 3.0, 1000),
        (10.0, 0.3999, 3),
        (1e6, 1e9, 10**15),
    ],
)
def test_a_wrench_is_held_for_the_whole_steps_that_fit(rate, hold, steps):
    assert steps_held(hold, rate) == steps
    sim = Simulation(Body(1.0, (0.1, 0.1, 0.1)), rate=rate)
    sim.set_wrench(PUSH, hold=hold)
    sim.step(min(steps, 2000) + 5)
    assert sim.state.momentum[0] == pytest.approx(2.0 * min(steps, 2005) / rate, rel=1e-12)  # 2e-16


def test_every_time_of_whole_steps_is_held_for_them():
    """As k steps are written: k / rate in floats, and in decimals."""
    for rate in (3.0, 10.0, 30.0, 200.0, 400.0, 1000.0, 1e4):
        for k in (*range(1, 300), 86_399, 10**9 + 7):
            assert steps_held(k / rate, rate) == steps_held(float(f"{k / rate:.9f}"), rate) == k


def test_new_wrench_ends_the_time_of_the_one_before():
    sim = simulation()
    sim.set_wrench(PUSH, hold=0.005)
    sim.step(3)
    sim.set_wrench(PUSH)
    sim.step(10)
    assert impulse_received(sim) == 13


def test_force_at_a_point_expires_too():
    sim = simulation()
    sim.set_wrench(Wrench(points=[((0.1, 0.0, 0.0), (2.0, 0.0, 0.0))]), hold=0.005)
    sim.step(10)
    assert impulse_received(sim) == 5


def test_forces_at_points_can_follow_and_be_followed_by_others():
    sim, at_point = simulation(), Wrench(points=[((0.1, 0.0, 0.0), (2.0, 0.0, 0.0))])
    for wrench in (PUSH, at_point, Wrench(points=2 * at_point.points), PUSH, Wrench()):
        sim.set_wrench(wrench)
        sim.step()
    assert impulse_received(sim) == 5


@pytest.mark.parametrize("hold", [0.0, -1.0, math.nan, math.inf, 1e306])
def test_time_to_hold_that_is_not_positive_and_finite_is_refused_and_changes_nothing(hold):
    sim = simulation()
    sim.set_wrench(PUSH, hold=0.005)
    before = sim.save()
    with pytest.raises(ValueError, match=r"is not a time greater than zero .*; leave it out to hold for ever"):
        sim.set_wrench(Wrench(), hold=hold)
    assert sim.save() == before


@pytest.mark.parametrize(("n", "error"), [(-1, ValueError), (2.7, TypeError), ("3", TypeError)])
def test_number_of_steps_that_is_none_is_refused_and_changes_nothing(n, error):
    sim = simulation(MOVING)
    before = sim.save()
    with pytest.raises(error):
        sim.step(n)
    assert sim.save() == before


def test_what_was_given_at_the_start_cannot_be_changed_behind_its_back():
    sim = simulation()
    with pytest.raises(AttributeError):
        sim.rate = 10.0
    with pytest.raises(ValueError, match="read-only"):
        sim.gravity[2] = -10.0


def test_motion_too_large_for_a_float_is_refused():
    with pytest.raises(ValueError, match="a momentum beyond the range of floats"):
        Simulation(Body(1e100, (1.0, 1.0, 1.0)), State(velocity=(1e210, 0.0, 0.0)))


def test_no_steps_change_nothing():
    sim = simulation(MOVING)
    before = sim.save()
    sim.step(0)
    assert sim.save() == before


@pytest.mark.filterwarnings("error")
def test_step_that_cannot_be_done_tells_the_last_good_state_in_finite_numbers():
    sim = simulation(rate=1.0)
    sim.set_wrench(Wrench(force_world=(3.8e306, 0.0, 0.0)))
    with pytest.raises(SimulationError, match=r"step 6 cannot be done.*spin 0 rad/s, speed 9.5e\+306 m/s"):
        sim.step(10)
    assert sim.steps == 5


def test_attitude_that_cannot_be_normalised_stops_the_simulation():
    """A spin whose square is beyond the floats would leave the quaternion zero, which is finite but no attitude."""
    drag = Drag(angular_linear=(1e90, 1e90, 1e90))
    sim = simulation(State(angular_velocity=(1.0, 2.0, 3.0)), integrator="semi_implicit_euler", drag=drag)
    with pytest.raises(SimulationError, match="the last good state is kept"):
        sim.step(10)
    assert rotation.norm(sim.state.orientation) == pytest.approx(1.0)
    assert 0 < sim.steps < 10


# Forces that always act, and impulses ------------------------------------------------------------------------------

LIFT = [((0.1, 0.0, 0.2), (0.0, 3.0, 20.0)), ((0.0, -0.1, 0.0), (1.0, 0.0, 0.0))]
OFF_CENTRE = Body(2.0, (0.3, 0.4, 0.5, 0.02, -0.03, 0.04), (0.05, -0.02, 0.03))


def moved_by(commands, **options):
    sim = Simulation(OFF_CENTRE, MOVING, **options)
    for wrench in commands:
        sim.set_wrench(wrench)
        sim.step(20)
    return sim.state.values


def test_constant_force_is_a_point_of_every_wrench_held():
    """Also of those that are twelve numbers written into the model, and of none."""
    commands = [PUSH, Wrench(torque_body=(0.1, 0.0, 0.0)), Wrench(points=[((0, 0, 1), (1, 0, 0))]), Wrench(), PUSH]
    both = [
        Wrench(w.force_body, w.torque_body, w.force_world, w.torque_world, points=[*w.points, *LIFT]) for w in commands
    ]
    assert_array_equal(moved_by(commands, forces=LIFT), moved_by(both))
    assert np.abs(moved_by(commands, forces=LIFT) - moved_by(commands)).max() > 0.1


def test_constant_force_stays_when_the_wrench_expires_and_after_a_reset():
    sim = simulation(forces=[((0.0, 0.0, 0.0), (2.0, 0.0, 0.0))])
    sim.set_wrench(PUSH, hold=0.005)
    sim.step(10)
    assert impulse_received(sim) == 15
    sim.reset()
    sim.step(10)
    assert impulse_received(sim) == 10


def test_constant_force_that_is_none_or_that_the_integrator_leaves_out_is_refused():
    with pytest.raises(ValueError, match=r"force at a point .* must be three finite numbers"):
        simulation(forces=[((0, 0, 0), (0, 0, math.nan))])
    with pytest.raises(
        ValueError, match="integrator 'exact' leaves out forces at points; choose one of auto, taylor, rk4"
    ):
        simulation(forces=LIFT, integrator="exact")


IMPULSES = {
    "body": Wrench(force_body=(1.0, -2.0, 3.0), torque_body=(0.3, 0.2, -0.1)),
    "world": Wrench(force_world=(1.0, -2.0, 3.0), torque_world=(0.3, 0.2, -0.1)),
    "points": Wrench(points=[((0.4, 0.1, -0.2), (1.0, -2.0, 3.0)), ((0.0, 0.3, 0.0), (0.5, 0.5, -1.0))]),
    "all": Wrench((1, 2, 3), (0.1, 0.2, 0.3), (1, 0, -1), (0.3, 0.2, 0.1), [((0.1, 0.2, 0.3), (3, 2, 1))]),
}


def closed_form(impulse, body, state):
    """ΔP and ΔL about the centre of mass [world] by matrices."""
    R, c = rotation.to_matrix(state.orientation), body.center_of_mass
    forces = [(-R @ c, R @ impulse.force_body), (np.zeros(3), impulse.force_world)]
    forces += [(R @ (np.array(point) - c), np.array(force)) for point, force in impulse.points]
    moment = R @ impulse.torque_body + impulse.torque_world + sum(np.cross(arm, force) for arm, force in forces)
    return sum(force for _, force in forces), moment


@pytest.mark.parametrize("impulse", IMPULSES.values(), ids=IMPULSES)
def test_impulse_changes_momentum_and_angular_momentum_by_its_closed_form(impulse):
    sim = Simulation(OFF_CENTRE, MOVING, gravity=(0, 0, -9.8), forces=LIFT)
    before = sim.state
    expected_momentum, expected_angular_momentum = closed_form(impulse, OFF_CENTRE, before)
    sim.apply_impulse(impulse)
    after = sim.state
    assert_allclose(after.momentum - before.momentum, expected_momentum, rtol=0, atol=4e-15)  # measured 8.9e-16
    assert_allclose(after.angular_momentum - before.angular_momentum, expected_angular_momentum, rtol=0, atol=4e-15)
    assert_array_equal(after.orientation, before.orientation)
    assert_allclose(after.position, before.position, rtol=0, atol=0)
    assert sim.steps == 0


def test_impulse_is_a_great_force_for_a_short_time():
    """The same wrench held for 1 µs, a million times as great, does the same but for what happens in that time."""
    struck, pushed = (Simulation(OFF_CENTRE, MOVING, rate=1e6, gravity=(0, 0, -9.8)) for _ in range(2))
    struck.apply_impulse(IMPULSES["all"])
    w = IMPULSES["all"]
    parts = [1e6 * np.array(w.values[i : i + 3]) for i in (0, 3, 6, 9)]
    pushed.set_wrench(Wrench(*parts, [(point, 1e6 * np.array(force)) for point, force in w.points]))
    pushed.step(1)
    assert_allclose(struck.state.values, pushed.state.values, rtol=0, atol=1e-4)  # measured 2.3e-5


@pytest.mark.parametrize("integrator", ["taylor", "exact"])
def test_impulse_between_two_steps_is_a_new_start(integrator):
    """The motion goes on from the new state, also where it is evaluated from where the wrench last changed."""
    sim = simulation(MOVING, integrator=integrator)
    sim.set_wrench(PUSH, hold=0.02)
    sim.step(7)
    sim.apply_impulse(IMPULSES["body"])
    other = simulation(State(*(sim.state.values[i:j] for i, j in ((0, 3), (3, 7), (7, 10), (10, 13)))))
    assert sim.wrench == PUSH
    other.set_wrench(PUSH, hold=0.013)  # what is left of the time to hold
    for each in (sim, other):
        each.step(30)
    assert sim.wrench == other.wrench == Wrench()
    assert_allclose(sim.state.values, other.state.values, rtol=0, atol=2e-14)  # measured 1.8e-15
    assert np.linalg.norm(sim.state.momentum - 2.0 * MOVING.velocity) > 1.0


def test_impulse_through_a_frame_with_world_axes_acts_at_its_origin():
    frame = Scene({"frames.hook.position": (0.25, 0.15, 0.0), "frames.hook.axes": "world"}).frames["hook"]
    sim = Simulation(OFF_CENTRE, MOVING)
    before = sim.state
    sim.apply_impulse(frame.wrench((1.0, -2.0, 3.0), (0.1, 0.0, 0.0)))
    arm = rotation.rotate(MOVING.orientation, np.array((0.25, 0.15, 0.0)) - OFF_CENTRE.center_of_mass)
    moment = np.array((0.1, 0.0, 0.0)) + np.cross(arm, (1.0, -2.0, 3.0))
    assert_allclose(sim.state.momentum - before.momentum, (1, -2, 3), rtol=0, atol=4e-15)  # measured 0
    assert_allclose(sim.state.angular_momentum - before.angular_momentum, moment, rtol=0, atol=4e-15)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("mass", "speed", "force"), [(1.0, 1e308, 1.7e308), (1e-8, 0.0, 1e301)], ids=["momentum", "velocity"]
)
def test_impulse_too_great_is_refused_and_changes_nothing(mass, speed, force):
    """The momentum overflows together with what was there, or only the velocity of a light body does."""
    sim = Simulation(Body(mass, (1.0, 1.0, 1.0)), State(velocity=(speed, 0.0, 0.0)))
    before = sim.save()
    with pytest.raises(ValueError, match=r"impulse .* refused: the motion that follows is not finite; give a smaller"):
        sim.apply_impulse(Wrench(force_world=(force, 0.0, 0.0)))
    assert sim.save() == before


# Going back -------------------------------------------------------------------------------------------------------


def test_reset_goes_to_the_initial_state_without_wrench_at_time_zero():
    sim = simulation(MOVING)
    before = sim.save()
    sim.set_wrench(PUSH, hold=1.0)
    sim.step(10)
    sim.reset()
    assert sim.save() == before


def test_reset_may_keep_time_and_go_elsewhere():
    sim = simulation()
    sim.set_wrench(PUSH, hold=1.0)
    sim.step(10)
    sim.reset(MOVING, keep_time=True)
    assert sim.steps == 10
    assert sim.wrench == Wrench()
    assert sim.save().state == simulation(MOVING).save().state
    sim.step(2000)
    assert_array_equal(sim.state.momentum, simulation(MOVING).state.momentum)


@pytest.mark.parametrize("wrench", [PUSH, Wrench(points=[((0.1, 0.0, 0.0), (2.0, 0.0, 0.0))])], ids=["force", "point"])
def test_snapshot_can_be_pickled_and_carried_to_another_simulation(wrench):
    sim, other = simulation(MOVING), simulation()
    sim.set_wrench(wrench, hold=0.02)
    sim.step(7)
    snapshot = pickle.loads(pickle.dumps(sim.save()))
    other.restore(snapshot)
    for each in (sim, other):
        each.step(30)
    assert other.save() == sim.save()
    assert sim.wrench == Wrench()  # it expired on the way, 13 steps after the snapshot


COPIES = {
    "pickle": lambda sim: pickle.loads(pickle.dumps(sim)),
    "deepcopy": copy.deepcopy,
    "copy": copy.copy,
}
COPIED = {
    "torque-free": lambda: simulation(MOVING, integrator="exact"),
    "held": lambda: simulation(MOVING, gravity=(0.0, 0.0, -9.81), forces=[((0.1, 0.0, 0.2), (0.0, 0.0, 3.0))]),
    "asked for": lambda: simulation(MOVING, integrator="rkmk4", rate=300.0),
    "drag": lambda: simulation(MOVING, drag=Drag(linear=(1.0, 2.0, 3.0)), rtol=1e-8),
    "tether": lambda: simulation(MOVING, tethers=[Tether((0.0, 0.0, 0.1), (3.0, 2.0, 3.0), 0.5, 1e6)]),
    "grows stiff": lambda: simulation(drag=Drag(quadratic=(1e12,) * 3)),  # at rest it has no rate at all
}


@pytest.mark.parametrize("make_copy", COPIES.values(), ids=COPIES)
@pytest.mark.parametrize("make", COPIED.values(), ids=COPIED)
def test_a_copy_goes_on_by_itself_with_the_same_bits(make, make_copy):
    sim = make()
    if sim.integrator.name != "exact":
        sim.set_wrench(PUSH, hold=0.02, source="a")
        sim.set_wrench(PUSH, source="b")
    sim.step(7)
    sim.change(body=Body(mass=3.0, inertia=(0.2, 0.3, 0.4)))
    sim.step(3)
    assert str(sim.plan).startswith("rosenbrock") == (make is COPIED["grows stiff"])
    other = make_copy(sim)
    before = other.save()
    sim.step(30)
    assert other.save() == before != sim.save()
    other.step(30)
    assert other.save() == sim.save() and str(other.plan) == str(sim.plan)
    for each in (sim, other):
        each.reset()
        each.step(3)
    assert other.save() == sim.save()


def test_snapshot_does_not_move_on():
    sim = simulation(MOVING)
    snapshot = sim.save()
    sim.step(10)
    assert snapshot == simulation(MOVING).save()


def test_two_simulations_share_nothing():
    one, other = simulation(MOVING), simulation(MOVING)
    one.set_wrench(PUSH)
    one.step(10)
    assert other.save() == simulation(MOVING).save()


# Several sources --------------------------------------------------------------------------------------------------

OTHER = Wrench(force_body=(0.3, 0.0, -0.2), points=[((0.1, 0.0, 0.0), (0.0, 1.0, 0.0))])


def test_wrenches_of_two_sources_add_up():
    both, one = simulation(MOVING), simulation(MOVING)
    both.set_wrench(PUSH, source="a")
    both.set_wrench(OTHER, source="b")
    one.set_wrench(total([PUSH, OTHER]))
    both.step(100)
    one.step(100)
    assert_array_equal(both.state.values, one.state.values)


def test_each_source_is_held_until_its_own_end():
    sim, steps = simulation(MOVING), []
    sim.set_wrench(PUSH, 0.003, "a")
    sim.set_wrench(OTHER, 0.005, "b")
    sim.set_wrench(PUSH, source="c")
    for _ in range(6):
        steps.append(sim.wrench)
        sim.step()
    assert steps == [total([PUSH, OTHER, PUSH])] * 3 + [total([OTHER, PUSH])] * 2 + [PUSH]


def test_new_wrench_replaces_that_of_its_source_only():
    sim = simulation(MOVING)
    sim.set_wrench(PUSH, source="a")
    sim.set_wrench(OTHER, source="b")
    sim.set_wrench(Wrench(), source="a")
    assert sim.wrench == OTHER
    sim.clear_wrench()
    assert sim.wrench == Wrench()
    sim.step(10)


def test_sources_are_saved_with_their_ends():
    sim = simulation(MOVING)
    sim.set_wrench(PUSH, 0.003, "a")
    sim.set_wrench(OTHER, 0.005, "b")
    saved = pickle.loads(pickle.dumps(sim.save()))
    sim.step(10)
    again = simulation(MOVING)
    again.restore(saved)
    again.step(10)
    assert again.save() == sim.save()


def test_sum_that_overflows_is_refused_and_changes_nothing():
    sim = simulation(MOVING)
    huge = Wrench(force_world=(1.5e308, 0.0, 0.0))
    sim.set_wrench(huge, source="a")
    before = sim.save()
    with pytest.raises(ValueError, match="add up to more than a float holds"):
        sim.set_wrench(huge, source="b")
    assert sim.save() == before


def test_wrenches_left_that_add_up_to_too_much_stop_the_step():
    """Two that only a third keeps within the range of floats: the state is that of the third one's end."""
    sim, one = simulation(MOVING), simulation(MOVING)
    for source, force, hold in (("a", 1.5e308, None), ("b", -1.5e308, 0.002), ("c", 1.5e308, None)):
        sim.set_wrench(Wrench(force_world=(force, 0.0, 0.0)), hold, source)
    one.set_wrench(Wrench(force_world=(1.5e308, 0.0, 0.0)))
    one.step(2)
    for _ in range(2):
        with pytest.raises(
            SimulationError, match=r"step 3 cannot be done: .* has run out, and .* more than a float holds"
        ):
            sim.step(5)
        assert sim.steps == 2
        assert_array_equal(sim.state.values, one.state.values)
    sim.clear_wrench()
    sim.step(5)


def test_wrench_not_for_the_integrator_is_refused_and_others_stay():
    sim = simulation(MOVING, integrator="exact")
    sim.set_wrench(PUSH, source="a")
    with pytest.raises(IntegratorError, match="takes no torque_world"):
        sim.set_wrench(Wrench(torque_world=(0.0, 0.0, 1.0)), source="b")
    sim.step(3)
    assert sim.wrench == PUSH


@pytest.mark.parametrize("coefficient", [1e150, 1e307])
def test_drag_beyond_any_float_is_taken_or_refused_as_a_whole(coefficient):
    """Its Jacobian is not finite, which no eigenvalue is found of: the step that follows says what is wrong."""
    sim = simulation(MOVING)
    sim.change(drag=Drag(quadratic=(coefficient,) * 3, linear=(1e308, 0.0, 0.0)))
    assert sim.integrator.name == "rosenbrock"
    before = sim.save()
    with pytest.raises(SimulationError, match="too stiff"):
        sim.step()
    assert sim.save() == before
    sim.change(drag=Drag())
    sim.step(3)


def test_state_set_from_outside_keeps_time_and_wrench():
    sim, fresh = simulation(), simulation(MOVING)
    for one in (sim, fresh):
        one.set_wrench(PUSH)
    sim.step(7)
    sim.set_state(MOVING)
    for one in (sim, fresh):
        one.step(10)
    assert sim.steps == 17
    assert_array_equal(sim.state.values, fresh.state.values)


@pytest.mark.parametrize("velocity", [2e307, 4e307])
def test_state_or_impulse_too_fast_for_other_axes_is_refused(velocity):
    """Each component is finite; in body axes their sum is not."""
    sim, turned = simulation(), State(orientation=(0.9, 0.1, 0.3, 0.2), velocity=(velocity,) * 3)
    before = sim.save()
    with pytest.raises(ValueError, match=r"moves too fast; give velocities below 1e\+307"):
        sim.set_state(turned)
    with pytest.raises(ValueError, match="not finite; give a smaller one"):
        sim.apply_impulse(Wrench(force_world=(velocity,) * 3))
    assert sim.save() == before


def test_scene_is_simulated_as_it_says():
    scene = Scene(
        {
            "rate": 50.0,
            "publish_rate": 50.0,
            "gravity": (0, 0, -1.62),
            "integrator.name": "rk4",
            "body.mass": 3.0,
            "initial.position": (0, 0, 5),
        }
    )
    sim = Simulation.from_scene(scene)
    assert (sim.rate, sim.integrator.name, sim.body) == (50.0, "rk4", scene.body())
    sim.step(50)
    assert_allclose(sim.state.position, (0, 0, 5 - 1.62 / 2), rtol=0, atol=3e-14)  # measured 0
    assert sim.state.momentum[2] == pytest.approx(-3.0 * 1.62, rel=1e-13, abs=0)  # measured 3.6e-16


RESISTED = {
    "drag.linear": (1.0, 2.0, 3.0),
    "tethers.line.anchor": (0.0, 0.0, 5.0),
    "tethers.line.rest_length": 2.0,
    "tethers.line.stiffness": 100.0,
    "forces.lift.force": (0.0, 0.0, 9.0),
    "forces.lift.body_point": (0.1, 0.0, 0.2),
}


def test_scene_gives_the_simulation_its_drag_tethers_forces_and_tolerance():
    sim = Simulation.from_scene(Scene({**RESISTED, "integrator.name": "rosenbrock", "integrator.rtol": 1e-6}))
    same = Simulation(
        Scene().body(),
        integrator="rosenbrock",
        drag=Drag((1, 2, 3)),
        tethers=[Tether(anchor=(0, 0, 5), rest_length=2.0, stiffness=100.0)],
        forces=[((0.1, 0.0, 0.2), (0.0, 0.0, 9.0))],
        rtol=1e-6,
    )
    for each in (sim, same):
        each.step(100)
    assert sim.save() == same.save()
    assert (sim.tethers, sim.forces) == (same.tethers, same.forces)
    assert np.linalg.norm(sim.state.velocity) > 0.1


def test_scene_with_an_integrator_that_leaves_something_out_is_refused_with_the_parameter():
    with pytest.raises(
        ValueError,
        match=r"parameter integrator\.name = 'taylor': .* leaves out drag, tethers, ground and added mass; choo",
    ):
        Simulation.from_scene(Scene({"drag.quadratic": (0.0, 0.0, 1.0), "integrator.name": "taylor"}))
    with pytest.raises(
        ValueError, match=r"parameter integrator\.name = 'exact': .* leaves out forces at points; choose"
    ):
        lift = {"forces.lift.force": (0.0, 0.0, 1.0), "forces.lift.body_point": (0.1, 0.0, 0.0)}
        Simulation.from_scene(Scene({**lift, "integrator.name": "exact"}))


def test_constant_force_at_the_centre_of_mass_turns_nothing_and_leaves_the_closed_form():
    sim = simulation(MOVING, forces=[((0.0, 0.0, 0.0), (0.0, 0.0, 2.0))])
    same = simulation(MOVING, gravity=(0.0, 0.0, 1.0))
    for one in (sim, same):
        one.step(1000)
    assert sim.plan.integrator == "exact"
    assert_array_equal(sim.state.values, same.state.values)


def test_description_is_one_line_with_what_is_simulated():
    text = simulation().describe()
    assert text.startswith(
        "mass 2 kg, principal moments [0.1, 0.2, 0.25] kg m2, rate 1000 Hz, integrator exact (nothing turns: "
    )
    assert "\n" not in text


def test_motion_is_the_same_whatever_is_read_in_between():
    watched, unwatched = simulation(MOVING), simulation(MOVING)
    for _ in range(10):
        watched.step()
        assert np.isfinite(watched.pose).all()
        assert watched.describe()
    unwatched.step(10)
    assert watched.save() == unwatched.save()


# Time from zero -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("integrator", ["auto", "taylor", "rk4"])
def test_time_from_zero_changes_the_count_of_steps_alone(integrator):
    """The motion goes on to the same bits, through the ends of two held wrenches, and without any."""
    simulations = [
        Simulation(
            Body(mass=2.0, inertia=(1.0, 2.0, 2.5)), State(angular_velocity=(0.3, 2.0, 0.1)), integrator=integrator
        )
        for _ in range(2)
    ]
    for simulation in simulations:
        simulation.set_wrench(Wrench(torque_body=(0.0, 0.3, 1.0)), hold=0.150, source="a")
        simulation.set_wrench(Wrench(force_world=(1.0, 0.0, 0.0)), hold=0.200, source="b")
    restarted, plain = simulations
    for count, passed in ((100, 100), (120, 220), (500, 720)):
        for simulation in simulations:
            simulation.step(count)
        restarted.restart_time()
        assert restarted.steps == 0 and plain.steps == passed
        assert restarted.time_ns == 0
        assert restarted.state.values.tolist() == plain.state.values.tolist()
        assert restarted.wrench == plain.wrench


def test_time_from_zero_with_the_closed_form():
    """``exact`` counts from where it was started; its answer does not change by a bit either."""
    body, spin = Body(mass=2.0, inertia=(1.0, 2.0, 2.5)), State(angular_velocity=(0.3, 2.0, 0.1))
    restarted, plain = (Simulation(body, spin, integrator="exact") for _ in range(2))
    for _ in range(3):
        for simulation in (restarted, plain):
            simulation.step(1000)
        restarted.restart_time()
        assert restarted.state.values.tolist() == plain.state.values.tolist()
    again = Simulation(body, spin, integrator="exact")
    again.restore(restarted.save())
    again.step(1000)
    plain.step(1000)
    assert again.steps == 1000 and again.state.values.tolist() == plain.state.values.tolist()


# Time without motion -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("integrator", ["auto", "exact", "taylor", "dop853"])
def test_waiting_counts_steps_and_moves_no_bit(integrator):
    """Nor is a bit of what follows another one: the closed form evaluates from where it did, as if no time had gone."""
    sim, plain = (Simulation(BODY, MOVING, gravity=(0.0, 0.1, -9.8), integrator=integrator) for _ in range(2))
    for steps, waited in ((0, 1000), (3, 5), (4, 0), (100, 1)):
        sim.step(steps)
        plain.step(steps)
        sim.wait(waited)
        assert sim.save().state == plain.save().state
    assert (sim.steps, plain.steps, sim.time) == (1113, 107, 1.113)


def test_what_is_held_while_time_waits_acts_for_what_was_left():
    sim, plain = simulation(), simulation()
    for each in (sim, plain):
        each.set_wrench(PUSH, hold=0.010)
        each.step(4)
    sim.wait(50)
    assert sim.wrench == PUSH
    for each in (sim, plain):
        each.step(20)
    assert sim.save().state == plain.save().state  # 10 ms of 2 N on 2 kg, whatever lay between
    assert_allclose(sim.state.velocity, (0.010, 0.0, 0.0), rtol=0, atol=1e-17)  # measured 0


def test_actuators_that_wait_go_on_where_they_were():
    """What lags and what is delayed, too, and commands for what is left of their time."""
    thruster = Actuator("one", "thruster", 0.0, 5.0, (0.1, 0.0, 0.0), time_constant=0.01, delay=0.0035)
    sim, plain = (simulation(actuators=[thruster]) for _ in range(2))
    for each in (sim, plain):
        each.set_actuators([2.0], hold=0.010)
        each.step(5)
    sim.wait(50)
    assert sim.actuator_states == plain.actuator_states
    for each in (sim, plain):
        each.step(20)
    assert sim.save().state == plain.save().state and sim.actuator_states == plain.actuator_states
    assert np.abs(sim.state.velocity).max() > 1e-3


@pytest.mark.parametrize(("n", "error"), [(-1, ValueError), (2.7, TypeError), ("3", TypeError)])
def test_number_of_steps_to_wait_that_is_none_is_refused_and_changes_nothing(n, error):
    sim = simulation(MOVING)
    saved = sim.save()
    with pytest.raises(error, match=r"wait\(-1\): time does not run backwards" if n == -1 else None):
        sim.wait(n)
    assert sim.save() == saved
