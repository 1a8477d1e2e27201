"""What follows from the measured points of a problem: the frontier, the cheapest way to an error, what others cost."""

from collections.abc import Iterable, Sequence
from typing import Any

from .method import OURS, SIMULATOR
from .section import FAILED, Results

BEST = ("taylor", "auto")  # what the headlines are about
LEVELS = (1e-3, 1e-6, 1e-9, 1e-12)
ROUND_OFF = 1e-14  # errors below it count as equal
TIE = 0.1  # share by which a cost must be lower to count as lower: timings are not better than that
BELOW, AT = 1e-6, 1e-9  # the errors that the headlines speak of
NEAR, NEAR_AT_BEST = 10.0, 1e-13  # near round-off: times the least error of BEST, but never below
PEER_GOAL, SIMULATOR_GOAL = 5.0, 100.0

Point = dict[str, Any]


def points(results: Results, problem: str) -> list[Point]:
    """All points of a problem that have an error, each with ``method``, ``kind``, ``knob`` and ``bodies``."""
    found = []
    for result in of_problem(results, problem):
        for method, measured in result.get("methods", {}).items():
            about = {"method": method, "kind": measured.get("kind"), "knob": measured.get("knob")}
            about["bodies"] = measured.get("bodies", 1)
            found += [{**about, **p} for p in measured.get("points", []) if p.get("error") is not None]
    return found


def of_problem(results: Results, problem: str) -> Iterable[dict[str, Any]]:
    """The results of a problem that did not fail."""
    return [r for key, r in results.items() if key.split("/")[0] == problem and FAILED not in r]


def alone(found: Iterable[Point]) -> list[Point]:
    """Points of methods that solve for one body: what one of a batch costs is not to be had for less than the batch."""
    return [p for p in found if p["bodies"] == 1]


def frontier(found: Iterable[Point], tie: float = TIE) -> list[Point]:
    """Points alone that no other undercuts in cost, by more than ``tie``, with an error not larger; cheapest first."""
    found = alone(found)
    kept = [p for p in found if not any(_undercuts(q, p, tie) for q in found)]
    return sorted(kept, key=lambda p: p["cpu"])


def _undercuts(q: Point, p: Point, tie: float) -> bool:
    return q["error"] <= max(p["error"], ROUND_OFF) and q["cpu"] < (1.0 - tie) * p["cpu"]


def cheapest(found: Iterable[Point], level: float) -> Point | None:
    """The cheapest point alone with an error of ``level`` at most, one of BEST where costs tie; None without any."""
    able = sorted((p for p in alone(found) if p["error"] <= level), key=lambda p: p["cpu"])
    tied = (p for p in able if p["method"] in BEST and (1.0 - TIE) * p["cpu"] <= able[0]["cpu"])
    return next(tied, able[0] if able else None)


def near_round_off(best: float) -> float:
    """The error that counts as near round-off on a problem where that is the least error of BEST."""
    return max(NEAR * best, NEAR_AT_BEST)


def goals(results: Results, problems: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Of each problem that was measured: whether BEST is on the frontier, and how it compares with the others.

    ``on_frontier``: below BELOW. ``peer``, ``simulator``: how many times more the best of them costs than BEST at an
    error of AT, None when none reaches it, ``peer_name`` and ``simulator_name``, and whether any was measured,
    ``peer_measured`` and ``simulator_measured``. ``near``, ``near_name`` and ``near_measured``: the same of the best
    peer at near_round_off. ``best``: the least error of BEST.
    """
    found = {}
    for problem in problems:
        all_points = points(results, problem)
        ours = [p for p in all_points if p["method"] in BEST]
        if not ours:
            continue
        peers = [p for p in all_points if p["kind"] != OURS]
        edge = frontier(all_points)
        best = min(p["error"] for p in ours)
        found[problem] = {
            "on_frontier": any(p["method"] in BEST and p["error"] < BELOW for p in edge),
            **_compared("peer", ours, peers, AT),
            **_compared("simulator", ours, [p for p in peers if p["kind"] == SIMULATOR], AT),
            **_compared("near", ours, peers, near_round_off(best)),
            "best": best,
        }
    return found


def _compared(what: str, ours: Sequence[Point], others: Sequence[Point], level: float) -> dict[str, Any]:
    mine, other = cheapest(ours, level), cheapest(others, level)
    ratio, name = (other["cpu"] / mine["cpu"], other["method"]) if mine and other else (None, None)
    return {what: ratio, f"{what}_name": name, f"{what}_measured": bool(others)}
