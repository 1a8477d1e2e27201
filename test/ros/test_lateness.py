"""The p99 of lateness from a histogram, against sorting. No ROS in here."""

import random

import pytest

from rigid_body_sim.ros.lateness import BIN_NS, BINS, Lateness
from rigid_body_sim.ros.pacing import Pacer

START = 123_456_789_012_345


@pytest.mark.parametrize("count", [1, 99, 100, 101, 1000, 20_000])
@pytest.mark.parametrize("typical_ns", [3_000, 80_000, 2_000_000])
def test_at_most_a_hundredth_is_later_and_a_bin_less_would_be_too_little(count, typical_ns):
    rng, lateness = random.Random(count + typical_ns), Lateness()
    late = [int(rng.expovariate(1 / typical_ns)) for _ in range(count)]
    for late_ns in late:
        lateness.add(late_ns)
    late_ns = lateness.take_p99_ns()
    assert sum(one > late_ns for one in late) <= count // 100
    if late_ns < (BINS - 1) * BIN_NS:  # beyond that it may be the largest
        assert sum(one >= late_ns - BIN_NS for one in late) > count // 100
    assert lateness.take_p99_ns() == 0


def test_what_lies_beyond_the_bins_is_not_made_smaller():
    lateness = Lateness()
    lateness.add(10 * BINS * BIN_NS)
    assert lateness.take_p99_ns() == 10 * BINS * BIN_NS


def test_publication_is_late_by_the_time_since_its_own_deadline():
    """Five steps given out at once: each has a deadline of its own, and is published at a time of its own."""
    pacer, late = Pacer(1000.0, START), []
    pacer.lateness.add = late.append
    assert pacer.due(START + 5_300_000) == 5
    for waiting in (4, 3, 2, 1, 0):
        pacer.published(waiting, START + 5_400_000)
    assert late == [4_400_000, 3_400_000, 2_400_000, 1_400_000, 400_000]
