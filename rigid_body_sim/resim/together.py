"""Many runs of one bag at once, where its commands are the same wrenches in all: as the bodies of an Ensemble."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..bags.rosbags_support import BagError
from ..effects import REGISTRY as EFFECTS
from ..ensemble import Ensemble
from ..kernels.arrays import Floats
from ..runs.schedule import WrenchSchedule
from ..scenarios import command_rows, timing
from ..scenarios.scenario import Scenario
from ..scene.loader import Scene
from . import resimulating

OF_A_BODY = ("body.", "initial.", "gravity", *(f"{name}." for name in EFFECTS))  # names of what changes no command
KEPT_AT_ONCE = 2048  # states of each body
MOST, MOST_BYTES = 64, 1 << 26  # runs at once, and bytes of their poses


@dataclass(frozen=True)
class Outcome:
    """Of one run: poses (m, 7) at the stamps of the scenario and the hash of its last state, or why it has none."""

    poses: Floats
    state: str
    refusal: str = ""


def run(scenario: Scenario, scenes: Sequence[Scene]) -> list[Outcome] | None:
    """The runs of these scenes, with the bits of resimulating.run, under the commands as the first one takes them.

    None where they cannot be done together: a journal that has more than commands, forces at points, a body that waits
    for its first command, a scene that cannot be simulated, rates or integrators that differ.
    """
    if any(map(scenario.waits, scenes)):
        return None
    try:
        commands = _commands(scenario, scenes[0])
        ensemble = Ensemble.from_scenes(scenes)
        if scenario.start is not None:
            ensemble.set_state(*np.split(scenario.start.values[:13], (3, 7, 10)))
        return _Run(scenario, ensemble, commands).outcomes()
    except (BagError, ValueError):
        return None


def most(scenario: Scenario) -> int:
    """How many runs to do at once: whole blocks of eight."""
    return max(8, min(MOST, MOST_BYTES // (7 * 8 * len(scenario.stamp_ns)) // 8 * 8))


_latest: tuple[Scenario, dict[str, object], WrenchSchedule] | None = None


def _commands(scenario: Scenario, scene: Scene) -> WrenchSchedule:
    """What is held when: the same as the last time, where nothing that it depends on has changed."""
    global _latest
    about = {name: value for name, value in scene.values.items() if not name.startswith(OF_A_BODY)}
    if _latest is None or _latest[0] is not scenario or _latest[1] != about:
        rows, _ = command_rows.of_scenario(scenario, scene)
        _latest = scenario, about, WrenchSchedule.of(*rows)
    return _latest[2]


class _Run:
    """An ensemble that is taken through the samples of a scenario, a piece of them at a time."""

    def __init__(self, scenario: Scenario, ensemble: Ensemble, commands: WrenchSchedule):
        self._ensemble, self._commands = ensemble, commands
        self._steps = np.array(timing.nearest_steps(scenario.stamp_ns - scenario.epoch_ns, ensemble.rate))
        self._every = max(1, math.gcd(*self._steps.tolist()))
        self._poses = np.empty((len(ensemble), len(self._steps), 7))

    def outcomes(self) -> list[Outcome]:
        """Simulate up to the last sample."""
        first, end = 0, int(self._steps[-1])
        while True:
            until = min(end, first + KEPT_AT_ONCE * self._every)
            self._advance(first, until)
            if until == end:
                break
            first = until
        states = [self._ensemble.simulation(i) for i in range(len(self._ensemble))]
        return [
            Outcome(self._poses[i], resimulating.state_hash(single), self._ensemble.stopped.get(i, ""))
            for i, single in enumerate(states)
        ]

    def _advance(self, first: int, until: int) -> None:
        """From one step to another, keeping the poses at the samples on the way."""
        rows = slice(*np.searchsorted(self._commands.steps, (first, until)))
        values = np.split(self._commands.values[rows], 4, axis=1)
        part = WrenchSchedule(self._commands.steps[rows] - first, *values)
        found = self._ensemble.run(steps=until - first, every=self._every, commands=part, progress=False)
        mine = slice(*np.searchsorted(self._steps, (first, until + 1)))
        places = (self._steps[mine] - first) // self._every
        poses = np.concatenate((found.position, found.orientation), axis=2)
        self._poses[:, mine] = poses[places].transpose(1, 0, 2)
