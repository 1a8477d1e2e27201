"""The kernels' view of a body and its held wrench: one flat array, and the forces and torques that follow from it.

The array holds what is given (body, gravity, wrench in the axes in which it was given) and, from ``REDUCED`` on, what
``reduce_wrench`` makes of it: everything about the centre of mass and in principal axes.

A torque that is fixed in the world, or comes from a world-axes force at a body-fixed point, is linear in the world axes
seen from the body. So any number of them is ``Σ_i A_i Rᵀ B_i`` with at most three *carried vectors* B_i (world) and
matrices A_i (principal axes): one carried vector when all are parallel, the three world axes otherwise.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Floats
from .body import Body
from .compiled import kernel
from .resistance import NO_DRAG, TETHER_SIZE, Drag, Tether
from .rotation import cross, qrotate, qrotate_back
from .wrench import PointForce, Wrench

MASS = 0
MOMENTS = 1  # principal moments, 3
Q_BODY_PRINCIPAL = 4  # 4
CENTER_OF_MASS = 8  # body axes, 3
GRAVITY = 11  # world, 3
WRENCH = 14  # the twelve values of Wrench.values
N_POINTS = 26
EULER = 27  # (I_y − I_z) / I_x and its cyclic companions, the coefficients of Euler's equation (theory 2.5.6), 3
RESISTED = 30  # 1 when drag or a tether acts
DRAG = 31  # the twelve coefficients of resistance.Drag.values
N_TETHERS = 43
TETHERS_AT = 44  # where the tethers begin, behind the points
RTOL = 45  # relative error that an error-controlled integrator may make in a step
MOST_MOMENTUM = 46  # kg m/s: up to this P no component of the velocity exceeds FASTEST
SAFE_ANGULAR_MOMENTUM = 47  # kg m²/s: up to this L no component of any velocity exceeds FASTEST, whatever the attitude
REDUCED = 48
FORCE = REDUCED  # force in principal axes, 3
TORQUE = REDUCED + 3  # torque about the centre of mass in principal axes, 3
FORCE_WORLD = REDUCED + 6  # force in world axes, gravity included, 3
N_CARRIED = REDUCED + 9
ONLY_WORLD_TORQUE = REDUCED + 10  # 1 when all torque is fixed in the world: L is then a closed form
CARRIED = REDUCED + 11  # B_i, world, 3 x 3
ARMS = REDUCED + 20  # A_i, 3 x 9
POINTS = REDUCED + 47  # point (body axes from the origin) and force (world), 6 each

FASTEST = 1e307  # m/s, rad/s: a velocity beyond it may have no finite components in other axes


def new_model(
    body: Body,
    gravity: ArrayLike,
    wrench: Wrench,
    drag: Drag = NO_DRAG,
    tethers: Sequence[Tether] = (),
    rtol: float = 1e-9,
    forces: Sequence[PointForce] = (),
) -> Floats:
    """Model array for a body [SI, body axes], gravity [m/s², world], a held wrench, drag, tethers and constant forces.

    Constant forces are points that act beside those of the wrench, whichever it is.
    """
    points = (*wrench.points, *forces)
    tethers_at = POINTS + 6 * len(points)
    model = np.zeros(tethers_at + TETHER_SIZE * len(tethers))
    model[MASS] = body.mass
    model[MOMENTS : MOMENTS + 3] = body.principal_moments
    model[Q_BODY_PRINCIPAL : Q_BODY_PRINCIPAL + 4] = body.q_body_principal
    model[CENTER_OF_MASS : CENTER_OF_MASS + 3] = body.center_of_mass
    model[GRAVITY : GRAVITY + 3] = gravity
    model[WRENCH : WRENCH + 12] = wrench.values
    model[N_POINTS] = len(points)
    model[POINTS:tethers_at] = np.ravel(points)
    model[DRAG : DRAG + 12] = drag.values
    model[N_TETHERS], model[TETHERS_AT] = len(tethers), tethers_at
    for k, tether in enumerate(tethers):
        row = tethers_at + TETHER_SIZE * k
        model[row : row + TETHER_SIZE] = tether.row(body.center_of_mass)
    model[RESISTED] = 1.0 if tethers or any(drag.values) else 0.0
    model[RTOL] = rtol
    x, y, z = map(float, body.principal_moments)
    model[EULER : EULER + 3] = (y - z) / x, (z - x) / y, (x - y) / z
    model[MOST_MOMENTUM] = FASTEST * body.mass
    model[SAFE_ANGULAR_MOMENTUM] = FASTEST * min(x, y, z) / (1.0 + math.hypot(*body.center_of_mass))
    return model


@kernel
def to_principal(model: Floats, vx: float, vy: float, vz: float) -> tuple[float, float, float]:
    """Body axes → principal axes."""
    i = Q_BODY_PRINCIPAL
    return qrotate_back(model[i], model[i + 1], model[i + 2], model[i + 3], vx, vy, vz)


@kernel
def to_body(model: Floats, vx: float, vy: float, vz: float) -> tuple[float, float, float]:
    """Principal axes → body axes."""
    i = Q_BODY_PRINCIPAL
    return qrotate(model[i], model[i + 1], model[i + 2], model[i + 3], vx, vy, vz)


@kernel
def reduce_wrench(model: Floats) -> None:
    """Fill the reduced part: body-axes wrench about the centre of mass, sum of world forces, carried vectors."""
    w = WRENCH
    c = CENTER_OF_MASS
    fx, fy, fz = model[w], model[w + 1], model[w + 2]
    mx, my, mz = cross(model[c], model[c + 1], model[c + 2], fx, fy, fz)
    model[FORCE], model[FORCE + 1], model[FORCE + 2] = to_principal(model, fx, fy, fz)
    model[TORQUE], model[TORQUE + 1], model[TORQUE + 2] = to_principal(
        model, model[w + 3] - mx, model[w + 4] - my, model[w + 5] - mz
    )
    for i in range(3):
        model[FORCE_WORLD + i] = model[w + 6 + i] + model[MASS] * model[GRAVITY + i]
    model[ONLY_WORLD_TORQUE] = 0.0
    if model[N_POINTS] == 0.0:
        _carry_world_torque(model)
    else:
        _carry_point_forces(model)


@kernel
def _carry_world_torque(model: Floats) -> None:
    w = WRENCH + 9
    model[N_CARRIED] = 0.0
    if model[w] != 0.0 or model[w + 1] != 0.0 or model[w + 2] != 0.0:
        model[N_CARRIED] = 1.0
    for i in range(9):
        model[ARMS + i] = 1.0 if i % 4 == 0 else 0.0
    for i in range(3):
        model[CARRIED + i] = model[w + i]
    if model[TORQUE] == 0.0 and model[TORQUE + 1] == 0.0 and model[TORQUE + 2] == 0.0:
        model[ONLY_WORLD_TORQUE] = 1.0


@kernel
def _carry_point_forces(model: Floats) -> None:
    """Carried vectors for world-axes forces at points: their common direction, or the three world axes."""
    n = int(model[N_POINTS])
    for k in range(n):
        for i in range(3):
            model[FORCE_WORLD + i] += model[POINTS + 6 * k + 3 + i]
    for i in range(27):
        model[ARMS + i] = 0.0
    parallel = _points_are_parallel(model, n)
    for i in range(9):
        model[CARRIED + i] = 1.0 if i % 4 == 0 else 0.0
    model[N_CARRIED] = 1.0 if parallel else 3.0
    if parallel:
        for i in range(3):
            model[CARRIED + i] = model[POINTS + 3 + i]
    for k in range(n):
        _add_arms(model, k, parallel)
    if not parallel:
        for axis in range(3):
            for i in range(3):
                model[ARMS + 9 * axis + 4 * i] += model[WRENCH + 9 + axis]


@kernel
def _points_are_parallel(model: Floats, n: int) -> bool:
    """Whether all forces at points lie along the first one, exactly, and no world torque needs carrying beside them."""
    for i in range(3):
        if model[WRENCH + 9 + i] != 0.0:
            return False
    p = POINTS + 3
    largest = max(abs(model[p]), abs(model[p + 1]), abs(model[p + 2]))
    if largest == 0.0:
        return False
    # By a power of two, which rounds nothing: products with a tiny force would vanish, with a huge one overflow.
    unit = math.ldexp(1.0, max(-1000, min(1000, -math.frexp(largest)[1])))
    fx, fy, fz = unit * model[p], unit * model[p + 1], unit * model[p + 2]
    for k in range(1, n):
        a = p + 6 * k
        x, y, z = cross(fx, fy, fz, model[a], model[a + 1], model[a + 2])
        if x != 0.0 or y != 0.0 or z != 0.0:
            return False
    return True


@kernel
def _add_arms(model: Floats, k: int, parallel: bool) -> None:
    """Add point k's skew matrix of its arm from the centre of mass to each A_i, weighted by the force along B_i."""
    p = POINTS + 6 * k
    c = CENTER_OF_MASS
    x, y, z = to_principal(model, model[p] - model[c], model[p + 1] - model[c + 1], model[p + 2] - model[c + 2])
    for i in range(1 if parallel else 3):
        # The force along B_i, which is parallel to it or an axis: from B_i's largest component.
        b, j = CARRIED + 3 * i, 0
        for other in range(1, 3):
            if abs(model[b + other]) > abs(model[b + j]):
                j = other
        weight = model[p + 3 + j] / model[b + j]
        a = ARMS + 9 * i
        model[a + 1] -= weight * z
        model[a + 2] += weight * y
        model[a + 3] += weight * z
        model[a + 5] -= weight * x
        model[a + 6] -= weight * y
        model[a + 7] += weight * x


@kernel
def arm_torque(model: Floats, i: int, bx: float, by: float, bz: float) -> tuple[float, float, float]:
    """A_i b: the torque (principal axes) of carried vector i whose components in principal axes are b."""
    a = ARMS + 9 * i
    return (
        model[a] * bx + model[a + 1] * by + model[a + 2] * bz,
        model[a + 3] * bx + model[a + 4] * by + model[a + 5] * bz,
        model[a + 6] * bx + model[a + 7] * by + model[a + 8] * bz,
    )


@kernel
def torque_principal(model: Floats, qw: float, qx: float, qy: float, qz: float) -> tuple[float, float, float]:
    """Whole torque about the centre of mass, in principal axes, at the attitude q (principal axes → world)."""
    tx, ty, tz = model[TORQUE], model[TORQUE + 1], model[TORQUE + 2]
    for i in range(int(model[N_CARRIED])):
        b = CARRIED + 3 * i
        bx, by, bz = qrotate_back(qw, qx, qy, qz, model[b], model[b + 1], model[b + 2])
        ax, ay, az = arm_torque(model, i, bx, by, bz)
        tx, ty, tz = tx + ax, ty + ay, tz + az
    return tx, ty, tz


@kernel
def force_world(model: Floats, qw: float, qx: float, qy: float, qz: float) -> tuple[float, float, float]:
    """Whole force, in world axes, at the attitude q (principal axes → world)."""
    fx, fy, fz = qrotate(qw, qx, qy, qz, model[FORCE], model[FORCE + 1], model[FORCE + 2])
    return fx + model[FORCE_WORLD], fy + model[FORCE_WORLD + 1], fz + model[FORCE_WORLD + 2]


@kernel
def rates_principal(
    model: Floats, qw: float, qx: float, qy: float, qz: float, lx: float, ly: float, lz: float
) -> tuple[float, float, float]:
    """Angular velocity in principal axes from the angular momentum L in the world: ω = I₀⁻¹ Rᵀ L, theory (2.4.3)."""
    x, y, z = qrotate_back(qw, qx, qy, qz, lx, ly, lz)
    return x / model[MOMENTS], y / model[MOMENTS + 1], z / model[MOMENTS + 2]
