"""Error against run time: every integrator and every peer on every problem."""

from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from . import frontier, ours, peers
from .error_plots import MICRO, error_against_time, overview
from .frontier import AT, BELOW, BEST, LEVELS, PEER_GOAL, SIMULATOR_GOAL, Point
from .method import LIBRARY, OURS, SIMULATOR, measure
from .problems import TITLES, problem
from .section import FAILED, Block, Heading, Measurement, Paragraph, Result, Results, Settings, Table

BEST_LIBRARY, TIMES, TIMES_NEAR = "best other library", "times the cost", "times near round-off"  # of the overview
QUICK_PEER_PROBLEMS = ("body_wrench",)  # with all of them a quick report would take minutes

_INTRO = (
    "Every method solves every problem with several steps or tolerances. The error is the worse of attitude [rad] and "
    "position (relative to the distance from start to end) at the end, against a reference of 35 digits. The cost is "
    "CPU time of the process per simulated second: warm, the median of repeats, with the quartiles beside it in the "
    "tables. What is timed goes from the start to the end, with every command in between, and reads the end state; "
    "nothing else. Compiling is apart, in a column of its own; where that is empty, nothing is compiled for a problem:"
    " the kernels of this package are compiled once on a machine, for all problems, and kept. A method that solves for"
    " several equal bodies at once is shown with the cost of one of them, and is not compared with the others. On the "
    f"frontier is what no other undercuts by more than {frontier.TIE:.0%} in cost with an error not larger; errors "
    f"below {frontier.ROUND_OFF:.0e} count as equal."
)


class ErrorSection:
    """The section ``error``; see section.Section."""

    name = "error"
    title = "Error against run time"

    def measurements(self, settings: Settings) -> list[Measurement]:
        """One for each problem and integrator, and one for each problem and peer, with all methods of the peer."""
        known = peers.names()
        others = known if settings.peers is None else settings.peers
        unknown = [peer for peer in others if peer not in known]
        if unknown:
            raise ValueError(f"peer {unknown[0]!r} is not known; choose one of {', '.join(known)}")
        found = []
        for name in TITLES if settings.problems is None else settings.problems:
            problem(name)
            weight = 0.2 if settings.quick else 2.0
            for integrator in settings.integrators:
                run = partial(_measure_ours, integrator, name, settings.quick)
                found.append(Measurement(f"{name}/{integrator}", run, weight))
            if not settings.quick or name in QUICK_PEER_PROBLEMS:
                for peer in others:
                    run = partial(_measure_peer, peer, name, settings.quick)
                    found.append(Measurement(f"{name}/peer/{peer}", run, 10.0 * weight))
        return found

    def headlines(self, results: Results) -> list[str]:
        """The goals, and where they are missed."""
        return sentences(frontier.goals(results, list(TITLES)))

    def render(self, results: Results, folder: Path) -> list[Block]:
        """The table of cheapest ways, then each problem with its picture and all of its points, then the peers."""
        measured = [name for name in TITLES if frontier.points(results, name)]
        blocks: list[Block] = [Paragraph(_INTRO)]
        if measured:
            blocks += [overview(results, measured, folder), _overview_table(results, measured)]
        blocks.append(_cheapest_table(results, measured))
        for name in measured:
            found = frontier.points(results, name)
            blocks += [
                Heading(TITLES[name]),
                Paragraph(problem(name).about),
                error_against_time(found, name, folder),
                Paragraph(conclusion(found)),
                _methods_table(found, name),
                _points_table(found, name),
            ]
        return [*blocks, Heading("Not measured, and why"), *_left_aside(results)]


def _measure_ours(integrator: str, name: str, quick: bool) -> Result:
    return {"methods": {integrator: measure(ours.method(integrator), problem(name), quick)}}


def _measure_peer(peer: str, name: str, quick: bool) -> Result:
    try:
        found = peers.methods(peer)
    except ImportError as reason:
        return {"missing": str(reason)}
    return {"methods": {method.name: measure(method, problem(name), quick) for method in found}}


def sentences(goals: dict[str, dict[str, Any]]) -> list[str]:
    """The headline sentences of frontier.goals."""
    if not goals:
        return []
    count = len(goals)
    off = [name for name, goal in goals.items() if not goal["on_frontier"]]
    short = {name: goal["best"] for name, goal in goals.items() if goal["best"] > LEVELS[-1]}
    found = [
        f"`taylor` or `auto` is on the frontier below {BELOW:.0e} on {count - len(off)} of {count} problems"
        f"{_except(off)}.",
        f"An error of {LEVELS[-1]:.0e} is reached on {count - len(short)} of {count} problems"
        f"{_except([f'{name} ({best:.1e})' for name, best in short.items()])}.",
    ]
    for what, words, goal in (
        ("peer", "best peer", PEER_GOAL),
        ("simulator", "best robotics simulator", SIMULATOR_GOAL),
    ):
        if compared := {name: one for name, one in goals.items() if one[f"{what}_measured"]}:
            found.append(_comparison(compared, what, words, goal))
    near = f"near round-off ({frontier.NEAR:g} times their least error, {frontier.NEAR_AT_BEST:.0e} at least)"
    for what, where in (("peer", f"at an error of {AT:.0e}"), ("near", near)):
        if compared := {name: one for name, one in goals.items() if one[f"{what}_measured"]}:
            found.append(_cheaper(compared, what, where))
    return found


def _cheaper(goals: dict[str, dict[str, Any]], what: str, where: str) -> str:
    """On which problems another costs less than `taylor` and `auto`, and what share of it."""
    ratios = {name: goal[what] for name, goal in goals.items() if goal[what] is not None}
    less = [
        f"{name} ({ratio:.2g} of it, {goals[name][what + '_name']})"
        for name, ratio in ratios.items()
        if ratio < 1.0 - frontier.TIE
    ]
    said = f"Another costs less than `taylor` and `auto` {where} on {len(less)} of {len(goals)} problems"
    return f"{said}: {', '.join(less)}." if less else f"{said}."


def _except(names: Sequence[str]) -> str:
    return f", not on {', '.join(names)}" if names else ""


def _comparison(goals: dict[str, dict[str, Any]], what: str, words: str, wanted: float) -> str:
    ratios = {name: goal[what] for name, goal in goals.items() if goal[what] is not None}
    out_of_reach = [name for name, goal in goals.items() if goal["best"] > AT]
    alone = [name for name, goal in goals.items() if goal[what] is None and name not in out_of_reach]
    if ratios:
        ends = (f"{ratios[name]:.3g} ({name}, {goals[name][what + '_name']})" for name in _ends(ratios))
        said = f"At an error of {AT:.0e} the {words} costs {' to '.join(ends)}"
        missed = [f"{name} ({ratio:.3g})" for name, ratio in ratios.items() if ratio < wanted]
        said += (
            f" times as much; the goal of {wanted:g} is met on {len(ratios) - len(missed)} of {len(ratios)} problems"
        )
        said += _except(missed)
    else:
        said = f"There is no cost of the {words} to compare at an error of {AT:.0e}"
    said += f"; none that was measured reaches that error on {', '.join(alone)}" if alone else ""
    return said + (f"; `taylor` and `auto` do not reach it on {', '.join(out_of_reach)}." if out_of_reach else ".")


def _ends(ratios: dict[str, float]) -> list[str]:
    """The names of the least and the greatest ratio, one when they are the same."""
    return list(dict.fromkeys((min(ratios, key=ratios.__getitem__), max(ratios, key=ratios.__getitem__))))


def conclusion(found: Sequence[Point]) -> str:
    """What a reader should take from a problem's picture, from its points."""
    reached = ((level, frontier.cheapest(found, level)) for level in reversed(LEVELS))
    level, best = next((one for one in reached if one[1]), (0.0, None))
    if best is None:
        return f"No method reaches an error of {LEVELS[0]:.0e}."
    said = (
        f"The cheapest way to {level:.0e} is `{best['method']}` with {MICRO * best['cpu']:.3g} µs per simulated second"
    )
    others = [p for p in found if p["kind"] != best["kind"] or (best["kind"] == OURS and p["method"] not in BEST)]
    next_best = frontier.cheapest([p for p in others if p["method"] != best["method"]], level)
    if next_best is None:
        return f"{said}; no method but `taylor` and `auto` reaches it." if best["method"] in BEST else f"{said}."
    return f"{said}; the next, `{next_best['method']}`, costs {next_best['cpu'] / best['cpu']:.3g} times as much."


def _overview_table(results: Results, names: Iterable[str]) -> Table:
    rows = [(TITLES[name], *_overview(frontier.points(results, name))) for name in names]
    columns = (
        "problem",
        "taylor or auto, µs/s",
        "least error",
        BEST_LIBRARY,
        TIMES,
        TIMES_NEAR,
        "its least error",
        "compile s",
        "best simulator",
        "times that cost",
    )
    return Table(
        "error_overview", columns, rows,
        f"CPU time per simulated second at an error of {AT:.0e}; near round-off, beside the best library there.",
    )  # fmt: skip


def _overview(found: Sequence[Point]) -> list[str | float | None]:
    """What the overview says of a problem."""
    ours = [p for p in found if p["method"] in BEST]
    libraries, simulators = ([p for p in found if p["kind"] == kind] for kind in (LIBRARY, SIMULATOR))
    mine = frontier.cheapest(ours, AT)
    library, times = _other(libraries, AT, mine)
    its = [p for p in libraries if p["method"] == library]
    row = _round(MICRO * mine["cpu"]) if mine else None, _least(ours), library, times
    return [*row, _times_near(ours, libraries), _least(its), _compiling(its), *_other(simulators, AT, mine)]


def _times_near(ours: Sequence[Point], others: Sequence[Point]) -> float | None:
    """What the best of others costs near round-off, as a multiple of what BEST does."""
    if not ours:
        return None
    level = frontier.near_round_off(min(p["error"] for p in ours))
    return _other(others, level, frontier.cheapest(ours, level))[1]


def _least(found: Iterable[Point]) -> float | None:
    return min((p["error"] for p in found), default=None)


def _compiling(found: Iterable[Point]) -> float | None:
    """The longest time [s] that compiling for one of the points took."""
    return max((p["compile_seconds"] for p in found if p["compile_seconds"] is not None), default=None)


def _methods_table(found: Sequence[Point], name: str) -> Table:
    """`taylor`, `auto` and each method of a peer, those that come to AT first, the cheapest of them first."""
    rows = []
    for method in dict.fromkeys(p["method"] for p in found if p["method"] in BEST or p["kind"] != OURS):
        its = [p for p in found if p["method"] == method]
        cost = min((MICRO * p["cpu"] for p in its if p["error"] <= AT), default=None)
        rows.append((method, its[0]["kind"], cost and _round(cost), _least(its), _compiling(its)))
    rows.sort(key=lambda row: (row[2] is None, row[2] or row[3]))
    columns = ("method", "kind", f"µs/s at {AT:.0e}", "least error", "compile s")
    return Table(f"error_{name}_methods", columns, rows, "What each costs, and how far it comes.")


def _cheapest_table(results: Results, names: Iterable[str]) -> Table:
    rows = []
    for name in names:
        found = frontier.points(results, name)
        for level in LEVELS:
            best = frontier.cheapest(found, level)
            mine = frontier.cheapest([p for p in found if p["method"] in BEST], level)
            others = [p for p in found if p["kind"] != OURS]
            simulators = [p for p in others if p["kind"] == SIMULATOR]
            compared = (*_other(others, level, mine), *_other(simulators, level, mine))
            rows.append((name, level, *_way(best), *_way(mine), *compared))
    columns: tuple[str, ...] = ("problem", "error", "cheapest", "µs/s", "taylor or auto", "µs/s of it", "best peer")
    columns = (*columns, "times its cost", "best simulator", "times the cost")
    return Table("error_cheapest", columns, rows, "The cheapest way to an error, and what others pay for the same.")


def _way(point: Point | None) -> tuple[str, float | None]:
    if point is None:
        return "none", None
    return f"{point['method']}, {point['knob'].split()[0]} {point['value']:.3g}", _round(MICRO * point["cpu"])


def _other(others: Sequence[Point], level: float, mine: Point | None) -> tuple[str | None, float | None]:
    """The cheapest of others for an error, "none" when none reaches it, and its cost as a multiple of mine."""
    point = frontier.cheapest(others, level)
    name = point["method"] if point else "none" if others else None
    return name, (_round(point["cpu"] / mine["cpu"]) if point and mine else None)


def _round(value: float) -> float:
    return float(f"{value:.3g}")


_COLUMNS = ("value", "error", "attitude", "position", "momentum", "energy", "cpu", "cpu_low", "cpu_high", "repeats")


def _points_table(found: Sequence[Point], name: str) -> Table:
    edge = frontier.frontier(found)
    rows = [
        (p["method"], p["kind"], p["knob"], *(p[c] for c in _COLUMNS), p["steps"], p["rhs"], p["compile_seconds"],
         "yes" if p in edge else "")
        for p in found
    ]  # fmt: skip
    columns = ("method", "kind", "setting", *_COLUMNS[:6], "CPU s/s", "quartile 1", "quartile 3", "repeats", "steps")
    return Table(
        f"error_{name}", (*columns, "right-hand sides", "compile s", "frontier"), rows,
        "All measurements of this problem.", folded=True,
    )  # fmt: skip


def _left_aside(results: Results) -> list[Block]:
    rows = []
    for key, result in results.items():
        name, *rest = key.split("/")
        if reason := result.get(FAILED) or result.get("missing"):
            rows.append((name, rest[-1], reason))
        for method, measured in result.get("methods", {}).items():
            if "refused" in measured:
                rows.append((name, method, measured["refused"]))
            for point in measured.get("points", []):
                if point.get("error") is None:
                    why = point.get("refused", "the end state is not finite")
                    rows.append((name, f"{method}, {measured['knob'].split()[0]} {point['value']:.3g}", why))
    table = Table(
        "error_not_measured", ("problem", "method", "reason"), rows, "Refused, failed or not installed.", True
    )
    return [Paragraph(f"{len(rows)} entries."), table]
