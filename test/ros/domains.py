"""Domains of ROS: programs in different ones do not hear each other."""

import os
import random
from pathlib import Path

FIRST_PORT, PORTS = 7400, 250  # of domain 0, and of each
USUAL = range(1, 101)
OWN = range(215, 233)  # above the ports that Linux hands out, where no other run of these tests is


def free_domain(among):
    """One of ``among`` on whose ports nobody on this machine listens; workers of one pytest never get the same."""
    worker = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
    workers = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
    taken = {(port - FIRST_PORT) // PORTS for port in _ports()}
    return random.choice([number for number in among if number % workers == worker and number not in taken])


def _ports():
    """UDP ports that somebody listens to."""
    lines = Path("/proc/net/udp").read_text().splitlines()[1:]
    return [int(line.split()[1].rpartition(":")[2], 16) for line in lines]
