"""Kernels of sensors: what an inertial unit feels where it is mounted, and noise that is found at any sample at once.

Nothing is drawn in an order: every random number is that of a key and of the sample for which it stands (see noise).
"""

import math

import numpy as np

from .arrays import Floats
from .compiled import kernel
from .noise import normals
from .tuples import NOTHING, Quat, Vec, crossed, minus, plus, rotate_back, scaled

# Of the numbers of a group of values, then what random_walk keeps:
WHITE, WALK, BIAS, QUANTIZATION, RANGE, NODES = 0, 1, 2, 5, 6, 7
_LEVELS = 54  # of the powers of two, and as many again of the halvings below one
_NODE = 4  # its sample, and three numbers
SIZE = NODES + 2 * _LEVELS * _NODE
STREAM = 2  # of noise; that of gusts is 1

Numbers = tuple[float, ...]


@kernel
def inertial(motion: Numbers, acceleration: Numbers, gravity: Numbers, mount: Numbers) -> Numbers:
    """ω [rad/s] and specific force [m/s²] at the point r of the body, in the axes of what is mounted there, 6 numbers.

    ``motion`` and ``acceleration`` are those of Simulation; ``mount`` is r [m] and the quaternion w, x, y, z that takes
    components in its axes to body axes. With a_o the acceleration of the body frame's origin and g that of free fall,
    f = R_sensor_body (R_body_world (a_o − g) + ω' × r + ω × (ω × r)): the acceleration of the point by the derivative
    of x_o + R r, less g.
    """
    q = Quat(motion[3], motion[4], motion[5], motion[6])
    w = Vec(motion[16], motion[17], motion[18])
    a, dw = (
        Vec(acceleration[0], acceleration[1], acceleration[2]),
        Vec(acceleration[3], acceleration[4], acceleration[5]),
    )
    r, turn = Vec(mount[0], mount[1], mount[2]), Quat(mount[3], mount[4], mount[5], mount[6])
    free = rotate_back(q, minus(a, Vec(gravity[0], gravity[1], gravity[2])))
    f = rotate_back(turn, plus(free, plus(crossed(dw, r), crossed(w, crossed(w, r)))))
    w = rotate_back(turn, w)
    return w.x, w.y, w.z, f.x, f.y, f.z


@kernel
def _node(row: Floats, level: int, sample: int, key: int, block: int) -> Vec:
    """Three standard normal numbers of a sample; what was drawn last at this level is kept, as the next one needs most.

    That saves time and changes no bit.
    """
    at = NODES + _NODE * level
    if row[at] != sample:
        z = normals(key, sample, block, STREAM)
        row[at], row[at + 1], row[at + 2], row[at + 3] = float(sample), z.a, z.b, z.c
    return Vec(row[at + 1], row[at + 2], row[at + 3])


@kernel
def random_walk(row: Floats, key: int, sample: int, block: int) -> Vec:
    """Three independent random walks W at a sample k ≥ 0: W(0) = 0, steps of variance 1, covariance min(j, k).

    By P. Lévy's construction (Karatzas and Shreve, Brownian Motion and Stochastic Calculus, 2.3) on whole numbers:
    W(2a) = W(a) + √a Z for powers of two, and in the middle of a and b between them
    W = (W(a) + W(b)) / 2 + √(b − a) / 2 Z, each with the Z of its own sample, in O(log k).
    """
    if sample == 0:
        return NOTHING
    a, w_a, b, w_b, level = 0, NOTHING, 1, _node(row, 0, 1, key, block), 0
    while b < sample:
        level += 1
        a, w_a = b, w_b
        b = 2 * a
        w_b = plus(w_a, scaled(math.sqrt(float(a)), _node(row, level, b, key, block)))
    level = _LEVELS
    while b > sample:
        middle = (a + b) // 2
        z = _node(row, level, middle, key, block)
        w = plus(scaled(0.5, plus(w_a, w_b)), scaled(0.5 * math.sqrt(float(b - a)), z))
        level += 1
        if middle < sample:
            a, w_a = middle, w
        else:
            b, w_b = middle, w
    return w_b


@kernel
def _shown(value: float, row: Floats) -> float:
    """The nearest multiple of the quantization, and within the range."""
    if row[QUANTIZATION] > 0.0:
        value = row[QUANTIZATION] * np.rint(value / row[QUANTIZATION])
    if row[RANGE] > 0.0:
        value = min(max(value, -row[RANGE]), row[RANGE])
    return float(value)


@kernel
def disturbed(x: float, y: float, z: float, row: Floats, key: int, sample: int, block: int) -> Vec:
    """Three values of a group as they are shown: with bias, walk and white noise, quantized, and within a range."""
    value = plus(Vec(x, y, z), Vec(row[BIAS], row[BIAS + 1], row[BIAS + 2]))
    if row[WALK] > 0.0:
        value = plus(value, scaled(row[WALK], random_walk(row, key, sample, block + 1)))
    if row[WHITE] > 0.0:
        white = normals(key, sample, block, STREAM)
        value = plus(value, scaled(row[WHITE], Vec(white.a, white.b, white.c)))
    return Vec(_shown(value.x, row), _shown(value.y, row), _shown(value.z, row))
