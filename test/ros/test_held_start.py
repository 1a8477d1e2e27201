"""A body that stays until its first command, while time goes on: the loop alone, a node over DDS, and its bags."""

import numpy as np
import pytest
import yaml
from numpy.testing import assert_array_equal

from rigid_body_sim import Scene, Simulation, State, Wrench

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros
loops = pytest.importorskip("rigid_body_sim.ros.loop")

PERIOD_NS = 10_000_000
SCENE = {
    "start_on_command": True,
    "rate": 100.0,
    "publish_rate": 0.0,
    "wrench.topics": ["wrench", "gust"],
    "wrench.timeout": 0.05,
    "body.mass": 2.0,
    "body.inertia": [0.1, 0.2, 0.25, 0.0, 0.0, 0.0],
    "initial.position": [0.3, -0.2, 0.5],
    "initial.linear_velocity": [0.5, 0.2, 3.0],
    "initial.angular_velocity": [1.1, -2.0, 0.7],
    "gravity": [0.0, 0.0, -9.80665],
}
WAITING = "waiting for the first command"
NAN = float("nan")


# The loop alone -------------------------------------------------------------------------------------------------------


class Published:
    """Motion and step at each publication."""

    heard = True

    def __init__(self, simulation):
        self.simulation, self.steps, self.motions = simulation, [], []

    def passing(self, advance, _):
        return advance

    def publish(self, _):
        self.steps.append(self.simulation.steps)
        self.motions.append(self.simulation.motion)

    def tick(self, _):
        pass


def loop_of(**changes):
    scene = Scene({**SCENE, **changes})
    simulation = Simulation.from_scene(scene)
    return loops.Loop(scene, simulation, Published(simulation), lambda _: None)


def bits(simulation):
    return simulation.save().state


def test_time_passes_as_fast_as_possible_without_motion_and_is_published():
    loop = loop_of(real_time_factor=0.0)
    initial, motion = bits(loop.simulation), loop.simulation.motion
    loop.turn()
    steps = loop.simulation.steps
    assert steps > 1 and loop._outputs.steps == list(range(1, steps + 1))
    assert bits(loop.simulation) == initial and set(loop._outputs.motions) == {motion}
    loop.simulation.set_wrench(Wrench(force_world=(1.0, 0.0, 0.0)))
    loop.set_going()
    assert loop.mode == "running"
    loop.turn()
    alone = Simulation.from_scene(Scene(SCENE))
    alone.set_wrench(Wrench(force_world=(1.0, 0.0, 0.0)))
    for step, moved in zip(loop._outputs.steps[steps:], loop._outputs.motions[steps:], strict=True):
        alone.step(step - steps - alone.steps)
        assert moved == alone.motion  # of the steps since the command, to the bit


def test_mode_is_what_goes_on_and_a_reset_of_the_state_waits_again():
    loop = loop_of()
    assert (loop.mode, loop.by_clock, loop.in_haste) == (WAITING, True, True)
    assert loop.pause(True) == "paused"
    assert loop.step(3) == "step 3, simulated time 0.03 s; the body stays until the first command"
    assert loop.pause(False) == WAITING
    loop.set_going()
    assert loop.pause(True) == "paused" and loop.step() == "step 4, simulated time 0.04 s"
    assert bits(loop.simulation) != bits(loop_of().simulation)
    loop.reset(state=False, time_too=True)
    assert loop.pause(False) == "running"
    loop.reset()
    assert loop.mode == WAITING and bits(loop.simulation) == bits(loop_of().simulation)


def test_steps_asked_for_while_paused_pass_without_motion():
    loop, told = loop_of(start_paused=True), []
    loop.begin_run(loops.Run(50_000, lambda *_: None, told.append))
    while not told:
        loop.turn()
    assert (told, loop.simulation.steps) == ([""], 50_000)
    assert bits(loop.simulation) == bits(loop_of().simulation)


def test_in_lockstep_the_command_that_advances_is_the_first():
    loop = loop_of(lockstep=True, steps_per_command=5)
    assert (loop.mode, loop.by_clock) == ("lockstep", False)
    loop.set_going()
    loop.on_command()
    alone = Simulation.from_scene(Scene(SCENE))
    alone.step(5)
    assert bits(loop.simulation) == bits(alone) and loop.simulation.steps == 5


def test_state_set_from_outside_is_where_it_waits():
    loop, there = loop_of(real_time_factor=0.0), State((1.0, 2.0, 3.0), velocity=(0.1, 0.0, 0.0))
    loop.turn()
    loop.simulation.set_state(there)
    loop.on_changed_state()
    set_bits = bits(loop.simulation)
    loop.turn()
    assert loop.mode == WAITING and bits(loop.simulation) == set_bits


def test_no_stamp_left_stops_the_waiting_too():
    loop = loop_of(rate=1e-3, start_paused=True)
    loop._outputs.heard = False
    with pytest.raises(loops.StoppedError, match=r"its stamp would be of 2\^31 s"):
        loop.step(10**9)
    assert loop.mode == "stopped" and bits(loop.simulation) == bits(loop_of(rate=1e-3).simulation)


# Over DDS -------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def running(connect_shared):
    return connect_shared(SCENE).ready()


@pytest.fixture(scope="module")
def paused(connect_shared):
    return connect_shared({**SCENE, "start_paused": True}).ready()


def at_rest(remote, count=1):
    """Poses and twists published since the last reset, which must be the initial ones to the bit."""
    track = remote.collect(count)
    assert_array_equal(track.position, np.tile(SCENE["initial.position"], (len(track.position), 1)))
    assert_array_equal(track.orientation, np.tile((1.0, 0.0, 0.0, 0.0), (len(track.position), 1)))
    initial = Simulation.from_scene(Scene(SCENE)).motion
    assert_array_equal(track.linear, np.tile(initial[13:16], (len(track.position), 1)))
    assert_array_equal(track.angular, np.tile(initial[16:19], (len(track.position), 1)))
    return track


def waiting_anew(remote):
    """After a reset, which a running node publishes at its next step and a paused one at once."""
    remote.call("reset")
    remote.drain()
    remote.clear()
    return remote


def moved(remote):
    """Rows of pose and twist from the last one at the initial position on."""
    remote.wait(lambda: any(pose.pose.position.x != 0.3 for pose in remote.poses), "motion")
    first = next(i for i, pose in enumerate(remote.poses) if pose.pose.position.x != 0.3)
    track = remote.collect(first + 8)
    return np.hstack((track.position, track.orientation, track.linear, track.angular))[first - 1 :]


def alone_under(act, steps):
    """The same without ROS: what ``act(simulation)`` does, then so many steps."""
    simulation, rows = Simulation.from_scene(Scene(SCENE)), []
    for step in range(steps):
        if step:
            simulation.step()
        else:
            act(simulation)
        rows.append((*simulation.motion[:7], *simulation.motion[13:19]))
    return np.array(rows)


FORCE, TORQUE = (0.3, 0.0, 0.1), (0.0, 0.02, 0.0)
PUSH = Wrench(force_body=FORCE, torque_body=TORQUE)


def test_body_stays_while_stamps_go_on_and_diagnostics_and_log_say_why(running):
    waiting_anew(running)
    track = at_rest(running, 20)
    assert set(np.diff(track.stamp_ns).tolist()) == {PERIOD_NS}
    _, values = running.wait_report(lambda status, _: status.message == WAITING, "that it waits")
    assert (values["mode"], values["wrench age [s]"]) == (WAITING, "none yet") and int(values["steps"]) > 0
    names = [running.name.replace("rigid_body_node", topic) for topic in ("impulse", "wrench", "gust")]
    told = f"{WAITING}, on any of {', '.join(names)}: until then the body stays"
    assert (running.process.stdout + running.process.stderr).count(told) == 1


@pytest.mark.parametrize("topic", ["wrench", "gust"])
def test_a_command_on_any_topic_sets_it_going_for_its_timeout(running, topic):
    """The first step after it moves; it acts for 0.05 s, five steps, from the command on."""
    gust = running.publisher("gust")
    at_rest(waiting_anew(running))
    running.send("base_link", FORCE, TORQUE, through=gust if topic == "gust" else None)
    expected = alone_under(lambda simulation: simulation.set_wrench(PUSH, 0.05), 9)
    assert_array_equal(moved(running)[:9], expected)
    assert running.report()[1]["mode"] == "running"


def test_an_impulse_sets_it_going(running):
    at_rest(waiting_anew(running))
    running.send("base_link", FORCE, TORQUE, topic="impulse")
    rows = moved(running)
    expected = alone_under(lambda simulation: simulation.apply_impulse(PUSH), 9)
    assert_array_equal(rows[1:9], expected[1:])  # row 0 was published before the blow, or after it


def test_what_is_refused_or_no_command_does_not(running):
    waiting_anew(running)
    running.send("base_link", force=(NAN, 0.0, 0.0))
    running.send("nowhere", FORCE)
    running.send("base_link", force=(NAN, 0.0, 0.0), topic="impulse")
    running.wait_report(lambda _, v: (v["refused: not finite"], v["refused: unknown frame"]) == ("2", "1"), "refusals")
    assert running.call("clear_wrench").success
    assert running.set_parameter("gravity", [0.0, 0.0, -9.0]).successful
    assert running.set_parameter("gravity", SCENE["gravity"]).successful
    assert running.report()[1]["mode"] == WAITING
    running.drain()
    at_rest(running, 10)


def test_it_waits_where_it_is_put(running):
    at_rest(waiting_anew(running))
    running.send_pose("world", (1.0, 2.0, 3.0), (0.0, 1.0, 0.0, 0.0))
    running.wait(lambda: running.poses[-1].pose.position.x == 1.0, "the pose that was set")
    running.send_twist("world", (0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
    running.wait(lambda: running.twists[-1].twist.linear.z == -1.0, "the twist that was set, in body axes")
    running.clear()
    track = running.collect(20)
    assert_array_equal(track.position, np.tile((1.0, 2.0, 3.0), (len(track.position), 1)))
    assert set(np.diff(track.stamp_ns).tolist()) == {PERIOD_NS}
    assert running.report()[1]["mode"] == WAITING


def test_steps_while_paused_pass_without_motion_until_a_command(paused):
    waiting_anew(paused)
    first = paused.call("step").message
    assert first.endswith("; the body stays until the first command")
    at_rest(paused, 1)
    paused.clear()
    paused.send("base_link", FORCE, TORQUE)
    paused.wait_arrived("wrench")
    for _ in range(3):
        assert "stays" not in paused.call("step").message
    track = paused.collect(3)
    expected = alone_under(lambda simulation: simulation.set_wrench(PUSH, 0.05), 4)
    assert_array_equal(track.position, expected[1:, :3])
    assert_array_equal(track.angular, expected[1:, 10:])


# Bags -----------------------------------------------------------------------------------------------------------------


def recorded(connect, folder, **changes):
    """A node that records, to be talked to."""
    pytest.importorskip("rosbags")
    remote = connect({**SCENE, **changes, "record.path": str(folder)}).ready()
    remote.settle(0.2) if changes.get("start_paused") else remote.collect(20)
    return remote


def test_journal_repeats_it_to_the_bit(connect, tmp_path, capfd):
    """Waiting, put elsewhere meanwhile, a command, a reset after which it waits again, a blow."""
    from . import bag as bags

    remote = recorded(connect, tmp_path / "bag")
    remote.send_pose("world", (1.0, 2.0, 3.0), (0.4, 0.2, -0.8, 0.4))
    assert remote.set_together({"body.mass": 3.0}).successful
    for act in (
        lambda: remote.send("base_link", FORCE, TORQUE),
        lambda: remote.call("reset"),
        lambda: remote.call("clear_wrench"),
        lambda: remote.send("world", FORCE, TORQUE, topic="impulse"),
    ):
        act()
        remote.clear()
        remote.collect(20)
    remote.process.assert_stopped_cleanly()
    bag = bags.read(tmp_path / "bag", remote.name.removesuffix("/rigid_body_node"))
    kept = [call for call in bag.calls() if call not in ("scene", "clear_wrench")][-5:]
    assert kept == ["set_state", "change", "set_wrench", "reset", "apply_impulse"]
    assert bag.assert_repeats() > 160
    from rigid_body_sim.tools import resim

    assert resim.main([str(tmp_path / "bag")]) == resim.SAME
    out = capfd.readouterr().out
    assert "Equal to the bit" in out and "Until the first command the body stays where it is" in out


def test_commands_alone_repeat_it_to_the_bit(connect, tmp_path, capfd):
    """Stamped by whoever sends them with the time of the step they follow; the first, which is refused, sets off
    nothing."""
    from rigid_body_sim.tools import resim

    from ..bags import making

    remote = recorded(connect, tmp_path / "own", start_paused=True, outputs=["clock"])
    for step, force in ((3, (NAN, 0.0, 0.0)), (6, FORCE), (4, (0.0, 0.5, 0.0))):
        for _ in range(step):
            assert remote.call("step").success
        remote.wait(lambda: remote.poses, "a pose")
        send_stamped(remote, force)
    for _ in range(12):
        assert remote.call("step").success
    remote.process.assert_stopped_cleanly()
    making.make(tmp_path / "bag", making.without_journal(tmp_path / "own"), "mcap")
    scene = {**SCENE, "outputs": ["clock"]}
    for name, waits in (("scene", True), ("other", False)):
        text = yaml.safe_dump({"/**": {"ros__parameters": {**scene, "start_on_command": waits}}})
        (tmp_path / f"{name}.yaml").write_text(text)
    command = [str(tmp_path / "bag"), "--times", "header", "--scene"]
    assert resim.main([*command, str(tmp_path / "scene.yaml")]) == resim.SAME
    out = capfd.readouterr().out
    assert "Equal to the bit: " in out and "Until the first command the body stays where it is" in out
    assert resim.main([*command, str(tmp_path / "other.yaml")]) == resim.DIFFERS


def send_stamped(remote, force):
    """A command with the stamp of the latest pose, taken before the next step."""
    from geometry_msgs.msg import WrenchStamped

    remote.drain()
    message = WrenchStamped()
    message.header.stamp, message.header.frame_id = remote.poses[-1].header.stamp, "base_link"
    message.wrench.force.x, message.wrench.force.y, message.wrench.force.z = force
    remote._commands["wrench"].publish(message)
    if np.isnan(force).any():
        remote.wait_report(lambda _, values: values["refused: not finite"] == "1", "the refusal")
    else:
        remote.wait_arrived("wrench")


def test_lockstep_advances_by_the_first_command(connect, tmp_path, capfd):
    """As ever: in lockstep time stands still until then, so that nothing is waited for."""
    from rigid_body_sim.tools import resim

    remote = recorded(connect, tmp_path / "bag", lockstep=True, start_paused=True)
    assert remote.pause(False).message == "lockstep"
    remote.clear()
    for _ in range(5):
        remote.send("base_link", FORCE, TORQUE)
        remote.collect(1)
    track = remote.collect(5)
    simulation = Simulation.from_scene(Scene(SCENE))
    for position in track.position:
        simulation.set_wrench(PUSH, 0.05)
        simulation.step()
        assert_array_equal(position, simulation.state.position)
    remote.process.assert_stopped_cleanly()
    assert resim.main([str(tmp_path / "bag")]) == resim.SAME
    assert "Equal to the bit" in capfd.readouterr().out
