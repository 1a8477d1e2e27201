"""A reader of the documentation, who does what a page says: makes the files, and runs the commands in a folder."""

import contextlib
import os
import signal
import subprocess
import sys
import time

from ..doc_pages import ROOT
from ..test_command_lines import PROGRAMS

UNTIL_CTRL_C = "# until Ctrl-C"
SECONDS = 250.0  # for a command, which may compile
SHIM = '#!/bin/sh\nexec "{python}" {run} "$@"\n'


class Reader:
    """In ``folder``, with the programs of the package on the path as if it were installed, and ``config`` beside."""

    def __init__(self, folder):
        self.folder, self._running = folder, []
        (folder / "config").symlink_to(ROOT / "config")
        for name, module, function in PROGRAMS:
            self._shim(name, f'-c "import sys; from {module} import {function}; sys.exit({function}())"')
        self._shim("python", "")
        self._shim("pytest", "-m pytest -p no:cacheprovider")
        path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
        others = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
        programs = f"{folder / 'bin'}{os.pathsep}{os.environ['PATH']}"
        self._environment = {**others, "PYTHONPATH": path, "PATH": programs}

    def _shim(self, name, run):
        (self.folder / "bin").mkdir(exist_ok=True)
        shim = self.folder / "bin" / name
        shim.write_text(SHIM.format(python=sys.executable, run=run))
        shim.chmod(0o755)

    def do(self, block, until=None):
        """What a block says. Programs that run until Ctrl-C are ended before the next command, after ``until()``."""
        if block.file:
            (self.folder / block.file).write_text(block.text, encoding="utf-8")
        elif block.language == "console":
            for line in block.text.splitlines():
                if line.startswith("$ "):
                    self._run(line[2:], statuses=(0, 2))  # 2: another motion than that of the page's own bag
        elif block.text.startswith(UNTIL_CTRL_C):
            self._start(block.text)
        else:
            self.stop(until)
            self._run(block.text)

    def _run(self, text, statuses=(0,)):
        process, output = self._begin(text, "output.txt")
        try:
            status = process.wait(SECONDS)
        finally:
            _kill(process)  # and all that it has started and left behind
        assert status in statuses, f"{text}\n{output.read_text()}"

    def _start(self, text):
        self._running.append((*self._begin(text, f"output_{len(self._running)}.txt"), text))

    def _begin(self, text, name):
        output = self.folder / name
        with output.open("w") as file:
            process = subprocess.Popen(
                ["bash", "-ec", text], cwd=self.folder, env=self._environment, stdin=subprocess.DEVNULL,
                stdout=file, stderr=subprocess.STDOUT, start_new_session=True,
            )  # fmt: skip
        return process, output

    def wait_ready(self):
        """Until the programs that run have all said that they are ready."""
        self.wait(lambda: all("ready: " in output.read_text() for _, output, _ in self._running), "ready")

    def wait(self, condition, what):
        """Until something is the case, while all programs run."""
        end = time.monotonic() + SECONDS
        while not condition():
            for process, output, text in self._running:
                assert process.poll() is None, f"{text}\n{output.read_text()}"
            assert time.monotonic() < end, f"{what}: not after {SECONDS:g} s"
            time.sleep(0.02)

    def stop(self, until=None):
        """Press Ctrl-C in all terminals, the last first; each program ends with status 0."""
        if self._running and until is not None:
            self.wait(until, "what the page tells to wait for")
        while self._running:
            process, output, text = self._running.pop()
            os.killpg(process.pid, signal.SIGINT)
            assert process.wait(60.0) == 0, f"{text}\n{output.read_text()}"

    def leave(self):
        """End what still runs."""
        for process, *_ in self._running:
            _kill(process)


def _kill(process):
    """Processes that are started, and killed, together."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
