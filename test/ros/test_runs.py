"""Runs of steps while paused: the loop alone, with a list for its publishers. No DDS in here."""

import pytest

from rigid_body_sim import Scene, Simulation, Wrench

pytest.importorskip("rclpy")
loops = pytest.importorskip("rigid_body_sim.ros.loop")

SCENE = {"rate": 1000.0, "publish_rate": 100.0, "start_paused": True, "body.mass": 2.0}
MANY = 10**18
TOO_MUCH = Wrench(torque_body=(0.0, 0.0, 1e9))


class Published:
    """Steps at which something was published."""

    heard = True

    def __init__(self, simulation):
        self.simulation, self.steps = simulation, []

    def passing(self, advance, _):
        return advance

    def publish(self, _):
        self.steps.append(self.simulation.steps)

    def tick(self, _):
        raise AssertionError("a clock that stands still while steps are taken")


class Told:
    """A run, and what it said of itself."""

    def __init__(self, steps):
        self.progress, self.ends = [], []
        self.run = loops.Run(steps, lambda *taken_left: self.progress.append(taken_left), self.ends.append)


@pytest.fixture
def loop():
    scene = Scene(SCENE)
    simulation = Simulation.from_scene(scene)
    loop = loops.Loop(scene, simulation, Published(simulation), lambda _: None)
    loop.published = loop._outputs.steps
    return loop


def turn_until_ended(loop, told):
    turns = 0
    while not told.ends:
        assert loop.idle_ns(0) == 0, "the loop sleeps while there are steps to take"
        loop.turn()
        turns += 1
        assert turns < 10_000
    return turns


def test_run_takes_its_steps_and_no_other(loop):
    """Published every tenth step and at the last one, as ``~/step`` would."""
    told = Told(25)
    loop.begin_run(told.run)
    assert loop.simulation.steps == 0, "steps taken inside a service"
    turn_until_ended(loop, told)
    assert loop.simulation.steps == 25 and told.ends == [""]
    assert loop.published == [10, 20, 25]
    assert told.progress[-1] == (25, 0)
    assert loop.idle_ns(0) > 0


@pytest.mark.parametrize("epoch_ns", [0, 2_000_000_000 * 10**9, -5 * 10**9])
def test_a_step_whose_stamp_no_message_holds_is_one_that_cannot_be_done(epoch_ns):
    """At 1 mHz: the last whole kilosecond before 2^31 s. Time begins anew at a reset, for there is none left."""
    scene = Scene({**SCENE, "rate": 1e-3, "publish_rate": 0.0, "initial.linear_velocity": (1.0, 0.0, 0.0)})
    simulation, complaints = Simulation.from_scene(scene), []
    loop = loops.Loop(scene, simulation, Published(simulation), complaints.append)
    loop.start(lambda: epoch_ns)
    last = (2**31 - epoch_ns // 10**9) // 1000
    loop.step(last)
    assert abs(loop.stamp_ns - epoch_ns - last * 1000 * 10**9) < 100  # 1e-3 is no float: 45 ns
    assert loop.stamp_ns < 2**31 * 10**9 <= loop.stamp_ns + 1000 * 10**9
    assert simulation.state.position[0] == pytest.approx(last * 1e3, rel=1e-15)
    for _ in range(2):
        with pytest.raises(loops.StoppedError, match=r"its stamp would be of 2\^31 s or more, which no message"):
            loop.step()
    assert (simulation.steps, loop.mode, len(complaints)) == (last, "stopped", 1)
    assert loop.reset() == "initial state, no wrench, simulated time from zero"
    told = Told(last + 2)
    loop.begin_run(told.run)
    turn_until_ended(loop, told)
    assert simulation.steps == last and "2^31 s" in told.ends[0]


@pytest.mark.parametrize("mode", [{"lockstep": True, "steps_per_command": 100_000}, {"real_time_factor": 0.0}])
@pytest.mark.parametrize("epoch_ns", [0, 1_790_000_000_123_456_789])
def test_another_time_alone_makes_good_that_no_stamp_was_left(mode, epoch_ns):
    """By commands, and as fast as possible: the motion goes on from the last state, which was good."""
    scene = Scene({"rate": 1e-3, "publish_rate": 0.0, "initial.linear_velocity": (1.0, 0.0, 0.0), **mode})
    simulation = Simulation.from_scene(scene)
    loop = loops.Loop(scene, simulation, Published(simulation), lambda _: None)
    loop.start(lambda: epoch_ns)
    advance = loop.on_command if loop.lockstep else loop.turn
    for _ in range(100_000):
        advance()
        if loop.failure:
            break
    assert 2**31 * 10**9 - 1000 * 10**9 <= loop.stamp_ns < 2**31 * 10**9
    position = simulation.state.position[0]
    assert position == pytest.approx(simulation.time, rel=1e-12)
    assert loop.reset(state=False, time_too=True) == "state kept, simulated time from zero"
    assert (loop.failure, loop.stamp_ns, simulation.state.position[0]) == ("", epoch_ns, position)
    advance()
    assert simulation.state.position[0] == pytest.approx(position + simulation.time, rel=1e-12)
    assert simulation.steps > 0 and not loop.failure


def test_run_and_single_steps_lead_to_the_same_bits(loop):
    """Also where a wrench ends within the run."""
    loop.simulation.set_wrench(Wrench(force_body=(1.0, 0.2, 0.0), torque_body=(0.1, 0.0, 0.3)), hold=0.777)
    other = Simulation.from_scene(Scene(SCENE))
    other.restore(loop.simulation.save())
    told = Told(2000)
    loop.begin_run(told.run)
    turn_until_ended(loop, told)
    for _ in range(2000):
        other.step()
    assert loop.simulation.save() == other.save()


def test_progress_counts_every_step(loop):
    told = Told(200_000)
    loop.begin_run(told.run)
    turns = turn_until_ended(loop, told)
    assert len(told.progress) == turns
    assert all(taken + left == 200_000 for taken, left in told.progress)
    assert [taken for taken, _ in told.progress] == sorted({taken for taken, _ in told.progress})


def test_run_of_no_steps_ends_at_once(loop):
    told = Told(0)
    loop.begin_run(told.run)
    assert turn_until_ended(loop, told) == 1
    assert loop.simulation.steps == 0 and told.ends == [""]


def test_turn_ends_although_the_run_does_not(loop):
    """10¹⁸ steps take longer than anybody waits; each turn gives the rest of the node its time."""
    told = Told(MANY)
    loop.begin_run(told.run)
    for _ in range(3):
        loop.turn()
    assert not told.ends and 0 < loop.simulation.steps < MANY
    loop.end_run("enough")
    steps = loop.simulation.steps
    loop._outputs.tick = lambda _: None
    loop.turn()
    assert told.ends == ["enough"] and loop.simulation.steps == steps
    loop.end_run("again")
    assert told.ends == ["enough"], "one run has two ends"


@pytest.mark.parametrize(
    ("act", "why"),
    [
        (lambda loop: loop.pause(False), "set going"),
        (lambda loop: loop.reset(), "was reset"),
        (lambda loop: loop.reset(state=False, time_too=True), "was reset"),
    ],
)
def test_what_ends_a_run(loop, act, why):
    told = Told(MANY)
    loop.begin_run(told.run)
    loop.turn()
    act(loop)
    assert len(told.ends) == 1 and why in told.ends[0]


def test_one_run_at_a_time(loop):
    told = Told(MANY)
    loop.begin_run(told.run)
    for another in (lambda: loop.begin_run(Told(1).run), loop.step):
        with pytest.raises(loops.StoppedError, match="still to be taken; wait, or cancel them"):
            another()
    assert not told.ends
    loop.end_run("")


def test_run_needs_a_pause(loop):
    loop.pause(False)
    with pytest.raises(loops.StoppedError, match="not paused"):
        loop.begin_run(Told(1).run)


def test_run_that_cannot_go_on_says_why(loop):
    loop.simulation.set_wrench(TOO_MUCH)
    told = Told(100)
    loop.begin_run(told.run)
    turn_until_ended(loop, told)
    assert len(told.ends) == 1 and "cannot be done" in told.ends[0]
    assert told.progress[-1][1] > 0
    with pytest.raises(loops.StoppedError, match="cannot be done"):
        loop.begin_run(Told(1).run)
    assert loop.published[-1] == loop.simulation.steps, "the last good state is not shown"
    assert len(set(loop.published)) == len(loop.published), "a state is published twice"


def test_several_steps_at_once_publish_as_the_loop_does(loop):
    loop.step(25)
    assert loop.published == [10, 20, 25]
    loop.step(5)
    assert loop.published == [10, 20, 25, 30]


@pytest.mark.parametrize(("state", "time_too"), [(True, True), (True, False), (False, True)])
def test_reset_of_state_and_time_apart(loop, state, time_too):
    loop.simulation.set_wrench(Wrench(force_world=(2.0, 0.0, 0.0)))
    loop.step(100)
    moved = loop.simulation.state.position[0]
    assert moved == pytest.approx(0.005, rel=1e-12)  # F t² / 2 m; measured 1.1e-16 off
    loop.reset(state=state, time_too=time_too)
    assert loop.simulation.state.position[0] == (0.0 if state else moved)
    assert loop.stamp_ns == (0 if time_too else 100_000_000)
    assert loop.published[-1] == loop.simulation.steps
