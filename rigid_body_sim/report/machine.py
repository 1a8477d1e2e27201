"""Where and with what a report was made."""

import importlib.metadata
import os
import platform
import sys
from collections.abc import Sequence
from datetime import datetime, timezone
from pathlib import Path

from ..kernels import compiled
from . import peers

PACKAGES = (
    "rigid_body_sim",
    "numpy",
    "numba",
    "matplotlib",
    "scipy",
    "jax",
    "diffrax",
    "heyoka",
    "mujoco",
    "drake",
    "bsk",
    "pin",
)


def facts(arguments: Sequence[str], seed: int) -> dict[str, str]:
    """Machine, versions, peers, date, seed and command line, by name."""
    versions = {name: version for name in PACKAGES if (version := _version(name))}
    return {
        "date": datetime.now(timezone.utc).strftime("%Y-%m-%d %H:%M UTC"),
        "machine": f"{_processor()}, {os.cpu_count()} cores, {platform.machine()}",
        "system": f"{platform.system()} {platform.release()}, Python {platform.python_version()}",
        "kernels": f"{compiled.sources_digest()}, {'compiled by numba' if compiled.ENABLED else 'as plain Python'}",
        "versions": ", ".join(f"{name} {version}" for name, version in versions.items()),
        "peers": peers.told(),
        "seed": str(seed),
        "command": " ".join(("rigid_body_report", *arguments)),
    }


def _version(name: str) -> str | None:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return None


def _processor() -> str:
    """The processor's name as Linux knows it, with its clock."""
    if sys.platform == "linux":
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or "unknown processor"
