"""Ground: rest, bounces, slopes and first contacts against closed forms; energy never rises; nothing is passed by."""

import math

import numpy as np
import pytest
from mpmath import mp, mpf
from numpy.testing import assert_allclose, assert_array_equal

from rigid_body_sim import Actuator, Body, Ground, Scene, Simulation, State, Wrench
from rigid_body_sim.effects import ground as effect
from rigid_body_sim.integrators import dop853, rosenbrock, substep
from rigid_body_sim.kernels import motion
from rigid_body_sim.kernels.arrays import python_floats
from rigid_body_sim.kernels.stiffness import spectral_radius
from rigid_body_sim.kernels.wrench import reduce_wrench
from rigid_body_sim.terms import Terms
from rigid_body_sim.values import rotation
from rigid_body_sim.values.state import flatten

G = 9.80665
GRAVITY = (0.0, 0.0, -G)
BALL = Body(2.0, (0.1, 0.1, 0.1))
BOX = Body(2.0, (0.05, 0.06, 0.07), (0.01, -0.02, 0.03))
LEVEL = Body(2.0, (0.05, 0.06, 0.07))
FEET = tuple((x, y, -0.1) for x in (-0.2, 0.2) for y in (-0.15, 0.15))
CORNERS = tuple((x, y, z) for x in (-0.2, 0.2) for y in (-0.15, 0.15) for z in (-0.1, 0.1))
POINT = ((0.0, 0.0, 0.0),)
METHODS = pytest.mark.parametrize("integrator", ["dop853", "rosenbrock"])


def on_ground(body, state, contacts, rate=1000.0, gravity=GRAVITY, stiffness=1e4, **how):
    options = {name: how.pop(name) for name in ("integrator", "rtol") if name in how}
    ground = Ground(stiffness=stiffness, contacts=contacts, **how)
    return Simulation(body, state, rate=rate, gravity=gravity, ground=ground, **options)


@METHODS
@pytest.mark.parametrize("contacts", [POINT, FEET], ids=["one contact", "four contacts"])
def test_body_rests_where_its_weight_is_held(integrator, contacts):
    """k d = m g on one contact or on the mean of four; falls 1 mm to there. Measured 2e-17 m and 5e-16 m/s."""
    body = BALL if contacts == POINT else BOX
    lowest = -min(z for _, _, z in contacts)
    sim = on_ground(body, State((0, 0, lowest + 1e-3)), contacts, damping=100.0, integrator=integrator)
    sim.step(3000)
    depths = [contact.penetration for contact in sim.contacts]
    assert np.mean(depths) == pytest.approx(body.mass * G / (1e4 * len(contacts)), abs=1e-9)
    assert sum(contact.normal_force for contact in sim.contacts) == pytest.approx(body.mass * G, rel=1e-9)
    assert_allclose(sim.state.values[7:13], 0.0, rtol=0, atol=1e-9)


def rebound(damping, stiffness=1e4, mass=2.0):
    """Coefficient of restitution and time of contact [s] of a spring and damper that never pulls.

    Schwager & Pöschel, Granular Matter 9 (2007) 465: s'' + 2 β s' + ω₀² s = 0 up to where the acceleration is zero.
    """
    b, square = damping / (2.0 * mass), stiffness / mass
    w = math.sqrt(abs(square - b * b))
    if b * b < square:
        t = (math.pi - math.atan2(2.0 * b * w, w * w - b * b)) / w
    else:
        t = math.log((b + w) / (b - w)) / w
    return math.exp(-b * t), t


@METHODS
@pytest.mark.parametrize("rate", [1000.0, 100.0, 10.0])
@pytest.mark.parametrize("damping", [0.0, 40.0, 200.0, 600.0])
def test_it_bounces_with_the_restitution_of_its_damping(integrator, rate, damping):
    """Also where touch-down and lift-off lie within one step; 600 N s/m are above the critical 283. Measured 2e-13."""
    start = State((0, 0, 0.0503), velocity=(0, 0, -1.0))
    sim = on_ground(BALL, start, POINT, rate, (0, 0, 0), damping=damping, integrator=integrator, rtol=1e-11)
    sim.step(round(0.2 * rate))
    e, t = rebound(damping)
    assert sim.state.velocity[2] == pytest.approx(e, abs=1e-9)
    depth = damping * e / 1e4  # it leaves where k d + c d' = 0, with d' = −e
    assert sim.state.position[2] == pytest.approx(e * (0.2 - 0.0503 - t) - depth, abs=1e-9)


@pytest.mark.parametrize("damping", [0.0, 1.414e5, 8.485e5])
def test_bounce_far_shorter_than_a_step_is_not_damped_away(damping):
    """It takes 45 µs of a step of 0.1 s: an L-stable method would see no error in a body that simply stops there."""
    start = State((0, 0, 0.05), velocity=(0, 0, -1.0))
    sim = on_ground(BALL, start, POINT, 10.0, (0, 0, 0), 1e10, damping=damping, integrator="rosenbrock", rtol=1e-4)
    sim.step()
    assert sim.state.velocity[2] == pytest.approx(rebound(damping, 1e10)[0], abs=1e-6)  # measured 1e-8


def test_ball_that_bounces_ever_less_comes_to_rest():
    """Dropped from 1 m with a restitution of 0.9: after 25 s it lies, and no bounce was too small. Measured 2e-17 m."""
    damping = 9.69
    assert rebound(damping)[0] == pytest.approx(0.9, abs=1e-3)
    sim = on_ground(BALL, State((0, 0, 1.0)), POINT, rate=500.0, damping=damping)
    velocities = []
    for _ in range(12_500):
        sim.step()
        velocities.append(sim.state.velocity[2])
    rising = np.array(velocities) > 1e-6
    assert (rising[1:] > rising[:-1]).sum() > 30  # bounces
    assert sim.state.position[2] == pytest.approx(-2.0 * G / 1e4, abs=1e-9)


def first_contact(step, work_size, sim, h):
    """The time [s] in a step of h at which the integrator begins to count a contact, from how fast the body fell."""
    terms, found = sim.terms, []
    model = terms.model(Wrench())
    reduce_wrench(model)
    state = flatten(sim.initial_state, model)

    def settle(numbers, body):
        terms.kernels.settle(numbers, body)
        rows = np.array(numbers)[-len(sim.ground.contacts) * effect.SIZE :].reshape(-1, effect.SIZE)
        if rows[:, effect.SIZE - 1].any():
            found.append((sim.initial_state.velocity[2] - body.v.z) / G)

    work = python_floats(np.zeros(work_size))
    with np.errstate(all="ignore"):
        assert step(terms.kernels._replace(settle=settle), python_floats(state), python_floats(model), work, h)
    return found[0]


@pytest.mark.no_numba
@pytest.mark.parametrize(("method", "rtol"), [(dop853, 1e-12), (rosenbrock, 1e-9)], ids=["dop853", "rosenbrock"])
def test_first_contact_of_a_falling_rod(method, rtol):
    """A rod falls and turns at 6 rad/s; the first of its ends reaches the ground within a step of 0.5 s.

    Its ends are at z₀ + v t − g t²/2 ± a (u cos ω t + (w × u) sin ω t), solved by mpmath with 40 digits.
    Measured 2e-15 s by dop853, 9e-13 s by rosenbrock.
    """
    half, q, rate, up, height = 0.5, rotation.normalize((0.9, 0.2, 0.1, -0.3)), 6.0, 0.4, 1.2
    rod = Body(1.0, (half**2 / 3.0, half**2 / 3.0, 1e-4))
    state = State((0, 0, height), q, (0.3, 0.0, up), (rate, 0.0, 0.0))
    sim = on_ground(rod, state, ((0, 0, half), (0, 0, -half)), 2.0, damping=30.0, rtol=rtol)
    with mp.workdps(40):
        qw, qx, qy, qz = (mpf(c) for c in q.tolist())
        size = qw**2 + qx**2 + qy**2 + qz**2
        # z components of the body's axes z and y, with x × z = −y: the rod turns about x
        u, across = (size - 2 * (qx**2 + qy**2)) / size, -2 * (qw * qx + qy * qz) / size

        def lowest(t):
            swing = mpf(half) * abs(u * mp.cos(rate * t) + across * mp.sin(rate * t))
            return mpf(height) + mpf(up) * t - mpf(G) * t**2 / 2 - swing

        first = next(k for k in range(500) if lowest(mpf(k + 1) / 1000) < 0)
        true = mp.findroot(lowest, (mpf(first) / 1000, mpf(first + 1) / 1000), solver="anderson")
    assert 0.1 < true < 0.5
    assert first_contact(method.step, method.WORK_SIZE, sim, 0.5) == pytest.approx(float(true), abs=1e-9)


@METHODS
def test_touch_that_begins_and_ends_within_a_step_is_felt(integrator):
    """A turning rod dips its end into the ground by 9 mm for 40 ms; one step of 0.2 s beside 2000. Measured 8e-14."""
    rod, state = Body(1.0, (0.1, 0.1, 0.01)), State((0, 0, 0.491), (0.8, 0.6, 0, 0), (0, 0, 0), (-9.0, 0, 0))
    ends = []
    for rate in (5.0, 1e4):
        sim = on_ground(
            rod, state, ((0, 0, -0.5),), rate, (0, 0, 0), 100.0, damping=1.0, integrator=integrator, rtol=1e-11
        )
        sim.step(round(0.2 * rate))
        ends.append(sim.state.values)
    assert ends[0][9] > 0.01  # m/s: pushed up
    assert_allclose(ends[0], ends[1], rtol=0, atol=1e-10)


def on_slope(theta, friction, slip_speed=1e-3, **how):
    """A box that stands on the ground, seen in axes in which it is level."""
    gravity = (G * math.sin(theta), 0.0, -G * math.cos(theta))
    state = State((0, 0, 0.1 - LEVEL.mass * G / 4e4))
    return on_ground(
        LEVEL, state, FEET, gravity=gravity, damping=200.0, friction=friction, slip_speed=slip_speed, **how
    )


@METHODS
def test_box_slides_above_the_friction_angle(integrator):
    """With a = g (sin θ − μ cos θ): what slides faster than the slip speed feels Coulomb's law. Measured 7e-16."""
    theta, friction = 0.5, 0.3
    sim = on_slope(theta, friction, integrator=integrator)
    sim.step(500)  # until it stands still on its springs
    before = sim.state.velocity[0]
    sim.step(500)
    gained = sim.state.velocity[0] - before
    assert gained == pytest.approx(0.5 * G * (math.sin(theta) - friction * math.cos(theta)), rel=1e-9)


@METHODS
@pytest.mark.parametrize("steepness", [0.1, 0.5, 0.95], ids="{} of the friction angle".format)
def test_box_stays_below_the_friction_angle(integrator, steepness):
    """But for a creep x of the slip speed with (15 x − 10 x³ + 3 x⁵) / 8 = tan θ / μ. Measured 9e-15 m/s."""
    friction, slip = 0.5, 1e-3
    sim = on_slope(math.atan(steepness * friction), friction, slip, integrator=integrator)
    sim.step(2000)
    roots = np.roots((3.0, 0.0, -10.0, 0.0, 15.0, -8.0 * steepness))
    (x,) = (root.real for root in roots if abs(root.imag) < 1e-9 and 0.0 < root.real < 1.0)
    assert sim.state.velocity[0] == pytest.approx(slip * x, abs=1e-9)
    assert sim.state.velocity[0] < slip
    assert [contact.slip_velocity[0] for contact in sim.contacts] == pytest.approx([slip * x] * 4, abs=1e-9)


TUMBLING = State((0, 0, 0.6), (0.9, 0.1, -0.3, 0.2), (1.0, -0.5, 0.3), (4.0, -6.0, 5.0))


@METHODS
@pytest.mark.parametrize("rate", [1000.0, 50.0])
def test_energy_of_a_tumbling_box_never_rises(integrator, rate):
    """By more than the method's error: measured 6e-14 of 16 J in a step."""
    sim = on_ground(BOX, TUMBLING, CORNERS, rate, damping=30.0, friction=0.4, integrator=integrator)
    energies = []
    for _ in range(round(1.5 * rate)):
        energies.append(sim.kinetic_energy + sim.potential_energy)
        sim.step()
    assert np.diff(energies).max() < 1e-11
    assert energies[0] - energies[-1] > 5.0


@METHODS
def test_energy_without_damping_and_friction_is_kept(integrator):
    """Through some dozens of touch-downs; measured 2e-11 J of 16 J."""
    sim = on_ground(BOX, TUMBLING, CORNERS, 100.0, integrator=integrator, rtol=1e-10)
    begin = sim.kinetic_energy + sim.potential_energy
    for _ in range(200):
        sim.step()
        assert sim.kinetic_energy + sim.potential_energy == pytest.approx(begin, abs=1e-9)
    assert max(contact.penetration for contact in sim.contacts) < 0.1


@METHODS
def test_thrust_that_grows_lifts_a_body_off_the_ground(integrator):
    """Held down by 30 N at first, against which a thruster lags; 20 steps of 50 ms beside 1000."""
    thruster = Actuator("up", "thruster", 0.0, 60.0, axis=(0.0, 0.0, 1.0), time_constant=0.3, initial=0.0)
    ends = []
    for rate in (20.0, 1000.0):
        ground = Ground(stiffness=1e4, damping=50.0, contacts=POINT)
        sim = Simulation(
            BALL, State((0, 0, -3e-3)), rate=rate, gravity=(0.0, 0.0, -15.0), integrator=integrator, ground=ground,
            actuators=[thruster], rtol=1e-11,
        )  # fmt: skip
        sim.set_actuators([60.0])
        sim.step(round(rate))
        ends.append(sim.state.values)
    assert ends[1][2] > 1.0 and sim.contacts[0].normal_force == 0.0
    assert_allclose(ends[0], ends[1], rtol=0, atol=1e-9)


def test_body_put_down_exactly_on_the_ground_sinks_in_without_a_jolt():
    """All its contacts at depth 0 to the last bit, and at rest: m x'' = m g − k x is a cosine."""
    sim = on_ground(BALL, State(), POINT, rate=100.0, integrator="dop853")
    sim.step(3)
    sag, w = 2.0 * G / 1e4, math.sqrt(1e4 / 2.0)
    assert sim.state.position[2] == pytest.approx(-sag * (1.0 - math.cos(0.03 * w)), abs=1e-11)  # measured 7e-14


@pytest.mark.no_numba
@pytest.mark.parametrize("slip_speed", [1e-2, 1e3], ids=["sliding", "creeping"])
def test_jacobian_is_the_derivative_of_what_touches(slip_speed):
    """On both branches of the friction; measured 2e-9 of 1e4."""
    ground = Ground(0.3, (0.1, -0.2, 2.0), 1e3, 5.0, 0.4, slip_speed, CORNERS)
    terms = Terms(BOX, GRAVITY, ground=ground)
    model, work = terms.model(Wrench()), np.zeros(12 + 13 + 12)
    reduce_wrench(model)
    y, matrix, h = (
        flatten(State((0, 0, 0.2), (0.9, 0.1, -0.3, 0.2), (1.0, -0.5, 0.3), (0.4, -1.0, 0.7)), model),
        np.zeros(144),
        1e-4,
    )
    substep.settle(terms.kernels, y, model)

    def slope(z):
        work[:12] = z
        substep.slope(terms.kernels, y, model, work, 0, 12, 25)
        return work[25:].copy()

    motion.jacobian(terms.kernels, model, y, 0, False, matrix, 0)
    steps = h * np.eye(12)
    differences = [(8 * (slope(d) - slope(-d)) - slope(2 * d) + slope(-2 * d)) / (12 * h) for d in steps]
    assert_allclose(matrix.reshape(12, 12), np.transpose(differences), rtol=0, atol=1e-6)
    assert np.abs(matrix).max() > 1e3


@pytest.mark.no_numba
@pytest.mark.parametrize("height", [5.0, -1e-3], ids=["in the air", "on the ground"])
def test_stiffness_counts_what_will_rest(height):
    """ω = √(k/m) of the spring, or 15 μ g / 8 s of the friction, whichever is more."""
    for friction, expected in ((0.0, math.sqrt(1e4 / 2.0)), (0.5, 15.0 / 8.0 * 0.5 * G / 1e-3)):
        terms = Terms(BALL, GRAVITY, ground=Ground(stiffness=1e4, friction=friction, contacts=POINT))
        model = terms.model(Wrench())
        state = flatten(State((0, 0, height), velocity=(0.3, 0, 0)), model)
        assert spectral_radius(terms.kernels, state, model) == pytest.approx(expected, rel=1e-9)


@pytest.mark.no_numba
def test_contacts_say_how_they_stand_to_the_ground():
    tilted = Ground(0.5, (0.0, 0.0, 3.0), 1e3, 10.0, 0.4, contacts=((0.2, 0, -0.1), (-0.2, 0, 0.1)))
    sim = Simulation(BOX, State((0, 0, 0.5), velocity=(0.3, 0, -0.2), angular_velocity=(0, 1.0, 0)), ground=tilted)
    below, above = sim.contacts
    # u = v + ω × p = (0.3 − 0.1, 0, −0.2 − 0.2)
    assert below.penetration == pytest.approx(0.1, abs=1e-15)
    assert below.normal_force == pytest.approx(1e3 * 0.1 + 10.0 * 0.4, abs=1e-12)
    assert_allclose(below.slip_velocity, (0.2, 0.0, 0.0), rtol=0, atol=1e-15)
    assert (above.penetration, above.normal_force) == (pytest.approx(-0.1, abs=1e-15), 0.0)
    assert Simulation(BOX).contacts == ()


@pytest.mark.no_numba
def test_acceleration_is_that_of_the_present_contacts():
    sim = on_ground(BALL, State((0, 0, -1e-3)), POINT)
    assert sim.acceleration[2] == pytest.approx(1e4 * 1e-3 / 2.0 - G, abs=1e-12)
    sim.set_state(State((0, 0, 1e-3)))
    assert sim.acceleration[2] == -G


BAD = {
    "contacts without a ground": (
        {"contacts": POINT},
        "ground stiffness 0 holds none of the 1 contacts; give one above 0",
    ),
    "a ground that nothing touches": ({"stiffness": 1e4}, "without contacts: no point of the body can touch"),
    "negative stiffness": (
        {"stiffness": -1.0, "contacts": POINT},
        "ground stiffness -1.0 is not a finite number of at",
    ),
    "negative friction": ({"friction": -0.1}, "ground friction -0.1 is not a finite number of at least 0"),
    "damping that is none": ({"damping": math.nan}, "ground damping nan is not a finite number of at least 0"),
    "slip speed of zero": ({"slip_speed": 0.0}, "ground slip_speed 0.0 is not a finite number of at least 1e-09"),
    "height that is a text": ({"height": "low"}, "ground height 'low' is not a finite number"),
    "normal without direction": ({"normal": (0, 0, 0)}, "has no direction; give one that points out of the ground"),
    "normal of two numbers": ({"normal": (0, 1)}, r"ground normal \[0, 1\] must be three finite numbers"),
    "a contact of two numbers": ({"contacts": [(0, 1)]}, r"ground contact \[0, 1\] must be three finite numbers"),
    "contacts that are a number": ({"contacts": 3}, "ground contacts 3 must be points of the body"),
}


@pytest.mark.no_numba
@pytest.mark.parametrize(("given", "said"), BAD.values(), ids=BAD)
def test_ground_that_is_none_is_refused(given, said):
    with pytest.raises(ValueError, match=said):
        Ground(**given)


@pytest.mark.no_numba
def test_scene_describes_its_ground():
    """Contacts in the order of their names; a change that would let the body fall through is refused."""
    given = {"ground": {"stiffness": 1e4, "height": 0.5}, "contacts": {"b": {"position": [1, 0, 0]}}}
    scene = Scene({**given, "contacts.a.position": [0, 1, 0]})
    assert scene.effect("ground") == Ground(0.5, stiffness=1e4, contacts=((0, 1, 0), (1, 0, 0)))
    assert scene.changed({"ground.friction": 0.7}).effect("ground").friction == 0.7
    with pytest.raises(
        ValueError, match=r"^parameter ground\.stiffness, .*: ground stiffness 0 holds none of the 2 contact"
    ):
        scene.changed({"ground.stiffness": 0.0})
    with pytest.raises(ValueError, match=r"^parameter ground\.stiffness: ground stiffness 1 without contacts"):
        Scene({"ground.stiffness": 1.0})
    points = {f"contacts.{name}.position": [0, 0, 0] for name in "abcde"}
    with pytest.raises(
        ValueError, match=r"^parameter .*a\.position, .*b\.position, .*c\.position and 2 more: ground stiff"
    ):
        Scene(points)
    with pytest.raises(ValueError, match=r"did you mean contacts\.<name>\.position"):
        Scene({"contacts.a.positions": [0, 1, 0]})


@pytest.mark.no_numba
def test_normal_of_any_length_is_the_same_ground():
    rows = [
        Terms(BOX, ground=Ground(0.1, normal, 1e4, contacts=FEET)).model(Wrench())
        for normal in ((0, 0, 1), (0, 0, 1e200))
    ]
    assert_array_equal(*rows)
