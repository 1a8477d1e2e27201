"""What a section of the report is: measurements that give numbers, and what is shown of the numbers.

A section is split like this so that a finished measurement is never done again: results are kept as they come (store),
and sentences, tables and pictures are made from the results alone.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from .. import integrators

Result = dict[str, Any]  # what JSON can hold: no infinity and no NaN, None where there is no number
Results = Mapping[str, Result]  # by key of the measurement
FAILED = "failed"  # the only entry of the result of a measurement that raised: type and text of the exception


@dataclass(frozen=True)
class Settings:
    """What is to be measured. ``problems`` and ``peers``: names, None for all; ``seed`` decides all random choices.

    ``node_bench``: the JSON file that the node's benchmark wrote.
    """

    quick: bool = False
    seed: int = 1
    integrators: tuple[str, ...] = integrators.CHOICES
    problems: tuple[str, ...] | None = None
    peers: tuple[str, ...] | None = None
    node_bench: Path | None = None


@dataclass(frozen=True)
class Measurement:
    """One piece of work: finished or not done at all.

    ``key``: stable from run to run, unique in its section. ``run``: does the work, without arguments; an exception that
    it raises is kept as its result. ``weight``: seconds that it may take, for the remaining time only.
    """

    key: str
    run: Callable[[], Result]
    weight: float = 1.0


@dataclass(frozen=True)
class Heading:
    """A heading inside a section."""

    text: str


@dataclass(frozen=True)
class Paragraph:
    """A sentence or more, computed from the results. `Backticks` set names in a type of their own."""

    text: str


@dataclass(frozen=True)
class Table:
    """Rows of strings, numbers and None under the columns' names. ``stem``: of its CSV and JSON file.

    ``folded``: the page shows it when its caption is clicked; the Markdown names its files only.
    """

    stem: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str | float | int | None]]
    caption: str = ""
    folded: bool = False


@dataclass(frozen=True)
class Picture:
    """A picture that lies in the folder as ``stem``.svg and ``stem``.png, as style.save leaves it there."""

    stem: str
    caption: str


Block = Heading | Paragraph | Table | Picture


class Section(Protocol):
    """One chapter of the page. ``name``: what --only calls it, also the prefix of its keys and files."""

    name: str
    title: str

    def measurements(self, settings: Settings) -> list[Measurement]:
        """All that is to be measured, in order."""
        ...

    def headlines(self, results: Results) -> list[str]:
        """The sentences for the top of the page, computed from the results: goals met, and those not met."""
        ...

    def render(self, results: Results, folder: Path) -> list[Block]:
        """What the page shows, in order. Pictures are drawn into ``folder``; results may be missing or have failed."""
        ...


def finished(results: Results, prefix: str = "") -> dict[str, Result]:
    """The results that are there and did not fail, of the keys that begin with ``prefix``."""
    return {key: result for key, result in results.items() if key.startswith(prefix) and FAILED not in result}
