"""The section "many bodies": sentences and tables follow from the numbers, and missing peers are told."""

import json

import pytest

from rigid_body_sim.report import batch, many_bodies_section, ours, peers
from rigid_body_sim.report.batch import BatchMethod
from rigid_body_sim.report.many_bodies_section import ManyBodies
from rigid_body_sim.report.method import LIBRARY
from rigid_body_sim.report.ours import ALONE, ENSEMBLE, LOOP
from rigid_body_sim.report.section import FAILED, Paragraph, Picture, Settings, Table

pytest.importorskip("matplotlib")

SECTION = ManyBodies()


def one(speed, n=1000, cpu=1e-7, error=1e-14, threads=2):
    """The result of a method that did so many steps a second in the middle one of three rounds."""
    middle = 100 * n / speed
    seconds = [middle, 2.0 * middle, 0.5 * middle]
    return {"threads": threads, "steps": 100, "seconds": seconds, "cpu": [100 * n * cpu] * 3, "error": error}


def result(methods, others=0.25, missing=None, refused=None):
    theirs = {"jax": ["J slow", "J fast"], "heyoka": ["H"], "gazebo": ["G"]}
    found = {peer: names for peer, names in theirs.items() if set(names) & set(methods)}
    return {"methods": methods, "peers": found, "missing": missing or {}, "refused": refused or {}, "others": others}


MANY = {ENSEMBLE: one(4e7), "J slow": one(1e7), "J fast": one(2e7), "H": one(2.5e6), "G": one(1e5)}


def test_headline_is_recomputed_from_the_numbers():
    found = {"speed/0.1/1000": result(MANY), "speed/0.1/10": result({ENSEMBLE: one(9e9, 10)})}
    assert SECTION.headlines(found) == [
        "1000 bodies of about 0.1 rad/s in steps of 1 ms: `Ensemble` does 4e+07 body-steps/s with 2 threads (goal "
        "5e+07 not met), 2 times `J fast` (goal 6 not met), 16 times `H` (goal 10 met), 400 times `G`. Other programs "
        "kept 0.2 cores busy meanwhile."
    ]


def test_headline_where_all_goals_are_met_and_where_no_peer_is():
    fast = {**MANY, ENSEMBLE: one(2e8)}
    (said,) = SECTION.headlines({"speed/0.1/1000": result(fast)})
    assert said.count(" met)") == 3 and "not met" not in said
    (said,) = SECTION.headlines({"speed/0.1/1000": result({ENSEMBLE: one(6e7)}, others=None)})
    assert said == (
        "1000 bodies of about 0.1 rad/s in steps of 1 ms: `Ensemble` does 6e+07 body-steps/s with 2 threads (goal "
        "5e+07 met); no peer was measured."
    )


@pytest.mark.parametrize(
    "found", [{}, {"speed/0.1/1000": {FAILED: "no"}}, {"speed/0.1/1000": result({})}, {"speed/0.1/10": result(MANY)}]
)
def test_without_a_result_nothing_is_said(found):
    assert SECTION.headlines(found) == []


def test_ratios_are_of_rounds_in_which_both_took_turns():
    """The machine was three times slower in one round, for both."""
    slow, fast = one(1e7), one(1e7)
    slow["seconds"], fast["seconds"] = [0.2, 0.6, 0.21], [0.1, 0.3, 0.07]
    (said,) = SECTION.headlines({"speed/0.1/1000": result({ENSEMBLE: fast, "H": slow})})
    assert "1e+06 body-steps/s" in said and "2 times `H`" in said


def test_spins_are_told_with_errors_and_the_fastest_that_is_as_exact():
    errors = {ENSEMBLE: 3e-15, "J fast": 1e-8, "J slow": 2e-8, "H": 4e-14, "G": None}
    assert many_bodies_section.at_spin(10.0, result(MANY), errors) == (
        "At 10 rad/s `Ensemble` does 4e+07 body-steps/s (error 3e-15), 2 times the fastest peer, `J fast` "
        "(error 1e-08), 16 times the fastest with an error below 1e-12, `H` (error 4e-14)."
    )
    alone = many_bodies_section.at_spin(1.0, result({ENSEMBLE: one(1e7)}), {})
    assert alone == "At 1 rad/s `Ensemble` does 1e+07 body-steps/s."


@pytest.fixture
def found():
    """Results of a report as the store gives them."""
    few = {name: one(1e6, 10) for name in (*MANY, ALONE, LOOP)}
    made = {
        "speed/0.1/10": result(few, missing={"mujoco": "No module named 'mujoco'; pip install mujoco"}),
        "speed/0.1/1000": result({**MANY, ALONE: one(3e7, threads=1)}, refused={"H fine": "MemoryError: "}),
        "speed/10/1000": result({**MANY, ENSEMBLE: one(1e7)}),
        "speed/1/1000": {FAILED: "RuntimeError: no"},
        "error/0.1": {"errors": {ENSEMBLE: 1e-15, "H": 2e-14}, "refused": {}, "missing": {}},
        "error/10": {"errors": {ENSEMBLE: 5e-14, "J fast": 1e-8}, "refused": {}, "missing": {}},
    }
    return json.loads(json.dumps(made))


def test_page_has_picture_tables_and_what_is_missing(found, tmp_path):
    blocks = SECTION.render(found, tmp_path)
    (picture,) = (block for block in blocks if isinstance(block, Picture))
    assert (tmp_path / f"{picture.stem}.png").stat().st_size > 20_000  # bytes; measured 82 000
    assert (tmp_path / f"{picture.stem}.svg").read_text(encoding="utf-8").count("<path") > 20
    said = [block.text for block in blocks if isinstance(block, Paragraph)]
    assert "wall-clock time" in said[0]
    assert said[1].startswith(SECTION.headlines(found)[0]) and "no error is above 1e-14" in said[1]
    assert (
        said[2].startswith("At 0.1 rad/s") and "At 10 rad/s `Ensemble` does 1e+07 body-steps/s (error 5e-14)" in said[2]
    )
    assert said[3] == ("Not measured: mujoco (No module named 'mujoco'; pip install mujoco); H fine (MemoryError: ).")


def test_tables_have_the_numbers(found, tmp_path):
    over_n, spins, points = (block for block in SECTION.render(found, tmp_path) if isinstance(block, Table))
    assert over_n.columns[:4] == ("method", "threads", "10", "1000")
    rows = {row[0]: row[1:] for row in over_n.rows}
    assert rows[ENSEMBLE] == (2, 1e6, 4e7, 100.0, 1.0, 1e-15)
    assert rows["J slow"] == (2, 1e6, 1e7, 100.0, 4.0, None)
    assert rows[LOOP] == (2, 1e6, None, None, None, None)
    assert spins.rows[0] == (0.1, ENSEMBLE, 4e7, 100.0, 1.0, 1e-15)
    assert (10.0, "J fast", 2e7, 100.0, 0.5, 1e-8) in spins.rows
    assert points.rows[0] == (0.1, 10, ENSEMBLE, 2, 100, 1e6, 5e5, 2e6, 100.0, 1e-14, 0.25)
    assert len(points.rows) == 7 + 6 + 5


def test_one_number_of_bodies_and_spin_is_enough_for_a_page(tmp_path):
    blocks = SECTION.render({"speed/0.1/10": result({ENSEMBLE: one(1e6, 10)})}, tmp_path)
    assert [type(block) for block in blocks] == [Paragraph, Picture, Paragraph, Table, Table]
    assert SECTION.render({}, tmp_path) == SECTION.render({"speed/0.1/10": {FAILED: "no"}}, tmp_path) == []


def test_what_is_measured():
    keys = [made.key for made in SECTION.measurements(Settings())]
    assert keys[:6] == [f"speed/0.1/{n}" for n in (1, 10, 100, 1000, 10_000, 100_000)]
    assert keys[6:] == ["speed/1/1000", "speed/10/1000", "error/0.1", "error/1", "error/10"]
    quick = [made.key for made in SECTION.measurements(Settings(quick=True))]
    assert quick == [*keys[:5], "error/0.1"]


def _borrowed(given):
    return ours.batch_methods()[0].start(given)


@pytest.fixture
def with_one_peer(monkeypatch):
    """Where one peer is installed, one is not, and one has nothing for many bodies; tiny numbers of bodies."""

    def methods(peer):
        if peer == "jax":
            raise ImportError("No module named 'jax'; pip install jax")
        return [BatchMethod("H", LIBRARY, _borrowed)] if peer == "heyoka" else []

    monkeypatch.setattr(peers, "batch_methods", methods)
    monkeypatch.setattr(many_bodies_section, "AT", 9)
    monkeypatch.setattr(many_bodies_section, "QUICK_NUMBERS", (1, 9))
    monkeypatch.setattr(many_bodies_section, "LONG", 300)
    monkeypatch.setattr(batch, "LONG_ENOUGH", 1e-9)


def measured(settings):
    return {made.key: json.loads(json.dumps(made.run(), allow_nan=False)) for made in SECTION.measurements(settings)}


def test_a_tiny_run_with_one_peer(with_one_peer, tmp_path):
    found = measured(Settings(quick=True))
    assert list(found) == ["speed/0.1/1", "speed/0.1/9", "error/0.1"]
    assert list(found["speed/0.1/1"]["methods"]) == [ENSEMBLE, ALONE, LOOP]  # no peer but at AT
    at = found["speed/0.1/9"]
    assert list(at["methods"]) == [ENSEMBLE, ALONE, LOOP, "H"] and at["peers"] == {"heyoka": ["H"]}
    assert at["missing"] == {"jax": "No module named 'jax'; pip install jax"} and at["refused"] == {}
    assert max(method["error"] for method in at["methods"].values()) < 2e-15  # measured 1.4e-16
    assert max(found["error/0.1"]["errors"].values()) < 2e-15  # measured 1.4e-16
    (headline,) = SECTION.headlines(found)
    assert headline.startswith("9 bodies") and "times `H` (goal 10 not met)" in headline
    assert "jax (No module named 'jax'; pip install jax)" in SECTION.render(found, tmp_path)[-1].text


def test_peers_that_are_not_asked_for_are_not_looked_for(with_one_peer):
    found = measured(Settings(quick=True, peers=()))
    assert found["speed/0.1/9"]["missing"] == {} == found["speed/0.1/9"]["peers"]
