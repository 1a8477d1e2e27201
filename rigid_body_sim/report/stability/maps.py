"""Maps: a grid of runs over two quantities, for every integrator, and what a user should conclude from one."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from ... import integrators
from .outcome import BAD, Case, Outcome, attempt

Measured = dict[str, Any]  # rows, columns and cells, as JSON
Cell = dict[str, Any]
Row = TypeVar("Row", float, str)


@dataclass(frozen=True)
class Map(Generic[Row]):
    """A grid of cases; ``case(row, column)`` makes one.

    ``text`` says what is simulated and where the truth comes from; ``hardness(row, column)`` is the number that makes a
    cell hard, and ``hardness_label`` its name.
    """

    name: str
    title: str
    text: str
    rows_label: str
    columns_label: str
    rows: Sequence[Row]
    columns: Sequence[float]
    case: Callable[[Row, float], Case]
    hardness_label: str
    hardness: Callable[[Row, float], float]


def measure(drawn: Map[Any], integrator: str) -> Measured:
    """All cells of one integrator, row by row."""
    cells = [[attempt(drawn.case(row, column), integrator) for column in drawn.columns] for row in drawn.rows]
    return {"rows": list(drawn.rows), "columns": list(drawn.columns), "cells": cells}


def outcomes(measured: Measured) -> list[Outcome]:
    """The outcomes of all cells."""
    return [Outcome(cell["outcome"]) for row in measured["cells"] for cell in row]


def takes_part(measured: Measured) -> bool:
    """Whether the integrator did anything but refuse."""
    return any(outcome is not Outcome.REFUSED for outcome in outcomes(measured))


def bad_cells(measured: Measured) -> list[Cell]:
    """The cells in the red, with their row and column."""
    return [one for one in flat(measured) if Outcome(one["outcome"]) in BAD]


def worst_error(measured: Measured) -> float:
    """Largest error of the accurate cells; 0 when there is none."""
    return max((c["error"] for c in flat(measured) if c["outcome"] == Outcome.ACCURATE.value), default=0.0)


def flat(measured: Measured) -> list[Cell]:
    """All cells, with their row and column."""
    return [
        {"row": row, "column": column, **cell}
        for row, cells in zip(measured["rows"], measured["cells"], strict=True)
        for column, cell in zip(measured["columns"], cells, strict=True)
    ]


def limit(drawn: Map[Any], measured: Measured) -> float | None:
    """Up to which hardness no cell is in the red: None when some is at the least, infinity when none is."""
    bad = [drawn.hardness(cell["row"], cell["column"]) for cell in bad_cells(measured)]
    if not bad:
        return math.inf
    softest = min(bad) * (1.0 - 1e-9)
    every = (drawn.hardness(cell["row"], cell["column"]) for cell in flat(measured))
    return max((hardness for hardness in every if hardness < softest), default=None)


def conclusion(drawn: Map[Any], by_integrator: dict[str, Measured]) -> str:
    """What to conclude from a map, from the numbers alone: how ``auto`` did, and how far the others can be trusted."""
    said = [_of_auto(drawn, by_integrator[integrators.AUTO])] if integrators.AUTO in by_integrator else []
    limits = {
        name: limit(drawn, one) for name, one in by_integrator.items() if name != integrators.AUTO and takes_part(one)
    }
    clean = [f"`{name}`" for name, reach in limits.items() if reach == math.inf]
    never = [f"`{name}`" for name, reach in limits.items() if reach is None]
    partly = [f"`{name}` {reach:.2g}" for name, reach in limits.items() if reach not in (None, math.inf)]
    if clean:
        said.append(f"never wrong either: {_list(clean)}")
    if partly:
        said.append(f"right only up to {drawn.hardness_label} of about: {', '.join(partly)}")
    if never:
        said.append(f"wrong somewhere even at the smallest {drawn.hardness_label}: {_list(never)}")
    return "; ".join(said) + "."


def _of_auto(drawn: Map[Any], measured: Measured) -> str:
    bad, every = bad_cells(measured), outcomes(measured)
    if bad:
        where = f"{drawn.rows_label} {bad[0]['row']}, {drawn.columns_label} {bad[0]['column']}"
        return f"`auto` is wrong or diverges in {len(bad)} of {len(every)} cells, such as {where}"
    refused = [cell for cell in flat(measured) if Outcome(cell["outcome"]) is Outcome.REFUSED]
    cells = f"all {len(every)} cells"
    if refused:
        why = refused[0]["said"].split(";")[0]
        cells = f"{len(every) - len(refused)} of {len(every)} cells and refuses the rest ({why})"
    return f"`auto` is accurate in {cells}, with an error of at most {worst_error(measured):.1e}"


def _list(names: Sequence[str]) -> str:
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
