"""A node at 1 kHz under 200 commands a second for an hour, or as many seconds as given: ``python soak.py [seconds]``.

Prints its memory [kB], threads and open files every minute, and at the end by how much each has grown since the first
minute; exit status 1 when threads or files have, or memory by more than 5 MB.
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
sys.path.insert(0, str(Path(__file__).parent))

from node_process import ROOT, NodeProcess

MOST_GROWTH = 5000  # kB
SCENE = {"rate": 1000.0, "publish_rate": 0.0, "body.inertia": [0.1, 0.2, 0.25, 0.0, 0.0, 0.0]}


def reading(pid):
    """(kB in memory, threads, open files) of a process."""
    fields = dict(line.split(":", 1) for line in Path(f"/proc/{pid}/status").read_text().splitlines())
    return int(fields["VmRSS"].split()[0]), int(fields["Threads"]), len(list(Path(f"/proc/{pid}/fd").iterdir()))


def watch(process, seconds):
    """Readings of each minute, of each tenth when that is shorter."""
    begun, found = time.monotonic(), []
    print("    s  memory [kB]  threads  files", flush=True)
    while (now := time.monotonic() - begun) < seconds:
        assert process.popen.poll() is None, process.stderr
        found.append(reading(process.popen.pid))
        print(f"{now:5.0f}  {found[-1][0]:11d}  {found[-1][1]:7d}  {found[-1][2]:5d}", flush=True)
        time.sleep(min(60.0, seconds / 10))
    return found


def main(seconds=3600.0):
    with tempfile.TemporaryDirectory() as folder:
        process = NodeProcess(SCENE, Path(folder), arguments=["-r", "__ns:=/soak"])
        process.wait_ready()
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])}
        script = str(Path(__file__).with_name("commander.py"))
        commander = subprocess.Popen([sys.executable, script, "/soak", "200", "0.1"], env=environment)
        try:
            found = watch(process, seconds)
        finally:
            commander.kill()
            commander.wait()
            status, _ = process.stop()
    memory, threads, files = (last - first for first, last in zip(found[1], found[-1], strict=True))
    print(f"grown by {memory} kB, {threads} threads, {files} files; exit status {status}")
    return int(memory > MOST_GROWTH or threads > 0 or files > 0 or status != 0)


if __name__ == "__main__":
    sys.exit(main(*map(float, sys.argv[1:])))
