"""A rigid body under held wrenches, advanced at a fixed rate: what node, report and tools stand on. No ROS."""

import struct
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from operator import index
from typing import Any

import numpy as np

from . import integrators, sentences
from .actuation import Actuation, ActuatorState
from .effects.actuators import Actuator
from .effects.drag import Drag
from .effects.fluid import Fluid
from .effects.ground import Contact, Ground, contacts_at
from .effects.tether import Tether
from .held import Held, earlier, steps_held
from .integrators.script import Script
from .kernels import compiled
from .kernels import state as flat
from .kernels.acceleration import acceleration_reader
from .kernels.arrays import Floats, Vector, python_floats
from .kernels.impulse import add_impulse
from .kernels.model import FASTEST, INSIDE, MEMORY, WRENCH
from .kernels.state import SIZE
from .rate import Rate, Timed
from .runs import running
from .runs.schedule import WrenchSchedule
from .runs.trajectory import Trajectory
from .scene import plan
from .scene.loader import Scene
from .sensors.base import NOT_READ, Seen, Sensor
from .sensors.instrument import Instrument, Record, instruments, named
from .snapshot import Snapshot
from .stepping import Stepping, asked_for
from .terms import Terms
from .theory import invariants
from .values.body import Body
from .values.state import BodyState, State, body_state, flatten, is_slow_enough
from .values.wrench import ZERO, PointForce, Wrench

_Reader = Callable[..., tuple[float, ...]]
_PACK_WRENCH = struct.Struct("12d").pack_into
_WRENCH_OFFSET = 8 * WRENCH

NO_WRENCH = Wrench()
_BACKWARDS = "{}({}): time does not run backwards; give a number of steps of at least 0"
MOST_AT_ONCE = 1_000_000  # steps in one kernel call, so that Ctrl-C is heard during a long run


class SimulationError(RuntimeError):
    """A step that could not be done; the simulation keeps the last good state.

    Of a run, ``trajectory`` is what was done up to there.
    """

    trajectory: Trajectory | None = None


class Simulation(Timed):
    """One rigid body, the wrench it holds, and time as a count of steps. It can be copied and pickled.

    Parameters
    ----------
    body : Body
    state : State
        Initial state of the body frame.
    rate : float
        Steps a second of simulated time [Hz].
    gravity : array_like, shape (3,)
        Acceleration [m/s²] of free fall, world axes.
    integrator : str
        ``auto``, which takes the one that is right for what acts (see scene.plan) and changes it when that
        changes, or a name in the registry, ``rigid_body_sim.integrators.REGISTRY``.
    rtol : float
        Relative error that an error-controlled integrator may make in a step.
    sensors : sequence of Sensor
        What can be measured by ``sense``: Imu, Magnetometer and so on. They change no bit of the motion.
    **effects
        What acts besides, by its name in ``rigid_body_sim.effects.REGISTRY``: ``drag`` (a Drag), ``tethers`` (several
        Tether), ``forces`` (several (point, force): forces [N] in world axes that always act, each at a body-fixed
        point [m] given from the body frame's origin in body axes: buoyancy, say), ``ground`` (a Ground), ``actuators``
        (several Actuator), ``fluid`` (a Fluid, which flows past and acts by drag and added mass alone), ``added_mass``
        (an AddedMass, or its 6 or 21 numbers).

    Raises
    ------
    ValueError
        A rate outside [1e-9, 1e6] Hz, gravity that is not three finite numbers, an unknown integrator, or one that
        leaves out the drag, the tethers, the forces or the ground given; rtol outside [1e-13, 1]; a sensor whose rate
        does not divide that of the steps.
    """

    _wrench: Wrench
    _in_place: tuple[bool, ...]  # ``turns`` of the wrenches without points that change twelve numbers and no more
    run_kernel: Callable[[int], int]  # advances the state, and no count; another one after any change of plan or model
    expiry: int | None  # step at which something that is held ends
    origin_steps: int | None  # step from whose state an integrator with ``one_evaluation`` goes
    is_at_home = False  # whether the model lies in a fleet's array: see ``move``
    _home: Floats | None = None

    def __init__(
        self,
        body: Body,
        state: State | None = None,
        *,
        rate: float = 1000.0,
        gravity: Vector = ZERO,
        integrator: str = integrators.AUTO,
        rtol: float = 1e-9,
        sensors: Sequence[Sensor] = (),
        **effects: Any,
    ):
        # No cached_property here: one that is used makes each look-up of any attribute take twice as long.
        self._rate = Rate(rate)
        self._h = self._rate.h
        self._stepping = Stepping(Terms(body, gravity, rtol, **effects), asked_for(integrator), self._h)
        self.initial_state = State() if state is None else state
        self.steps = 0
        self._actuation = Actuation(self.terms.given["actuators"])
        self._model = self.terms.model(NO_WRENCH, self.terms.memory(self._h))
        self._state = flatten(self.initial_state, self._model)
        self._origin = self._state.copy()
        self._state_view, self._origin_view = self._state.data, self._origin.data  # quicker to copy
        self._motion_kernel = compiled.ready(flat.read_motion, self._state, self._model)
        self._pose_kernel: _Reader | None = None
        self._acceleration_kernel: _Reader | None = None
        self._instruments = instruments(sensors, self._rate.value)
        self._go_on(self._state, self._model, Held())

    @classmethod
    def from_scene(cls, scene: Scene) -> "Simulation":
        """The simulation that a scene describes, at its initial state.

        Raises ValueError for an integrator that is unknown, or leaves out what the scene has.
        """
        name, terms = scene["integrator.name"], scene.terms()
        if name not in integrators.CHOICES:
            raise ValueError(f"parameter integrator.name = {name!r}: give {integrators.RULE}")
        if name != integrators.AUTO and (shortfall := integrators.shortfall(name, terms)):
            raise ValueError(f"parameter integrator.name = {name!r}: {shortfall}")
        options = {"rate": scene["rate"], "integrator": name, "sensors": scene.sensors(), **terms.optional()}
        return cls(terms.body, scene.initial_state(), **options)

    @property
    def body(self) -> Body:
        """The body that is simulated."""
        return self.terms.body

    @property
    def terms(self) -> Terms:
        """The body and all that acts on it without being sent."""
        return self._stepping.terms

    @property
    def gravity(self) -> Floats:
        """Acceleration of free fall [m/s²], world axes, shape (3,)."""
        gravity = np.array(self.terms.gravity)
        gravity.flags.writeable = False
        return gravity

    @property
    def drag(self) -> Drag:
        """The drag that acts."""
        drag: Drag = self.terms.given["drag"]
        return drag

    @property
    def fluid(self) -> Fluid:
        """The fluid around, which may flow."""
        fluid: Fluid = self.terms.given["fluid"]
        return fluid

    @property
    def tethers(self) -> tuple[Tether, ...]:
        """The tethers that hold the body."""
        return tuple(self.terms.given["tethers"])

    @property
    def forces(self) -> tuple[PointForce, ...]:
        """The forces that always act, as (point [m, body axes], force [N, world axes])."""
        return tuple(self.terms.given["forces"])

    @property
    def ground(self) -> Ground:
        """The ground, with the points of the body that it keeps out."""
        ground: Ground = self.terms.given["ground"]
        return ground

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """How each contact of the ground stands to it now: penetration, normal force and slip velocity."""
        return contacts_at(self.ground, self.body, self.state)

    @property
    def wrench(self) -> Wrench:
        """The wrench held now."""
        return self._wrench

    def set_wrench(self, wrench: Wrench, hold: float | None = None, source: str = "") -> None:
        """Hold ``wrench`` from now on, or for ``hold`` s of simulated time (see ``steps_held``) and zero after that.

        Wrenches of different sources are held side by side, each until its own end, and add up. Raises ValueError, and
        changes nothing, for a wrench that the integrator cannot be given.
        """
        expiry = None if hold is None else self.steps + steps_held(hold, self._rate.value)
        sources = self._held.sources
        if source in sources and len(sources) == 1:
            self._hold(wrench, expiry)
            sources[source] = wrench, expiry
        else:
            self._hold_all(self._held.having(source, wrench, expiry))

    def clear_wrench(self) -> None:
        """Hold no wrench, from no source."""
        self._hold_all(Held())

    def set_actuators(self, commands: Sequence[float], hold: float | None = None) -> None:
        """Command the actuators, in their order, from now on, or for ``hold`` [s] as by ``set_wrench``, and 0 then.

        A force [N] for a thruster, a speed [rad/s] for a rotor, a torque [N m] for a wheel; beyond a limit it is the
        limit. Raises ValueError, and changes nothing, for a wrong number of commands, or one that is not finite.
        """
        expiry = None if hold is None else self.steps + steps_held(hold, self._rate.value)
        self._actuation.take(commands, expiry)
        self._on_commands()

    def _on_commands(self) -> None:
        self._write_commands(self._actuation.within)
        self.expiry = earlier(self._held.end, self._actuation.end)

    @property
    def actuators(self) -> tuple[Actuator, ...]:
        """The actuators, in the order of commands."""
        return self._actuation.actuators

    @property
    def actuator_states(self) -> tuple[ActuatorState, ...]:
        """What each of the actuators does now."""
        return self._actuation.states(self._model, self.motion[16:19])

    @property
    def commands_limited(self) -> int:
        """How many commands to actuators had a number beyond a limit."""
        return self._actuation.limited

    def _hold_all(self, held: Held) -> None:
        self._hold(held.total, held.end)
        self._held = held

    def _hold(self, wrench: Wrench, expiry: int | None) -> None:
        """Hold ``wrench`` up to step ``expiry``."""
        if wrench.turns in self._in_place and not wrench.points:
            if self.origin_steps is not None and wrench.values != self._wrench.values:
                self._mark_origin()
            self._write_wrench(*wrench.values)
            self._wrench = wrench
        elif wrench != self._wrench:
            self._install(wrench)
        self.expiry = earlier(expiry, self._actuation.end)

    def _end_holding(self) -> None:
        """Go on without the sources whose time has run out. Raises SimulationError when the others cannot be held."""
        if self._actuation.end == self.steps:
            self._actuation.rest()
            self._on_commands()
        try:
            self._hold_all(self._held.left_at(self.steps))
        except ValueError as reason:  # what ended kept the sum small, or turned no body
            raise SimulationError(
                f"step {self.steps + 1} cannot be done: the time of one of several wrenches has run out, and {reason}"
            ) from None

    def change(self, **terms: Any) -> None:
        """Go on with other terms, named as in the constructor from ``body`` to ``rtol``; those not named stay.

        Pose and velocities of the body frame stay, and so do the held wrenches and the time; another body has another
        momentum. Actuators begin anew, levels and wheels too, where any has more than other limits of its command.
        Raises ValueError, and changes nothing, as the constructor does, and TypeError for any other name.
        An integrator that was not needed before is made ready here, which compiles it when it never was. Where only the
        fluid's velocity changes, the plan stays, and it takes no longer than a wrench.
        """
        changed = self.terms.changed(**terms)
        if changed.is_another_flow(self.terms, terms):
            self._stepping.terms = changed
            changed.write_media(self._model)
            return
        new = self._stepping.changed(changed)
        memory = new.terms.memory(self._h, self.terms, self._memory)
        actuation, state = self._actuation.of(new.terms.given["actuators"]), self._state
        model = new.terms.model(NO_WRENCH, memory)
        if new.terms.body != self.body or not np.array_equal(model[INSIDE], self._model[INSIDE]):
            state = flatten(self.state, model)
        self._stepping, self._actuation = new, actuation
        self._acceleration_kernel = None
        self._go_on(state, model, self._held)

    def check_change(self, **terms: Any) -> None:
        """Raise as ``change`` would, and change nothing."""
        self._stepping.changed(self.terms.changed(**terms))

    def apply_impulse(self, impulse: Wrench) -> None:
        """Change momentum and angular momentum at once, as ``impulse`` [N s, N m s] would within no time.

        It means what the same Wrench means as a force, at the present attitude. What is held stays held. Raises
        ValueError, and changes nothing, when the motion that follows would not be finite.
        """
        struck = self._state.copy()
        bare = self.terms.bare
        add_impulse(bare.kernels, python_floats(struck), python_floats(bare.model(impulse)))
        if not (np.isfinite(struck).all() and is_slow_enough(self._motion_kernel(struck, self._model))):
            raise ValueError(f"impulse {impulse!r} refused: the motion that follows is not finite; give a smaller one")
        self._begin_anew(struck)

    def step(self, n: int = 1) -> None:
        """Advance by n steps. Raises ValueError for n below 0 and TypeError for anything but a whole number.

        Raises SimulationError when a step would leave the range of finite numbers, or spins too fast to be followed;
        the simulation then stays at the last good state, and ``steps`` counts the steps that were done.
        """
        n = index(n)
        if n < 0:
            raise ValueError(_BACKWARDS.format("step", n))
        while n > 0:
            held = n if self.expiry is None else min(n, self.expiry - self.steps)
            if self.origin_steps is not None:
                done = self._step_from_origin(self.origin_steps, held)
            else:
                if held > MOST_AT_ONCE:
                    held = MOST_AT_ONCE
                done = self.run_kernel(held)
            self.steps += done
            if done < held:
                if not self._stepping.turn_stiff():
                    raise SimulationError(self._why_stopped())
                self._install(self._wrench)
            if self.expiry is not None and self.steps == self.expiry:
                self._end_holding()
            n -= done

    def end_what_is_due(self) -> None:
        """After a fleet has counted steps, up to ``expiry`` at most. Raises SimulationError as ``step`` does."""
        if self.steps == self.expiry:
            self._end_holding()

    def wait(self, n: int) -> None:
        """Let the time of n steps pass without motion: the state stays to the bit, and what is held for what is left.

        Raises ValueError for n below 0 and TypeError for anything but a whole number.
        """
        n = index(n)
        if n < 0:
            raise ValueError(_BACKWARDS.format("wait", n))
        self._move_time(n)

    def run(
        self,
        duration: float | None = None,
        *,
        steps: int | None = None,
        every: int = 1,
        commands: WrenchSchedule | None = None,
        controller: running.Controller | None = None,
        control_every: int = 1,
        progress: bool | None = None,
    ) -> Trajectory:
        """Advance by ``duration`` [s] or by ``steps``, and return the states on the way: the first, and of every so
        many steps one, and the last.

        They are the same bits as those of single steps. ``commands`` are held one after the other, as ``set_wrench``
        holds them; or ``controller(state, time)`` says, each ``control_every`` steps, the Wrench to be held next,
        commands to actuators, or None to go on. ``progress`` shows a bar: by default where a run takes longer on a
        terminal, with tqdm. Ctrl-C ends the run with a warning, and what was done is returned.

        Raises ValueError, and does nothing, for a duration that is no whole number of steps, commands beyond the run,
        or that the integrator cannot be given. Raises SimulationError as ``step`` does, with what was done up to there
        as its ``trajectory``.
        """
        n, every = running.counted(duration, steps, self.rate), running.positive("every", every)
        control_every = running.positive("control_every", control_every)
        commands = running.agreed(commands, controller)
        self._check_schedule(commands)
        made = partial(Trajectory, self.terms, self.rate)
        command = self.set_actuators if self.actuators else None
        record = Record(self._instruments, self.sense) if self._instruments else None
        inside = running.Inside(self._now, made, (Wrench,), command, self._takes, self._follow, record)
        run = running.Run(self, inside, n, every, commands)
        try:
            run.go(controller, control_every, progress)
        except SimulationError as stopped:
            stopped.trajectory = run.trajectory
            raise
        return run.trajectory

    def _check_schedule(self, commands: WrenchSchedule) -> None:
        """Raise ValueError for a row that cannot be held."""
        for row in np.flatnonzero(commands.turns)[:1].tolist():
            try:
                self._stepping.for_wrench(commands.wrench(row))
            except ValueError as reason:
                raise ValueError(f"row {row} of the schedule: {reason}") from None

    def _takes(self) -> tuple[bool, ...]:
        """Of which ``turns`` wrenches ``_follow`` may be given, without points; empty where it cannot go on alone."""
        alone = self.expiry is None and self._held.sources.keys() <= {""}
        within = compiled.ENABLED and alone and self.origin_steps is None and not self.terms.actuated
        return self._in_place if within else ()

    def _now(self) -> Floats:
        """The flat state, and what spins inside where there are actuators."""
        return np.append(self._state, self._model[INSIDE]) if self.terms.actuated else self._state

    def _follow(self, n: int, commands: Floats, kept: Floats, since: int, every: int) -> int:
        run, work = self._stepping.script(self.integrator)
        done = run(self._state, self._model, work, self._h, n, Script(commands, kept, SIZE, since, every), 0)
        self.steps += done
        return done

    @property
    def kinetic_energy(self) -> float:
        """½ m v·v + ½ ω·I ω [J], with v the velocity of the centre of mass; and what added mass adds to it."""
        return float(invariants.energy_of_motion(self.terms, self.state))

    @property
    def potential_energy(self) -> float:
        """Energy [J] in gravity, constant forces, tethers and contacts: none at the world's origin, and at rest."""
        return float(invariants.potential_energy(self.terms, self.state))

    @property
    def state(self) -> BodyState:
        """A copy of the state: of the body frame, with momentum and angular momentum."""
        return body_state(self._motion_kernel(self._state, self._model), self._state)

    @property
    def pose(self) -> tuple[float, ...]:
        """(x, y, z [m], qw, qx, qy, qz) of the body frame in the world: the quickest way to read a pose back.

        Its first use compiles a kernel.
        """
        read = self._pose_kernel
        if read is None:
            read = self._pose_kernel = compiled.ready(flat.read_pose, self._state, self._model)
        return read(self._state, self._model)

    @property
    def motion(self) -> tuple[float, ...]:
        """Pose (7, as ``pose``), velocity of the origin and ω in world axes (6), both in body axes (6): 19 numbers.

        The quickest way to read all of them.
        """
        return self._motion_kernel(self._state, self._model)

    @property
    def acceleration(self) -> tuple[float, ...]:
        """Acceleration of the body frame's origin [m/s², world axes] and dω/dt [rad/s², body axes], 6 numbers.

        Of the present state under the wrench held now and everything else that acts; its first use compiles a kernel.
        """
        if self._acceleration_kernel is None:
            self._acceleration_kernel = compiled.ready(
                acceleration_reader(self.terms.kernels), self._state, self._model
            )
        return self._acceleration_kernel(self._state, self._model)

    @property
    def instruments(self) -> Mapping[str, Instrument]:
        """The sensors at work, by name."""
        return self._instruments

    def measured(self, one: Instrument) -> tuple[float, ...]:
        """What an instrument shows now, as numbers."""
        acceleration = self.acceleration if one.type.accelerations else NOT_READ
        return one.measure(self.steps, Seen(self.motion, acceleration, self.terms.gravity, self.ground))

    def sense(self, name: str) -> Floats:
        """What the sensor of that name shows of the present state, under the wrench held now: docs/how-to/sensors.md.

        Its noise is that of the sample at this step, or the one before it: the same whenever it is asked for. Raises
        ValueError where there is no sensor of that name.
        """
        return np.array(self.measured(named(self._instruments, name)))

    def reset(self, state: State | None = None, *, keep_time: bool = False) -> None:
        """Go to ``state``, or else the initial one, hold no wrench, and count steps from zero unless ``keep_time``."""
        model = self.terms.model(NO_WRENCH, self.terms.memory(self._h))
        flattened = flatten(self.initial_state if state is None else state, model)
        self._actuation.rest()
        if not keep_time:
            self.steps = 0
        self._go_on(flattened, model, Held())

    def restart_time(self) -> None:
        """Count steps from zero. The motion goes on, and each held wrench for what is left of its time."""
        self._move_time(-self.steps)

    def _move_time(self, steps: int) -> None:
        """Count so many steps more, or fewer; whatever is due at a step moves along."""
        self._held = self._held.later(steps)
        if self._actuation.end is not None:
            self._actuation.end += steps
        self.expiry = earlier(self._held.end, self._actuation.end)
        if self.origin_steps is not None:
            self.origin_steps += steps
        self.steps += steps

    def set_state(self, state: State) -> None:
        """Go on from ``state``; time and held wrenches stay. Raises ValueError, and changes nothing, on overflow."""
        flattened = flatten(state, self._model)
        if not is_slow_enough(self._motion_kernel(flattened, self._model)):
            raise ValueError(f"{state!r} moves too fast; give velocities below {FASTEST:g} m/s and rad/s")
        self._begin_anew(flattened)

    def save(self) -> Snapshot:
        """Step count, state with its low-order parts, and held wrench, exact to the bit."""
        origin = None if self.origin_steps is None else (self.origin_steps, tuple(self._origin.tolist()))
        state = tuple(self._state.tolist())
        sources = tuple((name, *held) for name, held in self._held.sources.items())
        commands = self._actuation.commands, self._actuation.end
        memory, remembers = tuple(self._memory.tolist()), self.terms.remembers(self._h)
        return Snapshot(self.steps, state, sources, origin, self._stepping.stiffness, memory, commands, remembers)

    def restore(self, snapshot: Snapshot) -> None:
        """Continue from a snapshot taken with the same body, rate, terms and integrator: the same bits follow.

        Raises ValueError, and changes nothing, for one of other actuators or gusts, or whose wrench the integrator
        cannot be given.
        """
        if snapshot.remembers != self.terms.remembers(self._h) or len(snapshot.actuators[0]) != len(self.actuators):
            raise ValueError(
                "the snapshot is of other actuators or gusts, or another rate: what they remember does not fit; "
                "restore it in a simulation made in the same way"
            )
        held = Held({name: (wrench, expiry) for name, wrench, expiry in snapshot.sources})
        self._stepping.for_wrench(held.total)  # which raises for one that the integrator cannot be given
        self._stepping.stiffness = snapshot.stiffness
        self._actuation.commands, self._actuation.end = snapshot.actuators
        self._begin_with(self.terms.model(NO_WRENCH, np.array(snapshot.memory)), held)
        self._state[:] = snapshot.state
        self.steps = snapshot.steps
        if self.origin_steps is not None:
            self.origin_steps, self._origin[:] = snapshot.origin or (snapshot.steps, snapshot.state)

    def __reduce__(self) -> tuple[Any, ...]:
        """For pickle and copy: made anew in the same way, then restored, so the same bits follow."""
        integrator = self._stepping.asked.name if self._stepping.asked else integrators.AUTO
        sensors = tuple(one.sensor for one in self._instruments.values())
        options = {"rate": self.rate, "integrator": integrator, "sensors": sensors, **self.terms.optional()}
        return _restored, (partial(type(self), self.body, self.initial_state, **options), self.save())

    @property
    def plan(self) -> plan.Plan:
        """How it advances now, why so, and what that leaves out."""
        turning = bool(self._state[flat.L : flat.L + 3].any())
        return self._stepping.explain(self.integrator, self._wrench, turning)

    def describe(self) -> str:
        """One line for the log: what is simulated, and how."""
        return sentences.description(self.body, self.rate, self.plan)

    @property
    def _memory(self) -> Floats:
        """What goes on from step to step: the end of the model."""
        return self._model[int(self._model[MEMORY]) :]

    def _begin_anew(self, state: Floats) -> None:
        self._go_on(state, self.terms.model(NO_WRENCH, self._memory), self._held)

    def _go_on(self, state: Floats, model: Floats, held: Held) -> None:
        """From a flat state, by a model that holds no wrench yet."""
        self._state[:] = state
        self._stepping.prepare(self._state, model)
        self._begin_with(model, held)

    def _begin_with(self, model: Floats, held: Held) -> None:
        self._model, self._held = self._placed(model), held
        self._install(held.total, self._model)
        self.expiry = earlier(held.end, self._actuation.end)

    def _install(self, wrench: Wrench, model: Floats | None = None) -> None:
        self.integrator = integrator = self._stepping.for_wrench(wrench)
        steps, work = self._stepping.kernel(integrator)
        if model is None or wrench.points:
            self._model = self._placed(self.terms.model(wrench, self._memory))
        self._write_commands = self._actuation.writer(self._model)
        self._write_commands(self._actuation.within)
        self.run_kernel = partial(steps, self._state, self._model, work, self._h)
        self._write_wrench = partial(_PACK_WRENCH, self._model.data.cast("B"), _WRENCH_OFFSET)
        self._write_wrench(*wrench.values)
        self._wrench = wrench
        others = (False, True) if self._stepping.takes_any(integrator) else (wrench.turns,)
        self._in_place = () if wrench.points else others
        self.origin_steps = None
        if integrator.one_evaluation:
            self._mark_origin()

    @property
    def model_size(self) -> int:
        """How many numbers the model has."""
        return len(self._model)

    def move(self, state: Floats, origin: Floats, home: Floats) -> None:
        """At step 0: keep state and model in these rows of a fleet's arrays, so that one kernel advances many."""
        state[:], origin[:] = self._state, self._origin
        self._state, self._origin, self._home = state, origin, home
        self._state_view, self._origin_view = state.data, origin.data
        self._install(self._wrench)

    def _placed(self, model: Floats) -> Floats:
        self.is_at_home = self._home is not None and len(model) <= len(self._home)
        if self._home is None or not self.is_at_home:
            return model
        self._home[: len(model)] = model
        return self._home[: len(model)]

    def _mark_origin(self) -> None:
        """From here on, evaluate from the present state."""
        self.origin_steps = self.steps
        self._origin_view[:] = self._state_view

    def _step_from_origin(self, origin_steps: int, n: int) -> int:
        """Advance by n steps in one evaluation from where the wrench last changed; return how many were done."""
        self._state_view[:] = self._origin_view
        since = self.steps - origin_steps
        return self.run_kernel(since + n) - since

    def _why_stopped(self) -> str:
        since = None if self.origin_steps is None else self.steps + 1 - self.origin_steps
        how = sentences.How(self.terms, self.integrator, self._h, since, self._actuation.within)
        return sentences.why_stopped(self.steps + 1, self.state, self._wrench, how)


def _restored(make: Callable[[], Simulation], snapshot: Snapshot) -> Simulation:
    simulation = make()
    simulation.restore(snapshot)
    return simulation
