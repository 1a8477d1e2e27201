"""The section "stability": `auto` is never in the red, results repeat, and every sentence follows from the numbers."""

import csv
import itertools
import json

import pytest

from rigid_body_sim.report.section import FAILED, Paragraph, Picture, Settings, Table
from rigid_body_sim.report.stability import long_run, maps, matrix, plots
from rigid_body_sim.report.stability.outcome import Outcome
from rigid_body_sim.report.stability_section import MAPS, Stability, growth_sentence

pytest.importorskip("matplotlib")

SECTION = Stability()
QUICK = Settings(quick=True, integrators=("auto", "rk4", "semi_implicit_euler", "taylor"))


def results(*prefixes, settings=QUICK):
    """Results, as JSON keeps them, of the measurements whose keys begin like that."""
    made = {one.key: one for one in SECTION.measurements(settings)}
    return {
        key: json.loads(json.dumps(one.run(), allow_nan=False)) for key, one in made.items() if key.startswith(prefixes)
    }


@pytest.mark.parametrize("name", MAPS)
def test_auto_is_never_in_the_red(name):
    measured = maps.measure(MAPS[name](True), "auto")
    assert maps.takes_part(measured)
    assert maps.bad_cells(measured) == []
    assert maps.worst_error(measured) < 1e-6  # of the accurate 1e-3; measured 3.6e-7, on the undamped tether


@pytest.mark.parametrize("name", MAPS)
def test_map_shows_a_bad_method_to_be_bad(name):
    assert maps.bad_cells(maps.measure(MAPS[name](True), "semi_implicit_euler"))


def test_full_maps_contain_the_hard_cells_and_more():
    for build in MAPS.values():
        quick, full = build(True), build(False)
        assert len(full.rows) * len(full.columns) > len(quick.rows) * len(quick.columns)
        hardest = max(full.hardness(row, column) for row in full.rows for column in full.columns)
        assert hardest >= max(quick.hardness(row, column) for row in quick.rows for column in quick.columns)


def test_results_are_the_same_from_run_to_run():
    prefixes = ("map/damping", "map/controller", "long_run/attitude/rk4", "long_run/energy/rk4", "matrix/quaternion")
    found = results(*prefixes)
    assert len(found) > 10
    assert found == results(*prefixes)


def test_seed_decides_the_long_runs():
    one, same, other = (results("long_run/energy/rk4", settings=Settings(quick=True, seed=seed)) for seed in (1, 1, 2))
    assert one == same != other


@pytest.fixture(scope="module")
def rendered(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    found = results("map/damping", "map/step_size", "long_run", "matrix")
    return folder, found, SECTION.render(found, folder)


def test_pictures_are_drawn(rendered):
    folder, _, blocks = rendered
    stems = [block.stem for block in blocks if isinstance(block, Picture)]
    assert stems == ["stability_damping", "stability_step_size", "stability_long_run", "stability_matrix"]
    for stem in stems:
        assert (folder / f"{stem}.png").stat().st_size > 10_000  # bytes; measured 24 000 at least
        assert (folder / f"{stem}.svg").read_text(encoding="utf-8").count("<path") > 20


def test_a_sentence_stands_under_each_picture(rendered):
    _, found, blocks = rendered
    under = {a.stem: b.text for a, b in itertools.pairwise(blocks) if isinstance(a, Picture)}
    of_damping = {key.split("/")[2]: one for key, one in found.items() if key.startswith("map/damping")}
    assert under["stability_damping"] == maps.conclusion(MAPS["damping"](False), of_damping)
    last = found["long_run/energy/rk4/0"]["errors"][-1]
    assert f"`rk4` {last:.1e} after 1e+05 steps" in under["stability_long_run"]
    off = found["matrix/quaternion"]["departures"][-1]
    assert f"squared length by {off:.2g}" in under["stability_matrix"]


def test_table_counts_and_file_lists_every_cell(rendered):
    folder, found, blocks = rendered
    (table,) = (block for block in blocks if isinstance(block, Table))
    with (folder / "stability_cells.csv").open(encoding="utf-8", newline="") as file:
        cells = list(csv.DictReader(file))
    assert sum(sum(row[2:6]) for row in table.rows) == len(cells) == 4 * (12 + 27)
    wrong = [c for c in cells if c["map"] == "damping" and c["integrator"] == "rk4" and c["outcome"] == "diverged"]
    measured = found["map/damping/rk4"]
    assert len(wrong) == maps.outcomes(measured).count(Outcome.DIVERGED) > 0


def test_page_without_results_and_with_failed_ones(tmp_path):
    assert [type(block) for block in SECTION.render({}, tmp_path)] == [Paragraph]
    assert SECTION.headlines({}) == []
    failed = {one.key: {FAILED: "ValueError: no"} for one in SECTION.measurements(QUICK)}
    assert [type(block) for block in SECTION.render(failed, tmp_path)] == [Paragraph]


def hand_made(*outcomes):
    """A map of one row, with hardness 1, 2, ...; errors of 1e-9 where accurate and 0.5 where wrong."""
    error = {Outcome.ACCURATE: 1e-9, Outcome.WRONG: 0.5}
    cells = [{"outcome": o.value, "error": error.get(o), "said": "too small; why"} for o in outcomes]
    return {"rows": [1.0], "columns": [float(k + 1) for k in range(len(cells))], "cells": [cells]}


A, W, D, R = Outcome


@pytest.mark.parametrize(
    ("outcomes", "expected"),
    [((A, A, A), float("inf")), ((A, A, W), 2.0), ((A, D, A), 1.0), ((W, A, A), None), ((A, R, D), 2.0)],
)
def test_limit_of_trust(outcomes, expected):
    assert maps.limit(MAPS["step_size"](False), hand_made(*outcomes)) == expected


def test_conclusion_says_what_the_cells_say():
    drawn = MAPS["step_size"](False)
    few = {"auto": hand_made(A, A, R), "rk4": hand_made(A, W, D), "taylor": hand_made(R, R, R)}
    said = maps.conclusion(drawn, few)
    assert said == (
        "`auto` is accurate in 2 of 3 cells and refuses the rest (too small), with an error of at most 1.0e-09; "
        "right only up to h [s] of about: `rk4` 1."
    )
    several = {"auto": hand_made(A, W, D), "exact": hand_made(A, A, R), "rk4": hand_made(W, A, A)}
    said = maps.conclusion(drawn, several)
    assert said.startswith("`auto` is wrong or diverges in 2 of 3 cells, such as what acts 1.0, step size [s] 2.0; ")
    assert said.endswith("never wrong either: `exact`; wrong somewhere even at the smallest h [s]: `rk4`.")


def test_headline_tells_of_auto_in_the_red():
    good, bad = {"map/spin/auto": hand_made(A, A, R)}, {"map/mass/auto": hand_made(A, W, D)}
    assert SECTION.headlines(good) == [
        "`auto` is never wrong and never diverges on 1 stability maps with 3 cells, of which it refuses 1; its "
        "largest error is 1.0e-09 of the motion's own scale."
    ]
    assert SECTION.headlines({**good, **bad}) == [
        "`auto` is wrong or diverges on 1 of 2 stability maps: mass (2 cells)."
    ]


def test_growth_of_errors_is_fitted():
    steps = long_run.checkpoints(10**6)
    assert (steps[0], steps[-1], len(steps)) == (100, 10**6, 9)
    for power in (0.5, 1.0, 1.5):
        assert long_run.exponent(steps, [1e-16 * n**power for n in steps], 1000) == pytest.approx(power)
    runs = [{"steps": [1, 2], "errors": [3.0, 0.0]}, {"steps": [1, 2], "errors": [4.0, 2.0]}]
    assert long_run.together(runs) == ([1, 2], [pytest.approx(12.5**0.5), pytest.approx(2**0.5)])


def test_growth_beyond_brouwers_law_is_said():
    steps = long_run.checkpoints(10**6)
    runs = {f"n^{p}": (steps, [1e-16 * n**p for n in steps]) for p in (0.0, 0.5, 1.0)}
    said = growth_sentence("energy", runs)
    assert (
        "`n^0.0` 1.0e-16 after 1e+06 steps, not growing; `n^0.5` 1.0e-13 after 1e+06 steps, growing as n^0.50" in said
    )
    assert said.endswith("faster than that, so by something systematic: `n^1.0`.")
    assert growth_sentence("attitude", runs).endswith("none grows faster.")


def test_round_off_of_taylor_grows_as_brouwer_says():
    """The energy, which is conserved, about as √n; rk4 loses it in proportion to n."""
    steps, errors = long_run.together([long_run.energy_errors("taylor", seed, 10**6) for seed in (1, 2)])
    assert errors[-1] < 2e-14  # relative, after 20 000 rad; measured 3.8e-15
    assert long_run.exponent(steps, errors, 1000) < 0.8  # measured 0.41
    rk4 = long_run.energy_errors("rk4", 1, 10**5)
    assert rk4["errors"][-1] > 1e4 * errors[-1]  # measured 2.5e-9


def test_matrix_decays_as_its_step_says_and_the_quaternion_four_times_slower():
    h, steps = matrix.H * matrix.SPIN, 500
    found = {kind: matrix.measure(kind, steps) for kind in matrix.KINDS}
    stretched = (1.0 + h * h) ** steps - 1.0
    assert found["matrix"]["departures"][-1] == pytest.approx(stretched, rel=1e-10)
    assert found["quaternion"]["departures"][-1] == pytest.approx((1.0 + h * h / 4.0) ** steps - 1.0, rel=1e-10)
    for kind in ("matrix, re-orthonormalised", "quaternion, normalised"):
        assert max(found[kind]["departures"]) < 5e-15  # measured 8.9e-16
    ratio = found["matrix, re-orthonormalised"]["errors"][-1] / found["quaternion, normalised"]["errors"][-1]
    assert ratio == pytest.approx(4.0, rel=1e-2)  # (h ω)³/3 against (h ω)³/12 in a step; measured 3.998


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (1e-6, "1e-6"),
        (0.001, "0.001"),
        (1.0 / 30, "0.033"),
        (300.0, "300"),
        (1e4, "1e4"),
        (10.0, "10"),
        ("drag", "drag"),
    ],
)
def test_numbers_on_axes_are_short(number, text):
    assert plots.in_short(number) == text
