"""The pictures of the section ``error``: an overview of all problems, and error against time for each of them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from . import frontier, style
from .frontier import AT, BEST, Point
from .method import LIBRARY, OURS, SIMULATOR
from .problems import TITLES
from .section import Picture, Results

MICRO = 1e6
NO_LOWER = 1e-17  # where an error of zero is drawn
GROUPS = {  # of the overview: what it is called, its colour and marker, and which points belong to it
    "taylor or auto": (style.BLACK, "*", lambda p: p["method"] in BEST),
    "rk4 of this package": (style.BLUE, "s", lambda p: p["method"] == "rk4"),
    "best other library": (style.ORANGE, "o", lambda p: p["kind"] == LIBRARY),
    "best robotics simulator": (style.RED, "D", lambda p: p["kind"] == SIMULATOR),
}


def _mark(what: str) -> dict[str, Any]:
    colour, marker, _ = GROUPS[what]
    size, order = (13, 4) if marker == "*" else (8, 3)
    return {"linestyle": "", "color": colour, "marker": marker, "markersize": size, "zorder": order}


def overview(results: Results, names: Sequence[str], folder: Path) -> Picture:
    """What each group pays for an error of AT, a line for each problem."""
    with style.figure(9.0, 1.6 + 0.45 * len(names)) as figure:
        axes = figure.subplots()
        for row, name in enumerate(names):
            found = frontier.points(results, name)
            ways = {what: frontier.cheapest(filter(belongs, found), AT) for what, (*_, belongs) in GROUPS.items()}
            costs = [MICRO * way["cpu"] for way in ways.values() if way]
            if costs:
                axes.plot([min(costs), max(costs)], [row, row], color=style.LIGHT, linewidth=4, zorder=1)
            for what, way in ways.items():
                if way:
                    axes.plot(MICRO * way["cpu"], row, **_mark(what))
        for what in GROUPS:
            axes.plot([], [], label=what, **_mark(what))
        axes.set(xscale="log", yticks=range(len(names)), yticklabels=[TITLES[name] for name in names])
        axes.set_ylim(len(names) - 0.5, -0.5)
        axes.set_xlabel(f"CPU time per simulated second at an error of {AT:.0e} [µs]")
        figure.legend(loc="outside upper center", ncols=2)
        caption = f"What an error of {AT:.0e} costs: left is better; who has no mark in a line does not reach it."
        return style.save(figure, folder, "error_overview", caption)


_OWN_STYLE = {
    "auto": (style.BLACK, "*"),
    "taylor": (style.RED, "o"),
    "exact": (style.GREEN, "D"),
    "rk4": (style.BLUE, "s"),
    "rkmk4": (style.SKY, "s"),
    "splitting": (style.ORANGE, "^"),
    "splitting4": (style.ORANGE, "v"),
    "semi_implicit_euler": (style.PURPLE, "P"),
    "matrix_euler": (style.PURPLE, "X"),
    "dop853": (style.GREEN, "h"),
    "rosenbrock": (style.YELLOW, "p"),
}
_MARKERS = "ov^<>sDpPX*hd8"
_COLOURS = (style.BLUE, style.RED, style.GREEN, style.PURPLE, style.ORANGE, style.SKY, style.GREY)


def error_against_time(found: Sequence[Point], name: str, folder: Path) -> Picture:
    """All points of a problem, joined method by method, and the frontier."""
    with style.figure(10.0, 6.4) as figure:
        axes = figure.subplots()
        edge = frontier.frontier(found, tie=0.0)  # with ties it would be a band that goes up and down
        axes.plot(*_xy(edge), color="#FFE08A", linewidth=11, solid_capstyle="round", zorder=0, label="frontier")
        for index, method in enumerate(dict.fromkeys(p["method"] for p in found)):
            points = sorted((p for p in found if p["method"] == method), key=lambda p: p["cpu"])
            axes.plot(*_xy(points), label=method, **_style(method, points[0]["kind"], index))
        axes.set(xscale="log", yscale="log", title=TITLES[name], ylim=(NO_LOWER / 3, 10.0))
        axes.set_xlabel("CPU time per simulated second [µs]")
        axes.set_ylabel("error: worse of attitude [rad] and position [of the distance]")
        axes.legend(
            loc="center left",
            bbox_to_anchor=(1.0, 0.5),
            fontsize=9,
            title_fontsize=9,
            title="solid: this package\ndashed: others",
        )
        return style.save(
            figure, folder, f"error_{name}", f"{TITLES[name]}: error against CPU time; lower left is better."
        )


def _xy(points: Sequence[Point]) -> tuple[list[float], list[float]]:
    return [MICRO * p["cpu"] for p in points], [max(p["error"], NO_LOWER) for p in points]


def _style(method: str, kind: str, index: int) -> dict[str, Any]:
    if kind == OURS:
        colour, marker = _OWN_STYLE.get(method, (style.GREY, "o"))
        width, size, order = (2.0, 9, 5 + (marker == "*")) if method in BEST else (1.2, 5, 3)
        edge = {"markeredgecolor": "white", "markeredgewidth": 0.5}
        return {"color": colour, "marker": marker, "linewidth": width, "markersize": size, "zorder": order, **edge}
    colour, marker = _COLOURS[index % len(_COLOURS)], _MARKERS[index % len(_MARKERS)]
    return {"color": colour, "marker": marker, "linestyle": "--", "linewidth": 1.0, "markersize": 5, "zorder": 2,
            "markerfacecolor": "white"}  # fmt: skip
