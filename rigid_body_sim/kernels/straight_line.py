"""Kernels without branches: run once with symbols in place of their numbers, they write down their own machine code.

numba reads a kernel's source and asks for the type of each operation in it, milliseconds each, and it has no word for
eight numbers at once. A function decorated with ``straight_line`` is *run* instead, when the kernel that calls it is
compiled: what it does with a symbol becomes an instruction. So a loop over Python's own numbers is unrolled, and a
*row*, four or eight numbers side by side, is one register where the machine has such. A symbol has no truth value: an
``if`` that depends on one raises. Without numba the function is what it was, and rows are numpy arrays: the same
operations in the same order. No two of them are contracted to one (fma), so the bits are the same on every machine.
"""

import functools
import inspect
from collections.abc import Callable, Sequence
from typing import Any, TypeVar, get_args, get_type_hints

import numpy as np

from .compiled import ENABLED

if ENABLED:
    from llvmlite import ir
    from numba.core import types
    from numba.core.typing import signature, templates

    _REAL, _INTEGER = ir.DoubleType(), ir.IntType(64)

Row = Any  # four or eight numbers side by side: of numpy, or a symbol of them

_Function = TypeVar("_Function", bound=Callable[..., Any])


class Symbol:
    """A number or row that is known when the kernel runs, and the instruction that makes it."""

    __array_ufunc__ = None  # so that numpy leaves row · symbol to the symbol

    def __init__(self, builder: Any, value: Any):
        self.builder, self.value = builder, value

    @property
    def is_whole(self) -> bool:
        """Whether it is an integer."""
        return isinstance(self.value.type, ir.IntType)

    def __add__(self, other: Any) -> "Symbol":
        return self._with(other, "add")

    def __radd__(self, other: Any) -> "Symbol":
        return _symbol(self.builder, other) + self

    def __sub__(self, other: Any) -> "Symbol":
        return self._with(other, "sub")

    def __rsub__(self, other: Any) -> "Symbol":
        return _symbol(self.builder, other) - self

    def __mul__(self, other: Any) -> "Symbol":
        return self._with(other, "mul")

    def __rmul__(self, other: Any) -> "Symbol":
        return _symbol(self.builder, other) * self

    def __truediv__(self, other: Any) -> "Symbol":
        return self.real._with(other, "div")

    def __rtruediv__(self, other: Any) -> "Symbol":
        return _symbol(self.builder, other) / self

    def __neg__(self) -> "Symbol":
        return Symbol(self.builder, self.builder.fneg(self.value))

    def __getitem__(self, lane: Any) -> "Symbol":
        """The number in a lane, or the row of the lanes in a list."""
        if isinstance(lane, list):
            return picked(self, self, lane)
        return Symbol(self.builder, self.builder.extract_element(self.value, _place(lane)))

    def __bool__(self) -> bool:
        raise TypeError("what a symbol will be is not known yet: a straight_line kernel cannot branch on it")

    @property
    def real(self) -> "Symbol":
        """The same number as a float."""
        return Symbol(self.builder, self.builder.sitofp(self.value, _REAL)) if self.is_whole else self

    @property
    def magnitude(self) -> "Symbol":
        """Its absolute value."""
        name = f"llvm.fabs.{'f64' if self.value.type == _REAL else f'v{self.value.type.count}f64'}"
        kind = ir.FunctionType(self.value.type, [self.value.type])
        function = self.builder.module.globals.get(name) or ir.Function(self.builder.module, kind, name)
        return Symbol(self.builder, self.builder.call(function, [self.value]))

    def _with(self, other: Any, operation: str) -> "Symbol":
        a, b = _alike(self, _symbol(self.builder, other))
        return Symbol(
            self.builder, getattr(self.builder, operation if a.is_whole else f"f{operation}")(a.value, b.value)
        )

    def repeated_in_lanes(self, count: int) -> "Symbol":
        """The row that has this number in each lane."""
        none = ir.Constant(_row_type(count), ir.Undefined)
        one = self.builder.insert_element(none, self.real.value, _place(0))
        return Symbol(self.builder, self.builder.shuffle_vector(one, none, _places([0] * count)))


class Memory:
    """An array of floats that is known when the kernel runs."""

    def __init__(self, builder: Any, pointer: Any):
        self.builder, self._pointer = builder, pointer

    def __getitem__(self, at: Any) -> Symbol:
        return Symbol(self.builder, self.builder.load(self.place(at)))

    def __setitem__(self, at: Any, value: Any) -> None:
        self.builder.store(_symbol(self.builder, value).real.value, self.place(at))

    def place(self, at: Any) -> Any:
        """Pointer to the number at an index."""
        return self.builder.gep(self._pointer, [_symbol(self.builder, at).value], inbounds=True)

    def row_place(self, at: Any, lanes: int) -> Any:
        """Pointer to the numbers from an index on."""
        return self.builder.bitcast(self.place(at), _row_type(lanes).as_pointer())


def row(numbers: Any, at: Any, lanes: int) -> Row:
    """So many numbers from ``numbers[at]`` on."""
    if isinstance(numbers, Memory):
        return Symbol(numbers.builder, numbers.builder.load(numbers.row_place(at, lanes), align=8))
    return np.array(numbers[at : at + lanes])


def set_row(numbers: Any, at: Any, value: Row) -> None:
    """Put the numbers of a row to ``numbers[at]`` and on."""
    if isinstance(numbers, Memory):
        symbol = _symbol(numbers.builder, value)
        numbers.builder.store(symbol.value, numbers.row_place(at, symbol.value.type.count), align=8)
    else:
        numbers[at : at + len(value)] = value.data if isinstance(numbers, memoryview) else value


def row_of(*numbers: Any) -> Row:
    """The row of these numbers."""
    if (symbol := _first_symbol(*numbers)) is None:
        return np.array(numbers, float)
    filled = ir.Constant(_row_type(len(numbers)), ir.Undefined)
    for lane, number in enumerate(numbers):
        filled = symbol.builder.insert_element(filled, _symbol(symbol.builder, number).value, _place(lane))
    return Symbol(symbol.builder, filled)


def picked(a: Row, b: Row, lanes: Sequence[int]) -> Row:
    """The row of those lanes, where those of ``b`` are counted on from those of ``a``."""
    if (symbol := _first_symbol(a, b)) is None:
        return np.concatenate((a, b))[lanes]
    a, b = _symbol(symbol.builder, a), _symbol(symbol.builder, b)
    return Symbol(symbol.builder, symbol.builder.shuffle_vector(a.value, b.value, _places(lanes)))


def _lanes_in(value: Row) -> int:
    """How many numbers a row has."""
    return int(value.value.type.count) if isinstance(value, Symbol) else len(value)


def magnitude(value: Any) -> Any:
    """Absolute value of a number, or of each in a row."""
    return value.magnitude if isinstance(value, Symbol) else abs(value)


def sum_of(numbers: Row) -> Any:
    """Of the lanes: halves are added until one number is left."""
    count = _lanes_in(numbers)
    while count > 1:
        count //= 2
        numbers = numbers[list(range(count))] + numbers[list(range(count, 2 * count))]
    return numbers[0]


def repeated(first: Any, end: Any, start: tuple[Any, ...], body: Callable[..., tuple[Any, ...]]) -> tuple[Any, ...]:
    """What ``body(i, *values)`` makes of ``start``, called for each i from ``first`` to before ``end`` in turn.

    Where these are symbols it is a loop when the kernel runs, else it is unrolled.
    """
    if (symbol := _first_symbol(first, end)) is not None:
        return _loop(symbol.builder, _symbol(symbol.builder, first), _symbol(symbol.builder, end), start, body)
    for i in range(first, end):
        start = body(i, *start)
    return start


def _loop(
    builder: Any, first: Symbol, end: Symbol, start: tuple[Any, ...], body: Callable[..., tuple[Any, ...]]
) -> tuple[Symbol, ...]:
    before, begin = builder.block, [first, *(_symbol(builder, value) for value in start)]
    head, inside, after = (builder.append_basic_block() for _ in range(3))
    builder.branch(head)
    builder.position_at_end(head)
    held = [builder.phi(symbol.value.type) for symbol in begin]
    builder.cbranch(builder.icmp_signed("<", held[0], end.value), inside, after)
    builder.position_at_end(inside)
    i, *values = (Symbol(builder, one) for one in held)
    then = [i + 1, *(_symbol(builder, value) for value in body(i, *values))]
    for phi, old, new in zip(held, begin, then, strict=True):
        phi.add_incoming(old.value, before)
        phi.add_incoming(new.value, builder.block)
    builder.branch(head)
    builder.position_at_end(after)
    return tuple(values)


def straight_line(function: _Function) -> _Function:
    """Decorate a kernel of floats, whole numbers and arrays of floats that has no branches; see the head of the module.

    Its annotation says what it returns: nothing, a float, or a tuple of floats, named or not.
    """
    if ENABLED:
        vars(function)["_numba_type_"] = types.Function(_template(function))
    return function


def _template(function: Callable[..., Any]) -> Any:
    @functools.cache
    def returned() -> Any:
        return _numba_type(get_type_hints(function)["return"])

    def definition(context: Any, *arguments: Any) -> Any:
        return signature(returned(), *map(types.unliteral, arguments)), functools.partial(_write, function)

    name, kind = function.__name__, inspect.Parameter.POSITIONAL_OR_KEYWORD
    parameters = [inspect.Parameter(one, kind) for one in ("context", *inspect.signature(function).parameters)]
    vars(definition)["__signature__"] = inspect.Signature(parameters)
    return templates.make_intrinsic_template(function, definition, name)


def _numba_type(annotation: Any) -> Any:
    if annotation in (None, type(None)):
        return types.none
    if annotation is float:
        return types.float64
    if fields := getattr(annotation, "_fields", ()):
        return types.NamedUniTuple(types.float64, len(fields), annotation)
    return types.UniTuple(types.float64, len(get_args(annotation)))


def _write(function: Callable[..., Any], context: Any, builder: Any, sig: Any, arguments: Sequence[Any]) -> Any:
    """Write the instructions of a call of ``function``, and return what holds its result."""
    pairs = zip(sig.args, arguments, strict=True)
    result = function(*(_argument(context, builder, kind, value) for kind, value in pairs))
    if sig.return_type is types.none:
        return context.get_dummy_value()
    if sig.return_type is types.float64:
        return _symbol(builder, result).real.value
    numbers = [_symbol(builder, number).real.value for number in result]
    return context.make_tuple(builder, sig.return_type, numbers)


def _argument(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    if isinstance(kind, types.Array):
        return Memory(builder, context.make_array(kind)(context, builder, value).data)
    if isinstance(kind, types.BaseTuple):
        numbers = [Symbol(builder, builder.extract_value(value, i)) for i in range(len(kind))]
        return kind.instance_class(*numbers) if isinstance(kind, types.BaseNamedTuple) else tuple(numbers)
    return Symbol(builder, value)


def _first_symbol(*values: Any) -> Symbol | None:
    return next((value for value in values if isinstance(value, Symbol)), None)


def _symbol(builder: Any, value: Any) -> Symbol:
    """``value`` as a symbol: a number or a row of numbers that is known already becomes a constant."""
    if isinstance(value, Symbol):
        return value
    if isinstance(value, np.ndarray):
        return Symbol(
            builder, ir.Constant(_row_type(len(value)), [ir.Constant(_REAL, float(number)) for number in value])
        )
    return Symbol(builder, ir.Constant(_INTEGER if isinstance(value, int) else _REAL, value))


def _alike(a: Symbol, b: Symbol) -> tuple[Symbol, Symbol]:
    """Both as integers, as floats or as rows: as what both can be."""
    if a.value.type == b.value.type:
        return a, b
    a, b = a.real, b.real
    if a.value.type == b.value.type:
        return a, b
    if a.value.type == _REAL:
        return a.repeated_in_lanes(b.value.type.count), b
    return a, b.repeated_in_lanes(a.value.type.count)


def _row_type(lanes: int) -> Any:
    return ir.VectorType(_REAL, lanes)


def _place(lane: int) -> Any:
    return ir.Constant(ir.IntType(32), lane)


def _places(lanes: Sequence[int]) -> Any:
    return ir.Constant(ir.VectorType(ir.IntType(32), len(lanes)), list(lanes))
