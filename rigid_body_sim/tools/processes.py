"""Other programs, run as processes of their own and never left behind."""

import contextlib
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence

PATIENCE = 5.0  # s that a process gets to end by itself
STOPPING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class ChildError(RuntimeError):
    """A process that ended by itself; the text says which, how, and its last words."""


class Child:
    """A program, run as a process: out of reach of the terminal's Ctrl-C, so that only we end it."""

    def __init__(self, name: str, command: Sequence[str], environment: Mapping[str, str] | None = None):
        self.name = name
        with contextlib.ExitStack() as stack:
            # A file, because a pipe that nobody reads would block the process.
            self._output = stack.enter_context(tempfile.TemporaryFile())
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=self._output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                env={**os.environ, **(environment or {})},
            )
            self._open = stack.pop_all()  # until ``reap``

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    def check(self) -> None:
        """Raise ChildError when the process is no longer there."""
        if (status := self._process.poll()) is not None:
            raise ChildError(f"{self.name} ended with status {status}: {self.last_line()}")

    def interrupt(self) -> None:
        """Ask the process to end, as Ctrl-C does."""
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)

    def reap(self) -> None:
        """Wait until the process is gone; after PATIENCE it is killed."""
        try:
            self._process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._open.close()

    def said(self) -> str:
        """All that it has printed so far."""
        # Read in place: the process writes where the file's position is, which it shares.
        file = self._output.fileno()
        return os.pread(file, os.fstat(file).st_size, 0).decode(errors="replace")

    def last_line(self) -> str:
        """The last line that it has printed."""
        lines = self.said().split("\n")
        return next((line.strip() for line in reversed(lines) if line.strip()), "it said nothing")


class Children:
    """The processes that were started, and the signals that end all of them."""

    def __init__(self) -> None:
        self._running: list[Child] = []
        self._starting = self._interrupted = False

    def start(self, module: str, arguments: Sequence[str], environment: Mapping[str, str] | None = None) -> Child:
        """Start a module of this Python as a process."""
        return self._begin(module, [sys.executable, "-m", module, *arguments], environment)

    def run(self, command: Sequence[str], environment: Mapping[str, str] | None = None) -> Child:
        """Start a program as a process; it is named by its command line."""
        return self._begin(" ".join(command), command, environment)

    def _begin(self, name: str, command: Sequence[str], environment: Mapping[str, str] | None) -> Child:
        """A signal in the middle of it waits, so that no process is started and then forgotten."""
        self._starting = True
        try:
            self._running.append(Child(name, command, environment))
        finally:
            self._starting = False
        if self._interrupted:
            raise KeyboardInterrupt
        return self._running[-1]

    def check(self) -> None:
        """Raise ChildError when one is no longer there."""
        for child in self._running:
            child.check()

    def end(self) -> None:
        """Ask all to end, and see that they do."""
        for child in self._running:
            child.interrupt()
        for child in self._running:
            child.reap()

    def on_signal(self, *_: object) -> None:
        """Raise KeyboardInterrupt, but not between starting a process and noting it."""
        self._interrupted = True
        if not self._starting:
            raise KeyboardInterrupt


@contextlib.contextmanager
def children() -> Iterator[Children]:
    """Processes that can be started; on leaving, whatever the reason, all of them are ended."""
    running = Children()
    before = {number: signal.signal(number, running.on_signal) for number in STOPPING}
    try:
        yield running
    finally:
        for number in STOPPING:
            signal.signal(number, signal.SIG_IGN)  # a second Ctrl-C must not leave one behind
        running.end()
        for number, handler in before.items():
            signal.signal(number, handler)
