"""Philox: published answers, the same in plain Python as compiled; normal numbers."""

import itertools

import numpy as np
import pytest

from rigid_body_sim.kernels import compiled, noise
from rigid_body_sim.kernels.noise import Words

ALL = 0xFFFFFFFF
# Counter, key and answer of Philox4x32-10: kat_vectors of the authors' library Random123.
ANSWERS = [
    ((0, 0, 0, 0), (0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
    ((ALL, ALL, ALL, ALL), (ALL, ALL), (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)),
    (
        (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
        (0xA4093822, 0x299F31D0),
        (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
    ),
]


def philox_into(out, key, counter):
    words = noise.philox(key[0], key[1], Words(counter[0], counter[1], counter[2], counter[3]))
    for i in range(4):
        out[i] = words[i]


def normals_into(out, seed):
    for step in range(len(out) // 4):
        found = noise.normals(seed, step, 0, 7)
        for i in range(4):
            out[4 * step + i] = found[i]


@pytest.mark.no_numba
@pytest.mark.parametrize(("counter", "key", "answer"), ANSWERS)
def test_published_answers(counter, key, answer):
    """By the kernel and by plain Python."""
    out, keys, counters = np.zeros(4, np.int64), np.array(key), np.array(counter)
    compiled.ready(philox_into, out, keys, counters)(out, keys, counters)
    assert tuple(out.tolist()) == answer == noise.philox(*key, Words(*counter))


def test_normal_numbers_are_normal():
    """Of 400 000: mean, variance, kurtosis, share beyond 3, and no correlation, each within 4 standard deviations."""
    out = np.zeros(400_000)
    compiled.ready(normals_into, out, 5)(out, 5)
    n = len(out)
    assert abs(out.mean()) < 4 / np.sqrt(n)
    assert abs(out.var() - 1) < 4 * np.sqrt(2 / n)
    assert abs((out**4).mean() - 3) < 4 * np.sqrt(96 / n)
    assert abs((np.abs(out) > 3).mean() - 0.0026998) < 4 * np.sqrt(0.0027 / n)
    rows = out.reshape(-1, 4)
    for a, b in itertools.combinations(range(4), 2):
        assert abs((rows[:, a] * rows[:, b]).mean()) < 4 / np.sqrt(len(rows))
    assert abs((rows[1:, 0] * rows[:-1, 0]).mean()) < 4 / np.sqrt(len(rows))


@pytest.mark.no_numba
def test_seed_step_block_and_stream_each_give_others():
    """Also where they differ in bits beyond the 32nd alone."""
    here = (3, 4, 0, 1)
    others = [(3 + 2**40, 4, 0, 1), (4, 4, 0, 1), (3, 5, 0, 1), (3, 4 + 2**40, 0, 1), (3, 4, 1, 1), (3, 4, 0, 2)]
    assert len({noise.normals(*each) for each in (here, *others)}) == 7
    assert noise.normals(*here) == noise.normals(*here)
