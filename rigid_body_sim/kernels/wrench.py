"""The held wrench as kernels see it: reduced to principal axes and carried vectors, and its force and torque."""

import math
from array import array
from collections.abc import Sequence
from typing import Any

from .arrays import Floats, Vector, python_floats
from .compiled import kernel
from .model import (
    ALONG_AXES,
    ALONG_FIRST,
    ARM_ROWS,
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
    PARALLEL,
    TORQUE,
    WRENCH,
    to_principal,
)
from .straight_line import straight_line
from .vectors import cross, power_of_two, qrotate, qrotate_back

_IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
_NOTHING = (0.0,) * 6


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
    turned = model[w + 9] != 0.0 or model[w + 10] != 0.0 or model[w + 11] != 0.0
    if model[N_LEVERS] == 0.0:
        for i in range(3):
            model[CARRIED + i] = model[w + 9 + i]
        model[N_CARRIED] = 1.0 if turned else 0.0
        if model[TORQUE] == 0.0 and model[TORQUE + 1] == 0.0 and model[TORQUE + 2] == 0.0:
            model[ONLY_WORLD_TORQUE] = 1.0
    else:
        _carry_levers(model, turned)
    for i in range(int(model[N_CARRIED])):
        _write_arm_rows(model, ARMS + 9 * i, ARM_ROWS + 12 * i)


@kernel
def _write_arm_rows(model: Floats, arm: int, to: int) -> None:
    for diagonal in range(3):
        for axis in range(3):
            model[to + 4 * diagonal + axis] = model[arm + 3 * axis + (axis + diagonal) % 3]
        model[to + 4 * diagonal + 3] = model[to + 4 * diagonal]


@kernel
def _carry_levers(model: Floats, turned: bool) -> None:
    """Carry the common direction of the levers' vectors, or the three world axes, and with those a world torque."""
    for k in range(int(model[N_LEVERS])):
        p = LEVERS + LEVER_SIZE * k
        for i in range(3):
            model[FORCE_WORLD + i] += model[p + 6] * model[p + 3 + i]
    one = model[PARALLEL] != 0.0 and not turned
    model[N_CARRIED] = 1.0 if one else 3.0
    block = ALONG_FIRST if one else ALONG_AXES
    for i in range(36):
        model[CARRIED + i] = model[block + i]
    if turned:
        for i in range(3):
            a, torque = ARMS + 9 * i, model[WRENCH + 9 + i]
            model[a], model[a + 4], model[a + 8] = model[a] + torque, model[a + 4] + torque, model[a + 8] + torque


def write_arms(model: Floats) -> None:
    """Fill what ``reduce_wrench`` needs and no wrench changes. No kernel: called for each new model."""
    numbers = python_floats(model)
    n = int(model[N_LEVERS])
    if n == 0:
        model[ARMS], model[ARMS + 4], model[ARMS + 8] = 1.0, 1.0, 1.0  # A torque is its own arm.
        return
    places = range(LEVERS, LEVERS + LEVER_SIZE * n, LEVER_SIZE)
    vectors = [tuple(numbers[p + 3 : p + 6]) for p in places]
    arms = [_arm_principal(numbers, p) for p in places]
    along_axes = [_skew(components, arms) for components in zip(*vectors, strict=True)]
    numbers[ALONG_AXES : ALONG_AXES + 36] = array("d", (*_IDENTITY, *along_axes[0], *along_axes[1], *along_axes[2]))
    first = vectors[0]
    if _are_parallel(vectors):
        numbers[PARALLEL] = 1.0
        j = max(range(3), key=lambda i: abs(first[i]))
        along_first = _skew([vector[j] / first[j] for vector in vectors], arms)
        numbers[ALONG_FIRST : ALONG_FIRST + 18] = array("d", (*first, *_NOTHING, *along_first))


def _arm_principal(model: Any, p: int) -> tuple[float, float, float]:
    """Arm of the lever at ``model[p]``, principal axes; a force's from the centre of mass."""
    c, is_force = CENTER_OF_MASS, model[p + 6]
    return to_principal(
        model,
        model[p] - is_force * model[c],
        model[p + 1] - is_force * model[c + 1],
        model[p + 2] - is_force * model[c + 2],
    )


def _are_parallel(vectors: Sequence[Sequence[float]]) -> bool:
    """Whether all lie along the first one, exactly."""
    largest = max(map(abs, vectors[0]))
    if largest == 0.0:
        return False
    # By a power of two, which rounds nothing: products with a tiny force would vanish, with a huge one overflow.
    unit = power_of_two(-math.frexp(largest)[1])
    x, y, z = (unit * component for component in vectors[0])
    return not any(any(cross(x, y, z, *other)) for other in vectors[1:])


def _skew(weights: Sequence[float], arms: Sequence[Vector]) -> tuple[float, ...]:
    """Skew matrix, row by row, of the weighted sum of the arms."""
    x = y = z = 0.0
    for weight, arm in zip(weights, arms, strict=True):
        x, y, z = x + weight * arm[0], y + weight * arm[1], z + weight * arm[2]
    return 0.0, 0.0 - z, y, z, 0.0, 0.0 - x, 0.0 - y, x, 0.0  # no minus zero


@straight_line
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


@straight_line
def force_world(model: Floats, qw: float, qx: float, qy: float, qz: float) -> tuple[float, float, float]:
    """Whole force, in world axes, at the attitude q (principal axes → world)."""
    fx, fy, fz = qrotate(qw, qx, qy, qz, model[FORCE], model[FORCE + 1], model[FORCE + 2])
    return fx + model[FORCE_WORLD], fy + model[FORCE_WORLD + 1], fz + model[FORCE_WORLD + 2]
