"""The lateness that all but a hundredth of the publications keep to."""

BIN_NS = 10_000
BINS = 1000  # 10 ms in all; what is later lies in the last one


class Lateness:
    """A histogram in bins of BIN_NS, filled without allocating."""

    def __init__(self) -> None:
        self._bins = [0] * BINS
        self._largest_ns = 0

    def add(self, late_ns: int) -> None:
        """Count one that was late by this much."""
        i = late_ns // BIN_NS
        self._bins[i if i < BINS else -1] += 1
        if late_ns > self._largest_ns:
            self._largest_ns = late_ns

    def take_p99_ns(self) -> int:
        """At most a hundredth of what was counted since this was last asked is later; at most BIN_NS too large."""
        p99_ns = self._p99_ns()
        self._bins[:] = [0] * BINS
        self._largest_ns = 0
        return p99_ns

    def _p99_ns(self) -> int:
        last = min(self._largest_ns // BIN_NS, BINS - 1)
        later, may_be_later = 0, sum(self._bins) // 100
        for i in range(last, -1, -1):
            later += self._bins[i]
            if later > may_be_later:
                return self._largest_ns if i == last else (i + 1) * BIN_NS
        return 0
