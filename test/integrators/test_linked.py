"""Bodies with links between them: closed forms, conserved momenta, references to 20 digits, purity, refusal."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from rigid_body_sim import Actuator, Body, Drag, Fluid, Simulation, State
from rigid_body_sim.effects import link
from rigid_body_sim.effects.added_mass import AddedMass
from rigid_body_sim.effects.ground import Ground
from rigid_body_sim.effects.link import Link
from rigid_body_sim.integrators import linked
from rigid_body_sim.kernels.arrays import python_floats, zeros_on_a_line
from rigid_body_sim.kernels.drive import LEVELS
from rigid_body_sim.kernels.model import FORCE, MEMORY, RTOL, WRENCH
from rigid_body_sim.kernels.motion import fluid_velocity
from rigid_body_sim.kernels.state import SIZE, L, P, read_motion
from rigid_body_sim.many_bodies import of_terms
from rigid_body_sim.report.reference.load import stored
from rigid_body_sim.terms import Terms
from rigid_body_sim.theory.invariants import kinetic_energy
from rigid_body_sim.values.state import body_state, flatten

SMALL = Body(1.0, (0.1, 0.1, 0.1))
LARGE = Body(3.0, (0.3, 0.2, 0.25, 0.01, -0.02, 0.015), (0.02, -0.01, 0.03))
DOWN = (0.0, 0.0, -9.80665)
TURNING = State((0.0, 0.0, 1.5), (0.9, 0.1, -0.3, 0.2), (0.3, -0.2, 0.5), (0.5, -1.0, 0.7))


class Linked:
    """Bodies by their names, with their states and the links between them, in arrays; ``moving``: those to advance."""

    def __init__(self, bodies, links, rate=1000.0, moving=None):
        self.terms, states = ({name: one[i] for name, one in bodies.items()} for i in (0, 1))
        self.bodies, self.h = of_terms(list(self.terms.values()), 1.0 / rate), 1.0 / rate
        self.states = zeros_on_a_line(SIZE * len(bodies)).reshape(-1, SIZE)
        for i, state in enumerate(states.values()):
            self.states[i] = flatten(state, self.bodies.models[i])
        linked_terms = {name: self.terms[name] for name in moving or bodies}
        bare = {name: one.body for name, one in linked_terms.items()}
        self.links = np.concatenate([link.row(one, bare) for one in links])
        self.which = np.array([self.place(name) for name in linked_terms])
        self.work = np.zeros(linked.work_size(len(self.which)))
        self.given = links
        self._advance = linked.ready_linked(tuple(one.kernels for one in linked_terms.values()))

    def step(self, n):
        models, width = self.bodies.models.reshape(-1), self.bodies.models.shape[1]
        return self._advance(self.states.reshape(-1), models, width, self.which, self.links, self.work, self.h, n)

    def state(self, name):
        flat, model = self.states[self.place(name)], self.bodies.models[self.place(name)]
        return body_state(read_motion(python_floats(flat), python_floats(model)), flat)

    def place(self, name):
        return list(self.terms).index(name)

    def command(self, name, values):
        """To the actuators of a body, at the beginning of its memory."""
        model = self.bodies.models[self.place(name)]
        model[int(model[MEMORY]) :][: len(values)] = values

    def levels(self, name, count):
        """Of the actuators of a body, which lie in lists of ``count``."""
        model = self.bodies.models[self.place(name)]
        return model[int(model[MEMORY]) + count * LEVELS :][:count].copy()

    @property
    def numbers(self):
        """All that goes on: states and memories."""
        memories = [model[int(model[MEMORY]) :] for model in self.bodies.models]
        return np.concatenate((self.states.ravel(), *memories))

    def energy(self):
        bodies = {name: (one.body, self.state(name)) for name, one in self.terms.items()}
        kinetic = sum(float(kinetic_energy(*one)) for one in bodies.values())
        stored = sum(float(link.energy(one, *bodies[one.bodies[0]], *bodies[one.bodies[1]])) for one in self.given)
        return kinetic + stored

    def momenta(self):
        """Linear and angular momentum of all, about the world's origin."""
        x, p, spin = self.states[:, 0:3], self.states[:, P : P + 3], self.states[:, L : L + 3]
        return np.concatenate((p.sum(0), (spin + np.cross(x, p)).sum(0)))


def spring(**numbers):
    usual = {"bodies": ("a", "b"), "rest_length": 1.0, "stiffness": 100.0, "slack": False}
    return Link("spring", **{**usual, **numbers})


def pair(one, *, mass=3.0, rtol=1e-9, state=None, rate=1000.0, at=1.5, **others):
    """A ball of 1 kg at rest at the origin, and another above it."""
    other = Terms(Body(mass, (0.1, 0.1, 0.1)), rtol=rtol)
    bodies = {"a": (Terms(SMALL, rtol=rtol, **others), State()), "b": (other, state or State((0.0, 0.0, at)))}
    return Linked(bodies, [one], rate)


@pytest.mark.no_numba
@pytest.mark.parametrize(("rate", "bound"), [(1000.0, 3e-14), (20.0, 2e-9)])
def test_two_bodies_on_a_spring_swing_with_the_reduced_mass(rate, bound):
    """About their centre of mass, which stays at 1.125 m, with ω² = k (1 / m + 1 / M). Measured 8e-15 and 6e-10."""
    both = pair(spring(), rate=rate)
    assert both.step(round(0.5 * rate)) == round(0.5 * rate)
    omega = math.sqrt(100.0 * (1.0 + 1.0 / 3.0))
    length, rate_of = 1.0 + 0.5 * math.cos(0.5 * omega), -0.5 * omega * math.sin(0.5 * omega)
    lower, upper = both.state("a"), both.state("b")
    expected = [1.125 - 0.75 * length, 1.125 + 0.25 * length, -0.75 * rate_of, 0.25 * rate_of]
    found = [lower.position[2], upper.position[2], lower.velocity[2], upper.velocity[2]]
    assert_allclose(found, expected, rtol=0, atol=bound)


def tumbling(ends=("a", "b"), points=((0.1, 0.2, -0.1), (-0.2, 0.1, 0.1)), **numbers):
    bodies = {"a": (Terms(LARGE), State(angular_velocity=(1.0, 0.5, -0.7))), "b": (Terms(SMALL), TURNING)}
    return Linked(bodies, [spring(bodies=ends, points=points, **numbers)])


def test_momenta_and_energy_of_a_pair_stay():
    """For 3 s, with points off the centres: momenta to 3e-16 and 7e-16, of 0.6 and 0.8, and energy to 6e-14 of 19 J."""
    both = tumbling()
    before, energy, spins = both.momenta(), both.energy(), both.states[:, L : L + 3].copy()
    assert both.step(3000) == 3000
    assert_allclose(both.momenta()[:3], before[:3], rtol=0, atol=1e-15)
    assert_allclose(both.momenta()[3:], before[3:], rtol=0, atol=3e-15)
    assert both.energy() == pytest.approx(energy, abs=2e-13)
    assert np.abs(both.states[:, L : L + 3] - spins).max() > 0.1


def test_damper_takes_energy_out_and_leaves_momenta():
    both = tumbling(damping=2.0)
    before, energy = both.momenta(), both.energy()
    both.step(1000)
    assert_allclose(both.momenta(), before, rtol=0, atol=2e-15)  # measured 4e-16
    assert both.energy() < energy - 10.0  # of 19 J


def test_exchanging_the_ends_changes_nothing():
    """Not one bit: what acts on the one is minus what acts on the other."""
    one, other = tumbling(), tumbling(("b", "a"), ((-0.2, 0.1, 0.1), (0.1, 0.2, -0.1)))
    one.step(500)
    other.step(500)
    assert_array_equal(one.states, other.states)


PROBLEMS = stored("links.json")["problems"]


def made(problem, rate, rtol):
    bodies = {}
    for name, given in problem["bodies"].items():
        body = Body(given["mass"], given["inertia"], given["center_of_mass"])
        actuators = [Actuator(**{**one, "delay": float(one["delay"])}) for one in given["actuators"]]
        state = State(*(given[key] for key in ("position", "orientation", "velocity", "angular_velocity")))
        bodies[name] = Terms(body, problem["gravity"], rtol, actuators=actuators), state
    links = [Link(f"link{i}", slack=one.pop("slack"), **one) for i, one in enumerate(map(dict, problem["links"]))]
    whole = Linked(bodies, links, rate)
    for i, (name, given) in enumerate(problem["bodies"].items()):
        whole.bodies.models[i, WRENCH + 6 : WRENCH + 9] = given["force_world"]
        whole.command(name, [problem["command"]] * len(given["actuators"]))
    return whole


@pytest.mark.parametrize(("rate", "rtol", "bound"), [(1000.0, 1e-12, 2e-13), (50.0, 1e-9, 3e-8)])
@pytest.mark.parametrize("name", PROBLEMS)
def test_error_against_references(name, rate, rtol, bound):
    """A slung load, a chain of three and a load below rotors with a lag, fastened off their centres.

    Largest error of positions, quaternions and velocities after 0.2 and 0.6 s; see bench/reference/make_links.py.
    Measured 5e-14 and 1e-8, of the chain.
    """
    whole, done = made(PROBLEMS[name], rate, rtol), 0
    for time, sample in PROBLEMS[name]["samples"].items():
        until = round(float(time) * rate)
        assert whole.step(until - done) == until - done
        done = until
        for body, values in sample.items():
            assert_allclose(whole.state(body).values[:13], np.array(values, float), rtol=0, atol=bound)


GROUND = Ground(-0.3, stiffness=2e3, damping=10.0, friction=0.5, contacts=((0.1, 0, 0), (-0.1, 0.1, 0), (0, -0.1, 0)))
FALLING = {"gravity": DOWN, "drag": Drag((1.0, 2.0, 3.0), (0.5, 0.6, 0.7)), "ground": GROUND}


@pytest.mark.parametrize(("second", "bound"), [({"gravity": DOWN}, 1e-14), (FALLING, 5e-9)], ids=["one", "both"])
def test_link_of_no_stiffness_leaves_each_body_as_it_moves_alone(second, bound):
    """To rtol, not to the bit: the sub-steps are those that the other body needs. One or both fall to the ground.

    Where one does it needs the shorter ones, and moves as alone to the bit, the other to 2e-15; where both do, to 1e-9.
    """
    bodies = {
        "a": (LARGE, State(velocity=(0.5, 0.0, 0.1), angular_velocity=(0.3, -0.2, 1.0)), FALLING),
        "b": (SMALL, State((1.0, 0.0, 0.1), (0.9, 0.1, -0.3, 0.2), (0.3, -0.2, 0.5), (0.5, -1.0, 0.7)), second),
    }
    linked_bodies = {name: (Terms(body, **acting), state) for name, (body, state, acting) in bodies.items()}
    both = Linked(linked_bodies, [spring(stiffness=0.0)], 200.0)
    assert both.step(120) == 120
    for name, (body, state, acting) in bodies.items():
        alone = Simulation(body, state, rate=200.0, integrator="dop853", **acting)
        alone.step(120)
        assert acting is not FALLING or sum(one.normal_force for one in alone.contacts) > 1.0
        assert_allclose(both.state(name).values, alone.state.values, rtol=0, atol=bound)


def test_slack_rope_changes_no_momentum_by_one_bit():
    both = pair(spring(rest_length=2.0, slack=True), state=TURNING)
    before = both.states[:, P:13].copy()
    both.step(200)
    assert_array_equal(both.states[:, P:13], before)


@pytest.mark.no_numba
@pytest.mark.parametrize(
    ("rtol", "rate", "bound"), [(1e-4, 20.0, 5e-7), (1e-6, 100.0, 1e-6), (1e-9, 100.0, 2e-9), (1e-12, 100.0, 2e-9)]
)
def test_rope_that_pulls_taut_throws_the_bodies_back(rtol, rate, bound):
    """Half a swing, π / ω, at the end of which the relative velocity is turned round, and it is slack again.

    Measured 3e-8 (5e-6 without a word that there is a kink), 2e-7, 5e-12 and 6e-10: at a kink, what round-off of the
    positions may do is allowed for (see ``weighed``).
    """
    rope = spring(rest_length=1.0, stiffness=1e4, slack=True)
    both = pair(rope, state=State((0.0, 0.0, 0.9), velocity=(0.0, 0.0, 2.0)), rtol=rtol, rate=rate)
    assert both.step(round(0.2 * rate)) == round(0.2 * rate)
    omega = math.sqrt(1e4 * (1.0 + 1.0 / 3.0))
    length = 1.0 - 2.0 * (0.2 - 0.05 - math.pi / omega)
    lower, upper = both.state("a"), both.state("b")
    assert upper.velocity[2] - lower.velocity[2] == pytest.approx(-2.0, abs=bound)
    assert upper.position[2] - lower.position[2] == pytest.approx(length, abs=bound)


def test_added_mass_answers_to_a_link_too():
    """A sphere in still water: ω² = k (1 / (m + m_a) + 1 / M). Measured 1e-15."""
    heavy = AddedMass((0.5, 0.5, 0.5, 0.0, 0.0, 0.0))
    both = pair(spring(), added_mass=heavy)
    both.step(500)
    omega = math.sqrt(100.0 * (1.0 / 1.5 + 1.0 / 3.0))
    length = both.state("b").position[2] - both.state("a").position[2]
    assert length == pytest.approx(1.0 + 0.5 * math.cos(0.5 * omega), abs=1e-14)


def drone(rate, delay=0.0):
    """A load that swings below four rotors whose commands take a while."""
    body = PROBLEMS["lifted"]["bodies"]["drone"]
    rotors = [Actuator(**{**one, "delay": delay}) for one in body["actuators"]]
    terms = Terms(Body(body["mass"], body["inertia"], body["center_of_mass"]), DOWN, actuators=rotors)
    bodies = {"a": (terms, State()), "b": (Terms(SMALL, DOWN), State((0.3, 0.0, -1.0)))}
    made = Linked(bodies, [spring(slack=True, damping=0.5)], rate)
    made.command("a", [700.0, 710.0, 690.0, 700.0])
    return made


GUSTY = {
    "fluid": Fluid((6.0, -2.0, 1.0), gust_intensity=1.5, gust_length_scale=20.0, gust_seed=7),
    "drag": Drag((1.0, 2.0, 3.0), (0.5, 0.6, 0.7)),
}


def in_gusts():
    """A ball in gusts, on a rope to one that is in still air."""
    return pair(spring(slack=True), state=TURNING, rate=50.0, **GUSTY)


@pytest.mark.parametrize("made", [lambda: drone(200.0, 0.0123), in_gusts], ids=["drone", "in gusts"])
def test_runs_repeat_and_calls_may_be_divided_anywhere(made):
    """Not one bit of states and memories, of gusts and actuators, depends on it."""
    one, again, other = made(), made(), made()
    begun = one.numbers
    assert one.step(60) == again.step(60) == 60
    assert [other.step(n) for n in (1, 20, 2, 37)] == [1, 20, 2, 37]
    assert_array_equal(again.numbers, one.numbers)
    assert_array_equal(other.numbers, one.numbers)
    assert np.count_nonzero(one.numbers != begun) > SIZE


def test_gusts_are_those_that_act_on_the_body_alone():
    """Whatever the link does; and on a spring of no stiffness, the body moves as it does alone."""
    alone, pulled = Simulation(SMALL, rate=50.0, **GUSTY), pair(spring(), rate=50.0, **GUSTY)
    free = pair(spring(stiffness=0.0), rate=50.0, **GUSTY)
    for one in (alone, pulled, free):
        one.step(60)
        model = one._model if one is alone else one.bodies.models[0]
        assert_array_equal(fluid_velocity(model), fluid_velocity(alone._model))
    assert_allclose(free.state("a").values, alone.state.values, rtol=0, atol=1e-14)  # measured: not one bit


def test_commands_that_arrive_within_a_step_divide_it():
    """Steps of 0.1 s and of 1 ms: the delay of 13.3 ms is no whole number of either. Measured 3e-11.

    The speeds go to zero until then, and to those commanded from then on, each with the lag; to 1e-13 rad/s.
    """
    ends, lag = [], PROBLEMS["lifted"]["bodies"]["drone"]["actuators"][0]["time_constant"]
    for rate in (10.0, 1000.0):
        both = drone(rate, 0.0133)
        begun = both.levels("a", 4)
        both.step(round(0.3 * rate))
        commands = np.array([700.0, 710.0, 690.0, 700.0])
        arrived = begun * math.exp(-0.0133 / lag)
        expected = commands + (arrived - commands) * math.exp(-(0.3 - 0.0133) / lag)
        assert_allclose(both.levels("a", 4), expected, rtol=0, atol=5e-13)
        ends.append([both.state(name).values[:13] for name in ("a", "b")])
    assert_allclose(ends[0], ends[1], rtol=0, atol=2e-10)


def test_held_force_acts_beside_a_rotor_and_both_are_shown_at_the_end():
    """What the two bodies gain is what those give, with thrust c u² (1 − e^(−t/T))², and the model has the last force.

    Measured 4e-16, and not one bit.
    """
    c, u, lag, t = 1e-5, 300.0, 0.1, 0.25
    rotor = Actuator("rotor", "rotor", 0.0, 900.0, time_constant=lag, thrust_coefficient=c)
    both = pair(spring(), actuators=[rotor])
    both.bodies.models[0, WRENCH + 2] = 2.0
    both.command("a", [u])
    assert both.step(250) == 250
    e = math.exp(-t / lag)
    thrust = c * u * u * (t - 2.0 * lag * (1.0 - e) + 0.5 * lag * (1.0 - e * e))
    assert both.momenta()[2] == pytest.approx(2.0 * t + thrust, abs=2e-15)
    assert both.bodies.models[0, FORCE + 2] == pytest.approx(2.0 + c * (u * (1.0 - e)) ** 2, abs=2e-15)


def assert_stops_whole(both, kept):
    """Some steps of nine are done, and the one that cannot be moves nothing; ``kept`` is the same, before its steps."""
    done = both.step(9)
    assert 0 < done < 9
    assert kept.step(done) == done
    assert_array_equal(both.numbers, kept.numbers)
    assert both.step(1) == 0
    assert_array_equal(both.numbers, kept.numbers)


def test_step_that_cannot_be_done_leaves_all_bodies():
    """A stiff rope with a damper comes to be taut: a few steps are done, and nothing moved after them."""
    rope = spring(stiffness=1e15, damping=5e7, slack=True)
    both, kept = (pair(rope, state=State((0, 0, 0.9), velocity=(0.1, 0, 0.5)), rate=20.0) for _ in range(2))
    both.bodies.models[1, WRENCH + 8] = kept.bodies.models[1, WRENCH + 8] = 10.0
    assert_stops_whole(both, kept)


@pytest.mark.no_numba
def test_step_that_cannot_be_done_leaves_actuators_and_other_rows():
    """The rope comes to be taut within a step, in which a rotor, whose commands take a while, has sped up already.

    What the rotor does now is as it was, too.
    """
    rotor = Actuator("rotor", "rotor", 0.0, 900.0, time_constant=0.1, delay=0.06, thrust_coefficient=1e-5)
    bodies = {
        "other": (Terms(LARGE), TURNING),
        "b": (Terms(SMALL), State()),
        "another": (Terms(LARGE), TURNING),
        "a": (Terms(SMALL, actuators=[rotor]), State((0.0, 0.0, 0.9), velocity=(0.1, 0.0, 0.5))),
    }
    rope = spring(stiffness=1e300, slack=True)
    both, kept = (Linked(bodies, [rope], 20.0, moving=("a", "b")) for _ in range(2))
    for one in (both, kept):
        one.command("a", [300.0])
    assert_stops_whole(both, kept)
    assert_array_equal(both.bodies.models[3, FORCE : FORCE + 3], kept.bodies.models[3, FORCE : FORCE + 3])


@pytest.mark.no_numba
def test_force_beyond_the_range_of_floats_leaves_all_bodies():
    both = pair(spring(stiffness=1e308, rest_length=5.0), state=TURNING)
    before = both.numbers
    assert both.step(3) == 0
    assert_array_equal(both.numbers, before)


def test_bodies_may_be_any_rows_and_no_other_row_is_touched():
    """Of another mass and rtol. Steps of 50 ms, so that rtol tells into how many sub-steps they are divided."""
    alone = pair(spring(), state=TURNING, rate=20.0, **GUSTY)
    bodies = {
        "other": (Terms(LARGE, rtol=1e-12), TURNING),
        "another": (Terms(LARGE, rtol=1e-12), TURNING),
        "b": (alone.terms["b"], TURNING),
        "a": (alone.terms["a"], State()),
    }
    among = Linked(bodies, [spring()], 20.0, moving=("a", "b"))
    alone.bodies.models[0, WRENCH + 8] = among.bodies.models[3, WRENCH + 8] = 1.0
    before = among.states[:2].copy()
    assert among.step(20) == alone.step(20) == 20
    assert_array_equal(among.states[[3, 2]], alone.states)
    assert_array_equal(among.states[:2], before)


def test_tolerance_is_the_smallest_of_the_bodies():
    """A body that tumbles fast does so as accurately as one at rest wants it. 1e-15 apart, else 3e-10."""
    spinning = State(angular_velocity=(9.0, 5.0, -7.0))
    bodies = {"a": (Terms(LARGE), spinning), "b": (Terms(SMALL), State((0, 0, 1.5)))}
    one, other, loose = (Linked(bodies, [spring(stiffness=0.0)], 5.0) for _ in range(3))
    for both, tolerances in ((one, (1e-4, 1e-11)), (other, (1e-11, 1e-11)), (loose, (1e-4, 1e-4))):
        both.bodies.models[:, RTOL] = tolerances
        both.step(5)
    assert_allclose(one.states, other.states, rtol=0, atol=1e-12)
    assert np.abs(loose.states - other.states).max() > 1e-10
