"""Commands in several frames on one topic: warned about where they take turns, and not where a controller goes over."""

import pytest

from rigid_body_sim import Scene

pytest.importorskip("rclpy")
turns = pytest.importorskip("rigid_body_sim.ros.frame_turns")

SCENE = {"rate": 100.0, "wrench.timeout": 0.1}  # 10 steps


def warnings_of(frames, age=1, **scene):
    """What is said of commands that follow each other after ``age`` steps."""
    said = []
    watch = turns.FrameTurns(Scene({**SCENE, **scene}), "wrench", said.append)
    for frame in frames:
        watch.note(frame.encode() + b"\x00", age)
    return said


@pytest.mark.parametrize(
    "frames",
    [
        "front left back right",
        "front back front back",
        "base_link world base_link world",
        "front front left left",
        "base_link base_link world",
        f"{20 * 'base_link '}world",
    ],
    ids=["rotors", "two", "body and world", "in pairs", "one twice as often", "one twenty times as often"],
)
def test_turns_are_told_once_with_the_frames(frames):
    (said,) = warnings_of(5 * frames.split())
    names = ", ".join(dict.fromkeys(frames.split()))
    assert said.startswith(f"commands on wrench come in turn in the frames {names}: each replaces the one before")


@pytest.mark.parametrize(
    "frames",
    [
        100 * ["front"],
        50 * ["front"] + 50 * ["left"] + 50 * ["front"] + 50 * ["left"],
        50 * ["", "base_link", "/base_link"],  # one frame by its names
        ["front", "left", "back"],
    ],
    ids=["one", "another now and then", "one by several names", "three commands"],
)
def test_nothing_is_said_of_a_controller_that_goes_over_to_another_frame(frames):
    assert warnings_of(frames) == []


def test_nor_of_commands_that_no_longer_act_when_the_next_comes():
    rotors = 5 * ["front", "left", "back", "right"]
    assert warnings_of(rotors, age=10) == [] != warnings_of(rotors, age=9)
    assert warnings_of(rotors, age=10**9, **{"wrench.timeout": 0.0}) != []  # held for ever
