"""Runs known to the bit are simulated again from their bags: to the bit where the bag has all that decides them."""

import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

pytest.importorskip("rosbags")

from rigid_body_sim import Body, Scene, SimulationError, State, Wrench
from rigid_body_sim.bags.reading import read
from rigid_body_sim.bags.rosbags_support import BagError
from rigid_body_sim.resim import resimulating
from rigid_body_sim.resim.comparison import Comparison
from rigid_body_sim.scenarios import scenario as scenarios
from rigid_body_sim.scenarios import timing
from rigid_body_sim.scenarios.scenario import BAG, SCENE, Choices

from ..bags import making
from . import runs

BASE = Scene(runs.SCENE)
SECONDS = 2.0


def again(folder, messages, scene=BASE, storage="mcap", **choices):
    """The comparison with what was recorded, the scenario and the track."""
    recording = read(making.make(folder / "bag", messages, storage))
    scenario = scenarios.prepare(recording, scene, Choices(**choices))
    track = resimulating.run(scenario, scene)
    return Comparison(scenario.stamp_ns, scenario.recorded, track.poses), scenario, track


def said(scenario):
    return " ".join(scenario.notes)


def assert_equal_to_the_bit(comparison, count=None):
    assert comparison.first_unequal is None
    assert len(comparison.recorded) == (count or int(SECONDS * BASE["publish_rate"]) + 1)
    assert np.abs(np.diff(comparison.recorded, axis=0)).max() > 1e-3  # something moves


# By times ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("storage", ("mcap", "sqlite3"))
def test_stamps_in_headers_on_the_clock_of_the_poses(tmp_path, storage):
    """As from controllers that use the time of /clock: the recorder's clock says something else."""
    messages = runs.in_real_time(BASE, runs.sends(BASE, SECONDS), SECONDS, factor=3.0, lag_ns=10**12)
    comparison, scenario, track = again(tmp_path, messages, storage=storage)
    assert_equal_to_the_bit(comparison)
    assert "Commands on /wrench take effect at the stamps in their headers." in said(scenario)
    assert "Starts from the scene's initial state" in said(scenario)
    assert track.refused == 0 and track.steps == 1000


@pytest.mark.parametrize("factor", (1.0, 0.3, 20.0))
@pytest.mark.parametrize("lag_ns", (0, 123_456_789))
def test_times_of_receipt(tmp_path, factor, lag_ns):
    """Of raw wrenches, which have no other; the node's simulated time begins late and has a pace of its own."""
    given = [replace(send, raw=True) for send in runs.sends(BASE, SECONDS)]
    messages = runs.in_real_time(BASE, given, SECONDS, factor=factor, lag_ns=lag_ns)
    comparison, scenario, _ = again(tmp_path, messages)
    assert_equal_to_the_bit(comparison)
    assert "take effect at the times of receipt (not every header has a stamp)" in said(scenario)


def test_headers_without_stamps_count_as_none(tmp_path):
    given = [replace(send, stamp_ns=0) for send in runs.sends(BASE, SECONDS)]
    comparison, scenario, _ = again(tmp_path, runs.in_real_time(BASE, given, SECONDS, lag_ns=10**8))
    assert_equal_to_the_bit(comparison)
    assert "take effect at the times of receipt" in said(scenario)


def test_stamps_of_the_recorders_clock_are_carried_over(tmp_path):
    """The node's simulated time began 0.15 s after its epoch, so the same moment has two times."""
    lag_ns = 150_000_000
    given = runs.sends(BASE, SECONDS)
    given = [replace(send, stamp_ns=making.EPOCH_NS + lag_ns + send.at_ns) for send in given]
    comparison, scenario, _ = again(tmp_path, runs.in_real_time(BASE, given, SECONDS, lag_ns=lag_ns))
    assert_equal_to_the_bit(comparison)
    assert "the stamps in their headers, which are wall-clock time, not simulated time" in said(scenario)


def test_answers_that_carry_the_stamp_of_their_pose(tmp_path):
    """That is not when they reach the node, which is some steps later."""
    random, poses_ns = np.random.default_rng(5), 20_000_000 * np.arange(100)
    given = [
        runs.Send(
            stamp_ns + 1_000_000 + 2_000_000 * int(random.integers(5)),
            "base_link",
            tuple(random.normal(size=6).tolist()),
            stamp_ns=making.EPOCH_NS + stamp_ns,
        )
        for stamp_ns in poses_ns.tolist()
    ]
    comparison, scenario, _ = again(tmp_path, runs.in_real_time(BASE, given, SECONDS, lag_ns=4 * 10**8))
    assert_equal_to_the_bit(comparison)
    assert "the times of receipt (their headers repeat the stamps of the poses they answer)" in said(scenario)


def test_stamps_of_another_day_count_as_none(tmp_path):
    given = [replace(send, stamp_ns=making.EPOCH_NS + send.at_ns + 86400 * 10**9) for send in runs.sends(BASE, SECONDS)]
    messages = runs.in_real_time(BASE, given, SECONDS)
    comparison, scenario, _ = again(tmp_path, messages)
    assert_equal_to_the_bit(comparison)
    assert "the times of receipt (the stamps in their headers are of another time)" in said(scenario)


def test_what_is_asked_for_decides(tmp_path):
    given = [replace(send, stamp_ns=making.EPOCH_NS + send.at_ns + 40_000_000) for send in runs.sends(BASE, SECONDS)]
    messages = runs.in_real_time(BASE, given, SECONDS)
    comparison, _, _ = again(tmp_path, messages, times=timing.HEADER)
    assert comparison.first_unequal is not None
    (tmp_path / "other").mkdir()
    assert_equal_to_the_bit(again(tmp_path / "other", messages, times=timing.RECEIVE)[0])


def test_rate_whose_period_is_no_whole_number_of_nanoseconds(tmp_path):
    scene = BASE.changed({"rate": 300.0, "publish_rate": 60.0})
    messages = runs.in_real_time(scene, runs.sends(scene, 30.0), 30.0)
    assert_equal_to_the_bit(again(tmp_path, messages, scene)[0], 1801)


def test_several_topics_add_up_and_limits_hold(tmp_path):
    scene = BASE.changed({"wrench.max_force": 1.5, "wrench.max_torque": 0.7, "twist_frame": "world"})
    given = runs.sends(scene, SECONDS) + runs.sends(scene, SECONDS, 20.0, "/gust", seed=4, frames=("world",))
    comparison, scenario, _ = again(tmp_path, runs.in_real_time(scene, given, SECONDS), scene)
    assert_equal_to_the_bit(comparison)
    assert scenario.commands.topics == ("/wrench", "/gust")


def test_commands_that_are_refused_are_left_out(tmp_path):
    given = runs.sends(BASE, SECONDS)
    messages = runs.in_real_time(BASE, given, SECONDS)
    bad = [
        runs.Send(501_000_000, "base_link", (np.nan, 0, 0, 0, 0, 0)),
        runs.Send(701_000_000, "map", (9.0, 0, 0, 0, 0, 0)),
    ]
    messages += [("/wrench", making.EPOCH_NS + send.at_ns, runs.message(send, making.EPOCH_NS)) for send in bad]
    comparison, _, track = again(tmp_path, sorted(messages, key=lambda entry: entry[1]))
    assert_equal_to_the_bit(comparison)
    assert track.refused == 2 and "nan" in track.reason


def test_none_of_the_commands_can_be_used(tmp_path):
    messages = runs.in_real_time(BASE, runs.sends(BASE, SECONDS), SECONDS)
    with pytest.raises(
        BagError, match=r"none of the \d+ commands can be used: wrench in frame 'base_link' refused: send"
    ):
        scene = BASE.changed({"body.frame_id": "rocket", "world_frame_id": "world", "frames.hook.axes": "world"})
        only = [entry for entry in messages if entry[0] != "/wrench" or entry[2].header.frame_id == "base_link"]
        again(tmp_path, only, scene, start=SCENE)


# What is odd in a bag ---------------------------------------------------------------------------------------------


def test_poses_missing_repeated_and_out_of_order(tmp_path):
    messages = runs.in_real_time(BASE, runs.sends(BASE, SECONDS), SECONDS)
    at = [i for i, entry in enumerate(messages) if entry[0] == "/pose"]
    messages[at[10]], messages[at[11]] = (
        (*messages[at[10]][:2], messages[at[11]][2]),
        (*messages[at[11]][:2], messages[at[10]][2]),
    )
    messages = [entry for i, entry in enumerate(messages) if i not in at[40:46]]
    messages.insert(at[20], messages[at[20]])
    comparison, scenario, _ = again(tmp_path, messages)
    left = sum(entry[0] == "/pose" for entry in messages) - 1
    assert_equal_to_the_bit(comparison, left)
    assert "Stamps of /pose: 1 out of order (put in order), 1 with the time of another" in said(scenario)
    assert "1 gap of more than 0.03 s, the longest" in said(scenario)


def test_a_single_pose_that_is_lost_is_a_gap(tmp_path):
    messages = runs.in_real_time(BASE, runs.sends(BASE, SECONDS), SECONDS)
    del messages[[i for i, entry in enumerate(messages) if entry[0] == "/pose"][30]]
    assert "Stamps of /pose: 1 gap of more than 0.03 s, the longest 0.04 s at 0.58 s." in said(
        again(tmp_path, messages)[1]
    )


def test_commands_out_of_order_are_put_in_order(tmp_path):
    messages = runs.in_real_time(BASE, runs.sends(BASE, SECONDS), SECONDS, lag_ns=10**11)
    at = [i for i, entry in enumerate(messages) if entry[0] == "/wrench"]
    first, second = messages[at[30]], messages[at[31]]
    messages[at[30]], messages[at[31]] = (*first[:2], second[2]), (*second[:2], first[2])
    comparison, scenario, _ = again(tmp_path, messages)
    assert_equal_to_the_bit(comparison)
    assert "Times of /wrench: 1 out of order" in said(scenario)


def test_poses_between_two_steps_are_compared_at_the_nearest(tmp_path):
    """As of a camera with a clock of its own."""
    messages = runs.in_real_time(BASE, runs.sends(BASE, SECONDS), SECONDS)
    moved = []
    for i, (topic, receive_ns, message) in enumerate(messages):
        if topic == "/pose" and i > 5:
            message = making.pose_stamped(making.EPOCH_NS + i * 10_100_000, "world", range(7))
        moved.append((topic, receive_ns, message))
    comparison, scenario, track = again(tmp_path, moved, times=timing.HEADER)
    assert "poses lie between two steps, by up to 0.00" in said(scenario)
    last = round((scenario.stamp_ns[-1] - scenario.epoch_ns) * 5e-7)
    assert track.steps == last and len(comparison.recorded) == 101


def test_time_that_was_set_back_is_refused(tmp_path):
    first = runs.in_real_time(BASE, runs.sends(BASE, SECONDS), SECONDS)
    later = [(topic, receive_ns + 3 * 10**9, message) for topic, receive_ns, message in first]
    with pytest.raises(
        BagError, match=r"bag: the stamps of /pose go backwards by 2 s at message 102: time was set back"
    ):
        again(tmp_path, first + later)


def test_bag_that_begins_late(tmp_path):
    messages = [
        entry
        for entry in runs.in_real_time(BASE, runs.sends(BASE, SECONDS), SECONDS)
        if entry[1] > making.EPOCH_NS + 0.605e9
    ]
    comparison, scenario, _ = again(tmp_path, messages)
    assert "the bag begins after the scene's initial state" in said(scenario)
    assert "Starts from the recorded pose and twist stamped 1700000000.620000000 s" in said(scenario)
    assert len(comparison.recorded) == 70
    # The command held at its first pose is in it, and held for what is left of its time.
    assert comparison.position_error.max() < 1e-13  # measured 3.9e-15
    assert comparison.attitude_error.max() < 1e-13  # measured 4.2e-16


def test_bag_that_begins_late_is_followed_to_round_off(tmp_path):
    """Where the wrench held at its beginning is in it: it came between the last pose that is not, and the first."""
    given = [send for send in runs.sends(BASE, SECONDS) if not 0.4e9 < send.at_ns < 0.601e9]
    given.append(runs.Send(605_000_000, "world", (1.0, 2.0, 3.0, 0.1, 0.2, 0.3)))
    messages = [e for e in runs.in_real_time(BASE, given, SECONDS) if e[1] > making.EPOCH_NS + 0.604e9]
    for scene in (BASE, BASE.changed({"twist_frame": "world"})):
        (tmp_path / scene["twist_frame"]).mkdir()
        comparison, _, _ = again(tmp_path / scene["twist_frame"], messages, scene)
        assert comparison.position_error.max() < 1e-13  # measured 3.7e-15
        assert comparison.attitude_error.max() < 1e-13  # measured 6.1e-16


@pytest.mark.parametrize("timeout", [0.0519, 0.052, 0.0219, 0.0001])
def test_late_beginning_keeps_what_is_left_of_a_timeout_in_whole_steps(tmp_path, timeout):
    """25, 26, 10 and 1 steps of 2 ms from step 300 on, of which the bag has those from step 310, and its command."""
    scene = BASE.changed({"wrench.timeout": timeout})
    given = [runs.Send(601_000_000, "world", (1.0, 2.0, 3.0, 0.1, 0.2, 0.3))]
    messages = [e for e in runs.in_real_time(scene, given, SECONDS) if e[1] > making.EPOCH_NS + 0.6009e9]
    comparison, _, _ = again(tmp_path, messages, scene)
    assert comparison.position_error.max() < 1e-13  # measured 3.6e-15; a step more or less is 2e-3 m after 1.4 s
    assert comparison.attitude_error.max() < 1e-13  # measured 6.3e-16


def test_state_to_start_from_can_be_chosen(tmp_path):
    messages = runs.in_real_time(BASE, runs.sends(BASE, SECONDS), SECONDS)
    scene = BASE.changed({"initial.angular_velocity": [0.0, 0.0, 0.0]})
    comparison, scenario, _ = again(tmp_path, messages, scene, start=BAG)
    assert "as asked for" in said(scenario)
    assert comparison.attitude_error.max() < 1e-13  # measured 9.9e-16
    assert isinstance(scenario.start, State)
    (tmp_path / "scene").mkdir()
    comparison, scenario, _ = again(tmp_path / "scene", messages, scene, start=SCENE)
    assert scenario.start is None and comparison.attitude_error.max() > 1.0


def test_late_beginning_without_twists_is_refused(tmp_path):
    messages = [e for e in runs.in_real_time(BASE, runs.sends(BASE, SECONDS), SECONDS) if e[0] != "/twist"]
    assert_equal_to_the_bit(again(tmp_path, messages)[0])
    (tmp_path / "late").mkdir()
    with pytest.raises(BagError, match="begins after the start, and no twist of the body tells the velocities"):
        again(tmp_path / "late", messages[50:])


# Lockstep -----------------------------------------------------------------------------------------------------------

LOCKSTEP = BASE.changed({"lockstep": True, "steps_per_command": 5, "publish_rate": 100.0})


def lockstep_sends():
    random = np.random.default_rng(8)
    given = []
    for k in range(150):
        numbers = tuple(random.normal(size=6).tolist())
        given.append(runs.Send(0, "base_link", numbers, stamp_ns=0))
        if k % 10 == 3:
            given.append(runs.Send(0, "world", numbers, "/gust", stamp_ns=0))
        if k % 50 == 7:
            given.append(runs.Send(0, "nowhere", numbers, stamp_ns=0))
    return given


@pytest.mark.parametrize("first", (0, 2), ids=("from the initial pose", "from the first answer"))
def test_lockstep_is_equal_to_the_bit(tmp_path, first):
    messages = runs.in_lockstep(LOCKSTEP, lockstep_sends())
    comparison, scenario, track = again(tmp_path, messages[first:], LOCKSTEP)
    assert_equal_to_the_bit(comparison, 151 - bool(first))
    assert "Lockstep: each command on /wrench advances the simulation by 5 steps" in said(scenario)
    assert track.refused == 3 and scenario.start is None


def test_lockstep_that_begins_late_starts_from_the_bag(tmp_path):
    messages = runs.in_lockstep(LOCKSTEP, [replace(send, topic="/wrench") for send in lockstep_sends()])
    at = [i for i, entry in enumerate(messages) if entry[0] == "/pose"]
    comparison, scenario, _ = again(tmp_path, messages[at[60] :], LOCKSTEP)
    assert scenario.start is not None
    assert comparison.attitude_error.max() < 1e-13  # measured 2.9e-16
    assert comparison.position_error.max() < 1e-13  # measured 1.9e-15


# Actuators --------------------------------------------------------------------------------------------------------

ACTUATORS = {
    "names": ["left", "right", "jet", "wheel", "fin", "tip", "top"],  # more numbers than a wrench has
    "left": {"type": "rotor", "min": 0.0, "max": 900.0, "thrust_coefficient": 2e-5, "position": [0.0, 0.3, 0.0]},
    "right": {"type": "rotor", "min": 0.0, "max": 900.0, "thrust_coefficient": 2e-5, "time_constant": 0.02},
    "jet": {"type": "thruster", "min": -5.0, "max": 5.0, "position": [0.1, 0.2, 0.0], "delay": 0.0033},
    "wheel": {"type": "wheel", "min": -1.0, "max": 1.0, "inertia": 1e-3, "max_speed": 90.0},
    **{name: {"type": "thruster", "min": -1.0, "max": 1.0, "time_constant": 0.01} for name in ("fin", "tip", "top")},
}


def commanded(given):
    """The same with a command to the actuators after each, of which each tenth is refused."""
    random = np.random.default_rng(8)
    for k, send in enumerate(given):
        numbers = random.normal(size=7) * (900.0, 900.0, 5.0, 1.0, 1.0, 1.0, 1.0)
        numbers[3] = np.nan if k % 10 == 6 else numbers[3]
        yield send
        yield runs.Send(send.at_ns + 10_000, "", tuple(numbers.tolist()), "/actuator_commands")


def test_commands_to_actuators_take_effect_when_they_were_received(tmp_path):
    scene = BASE.changed({"actuators": ACTUATORS})
    given = [one for one in commanded(runs.sends(scene, SECONDS)) if np.isfinite(one.numbers).all()]
    messages = runs.in_real_time(scene, given, SECONDS, lag_ns=10**8)
    wrong = ("/actuator_commands", messages[200][1], making.numbers([1.0]))
    refused = ("/actuator_commands", messages[300][1], making.numbers([np.nan] * 7))
    comparison, scenario, track = again(
        tmp_path, [*messages[:200], wrong, *messages[200:300], refused, *messages[300:]], scene, times=timing.RECEIVE
    )
    assert_equal_to_the_bit(comparison)
    assert "1 messages on /actuator_commands do not have 7 numbers: left out, as the node does." in said(scenario)
    assert track.refused == 1 and "not all are finite" in track.reason


@pytest.mark.parametrize("on", ["wrench", "actuators"])
def test_lockstep_with_actuators_is_equal_to_the_bit(tmp_path, on):
    scene = LOCKSTEP.changed({"actuators": ACTUATORS, "lockstep_on": on})
    messages = runs.in_lockstep(scene, list(commanded(lockstep_sends())))
    comparison, scenario, track = again(tmp_path, messages, scene)
    assert_equal_to_the_bit(comparison, len([one for one in messages if one[0] == "/pose"]))
    topic = "/wrench" if on == "wrench" else "/actuator_commands"
    assert f"Lockstep: each command on {topic} advances the simulation by 5 steps" in said(scenario)
    assert track.refused == 3 + 17


def test_commands_to_actuators_of_another_scene_are_not_used(tmp_path):
    scene = BASE.changed({"actuators": ACTUATORS})
    messages = runs.in_real_time(scene, [runs.Send(21_000_000, "", (0.0,) * 7, "/actuator_commands")], SECONDS)
    comparison, scenario, _ = again(tmp_path, messages)
    assert comparison.position_error.max() < 1e-12  # measured 3.6e-15: other kernels
    assert "Not used: /actuator_commands (1 std_msgs/msg/Float64MultiArray)" in said(scenario)


def test_commands_to_actuators_of_two_bodies_are_refused(tmp_path):
    scene = BASE.changed({"actuators": ACTUATORS})
    messages = runs.in_real_time(scene, [], SECONDS)
    messages += [(f"/{name}/actuator_commands", making.EPOCH_NS + 10**10, making.numbers([0.0] * 7)) for name in "ab"]
    with pytest.raises(BagError, match="has commands to the actuators of several bodies: /a/actuator_commands, /b/"):
        again(tmp_path, messages, scene)


def leading(messages):
    """Places of the commands that advance the simulation."""
    return [i for i, e in enumerate(messages) if e[0] == "/wrench" and e[2].header.frame_id != "nowhere"]


@pytest.mark.parametrize("which", (0, 50, -1), ids=("first", "middle", "last"))
def test_lockstep_with_a_command_missing_in_the_bag(tmp_path, which):
    messages = runs.in_lockstep(LOCKSTEP, lockstep_sends())
    del messages[leading(messages)[which]]
    with pytest.raises(BagError) as caught:
        again(tmp_path, messages, LOCKSTEP)
    assert str(caught.value) == (
        "the commands lead to step 745, but the poses go on to step 750: some commands, or steps that were asked "
        "for by a service, are not in the bag; start the first command when node and recorder hear it (ros2 topic pub "
        "-w 2), or let the node record (record.path)"
    )


def test_lockstep_without_any_command_is_refused(tmp_path):
    messages = [e for e in runs.in_lockstep(LOCKSTEP, lockstep_sends()) if e[0] not in ("/wrench", "/gust")]
    with pytest.raises(BagError, match="the commands lead to step 0, but the poses go on to step 750"):
        again(tmp_path, messages, LOCKSTEP)


def test_lockstep_with_a_command_missing_and_poses_missing_at_the_end(tmp_path):
    """So that their numbers fit: what the commands lead to came before them."""
    messages = runs.in_lockstep(LOCKSTEP, lockstep_sends())
    del messages[leading(messages)[30]]
    ends = [i for i, entry in enumerate(messages) if entry[0] == "/pose"][-3]
    messages = [e for i, e in enumerate(messages) if i < ends or e[0] not in ("/pose", "/twist")]
    comparison, _, track = again(tmp_path, messages, LOCKSTEP)
    assert comparison.first_unequal == 31
    assert track.doubt.startswith(
        "The last poses were received before the commands that lead to them: the bag may lack"
    )


def test_lockstep_with_commands_that_the_node_missed(tmp_path):
    messages = runs.in_lockstep(LOCKSTEP, lockstep_sends())
    early = [("/wrench", making.EPOCH_NS - 3 + k, messages[leading(messages)[5]][2]) for k in range(3)]
    comparison, _, track = again(tmp_path, early + messages, LOCKSTEP)
    assert comparison.first_unequal == 1
    assert track.doubt.startswith(
        "At every pose more commands had been received than lead to it, by 3 or more: the node"
    )
    (tmp_path / "whole").mkdir()
    assert again(tmp_path / "whole", messages, LOCKSTEP)[2].doubt == ""


# By the journal -----------------------------------------------------------------------------------------------------


EVENTS = (
    (301_000_000, lambda simulation: simulation.apply_impulse(Wrench(force_world=(1.0, 2.0, 3.0)))),
    (502_000_000, lambda simulation: simulation.set_state(State(position=(1.0, 2.0, 3.0), orientation=(1, 2, 3, 4)))),
    (703_000_000, lambda simulation: simulation.change(body=Body(3.0, (0.2, 0.2, 0.3)))),
    (904_000_000, lambda simulation: simulation.clear_wrench()),
    (1_105_000_000, lambda simulation: simulation.reset(keep_time=True)),
    (1_306_000_000, lambda simulation: simulation.reset()),
)


def test_journal_is_repeated_to_the_bit(tmp_path):
    """With time set back, which no bag without a journal may have."""
    given = runs.sends(BASE, SECONDS) + runs.sends(BASE, SECONDS, 20.0, "/gust", seed=4)
    messages = runs.with_journal(BASE, given, SECONDS, EVENTS)
    recording = read(making.make(tmp_path / "bag", messages))
    scene = scenarios.scene_of(recording)
    scenario = scenarios.prepare(recording, scene)
    track = resimulating.run(scenario, scene)
    comparison = Comparison(scenario.stamp_ns, scenario.recorded, track.poses)
    assert_equal_to_the_bit(comparison, len(scenario.stamp_ns))
    assert len(scenario.stamp_ns) > 90 and (np.diff(scenario.stamp_ns) < 0).any()
    assert scenario.notes == (
        "Simulated by the node's own journal: each command takes effect at the step at which it did.",
    )


def test_journal_with_another_scene_leads_elsewhere(tmp_path):
    messages = runs.with_journal(BASE, runs.sends(BASE, SECONDS), SECONDS)
    comparison, _, _ = again(tmp_path, messages, BASE.changed({"body.mass": 2.1}))
    assert comparison.attitude_error.max() < 1e-13  # by the same torques; measured 0
    assert comparison.position_error.max() > 1e-3


def test_journal_of_other_kernels_says_so(tmp_path, monkeypatch):
    messages = runs.with_journal(BASE, runs.sends(BASE, SECONDS), SECONDS)
    monkeypatch.setattr(scenarios, "sources_digest", lambda: "others")
    _, scenario, _ = again(tmp_path, messages)
    assert "with other kernels: the last digits may differ" in said(scenario)


def test_journal_without_poses_is_refused(tmp_path):
    messages = [e for e in runs.with_journal(BASE, runs.sends(BASE, SECONDS), SECONDS) if e[0] != "/pose"]
    with pytest.raises(BagError, match="has a journal, but no pose to compare with"):
        again(tmp_path, messages)


# Topics -------------------------------------------------------------------------------------------------------------


def renamed(messages, **names):
    return [(names.get(topic[1:], topic), receive_ns, message) for topic, receive_ns, message in messages]


def test_topics_of_any_name_and_namespace(tmp_path):
    messages = runs.in_real_time(BASE, runs.sends(BASE, SECONDS), SECONDS)
    names = {"wrench": "/robot/cmd", "pose": "/robot/where", "twist": "/robot/how"}
    comparison, scenario, _ = again(tmp_path, renamed(messages, **names))
    assert_equal_to_the_bit(comparison)
    assert (scenario.commands.topics, scenario.pose_topic, scenario.twist_topic) == (
        ("/robot/cmd",),
        "/robot/where",
        "/robot/how",
    )


def test_topics_of_the_node_beside_others_of_their_type(tmp_path):
    messages = runs.in_real_time(BASE, runs.sends(BASE, SECONDS), SECONDS)
    names = {"wrench": "/ns/wrench", "pose": "/ns/pose", "twist": "/ns/twist"}
    others = [
        ("/ns/wrench_applied", making.EPOCH_NS, making.wrench_stamped(1, "base_link", range(6))),
        ("/ns/impulse", making.EPOCH_NS, making.wrench_stamped(1, "base_link", range(6))),
        ("/ns/set_pose", making.EPOCH_NS, making.pose_stamped(1, "world", range(7))),
        ("/goal", making.EPOCH_NS, making.pose_stamped(1, "map", range(7))),
        ("/ns/set_twist", making.EPOCH_NS, making.twist_stamped(1, "world", range(6))),
    ]
    comparison, scenario, _ = again(tmp_path, others + renamed(messages, **names))
    assert_equal_to_the_bit(comparison)
    assert scenario.twist_topic == "/ns/twist"
    for topic in ("/ns/impulse", "/ns/set_pose", "/ns/set_twist"):
        assert topic in said(scenario)
    assert "only a journal tells" in said(scenario)


@pytest.mark.parametrize(
    ("names", "choices", "what"),
    [
        ({"wrench": "/a"}, {"topics": ("b",)}, "has no topic b; it has /a, /pose, /twist"),
        ({}, {"topics": ("pose",)}, "topic /pose is of type geometry_msgs/msg/PoseStamped; give one of type geometry"),
        ({}, {"pose": "/twist"}, "topic /twist is of type geometry_msgs/msg/TwistStamped"),
    ],
)
def test_topics_that_cannot_be(tmp_path, names, choices, what):
    messages = renamed(runs.in_real_time(BASE, runs.sends(BASE, 0.2), 0.2), **names)
    with pytest.raises(BagError, match=what):
        again(tmp_path, messages, **choices)


def test_several_topics_and_no_telling_which(tmp_path):
    messages = runs.in_real_time(BASE, runs.sends(BASE, SECONDS), SECONDS)
    one = renamed(messages, wrench="/one")
    both = sorted(one + [("/two", *entry[1:]) for entry in one if entry[0] == "/one"], key=lambda entry: entry[1])
    with pytest.raises(BagError, match=r"several topics of type .*: /one, /two; choose with --topic"):
        again(tmp_path, both)
    (tmp_path / "chosen").mkdir()
    assert_equal_to_the_bit(again(tmp_path / "chosen", both, topics=("/two",))[0])


def test_bag_with_two_robots(tmp_path):
    """Names of the scene that two namespaces have are no names."""
    messages = runs.in_real_time(BASE, runs.sends(BASE, SECONDS), SECONDS)
    both = [(f"/{robot}{topic}", receive_ns, message) for topic, receive_ns, message in messages for robot in "ab"]
    with pytest.raises(BagError, match=r"several topics of type .*PoseStamped: /a/pose, /b/pose; choose the body's in"):
        again(tmp_path, both)
    (tmp_path / "pose").mkdir()
    with pytest.raises(BagError, match=r"several topics of type .*: /a/wrench, /b/wrench; choose with --topic"):
        again(tmp_path / "pose", both, pose="a/pose")
    (tmp_path / "both").mkdir()
    comparison, scenario, _ = again(tmp_path / "both", both, pose="a/pose", topics=("a/wrench",))
    assert_equal_to_the_bit(comparison)
    assert scenario.twist_topic == "/a/twist"


def test_poses_in_another_frame_than_the_scenes(tmp_path):
    messages = runs.in_real_time(BASE, runs.sends(BASE, 0.2), 0.2)
    with pytest.raises(BagError, match="/pose is in frame 'world', the scene's world is 'map'"):
        again(tmp_path, messages, BASE.changed({"world_frame_id": "map"}))


# Other kinds of poses and twists -------------------------------------------------------------------------------------


def with_covariance(receive_ns, pose, _):
    return "/where", receive_ns, making.pose_with_covariance(runs.stamp_ns(pose), "world", runs.numbers_of(pose.pose))


def transform(receive_ns, pose, _):
    return (
        "/where",
        receive_ns,
        making.transform_stamped(runs.stamp_ns(pose), "world", "base_link", runs.numbers_of(pose.pose)),
    )


def twist_with_covariance(receive_ns, twist):
    return (
        "/how",
        receive_ns,
        making.twist_with_covariance(runs.stamp_ns(twist), "base_link", runs.vectors_of(twist.twist)),
    )


KINDS = {
    "odometry": (runs.odometry(), None, ("/odom", "/odom")),
    "odometry without a child": (runs.odometry(""), None, ("/odom", "/odom")),
    "odometry of another name": (runs.odometry(topic="/ns/state"), None, ("/ns/state", "/ns/state")),
    "with covariance": (with_covariance, twist_with_covariance, ("/where", "/how")),
    "transforms": (transform, twist_with_covariance, ("/where", "/how")),
}


@pytest.mark.parametrize("storage", ("mcap", "sqlite3"))
@pytest.mark.parametrize("kind", KINDS)
def test_poses_and_twists_of_other_types(tmp_path, kind, storage):
    pose, twist, topics = KINDS[kind]
    messages = runs.told_by(runs.in_real_time(BASE, runs.sends(BASE, SECONDS), SECONDS), pose, twist)
    comparison, scenario, _ = again(tmp_path, messages, storage=storage)
    assert_equal_to_the_bit(comparison)
    assert (scenario.pose_topic, scenario.twist_topic) == topics
    (tmp_path / "late").mkdir()
    late = [entry for entry in messages if entry[1] > making.EPOCH_NS + 0.605e9]
    comparison, scenario, _ = again(tmp_path / "late", late, storage=storage)
    assert scenario.start is not None and len(comparison.recorded) == 70
    # By the recorded twist, in the axes of the child frame.
    assert comparison.position_error.max() < 1e-13  # measured 3.9e-15
    assert comparison.attitude_error.max() < 1e-13  # measured 4.2e-16


@pytest.mark.parametrize(("given", "told"), [({}, "/pose"), ({"pose": "odom"}, "/odom"), ({"pose": "/odom"}, "/odom")])
def test_pose_goes_before_odom(tmp_path, given, told):
    messages = runs.in_real_time(BASE, runs.sends(BASE, SECONDS), SECONDS)
    both = sorted(
        messages + [e for e in runs.told_by(messages, runs.odometry()) if e[0] == "/odom"], key=lambda entry: entry[1]
    )
    comparison, scenario, _ = again(tmp_path, both, **given)
    assert_equal_to_the_bit(comparison)
    assert scenario.pose_topic == told and scenario.out_topics == ("/pose", "/twist")


def test_odom_goes_before_poses_of_other_names(tmp_path):
    messages = runs.told_by(runs.in_real_time(BASE, runs.sends(BASE, SECONDS), SECONDS), runs.odometry())
    goal = ("/goal", making.EPOCH_NS, making.pose_stamped(making.EPOCH_NS, "world", range(7)))
    assert_equal_to_the_bit(again(tmp_path, [goal, *messages])[0])


def test_odometry_of_another_body_or_world_is_refused(tmp_path):
    messages = runs.in_real_time(BASE, runs.sends(BASE, 0.2), 0.2)
    with pytest.raises(BagError, match="/odom is of frame 'camera', the scene's body is 'base_link'; give the"):
        again(tmp_path, runs.told_by(messages, runs.odometry("camera")))
    (tmp_path / "map").mkdir()
    with pytest.raises(BagError, match="/odom is in frame 'map', the scene's world is 'world'"):
        again(tmp_path / "map", runs.told_by(messages, runs.odometry(world="map")))


# Without commands ---------------------------------------------------------------------------------------------------


def without_commands(folder, listed, storage):
    """A free motion; the topic of the commands is listed without a message, as of a bag whose recorder heard none."""
    plugin = making.StoragePlugin[storage.upper()]
    bag = making.Writer(folder, version=9, storage_plugin=plugin)
    bag.open()
    if listed:
        bag.add_connection("/wrench", "geometry_msgs/msg/WrenchStamped", typestore=making.STORE)
    connections = {}
    for topic, receive_ns, message in runs.in_real_time(BASE, [], SECONDS):
        kind = message.__msgtype__
        if topic not in connections:
            connections[topic] = bag.add_connection(topic, kind, typestore=making.STORE)
        bag.write(connections[topic], receive_ns, bytes(making.STORE.serialize_cdr(message, kind)))
    bag.close()
    return folder


@pytest.mark.parametrize("storage", ("mcap", "sqlite3"))
@pytest.mark.parametrize("listed", (False, True))
def test_free_motion_needs_no_commands(tmp_path, listed, storage):
    recording = read(without_commands(tmp_path / "bag", listed, storage))
    asked = [(), ("wrench",), ("/wrench",)] if listed else [()]
    for names in asked:
        scenario = scenarios.prepare(recording, BASE, Choices(topics=names))
        track = resimulating.run(scenario, BASE)
        assert_equal_to_the_bit(Comparison(scenario.stamp_ns, scenario.recorded, track.poses))
        assert "no commands of type geometry_msgs/WrenchStamped or Wrench: the motion is a free one." in said(scenario)
    with pytest.raises(BagError, match="has no topic nowhere"):
        scenarios.prepare(recording, BASE, Choices(topics=("nowhere",)))


def test_what_moved_the_body_and_is_not_taken_is_counted(tmp_path):
    messages = runs.in_real_time(BASE, [], SECONDS)
    kinds = {"/impulse": 2, "/other": 3, "/third": 1, "/wrench_applied": 5}
    more = [
        (topic, making.EPOCH_NS + k, making.wrench_stamped(making.EPOCH_NS, "world", range(6)))
        for topic, count in kinds.items()
        for k in range(count)
    ]
    recording = read(making.make(tmp_path / "bag", [*messages, *more]))
    with pytest.raises(BagError, match=r"has several topics of type .*: /other, /third; choose with --topic"):
        scenarios.prepare(recording, BASE)
    told = said(scenarios.prepare(recording, BASE, Choices(topics=("other",))))
    assert "Left out, because only a journal tells when they took effect: /impulse (2 geometry_msgs/msg/Wren" in told
    assert "Not used: /third (1 geometry_msgs/msg/WrenchStamped); --topic chooses, once for each topic." in told
    assert "wrench_applied" not in told


def test_neither_commands_nor_poses(tmp_path):
    messages = [e for e in runs.in_real_time(BASE, [], SECONDS) if e[0] == "/twist"]
    recording = read(making.make(tmp_path / "bag", [*messages, ("/note", messages[-1][1], making.text("x"))]))
    with pytest.raises(
        BagError, match=r"none with poses, of type .*Odometry; it has /note \(std_msgs/.*, /twist \(geom"
    ):
        scenarios.prepare(recording, BASE)


def test_commands_alone(tmp_path):
    """Poses come as the scene publishes them, from the first command to the end of the last one's step."""
    messages = [e for e in runs.in_real_time(BASE, runs.sends(BASE, SECONDS), SECONDS) if e[0] == "/wrench"]
    recording = read(making.make(tmp_path / "bag", messages))
    scenario = scenarios.prepare(recording, BASE)
    track = resimulating.run(scenario, BASE)
    assert scenario.recorded is None and np.isfinite(track.motion).all()
    assert_array_equal(np.diff(scenario.stamp_ns), 20_000_000)
    assert scenario.stamp_ns[-1] >= messages[-1][1] - runs.LATENCY_NS > scenario.stamp_ns[-2] - 20_000_000


def test_commands_alone_that_do_not_tell_enough(tmp_path):
    messages = [e for e in runs.in_real_time(BASE, runs.sends(BASE, SECONDS), SECONDS) if e[0] == "/wrench"]
    recording = read(making.make(tmp_path / "bag", messages))
    with pytest.raises(BagError, match="has no poses, which lockstep needs; record pose and twist, too"):
        scenarios.prepare(recording, LOCKSTEP)
    with pytest.raises(BagError, match="has no poses, which --start bag needs"):
        scenarios.prepare(recording, BASE, Choices(start=BAG))
    later = ("/wrench", messages[-1][1] + 10**17, runs.message(runs.Send(10**17, "world", (0.0,) * 6), making.EPOCH_NS))
    recording = read(making.make(tmp_path / "years", [*messages, later]))
    with pytest.raises(BagError, match=r"its commands span 5e\+09 poses at this publish_rate; give a lower one"):
        scenarios.prepare(recording, BASE)


def with_numbers(messages, topic, number):
    """The same with that number in all places of the messages on a topic."""
    make = {"/wrench": making.wrench_stamped, "/pose": making.pose_stamped, "/twist": making.twist_stamped}[topic]
    changed = []
    for name, receive_ns, message in messages:
        if name == topic:
            message = make(runs.stamp_ns(message), message.header.frame_id, [number] * 7)
        changed.append((name, receive_ns, message))
    return changed


@pytest.mark.parametrize("twist_frame", ("body", "world"))
@pytest.mark.parametrize("number", (np.nan, np.inf, 1e308))
@pytest.mark.parametrize("topic", ("/wrench", "/pose", "/twist"))
def test_refusals_show_plain_numbers(tmp_path, topic, number, twist_frame):
    scene = BASE.changed({"twist_frame": twist_frame, "wrench.topics": ["wrench"]})
    messages = with_numbers(runs.in_real_time(scene, runs.sends(scene, 0.2), 0.2), topic, number)
    with pytest.raises((BagError, SimulationError, ValueError)) as caught:
        again(tmp_path, messages, scene, start=BAG)
    assert not re.search(r"array|np\.|float64|\.\.\.", str(caught.value)), caught.value


# Errors -------------------------------------------------------------------------------------------------------------


def test_further_poses_are_said_to_be_left_out(tmp_path):
    """Of the same body or another, nobody knows: none is compared without a word."""
    messages = runs.in_real_time(BASE, runs.sends(BASE, SECONDS), SECONDS)
    messages += [("/other/pose", *rest) for topic, *rest in messages if topic == "/pose"]
    _, scenario, _ = again(tmp_path, messages, pose="/pose")
    assert "Not compared: /other/pose (101 geometry_msgs/msg/PoseStamped); --pose chooses." in said(scenario)


# A body that waits for its first command ------------------------------------------------------------------------------

WAITS = BASE.changed({"start_on_command": True})


def test_body_that_waits_moves_from_the_first_command_that_is_taken(tmp_path):
    """The first of all is refused. Without ``start_on_command`` it is another motion."""
    bad = runs.Send(101_000_000, "base_link", (np.nan, 0, 0, 0, 0, 0))
    given = [send for send in runs.sends(WAITS, SECONDS) if send.at_ns > 500_000_000]
    messages = runs.in_real_time(WAITS, given, SECONDS)
    messages.append(("/wrench", making.EPOCH_NS + bad.at_ns, runs.message(bad, making.EPOCH_NS)))
    comparison, scenario, track = again(tmp_path, sorted(messages, key=lambda entry: entry[1]), WAITS)
    assert_equal_to_the_bit(comparison)
    began = int(np.flatnonzero(np.diff(comparison.recorded[:, 2]))[0])
    assert 24 <= began <= 27 and track.refused == 1  # 0.5 s and a little are 25 poses
    assert scenarios.STAYS in scenario.notes
    (tmp_path / "other").mkdir()
    assert again(tmp_path / "other", messages)[0].first_unequal is not None


def test_body_that_waits_in_a_bag_that_begins_late_has_had_its_command(tmp_path):
    given = [send for send in runs.sends(WAITS, SECONDS) if not 0.8e9 < send.at_ns < 1.2e9]
    messages = [entry for entry in runs.in_real_time(WAITS, given, SECONDS) if entry[1] > making.EPOCH_NS + 10**9]
    comparison, scenario, _ = again(tmp_path, messages, WAITS)
    assert scenario.start is not None and scenarios.STAYS not in scenario.notes
    assert comparison.position_error.max() < 1e-12  # measured 1.8e-15: from a pose and a twist, not the state
    assert np.ptp(comparison.recorded[:, 2]) > 1.0


def test_body_that_waits_is_in_the_journal(tmp_path):
    """Also after a reset; another scene changes the body and not when it was let go."""
    late = [send for send in runs.sends(WAITS, SECONDS) if send.at_ns > 500_000_000 and not 1e9 < send.at_ns < 1.2e9]
    calls = [(1_101_000_000, lambda simulation: simulation.reset(keep_time=True))]
    messages = runs.with_journal(WAITS, late, SECONDS, calls)
    comparison, scenario, _ = again(tmp_path, messages, WAITS)
    assert_equal_to_the_bit(comparison)
    assert scenarios.STAYS in scenario.notes
    still = np.flatnonzero(~np.diff(comparison.recorded, axis=0).any(axis=1))
    assert {0, 20, 56, 58} <= set(still.tolist())
    (tmp_path / "other").mkdir()
    assert_equal_to_the_bit(again(tmp_path / "other", messages, BASE)[0])
