"""The commands of a bag by steps: what is held from which step on when the bag is simulated again."""

import logging
import os
from collections.abc import Callable, Sequence
from pathlib import Path

from .. import integrators
from ..bags import journal as journals
from ..bags.reading import Bag, read
from ..bags.rosbags_support import BagError
from ..held import Held, steps_held
from ..scene.fleet import FleetScene, load_any
from ..scene.loader import Scene
from ..values.wrench import Wrench
from . import several
from .command_feed import CommandFeed
from .scenario import Choices, Scenario, prepare, scene_of

_INSTEAD = (
    "simulate the bag with rigid_body_resim, or give it to a Simulation.from_scene(scene) when that is at this step"
)
_NO_WRENCH = {  # calls in a journal that a schedule does not hold, in words
    "set_actuators": "a command to actuators",
    "apply_impulse": "an impulse",
    "set_state": "a state that was set",
    "change": "a change of parameters",
    "reset": "a reset",
    "restart_time": "a reset of the time",
}
_log = logging.getLogger("rigid_body_sim")

Rows = tuple[list[int], list[Wrench]]  # rising steps, and what is held from each on


def of_bag(
    path: str | os.PathLike[str],
    scene: Scene | str | os.PathLike[str] | None,
    choices: Choices,
    recover: bool,
    body: str | None = None,
) -> Rows:
    """What WrenchSchedule.from_bag says, as rows. How the bag was understood is logged."""
    bag = read(path, recover=recover)
    bag, scene = several.chosen(bag, _scene_in(bag, scene), body)
    if bag.journal:
        _check_journal(bag, scene, choices)
    scenario = prepare(bag, scene, choices)
    for sentence in scenario.notes:
        _log.info("%s: %s", bag.path, sentence)
    rows, left_out = of_scenario(scenario, scene, bag.path)
    if scenario.waits(scene) and rows[0] and rows[0][0]:
        told = f"until its first command, at step {rows[0][0]}, the body stayed where it was (start_on_command)"
        _log.warning("%s: %s; a whole run moves it from the first step on", bag.path, told)
    if left_out:
        _log.warning("%s: %s", bag.path, left_out)
    return rows


def of_scenario(scenario: Scenario, scene: Scene, path: Path | str = "the bag") -> tuple[Rows, str]:
    """The same of a bag that is understood already, and what is left out; ``path`` is for the sentences."""
    noted, left_out = _Noted(path, scene), ""
    if scenario.journal:
        _follow_journal(path, scenario, scene, noted)
    else:
        left_out = _follow_commands(scenario, scene, noted)
    steps = [step for step in noted.rows if step < noted.steps]  # the last step that is taken begins before the end
    return (steps, [noted.rows[step] for step in steps]), left_out


def _scene_in(bag: Bag, given: Scene | str | os.PathLike[str] | None) -> Scene | FleetScene:
    if given is None and (recorded := scene_of(bag)):
        return recorded
    if given is None:
        _log.warning("%s: has no journal with a scene, and none is given: the node's defaults are taken", bag.path)
        return Scene()
    if isinstance(given, Scene):
        return given
    try:
        return load_any(given)
    except OSError as reason:
        raise ValueError(
            f"scene {os.fspath(given)}: cannot be read ({reason.strerror}); give a parameter file of the node"
        ) from None


def _check_journal(bag: Bag, scene: Scene, choices: Choices) -> None:
    if choices.topics or choices.times or choices.start:
        raise BagError(
            f"{bag.path}: has a journal, which tells what each command did and when; leave topics, times and start out"
        )
    recorded = journals.beginning(journals.read(bag.journal)).scene["rate"]
    if scene["rate"] != recorded:
        raise BagError(
            f"{bag.path}: the steps of its journal are those of {recorded:g} Hz, but the scene has {scene['rate']:g} "
            "Hz; give a scene with the rate of the journal"
        )


class _Noted:
    """What is held, without a body: ``rows`` are the wrenches by the step from which on each is, ``steps`` is now."""

    def __init__(self, path: Path | str, scene: Scene):
        name = scene["integrator.name"]
        self._asked = None if name == integrators.AUTO else integrators.get(name)
        self._path, self._rate = path, scene["rate"]
        self._held = Held()
        self.steps = 0
        self.rows: dict[int, Wrench] = {}

    def set_wrench(self, wrench: Wrench, hold: float | None, source: str) -> None:
        """As Simulation.set_wrench. Raises BagError for forces at points."""
        if wrench.points:
            raise BagError(
                f"{self._path}: the command on {source} for {self._now} is a force at a point, which keeps its "
                f"direction while the point turns with the body; a schedule takes none: {_INSTEAD}"
            )
        end = None if hold is None else self.steps + steps_held(hold, self._rate)
        held, is_only = self._held.having(source, wrench, end), self._held.sources.keys() == {source}
        # The only source's is held as it is, as a simulation does; a sum makes 0.0 of -0.0.
        self._hold(held, wrench if is_only else held.total)

    def set_actuators(self, commands: Sequence[float], hold: float | None) -> None:
        """Raises BagError."""
        raise BagError(
            f"{self._path}: for {self._now} it has a command to actuators, which a schedule does not hold: {_INSTEAD}"
        )

    def clear_wrench(self) -> None:
        """Hold no wrench, from no source."""
        self._hold(Held(), Wrench())

    def advance(self, step: int) -> None:
        """Go to a step. Raises BagError when what is left where a time runs out on the way cannot be held."""
        while (end := self._held.end) is not None and end <= step:
            self.steps, left = end, self._held.left_at(end)
            try:
                self._hold(left, left.total)
            except ValueError as reason:
                raise BagError(
                    f"{self._path}: at {self._now} the time of one of several wrenches has run out, and {reason}"
                ) from None
        self.steps = step

    def _hold(self, held: Held, total: Wrench) -> None:
        if self._asked is not None and (refusal := self._asked.refusal(total)):
            raise ValueError(refusal)
        self._held, self.rows[self.steps] = held, total

    @property
    def _now(self) -> str:
        return f"step {self.steps} ({self.steps / self._rate:.9g} s)"


def _follow_commands(scenario: Scenario, scene: Scene, noted: _Noted) -> str:
    """Note what is held, up to the last pose; returns what is left out, in words."""
    feed = CommandFeed(scenario, scene, noted, noted.advance, lambda time: None)
    feed.give_all()
    if not feed.refused:
        return ""
    what = "1 command is" if feed.refused == 1 else f"{feed.refused} commands are"
    return f"{what} left out, as the node does; the first: {feed.reason}"


_CALLS: dict[str, Callable[..., None]] = {
    "set_wrench": lambda noted, wrench, hold, source: noted.set_wrench(Wrench(**wrench), hold, source),
    "clear_wrench": _Noted.clear_wrench,
}


def _follow_journal(path: Path | str, scenario: Scenario, scene: Scene, noted: _Noted) -> None:
    """Note what the node held, up to the last pose. Raises BagError for whatever else it did."""
    _, *calls = scenario.journal
    end_ns = int(scenario.receive_ns.max())
    for entry in calls:
        if entry.time_ns >= end_ns:
            break
        if entry.call == journals.LOST:
            raise journals.hole(entry)
        where = f"step {entry.step} of the journal"
        if entry.call not in _CALLS:
            what = _NO_WRENCH[entry.call]
            raise BagError(f"{path}: at {where} is {what}, which a schedule does not hold: {_INSTEAD}")
        if entry.step < noted.steps:
            raise BagError(f"{path}: {entry.call} at {where} lies before step {noted.steps}, which it had reached")
        noted.advance(entry.step)
        try:
            _CALLS[entry.call](noted, **entry.values)
        except (AttributeError, KeyError, TypeError, ValueError) as reason:
            told = f"{type(reason).__name__}: {reason}" if not isinstance(reason, ValueError) else reason
            raise BagError(f"{path}: {entry.call} at {where} cannot be repeated: {told}") from None
    noted.advance(scenario.last_step(scene["rate"]))
