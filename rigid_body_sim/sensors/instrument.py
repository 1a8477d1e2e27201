"""Sensors at work: when each measures, what it shows of a motion, and what was measured on the way of a run."""

import hashlib
import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from ..kernels import compiled, sensing
from ..kernels.arrays import Floats
from ..kernels.compiled import Request
from ..values.parameter import shown
from . import REGISTRY
from .base import Noise, Numbers, Seen, Sensor, SensorType

MOST_STEPS_BETWEEN = 1e9
MOST_STEPS_LATE = 100_000
_KEY_BITS = 53  # of noise.normals
_EXAMPLES = 0.0, 0.0, 0.0, np.zeros(sensing.SIZE), 0, 0, 0


class Instrument:
    """A sensor of a simulation with ``rate`` steps a second: it measures each ``every`` steps, from step 0 on.

    Its messages come out ``late`` steps after that. ``variances`` are those of the values of each group, of white noise
    and of quantization, which are what covariances in messages say. Raises ValueError where the sensor's rate does not
    divide the step rate, and for a delay of too many steps.
    """

    def __init__(self, sensor: Sensor, rate: float):
        self.sensor, self.type = sensor, REGISTRY[sensor.type]
        self.every, self.late = in_steps(sensor, rate)
        self._truth, self._show = self.type.truth(sensor), self.type.show(sensor)
        self._disturb = compiled.ready(sensing.disturbed, *_EXAMPLES)
        self._key = key_of(sensor)
        noises = [getattr(sensor, group.field) for group in sensor.groups]
        rows = [_row(noise, rate / self.every) for noise in noises]
        self._rows = [(block, one) for block, one in enumerate(rows) if one.any()]
        self.variances = [float(one[sensing.WHITE] ** 2 + one[sensing.QUANTIZATION] ** 2 / 12.0) for one in rows]

    def measure(self, steps: int, seen: Seen) -> Numbers:
        """What it shows at a step; between two of its instants with the noise of the one before."""
        values, sample = list(self._truth(seen)), steps // self.every
        for block, row in self._rows:
            values[block] = self._disturb(*values[block], row, self._key, sample, 2 * block)
        return self._show(values, seen)


def kernels_of(kinds: Iterable[SensorType]) -> list[Request]:
    """What sensors of these types call, and of any there are."""
    own = [request for kind in kinds for request in (Request(sensing.disturbed, _EXAMPLES), *kind.kernels)]
    return list({request.function: request for request in own}.values())


def in_steps(sensor: Sensor, rate: float) -> tuple[int, int]:
    """Steps from one measurement to the next, and of its delay. Raises ValueError for a rate that does not divide."""
    steps = max(1, round(min(rate / sensor.rate, MOST_STEPS_BETWEEN))) if sensor.rate else 1
    if sensor.rate and abs(steps * sensor.rate - rate) > 1e-5 * rate:
        raise ValueError(
            f"{sensor}: rate {sensor.rate:g} Hz does not divide the step rate {rate:g} Hz into whole steps; "
            f"the nearest that does is {rate / steps:.9g}"
        )
    if sensor.delay * rate > MOST_STEPS_LATE:
        raise ValueError(
            f"{sensor}: delay {sensor.delay:g} s is more than {MOST_STEPS_LATE} steps of {1.0 / rate:g} s; give less"
        )
    return steps, round(sensor.delay * rate)


def key_of(sensor: Sensor) -> int:
    """Of its noise: 53 bits of BLAKE2 of seed and name, so that no two sensors or seeds have anything in common."""
    digest = hashlib.blake2b(f"{sensor.seed}/{sensor.name}".encode(), digest_size=8).digest()
    return int.from_bytes(digest, "little") >> (64 - _KEY_BITS)


def _row(noise: Noise, rate: float) -> Floats:
    """The numbers of a group for kernels, sampled so many times a second.

    White noise of the density n has the standard deviation n √rate in a sample, and a walk of w changes by w / √rate
    from one to the next: https://github.com/ethz-asl/kalibr/wiki/IMU-Noise-Model.
    """
    row = np.zeros(sensing.SIZE)
    row[sensing.WHITE], row[sensing.WALK] = noise.noise_density * math.sqrt(rate), noise.random_walk / math.sqrt(rate)
    row[sensing.BIAS : sensing.BIAS + len(noise.bias)] = noise.bias
    row[sensing.QUANTIZATION], row[sensing.RANGE] = noise.quantization, noise.range
    return row


def instruments(sensors: Iterable[Sensor], rate: float) -> dict[str, Instrument]:
    """Sensors at work, by their names. Raises TypeError for what is none, ValueError for a name that is there twice."""
    made: dict[str, Instrument] = {}
    for sensor in sensors:
        if not isinstance(sensor, Sensor):
            raise TypeError(f"sensors: {sensor!r} is no sensor; give a sequence of them, such as Imu")
        if sensor.name in made:
            raise ValueError(f"sensors: the name {shown(sensor.name)} is there twice; give each its own")
        made[sensor.name] = Instrument(sensor, rate)
    return made


def named(made: Mapping[str, Any], name: str) -> Any:
    """What is there of a sensor. Raises ValueError, with those there are, where there is none of that name."""
    if name not in made:
        there = f"there are {', '.join(made)}" if made else "none was given"
        raise ValueError(f"there is no sensor {shown(name)}; {there}")
    return made[name]


class Samples(NamedTuple):
    """What a sensor measured: ``time`` [s], shape (k,), and ``values``, shape (k, m), or (k, n, m) of n bodies.

    What the m numbers are is in docs/how-to/sensors.md, and in SensorType.columns.
    """

    time: Floats
    values: Floats


class Record:
    """What sensors measure on the way of a run; ``sense(name)`` is what one shows now."""

    def __init__(self, made: Mapping[str, Instrument], sense: Callable[[str], Floats]):
        self._every = {name: one.every for name, one in made.items()}
        self._sense = sense
        self._steps: dict[str, list[int]] = {name: [] for name in made}
        self._rows: dict[str, list[Floats]] = {name: [] for name in made}

    def until(self, steps: int) -> int:
        """How many steps after a step the next measurement is."""
        return min(every - steps % every for every in self._every.values())

    def take(self, steps: int) -> None:
        """Measure what is to be measured at the present step."""
        for name, every in self._every.items():
            if steps % every == 0:
                self._steps[name].append(steps)
                self._rows[name].append(self._sense(name))

    def taken(self, rate: float) -> dict[str, Samples]:
        """All up to now, by sensor."""
        return {name: Samples(np.array(self._steps[name]) / rate, np.array(self._rows[name])) for name in self._rows}
