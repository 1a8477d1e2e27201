"""Times in a bag without a journal: what is odd about them, and at which step a command took effect."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..bags.reading import Messages
from ..bags.rosbags_support import BagError
from ..kernels.arrays import Integers

NANOSECONDS = 1_000_000_000
MOST_LATE_NS = NANOSECONDS  # what is further behind is no message that took longer, but time that was set back
MOST_LATE_IN_A_ROW = 10
NEAR_NS = NANOSECONDS  # how far a stamp may be from what it should be near to
LATENCY_NS = 5_000_000  # most that a pose takes to the recorder; simulated time that begins later is further behind
GAP = 1.5  # times the usual interval: poses are stamped with simulated time, so one that is lost leaves 2
HEADER, RECEIVE = "header", "receive"


@dataclass(frozen=True)
class Times:
    """When each command of a topic reached the simulation [ns of simulated time], and how that is known."""

    ns: Integers
    source: str


def order(path: Path, topic: str, stamp_ns: Integers, remedy: str) -> Integers:
    """Indices in the order of the stamps, equal ones as they came.

    Raises BagError, with what would help, where they go further back than messages do that take longer than others.
    """
    latest = np.maximum.accumulate(stamp_ns)
    late = stamp_ns < latest
    if late.any():
        _refuse_set_back(path, topic, latest - stamp_ns, late, remedy)
    return np.argsort(stamp_ns, kind="stable")


def last_of_equal(ordered_ns: Integers) -> NDArray[np.bool_]:
    """Which of rising stamps are not followed by the same."""
    return np.append(np.diff(ordered_ns) > 0, True)


def _refuse_set_back(path: Path, topic: str, late_ns: Integers, late: NDArray[np.bool_], remedy: str) -> None:
    edges = np.flatnonzero(np.diff(np.concatenate(([0], late.astype(np.int8), [0]))))
    rows = edges[1::2] - edges[::2]
    if late_ns.max() > MOST_LATE_NS or rows.max() > MOST_LATE_IN_A_ROW:
        first = int(edges[0])
        raise BagError(
            f"{path}: the stamps of {topic} go backwards by {late_ns[first] / NANOSECONDS:.6g} s at message "
            f"{first + 1}: time was set back, or two runs are in one bag; {remedy}"
        )


def oddities(what: str, times_ns: Integers, longest_ns: float | None = None) -> str:
    """A sentence about late, repeated and missing messages in times as they came; empty when there are none.

    A gap is longer than ``longest_ns``, or else than GAP times the usual interval.
    """
    if len(times_ns) < 2:
        return ""
    found = []
    if late := int((times_ns < np.maximum.accumulate(times_ns)).sum()):
        found.append(f"{late} out of order (put in order)")
    ordered = np.sort(times_ns)
    intervals = np.diff(ordered)
    if twice := int((intervals == 0).sum()):
        found.append(f"{twice} with the time of another (the later one counts)")
    if longest_ns is None:
        longest_ns = GAP * np.median(intervals[intervals > 0]) if intervals.any() else math.inf
    gaps = np.flatnonzero(intervals > longest_ns)
    if len(gaps):
        longest = gaps[np.argmax(intervals[gaps])]
        count = "1 gap" if len(gaps) == 1 else f"{len(gaps)} gaps"
        length, at = intervals[longest] / NANOSECONDS, (ordered[longest] - ordered[0]) / NANOSECONDS
        found.append(f"{count} of more than {longest_ns / NANOSECONDS:.4g} s, the longest {length:.4g} s at {at:.4g} s")
    return f"{what}: {', '.join(found)}." if found else ""


def of_commands(commands: Messages, poses: Messages | None, asked: str | None) -> Times:
    """When commands reached the simulation: as their headers say where that can be, else as they were received.

    The base is that of the poses' stamps. Times of the recorder's clock are carried over to it by the poses, each of
    which has a time of receipt and a stamp. ``asked`` is "header" or "receive" to have one of the two.
    """
    unusable = _unusable(commands, poses)
    if asked == RECEIVE or (asked is None and unusable):
        why = "as asked for" if asked else unusable
        return Times(_carried_over(commands.receive_ns, poses), f"the times of receipt ({why})")
    told = "the stamps in their headers"
    other_clock = poses is not None and not _answers(commands, poses) and not _stamped_as_sent(poses)
    if other_clock and _near(commands.stamp_ns, commands.receive_ns):
        return Times(_carried_over(commands.stamp_ns, poses), f"{told}, which are wall-clock time, not simulated time")
    return Times(commands.stamp_ns, told)


def _unusable(commands: Messages, poses: Messages | None) -> str:
    """Why the stamps in headers do not tell when commands reached the simulation; empty when they may."""
    stamps = commands.stamp_ns
    if not stamps.all():
        return "not every header has a stamp"
    if poses is not None and _answers(commands, poses):
        return "their headers repeat the stamps of the poses they answer"  # and arrived after them, who knows when
    if _near(stamps, commands.receive_ns):
        return ""
    if poses is None or stamps.min() < poses.stamp_ns.min() - NEAR_NS or stamps.max() > poses.stamp_ns.max() + NEAR_NS:
        return "the stamps in their headers are of another time"
    return ""


def _near(stamps: Integers, times: Integers) -> bool:
    return bool(np.abs(stamps - times).max() < NEAR_NS)


def _stamped_as_sent(poses: Messages) -> bool:
    """Whether the recorder's clock shows what is in the poses' stamps: simulated time has not fallen behind."""
    return 0.0 <= np.median(poses.receive_ns - poses.stamp_ns) < LATENCY_NS


def _answers(commands: Messages, poses: Messages) -> bool:
    """Whether most commands carry the stamp of a pose, which they answer."""
    return bool(np.isin(commands.stamp_ns, poses.stamp_ns).mean() > 0.5)


def _carried_over(clock_ns: Integers, poses: Messages | None) -> Integers:
    """Times of the recorder's clock as simulated time: where the clock stood when poses came, simulated time stood."""
    if poses is None:
        return clock_ns
    clock, simulated = np.sort(poses.receive_ns), np.sort(poses.stamp_ns)  # some may have overtaken others
    apart = last_of_equal(clock)
    clock, simulated = clock[apart], simulated[apart]
    # Relative to the first, so that floats hold every nanosecond of some months.
    base, zero = clock[0], simulated[0]
    moved = np.interp(clock_ns - base, clock - base, simulated - zero)
    before = np.minimum(clock_ns - base, 0)
    after = np.maximum(clock_ns - clock[-1], 0)
    return zero + np.rint(moved).astype(np.int64) + before + after


def seconds(time_ns: int) -> str:
    """A time [ns] in seconds, every digit."""
    return f"{time_ns // NANOSECONDS}.{time_ns % NANOSECONDS:09d} s"


def steps_at(times_ns: Integers, rate: float) -> Integers:
    """The last step whose time is not after each of ``times_ns`` [ns since step 0]: floor, but for round-off.

    A stamp and that of step 0, in a bag that begins late, may each be half a nanosecond from the time of its step.
    """
    return np.floor((times_ns + 1.0) * (rate / NANOSECONDS) * (1.0 + 1e-15)).astype(np.int64)


def nearest_steps(times_ns: Integers, rate: float) -> Integers:
    """The step nearest to each of ``times_ns`` [ns since step 0]."""
    return np.rint(times_ns * (rate / NANOSECONDS)).astype(np.int64)
