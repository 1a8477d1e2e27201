"""Steps a second, and the time of a step: in whole numbers, so that it is the same however it is come to."""

NANOSECONDS = 1_000_000_000
LOWEST = 1e-9  # Hz: a step of 30 years
HIGHEST = 1e6  # Hz: beyond it a step is shorter than the call that computes it


class Rate:
    """Steps a second of simulated time [Hz]. Raises ValueError for one outside [1e-9, 1e6] Hz."""

    __slots__ = ("_divisor", "_half", "_per_step", "h", "value")

    def __init__(self, value: float):
        self.value = float(value)
        if not LOWEST <= self.value <= HIGHEST:
            raise ValueError(f"rate {self.value:.9g} Hz is not between {LOWEST:g} and {HIGHEST:g} Hz")
        self.h = 1.0 / self.value
        numerator, denominator = self.value.as_integer_ratio()
        self._per_step, self._half, self._divisor = 2 * NANOSECONDS * denominator, numerator, 2 * numerator

    def nanoseconds(self, steps: int) -> int:
        """Time of that many steps [ns]: round(steps · 10⁹ / rate), in integers, half up."""
        return (steps * self._per_step + self._half) // self._divisor


class Timed:
    """What is advanced by steps of a Rate: ``steps`` counts them."""

    _rate: Rate
    steps: int

    @property
    def rate(self) -> float:
        """Steps a second of simulated time [Hz]."""
        return self._rate.value

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.steps / self._rate.value

    @property
    def time_ns(self) -> int:
        """Simulated time [ns]: round(steps · 10⁹ / rate), in integers, half up."""
        return self._rate.nanoseconds(self.steps)
