"""The pictures of the section: maps of outcomes, growth of errors, decay of a matrix."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import style
from ..section import Picture
from . import maps
from .outcome import Outcome

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_NAMES = {0.5: "√n", 1.0: "n", 1.5: "n√n"}

# Colour, sign in words, the marker that draws it and its colour: four lightnesses, so that they differ in grey too.
LOOK = {
    Outcome.ACCURATE: (style.SKY, "•", ".", style.BLACK),
    Outcome.WRONG: (style.RED, "▼", "v", "#FFFFFF"),
    Outcome.DIVERGED: (style.BLACK, "×", "x", "#FFFFFF"),
    Outcome.REFUSED: ("#F2F2F2", "–", "_", style.GREY),
}
_ORDER = list(LOOK)
ACROSS = 3  # panels side by side


def draw_map(
    drawn: maps.Map[Any], measured: Mapping[str, dict[str, Any]], folder: Path, stem: str, caption: str
) -> Picture:
    """A panel for every integrator that takes part, ``auto`` first."""
    shown = {name: one for name, one in measured.items() if maps.takes_part(one)}
    across, down = min(ACROSS, len(shown)), math.ceil(len(shown) / ACROSS)
    cells = len(next(iter(shown.values()))["rows"])
    with style.figure(3.4 * across + 0.8, (0.3 * max(cells, 5) + 1.0) * down + 0.9) as figure:
        panels = figure.subplots(down, across, squeeze=False, sharex=True, sharey=True)
        for panel in panels.flat[len(shown) :]:
            panel.set_visible(False)
        for k, (panel, (name, one)) in enumerate(zip(panels.flat, shown.items(), strict=False)):
            _panel(panel, one)
            panel.set_title(name, fontsize=11, fontweight="bold" if name == "auto" else "normal")
            panel.tick_params(labelbottom=True, labelleft=k % across == 0)
        figure.supxlabel(drawn.columns_label, fontsize=11)
        figure.supylabel(drawn.rows_label, fontsize=11)
        _legend(figure)
        return style.save(figure, folder, stem, caption)


def _panel(panel: "Axes", measured: dict[str, Any]) -> None:
    """The cells of one integrator: colours, and signs on them."""
    from matplotlib.colors import ListedColormap

    grid = [[_ORDER.index(Outcome(cell["outcome"])) for cell in row] for row in measured["cells"]]
    colours = ListedColormap([LOOK[outcome][0] for outcome in _ORDER])
    panel.pcolormesh(grid, cmap=colours, vmin=-0.5, vmax=len(_ORDER) - 0.5, edgecolors="white", linewidth=0.8)
    panel.grid(False)
    for index, outcome in enumerate(_ORDER):
        _, _, marker, colour = LOOK[outcome]
        there = [(c + 0.5, r + 0.5) for r, row in enumerate(grid) for c, cell in enumerate(row) if cell == index]
        panel.plot(
            *zip(*there, strict=True) if there else ((), ()), linestyle="", marker=marker, color=colour, markersize=5
        )
    for axis, values in ((panel.xaxis, measured["columns"]), (panel.yaxis, measured["rows"])):
        every = max(1, math.ceil(len(values) / 10)) if axis is panel.yaxis else max(1, math.ceil(len(values) / 5))
        kept = range(0, len(values), every)
        axis.set_ticks([k + 0.5 for k in kept], [in_short(values[k]) for k in kept], fontsize=9)


def in_short(value: float | str) -> str:
    """A number as short as it can be read: 1e-6, 0.033, 300."""
    if isinstance(value, str):
        return value
    if 100.0 <= value < 1000.0:
        return f"{value:.0f}"
    text = f"{value:.2g}"
    if "e" in text:
        mantissa, power = text.split("e")
        return f"{mantissa}e{int(power)}"
    return text


def _legend(figure: Any) -> None:
    """What colours and signs mean, above the panels."""
    from matplotlib.lines import Line2D

    handles = [
        Line2D(
            [], [], linestyle="", marker="s", markersize=14, markerfacecolor=colour, markeredgecolor=style.GREY,
            label=f"{outcome.value} ({sign})",
        )
        for outcome, (colour, sign, _, _) in LOOK.items()
    ]  # fmt: skip
    figure.legend(handles=handles, loc="outside upper center", ncols=2, fontsize=10)


Curve = tuple[str, Sequence[float], Sequence[float]]  # label, across, up
_STYLES = (
    (style.BLUE, "-", "o"), (style.RED, "--", "s"), (style.GREEN, "-.", "^"), (style.PURPLE, ":", "D"),
)  # fmt: skip
_STYLE_OF = {"taylor": 0, "exact": 3, "rk4": 1, "splitting4": 2}  # the same in both panels


def draw_growth(
    left: tuple[str, Sequence[Curve]], right: tuple[str, Sequence[Curve]], folder: Path, stem: str, caption: str
) -> Picture:
    """Errors against the number of steps in two panels (label, curves); thin lines show √n and n, n and n√n."""
    with style.figure(10.0, 5.2) as figure:
        for panel, (label, curves), powers in zip(
            figure.subplots(1, 2), (left, right), ((0.5, 1.0), (1.0, 1.5)), strict=True
        ):
            _plot(panel, curves, label, "steps n")
            _guides(panel, curves, powers)
            panel.legend(loc="upper left", fontsize=9)
        return style.save(figure, folder, stem, caption)


def _guides(panel: "Axes", curves: Sequence[Curve], powers: Sequence[float]) -> None:
    """Lines n^p from where the lowest curve begins, and their names at their ends."""
    _, steps, errors = min(curves, key=lambda curve: curve[2][-1])
    first, size = steps[0], max(errors[0], 1e-16)
    last = max(curve[1][-1] for curve in curves)
    for power in powers:
        end = size * (last / first) ** power
        panel.plot((first, last), (size, end), color=style.GREY, linewidth=0.9, zorder=1)
        panel.annotate(
            _NAMES[power],
            (last, end),
            (-4, 3),
            textcoords="offset points",
            fontsize=10,
            color=style.GREY,
            ha="right",
        )
    low, high = panel.get_ylim()
    panel.set_ylim(max(low, 1e-17), 1000.0 * high)  # room for the legend


def draw_decay(measured: Mapping[str, dict[str, Any]], folder: Path, stem: str, caption: str) -> Picture:
    """Departure from a rotation, and attitude error, against the angle turned."""
    with style.figure(10.0, 5.2) as figure:
        for panel, label, field in zip(
            figure.subplots(1, 2),
            ("departure from a rotation", "attitude error [rad]"),
            ("departures", "errors"),
            strict=True,
        ):
            curves = [(kind, one["angles"], one[field]) for kind, one in measured.items()]
            _plot(panel, curves, label, "angle turned [rad]")
        handles, labels = figure.axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=2, fontsize=10)
        return style.save(figure, folder, stem, caption)


def _plot(panel: "Axes", curves: Sequence[Curve], label: str, across: str) -> None:
    for k, (name, x, y) in enumerate(curves):
        colour, line, marker = _STYLES[_STYLE_OF.get(name, k)]
        panel.loglog(
            x,
            [max(value, 1e-17) for value in y],
            color=colour,
            linestyle=line,
            marker=marker,
            markersize=4,
            linewidth=1.6,
            label=name,
        )
    panel.set_xlabel(across)
    panel.set_ylabel(label)
