"""The motion that a bag has recorded is the one that was simulated: velocities, commands and their times."""

import numpy as np
import pytest

pytest.importorskip("rosbags")

from rigid_body_sim import Scene
from rigid_body_sim.bags.reading import read
from rigid_body_sim.bags.rosbags_support import BagError
from rigid_body_sim.scenarios.motion import motion_in, recorded

from ..bags import making
from ..resim import runs

SECONDS = 0.5


def true_motion(scene, given):
    """Of each published step: time [s], and 19 numbers as Simulation.motion."""
    from rigid_body_sim import Simulation

    simulation, rows = Simulation.from_scene(scene), []
    waiting = sorted(given, key=lambda send: send.at_ns)
    for step in range(int(SECONDS * scene["rate"]) + 1):
        simulation.step(step - simulation.steps)
        if step % scene.steps_per_publish == 0:
            rows.append((simulation.time, *simulation.motion))
        while waiting and waiting[0].at_ns < (step + 1) * 1e9 / scene["rate"]:
            runs.hold(simulation, scene, waiting.pop(0))
    return np.array(rows)


@pytest.mark.parametrize("frame", ["body", "world"])
def test_velocities_are_those_of_the_body(tmp_path, frame):
    scene = Scene({**runs.SCENE, "twist_frame": frame})
    given = runs.sends(scene, SECONDS)
    making.make(tmp_path / "run", runs.in_real_time(scene, given, SECONDS))
    motion, true = recorded(tmp_path / "run"), true_motion(scene, given)
    assert motion.measured and motion.topic == "/pose" and len(motion) == 26
    np.testing.assert_allclose(motion.time, true[:, 0], rtol=0, atol=1e-9)
    for name, columns in (
        ("position", slice(1, 4)),
        ("orientation", slice(4, 8)),
        ("velocity", slice(8, 11)),
        ("angular_velocity", slice(17, 20)),
    ):
        # measured 1.4e-15: what is told in other axes is turned
        np.testing.assert_allclose(getattr(motion, name), true[:, columns], rtol=0, atol=1e-13)


def test_without_twists_velocities_are_differences_of_second_order(tmp_path):
    errors = []
    for publish_rate in (50.0, 100.0, 500.0):
        scene = Scene({**runs.SCENE, "publish_rate": publish_rate, "gravity": [0.0, 0.0, -9.80665]})
        messages = [entry for entry in runs.in_real_time(scene, [], SECONDS) if entry[0] == "/pose"]
        for i in range(1, len(messages), 3):  # −q is the same attitude
            q = messages[i][2].pose.orientation
            q.x, q.y, q.z, q.w = -q.x, -q.y, -q.z, -q.w
        making.make(tmp_path / f"run{publish_rate:g}", messages)
        motion, true = recorded(tmp_path / f"run{publish_rate:g}"), true_motion(scene, [])
        assert not motion.measured
        inside = slice(1, -1)
        found = np.hstack((motion.velocity, motion.angular_velocity))[inside]
        errors.append(np.abs(found - np.delete(true[:, 8:20], slice(3, 9), axis=1)[inside]).max())
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)  # measured 4.000
    assert errors[1] / errors[2] == pytest.approx(25.0, rel=0.05)  # measured 25.0


def test_commands_stand_when_they_were_sent(tmp_path):
    scene = Scene(runs.SCENE)
    given = runs.sends(scene, SECONDS, frames=("base_link",))
    making.make(tmp_path / "run", runs.in_real_time(scene, given, SECONDS))
    motion = recorded(tmp_path / "run")
    (command,) = motion.wrenches
    assert command.topic == "/wrench" and command.frames == ("base_link",) and motion.actuators == ()
    np.testing.assert_allclose(command.time, [send.at_ns * 1e-9 for send in given], rtol=0, atol=1e-8)
    assert np.array_equal(command.values, [send.numbers for send in given])


def test_what_acted_takes_the_place_of_what_was_commanded(tmp_path):
    scene = Scene(runs.SCENE)
    messages = runs.in_real_time(scene, runs.sends(scene, SECONDS), SECONDS)
    applied = making.wrench_stamped(making.EPOCH_NS, "base_link", range(6))
    making.make(tmp_path / "run", [*messages, ("/wrench_applied", messages[-1][1] + 1, applied)])
    assert [each.topic for each in recorded(tmp_path / "run").wrenches] == ["/wrench_applied"]


def test_commands_to_actuators(tmp_path):
    scene = Scene(runs.SCENE)
    messages = runs.in_real_time(scene, [], SECONDS)
    sent = [(1.0, 2.0), (3.0, 4.0), (5.0,)]
    at = [messages[i][1] for i in (0, 10, 20)]
    messages += [("/actuator_commands", time, making.numbers(n)) for time, n in zip(at, sent, strict=True)]
    making.make(tmp_path / "run", sorted(messages, key=lambda entry: entry[1]))
    (command,) = recorded(tmp_path / "run").actuators
    assert command.values.tolist() == [[1.0, 2.0], [3.0, 4.0]] and command.frames == ()


def test_bag_without_poses_is_refused(tmp_path):
    scene = Scene(runs.SCENE)
    messages = runs.in_real_time(scene, runs.sends(scene, SECONDS), SECONDS)
    making.make(tmp_path / "run", [entry for entry in messages if entry[0] != "/pose"])
    with pytest.raises(BagError, match=r"has no topic with poses, of type .*; it has /twist"):
        motion_in(read(tmp_path / "run"), scene)


def test_one_pose_has_no_velocity(tmp_path):
    making.make(tmp_path / "run", [("/pose", 5, making.pose_stamped(5, "world", (1, 2, 3, 2, 0, 0, 0)))])
    motion = recorded(tmp_path / "run")
    assert motion.orientation.tolist() == [[1.0, 0.0, 0.0, 0.0]] and np.isnan(motion.velocity).all()
