"""Many bodies in one call: each has the bits of a Simulation of it alone, whatever its neighbours do."""

import copy
import pickle

import numpy as np
import pytest

from rigid_body_sim import (
    Body,
    Drag,
    Ensemble,
    Ground,
    Simulation,
    SimulationError,
    State,
    Tether,
    Wrench,
    Wrenches,
    WrenchSchedule,
    load_scene,
)

N = 37  # four whole blocks of eight, and five
GRAVITY = (0.0, 0.0, -9.8)
TETHER = Tether(body_point=(0, 0, 0.1), anchor=(0, 0, 2), rest_length=0.8, stiffness=400.0, damping=3.0)
SCENES = {
    "auto": {},
    "taylor": {"integrator": "taylor"},
    "rk4": {"integrator": "rk4"},
    "exact": {"integrator": "exact"},
    "force at a point": {"forces": [((0.1, 0, 0), (0, 0, 3.0))]},
    "forces at points": {"forces": [((0.1, 0, 0), (0, 0, 3.0)), ((0, 0.1, 0), (1.0, 0, 0))]},
    "drag": {"drag": Drag(linear=(0.1, 0.2, 0.3), angular_linear=(0.01, 0.01, 0.01))},
    "tether": {"tethers": [TETHER], "rtol": 1e-6},
    "ground": {"ground": Ground(stiffness=400.0, damping=3.0, friction=0.3, contacts=((0, 0, -0.1), (0, 0, 0.1)))},
}
STATES = ("position", "orientation", "velocity", "angular_velocity")


def made(n=N, seed=0, spins=(0.1, 1.0, 20.0, 300.0)):
    """Arrays for n bodies: some turn by less than 0.001 rad in a step, some by much more; one is thin."""
    random = np.random.default_rng(seed)
    inertia = np.column_stack((random.uniform(0.1, 0.2, n), random.uniform(0.15, 0.2, n), random.uniform(0.2, 0.25, n)))
    inertia[3] = 0.001, 0.2, 0.2
    return {
        "mass": random.uniform(1, 2, n),
        "inertia": inertia,
        "center_of_mass": 0.01 * random.normal(size=(n, 3)),
        "position": random.normal(size=(n, 3)),
        "orientation": random.normal(size=(n, 4)),
        "velocity": random.normal(size=(n, 3)),
        "angular_velocity": random.normal(size=(n, 3)) * random.choice(spins, (n, 1)),
    }


def alone(given, i, **options):
    body = Body(given["mass"][i], given["inertia"][i], given["center_of_mass"][i])
    return Simulation(body, State(**{name: given[name][i] for name in STATES}), rate=1000.0, gravity=GRAVITY, **options)


def random_wrenches(random, n, turning=True):
    """Some bodies have a force or a torque in body axes, some in world axes, some none."""
    share = [turning * (random.random((n, 1)) > least) for least in (0.4, 0.4, 0.2, 0.6)]
    share[2] = random.random((n, 1)) > 0.2
    return [one * random.normal(size=(n, 3)) for one in share]


@pytest.mark.no_numba
@pytest.mark.parametrize("name", ["auto", "rk4"])
def test_bits_are_those_of_a_few_bodies_alone(name):
    assert_bits_are_those_of_each_body_alone(name, 4, (1, 2))


@pytest.mark.parametrize("name", SCENES)
def test_bits_are_those_of_each_body_alone(name):
    assert_bits_are_those_of_each_body_alone(name, N, (1, 7, 12))


def assert_bits_are_those_of_each_body_alone(name, n, counts):
    given, random = made(n), np.random.default_rng(5)
    ensemble = Ensemble(**given, rate=1000.0, gravity=GRAVITY, threads=2, **SCENES[name])
    singles = [alone(given, i, **SCENES[name]) for i in range(n)]
    for count in counts:
        rows = random_wrenches(random, n, turning=name != "exact")
        ensemble.set_wrench(Wrenches(*rows))
        ensemble.step(count)
        for i, single in enumerate(singles):
            single.set_wrench(Wrench(*(one[i] for one in rows)))
            single.step(count)
    assert ensemble.steps == sum(counts) and not ensemble.stopped
    for i, single in enumerate(singles):
        assert ensemble.simulation(i).save().state == single.save().state, i
        assert ensemble.integrators[i] == single.integrator.name
        for array in (*STATES, "momentum", "angular_momentum"):
            assert np.array_equal(getattr(ensemble.state, array)[i], getattr(single.state, array))


def test_a_body_goes_on_alone_with_the_same_bits():
    ensemble = Ensemble(**made(), rate=1000.0, gravity=GRAVITY)
    ensemble.set_wrench(Wrenches(torque_body=np.eye(3)[[0, 1, 2] * 12 + [0]]))
    ensemble.step(9)
    single = ensemble.simulation(4)
    assert single.time == ensemble.time and single.wrench == ensemble.wrench(4) == Wrench(torque_body=(0, 1, 0))
    single.step(30)
    ensemble.step(30)
    assert single.save().state == ensemble.simulation(4).save().state


def test_a_run_gives_arrays_with_a_row_for_each_body():
    given = made(10)
    ensemble = Ensemble(**given, rate=1000.0, gravity=GRAVITY)
    commands = WrenchSchedule([0, 6], torque_body=[(0.1, 0, 0), (0, 0, 0)])
    found = ensemble.run(0.02, every=8, commands=commands)
    assert found.position.shape == (4, 10, 3) and found.orientation.shape == (4, 10, 4)
    assert found.steps.tolist() == [0, 8, 16, 20] and len(found) == 10
    for i in (0, 7):
        single = alone(given, i).run(0.02, every=8, commands=commands)
        for array in (*STATES, "momentum", "kinetic_energy", "potential_energy"):
            assert np.array_equal(getattr(found, array)[:, i], getattr(single, array))
            assert np.array_equal(getattr(found[i], array), getattr(single, array))
    assert repr(found) == "Trajectories(10 bodies, 4 states from 0 s to 0.02 s at 1000 Hz)"


def schedule(n):
    """Rows of every kind: forces and torques that come and go, so that what a kernel for eight leaves out changes."""
    random = np.random.default_rng(8)
    rows = random_wrenches(random, 20)
    return WrenchSchedule(np.sort(random.choice(n, 20, replace=False)), *rows)


@pytest.mark.parametrize("name", [name for name in SCENES if name != "exact"])
def test_runs_under_a_schedule_have_the_bits_of_each_body_alone(name):
    given, commands = made(19), schedule(40)
    ensemble = Ensemble(**given, rate=1000.0, gravity=GRAVITY, **SCENES[name])
    found = ensemble.run(steps=40, every=3, commands=commands)
    again = ensemble.run(steps=7)
    for i in range(19):
        single = alone(given, i, **SCENES[name])
        whole = single.run(steps=40, every=3, commands=commands)
        for array in (*STATES, "momentum", "angular_momentum"):
            assert np.array_equal(getattr(found, array)[:, i], getattr(whole, array)), (i, array)
        single.step(7)
        assert np.array_equal(again.position[-1, i], single.state.position)
        assert ensemble.simulation(i).save().state == single.save().state


def test_a_body_that_stops_in_the_midst_of_a_run_leaves_the_others_alone():
    """The same torque for all; one is so light that it spins up beyond what can be followed within the run."""
    inertia = np.tile((0.1, 0.2, 0.25), (11, 1))
    inertia[5] = 1e-15, 2e-15, 2.5e-15
    commands = WrenchSchedule([0, 7, 12], torque_body=[(0, 0, 0.0), (0.1, 0, 0.02), (0, 0.1, 0)], force_body=(1, 0, 0))
    ensemble = Ensemble(1.0, inertia, angular_velocity=(0.1, 0.2, 0.3), rate=100.0, drag=Drag(linear=(0.1, 0, 0)))
    for found in (ensemble.run(steps=20, every=4, commands=commands), ensemble.run(steps=8, every=4)):
        assert list(found.stopped_bodies) == [5] and "cannot be done" in found[5].stopped
        for i in range(11):
            single = Simulation(
                *(Body(1.0, inertia[i]), State(angular_velocity=(0.1, 0.2, 0.3))),
                rate=100.0,
                drag=Drag(linear=(0.1, 0, 0)),
            )
            try:
                whole = single.run(steps=20, every=4, commands=commands)
                if found.steps[0] == 20:
                    whole = single.run(steps=8, every=4)
            except SimulationError as reason:
                assert i == 5 and str(reason) == found.stopped_bodies[5]
                assert np.array_equal(found.position[-1, i], single.state.position)
            else:
                assert np.array_equal(found.angular_velocity[:, i], whole.angular_velocity)


def test_a_body_that_grows_stiff_in_the_midst_of_a_run_goes_on_implicitly():
    """Quadratic drag at rest has no rate; a force makes it fast for those that are light."""
    mass, drag = [1e-3, 1e3, 1e-3, 1e6], Drag(quadratic=(1e4,) * 3)
    commands = WrenchSchedule([2, 6], force_world=[(1e8, 0, 0), (0, 1e8, 0)])
    ensemble = Ensemble(mass, (1e-6,) * 3, rate=10.0, drag=drag)
    found = ensemble.run(steps=10, every=3, commands=commands)
    ensemble.step(2)
    singles = [Simulation(Body(one, (1e-6,) * 3), rate=10.0, drag=drag) for one in mass]
    for i, single in enumerate(singles):
        assert np.array_equal(found.velocity[:, i], single.run(steps=10, every=3, commands=commands).velocity)
        single.step(2)
        assert ensemble.simulation(i).save().state == single.save().state
    assert ensemble.integrators == [single.integrator.name for single in singles]
    assert len(set(ensemble.integrators)) == 2  # both methods are at work


def test_a_controller_has_all_bodies_at_once():
    given = made(10)

    def damping(state, time):
        return Wrenches(torque_body=-0.5 * state.angular_velocity)

    found = Ensemble(**given, rate=1000.0).run(steps=30, every=30, controller=damping, control_every=10)
    single = Simulation(Body(*(given[name][2] for name in ("mass", "inertia", "center_of_mass"))), rate=1000.0)
    single.set_state(State(**{name: given[name][2] for name in STATES}))
    single.run(
        steps=30,
        controller=lambda state, time: Wrench(torque_body=-0.5 * state.angular_velocity),
        control_every=10,
    )
    assert np.array_equal(found.angular_velocity[-1, 2], single.state.angular_velocity)


@pytest.mark.parametrize("n", [3, 19])
def test_a_body_that_cannot_go_on_stops_alone(n):
    """Body 2 is spun up beyond what can be followed; its neighbours, one of them in the same eight, do not notice."""
    torque = np.tile((0.0, 0.0, 0.01), (n, 1))
    torque[2] = 0.0, 0.0, 1e14
    ensemble = Ensemble(1.0, (0.1, 0.2, 0.25), n=n, angular_velocity=(0.1, 0.2, 0.3), rate=100.0)
    ensemble.set_wrench(Wrenches(torque_body=torque))
    others = Ensemble(1.0, (0.1, 0.2, 0.25), n=n, angular_velocity=(0.1, 0.2, 0.3), rate=100.0)
    others.set_wrench(Wrench(torque_body=(0, 0, 0.01)))
    found = ensemble.run(steps=10, every=5)
    others.step(10)
    assert list(ensemble.stopped) == [2] and list(found.stopped_bodies) == [2]
    assert ensemble.stopped[2].startswith("step 1 cannot be done: the state would not be finite, or would turn by")
    assert found[2].stopped == ensemble.stopped[2] and found[1].stopped == ""
    assert np.isfinite(found.angular_velocity).all()
    assert np.array_equal(found.orientation[-1, 2], found.orientation[0, 2])
    same = np.arange(n) != 2
    assert np.array_equal(ensemble.state.orientation[same], others.state.orientation[same])
    ensemble.set_wrench(Wrench())
    ensemble.set_state(angular_velocity=(0, 0, 1), which=[2])
    assert not ensemble.stopped
    ensemble.step(1)
    assert ensemble.state.angular_velocity[2].tolist() == [0, 0, 1]


def test_reset_of_some_and_of_all():
    given = made(10)
    ensemble = Ensemble(**given, rate=1000.0, gravity=GRAVITY)
    start = ensemble.state
    ensemble.set_wrench(Wrench(torque_body=(0.1, 0, 0)))
    ensemble.step(5)
    ensemble.reset([1, 4])
    assert ensemble.steps == 5 and ensemble.wrench(1) == Wrench() and ensemble.wrench(2) != Wrench()
    assert np.array_equal(ensemble.state.position[[1, 4]], start.position[[1, 4]])
    ensemble.reset()
    assert ensemble.steps == 0 and np.array_equal(ensemble.state.angular_velocity, start.angular_velocity)


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))])
def test_a_copy_goes_on_with_the_same_bits(copied):
    ensemble = Ensemble(**made(11), rate=1000.0, gravity=GRAVITY, drag=Drag(linear=(0.1, 0, 0)))
    ensemble.set_wrench(Wrenches(torque_body=np.eye(3)[[0, 1, 2] * 3 + [0, 1]]))
    ensemble.step(7)
    other = copied(ensemble)
    for one in (ensemble, other):
        one.step(5)
    assert np.array_equal(ensemble.state.position, other.state.position) and other.steps == 12
    assert np.array_equal(ensemble.state.angular_velocity, other.state.angular_velocity)
    other.reset()
    assert ensemble.steps == 12 and other.steps == 0
    assert repr(ensemble) == "Ensemble(11 bodies at 0.012 s, 1000 Hz)"


@pytest.mark.parametrize("name", ["auto", "drag", "tether"])
def test_a_body_that_is_set_anew_goes_on_as_a_new_one(name):
    """Whatever it held and however stiff it was; its neighbours go on."""
    given, other, random = made(19), made(19, seed=1), np.random.default_rng(5)
    ensemble = Ensemble(**given, rate=1000.0, gravity=GRAVITY, **SCENES[name])
    singles = [alone(given, i, **SCENES[name]) for i in range(19)]
    for which in ([7], [2, 9], [17, 2], [4]):
        ensemble.reset(which)
        ensemble.set_state(**{array: other[array][which] for array in STATES}, which=which)
        for i in which:
            singles[i] = alone({**given, **{array: other[array] for array in STATES}}, i, **SCENES[name])
        rows = random_wrenches(random, 19)
        ensemble.set_wrench(Wrenches(*rows))
        ensemble.step(3)
        for i, single in enumerate(singles):
            single.set_wrench(Wrench(*(one[i] for one in rows)))
            single.step(3)
    for i, single in enumerate(singles):
        assert ensemble.simulation(i).save().state == single.save().state, i


def test_bodies_of_scenes(tmp_path):
    text = "/**:\n  ros__parameters:\n    rate: 200.0\n    body.mass: {}\n    drag.linear: [{}, 0.0, 0.0]\n"
    scenes = []
    for k, (mass, drag) in enumerate([(1.0, 0.0), (2.0, 0.5), (3.0, 0.0)]):
        (tmp_path / f"{k}.yaml").write_text(text.format(mass, drag))
        scenes.append(load_scene(tmp_path / f"{k}.yaml"))
    ensemble = Ensemble.from_scenes(scenes)
    ensemble.set_wrench(Wrench(force_world=(1.0, 0, 0), torque_body=(0.1, 0, 0)))
    ensemble.step(50)
    assert ensemble.integrators == ["taylor", "dop853", "taylor"]
    for i, scene in enumerate(scenes):
        single = Simulation.from_scene(scene)
        single.set_wrench(Wrench(force_world=(1.0, 0, 0), torque_body=(0.1, 0, 0)))
        single.step(50)
        assert np.array_equal(ensemble.state.velocity[i], single.state.velocity)


BODY = {"mass": 1.0, "inertia": (0.1, 0.2, 0.25)}


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"mass": [1.0, 2.0], "position": np.zeros((3, 3))}, "numbers of bodies differ: mass 2, position 3"),
        ({"n": 4, "mass": [1.0, 2.0]}, "numbers of bodies differ: n 4, mass 2"),
        ({"position": np.zeros((3, 2))}, r"position has shape \(3, 2\); give \(n, 3\), a row for each body"),
        ({"inertia": np.zeros((2, 5))}, r"inertia has shape \(2, 5\); give \(n, 3\) or \(n, 6\) or \(n, 3, 3\)"),
        ({"mass": [1.0, -2.0]}, r"body 1: mass -2"),
        ({"inertia": [(1, 2, 2), (1, 2, 4)]}, "body 1: .*triangle"),
        ({"n": 3, "inertia": [(1, 2, 2), (1, 2, 3), (1, 2, 2)]}, "body 0: inertia .* is not symmetric"),
        ({"velocity": [(0, 0, 0), (0, np.nan, 0)]}, r"row 1 of velocity, \[0\.0, nan, 0\.0\], is not finite"),
        ({"mass": [1.0, np.inf]}, "row 1 of mass, inf, is not finite"),
        ({"orientation": [(1, 0, 0, 0), (0, 0, 0, 0)]}, "row 1 of orientation: quaternion .* has norm 0"),
        ({"mass": "heavy"}, "mass holds what is no number"),
        ({"n": 0}, "n=0: give a whole number of at least 1"),
        ({"mass": np.zeros(0)}, "mass has no rows; give one for each body"),
        ({"inertia": [(1, 2, 2), (1, 2)]}, "inertia has rows of different lengths"),
        ({"threads": 0}, "threads=0: give a whole number"),
        ({"rate": 0.0}, "rate 0 Hz is not between"),
        ({"integrator": "euler"}, "integrator 'euler' is not known"),
        ({"integrator": "taylor", "drag": Drag(linear=(1, 0, 0))}, "body 0: integrator 'taylor' leaves out"),
        ({"mass": 1e90, "velocity": (1e250, 0, 0)}, "row 0: state .* beyond the range of floats"),
    ],
)
def test_what_cannot_be_made(given, sentence):
    with pytest.raises(ValueError, match=sentence):
        Ensemble(**{**BODY, **given})


@pytest.mark.parametrize(
    ("wrenches", "sentence"),
    [
        (lambda: Wrenches(torque_body=np.zeros((4, 3))), "wrenches have 4 rows, but there are 3 bodies"),
        (
            lambda: Wrench(points=[((0, 0, 1), (1, 0, 0))]),
            "has forces at points, which many bodies at once do not take",
        ),
        (lambda: Wrenches(torque_body=[[0, 0, 0], [0, np.nan, 0]]), r"row 1: .*nan.* must be finite"),
        (lambda: Wrenches(force_body=[1, 2]), r"force_body has shape \(2,\); give \(n, 3\)"),
        (lambda: Wrenches(force_body=np.zeros((2, 3)), torque_body=np.zeros((3, 3))), "force_body has 2 rows where"),
        (lambda: Wrenches(force_body="up"), "force_body holds what is no number"),
        (lambda: Wrenches(torque_world=[(0, 0, 0), (0, 0, 0), (0, 1, 0)]), "body 2: integrator 'exact' knows only"),
    ],
)
def test_wrenches_that_cannot_be_held_change_nothing(wrenches, sentence):
    ensemble = Ensemble(**BODY, n=3, integrator="exact", velocity=(1, 0, 0))
    ensemble.set_wrench(Wrench(force_world=(1, 2, 3)))
    with pytest.raises(ValueError, match=sentence):
        ensemble.set_wrench(wrenches())
    assert ensemble.wrench(2) == Wrench(force_world=(1, 2, 3))


def test_what_cannot_be_asked_of_it():
    ensemble = Ensemble(**BODY, n=3)
    with pytest.raises(ValueError, match=r"which=\[5\]: .*; give indices of the 3 bodies"):
        ensemble.reset([5])
    with pytest.raises(ValueError, match="steps=-1: give a whole number of at least 0"):
        ensemble.step(-1)
    with pytest.raises(IndexError, match="there is no body 7; they are 0 to 2"):
        ensemble.simulation(7)
    with pytest.raises(TypeError, match=r"\(0, 0, 1\): give Wrenches, with a row for each body"):
        ensemble.set_wrench((0, 0, 1))
    with pytest.raises(ValueError, match="at least one body; give at least one scene"):
        Ensemble.from_scenes([])
    with pytest.raises(TypeError, match=r"the controller gave 3 at 0 s; give a Wrenches"):
        ensemble.run(steps=2, controller=lambda state, time: 3)
    with pytest.raises(ValueError, match="commands or a controller, not both"):
        ensemble.run(steps=2, commands=WrenchSchedule([0]), controller=print)
    with pytest.raises(ValueError, match="scenes of an ensemble have one rate for all"):
        Ensemble.from_scenes([{"rate": 1.0}, {"rate": 2.0}])
    assert ensemble.steps == 0
