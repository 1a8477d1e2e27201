"""The section "many bodies": body-steps a second over the number of bodies, of this package and of its peers."""

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from . import batch, ours, peers, style
from .batch import BatchMethod
from .ours import ALONE, ENSEMBLE, LOOP
from .section import Block, Heading, Measurement, Paragraph, Picture, Result, Results, Settings, Table, finished

NUMBERS, QUICK_NUMBERS = (1, 10, 100, 1000, 10_000, 100_000), (1, 10, 100, 1000, 10_000)  # of bodies
SPINS = (0.1, 1.0, 10.0)  # rad/s; the first with every number of bodies
AT = 1000  # bodies, of which the sentences tell; a quick report has peers here alone
FEW, LONG = 10, 10_000  # bodies whose error is measured, and steps after which it is
GOAL = 5e7  # body-steps/s
GOALS = {"jax": 6.0, "heyoka": 10.0}  # times the fastest method of a peer
EXACT = 1e-12  # an error below it is next to round-off

_HOW = (
    "Equal bodies, each with a spin of its own about every axis (normal, with a deviation of "
    f"{SPINS[0]:g} rad/s in the picture), hold a constant force and torque in body axes and advance by steps of 1 ms: "
    f"as often as a command may come. A call does {batch.STEPS} steps of each, fewer where it would take seconds. "
    "Counted are steps of bodies in a second of wall-clock time, since threads share the work: the median of rounds in "
    "which all methods take turns. The processor time of a step, that of all threads together, is less moved by other "
    "programs. The `Ensemble` has mass, inertia and wrench of each body as data; peers have mass and inertia, the same "
    "for all, compiled as constants, and one wrench. heyoka is held to steps of 1 ms: in longer ones it and this "
    "package cover the same time for a fraction of this, as long as no command comes. The error is the worse of "
    f"attitude [rad] and position (relative to the distance from start to end) of {batch.COMPARED} bodies after 10 s, "
    "against the series of this package in steps of 0.1 s, which is next to round-off from true."
)


class ManyBodies:
    """Section 4 of the report."""

    name = "many_bodies"
    title = "Many bodies at once"

    def measurements(self, settings: Settings) -> list[Measurement]:
        """One a number of bodies and spin, in which all methods take turns, and one of the errors at each spin."""
        quick, chosen = settings.quick, settings.peers
        spins = SPINS[:1] if quick else SPINS
        made = []
        for spin in spins:
            for n in _numbers(spin, quick):
                these = () if quick and n != AT else chosen
                run = partial(_speeds, n, spin, settings.seed, these, quick)
                made.append(Measurement(f"speed/{spin:g}/{n}", run, _weight(n, quick)))
        these = () if quick else chosen
        return made + [
            Measurement(f"error/{spin:g}", partial(_errors, spin, settings.seed, these), 0.5 if quick else 4.0)
            for spin in spins
        ]

    def headlines(self, results: Results) -> list[str]:
        """How many steps of bodies are done in a second, and how many times those of each peer."""
        at = _speeds_of(results).get((SPINS[0], AT))
        return [headline(at)] if at and ENSEMBLE in at["methods"] else []

    def render(self, results: Results, folder: Path) -> list[Block]:
        """A picture and a table over the number of bodies, a table over spins, all points, and what is missing."""
        speeds, errors = _speeds_of(results), _errors_of(results)
        over_n = {n: one for (spin, n), one in speeds.items() if spin == SPINS[0]}
        if not over_n:
            return []
        return [
            Paragraph(_HOW),
            _picture(over_n, folder),
            Paragraph(" ".join([*self.headlines(results), checked(over_n.values())])),
            _table(over_n, errors),
            *_spin_blocks(speeds, errors),
            _points(speeds),
            *_missing(results),
        ]


def _numbers(spin: float, quick: bool) -> tuple[int, ...]:
    return (AT,) if spin != SPINS[0] else QUICK_NUMBERS if quick else NUMBERS


def _weight(n: int, quick: bool) -> float:
    if quick:
        return 8.0 if n == AT else 0.5
    return 10.0 + n / 1000.0


def _speeds(n: int, spin: float, seed: int, chosen: Sequence[str] | None, quick: bool) -> Result:
    methods, found = _methods(chosen)
    return {**batch.measure(methods, batch.batch(n, spin, seed), quick), **found}


def _errors(spin: float, seed: int, chosen: Sequence[str] | None) -> Result:
    methods, found = _methods(chosen)
    return {**batch.errors_after(methods, batch.batch(FEW, spin, seed), LONG), **found}


def _methods(chosen: Sequence[str] | None) -> tuple[list[BatchMethod], dict[str, Any]]:
    """What is compared; ``peers``: the names of each one's methods, ``missing``: the others, with the reason."""
    methods = ours.batch_methods()
    found: dict[str, list[str]] = {}
    missing: dict[str, str] = {}
    for peer in peers.names() if chosen is None else chosen:
        try:
            theirs = peers.batch_methods(peer)
        except Exception as reason:  # whatever the import of a peer raises
            missing[peer] = str(reason) or type(reason).__name__
            continue
        found |= {peer: [method.name for method in theirs]} if theirs else {}
        methods += theirs
    return methods, {"peers": found, "missing": missing}


# What is said of the numbers -----------------------------------------------------------------------------------------

Speeds = Mapping[tuple[float, int], Result]  # by spin and number of bodies
Errors = Mapping[float, Mapping[str, float | None]]  # by spin and method


def _speeds_of(results: Results) -> dict[tuple[float, int], Result]:
    found = {}
    for key, one in finished(results, "speed/").items():
        _, spin, n = key.split("/")
        if one["methods"]:
            found[float(spin), int(n)] = one
    return found


def _errors_of(results: Results) -> dict[float, dict[str, float | None]]:
    return {float(key.split("/")[1]): one["errors"] for key, one in finished(results, "error/").items()}


def headline(at: Result) -> str:
    """How fast AT bodies are advanced, beside the goals and the fastest method of each peer."""
    mine = at["methods"][ENSEMBLE]
    speed = batch.speed(mine, AT)
    said = f"{AT} bodies of about {SPINS[0]:g} rad/s in steps of 1 ms: `{ENSEMBLE}` does {speed:.2g} body-steps/s with "
    said += f"{mine['threads']} threads ({_goal(speed, GOAL)})"
    compared = []
    for peer, names in at["peers"].items():
        if there := {name: batch.times(mine, at["methods"][name]) for name in names if name in at["methods"]}:
            name = min(there, key=there.__getitem__)
            goal = f" ({_goal(there[name], GOALS[peer])})" if peer in GOALS else ""
            compared.append(f"{_short(there[name])} times `{name}`{goal}")
    said += f", {', '.join(compared)}" if compared else "; no peer was measured"
    return said + ("." if at["others"] is None else f". Other programs kept {at['others']:.1f} cores busy meanwhile.")


def _goal(value: float, goal: float) -> str:
    return f"goal {goal:g} {'met' if value >= goal else 'not met'}"


def _short(value: float) -> str:
    return f"{float(f'{value:.2g}'):g}"


def checked(results: Iterable[Result]) -> str:
    """That what was timed did what it should."""
    worst = max(one["error"] for result in results for one in result["methods"].values())
    return f"The ends of all these calls were compared with the series, too: no error is above {worst:.0e}."


def at_spin(spin: float, result: Result, errors: Mapping[str, float | None]) -> str:
    """How fast AT bodies of a spin are advanced, beside the fastest peer, and the fastest that is as exact."""
    mine = result["methods"][ENSEMBLE]
    said = (
        f"At {spin:g} rad/s `{ENSEMBLE}` does {batch.speed(mine, AT):.2g} body-steps/s{_with_error(errors, ENSEMBLE)}"
    )
    theirs = [name for names in result["peers"].values() for name in names if name in result["methods"]]
    exact = [name for name in theirs if (error := errors.get(name)) is not None and error < EXACT]
    for names, what in ((theirs, "the fastest peer"), (exact, f"the fastest with an error below {EXACT:.0e}")):
        if names:
            times, name = min((batch.times(mine, result["methods"][name]), name) for name in names)
            said += f", {_short(times)} times {what}, `{name}`{_with_error(errors, name)}"
    return f"{said}."


def _with_error(errors: Mapping[str, float | None], name: str) -> str:
    return "" if (error := errors.get(name)) is None else f" (error {error:.0e})"


# Tables and the picture ----------------------------------------------------------------------------------------------


def _table(over_n: Mapping[int, Result], errors: Errors) -> Table:
    """A line for each method: body-steps/s over the number of bodies."""
    rows = []
    for name in _names(over_n.values()):
        its = {n: one["methods"].get(name) for n, one in over_n.items()}
        speeds = [_round(batch.speed(one, n)) if one else None for n, one in its.items()]
        threads = next(one["threads"] for one in its.values() if one)
        rows.append((name, threads, *speeds, *_beside(over_n.get(AT), name), errors.get(SPINS[0], {}).get(name)))
    columns = ("method", "threads", *map(str, over_n), f"CPU ns at {AT}", f"Ensemble, times it at {AT}", _ERROR)
    return Table("many_bodies", columns, rows, "Body-steps/s by the number of bodies.")


_ERROR = "error after 10 s"


def _beside(at: Result | None, name: str) -> tuple[float | None, float | None]:
    """Processor time [ns] of a step of one of AT bodies, and how many times as many steps the Ensemble does."""
    if at is None or name not in at["methods"]:
        return None, None
    one, mine = at["methods"][name], at["methods"].get(ENSEMBLE)
    return _round(_cpu(one, AT)), _round(batch.times(mine, one)) if mine else None


def _cpu(result: Result, n: int) -> float:
    return float(1e9 * np.median(result["cpu"]) / (n * result["steps"]))


def _names(results: Iterable[Result]) -> list[str]:
    return list(dict.fromkeys(name for result in results for name in result["methods"]))


def _round(value: float) -> float:
    return float(f"{value:.3g}")


def _spin_blocks(speeds: Speeds, errors: Errors) -> list[Block]:
    """What becomes of speed and error when the bodies spin faster."""
    at = {spin: one for (spin, n), one in speeds.items() if n == AT}
    if len(at) < 2:
        return []
    rows = [
        (spin, name, _round(batch.speed(one["methods"][name], AT)), *_beside(one, name), errors.get(spin, {}).get(name))
        for spin, one in at.items()
        for name in one["methods"]
    ]
    columns = ("rad/s", "method", "body-steps/s", "CPU ns", "Ensemble, times it", _ERROR)
    said = [at_spin(spin, one, errors.get(spin, {})) for spin, one in at.items() if ENSEMBLE in one["methods"]]
    table = Table("many_bodies_spins", columns, rows, f"{AT} bodies, by the deviation of their spins.")
    return [Heading("How fast they spin"), Paragraph(" ".join(said)), table]


def _points(speeds: Speeds) -> Table:
    rows = []
    for (spin, n), result in speeds.items():
        for name, one in result["methods"].items():
            slow, fast = (n * one["steps"] / pick(one["seconds"]) for pick in (max, min))
            figures = map(_round, (batch.speed(one, n), slow, fast, _cpu(one, n)))
            rows.append((spin, n, name, one["threads"], one["steps"], *figures, one["error"], result["others"]))
    columns = ("rad/s", "bodies", "method", "threads", "steps in a call", "body-steps/s", "slowest round")
    last = ("fastest round", "CPU ns", "error after the call", "cores others kept busy")
    return Table("many_bodies_points", (*columns, *last), rows, "All measurements.", folded=True)


def _missing(results: Results) -> list[Block]:
    """Peers that are not there, and methods that failed, with the reasons."""
    why: dict[str, None] = {}
    for result in finished(results).values():
        why |= dict.fromkeys(f"{name} ({said})" for name, said in (result["missing"] | result["refused"]).items())
    return [Paragraph(f"Not measured: {'; '.join(why)}.")] if why else []


_OWN = {ENSEMBLE: (style.BLACK, "*"), ALONE: (style.BLUE, "o"), LOOP: (style.SKY, "s")}
_COLOURS = (style.GREEN, style.RED, style.PURPLE, style.ORANGE, style.GREY)  # of peers, in turn
_MARKERS = "os^Dv"  # of a peer's methods


def _picture(over_n: Mapping[int, Result], folder: Path) -> Picture:
    """Body-steps/s over the number of bodies, a line for each method."""
    curves = {
        name: {n: batch.speed(one["methods"][name], n) for n, one in over_n.items() if name in one["methods"]}
        for name in _names(over_n.values())
    }
    looks = _looks(over_n.values())
    with style.figure(10.0, 6.0) as figure:
        axes = figure.subplots()
        axes.axhline(GOAL, color=style.GREY, linewidth=1.2, linestyle=":", label=f"goal, {GOAL:.0e}")
        for name, curve in sorted(curves.items(), key=lambda item: -max(item[1].values())):
            axes.plot(list(curve), list(curve.values()), label=name, **looks[name])
        axes.set(xscale="log", yscale="log", xlabel="bodies", ylabel="steps of bodies in a second of wall-clock time")
        axes.legend(
            loc="center left",
            bbox_to_anchor=(1.0, 0.5),
            fontsize=9,
            title_fontsize=9,
            title="solid: this package\ndashed: others",
        )
        caption = f"Steps of 1 ms of bodies that turn at about {SPINS[0]:g} rad/s; higher is better."
        return style.save(figure, folder, "many_bodies", caption)


def _looks(results: Iterable[Result]) -> dict[str, dict[str, Any]]:
    """How the line of each method is drawn: a colour for each peer, a marker for each of its methods."""
    found: dict[str, dict[str, Any]] = {}
    for name, (colour, marker) in _OWN.items():
        found[name] = {"color": colour, "marker": marker, "linewidth": 2.0, "zorder": 4, "markeredgecolor": "white"}
        found[name] |= {"markersize": 13 if marker == "*" else 7, "markeredgewidth": 0.5}
    every = {peer: names for result in results for peer, names in result["peers"].items()}
    for k, names in enumerate(every.values()):
        for name, marker in zip(names, _MARKERS * len(names), strict=False):
            colour = _COLOURS[k % len(_COLOURS)]
            found[name] = {"color": colour, "marker": marker, "linewidth": 1.2, "linestyle": "--", "markersize": 6}
            found[name] |= {"markerfacecolor": "white", "zorder": 3}
    return found
