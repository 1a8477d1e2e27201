"""Bodies, their states and what moves them as rows of arrays: what an Ensemble is made from."""

import math
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .kernels import compiled
from .kernels import state as flat
from .kernels.arrays import Floats, Integers, zeros_on_a_line
from .kernels.model import MEMORY
from .terms import Terms
from .values import rotation
from .values.body import Body
from .values.state import BEYOND
from .values.wrench import Wrench

_INERTIAS = ((3,), (6,), (3, 3))  # shapes of one body's


class Bodies(NamedTuple):
    """Of each body its terms, many of which may be the same object, and its row of the models.

    ``start`` are the same rows as they were at the start, where something goes on from step to step, else empty.
    """

    terms: list[Terms]
    models: Floats  # (n, m)
    start: Floats

    @property
    def actuated(self) -> bool:
        """Whether any has actuators."""
        return len(self.start) > 0 and any(one.actuated for one in self.terms)

    @property
    def kinds(self) -> list[tuple[Integers, Terms]]:
        """Terms, and which bodies are under them."""
        numbers = np.array([id(one) for one in self.terms])
        _, first, kind = np.unique(numbers, return_index=True, return_inverse=True)
        return [(np.flatnonzero(kind == k), self.terms[i]) for k, i in enumerate(first.tolist())]

    def memories(self, which: Integers) -> Iterator[tuple[int, slice]]:
        """Of these bodies, where the memory of each begins and ends; see Terms.memory."""
        if len(self.start):
            for i in which.tolist():
                at = int(self.models[i, MEMORY])
                yield i, slice(at, self.models.shape[1])


def count(n: int | None, **given: tuple[ArrayLike | None, tuple[tuple[int, ...], ...]]) -> int:
    """How many bodies arrays are of: (array, shapes that one body's may have). Raises ValueError where they differ."""
    found = {"n": n} if n is not None else {}
    for name, (array, shapes) in given.items():
        try:
            shape = np.shape(array) if array is not None else shapes[0]
        except ValueError:
            raise ValueError(f"{name} has rows of different lengths; give the same for each body") from None
        if shape not in shapes:
            if shape[1:] not in shapes:
                wanted = " or ".join(str(("n", *one)).replace("'", "") for one in shapes)
                raise ValueError(f"{name} has shape {shape}; give {wanted}, a row for each body, or one row for all")
            found[name] = shape[0]
    if len(set(found.values())) > 1:
        said = ", ".join(f"{name} {rows}" for name, rows in found.items())
        raise ValueError(f"numbers of bodies differ: {said}; give one row for each body in all of them")
    bodies = next(iter(found.values()), 1)
    if bodies < 1:
        raise ValueError(f"{next(iter(found))} has no rows; give one for each body, of which there is at least one")
    return bodies


def rows(name: str, given: ArrayLike, n: int, shapes: Sequence[tuple[int, ...]]) -> Floats:
    """One row for each of n bodies, shape (n, ...). Raises ValueError, with its row, for what is not finite."""
    try:
        array = np.array(given, float)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{name} holds what is no number, or rows of different lengths") from None
    if array.shape in shapes:
        array = np.broadcast_to(array, (n, *array.shape))
    finite = np.isfinite(array.reshape(n, -1)).all(1)
    if not finite.all():
        row = int(np.argmin(finite))
        raise ValueError(f"row {row} of {name}, {array[row].tolist()}, is not finite")
    return array


def make(n: int, mass: ArrayLike, inertia: ArrayLike, center_of_mass: ArrayLike, h: float, **others: Any) -> Bodies:
    """n bodies, all under the same other terms, for steps of h [s].

    Raises ValueError, with its row, for a body that cannot be.
    """
    masses, inertias = rows("mass", mass, n, [()]), rows("inertia", inertia, n, _INERTIAS)
    centers = rows("center_of_mass", center_of_mass, n, [(3,)])
    numbers = np.column_stack((masses, inertias.reshape(n, -1), centers))
    _, first, kind = np.unique(numbers, axis=0, return_index=True, return_inverse=True)
    made = []
    for row in first.tolist():
        try:
            made.append(Terms(Body(float(masses[row]), inertias[row], centers[row]), **others))
        except ValueError as reason:
            raise ValueError(f"body {row}: {reason}") from None
    return of_terms([made[i] for i in kind.reshape(-1).tolist()], h)


def of_terms(terms: list[Terms], h: float) -> Bodies:
    """Bodies under these terms, each without a wrench, for steps of h [s]."""
    kept = {id(one): one for one in terms}
    memories = {key: one.memory(h) for key, one in kept.items()}
    made = {key: one.model(Wrench(), memories[key]) for key, one in kept.items()}
    width = -(-max(map(len, made.values())) // 8) * 8
    models = zeros_on_a_line(len(terms) * width).reshape(-1, width)
    for row, one in zip(models, terms, strict=True):
        row[: len(made[id(one)])] = made[id(one)]
    return Bodies(terms, models, models.copy() if any(map(len, memories.values())) else models[:0])


def flat_states(
    n: int,
    models: Floats,
    position: ArrayLike,
    orientation: ArrayLike,
    velocity: ArrayLike,
    angular_velocity: ArrayLike,
) -> Floats:
    """Flat states, shape (n, 26), of n bodies with these models, from what State takes.

    Raises ValueError, with its row, for a state that cannot be.
    """
    x, v = rows("position", position, n, [(3,)]), rows("velocity", velocity, n, [(3,)])
    q, w = rows("orientation", orientation, n, [(4,)]), rows("angular_velocity", angular_velocity, n, [(3,)])
    values = np.hstack((x, _normalized(q), v, w))
    states = np.zeros((n, flat.SIZE))
    _writer()(values.reshape(-1), models.reshape(-1), models.shape[1], states.reshape(-1))
    finite = np.isfinite(states).all(1)
    if not finite.all():
        row = int(np.argmin(finite))
        raise ValueError(f"row {row}: state {values[row].tolist()} {BEYOND}")
    return states


@cache
def _writer() -> Callable[[Floats, Floats, int, Floats], None]:
    numbers = np.zeros(1)
    return compiled.ready(flat.write_states, numbers, numbers, 1, numbers)


def _normalized(q: Floats) -> Floats:
    """As rotation.normalize does, to the bit."""
    norms = np.array([math.hypot(*one) for one in q.tolist()])
    for row in np.flatnonzero(~((norms >= rotation.SMALLEST_NORM) & (norms < math.inf)))[:1].tolist():
        try:
            rotation.normalize(q[row])
        except ValueError as reason:
            raise ValueError(f"row {row} of orientation: {reason}") from None
    return q / norms[:, None]
