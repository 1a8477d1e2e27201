"""Steps that take long: the loop alone, on a clock that steps move forward. No DDS in here."""

import pytest

from rigid_body_sim import Scene, Simulation

pytest.importorskip("rclpy")
loops = pytest.importorskip("rigid_body_sim.ros.loop")

MILLISECOND = 1_000_000
SLEPT = 40 * MILLISECOND  # so that at 1 kHz 40 steps are due at once


class Slow:
    """A loop whose steps take ``cost_ns`` each, nothing else any time at all, and its own view of what happened."""

    def __init__(self, monkeypatch, heard=True, **parameters):
        scene = Scene({"rate": 1000.0, **parameters})
        self.now_ns, self.cost_ns, self.calls, self.heard, self.published = 10**15, 0, [], heard, []
        monkeypatch.setattr(loops.time, "monotonic_ns", lambda: self.now_ns)
        self.simulation = Simulation.from_scene(scene)
        self._step = self.simulation.step
        self.simulation.step = self.step
        self.loop = loops.Loop(scene, self.simulation, self, lambda _: None)
        self.loop.start(lambda: 0)
        self.loop.publish()

    def step(self, n):
        self.calls.append(n)
        self.now_ns += n * self.cost_ns
        self._step(n)

    def passing(self, advance, _):
        return advance

    def publish(self, _):
        self.published.append(self.simulation.steps)

    def turn(self):
        """Wall time [ns] of a turn, steps that it took, and the largest number of them in one call."""
        before_ns, steps = self.now_ns, self.simulation.steps
        self.calls.clear()
        self.loop.turn()
        return self.now_ns - before_ns, self.simulation.steps - steps, max(self.calls, default=0)


@pytest.fixture
def slow(monkeypatch):
    return lambda **more: Slow(monkeypatch, **more)


def test_stamps_begin_with_the_clock_when_time_begins(slow):
    """Not when the loop was made, which is long before: publishers, services and the compiler come in between."""
    node = slow()
    node.now_ns += 700 * MILLISECOND
    node.loop.start(lambda: node.now_ns + 5)
    assert node.loop.stamp_ns == node.now_ns + 5 and node.loop.pacer.deadline_ns() == node.now_ns + MILLISECOND
    node.now_ns += MILLISECOND
    node.turn()
    assert node.loop.stamp_ns == node.now_ns + 5


@pytest.mark.parametrize("heard", [True, False])
@pytest.mark.parametrize("publish_rate", [0.0, 10.0])
def test_others_wait_for_one_slow_step_at_most(slow, heard, publish_rate):
    """40 steps of 0.2 s are due: each turn takes one of them, whatever is published, and none is lost."""
    node = slow(heard=heard, publish_rate=publish_rate)
    node.now_ns, node.cost_ns = node.now_ns + SLEPT, 200 * MILLISECOND
    for _ in range(60):
        assert node.turn() == (node.cost_ns, 1, 1)
    assert node.loop.idle_ns(node.now_ns) <= 0
    behind = node.now_ns - 10**15 - node.simulation.time_ns - node.loop.pacer.slipped_ns
    assert 0 < behind <= 50 * MILLISECOND + node.cost_ns  # counted as slipped, but for what may be caught up


def test_steps_given_back_are_taken_later(slow):
    """Steps of 0.9 ms at 1 kHz: 40 ms are caught up in turns of 10 to 20 ms, at each of which others are served."""
    node = slow(publish_rate=0.0)
    node.now_ns, node.cost_ns = node.now_ns + SLEPT, 9 * MILLISECOND // 10
    turns = 0
    while node.loop.idle_ns(node.now_ns) <= 0:
        took, _, _ = node.turn()
        assert took < 20 * MILLISECOND
        turns += 1
    assert 25 < turns < 100  # measured 52, for 400 steps
    assert node.loop.pacer.slipped_ns == 0
    assert node.simulation.time_ns == (node.now_ns - 10**15) // MILLISECOND * MILLISECOND
    assert node.published == list(range(node.simulation.steps + 1))


def test_quick_steps_that_are_due_together_are_one_turn(slow):
    node = slow(heard=False)
    node.now_ns += SLEPT
    node.cost_ns = 1000
    took, steps, largest = node.turn()
    assert (took, steps) == (40_000, 40) and largest >= 8


def test_each_publication_counts_by_how_late_it_is(slow):
    """40 steps of 0.1 ms that are due together: the k-th was due after k ms and is published after 40 + 0.1 k ms."""
    node, late = slow(publish_rate=0.0), []
    node.loop.pacer.lateness.add = late.append
    node.now_ns, node.cost_ns = node.now_ns + SLEPT, MILLISECOND // 10
    node.turn()
    assert late == [SLEPT - 9 * k * MILLISECOND // 10 for k in range(1, 41)]


@pytest.mark.parametrize("heard", [True, False])
def test_free_run_finds_out_what_steps_cost(slow, heard):
    """A millisecond a turn when steps are quick; one step when they are slow."""
    node = slow(heard=heard, real_time_factor=0.0, publish_rate=1.0)
    node.cost_ns = 100
    for _ in range(3):
        took, steps, largest = node.turn()
        assert MILLISECOND <= took < 3 * MILLISECOND and largest >= (512 if heard else 2048)
        assert steps >= 10_000
    node.cost_ns = 200 * MILLISECOND
    for _ in range(3):
        assert node.turn() == (node.cost_ns, 1, 1)
