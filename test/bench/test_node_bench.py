"""The node's benchmark: what it writes is complete, its goals are judged rightly, and nothing is left behind."""

import json
import os
import re
import signal
import subprocess
import sys
import time

import pytest

from bench.node_bench.record import AT_LEAST, AT_MOST, BELOW, Figure

NAMES = {"name", "value", "unit", "how", "goal", "met", "spread", "load"}


@pytest.mark.parametrize(
    ("value", "goal", "met"),
    [
        (0.5, (AT_MOST, 0.5), True),
        (0.6, (AT_MOST, 0.5), False),
        (0.5, (BELOW, 0.5), False),
        (0.4, (BELOW, 0.5), True),
        (0.5, (AT_LEAST, 0.5), True),
        (0.4, (AT_LEAST, 0.5), False),
        (0.4, None, None),
        (None, (BELOW, 0.5), None),
    ],
)
def test_goal_is_judged(value, goal, met):
    assert Figure("cost", value, "s", "by a clock", goal).met is met


def test_median_carries_its_spread():
    figure = Figure.median("cost", [3.0, 1.0, 2.5], "s", "by a clock", (BELOW, 2.0))
    assert (figure.value, figure.spread, figure.met) == (2.5, (1.0, 3.0), False)
    assert "2.5 s (1 to 3); goal below 2: NOT met" in figure.line()
    assert figure.record()["goal"] == "below 2"


def test_what_could_not_be_measured_keeps_its_reason():
    figure = Figure.missing("cost", "no clock here")
    assert figure.line() == "cost: not measured: no clock here"
    assert (figure.record()["value"], figure.record()["met"]) == (None, None)


def start(*arguments: str) -> subprocess.Popen:
    command = [sys.executable, "-m", "bench.node_bench", *arguments]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.mark.ros
def test_figures_are_printed_and_written(tmp_path):
    pytest.importorskip("rclpy")
    file = tmp_path / "bench.json"
    bench = start("--seconds", "1", "--only", "1khz", "--only", "command", "--out", str(file))
    said, errors = bench.communicate(timeout=280)
    assert bench.returncode == 0, errors
    content = json.loads(file.read_text(encoding="utf-8"))
    assert "processors" in content["machine"]["machine"]
    figures = {figure["name"]: figure for figure in content["figures"]}
    assert all(set(figure) == NAMES for figure in figures.values())
    assert all(name in said for name in figures)
    assert figures["command to motion"]["value"] > 0.0
    assert figures["1000 Hz: CPU"]["value"] > 0.0
    steps = int(re.search(r"(\d+) steps", figures["1000 Hz: time given up"]["how"])[1])
    assert steps > 0  # measured 1000 in a second on an idle machine


@pytest.mark.ros
def test_interrupted_benchmark_leaves_nothing_behind(tmp_path):
    pytest.importorskip("rclpy")
    file = tmp_path / "bench.json"
    bench = start("--only", "1khz", "--out", str(file))
    deadline = time.monotonic() + 100.0
    while not (processes := children_of(bench.pid)):
        assert bench.poll() is None and time.monotonic() < deadline
        time.sleep(0.05)
    bench.send_signal(signal.SIGINT)
    _, errors = bench.communicate(timeout=30)
    assert bench.returncode == 130
    assert errors.endswith("interrupted\n") and "Traceback" not in errors
    assert not any(os.path.exists(f"/proc/{pid}") for pid in processes)
    assert json.loads(file.read_text(encoding="utf-8"))["figures"] == []


def children_of(pid: int) -> list[int]:
    with open(f"/proc/{pid}/task/{pid}/children") as file:
        return [int(child) for child in file.read().split()]


def test_bad_arguments_are_one_sentence(tmp_path):
    for arguments, sentence in (
        (("--seconds", "0"), "0 is not a finite number of seconds of at least 1"),
        (("--out", str(tmp_path / "nowhere" / "bench.json")), "there is no such folder"),
    ):
        bench = start(*arguments)
        _, errors = bench.communicate(timeout=60)
        assert bench.returncode == 2
        assert sentence in errors
