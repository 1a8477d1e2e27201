"""What every effect keeps to, run over the registry: a new one is tested by being named there."""

import dataclasses

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rigid_body_sim import Body, Scene, Simulation, State, Wrench
from rigid_body_sim.effects import REGISTRY
from rigid_body_sim.effects.base import (
    DriveEffect,
    KernelEffect,
    LoadEffect,
    MediumEffect,
    SeriesEffect,
    TransformEffect,
)
from rigid_body_sim.integrators import substep
from rigid_body_sim.kernels import kernel_cache, motion
from rigid_body_sim.kernels.model import MOST_LOADS
from rigid_body_sim.kernels.wrench import reduce_wrench
from rigid_body_sim.scene import schema
from rigid_body_sim.terms import Terms
from rigid_body_sim.theory import invariants
from rigid_body_sim.values import rotation
from rigid_body_sim.values.state import flatten

pytestmark = pytest.mark.no_numba

BODY = Body(2.0, (0.3, 0.4, 0.5, 0.02, 0.01, -0.03), (0.02, -0.01, 0.03))
GRAVITY = (0.3, -0.2, -9.8)
START = State((0.3, 0.2, 0.1), (0.9, 0.1, -0.3, 0.2), (1.0, -0.5, 0.3), (0.4, -1.0, 0.7))
WRENCH = Wrench(force_body=(0.1, 0.2, -0.3), torque_world=(0.02, -0.01, 0.03))
TURN = rotation.normalize((0.7, -0.2, 0.5, 0.4))

EFFECTS = pytest.mark.parametrize("effect", REGISTRY.values(), ids=list(REGISTRY))
LOADS = [effect for effect in REGISTRY.values() if isinstance(effect, KernelEffect)]
KINDS = (SeriesEffect, LoadEffect, DriveEffect, TransformEffect, MediumEffect)


def given(effect, one):
    """With what it needs to act."""
    return {effect.name: [one] if effect.many else one, **effect.beside}


def fields_of(effect):
    """What a user writes of one, its name apart where names are in a list of their own."""
    fields = effect.example._fields if hasattr(effect.example, "_fields") else effect.example.__dataclass_fields__
    return [field for field in fields if not (effect.order and field == "name")]


def simulation(effect, one, body=BODY, state=START, gravity=GRAVITY, **options):
    return Simulation(body, state, rate=100.0, gravity=gravity, **given(effect, one), **options)


def turned(q, state):
    return State(
        rotation.rotate(q, state.position),
        rotation.multiply(q, state.orientation),
        rotation.rotate(q, state.velocity),
        state.angular_velocity,
    )


def replaced(one, **fields):
    return dataclasses.replace(one, **fields) if dataclasses.is_dataclass(one) else one._replace(**fields)


def as_texts(value):
    """``value`` with a text in place of its first number; itself where there is none."""
    if isinstance(value, tuple) and value:
        return (as_texts(value[0]), *value[1:])
    return str(value) if isinstance(value, float | int) and not isinstance(value, bool) else value


@EFFECTS
def test_text_in_place_of_a_number_is_refused(effect):
    """Python makes numbers of texts, and nobody else does."""
    refused = 0
    for field in fields_of(effect):
        value = getattr(effect.example, field)
        if (text := as_texts(value)) != value:
            refused += 1
            with pytest.raises(ValueError, match=r"is not a (finite )?number|three finite numbers"):
                effect.checked(given(effect, replaced(effect.example, **{field: text}))[effect.name])
    assert refused > 0


@EFFECTS
def test_it_is_of_one_kind_and_its_parameters_make_it(effect):
    """Each field of what users write has one parameter, below the effect's name."""
    assert sum(isinstance(effect, kind) for kind in KINDS) == 1
    assert set(effect.fields) == set(fields_of(effect)) and set(effect.world) <= set(effect.fields)
    for field, name in effect.fields.items():
        own = f"{effect.group or effect.name}." + "<name>." * effect.many
        assert name.startswith(f"{field}.<name>." if field in effect.groups else own)
    assert all(parameter.text for parameter in effect.parameters)
    assert set(effect.parameters) <= set(schema.TABLE)


@EFFECTS
def test_scene_makes_what_its_parameters_say(effect):
    """So that YAML file, node and Simulation mean the same."""
    values = {effect.order: ["one"]} if effect.order else {}
    for field, name in effect.fields.items():
        value = getattr(effect.example, field)
        each = enumerate(value) if field in effect.groups else [("one", value)]
        values.update({name.replace("<name>", str(member)): part for member, part in each})
    scene = Scene(values)
    assert scene.effect(effect.name) == effect.present
    assert Scene().effect(effect.name) == effect.absent
    assert Simulation.from_scene(scene).terms.acting[effect.name] == (effect.example,)


@EFFECTS
def test_what_is_given_is_restored_from_what_json_makes_of_it(effect):
    plain = dataclasses.asdict(effect.example) if dataclasses.is_dataclass(effect.example) else list(effect.example)
    restored = effect.restored([plain] if effect.many else plain)
    assert restored == effect.present


@EFFECTS
def test_zero_strength_changes_no_bit(effect):
    """By the same method: ``auto`` may take another where such a thing is given."""
    method = "taylor" if isinstance(effect, SeriesEffect | DriveEffect) else "dop853"
    states = []
    for options in (given(effect, effect.zero), effect.beside):
        sim = Simulation(BODY, START, rate=100.0, gravity=GRAVITY, integrator=method, **options)
        sim.set_wrench(WRENCH)
        sim.step(20)
        states.append(sim.save().state)
    assert states[0] == states[1]


@EFFECTS
def test_it_acts(effect):
    """The example, beside none: else the other tests here would show nothing."""
    with_it = simulation(effect, effect.example)
    without = Simulation(BODY, START, rate=100.0, gravity=GRAVITY, **effect.beside)
    for sim in (with_it, without):
        sim.step(20)
    assert np.abs(with_it.state.values - without.state.values).max() > 1e-4


@EFFECTS
def test_what_is_not_there_costs_nothing(effect):
    """No number in the model, no kernel, and the plan says so."""
    none, one = Terms(BODY, **effect.beside), Terms(BODY, **given(effect, effect.example))
    assert len(one.model(Wrench())) - len(none.model(Wrench())) == size_of(effect)
    assert (one.kernels is none.kernels) == isinstance(effect, SeriesEffect | MediumEffect)
    assert effect.left_out in none.left_out and effect.left_out not in one.left_out
    assert effect.left_out in Simulation(BODY).plan.left_out


def size_of(effect):
    """Numbers of the example in the model."""
    if isinstance(effect, MediumEffect):
        return 0
    if isinstance(effect, KernelEffect):
        return effect.row(effect.example, BODY).size
    if isinstance(effect, DriveEffect):
        filling = -len(Terms(BODY).model(Wrench())) % 8  # a drive begins with a line of the cache
        return filling + len(effect.row((effect.example,), BODY))
    return 7 * len(list(effect.levers(effect.example, BODY)))


@EFFECTS
def test_saved_and_restored_the_same_bits_follow(effect):
    sim = simulation(effect, effect.example)
    sim.set_wrench(WRENCH)
    sim.step(10)
    saved = sim.save()
    sim.step(10)
    once = sim.save()
    sim.restore(saved)
    sim.step(10)
    assert sim.save() == once


@EFFECTS
def test_turned_scene_has_the_turned_motion(effect):
    """With vectors of the world turned, and with q of the other sign. Measured 3e-15 (series), 4e-10 (loads)."""
    world = {field: tuple(rotation.rotate(TURN, getattr(effect.example, field)).tolist()) for field in effect.world}
    other = replaced(effect.example, **world)
    here = simulation(effect, effect.example, rtol=1e-12)
    there = simulation(effect, other, state=turned(-TURN, START), gravity=rotation.rotate(TURN, GRAVITY), rtol=1e-12)
    for sim in (here, there):
        sim.step(100)
    expected = turned(TURN, here.state)
    assert_allclose(there.state.position, expected.position, rtol=0, atol=1e-9)
    assert rotation.angle_between(there.state.orientation, expected.orientation) < 1e-9
    assert_allclose(there.state.velocity, expected.velocity, rtol=0, atol=1e-9)
    assert_allclose(there.state.angular_velocity, expected.angular_velocity, rtol=0, atol=1e-9)


STATED = [effect for effect in REGISTRY.values() if not isinstance(effect, DriveEffect | MediumEffect)]


@pytest.mark.parametrize("effect", STATED, ids=[effect.name for effect in STATED])
def test_energy_is_kept_or_taken_out_as_stated(effect):
    """Kinetic and potential, over 2 s; measured 5e-15 of what is exchanged for series, 1e-9 for loads."""
    sim, energies, kinetic = simulation(effect, effect.example, rtol=1e-11), [], []
    for _ in range(20):
        kinetic.append(invariants.energy_of_motion(sim.terms, sim.state))
        energies.append(kinetic[-1] + invariants.potential_energy(sim.terms, sim.state))
        sim.step(10)
    exchanged = np.ptp(kinetic)
    assert exchanged > 0.1
    if effect.dissipates:
        assert np.diff(energies).max() < 1e-12 * exchanged  # measured 2e-16, of a body in the air between two contacts
        assert energies[-1] < energies[0] - 0.1 * exchanged
    else:
        assert effect.energy is not None or effect.kinetic is not None
        assert np.ptp(energies) < 1e-7 * exchanged


MANY = [effect for effect in STATED if effect.many]  # of actuators see test_actuators: they need names of their own


@pytest.mark.parametrize("effect", MANY, ids=[effect.name for effect in MANY])
def test_two_of_it_add_up(effect):
    """Where there may be many: twice the same is what the double force does, here to the momentum after 1 us."""
    gains = []
    for count in (0, 1, 2):
        sim = Simulation(BODY, START, rate=1e6, **{effect.name: [effect.example] * count})
        sim.step(1)
        gains.append(np.concatenate((sim.state.momentum, sim.state.angular_momentum)))
    assert_allclose(gains[2] - gains[0], 2 * (gains[1] - gains[0]), rtol=1e-4, atol=1e-14)


SMOOTH = [effect for effect in REGISTRY.values() if not isinstance(effect, SeriesEffect | DriveEffect)]


@pytest.mark.parametrize("effect", SMOOTH, ids=[effect.name for effect in SMOOTH])
def test_jacobian_of_a_load_is_its_derivative(effect):
    """Against differences of the fourth order; measured 2e-10. One wrong sign shows as an error of order 1."""
    terms = Terms(BODY, GRAVITY, **given(effect, effect.example))
    model, work = terms.model(WRENCH), np.zeros(12 + 13 + 12)
    reduce_wrench(model)
    y, matrix, h = flatten(START, model), np.zeros(144), 1e-4

    def slope(z):
        work[:12] = z
        substep.slope(terms.kernels, y, model, work, 0, 12, 25)
        return work[25:].copy()

    substep.settle(terms.kernels, y, model)
    motion.jacobian(terms.kernels, model, y, 0, False, matrix, 0)
    steps = h * np.eye(12)
    differences = [(8 * (slope(d) - slope(-d)) - slope(2 * d) + slope(-2 * d)) / (12 * h) for d in steps]
    assert_allclose(matrix.reshape(12, 12), np.transpose(differences), rtol=0, atol=1e-8)


@EFFECTS
def test_integrator_that_leaves_it_out_is_refused(effect):
    leaves_out = "exact" if isinstance(effect, SeriesEffect) else "rkmk4"
    with pytest.raises(ValueError, match=f"'{leaves_out}' leaves out"):
        simulation(effect, effect.example, integrator=leaves_out)


@EFFECTS
def test_what_is_none_of_it_is_refused(effect):
    """In a sentence that says what it is and what it should be."""
    for given in (3, None, [3]) if effect.many else (3, None):
        with pytest.raises((TypeError, ValueError), match=r"; give|must be"):
            Simulation(BODY, **{effect.name: given})


def test_loads_fit_into_the_model():
    assert len(LOADS) <= MOST_LOADS


def test_kernels_of_a_set_of_loads_are_made_once():
    """numba knows a kernel by what it made of it: made anew, all would be compiled again."""
    loads = [effect for effect in LOADS if isinstance(effect, LoadEffect)]
    every = {name: value for effect in loads for name, value in given(effect, effect.example).items()}
    one = given(loads[0], loads[0].example)
    first, both = Terms(BODY, **one).kernels, Terms(BODY, **every).kernels
    assert first is Terms(BODY, **one).kernels is not both
    assert kernel_cache.identity(first.add_load) in kernel_cache.identity(both.add_load)


def test_effect_that_is_not_known_is_named():
    with pytest.raises(
        TypeError, match=r"not a term; there are gravity, rtol, drag, tethers, forces, ground, actuators"
    ):
        Simulation(BODY, drga=1.0)
