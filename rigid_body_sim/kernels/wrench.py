"""The held wrench as kernels see it: reduced to principal axes and carried vectors, and its force and torque."""

import math

from .arrays import Floats
from .compiled import kernel
from .model import (
    ARMS,
    CARRIED,
    CENTER_OF_MASS,
    FORCE,
    FORCE_WORLD,
    GRAVITY,
    LEVER_SIZE,
    LEVERS,
    MASS,
    N_CARRIED,
    N_LEVERS,
    ONLY_WORLD_TORQUE,
    TORQUE,
    WRENCH,
    to_principal,
)
from .vectors import cross, qrotate, qrotate_back


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
    if model[N_LEVERS] == 0.0:
        _carry_world_torque(model)
    else:
        _carry_levers(model)


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
def _carry_levers(model: Floats) -> None:
    """Carried vectors for levers: the common direction of their vectors, or the three world axes."""
    n = int(model[N_LEVERS])
    for k in range(n):
        p = LEVERS + LEVER_SIZE * k
        for i in range(3):
            model[FORCE_WORLD + i] += model[p + 6] * model[p + 3 + i]
    for i in range(27):
        model[ARMS + i] = 0.0
    parallel = _levers_are_parallel(model, n)
    for i in range(9):
        model[CARRIED + i] = 1.0 if i % 4 == 0 else 0.0
    model[N_CARRIED] = 1.0 if parallel else 3.0
    if parallel:
        for i in range(3):
            model[CARRIED + i] = model[LEVERS + 3 + i]
    for k in range(n):
        _add_arms(model, k, parallel)
    if not parallel:
        for axis in range(3):
            for i in range(3):
                model[ARMS + 9 * axis + 4 * i] += model[WRENCH + 9 + axis]


@kernel
def _levers_are_parallel(model: Floats, n: int) -> bool:
    """Whether all levers' vectors lie along the first one, exactly, and no world torque needs carrying beside them."""
    for i in range(3):
        if model[WRENCH + 9 + i] != 0.0:
            return False
    p = LEVERS + 3
    largest = max(abs(model[p]), abs(model[p + 1]), abs(model[p + 2]))
    if largest == 0.0:
        return False
    # By a power of two, which rounds nothing: products with a tiny force would vanish, with a huge one overflow.
    unit = math.ldexp(1.0, max(-1000, min(1000, -math.frexp(largest)[1])))
    fx, fy, fz = unit * model[p], unit * model[p + 1], unit * model[p + 2]
    for k in range(1, n):
        a = p + LEVER_SIZE * k
        x, y, z = cross(fx, fy, fz, model[a], model[a + 1], model[a + 2])
        if x != 0.0 or y != 0.0 or z != 0.0:
            return False
    return True


@kernel
def _add_arms(model: Floats, k: int, parallel: bool) -> None:
    """Add the skew matrix of lever k's arm, a force's from the centre of mass, to each A_i, weighted along B_i."""
    p = LEVERS + LEVER_SIZE * k
    c, at = CENTER_OF_MASS, model[p + 6]
    x, y, z = to_principal(
        model, model[p] - at * model[c], model[p + 1] - at * model[c + 1], model[p + 2] - at * model[c + 2]
    )
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
