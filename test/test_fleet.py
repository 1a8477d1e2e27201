"""Several bodies advanced together: each with the bits of a Simulation of it alone, and none minds another's end."""

import copy
import pickle
from pathlib import Path

import numpy as np
import pytest

from rigid_body_sim import Body, Fleet, FleetScene, Scene, Simulation, Wrench, load_fleet, load_scene

CONFIG = Path(__file__).parents[1] / "config"
PUSH = Wrench(force_body=(1.0, 0.0, 0.0), torque_body=(0.1, -0.2, 0.3))
INERTIA = [0.1, 0.2, 0.25, 0.0, 0.0, 0.0]
MIXED = {
    "bodies": ["free", "pushed", "dragged", "stiff", "rotor", "spin"],
    "rate": 500.0,
    "body.inertia": INERTIA,
    "initial.angular_velocity": [0.3, -1.0, 0.2],
    "dragged.drag.quadratic": [0.1, 0.2, 0.3],
    "stiff.tethers.rope": {
        "body_point": [0.1, 0.0, 0.0],
        "anchor": [0.0, 0.0, 1.0],
        "rest_length": 0.5,
        "stiffness": 1e5,
    },
    "rotor.actuators": {
        "names": ["one"],
        "one": {
            "type": "rotor",
            "min": 0.0,
            "max": 900.0,
            "thrust_coefficient": 1e-5,
            "torque_coefficient": 1e-7,
            "time_constant": 0.02,
        },
    },
}
FAST = {"bodies": ["red", "blue"], "red.initial.linear_velocity": [9e306, 0.0, 0.0]}


def state(simulation):
    return simulation.save()


def commanded(target):
    """The same commands to bodies of MIXED, by name."""
    target["pushed"].set_wrench(PUSH, 0.011)
    target["pushed"].set_wrench(Wrench(force_world=(0.0, 1.0, 0.0)), 0.1, "gust")
    target["dragged"].set_wrench(PUSH)
    target["rotor"].set_actuators([500.0], 0.05)
    target["spin"].set_wrench(Wrench(points=[((0.1, 0.0, 0.0), (0.0, 0.0, 1.0))]))


def test_each_body_has_the_bits_of_a_simulation_alone():
    scene = FleetScene(MIXED)
    fleet, alone = Fleet.from_scene(scene), {name: Simulation.from_scene(one) for name, one in scene.scenes.items()}
    for n in (1, 7, 0, 30, 1, 200):
        commanded(fleet)
        commanded(alone)
        fleet.step(n)
        for one in alone.values():
            one.step(n)
        assert {name: one.save() for name, one in fleet.items()} == {name: one.save() for name, one in alone.items()}
    assert fleet.steps == 239


def test_group_follows_who_is_busy_and_what_kind_of_wrench_is_held():
    """Of four alike another one each step has a hold that ends, and all come to hold a wrench of another kind.

    A group of bodies that are busy has other bits; one of the wrong kind has the same, and takes longer.
    """
    scene = FleetScene({"bodies.count": 4, "initial.angular_velocity": [0.3, -1.0, 0.2], "body.inertia": INERTIA})
    fleet = Fleet.from_scene(scene)
    alone = {name: Simulation.from_scene(one) for name, one in scene.scenes.items()}
    for kind in (
        Wrench(torque_body=(0.1, -0.2, 0.3)),
        Wrench(torque_world=(0.3, 0.1, 0.2), force_body=(0.0, 1.0, 2.0)),
    ):
        for target in (fleet, alone):
            for name in scene.scenes:
                target[name].set_wrench(kind)
        for busy in (None, *scene.scenes, *scene.scenes, None):
            for target in (fleet, alone) if busy else ():
                target[busy].set_wrench(PUSH, 0.001, "gust")
            fleet.step()
            for one in alone.values():
                one.step()
            assert {name: state(one) for name, one in fleet.items()} == {
                name: state(one) for name, one in alone.items()
            }


def test_many_alike_have_the_bits_of_a_simulation_alone():
    scene = FleetScene({"bodies.count": 11, "body.inertia": INERTIA})
    fleet = Fleet.from_scene(scene)
    alone = {name: Simulation.from_scene(one) for name, one in scene.scenes.items()}
    for turn in range(40):
        for place, name in enumerate(fleet):
            if place % 3 == turn % 5:
                wrench = Wrench(torque_body=(0.1 * place, 0.2, -0.1), force_world=(0.0, turn, 0.0))
                fleet[name].set_wrench(wrench, 0.002 * place + 0.001)
                alone[name].set_wrench(wrench, 0.002 * place + 0.001)
        fleet.step(turn % 4)
        for one in alone.values():
            one.step(turn % 4)
    assert {name: one.save() for name, one in fleet.items()} == {name: one.save() for name, one in alone.items()}


def test_many_in_closed_form_have_the_bits_of_a_simulation_alone_however_steps_are_divided():
    scene = FleetScene(
        {
            "bodies.count": 5,
            "body.inertia": INERTIA,
            "initial.angular_velocity": [0.3, -1.0, 0.2],
        }
    )
    fleet, alone = Fleet.from_scene(scene), Simulation.from_scene(scene.scenes["body_3"])
    for n in (3, 40, 1, 700):
        fleet.step(n)
        alone.step(n)
        assert {one.integrator.name for one in fleet.values()} == {"exact"}
        assert fleet["body_3"].motion[3:] == alone.motion[3:] and fleet["body_3"].save() == alone.save()


def test_one_that_cannot_go_on_stops_alone_and_is_reset_alone():
    fleet = Fleet.from_scene(FleetScene({**FAST, "red.gravity": [1e303, 0.0, 0.0]}))
    told = []
    fleet.on_stop = told.append
    fleet.step(2_000_000)
    assert list(fleet.stopped) == told == ["red"]
    assert "step " in fleet.stopped["red"] and fleet["red"].steps < fleet.steps == fleet["blue"].steps == 2_000_000
    last = fleet["red"].state.values.tolist()
    fleet.step(5)
    assert fleet["red"].state.values.tolist() == last and fleet["blue"].steps == 2_000_005
    fleet.reset("red")
    assert not fleet.stopped and fleet["red"].steps == fleet.steps == 2_000_005
    fleet.step(5)
    assert fleet["red"].steps == 2_000_010


def test_bodies_wait_each_for_its_own_command():
    fleet = Fleet.from_scene(
        FleetScene({"bodies": ["red", "blue"], "start_on_command": True, "gravity": [0.0, 0.0, -1.0]})
    )
    fleet.step(10)
    fleet.set_going("red")
    fleet.step(10)
    assert fleet["red"].state.position[2] < 0.0 == fleet["blue"].state.position[2]
    assert fleet["red"].steps == fleet["blue"].steps == 20
    fleet.reset("red")
    fleet.step(10)
    assert fleet["red"].state.position[2] == 0.0 and fleet.waiting == {"red", "blue"}


def test_reset_of_all_begins_time_anew_or_keeps_it():
    fleet = Fleet.from_scene(load_fleet(CONFIG / "two_satellites.yaml"))
    fleet.step(100)
    fleet.reset(keep_time=True)
    assert (fleet.steps, fleet["red"].steps, fleet.time_ns) == (100, 100, 100_000_000)
    fleet.reset()
    assert (fleet.steps, fleet["blue"].steps) == (0, 0)
    fleet.step(3)
    fleet.restart_time()
    assert (fleet.steps, fleet["blue"].steps) == (0, 0)


def test_saved_fleet_goes_on_with_the_same_bits():
    fleet = Fleet.from_scene(FleetScene({**MIXED, "free.start_on_command": True}))
    commanded(fleet)
    fleet.step(20)
    saved = pickle.loads(pickle.dumps(fleet.save()))
    fleet.step(50)
    ahead = fleet.save()
    fleet.restore(saved)
    assert fleet.save() == saved and fleet.waiting == {"free"}
    fleet.step(50)
    assert fleet.save() == ahead


def test_snapshot_of_other_bodies_is_refused_and_nothing_changes():
    one, two = Fleet.from_scene(FleetScene(MIXED)), Fleet.from_scene(load_fleet(CONFIG / "two_satellites.yaml"))
    one.step(3)
    old = one.save()
    one.step(3)
    before = one.save()
    with pytest.raises(ValueError, match=r"the snapshot is of \['blue', 'red'\]; give one of a fleet of"):
        one.restore(two.save())
    worse = copy.deepcopy(old)  # of which all but the last body could be restored
    worse.bodies["spin"] = old.bodies["rotor"]
    with pytest.raises(ValueError, match="other actuators"):
        one.restore(worse)
    assert one.save() == before


@pytest.mark.no_numba
def test_what_is_no_fleet_is_refused():
    def make(rate=100.0, steps=0):
        simulation = Simulation(Body(1.0, (1.0, 1.0, 1.0)), rate=rate)
        simulation.step(steps)
        return simulation

    with pytest.raises(ValueError, match="a fleet without bodies"):
        Fleet({})
    with pytest.raises(ValueError, match="the rates of the bodies are 100, 200 Hz; give all"):
        Fleet({"a": make(), "b": make(200.0)})
    with pytest.raises(ValueError, match="body b: has done 3 steps; give simulations at step 0"):
        Fleet({"a": make(), "b": make(steps=3)})
    with pytest.raises(TypeError, match="body a: 1 is no Simulation"):
        Fleet({"a": 1})
    one = make()
    with pytest.raises(ValueError, match="body b: is the same simulation as a; give each body one of its own"):
        Fleet({"a": one, "b": one})
    with pytest.raises(ValueError, match="starts_on_command: there is no body 'z'; there are a"):
        Fleet({"a": make()}, ["z"])
    with pytest.raises(ValueError, match=r"body b: parameter integrator.name = 'nope'"):
        Fleet.from_scene(FleetScene({"bodies": ["a", "b"], "b.integrator.name": "nope"}))
    fleet = Fleet({"a": make()})
    with pytest.raises(ValueError, match=r"step\(-1\): time does not run backwards"):
        fleet.step(-1)
    assert repr(fleet) == "Fleet(1 bodies at 0 s, 100 Hz)"
    with pytest.raises(KeyError):
        fleet["nobody"]
    with pytest.raises(KeyError):
        fleet.reset("nobody")
    with pytest.raises(KeyError):
        fleet.set_going("nobody")


def test_two_satellites_differ_from_one_alone_by_their_start_alone():
    scene, one = load_fleet(CONFIG / "two_satellites.yaml"), load_scene(CONFIG / "satellite.yaml")
    assert scene.scenes["red"].terms() == one.terms()
    fleet, alone = Fleet.from_scene(scene), Simulation.from_scene(one)
    fleet.step(100)
    alone.step(100)
    np.testing.assert_array_equal(fleet["red"].state.values, alone.state.values)


# Links ----------------------------------------------------------------------------------------------------------------

SLUNG = {
    "bodies": ["drone", "load", "bird"],
    "rate": 500.0,
    "gravity": [0.0, 0.0, -9.80665],
    "drone.body.mass": 2.0,
    "load.body.mass": 0.5,
    "load.initial.position": [0.3, 0.0, -1.0],
    "drone.initial.angular_velocity": [0.1, 0.2, 0.3],
    "links.cable": {
        "bodies": ["drone", "load"],
        "first_point": [0.0, 0.0, -0.05],
        "second_point": [0.0, 0.0, 0.1],
        "rest_length": 0.8,
        "stiffness": 500.0,
        "damping": 2.0,
    },
}
HOVER = Wrench(force_world=(0.0, 0.0, 2.5 * 9.80665))


def slung(**more):
    return Fleet.from_scene(FleetScene({**SLUNG, **more}))


def test_linked_bodies_pull_each_other_and_their_momentum_changes_by_what_is_sent_alone():
    fleet = slung()
    fleet["drone"].set_wrench(HOVER)
    fleet.step(1000)
    linked = sum(fleet[name].state.momentum for name in ("drone", "load"))
    assert np.abs(linked).max() < 2e-13  # of 49 N s each way; 1.4e-14 measured
    assert fleet["load"].state.position[2] > -3.0  # it would have fallen by 20 m
    assert fleet["bird"].state.position[2] == pytest.approx(-0.5 * 9.80665 * 4.0, rel=1e-15)  # linked to none


def test_holds_end_within_a_call_as_between_calls():
    def commanded():
        fleet = slung()
        fleet["drone"].set_wrench(HOVER, 0.1)
        fleet["load"].set_wrench(PUSH, 0.034)
        return fleet

    one, many = commanded(), commanded()
    one.step(100)
    for n in (1, 16, 1, 33, 49):
        many.step(n)
    assert one.save() == many.save()


def test_linked_bodies_stop_are_reset_and_wait_together():
    fleet = slung(**{"load.gravity": [1e307, 0.0, 0.0]})
    told = []
    fleet.on_stop = told.append
    fleet.step(500)
    assert told == ["drone", "load"] and fleet["bird"].steps == 500
    assert "drone, load, which are linked, would leave the range of finite numbers" in fleet.stopped["load"]
    fleet.reset("drone")
    assert not fleet.stopped and fleet["load"].steps == 500
    assert fleet["load"].state.position.tolist() == [0.3, 0.0, -1.0]

    waiting = slung(**{"drone.start_on_command": True})
    waiting.step(10)
    assert waiting.waiting == {"drone", "load"} and waiting["load"].state.position.tolist() == [0.3, 0.0, -1.0]
    waiting.set_going("load")
    waiting.step(10)
    assert not waiting.waiting and waiting["drone"].state.velocity[2] < 0.0


def test_slack_links_leave_bodies_as_they_were_alone_to_rtol():
    fleet = slung(**{"links.cable": {**SLUNG["links.cable"], "rest_length": 100.0}})
    alone = {name: Simulation.from_scene(one) for name, one in FleetScene(SLUNG).scenes.items()}
    fleet.step(200)
    for name, one in alone.items():
        one.step(200)
        np.testing.assert_allclose(fleet[name].motion, one.motion, rtol=1e-9, atol=1e-12)


def test_chain_is_one_set_whatever_the_order_of_its_links():
    scene = {
        "bodies": ["a", "b", "c", "d"],
        "links": {
            "last": {"bodies": ["c", "b"], "rest_length": 1.0, "stiffness": 10.0},
            "first": {"bodies": ["a", "b"], "rest_length": 1.0, "stiffness": 10.0},
        },
        "a.start_on_command": True,
    }
    assert Fleet.from_scene(FleetScene(scene)).waiting == {"a", "b", "c"}


@pytest.mark.no_numba
@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"links.cable.bodies": ["drone", "nobody"]}, "link cable: there is no body 'nobody'; there are drone, load"),
        ({"links.cable.bodies": ["drone", "drone"]}, "'drone' is given twice; give it once"),
        ({"links.cable.bodies": ["drone"]}, "link cable: bodies ['drone']; give names of two bodies"),
        ({"links.cable.stiffness": -1.0}, "parameter links.cable.stiffness = -1.0: is out of range"),
        ({"links.cable.length": 1.0}, "parameter links.cable.length is not known"),
        ({"drone.links.cable.stiffness": 1.0}, "parameter drone.links.cable.stiffness: is the same for all bodies"),
        ({"links.cable": {"stiffness": 1.0}}, "is given without links.cable.bodies"),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)
def test_link_that_cannot_be_is_refused(given, said):
    kept = {key: value for key, value in SLUNG.items() if key not in given and key != "links.cable"}
    cable = {f"links.cable.{key}": value for key, value in SLUNG["links.cable"].items()}
    with pytest.raises(ValueError) as caught:
        FleetScene({**kept, **(cable if "links.cable" not in given else {}), **given})
    assert said in str(caught.value)


@pytest.mark.no_numba
def test_linked_body_of_another_integrator_is_refused():
    with pytest.raises(
        ValueError,
        match=r"integrator.name = 'taylor': load has links, and bodies with links are advanced by",
    ):
        slung(**{"load.integrator.name": "taylor"})
    with pytest.raises(ValueError, match=r"links.cable.bodies = .*: is of a scene of several bodies"):
        Scene({"links.cable.bodies": ["drone", "load"]})
