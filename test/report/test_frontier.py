"""Frontier, cheapest ways and headlines, recomputed in another way from the same numbers."""

import re

import pytest

from rigid_body_sim.report import error_section, frontier
from rigid_body_sim.report.method import LIBRARY, OURS, SIMULATOR, STEP


def measured(kind, *pairs, bodies=1):
    """The result of a method with (error, cpu) at each value of its knob."""
    points = [{"value": 1.0, "error": e, "cpu": c, "compile_seconds": None} for e, c in pairs]
    return {"kind": kind, "knob": STEP, "bodies": bodies, "points": points}


def results(**problems):
    return {f"{name}/{method}": {"methods": {method: one}} for name, all_ in problems.items() for method, one in all_}


GOOD = [
    ("auto", measured(OURS, (1e-13, 1e-6))),
    ("rk4", measured(OURS, (1e-3, 5e-7), (1e-7, 5e-6), (1e-10, 5e-5))),
    ("lib", measured(LIBRARY, (1e-4, 2e-6), (5e-10, 7e-6))),
    ("sim", measured(SIMULATOR, (1e-5, 1e-5), (1e-9, 2e-4))),
]
BAD = [
    ("taylor", measured(OURS, (3e-11, 1e-5))),
    ("lib", measured(LIBRARY, (1e-11, 2e-6))),
    ("sim", measured(SIMULATOR, (1e-8, 1e-3))),
]


def test_the_frontier_is_what_nobody_undercuts():
    found = frontier.frontier(frontier.points(results(tumble=GOOD), "tumble"))
    assert [(p["method"], p["error"]) for p in found] == [("rk4", 1e-3), ("auto", 1e-13)]


def test_a_tie_in_cost_and_errors_at_round_off_leave_both_on_it():
    tie = [("auto", measured(OURS, (9e-15, 1.05e-6))), ("taylor", measured(OURS, (1e-16, 1e-6)))]
    assert len(frontier.frontier(frontier.points(results(tumble=tie), "tumble"))) == 2


def test_goals_and_their_sentences():
    goals = frontier.goals(results(tumble=GOOD, commands=BAD), ["tumble", "commands", "free_fall"])
    assert set(goals) == {"tumble", "commands"}
    assert goals["tumble"]["on_frontier"] and not goals["commands"]["on_frontier"]
    assert (goals["tumble"]["peer"], goals["tumble"]["peer_name"]) == (pytest.approx(7.0), "lib")
    assert (goals["tumble"]["simulator"], goals["tumble"]["simulator_name"]) == (pytest.approx(200.0), "sim")
    assert goals["commands"]["peer"] == pytest.approx(0.2) and goals["commands"]["simulator"] is None
    first, second, third, fourth, *_ = error_section.sentences(goals)
    assert "on the frontier below 1e-06 on 1 of 2 problems, not on commands." in first
    assert "1e-12 is reached on 1 of 2 problems, not on commands (3.0e-11)." in second
    assert re.search(r"costs 0.2 \(commands, lib\) to 7 \(tumble, lib\).*goal of 5 is met on 1 of 2 .*commands", third)
    assert re.search(
        r"costs 200 \(tumble.*goal of 100 is met on 1 of 1 problems; none that .* reaches .* on commands", fourth
    )


def test_where_another_costs_less_is_said():
    """The near error is 1e-12 for auto, 3e-10 for taylor; within a tenth of its cost is not less."""
    close = [("auto", measured(OURS, (1e-13, 1e-6))), ("lib", measured(LIBRARY, (9e-13, 0.95e-6)))]
    goals = frontier.goals(results(tumble=GOOD, commands=BAD, free_fall=close), ["tumble", "commands", "free_fall"])
    assert [goals[name]["near"] for name in goals] == [None, pytest.approx(0.2), pytest.approx(0.95)]
    *_, at, near = error_section.sentences(goals)
    assert at == (
        "Another costs less than `taylor` and `auto` at an error of 1e-09 on 1 of 3 problems: "
        "commands (0.2 of it, lib)."
    )
    assert near == (
        "Another costs less than `taylor` and `auto` near round-off (10 times their least error, 1e-13 at least) on "
        "1 of 3 problems: commands (0.2 of it, lib)."
    )
    *_, at, near = error_section.sentences(frontier.goals(results(tumble=GOOD), ["tumble"]))
    assert at.endswith("on 0 of 1 problems.") and near.endswith("on 0 of 1 problems.")


def test_one_of_a_batch_is_compared_with_nobody_and_yet_shown():
    batch = ("of 8", measured(LIBRARY, (1e-13, 1e-7), bodies=8))
    found, with_it = (frontier.points(results(tumble=all_), "tumble") for all_ in (GOOD, [*GOOD, batch]))
    assert frontier.frontier(found) == frontier.frontier(with_it)
    assert frontier.cheapest(with_it, 1e-9)["method"] == "auto"
    assert error_section.conclusion(found) == error_section.conclusion(with_it)
    assert error_section._overview(found) == error_section._overview(with_it)
    assert ("of 8", LIBRARY, pytest.approx(0.1), 1e-13, None) in error_section._methods_table(with_it, "tumble").rows


def test_the_tables_have_compiling_and_the_least_error_of_each():
    library = measured(LIBRARY, (1e-4, 2e-6), (5e-10, 7e-6), (2e-10, 9e-6))
    for point, taken in zip(library["points"], (0.5, 2.0, 1.0), strict=True):
        point["compile_seconds"] = taken
    found = frontier.points(results(tumble=[*GOOD[:2], ("lib", library), GOOD[3]]), "tumble")
    assert error_section._overview(found) == [1.0, 1e-13, "lib", 7.0, None, 2e-10, 2.0, "sim", 200.0]
    assert error_section._methods_table(found, "tumble").rows == [
        ("auto", OURS, 1.0, 1e-13, None),
        ("lib", LIBRARY, 7.0, 2e-10, 2.0),
        ("sim", SIMULATOR, 200.0, 1e-9, None),
    ]


def test_nothing_is_said_about_peers_that_were_not_measured():
    alone = results(tumble=GOOD[:2])
    assert len(error_section.sentences(frontier.goals(alone, ["tumble"]))) == 2
    assert error_section.sentences({}) == []


def test_what_cannot_be_compared_is_said_as_such():
    coarse = [GOOD[0], ("lib", measured(LIBRARY, (1e-4, 2e-6)))]
    said = error_section.sentences(frontier.goals(results(tumble=coarse), ["tumble"]))[2]
    assert said == (
        "There is no cost of the best peer to compare at an error of 1e-09; none that was measured reaches that error "
        "on tumble."
    )
    coarse.append(("sim", measured(SIMULATOR, (1e-4, 2e-6))))
    said = error_section.sentences(frontier.goals(results(tumble=coarse), ["tumble"]))[3]
    assert said.startswith("There is no cost of the best robotics simulator to compare at an error of 1e-09; none")


def test_the_sentence_under_a_picture():
    said = error_section.conclusion(frontier.points(results(tumble=GOOD), "tumble"))
    assert said == "The cheapest way to 1e-12 is `auto` with 1 µs per simulated second; no method but `taylor` and " \
        "`auto` reaches it."  # fmt: skip
    said = error_section.conclusion(frontier.points(results(tumble=BAD), "tumble"))
    assert said == "The cheapest way to 1e-09 is `lib` with 2 µs per simulated second; the next, `taylor`, costs 5 " \
        "times as much."  # fmt: skip


def test_failed_missing_and_refused_are_listed_with_the_reason():
    found = {
        "tumble/rk4": {"failed": "OSError: disk"},
        "tumble/peer/drake": {"missing": "No module named 'pydrake'; pip install drake"},
        "tumble/exact": {"methods": {"exact": {"refused": "takes no torque"}}},
        "tumble/x": {"methods": {"x": {"kind": OURS, "knob": STEP, "points": [{"value": 1.0, "error": None}]}}},
    }
    *_, table = error_section.ErrorSection().render(found, None)
    assert [row[1:] for row in table.rows] == [
        ("rk4", "OSError: disk"),
        ("drake", "No module named 'pydrake'; pip install drake"),
        ("exact", "takes no torque"),
        ("x, step 1", "the end state is not finite"),
    ]
