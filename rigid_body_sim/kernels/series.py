"""The Taylor series of a body's motion over a trial step, four and eight numbers at a time.

The unknowns are the attitude relative to the start of the step Q, the rates in principal axes as the half angles
η = ½ h ω of a trial step h, and the carried vectors b = Rᵀ B (see kernels.wrench), in the time θ = t / h:

    Q' = Q ⊗ η        η' = 2 c ∘ (η_y η_z, η_z η_x, η_x η_y) + ½ h² I₀⁻¹ (τ + Σ A_i b_i)        b_i' = 2 b_i × η

with c the coefficients of Euler's equation (theory 2.5.5, 2.7). Order k + 1 follows from Cauchy products of all orders
up to k. An order is a few *rows* of four numbers: q = (x, y, z, w), and vectors as (x, y, z, x). Permuted, all products
are products of rows:

    left    w w w x    y z x z    z x y y    yzx of η       and of each carried vector   zxy of b    yzx of b
    right   η          zxy of η   yzx of η   zxy of η       whose right are the last two of these

The first three add up to Q ⊗ η, with the third taken from the others, and all from nothing in lane w; the fourth are
the gyroscopic products. In memory two neighbours are one row of eight, as which higher orders take them. The products
with order 0 are taken last: all others are known before the newest order is.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .arrays import Floats
from .model import ARM_ROWS, CARRIED, DIFFERENCES, FORCE, GYRO, INVERSE, MOMENT_ROW, TORQUE
from .row_vectors import YZX, ZXY, crossed, rotated_back
from .state import L, Q
from .straight_line import Row, magnitude, picked, repeated, row, row_of, set_row, straight_line, sum_of
from .vectors import cross

HIGHEST_ORDER = 28
MOST_CARRIED = 3

# Where rows lie, from the start of what a caller sets aside; all begin at multiples of eight.
RATES = 0  # ω in principal axes [rad/s]
TORQUES = 4  # torque in principal axes [N m]
GAIN = 8  # sum of the terms of order 1 and up: q and η; while they are being found, of order 2 and up
ARMS = 16  # ½ h² I₀⁻¹ A_i: the diagonals of A_i that go with (bx, by, bz), (by, bz, bx), (bz, bx, by)
IMPULSE = ARMS + 36  # ∫ R F dθ, then ∬ R F dθ², of a force in body axes, in principal axes at the start
SCALE = IMPULSE + 8  # ½ h²
TERMS = IMPULSE + 12
TERM, RIGHT, LEFT = 0, 8, 24  # of each order: q and η; right; left, those of the carried vectors last
STRIDE = LEFT + 16 + 8 * MOST_CARRIED + 8  # from one order to the next: no power of two, which would be slow
SIZE = TERMS + (HIGHEST_ORDER + 1) * STRIDE
NARROW = 8  # up to this order rows of four are multiplied, which is quicker for few of them

_BOTH = list(range(8))
_TURN = np.array([1.0, 1.0, 1.0, -1.0])  # sign of the first two products in Q ⊗ η
_VECTOR = np.array([1.0, 1.0, 1.0, 0.0])


class _Order:
    """One order: its terms, and the rows of the products that it is a factor of."""

    def __init__(self, q: Row, eta: Row, carried: Sequence[Row]):
        self.q, self.eta, self.carried = q, eta, carried
        yzx, zxy = eta[YZX], eta[ZXY]
        self.right = [eta, zxy, yzx, zxy]
        self.left = [q[[3, 3, 3, 0]], q[[1, 2, 0, 2]], q[[2, 0, 1, 1]], yzx]
        for b in carried:
            self.left += [b[ZXY], b[YZX]]

    def keep(self, work: Any, k: Any, wide: bool = False) -> None:
        """Write it to where the others are found, as rows of eight where ``wide``."""
        at = TERMS + k * STRIDE
        for place, rows in ((TERM, [self.q, self.eta]), (RIGHT, self.right), (LEFT, self.left)):
            for i in range(0, len(rows), 2 if wide else 1):
                set_row(work, at + (place + 4 * i), picked(rows[i], rows[i + 1], _BOTH) if wide else rows[i])


def _kept(work: Any, k: Any, carried: int) -> _Order:
    at = TERMS + k * STRIDE
    vectors = [_carried_vector(work, at, i) for i in range(carried)]
    return _Order(row(work, at + TERM, 4), row(work, at + RIGHT, 4), vectors)


def _carried_vector(work: Any, at: Any, i: int) -> Row:
    return row(work, at + (LEFT + 16 + 8 * i), 4)[YZX]


@straight_line
def set_rates(state: Floats, model: Floats, work: Floats) -> None:
    """ω = I₀⁻¹ Rᵀ L, theory (2.4.3)."""
    l_body = rotated_back(row(state, Q, 4), row_of(state[L], state[L + 1], state[L + 2], state[L]))
    set_row(work, RATES, l_body / row(model, MOMENT_ROW, 4))


def carry(carried: int) -> Callable[[Floats, Floats, Floats], float]:
    """The kernel that sets the carried vectors and the torque; it returns how fast the body turns, squared [1/s²].

    That is ω·ω plus the sum of the components of I₀⁻¹ τ.
    """

    @straight_line
    def set_carried(state: Floats, model: Floats, work: Floats) -> float:
        torque = row(model, TORQUE, 4)[[0, 1, 2, 0]]
        for i in range(carried):
            x, y, z = (model[CARRIED + 3 * i + axis] for axis in range(3))
            b = rotated_back(row(state, Q, 4), row_of(x, y, z, x))
            set_row(work, TERMS + (LEFT + 16 + 8 * i), b[ZXY])
            torque = torque + _arm_products(model, ARM_ROWS + 12 * i, b)
        set_row(work, TORQUES, torque)
        w = row(work, RATES, 4)
        turning = w * w + magnitude(torque * row(model, INVERSE, 4))
        x, y, z = (turning[axis] for axis in range(3))
        return (x + y) + z

    return set_carried


def begin(carried: int) -> Callable[[Floats, Floats, float], float]:
    """The kernel that sets orders 0 and 1 for a trial step of h [s], and returns the size of order 1."""

    @straight_line
    def set_first(work: Floats, model: Floats, h: float) -> float:
        scale, inverse = (0.5 * h) * h, row(model, INVERSE, 4)
        work[SCALE] = scale
        for at in range(0, 12 * carried, 4):
            set_row(work, ARMS + at, (scale * inverse) * row(model, ARM_ROWS + at, 4))
        eta, torque = (0.5 * h) * row(work, RATES, 4), row(work, TORQUES, 4)
        oldest = _Order(1.0 - _VECTOR, eta, [_carried_vector(work, TERMS, i) for i in range(carried)])
        oldest.keep(work, 0)
        gyroscopic = row(model, DIFFERENCES, 4) * (eta[YZX] * eta[ZXY])
        gained = (gyroscopic + scale * torque) / row(model, MOMENT_ROW, 4)
        first = _Order(_VECTOR * eta, gained, [2.0 * crossed(b, eta) for b in oldest.carried])
        first.keep(work, 1)
        return sum_of(magnitude(first.q) + magnitude(first.eta))

    return set_first


def first_orders(carried: int, last: int, careful: int) -> Callable[[Floats, Floats], tuple[float, float]]:
    """The kernel that adds orders 2 to ``last``, and returns sizes: of the last pair of terms, and of that before.

    Up to order ``careful`` quotients are formed by division: what rounding drops of 1/3, or of a coefficient of Euler's
    equation, is the same in every step, and does work in each.
    """

    @straight_line
    def add_orders(work: Floats, model: Floats) -> tuple[float, float]:
        oldest, newest = _kept(work, 0, carried), _kept(work, 1, carried)
        q, eta = np.zeros(4), np.zeros(4)
        for k in range(1, last):
            newest = _next(work, model, k, newest, oldest, careful=k < careful)
            newest.keep(work, k + 1)
            q, eta = q + newest.q, eta + newest.eta
        set_row(work, GAIN, q)
        set_row(work, GAIN + 4, eta)
        return _sizes(work, last)

    return add_orders


def more_orders(carried: int) -> Callable[[Floats, Floats, int, int], tuple[float, float]]:
    """The kernel that goes on from order ``first`` to ``last``, eight numbers at a time."""

    @straight_line
    def add_orders(work: Floats, model: Floats, first: int, last: int) -> tuple[float, float]:
        oldest, begin = _kept(work, 0, carried), _kept(work, first, carried)

        def add(k: Any, q: Row, eta: Row, *newest: Row) -> tuple[Row, ...]:
            order = _next(work, model, k, _Order(newest[0], newest[1], newest[2:]), oldest, wide=True)
            order.keep(work, k + 1, wide=True)
            return q + order.q, eta + order.eta, order.q, order.eta, *order.carried

        start = row(work, GAIN, 4), row(work, GAIN + 4, 4), begin.q, begin.eta, *begin.carried
        q, eta, *_ = repeated(first, last, start, add)
        set_row(work, GAIN, q)
        set_row(work, GAIN + 4, eta)
        return _sizes(work, last)

    return add_orders


def _sizes(work: Any, last: Any) -> tuple[Any, Any]:
    """Sums of the absolute values of the last two terms, and of the two before."""
    d, c, b, a = (magnitude(row(work, TERMS + (last - i) * STRIDE + TERM, 8)) for i in (3, 2, 1, 0))
    return sum_of(a + b), sum_of(c + d)


def _next(
    work: Any, model: Any, k: Any, newest: _Order, oldest: _Order, careful: bool = False, wide: bool = False
) -> _Order:
    """Order k + 1, for k above 0."""
    share, middle = 1.0 / (k + 1), _middle(work, k, len(newest.left), 8 if wide else 4)
    by_w, by_yzx, by_zxy, yzx = newest.left[:4]
    eta_old, zxy_old, yzx_old = oldest.right[:3]
    turn = (middle[0] + by_w * eta_old) + (middle[1] + by_yzx * zxy_old)
    q = ((share * _VECTOR) * newest.eta + (share * _TURN) * turn) - share * (middle[2] + by_zxy * yzx_old)
    products = middle[3] + (yzx * zxy_old + newest.right[1] * yzx_old)
    eta = _careful_rates(work, model, k, products, newest) if careful else _rates(work, model, share, products, newest)
    return _Order(q, eta, [_turned(2.0 * share, i, middle, newest, oldest) for i in range(len(newest.carried))])


def _rates(work: Any, model: Any, share: Any, products: Row, newest: _Order) -> Row:
    gained = (share * row(model, GYRO, 4)) * products
    for i, b in enumerate(newest.carried):
        gained = gained + share * _arm_products(work, ARMS + 12 * i, b)
    return gained


def _careful_rates(work: Any, model: Any, k: int, products: Row, newest: _Order) -> Row:
    """The same by division, with the rounding of a quotient that is another one each time."""
    gained = row(model, DIFFERENCES, 4) * products
    for i, b in enumerate(newest.carried):
        gained = gained + work[SCALE] * _arm_products(model, ARM_ROWS + 12 * i, b)
    return gained / row(model, MOMENT_ROW, 4) / float(k + 1)


def _turned(share: Any, i: int, middle: Sequence[Row], newest: _Order, oldest: _Order) -> Row:
    """``share`` times the coefficient of b_i × η."""
    at = 4 + 2 * i
    (zxy, yzx), (old_zxy, old_yzx) = newest.left[at : at + 2], oldest.left[at : at + 2]
    gained = (middle[at + 1] + yzx * oldest.right[1]) + old_yzx * newest.right[1]
    lost = (middle[at] + zxy * oldest.right[2]) + old_zxy * newest.right[2]
    return share * (gained - lost)


def _middle(work: Any, k: Any, count: int, lanes: int) -> list[Row]:
    """Coefficient k of so many products, without those with order 0; those with the newest order last."""

    def add(j: Any, *sums: Row) -> tuple[Row, ...]:
        left, right = TERMS + j * STRIDE + LEFT, TERMS + (k - j) * STRIDE + RIGHT
        places = (lanes * i for i in range(len(sums)))
        return tuple(
            one + row(work, left + at, lanes) * row(work, right + (at if at < 16 else 8 + at % 8), lanes)
            for one, at in zip(sums, places, strict=True)
        )

    sums = tuple(np.zeros(lanes) for _ in range(0, 4 * count, lanes))
    if lanes == 4:
        for j in sorted(range(1, k), key=lambda j: max(j, k - j)):
            sums = add(j, *sums)
        return list(sums)
    sums = add(k - 1, *add(1, *repeated(2, k - 1, sums, add)))
    return [half for one in sums for half in (one[[0, 1, 2, 3]], one[[4, 5, 6, 7]])]


def _arm_products(numbers: Any, at: int, b: Row) -> Row:
    """A b of a matrix that is kept as three diagonals from ``numbers[at]`` on."""
    straight, once, twice = (row(numbers, at + 4 * n, 4) for n in range(3))
    return (straight * b + once * b[YZX]) + twice * b[ZXY]


@straight_line
def gain_whole(work: Floats) -> None:
    """Sum all terms, the small ones first: of a trial step that is taken as it is."""
    set_row(work, GAIN, row(work, TERMS + STRIDE + TERM, 8) + row(work, GAIN, 8))


@straight_line
def gain_part(work: Floats, f: float) -> None:
    """Sum f^k term_k up to the highest order, odd and even powers apart."""
    odd, even = np.zeros(8), np.zeros(8)
    square = f * f
    for k in range(HIGHEST_ORDER, 0, -2):
        even = square * (even + row(work, TERMS + k * STRIDE + TERM, 8))
        odd = square * odd + row(work, TERMS + (k - 1) * STRIDE + TERM, 8)
    set_row(work, GAIN, even + f * odd)


# Gauss' nodes between 0 and 1, and the weights with which values there make ∫ dθ and ∬ dθ². Written down, as what a
# library computes differs in the last digit from one machine to another, and so would the bits of a run.
_FOUR_NODES = np.array(
    [
        (0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970263),
        (0.17392742256872692, 0.32607257743127305, 0.32607257743127305, 0.17392742256872692),
        (0.1618513208623103, 0.21846553629538057, 0.1076070411358925, 0.012076101706416622),
    ]
)
_EIGHT_NODES = np.array(
    [
        (0.019855071751231884, 0.10166676129318664, 0.2372337950418355, 0.4082826787521751),
        (0.591717321247825, 0.7627662049581645, 0.8983332387068134, 0.9801449282487681),
        (0.05061426814518813, 0.11119051722668724, 0.15685332293894363, 0.181341891689181),
        (0.181341891689181, 0.15685332293894363, 0.11119051722668724, 0.05061426814518813),
        (0.04960931821952933, 0.09988613745373567, 0.11964241387321545, 0.10730313838033538),
        (0.07403875330884561, 0.037210909065728194, 0.011304379772951567, 0.0010049499256588007),
    ]
).reshape(3, 8)


@straight_line
def set_impulse(work: Floats, model: Floats, order: int, f: float) -> None:
    """Find the impulse of the force in body axes over a share f of the trial step, from its values at eight times."""
    times, weights, second_weights = _EIGHT_NODES
    then, top = f * times, order + 1

    def add_term(i: Any, *sums: Row) -> tuple[Row, ...]:
        at = TERMS + (top - i) * STRIDE + TERM
        return tuple(then * (one + work[at + n]) for n, one in enumerate(sums))

    turn = repeated(1, top, tuple(np.zeros(8) for _ in range(4)), add_term)
    _set_impulse(work, model, turn, weights, second_weights)


def _set_impulse(work: Any, model: Any, turn: Sequence[Row], weights: Row, second_weights: Row) -> None:
    """With Q = 1 + [s, v] and a = v × F, R F = F + 2 (a + s a + v × a)."""
    x, y, z, s = turn
    force = [model[FORCE + axis] for axis in range(3)]
    a = cross(x, y, z, *force)
    gains = [one + (s * one + two) for one, two in zip(a, cross(x, y, z, *a), strict=True)]
    for at, share, by in ((IMPULSE, 1.0, weights), (IMPULSE + 4, 0.5, second_weights)):
        for axis in range(3):
            work[at + axis] = share * force[axis] + 2.0 * sum_of(by * gains[axis])


SHORT_ORDER = 6  # up to which terms count for the force while the first orders are enough


@straight_line
def set_short_impulse(work: Floats, model: Floats) -> None:
    """The same for a whole step of few orders, from four values."""
    times, weights, second_weights = _FOUR_NODES
    sums, power = [np.zeros(4) for _ in range(4)], np.ones(4)
    for k in range(1, SHORT_ORDER + 1):
        power = power * times
        for n in range(4):
            sums[n] = sums[n] + power * work[TERMS + k * STRIDE + TERM + n]
    _set_impulse(work, model, sums, weights, second_weights)
