"""What every type of sensor keeps to, run over the registry: a new one is tested by being named there."""

import copy
import dataclasses
import pickle

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from rigid_body_sim import Actuator, Body, Ensemble, Ground, Scene, Simulation, State, Wrench, WrenchSchedule
from rigid_body_sim.scene import schema
from rigid_body_sim.sensors import REGISTRY
from rigid_body_sim.sensors.base import NO_NOISE, NOT_READ, Seen

pytestmark = pytest.mark.no_numba

TYPES = pytest.mark.parametrize("kind", REGISTRY.values(), ids=list(REGISTRY))
BODY = Body(2.0, (0.3, 0.4, 0.5, 0.02, 0.01, -0.03), (0.02, -0.01, 0.03))
START = State((0.3, 0.2, 4.0), (0.9, 0.1, -0.3, 0.2), (1.0, -0.5, 0.3), (0.4, -1.0, 0.7))
GRAVITY = (0.3, -0.2, -9.8)
WRENCH = Wrench(force_body=(0.1, 0.2, -0.3), torque_world=(0.02, -0.01, 0.03))


@pytest.fixture(autouse=True)
def _with_pyproj():
    pytest.importorskip("pyproj")


def named(kind, name="one", **options):
    return dataclasses.replace(kind.example, name=name, **options)


def simulation(*sensors, **options):
    made = Simulation(BODY, START, rate=100.0, gravity=GRAVITY, sensors=sensors, **options)
    made.set_wrench(WRENCH, hold=0.05)
    return made


def every(one):
    return round(100.0 / one.rate)


def stepwise(sim, one, steps=40):
    """What it shows at its instants, of single steps."""
    rows = [sim.sense(one.name)]
    for step in range(1, steps + 1):
        sim.step()
        if step % every(one) == 0:
            rows.append(sim.sense(one.name))
    return np.array(rows)


@TYPES
def test_it_shows_as_many_finite_numbers_as_it_has_names_for(kind):
    shown = simulation(named(kind)).sense("one")
    assert shown.shape == (len(kind.columns),)
    assert not np.isnan(shown).any()


@TYPES
def test_the_parameters_make_the_example(kind):
    """Every field of a sensor is a parameter, and none is lost on the way."""
    one = named(kind)
    given = {f"sensors.one.{name}": getattr(one, name) for name in ("rate", "position", "seed", "delay", "frame_id")}
    given |= {f"sensors.one.orientation.{p}": v for p, v in zip("wxyz", one.orientation, strict=True)}
    for group in one.groups:
        noise = getattr(one, group.field)
        given |= {f"sensors.one.{group.prefix}{name}": getattr(noise, name) for name in group.has}
    given |= {f"sensors.one.{name}": getattr(one, name.replace(".", "_")) for name in kind.own}
    scene = Scene({**given, "sensors.one.type": kind.name})
    assert scene.sensors() == (one,)
    rows = [row for row in schema.TABLE if row.name.startswith("sensors.")]
    theirs = {row.name.replace("<name>", "one") for row in rows if row.name in scene_rows(scene)}
    assert given.keys() <= theirs | {"sensors.one.type"}


def scene_rows(scene):
    return {name.replace(".one.", ".<name>.") for name in scene.values}


@TYPES
def test_each_noise_of_the_example_does_something(kind):
    """With one part of one group left out, something else is shown at some of 20 samples."""
    one = named(kind)
    shown = stepwise(simulation(one), one, 20 * every(one))
    for group in one.groups:
        noise = getattr(one, group.field)
        for part in set(group.has) - {"range"}:
            other = dataclasses.replace(one, **{group.field: noise._replace(**{part: getattr(NO_NOISE, part)})})
            assert (stepwise(simulation(other), other, 20 * every(one)) != shown).any(), (group.field, part)


@TYPES
def test_two_runs_and_any_strides_have_the_same_bits(kind):
    one = named(kind)
    steps = stepwise(simulation(one), one)
    assert_array_equal(simulation(one).run(steps=40, every=7).sense("one").values, steps)
    late = simulation(one)
    late.step(40)  # who has not listened before
    if 40 % every(one) == 0:
        assert_array_equal(late.sense("one"), steps[-1])


@TYPES
def test_noise_is_that_of_the_seed(kind):
    one = named(kind)
    other = dataclasses.replace(one, seed=one.seed + 1)
    assert (stepwise(simulation(one), one) != stepwise(simulation(other), other)).any()


@TYPES
def test_copies_and_snapshots_go_on_with_the_same_bits(kind):
    sim = simulation(named(kind))
    sim.step(17)
    saved, copies = sim.save(), [copy.copy(sim), pickle.loads(pickle.dumps(sim))]
    sim.step(13)
    expected = sim.sense("one")
    for again in copies:
        again.step(13)
        assert_array_equal(again.sense("one"), expected)
    sim.restore(saved)
    sim.step(13)
    assert_array_equal(sim.sense("one"), expected)


@TYPES
def test_the_descriptor_says_whether_accelerations_are_needed(kind):
    sim = simulation(named(kind))
    one = sim.instruments["one"]
    if not kind.accelerations:
        seen = Seen(sim.motion, NOT_READ, sim.terms.gravity, sim.ground)
        assert_array_equal(one.measure(0, seen), sim.sense("one"))
    else:
        assert one.measure(0, Seen(sim.motion, (9.0,) * 6, sim.terms.gravity, sim.ground)) != sim.measured(one)


@TYPES
def test_bodies_of_an_ensemble_sense_as_simulations_with_seeds_of_their_own(kind):
    one = named(kind)
    positions = np.array([(0.3, 0.2, 4.0), (1.0, 2.0, 5.0)])
    ensemble = Ensemble(
        2.0,
        BODY.inertia,
        BODY.center_of_mass,
        position=positions,
        angular_velocity=START.angular_velocity,
        rate=100.0,
        gravity=GRAVITY,
        sensors=[one],
    )
    ensemble.set_wrench(WRENCH)
    run = ensemble.run(steps=20, every=3)
    for i, position in enumerate(positions):
        own = dataclasses.replace(one, seed=one.seed + i)
        alone = Simulation(
            BODY, State(position, angular_velocity=START.angular_velocity), rate=100.0, gravity=GRAVITY, sensors=[own]
        )
        alone.set_wrench(WRENCH)
        expected = alone.run(steps=20).sense("one")
        assert_array_equal(run.sense("one").values[:, i], expected.values)
        assert_array_equal(run[i].sense("one").values, expected.values)
        assert_array_equal(run.sense("one").time, expected.time)
        assert_array_equal(ensemble.sense("one")[i], alone.sense("one"))
        assert_array_equal(ensemble.simulation(i).sense("one"), alone.sense("one"))
    assert_array_equal(pickle.loads(pickle.dumps(ensemble)).sense("one"), ensemble.sense("one"))


ROTORS = [Actuator("rotor", "rotor", 0.0, 900.0, (0.2, 0.1, 0.0), thrust_coefficient=2e-5, time_constant=0.05)]
FEET = Ground(stiffness=1e4, damping=30.0, friction=0.3, contacts=((0.1, 0.0, -4.0), (-0.1, 0.1, -4.0)))


@pytest.mark.parametrize("effects", [{}, {"actuators": ROTORS}, {"ground": FEET}], ids=["bare", "actuators", "ground"])
def test_who_senses_changes_no_bit_of_the_motion(effects):
    """Nor who looks at each step: reading an acceleration settles forces anew."""
    sensors = [named(kind, f"s{i}", rate=0.0) for i, kind in enumerate(REGISTRY.values())]
    sims = [simulation(*given, **effects) for given in ((), sensors, sensors)]
    for _ in range(25):
        for sim in sims:
            if effects.get("actuators"):
                sim.set_actuators([500.0])
            sim.step()
        for one in sensors:
            sims[2].sense(one.name)
    for sim in sims[1:]:
        assert sim.motion == sims[0].motion
        assert sim.save() == sims[0].save()


def test_a_run_under_a_schedule_senses_on_arrival_before_what_is_commanded_there():
    kind = REGISTRY["imu"]
    one = named(kind, rate=0.0, gyroscope=NO_NOISE, accelerometer=NO_NOISE)
    commands = WrenchSchedule([0, 5], force_body=[(0.0, 0.0, 30.0), (0.0, 0.0, 60.0)])
    sim = Simulation(BODY, START, rate=100.0, sensors=[one])
    run = sim.run(steps=10, commands=commands)
    felt = run.sense("one").values[:, 3:]
    assert_array_equal(run.sense("one").time, np.arange(11) / 100.0)
    changes = np.flatnonzero(np.abs(np.diff(felt, axis=0)).max(axis=1) > 5.0).tolist()
    assert changes == [0, 5], "the command of step 5 is felt from step 6 on"
    bare = Simulation(BODY, START, rate=100.0).run(steps=10, commands=commands)
    assert_array_equal(run.position, bare.position)
    assert_array_equal(run.orientation, bare.orientation)


def test_noise_begins_anew_where_steps_are_counted_anew():
    sim = simulation(named(REGISTRY["imu"]))
    first = sim.sense("one")
    sim.step(30)
    kept = sim.sense("one")
    sim.reset(keep_time=True)
    assert (sim.sense("one") != kept).any()
    sim.step(10)
    sim.reset()
    sim.set_wrench(WRENCH, hold=0.05)
    assert_array_equal(sim.sense("one"), first)


def test_bodies_of_scenes_sense_what_their_scenes_say():
    scenes = [
        Scene(
            {
                "body.mass": mass,
                "sensors.baro.type": "barometer",
                "sensors.baro.noise_density": 1.0,
                "sensors.baro.seed": seed,
            }
        )
        for mass, seed in ((1.0, 3), (2.0, 3))
    ]
    ensemble = Ensemble.from_scenes(scenes)
    assert_array_equal(ensemble.sense("baro")[0], ensemble.sense("baro")[1])
    with pytest.raises(ValueError, match="have the same sensors"):
        Ensemble.from_scenes([scenes[0], Scene()])
