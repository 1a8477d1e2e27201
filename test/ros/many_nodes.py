"""Nodes that end by themselves, each a process forked from one that has imported everything: importing takes a second.

As a program it reads a JSON list of [folder, arguments] and leaves stdout, stderr and status of each in its folder.
"""

import importlib
import json
import os
import subprocess
import sys
import traceback
from pathlib import Path

ROOT = Path(__file__).parents[2]
END_SECONDS = 120.0


def run(arguments_of, folder):
    """(exit status, stdout, stderr) of a node for each list of arguments in a dict, by the same names."""
    folders = {name: folder / f"node{number}" for number, name in enumerate(arguments_of)}
    for each in folders.values():
        each.mkdir()
    asked = json.dumps([[str(folders[name]), arguments] for name, arguments in arguments_of.items()])
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
    environment = {**os.environ, "PYTHONPATH": path}
    subprocess.run([sys.executable, __file__], input=asked, text=True, check=True, timeout=END_SECONDS, env=environment)
    return {name: _result(each) for name, each in folders.items()}


def _result(folder):
    status, stdout, stderr = ((folder / name).read_text(errors="replace") for name in ("status", "stdout", "stderr"))
    return int(status), stdout, stderr


def main():
    """Fork a node for each of what stdin asks for, one after the other."""
    from rigid_body_sim import first_start
    from rigid_body_sim.ros import main as node_main

    importlib.import_module("rigid_body_sim.ros.node")  # here for all

    for requests in first_start.of_parameters({}):
        first_start.compile_together(requests)
    for folder, arguments in json.load(sys.stdin):
        child = os.fork()
        if child == 0:
            _be_node(node_main, Path(folder), arguments)
        _, status = os.waitpid(child, 0)
        Path(folder, "status").write_text(str(os.waitstatus_to_exitcode(status)))


def _be_node(node_main, folder, arguments):
    for descriptor, name in ((1, "stdout"), (2, "stderr")):
        os.dup2(os.open(folder / name, os.O_WRONLY | os.O_CREAT), descriptor)
    status = 70
    try:
        status = node_main.main(arguments)
    except SystemExit as ended:
        status = ended.code
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)


if __name__ == "__main__":
    main()
