"""The journal of a run: every call that decides the motion, with the step before which it took effect.

A bag holds it as the topic ``~/journal`` (std_msgs/msg/String, one JSON object a message). Its first entry is the
scene. Python writes a float with as many digits as read back to the bit, so a run can be repeated to the bit.
"""

import dataclasses
import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from .. import __version__
from ..effects import REGISTRY
from ..kernels import compiled
from ..rate import NANOSECONDS
from ..scene import attitude
from ..scene.loader import Scene
from ..simulation import Simulation, SimulationError
from ..values.body import Body
from ..values.state import BodyState, State
from ..values.wrench import Wrench
from .rosbags_support import BagError

TOPIC = "~/journal"  # of the node, so /ns/rigid_body_node/journal in the bag
TYPE = "std_msgs/msg/String"
SCENE = "scene"  # first entry
LOST = "lost"  # entries that could not be kept would stand here

# What mass, inertia and centre of mass may follow from: an entry has what follows, so that a bag is enough.
_SOURCES = (
    "body.shape",
    "body.dimensions",
    "body.density",
    "body.mesh_file",
    "body.mesh_scale",
    "body.urdf_file",
    "body.urdf_link",
)
Values = dict[str, Any]  # of JSON


class JournaledSimulation(Simulation):
    """A Simulation that tells ``journal(step, call, values)`` of each call that decides its motion, once it is done.

    ``step`` is the count of steps before the call, and ``values`` hold what never changes: ``text`` makes an entry of
    it, later and elsewhere. What is read from the simulation is not told, nor are steps, and ``restore`` is refused.
    """

    journal: Callable[[int, str, Values], None] | None = None

    def _tell(self, step: int, call: str, **values: Any) -> None:
        if self.journal is not None:
            self.journal(step, call, values)

    def set_wrench(self, wrench: Wrench, hold: float | None = None, source: str = "") -> None:
        """As Simulation.set_wrench."""
        super().set_wrench(wrench, hold, source)
        self._tell(self.steps, "set_wrench", wrench=wrench, hold=hold, source=source)

    def clear_wrench(self) -> None:
        """As Simulation.clear_wrench."""
        super().clear_wrench()
        self._tell(self.steps, "clear_wrench")

    def change(self, **terms: Any) -> None:
        """As Simulation.change."""
        super().change(**terms)
        self._tell(self.steps, "change", **terms)

    def apply_impulse(self, impulse: Wrench) -> None:
        """As Simulation.apply_impulse."""
        super().apply_impulse(impulse)
        self._tell(self.steps, "apply_impulse", impulse=impulse)

    def set_state(self, state: State) -> None:
        """As Simulation.set_state."""
        super().set_state(state)
        self._tell(self.steps, "set_state", state=state)

    def reset(self, state: State | None = None, *, keep_time: bool = False) -> None:
        """As Simulation.reset."""
        step = self.steps
        super().reset(state, keep_time=keep_time)
        self._tell(step, "reset", keep_time=keep_time, **({} if state is None else {"state": state}))

    def restart_time(self) -> None:
        """As Simulation.restart_time."""
        step = self.steps
        super().restart_time()
        self._tell(step, "restart_time")

    def restore(self, snapshot: Any) -> None:
        """Raises RuntimeError: a journal does not tell what led to a snapshot."""
        raise RuntimeError("a simulation that keeps a journal cannot be restored; restore one without")


# Texts ----------------------------------------------------------------------------------------------------------------


def scene_values(scene: Scene, epoch_ns: int) -> Values:
    """Values of the first entry, of a run whose step 0 has the stamp ``epoch_ns``."""
    kept = {name: value for name, value in scene.values.items() if name not in _SOURCES}
    return {
        "epoch_ns": epoch_ns,
        "version": __version__,
        "kernels": compiled.sources_digest(),
        "parameters": kept,
    }


def text(time_ns: int, step: int, call: str, values: Mapping[str, Any]) -> str:
    """The entry, logged at ``time_ns``, of a call told by a JournaledSimulation."""
    return json.dumps({"time_ns": time_ns, "step": step, "call": call, **values}, default=_plain, allow_nan=False)


def _plain(value: Any) -> Any:
    """What JSON knows in place of what it does not."""
    if isinstance(value, Wrench):
        points = {"points": value.points} if value.points else {}
        return {**{part: value.values[3 * i : 3 * i + 3] for i, part in enumerate(_PARTS)}, **points}
    if isinstance(value, State):
        return {name: getattr(value, name).tolist() for name in _STATE}
    if isinstance(value, Body):
        names = ("mass", "inertia", "center_of_mass")
        return {name: np.asarray(getattr(value, name)).tolist() for name in names}
    if dataclasses.is_dataclass(value) and not isinstance(value, type):  # as effects are
        return dataclasses.asdict(value)
    return np.asarray(value, float).tolist()


_PARTS = ("force_body", "torque_body", "force_world", "torque_world")
_STATE = ("position", "orientation", "velocity", "angular_velocity")


# Replay ---------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Entry:
    """A call: at which time [ns] it was logged, how many steps were done then, its name and its values, as in JSON.

    Times in one bag never repeat: whatever message has an earlier log time came before it, and the others after it.
    """

    time_ns: int
    step: int
    call: str
    values: Values


def read(texts: Iterable[str]) -> list[Entry]:
    """The entries in a bag's journal. Raises BagError with what is wrong about one."""
    return [_read(place, line) for place, line in enumerate(texts)]


def _read(place: int, line: str) -> Entry:
    try:
        values = json.loads(line)
        entry = Entry(_integer(values, "time_ns"), _integer(values, "step"), values.pop("call"), values)
        if entry.call not in (*_CALLS, SCENE, LOST):
            raise ValueError(f"call {entry.call!r} is not known to version {__version__}")
    except (AttributeError, KeyError, RecursionError, TypeError, ValueError) as reason:
        raise BagError(f"entry {place} of the journal is not as rigid_body_node writes it: {reason!r}") from None
    return entry


def _integer(values: Values, name: str) -> int:
    """Taken out of the values. Raises TypeError for what is none."""
    value = values.pop(name)
    if type(value) is not int:
        raise TypeError(f"{name} is no whole number")
    return value


@dataclass(frozen=True)
class Beginning:
    """The first entry: the scene (with the mass and inertia in use, no files needed), and what ran it.

    ``epoch_ns`` is the stamp of step 0. ``kernels`` is compiled.sources_digest() of the node that wrote it: with the
    same one the same bits follow.
    """

    scene: Scene
    epoch_ns: int
    version: str
    kernels: str


def beginning(entries: Iterable[Entry]) -> Beginning:
    """What a journal begins with. Raises BagError when that is no scene."""
    first = next(iter(entries), None)
    if first is None or first.call != SCENE:
        raise BagError("the journal does not begin with a scene; give a bag whose first file is there")
    values = dict(first.values)
    try:
        scene, epoch_ns = Scene(attitude.named(values["parameters"])), _integer(values, "epoch_ns")
        return Beginning(scene, epoch_ns, values["version"], values["kernels"])
    except (AttributeError, KeyError, TypeError, ValueError) as reason:
        raise BagError(f"the scene in the journal cannot be read by version {__version__}: {reason}") from None


def replay(
    entries: Iterable[Entry], simulation: Simulation, messages: Iterable[tuple[int, int]]
) -> Iterator[Simulation]:
    """Repeat a run: ``simulation`` (of the journal's scene, fresh) at each message, given as (log time, stamp) [ns].

    Messages come in the order of their log times. The simulation is yielded after the entries logged before the
    message and at the step that its stamp names; read ``motion`` before going on. Raises BagError when the journal has
    a hole, or does not fit the messages.
    """
    calls = iter(entries)
    epoch_ns = next(calls).values["epoch_ns"]
    rate = Fraction(simulation.rate)
    coming = next(calls, None)
    for log_ns, stamp_ns in messages:
        while coming is not None and coming.time_ns < log_ns:
            _repeat(coming, simulation)
            coming = next(calls, None)
        _go_to(simulation, round((stamp_ns - epoch_ns) * rate / NANOSECONDS), f"the message stamped {stamp_ns} ns")
        if epoch_ns + simulation.time_ns != stamp_ns:
            raise BagError(f"the message stamped {stamp_ns} ns belongs to no step of the journal's run")
        yield simulation


def _repeat(entry: Entry, simulation: Simulation) -> None:
    if entry.call == LOST:
        raise BagError(
            f"the journal has a hole after step {entry.step}, where the recorder's buffer was full; the run can be "
            "repeated up to there"
        )
    _go_to(simulation, entry.step, f"{entry.call} at step {entry.step}")
    try:
        _CALLS[entry.call](simulation, **entry.values)
    except (AttributeError, KeyError, TypeError, ValueError) as reason:
        told = f"{type(reason).__name__}: {reason}" if not isinstance(reason, ValueError) else reason
        raise BagError(f"{entry.call} at step {entry.step} of the journal cannot be repeated: {told}") from None


def _go_to(simulation: Simulation, step: int, what: str) -> None:
    if step < simulation.steps:
        raise BagError(f"{what} lies before step {simulation.steps}, which the journal had reached; they do not fit")
    try:
        simulation.step(step - simulation.steps)
    except SimulationError as reason:
        if simulation.steps != step:  # else the recorded run stopped here, too
            raise BagError(f"{what} cannot be reached: {reason}") from None


def _state(values: Values) -> State:
    """The very numbers: State would normalise the quaternion once more."""
    return BodyState(np.concatenate([values[name] for name in _STATE]))


def _change(simulation: Simulation, **terms: Any) -> None:
    if "body" in terms:
        terms["body"] = Body(**terms["body"])
    for name in REGISTRY.keys() & terms:
        terms[name] = REGISTRY[name].restored(terms[name])
    simulation.change(**terms)


_CALLS: dict[str, Callable[..., None]] = {
    "set_wrench": lambda simulation, wrench, hold, source: simulation.set_wrench(Wrench(**wrench), hold, source),
    "clear_wrench": Simulation.clear_wrench,
    "change": _change,
    "apply_impulse": lambda simulation, impulse: simulation.apply_impulse(Wrench(**impulse)),
    "set_state": lambda simulation, state: simulation.set_state(_state(state)),
    "reset": lambda simulation, keep_time, state=None: simulation.reset(
        None if state is None else _state(state), keep_time=keep_time
    ),
    "restart_time": Simulation.restart_time,
}
