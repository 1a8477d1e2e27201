"""Names for the types that most functions here take and give, and how messages write them."""

from array import array
from collections.abc import Sequence
from ctypes import addressof, c_char
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]
Integers: TypeAlias = NDArray[np.int64]
Vector: TypeAlias = Sequence[float] | Floats  # a few numbers, as users give them


def zeros_on_a_line(size: int) -> Floats:
    """So many zeros that begin with a line of the cache, 64 bytes: eight of them are then read as fast as one."""
    longer = np.zeros(size + 8)
    first = -(addressof(c_char.from_buffer(longer.data)) // 8) % 8  # longer.ctypes.data takes three times as long
    return longer[first : first + size]


def python_floats(array: Floats) -> Any:
    """The same memory as a kernel takes it that runs as plain Python: its items are Python's floats.

    Those are twice as fast as numpy's scalars, and follow the same rules, but for a division by zero, which raises.
    """
    return array.data


def plain(value: Any) -> Any:
    """``value`` with lists in place of all arrays and tuples, and Python's numbers: for messages to quote."""
    if isinstance(value, np.ndarray | np.generic | array):
        return value.tolist()
    return [plain(entry) for entry in value] if isinstance(value, list | tuple) else value
