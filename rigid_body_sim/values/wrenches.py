"""Forces and torques on many bodies, held constant between two commands."""

import numpy as np
from numpy.typing import ArrayLike

from ..kernels.arrays import Floats
from .wrench import Wrench

KINDS = ("force_body", "torque_body", "force_world", "torque_world")


class Wrenches:
    """A wrench for each of many bodies.

    Parameters
    ----------
    force_body, torque_body, force_world, torque_world : array_like, shape (n, 3) or (3,)
        Forces [N] and torques [N m], one row for each body or one for all, with the meanings that they have in Wrench.

    Raises
    ------
    ValueError
        A shape that does not fit; a row that is not finite, with its number.
    """

    __slots__ = ("values",)

    def __init__(
        self,
        force_body: ArrayLike | None = None,
        torque_body: ArrayLike | None = None,
        force_world: ArrayLike | None = None,
        torque_world: ArrayLike | None = None,
    ):
        given = dict(zip(KINDS, (force_body, torque_body, force_world, torque_world), strict=True))
        rows = {name: _rows(name, one) for name, one in given.items() if one is not None}
        count = max((len(one) for one in rows.values()), default=1)
        self.values: Floats = np.zeros((count, 12))
        for i, name in enumerate(KINDS):
            if name in rows:
                if len(rows[name]) not in (1, count):
                    raise ValueError(
                        f"{name} has {len(rows[name])} rows where another has {count}; give one for each body, or (3,)"
                    )
                self.values[:, 3 * i : 3 * i + 3] = rows[name]
        with np.errstate(over="ignore", invalid="ignore"):
            finite = np.isfinite(self.values.sum(1))
        if not finite.all():
            row = int(np.argmin(finite))
            shown = Wrenches.__name__ + f" {self.values[row].tolist()}"
            raise ValueError(f"row {row}: {shown} must be finite, and so must the sum of the components")

    @classmethod
    def of(cls, wrench: Wrench) -> "Wrenches":
        """The same for all bodies. Raises ValueError for forces at points."""
        if wrench.points:
            raise ValueError(f"{wrench!r} has forces at points, which many bodies at once do not take")
        f, t, g, u = np.reshape(wrench.values, (4, 3))
        return cls(f, t, g, u)

    def for_bodies(self, n: int) -> Floats:
        """Twelve values for each of n bodies, shape (n, 12). Raises ValueError for another number of rows."""
        if len(self.values) not in (1, n):
            raise ValueError(f"wrenches have {len(self.values)} rows, but there are {n} bodies; give one for each")
        return self.values if len(self.values) == n else np.broadcast_to(self.values, (n, 12))

    def __repr__(self) -> str:
        kinds = [name for i, name in enumerate(KINDS) if self.values[:, 3 * i : 3 * i + 3].any()]
        return f"Wrenches({len(self.values)} rows: {', '.join(kinds) or 'zero'})"


def _rows(name: str, given: ArrayLike) -> Floats:
    try:
        rows = np.array(given, float)
    except (TypeError, ValueError):
        raise ValueError(f"{name} holds what is no number, or rows of different lengths") from None
    if rows.ndim not in (1, 2) or rows.shape[-1] != 3:
        raise ValueError(f"{name} has shape {rows.shape}; give (n, 3), a row for each body, or (3,) for all")
    return rows.reshape(-1, 3)
