"""What stiff scenes cost: rosenbrock beside SciPy's Radau at equal achieved accuracy, in one run.

Radau integrates (x, q, P, L) with a right-hand side in numpy, as a user would write it, and is given the exact
Jacobian (from the kernel that rosenbrock uses). Each is run at several tolerances; a row compares a run of Radau with
the cheapest of ours that is at least as accurate.
"""

import math
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from rigid_body_sim.command_line import takes_nothing
from rigid_body_sim.effects.drag import NO_DRAG, Drag
from rigid_body_sim.effects.tether import Tether
from rigid_body_sim.kernels import motion
from rigid_body_sim.kernels.arrays import Floats
from rigid_body_sim.kernels.state import LOW
from rigid_body_sim.kernels.wrench import reduce_wrench
from rigid_body_sim.simulation import Simulation
from rigid_body_sim.terms import Terms
from rigid_body_sim.values.body import Body
from rigid_body_sim.values.rotation import multiply, skew, to_matrix
from rigid_body_sim.values.state import State, flatten
from rigid_body_sim.values.wrench import Wrench

GRAVITY = np.array((0.0, 0.0, -9.80665))  # m/s²
RATE = 10.0  # Hz
SECONDS = 2.0
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
REFERENCE_RTOL = 1e-11
ROUNDS = 3


@dataclass(frozen=True)
class Scene:
    """A body with principal axes as body axes, and what resists its motion."""

    state: State
    drag: Drag = NO_DRAG
    tethers: tuple[Tether, ...] = ()
    force_world: tuple[float, float, float] = (0.0, 0.0, 0.0)
    mass: float = 2.0
    moments: tuple[float, float, float] = (0.1, 0.2, 0.25)

    @property
    def body(self) -> Body:
        """Its body."""
        return Body(self.mass, self.moments)


_MOVING = State((0.0, 0.0, 0.0), (1.0, 2.0, 3.0, 4.0), (1.0, -0.5, 0.3), (1.0, 2.0, -0.5))
SCENES = {
    "vehicle, damped at 1e3 1/s": Scene(
        _MOVING, Drag((2e3, 3e3, 4e3), (4.0, 5.0, 6.0), (1e2, 2e2, 2e2), (0.1, 0.1, 0.2)), force_world=(2e3, 1e3, 5e2)
    ),
    "vehicle, damped at 1e6 1/s": Scene(
        _MOVING, Drag((2e6, 3e6, 4e6), (4.0, 5.0, 6.0), (1e5, 2e5, 2e5), (0.1, 0.1, 0.2)), force_world=(2e6, 1e6, 5e5)
    ),
    "tether of 300 rad/s, swing": Scene(
        State((0.3, 0.0, -0.93)),
        Drag((0.5,) * 3, angular_linear=(0.05,) * 3),
        (Tether((0.0, 0.0, 0.2), (0.0, 0.0, 0.0), 0.78, 2.0 * 300.0**2, 2.0 * 300.0, False),),
    ),
}


def rosenbrock(scene: Scene, rtol: float) -> Callable[[], Floats]:
    """What runs rosenbrock to the end and gives the state (x, q, P, L) there, shape (13,)."""
    sim = Simulation(
        scene.body,
        scene.state,
        rate=RATE,
        gravity=GRAVITY,
        integrator="rosenbrock",
        drag=scene.drag,
        tethers=scene.tethers,
        rtol=rtol,
    )
    sim.set_wrench(Wrench(force_world=scene.force_world))

    def run() -> Floats:
        sim.step(round(SECONDS * RATE))
        return np.array(sim.save().state[:LOW])

    return run


def right_hand_side(scene: Scene) -> Callable[[float, Floats], Floats]:
    """dY/dt of Y = (x, q, P, L) in numpy."""
    drag, force = scene.drag, np.array(scene.force_world) + scene.mass * GRAVITY
    moments = np.array(scene.moments)
    linear, quadratic, angular, angular_quadratic = np.reshape(drag.values, (4, 3))

    def slope(_: float, y: Floats) -> Floats:
        q = y[3:7] / math.sqrt(y[3:7] @ y[3:7])
        R = to_matrix(q)
        v_body, w_body = R.T @ y[7:10] / scene.mass, (R.T @ y[10:13]) / moments
        total = force - R @ ((linear + quadratic * np.abs(v_body)) * v_body)
        torque = -R @ ((angular + angular_quadratic * np.abs(w_body)) * w_body)
        for tether in scene.tethers:
            arm = R @ tether.body_point
            away = y[0:3] + arm - tether.anchor
            length = math.sqrt(away @ away)
            u = y[7:10] / scene.mass + np.cross(R @ w_body, arm)
            tension = tether.stiffness * (length - tether.rest_length) + tether.damping * (u @ away) / length
            pull = -tension / length * away
            total, torque = total + pull, torque + np.cross(arm, pull)
        return np.concatenate((y[7:10] / scene.mass, 0.5 * multiply(y[3:7], (0.0, *w_body)), total, torque))

    return slope


def exact_jacobian(scene: Scene) -> Callable[[float, Floats], Floats]:
    """The Jacobian of ``right_hand_side``, 13 x 13, from that of motion.jacobian: δq = ½ E b and q' = ½ E ω."""
    terms = Terms(scene.body, GRAVITY, drag=scene.drag, tethers=scene.tethers)
    model = terms.model(Wrench(force_world=scene.force_world))
    reduce_wrench(model)
    flat = np.zeros(144)

    def jacobian(_: float, y: Floats) -> Floats:
        motion.jacobian(terms.kernels, model, y, 0, False, flat, 0)
        rows = flat.reshape(12, 12)
        w = rows[3:6, 9:12] @ y[10:13]
        E = np.vstack((-y[4:7], y[3] * np.eye(3) - skew(y[4:7])))
        rates = rows[3:6].copy()
        rates[:, 3:6] -= 0.5 * skew(w)
        found = np.vstack((rows[0:3], 0.5 * E @ rates, rows[6:12]))
        found = np.hstack((found[:, 0:3], 2.0 * found[:, 3:6] @ E.T, found[:, 6:12]))
        found[3, 4:7] -= 0.5 * w
        found[4:7, 3] += 0.5 * w
        found[4:7, 4:7] += 0.5 * skew(w)
        return found

    return jacobian


def radau(scene: Scene, rtol: float) -> Callable[[], Floats]:
    """The same by SciPy's Radau with the exact Jacobian; its absolute tolerance is a tenth of the relative."""
    model = Terms(scene.body, GRAVITY).model(Wrench())
    begin = flatten(scene.state, model)[:LOW]
    slope, jacobian = right_hand_side(scene), exact_jacobian(scene)
    options = {"method": "Radau", "rtol": rtol, "atol": 0.1 * rtol, "jac": jacobian}
    return lambda: solve_ivp(slope, (0.0, SECONDS), begin, **options).y[:, -1]


def measured(
    method: Callable[[Scene, float], Callable[[], Floats]], scene: Scene, exact: Floats
) -> list[tuple[float, float]]:
    """Error (largest of position [m], quaternion and velocities) and CPU time [s] at each tolerance."""
    weights = 1.0 / np.array((1.0,) * 7 + (scene.mass,) * 3 + (min(scene.moments),) * 3)
    found = []
    for rtol in TOLERANCES:
        times = []
        for _ in range(ROUNDS):
            run = method(scene, rtol)
            begin = time.process_time()
            end = run()
            times.append(time.process_time() - begin)
        found.append((float(np.abs((end - exact) * weights).max()), min(times)))
    return found


def main(args: Sequence[str] | None = None) -> int:
    """Print error, time and ratio of each scene."""
    takes_nothing("stiff_cost", "Measures stiff scenes beside SciPy's Radau.", args)
    print("Stiff scenes: 2 s, CPU time of SciPy's Radau beside the cheapest rosenbrock that is at least as accurate")
    for name, scene in SCENES.items():
        exact = rosenbrock(scene, REFERENCE_RTOL)()
        ours = measured(rosenbrock, scene, exact)
        print(f"  {name}")
        for error, seconds in measured(radau, scene, exact):
            able = [one for one in ours if one[0] <= error]
            best = min(able, key=lambda one: one[1], default=None)
            shown = f"rosenbrock {best[0]:.1e} {1e3 * best[1]:7.2f} ms   {seconds / best[1]:5.0f} x" if best else "none"
            print(f"    Radau {error:.1e} {1e3 * seconds:8.1f} ms   {shown}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
