"""A rigid body under held wrenches, advanced at a fixed rate: what node, report and tools stand on. No ROS."""

import math
import operator
import struct
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import integrators
from .physics import compiled
from .physics import state as flat
from .physics.body import Body
from .physics.forces import WRENCH, new_model
from .physics.resistance import NO_DRAG, Drag, Tether
from .physics.state import BodyState, State
from .physics.wrench import Wrench, three_finite
from .scene.loader import Scene

_PACK_WRENCH = struct.Struct("12d").pack_into
_WRENCH_OFFSET = 8 * WRENCH

NANOSECONDS = 1_000_000_000
HIGHEST_RATE = 1e6  # Hz: beyond it a step is shorter than the call that computes it


MOST_AT_ONCE = 1_000_000  # steps in one kernel call, so that Ctrl-C is heard during a long run
MOST_STEPS_HELD = 1e15


class SimulationError(RuntimeError):
    """A step that could not be done; the simulation keeps the last good state."""


@dataclass(frozen=True)
class Snapshot:
    """Everything that decides a simulation's future, exact to the bit: see Simulation.save. It can be pickled."""

    steps: int
    state: tuple[float, ...]
    wrench: Wrench
    expiry: int | None
    origin: tuple[int, tuple[float, ...]] | None = None  # step and state from which ``exact`` evaluates


class Simulation:
    """One rigid body, the wrench it holds, and time as a count of steps.

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
        A name in the registry, ``rigid_body_sim.integrators.REGISTRY``.
    drag : Drag
    tethers : sequence of Tether
    rtol : float
        Relative error that an error-controlled integrator may make in a step.

    Raises
    ------
    ValueError
        A rate outside (0, 1e6] Hz, gravity that is not three finite numbers, an unknown integrator, or one that leaves
        out the drag or the tethers given; rtol outside [1e-13, 1].
    """

    def __init__(
        self,
        body: Body,
        state: State | None = None,
        *,
        rate: float = 1000.0,
        gravity: ArrayLike = (0.0, 0.0, 0.0),
        integrator: str = "taylor",
        drag: Drag = NO_DRAG,
        tethers: Sequence[Tether] = (),
        rtol: float = 1e-9,
    ):
        self._rate = float(rate)
        if not 0.0 < self._rate <= HIGHEST_RATE:
            raise ValueError(f"rate {self._rate:.9g} Hz is not between 0 (excluded) and {HIGHEST_RATE:g} Hz")
        self.integrator = integrators.get(integrator)
        self._body, self._drag, self._tethers, self._rtol = body, drag, tuple(tethers), float(rtol)
        self._check_resistance()
        self._gravity = np.array(three_finite(gravity, "gravity"))
        self._gravity.flags.writeable = False
        self.initial_state = State() if state is None else state
        self.steps = 0
        self._h = 1.0 / self._rate
        self._rate_ratio = self._rate.as_integer_ratio()
        self._work = np.zeros(self.integrator.work_size)
        self._out = np.zeros(flat.OUT_SIZE)
        model = self._new_model(Wrench())
        self._state = flat.flatten(self.initial_state, model)
        self._steps_kernel = compiled.ready(self.integrator.steps, self._state, model, self._work, self._h, 1)
        self._read_kernel = compiled.ready(flat.read_out, self._state, model, self._out)
        self._pose_kernel = compiled.ready(flat.read_pose, self._state, model)
        self._install(Wrench())

    @classmethod
    def from_scene(cls, scene: Scene) -> "Simulation":
        """The simulation that a scene describes, at its initial state. Raises ValueError for an unknown integrator."""
        name = scene["integrator.name"]
        if name not in integrators.REGISTRY:
            raise ValueError(f"parameter integrator.name = {name!r}: give one of {', '.join(integrators.REGISTRY)}")
        return cls(
            scene.body(),
            scene.initial_state(),
            rate=scene["rate"],
            gravity=scene["gravity"],
            integrator=name,
        )

    @property
    def body(self) -> Body:
        """The body that is simulated."""
        return self._body

    @property
    def gravity(self) -> NDArray:
        """Acceleration of free fall [m/s²], world axes, shape (3,)."""
        return self._gravity

    @property
    def rate(self) -> float:
        """Steps a second of simulated time [Hz]."""
        return self._rate

    # Time -------------------------------------------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.steps / self._rate

    @property
    def time_ns(self) -> int:
        """Simulated time [ns]: round(steps · 10⁹ / rate), in integers, half up."""
        numerator, denominator = self._rate_ratio
        return (2 * self.steps * NANOSECONDS * denominator + numerator) // (2 * numerator)

    # Commands ---------------------------------------------------------------------------------------------------------

    @property
    def wrench(self) -> Wrench:
        """The wrench held now."""
        return self._wrench

    def set_wrench(self, wrench: Wrench, hold: float | None = None) -> None:
        """Hold ``wrench`` from now on, or for ``hold`` s of simulated time (at least one step) and zero after that.

        Raises ValueError, and changes nothing, for a wrench that the integrator cannot be given.
        """
        expiry = None if hold is None else self.steps + self._steps_held(hold)
        if self._plain and not wrench.points:
            _PACK_WRENCH(self._model_bytes, _WRENCH_OFFSET, *wrench.values)
            self._wrench = wrench
        elif wrench != self._wrench:
            self._install(wrench)
        self._expiry = expiry

    def clear_wrench(self) -> None:
        """Hold no wrench."""
        self.set_wrench(Wrench())

    def step(self, n: int = 1) -> None:
        """Advance by n steps. Raises ValueError for n below 0 and TypeError for anything but a whole number.

        Raises SimulationError when a step would leave the range of finite numbers, or spins too fast to be followed;
        the simulation then stays at the last good state, and ``steps`` counts the steps that were done.
        """
        if type(n) is not int:
            n = operator.index(n)
        if n < 0:
            raise ValueError(f"step({n}): time does not run backwards; give a number of steps of at least 0")
        while n > 0:
            held = n if self._expiry is None else min(n, self._expiry - self.steps)
            if self._origin is not None:
                done = self._step_from_origin(held)
            else:
                if held > MOST_AT_ONCE:
                    held = MOST_AT_ONCE
                done = self._steps_kernel(self._state, self._model, self._work, self._h, held)
            self.steps += done
            if done < held:
                raise SimulationError(self._why_stopped())
            if self.steps == self._expiry:
                self.clear_wrench()
            n -= held

    # State ------------------------------------------------------------------------------------------------------------

    @property
    def state(self) -> BodyState:
        """A copy of the state: of the body frame, with momentum and angular momentum."""
        self._read_kernel(self._state, self._model, self._out)
        return BodyState(self._out.copy())

    @property
    def pose(self) -> tuple[float, ...]:
        """(x, y, z [m], qw, qx, qy, qz) of the body frame in the world: the quickest way to read a pose back."""
        return self._pose_kernel(self._state, self._model)

    def reset(self, state: State | None = None, *, keep_time: bool = False) -> None:
        """Go to ``state``, or else the initial one, hold no wrench, and count steps from zero unless ``keep_time``."""
        self._state[:] = flat.flatten(self.initial_state if state is None else state, self._model)
        if not keep_time:
            self.steps = 0
        self._install(Wrench())

    def save(self) -> Snapshot:
        """Step count, state with its low-order parts, and held wrench, exact to the bit."""
        origin = self._origin and (self._origin[0], tuple(self._origin[1].tolist()))
        return Snapshot(self.steps, tuple(self._state.tolist()), self._wrench, self._expiry, origin)

    def restore(self, snapshot: Snapshot) -> None:
        """Continue from a snapshot taken with the same body, rate, gravity and integrator: the same bits follow."""
        self._install(snapshot.wrench)
        self._state[:] = snapshot.state
        self.steps = snapshot.steps
        self._expiry = snapshot.expiry
        if self._origin is not None:
            steps, state = snapshot.origin or (snapshot.steps, snapshot.state)
            self._origin = steps, np.array(state)

    def describe(self) -> str:
        """One line for the log: what is simulated, and how."""
        moments = ", ".join(f"{moment:.6g}" for moment in self.body.principal_moments)
        return (
            f"mass {self.body.mass:g} kg, principal moments [{moments}] kg m2, rate {self.rate:g} Hz, "
            f"integrator {self.integrator.name}{'' if compiled.ENABLED else ' (plain Python: numba is not in use)'}"
        )

    def _steps_held(self, hold: float) -> int:
        if not 0.0 < hold * self._rate <= MOST_STEPS_HELD:
            raise ValueError(
                f"hold {hold:g} s is not a time greater than zero and of at most {MOST_STEPS_HELD:g} steps; "
                "leave it out to hold for ever"
            )
        return max(1, round(hold * self._rate))

    def _check_resistance(self) -> None:
        if (self._tethers or any(self._drag.values)) and not self.integrator.resisted:
            able = ", ".join(name for name, one in integrators.REGISTRY.items() if one.resisted)
            raise ValueError(f"integrator {self.integrator.name!r} leaves out drag and tethers; choose one of {able}")
        if not 1e-13 <= self._rtol <= 1.0:
            raise ValueError(f"rtol {self._rtol:g} is not between 1e-13 and 1; try 1e-9")

    def _new_model(self, wrench: Wrench) -> NDArray:
        return new_model(self.body, self.gravity, wrench, self._drag, self._tethers, self._rtol)

    def _step_from_origin(self, n: int) -> int:
        """Advance by n steps in one evaluation from where the wrench last changed; return how many were done."""
        steps, state = self._origin
        self._state[:] = state
        since = self.steps - steps
        return self._steps_kernel(self._state, self._model, self._work, self._h, since + n) - since

    def _install(self, wrench: Wrench) -> None:
        refusal = self.integrator.refusal(wrench)
        if refusal:
            raise ValueError(refusal)
        self._origin = (self.steps, self._state.copy()) if self.integrator.one_evaluation else None
        self._model = self._new_model(wrench)
        self._model_bytes = memoryview(self._model).cast("B")
        self._wrench = wrench
        self._expiry: int | None = None
        # Whether twelve numbers are all that another wrench changes: no points, and an integrator that takes any.
        self._plain = not (wrench.points or self.integrator.torque_free_only or self.integrator.one_evaluation)

    def _why_stopped(self) -> str:
        state = self.state
        spin, speed = math.hypot(*state.angular_velocity), math.hypot(*state.velocity)  # norms that cannot overflow
        return (
            f"step {self.steps + 1} cannot be done: the state would not be finite, would turn by more than about "
            "1e5 rad in one step, or drag or a tether is too stiff or rings too fast for the integrator and its rtol; "
            f"the last good state is kept (spin {spin:.3g} rad/s, speed {speed:.3g} m/s, "
            f"held {self._wrench!r}); use a smaller wrench or a higher rate"
        )
