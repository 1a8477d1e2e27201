"""A run as what the view shows."""

import numpy as np

from ..kernels.arrays import Floats
from ..scene.loader import Scene
from ..terms import Terms
from ..values import rotation
from ..view.look import of_terms, of_values
from ..view.moment import Recording, Wrenches
from ..view.player import Player

_BODY, _WORLD = slice(0, 6), slice(6, 12)  # of Wrench.values
_CONJUGATE = np.array((1.0, -1.0, -1.0, -1.0))


def player(recording: Recording, terms: Terms, scene: Scene | None, host: str, port: int) -> Player:
    """Do what Trajectory.view says."""
    look = of_terms(terms) if scene is None else of_values(scene.values)
    shown = Player({"body": recording}, {"body": look}, "Trajectory", host, port)
    shown.start()
    return shown


def with_commands(motion: Recording, time: Floats, values: Floats, center: Floats) -> Recording:
    """The same with commands at times [s], shape (n,), whose rows, shape (n, 12), are as Wrench.values.

    They become wrenches about the body frame's origin, at the attitudes that the body has when they take effect;
    ``center`` is the centre of mass [m], where forces in world axes act.
    """
    body, world = values[:, _BODY], values[:, _WORLD]
    at = np.clip(np.searchsorted(motion.time, time, side="right") - 1, 0, None)
    back = motion.orientation[at] * _CONJUGATE
    force, torque = (rotation.rotate_each(back, np.ascontiguousarray(part)) for part in (world[:, :3], world[:, 3:]))
    wrenches = Wrenches(time, body[:, :3] + force, body[:, 3:] + torque + np.cross(center, force))
    return motion._replace(wrenches=wrenches)
