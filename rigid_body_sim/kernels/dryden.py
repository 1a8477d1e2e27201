"""Gusts by the Dryden model: white noise through filters, sampled once a step without error.

With the intensity σ [m/s] and the time T = L / V [s] in which the length scale L passes,

    H_u = σ √(2T/π) / (1 + T s)                      along the mean flow
    H_v = σ √(T/π) (1 + √3 T s) / (1 + T s)²         across it

(MIL-F-8785C, 3.7.1; MIL-HDBK-1797, appendix A, Dryden form). |H(iω)|² is the one-sided spectrum, (m/s)² s/rad, whose
integral over ω > 0 is σ². In units of σ and T the states are u' = −u + √2 w and q₁' = −q₁ + w, q₂' = −q₂ + q₁ of white
noise w, with the outputs u and √3 q₁ + (1 − √3) q₂. Over a step n = h / T they decay by known exponentials and gain
numbers of known covariance, so what is sampled has the model's own statistics at any step.
"""

import math
from typing import NamedTuple

from .arrays import Floats
from .compiled import kernel
from .noise import normals
from .tuples import Vec

U, V, W = 0, 1, 3  # states: along the flow; of two filters across it two each
COUNT = 5  # steps that have passed
SIZE = 6
STREAM = 1  # of noise
_ROOT_3 = math.sqrt(3.0)
_SHORT = 1.0  # n, up to which integrals are series: their closed forms cancel


class Gains(NamedTuple):
    """Of a step: e⁻ⁿ, n, and the Cholesky factor of what q₁ and q₂ gain."""

    decay: float
    n: float
    l11: float
    l21: float
    l22: float


@kernel
def moment(k: int, n: float) -> float:
    """∫₀ⁿ xᵏ e⁻²ˣ dx of k = 1 or 2."""
    if n > _SHORT:
        rest = math.exp(-2.0 * n)
        if k == 1:
            return 0.25 - rest * (0.5 * n + 0.25)
        return 0.25 - rest * (0.5 * n * n + 0.5 * n + 0.25)
    term = n**k * n * math.exp(-2.0 * n) / (k + 1.0)
    total, j = term, k + 2.0
    while term > 1e-18 * total:
        term *= 2.0 * n / j
        total += term
        j += 1.0
    return total


@kernel
def gains(n: float) -> Gains:
    """Of a step h = n T; nothing passes in none."""
    variance = -0.5 * math.expm1(-2.0 * n)
    if variance == 0.0:
        return Gains(1.0, 0.0, 0.0, 0.0, 0.0)
    l11 = math.sqrt(variance)
    l21 = moment(1, n) / l11
    return Gains(math.exp(-n), n, l11, l21, math.sqrt(max(0.0, moment(2, n) - l21 * l21)))


@kernel
def begin(memory: Floats, at: int, seed: int) -> None:
    """Draw memory[at:] as it is in the long run, before the first step."""
    _gain(memory, at, Gains(0.0, 0.0, math.sqrt(0.5), math.sqrt(0.125), math.sqrt(0.125)), seed, 0)
    memory[at + COUNT] = 0.0


@kernel
def advance(memory: Floats, at: int, n: float, seed: int) -> None:
    """Let a step h = n T pass."""
    count = int(memory[at + COUNT]) + 1
    _gain(memory, at, gains(n), seed, count)
    memory[at + COUNT] = float(count)


@kernel
def _gain(memory: Floats, at: int, by: Gains, seed: int, count: int) -> None:
    z, more = normals(seed, count, 0, STREAM), normals(seed, count, 1, STREAM)
    memory[at + U] = by.decay * memory[at + U] + math.sqrt(2.0) * by.l11 * more.a
    _gain_across(memory, at + V, by, z.a, z.b)
    _gain_across(memory, at + W, by, z.c, z.d)


@kernel
def _gain_across(memory: Floats, at: int, by: Gains, z: float, other: float) -> None:
    first, second = memory[at], memory[at + 1]
    memory[at] = by.decay * first + by.l11 * z
    memory[at + 1] = by.decay * (second + by.n * first) + by.l21 * z + by.l22 * other


@kernel
def gust(memory: Floats, at: int) -> Vec:
    """The gust in units of its intensity: along the flow, and in two directions across it."""
    return Vec(memory[at + U], _across(memory, at + V), _across(memory, at + W))


@kernel
def _across(memory: Floats, at: int) -> float:
    return _ROOT_3 * memory[at] + (1.0 - _ROOT_3) * memory[at + 1]
