"""Actuators: exact at every rate, with their lags, delays and limits; and what spins inside turns with the body."""

import dataclasses
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rigid_body_sim import Actuator, Body, Drag, Scene, Simulation, SimulationError, State, Wrench
from rigid_body_sim.effects.actuators import LARGEST
from rigid_body_sim.report.reference.load import stored
from rigid_body_sim.values import rotation

PROBLEMS = stored("actuators.json")["problems"]
QUANTITIES = ("position", "orientation", "velocity", "angular_velocity")
SATELLITE = Body(12.0, (0.4, 0.5, 0.3, 0.01, 0.0, -0.02), (0.01, 0.0, -0.02))
START = State(orientation=(0.9, 0.1, -0.3, 0.2), angular_velocity=(0.1, -0.2, 0.05))
PUSH = Actuator("push", "thruster", -5.0, 5.0, (0.1, 0.0, 0.0), (0.0, 0.0, 2.0), time_constant=0.05)
SPIN = Actuator("spin", "wheel", -0.1, 0.1, axis=(1.0, 1.0, 0.0), inertia=1e-3, max_speed=300.0)


def made(problem, rate, **options):
    """The simulation of a problem of the references."""
    body, initial = problem["body"], problem["initial"]
    actuators = [Actuator(**{**one, "delay": float(one["delay"])}) for one in problem["actuators"]]
    state = State(orientation=initial["orientation"], angular_velocity=initial["angular_velocity"])
    body = Body(body["mass"], body["inertia"], body["center_of_mass"])
    return Simulation(body, state, rate=rate, gravity=problem["gravity"], actuators=actuators, **options)


def errors(name, rate, **options):
    """By quantity, the largest errors of the samples: of the state, of what actuators do, and of wheels."""
    problem = PROBLEMS[name]
    sim, found = made(problem, rate, **options), dict.fromkeys((*QUANTITIES, "speed", "effort"), 0.0)
    commands = {round(float(t) * rate): values for t, values in problem["commands"]}
    samples = {round(float(t) * rate): sample for t, sample in problem["samples"].items()}
    for step in sorted({*commands, *samples}):
        sim.step(step - sim.steps)
        if step in samples:
            for quantity, error in _apart(sim, samples[step]):
                found[quantity] = max(found[quantity], error)
        if step in commands:
            sim.set_actuators(commands[step])
    return found


def _apart(sim, sample):
    for quantity in QUANTITIES:
        yield quantity, np.abs(getattr(sim.state, quantity) - np.array(sample[quantity], float)).max()
    w_body = np.array(sample["angular_velocity"], float)
    for one, now, level, spin in zip(sim.actuators, sim.actuator_states, sample["level"], sample["spin"], strict=True):
        if one.type == "wheel":
            relative = float(spin) / one.inertia - np.dot(one.axis, w_body) / np.linalg.norm(one.axis)
            yield "speed", abs(now.speed - relative) / 100.0
        elif one.type == "thruster":
            yield "effort", abs(now.effort - float(level))
        else:
            yield "speed", abs(now.speed - float(level)) / 100.0


@pytest.mark.parametrize("rate", [10.0, 100.0, 1000.0])
@pytest.mark.parametrize("name", PROBLEMS)
def test_error_is_round_off_at_every_rate(name, rate):
    """Against mpmath, with lags from 4 ms to 0.4 s, delays that are no whole number of steps, and wheels at their top
    speed. Measured 9e-15 at most, at each of the three rates; speeds, of some 100 rad/s, in parts of that."""
    assert all(error < 3e-14 for error in errors(name, rate).values())


@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.parametrize(("method", "bound"), [("dop853", 1e-9), ("rosenbrock", 1e-9)])
def test_error_controlled_integrators_keep_within_rtol(name, method, bound):
    """Of 1e-10 a step, at 100 Hz. Measured 2e-10 and 1e-10. A Rosenbrock method that left out what changes with time
    alone came to 6e-5."""
    assert all(error < bound for error in errors(name, 100.0, integrator=method, rtol=1e-10).values())


def test_lag_of_rk4_held_over_a_step_is_shown_to_be_worse():
    """What others do: the level at the beginning of each step, held. At 100 Hz its error is 1e-4, ours 1e-15."""
    one = dataclasses.replace(PUSH, position=(0.0, 0.0, 0.0))
    exact, held = (
        Simulation(Body(2.0, (1, 1, 1)), rate=100.0, actuators=[one]),
        Simulation(Body(2.0, (1, 1, 1)), rate=100.0),
    )
    exact.set_actuators([4.0])
    for step in range(20):
        held.set_wrench(Wrench(force_body=(0.0, 0.0, 4.0 * -math.expm1(-step / 100.0 / 0.05))))
        held.step()
    exact.step(20)
    t, lag = 0.2, 0.05
    speed = 4.0 / 2.0 * (t + lag * math.expm1(-t / lag))
    assert abs(exact.state.velocity[2] - speed) < 1e-15
    assert abs(held.state.velocity[2] - speed) > 5e-3


def test_divided_steps_are_the_same_motion():
    """One step of 0.2 s and 200 of 1 ms, with a delay of 3.3 ms; measured 4e-16."""
    late = dataclasses.replace(PUSH, delay=0.0033)
    ends = []
    for rate in (5.0, 1000.0):
        sim = Simulation(SATELLITE, START, rate=rate, actuators=[late])
        sim.set_actuators([3.0])
        sim.step(round(0.2 * rate))
        ends.append(sim.state.values[:13])
    assert_allclose(ends[0], ends[1], rtol=0, atol=4e-15)


def test_momentum_of_body_and_wheels_together_does_not_change_by_one_bit():
    """A wheel's motor is inside. The body takes up what the wheel loses: it turns the other way, and stops again."""
    sim = Simulation(
        SATELLITE, START, rate=100.0, actuators=[SPIN, dataclasses.replace(SPIN, name="z", axis=(0, 0, 1))]
    )
    before, seen = sim.state.angular_momentum.copy(), []
    for command in ([0.05, -0.1], [-0.08, 0.1], [0.0, 0.0]):
        sim.set_actuators(command)
        sim.step(200)
        seen.append(sim.state.angular_velocity.copy())
    assert np.array_equal(sim.state.angular_momentum, before)
    assert np.abs(np.diff(seen, axis=0)).max() > 0.1


def test_total_momentum_is_that_of_the_body_and_of_its_wheels():
    """L = R (I w + sum of s a), with s from the speeds that are shown; measured 1e-16."""
    sim = Simulation(SATELLITE, START, rate=100.0, actuators=[SPIN])
    sim.set_actuators([0.07])
    sim.step(150)
    state, (wheel,) = sim.state, sim.actuator_states
    axis = np.array(SPIN.axis) / math.sqrt(2.0)
    inside = 1e-3 * (wheel.speed + axis @ state.angular_velocity) * axis
    whole = rotation.rotate(state.orientation, SATELLITE.inertia @ state.angular_velocity + inside)
    assert_allclose(state.angular_momentum, whole, rtol=0, atol=2e-15)


def test_spinning_rotor_makes_the_body_nutate():
    """A symmetric body at rest with a spin h along its axis, struck across: it nutates at h / I, in closed form.
    Measured 2e-15 over 3 periods."""
    rotor = Actuator("r", "rotor", 0.0, 1000.0, inertia=2e-3, time_constant=1e9, initial=500.0)
    body = Body(5.0, (0.2, 0.2, 0.1))
    sim = Simulation(body, rate=50.0, actuators=[rotor])
    sim.set_actuators([500.0])
    sim.apply_impulse(Wrench(torque_body=(0.02, 0.0, 0.0)))
    w, rate = 0.02 / 0.2, 1.0 / 0.2
    sim.step(190)
    turn = rate * sim.time
    assert_allclose(sim.state.angular_velocity, (w * math.cos(turn), w * math.sin(turn), 0.0), rtol=0, atol=1e-14)


def test_wheel_at_its_top_speed_pushes_no_more_and_leaves_it_at_once():
    """It takes up 300 rad/s x 1e-3 kg m2 = 0.3 N m s from rest: 3 s under 0.1 N m. Then the body keeps its spin."""
    sim = Simulation(Body(1.0, (1.0, 1.0, 1.0)), rate=10.0, actuators=[dataclasses.replace(SPIN, axis=(0, 0, 1))])
    sim.set_actuators([0.1])
    sim.step(25)
    assert_allclose(sim.state.angular_velocity[2], -0.25, rtol=0, atol=1e-15)
    sim.step(25)
    assert sim.state.angular_velocity[2] == -0.3
    sim.set_actuators([-0.1])
    sim.step(10)
    assert_allclose(sim.state.angular_velocity[2], -0.2, rtol=0, atol=1e-15)


def test_command_arrives_after_its_delay_to_the_moment():
    """At 10 Hz after 0.13 s: 0.07 s of the second step are left, and the speed is a t."""
    late = Actuator("a", "thruster", -9.0, 9.0, axis=(1, 0, 0), delay=0.13)
    sim = Simulation(Body(1.0, (1, 1, 1)), rate=10.0, actuators=[late])
    sim.set_actuators([2.0])
    sim.step(1)
    assert sim.state.velocity[0] == 0.0
    sim.step(1)
    assert_allclose(sim.state.velocity[0], 2.0 * 0.07, rtol=1e-14)


def test_limits_act_on_the_command_and_are_counted():
    sim = Simulation(SATELLITE, rate=100.0, actuators=[PUSH, SPIN])
    sim.set_actuators([7.0, 0.05])
    sim.set_actuators([1.0, 0.05])
    sim.set_actuators([-9.0, 9.0])
    assert sim.commands_limited == 2
    sim.step(200)
    assert [one.command for one in sim.actuator_states] == [-5.0, 0.1]
    assert_allclose(sim.actuator_states[0].effort, -5.0, rtol=1e-12)
    sim.change(actuators=[dataclasses.replace(PUSH, min=-1.0), SPIN])  # what is held obeys from here on
    speed = sim.actuator_states[1].speed
    assert sim.actuator_states[0].command == -1.0 and speed > 100.0
    sim.step(200)
    assert_allclose(sim.actuator_states[0].effort, -1.0, rtol=1e-12)


def test_held_commands_end():
    """After ``hold`` they are 0, and a held wrench goes on by itself."""
    sim = Simulation(SATELLITE, rate=100.0, actuators=[SPIN])
    sim.set_wrench(Wrench(force_world=(1.0, 0.0, 0.0)), hold=0.2)
    sim.set_actuators([0.1], hold=0.05)
    sim.step(30)
    ((_, speed, effort),) = sim.actuator_states
    assert effort == 0.0
    along = sim.state.angular_velocity @ np.array(SPIN.axis) / math.sqrt(2.0)
    assert_allclose(speed + along, 0.1 * 0.05 / 1e-3, rtol=1e-14)
    assert_allclose(sim.state.momentum[0], 0.2, rtol=1e-14)


def test_saved_and_restored_with_commands_on_their_way():
    """Exactly: levels, wheels, commands on their way, and when those that are held end."""
    late = [dataclasses.replace(PUSH, delay=0.0333), dataclasses.replace(SPIN, delay=0.02)]
    sim = Simulation(SATELLITE, START, rate=100.0, actuators=late)
    sim.set_actuators([3.0, 0.1])
    sim.step(2)
    sim.set_actuators([-2.0, -0.05], hold=0.07)
    sim.step(1)
    saved = sim.save()
    sim.step(20)
    end = sim.save()
    for again in (sim, Simulation(SATELLITE, rate=100.0, actuators=late)):
        again.restore(saved)
        again.step(5)
        again.step(15)
        assert again.save() == end


def test_reset_takes_actuators_back_to_their_start():
    sim = Simulation(SATELLITE, START, rate=100.0, actuators=[PUSH, SPIN])
    first = sim.save()
    sim.set_actuators([3.0, 0.1])
    sim.step(20)
    sim.reset()
    assert sim.save() == first


def test_step_that_cannot_be_done_leaves_actuators_as_they_were():
    """A spin of 1e5 rad in one step is refused; levels, wheels and commands on their way are those before it."""
    each = [dataclasses.replace(PUSH, delay=2.0), dataclasses.replace(SPIN, time_constant=0.5)]
    fast = State(angular_velocity=(1e6, 1e6, 0.0))
    sim = Simulation(Body(1.0, (1e-3, 2e-3, 3e-3)), rate=1.0, actuators=each)
    sim.set_actuators([2.0, 0.1])
    sim.step(2)
    sim.set_state(fast)
    before, shown = sim.save(), sim.actuator_states
    with pytest.raises(RuntimeError, match="step 3 cannot be done"):
        sim.step()
    assert sim.save().state == before.state and sim.actuator_states == shown
    sim.set_state(State())
    sim.step()
    assert sim.actuator_states[0].effort == 2.0 * -math.expm1(-1.0 / 0.05)


@pytest.mark.no_numba
@pytest.mark.parametrize(
    ("commands", "sentence"),
    [
        ([1.0], r"\[1.0\] refused: they are 1 numbers; give 2 numbers, for push, spin"),
        ([1.0, math.nan], "refused: not all are finite; give 2 numbers"),
        ([1.0, math.inf], "refused: not all are finite"),
        ("ab", "refused: they are no numbers"),
        ([None, 1.0], "refused: they are no numbers"),
        (["1", 1.0], "refused: not all are finite"),
        (b"ab", "refused: they are no numbers"),
        ([10**400, 1.0], "refused: not all are finite"),
        ([1e308, 1e308], None),
    ],
)
def test_bad_commands_are_refused_and_nothing_moves(commands, sentence):
    sim = Simulation(SATELLITE, rate=100.0, actuators=[PUSH, SPIN])
    sim.set_actuators([1.0, 0.05])
    before = sim.save()
    if sentence is None:  # their sum is not finite, but they are
        sim.set_actuators(commands)
        assert [one.command for one in sim.actuator_states] == [5.0, 0.1]
        return
    with pytest.raises(ValueError, match=sentence):
        sim.set_actuators(commands)
    assert sim.save() == before and sim.commands_limited == 0


@pytest.mark.no_numba
@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"type": "propeller"}, "type 'propeller' is not known; give one of thruster, rotor, wheel"),
        ({"time_constant": -0.1}, "time_constant -0.1 is not a finite number of at least 0"),
        ({"time_constant": 1e-320}, "is shorter than 1e-12 s; give 0, for none"),
        ({"time_constant": "short"}, "time_constant 'short' is not a number"),
        ({"max": None}, "max None is not a number"),
        ({"delay": -0.1}, "delay -0.1 is not a finite number of at least 0"),
        ({"delay": math.nan}, "delay nan is not a finite number of at least 0"),
        ({"max": 1e308}, "max 1e\\+308 is too large; give at most 1e\\+60"),
        ({"position": (0.0, -1e61, 0.0)}, "is too far away; give at most 1e\\+60 m"),
        ({"min": 2.0, "max": 1.0}, "min 2 is above max 1"),
        ({"axis": (0.0, 0.0, 0.0)}, "has no direction"),
        ({"inertia": 1.0}, "a thruster has no inertia; leave it out"),
        ({"type": "wheel"}, "a wheel has inertia; give its moment about its axis"),
        ({"type": "rotor"}, "min -5 is a speed below 0"),
        ({"type": "rotor", "min": 0.0}, "does nothing"),
        ({"direction": "left"}, "direction 'left' is not known; give ccw or cw"),
        ({"time_constant": 0.0, "initial": 1.0}, "initial 1 without a time_constant"),
    ],
)
def test_actuator_that_cannot_be_is_refused_with_its_name(change, sentence):
    with pytest.raises(ValueError, match=f"actuator 'push': .*{sentence}"):
        dataclasses.replace(PUSH, **change)


def largest(kind, **more):
    arm = (0.0, LARGEST, 0.0)
    return Actuator("far", kind, 0.0, LARGEST, arm, inertia=LARGEST * (kind != "thruster"), **more)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("lag", [0.0, 0.1])
@pytest.mark.parametrize(
    "actuator",
    [largest("thruster"), largest("rotor", thrust_coefficient=LARGEST, torque_coefficient=LARGEST), largest("wheel")],
    ids=lambda one: one.type,
)
def test_what_no_body_can_follow_is_told_with_who_commanded_it(actuator, lag):
    sim = Simulation(SATELLITE, actuators=[dataclasses.replace(actuator, time_constant=lag)])
    sim.set_actuators([1e300])
    before = sim.save()
    with pytest.raises(SimulationError, match=r"commanded far 1e\+60\); use a smaller wrench or smaller commands or"):
        for _ in range(1000):
            before = sim.save()
            sim.step()
    assert sim.save().state == before.state and np.isfinite(sim.state.values).all()


@pytest.mark.no_numba
def test_snapshot_of_other_actuators_is_refused_and_nothing_changes():
    """Of another number, of as many others, of another delay, and at another rate; other limits fit."""
    saved = Simulation(SATELLITE, START, rate=100.0, actuators=[PUSH, SPIN]).save()
    late = dataclasses.replace(PUSH, delay=1.0)
    for actuators, rate in (
        ((), 100.0),
        ((PUSH,), 100.0),
        ((late, SPIN), 100.0),
        ((SPIN, PUSH), 100.0),
        ((PUSH, SPIN), 50.0),
    ):
        sim = Simulation(SATELLITE, rate=rate, actuators=actuators)
        before = sim.save()
        with pytest.raises(ValueError, match="the snapshot is of other actuators or gusts, or another rate"):
            sim.restore(saved)
        assert sim.save() == before
        sim.set_wrench(Wrench(force_body=(1.0, 0.0, 0.0)))
    sim = Simulation(SATELLITE, rate=100.0, actuators=[dataclasses.replace(PUSH, max=1.0), SPIN])
    sim.restore(saved)
    assert sim.save() == saved


@pytest.mark.no_numba
@pytest.mark.parametrize("other", [(), (dataclasses.replace(SPIN, axis=(0.0, 0.0, 1.0)),), (PUSH,)])
def test_velocities_stay_where_actuators_change(other):
    """What spun inside is gone, or begins anew, and the body turns as before; measured 1.1e-16."""
    sim = Simulation(SATELLITE, START, rate=100.0, actuators=[SPIN])
    sim.set_actuators([0.1])
    sim.step(40)
    before = sim.state.values[:13].copy()
    sim.change(actuators=other)
    assert_allclose(sim.state.values[:13], before, rtol=0, atol=1e-15)


@pytest.mark.no_numba
def test_axis_may_have_any_length():
    """From 1e-300 to 1e308 the same motion, to the bit for powers of two."""
    ends = []
    for length in (1.0, 2.0**-990, 2.0**1023):
        sim = Simulation(
            SATELLITE, START, rate=100.0, actuators=[dataclasses.replace(PUSH, axis=(length, 0.0, -length))]
        )
        sim.set_actuators([2.0])
        sim.step(5)
        ends.append(sim.save().state)
    assert ends[0] == ends[1] == ends[2]


@pytest.mark.no_numba
@pytest.mark.parametrize("name", [3, "", " "])
def test_actuator_has_a_name(name):
    with pytest.raises(ValueError, match="its name is no text; give one"):
        dataclasses.replace(PUSH, name=name)


@pytest.mark.no_numba
def test_names_say_the_order_and_must_be_those_that_are_described():
    described = {
        f"actuators.{name}.{key}": value
        for name in "ba"
        for key, value in (("type", "thruster"), ("min", 0.0), ("max", 1.0))
    }
    assert [one.name for one in Scene({"actuators.names": ["b", "a"], **described}).effect("actuators")] == ["b", "a"]
    with pytest.raises(ValueError, match=r"actuators.names = \['b'\]: lacks a, whose parameters are given"):
        Scene({"actuators.names": ["b"], **described}).terms()
    with pytest.raises(ValueError, match=r"c has no parameters; give actuators.c.type"):
        Scene({"actuators.names": ["b", "a", "c"], **described}).terms()
    with pytest.raises(ValueError, match="the name 'push' is there twice"):
        Simulation(SATELLITE, actuators=[PUSH, PUSH])
    with pytest.raises(ValueError, match="more than 100000 steps"):
        Simulation(SATELLITE, rate=1e6, actuators=[dataclasses.replace(PUSH, delay=1.0)])


@pytest.mark.no_numba
@pytest.mark.parametrize("extra", [{}, {"drag": Drag(linear=(0.1, 0.2, 0.3))}], ids=["alone", "with drag"])
def test_plain_python_does_the_same(extra):
    """As compiled, to round-off; the numbers are those of the compiled kernels, at 100 Hz after 0.05 s."""
    sim = Simulation(SATELLITE, START, rate=100.0, actuators=[dataclasses.replace(PUSH, delay=0.013), SPIN], **extra)
    sim.set_actuators([3.0, 0.1])
    sim.step(5)
    expected = EXPECTED["drag" if extra else "alone"]
    assert_allclose(sim.state.values[:13], expected, rtol=0, atol=1e-11 if extra else 1e-15)


EXPECTED = {
    "alone": [
        -2.1838243073963454e-05,
        -7.52809549012072e-06,
        2.2452572458685552e-05,
        0.921286792511319,
        0.10547201114798366,
        -0.3121575884760731,
        0.20655251333597485,
        -0.0015871973320611289,
        -0.000726889418847416,
        0.001857499724705245,
        0.09134132819550646,
        -0.21278878748943927,
        0.04945591808991955,
    ],
    "drag": [
        -2.1808194970416445e-05,
        -7.565385494781238e-06,
        2.2368229069475234e-05,
        0.9212867925113191,
        0.10547201114798362,
        -0.31215758847607317,
        0.20655251333597488,
        -0.0015857074363206341,
        -0.0007282050344474844,
        0.0018537051504556694,
        0.09134132819550643,
        -0.21278878748943927,
        0.04945591808991951,
    ],
}


def test_states_do_not_depend_on_who_reads_the_acceleration():
    """It lets commands that act at once take effect; so do the states, as for a wrench that is held."""
    actuators = (
        PUSH,
        SPIN,
        Actuator("jet", "thruster", -5.0, 5.0),
        Actuator("late", "thruster", -5.0, 5.0, delay=0.015),
    )
    quiet, read = (Simulation(SATELLITE, START, rate=100.0, actuators=actuators) for _ in range(2))
    for commands in ([1.0, 0.05, 2.0, 3.0], [-1.0, -0.05, 4.0, 1.0]):
        for sim in (quiet, read):
            sim.set_actuators(commands, 0.04)
        for _ in range(6):
            assert len(read.acceleration) == 6
            assert read.actuator_states == quiet.actuator_states
            for sim in (quiet, read):
                sim.step()
    assert read.save() == quiet.save()
