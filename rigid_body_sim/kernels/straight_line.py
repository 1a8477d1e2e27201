"""Kernels without branches: run once with symbols in place of their numbers, they write down their own machine code.

numba reads a kernel's source and asks for the type of each operation in it, milliseconds each, and it has no word for
eight numbers at once. A function decorated with ``straight_line`` is *run* instead, when the kernel that calls it is
compiled: what it does with a symbol becomes an instruction (see symbols). So a loop over Python's own numbers is
unrolled, and a *row*, four or eight numbers side by side, is one register where the machine has such. A symbol has no
truth value: an ``if`` that depends on one raises. Without numba the function is what it was, and rows are numpy arrays:
the same operations in the same order. No two of them are contracted to one (fma), so the bits are the same on every
machine.
"""

import functools
import inspect
from collections.abc import Callable, Sequence
from typing import Any, TypeVar, get_args, get_type_hints

from .compiled import ENABLED
from .symbols import Block, Memory, Symbol, as_symbol

if ENABLED:
    from numba.core import types
    from numba.core.typing import signature, templates

_Function = TypeVar("_Function", bound=Callable[..., Any])


def straight_line(function: _Function) -> _Function:
    """Decorate a kernel of floats, whole numbers and arrays of floats that has no branches; see the head of the module.

    Its annotation says what it returns: nothing, a float, or a tuple of floats, named or not.
    """
    if ENABLED:
        vars(function)["_numba_type_"] = types.Function(_template(function))
    return function


def in_lanes(function: _Function) -> _Function:
    """Decorate a straight_line kernel that is written for one body and does the same for eight, in one lane each.

    Its arrays are blocks (see symbols.Block), its numbers the same for all bodies. The bits of a body are those of the
    kernel by itself. What it returns is an ``int`` whose bits are what it says of each body, as Symbol.bits are.
    """
    if ENABLED:
        vars(function)["_numba_type_"] = types.Function(_template(function, Block))
    return function


def _template(function: Callable[..., Any], array: Callable[[Memory], Any] = lambda memory: memory) -> Any:
    @functools.cache
    def returned() -> Any:
        return _numba_type(get_type_hints(function)["return"])

    def definition(context: Any, *arguments: Any) -> Any:
        return signature(returned(), *map(types.unliteral, arguments)), functools.partial(_write, function, array)

    name, kind = function.__name__, inspect.Parameter.POSITIONAL_OR_KEYWORD
    parameters = [inspect.Parameter(one, kind) for one in ("context", *inspect.signature(function).parameters)]
    vars(definition)["__signature__"] = inspect.Signature(parameters)
    return templates.make_intrinsic_template(function, definition, name)


def _numba_type(annotation: Any) -> Any:
    if annotation in (None, type(None)):
        return types.none
    if annotation is int:
        return types.int64
    if annotation is float:
        return types.float64
    if fields := getattr(annotation, "_fields", ()):
        return types.NamedUniTuple(types.float64, len(fields), annotation)
    return types.UniTuple(types.float64, len(get_args(annotation)))


def _write(
    function: Callable[..., Any], array: Any, context: Any, builder: Any, sig: Any, arguments: Sequence[Any]
) -> Any:
    """Write the instructions of a call of ``function``, and return what holds its result."""
    pairs = zip(sig.args, arguments, strict=True)
    result = function(*(_argument(array, context, builder, kind, value) for kind, value in pairs))
    if sig.return_type is types.none:
        return context.get_dummy_value()
    if sig.return_type is types.int64:
        return result.value
    if sig.return_type is types.float64:
        return as_symbol(builder, result).real.value
    numbers = [as_symbol(builder, number).real.value for number in result]
    return context.make_tuple(builder, sig.return_type, numbers)


def _argument(array: Callable[[Memory], Any], context: Any, builder: Any, kind: Any, value: Any) -> Any:
    if isinstance(kind, types.Array):
        return array(Memory(builder, context.make_array(kind)(context, builder, value).data))
    if isinstance(kind, types.BaseTuple):
        numbers = [Symbol(builder, builder.extract_value(value, i)) for i in range(len(kind))]
        return kind.instance_class(*numbers) if isinstance(kind, types.BaseNamedTuple) else tuple(numbers)
    return Symbol(builder, value)
