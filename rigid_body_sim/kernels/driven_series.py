"""The series of kernels.series for a body with actuators: forces and torques that change, and what spins inside.

With h the internal angular momentum, relative to the body, the whole one ℓ = Rᵀ L = I₀ ω + h turns with the body as a
carried vector does, ℓ' = ℓ × ω + τ, and ω = I₀⁻¹ (ℓ − h) follows from it: no term has h' in it (Hughes, Spacecraft
Attitude Dynamics, 1986, section 3.3, on gyrostats). So ℓ is the first of the carried vectors, as ½ h ℓ of a trial
step h, and what the actuators do is known order by order beforehand (kernels.drive.expand).
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .arrays import Floats
from .compiled import kernel
from .drive import STRIDE as STRIDE_OF_DRIVE
from .drive import expand, expand_more, fastest
from .model import FORCE, INTERNAL, INTERNAL_SLOPE, INVERSE, MOMENT_ROW
from .row_vectors import crossed, rotated_back
from .series import (
    DRIVEN,
    EIGHT_NODES,
    FOUR_NODES,
    HALF,
    RATES,
    STRIDE,
    TERM,
    TERMS,
    THREE_NODES,
    VECTOR,
    WHOLE,
    Equations,
    Order,
    arm_rows,
    begin,
    carried_on,
    impulse_under,
    keep_impulse,
    more_orders,
    set_carried_vectors,
    times,
    turned_on,
    turning,
)
from .state import L, Q
from .straight_line import straight_line
from .symbols import Row, magnitude, repeated, row, row_of, set_row

# rad, an angle that counts in a trial step as an e-folding does: 28 orders give 2 of them, 8 orders 0.05 and 6 0.0025,
# to round-off, where it turns by 0.8, 0.02 and 0.001 rad.
PER_DECAY = 0.4


class Driven(Equations):
    """The equations of motion with actuators; see the head of the module."""

    more = 1

    def __init__(self, model: Any, scale: Any, arm: Callable[[int], Row], work: Any):
        super().__init__(model, scale, arm)
        self._work, self._half = work, work[HALF]

    @classmethod
    def kept(cls, work: Any, model: Any) -> "Driven":
        found = Equations.kept(work, model)
        return cls(model, found.scale, found.arm, work)

    @staticmethod
    def vectors(work: Any, half: Any, carried: int) -> list[Row]:
        return [half * row(work, WHOLE, 4), *Equations.vectors(work, half, carried)]

    def first_two(self, half: Row, torque: Row, vectors: Sequence[Row]) -> tuple[Order, Order]:
        whole, *others = vectors
        oldest = Order(1.0 - VECTOR, half, vectors)
        gained = 2.0 * crossed(whole, half) + self.scale * torque
        carried = [gained, *(2.0 * crossed(b, half) for b in others)]
        return oldest, self._order(1, VECTOR * half, carried, careful=True)

    def next(self, k: Any, middle: Sequence[Row], newest: Order, oldest: Order, careful: bool = False) -> Order:
        share = 1.0 / (k + 1)
        gained, *others = carried_on(2.0 * share, middle, newest, oldest)
        torque = row(self._work, DRIVEN + 4 + STRIDE_OF_DRIVE * k, 4)
        for i, b in enumerate(newest.carried[1:]):
            torque = torque + times(arm_rows(self.model, i), b)
        gained = gained + (share * self.scale) * torque
        return self._order(k + 1, turned_on(share, middle, newest, oldest), [gained, *others], careful)

    def _order(self, k: Any, q: Row, carried: Sequence[Row], careful: bool) -> Order:
        """Of ω = I₀⁻¹ (ℓ − h); see Equations on care."""
        inside, whole = self._half * row(self._work, DRIVEN + 8 + STRIDE_OF_DRIVE * k, 4), carried[0]
        if careful:
            moments = row(self.model, MOMENT_ROW, 4)
            return Order(q, (whole - inside) / moments, carried, whole / moments)
        inverse = row(self.model, INVERSE, 4)
        return Order(q, inverse * (whole - inside), carried, inverse * whole)


@straight_line
def set_whole(state: Floats, model: Floats, work: Floats) -> None:
    """Rᵀ L with what spins inside, and ω = I₀⁻¹ (Rᵀ L − h)."""
    whole = rotated_back(row(state, Q, 4), row_of(state[L], state[L + 1], state[L + 2], state[L]))
    set_row(work, WHOLE, whole)
    set_row(work, RATES, (whole - row(model, INTERNAL, 4)) / row(model, MOMENT_ROW, 4))


def carry(carried: int) -> Callable[[Floats, Floats, Floats], float]:
    """As series.carry; the angular momentum inside turns a body as fast as h / I; its growth counts, and decay does."""

    @straight_line
    def set_carried(state: Floats, model: Floats, work: Floats) -> float:
        torque = set_carried_vectors(state, model, work, carried)
        inside = row(model, INTERNAL, 4) * row(model, INVERSE, 4)
        change = magnitude(torque) + magnitude(row(model, INTERNAL_SLOPE, 4))
        squares = inside * inside
        return turning(row(work, RATES, 4), change, model) + ((squares[0] + squares[1]) + squares[2])

    @kernel
    def set_and_compare(state: Floats, model: Floats, work: Floats) -> float:
        turn, decay = set_carried(state, model, work), PER_DECAY * fastest(model)
        return max(turn, decay * decay)

    return set_and_compare


def begin_driven(carried: int) -> Callable[[Floats, Floats, float], float]:
    """As series.begin, after the first orders of what actuators do."""
    inner = begin(carried, Driven)

    @kernel
    def set_first(work: Floats, model: Floats, h: float) -> float:
        expand(model, work, DRIVEN, h)
        return inner(work, model, h)

    return set_first


def more_driven_orders(carried: int) -> Callable[[Floats, Floats, int, int], tuple[float, float]]:
    """As series.more_orders, after the same of what actuators do."""
    inner = more_orders(carried, Driven)

    @kernel
    def add_orders(work: Floats, model: Floats, first: int, last: int) -> tuple[float, float]:
        expand_more(model, work, DRIVEN, 2.0 * work[HALF], first + 1)
        return inner(work, model, first, last)

    return add_orders


def short_impulse(order: int) -> Callable[[Floats, Floats], None]:
    """As series.short_impulse, of the force that actuators change."""
    nodes = THREE_NODES if order == 6 else FOUR_NODES

    @straight_line
    def set_short_impulse(work: Floats, model: Floats) -> None:
        then, weights, second_weights = nodes
        turn, force = ([np.zeros(len(then)) for _ in range(count)] for count in (4, 3))
        power = np.ones(len(then))
        for k in range(1, order + 1):
            power = power * then
            force = [one + power * work[DRIVEN + STRIDE_OF_DRIVE * k + n] for n, one in enumerate(force)]
            if k <= order - 2:
                turn = [one + power * work[TERMS + k * STRIDE + TERM + n] for n, one in enumerate(turn)]
        keep_impulse(work, _impulse(model, turn, force, weights, second_weights))

    return set_short_impulse


@straight_line
def set_impulse(work: Floats, model: Floats, order: int, f: float) -> None:
    """As series.set_impulse, of the force that actuators change."""
    nodes, weights, second_weights = EIGHT_NODES
    then, top = f * nodes, order + 1

    def add_term(i: Any, *sums: Row) -> tuple[Row, ...]:
        k = top - i
        turn = [then * (one + work[TERMS + k * STRIDE + TERM + n]) for n, one in enumerate(sums[:4])]
        return *turn, *(then * (one + work[DRIVEN + STRIDE_OF_DRIVE * k + n]) for n, one in enumerate(sums[4:]))

    sums = repeated(1, top, tuple(np.zeros(8) for _ in range(7)), add_term)
    keep_impulse(work, _impulse(model, sums[:4], sums[4:], weights, second_weights))


def _impulse(
    model: Any, turn: Sequence[Row], change: Sequence[Row], weights: Row, second_weights: Row
) -> tuple[Row, Row]:
    """∫ R F dθ and ∬ R F dθ² of a force that differs by ``change`` from what it was at the start."""
    start = [model[FORCE + axis] for axis in range(3)]
    return impulse_under(start, change, turn, weights, second_weights)
