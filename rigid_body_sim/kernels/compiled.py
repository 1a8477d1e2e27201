"""The place, with kernel_cache and lock, that knows numba: compile a kernel, or run the same function as plain Python.

A kernel is a function of floats and flat float64 arrays. With numba it becomes machine code; without it (not installed,
or switched off by ``RIGID_BODY_SIM_NO_NUMBA=1``) the very same function runs as Python, slower and with the same
results.
"""

import hashlib
import os
from collections import Counter
from collections.abc import Callable, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from . import kernel_cache
from .arrays import Floats, Vector, python_floats
from .quick_compiling import quick_compiling

try:
    import numba
except (ImportError, OSError):  # OSError of coverage, which numba imports, where the working directory is gone
    numba = None

_Kernel = TypeVar("_Kernel", bound=Callable[..., Any])  # decorated, it keeps its signature
_Result = TypeVar("_Result")

ENABLED = numba is not None and os.environ.get("RIGID_BODY_SIM_NO_NUMBA", "0") in ("", "0")


@cache
def sources_digest() -> str:
    """Name of this version of the kernels: numba notices a change in a kernel's own file, not in those it calls."""
    package = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for folder in ("kernels", "effects", "integrators"):
        for source in sorted((package / folder).glob("*.py")):
            digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


Steps = Callable[[Floats, Floats, Floats, float, int], int]  # what advances a state: see integrators.base

# Kernels create no arrays, so numba need not count references to them: without `_nrt` it does so at every inner call,
# which made a step 1.6 times slower. Python's and numpy's rules of arithmetic are kept: no fast-math, so results are
# the same bits.
_OPTIONS = {"error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}
_INNER_OPTIONS = {**_OPTIONS, "forceinline": True, "no_cpython_wrapper": True}

# What was compiled knows the paths of its sources: another installation has a folder of its own.
_PLACE = hashlib.sha256(__file__.encode()).hexdigest()[:8]
FOLDER, NO_FOLDER = kernel_cache.choose(f"kernels-{sources_digest()}-{_PLACE}") if ENABLED else (None, "")

_inner: list[tuple[str, Any]] = []  # identity of each kernel, and what numba makes of it; here it is kept alive


def kernel(function: _Kernel) -> _Kernel:
    """Decorate a kernel. From Python it is the function that it was; in a kernel that is compiled it is compiled, too.

    No call from Python can reach what numba makes of it, so that needs no wrapper, and no place in the cache: it lies
    there as part of what was made ``ready``.
    """
    if ENABLED:
        dispatcher: Any = numba.njit(**_INNER_OPTIONS)(function)
        typed = dispatcher.get_call_template
        # A kernel is not compiled once more for each number that stands in a call of it.
        dispatcher.get_call_template = lambda args, kws: typed(tuple(map(numba.types.unliteral, args)), kws)
        vars(function)["_numba_type_"] = dispatcher._numba_type_  # where numba looks
        _inner.append((kernel_cache.identity(function), dispatcher))
    return function


def compilations() -> dict[str, int]:
    """How often each kernel was compiled in this process, as part of whatever was made ready."""
    counts: Counter[str] = Counter()
    for name, dispatcher in _inner:
        counts[name] += len(dispatcher.overloads)
    return {name: count for name, count in counts.items() if count}


@cache
def _entry(function: Callable[..., Any]) -> Any:
    """What numba makes of a kernel that Python calls."""
    dispatcher: Any = numba.njit(**_OPTIONS)(function)
    # Where ``cache=True`` has numba's own, which trusts what it finds.
    dispatcher._cache = kernel_cache.KernelCache(function, FOLDER, NO_FOLDER)
    return dispatcher


def table(rows: Sequence[Sequence[float]], width: int) -> Vector:
    """Coefficients for kernels, one row after the other in one sequence, each filled up with zeros to ``width``.

    Compiled code indexes an array at run time, but searches a tuple; Python reads floats from a tuple faster.
    """
    flat = tuple(float(value) for row in rows for value in (*row, *(0.0,) * (width - len(row))))
    return np.array(flat) if ENABLED else flat


class Request(NamedTuple):
    """A kernel, and arguments of the types for which it is wanted."""

    function: Callable[..., Any]
    examples: tuple[Any, ...]

    @property
    def is_met(self) -> bool:
        """Whether compiled code is there, or none is needed, so that ``ready`` takes no time."""
        if not ENABLED:
            return True
        dispatcher, signature = _entry(self.function), self.signature
        if signature in dispatcher.overloads:
            return True
        kept: bool = dispatcher._cache.has(signature, dispatcher.targetctx.codegen())
        return kept

    @property
    def signature(self) -> tuple[Any, ...]:
        """Types of the arguments, as numba names them."""
        return tuple(map(numba.typeof, self.examples))


def ready(function: Callable[..., _Result], *examples: object) -> Callable[..., _Result]:
    """Compile ``function`` now, for arguments of the types of ``examples``, and return what calls it fastest.

    The compiled entry point is called without numba's look-up of argument types (0.4 of the cost of a short step), so
    the types passed later must be those of ``examples``. Without numba, arrays are passed as memoryviews: indexing
    those gives Python floats, which are faster than numpy's scalars and follow the same IEEE rules.
    """
    if not ENABLED:
        return partial(_run_as_python, function)
    dispatcher, signature = _entry(function), Request(function, examples).signature
    if signature not in dispatcher.overloads:
        with quick_compiling(function.__qualname__):
            dispatcher.compile(signature)
    entry: Callable[..., _Result] = dispatcher.overloads[signature].entry_point
    return entry


def _run_as_python(function: Callable[..., _Result], *arguments: Any) -> _Result:
    with np.errstate(all="ignore"):  # rows follow IEEE rules without a word, as compiled code does
        return function(*(python_floats(one) if isinstance(one, np.ndarray) else one for one in arguments))


def ready_steps(request: Request) -> Steps:
    """``ready`` for an integrator's kernel, which refuses a step that cannot be done: see integrators.base.

    Compiled, such a step shows as inf or NaN, by IEEE rules. Plain Python raises instead, in the middle of the step.
    """
    run: Steps = ready(request.function, *request.examples)
    return run if ENABLED else lambda *arguments: refuse_what_raises(run, *arguments)


def refuse_what_raises(run: Steps, state: Floats, model: Floats, work: Floats, h: float, n: int) -> int:
    """Up to n steps, and how many were done; where arithmetic raises, state and model are those before the step."""
    before, model_before = state.copy(), model.copy()
    try:
        return run(state, model, work, h, n)
    except (ArithmeticError, ValueError):
        state[:], model[:] = before, model_before
    if n == 1:
        return 0
    first = refuse_what_raises(run, state, model, work, h, n // 2)
    return first + (refuse_what_raises(run, state, model, work, h, n - first) if first == n // 2 else 0)
