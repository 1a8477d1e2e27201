"""What a parameter is: its name, type, unit, default, range and text, and how a value given for it is read."""

import difflib
import math
from collections import Counter
from collections.abc import Iterable, Mapping, Set
from dataclasses import dataclass
from typing import Any

from ..kernels.arrays import plain

NAMES = tuple[str, ...]
TYPES = {bool: "bool", int: "integer", float: "double", str: "string", tuple: "double array", NAMES: "string array"}
OPEN = ".<name>."  # between a group and a parameter that each member of the group has
MOST_SHOWN = 200  # characters of a value in a message


@dataclass(frozen=True)
class Parameter:
    """One parameter. ``<name>`` stands for a name of the user's.

    ``type`` is bool, int, float, str, tuple (of floats) or NAMES (any of ``choices``, none of them twice). A
    ``dynamic`` one may be set while the node runs, and acts from the next step on.
    """

    name: str
    type: type
    default: Any
    text: str
    unit: str = ""
    above: float | None = None  # greatest lower bound, excluded
    least: float | None = None  # smallest value allowed
    most: float | None = None
    length: int | None = None
    choices: tuple[str, ...] = ()
    optional: bool = False  # a text or array may be empty, which means that it is not used
    dynamic: bool = False
    required: bool = False  # of a group: it must be given, and the default is an example for messages
    file: bool = False  # a text is the path of a file that is read
    lone: bool = False  # a text in place of names is one name

    def read(self, name: str, value: Any) -> Any:
        """``value`` as this parameter's type. Raises ValueError: what was given, which rule it breaks."""
        try:
            converted = self._convert(value)
            self._check(converted)
        except ValueError as reason:
            raise ValueError(f"parameter {name} = {shown(value)}: {reason}") from None
        return converted

    @property
    def rule(self) -> str:
        """The values allowed, in words; empty when any value of the type is."""
        if self.type == NAMES:
            return "any of " + ", ".join(self.choices) if self.choices else "names, none twice"
        if self.choices:
            return ("empty or " if self.optional else "") + "one of " + ", ".join(self.choices)
        if self.type not in (int, float, tuple):
            return ""
        bounds = [(self.above, "greater than"), (self.least, "at least"), (self.most, "at most")]
        within = [f"{word} {bound:g}" for bound, word in bounds if bound is not None]
        if self.type is not tuple:
            return " and ".join([*(["finite"] if self.type is float else []), *within])
        numbers = f"{self.length} finite numbers" if self.length else "finite numbers"
        return f"{numbers}, each {' and '.join(within)}" if within else numbers

    def _convert(self, value: Any) -> Any:
        if self.type == NAMES:
            if self.lone and isinstance(value, str):
                return (value,)
            if not is_array(value):
                raise ValueError(
                    f"is not an array; give names such as {list(self.choices[:2] or self.default or ('pose', 'twist'))}"
                )
            return tuple(value)
        if self.type is tuple:
            if not is_array(value):
                raise ValueError(f"is not an array; give {self.length or 'some'} numbers such as {self._example}")
            return tuple(_number(entry, self._example) for entry in value)
        if self.type is float:
            return _number(value, self.default)
        if not isinstance(value, self.type) or (self.type is int and isinstance(value, bool)):
            raise ValueError(f"is not of type {TYPES[self.type]}; give a value such as {self._example!r}")
        return value

    @property
    def _example(self) -> Any:
        """What a message proposes where the default may be empty."""
        if self.type is tuple:
            return list(self.default or (1.0, 0.5, 0.0)[: self.length or 2])
        return (self.default or (*self.choices, "name")[0]) if self.type is str else self.default

    def _check(self, value: Any) -> None:
        if self.type == NAMES:
            self._check_names(value)
            return
        if self.optional and not value:
            return
        if self.choices and value not in self.choices:
            raise ValueError(f"is not allowed; give {self.rule}{self._meant(value)}")
        if self.length and len(value) != self.length:
            raise ValueError(f"has {len(value)} entries; give {self.length}, such as {self._example}")
        numbers = value if self.type is tuple else (value,) if self.type in (int, float) else ()
        if not all(-math.inf < number < math.inf for number in numbers):  # also of integers that no float holds
            raise ValueError("is not finite; give finite numbers")
        in_range = all(
            (self.above is None or number > self.above)
            and (self.least is None or number >= self.least)
            and (self.most is None or number <= self.most)
            for number in numbers
        )
        if not in_range:
            raise ValueError(f"is out of range; give {'a number that is ' * (self.type is not tuple)}{self.rule}")
        if self.type is str and not value.strip():
            raise ValueError(f"is empty; give a name such as {self.default!r}")

    def _meant(self, value: Any) -> str:
        """The choice that a text is nearest to, where one is near."""
        near = difflib.get_close_matches(str(value), self.choices, n=1)
        return f"; did you mean {near[0]}?" if near else ""

    def _check_names(self, names: tuple[Any, ...]) -> None:
        if not names and self.default:
            raise ValueError(f"is empty; give at least one name, such as {list(self.default)}")
        for name in names:
            if name not in self.choices if self.choices else not (isinstance(name, str) and name.strip()):
                raise ValueError(f"{shown(name)} is not allowed; give {self.rule}")
        for name, count in Counter(names).items():
            if count > 1:
                raise ValueError(f"{shown(name)} is given twice; give it once")


def shown(value: Any) -> str:
    """``value`` as messages quote it, arrays of any kind as lists: all of it, or how it begins."""
    try:
        text = " ".join(repr(plain(value)).split())
    except ValueError:  # Python prints no integer of more than 4300 digits
        text = "a number of thousands of digits"
    return text if len(text) <= MOST_SHOWN else f"{text[:MOST_SHOWN]}... ({len(text)} characters)"


def dotted(name: str) -> str:
    """The sentence for a name of the user's that cannot be told from those of parameters."""
    return f"the name {shown(name)} has a dot, which divides names of parameters; give {shown(name.replace('.', '_'))}"


def is_array(value: Any) -> bool:
    """Something with an order. Bytes are texts; a set has no order."""
    return isinstance(value, Iterable) and not isinstance(value, str | bytes | bytearray | Set | Mapping)


def _number(value: Any, example: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"{shown(value)} is not a number; give a value such as {example}")
    try:
        return float(value)
    except OverflowError:
        raise ValueError("is too large; give a number below 1e308") from None
