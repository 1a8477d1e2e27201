"""Rigid-body simulation, exact between commands; usable with or without ROS 2."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # what type checkers see of _HOMES; a test compares the two
    from .actuation import ActuatorState as ActuatorState
    from .effects.actuators import Actuator as Actuator
    from .effects.added_mass import AddedMass as AddedMass
    from .effects.drag import Drag as Drag
    from .effects.fluid import Fluid as Fluid
    from .effects.ground import Contact as Contact
    from .effects.ground import Ground as Ground
    from .effects.link import Link as Link
    from .effects.tether import Tether as Tether
    from .ensemble import Ensemble as Ensemble
    from .fleet import Fleet as Fleet
    from .runs.schedule import WrenchSchedule as WrenchSchedule
    from .runs.trajectories import Trajectories as Trajectories
    from .runs.trajectory import Trajectory as Trajectory
    from .scene.fleet import FleetScene as FleetScene
    from .scene.fleet import load_fleet as load_fleet
    from .scene.loader import Scene as Scene
    from .scene.loader import load_scene as load_scene
    from .sensors.barometer import Barometer as Barometer
    from .sensors.base import Noise as Noise
    from .sensors.gnss import Gnss as Gnss
    from .sensors.imu import Imu as Imu
    from .sensors.instrument import Samples as Samples
    from .sensors.magnetometer import Magnetometer as Magnetometer
    from .sensors.pose import PoseSensor as PoseSensor
    from .sensors.range_finder import RangeFinder as RangeFinder
    from .simulation import Simulation as Simulation
    from .simulation import SimulationError as SimulationError
    from .snapshot import Snapshot as Snapshot
    from .values.body import Body as Body
    from .values.state import BodyState as BodyState
    from .values.state import State as State
    from .values.wrench import Wrench as Wrench
    from .values.wrenches import Wrenches as Wrenches

__version__ = "0.1.0"

_HOMES = {  # of each public name
    "Actuator": "effects.actuators",
    "ActuatorState": "actuation",
    "AddedMass": "effects.added_mass",
    "Barometer": "sensors.barometer",
    "Body": "values.body",
    "BodyState": "values.state",
    "Contact": "effects.ground",
    "Drag": "effects.drag",
    "Ensemble": "ensemble",
    "Fleet": "fleet",
    "FleetScene": "scene.fleet",
    "Fluid": "effects.fluid",
    "Gnss": "sensors.gnss",
    "Ground": "effects.ground",
    "Imu": "sensors.imu",
    "Link": "effects.link",
    "Magnetometer": "sensors.magnetometer",
    "Noise": "sensors.base",
    "PoseSensor": "sensors.pose",
    "RangeFinder": "sensors.range_finder",
    "Samples": "sensors.instrument",
    "Scene": "scene.loader",
    "Simulation": "simulation",
    "SimulationError": "simulation",
    "Snapshot": "snapshot",
    "State": "values.state",
    "Tether": "effects.tether",
    "Trajectories": "runs.trajectories",
    "Trajectory": "runs.trajectory",
    "Wrench": "values.wrench",
    "WrenchSchedule": "runs.schedule",
    "Wrenches": "values.wrenches",
    "load_fleet": "scene.fleet",
    "load_scene": "scene.loader",
}
__all__ = [*_HOMES]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used (PEP 562): a program can handle signals before numba is imported."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f".{_HOMES[name]}", __name__), name)
