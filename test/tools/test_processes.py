"""Processes that the demo starts: noticed when they die, never left behind."""

import os
import signal
import time
from pathlib import Path

import pytest

from rigid_body_sim.tools import processes
from rigid_body_sim.tools.processes import Child, ChildError, Children, children

SOON = 20.0  # s


def start(running: Children, folder: Path, text: str, monkeypatch) -> Child:
    (folder / "a_child.py").write_text(text)
    monkeypatch.setenv("PYTHONPATH", f"{folder}{os.pathsep}{os.environ.get('PYTHONPATH', '')}")
    return running.start("a_child", [])


def test_early_end_is_told_with_the_last_words(tmp_path, monkeypatch):
    with children() as running:
        child = start(running, tmp_path, "print('first'); raise SystemExit('no such scene')", monkeypatch)
        with pytest.raises(ChildError, match=r"^a_child ended with status 1: no such scene$"):
            check_until(child, time.monotonic() + SOON)


@pytest.mark.parametrize("stubborn", (False, True), ids=("ends when asked", "has to be killed"))
def test_nothing_is_left_behind(tmp_path, monkeypatch, stubborn):
    monkeypatch.setattr(processes, "PATIENCE", 1.0)
    ignore = "signal.signal(signal.SIGINT, signal.SIG_IGN); " if stubborn else ""
    ready = tmp_path / "ready"
    text = f"import pathlib, signal, time; {ignore}pathlib.Path({str(ready)!r}).touch(); time.sleep(600)"
    with pytest.raises(KeyboardInterrupt), children() as running:
        child = start(running, tmp_path, text, monkeypatch)
        wait_for(ready, time.monotonic() + SOON)
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(SOON)  # cut short by the signal
    with pytest.raises(ProcessLookupError):
        os.kill(child.pid, 0)


def test_signal_while_a_process_is_started_ends_that_process_too(tmp_path, monkeypatch):
    """It used to be started and never noted: the list got it one statement later."""
    started = []

    class Slow(Child):
        def __init__(self, *arguments):
            super().__init__(*arguments)
            started.append(self.pid)
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.1)  # the signal is handled here, between the start and its note

    monkeypatch.setattr(processes, "Child", Slow)
    with pytest.raises(KeyboardInterrupt), children() as running:
        start(running, tmp_path, "import time; time.sleep(600)", monkeypatch)
    with pytest.raises(ProcessLookupError):
        os.kill(started[0], 0)


def check_until(child: Child, deadline: float) -> None:
    while time.monotonic() < deadline:
        child.check()
        time.sleep(0.01)


def wait_for(path: Path, deadline: float) -> None:
    while not path.exists():
        assert time.monotonic() < deadline
        time.sleep(0.01)
