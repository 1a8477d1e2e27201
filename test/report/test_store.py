"""Results survive: what was finished is found again, and only where it belongs."""

import pytest

from rigid_body_sim.report.store import FILE, Store, StoreError

ABOUT = {"quick": True, "seed": 1}


def test_what_was_added_is_there_after_a_resume(tmp_path):
    Store(tmp_path, ABOUT, resume=False).add("a", {"error": 1e-300, "none": None})
    assert Store(tmp_path, ABOUT, resume=True).results == {"a": {"error": 1e-300, "none": None}}


def test_without_resume_it_begins_anew_and_what_was_there_is_put_aside(tmp_path):
    for n in range(3):
        store = Store(tmp_path, ABOUT, resume=False)
        assert store.results == {}
        store.add("a", {"n": n})
    kept = {file.read_text(encoding="utf-8").splitlines()[1] for file in tmp_path.glob("results-*.jsonl")}
    assert kept == {f'{{"key": "a", "result": {{"n": {n}}}}}' for n in (0, 1)}


def test_a_line_cut_off_is_dropped_and_the_next_one_starts_clean(tmp_path):
    Store(tmp_path, ABOUT, resume=False).add("a", {"n": 1})
    with (tmp_path / FILE).open("a", encoding="utf-8") as file:
        file.write('{"key": "b", "resu')
    resumed = Store(tmp_path, ABOUT, resume=True)
    assert resumed.results == {"a": {"n": 1}}
    resumed.add("b", {"n": 2})
    assert Store(tmp_path, ABOUT, resume=True).results == {"a": {"n": 1}, "b": {"n": 2}}


def test_a_file_cut_off_in_its_first_line_begins_anew(tmp_path):
    (tmp_path / FILE).write_text('{"about"', encoding="utf-8")
    assert Store(tmp_path, ABOUT, resume=True).results == {}


def test_other_settings_are_refused_with_what_differs(tmp_path):
    Store(tmp_path, ABOUT, resume=False)
    with pytest.raises(StoreError, match=r"seed 1, now 2.*leave out --resume"):
        Store(tmp_path, {**ABOUT, "seed": 2}, resume=True)


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_what_json_cannot_hold_is_refused_and_not_written(tmp_path, value):
    store = Store(tmp_path, ABOUT, resume=False)
    with pytest.raises(ValueError, match="not JSON compliant"):
        store.add("a", {"error": value})
    assert Store(tmp_path, ABOUT, resume=True).results == {}


def test_a_key_is_taken_once(tmp_path):
    store = Store(tmp_path, ABOUT, resume=False)
    store.add("a", {})
    with pytest.raises(ValueError, match="'a' has a result already"):
        store.add("a", {})
