"""
Solve bodies with links between them with mpmath to more than 20 digits and write links.json.

Run `python -m bench.reference.make_links` (some minutes). Nothing that simulates is imported. Of each body the centre
of mass, q, velocity and rates are unknown, with the inertia I about the centre of mass in the axes of the body frame,
and of a rotor its level:

    x' = v        m v' = F + m g        q' = 1/2 q (0, w)        I w' = (I w + h) x w - h' + t        l' = (u - l) / T

A link pulls its two points r_a and r_b together with the tension k (|r_a - r_b| - l_0) + c d|r_a - r_b|/dt; of a rope,
which would be slack below 0, it is above 0 throughout. A rotor is that of make_actuators. The method is extrapolation
of the modified midpoint rule. All is solved twice, with different steps, orders and numbers of digits; both must agree.
"""

import json
import multiprocessing

from mpmath import matrix, mp, mpf

from . import DATA
from .make_actuators import cross, extrapolated, rotated, rotor

FILE = DATA / "links.json"
ACCURATE, CONTROL = (30, 11, "0.01"), (27, 9, "0.008")  # decimal digits, columns of the extrapolation, step [s]
WANTED_AGREEMENT = mpf("1e-22")
PRINTED_DIGITS = 22
SAMPLES = ("0.2", "0.6")


def body(mass, inertia, center, position, orientation, velocity, rates, force=(0.0, 0.0, 0.0), rotors=()):
    return {
        "mass": mass, "inertia": inertia, "center_of_mass": center, "position": position, "orientation": orientation,
        "velocity": velocity, "angular_velocity": rates, "force_world": list(force),
        "actuators": list(rotors),
    }  # fmt: skip


def link(bodies, points, rest, stiffness, damping, slack=False):
    return {
        "bodies": bodies, "points": points, "rest_length": rest, "stiffness": stiffness, "damping": damping,
        "slack": slack,
    }  # fmt: skip


CRATE = (0.5, [0.004, 0.005, 0.006, 2e-4, -1e-4, 3e-4], [0.01, 0.0, -0.02])
BLOCK = (2.0, [0.03, 0.04, 0.05, 1e-3, -2e-3, 1e-3], [0.01, -0.02, 0.0])
DRONE = (1.2, [0.0075, 0.0080, 0.0130, 2e-4, -1e-4, 3e-4], [0.002, -0.001, 0.0005])
LEVEL, TILTED = [1.0, 0.0, 0.0, 0.0], [0.9, 0.1, -0.3, 0.2]
ZERO = [0.0, 0.0, 0.0]
PROBLEMS = {
    "slung": {
        "gravity": [0.0, 0.0, -9.80665], "command": 0.0,
        "bodies": {
            "carrier": body(4000.0, [800.0, 900.0, 700.0, 0.0, 0.0, 0.0], ZERO, ZERO, LEVEL, [0.0, 0.0, 2.0], ZERO,
                            [0.0, 0.0, 39231.5]),
            "load": body(*CRATE, [0.5, 0.1, -0.95], TILTED, [0.1, 0.4, 2.0], [0.3, -0.5, 0.2]),
        },
        "links": [link(["carrier", "load"], [[0.0, 0.1, -0.1], [0.0, 0.02, 0.05]], 0.923, 300.0, 0.5, True)],
    },
    "chain": {
        "gravity": [0.1, 0.0, -0.3], "command": 0.0,
        "bodies": {
            "a": body(*BLOCK, ZERO, TILTED, [0.2, 0.0, 0.1], [0.4, -1.0, 0.7]),
            "b": body(*CRATE, [1.1, 0.1, 0.0], LEVEL, [0.0, 0.5, 0.0], [0.0, 0.6, -0.4]),
            "c": body(*BLOCK, [2.2, -0.1, 0.2], TILTED, [0.2, -0.2, 0.3], [-0.2, 0.1, 0.3]),
        },
        "links": [link(["a", "b"], [[0.1, 0.0, 0.05], [-0.05, 0.0, 0.0]], 0.6, 150.0, 0.0),
                  link(["c", "b"], [[-0.1, 0.05, 0.0], [0.05, 0.02, 0.0]], 0.6, 200.0, 0.8)],
    },
    "lifted": {
        "gravity": [0.0, 0.0, -9.80665], "command": 720.0,
        "bodies": {
            "drone": body(*DRONE, ZERO, LEVEL, ZERO, [0.1, -0.2, 0.3], rotors=[
                rotor("front", [0.17, 0.0, 0.01], "cw", "0.0"), rotor("left", [0.0, 0.17, 0.01], "ccw", "0.0"),
                rotor("back", [-0.17, 0.0, 0.01], "cw", "0.0"), rotor("right", [0.0, -0.17, 0.01], "ccw", "0.0"),
            ]),
            "load": body(*CRATE, [0.2, 0.0, -1.05], TILTED, ZERO, ZERO),
        },
        "links": [link(["drone", "load"], [[0.0, 0.01, -0.03], [0.0, 0.0, 0.05]], 0.9, 250.0, 1.0)],
    },
}  # fmt: skip


def numbers(values):
    return [mpf(c) for c in values]


def added(*vectors):
    return [sum(each) for each in zip(*vectors, strict=True)]


def minus(a, b):
    return [p - q for p, q in zip(a, b, strict=True)]


def dot(a, b):
    return sum(p * q for p, q in zip(a, b, strict=True))


class Plant:
    """One body."""

    def __init__(self, given, command):
        self.mass, self.center = mpf(given["mass"]), numbers(given["center_of_mass"])
        xx, yy, zz, xy, xz, yz = numbers(given["inertia"])
        self.inertia = matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        self.inverse = self.inertia**-1
        self.rotors = [self._read(one) for one in given["actuators"]]
        self.command, self.held = mpf(command), numbers(given["force_world"])
        self.size = 13 + len(self.rotors)
        q = numbers(given["orientation"])
        length = mp.sqrt(dot(q, q))
        q, w = [c / length for c in q], numbers(given["angular_velocity"])
        x = added(numbers(given["position"]), rotated(q, self.center))
        v = added(numbers(given["velocity"]), rotated(q, cross(w, self.center)))
        self.start = [*x, *q, *v, *w, *(mpf(one["initial"]) for one in given["actuators"])]

    def _read(self, one):
        axis = numbers(one["axis"])
        length = mp.sqrt(dot(axis, axis))
        names = ("time_constant", "thrust_coefficient", "torque_coefficient", "inertia")
        read = {name: mpf(one[name]) for name in names}
        arm = minus(numbers(one["position"]), self.center)
        return {**read, "axis": [c / length for c in axis], "arm": arm, "sense": -1 if one["direction"] == "cw" else 1}

    def arm(self, y, point):
        """From the centre of mass, world axes."""
        return rotated(y[3:7], minus(numbers(point), self.center))

    def velocity(self, y, arm):
        return added(y[7:10], cross(rotated(y[3:7], y[10:13]), arm))

    def frame(self, y):
        """The body frame's origin, q, its velocity, rates."""
        q, w = y[3:7], y[10:13]
        return [*minus(y[0:3], rotated(q, self.center)), *q, *minus(y[7:10], rotated(q, cross(w, self.center))), *w]

    def slope(self, y, gravity, force_world, torque_world):
        q, w = y[3:7], y[10:13]
        back = [q[0], -q[1], -q[2], -q[3]]
        force, torque, inside, growth, more = [mpf(0)] * 3, rotated(back, torque_world), [mpf(0)] * 3, [mpf(0)] * 3, []
        for one, level in zip(self.rotors, y[13:], strict=True):
            a, dx = one["axis"], (self.command - level) / one["time_constant"]
            push = [one["thrust_coefficient"] * level * level * c for c in a]
            drag = -one["sense"] * one["torque_coefficient"] * level * level
            force, torque = added(force, push), added(torque, cross(one["arm"], push), [drag * c for c in a])
            turn = one["sense"] * one["inertia"]
            inside, growth = added(inside, [turn * level * c for c in a]), added(growth, [turn * dx * c for c in a])
            more.append(dx)
        whole = added(list(self.inertia * matrix(w)), inside)
        dw = list(self.inverse * matrix(added(cross(whole, w), [-g for g in growth], torque)))
        dv = [f / self.mass + g for f, g in zip(added(rotated(q, force), force_world, self.held), gravity, strict=True)]
        s, u = q[0], q[1:]
        dq = [-dot(u, w) / 2, *((s * a + b) / 2 for a, b in zip(w, cross(u, w), strict=True))]
        return [*y[7:10], *dq, *dv, *dw, *more]


class Whole:
    """All bodies, and the links between them."""

    def __init__(self, problem):
        self.plants = {name: Plant(given, problem["command"]) for name, given in problem["bodies"].items()}
        self.gravity, self.links = numbers(problem["gravity"]), problem["links"]

    def parts(self, y):
        found, at = {}, 0
        for name, plant in self.plants.items():
            found[name] = y[at : at + plant.size]
            at += plant.size
        return found

    def slope(self, y):
        parts = self.parts(y)
        forces, torques = ({name: [mpf(0)] * 3 for name in parts} for _ in range(2))
        for one in self.links:
            names = one["bodies"]
            arms = [self.plants[n].arm(parts[n], point) for n, point in zip(names, one["points"], strict=True)]
            ends = [added(parts[n][0:3], arm) for n, arm in zip(names, arms, strict=True)]
            speeds = [self.plants[n].velocity(parts[n], arm) for n, arm in zip(names, arms, strict=True)]
            away = minus(*ends)
            length = mp.sqrt(dot(away, away))
            pull = mpf(one["stiffness"]) * (length - mpf(one["rest_length"]))
            pull += mpf(one["damping"]) * dot(away, minus(*speeds)) / length
            assert pull > 0 or not one["slack"], "a rope is slack"
            for name, arm, sign in zip(names, arms, (-1, 1), strict=True):
                force = [sign * pull * c / length for c in away]
                forces[name], torques[name] = added(forces[name], force), added(torques[name], cross(arm, force))
        found = []
        for name, plant in self.plants.items():
            found += plant.slope(parts[name], self.gravity, forces[name], torques[name])
        return found


def solve(problem, digits, columns, step):
    """Return the states of the body frames at the samples."""
    mp.dps = digits
    whole, step = Whole(problem), mpf(step)
    y = [c for plant in whole.plants.values() for c in plant.start]
    t, samples = mpf(0), {}
    for sample in SAMPLES:
        parts = int(mp.ceil((mpf(sample) - t) / step))
        h = (mpf(sample) - t) / parts
        for _ in range(parts):
            y = extrapolated(whole.slope, y, h, columns)
        t = mpf(sample)
        samples[sample] = {name: whole.plants[name].frame(part) for name, part in whole.parts(y).items()}
    return samples


def entry(item):
    """Solve one problem twice and return its JSON."""
    name, problem = item
    found, control = (solve(problem, *how) for how in (ACCURATE, CONTROL))
    mp.dps = ACCURATE[0]
    difference = max(
        abs(a - b) for t in SAMPLES for n in problem["bodies"] for a, b in zip(found[t][n], control[t][n], strict=True)
    )
    assert difference < WANTED_AGREEMENT, f"{name}: {difference}"
    samples = {t: {n: [mp.nstr(c, PRINTED_DIGITS) for c in y] for n, y in found[t].items()} for t in SAMPLES}
    return name, {**problem, "samples": samples, "agreement": mp.nstr(difference, 2)}


def main():
    with multiprocessing.Pool(2) as pool:
        entries = dict(pool.map(entry, PROBLEMS.items(), chunksize=1))
    for name, one in entries.items():
        print(name, one["agreement"])
    FILE.write_text(json.dumps({"problems": entries}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
