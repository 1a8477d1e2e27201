"""A hundred million steps: how round-off adds up. Brouwer's law (Astron. J. 46 (1937) 149): as √steps at the best.

Two problems, from random states. A heavy asymmetric top, in which nothing has a closed form but the energy: a force in
world axes at a body point and its opposite at the centre of mass. A symmetric body without torque, whose attitude after
any time is, with L constant,

    q(t) = exp(½ t L / I₁) ⊗ q(0) ⊗ exp(½ t (1/I₃ − 1/I₁) L₃ e₃),

evaluated by mpmath with 40 digits.
"""

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ...kernels.arrays import Floats
from ...simulation import Simulation
from ...theory import invariants
from ...values import rotation
from ...values.body import Body
from ...values.state import State
from ...values.wrench import Wrench
from ..reference.quaternions import product

RATE = 1000.0  # Hz
SPIN = 20.0  # rad/s: 0.02 rad in a step
TOP = Body(1.0, (0.03, 0.04, 0.05))
WEIGHT = (0.0, 0.0, -9.80665)  # N
POINT = (0.01, -0.02, 0.1)  # m
SYMMETRIC = Body(1.0, (0.03, 0.03, 0.05))
DIGITS = 40


def checkpoints(most: int) -> list[int]:
    """Numbers of steps at which errors are looked at: two a decade, up to ``most``."""
    return [round(10 ** (k / 2)) for k in range(4, round(2 * math.log10(most)) + 1)]


def start(seed: int) -> State:
    """A random attitude, and a spin of SPIN about a random axis."""
    random = np.random.default_rng(seed)
    axis = random.normal(size=3)
    return State(orientation=random.normal(size=4), angular_velocity=SPIN * axis / np.linalg.norm(axis))


def energy_errors(integrator: str, seed: int, most: int) -> dict[str, list[Any]]:
    """Relative energy error of the heavy top at the checkpoints."""
    simulation = Simulation(TOP, start(seed), rate=RATE, integrator=integrator)
    force = np.array(WEIGHT)
    simulation.set_wrench(Wrench(force_world=(-force).tolist(), points=[(POINT, WEIGHT)]))

    def energy() -> float:
        state = simulation.state
        potential = -float(force @ rotation.rotate(state.orientation, POINT))
        return invariants.kinetic_energy(TOP, state) + potential

    begin = energy()
    size = invariants.kinetic_energy(TOP, simulation.state)
    return _errors(simulation, most, lambda: abs(energy() - begin) / size)


def attitude_errors(integrator: str, seed: int, most: int) -> dict[str, list[Any]]:
    """Error of the attitude [rad] of the symmetric body at the checkpoints."""
    simulation = Simulation(SYMMETRIC, start(seed), rate=RATE, integrator=integrator)
    q0, w_body = simulation.state.orientation, simulation.initial_state.angular_velocity

    def error() -> float:
        true = closed_form(q0, w_body, simulation.steps)
        return rotation.angle_between(true, simulation.state.orientation)

    return _errors(simulation, most, error)


def _errors(simulation: Simulation, most: int, error: Callable[[], float]) -> dict[str, list[Any]]:
    moments = checkpoints(most)
    return {"steps": moments, "errors": [error() for _ in _advance(simulation, moments)]}


def _advance(simulation: Simulation, moments: list[int]) -> Iterator[int]:
    for before, moment in itertools.pairwise([0, *moments]):
        simulation.step(moment - before)
        yield moment


def closed_form(q0: Floats, w_body: Floats, steps: int) -> Floats:
    """Attitude (4,) of the symmetric body after steps of 1 / RATE, from mpmath."""
    from mpmath import mp, mpf

    with mp.workdps(DIGITS):
        t = steps * mpf(1.0 / RATE)
        i1, _, i3 = (mpf(moment) for moment in SYMMETRIC.principal_moments.tolist())
        wx, wy, wz = (mpf(rate) for rate in w_body.tolist())
        # exp(½ t L / I₁) q₀ = q₀ exp(½ t l / I₁), with l = I₀ ω in the body
        turn = product(_exponential(t * wx, t * wy, t * wz * i3 / i1), _exponential(0, 0, t * wz * (1 - i3 / i1)))
        return np.array([float(c) for c in product([mpf(c) for c in q0.tolist()], turn)])


def _exponential(x: Any, y: Any, z: Any) -> list[Any]:
    """The rotation by the rotation vector (x, y, z), as a list (w, x, y, z) of mpmath numbers."""
    from mpmath import mp

    angle = mp.sqrt(x * x + y * y + z * z)
    share = mp.sin(angle / 2) / angle if angle else mp.mpf(1) / 2
    return [mp.cos(angle / 2), share * x, share * y, share * z]


def exponent(steps: list[int], errors: list[float], least: int) -> float:
    """p of errors that grow as steps^p: the slope of the best straight line in logarithms, from ``least`` steps on."""
    pairs = zip(steps, errors, strict=True)
    used = [(math.log(n), math.log(error)) for n, error in pairs if n >= least and error > 0.0]
    x, y = zip(*used, strict=True)
    return float(np.polyfit(x, y, 1)[0])


def together(runs: Sequence[Mapping[str, Any]]) -> tuple[list[int], list[float]]:
    """Steps, and the root mean square of the errors of several runs."""
    return runs[0]["steps"], np.sqrt(np.mean(np.square([run["errors"] for run in runs]), axis=0)).tolist()
