"""A bag's commands as a schedule: a run under it has the bits of the re-simulation; what it cannot hold is refused."""

import json
import logging
import math
from dataclasses import replace

import numpy as np
import pytest
import yaml
from numpy.testing import assert_array_equal

pytest.importorskip("rosbags")

from rigid_body_sim import Scene, Simulation, State, Wrench, WrenchSchedule
from rigid_body_sim.bags.reading import read
from rigid_body_sim.bags.rosbags_support import BagError
from rigid_body_sim.resim import resimulating
from rigid_body_sim.scenarios import scenario as scenarios
from rigid_body_sim.scenarios import timing
from rigid_body_sim.scenarios.scenario import Choices

from ..bags import making
from ..resim import runs

SECONDS = 1.0
# The frame that is declared has the body's axes: those of the world's would make a force at a point.
BASE = Scene({**runs.SCENE, "frames.hook.axes": "body", "frames.hook.rpy": [0.3, -0.2, 1.1]})
LIMITED = BASE.changed({"wrench.max_force": 1.5, "wrench.max_torque": 0.7, "rate": 300.0, "publish_rate": 60.0})
FOR_EVER = BASE.changed({"wrench.timeout": 0.0})
WORLD_ONLY = BASE.changed({"integrator.name": "exact", "wrench.frame": "world"})
LOCKSTEP = BASE.changed({"lockstep": True, "steps_per_command": 7, "publish_rate": 500.0, "wrench.timeout": 0.05})


def given(scene, per_second=20.0):
    """Commands on two topics, with pauses in which the time of some runs out."""
    gusts = runs.sends(scene, SECONDS, per_second / 2.0, "/gust", seed=4, frames=("world", "base_link"))
    return runs.sends(scene, SECONDS, per_second) + gusts


def again(bag, scene, **choices):
    """What is simulated again, and how."""
    scenario = scenarios.prepare(read(bag), scene, Choices(**choices))
    return scenario, resimulating.run(scenario, scene)


def assert_same_bits(bag, scene, **choices):
    """A run under the schedule against the re-simulation, at its poses and in the state of its end; the schedule."""
    scenario, track = again(bag, scene, **choices)
    simulation, commands = Simulation.from_scene(scene), WrenchSchedule.from_bag(bag, scene, **choices)
    if scenario.start is not None:
        simulation.reset(scenario.start)
    trajectory = simulation.run(steps=track.steps, commands=commands)
    rows = timing.nearest_steps(scenario.stamp_ns - scenario.epoch_ns, scene["rate"])
    for name, part in (("position", slice(0, 3)), ("orientation", slice(3, 7)), ("angular_velocity", slice(16, 19))):
        expected = np.ascontiguousarray(track.motion[:, part])
        assert_array_equal(
            np.ascontiguousarray(getattr(trajectory, name)[rows]).view(np.int64), expected.view(np.int64)
        )
    assert resimulating.state_hash(simulation) == track.state
    assert np.ptp(track.motion, axis=0).max() > 0.1  # something moves
    return commands


# The same bits --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scene", [BASE, LIMITED, FOR_EVER], ids=["timeouts", "limits at 300 Hz", "for ever"])
def test_commands_by_their_times(tmp_path, scene):
    sends = given(scene, 8.0)
    commands = assert_same_bits(making.make(tmp_path / "bag", runs.in_real_time(scene, sends, SECONDS)), scene)
    assert (~commands.values.any(axis=1)).any() == (scene is not FOR_EVER)
    assert (len(commands) > len(sends)) == (scene is not FOR_EVER)


def test_dense_commands_whose_holds_never_end(tmp_path):
    bag = making.make(tmp_path / "bag", runs.in_real_time(BASE, runs.sends(BASE, SECONDS, 400.0), SECONDS))
    assert len(assert_same_bits(bag, BASE)) > 200


@pytest.mark.parametrize(
    "choices", [{"times": "receive"}, {"topics": "gust"}, {"topics": ["/gust", "wrench"]}], ids=str
)
def test_choices_are_those_of_the_re_simulation(tmp_path, choices):
    bag = making.make(tmp_path / "bag", runs.in_real_time(BASE, given(BASE), SECONDS, lag_ns=12_345_678))
    names = choices.get("topics", ())
    plain = {**choices, "topics": (names,) if isinstance(names, str) else tuple(names)}
    scenario, _ = again(bag, BASE, **plain)
    chosen = WrenchSchedule.from_bag(bag, BASE, **choices)
    assert_array_equal(chosen.values, assert_same_bits(bag, BASE, **plain).values)
    assert len(scenario.commands.topics) == (1 if names == "gust" else 2)


def test_raw_wrenches_by_the_times_of_receipt(tmp_path):
    sends = [replace(send, raw=True) for send in given(BASE)]
    assert_same_bits(making.make(tmp_path / "bag", runs.in_real_time(BASE, sends, SECONDS, factor=3.0)), BASE)


def test_bag_that_begins_late(tmp_path):
    """Step 0 is its first pose; what is held there is held for what is left of its time."""
    messages = runs.in_real_time(BASE, given(BASE, 60.0), SECONDS)
    late = [entry for entry in messages if entry[1] > making.EPOCH_NS + 0.405e9]
    commands = assert_same_bits(making.make(tmp_path / "bag", late), BASE)
    assert commands.steps[0] == 0 and commands.steps[-1] < 0.58 * 500


def test_hold_that_began_before_the_bag_has_what_is_left_of_its_time(tmp_path):
    """From step 200 on for 50 steps, of which the bag has 40: its first pose is at step 210."""
    sends = [runs.Send(401_000_000, "world", (1.0, 2.0, 3.0, 0.1, 0.2, 0.3))]
    late = [entry for entry in runs.in_real_time(BASE, sends, SECONDS) if entry[1] > making.EPOCH_NS + 0.4009e9]
    commands = assert_same_bits(making.make(tmp_path / "bag", late), BASE)
    assert commands.steps.tolist() == [0, 40] and not commands.values[1].any()


def test_integrator_that_takes_no_torque_leaves_out_what_the_node_does(tmp_path, caplog):
    sends = [replace(send, frame_id="world", numbers=(*send.numbers[:3], 0.0, 0.0, 0.0)) for send in given(WORLD_ONLY)]
    messages = runs.in_real_time(WORLD_ONLY, sends, SECONDS)
    bad = runs.Send(501_000_000, "base_link", (1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    messages.append(("/wrench", making.EPOCH_NS + bad.at_ns, runs.message(bad, making.EPOCH_NS)))
    bag = making.make(tmp_path / "bag", sorted(messages, key=lambda entry: entry[1]))
    assert_same_bits(bag, WORLD_ONLY)
    assert "bag: 1 command is left out, as the node does; the first: integrator 'exact' knows only" in caplog.text


def test_hold_that_ends_in_the_step_of_an_equal_command(tmp_path):
    """Where nothing turns the body: re-simulated, the closed form begins anew there; a schedule has nothing to say."""
    sends = [runs.Send(1_000_000 + 100_000_000 * k, "world", (1.0, 2.0, 19.6, 0.0, 0.0, 0.0)) for k in range(10)]
    bag = making.make(tmp_path / "bag", runs.in_real_time(BASE, sends, SECONDS))
    _, track = again(bag, BASE)
    commands = WrenchSchedule.from_bag(bag, BASE)
    assert commands.steps.tolist() == list(range(0, 500, 50))
    trajectory = Simulation.from_scene(BASE).run(steps=track.steps, every=10, commands=commands)
    assert np.abs(trajectory.position - track.motion[:, :3]).max() < 1e-15  # measured 1.7e-16
    assert np.abs(trajectory.orientation - track.motion[:, 3:7]).max() < 3e-15  # measured 5.6e-16


def test_lockstep(tmp_path):
    random, sends = np.random.default_rng(8), []
    for k in range(60):
        numbers = tuple(random.normal(size=6).tolist())
        sends.append(runs.Send(0, ("base_link", "world", "hook")[k % 3], numbers, stamp_ns=0))
        if k % 10 == 3:
            sends.append(runs.Send(0, "world", numbers, "/gust", stamp_ns=0))
        if k % 20 == 7:
            sends.append(runs.Send(0, "nowhere", numbers, stamp_ns=0))  # advances nothing
    commands = assert_same_bits(making.make(tmp_path / "bag", runs.in_lockstep(LOCKSTEP, sends)), LOCKSTEP)
    # Of the gusts, held for 25 steps, each end is a row between those of commands every 7.
    assert (commands.steps % 7 != 0).sum() == 6 and commands.steps[-1] == 59 * 7


def test_journal(tmp_path):
    clear = (503_000_000, lambda simulation: simulation.clear_wrench())
    bag = making.make(tmp_path / "bag", runs.with_journal(BASE, given(BASE), SECONDS, [clear]))
    commands = assert_same_bits(bag, BASE)
    assert not commands.values[commands.steps.tolist().index(251)].any()
    own = WrenchSchedule.from_bag(bag)  # the scene is in it
    assert_array_equal(own.steps, commands.steps)
    assert_array_equal(own.values, commands.values)


def test_what_a_journal_has_after_the_last_pose_is_not_known_to_the_re_simulation(tmp_path):
    """Here an impulse, which would be refused before it."""
    messages = runs.with_journal(BASE, given(BASE), SECONDS, [(999_000_000, struck)])
    last = [i for i, entry in enumerate(messages) if entry[0] == "/pose"][-2]
    assert_same_bits(
        making.make(tmp_path / "bag", [e for i, e in enumerate(messages) if i <= last or e[0] != "/pose"]), BASE
    )


# What is in the rows --------------------------------------------------------------------------------------------------


def schedule(folder, scene, *sends):
    return WrenchSchedule.from_bag(making.make(folder / "bag", runs.in_real_time(scene, list(sends), SECONDS)), scene)


def test_end_of_a_hold_is_a_row_of_zeros(tmp_path):
    """0.1 s at 500 Hz are 50 steps."""
    commands = schedule(
        tmp_path,
        BASE,
        runs.Send(21_000_000, "base_link", (1, 2, 3, 4, 5, 6)),
        runs.Send(221_000_000, "world", (7,) * 6),
    )
    assert commands.steps.tolist() == [10, 60, 110, 160]
    assert commands.wrench(0) == Wrench((1, 2, 3), (4, 5, 6)) and commands.wrench(2).torque_world.tolist() == [7, 7, 7]
    assert commands.wrench(1) == commands.wrench(3) == Wrench()


def test_hold_that_would_end_after_the_last_pose_does_not_end(tmp_path):
    commands = schedule(tmp_path, BASE, runs.Send(951_000_000, "base_link", (1, 2, 3, 4, 5, 6)))
    assert commands.steps.tolist() == [475]


def test_several_topics_are_sums_to_the_bit(tmp_path):
    """math.fsum's: 0.1 + 0.2 + 0.3 is one digit less than what a sum from the left makes."""
    scene = BASE.changed({"wrench.topics": ["wrench", "gust", "wind"]})
    sends = [
        runs.Send(21_000_000 + 2_000_000 * k, "base_link", (value, 0, 0, 0, 0, 0), topic)
        for k, (topic, value) in enumerate([("/wrench", 0.1), ("/gust", 0.2), ("/wind", 0.3)])
    ]
    commands = schedule(tmp_path, scene, *sends)
    assert commands.steps.tolist() == [10, 11, 12, 60, 61, 62]
    sums = [0.1, math.fsum([0.1, 0.2]), math.fsum([0.1, 0.2, 0.3]), 0.5, 0.3, 0.0]
    assert commands.values[:, 0].tolist() == sums and sums[2] != 0.1 + 0.2 + 0.3


def test_empty_frame_is_the_scenes(tmp_path):
    send = runs.Send(21_000_000, "", (1, 2, 3, 4, 5, 6))
    rows = {"body": Wrench((1, 2, 3), (4, 5, 6)), "world": Wrench(force_world=(1, 2, 3), torque_world=(4, 5, 6))}
    for frame, row in rows.items():
        (tmp_path / frame).mkdir()
        assert schedule(tmp_path / frame, BASE.changed({"wrench.frame": frame}), send).wrench(0) == row


def test_scene_may_be_a_parameter_file_or_the_defaults(tmp_path, caplog):
    bag = making.make(tmp_path / "bag", runs.in_real_time(BASE, [runs.Send(21_000_000, "", (1,) * 6)], SECONDS))
    path = tmp_path / "scene.yaml"
    path.write_text(yaml.safe_dump({"/**": {"ros__parameters": {**runs.SCENE, "wrench.frame": "world"}}}))
    assert WrenchSchedule.from_bag(str(bag), path).wrench(0) == Wrench(force_world=(1,) * 3, torque_world=(1,) * 3)
    assert not caplog.records
    by_default = WrenchSchedule.from_bag(bag, start="scene")  # 1000 Hz, 0.5 s, body axes
    assert "bag: has no journal with a scene, and none is given: the node's defaults are taken" in caplog.text
    assert by_default.steps.tolist() == [21, 521] and by_default.wrench(0) == Wrench((1,) * 3, (1,) * 3)


def test_bag_without_commands_is_an_empty_schedule(tmp_path):
    assert len(schedule(tmp_path, BASE)) == 0


def test_how_it_was_understood_is_logged(tmp_path, caplog):
    with caplog.at_level(logging.INFO, "rigid_body_sim"):
        schedule(tmp_path, BASE, runs.Send(21_000_000, "base_link", (1,) * 6))
    assert "bag: Commands on /wrench take effect at the stamps in their headers." in caplog.text


# What is refused ------------------------------------------------------------------------------------------------------


def struck(simulation):
    simulation.apply_impulse(Wrench(force_world=(1.0, 0.0, 0.0)))


INSTEAD = (
    "simulate the bag with rigid_body_resim, or give it to a Simulation.from_scene(scene) when that is at this step"
)
POINT = (
    "bag: the command on /wrench for step 110 (0.22 s) is a force at a point, which keeps its direction while the "
    f"point turns with the body; a schedule takes none: {INSTEAD}"
)


@pytest.mark.parametrize("made", [runs.in_real_time, runs.with_journal], ids=["by times", "by the journal"])
def test_forces_at_points(tmp_path, made):
    """The first of them is named, of several."""
    scene = BASE.changed({"frames.hook.axes": "world"})
    sends = [runs.Send(21_000_000 + 200_000_000 * k, "hook" if k else "base_link", (1,) * 6) for k in range(4)]
    bag = making.make(tmp_path / "bag", made(scene, sends, SECONDS))
    with pytest.raises(BagError) as caught:
        WrenchSchedule.from_bag(bag, scene)
    assert str(caught.value) == f"{tmp_path}/{POINT}"


def test_body_that_waited_for_its_first_command_is_told_of(tmp_path, caplog):
    """The schedule begins there, and a run does not wait."""
    scene = BASE.changed({"start_on_command": True})
    sends = [send for send in given(scene) if send.at_ns > 300_000_000]
    bag = making.make(tmp_path / "bag", runs.with_journal(scene, sends, SECONDS))
    with caplog.at_level(logging.WARNING, "rigid_body_sim"):
        first = int(WrenchSchedule.from_bag(bag).steps[0])
    (record,) = caplog.records
    assert first >= 150 and f"until its first command, at step {first}, the body stayed" in record.getMessage()


def test_commands_to_actuators(tmp_path):
    scene = BASE.changed({"actuators": {"names": ["jet"], "jet": {"type": "thruster", "min": 0.0, "max": 1.0}}})
    sends = [runs.Send(21_000_000, "", (0.5,), "/actuator_commands")]
    bag = making.make(tmp_path / "bag", runs.in_real_time(scene, sends, SECONDS))
    with pytest.raises(BagError) as caught:
        WrenchSchedule.from_bag(bag, scene)
    said = f"{bag}: for step 10 (0.02 s) it has a command to actuators, which a schedule does not hold: {INSTEAD}"
    assert str(caught.value) == said


@pytest.mark.parametrize(
    ("call", "what"),
    [
        (struck, "an impulse"),
        (lambda simulation: simulation.set_actuators([]), "a command to actuators"),
        (lambda simulation: simulation.set_state(State()), "a state that was set"),
        (lambda simulation: simulation.change(gravity=(0, 0, -1)), "a change of parameters"),
        (lambda simulation: simulation.reset(), "a reset"),
        (lambda simulation: simulation.restart_time(), "a reset of the time"),
    ],
    ids=["impulse", "actuators", "state", "change", "reset", "time"],
)
def test_other_calls_of_a_journal(tmp_path, call, what):
    bag = making.make(tmp_path / "bag", runs.with_journal(BASE, given(BASE), SECONDS, [(301_000_000, call)]))
    with pytest.raises(BagError) as caught:
        WrenchSchedule.from_bag(bag)
    said = f"{bag}: at step 150 of the journal is {what}, which a schedule does not hold: {INSTEAD}"
    assert str(caught.value) == said


def spoilt(entry, **values):
    """The same entry of a journal with other values."""
    topic, receive_ns, message = entry
    return topic, receive_ns, making.text(json.dumps({**json.loads(message.data), **values}))


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"call": "lost"}, r"^the journal has a hole after step \d+, where the recorder's buffer was full"),
        ({"step": 0}, r"bag: set_wrench at step 0 of the journal lies before step \d+, which it had reached$"),
        ({"hold": -1.0}, r"bag: set_wrench at step \d+ of the journal cannot be repeated: hold -1 s is not a time"),
        ({"wrench": {"force": [1]}}, r"bag: set_wrench at step \d+ of the journal cannot be repeated: TypeError: "),
    ],
)
def test_journal_that_cannot_be_followed(tmp_path, values, sentence):
    messages = runs.with_journal(BASE, given(BASE), SECONDS)
    place = [i for i, entry in enumerate(messages) if entry[0] == "/node/journal"][5]
    messages[place] = spoilt(messages[place], **values)
    with pytest.raises(BagError, match=sentence):
        WrenchSchedule.from_bag(making.make(tmp_path / "bag", messages))


@pytest.mark.parametrize("choices", [{"topics": "wrench"}, {"times": "header"}, {"start": "scene"}], ids=str)
def test_choices_that_a_journal_makes(tmp_path, choices):
    bag = making.make(tmp_path / "bag", runs.with_journal(BASE, given(BASE), SECONDS))
    with pytest.raises(BagError, match=r"bag: has a journal, which tells .*; leave topics, times and start out$"):
        WrenchSchedule.from_bag(bag, **choices)


def test_scene_of_another_rate_than_the_journals(tmp_path):
    bag = making.make(tmp_path / "bag", runs.with_journal(BASE, given(BASE), SECONDS))
    with pytest.raises(BagError, match=r"journal are those of 500 Hz, but the scene has 300 Hz; give a scene with the"):
        WrenchSchedule.from_bag(bag, LIMITED)


def test_sum_that_is_too_large_where_a_hold_ends(tmp_path):
    """What ended kept it small: the re-simulation stops there, too."""
    scene = BASE.changed({"wrench.topics": ["wrench", "gust", "wind"]})
    sends = [
        runs.Send(21_000_000 + 2_000_000 * k, "world", (value, 0, 0, 0, 0, 0), topic)
        for k, (topic, value) in enumerate([("/wrench", -1.7e308), ("/gust", 1e308), ("/wind", 1e308)])
    ]
    messages = [(s.topic, making.EPOCH_NS + s.at_ns, runs.message(s, making.EPOCH_NS)) for s in sends]
    messages += runs.in_real_time(BASE, [], SECONDS)
    bag = making.make(tmp_path / "bag", sorted(messages, key=lambda entry: entry[1]))
    with pytest.raises(BagError, match=r"bag: at step 60 \(0\.12 s\) the time of one of several .* and the wrenches"):
        WrenchSchedule.from_bag(bag, scene)


def test_none_of_the_commands_can_be_used(tmp_path):
    bag = making.make(tmp_path / "bag", runs.in_real_time(BASE, [runs.Send(21_000_000, "world", (1,) * 6)], SECONDS))
    scene = BASE.changed({"integrator.name": "exact"})
    with pytest.raises(BagError, match="none of the 1 commands can be used: integrator 'exact' knows only"):
        WrenchSchedule.from_bag(bag, scene)


@pytest.mark.parametrize(
    ("path", "scene", "options", "error", "sentence"),
    [
        ("nowhere", None, {}, BagError, "nowhere: does not exist; give the folder of a bag"),
        ("bag", "nowhere.yaml", {}, ValueError, r"scene nowhere\.yaml: cannot be read \(No such file or directory\); "),
        ("bag", None, {"times": "now"}, ValueError, "times='now' is not known; give 'header', 'receive' or None"),
        ("bag", None, {"start": "end"}, ValueError, "start='end' is not known; give 'scene', 'bag' or None"),
        ("bag", None, {"topics": ["pose"]}, BagError, "topic /pose is of type geometry_msgs/msg/PoseStamped; give one"),
    ],
)
def test_what_is_not_there(tmp_path, monkeypatch, path, scene, options, error, sentence):
    making.make(tmp_path / "bag", runs.in_real_time(BASE, [], 0.1))
    monkeypatch.chdir(tmp_path)
    with pytest.raises(error, match=sentence):
        WrenchSchedule.from_bag(path, scene, **options)
