"""Steps due by a clock: a fake one, so that hours pass in no time. No ROS in here."""

import random
from fractions import Fraction

import pytest

from rigid_body_sim.ros.pacing import LONGEST_BACKLOG, NANOSECONDS, Pacer

START = 123_456_789_012_345
RATES = [1000.0, 300.0, 7.0, 0.3, 1e-3, 999.999, 1234.5678, 44100.0, 1e6, 1 / 3]
BACKLOG_NS = round(LONGEST_BACKLOG * NANOSECONDS)


def exact_steps(rate, elapsed_ns):
    """Steps whose time, in exact arithmetic, has come."""
    return int(Fraction(rate) * elapsed_ns / NANOSECONDS)


def calls(rng, mean_ns, count):
    """Times of calls by a loop that is now early and now late, never by as much as the longest backlog."""
    now = START
    for _ in range(count):
        now += rng.randrange(1, 2 * min(mean_ns, BACKLOG_NS // 2))
        yield now


@pytest.mark.parametrize("rate", RATES)
def test_neither_loses_nor_repeats_a_step(rate):
    """However irregular the calls, the steps given out are those whose time has come."""
    pacer, rng, given = Pacer(rate, START), random.Random(1), 0
    for now in calls(rng, 2_000_000, 20_000):
        due = pacer.due(now)
        assert due >= 0
        given += due
        assert given == exact_steps(rate, now - START)
    assert pacer.slipped_ns == 0


@pytest.mark.parametrize("rate", RATES)
def test_waking_at_the_deadline_gives_exactly_one_step(rate):
    """One nanosecond sooner gives none: the deadline is the first nanosecond at which the step is due."""
    pacer = Pacer(rate, START)
    for step in range(1, 2000):
        deadline = pacer.deadline_ns()
        assert deadline - START == -(-step * NANOSECONDS * Fraction(rate).denominator // Fraction(rate).numerator)
        assert pacer.due(deadline - 1) == 0
        assert pacer.due(deadline) == 1
        assert pacer.due(deadline) == 0
    assert pacer.take_latest_ns() == 0 and pacer.slipped_ns == 0


@pytest.mark.parametrize("rate", RATES)
def test_mean_rate_is_exact_after_a_year(rate):
    """Deadlines come from the count of steps, so that no error adds up: step k is due at k / rate to the nanosecond."""
    pacer, given = Pacer(rate, START), 0
    year = 365 * 24 * 3600
    pacer._done = given = exact_steps(rate, year * NANOSECONDS)  # as if all steps of that year had been given out
    assert pacer.deadline_ns() - START == -(-(given + 1) * NANOSECONDS // Fraction(rate))
    for now in calls(random.Random(2), 2_000_000, 1000):
        now += year * NANOSECONDS
        given += pacer.due(now)
        assert given == exact_steps(rate, now - START)


def test_lateness_is_that_of_the_oldest_step_given_out():
    pacer = Pacer(1000.0, START)
    assert pacer.due(START + 1_000_300) == 1
    assert pacer.due(START + 6_400_000) == 5
    assert pacer.due(START + 7_000_000) == 1
    assert pacer.take_latest_ns() == 4_400_000
    assert pacer.take_latest_ns() == 0


@pytest.mark.parametrize("factor", [0.1, 0.5, 3.0, 100.0])
def test_factor_scales_the_pace_exactly(factor):
    pacer, given = Pacer(300.0, START, factor), 0
    for now in calls(random.Random(3), 2_000_000, 5000):
        given += pacer.due(now)
        assert given == exact_steps(Fraction(300) * Fraction(factor), now - START)


def test_change_of_pace_loses_and_repeats_nothing():
    pacer = Pacer(1000.0, START)
    assert pacer.due(START + 10_500_000) == 10
    pacer.set_factor(2.0, START + 10_500_000)
    assert not pacer.free
    assert pacer.due(START + 10_999_999) == 0
    assert pacer.due(START + 11_000_000) == 1
    pacer.set_factor(0.0, START + 11_000_000)
    assert pacer.free


def test_backlog_up_to_the_limit_is_caught_up():
    pacer = Pacer(1000.0, START)
    late = START + 1_000_000 + BACKLOG_NS
    assert pacer.due(late) == 51
    assert pacer.slipped_ns == 0


@pytest.mark.parametrize("rate", [1000.0, 300.0, 44100.0])
def test_longer_backlog_slips_instead_of_bursting(rate):
    """After a stall of a minute: at most a backlog of steps at once, the rest of the minute given up and counted."""
    pacer = Pacer(rate, START)
    stall = 60 * NANOSECONDS
    due = pacer.due(START + stall)
    assert due == exact_steps(rate, BACKLOG_NS) + 1
    first_step = -(-NANOSECONDS // Fraction(rate))
    assert pacer.slipped_ns == stall - first_step - BACKLOG_NS
    now, given = START + stall, due
    for _ in range(1000):  # on time from here on: simulated time runs behind by what has slipped, and by no more
        now = pacer.deadline_ns()
        given += pacer.due(now)
        assert given == exact_steps(rate, now - START - pacer.slipped_ns)


def test_machine_half_as_fast_as_needed_runs_at_half_speed():
    """Each call returns the steps due, and computing them takes twice the time that they simulate."""
    pacer, now, given = Pacer(1000.0, START), START, 0
    for _ in range(5000):
        due = pacer.due(now)
        assert due <= 51
        given += due
        now = max(now + due * 2_000_000, pacer.deadline_ns() if due == 0 else 0)
    elapsed = now - START
    assert given * 1_000_000 == pytest.approx(elapsed / 2, rel=1e-3)
    assert pacer.slipped_ns + given * 1_000_000 == pytest.approx(elapsed, abs=3 * BACKLOG_NS)


def test_start_after_a_pause_owes_nothing():
    pacer = Pacer(1000.0, START)
    assert pacer.due(START + 2_500_000) == 2
    resumed = START + 3600 * NANOSECONDS
    pacer.start(resumed)
    assert pacer.due(resumed) == 0
    assert pacer.deadline_ns() == resumed + 1_000_000
    assert pacer.due(resumed + 1_000_000) == 1
    assert pacer.slipped_ns == 0


def test_clock_that_stands_still_or_goes_back_gives_nothing():
    pacer = Pacer(1000.0, START)
    assert pacer.due(START + 5_000_000) == 5
    assert pacer.due(START + 5_000_000) == 0
    assert pacer.due(START) == 0
    assert pacer.due(START + 6_000_000) == 1
