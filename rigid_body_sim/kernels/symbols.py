"""Numbers, rows and arrays in a ``straight_line`` kernel: of numpy, or symbols that write down instructions.

A *row* is four or eight numbers side by side. As symbols it is one register where the machine has such; in a kernel
that is ``in_lanes``, where each number is one of eight bodies, it is as many registers as it has numbers.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .compiled import ENABLED

if ENABLED:
    from llvmlite import ir

    _REAL, _INTEGER = ir.DoubleType(), ir.IntType(64)

Row = Any  # four or eight numbers side by side: of numpy, or a symbol of them
BODIES = 8  # side by side in a kernel that is ``in_lanes``


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
        return as_symbol(self.builder, other) + self

    def __sub__(self, other: Any) -> "Symbol":
        return self._with(other, "sub")

    def __rsub__(self, other: Any) -> "Symbol":
        return as_symbol(self.builder, other) - self

    def __mul__(self, other: Any) -> "Symbol":
        return self._with(other, "mul")

    def __rmul__(self, other: Any) -> "Symbol":
        return as_symbol(self.builder, other) * self

    def __floordiv__(self, other: Any) -> "Symbol":
        """Of whole numbers that are not below 0."""
        return self._with(other, "sdiv")

    def __truediv__(self, other: Any) -> "Symbol":
        return self.real._with(other, "div")

    def __rtruediv__(self, other: Any) -> "Symbol":
        return as_symbol(self.builder, other) / self

    def __neg__(self) -> "Symbol":
        return type(self)(self.builder, self.builder.fneg(self.value))

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
        return self._by_itself("fabs")

    def _by_itself(self, operation: str) -> "Symbol":
        name = f"llvm.{operation}.{'f64' if self.value.type == _REAL else f'v{self.value.type.count}f64'}"
        kind = ir.FunctionType(self.value.type, [self.value.type])
        function = self.builder.module.globals.get(name) or ir.Function(self.builder.module, kind, name)
        return type(self)(self.builder, self.builder.call(function, [self.value]))

    def _with(self, other: Any, operation: str) -> "Symbol":
        if isinstance(other, Lanes):
            return NotImplemented
        a, b = _alike(self, as_symbol(self.builder, other))
        result = getattr(self.builder, operation if a.is_whole else f"f{operation}")(a.value, b.value)
        return (Each if Each in (type(self), type(other)) else Symbol)(self.builder, result)

    def __le__(self, other: Any) -> "Symbol":
        return self._compared("<=", other)

    def __ge__(self, other: Any) -> "Symbol":
        return self._compared(">=", other)

    def __lt__(self, other: Any) -> "Symbol":
        return self._compared("<", other)

    def __gt__(self, other: Any) -> "Symbol":
        return self._compared(">", other)

    def _compared(self, how: str, other: Any) -> "Symbol":
        a, b = _alike(self.real, as_symbol(self.builder, other))
        return Symbol(self.builder, self.builder.fcmp_ordered(how, a.value, b.value))

    def __and__(self, other: "Symbol") -> "Symbol":
        return Symbol(self.builder, self.builder.and_(self.value, other.value))

    def __or__(self, other: "Symbol") -> "Symbol":
        return Symbol(self.builder, self.builder.or_(self.value, other.value))

    @property
    def root(self) -> "Symbol":
        """Its square root."""
        return self._by_itself("sqrt")

    @property
    def bits(self) -> "Symbol":
        """Of truth values, one for each body: a whole number whose bit i is the value of body i."""
        together = self.builder.bitcast(self.value, ir.IntType(BODIES))
        return Symbol(self.builder, self.builder.zext(together, _INTEGER))

    def repeated_in_lanes(self, count: int) -> "Symbol":
        """The row that has this number in each lane."""
        none = ir.Constant(_row_type(count), ir.Undefined)
        one = self.builder.insert_element(none, self.real.value, _place(0))
        return Symbol(self.builder, self.builder.shuffle_vector(one, none, _places([0] * count)))


class Each(Symbol):
    """A number of each of eight bodies."""

    def __rmul__(self, other: Any) -> Any:
        return Lanes([number * self for number in other.tolist()]) if isinstance(other, np.ndarray) else self * other

    def __radd__(self, other: Any) -> Any:
        return Lanes([number + self for number in other.tolist()]) if isinstance(other, np.ndarray) else self + other


class Memory:
    """An array of floats that is known when the kernel runs."""

    def __init__(self, builder: Any, pointer: Any):
        self.builder, self._pointer = builder, pointer

    def __getitem__(self, at: Any) -> Symbol:
        return Symbol(self.builder, self.builder.load(self.place(at)))

    def __setitem__(self, at: Any, value: Any) -> None:
        self.builder.store(as_symbol(self.builder, value).real.value, self.place(at))

    def place(self, at: Any) -> Any:
        """Pointer to the number at an index."""
        return self.builder.gep(self._pointer, [as_symbol(self.builder, at).value], inbounds=True)

    def row(self, at: Any, lanes: int) -> Symbol:
        """So many numbers from an index on."""
        return Symbol(self.builder, self.builder.load(self._row_place(at, lanes), align=8))

    def set_row(self, at: Any, value: Row) -> None:
        """Put the numbers of a row to an index and on."""
        symbol = as_symbol(self.builder, value)
        self.builder.store(symbol.value, self._row_place(at, symbol.value.type.count), align=8)

    def _row_place(self, at: Any, lanes: int) -> Any:
        return self.builder.bitcast(self.place(at), _row_type(lanes).as_pointer())


class Block:
    """The arrays of eight bodies, number by number: where one array has a number, here are those of all."""

    def __init__(self, memory: Memory):
        self._memory = memory

    def __getitem__(self, at: Any) -> Each:
        symbol = self._memory.row(BODIES * at, BODIES)
        return Each(symbol.builder, symbol.value)

    def __setitem__(self, at: Any, value: Any) -> None:
        symbol = as_symbol(self._memory.builder, value)
        is_one = symbol.value.type == _REAL
        self._memory.set_row(BODIES * at, symbol.repeated_in_lanes(BODIES) if is_one else symbol)

    def row(self, at: Any, lanes: int) -> "Lanes":
        """So many numbers from an index on."""
        return Lanes([self[at + i] for i in range(lanes)])

    def set_row(self, at: Any, value: Row) -> None:
        """Put the numbers of a row to an index and on."""
        for i, number in enumerate(value):
            self[at + i] = number


class Lanes:
    """A row whose numbers are those of eight bodies each; with numpy's rows and with numbers it acts as a row does."""

    __array_ufunc__ = None

    def __init__(self, numbers: Sequence[Any]):
        self.numbers = list(numbers)

    def __len__(self) -> int:
        return len(self.numbers)

    def __getitem__(self, lane: Any) -> Any:
        return Lanes([self.numbers[i] for i in lane]) if isinstance(lane, list) else self.numbers[lane]

    def __add__(self, other: Any) -> "Lanes":
        return self._with(other, lambda a, b: a + b)

    def __radd__(self, other: Any) -> "Lanes":
        return self._with(other, lambda a, b: b + a)

    def __sub__(self, other: Any) -> "Lanes":
        return self._with(other, lambda a, b: a - b)

    def __rsub__(self, other: Any) -> "Lanes":
        return self._with(other, lambda a, b: b - a)

    def __mul__(self, other: Any) -> "Lanes":
        return self._with(other, lambda a, b: a * b)

    def __rmul__(self, other: Any) -> "Lanes":
        return self._with(other, lambda a, b: b * a)

    def __truediv__(self, other: Any) -> "Lanes":
        return self._with(other, lambda a, b: a / b)

    def __neg__(self) -> "Lanes":
        return Lanes([-number for number in self.numbers])

    @property
    def magnitude(self) -> "Lanes":
        """Absolute values."""
        return Lanes([magnitude(number) for number in self.numbers])

    def _with(self, other: Any, operation: Callable[[Any, Any], Any]) -> "Lanes":
        others: Any = other if isinstance(other, Lanes | np.ndarray) else [other] * len(self)
        return Lanes([operation(a, _python_number(b)) for a, b in zip(self.numbers, others, strict=True)])


def _python_number(value: Any) -> Any:
    return value if isinstance(value, Symbol) else float(value)


def row(numbers: Any, at: Any, lanes: int) -> Row:
    """So many numbers from ``numbers[at]`` on."""
    return numbers.row(at, lanes) if isinstance(numbers, Memory | Block) else np.array(numbers[at : at + lanes])


def set_row(numbers: Any, at: Any, value: Row) -> None:
    """Put the numbers of a row to ``numbers[at]`` and on."""
    if isinstance(numbers, Memory | Block):
        numbers.set_row(at, value)
    else:
        numbers[at : at + len(value)] = value.data if isinstance(numbers, memoryview) else value


def row_of(*numbers: Any) -> Row:
    """The row of these numbers."""
    if (symbol := _first_symbol(*numbers)) is None:
        return np.array(numbers, float)
    if isinstance(symbol, Each):
        return Lanes(numbers)
    filled = ir.Constant(_row_type(len(numbers)), ir.Undefined)
    for lane, number in enumerate(numbers):
        filled = symbol.builder.insert_element(filled, as_symbol(symbol.builder, number).value, _place(lane))
    return Symbol(symbol.builder, filled)


def picked(a: Row, b: Row, lanes: Sequence[int]) -> Row:
    """The row of those lanes, where those of ``b`` are counted on from those of ``a``."""
    if isinstance(a, Lanes) or isinstance(b, Lanes):
        both = [*a, *b]
        return Lanes([both[i] for i in lanes])
    if (symbol := _first_symbol(a, b)) is None:
        return np.concatenate((a, b))[lanes]
    a, b = as_symbol(symbol.builder, a), as_symbol(symbol.builder, b)
    return Symbol(symbol.builder, symbol.builder.shuffle_vector(a.value, b.value, _places(lanes)))


def chosen(condition: Any, a: Row, b: Row) -> Row:
    """The row ``a`` for the bodies for which the condition is true, ``b`` for the others."""
    builder, found = condition.builder, []
    for pair in zip(a, b, strict=True):
        one, other = (as_symbol(builder, number).real for number in pair)
        one, other = (each if isinstance(each, Each) else each.repeated_in_lanes(BODIES) for each in (one, other))
        found.append(Each(builder, builder.select(condition.value, one.value, other.value)))
    return Lanes(found)


def _lanes_in(value: Row) -> int:
    """How many numbers a row has."""
    return int(value.value.type.count) if isinstance(value, Symbol) else len(value)


def magnitude(value: Any) -> Any:
    """Absolute value of a number, or of each in a row."""
    return value.magnitude if isinstance(value, Symbol | Lanes) else abs(value)


def sum_of(numbers: Row) -> Any:
    """Of the lanes: halves are added until one number is left; three are added in turn."""
    count = _lanes_in(numbers)
    if count == 3:
        return (numbers[0] + numbers[1]) + numbers[2]
    while count > 1:
        count //= 2
        numbers = numbers[list(range(count))] + numbers[list(range(count, 2 * count))]
    return numbers[0]


def repeated(first: Any, end: Any, start: tuple[Any, ...], body: Callable[..., tuple[Any, ...]]) -> tuple[Any, ...]:
    """What ``body(i, *values)`` makes of ``start``, called for each i from ``first`` to before ``end`` in turn.

    Where these are symbols it is a loop when the kernel runs, else it is unrolled.
    """
    if (symbol := _first_symbol(first, end)) is not None:
        return _loop(symbol.builder, as_symbol(symbol.builder, first), as_symbol(symbol.builder, end), start, body)
    for i in range(first, end):
        start = body(i, *start)
    return start


def _loop(
    builder: Any, first: Symbol, end: Symbol, start: tuple[Any, ...], body: Callable[..., tuple[Any, ...]]
) -> tuple[Symbol, ...]:
    before, begin = builder.block, [first, *(as_symbol(builder, value) for value in start)]
    head, inside, after = (builder.append_basic_block() for _ in range(3))
    builder.branch(head)
    builder.position_at_end(head)
    held = [builder.phi(symbol.value.type) for symbol in begin]
    builder.cbranch(builder.icmp_signed("<", held[0], end.value), inside, after)
    builder.position_at_end(inside)
    i, *values = (Symbol(builder, one) for one in held)
    then = [i + 1, *(as_symbol(builder, value) for value in body(i, *values))]
    for phi, old, new in zip(held, begin, then, strict=True):
        phi.add_incoming(old.value, before)
        phi.add_incoming(new.value, builder.block)
    builder.branch(head)
    builder.position_at_end(after)
    return tuple(values)


def _first_symbol(*values: Any) -> Symbol | None:
    return next((value for value in values if isinstance(value, Symbol)), None)


def as_symbol(builder: Any, value: Any) -> Symbol:
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
