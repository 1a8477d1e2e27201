"""Read trajectories.json, the reference solutions made by make_reference.py, as floats and numpy arrays."""

import json
import pathlib

import numpy as np

FILE = pathlib.Path(__file__).with_name("trajectories.json")


def names():
    """Return the names of the problems in the file."""
    return sorted(json.loads(FILE.read_text(encoding="utf-8"))["problems"])


def load(name):
    """
    Return one problem as a dictionary with the layout of the file; units are SI.

    Numbers are floats, vectors are arrays. body: mass, inertia (ixx, iyy, izz, ixy, ixz, iyz; about the centre of mass,
    body axes), center_of_mass (from the body frame's origin, body axes). initial and samples: position and velocity of
    the body frame's origin [world], orientation (w, x, y, z; body to world), angular_velocity [body]; samples also
    momentum and angular_momentum (about the centre of mass) [world]. wrenches: held until `until`; force_body acts at
    the body frame's origin, force_world at the centre of mass; points has the shape (number, 2, 3): the point from the
    body frame's origin [body] and the force [world]. The initial orientation has a norm of one to round-off; the
    reference divides by it.
    """
    problem = json.loads(FILE.read_text(encoding="utf-8"))["problems"][name]
    loaded = {"about": problem.pop("about"), **_numbers(problem)}
    for held in loaded["wrenches"]:
        held["points"] = held["points"].reshape(-1, 2, 3)
    return loaded


def _numbers(value):
    """Turn strings into floats and lists of them into arrays, at every level."""
    if isinstance(value, dict):
        return {key: _numbers(item) for key, item in value.items()}
    if isinstance(value, list) and value and isinstance(value[0], dict):
        return [_numbers(item) for item in value]
    return np.array(value, dtype=float) if isinstance(value, list) else float(value)
