"""The command from end to end: quick reports of a few methods, their numbers, their page in a browser."""

import csv
import itertools
import json
import re
import subprocess
import sys
import time

import pytest

from bench import readme
from rigid_body_sim.report import error_section, frontier, main
from rigid_body_sim.report.problems import TITLES
from rigid_body_sim.report.section import Heading, Measurement, Paragraph, Table
from rigid_body_sim.report.store import FILE

from . import browser

for extra in ("matplotlib", "tqdm"):
    pytest.importorskip(extra)

FEW = ["--quick", "--only", "error", "--problems", "free_fall,commands,body_wrench"]
FEW += ["--integrators", "auto,taylor,exact,rk4", "--peers", "none"]


def results(folder):
    """Of a folder, by key."""
    lines = (folder / FILE).read_text(encoding="utf-8").splitlines()[1:]
    return {entry["key"]: entry["result"] for entry in map(json.loads, lines)}


def errors_of(found):
    """All that is not a time, by key."""
    timed = ("cpu", "cpu_low", "cpu_high", "repeats", "compile_seconds")
    return {
        (key, name, point["value"]): {what: point[what] for what in point if what not in timed}
        for key, result in found.items()
        for name, one in result["methods"].items()
        for point in one.get("points", [])
    }


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A quick report."""
    made = tmp_path_factory.mktemp("report")
    assert main.main([*FEW, "--out", str(made)]) == 0
    return made


def test_errors_are_the_same_from_run_to_run(folder, tmp_path):
    assert main.main([*FEW, "--out", str(tmp_path)]) == 0
    first, second = errors_of(results(folder)), errors_of(results(tmp_path))
    assert first == second and len(first) > 20


def test_methods_that_are_worse_show_as_worse(folder):
    found = results(folder)["error/body_wrench/rk4"]["methods"]["rk4"]["points"]
    ratios = [a["error"] / b["error"] for a, b in itertools.pairwise(found)]
    assert max(ratios[1:3]) == pytest.approx(256, rel=0.1)  # order 4: steps are a quarter of the one before
    best = results(folder)["error/body_wrench/auto"]["methods"]["auto"]["points"]
    assert max(point["error"] for point in best) < 1e-12  # measured 6e-14


def test_every_headline_is_recomputed_from_the_numbers(folder):
    mine = {key.removeprefix("error/"): result for key, result in results(folder).items()}
    expected = error_section.sentences(frontier.goals(mine, list(TITLES)))
    page, text = ((folder / f"report.{end}").read_text(encoding="utf-8") for end in ("html", "md"))
    assert [line[2:] for line in text.split("\n\n")[1].splitlines()] == expected and len(expected) == 2
    for sentence in expected:
        assert re.sub("`([^`]+)`", r"<code>\1</code>", sentence) in page


def test_the_frontier_goal_is_recomputed_in_another_way(folder):
    """auto or taylor below 1e-6, and no point with an error as small at 0.9 of its cost."""
    for name in ("free_fall", "commands", "body_wrench"):
        flat = [
            (method, p["error"], p["cpu"])
            for key, result in results(folder).items()
            if key.startswith(f"error/{name}/")
            for method, one in result["methods"].items()
            for p in one.get("points", [])
        ]
        mine = [(e, c) for m, e, c in flat if m in ("auto", "taylor") and e < 1e-6]
        on = any(all(not (e2 <= max(e, 1e-14) and c2 < 0.9 * c) for _, e2, c2 in flat) for e, c in mine)
        found = {key.removeprefix("error/"): result for key, result in results(folder).items()}
        assert frontier.goals(found, [name])[name]["on_frontier"] == on


def test_every_table_is_there_as_csv_and_json(folder):
    assert (folder / "error_commands.svg").exists() and (folder / "error_commands.png").exists()
    for stem in ("error_cheapest", "error_commands", "error_free_fall", "error_not_measured"):
        rows = json.loads((folder / f"{stem}.json").read_text(encoding="utf-8"))
        with (folder / f"{stem}.csv").open(newline="", encoding="utf-8") as file:
            assert len(list(csv.reader(file))) == len(rows) + 1 > 1


def test_machine_versions_and_command_line_are_named(folder):
    text = (folder / "report.md").read_text(encoding="utf-8")
    assert "- command: rigid_body_report --quick --only error" in text
    for name in ("date", "machine", "system", "versions"):
        assert re.search(rf"^- {name}: .+", text, re.MULTILINE)


def test_killed_and_resumed_it_loses_nothing(tmp_path):
    command = [sys.executable, "-m", "rigid_body_sim.report.main", *FEW, "--out", str(tmp_path)]
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 200
    file = tmp_path / FILE
    while not file.exists() or file.read_bytes().count(b"\n") < 4:
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.01)
    process.kill()
    process.wait()
    before = file.read_text(encoding="utf-8").rsplit("\n", 1)[0].splitlines()
    assert main.main([*FEW, "--resume", "--out", str(tmp_path)]) == 0
    assert file.read_text(encoding="utf-8").splitlines()[: len(before)] == before  # with the times that were measured
    assert len(results(tmp_path)) == 12


class _Section:
    """A section of which one measurement fails."""

    name, title = "odd", "Odd <numbers>"

    def measurements(self, settings):
        return [Measurement("bad", self._fail), Measurement("good", lambda: {"n": 2 + settings.seed})]

    def _fail(self):
        raise ArithmeticError("no such number")

    def headlines(self, results):
        return [f"It is {results['good']['n']} & no more."]

    def render(self, results, folder):
        table = Table("odd_table", ("a", "b"), [("x<y", 2.0), ("z", None), ("q", 10)], "Numbers.")
        return [Heading("A <heading>"), Paragraph(results["bad"]["failed"]), table]


def test_one_measurement_that_fails_is_shown_and_does_not_end_the_others(tmp_path, monkeypatch):
    monkeypatch.setattr(main, "SECTIONS", (_Section(),))
    assert main.main(["--out", str(tmp_path), "--seed", "5"]) == 0
    assert results(tmp_path) == {"odd/bad": {"failed": "ArithmeticError: no such number"}, "odd/good": {"n": 7}}
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    for part in ("It is 7 &amp; no more.", "Odd &lt;numbers&gt;", "ArithmeticError: no such number", "x&lt;y"):
        assert part in text
    assert "| z | – |" in (tmp_path / "report.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--integrators", "rk5"], "'rk5' is not known; choose from auto, taylor"),
        (["--problems", "top"], "'top' is not known; choose from tumble"),
        (["--peers", "gazebo"], "'gazebo' is not known; choose from jax"),
        (["--only", "errors"], "'errors' is not known; choose from error"),
    ],
)
def test_unknown_names_are_refused_with_those_there_are(arguments, said, capsys):
    with pytest.raises(SystemExit):
        main.main(arguments)
    assert said in capsys.readouterr().err


def test_other_settings_are_not_mixed_into_a_folder(folder, capsys):
    assert main.main([*FEW, "--resume", "--seed", "2", "--out", str(folder)]) == 1
    assert "seed 1, now 2" in capsys.readouterr().err


_LOOK = """
const column = (t, i) => [...t.tBodies[0].rows].map((row) => row.cells[i].dataset.value ?? row.cells[i].textContent);
const table = document.querySelectorAll("table")[3], button = table.querySelectorAll("th button")[4];
button.click(); const up = column(table, 4); button.click(); const down = column(table, 4);
const names = table.querySelectorAll("th button")[0]; names.click();
return {
  svg: [...document.querySelectorAll("figure svg")].map((s) => s.getBoundingClientRect().width > 100),
  img: document.images.length, tables: document.querySelectorAll("table").length,
  fetched: performance.getEntriesByType("resource").filter((r) => !r.name.startsWith("data:")).length,
  broken: [...document.querySelectorAll("use")].filter(
    (u) => !document.getElementById((u.getAttribute("href") ?? u.getAttribute("xlink:href")).slice(1))).length,
  up: up.map(Number), down: down.map(Number), names: column(table, 0),
  wide: document.documentElement.scrollWidth > document.documentElement.clientWidth,
};"""


def test_the_page_works_in_a_browser(chromium, folder, tmp_path):
    found, failures = browser.ask(chromium, folder / "report.html", _LOOK, tmp_path)
    assert failures == []
    assert found["svg"] == [True] * 4 and found["img"] == 0 and found["fetched"] == 0 and found["broken"] == 0
    assert found["tables"] == 9
    assert found["up"] == sorted(found["up"]) and len(set(found["up"])) > 3
    assert found["down"] == found["up"][::-1]
    assert found["names"] == sorted(found["names"]) and not found["wide"]


def test_a_script_error_would_be_noticed(chromium, folder, tmp_path):
    broken = tmp_path / "broken.html"
    text = (folder / "report.html").read_text(encoding="utf-8")
    broken.write_text(text.replace('"use strict";', '"use strict"; noSuchFunction();'), encoding="utf-8")
    assert browser.ask(chromium, broken, "return 1;", tmp_path)[1] != []


def test_the_readme_gets_table_picture_date_and_machine(folder, tmp_path):
    (tmp_path / "docs" / "images").mkdir(parents=True)
    text = f"above\n{readme.BEGIN}\nold\n{readme.END}\nbelow\n"
    (tmp_path / "README.md").write_text(text, encoding="utf-8")
    assert readme.main([str(folder), str(tmp_path)]) == 0
    made = (tmp_path / "README.md").read_text(encoding="utf-8")
    assert made.startswith("above\n") and made.endswith("below\n") and "old" not in made
    assert "| Free fall, 10 s |" in made and "Made by `rigid_body_report --quick" in made
    assert json.loads((folder / "made.json").read_text(encoding="utf-8"))["machine"] in made
    assert "Another library costs less" not in made  # none was measured
    assert (tmp_path / "docs" / "images" / "report.png").stat().st_size > 5000
