"""Waits between deadlines, by a fake clock: which of them are the executor's."""

import pytest

from rigid_body_sim.ros import executor
from rigid_body_sim.ros.executor import UNSERVED_NS, IdleTime
from rigid_body_sim.ros.pacing import NANOSECONDS

pytestmark = pytest.mark.ros  # importing the executor needs rclpy

PERIOD_NS = 100_000


class Clock:
    """Time that passes only while somebody waits; also the executor, with an event at each time of ``events``."""

    def __init__(self):
        self.now_ns, self.events, self.served_ns, self.asked = 1_000_000, [], [], 0

    def monotonic_ns(self):
        return self.now_ns

    def sleep(self, seconds):
        self.now_ns += round(seconds * NANOSECONDS)

    def spin_once(self, timeout_sec):
        self.asked += 1
        end_ns = self.now_ns + round(timeout_sec * NANOSECONDS)
        if self.events and self.events[0] <= end_ns:
            self.now_ns = max(self.now_ns, self.events.pop(0))
            self.served_ns.append(self.now_ns)
        else:
            self.now_ns = end_ns


@pytest.fixture
def clock(monkeypatch):
    """A fake clock in the place of the module's."""
    clock = Clock()
    monkeypatch.setattr(executor, "time", clock)
    return clock


def run(clock, steps, period_ns=PERIOD_NS):
    """A loop with a deadline in each period."""
    idle, due_ns = IdleTime(clock), clock.now_ns
    for _ in range(steps):
        due_ns += period_ns
        while clock.now_ns < due_ns:
            idle.spend(clock.now_ns, due_ns - clock.now_ns)


def test_of_short_waits_few_are_the_executors(clock):
    run(clock, 1000)
    assert clock.now_ns == 1_000_000 + 1000 * PERIOD_NS
    assert clock.asked == pytest.approx(1000 * PERIOD_NS / UNSERVED_NS, rel=0.02)


def test_of_long_waits_all_are(clock):
    run(clock, 100, period_ns=UNSERVED_NS)
    assert clock.asked == 100


def test_nobody_waits_longer_than_promised(clock):
    came = [1_000_000 + 777_777 * i for i in range(1, 50)]
    clock.events = came.copy()
    run(clock, 600)
    assert len(clock.served_ns) == len(came)
    assert max(served - at for served, at in zip(clock.served_ns, came, strict=True)) <= UNSERVED_NS


def test_many_at_once_are_served_one_after_the_other(clock):
    at_ns = 1_000_000 + 20 * PERIOD_NS
    clock.events = [at_ns] * 30
    run(clock, 40)
    assert len(clock.served_ns) == 30 and clock.served_ns[-1] == clock.served_ns[0]


def test_a_loop_that_has_fallen_behind_asks_once_a_turn(clock):
    idle = IdleTime(clock)
    for _ in range(5):
        idle.spend(clock.now_ns, -50)
    assert clock.asked == 5
