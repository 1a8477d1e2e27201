"""Noise by its statistics: Allan deviation, covariance, independence; and that it is a function of key and sample."""

import itertools

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from rigid_body_sim import Imu, Magnetometer, Noise
from rigid_body_sim.effects.ground import Ground
from rigid_body_sim.sensors.base import Seen
from rigid_body_sim.sensors.instrument import Instrument, key_of

RATE = 100.0
N = 1 << 15
AT_REST = Seen((*(0.0,) * 3, 1.0, *(0.0,) * 15), (0.0,) * 6, (0.0, 0.0, -10.0), Ground())
DENSITY, WALK = 0.02, 0.3


def magnetometer(noise, name="mag", **options):
    return Instrument(Magnetometer(name, noise=noise, **options), RATE)


def samples(one, steps=range(N)):
    return np.array([one.measure(step, AT_REST) for step in steps])


def allan_variance(values, m):
    """Of clusters of m samples, each column; and the standard deviation of this estimate, relative, at most.

    Half the mean square of M differences of neighbouring clusters, each correlated with its two neighbours by at most
    1/2 (−1/2 of white noise, 1/4 of a walk): the variance of the mean of M squares is at most 2 (1 + 2 · 1/4) / M.
    """
    clusters = values[: len(values) // m * m].reshape(-1, m, values.shape[1]).mean(axis=1)
    differences = np.diff(clusters, axis=0)
    return 0.5 * (differences**2).mean(axis=0), (3.0 / len(differences)) ** 0.5


@pytest.fixture(scope="module")
def white():
    return samples(magnetometer(Noise(DENSITY)))


@pytest.fixture(scope="module")
def walk():
    return samples(magnetometer(Noise(random_walk=WALK)))


@pytest.mark.parametrize("m", [1, 4, 16, 64, 256])
def test_white_noise_has_the_allan_deviation_of_its_density(white, m):
    """N² / τ. Largest deviation measured: 2.3 of its standard deviations."""
    found, relative = allan_variance(white, m)
    assert np.abs(found / (DENSITY**2 * RATE / m) - 1.0).max() < 4.0 * relative


@pytest.mark.parametrize("m", [1, 4, 16, 64, 256])
def test_a_walk_has_the_allan_deviation_of_its_density(walk, m):
    """K² τ / 3 (1 + 1 / 2 m²), the last factor of a walk in steps. Largest deviation measured: 2.1."""
    found, relative = allan_variance(walk, m)
    expected = WALK**2 * m / RATE / 3.0 * (1.0 + 0.5 / m**2)
    assert np.abs(found / expected - 1.0).max() < 4.0 * relative


def test_a_walk_at_two_samples_has_the_covariance_of_brownian_motion():
    """Over 4000 keys: min(s, t). Largest deviation measured: 2.2 of its standard deviations."""
    steps = (1, 2, 3, 7, 12, 100, 4095, 4096)
    rows = [
        [one.measure(step, AT_REST) for step in steps]
        for one in (magnetometer(Noise(random_walk=1.0), seed=seed) for seed in range(4000))
    ]
    walks = np.moveaxis(np.array(rows), 2, 1).reshape(-1, len(steps))
    times = np.array(steps) / RATE
    expected = np.minimum(times, times[:, None])
    deviation = np.sqrt((np.outer(times, times) + expected**2) / len(walks))
    assert np.abs((walks.T @ walks / len(walks) - expected) / deviation).max() < 4.5


def test_a_sample_does_not_depend_on_what_was_asked_before():
    noise, order = Noise(DENSITY, random_walk=WALK), np.random.default_rng(1).permutation(3000)
    in_order, shuffled = magnetometer(noise), magnetometer(noise)
    straight = samples(in_order, range(3000))
    assert_array_equal(samples(shuffled, order.tolist()), straight[order])
    assert_array_equal(magnetometer(noise).measure(2999, AT_REST), straight[2999])


def test_far_samples_are_found_at_once():
    one, steps = magnetometer(Noise(random_walk=WALK)), 2**50 + 12345
    before, after = (np.array(one.measure(step, AT_REST)) for step in (steps, steps + 1))
    assert 0.0 < np.abs(after - before).max() < 6.0 * WALK / RATE**0.5


def test_sensors_seeds_groups_axes_and_parts_are_independent():
    """Correlations of 2 · 6 + 3 + 3 columns of noise; the largest measured is 2.8 / √N."""
    imu = [Imu("a", seed=seed, gyroscope=Noise(1.0), accelerometer=Noise(1.0)) for seed in (1, 2)]
    columns = [samples(Instrument(one, RATE), range(1 << 13)) for one in imu]
    columns += [samples(magnetometer(Noise(1.0), "b", seed=1), range(1 << 13))]
    steps = np.diff(samples(magnetometer(Noise(random_walk=1.0), "b", seed=1), range((1 << 13) + 1)), axis=0)
    all_columns = np.hstack((*columns, steps))
    correlation = np.corrcoef(all_columns.T) - np.eye(all_columns.shape[1])
    assert np.abs(correlation).max() < 4.5 / (1 << 13) ** 0.5


def test_keys_of_names_with_one_checksum_differ():
    """CRC-32 takes plumless and buckeroo for one."""
    keys = [key_of(Imu(name, seed=seed)) for name in ("plumless", "buckeroo") for seed in (0, 1)]
    assert len(set(keys)) == 4
    assert max(keys) < 2**53


@pytest.mark.no_numba
def test_quantization_and_saturation_are_exact():
    """Multiples of the step to the bit, the nearest ones, and never beyond the range."""
    step, limit = 0.07, 0.5
    bare = samples(magnetometer(Noise(DENSITY, (0.1, -0.2, 0.4))), range(300))
    shown = samples(magnetometer(Noise(DENSITY, (0.1, -0.2, 0.4), 0.0, step, limit)), range(300))
    expected = np.clip(step * np.rint(bare / step), -limit, limit)
    assert_array_equal(shown, expected)
    assert np.abs(bare).max() > limit
    assert (np.abs(shown) == limit).any()


@pytest.mark.no_numba
def test_variances_are_those_of_white_noise_and_quantization():
    one = Instrument(Imu("imu", 50.0, gyroscope=Noise(0.1, (), 9.0), accelerometer=Noise(0.2, (), 0.0, 0.6)), RATE)
    assert one.variances == pytest.approx([0.1**2 * 50.0, 0.2**2 * 50.0 + 0.03], rel=1e-15)


def test_two_axes_of_a_group_never_share_a_number(white):
    for a, b in itertools.combinations(white.T, 2):
        assert not np.intersect1d(a, b).size
