"""
Solve the motion of bodies with added mass with mpmath to more than 30 digits and write added_mass.json.

Run `python -m bench.reference.make_added_mass` (20 s). Nothing that simulates is imported, and the equations are
others than those of the simulation: the unknowns are the momenta of body and fluid together, p and h, about the body
frame's origin O in body axes, for velocities v and w through the fluid, which flows with the steady velocity u:

    (p, h) = (M + M_A) (v, w)      p' = p x w + F      h' = h x w + p x v + T      q' = 1/2 q (0, w)      x' = R v + u

with gravity at the centre of mass, a lift in world axes at a body-fixed point, a wrench in body axes, and linear drag
at the centre of mass. All of it is polynomial, and integrated by its Taylor series; what is given are exact doubles.
Every case is solved twice, with different order, step and number of digits; both must agree.
"""

import json
import multiprocessing

import mpmath
from mpmath import mp, mpf

from rigid_body_sim.report.reference.quaternions import unit

from . import DATA

FILE = DATA / "added_mass.json"
ACCURATE = (54, 44)  # decimal digits, order
CONTROL = (48, 40)
WANTED_AGREEMENT = mpf("1e-30")
RATIOS = ("1e-4", "1e-2", "1e0", "1e2", "1e4", "1e6")

BODY = {
    "mass": 2.0,
    "inertia": [0.3, 0.4, 0.5, 0.02, 0.01, -0.03],  # ixx, iyy, izz, ixy, ixz, iyz about the centre of mass
    "center_of_mass": [0.0625, -0.03125, 0.125],
    "gravity": [0.0, 0.0, -9.75],
    "lift_point": [0.125, 0.0, 0.25],
    "lift": [0.5, -0.25, 18.0],
    "force_body": [0.5, 0.25, -0.125],
    "torque_body": [0.0625, -0.125, 0.25],
    "drag": [1.0, 2.0, 1.5],
    "angular_drag": [0.25, 0.125, 0.5],
    "fluid_velocity": [0.75, -0.5, 0.25],
    "orientation": [0.5, 0.5, -0.5, 0.5],
    "velocity": [1.0, -0.5, 0.25],
    "angular_velocity": [0.5, -1.0, 0.75],
    "time": 2.0,
}
# Upper triangle of the added mass at the ratio 1, in thousandths: of every kind, and of three different sizes.
TRIANGLE = (
    *(1500, 100, -50, 25, 150, -100),
    *(2500, 150, -125, 50, 75),
    *(2000, 50, 100, -50),
    *(300, 10, 15),
    *(400, -20),
    250,
)


def added_mass(ratio):
    """The 21 numbers."""
    return [value / 1000 * float(ratio) for value in TRIANGLE]


def cross(a, b):
    """a x b of series, to the order that both have: coefficient k."""
    k = len(a[0]) - 1

    def product(i, j):
        return mpmath.fdot(a[i], b[j][k::-1]) - mpmath.fdot(a[j], b[i][k::-1])

    return [product(1, 2), product(2, 0), product(0, 1)]


def matrix_of(values):
    upper = map(mpf, values)
    found = mpmath.zeros(6)
    for i in range(6):
        for j in range(i, 6):
            found[i, j] = found[j, i] = next(upper)
    return found


def own_mass(m, inertia, c):
    """The body's own 6 x 6 matrix about O."""
    xx, yy, zz, xy, xz, yz = inertia
    skew = mpmath.matrix([[0, -c[2], c[1]], [c[2], 0, -c[0]], [-c[1], c[0], 0]])
    about = mpmath.matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) - m * skew * skew
    found = mpmath.zeros(6)
    for i in range(3):
        found[i, i] = m
        for j in range(3):
            found[i, 3 + j], found[3 + i, j] = -m * skew[i, j], m * skew[i, j]
            found[3 + i, 3 + j] = about[i, j]
    return found


class Motion:
    """The equations of one case, at the precision that mpmath has."""

    def __init__(self, ratio):
        self.of = {
            key: [mpf(c) for c in value] if isinstance(value, list) else mpf(value) for key, value in BODY.items()
        }
        whole = own_mass(self.of["mass"], self.of["inertia"], self.of["center_of_mass"]) + matrix_of(added_mass(ratio))
        self.whole, self.inverse = whole, whole**-1

    def start(self):
        """x, q, and the momenta."""
        q = unit(self.of["orientation"])
        through = [a - b for a, b in zip(self.of["velocity"], self.of["fluid_velocity"], strict=True)]
        v = [mpmath.fdot(row, through) for row in zip(*rotation(q), strict=True)]
        momenta = self.whole * mpmath.matrix(v + self.of["angular_velocity"])
        return [mpf(0)] * 3, q, list(momenta)

    def series(self, x, q, momenta, order):
        """Taylor coefficients of x, q and the momenta."""
        X, Q, P = [[c] for c in x], [[c] for c in q], [[c] for c in momenta]
        N = [[] for _ in range(6)]  # v, w
        turned = [[[] for _ in range(3)] for _ in range(3)]  # R
        for k in range(order):
            for one, value in zip(N, self.inverse * mpmath.matrix([c[k] for c in P]), strict=True):
                one.append(value)
            for row, values in zip(turned, rotation_coefficient(Q, k), strict=True):
                for one, value in zip(row, values, strict=True):
                    one.append(value)
            force, torque = self.load(turned, N, k)
            v, w, p, h = N[:3], N[3:], P[:3], P[3:]
            by_force = [a + b for a, b in zip(cross(p, w), force, strict=True)]
            by_torque = [a + b + c for a, b, c in zip(cross(h, w), cross(p, v), torque, strict=True)]
            rates = [sum(mpmath.fdot(row[j], v[j][k::-1]) for j in range(3)) for row in turned]
            if k == 0:
                rates = [a + b for a, b in zip(rates, self.of["fluid_velocity"], strict=True)]
            s, a, b, c = Q
            turn = [
                -dot(a, w[0], k) - dot(b, w[1], k) - dot(c, w[2], k),
                dot(s, w[0], k) + dot(b, w[2], k) - dot(c, w[1], k),
                dot(s, w[1], k) + dot(c, w[0], k) - dot(a, w[2], k),
                dot(s, w[2], k) + dot(a, w[1], k) - dot(b, w[0], k),
            ]
            for one, rate in zip(P, by_force + by_torque, strict=True):
                one.append(rate / (k + 1))
            for one, rate in zip(Q, turn, strict=True):
                one.append(rate / (2 * (k + 1)))
            for one, rate in zip(X, rates, strict=True):
                one.append(rate / (k + 1))
        return X, Q, P

    def load(self, turned, N, k):
        """Coefficient k of force and torque about O, body axes."""
        of, c = self.of, self.of["center_of_mass"]
        v, w = [one[k] for one in N[:3]], [one[k] for one in N[3:]]
        weight = [of["mass"] * sum(turned[i][j][k] * of["gravity"][i] for i in range(3)) for j in range(3)]
        lift = [sum(turned[i][j][k] * of["lift"][i] for i in range(3)) for j in range(3)]
        there = [a + b for a, b in zip(v, vector_cross(w, c), strict=True)]
        at_center = [f - d * u for f, d, u in zip(weight, of["drag"], there, strict=True)]
        force = [a + b for a, b in zip(at_center, lift, strict=True)]
        torque = [a + b for a, b in zip(vector_cross(c, at_center), vector_cross(of["lift_point"], lift), strict=True)]
        torque = [t - d * rate for t, d, rate in zip(torque, of["angular_drag"], w, strict=True)]
        if k == 0:
            force = [a + b for a, b in zip(force, of["force_body"], strict=True)]
            torque = [a + b for a, b in zip(torque, of["torque_body"], strict=True)]
        return force, torque

    def outcome(self, x, q, momenta):
        """Position and velocity of O in the world, attitude, rates."""
        nu = list(self.inverse * mpmath.matrix(momenta))
        R = rotation(q)
        velocity = [mpmath.fdot(row, nu[:3]) + u for row, u in zip(R, self.of["fluid_velocity"], strict=True)]
        return [*x, *q, *velocity, *nu[3:]]


def dot(a, b, k):
    """Coefficient k of a product."""
    return mpmath.fdot(a[: k + 1], b[k::-1])


def vector_cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def rotation(q):
    return rotation_coefficient([[c] for c in q], 0)


def rotation_coefficient(Q, k):
    """Coefficient k of the rotation matrix of a unit quaternion."""
    s, x, y, z = Q

    def of(a, b):
        return dot(a, b, k)

    ss, xx, yy, zz = of(s, s), of(x, x), of(y, y), of(z, z)
    return [
        [ss + xx - yy - zz, 2 * (of(x, y) - of(s, z)), 2 * (of(x, z) + of(s, y))],
        [2 * (of(x, y) + of(s, z)), ss - xx + yy - zz, 2 * (of(y, z) - of(s, x))],
        [2 * (of(x, z) - of(s, y)), 2 * (of(y, z) + of(s, x)), ss - xx - yy + zz],
    ]


def step_size(groups, digits, order):
    """The step [s] at whose end the last terms of each group of series are as small as the digits."""
    last = mpf(0)
    for group in groups:
        size = max(abs(c[0]) for c in group) or mpf(1)
        last = max(last, *((abs(c[k]) / size) ** (mpf(1) / k) for c in group for k in (order - 1, order)))
    return mpf(10) ** (-mpf(digits - 4) / order) / last


def solve(ratio, digits, order):
    """What becomes of a case."""
    mp.dps = digits
    motion = Motion(ratio)
    x, q, momenta = motion.start()
    done, end = mpf(0), motion.of["time"]
    while done < end:
        X, Q, P = motion.series(x, q, momenta, order)
        h = min(end - done, step_size((Q, P[:3], P[3:]), digits, order))
        x, q, momenta = ([mpmath.polyval(c[::-1], h) for c in group] for group in (X, Q, P))
        done += h
    return motion.outcome(x, unit(q), momenta)


def entry(ratio):
    """Solve one case twice and return its JSON."""
    end, control = solve(ratio, *ACCURATE), solve(ratio, *CONTROL)
    mp.dps = ACCURATE[0]
    difference = max(abs(a - b) for a, b in zip(end, control, strict=True))
    assert difference < WANTED_AGREEMENT, f"{ratio}: {difference}"
    return ratio, {
        "added_mass": added_mass(ratio),
        "end": [mpmath.nstr(c, 35) for c in end],
        "agreement": mpmath.nstr(difference, 2),
    }


def main():
    with multiprocessing.Pool(2) as pool:
        found = dict(pool.imap_unordered(entry, RATIOS))
    lines = (f"{json.dumps(ratio)}: {json.dumps(found[ratio])}" for ratio in RATIOS)
    FILE.write_text(f'{{\n"scene": {json.dumps(BODY)},\n' + ",\n".join(lines) + "\n}\n", encoding="utf-8")
    for ratio in RATIOS:
        print(ratio, found[ratio]["agreement"])


if __name__ == "__main__":
    main()
