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
from .straight_line import straight_line
from .symbols import Row, magnitude, picked, repeated, row, row_of, set_row, sum_of
from .vectors import cross

HIGHEST_ORDER = 28
MOST_CARRIED = 3

# Where rows lie, from the start of what a caller sets aside; all begin at multiples of eight.
RATES = 0  # ω in principal axes [rad/s]
TORQUES = 4  # torque in principal axes [N m]
GAIN = 8  # sum of the terms of order 1 and up: q and what is gained; while they are being found, of order 2 and up
ARMS = 16  # ½ h² I₀⁻¹ A_i: the diagonals of A_i that go with (bx, by, bz), (by, bz, bx), (bz, bx, by)
IMPULSE = ARMS + 36  # ∫ R F dθ, then ∬ R F dθ², of a force in body axes, in principal axes at the start
SCALE = IMPULSE + 8  # ½ h²
HALF = SCALE + 1  # ½ h
TERMS = IMPULSE + 12
TERM, RIGHT, LEFT = 0, 8, 24  # of each order: q and what is gained; right; left, those of the carried vectors last
STRIDE = LEFT + 16 + 8 * (MOST_CARRIED + 1)  # from one order to the next: no power of two, which would be slow
DRIVEN = TERMS + (HIGHEST_ORDER + 1) * STRIDE  # of each order what actuators do: see drive.expand, 16
WHOLE = DRIVEN + 16 * (HIGHEST_ORDER + 1)  # Rᵀ L with what spins inside, 4
SIZE = WHOLE + 4
NARROW = 8  # up to this order rows of four are multiplied, which is quicker for few of them

_BOTH = list(range(8))
_TURN = np.array([1.0, 1.0, 1.0, -1.0])  # sign of the first two products in Q ⊗ η
VECTOR = np.array([1.0, 1.0, 1.0, 0.0])


class Order:
    """One order: its terms, and the rows of the products that it is a factor of.

    ``gained`` is what is added up beside q: η, or of a body with something that spins inside, ½ h I₀⁻¹ Rᵀ L.
    """

    def __init__(self, q: Row, eta: Row, carried: Sequence[Row], gained: Row | None = None):
        self.q, self.eta, self.carried, self.gained = q, eta, carried, eta if gained is None else gained
        yzx, zxy = eta[YZX], eta[ZXY]
        self.right = [eta, zxy, yzx, zxy]
        self.left = [q[[3, 3, 3, 0]], q[[1, 2, 0, 2]], q[[2, 0, 1, 1]], yzx]
        for b in carried:
            self.left += [b[ZXY], b[YZX]]

    @property
    def size(self) -> Any:
        """Sum of the absolute values of its terms."""
        return sum_of(magnitude(self.q) + magnitude(self.gained))

    def keep(self, work: Any, k: Any, wide: bool = False) -> None:
        """Write it to where the others are found, as rows of eight where ``wide``."""
        at = TERMS + k * STRIDE
        for place, rows in ((TERM, [self.q, self.gained]), (RIGHT, self.right), (LEFT, self.left)):
            for i in range(0, len(rows), 2 if wide else 1):
                set_row(work, at + (place + 4 * i), picked(rows[i], rows[i + 1], _BOTH) if wide else rows[i])


def _kept(work: Any, k: Any, carried: int) -> Order:
    at = TERMS + k * STRIDE
    vectors = [_carried_vector(work, at, i) for i in range(carried)]
    return Order(row(work, at + TERM, 4), row(work, at + RIGHT, 4), vectors)


def _carried_vector(work: Any, at: Any, i: int) -> Row:
    return row(work, at + (LEFT + 16 + 8 * i), 4)[YZX]


class Equations:
    """The equations of motion as a recurrence from order to order.

    ``scale`` is ½ h² of a trial step of h [s]; ``arm(at)`` are the rows of all A_i, four numbers each, by I₀⁻¹ ½ h².
    An order carries ``more`` vectors along than those that the torque needs.
    """

    more = 0

    def __init__(self, model: Any, scale: Any, arm: Callable[[int], Row]):
        self.model, self.scale, self.arm = model, scale, arm

    @classmethod
    def kept(cls, work: Any, model: Any) -> "Equations":
        """Those of the trial step that was begun."""
        return cls(model, work[SCALE], lambda at: row(work, ARMS + at, 4))

    @staticmethod
    def vectors(work: Any, half: Any, carried: int) -> list[Row]:
        """What each order carries along, at the start of a trial step; ``half`` of it [s]."""
        return [_carried_vector(work, TERMS, i) for i in range(carried)]

    def first_two(self, half: Row, torque: Row, vectors: Sequence[Row]) -> tuple[Order, Order]:
        """Orders 0 and 1, from ½ h ω, the torque [N m] and the carried vectors at the start."""
        oldest = Order(1.0 - VECTOR, half, vectors)
        gyroscopic = row(self.model, DIFFERENCES, 4) * (half[YZX] * half[ZXY])
        gained = (gyroscopic + self.scale * torque) / row(self.model, MOMENT_ROW, 4)
        return oldest, Order(VECTOR * half, gained, [2.0 * crossed(b, half) for b in vectors])

    def next(self, k: Any, middle: Sequence[Row], newest: Order, oldest: Order, careful: bool = False) -> Order:
        """Order k + 1, for k above 0; ``middle`` are its products without those with order 0."""
        share, (zxy_old, yzx_old) = 1.0 / (k + 1), oldest.right[1:3]
        q = turned_on(share, middle, newest, oldest)
        products = middle[3] + (newest.left[3] * zxy_old + newest.right[1] * yzx_old)
        eta = (self._careful_rates if careful else self._rates)(k, products, newest)
        return Order(q, eta, carried_on(2.0 * share, middle, newest, oldest))

    def _rates(self, k: Any, products: Row, newest: Order) -> Row:
        share = 1.0 / (k + 1)
        gained = (share * row(self.model, GYRO, 4)) * products
        for i, b in enumerate(newest.carried):
            gained = gained + share * times([self.arm(12 * i + at) for at in (0, 4, 8)], b)
        return gained

    def _careful_rates(self, k: int, products: Row, newest: Order) -> Row:
        """The same by division, with the rounding of a quotient that is another one each time."""
        gained = row(self.model, DIFFERENCES, 4) * products
        for i, b in enumerate(newest.carried):
            gained = gained + self.scale * times(arm_rows(self.model, i), b)
        return gained / row(self.model, MOMENT_ROW, 4) / float(k + 1)


def turned_on(share: Any, middle: Sequence[Row], newest: Order, oldest: Order) -> Row:
    """``share`` times the coefficient of Q ⊗ η."""
    by_w, by_yzx, by_zxy = newest.left[:3]
    eta_old, zxy_old, yzx_old = oldest.right[:3]
    turn = (middle[0] + by_w * eta_old) + (middle[1] + by_yzx * zxy_old)
    return share * ((VECTOR * newest.eta + _TURN * turn) - (middle[2] + by_zxy * yzx_old))


def carried_on(share: Any, middle: Sequence[Row], newest: Order, oldest: Order) -> list[Row]:
    """``share`` times the coefficient of b × η, of each carried vector b."""
    return [_turned(share, i, middle, newest, oldest) for i in range(len(newest.carried))]


def arm_rows(model: Any, i: int) -> list[Row]:
    return [row(model, ARM_ROWS + 12 * i + at, 4) for at in (0, 4, 8)]


def times(diagonals: Sequence[Row], b: Row) -> Row:
    """A b of a matrix that is given as three diagonals."""
    straight, once, twice = diagonals
    return (straight * b + once * b[YZX]) + twice * b[ZXY]


def _turned(share: Any, i: int, middle: Sequence[Row], newest: Order, oldest: Order) -> Row:
    """``share`` times the coefficient of b_i × η."""
    at = 4 + 2 * i
    (zxy, yzx), (old_zxy, old_yzx) = newest.left[at : at + 2], oldest.left[at : at + 2]
    gained = (middle[at + 1] + yzx * oldest.right[1]) + old_yzx * newest.right[1]
    lost = (middle[at] + zxy * oldest.right[2]) + old_zxy * newest.right[2]
    return share * (gained - lost)


@straight_line
def set_rates(state: Floats, model: Floats, work: Floats) -> None:
    """ω = I₀⁻¹ Rᵀ L, theory (2.4.3)."""
    set_row(work, RATES, rates(state, model))


def rates(state: Any, model: Any) -> Row:
    """The same as a row."""
    l_body = rotated_back(row(state, Q, 4), row_of(state[L], state[L + 1], state[L + 2], state[L]))
    return l_body / row(model, MOMENT_ROW, 4)


def carry(carried: int) -> Callable[[Floats, Floats, Floats], float]:
    """The kernel that sets the carried vectors and the torque; it returns how fast the body turns, squared [1/s²]."""

    @straight_line
    def set_carried(state: Floats, model: Floats, work: Floats) -> float:
        return turning(row(work, RATES, 4), set_carried_vectors(state, model, work, carried), model)

    return set_carried


def set_carried_vectors(state: Any, model: Any, work: Any, carried: int) -> Row:
    """Put them and the torque to where the trial step that begins finds them, and return the torque."""
    vectors, torque = carried_vectors(state, model, carried)
    for i, b in enumerate(vectors):
        set_row(work, TERMS + (LEFT + 16 + 8 * i), b[ZXY])
    set_row(work, TORQUES, torque)
    return torque


def carried_vectors(state: Any, model: Any, carried: int) -> tuple[list[Row], Row]:
    """So many carried vectors and the torque [N m], in principal axes."""
    vectors, torque = [], row(model, TORQUE, 4)[[0, 1, 2, 0]]
    for i in range(carried):
        x, y, z = (model[CARRIED + 3 * i + axis] for axis in range(3))
        b = rotated_back(row(state, Q, 4), row_of(x, y, z, x))
        torque = torque + times(arm_rows(model, i), b)
        vectors.append(b)
    return vectors, torque


def turning(w: Row, torque: Row, model: Any) -> Any:
    """How fast a body turns, squared [1/s²]: ω·ω plus the sum of the components of I₀⁻¹ τ."""
    squares = w * w + magnitude(torque * row(model, INVERSE, 4))
    x, y, z = (squares[axis] for axis in range(3))
    return (x + y) + z


def begin(carried: int, kind: type[Equations] = Equations) -> Callable[[Floats, Floats, float], float]:
    """The kernel that sets orders 0 and 1 for a trial step of h [s], and returns the size of order 1."""

    @straight_line
    def set_first(work: Floats, model: Floats, h: float) -> float:
        found = trial(model, h, carried)
        work[SCALE], work[HALF] = found.scale, 0.5 * h
        for at in range(0, 12 * carried, 4):
            set_row(work, ARMS + at, found.arm(at))
        equations, vectors = kind.kept(work, model), kind.vectors(work, 0.5 * h, carried)
        orders = equations.first_two((0.5 * h) * row(work, RATES, 4), row(work, TORQUES, 4), vectors)
        for k, order in enumerate(orders):
            order.keep(work, k)
        return orders[1].size

    return set_first


def trial(model: Any, h: Any, carried: int) -> Equations:
    """The equations for a trial step of h [s]."""
    scale, inverse = (0.5 * h) * h, row(model, INVERSE, 4)
    arms = [(scale * inverse) * row(model, ARM_ROWS + at, 4) for at in range(0, 12 * carried, 4)]
    return Equations(model, scale, lambda at: arms[at // 4])


def first_orders(
    carried: int, last: int, careful: int, kind: type[Equations] = Equations
) -> Callable[[Floats, Floats], tuple[float, float]]:
    """The kernel that adds orders 2 to ``last``, and returns sizes: of the last pair of terms, and of that before.

    Up to order ``careful`` quotients are formed by division: what rounding drops of 1/3, or of a coefficient of Euler's
    equation, is the same in every step, and does work in each.
    """

    @straight_line
    def add_orders(work: Floats, model: Floats) -> tuple[float, float]:
        q, gained = added_up_to(last, careful, kind.kept(work, model), _Kept(work, carried + kind.more))
        set_row(work, GAIN, q)
        set_row(work, GAIN + 4, gained)
        return _kept_sizes(work, last)

    return add_orders


class _Kept:
    """Orders in memory. To read a row back that is a permutation of another takes less time than to permute that."""

    def __init__(self, work: Any, carried: int):
        self._work, self._carried, self._count = work, carried, 2

    def __getitem__(self, k: int) -> Order:
        order, at = _kept(self._work, k, self._carried), TERMS + k * STRIDE
        order.right, order.left = (
            [row(self._work, at + (place + 4 * i), 4) for i in range(len(rows))]
            for place, rows in ((RIGHT, order.right), (LEFT, order.left))
        )
        return order

    def append(self, order: Order) -> None:
        order.keep(self._work, self._count)
        self._count += 1


def added_up_to(last: int, careful: int, equations: Equations, orders: Any) -> tuple[Row, Row]:
    """Add orders 2 to ``last`` to orders 0 and 1, and return the sums of their terms; see ``first_orders``."""
    oldest, newest, q, gained = orders[0], orders[1], np.zeros(4), np.zeros(4)
    for k in range(1, last):
        newest = equations.next(k, _products(orders, k, len(oldest.left)), newest, oldest, careful=k < careful)
        orders.append(newest)
        q, gained = q + newest.q, gained + newest.gained
    return q, gained


def added_as_wide(last: int, equations: Equations, orders: list[Order]) -> None:
    """Add orders up to ``last`` as ``more_orders`` does: its products are added up in another order."""
    for k in range(len(orders) - 1, last):
        found: list[Row] = [np.zeros(4)] * len(orders[0].left)
        for j in (*range(2, k - 1), 1, k - 1):
            found = _with_products(found, orders[j], orders[k - j])
        orders.append(equations.next(k, found, orders[k], orders[0]))


def gain(orders: Sequence[Order], last: int) -> tuple[Row, Row]:
    """Sums of all terms up to order ``last``, the small ones first."""
    q, eta = np.zeros(4), np.zeros(4)
    for order in orders[2 : last + 1]:
        q, eta = q + order.q, eta + order.eta
    return orders[1].q + q, orders[1].eta + eta


def sizes(orders: Sequence[Order], last: int) -> tuple[Any, Any]:
    """Sizes of the pair of terms up to order ``last``, and of the pair before."""
    d, c, b, a = (picked(magnitude(orders[k].q), magnitude(orders[k].eta), _BOTH) for k in range(last - 3, last + 1))
    return sum_of(a + b), sum_of(c + d)


def more_orders(
    carried: int, kind: type[Equations] = Equations
) -> Callable[[Floats, Floats, int, int], tuple[float, float]]:
    """The kernel that goes on from order ``first`` to ``last``, eight numbers at a time."""

    @straight_line
    def add_orders(work: Floats, model: Floats, first: int, last: int) -> tuple[float, float]:
        oldest, begin = (_kept(work, k, carried + kind.more) for k in (0, first))
        equations = kind.kept(work, model)

        def add(k: Any, q: Row, gained: Row, *rows: Row) -> tuple[Row, ...]:
            newest = Order(rows[0], rows[1], rows[2:])
            order = equations.next(k, _kept_products(work, k, len(newest.left)), newest, oldest)
            order.keep(work, k + 1, wide=True)
            return q + order.q, gained + order.gained, order.q, order.eta, *order.carried

        start = row(work, GAIN, 4), row(work, GAIN + 4, 4), begin.q, begin.eta, *begin.carried
        q, gained, *_ = repeated(first, last, start, add)
        set_row(work, GAIN, q)
        set_row(work, GAIN + 4, gained)
        return _kept_sizes(work, last)

    return add_orders


def _kept_sizes(work: Any, last: Any) -> tuple[Any, Any]:
    d, c, b, a = (magnitude(row(work, TERMS + (last - i) * STRIDE + TERM, 8)) for i in (3, 2, 1, 0))
    return sum_of(a + b), sum_of(c + d)


def _products(orders: Any, k: int, count: int) -> list[Row]:
    """Coefficient k of so many products, without those with order 0; those with the newest order last."""
    found: list[Row] = [np.zeros(4)] * count
    for j in sorted(range(1, k), key=lambda j: max(j, k - j)):
        found = _with_products(found, orders[j], orders[k - j])
    return found


def _with_products(found: Sequence[Row], a: Order, b: Order) -> list[Row]:
    return [one + a.left[i] * b.right[i if i < 4 else 2 + i % 2] for i, one in enumerate(found)]


def _kept_products(work: Any, k: Any, count: int) -> list[Row]:
    """The same for k above 4, from memory, two rows at a time."""

    def add(j: Any, *found: Row) -> tuple[Row, ...]:
        left, right = TERMS + j * STRIDE + LEFT, TERMS + (k - j) * STRIDE + RIGHT
        places = (8 * i for i in range(len(found)))
        return tuple(
            one + row(work, left + at, 8) * row(work, right + min(at, 8), 8)
            for one, at in zip(found, places, strict=True)
        )

    nothing = tuple(np.zeros(8) for _ in range(0, count, 2))
    found = add(k - 1, *add(1, *repeated(2, k - 1, nothing, add)))
    return [half for one in found for half in (one[[0, 1, 2, 3]], one[[4, 5, 6, 7]])]


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
THREE_NODES = np.array(
    [
        (0.11270166537925831, 0.5, 0.8872983346207417),
        (0.2777777777777778, 0.4444444444444444, 0.2777777777777778),
        (0.2464717596168727, 0.2222222222222222, 0.031306018160905086),
    ]
)
FOUR_NODES = np.array(
    [
        (0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970263),
        (0.17392742256872692, 0.32607257743127305, 0.32607257743127305, 0.17392742256872692),
        (0.1618513208623103, 0.21846553629538057, 0.1076070411358925, 0.012076101706416622),
    ]
)
EIGHT_NODES = np.array(
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
    nodes, weights, second_weights = EIGHT_NODES
    then, top = f * nodes, order + 1

    def add_term(i: Any, *sums: Row) -> tuple[Row, ...]:
        at = TERMS + (top - i) * STRIDE + TERM
        return tuple(then * (one + work[at + n]) for n, one in enumerate(sums))

    turn = repeated(1, top, tuple(np.zeros(8) for _ in range(4)), add_term)
    keep_impulse(work, _impulse(model, turn, weights, second_weights))


def keep_impulse(work: Any, impulse: tuple[Row, Row]) -> None:
    """Put ∫ R F dθ and ∬ R F dθ² to where the step finds them."""
    set_row(work, IMPULSE, impulse[0])
    set_row(work, IMPULSE + 4, impulse[1])


def _impulse(model: Any, turn: Sequence[Row], weights: Row, second_weights: Row) -> tuple[Row, Row]:
    """∫ R F dθ and ∬ R F dθ² of the force in body axes."""
    return impulse_under([model[FORCE + axis] for axis in range(3)], None, turn, weights, second_weights)


def impulse_under(
    start: Sequence[Any], change: Sequence[Row] | None, turn: Sequence[Row], weights: Row, second_weights: Row
) -> tuple[Row, Row]:
    """The same of one that is ``start`` and, where it changes, by how much at each node.

    With Q = 1 + [s, v] and a = v × F, R F = F + 2 (a + s a + v × a).
    """
    x, y, z, s = turn
    force = start if change is None else [one + more for one, more in zip(start, change, strict=True)]
    a = cross(x, y, z, *force)
    gains = [2.0 * (one + (s * one + two)) for one, two in zip(a, cross(x, y, z, *a), strict=True)]
    if change is not None:
        gains = [more + gain for more, gain in zip(change, gains, strict=True)]
    once, twice = (
        [share * one + sum_of(by * gain) for one, gain in zip(start, gains, strict=True)]
        for share, by in ((1.0, weights), (0.5, second_weights))
    )
    return row_of(*once, once[0]), row_of(*twice, twice[0])


def impulse_of(model: Any, terms: Sequence[Row]) -> tuple[Row, Row]:
    """What ``set_impulse`` finds over a whole step, from the terms of q of order 1 and up."""
    nodes, weights, second_weights = EIGHT_NODES
    sums: list[Any] = [np.zeros(8) for _ in range(4)]
    for q in reversed(terms):
        sums = [nodes * (one + q[n]) for n, one in enumerate(sums)]
    return _impulse(model, sums, weights, second_weights)


def short_impulse(order: int) -> Callable[[Floats, Floats], None]:
    """The kernel that does the same for a whole step that takes 6 or 8 orders, from fewer values."""

    @straight_line
    def set_short_impulse(work: Floats, model: Floats) -> None:
        terms = [row(work, TERMS + k * STRIDE + TERM, 4) for k in range(1, order + 1)]
        keep_impulse(work, few_orders_impulse(model, terms))

    return set_short_impulse


def few_orders_impulse(model: Any, terms: Sequence[Row]) -> tuple[Row, Row]:
    """The same, from the 6 or 8 terms of q of order 1 and up, of which the last two count for less than round-off."""
    nodes, weights, second_weights = THREE_NODES if len(terms) == 6 else FOUR_NODES
    sums, power = [np.zeros(len(nodes)) for _ in range(4)], np.ones(len(nodes))
    for q in terms[:-2]:
        power = power * nodes
        sums = [one + power * q[n] for n, one in enumerate(sums)]
    return _impulse(model, sums, weights, second_weights)
