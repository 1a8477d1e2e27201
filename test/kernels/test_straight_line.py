"""Kernels that are run once with symbols: compiled, they give the bits that they give as plain Python."""

import numpy as np
import pytest

from rigid_body_sim.kernels import compiled
from rigid_body_sim.kernels.straight_line import in_lanes, straight_line
from rigid_body_sim.kernels.symbols import (
    chosen,
    magnitude,
    picked,
    repeated,
    row,
    row_of,
    set_row,
    sum_of,
)
from rigid_body_sim.kernels.tuples import Vec
from rigid_body_sim.kernels.vectors import cross

pytest.importorskip("numba")
RANDOM = np.random.default_rng(7)


def both(function, *arguments):
    """What a kernel returns compiled and as plain Python, each on a copy of its arrays, and these arrays after."""
    results = []
    for call in (compiled.ready(called(function, len(arguments)), *arguments), function):
        copies = [one.copy() if isinstance(one, np.ndarray) else one for one in arguments]
        results.append((call(*copies), [one.tolist() for one in copies if isinstance(one, np.ndarray)]))
    return results


def called(function, count):
    """A kernel that Python can call, as a straight_line kernel itself is only called from others."""
    if count == 2:

        def run(a, b):
            return function(a, b)

    else:

        def run(a, b, c):
            return function(a, b, c)

    return run


@straight_line
def scalars(x: float, y: float, n: int) -> tuple[float, float, float, float]:
    """Every operation, with constants and whole numbers on either side."""
    a = (2.0 - x) * y + n - x / 3.0 + 1 / n
    b = -(a * n) / y + (n - 1) * x - (3 - n)
    return a, b, magnitude(b), 1.5


def test_numbers():
    for x, y in RANDOM.normal(size=(20, 2)).tolist():
        compiled_result, plain = both(scalars, x, y, 7)
        assert tuple(compiled_result[0]) == tuple(map(float, plain[0]))


@straight_line
def rows(a: np.ndarray, b: np.ndarray) -> float:
    """Rows of four and of eight: read, permuted, combined with numbers and constants, added up, written."""
    four, eight = row(a, 1, 4), row(b, 3, 8)
    mixed = picked(four, eight[[7, 0, 3, 3]], [0, 5, 6, 3, 4, 4, 2, 1]) * eight - 0.1 * eight / (2.0 + magnitude(eight))
    set_row(b, 2, np.array([1.0, -1.0, 0.5, 3.0]) * mixed[[4, 5, 6, 7]] + four[2])
    a[0] = sum_of(mixed)
    return sum_of(row_of(a[0], 1.0, b[4], a[5]))


def test_rows():
    for _ in range(20):
        compiled_result, plain = both(rows, RANDOM.normal(size=6), RANDOM.normal(size=12))
        assert compiled_result == plain


@straight_line
def loops(a: np.ndarray, n: int) -> float:
    """Loops whose end is known when they run, of numbers and of rows, and one that is unrolled."""
    (first,) = repeated(1, n, (a[0],), lambda i, total: (total * 0.5 + a[i],))
    (second,) = repeated(0, 3, (first,), lambda i, total: (total - a[i] * i,))
    (third,) = repeated(2, n - 3, (np.zeros(4),), lambda i, total: (total * 0.5 + row(a, i, 4),))
    return second + sum_of(third)


@pytest.mark.parametrize("n", [1, 2, 9])
def test_loops(n):
    compiled_result, plain = both(loops, RANDOM.normal(size=10), n)
    assert compiled_result[0] == plain[0]


@straight_line
def named(a: np.ndarray, b: np.ndarray) -> Vec:
    """It may call kernels that have no branches, and return a named tuple."""
    return Vec(*cross(a[0], a[1], a[2], b[0], b[1], b[2]))


def test_named_tuples_and_other_kernels():
    compiled_result, plain = both(named, RANDOM.normal(size=3), RANDOM.normal(size=3))
    assert compiled_result == plain and type(compiled_result[0]) is Vec


@straight_line
def nothing(a: np.ndarray, x: float) -> None:
    """Returns nothing."""
    a[1] = x


def test_nothing_to_return():
    assert both(nothing, np.zeros(2), 0.5)[0] == (None, [[0.0, 0.5]])


@straight_line
def branches(x: float, y: float) -> float:
    """A branch on what is not known yet."""
    return x if x > y else y


@straight_line
def asks_a_number(x: float, y: float) -> float:
    """The same, without a comparison."""
    return x if x else y


@pytest.mark.parametrize("kernel", [branches, asks_a_number])
def test_a_branch_is_refused_when_it_is_compiled(kernel):
    with pytest.raises(Exception, match=r"cannot branch on it|not supported between"):
        compiled.ready(called(kernel, 2), 1.0, 2.0)


def test_products_and_sums_are_not_contracted():
    """1 + ε squared, less 1: a fused multiply-add would keep ε², which a product that is rounded has lost."""
    x = 1.0 + 2.0**-30

    @straight_line
    def squared_less_one(a: np.ndarray, b: np.ndarray) -> float:
        return sum_of(row(a, 0, 4) * row(a, 0, 4) - row(b, 0, 4))

    assert both(squared_less_one, np.full(4, x), np.ones(4))[0][0] == 4 * (x * x - 1.0) == 4 * 2.0**-29


def one_body(a, b, h):
    """Of one body: rows permuted, picked, combined with numbers and constants, a sum, a root; written in place."""
    q, v = row(a, 0, 4), row(b, 1, 4)
    mixed = np.array([1.0, -1.0, 0.5, 3.0]) * picked(q, v[[2, 0, 1, 3]], [0, 5, 2, 7]) - h * v / (2.0 + magnitude(q))
    set_row(b, 2, row_of(sum_of(mixed), a[1], h * a[2], 1.0 - mixed[0]))
    a[3] = -mixed[1]
    return mixed


@in_lanes
def eight_bodies(a: np.ndarray, b: np.ndarray, h: float) -> int:
    """The same, and a choice between rows by what is true of each body."""
    mixed = one_body(a, b, h)
    large = (mixed[0] > 0.0) & (mixed[1] <= 1.0) | (sum_of(mixed * mixed).root < 0.5)
    set_row(a, 4, chosen(large, mixed, np.zeros(4)))
    return large.bits


def test_eight_bodies_at_once_have_the_bits_of_each():
    a, b = RANDOM.normal(size=(8, 8)), RANDOM.normal(size=(6, 8))
    blocks = a.reshape(-1).copy(), b.reshape(-1).copy()
    bits = compiled.ready(called(eight_bodies, 3), *blocks, 0.25)(*blocks, 0.25)
    truths = []
    for body in range(8):
        own_a, own_b = a[:, body].copy(), b[:, body].copy()
        mixed = one_body(own_a, own_b, 0.25)
        truths.append((mixed[0] > 0 and mixed[1] <= 1) or np.sqrt(sum_of(mixed * mixed)) < 0.5)
        own_a[4:8] = mixed if truths[-1] else 0.0
        assert own_a.tolist() == blocks[0].reshape(8, 8)[:, body].tolist()
        assert own_b.tolist() == blocks[1].reshape(6, 8)[:, body].tolist()
    assert [bool(bits >> body & 1) for body in range(8)] == truths and len(set(truths)) == 2
