"""Scenes of several bodies: what is under a body's name, what all share, and what is refused."""

from pathlib import Path

import pytest

from rigid_body_sim import FleetScene, Scene, load_fleet, load_scene
from rigid_body_sim.scene.fleet import load_any, scene_from

pytestmark = pytest.mark.no_numba

CONFIG = Path(__file__).parents[2] / "config"
TWO = {"bodies": ["red", "blue"], "body": {"mass": 2.0}, "blue": {"body": {"mass": 3.0}}}


def refusal(**given):
    with pytest.raises(ValueError) as caught:
        FleetScene({"bodies": ["red", "blue"], **given})
    return str(caught.value)


def test_what_is_under_a_name_goes_over_what_all_share():
    scene = FleetScene({**TWO, "gravity": [0.0, 0.0, -9.8], "red.gravity": [0.0, 0.0, 0.0]})
    assert [one["body.mass"] for one in scene.scenes.values()] == [2.0, 3.0]
    assert [one["gravity"][2] for one in scene.scenes.values()] == [0.0, -9.8]


def test_each_body_is_the_scene_of_it_alone():
    alone = Scene({"body": {"mass": 3.0, "frame_id": "blue/base_link"}})
    assert FleetScene(TWO).scenes["blue"].values == alone.values


def test_half_an_attitude_under_a_name_takes_the_place_of_the_whole():
    scene = FleetScene(
        {**TWO, "initial.rpy": [0.1, 0.2, 0.3], "red.initial.orientation": {"w": 1, "x": 0, "y": 0, "z": 0}}
    )
    assert scene.scenes["red"].initial_state().orientation.tolist() == [1.0, 0.0, 0.0, 0.0]
    assert scene.scenes["blue"].initial_state().orientation[1] != 0.0


def test_frames_have_the_name_of_the_body_in_front():
    scene = FleetScene({**TWO, "frames.tip.position": [1.0, 0.0, 0.0], "red.body.frame_id": "hull"})
    assert [one["body.frame_id"] for one in scene.scenes.values()] == ["red/hull", "blue/base_link"]
    assert [list(one.frames) for one in scene.scenes.values()] == [["red/tip"], ["blue/tip"]]


def test_there_is_one_clock_after_the_messages_of_all():
    scene = FleetScene({**TWO, "outputs": ["odom", "clock"], "blue.outputs": ["imu"]})
    assert [one["outputs"] for one in scene.scenes.values()] == [("odom",), ("imu", "clock")]


def test_counted_bodies_stand_in_a_grid_from_the_position_of_all():
    scene = FleetScene(
        {"bodies": {"count": 5, "columns": 3, "spacing": [2.0, 10.0]}, "initial.position": [1.0, 0.0, 7.0]}
        | {"body_3.initial.position": [0.0, 0.0, 0.0]}
    )
    found = [one["initial.position"] for one in scene.scenes.values()]
    assert found == [(1.0, 0.0, 7.0), (3.0, 0.0, 7.0), (5.0, 0.0, 7.0), (0.0, 0.0, 0.0), (3.0, 10.0, 7.0)]
    assert scene.names == ("body_0", "body_1", "body_2", "body_3", "body_4")


def test_without_columns_there_are_about_as_many_as_rows():
    found = [one["initial.position"][:2] for one in FleetScene({"bodies.count": 7}).scenes.values()]
    assert found == [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1), (0, 2)]


def test_change_for_all_changes_each_body_that_has_none_of_its_own():
    before = FleetScene(TWO)
    after = before.changed({"body.mass": 5.0})
    assert [one["body.mass"] for one in after.scenes.values()] == [5.0, 3.0]
    assert after.scenes["blue"] is before.scenes["blue"]
    assert [one["body.mass"] for one in after.changed({"red.body.mass": 7.0}).scenes.values()] == [7.0, 3.0]
    assert [one["body.mass"] for one in before.scenes.values()] == [2.0, 3.0]


def test_values_are_those_of_all_and_what_may_change_of_each():
    values = FleetScene({**TWO, "body.shape": "box", "body.dimensions": [1.0, 2.0, 3.0]}).values
    assert (values["body.mass"], values["red.body.mass"], values["blue.body.mass"]) == (2.0, 2.0, 3.0)
    assert values["red.body.inertia"] != values["blue.body.inertia"]
    assert "red.rate" not in values and "red.body.shape" not in values


def test_same_scene_can_be_made_from_its_own_parameters():
    scene = FleetScene(
        {**TWO, "outputs": ["odom", "clock"], "frames.tip.position": [1.0, 0.0, 0.0], "lockstep_on": ["red"]}
    )
    again = FleetScene(scene.parameters(but=()))
    assert {name: one.values for name, one in again.scenes.items()} == {n: o.values for n, o in scene.scenes.items()}
    assert again.awaited == scene.awaited == ("red",)


@pytest.mark.parametrize("name", ["body", "wrench", "bodies", "pose", "reset", "odom", "links", "start_on_command"])
def test_body_cannot_be_called_as_something_else(name):
    assert f"a body cannot be called {name!r}, which is the name of " in refusal(bodies=["red", name])


@pytest.mark.parametrize("name", ["", " ", "7up", "a b", "a/b", "a.b", "_a", "a__b", "blå", "~", "a-b"])
def test_name_of_a_body_is_a_name_in_ros(name):
    said = refusal(bodies=["red", name])
    assert said.startswith("parameter bodies") and ("cannot be the name of a body" in said or "is not allowed" in said)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"bodies": ["red", "red"]}, "'red' is given twice; give it once"),
        ({"bodies": {}}, "no bodies are named; give bodies: [red, blue], or bodies.count"),
        ({"red.lockstep_on": ["blue"]}, "parameter red.lockstep_on: 'blue' says for whom all wait"),
        ({"bodies": 3}, "parameter bodies = 3: is not an array"),
        ({"bodies": ["red"], "bodies.count": 3}, "parameters bodies and bodies.count are given"),
        ({"bodies": ["red"], "bodies.columns": 3}, "parameter bodies.columns is for counted bodies; give bodies.count"),
        ({"bodies": [], "bodies.count": -1}, "parameter bodies.count = -1: is out of range"),
        ({"bodies": [], "bodies.count": 3, "bodies.prefix": "7"}, "parameter bodies.prefix: '7' cannot be the name"),
        ({"red.rate": 100.0}, "parameter red.rate: is the same for all bodies; give rate without a body's name"),
        ({"red.record.path": "x"}, "parameter red.record.path: is the same for all bodies"),
        ({"red.outputs": ["clock"]}, "there is one clock for all bodies; give it without a body's name"),
        ({"red.body.mass": -1.0}, "parameter red.body.mass = -1.0: is out of range"),
        ({"body.mass": -1.0}, "parameter body.mass = -1.0: is out of range"),
        ({"red.body.mas": 1.0}, "parameter red.body.mas is not known; did you mean red.body.mass?"),
        ({"rad.body.mass": 1.0}, "no body is called 'rad': did you mean red.body.mass?"),
        ({"green.body.mass": 1.0}, "parameter green.body.mass is not known; no body is called 'green'"),
        ({"red": 1.0}, "parameter red: is the name of a body; its parameters stand below it"),
        ({"lockstep_on": ["green"]}, "parameter lockstep_on: 'green' is no body; give names of bodies (red, blue) or"),
        ({"red.actuators.a.type": "rotor"}, "parameter red.actuators.a.type is given without red.actuators.a.min"),
        ({"red.frames.tip.axis": "world"}, "parameter red.frames.tip.axis is not known; did you mean red.frames"),
    ],
    ids=lambda value: "-".join(value) if isinstance(value, dict) else "",
)
def test_refusal_says_what_was_given_and_what_would_be_right(given, said):
    assert said in refusal(**given)


def test_scene_of_one_body_takes_no_several():
    with pytest.raises(ValueError, match=r"parameter bodies = \['red'\]: is of a scene of several bodies"):
        Scene({"bodies": ["red"]})
    with pytest.raises(ValueError, match=r"lockstep_on = .*give one of wrench, actuators"):
        Scene({"lockstep_on": ["red"]})
    assert Scene({"lockstep_on": "wrench"}).values == Scene().values == scene_from({}).values


def test_files_of_one_and_of_several_are_told_apart():
    assert load_fleet(CONFIG / "two_satellites.yaml").names == ("red", "blue")
    assert len(load_fleet(CONFIG / "fleet.yaml").names) == 50
    assert isinstance(load_any(CONFIG / "satellite.yaml"), Scene)
    with pytest.raises(ValueError, match=r"satellite.yaml: names no bodies"):
        load_fleet(CONFIG / "satellite.yaml")
    with pytest.raises(ValueError, match=r"fleet.yaml: parameter bodies"):
        load_scene(CONFIG / "fleet.yaml")
