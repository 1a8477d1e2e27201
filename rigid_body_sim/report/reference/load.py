"""Read reference solutions, made by the programs in bench/reference, as floats and numpy arrays."""

import json
from importlib import resources
from typing import Any

import numpy as np

TRAJECTORIES, REPORT = "trajectories.json", "report.json"


def stored(file: str) -> dict[str, Any]:
    """All that a file in this folder holds; its numbers are decimal strings of 35 digits."""
    return json.loads(resources.files(__package__).joinpath(file).read_text(encoding="utf-8"))


def names(file: str = TRAJECTORIES) -> list[str]:
    """The names of the problems in a file, sorted."""
    return sorted(stored(file)["problems"])


def load(name: str, file: str = TRAJECTORIES) -> dict[str, Any]:
    """One problem as a dictionary with the layout of the file; units are SI.

    Numbers are floats, vectors are arrays. body: mass, inertia (ixx, iyy, izz, ixy, ixz, iyz; about the centre of mass,
    body axes), center_of_mass (from the body frame's origin, body axes). initial and samples: position and velocity of
    the body frame's origin [world], orientation (w, x, y, z; body to world), angular_velocity [body]; samples also
    momentum and angular_momentum (about the centre of mass) [world]. wrenches: held until `until`; force_body acts at
    the body frame's origin, force_world at the centre of mass; points has the shape (number, 2, 3): the point from the
    body frame's origin [body] and the force [world]. drag, where there is any: as in effects.drag.Drag. The
    initial orientation has a norm of one to round-off; the reference divides by it.
    """
    return as_numbers(stored(file)["problems"][name])


def as_numbers(problem: dict[str, Any]) -> dict[str, Any]:
    """A problem of a file with floats and arrays."""
    loaded = {key: value if key == "about" else _numbers(value) for key, value in problem.items()}
    for held in loaded["wrenches"]:
        held["points"] = held["points"].reshape(-1, 2, 3)
    return loaded


def _numbers(value: Any) -> Any:
    """Turn strings into floats and lists of them into arrays, at every level."""
    if isinstance(value, dict):
        return {key: _numbers(item) for key, item in value.items()}
    if isinstance(value, list) and value and isinstance(value[0], dict):
        return [_numbers(item) for item in value]
    return np.array(value, dtype=float) if isinstance(value, list) else float(value)
