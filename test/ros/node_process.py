"""A node as a process of its own: started with a parameter file, stopped by a signal, its output kept."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[2]
READY_SECONDS = 120.0  # the first start compiles the kernels
SHARED_MEMORY = Path("/dev/shm")
SEGMENT = f"{SHARED_MEMORY}/fast(?:rtps|dds)_"  # of Fast DDS 2 and 3, as a pattern
NODE = "rigid_body_sim.ros.main"
DEEP_QUEUE = 20000  # a message for every step would fall out of the default queue of 10 when the machine is busy


class NodeProcess:
    """``rigid_body_node``, or another program of the package, in a process of its own.

    ``parameters`` go into a temporary YAML file; None gives no file. ``prefix`` is a program that becomes the node, and
    its arguments. Output goes to files, so that it cannot block.
    """

    def __init__(self, parameters, folder, arguments=(), namespace="", environment=None, module=NODE, prefix=()):
        command = [*prefix, sys.executable, "-m", module, "--ros-args", *arguments]
        if parameters is not None:
            parameters = {**deep_queues(namespace, parameters), **parameters}
            file = folder / "parameters.yaml"
            file.write_text(yaml.safe_dump({"/**": {"ros__parameters": parameters}}))
            command += ["--params-file", str(file)]
        path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
        self._output = {name: folder / name for name in ("stdout", "stderr")}
        with self._output["stdout"].open("w") as stdout, self._output["stderr"].open("w") as stderr:
            self.popen = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=stdout,
                stderr=stderr,
                env={**os.environ, "PYTHONPATH": path, **(environment or {})},
            )

    @property
    def stdout(self):
        return self._output["stdout"].read_text(errors="replace")

    @property
    def stderr(self):
        return self._output["stderr"].read_text(errors="replace")

    def wait_ready(self, seconds=READY_SECONDS):
        """Wait for the log line that begins with "ready"."""
        self.wait_for_output("]: ready: ", seconds)

    def wait_for_output(self, text, seconds):
        self.wait_until(lambda: text in self.stdout + self.stderr, repr(text), seconds)

    def wait_loaded(self, pattern, seconds):
        """Wait until a file whose path has ``pattern`` in it is in the process's memory."""
        maps = Path(f"/proc/{self.popen.pid}/maps")
        self.wait_until(lambda: re.search(pattern, maps.read_text()), pattern, seconds)

    def wait_until(self, condition, what, seconds):
        deadline = time.monotonic() + seconds
        while not condition():
            assert self.popen.poll() is None, f"the node ended with {self.popen.returncode}: {self.stderr}"
            assert time.monotonic() < deadline, f"no {what} within {seconds} s: {self.stderr}"
            time.sleep(0.01)

    def wait_end(self, seconds):
        """Exit status, once the process has ended by itself."""
        try:
            return self.popen.wait(seconds)
        except subprocess.TimeoutExpired:
            raise AssertionError(f"the node still runs after {seconds} s: {self.stdout}{self.stderr}") from None

    def stop(self, number=signal.SIGINT, seconds=5.0):
        """Send a signal; returns the exit status and the seconds that the node took to end."""
        sent = time.monotonic()
        self.popen.send_signal(number)
        status = self.wait_end(seconds)
        return status, time.monotonic() - sent

    def assert_stopped_cleanly(self):
        status, _ = self.stop()
        assert "Traceback" not in self.stderr, self.stderr
        assert status == 0, f"exit status {status}: {self.stderr}"

    def kill(self):
        """SIGKILL. A killed process leaves its shared memory behind, which is removed here."""
        files = shared_memory(self.popen.pid)
        self.popen.kill()
        self.popen.wait()
        for file in files - set().union(*map(shared_memory, all_processes())):
            for name in (file.name, f"{file.name}_el", f"sem.{file.name}_mutex"):
                file.with_name(name).unlink(missing_ok=True)

    def end(self):
        """Last resort, for what should have ended long ago: SIGTERM, and then SIGKILL."""
        if self.popen.poll() is None:
            self.popen.terminate()
            try:
                self.popen.wait(2.0)
            except subprocess.TimeoutExpired:
                self.kill()


def shared_memory(pid):
    """Files of Fast DDS that a process has mapped."""
    try:
        maps = Path(f"/proc/{pid}/maps").read_text()
    except OSError:  # ended, or somebody else's
        return set()
    return set(map(Path, re.findall(rf"{SEGMENT}\w+", maps)))


def all_processes():
    return [path.name for path in Path("/proc").iterdir() if path.name.isdigit()]


def deep_queues(namespace, parameters):
    """Parameters that override the queue length of publishers and command topics in the node's namespace."""
    if not namespace:
        return {}
    sent = ["pose", "twist", *(topic for topic in parameters.get("outputs", ()) if topic not in ("clock", "tf"))]
    taken = [topic for topic in parameters.get("wrench.topics", ("wrench",)) if not topic.startswith("/")]
    taken += ["actuator_commands"] if parameters.get("actuators") else []
    ends = [*(f"{topic}.publisher" for topic in sent), *(f"{topic}.subscription" for topic in taken)]
    return {f"qos_overrides.{namespace}/{end}.depth": DEEP_QUEUE for end in ends}
