"""Rigid-body simulation, exact between commands; usable with or without ROS 2."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .effects.drag import Drag
    from .effects.tether import Tether
    from .scene.loader import Scene, load_scene
    from .simulation import Simulation, SimulationError, Snapshot
    from .values.body import Body
    from .values.state import BodyState, State
    from .values.wrench import Wrench

__version__ = "0.1.0"

__all__ = [
    "Body",
    "BodyState",
    "Drag",
    "Scene",
    "Simulation",
    "SimulationError",
    "Snapshot",
    "State",
    "Tether",
    "Wrench",
    "load_scene",
]

_HOMES = {
    "Body": "values.body",
    "BodyState": "values.state",
    "Drag": "effects.drag",
    "Scene": "scene.loader",
    "Simulation": "simulation",
    "SimulationError": "simulation",
    "Snapshot": "simulation",
    "State": "values.state",
    "Tether": "effects.tether",
    "Wrench": "values.wrench",
    "load_scene": "scene.loader",
}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used (PEP 562): a program can handle signals before numba is imported."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f".{_HOMES[name]}", __name__), name)
