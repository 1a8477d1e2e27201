"""Attitudes among parameters: named parts or angles, in one way, whole; four numbers in a row are refused."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigid_body_sim import Scene
from rigid_body_sim.scene import attitude, schema
from rigid_body_sim.values import rotation

pytestmark = pytest.mark.no_numba

PREFIXES = ("initial", "frames.nozzle")
over_both = pytest.mark.parametrize("prefix", PREFIXES)


def held(scene, prefix):
    return attitude.quaternion(scene.values, prefix)


@over_both
def test_parts_are_taken_by_their_names_whatever_their_order(prefix):
    nested = Scene({f"{prefix}.orientation": {"z": 0.5, "y": -0.1, "x": 0.3, "w": 0.8}})
    dotted = Scene({f"{prefix}.orientation.{part}": v for part, v in zip("xyzw", (0.3, -0.1, 0.5, 0.8), strict=True)})
    assert held(nested, prefix) == held(dotted, prefix) == (0.8, 0.3, -0.1, 0.5)


@over_both
def test_none_given_is_no_turn(prefix):
    assert held(Scene({"frames.nozzle.axes": "body"}), prefix) == (1.0, 0.0, 0.0, 0.0)


@over_both
@pytest.mark.parametrize(
    ("rpy", "point", "image"),
    [
        ((math.pi / 2, 0, 0), (0, 1, 0), (0, 0, 1)),
        ((0, math.pi / 2, 0), (0, 0, 1), (1, 0, 0)),
        ((0, 0, math.pi / 2), (1, 0, 0), (0, 1, 0)),
        ((math.pi / 2, 0, math.pi / 2), (0, 1, 0), (0, 0, 1)),  # about the fixed axes: x first, then z
        ((math.pi / 2, 0, math.pi / 2), (1, 0, 0), (0, 1, 0)),
    ],
)
def test_angles_turn_about_fixed_axes_x_first_as_in_urdf(prefix, rpy, point, image):
    q = held(Scene({f"{prefix}.rpy": rpy}), prefix)
    assert rotation.rotate(q, point) == pytest.approx(image, abs=1e-15)  # measured 2.2e-16


def test_angles_are_of_the_body_and_of_the_frame_in_it():
    scene = Scene({"initial.rpy": [0.1, -0.2, 0.3], "frames.nozzle.rpy": [0.4, 0.5, -0.6]})
    wanted = rotation.from_roll_pitch_yaw(0.1, -0.2, 0.3), rotation.from_roll_pitch_yaw(0.4, 0.5, -0.6)
    assert scene.initial_state().orientation == pytest.approx(wanted[0], abs=1e-15)  # measured 0
    assert scene.frames["nozzle"].orientation == pytest.approx(wanted[1], abs=1e-15)  # measured 0


@over_both
def test_what_a_scene_holds_can_be_given_to_another_one(prefix):
    scene = Scene({f"{prefix}.rpy": [0.1, -0.2, 0.3]})
    assert scene[f"{prefix}.rpy"] == ()
    again = Scene(scene.values)
    assert again.values == scene.values


ROWS = {  # what is given in place of an attitude, and what the sentence must say
    "x last": (
        [0, 0, 0, 1],
        "as x, y, z, w that is {w: 1, x: 0, y: 0, z: 0}; as w, x, y, z it is {w: 0, x: 0, y: 0, z: 1}",
    ),
    "w first": (
        (0.8, 0.6, 0.1, -0.5),
        "that is {w: -0.5, x: 0.8, y: 0.6, z: 0.1}; as w, x, y, z it is {w: 0.8, x: 0.6, y: 0.1, z: -0.5}",
    ),
    "the same in both": ([0.5] * 4, "as w, x, y, z it is {w: 0.5, x: 0.5, y: 0.5, z: 0.5}"),
    "array": (np.array([0.0, 0.0, 0.0, 1.0]), "as x, y, z, w that is {w: 1.0, x: 0.0, y: 0.0, z: 0.0}; "),
    "three": ([0.0, 0.0, 1.57], "has 3 entries, and an attitude has named parts; write "),
    "five": ([0.0] * 5, "has 5 entries"),
    "empty": ([], "has 0 entries"),
    "matrix": (np.eye(3), "has 3 entries"),
    "number": (1.0, "1.0: is no attitude; write "),
    "text": ("identity", "'identity': is no attitude"),
    "nothing": (None, "is no attitude"),
}


@over_both
@pytest.mark.parametrize(("value", "said"), ROWS.values(), ids=ROWS)
def test_row_of_numbers_is_refused_with_what_it_could_mean(prefix, value, said):
    with pytest.raises(ValueError) as caught:
        Scene({f"{prefix}.orientation": value})
    text = str(caught.value)
    assert text.startswith(f"parameter {prefix}.orientation = ") and said in text
    assert f"{prefix}.rpy: [roll, pitch, yaw]" in text and f"write {prefix}.orientation: " in text


def test_the_two_readings_are_the_two_orders():
    q = [0.1, 0.2, 0.3, 0.4]
    with pytest.raises(ValueError) as caught:
        Scene({"initial.orientation": q})
    last, first = (part.split("}")[0] for part in str(caught.value).split("{")[1:3])
    assert dict(part.split(": ") for part in last.split(", ")) == {"x": "0.1", "y": "0.2", "z": "0.3", "w": "0.4"}
    assert dict(part.split(": ") for part in first.split(", ")) == {"w": "0.1", "x": "0.2", "y": "0.3", "z": "0.4"}


@over_both
@pytest.mark.parametrize("missing", ["w", "z", "wx", "xyz", "wyz"])
def test_part_that_is_missing_is_named_and_not_guessed(prefix, missing):
    parts = {part: 0.5 for part in "wxyz" if part not in missing}
    with pytest.raises(ValueError) as caught:
        Scene({f"{prefix}.orientation": parts})
    names = ", ".join(f"{prefix}.orientation.{part}" for part in missing)
    first = f"{prefix}.orientation.{next(iter(parts))}"
    assert f"parameter {first} is given without {names}; give all four parts, such as {{w: 1.0, " in str(caught.value)


@over_both
@pytest.mark.parametrize("parts", [schema.PARTS, {"w": 1.0}, {"x": 0.1, "y": 0.2}])
def test_attitude_in_two_ways_is_refused_even_where_they_agree(prefix, parts):
    with pytest.raises(
        ValueError, match=r"orientation\.\w and .*\.rpy are given; an attitude is given once: leave one"
    ):
        Scene({f"{prefix}.orientation": parts, f"{prefix}.rpy": [0.0, 0.0, 0.0]})


@pytest.mark.parametrize(
    "name",
    [
        *("orientation.rpy", "orientation.roll", "orientation.pitch", "orientation.yaw"),
        *("rpy.roll", "rpy.pitch", "rpy.yaw", "roll", "pitch", "yaw", "orientation.rpy.yaw"),
    ],
)
@pytest.mark.parametrize(("prefix", "known"), [("initial", "initial"), ("frames.nozzle", "frames.<name>")])
def test_angles_in_the_wrong_place_are_shown_the_right_one(prefix, known, name):
    with pytest.raises(ValueError, match=rf"parameter {prefix}\.{name} is not known; did you mean {known}\.rpy\?"):
        Scene({f"{prefix}.{name}": 0.1})


@pytest.mark.parametrize(("name", "meant"), [("W", "w"), ("_x", "x"), ("Z", "z")])
def test_misspelt_part_is_shown_the_right_one(name, meant):
    with pytest.raises(ValueError, match=rf"did you mean initial\.orientation\.{meant}\?"):
        Scene({f"initial.orientation.{name}": 0.1})


BAD = {
    "zero": ({"orientation": dict.fromkeys("wxyz", 0)}, "orientation: quaternion .* norm"),
    "part that is no number": ({"orientation": {**schema.PARTS, "w": "1"}}, r"orientation\.w = '1': '1' is not a num"),
    "part that is not finite": ({"orientation": {**schema.PARTS, "x": math.nan}}, r"orientation\.x = nan: is not fin"),
    "part that is a row": ({"orientation": {**schema.PARTS, "x": [1.0]}}, r"orientation\.x = \[1\.0\]: .*not a number"),
    "two angles": ({"rpy": [0.0, 1.0]}, r"rpy = \[0\.0, 1\.0\]: has 2 entries; give 3"),
    "a quaternion for angles": ({"rpy": [0.0, 0.0, 0.0, 1.0]}, "rpy .* has 4 entries; give 3"),
    "one angle": ({"rpy": 1.57}, r"rpy = 1\.57: is not an array; give 3 numbers"),
    "angle that is not finite": ({"rpy": [0.0, math.inf, 0.0]}, "rpy .* is not finite"),
}


@over_both
@pytest.mark.parametrize(("values", "said"), BAD.values(), ids=BAD)
def test_bad_number_is_refused_by_the_name_of_its_part(prefix, values, said):
    with pytest.raises(ValueError, match=rf"parameter {prefix}\.{said}"):
        Scene({f"{prefix}.{name}": value for name, value in values.items()})


# Changed scenes -------------------------------------------------------------------------------------------------------


@over_both
def test_changed_part_keeps_the_others(prefix):
    for start in ({"orientation": {"w": 0.1, "x": 0.2, "y": 0.3, "z": 0.4}}, {"rpy": [0.1, 0.2, 0.3]}):
        scene = Scene({f"{prefix}.{name}": value for name, value in start.items()})
        w, x, _, z = held(scene, prefix)
        assert held(scene.changed({f"{prefix}.orientation.y": 0.7}), prefix) == (w, x, 0.7, z)


@over_both
def test_changed_angles_take_the_place_of_a_quaternion(prefix):
    scene = Scene({f"{prefix}.orientation": {"w": 0.1, "x": 0.2, "y": 0.3, "z": 0.4}, "body.mass": 3.0})
    changed = scene.changed({f"{prefix}.rpy": [0.0, 0.0, math.pi]})
    assert held(changed, prefix) == pytest.approx((0, 0, 0, 1), abs=1e-15)  # measured 6.1e-17
    assert changed["body.mass"] == 3.0
    assert held(changed.changed({"body.mass": 2.0}), prefix) == held(changed, prefix)
    with pytest.raises(ValueError, match="an attitude is given once"):
        scene.changed({f"{prefix}.rpy": [0.0, 0.0, 1.0], f"{prefix}.orientation.w": 1.0})


# Another table, such as the pointing controller's ---------------------------------------------------------------------

TARGET = {parameter.name: parameter for parameter in schema.attitude("target", "to hold")}


def test_rows_of_an_attitude_make_a_table_of_their_own():
    values = attitude.read({"target.rpy": [0, 0, math.pi / 2]}, TARGET)
    assert attitude.quaternion(values, "target") == pytest.approx((math.sqrt(0.5), 0, 0, math.sqrt(0.5)), abs=1e-15)
    with pytest.raises(ValueError, match=r"target = \[1\.0, 0\.0, 0\.0, 0\.0\]: .*write target\.orientation: with the"):
        attitude.read({"target": [1.0, 0.0, 0.0, 0.0]}, TARGET)


numbers = st.floats(-10, 10) | st.integers(-2, 2)


@given(st.dictionaries(st.sampled_from("wxyz"), numbers), st.none() | st.lists(numbers, min_size=3, max_size=3))
def test_any_attitude_is_one_whole_one_or_refused(parts, angles):
    """A turn of the length one, the very numbers that were given, or a sentence."""
    given_values = {"initial.orientation": parts, **({} if angles is None else {"initial.rpy": angles})}
    whole = (len(parts) == 4 and angles is None) or not parts
    try:
        scene = Scene(given_values)
    except ValueError as reason:
        assert not whole or (parts and math.hypot(*parts.values()) < 1e-6), reason
        return
    assert whole
    q = held(scene, "initial")
    assert math.isclose(np.linalg.norm(scene.initial_state().orientation), 1.0, abs_tol=1e-15)
    assert q == tuple(parts[part] for part in "wxyz") if parts else math.isclose(math.hypot(*q), 1.0, abs_tol=1e-15)
