"""A run is repeated from its journal to the bit, whatever was called when, and in however large strides."""

import json
import random
from dataclasses import replace

import pytest

from rigid_body_sim import Body, Drag, Scene, Simulation, SimulationError, State, Tether, Wrench
from rigid_body_sim.bags import journal
from rigid_body_sim.bags.rosbags_support import BagError
from rigid_body_sim.resim import journaled
from rigid_body_sim.resim.journaled import JournaledSimulation, replay

BODY = {"body.mass": 2.0, "body.inertia": [0.1, 0.2, 0.25, 0.01, 0.0, -0.02], "body.center_of_mass": [0.1, 0.0, 0.3]}
SPIN = {"initial.angular_velocity": [0.3, 1.0, 0.2], "initial.orientation": {"w": 0.4, "x": 0.2, "y": -0.8, "z": 0.4}}
SCENES = {
    "smooth": {**BODY, **SPIN, "gravity": [0.0, 0.0, -9.80665]},
    "from a shape": {**SPIN, "body.shape": "box", "body.dimensions": [0.1, 0.2, 0.7], "body.density": 900.0},
    "another rate": {**BODY, **SPIN, "rate": 333.3, "publish_rate": 0.0},
    "drag": {**BODY, **SPIN, "drag.quadratic": [0.3, 0.1, 0.2], "drag.angular_linear": [0.01, 0.02, 0.03]},
    "tether": {
        **BODY,
        "gravity": [0.0, 0.0, -9.80665],
        "tethers.rope.anchor": [0.0, 0.0, 1.0],
        "tethers.rope.rest_length": 1.0,
        "tethers.rope.stiffness": 1e5,
        "tethers.rope.damping": 10.0,
    },
}
SCENES["actuators"] = {
    **SCENES["smooth"],
    "actuators": {
        "names": ["rotor", "jet", "wheel"],
        "rotor": {"type": "rotor", "min": 0.0, "max": 900.0, "thrust_coefficient": 2e-5, "time_constant": 0.02},
        "jet": {"type": "thruster", "min": -5.0, "max": 5.0, "position": [0.1, 0.2, 0.0], "delay": 0.0033},
        "wheel": {"type": "wheel", "min": -1.0, "max": 1.0, "inertia": 1e-3, "time_constant": 0.05, "max_speed": 90.0},
    },
}
SCENES["actuators and drag"] = {**SCENES["actuators"], "drag.quadratic": [0.3, 0.1, 0.2]}
EPOCH_NS = 1_700_000_000_987_654_321
MOTIONS = 150
HOLDS = [None, 0.004, 0.1]  # s


class Run:
    """A run with its journal: ``messages`` are (log time, stamp), ``motions`` what they would hold."""

    def __init__(self, scene, sim=None):
        self.simulation = sim or JournaledSimulation.from_scene(scene)
        self.time_ns, self.texts, self.messages, self.motions = 1000, [], [], []
        self.simulation.journal = self.tell
        self.tell(0, journal.SCENE, journal.scene_values(scene, EPOCH_NS))

    def tell(self, step, call, values):
        self.time_ns += 1
        self.texts.append(journal.text(self.time_ns, step, call, values))

    def show(self):
        self.time_ns += 1
        self.messages.append((self.time_ns, EPOCH_NS + self.simulation.time_ns))
        self.motions.append(self.simulation.motion)

    def repeated(self):
        entries = journal.read(self.texts)
        simulation = Simulation.from_scene(journal.beginning(entries).scene)
        return [again.motion for again in replay(entries, simulation, self.messages)]


def vector(rng, scale=1.0):
    return tuple(rng.gauss(0.0, scale) for _ in range(3))


def wrench(rng):
    points = [(vector(rng), vector(rng))] if rng.random() < 0.2 else []
    parts = [vector(rng, 0.3) if rng.random() < 0.5 else (0.0, -0.0, 0.0) for _ in range(4)]
    return Wrench(*parts, points=points)


def command(rng, sim):
    """To the actuators, where there are any; or limits of their own, under which they go on."""
    if rng.random() < 0.3:
        sim.change(actuators=[replace(one, max=rng.uniform(0.1, 900.0)) for one in sim.actuators])
    sim.set_actuators([rng.gauss(0.0, scale) for scale in (900.0, 5.0, 1.0)[: len(sim.actuators)]], rng.choice(HOLDS))


def anything(rng, sim):
    """Call something that decides the motion."""
    calls = {
        "set_wrench": lambda: sim.set_wrench(wrench(rng), rng.choice(HOLDS), rng.choice(["a", "b"])),
        "impulse": lambda: sim.apply_impulse(Wrench(vector(rng, 0.1), vector(rng, 0.01))),
        "state": lambda: sim.set_state(State(vector(rng), [rng.gauss(0, 1) for _ in range(4)], vector(rng))),
        "gravity": lambda: sim.change(gravity=vector(rng)),
        "body": lambda: sim.change(body=Body(rng.uniform(1, 3), (0.1, 0.2, 0.25)), gravity=vector(rng)),
        "drag": lambda: sim.change(drag=Drag(linear=(rng.random(), 0.1, 0.2))),
        "tether": lambda: sim.change(tethers=[Tether((0.1, 0.0, 0.0), (0.0, 0.0, 2.0), 1.0, 100.0 * rng.random())]),
        "force": lambda: sim.change(forces=[((0.0, 0.0, 0.1), vector(rng))], rtol=1e-10),
        "clear": sim.clear_wrench,
        "actuators": lambda: command(rng, sim),
        "reset": lambda: sim.reset(keep_time=rng.random() < 0.5),
        "reset to": lambda: sim.reset(State(vector(rng))),
        "restart": sim.restart_time,
    }
    often = "actuators" if sim.actuators and rng.random() < 0.5 else "set_wrench"
    rng.choice([calls[often], *calls.values()])()


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("seed", range(3))
def test_any_run_repeats_to_the_bit(name, seed):
    rng = random.Random(f"{name} {seed}")
    run = Run(Scene(SCENES[name]))
    for _ in range(MOTIONS):
        run.simulation.step(rng.choice([0, 1, 1, 7, 20]))
        if rng.random() < 0.7:
            run.show()
        if rng.random() < 0.4:
            anything(rng, run.simulation)
            if rng.random() < 0.5:
                run.show()
    assert len(run.motions) > MOTIONS // 2
    assert run.repeated() == run.motions


def test_stop_and_reset_repeat_too():
    """A step that cannot be done is not taken again; what follows the reset is the same."""
    run = Run(Scene(BODY))
    run.simulation.step(5)
    run.simulation.set_wrench(Wrench(torque_body=(1e12, 0.0, 0.0)))
    with pytest.raises(SimulationError):
        run.simulation.step(100_000)
    run.show()
    run.simulation.reset(keep_time=True)
    run.simulation.apply_impulse(Wrench(torque_body=(0.0, 0.1, 0.0)))
    run.simulation.step(10)
    run.show()
    assert run.repeated() == run.motions


def test_stop_where_a_wrench_ends_repeats():
    """The sum of the wrenches left is refused when the one in between ends: at that step, not at the next."""
    run = Run(Scene(BODY))
    huge = 1.7e308
    run.simulation.set_wrench(Wrench(force_world=(-huge, 0.0, 0.0)), 0.005, "a")
    for source in "bc":
        run.simulation.set_wrench(Wrench(force_world=(0.6 * huge, 0.0, 0.0)), None, source)
    with pytest.raises(SimulationError):
        run.simulation.step(10)
    assert run.simulation.steps == 5
    run.show()
    run.simulation.reset(keep_time=True)
    run.simulation.step(3)
    run.show()
    assert run.repeated() == run.motions


def test_what_is_refused_is_not_told():
    run = Run(Scene(BODY))
    most = Wrench(force_world=(1.7e308, 0.0, 0.0))
    run.simulation.set_wrench(most, None, "a")
    with pytest.raises(ValueError, match="add up to more"):
        run.simulation.set_wrench(most, None, "b")
    with pytest.raises(ValueError, match="hold"):
        run.simulation.set_wrench(Wrench(), -1.0)
    assert len(run.texts) == 2


def test_numbers_are_those_of_the_call():
    run = Run(Scene(BODY))
    run.simulation.set_wrench(Wrench(force_body=(0.1, -0.0, 1e-300), points=[((0, 0, 1), (1 / 3, 0, 0))]), 0.5, "gust")
    entry = json.loads(run.texts[1])
    assert entry == {
        "time_ns": 1002,
        "step": 0,
        "call": "set_wrench",
        "wrench": {
            "force_body": [0.1, -0.0, 1e-300],
            "torque_body": [0.0, 0.0, 0.0],
            "force_world": [0.0, 0.0, 0.0],
            "torque_world": [0.0, 0.0, 0.0],
            "points": [[[0.0, 0.0, 1.0], [1 / 3, 0.0, 0.0]]],
        },
        "hold": 0.5,
        "source": "gust",
    }
    assert "[0.1, -0.0, 1e-300]" in run.texts[1]


def test_beginning_needs_no_files():
    scene = Scene(SCENES["from a shape"])
    run = Run(scene)
    start = journal.beginning(journal.read(run.texts))
    assert start.scene["body.shape"] == ""
    assert start.scene.body() == scene.body()
    assert start.epoch_ns == EPOCH_NS
    assert start.kernels == json.loads(run.texts[0])["kernels"]


def test_journal_of_an_earlier_version_is_read():
    """Its scene has quaternions as w, x, y, z in a row, of the body and of its frames."""
    scene = Scene({**BODY, **SPIN, "frames.hook.orientation": {"w": 0.6, "x": 0.0, "y": 0.8, "z": 0.0}})
    run = Run(scene)
    for _ in range(5):
        run.simulation.step(7)
        run.show()
    entry = json.loads(run.texts[0])
    parameters = entry["parameters"]
    for prefix in ("initial", "frames.hook"):
        parameters[f"{prefix}.orientation"] = [parameters.pop(f"{prefix}.orientation.{part}") for part in "wxyz"]
        del parameters[f"{prefix}.rpy"]
    assert parameters["initial.orientation"] == [0.4, 0.2, -0.8, 0.4]
    run.texts[0] = json.dumps(entry)
    assert journal.beginning(journal.read(run.texts)).scene.values == scene.values
    assert run.repeated() == run.motions


def test_every_call_that_an_entry_may_have_can_be_repeated():
    assert set(journaled._CALLS) == set(journal.CALLS)


def test_simulation_without_a_journal_works():
    sim = JournaledSimulation.from_scene(Scene(BODY))
    sim.set_wrench(Wrench())
    with pytest.raises(RuntimeError, match="cannot be restored"):
        sim.restore(sim.save())


# What does not fit ----------------------------------------------------------------------------------------------------


def short_run():
    run = Run(Scene(BODY))
    for _ in range(3):
        run.simulation.step(4)
        run.simulation.set_wrench(Wrench(torque_body=(0.1, 0.0, 0.0)))
        run.show()
    return run


def test_hole_is_said_where_it_is():
    run = short_run()
    run.tell(12, journal.LOST, {})
    assert run.repeated() == run.motions
    run.simulation.step(1)
    run.show()
    with pytest.raises(BagError, match="hole after step 12, where"):
        run.repeated()


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda run: run.messages.append((2000, EPOCH_NS)), "lies before step 12"),
        (lambda run: run.messages.append((2000, EPOCH_NS + 13_500_001)), "belongs to no step"),
        (lambda run: run.texts.append("{"), "entry 4 of the journal is not as"),
        (lambda run: run.texts.append("[]"), "entry 4 of the journal is not as"),
        (lambda run: run.texts.append('{"step": 0, "call": "reset"}'), "time_ns"),
        (lambda run: run.texts.append('{"time_ns": 1, "step": 0, "call": "jump"}'), "'jump' is not known"),
        (lambda run: run.texts.pop(0), "does not begin with a scene"),
        (lambda run: run.texts.clear(), "does not begin with a scene"),
        (lambda run: run.texts.__setitem__(0, run.texts[0].replace("body.mass", "body.mas")), "did you mean body.mass"),
        (
            lambda run: run.texts.__setitem__(
                0, run.texts[0].replace('"initial.rpy": []', '"initial.orientation": [1]')
            ),
            "initial.orientation = .1.: has 1 entries",
        ),
        (lambda run: run.texts.__setitem__(2, run.texts[2].replace("torque_body", "torque")), "cannot be repeated"),
    ],
)
def test_misfits_are_refused(spoil, said):
    run = short_run()
    spoil(run)
    with pytest.raises(BagError, match=said):
        run.repeated()
