"""Gusts: exact samples of the Dryden model, so its variance and its spectrum."""

import itertools
import math

import mpmath
import numpy as np
import pytest
from numpy.testing import assert_allclose

from rigid_body_sim.kernels import compiled, dryden

STATIONARY = np.array(((0.5, 0.25), (0.25, 0.25)))


def sample(out, memory, n, seed):
    dryden.begin(memory, 0, seed)
    for k in range(len(out) // 3):
        found = dryden.gust(memory, 0)
        for i in range(3):
            out[3 * k + i] = found[i]
        dryden.advance(memory, 0, n, seed)


def samples(count, n, seed):
    """Gusts (count, 3) in units of the intensity, in steps h = n T."""
    out, memory = np.zeros(3 * count), np.zeros(dryden.SIZE)
    compiled.ready(sample, out, memory, n, seed)(out, memory, n, seed)
    return out.reshape(-1, 3)


def transition(n):
    by = dryden.gains(n)
    lower = np.array(((by.l11, 0.0), (by.l21, by.l22)))
    return by.decay * np.array(((1.0, 0.0), (by.n, 1.0))), lower @ lower.T


@pytest.mark.no_numba
@pytest.mark.parametrize("n", [1e-9, 1e-4, 0.1, 0.999, 1.001, 5.0, 50.0])
def test_gains_are_the_integrals_that_they_stand_for(n):
    """Incomplete gamma functions by mpmath; measured 4e-16 of each. Closed forms would have lost all digits at 1e-9."""
    _, gained = transition(n)
    integrals = [mpmath.gammainc(k + 1, 0, 2 * mpmath.mpf(n)) / 2 ** (k + 1) for k in range(3)]
    expected = np.array(((integrals[0], integrals[1]), (integrals[1], integrals[2])), float)
    assert_allclose(gained, expected, rtol=1e-14, atol=0)


@pytest.mark.no_numba
@pytest.mark.parametrize("n", [1e-6, 0.01, 0.7, 3.0])
def test_long_run_stays_as_it_is_and_two_steps_are_one(n):
    """E P Eᵀ + Q = P of the stationary covariance, and Q(2n) = E Q Eᵀ + Q; measured 1e-16."""
    decay, gained = transition(n)
    assert_allclose(decay @ STATIONARY @ decay.T + gained, STATIONARY, rtol=0, atol=1e-15)
    twice, gained_twice = transition(2 * n)
    assert_allclose(decay @ decay, twice, rtol=0, atol=1e-15)
    assert_allclose(decay @ gained @ decay.T + gained, gained_twice, rtol=1e-13, atol=0)


@pytest.mark.no_numba
def test_where_nothing_passes_nothing_changes():
    memory = np.zeros(dryden.SIZE)
    dryden.begin(memory, 0, 3)
    before = dryden.gust(memory, 0)
    dryden.advance(memory, 0, 0.0, 3)
    assert dryden.gust(memory, 0) == before and memory[dryden.COUNT] == 1.0


def test_variance_is_that_of_the_intensity():
    """At every step, the first one too: of 2000 seeds, within 4 standard deviations of the estimate."""
    for at in (0, 1, 50):
        found = np.array([samples(51, 0.1, seed)[at] for seed in range(2000)])
        assert np.abs((found**2).mean(0) - 1.0).max() < 4 * math.sqrt(2 / len(found))
        assert np.abs(np.corrcoef(found.T)[np.triu_indices(3, 1)]).max() < 4 / math.sqrt(len(found))


def model_spectrum(w):
    """Two-sided spectra of u and v, w in units of 1/T, whose integral over all w is 1."""
    along = 1 / math.pi / (1 + w**2)
    return along, (1 + 3 * w**2) / (2 * math.pi * (1 + w**2) ** 2)


def aliased(w, h):
    """What samples every h have: the model's, folded at the sampling frequency."""
    folds = w + 2 * math.pi / h * np.arange(-400, 401)[:, None]
    along, across = model_spectrum(folds)
    return along.sum(0), across.sum(0)


@pytest.mark.parametrize("n", [0.05, 1.0])
def test_spectrum_is_the_models(n):
    """Periodograms of 131 072 samples, in 12 bands: each mean within 4 standard deviations (3 % to 25 %) of the model.

    A periodogram divided by the spectrum has the mean 1 and the standard deviation 1 (Percival and Walden 1993, chapter
    6); Hann's window keeps the large part of the spectrum out of the small one, and ties neighbouring lines.
    Measured: 2.0 standard deviations at most, of 72 bands.
    """
    count, pieces = 131_072, 32
    found = samples(count, n, 11).reshape(pieces, -1, 3)
    size = found.shape[1]
    window = np.hanning(size)
    window /= math.sqrt((window**2).sum())
    lines = np.abs(np.fft.rfft(found * window[None, :, None], axis=1)[:, 4 : size // 2]) ** 2 * n / (2 * math.pi)
    w = 2 * math.pi * np.arange(4, size // 2) / size / n
    along, across = aliased(w, n)
    ratio = (lines / np.column_stack((along, across, across))).mean(0)
    spread = math.sqrt(35 / 18)  # a Hann window ties neighbours: of the mean of m lines, √(35/18 / m)
    bands = np.array((0, *np.geomspace(16, len(w), 12).astype(int)))
    for low, high in itertools.pairwise(bands):
        deviation = spread / math.sqrt((high - low) * pieces)
        assert np.abs(ratio[low:high].mean(0) - 1.0).max() < 4 * deviation, (low, high)
