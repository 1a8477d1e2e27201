"""Fixtures for tests that talk to a running node over DDS. Every node is a process of its own."""

import hashlib
import importlib.util
import itertools
import os
import shutil
import sys
import sysconfig
from pathlib import Path

import pytest

from rigid_body_sim import first_start

from . import stand_in
from .domains import USUAL, free_domain

os.environ["ROS_DOMAIN_ID"] = str(free_domain(USUAL))
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"

_numbers = itertools.count(1)


@pytest.fixture(scope="session")
def context():
    """A context of rclpy for the nodes that tests make in this process, but for those of Remote."""
    rclpy = pytest.importorskip("rclpy")
    context = rclpy.Context()
    rclpy.init(context=context)
    yield context
    context.try_shutdown()


@pytest.fixture(scope="session")
def run_node(tmp_path_factory):
    """Start a node process that nobody listens to: ``run_node(parameters, arguments=(), environment={})``."""
    from .node_process import NodeProcess

    started = []

    def run(parameters=None, **options):
        process = NodeProcess(parameters, tmp_path_factory.mktemp("node"), **options)
        started.append(process)
        return process

    yield run
    for process in started:
        process.end()


@pytest.fixture
def connect(run_node):
    """Start a node in a namespace of its own and talk to it: ``connect(parameters, environment={})``.

    At the end of the test each is stopped by SIGINT, which must leave no traceback and exit status 0. So no test has
    to share the machine with the nodes of others.
    """
    yield from _connections(run_node)


@pytest.fixture(scope="module")
def connect_shared(run_node):
    """The same, for nodes that the tests of a module share; they are stopped at its end."""
    yield from _connections(run_node)


def _connections(run_node):
    pytest.importorskip("rclpy")
    from .remote import Remote

    remotes = []

    def start(parameters, **options):
        namespace = f"/n{next(_numbers)}"
        process = run_node(parameters, arguments=["-r", f"__ns:={namespace}"], namespace=namespace, **options)
        remotes.append(Remote(process, namespace, parameters.get("wrench.topics", ("wrench",))))
        return remotes[-1]

    yield start
    try:
        for remote in remotes:
            if remote.process.popen.poll() is None:  # else a test has failed already
                remote.process.assert_stopped_cleanly()
    finally:  # last: when somebody leaves with 20 000 messages unread, Fast DDS holds the node up for seconds
        for remote in remotes:
            remote.close()


@pytest.fixture(scope="session")
def stand_in_for(request, tmp_path_factory):
    """A function: the folder with a stand-in for a package, made once for this Python and its text.

    It can be imported here from then on. None where the real package is installed.
    """

    def made(name, interfaces):
        if importlib.util.find_spec(name) is not None:
            return None
        if not (shutil.which("gcc") and Path(sysconfig.get_paths()["include"], "Python.h").exists()):
            pytest.skip(f"the stand-in for {name} needs gcc and Python.h (python3-dev)")
        cache = getattr(request.config, "cache", None)
        text = Path(stand_in.__file__).read_bytes() + sys.version.encode() + name.encode()
        folder = cache.mkdir("stand_in") if cache else tmp_path_factory.mktemp("stand_in")
        folder /= hashlib.sha256(text).hexdigest()[:16]
        if not folder.exists():
            stand_in.build(tmp_path_factory.mktemp("build"), name, interfaces).rename(folder)
        sys.path.append(str(folder))
        return folder

    return made


@pytest.fixture(scope="session", autouse=True)
def _kernels_in_the_cache():
    """Compiled once here: else the first nodes do it, for many seconds, and say so on stderr."""
    first_start.compile_together(first_start.everything())
