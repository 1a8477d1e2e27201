"""
Solve a few rigid-body problems with mpmath to more than 30 digits and write trajectories.json.

Run it with `python -m bench.reference.make_reference`, which takes a few minutes; with `--check` it
solves the beginning of one problem again, at lower cost, and compares it with the file. Needs only Python and mpmath.
The problems of the report are in make_report.py, which uses what is here.

The formulation is deliberately not that of the simulator: it has no principal axes, no momenta among its unknowns and
no special case, and nothing is imported from `rigid_body_sim`. With the centre of mass p [m, world], its velocity
v [m/s, world], the quaternion q (scalar first, body to world; R is its rotation matrix) and the angular velocity
w [rad/s, body], the Newton-Euler equations in the axes of the body frame, inertia I [kg m^2] about the centre of mass
and with products of inertia, are

    p' = v
    q' = 1/2 q (0, w)
    m v' = R (f_body + f_drag) + f_world + m g + sum_k F_k
    I w' = (I w) x w + t_body + t_drag - c x f_body + R^T t_world + sum_k (r_k - c) x (R^T F_k)

- c [m, body]: centre of mass, from the body frame's origin.
- f_body [N, body]: acts at the body frame's ORIGIN and turns with the body. f_world [N, world]: acts at the centre of
  mass. t_body [N m, body] and t_world [N m, world]: free vectors.
- F_k [N, world]: constant in the world, acts at the body-fixed point r_k [m, body, from the body frame's origin].
- g [m/s^2, world]: acts at the centre of mass.
- drag: f_drag,i = -(linear_i + quadratic_i |u_i|) u_i with u = R^T v, and t_drag,i = -(angular_linear_i +
  angular_quadratic_i |w_i|) w_i, body axes. It is smooth between zeros of u_i and w_i: a step ends at each of them.

Initial state and results belong to the body frame's origin: its position and velocity in the world, the orientation,
and the angular velocity in body axes. Momentum P = m v and angular momentum L = R I w (about the centre of mass) are
in world axes. Every parameter is the exact value of a double; times are exact decimals (0.1 s is one tenth). The
initial orientation is the quaternion of doubles, one to round-off, divided by its norm at full precision.

Method: the right-hand side is polynomial, so the Taylor coefficients of the solution follow from Cauchy products
one order at a time. Each step is as long as its last terms allow. Every problem is solved twice, with different order,
step and number of digits; both must agree, the balance of energy and of angular momentum must close, and the norm of q
must stay one.
"""

import argparse
import json
import math
import multiprocessing
import random
import re
import sys
import time
from fractions import Fraction

import mpmath
from mpmath import fdot as dot
from mpmath import mp, mpf

from . import DATA

FILE = DATA / "trajectories.json"
ACCURATE = (60, 56)  # decimal digits, order of the Taylor series; this solution is written to the file
CONTROL = (40, 40)  # the second solution, only compared
QUICK = (30, 30)  # the solution of --check
EXTRA_DIGITS = 5  # the last Taylor terms of a step are below 10^-(digits + EXTRA_DIGITS)
WANTED_AGREEMENT = mpf("1e-31")  # between ACCURATE and CONTROL, absolute, in SI units
WANTED_BALANCE = mpf("1e-50")  # energy [J], angular momentum [N m s] and norm of q in the ACCURATE solution
PRINTED_DIGITS = 35
ZERO = (0.0, 0.0, 0.0)
DRAG = ("linear", "quadratic", "angular_linear", "angular_quadratic")
LOOKS = 64  # points of a step at which signs are looked at
RESULTS = ("position", "orientation", "velocity", "angular_velocity", "momentum", "angular_momentum")


# --- the problems: plain doubles in SI units; times are exact decimals, hence strings -------------------------------


def wrench(until, force_body=ZERO, torque_body=ZERO, force_world=ZERO, torque_world=ZERO, points=()):
    """Hold forces [N] and torques [N m] until the time `until` [s]; `points`: pairs (r_k [m, body], F_k [N, world])."""
    return {
        "until": until,
        "force_body": list(force_body),
        "torque_body": list(torque_body),
        "force_world": list(force_world),
        "torque_world": list(torque_world),
        "points": [[list(point), list(force)] for point, force in points],
    }


def problem(
    about, mass, inertia, initial, wrenches, center_of_mass=ZERO, gravity=ZERO, times=("1", "2", "5", "10"), drag=None
):
    """
    Describe one problem.

    `inertia` is (ixx, iyy, izz, ixy, ixz, iyz) [kg m^2] about the centre of mass in body axes, with the matrix
    [[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]] as in URDF; `initial` is position [m, world], orientation
    (w, x, y, z), velocity of the origin [m/s, world], angular velocity [rad/s, body].
    """
    names = ("position", "orientation", "velocity", "angular_velocity")
    resisted = {"drag": {name: list(drag.get(name, ZERO)) for name in DRAG}} if drag else {}
    return {
        **resisted,
        "about": about,
        "body": {"mass": mass, "inertia": list(inertia), "center_of_mass": list(center_of_mass)},
        "gravity": list(gravity),
        "initial": {name: list(values) for name, values in zip(names, initial, strict=True)},
        "wrenches": wrenches,
        "times": list(times),
    }


def torque_free_middle_axis():
    return problem(
        "No force, no torque: a tumble close to the unstable middle axis; the centre of mass is off the origin.",
        mass=2.0,
        inertia=(0.1, 0.2, 0.3, 0.0, 0.0, 0.0),
        center_of_mass=(0.05, -0.02, 0.1),
        initial=((1.0, -2.0, 0.5), (0.5, -0.1, 0.7, 0.5), (0.3, 0.1, -0.2), (0.01, 3.0, 0.02)),
        wrenches=[wrench("10")],
    )


def body_wrench():
    return problem(
        "Constant force and torque in body axes on a body with three different moments of inertia.",
        mass=1.5,
        inertia=(0.12, 0.2, 0.27, 0.0, 0.0, 0.0),
        center_of_mass=(0.02, 0.03, -0.04),
        initial=((0.0, 0.0, 1.0), (0.8, 0.4, -0.4, 0.2), (0.5, 0.0, -0.1), (1.0, -0.5, 2.0)),
        wrenches=[wrench("10", force_body=(0.7, -0.3, 1.1), torque_body=(0.05, -0.02, 0.03))],
    )


def world_wrench():
    return problem(
        "Constant force at the centre of mass and free torque, both in world axes, on an asymmetric body.",
        mass=3.0,
        inertia=(0.15, 0.32, 0.4, 0.0, 0.0, 0.0),
        initial=((-1.0, 2.0, 3.0), (0.1, 0.9, -0.3, 0.3), (0.0, 0.4, 0.2), (0.5, 1.5, -1.0)),
        wrenches=[wrench("10", force_world=(0.4, -1.2, 0.9), torque_world=(0.06, 0.1, -0.08))],
    )


def heavy_top():
    return problem(
        "Symmetric top at about 20 rad/s: a constant downward force at one body-fixed point on the axis of symmetry.",
        mass=0.5,
        inertia=(0.002, 0.002, 0.003, 0.0, 0.0, 0.0),
        initial=((0.0, 0.0, 0.0), (0.9, 0.3, 0.1, -0.3), (0.0, 0.0, 0.0), (0.5, -0.3, 20.0)),
        wrenches=[wrench("10", points=[((0.0, 0.0, 0.05), (0.0, 0.0, -4.905))])],
    )


def asymmetric_top_two_points():
    return problem(
        "Asymmetric body under two constant world forces that are not parallel, at two body-fixed points.",
        mass=2.0,
        inertia=(0.11, 0.19, 0.26, 0.0, 0.0, 0.0),
        center_of_mass=(0.01, 0.0, -0.02),
        initial=((0.2, 0.1, 0.0), (0.7, -0.5, 0.5, 0.1), (0.1, 0.2, 0.3), (1.2, 0.8, -1.6)),
        wrenches=[wrench("10", points=[((0.3, 0.1, 0.0), (0.5, 0.2, -1.0)), ((-0.1, 0.2, 0.25), (-0.6, 0.9, 0.4))])],
    )


def everything():
    held = wrench(
        "10",
        force_body=(0.9, -0.4, 1.3),
        torque_body=(0.06, 0.04, -0.08),
        force_world=(-0.8, 1.7, 12.1),
        torque_world=(-0.07, 0.1, 0.05),
        points=[
            ((0.4, 0.0, 0.1), (0.2, -0.4, 0.3)),
            ((-0.2, 0.3, 0.0), (0.4, 0.1, -0.2)),
            ((0.0, -0.35, -0.15), (-0.3, 0.5, 0.1)),
        ],
    )
    return problem(
        "Products of inertia, offset centre of mass, gravity, every kind of force and torque, and three points.",
        mass=2.5,
        inertia=(0.31, 0.42, 0.53, -0.04, 0.06, 0.03),
        center_of_mass=(0.07, -0.04, 0.05),
        gravity=(0.0, 0.0, -9.81),
        initial=((1.0, 2.0, 3.0), (0.4, 0.2, -0.8, 0.4), (-0.5, 0.2, 1.0), (1.1, -2.0, 0.7)),
        wrenches=[held],
    )


def fast_spin():
    return problem(
        "Needle with moments of inertia near 1 : 1000 : 1000, about 200 rad/s, under small torques.",
        mass=1.0,
        inertia=(0.001, 1.0, 1.0005, 0.0, 0.0, 0.0),
        initial=((0.0, 0.0, 0.0), (0.7, 0.1, -0.5, 0.5), (1.0, 0.0, 0.0), (90.0, 140.0, -110.0)),
        wrenches=[wrench("0.5", torque_body=(0.002, 0.03, -0.05), torque_world=(0.04, -0.02, 0.03))],
        times=("0.1", "0.2", "0.5"),
    )


def needle_one_to_a_million():
    return problem(
        "Needle with moments near 1e-6 : 1 : 1, about 200 rad/s about all axes, under torques in body and world axes.",
        mass=1.0,
        inertia=(1e-6, 1.0, 1.0000005, 0.0, 0.0, 0.0),
        initial=((0.0, 0.0, 0.0), (0.7, 0.1, -0.5, 0.5), (1.0, 0.0, 0.0), (90.0, 140.0, -110.0)),
        wrenches=[wrench("0.2", torque_body=(2e-6, 0.03, -0.05), torque_world=(4e-5, -2e-5, 3e-5))],
        times=("0.1", "0.2"),
    )


def flat_body():
    return problem(
        "A flat body, I_x + I_y = I_z to the last bit, under force and torque in body axes.",
        mass=1.0,
        inertia=(0.125, 0.25, 0.375, 0.0, 0.0, 0.0),
        initial=((0.0, 0.0, 0.0), (0.5, -0.5, 0.5, 0.5), (0.0, 0.1, 0.0), (2.0, 1.0, -1.5)),
        wrenches=[wrench("5", force_body=(0.2, 0.1, -0.3), torque_body=(0.03, -0.05, 0.04))],
        times=("1", "2", "5"),
    )


def from_rest():
    return problem(
        "Starts from rest; a torque in body axes and a torque in world axes, products of inertia.",
        mass=1.2,
        inertia=(0.2, 0.25, 0.33, 0.03, -0.02, 0.04),
        center_of_mass=(-0.03, 0.06, 0.02),
        initial=((0.0, 0.0, 0.0), (0.3, 0.3, 0.1, -0.9), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        wrenches=[wrench("10", torque_body=(0.05, -0.03, 0.02), torque_world=(-0.01, 0.04, 0.03))],
    )


def short_wrench_changes():
    rng = random.Random(7)

    def vector(size):
        return [round(size * (2.0 * rng.random() - 1.0), 3) for _ in range(3)]

    point = (0.15, -0.1, 0.2)
    sizes = (4.0, 0.4, 4.0, 0.4)  # force_body, torque_body, force_world, torque_world
    wrenches = [
        wrench(f"{k / 2:g}", *(vector(size) for size in sizes), points=[(point, vector(1.0))]) for k in range(1, 21)
    ]
    return problem(
        "Twenty wrenches, each held for half a second, with a force at one body-fixed point; products of inertia.",
        mass=1.8,
        inertia=(0.22, 0.3, 0.37, 0.02, 0.05, -0.03),
        center_of_mass=(0.04, 0.01, -0.03),
        gravity=(0.0, 0.0, -9.81),
        initial=((0.0, 1.0, 10.0), (0.9, -0.3, 0.3, 0.1), (0.2, -0.1, 0.0), (0.4, 0.9, -0.6)),
        wrenches=wrenches,
        times=("0.5", "1", "2", "5", "10"),
    )


MAKERS = (  # slowest first, so that the last task of a parallel run is a short one
    heavy_top,
    fast_spin,
    needle_one_to_a_million,
    everything,
    short_wrench_changes,
    torque_free_middle_axis,
    body_wrench,
    world_wrench,
    asymmetric_top_two_points,
    flat_body,
    from_rest,
)
PROBLEMS = {maker.__name__: maker() for maker in MAKERS}


# --- small vectors as lists of numbers ------------------------------------------------------------------------------


def exact(values):
    """Turn doubles into multiple-precision numbers of exactly the same value, lists of them too."""
    return [exact(value) for value in values] if isinstance(values, (list, tuple)) else mpf(values)


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def add(*vectors):
    return [mpmath.fsum(parts) for parts in zip(*vectors, strict=True)]


def scale(factor, a):
    return [factor * x for x in a]


def subtract(a, b):
    return [x - y for x, y in zip(a, b, strict=True)]


def turn(rotation, a):
    """Return R a for a matrix given as nine numbers, row by row."""
    return [dot(rotation[3 * i : 3 * i + 3], a) for i in range(3)]


def turn_back(rotation, a):
    """Return R^T a for a matrix given as nine numbers, row by row."""
    return [dot(rotation[i::3], a) for i in range(3)]


def inverse_of_symmetric(matrix):
    """Return the inverse of a symmetric 3 x 3 matrix, both as nine numbers row by row, by its cofactors."""
    rows = [matrix[0:3], matrix[3:6], matrix[6:9]]
    cofactors = cross(rows[1], rows[2]) + cross(rows[2], rows[0]) + cross(rows[0], rows[1])
    return scale(1 / dot(rows[0], cofactors[0:3]), cofactors)


def rotation_from_squares(ww, xx, yy, zz, wx, wy, wz, xy, xz, yz):
    """Return the matrix R(q), nine entries row by row, from the ten products of two components of q."""
    return [
        ww + xx - yy - zz, 2 * (xy - wz), 2 * (xz + wy),
        2 * (xy + wz), ww - xx + yy - zz, 2 * (yz - wx),
        2 * (xz - wy), 2 * (yz + wx), ww - xx - yy + zz,
    ]  # fmt: skip


def rotation_of(q):
    w, x, y, z = q
    return rotation_from_squares(w * w, x * x, y * y, z * z, w * x, w * y, w * z, x * y, x * z, y * z)


# --- the problem at full precision ----------------------------------------------------------------------------------


class Body:
    """Mass m [kg], inertia I [kg m^2, body axes, about the centre of mass], centre of mass c [m, body], gravity g."""

    def __init__(self, data):
        ixx, iyy, izz, ixy, ixz, iyz = exact(data["body"]["inertia"])
        self.m = mpf(data["body"]["mass"])
        self.c = exact(data["body"]["center_of_mass"])
        self.g = exact(data["gravity"])
        drag = {name: exact(values) for name, values in data.get("drag", {}).items()}
        self.linear = drag and drag["linear"] + drag["angular_linear"]
        self.quadratic = drag and drag["quadratic"] + drag["angular_quadratic"]
        self.inertia = [ixx, ixy, ixz, ixy, iyy, iyz, ixz, iyz, izz]
        self.inverse = inverse_of_symmetric(self.inertia)

    def check(self):
        """Assert that a real body can have this inertia: 0 < I1 <= I2 <= I3 <= I1 + I2."""
        rows = mpmath.matrix([self.inertia[0:3], self.inertia[3:6], self.inertia[6:9]])
        low, middle, high = sorted(mpmath.eigsy(rows, eigvals_only=True))
        assert low > 0 and high <= low + middle, "not the inertia of a real body"


class Held:
    """One held wrench, reduced to the centre of mass: parts constant in the body, parts constant in the world."""

    def __init__(self, data, body):
        self.force_body = exact(data["force_body"])
        self.torque_body = subtract(exact(data["torque_body"]), cross(body.c, self.force_body))
        self.torque_world = exact(data["torque_world"])
        self.central_force = add(exact(data["force_world"]), scale(body.m, body.g))
        self.points = [(subtract(exact(r), body.c), exact(force)) for r, force in data["points"]]
        self.force_world = add(self.central_force, *(force for _, force in self.points))


# --- the Taylor series of the solution ------------------------------------------------------------------------------


def cauchy(n, *pairs):
    """Return the coefficient of t^n of the sum of the products of the given pairs of power series."""
    left, right = [], []
    for a, b in pairs:
        left += a[: n + 1]
        right += b[n::-1]
    return dot(left, right)


def rotation_coefficients(q, n):
    """Return the coefficient of t^n of R(q(t)), nine entries row by row, from the series of q."""
    w, x, y, z = q
    pairs = ((w, w), (x, x), (y, y), (z, z), (w, x), (w, y), (w, z), (x, y), (x, z), (y, z))
    return rotation_from_squares(*(cauchy(n, pair) for pair in pairs))


def quaternion_rate(q, w, minus_w, n):
    """Return the coefficient of t^n of 1/2 q (0, w)."""
    s, x, y, z = q
    (a, b, c), (minus_a, minus_b, minus_c) = w, minus_w
    product = [
        cauchy(n, (x, minus_a), (y, minus_b), (z, minus_c)),
        cauchy(n, (s, a), (y, c), (z, minus_b)),
        cauchy(n, (s, b), (z, a), (x, minus_c)),
        cauchy(n, (s, c), (x, b), (y, minus_a)),
    ]
    return [value / 2 for value in product]


def gyroscopic(momentum, w, minus_w, n):
    """Return the coefficient of t^n of (I w) x w [N m, body]."""
    pairs = ((1, 2), (2, 0), (0, 1))
    return [cauchy(n, (momentum[i], w[j]), (momentum[j], minus_w[i])) for i, j in pairs]


def append(series, values):
    for coefficients, value in zip(series, values, strict=True):
        coefficients.append(value)


def taylor_series(start, body, held, order, signs=()):
    """
    Return the Taylor coefficients, order by order, of all unknowns about the state `start`.

    The unknowns are p, v, q, w of the module's docstring and, for the checks in `balance`, S [s] with S' = R, D [N m s]
    with D' = R t_drag, and the work [J] of everything but the forces fixed in the world. With drag, u [m/s, body] comes
    along, and `signs` are those of the components of u and w.
    """
    series = {name: [[x] for x in start[name]] for name in start}
    minus_w, momentum, thrust, torque = ([[] for _ in range(3)] for _ in range(4))
    rotations, moved, drag = [[] for _ in range(9)], [[] for _ in range(3)], [[] for _ in range(6)]
    for n in range(order):
        at_n = {name: [x[n] for x in series[name]] for name in ("v", "w")}
        rotation = rotation_coefficients(series["q"], n)
        append(rotations, rotation)
        append(minus_w, scale(-1, at_n["w"]))
        append(momentum, turn(body.inertia, at_n["w"]))
        append(thrust, turn(rotation, held.force_body))
        append(torque, turn_back(rotation, held.torque_world))
        powers = [*zip(thrust + torque, series["v"] + series["w"], strict=True)]
        drag_force, drag_torque, lost = ZERO, ZERO, ZERO
        if signs:
            append(moved, [cauchy(n, *zip(rotations[j::3], series["v"], strict=True)) for j in range(3)])
            append(drag, drag_coefficients(body, moved + series["w"], signs, n))
            powers += zip(drag, moved + series["w"], strict=True)
            drag_force = turned_coefficients(rotations, drag[:3], n)
            drag_torque, lost = [x[n] for x in drag[3:]], turned_coefficients(rotations, drag[3:], n)
        rates = {
            "p": at_n["v"],
            "v": scale(1 / body.m, add([x[n] for x in thrust], held.force_world if n == 0 else ZERO, drag_force)),
            "q": quaternion_rate(series["q"], series["w"], minus_w, n),
            "w": spin_rate(body, held, rotation, torque, gyroscopic(momentum, series["w"], minus_w, n), drag_torque, n),
            "S": rotation,
            "D": lost,
            "work": [cauchy(n, *powers) + dot(held.torque_body, at_n["w"])],
        }
        for name, rate in rates.items():
            append(series[name], [value / (n + 1) for value in rate])
    return series, moved


def drag_coefficients(body, motion, signs, n):
    """Return the coefficient of t^n of f_drag and t_drag, from the series of u and w."""
    parts = zip(body.linear, body.quadratic, motion, signs, strict=True)
    return [-(linear * u[n] + quadratic * sign * cauchy(n, (u, u))) for linear, quadratic, u, sign in parts]


def turned_coefficients(rotations, vector, n):
    """Return the coefficient of t^n of R a, from the series of R and a."""
    return [cauchy(n, *zip(rotations[3 * i : 3 * i + 3], vector, strict=True)) for i in range(3)]


def spin_rate(body, held, rotation, torque_world, gyroscopic_torque, drag_torque, n):
    """Return the coefficient of t^n of w' = I^-1 (all torques) [rad/s^2, body]."""
    arms = [cross(arm, turn_back(rotation, force)) for arm, force in held.points]
    constant = held.torque_body if n == 0 else ZERO
    return turn(body.inverse, add(gyroscopic_torque, [x[n] for x in torque_world], constant, drag_torque, *arms))


def signs_of(state, body, held):
    """Return the signs that the components of u and w have just after `state`: () without drag."""
    if not body.linear:
        return ()
    series, moved = taylor_series(state, body, held, 2, (1,) * 6)
    # At a zero |u| u has no slope, so the first derivative is right whatever the sign.
    return tuple(int(mpmath.sign(u[0] if abs(u[0]) > mpf("1e-20") else u[1])) for u in moved + series["w"])


def up_to_change(motion, signs, step):
    """Return `step` [s], or the time of the first zero within it of a component of u and w, to full precision."""
    for look in range(1, LOOKS + 1):
        before, after = step * (look - 1) / LOOKS, step * look / LOOKS
        if crossed := [x for x, sign in zip(motion, signs, strict=True) if sign * mpmath.polyval(x[::-1], after) < 0]:
            return min(zero_between(x, before, after) for x in crossed)
    return step


def zero_between(series, before, after):
    """Return the zero of a polynomial between two times, by bisection and then Newton's method."""
    coefficients, sign = series[::-1], mpmath.sign(mpmath.polyval(series[::-1], after))
    for _ in range(40):
        middle = (before + after) / 2
        before, after = (before, middle) if sign * mpmath.polyval(coefficients, middle) > 0 else (middle, after)
    for _ in range(4):
        value, slope = mpmath.polyval(coefficients, after, derivative=1)
        after -= value / slope
    return after


def step_length(series, tolerance):
    """Return the time [s] for which the last two terms of every series stay below `tolerance`."""
    longest = math.inf
    order = len(series["p"][0]) - 1
    for n in (order - 1, order):
        largest = max(abs(coefficients[n]) for unknown in series.values() for coefficients in unknown)
        if largest:
            longest = min(longest, math.exp(float(mpmath.log(tolerance / largest)) / n))
    return longest


def advance(state, body, held, duration, order):
    """Return the state after `duration` [s] under one held wrench."""
    tolerance = mpf(10) ** -(mp.dps + EXTRA_DIGITS)
    while duration > 0:
        signs = signs_of(state, body, held)
        series, moved = taylor_series(state, body, held, order, signs)
        step = min(mpf(min(step_length(series, tolerance), 1e6)), duration)
        if signs:
            step = up_to_change(moved + series["w"], signs, step)
        state = {name: [mpmath.polyval(x[::-1], step) for x in unknown] for name, unknown in series.items()}
        duration -= step
    return state


# --- start, results, checks -----------------------------------------------------------------------------------------


def first_state(data, body):
    """Return the unknowns at time zero; the orientation is normalised here, at full precision."""
    initial = {name: exact(values) for name, values in data["initial"].items()}
    norm = mpmath.sqrt(dot(initial["orientation"], initial["orientation"]))
    assert abs(norm - 1) < mpf("1e-15"), "the initial orientation must be a unit quaternion to round-off"
    q = scale(1 / norm, initial["orientation"])
    w = initial["angular_velocity"]
    rotation = rotation_of(q)
    return {
        "p": add(initial["position"], turn(rotation, body.c)),
        "v": add(initial["velocity"], turn(rotation, cross(w, body.c))),
        "q": q,
        "w": w,
    }


def results(state, body):
    """Return what is compared and written: origin of the body frame, momenta (units and frames: module docstring)."""
    rotation = rotation_of(state["q"])
    return {
        "position": subtract(state["p"], turn(rotation, body.c)),
        "orientation": state["q"],
        "velocity": subtract(state["v"], turn(rotation, cross(state["w"], body.c))),
        "angular_velocity": state["w"],
        "momentum": scale(body.m, state["v"]),
        "angular_momentum": turn(rotation, turn(body.inertia, state["w"])),
    }


def kinetic_energy(state, body):
    """Return 1/2 m v . v + 1/2 w . I w [J]."""
    return (body.m * dot(state["v"], state["v"]) + dot(state["w"], turn(body.inertia, state["w"]))) / 2


def balance(before, after, body, held, duration):
    """
    Return by how much the laws of motion in the large fail over one span: a dictionary of absolute errors.

    energy [J]: kinetic energy against the work of all forces; a constant force at a point does F . (displacement of
    that point). angular_momentum [N m s, world]: L against t_world T + S (t_body - c x f_body) + D + sum_k S (r_k - c)
    x F_k where S is the integral of R over the span of length T and D that of R t_drag; Euler's equation does not
    appear in it.
    """
    r0, r1 = rotation_of(before["q"]), rotation_of(after["q"])
    moved = subtract(after["p"], before["p"])
    work = after["work"][0] + dot(held.central_force, moved)
    gained = add(scale(duration, held.torque_world), turn(after["S"], held.torque_body), after["D"])
    for arm, force in held.points:
        work += dot(force, add(moved, subtract(turn(r1, arm), turn(r0, arm))))
        gained = add(gained, cross(turn(after["S"], arm), force))
    l0, l1 = turn(r0, turn(body.inertia, before["w"])), turn(r1, turn(body.inertia, after["w"]))
    return {
        "energy": abs(kinetic_energy(after, body) - kinetic_energy(before, body) - work),
        "angular_momentum": max(abs(x) for x in subtract(subtract(l1, l0), gained)),
        "quaternion_norm": abs(mpmath.sqrt(dot(after["q"], after["q"])) - 1),
    }


def solve(data, digits, order, until=math.inf):
    """Return (results by time, largest balance errors) of one problem, for the sample times up to `until` [s]."""
    mp.dps = digits
    body = Body(data)
    body.check()
    state, now, samples, errors = first_state(data, body), Fraction(0), {}, {}
    ends = {Fraction(text) for text in data["times"]} | {Fraction(held["until"]) for held in data["wrenches"]}
    for end in sorted(end for end in ends if end <= until):
        held = Held(next(held for held in data["wrenches"] if end <= Fraction(held["until"])), body)
        duration = mpf((end - now).numerator) / (end - now).denominator
        before = {**state, "S": [mpf(0)] * 9, "D": [mpf(0)] * 3, "work": [mpf(0)]}
        state = advance(before, body, held, duration, order)
        for check, error in balance(before, state, body, held, duration).items():
            errors[check] = max(error, errors.get(check, error))
        samples[end] = results(state, body)
        now = end
    return {text: samples[Fraction(text)] for text in data["times"] if Fraction(text) <= until}, errors


def largest_difference(first, second):
    """Return the largest absolute difference [SI units] of two solutions over the samples that both have."""
    return max(
        abs(mpf(a) - mpf(b))
        for instant in first.keys() & second.keys()
        for name in RESULTS
        for a, b in zip(first[instant][name], second[instant][name], strict=True)
    )


# --- the file -------------------------------------------------------------------------------------------------------


def as_strings(values):
    """Turn every double of nested lists and dictionaries into the shortest decimal string that reads back the same."""
    if isinstance(values, dict):
        return {name: as_strings(value) for name, value in values.items()}
    if isinstance(values, list):
        return [as_strings(value) for value in values]
    return repr(values) if isinstance(values, float) else values


def to_json(data, samples, agreement, errors):
    """Return the file's entry of one problem."""
    data = as_strings({key: value for key, value in data.items() if key != "times"})
    printed = [
        {"time": instant, **{key: [mpmath.nstr(x, PRINTED_DIGITS) for x in sample[key]] for key in RESULTS}}
        for instant, sample in samples.items()
    ]
    balances = {check: mpmath.nstr(error, 2) for check, error in errors.items()}
    return {**data, "agreement": mpmath.nstr(agreement, 2), "balance": balances, "samples": printed}


def work_item(task):
    name, data, (digits, order) = task
    begin = time.perf_counter()
    samples, errors = solve(data, digits, order)
    return name, digits, samples, errors, time.perf_counter() - begin


def solve_all(problems, jobs):
    """Solve every problem in both ways with `jobs` processes and return the file's entries."""
    tasks = [(name, data, accuracy) for accuracy in (ACCURATE, CONTROL) for name, data in problems.items()]
    solutions = {}
    mp.dps = ACCURATE[0]  # before the first result arrives: reading a number from another process rounds it to this
    with multiprocessing.Pool(jobs) as pool:
        for name, digits, samples, errors, seconds in pool.imap_unordered(work_item, tasks):
            solutions[name, digits] = samples, errors
            print(f"[{len(solutions):2d}/{len(tasks)}] {name}, {digits} digits: {seconds:.1f} s", flush=True)
    entries = {}
    for name, data in sorted(problems.items()):
        samples, errors = solutions[name, ACCURATE[0]]
        agreement = largest_difference(samples, solutions[name, CONTROL[0]][0])
        assert agreement < WANTED_AGREEMENT, f"{name}: the two solutions differ by {mpmath.nstr(agreement, 3)}"
        assert max(errors.values()) < WANTED_BALANCE, f"{name}: balance fails: {errors}"
        entries[name] = to_json(data, samples, agreement, errors)
        print(f"{name}: agreement {entries[name]['agreement']}, balance {entries[name]['balance']}")
    return entries


def on_one_line(found):
    """Return a matched list without line breaks."""
    return "[" + " ".join(found[1].split()) + "]"


def write(problems, file, script, jobs=2):
    """Solve all problems and write the file; `script`: what made it."""
    entries = solve_all(problems, jobs)
    made_by = (
        f"{script}: Newton-Euler equations in body axes, Taylor series with mpmath; "
        f"{ACCURATE[0]} digits at order {ACCURATE[1]}, compared with {CONTROL[0]} digits at order {CONTROL[1]}. "
        "Units SI; conventions in make_reference.py. Parameters are exact doubles; times are exact decimals; "
        "the initial orientation, a unit quaternion to round-off, was divided by its norm first."
    )
    content = {"made_by": made_by, "digits": PRINTED_DIGITS, "problems": entries}
    text = re.sub(r"\[\s+([^][{}]*?)\s+\]", on_one_line, json.dumps(content, indent=1))
    file.write_text(text + "\n", encoding="utf-8")


def check(name="body_wrench", until=1):
    """Return the largest difference [SI units] of a quick solution up to `until` [s] from the file; parameters too."""
    stored = json.loads(FILE.read_text(encoding="utf-8"))["problems"]
    for known, data in PROBLEMS.items():
        expected = as_strings({key: value for key, value in data.items() if key != "times"})
        assert {key: stored[known][key] for key in expected} == expected, f"{known}: parameters differ from the file"
    samples, _ = solve(PROBLEMS[name], *QUICK, until=until)
    return largest_difference(samples, {sample["time"]: sample for sample in stored[name]["samples"]})


def main():
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument("--check", action="store_true", help="solve part of one problem again, compare with the file")
    parser.add_argument("--jobs", type=int, default=2, help="number of processes")
    arguments = parser.parse_args()
    if not arguments.check:
        write(PROBLEMS, FILE, "make_reference.py", arguments.jobs)
        return 0
    difference = check()
    print(f"largest difference from {FILE.name}: {mpmath.nstr(difference, 2)}")
    return 0 if difference < mpf("1e-24") else 1


if __name__ == "__main__":
    sys.exit(main())
