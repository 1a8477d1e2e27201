"""Random numbers that are a function of what they are for: a seed, a step, a stream. Nothing is kept between them.

Philox4x32-10 of Salmon, Moraes, Dror and Shaw, "Parallel random numbers: as easy as 1, 2, 3" (SC 2011). Products of two
32-bit numbers are formed in halves, so that all fits into signed integers of 64 bits and is the same in plain Python.
"""

import math
from typing import NamedTuple

from .compiled import kernel

_MASK = 0xFFFFFFFF
_ROUNDS = 10
_FIRST, _SECOND = 0xD2511F53, 0xCD9E8D57  # multipliers
_GOLDEN, _ROOT = 0x9E3779B9, 0xBB67AE85  # what the halves of the key grow by


class Words(NamedTuple):
    """Four numbers of 32 bits."""

    a: int
    b: int
    c: int
    d: int


class Normals(NamedTuple):
    """Four independent numbers of the standard normal distribution."""

    a: float
    b: float
    c: float
    d: float


@kernel
def _product(x: int, y: int) -> tuple[int, int]:
    """The upper and the lower 32 bits of x y."""
    low, high = x * (y & 0xFFFF), x * (y >> 16)
    return (high + (low >> 16)) >> 16, (low + ((high & 0xFFFF) << 16)) & _MASK


@kernel
def philox(key_low: int, key_high: int, counter: Words) -> Words:
    """Philox4x32 with ten rounds."""
    a, b, c, d = counter
    for _ in range(_ROUNDS):
        high, low = _product(_FIRST, a)
        other_high, other_low = _product(_SECOND, c)
        a, b, c, d = other_high ^ b ^ key_low, other_low, high ^ d ^ key_high, low
        key_low, key_high = (key_low + _GOLDEN) & _MASK, (key_high + _ROOT) & _MASK
    return Words(a, b, c, d)


@kernel
def normals(seed: int, step: int, block: int, stream: int) -> Normals:
    """Of a seed and a step, whole numbers below 2^53; ``block`` counts those of one step, ``stream`` is who asks."""
    words = philox(seed & _MASK, seed >> 32, Words(step & _MASK, step >> 32, block, stream))
    a, b = _pair(words.a, words.b)
    c, d = _pair(words.c, words.d)
    return Normals(a, b, c, d)


@kernel
def _pair(x: int, y: int) -> tuple[float, float]:
    """Box and Muller's transform of two numbers of 32 bits: up to 6.8."""
    size = math.sqrt(-2.0 * math.log((x + 0.5) * 2.0**-32))
    angle = 2.0 * math.pi * (y * 2.0**-32)
    return size * math.cos(angle), size * math.sin(angle)
