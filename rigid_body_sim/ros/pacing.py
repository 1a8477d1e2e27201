"""How many steps are due: counted from a clock, never from the number of times somebody called."""

from fractions import Fraction

from .lateness import Lateness

NANOSECONDS = 1_000_000_000
# s of wall time. What is further behind is given up: simulated time slows down and no step is lost.
LONGEST_BACKLOG = 0.05


class Pacer:
    """Steps due since ``start``, ``factor`` times as fast as real time, for a monotonic clock in integer nanoseconds.

    Step k is due at start + k / (rate · factor). When the caller falls behind by more than LONGEST_BACKLOG, the
    deadlines move back by the excess: steps then happen later than planned, none is left out, and ``slipped_ns`` tells
    by how much. With the factor 0 there are no deadlines: ``free`` is True, and the caller steps as fast as it can.
    """

    def __init__(self, rate: float, now_ns: int, factor: float = 1.0):
        self._rate = Fraction(rate)
        self._longest_ns = int(LONGEST_BACKLOG * NANOSECONDS)
        self.slipped_ns = 0
        self.latest_ns = 0
        self.lateness = Lateness()
        self.set_factor(factor, now_ns)

    def set_factor(self, factor: float, now_ns: int) -> None:
        """Go on at another pace: the next step is due one period of it from now."""
        pace = self._rate * Fraction(factor)
        self.free = pace == 0
        self._numerator, self._denominator = pace.numerator, pace.denominator * NANOSECONDS
        self._period_ns = 0 if self.free else self._denominator // self._numerator
        self.start(now_ns)

    def start(self, now_ns: int) -> None:
        """Begin counting afresh: the next step is due one period from now."""
        self._start_ns = now_ns
        self._done = 0

    def due(self, now_ns: int) -> int:
        """Number of steps that are due now and have not been given out yet; they count as done from here on."""
        late_ns = now_ns - self.deadline_ns()
        behind_ns = late_ns - self._longest_ns
        if behind_ns > 0:
            self._start_ns += behind_ns
            self.slipped_ns += behind_ns
        due = (now_ns - self._start_ns) * self._numerator // self._denominator - self._done
        if due <= 0:
            return 0
        self._done += due
        if late_ns > self.latest_ns:
            self.latest_ns = late_ns
        self._given, self._oldest_ns = due, now_ns - late_ns
        return due

    def give_back(self, left: int) -> None:
        """Of the steps given out last, that many were not taken: they are still due."""
        self._done -= left

    def take_latest_ns(self) -> int:
        """By how much the latest step was given out after its deadline, since this was last asked."""
        latest_ns, self.latest_ns = self.latest_ns, 0
        return latest_ns

    def published(self, waiting: int, now_ns: int) -> None:
        """The step was published now after which ``waiting`` more were given out: note how late that is."""
        self.lateness.add(now_ns - self._oldest_ns - (self._given - 1 - waiting) * self._period_ns)

    def deadline_ns(self) -> int:
        """When the next step is due, rounded up to the clock's nanosecond."""
        return self._start_ns - (-(self._done + 1) * self._denominator // self._numerator)
