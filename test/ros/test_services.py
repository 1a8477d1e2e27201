"""Services, run-time parameters, diagnostics and a step that cannot be done.

One node runs with the defaults for time; one starts paused and sets time back at a reset.
"""

import array
import ast

import numpy as np
import pytest

from .remote import stamp_ns

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros

RATE = 200
PERIOD = 5_000_000  # ns
SCENE = {"rate": float(RATE), "publish_rate": 0.0, "wrench.timeout": 0.0, "body.mass": 2.0}
TOO_MUCH = 1e9  # N m on 0.1 kg m²: 10⁵ rad and more in one step


@pytest.fixture(scope="module")
def nodes(connect_shared):
    started = {
        "running": connect_shared(SCENE),
        "paused": connect_shared({**SCENE, "start_paused": True, "reset_time": True}),
    }
    return {name: remote.ready() for name, remote in started.items()}


@pytest.fixture
def running(nodes):
    node = nodes["running"]
    node.pause(False)
    node.fresh()
    yield node
    node.pause(False)


@pytest.fixture
def paused(nodes):
    node = nodes["paused"]
    node.pause(True)
    node.fresh()
    return node


def test_pause_is_idempotent_and_says_what_it_did(running):
    words = [running.pause(flag).message for flag in (False, True, True, False)]
    assert words == ["already running", "paused", "already paused", "running"]


def test_pause_stops_stamps_and_resumes_with_the_next(running):
    running.collect(20)
    assert running.pause(True).success
    running.settle()
    count = len(running.poses)
    status, _ = running.wait_report(lambda _, values: values["mode"] == "paused", "mode paused")
    assert status.message == "paused"
    assert len(running.poses) == count, "a pose while paused"
    running.pause(False)
    track = running.collect(count + 20)
    assert set(np.diff(track.stamp_ns)) == {PERIOD}


def test_pause_keeps_the_wrench(running):
    running.send("world", force=(2.0, 0.0, 0.0))
    track = running.collect_motion(10)
    running.pause(True)
    running.pause(False)
    before = len(running.poses)
    track = running.collect(before + 10)
    assert track.linear[:, 0] == pytest.approx(np.arange(len(track.linear)) / RATE, rel=1e-12, abs=0.0)


def test_step_is_refused_while_running(running):
    answer = running.call("step")
    assert not answer.success
    assert answer.message == "not paused; call ~/pause with true first"


def test_reset_keeps_stamps_increasing(running):
    running.send("world", force=(2.0, 0.0, 0.0))
    running.wait(lambda: running.twists[-1].twist.linear.x > 0.1, "motion")
    answer = running.call("reset")
    assert answer.success and answer.message == "initial state, no wrench, simulated time goes on"
    running.wait(lambda: running.twists[-1].twist.linear.x == 0.0, "a body at rest")
    track = running.collect(len(running.poses) + 20)
    assert set(np.diff(track.stamp_ns)) == {PERIOD}, "a gap or a repeat over the reset"
    assert not track.position[-20:].any() and not track.linear[-20:].any(), "the wrench was not cleared"


def test_starts_paused(nodes):
    """Before anybody stepped it: the log says so, and simulated time stands at zero."""
    node = nodes["paused"]
    assert ", paused\n" in node.process.stderr
    _, values = node.report()
    assert values["steps"] == "0" and values["mode"] == "paused"


def test_step_does_one_step_whose_messages_are_out_before_the_answer(paused):
    last = stamp_ns(paused.poses[-1])
    for count in range(1, 31):
        paused.clear()
        answer = paused.call("step")
        assert answer.success and answer.message == f"step {count}, simulated time {count / RATE:.9g} s"
        paused.drain()  # what had arrived with the answer, without waiting for more
        assert [stamp_ns(m) - last for m in paused.poses] == [PERIOD]
        assert [stamp_ns(m) - last for m in paused.twists] == [PERIOD]
        last += PERIOD


def test_steps_follow_the_wrench(paused):
    """Steps on demand are the same steps: v = n F h / m once the command is there."""
    paused.send("world", force=(2.0, 0.0, 0.0))
    while not paused.twists[-1].twist.linear.x:
        paused.call("step")
        paused.settle()
    for _ in range(9):
        paused.call("step")
    track = paused.collect_motion(11)
    n = np.arange(11)
    assert track.linear[:, 0] == pytest.approx(n / RATE, rel=1e-12, abs=0.0)
    assert track.position[:, 0] == pytest.approx((n / RATE) ** 2 / 2, rel=1e-12, abs=0.0)


def test_reset_time_sets_stamps_back(paused):
    start = stamp_ns(paused.poses[-1])
    for _ in range(3):
        paused.call("step")
    paused.wait(lambda: stamp_ns(paused.poses[-1]) == start + 3 * PERIOD, "the third step")
    paused.settle()
    answer = paused.call("reset")
    assert answer.success and answer.message == "initial state, no wrench, simulated time from zero"
    paused.wait(lambda: stamp_ns(paused.poses[-1]) == stamp_ns(paused.twists[-1]) == start, "a pose from zero")


# Parameters while running -------------------------------------------------------------------------------------------


def test_parameters_can_be_read(running):
    assert running.get_parameters("body.mass", "rate", "twist_frame", "wrench.timeout") == [2.0, 200.0, "body", 0.0]
    assert list(running.get_parameters("body.inertia")[0]) == [0.1, 0.1, 0.1, 0.0, 0.0, 0.0]


def test_array_that_is_not_used_is_an_empty_one_of_floats(running):
    """rclpy by itself would make it an array of bytes."""
    (dimensions,) = running.get_parameters("body.dimensions")
    assert isinstance(dimensions, array.array) and dimensions.typecode == "d" and len(dimensions) == 0
    result = running.set_parameter("body.dimensions", [1.0])
    assert not result.successful and "is read at start only" in result.reason


def test_mass_and_inertia_that_follow_from_a_shape_can_be_read(connect):
    node = connect({"body": {"shape": "box", "dimensions": [2.0, 1.0, 1.0], "density": 6.0, "urdf_file": ""}})
    node.ready()
    mass, inertia, dimensions = node.get_parameters("body.mass", "body.inertia", "body.dimensions")
    assert (mass, list(dimensions)) == (12.0, [2.0, 1.0, 1.0])
    assert list(inertia) == [2.0, 5.0, 5.0, 0.0, 0.0, 0.0]


def test_empty_array_may_be_given(connect):
    """It reaches rclpy without a type and without a value."""
    node = connect({"body": {"dimensions": [], "mass": 3.0}})
    node.ready()
    assert node.get_parameters("body.mass") == [3.0]


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("body.center_of_mass", [0.0, 0.0, 0.1], "is read at start only"),
        ("integrator.name", "rk4", "integrator.name = 'rk4': is read at start only"),
        ("use_sim_time", True, "this node makes the simulated time"),
        ("use_sim_time", 3, "parameter use_sim_time = 3: is not of type bool; leave it false"),
        ("nonsense", 1.0, "parameter nonsense is not known; the parameters are "),
    ],
)
def test_parameter_refused_at_run_time(running, name, value, reason):
    """With a reason, and the node lives on."""
    result = running.set_parameter(name, value)
    assert not result.successful
    assert result.reason and reason in result.reason
    running.clear()
    running.collect(3)
    assert running.get_parameters("body.mass", "use_sim_time") == [2.0, False]


# Diagnostics --------------------------------------------------------------------------------------------------------


def test_diagnostics_of_a_moving_body(running):
    running.send("world", force=(2.0, 0.0, 0.0), torque=(0.0, 0.0, 0.1))
    running.collect_motion(RATE)
    running.report()  # the interval of the next one has no reset in it
    status, values = running.report()
    assert status.level == b"\x00" or "slower than real time" in status.message, status
    assert values["mode"] == "running"
    assert "mass 2 kg" in values["plan"] and "rate 200 Hz" in values["plan"] and "taylor" in values["plan"]
    assert int(values["steps"]) > RATE
    assert float(values["simulated time [s]"]) == int(values["steps"]) / RATE
    assert float(values["achieved rate [Hz]"]) == pytest.approx(RATE * float(values["real-time factor"]), rel=1e-3)
    assert 0.0 < float(values["real-time factor"]) < 1.2
    assert float(values["largest lateness [s]"]) >= 0.0 and float(values["slipped time [s]"]) >= 0.0
    assert abs(float(values["|q| - 1"])) < 1e-15
    assert_energy_and_momentum(values)


def assert_energy_and_momentum(values):
    """Every figure follows from the age of the command: P = F t, L = τ t, and the energy from both."""
    seconds = float(values["wrench age [s]"])
    momentum = ast.literal_eval(values["momentum [kg m/s]"])
    angular = ast.literal_eval(values["angular momentum [kg m2/s]"])
    assert momentum == pytest.approx([2.0 * seconds, 0.0, 0.0], rel=1e-12)
    assert angular == pytest.approx([0.0, 0.0, 0.1 * seconds], rel=1e-12)
    kinetic = momentum[0] ** 2 / (2 * 2.0) + angular[2] ** 2 / (2 * 0.1)
    assert float(values["kinetic energy [J]"]) == pytest.approx(kinetic, rel=1e-12)
    assert float(values["potential energy [J]"]) == 0.0


def test_wrench_age_before_any_command(running):
    _, values = running.report()
    assert values["wrench age [s]"] == "none yet"


def test_step_that_cannot_be_done_stops_a_running_node_until_reset(running):
    running.send("base_link", torque=(0.0, 0.0, TOO_MUCH))
    status, values = running.wait_report(lambda status, _: status.level == b"\x02", "status ERROR")
    assert values["mode"] == "stopped"
    assert "cannot be done" in status.message and "last good state is kept" in status.message
    assert status.message in running.process.stderr and "~/reset starts afresh" in running.process.stderr
    running.settle()
    track = running.track()
    assert all(np.isfinite(values).all() for values in (track.position, track.orientation, track.linear, track.angular))
    last = track.stamp_ns[-1]
    assert "cannot be done" in running.call("step").message
    answer = running.pause(False)
    assert not answer.success and "~/reset starts afresh" in answer.message  # not "running", which it is not
    answer = running.call("reset")
    assert answer.success
    running.clear()
    assert running.collect(3).stamp_ns[0] > last
    status, values = running.wait_report(lambda _, values: values["mode"] == "running", "mode running")
    assert status.level != b"\x02"


def test_step_that_cannot_be_done_is_said_by_the_step_service(paused):
    """Answer with the sentence; the last good state stays, and a reset recovers."""
    paused.send("base_link", torque=(0.0, 0.0, TOO_MUCH))
    steps, answer = 0, paused.call("step")
    while answer.success and steps < 1000:  # until the command has arrived
        steps, answer = steps + 1, paused.call("step")
    assert "cannot be done" in answer.message
    paused.settle()
    before = len(paused.poses)
    assert paused.call("step").message == answer.message
    paused.settle()
    assert len(paused.poses) == before, "a pose for a step that was not done"
    assert np.isfinite(paused.track().angular).all()
    assert paused.call("reset").success
    assert paused.call("step").success
