"""The motion that a run has come to, as arrays."""

import os
from collections.abc import Callable, Mapping
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..kernels import compiled
from ..kernels import state as flat
from ..kernels.arrays import Floats, Integers
from ..kernels.model import INSIDE
from ..scene.loader import Scene
from ..sensors.instrument import Samples, named
from ..terms import Terms
from ..theory import invariants
from ..values.wrench import Wrench
from .schedule import WrenchSchedule

if TYPE_CHECKING:
    from ..view.player import Player

COLUMNS = {  # of each array with several numbers in a row, for tables
    "position": "xyz",
    "orientation": "wxyz",
    "velocity": "xyz",
    "angular_velocity": "xyz",
    "momentum": "xyz",
    "angular_momentum": "xyz",
}
ENERGIES = ("kinetic_energy", "potential_energy")


@cache
def _reader() -> Callable[[Floats, Floats, int, Floats], None]:
    numbers = np.zeros(1)
    return compiled.ready(flat.read_motions, numbers, numbers, 1, numbers)


class States:
    """Flat states as arrays with any leading axes, the same to the bit as what Simulation.state says of each."""

    def __init__(self, states: Floats, models: Floats):
        """Of bodies with one model each, the last axis but one of ``states``; or of one body, with its model (m,).

        Where there are actuators, rows of ``states`` have what spins inside after the state itself.
        """
        states.flags.writeable = False
        self._rows, self._states, self._models = states, states[..., : flat.SIZE], models

    @cached_property
    def _motion(self) -> Floats:
        states, each = self._states.reshape(-1), self._each_model()
        models, motion = each.reshape(-1), np.empty((*self._states.shape[:-1], flat.MOTION_SIZE))
        count, width = (len(each), each.shape[1]) if each.ndim == 2 else (states.size // flat.SIZE, 0)
        read, numbers = _reader(), motion.reshape(-1)
        for first in range(0, states.size // flat.SIZE, max(count, 1)):
            block, rows = (slice(first * size, (first + count) * size) for size in (flat.SIZE, flat.MOTION_SIZE))
            read(states[block], models, width, numbers[rows])
        return _kept(motion)

    def _each_model(self) -> Floats:
        """The models; where something spins inside, what is read of them, one for each state."""
        if self._rows.shape[-1] == flat.SIZE:
            return self._models
        each = np.empty((*self._rows.shape[:-1], INSIDE.stop))
        each[:] = self._models[..., : INSIDE.stop]
        each[..., INSIDE] = self._rows[..., flat.SIZE :]
        return each.reshape(-1, INSIDE.stop)

    @property
    def motion(self) -> Floats:
        """All of what Simulation.motion says, shape (..., 19)."""
        return self._motion

    @property
    def position(self) -> Floats:
        """Position [m] of the body frame's origin, world axes, shape (..., 3)."""
        return self._motion[..., 0:3]

    @property
    def orientation(self) -> Floats:
        """Unit quaternion (w, x, y, z), body → world, shape (..., 4)."""
        return self._motion[..., 3:7]

    @property
    def velocity(self) -> Floats:
        """Velocity [m/s] of the body frame's origin, world axes, shape (..., 3)."""
        return self._motion[..., 7:10]

    @property
    def angular_velocity(self) -> Floats:
        """Angular velocity [rad/s], body axes, shape (..., 3)."""
        return self._motion[..., 16:19]

    @property
    def momentum(self) -> Floats:
        """Momentum P [kg m/s], world axes, shape (..., 3)."""
        return self._states[..., flat.P : flat.P + 3]

    @property
    def angular_momentum(self) -> Floats:
        """Angular momentum L [kg m²/s] about the centre of mass, world axes, shape (..., 3)."""
        return self._states[..., flat.L : flat.L + 3]


class Trajectory(States):
    """States of a body, from the one at which a run began to its last.

    All arrays have one row for each state, and are the same to the bit as what Simulation.state says at these steps.

    Attributes
    ----------
    steps : array of int, shape (n,)
        Steps of the simulation at which the states are, as Simulation.steps counts them.
    commands : WrenchSchedule or None
        What the run was given.
    stopped : str
        Why the run ended before its time: a sentence, empty where it did not.
    samples : mapping of str to Samples
        What each sensor measured on the way.
    """

    def __init__(self, terms: Terms, rate: float, steps: Integers, states: Floats):
        super().__init__(states, terms.model(Wrench()))
        self._terms, self.rate, self.steps = terms, rate, steps
        steps.flags.writeable = False
        self.commands: WrenchSchedule | None = None
        self.stopped = ""
        self.samples: Mapping[str, Samples] = {}

    def __len__(self) -> int:
        return len(self.steps)

    @property
    def time(self) -> Floats:
        """Simulated time [s], shape (n,)."""
        return self.steps / self.rate

    @cached_property
    def kinetic_energy(self) -> Floats:
        """Kinetic energy [J], shape (n,)."""
        return _kept(invariants.energy_of_motion(self._terms, self))

    @cached_property
    def potential_energy(self) -> Floats:
        """Potential energy [J] in gravity, constant forces, tethers and contacts, shape (n,); see theory.invariants."""
        return _kept(invariants.potential_energy(self._terms, self))

    def sense(self, name: str) -> Samples:
        """What a sensor measured at all its instants in the run, its beginning included, whatever states were kept.

        Each is taken as its step is reached, before what is commanded there: the bits of Simulation.sense. Raises
        ValueError where the run had no sensor of that name.
        """
        found: Samples = named(self.samples, name)
        return found

    def to_pandas(self) -> Any:
        """A DataFrame by time [s], with columns such as position.x and kinetic_energy. Needs pandas."""
        import pandas

        columns = {
            f"{name}.{letter}": getattr(self, name)[:, i]
            for name, letters in COLUMNS.items()
            for i, letter in enumerate(letters)
        }
        columns |= {name: getattr(self, name) for name in ENERGIES}
        return pandas.DataFrame(columns, index=pandas.Index(self.time, name="time"))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write all arrays by their names into a file of numpy's, ``numpy.load`` reads them.

        Raises ValueError for a name that does not end in .npz, and OSError where the file cannot be written.
        """
        path = Path(path)
        if path.suffix != ".npz":
            raise ValueError(f"{path} does not end in .npz, which is what a trajectory is saved as")
        arrays = {name: getattr(self, name) for name in ("time", "steps", *COLUMNS, *ENERGIES)}
        if self.commands is not None:
            arrays |= {"command_steps": self.commands.steps, "command_values": self.commands.values}
        np.savez(path, **arrays)

    def to_bag(
        self,
        folder: str | os.PathLike[str],
        *,
        namespace: str = "",
        world_frame_id: str = "world",
        body_frame_id: str = "base_link",
    ) -> None:
        """Write a bag of ROS 2 Jazzy (rosbag2, MCAP): what the node would publish, and the commands of the run.

        ``pose`` (PoseStamped, in the world's frame) and ``twist`` (TwistStamped, body axes) have a message for each
        state, stamped and received at its simulated time. Of a run under a schedule, ``wrench`` (WrenchStamped) has a
        message for each row that took effect, at the time of its step; where a row has a part in body axes and one in
        world axes, ``wrench`` has the former of every row and ``wrench_world`` the latter. Of a scene with these
        ``wrench.topics`` and ``wrench.timeout: 0.0``, because a row is held up to the next one, rigid_body_resim
        simulates the bag again to the bit where the run began at the scene's initial state, without a wrench held.

        Raises BagError (``rigid_body_sim.bags.rosbags_support``) where the folder exists already or cannot be made or
        written, for a time that no stamp holds, and without the extra ``bag``; ValueError for a name that is none.
        Nothing is left of a bag that is not whole.
        """
        from . import bag

        names = bag.Names(namespace, world_frame_id, body_frame_id)
        bag.write(folder, names, self.rate, self.steps, self._motion, self.commands)

    def plot(self) -> Any:
        """A matplotlib Figure of position, attitude, angular velocity and energy over time. Needs matplotlib."""
        from .plot import figure

        return figure(self)

    def view(self, scene: Scene | None = None, *, host: str = "127.0.0.1", port: int = 0) -> "Player":
        """Show the run on a page in the browser, with a time line; in a notebook, below the cell. Needs viser.

        The body looks as ``scene`` describes it, else as the even ellipsoid of its mass and inertia. The page is served
        in the background, on this machine alone unless ``host`` says otherwise, until ``close()`` or the program's end;
        ``url`` is its address, and port 0 is any that is free. ``save(path)`` writes a page that plays by itself.

        Raises ViewError (``rigid_body_sim.view.page``) without viser, and where nothing can listen there.
        """
        from ..view.moment import Recording
        from .shown import player, with_commands

        shown = Recording(self.time, self.position, self.orientation)
        if self.commands is not None:
            at = (self.commands.steps + self.steps[0]) / self.rate
            shown = with_commands(shown, at, self.commands.values, self._terms.body.center_of_mass)
        return player(shown, self._terms, scene, host, port)

    def __repr__(self) -> str:
        shape = f"{len(self)} states from {self.time[0]:g} s to {self.time[-1]:g} s at {self.rate:g} Hz"
        moved = np.ptp(self.position, axis=0).max()
        spin = np.linalg.norm(self.angular_velocity, axis=1).max()
        return (
            f"Trajectory({shape}: within {moved:.3g} m, at most {spin:.3g} rad/s, kinetic energy "
            f"{self.kinetic_energy[0]:.4g} to {self.kinetic_energy[-1]:.4g} J{', ' * bool(self.stopped)}{self.stopped})"
        )


def _kept(array: Floats) -> Floats:
    array.flags.writeable = False
    return array
