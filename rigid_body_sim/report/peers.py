"""Other simulators and libraries on the same problems: where their adapters are looked for, and which are there.

An adapter is a module that imports its peer only when it is used, with

- ``MODULE``: what it imports, and ``PACKAGE``: what pip has to install for that,
- ``methods()``: a list of method.Method, or ImportError when the peer is missing;
- ``batch_methods()``, if it advances many bodies at once: a list of batch.BatchMethod, or ImportError.

Those of KNOWN are in bench/peers of the repository: they are found when this package is used from a checkout. Other
distributions name theirs in the entry-point group GROUP, as ``name = module``.
"""

import functools
import importlib
import importlib.util
import sys
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from types import ModuleType
from typing import Any

from .batch import BatchMethod
from .method import Method

KNOWN = ("jax", "diffrax", "heyoka", "scipy", "mujoco", "drake", "basilisk", "pinocchio")
GROUP = "rigid_body_sim.peers"
CHECKOUT = Path(__file__).parents[2]
ELSEWHERE = "adapter in bench/peers of the repository: run the report of a checkout"


def names() -> tuple[str, ...]:
    """The peers that can be asked for."""
    return tuple(_modules())


def methods(peer: str) -> list[Method]:
    """The methods of a peer.

    Raises ValueError for a name not in names(), ImportError that says what is missing, and whatever its import raises.
    """
    adapter = _adapter(peer)
    found: list[Method] = _of(adapter, adapter.methods)
    return found


def batch_methods(peer: str) -> list[BatchMethod]:
    """The methods of a peer for many bodies at once, none if it has none. Raises as ``methods`` does."""
    adapter = _adapter(peer)
    found: list[BatchMethod] = _of(adapter, getattr(adapter, "batch_methods", list))
    return found


def _of(adapter: ModuleType, methods: Callable[[], Any]) -> Any:
    try:
        return methods()
    except ImportError as reason:
        raise ImportError(f"{reason}; pip install {adapter.PACKAGE}") from reason


def told() -> str:
    """Which peers are there, and why the others are not, without importing one."""
    by_reason: dict[str, list[str]] = {}
    for peer in names():
        by_reason.setdefault(_absence(peer), []).append(peer)
    found = ", ".join(by_reason.pop("", ["none"]))
    missing = (f"{', '.join(peers)} ({why})" for why, peers in by_reason.items())
    return "; ".join([f"found: {found}", *([f"not found: {', '.join(missing)}"] if by_reason else [])])


def _absence(peer: str) -> str:
    """Why a peer is not there, "" when it is."""
    try:
        adapter = _adapter(peer)
        return "" if importlib.util.find_spec(adapter.MODULE) else f"pip install {adapter.PACKAGE}"
    except Exception as reason:  # whatever the module of another distribution lacks, or raises on import
        return str(reason) or type(reason).__name__


def _adapter(peer: str) -> ModuleType:
    modules = _modules()
    if peer not in modules:
        raise ValueError(f"peer {peer!r} is not known; choose one of {', '.join(modules)}")
    if not modules[peer]:
        raise ImportError(ELSEWHERE)
    return importlib.import_module(modules[peer])


@functools.cache
def _modules() -> dict[str, str]:
    """The module of every peer's adapter, "" where it is not here."""
    here = (CHECKOUT / "bench/peers").is_dir()
    if here and str(CHECKOUT) not in sys.path:
        sys.path.insert(0, str(CHECKOUT))  # for rigid_body_report, which may be run in any folder
    found = {peer: f"bench.peers.{peer}_peer" if here else "" for peer in KNOWN}
    return found | {point.name: point.value for point in metadata.entry_points(group=GROUP)}
