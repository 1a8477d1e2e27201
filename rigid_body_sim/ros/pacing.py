"""How many steps are due: counted from a clock, never from the number of times somebody called."""

NANOSECONDS = 1_000_000_000
# s of wall time. What is further behind is given up: simulated time slows down and no step is lost.
LONGEST_BACKLOG = 0.05


class Pacer:
    """Steps due in real time since ``start``, for a monotonic clock in integer nanoseconds.

    Step k is due at start + k / rate. When the caller falls behind by more than LONGEST_BACKLOG, the deadlines move
    back by the excess: steps then happen later than planned, none is left out, and ``slipped_ns`` tells by how much.
    """

    def __init__(self, rate: float, now_ns: int):
        self._numerator, denominator = rate.as_integer_ratio()
        self._denominator = denominator * NANOSECONDS
        self._longest_ns = int(LONGEST_BACKLOG * NANOSECONDS)
        self.late_steps = 0
        self.slipped_ns = 0
        self.start(now_ns)

    def start(self, now_ns: int) -> None:
        """Begin counting afresh: the next step is due one period from now."""
        self._start_ns = now_ns
        self._done = 0

    def due(self, now_ns: int) -> int:
        """Number of steps that are due now and have not been given out yet; they count as done from here on."""
        behind_ns = now_ns - self.deadline_ns() - self._longest_ns
        if behind_ns > 0:
            self._start_ns += behind_ns
            self.slipped_ns += behind_ns
        due = (now_ns - self._start_ns) * self._numerator // self._denominator - self._done
        if due <= 0:
            return 0
        self._done += due
        self.late_steps += due - 1
        return due

    def deadline_ns(self) -> int:
        """When the next step is due, rounded up to the clock's nanosecond."""
        return self._start_ns - (-(self._done + 1) * self._denominator // self._numerator)
