"""Other simulators and libraries on the same problems: a file each, which imports its package only when it is used.

A peer is a module with ``PACKAGE`` (what pip installs, and the extra ``peers``) and ``methods()``, which returns
report.method.Method objects and raises ImportError when the package is missing. Each is driven as its users would, in
its compiled form where it has one, with the wrench evaluated at the stages where that is possible.
"""

import importlib

from ..method import Method

PEERS = ("jax", "diffrax", "scipy", "mujoco", "drake", "basilisk", "pinocchio")


def methods(peer: str) -> list[Method]:
    """The methods of a peer. Raises ValueError for a name not in PEERS, and whatever its import raises."""
    if peer not in PEERS:
        raise ValueError(f"peer {peer!r} is not known; choose one of {', '.join(PEERS)}")
    return importlib.import_module(f".{peer}_peer", __package__).methods()


def package_of(peer: str) -> str:
    """What pip has to install for a peer."""
    return importlib.import_module(f".{peer}_peer", __package__).PACKAGE
