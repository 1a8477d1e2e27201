"""Many rigid bodies advanced in one call, each as a Simulation would advance it by itself. No ROS."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import actuation, integrators, many_bodies, sentences
from .groups import Group, Groups
from .integrators import Integrator, many
from .integrators.script import COMMAND_SIZE, NOTHING, Script
from .kernels import compiled
from .kernels.acceleration import acceleration_reader
from .kernels.arrays import Floats, Integers, Vector, zeros_on_a_line
from .kernels.model import INSIDE, MEMORY, WRENCH
from .many_bodies import Bodies
from .rate import Rate, Timed
from .runs import running
from .runs.schedule import WrenchSchedule
from .runs.trajectories import Trajectories
from .runs.trajectory import States
from .scene.loader import Scene
from .sensors.base import NOT_READ, Seen, Sensor
from .sensors.instrument import Instrument, Record, instruments, named
from .simulation import Simulation, SimulationError
from .snapshot import Snapshot
from .stepping import asked_for
from .terms import DEFAULT_RTOL
from .values.wrench import ZERO, Wrench
from .values.wrenches import Wrenches

Controller = Callable[[States, float], Wrenches | Wrench | None]

_WORTH_SORTING = 32  # steps in a call, from which on bodies that turn alike are put side by side
_WORTH_A_THREAD = 4000  # steps of bodies in a call: what less takes is less than to wake threads
_AT_REST = {"position": ZERO, "orientation": (1.0, 0.0, 0.0, 0.0), "velocity": ZERO, "angular_velocity": ZERO}
_SHAPES = {name: ((len(one),),) for name, one in _AT_REST.items()}


class Ensemble(Timed):
    """n rigid bodies with a wrench each, and time as a count of steps that they share.

    What becomes of a body does not depend on the others: its numbers are the same bits as those of a Simulation of it
    alone. A body whose step cannot be done stops there, and the others go on; see ``stopped``.

    Parameters
    ----------
    mass : array_like, shape (n,) or ()
    inertia : array_like, shape (n, 3), (n, 6), (n, 3, 3), or without the leading axis
    center_of_mass : array_like, shape (n, 3) or (3,)
        As Body takes them, a row for each body, or one for all; an inertia of shape (3, 3) is one matrix for all.
    n : int
        Number of bodies, where no array has a row for each.
    position, velocity, angular_velocity : array_like, shape (n, 3) or (3,)
    orientation : array_like, shape (n, 4) or (4,)
        Initial states, as State takes them.
    rate, gravity, integrator, rtol, **effects
        The same for all, as Simulation takes them.
    sensors : sequence of Sensor
        What each body has; to the seed of each is added the number of the body, so that all have noise of their own.
    threads : int
        How many share the bodies in a call, among the cores of the machine.

    Raises
    ------
    ValueError
        Shapes that do not fit, and what Body, State and Simulation raise, with the number of the body.
    """

    def __init__(
        self,
        mass: ArrayLike,
        inertia: ArrayLike,
        center_of_mass: ArrayLike = ZERO,
        *,
        n: int | None = None,
        position: ArrayLike = ZERO,
        orientation: ArrayLike = (1.0, 0.0, 0.0, 0.0),
        velocity: ArrayLike = ZERO,
        angular_velocity: ArrayLike = ZERO,
        rate: float = 1000.0,
        gravity: Vector = ZERO,
        integrator: str = integrators.AUTO,
        rtol: float = DEFAULT_RTOL,
        threads: int = 1,
        sensors: Sequence[Sensor] = (),
        **effects: Any,
    ):
        n = many_bodies.count(
            n if n is None else running.positive("n", n),
            mass=(mass, ((),)),
            inertia=(inertia, ((3,), (6,), (3, 3))),
            center_of_mass=(center_of_mass, ((3,),)),
            position=(position, _SHAPES["position"]),
            orientation=(orientation, _SHAPES["orientation"]),
            velocity=(velocity, _SHAPES["velocity"]),
            angular_velocity=(angular_velocity, _SHAPES["angular_velocity"]),
        )
        h = Rate(rate).h
        bodies = many_bodies.make(n, mass, inertia, center_of_mass, h, gravity=gravity, rtol=rtol, **effects)
        states = many_bodies.flat_states(n, bodies.models, position, orientation, velocity, angular_velocity)
        made = [one.sensor for one in instruments(sensors, rate).values()]
        each = [[replace(one, seed=one.seed + i) for one in made] for i in range(n)] if made else []
        self._begin(bodies, states, each, rate, integrator, threads)

    @classmethod
    def from_scenes(cls, scenes: Sequence[Scene], threads: int = 1) -> "Ensemble":
        """One body for each scene, at its initial state. Raises ValueError where rates or integrators differ."""
        if not scenes:
            raise ValueError("an ensemble has at least one body; give at least one scene")
        for name in ("rate", "integrator.name"):
            if len({scene[name] for scene in scenes}) != 1:
                raise ValueError(
                    f"scenes of an ensemble have one {name} for all, not {sorted({s[name] for s in scenes})}"
                )
        sensors = [scene.sensors() for scene in scenes]
        if len({tuple((one.name, one.type, one.rate) for one in each) for each in sensors}) != 1:
            raise ValueError("scenes of an ensemble have the same sensors, of the same types and rates")
        made = cls.__new__(cls)
        bodies = many_bodies.of_terms([scene.terms() for scene in scenes], 1.0 / scenes[0]["rate"])
        starts = np.array([scene.initial_state().values[:13] for scene in scenes])
        states = many_bodies.flat_states(len(scenes), bodies.models, *np.split(starts, (3, 7, 10), axis=1))
        made._begin(
            bodies, states, sensors if sensors[0] else [], scenes[0]["rate"], scenes[0]["integrator.name"], threads
        )
        return made

    def _begin(
        self,
        bodies: Bodies,
        states: Floats,
        sensors: Sequence[Sequence[Sensor]],
        rate: float,
        integrator: str,
        threads: int,
    ) -> None:
        self._bodies, self._states, self._initial = bodies, states, states.copy()
        self._rate, self.threads = Rate(rate), running.positive("threads", threads)
        self.steps = 0
        self._sensors = sensors  # of each body, or empty
        self._at_work: list[dict[str, Instrument]] = []
        self._actuated = bodies.actuated
        self._groups = Groups(bodies, asked_for(integrator), self._rate.h)
        self._groups.measure(states, np.arange(len(states)))
        self.stopped: dict[int, str] = {}
        self._origins, self._origin_steps = states.copy(), np.zeros(len(states), np.int64)
        self._pool: ThreadPoolExecutor | None = None
        self._scratch: dict[tuple[str, int], tuple[Floats, Floats]] = {}
        numbers = np.zeros(1)
        whole = np.zeros(1, np.int64)
        self._write = compiled.ready(many.write_wrenches, numbers, 1, whole, numbers, whole)
        self._write_wrenches(np.arange(len(states)), np.zeros((len(states), 12)))

    def __len__(self) -> int:
        return len(self._states)

    def __repr__(self) -> str:
        told = f", {len(self.stopped)} stopped" if self.stopped else ""
        return f"Ensemble({len(self)} bodies at {self.time:g} s, {self.rate:g} Hz{told})"

    def __getstate__(self) -> dict[str, Any]:
        """For pickle and copy: what decides how it goes on. Kernels and threads are made anew."""
        kept = ("_states", "_initial", "_origins", "_origin_steps", "steps", "stopped")
        name = integrators.AUTO if self._groups.asked is None else self._groups.asked.name
        made = self._bodies.terms, self._sensors, self.rate, name, self.threads
        models = self._bodies.models if len(self._bodies.start) else None
        held = self._wrenches.copy(), self._groups.stiffness, models
        return {"made": made, "held": held, "kept": {name: getattr(self, name) for name in kept}}

    def __setstate__(self, state: dict[str, Any]) -> None:
        (terms, *made), (wrenches, stiffness, models) = state["made"], state["held"]
        bodies = many_bodies.of_terms(terms, Rate(made[1]).h)
        if models is not None:
            bodies.models[:] = models
        self._begin(bodies, state["kept"]["_states"].copy(), *made)
        self._groups.stiffness[:] = stiffness
        self._write_wrenches(np.arange(len(terms)), wrenches)
        self._groups.find()
        for name, value in state["kept"].items():
            setattr(self, name, value)

    @property
    def state(self) -> States:
        """A copy of all states: position, orientation and so on, arrays with a row for each body."""
        return States(self._states.copy(), self._bodies.models)

    @property
    def integrators(self) -> list[str]:
        """Of each body, the name of the integrator that advances it now."""
        return self._groups.names

    @property
    def _wrenches(self) -> Floats:
        return self._bodies.models[:, WRENCH : WRENCH + 12]

    def wrench(self, i: int) -> Wrench:
        """The wrench that a body holds."""
        return _wrench(self._wrenches[i])

    def set_wrench(self, wrenches: Wrenches | Wrench) -> None:
        """Hold a wrench for each body, or one for all, from now on.

        Raises ValueError, and changes nothing, for another number of rows, forces at points, and a wrench that the
        integrator cannot be given, with the number of the body.
        """
        if isinstance(wrenches, Wrench):
            wrenches = Wrenches.of(wrenches)
        if not isinstance(wrenches, Wrenches):
            raise TypeError(f"{wrenches!r}: give Wrenches, with a row for each body, or a Wrench for all")
        values = wrenches.for_bodies(len(self))
        self._groups.check(values)
        self._write_wrenches(np.arange(len(self)), values)

    def set_actuators(self, commands: ArrayLike) -> None:
        """Command the actuators of all bodies: a row of numbers for each, or one for all; see Simulation.set_actuators.

        Raises ValueError, and changes nothing, for another number of rows or of numbers, and, with its row, for one
        that is not finite.
        """
        bodies = self._bodies
        if commands is None:
            raise ValueError("commands are None; give a row of numbers for each body, or one for all")
        counts = {len(one.given["actuators"]) for one in bodies.terms}
        if len(counts) > 1:
            raise ValueError(
                f"bodies have different numbers of actuators, {sorted(counts)}: they take no commands in rows"
            )
        (count,) = counts
        many_bodies.count(len(self), commands=(commands, ((count,),)))
        values = many_bodies.rows("commands", commands, len(self), [(count,)])
        for which, one in bodies.kinds:
            actuation.write_commands(one.given["actuators"], bodies.models, which, values)

    def _write_wrenches(self, which: Integers, values: Floats) -> None:
        """Bodies ``which`` hold these values; the order of ``which`` does not last."""
        models, kinds, numbers = self._bodies.models, self._groups.wrench_kinds, np.ascontiguousarray(values)
        before = kinds.copy()
        n = self._write(models.reshape(-1), models.shape[1], which, numbers.reshape(-1), kinds)
        if not np.array_equal(kinds, before):
            self._groups.find()
        self._mark_origins(which[:n])

    def _mark_origins(self, which: Integers) -> None:
        """From here on, closed forms are evaluated from the present states of these bodies."""
        marked = which[self._groups.in_closed_form[which]]
        self._origins[marked], self._origin_steps[marked] = self._states[marked], self.steps

    def step(self, n: int = 1) -> None:
        """Advance all bodies that have not stopped by n steps. Raises ValueError for n below 0."""
        n = running.positive("steps", n, least=0)
        for group in self._groups.all:
            self._advance(group._replace(which=self._going(group.which)), n)
        self.steps += n

    def _going(self, which: Integers) -> Integers:
        return np.setdiff1d(which, list(self.stopped), assume_unique=True) if self.stopped else which

    def _advance(self, group: Group, n: int) -> None:
        which, integrator, _ = group
        counts: Integers = np.full(len(which), n)
        if integrator.one_evaluation:
            since = self.steps - self._origin_steps[which]
            counts, self._states[which] = counts + since, self._origins[which]
        self._call(group, counts, NOTHING)
        if integrator.one_evaluation:
            counts -= since
        for k in np.flatnonzero(counts < n).tolist():
            self._go_on(int(which[k]), int(counts[k]), n, integrator)

    def _go_on(self, i: int, done: int, n: int, integrator: Integrator) -> None:
        """A body has done only so many of n steps: as a stiff one it may do the rest, else it has stopped."""
        if self._groups.turn_stiff(i):
            self._groups.find()
            self._advance(self._groups.group_of(i)._replace(which=np.array([i])), n - done)
            return
        step = self.steps + done + 1
        since = step - int(self._origin_steps[i]) if integrator.one_evaluation else None
        one = self.simulation(i)
        commands = [each.command for each in one.actuator_states]
        how = sentences.How(one.terms, integrator, self._rate.h, since, commands)
        self.stopped[i] = sentences.why_stopped(step, one.state, self.wrench(i), how)

    def _takes(self) -> tuple[bool, ...]:
        """Of which ``turns`` wrenches ``_follow`` may be given; empty where it cannot go on alone."""
        if not compiled.ENABLED or self._groups.in_closed_form.any() or self._actuated:
            return ()
        return (False, True) if self._groups.take_any else (True,)

    def _now(self) -> Floats:
        """The flat states, each with what spins inside where there are actuators."""
        if not self._actuated:
            return self._states.reshape(-1)
        return np.hstack((self._states, self._bodies.models[:, INSIDE])).reshape(-1)

    def _follow(self, n: int, commands: Floats, kept: Floats, since: int, every: int) -> int:
        """n steps of all bodies, under the same commands: see integrators.script."""
        script = Script(commands, kept, self._states.size, since, every)
        keeps = kept[: (since + n) // every * self._states.size].reshape(-1, *self._states.shape)
        keeps[:, list(self.stopped)] = self._states[list(self.stopped)]
        for group in self._groups.all:
            which = self._going(group.which)
            counts: Integers = np.full(len(which), n)
            self._call(group._replace(which=which), counts, script)
            for k in np.flatnonzero(counts < n).tolist():
                self._finish(int(which[k]), int(counts[k]), n, script, keeps)
        if len(commands):
            self._groups.wrench_kinds[:] = many.UNKNOWN
            self._write_wrenches(np.arange(len(self)), self._wrenches.copy())
        self.steps += n
        return n

    def _finish(self, i: int, done: int, n: int, script: Script, keeps: Floats) -> None:
        """Do the rest of n steps of a body by itself, by whatever integrator can; else it has stopped."""
        single, rows = self.simulation(i, ahead=done), script.commands.reshape(-1, COMMAND_SIZE)
        coming = [(int(row[0]), _wrench(row[1:])) for row in rows if row[0] > done]
        while done < n:
            if coming and coming[0][0] == done:
                single.set_wrench(coming.pop(0)[1])
            passed = script.since + done
            until = min(n, done + script.every - passed % script.every, coming[0][0] if coming else n)
            try:
                single.step(until - done if i not in self.stopped else 0)
            except SimulationError as reason:
                self.stopped[i] = str(reason)
            done, state = until, single.save().state
            if (script.since + done) % script.every == 0:
                keeps[(script.since + done) // script.every - 1, i] = state
        self._states[i] = single.save().state
        for _, memory in self._bodies.memories(np.array([i])):
            kept = single.save().memory
            self._bodies.models[i, memory][: len(kept)] = kept
        self._groups.keep_stiffness(i, single.save().stiffness)
        self._groups.find()

    def _call(self, group: Group, counts: Integers, script: Script) -> None:
        """Advance bodies, with as many threads as there are; ``counts`` says how far each is to go, and came."""
        which = group.which
        if len(which) > 8 and counts[0] >= _WORTH_SORTING:
            order = self._groups.by_speed(which, self._states)
            sorted_counts = counts[order]
            self._share_out(group._replace(which=which[order]), sorted_counts, script)
            counts[order] = sorted_counts
        else:
            self._share_out(group, counts, script)

    def _share_out(self, group: Group, counts: Integers, script: Script) -> None:
        which, integrator, kernel = group
        share = max(1, -(-len(which) // (8 * self.threads))) * 8  # blocks of eight are not divided
        states, models, width = self._states.reshape(-1), self._bodies.models.reshape(-1), self._bodies.models.shape[1]

        def advance(first: int) -> None:
            part, scratch = slice(first, first + share), self._scratch_of(integrator, first)
            kernel(states, models, width, which[part], counts[part], *scratch, self._rate.h, script)

        parts = range(0, len(which), share)
        if len(parts) < 2 or counts.sum() < _WORTH_A_THREAD:
            for first in parts:
                advance(first)
            return
        if self._pool is None:
            self._pool = ThreadPoolExecutor(self.threads)
        list(self._pool.map(advance, parts))

    def _scratch_of(self, integrator: Integrator, first: int) -> tuple[Floats, Floats]:
        """Scratch space for the part of a call that begins there."""
        if (key := (integrator.name, first)) not in self._scratch:
            self._scratch[key] = zeros_on_a_line(integrator.work_size), zeros_on_a_line(many.BLOCK_SIZE)
        return self._scratch[key]

    def run(
        self,
        duration: float | None = None,
        *,
        steps: int | None = None,
        every: int = 1,
        commands: WrenchSchedule | None = None,
        controller: Controller | None = None,
        control_every: int = 1,
        progress: bool | None = None,
    ) -> Trajectories:
        """Advance as Simulation.run does; the same commands are for all bodies.

        ``controller(state, time)`` is given arrays with a row for each body (see ``state``), and returns Wrenches, or
        None to go on. A body that stops is marked in ``stopped``, and in what is returned.
        """
        n, every = running.counted(duration, steps, self.rate), running.positive("every", every)
        control_every = running.positive("control_every", control_every)
        commands = running.agreed(commands, controller)
        self._groups.check(commands.values)
        made = partial(Trajectories, self._bodies.terms, self._bodies.models, self.rate, self.stopped)
        command = self.set_actuators if self._actuated else None
        inside = running.Inside(self._now, made, (Wrenches, Wrench), command, self._takes, self._follow, self._record)
        run = running.Run(self, inside, n, every, commands)
        run.go(controller, control_every, progress)
        found: Trajectories = run.trajectory
        return found

    @property
    def _instruments(self) -> list[dict[str, Instrument]]:
        """Of each body its sensors at work, made when they are first used."""
        if not self._at_work:
            self._at_work = [instruments(each, self.rate) for each in self._sensors]
        return self._at_work

    @property
    def _record(self) -> Record | None:
        return Record(self._instruments[0], self.sense) if self._sensors else None

    def sense(self, name: str) -> Floats:
        """What the sensor of that name of each body shows now, shape (n, m): see Simulation.sense.

        Where the sensors were given for all bodies, that of body i is the one of a Simulation with i added to its seed.
        """
        ones: list[Instrument] = [named(each, name) for each in self._instruments] or named({}, name)
        motions = self.state.motion.tolist()
        return np.array([one.measure(self.steps, self._seen(i, one, motions[i])) for i, one in enumerate(ones)])

    def _seen(self, i: int, one: Instrument, motion: list[float]) -> Seen:
        terms, acceleration = self._bodies.terms[i], NOT_READ
        if one.type.accelerations:
            state, model = self._states[i], self._bodies.models[i]
            acceleration = compiled.ready(acceleration_reader(terms.kernels), state, model)(state, model)
        return Seen(tuple(motion), acceleration, terms.gravity, terms.given["ground"])

    def reset(self, which: ArrayLike | None = None) -> None:
        """These bodies, or all, go to their initial states and hold no wrench; all of them count steps from zero."""
        bodies = self._indices(which)
        self._states[bodies] = self._initial[bodies]
        for i, memory in self._bodies.memories(bodies):
            self._bodies.models[i, memory] = self._bodies.start[i, memory]
            self._bodies.models[i, INSIDE] = self._bodies.start[i, INSIDE]
        self._set_free(bodies)
        if which is None:
            self.steps = 0
            self._origin_steps[:] = 0
        self._write_wrenches(bodies, np.zeros((len(bodies), 12)))

    def set_state(
        self,
        position: ArrayLike = ZERO,
        orientation: ArrayLike = (1.0, 0.0, 0.0, 0.0),
        velocity: ArrayLike = ZERO,
        angular_velocity: ArrayLike = ZERO,
        which: ArrayLike | None = None,
    ) -> None:
        """Go on from these states, a row for each of the bodies of ``which`` (indices), or one for all.

        Time and wrenches stay; a body that had stopped goes on. Raises ValueError, and changes nothing, as the
        constructor does.
        """
        bodies = self._indices(which)
        given = {"position": position, "orientation": orientation, "velocity": velocity}
        given["angular_velocity"] = angular_velocity
        many_bodies.count(len(bodies), **{name: (array, _SHAPES[name]) for name, array in given.items()})
        self._states[bodies] = many_bodies.flat_states(len(bodies), self._bodies.models[bodies], **given)
        self._set_free(bodies)

    def _indices(self, which: ArrayLike | None) -> Integers:
        everyone = np.arange(len(self))
        try:
            return everyone if which is None else everyone[np.atleast_1d(which)]
        except IndexError as reason:
            raise ValueError(f"which={which!r}: {reason}; give indices of the {len(self)} bodies") from None

    def _set_free(self, bodies: Integers) -> None:
        """After their states were changed from outside."""
        if self.stopped:
            for i in bodies.tolist():
                self.stopped.pop(i, None)
        if self._groups.measure(self._states, bodies):
            self._groups.find()
        self._mark_origins(bodies)

    def simulation(self, i: int, *, ahead: int = 0) -> Simulation:
        """A Simulation of one of the bodies, which goes on with the same bits; its count of steps is so far ``ahead``.

        Raises IndexError for another index.
        """
        if not 0 <= i < len(self):
            raise IndexError(f"there is no body {i}; they are 0 to {len(self) - 1}")
        terms, wrench, stiffness = self._bodies.terms[i], self.wrench(i), float(self._groups.stiffness[i])
        name = integrators.AUTO if self._groups.asked is None else self._groups.asked.name
        sensors = self._sensors[i] if self._sensors else ()
        single = Simulation(terms.body, rate=self.rate, integrator=name, sensors=sensors, **terms.optional())
        held = (("", wrench, None),) if any(wrench.values) else ()
        origin = int(self._origin_steps[i]), tuple(self._origins[i].tolist())
        state = tuple(self._states[i].tolist())
        memory = self._bodies.models[i, int(self._bodies.models[i, MEMORY]) :][: len(terms.memory(self._rate.h))]
        commands = actuation.commands_in(terms.given["actuators"], self._bodies.models[i])
        stiff = None if np.isnan(stiffness) else stiffness
        remembers, kept = terms.remembers(self._rate.h), tuple(memory.tolist())
        single.restore(Snapshot(self.steps + ahead, state, held, origin, stiff, kept, (commands, None), remembers))
        return single


def _wrench(values: Floats) -> Wrench:
    f, t, g, u = values.reshape(4, 3).tolist()
    return Wrench(f, t, g, u)
