"""The table of parameters and its rules: one failing example for each, with what the message must say."""

import math
from array import array

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigid_body_sim import sensors
from rigid_body_sim.scene import schema
from rigid_body_sim.scene.loader import Scene
from rigid_body_sim.simulation import Simulation

pytestmark = pytest.mark.no_numba

over_the_table = pytest.mark.parametrize("parameter", schema.TABLE, ids=lambda parameter: parameter.name)


@over_the_table
def test_parameter_has_a_text_that_is_a_sentence(parameter):
    assert len(parameter.text) > 4
    assert parameter.text.endswith(".")


@over_the_table
def test_default_obeys_the_rules_of_its_own_parameter(parameter):
    assert parameter.read(parameter.name, parameter.default) == parameter.default


@over_the_table
def test_numbers_with_a_dimension_say_their_unit(parameter):
    dimensionless = ".orientation." in parameter.name or parameter.name.endswith(
        ("rtol", "factor", "normal", "friction", ".axis")
    )
    assert bool(parameter.unit) == (parameter.type in (float, tuple) and not dimensionless)


def test_names_are_unique():
    assert len(schema.BY_NAME) == len(schema.TABLE)


def test_scene_without_anything_given_has_every_default():
    assert Scene().values == schema.defaults()


MAST = {"tethers.mast.anchor": (0.0, 0.0, 5.0), "tethers.mast.rest_length": 2.0, "tethers.mast.stiffness": 1e3}

NOWHERE = dict.fromkeys("wxyz", 0)

BAD = {  # what is given, and what the message must say: the name, the value, and what would be right
    "unknown name": ({"body.maas": 1.0}, r"parameter body\.maas is not known; did you mean body\.mass\?"),
    "unknown group": ({"inital.position": (0, 0, 0)}, r"did you mean initial\.position\?"),
    "unknown frame entry": ({"frames.nozzle.positon": (0, 0, 0)}, r"did you mean frames\.<name>\.position\?"),
    "frame without a name": ({"frames..position": (0, 0, 0)}, r"frames\.\.position is not known"),
    "frame name left open": ({"frames.<name>.axes": "body"}, "is not known"),
    "text for a number": ({"rate": "1000"}, r"parameter rate = '1000': '1000' is not a number; give .* 1000\.0"),
    "nothing for a number": ({"rate": None}, "parameter rate = None: None is not a number"),
    "bool for a number": ({"rate": True}, "parameter rate = True: True is not a number"),
    "bool in an array": ({"gravity": (0.0, 0.0, False)}, "False is not a number; give a value such as"),
    "number for a bool": ({"start_paused": 1}, "is not of type bool; give a value such as False"),
    "number for a text": ({"world_frame_id": 1.0}, "is not of type string; give a value such as 'world'"),
    "number for an array": ({"gravity": -9.81}, r"is not an array; give 3 numbers such as \[0\.0, 0\.0, 0\.0\]"),
    "text for an array": ({"gravity": "0 0 -9.81"}, "is not an array; give 3 numbers"),
    "text in an array": ({"gravity": (0, 0, "-9.81")}, "'-9.81' is not a number"),
    "not a number": ({"body.mass": math.nan}, r"parameter body\.mass = nan: is not finite"),
    "infinite": ({"body.mass": math.inf}, "is not finite; give finite numbers"),
    "not a number in an array": ({"initial.position": (0, math.nan, 0)}, r"initial\.position.* is not finite"),
    "excluded bound": ({"body.mass": 0.0}, "is out of range; give a number that is finite and greater than 0"),
    "below the least": ({"wrench.timeout": -0.1}, "out of range; give a number that is finite and at least 0"),
    "above the most": ({"rate": 2e6}, r"out of range; .* at least 0\.001 and at most 1e\+06"),
    "too short": ({"gravity": (0.0, -9.81)}, r"has 2 entries; give 3, such as \[0\.0, 0\.0, 0\.0\]"),
    "too long": ({"body.inertia": [0.1] * 9}, "has 9 entries; give 6"),
    "no choice": ({"twist_frame": "base_link"}, "twist_frame = 'base_link': is not allowed; give one of body, world"),
    "empty text": ({"body.frame_id": ""}, "is empty; give a name such as 'base_link'"),
    "text for names": ({"outputs": "odom"}, r"outputs = 'odom': is not an array; give names such as \['odom', "),
    "unknown name in names": ({"outputs": ["odom", "pose"]}, "'pose' is not allowed; give any of odom, accel, imu, "),
    "number in names": ({"outputs": [1.0]}, r"outputs = \[1.0\]: 1.0 is not allowed; give any of odom"),
    "name given twice": ({"outputs": ["imu", "odom", "imu"]}, "'imu' is given twice; give it once"),
    "publish_rate does not divide": ({"publish_rate": 300.0}, r"divide rate = 1000 Hz .* nearest .* 333\.333333"),
    "publish_rate above rate": ({"publish_rate": 2000.0}, "does not divide rate = 1000 Hz"),
    "frame named twice": ({"frames.world.axes": "body"}, "frame name 'world' is used twice"),
    "body frame is the world frame": ({"body.frame_id": "world"}, "frame name 'world' is used twice"),
    "attitude without direction": ({"initial.orientation": NOWHERE}, r"initial\.orientation: quaternion .* norm"),
    "frame without direction": ({"frames.a.orientation": NOWHERE}, r"frames\.a\.orientation: quaternion"),
    "negative drag": (
        {"drag.quadratic": (1.0, -2.0, 3.0)},
        r"parameter drag\.quadratic .* is out of range; give 3 finite numbers, each at least 0",
    ),
    "one number for drag": ({"drag.linear": 2.0}, r"drag\.linear = 2\.0: is not an array; give 3 numbers such as"),
    "two numbers for drag": ({"drag.angular_linear": (1.0, 2.0)}, "has 2 entries; give 3"),
    "unknown kind of drag": ({"drag.angular": (0, 0, 0)}, "the parameters of drag are linear, quadratic, ang"),
    "unknown tether entry": ({"tethers.mast.stiffnes": 1.0}, r"did you mean tethers\.<name>\.stiffness\?"),
    "tether without a name": ({"tethers.stiffness": 1.0}, r"tethers\.stiffness is not known; did you mean tethers"),
    "negative stiffness": ({**MAST, "tethers.mast.stiffness": -1.0}, "stiffness = -1.0: .* finite and greater than 0"),
    "tether that does not pull": ({**MAST, "tethers.mast.stiffness": 0.0}, "stiffness = 0.0: is out of range"),
    "negative damping": ({**MAST, "tethers.mast.damping": -1.0}, "damping = -1.0: .* finite and at least 0"),
    "negative length": ({**MAST, "tethers.mast.rest_length": -1.0}, "rest_length = -1.0: .* at least 0"),
    "slack that is a number": ({**MAST, "tethers.mast.slack": 1}, "slack = 1: is not of type bool"),
    "tether to nowhere": (
        {"tethers.mast.stiffness": 5.0},
        r"parameter tethers\.mast\.stiffness is given without tethers\.mast\.anchor, which has no default; give it",
    ),
    "tether without stiffness": (
        {"tethers.mast.anchor": (0, 0, 1), "tethers.mast.rest_length": 1.0},
        r"without tethers\.mast\.stiffness, which has no default; give it, such as 1000\.0",
    ),
    "tether without length": (
        {"tethers.mast.anchor": (0, 0, 1), "tethers.mast.stiffness": 1.0},
        r"without tethers\.mast\.rest_length",
    ),
    "force without a force": (
        {"forces.lift.body_point": (0, 0, 1)},
        r"forces\.lift\.body_point is given without forces\.lift\.force, .* such as \[0\.0, 0\.0, 1\.0\]",
    ),
    "force not finite": ({"forces.lift.force": (0, 0, math.inf)}, r"forces\.lift\.force .* is not finite"),
    "unknown force entry": ({"forces.lift.point": (0, 0, 1)}, r"parameters of forces\.lift are body_point, force$"),
    "no tolerance": ({"integrator.rtol": 0.0}, r"integrator\.rtol = 0\.0: .* at least 1e-13 and at most 1"),
    "impossible inertia": ({"body.inertia": (1, 1, 3, 0, 0, 0)}, r"parameter body\.inertia .* triangle inequality"),
}  # fmt: skip


@pytest.mark.parametrize(("given_values", "message"), BAD.values(), ids=BAD)
def test_bad_value_is_refused_with_its_name_and_what_would_be_right(given_values, message):
    with pytest.raises(ValueError, match=message) as caught:
        Scene(given_values)
    assert any(name in str(caught.value) for name in given_values) or "frame name" in str(caught.value)


def test_integer_is_taken_as_a_float():
    scene = Scene({"rate": 500, "gravity": [0, 0, -10]})
    assert scene["rate"] == 500.0
    assert isinstance(scene["rate"], float)
    assert scene["gravity"] == (0.0, 0.0, -10.0)
    assert all(isinstance(component, float) for component in scene["gravity"])


@pytest.mark.parametrize(
    ("rate", "publish_rate", "steps"),
    [(1000.0, 100.0, 10), (1000.0, 0.0, 1), (3.0, 1.0, 3), (0.3, 0.1, 3), (1.0, 1.0, 1)],
)
def test_publish_rate_divides_rate_into_whole_steps(rate, publish_rate, steps):
    assert Scene({"rate": rate, "publish_rate": publish_rate}).steps_per_publish == steps


def test_publish_rate_proposed_is_one_that_is_accepted():
    with pytest.raises(ValueError, match="nearest") as caught:
        Scene({"publish_rate": 300.0})
    proposed = float(str(caught.value).rsplit(" ", 1)[1])
    assert Scene({"publish_rate": proposed}).steps_per_publish == 3


def test_frame_named_once_has_all_its_parameters():
    scene = Scene({"frames.nozzle.position": (0.0, 0.0, -1.0)})
    frame = scene.frames["nozzle"]
    assert (frame.position, frame.orientation, frame.axes) == ((0, 0, -1), (1, 0, 0, 0), "body")


@pytest.mark.parametrize("group", [each for each in schema.GROUPS if each not in schema.OF_SEVERAL])
def test_member_of_a_group_has_all_its_parameters(group):
    own = [p for p in schema.TABLE if p.name.startswith(f"{group}.<name>.")]
    given_values = {p.name.replace("<name>", "mast"): p.default for p in own if p.required or p is own[0]}
    needed = {"contacts": {"ground.stiffness": 1e4}, "actuators": {"actuators.names": ["mast"]}}
    scene = Scene({**given_values, **needed.get(group, {})})
    assert schema.members(group, scene.values) == ["mast"]
    kind = sensors.REGISTRY["imu"]  # a sensor has those of its type, and what has no type has all
    own = [p for p in own if group != "sensors" or p not in sensors.ROWS or kind.has(p)]
    assert {p.name.replace("<name>", "mast"): p.default for p in own}.items() <= scene.values.items()


def test_groups_are_those_of_the_table():
    assert schema.GROUPS == ("tethers", "forces", "contacts", "actuators", "sensors", "frames", "links")


STEPS = schema.BY_NAME["steps_per_command"]
TOPICS = schema.BY_NAME["wrench.topics"]


@pytest.mark.parametrize(
    ("parameter", "value", "reason"),
    [
        (STEPS, 1.0, "is not of type integer; give a value such as 1"),
        (STEPS, True, "is not of type integer"),
        (STEPS, "1", "is not of type integer"),
        (STEPS, 0, "is out of range; give a number that is at least 1 and at most 1e\\+06"),
        (STEPS, 10**30, "is out of range"),
        (TOPICS, "wrench", "is not an array; give names such as \\['wrench'\\]"),
        (TOPICS, 3, "is not an array"),
        (TOPICS, [], "is empty; give at least one name, such as \\['wrench'\\]"),
        (TOPICS, ["a", " "], "' ' is not allowed; give names, none twice"),
        (TOPICS, ["a", 3], "3 is not allowed"),
        (TOPICS, ["a", "b", "a"], "'a' is given twice; give it once"),
    ],
)
def test_whole_number_or_names_that_are_none_are_refused(parameter, value, reason):
    with pytest.raises(ValueError, match=f"parameter {parameter.name} = .*: {reason}"):
        parameter.read(parameter.name, value)


def test_whole_number_stays_one_and_names_keep_their_order():
    assert STEPS.read("steps_per_command", 12) == 12 and isinstance(STEPS.read("steps_per_command", 12), int)
    assert TOPICS.read("wrench.topics", ["b", "a"]) == ("b", "a")


def test_dynamic_are_those_of_the_body_what_acts_limits_and_pace():
    """Everything else decides the set-up: names, files, rates."""
    assert {p.name for p in schema.TABLE if p.dynamic} == {
        *("body.mass", "body.inertia", "gravity", "wrench.max_force", "wrench.max_torque", "real_time_factor"),
        *(f"drag.{kind}" for kind in ("linear", "quadratic", "angular_linear", "angular_quadratic")),
        *(f"ground.{kind}" for kind in ("height", "normal", "stiffness", "damping", "friction", "slip_speed")),
        *(f"actuators.<name>.{limit}" for limit in ("min", "max")),
        "fluid.velocity",
        *(
            f"tethers.<name>.{last}"
            for last in ("body_point", "anchor", "rest_length", "stiffness", "damping", "slack")
        ),
        *(f"forces.<name>.{last}" for last in ("body_point", "force")),
    }


def test_changed_scene_keeps_what_was_given_and_works_out_anew_what_follows():
    scene = Scene({"body.shape": "box", "body.dimensions": (1.0, 2.0, 3.0), "body.mass": 12.0, "rate": 500.0})
    assert scene["body.inertia"] == (13.0, 10.0, 5.0, 0.0, 0.0, 0.0)
    changed = scene.changed({"body.mass": 6.0})
    assert (changed["body.mass"], changed["rate"]) == (6.0, 500.0)
    assert changed["body.inertia"] == (6.5, 5.0, 2.5, 0.0, 0.0, 0.0)
    assert scene["body.mass"] == 12.0
    with pytest.raises(ValueError, match=r"body\.inertia = .* contradicts body\.shape"):
        changed.changed({"body.inertia": (1.0, 1.0, 1.0, 0.0, 0.0, 0.0)})


def test_mass_out_of_range_is_called_by_its_name():
    with pytest.raises(ValueError, match=r"parameter body\.mass = 1e\+200: mass 1e\+200 kg is not between"):
        Scene({"body.mass": 1e200})


@pytest.mark.parametrize(
    "parameter",
    [p for p in schema.TABLE if p.above is not None or p.least is not None],
    ids=lambda parameter: parameter.name,
)
def test_rule_is_told_in_words(parameter):
    bound = parameter.above if parameter.above is not None else parameter.least
    assert f"{bound:g}" in parameter.rule


values = st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.lists(st.floats(), max_size=7)


@given(st.sampled_from(list(schema.BY_NAME)), values)
def test_any_value_is_either_taken_or_refused_by_a_sentence_with_the_name(name, value):
    name = name.replace("<name>", "nozzle")
    try:
        Scene({name: value})
    except ValueError as reason:
        assert name in str(reason) or "publish_rate" in str(reason) or "frame name" in str(reason)


@given(st.text(max_size=30))
def test_any_unknown_name_gets_a_sentence(name):
    if name not in schema.BY_NAME:
        with pytest.raises(
            ValueError, match=r"is not known; (did you mean .*\?|the name .*|the parameters (of .* )?are .*)$"
        ):
            schema.find(name)


def delayed(delay):
    thruster = {"type": "thruster", "min": 0.0, "max": 1.0, "delay": delay}
    return {"publish_rate": 0.0, "actuators": {"names": ["a"], "a": thruster}}


def test_longest_delay_is_taken():
    assert Simulation.from_scene(Scene({"rate": 50.0, **delayed(2000.0)})).rate == 50.0


@pytest.mark.parametrize("group", schema.GROUPS)
def test_member_with_nothing_in_it_is_refused(group):
    with pytest.raises(ValueError, match=rf"parameter {group}\.one has nothing in it; give .*, such as {group}\.one\."):
        Scene({group: {"one": {}}})


@pytest.mark.parametrize("group", schema.GROUPS)
def test_name_with_a_dot_is_refused_as_such(group):
    last = next(name for name in schema.BY_NAME if name.startswith(f"{group}.<name>.")).split(".<name>.")[1]
    with pytest.raises(ValueError, match=r"the name 'a\.b' has a dot, .*; give 'a_b'"):
        Scene({f"{group}.a.b.{last}": 1.0})


def test_actuator_whose_name_has_a_dot_is_refused_as_such():
    with pytest.raises(ValueError, match=r"actuators\.names = \['a\.b'\]: the name 'a\.b' has a dot, .*; give 'a_b'"):
        Scene({"actuators.names": ["a.b"]})


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ({"world_frame_id": "/world"}, "begins with '/', as no name in ROS 2 does; give 'world'"),
        ({"body.frame_id": "  "}, "is empty"),
        ({"body.mass": 10**400}, "is too large"),
        ({"publish_rate": 1e-306}, "is too low for rate = 1000 Hz; give 0 .* or at least 1e-06"),
        ({"wrench.timeout": 1e306}, "at most 1e\\+09"),
        (
            {"rate": 50.0, **delayed(2000.1)},
            "parameter actuators.a.delay = 2000.1: is more than 100000 .*at most 2000$",
        ),
    ],
)
def test_extreme_value_is_refused_by_a_sentence(given, reason):
    with pytest.raises(ValueError, match=reason):
        Scene(given)


# Names that are not known ---------------------------------------------------------------------------------------------

BODY = "the parameters of body are frame_id, mass, inertia, center_of_mass, shape, dimensions, density, mesh_f"


@pytest.mark.parametrize(
    ("name", "advice"),
    [
        *(
            (name, "did you mean body.mass?")
            for name in ("body.mas", "body.maas", "body.massa", "Body.Mass", "BODY_MASS")
        ),
        *((name, "did you mean body.mass?") for name in ("bodymass", "body/mass", "mass", "bodi.mass")),
        ("gravty", "did you mean gravity?"),
        ("gravity.z", "did you mean gravity?"),  # it has no parts
        ("rates", "did you mean rate?"),
        ("realtime-factor", "did you mean real_time_factor?"),
        ("body.centre_of_mass", "did you mean body.center_of_mass?"),
        ("integrator.tol", "did you mean integrator.rtol?"),
        ("drag.Linear", "did you mean drag.linear?"),
        ("frames.arm.axis", "did you mean frames.<name>.axes?"),
        ("frame.arm.axes", "did you mean frames.<name>.axes?"),
        ("tethers.stiffness", "did you mean tethers.<name>.stiffness?"),
        # What this package does not have, though a name in its table has letters of it.
        *((f"body.{name}", BODY) for name in ("mass_matrix", "drag", "com", "volume", "center_of_gravity")),
        ("body", BODY),
        ("drag.angular", "the parameters of drag are linear, quadratic, angular_linear, angular_quadratic"),
        ("initial.velocity", "the parameters of initial are position, orientation, rpy, linear_velocity, angular_"),
        ("initial.orientation.q", "the parameters of initial.orientation are w, x, y, z"),
        ("wrench.max_thrust", "the parameters of wrench are topics, max_force, max_torque, timeout, frame"),
        ("integrator.step", "the parameters of integrator are name, rtol"),
        ("tethers.rope.length", "the parameters of tethers.rope are body_point, anchor, rest_length, stiffness, "),
        ("frames.arm", "the parameters of frames.arm are position, orientation, rpy, axes"),
        *(
            (name, "the parameters are rate, publish_rate, ")
            for name in ("gain", "timestep", "wind.velocity", "position")
        ),
    ],
)
def test_name_is_shown_another_only_where_it_misspells_it(name, advice):
    with pytest.raises(ValueError) as caught:
        schema.find(name)
    assert str(caught.value).startswith(f"parameter {name} is not known; {advice}")


ALIKE = "latitude", "altitude"  # which of the two ltitude is nobody can tell


@given(st.sampled_from([name for name in schema.BY_NAME if len(name) > 5 and not name.endswith(ALIKE)]), st.data())
def test_letter_that_is_missing_is_seen(name, data):
    """Of parts with at least five letters: of shorter ones there may be several."""
    parts = name.replace("<name>", "nozzle").split(".")
    if len(parts[-1]) >= 5:
        place = data.draw(st.integers(1, len(parts[-1]) - 1))
        parts[-1] = parts[-1][:place] + parts[-1][place + 1 :]
        with pytest.raises(ValueError, match=f"did you mean {name}\\?"):
            schema.find(".".join(parts))


# Values in messages ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "make", [tuple, list, np.array, lambda row: array("d", row)], ids=["tuple", "list", "numpy", "array"]
)
@pytest.mark.parametrize(
    ("name", "row", "shown"),
    [
        ("gravity", [0.0, -9.81], "gravity = [0.0, -9.81]: has 2"),
        ("body.inertia", [1.0, 1.0, 3.0, 0.0, 0.0, 0.0], "body.inertia = [1.0, 1.0, 3.0, 0.0, 0.0, 0.0]: "),
        ("body.center_of_mass", [1e200, 0.0, 0.0], "center_of_mass [1e+200, 0.0, 0.0] is"),
        ("drag.linear", [0.0, -1.0, 0.0], "drag.linear = [0.0, -1.0, 0.0]: is out"),
        ("wrench.topics", [1.0, 2.0], "wrench.topics = [1.0, 2.0]: 1.0 is"),
        ("body.mass", [2.0, 3.0], "body.mass = [2.0, 3.0]: [2.0, 3.0] is not a number"),
        ("rate", [2.0], "rate = [2.0]: [2.0] is not a number"),
        ("world_frame_id", [2.0], "world_frame_id = [2.0]: is not of type string"),
        ("initial.orientation", [0.0, 1.0], "initial.orientation = [0.0, 1.0]: has 2"),
    ],
)
def test_array_of_any_kind_is_shown_as_a_plain_list(make, name, row, shown):
    with pytest.raises(ValueError) as caught:
        Scene({name: make(row)})
    assert shown in str(caught.value)
