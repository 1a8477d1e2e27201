"""
Solve bodies with actuators with mpmath to more than 30 digits and write actuators.json.

Run `python -m bench.reference.make_actuators` (some minutes). Nothing that simulates is imported, and nothing is known
in closed form but when a wheel reaches its top speed. In the axes of the body frame, with the inertia I about the
centre of mass, each actuator's level x_i and each wheel's angular momentum s_i among the unknowns:

    p' = v        m v' = R F + m g        q' = 1/2 q (0, w)        I w' = (I w + h) x w - h' + t
    x_i' = (u_i - x_i) / T_i              s_i' = x_i, a wheel's at its top speed 0
    h = sum J_i x_i d_i a_i (rotors) + s_i a_i (wheels)

A thruster's force is x a, a rotor's k x^2 a and its drag torque -d k_q x^2 a, with d = 1 for ccw and -1 for cw. A
command u_i sent at t arrives at t + delay_i. The method is extrapolation of the modified midpoint rule (Gragg,
Bulirsch, Stoer; Hairer, Norsett & Wanner I, section II.9) between events. Everything is solved twice, with different
steps, orders and numbers of digits; both must agree.
"""

import json
import multiprocessing

from mpmath import exp, matrix, mp, mpf

from . import DATA

FILE = DATA / "actuators.json"
ACCURATE, CONTROL = (46, 16, "0.008"), (42, 14, "0.007")  # decimal digits, columns of the extrapolation, step [s]
FINER = {"thrusters": 4}  # by how much shorter the steps are where a lag is short
WANTED_AGREEMENT = mpf("1e-30")
PRINTED_DIGITS = 35
NEVER = "1000"


def rotor(name, position, direction, delay):
    """One of a small quadrotor whose axes lean outwards a little."""
    axis = (position[0] * 0.1, position[1] * 0.1, 1.0)
    return {
        "name": name, "type": "rotor", "position": position, "axis": axis, "min": 0.0, "max": 838.0,
        "time_constant": 0.05, "delay": delay, "thrust_coefficient": 8.54858e-06, "torque_coefficient": 1.3677728e-07,
        "direction": direction, "inertia": 6e-5, "initial": 400.0,
    }  # fmt: skip


def wheel(name, axis, lag, most):
    return {
        "name": name, "type": "wheel", "axis": axis, "min": -0.2, "max": 0.2, "time_constant": lag, "delay": "0.013",
        "inertia": 2e-3, "max_speed": most, "initial": 150.0,
    }  # fmt: skip


def thruster(name, position, axis, lag, delay):
    return {
        "name": name, "type": "thruster", "position": position, "axis": axis, "min": -40.0, "max": 40.0,
        "time_constant": lag, "delay": delay, "initial": 3.0 if lag else 0.0,
    }  # fmt: skip


BODY = {
    "mass": 0.716,
    "inertia": [0.0075, 0.0080, 0.0130, 2e-4, -1e-4, 3e-4],
    "center_of_mass": [0.002, -0.001, 0.0005],
}
LARGE = {"mass": 11.5, "inertia": [0.16, 0.21, 0.25, 0.01, -0.02, 0.005], "center_of_mass": [0.0, 0.01, -0.02]}
AT_REST = {"orientation": [1.0, 0.0, 0.0, 0.0], "angular_velocity": [0.0, 0.0, 0.0]}
TUMBLING = {"orientation": [0.9, 0.1, -0.3, 0.2], "angular_velocity": [0.4, -1.0, 0.7]}
PROBLEMS = {
    "quadrotor": {
        "body": BODY, "initial": TUMBLING, "gravity": [0.3, -0.2, -9.8],
        "actuators": [
            rotor("front", [0.17, 0.0, 0.01], "cw", "0.0"), rotor("left", [0.0, 0.17, 0.01], "ccw", "0.02"),
            rotor("back", [-0.17, 0.0, 0.01], "cw", "0.0337"), rotor("right", [0.0, -0.17, 0.01], "ccw", "0.1"),
        ],
        "commands": [["0", [453.0, 460.0, 440.0, 450.0]], ["0.3", [500.0, 300.0, 450.0, 420.0]],
                     ["0.5", [0.0, 600.0, 453.0, 838.0]]],
    },
    "wheels": {
        "body": LARGE, "initial": TUMBLING, "gravity": [0.0, 0.0, 0.0],
        "actuators": [wheel("x", [1.0, 0.0, 0.1], 0.03, 160.0), wheel("y", [0.0, -2.0, 0.0], 0.0, 155.0),
                      wheel("z", [0.3, 0.2, 1.0], 0.4, 0.0)],
        "commands": [["0", [0.1, 0.15, -0.2]], ["0.4", [-0.1, -0.05, 0.2]], ["0.7", [0.2, 0.1, 0.05]]],
    },
    "thrusters": {
        "body": LARGE, "initial": AT_REST, "gravity": [0.0, 0.0, -9.80665],
        "actuators": [thruster("a", [0.2, 0.1, 0.0], [1.0, 0.3, 0.0], 0.11, "0.0"),
                      thruster("b", [0.1, -0.2, 0.05], [0.0, 0.0, 1.0], 0.004, "0.05"),
                      thruster("c", [-0.2, 0.1, 0.1], [0.2, 1.0, -0.4], 0.0, "0.071")],
        "commands": [["0", [10.0, -5.0, 20.0]], ["0.2", [-30.0, 40.0, 0.0]], ["0.8", [5.0, 20.0, -10.0]]],
    },
}  # fmt: skip
SAMPLES = ("0.1", "0.6", "1.0")


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def rotated(q, v):
    """R v of a quaternion that is of unit length but for the error of the method."""
    w, u = q[0], q[1:]
    t = [2 * c for c in cross(u, v)]
    return [a + w * b + c for a, b, c in zip(v, t, cross(u, t), strict=True)]


class Plant:
    """The right-hand side; ``targets`` and ``blocked`` change at events."""

    def __init__(self, problem):
        body = problem["body"]
        self.mass, self.center = mpf(body["mass"]), [mpf(c) for c in body["center_of_mass"]]
        xx, yy, zz, xy, xz, yz = (mpf(c) for c in body["inertia"])
        self.inertia = matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        self.inverse = self.inertia**-1
        self.gravity = [mpf(c) for c in problem["gravity"]]
        self.each = [self._read(one) for one in problem["actuators"]]
        self.targets, self.blocked = [mpf(0)] * len(self.each), [False] * len(self.each)

    def _read(self, one):
        axis = [mpf(c) for c in one["axis"]]
        size = mp.sqrt(sum(c * c for c in axis))
        numbers = ("time_constant", "thrust_coefficient", "torque_coefficient", "inertia", "max_speed")
        read = {name: mpf(one.get(name, 0)) for name in numbers}
        arm = [mpf(p) - c for p, c in zip(one.get("position", [0, 0, 0]), self.center, strict=True)]
        sense = -1 if one.get("direction") == "cw" else 1
        return {**read, "type": one["type"], "axis": [c / size for c in axis], "arm": arm, "sense": sense}

    def level(self, i, y):
        return self.targets[i] if self.each[i]["time_constant"] == 0 else y[13 + 2 * i]

    def slope(self, y):
        q, v, w = y[3:7], y[7:10], y[10:13]
        force, torque, inside, growth, more = [mpf(0)] * 3, [mpf(0)] * 3, [mpf(0)] * 3, [mpf(0)] * 3, []
        for i, one in enumerate(self.each):
            x, a, lag = self.level(i, y), one["axis"], one["time_constant"]
            dx = (self.targets[i] - x) / lag if lag > 0 else mpf(0)
            ds = x if one["type"] == "wheel" and not self.blocked[i] else mpf(0)
            more += [dx, ds]
            if one["type"] == "wheel":
                inside = [h + y[14 + 2 * i] * c for h, c in zip(inside, a, strict=True)]
                growth = [g + ds * c for g, c in zip(growth, a, strict=True)]
                continue
            thrust = x if one["type"] == "thruster" else one["thrust_coefficient"] * x * x
            push = [thrust * c for c in a]
            drag = -one["sense"] * one["torque_coefficient"] * x * x
            force = [f + p for f, p in zip(force, push, strict=True)]
            torque = [t + c + drag * b for t, c, b in zip(torque, cross(one["arm"], push), a, strict=True)]
            turn = one["sense"] * one["inertia"]
            inside = [h + turn * x * c for h, c in zip(inside, a, strict=True)]
            growth = [g + turn * dx * c for g, c in zip(growth, a, strict=True)]
        own = list(self.inertia * matrix(w))
        whole = [a + b for a, b in zip(own, inside, strict=True)]
        moment = [a - b + c for a, b, c in zip(cross(whole, w), growth, torque, strict=True)]
        dw = list(self.inverse * matrix(moment))
        dv = [f / self.mass + g for f, g in zip(rotated(q, force), self.gravity, strict=True)]
        s, u = q[0], q[1:]
        dq = [-sum(a * b for a, b in zip(u, w, strict=True)) / 2]
        dq += [(s * a + b) / 2 for a, b in zip(w, cross(u, w), strict=True)]
        return [*v, *dq, *dv, *dw, *more]


def extrapolated(slope, y, h, columns):
    """One step of the modified midpoint rule with 2, 4, 6 ... parts, extrapolated."""
    table = []
    for j in range(1, columns + 1):
        n = 2 * j
        part, before = h / n, y
        now = [a + part * b for a, b in zip(y, slope(y), strict=True)]
        for _ in range(n - 1):
            before, now = now, [a + 2 * part * b for a, b in zip(before, slope(now), strict=True)]
        row = [[(a + b + part * c) / 2 for a, b, c in zip(before, now, slope(now), strict=True)]]
        for k in range(1, j):
            factor = (mpf(j) / (j - k)) ** 2 - 1
            row.append([a + (a - b) / factor for a, b in zip(row[k - 1], table[k - 1], strict=True)])
        table = row
    return table[-1]


def spin_after(plant, i, y, t):
    lag, x, u = plant.each[i]["time_constant"], plant.level(i, y), plant.targets[i]
    return y[14 + 2 * i] + u * t + ((x - u) * lag * (1 - exp(-t / lag)) if lag > 0 else 0)


def next_wheel_event(plant, y, longest):
    """Set which wheels are blocked, and return the time until that changes, found by halving."""
    first = longest
    for i, one in enumerate(plant.each):
        if one["type"] != "wheel" or one["max_speed"] == 0:
            continue
        most, x, u, lag = one["inertia"] * one["max_speed"], plant.level(i, y), plant.targets[i], one["time_constant"]
        turn = lag * mp.log(1 - x / u) if lag > 0 and x * u < 0 else longest
        push = x if turn > mpf("1e-30") else u
        plant.blocked[i] = abs(y[14 + 2 * i]) >= most * (1 - mpf("1e-35")) and y[14 + 2 * i] * push > 0
        if plant.blocked[i]:
            first = min(first, turn) if turn > mpf("1e-30") else first
            continue
        for low, high in ((mpf(0), min(turn, longest)), (turn, longest)):
            if low < high and abs(spin_after(plant, i, y, high)) > most:
                while high - low > mpf(10) ** (5 - mp.dps):
                    middle = (low + high) / 2
                    low, high = (low, middle) if abs(spin_after(plant, i, y, middle)) > most else (middle, high)
                first = min(first, high)
                break
    return first


def arrivals(problem):
    """Times, and what arrives then: actuator and command."""
    found = []
    for sent, values in problem["commands"]:
        for i, (one, value) in enumerate(zip(problem["actuators"], values, strict=True)):
            found.append((mpf(sent) + mpf(one["delay"]), i, mpf(value)))
    return sorted(found)


def solve(problem, digits, columns, step, finer):
    """Return the states of the body frame, levels and momenta of wheels at the samples."""
    mp.dps = digits
    plant, step = Plant(problem), mpf(step) / finer
    start = problem["initial"]
    q = [mpf(c) for c in start["orientation"]]
    size = mp.sqrt(sum(c * c for c in q))
    q, w = [c / size for c in q], [mpf(c) for c in start["angular_velocity"]]
    c = plant.center
    y = [*rotated(q, c), *q, *rotated(q, cross(w, c)), *w]
    for one, read in zip(problem["actuators"], plant.each, strict=True):
        first = mpf(one["initial"])
        y += [mpf(0), first * read["inertia"]] if one["type"] == "wheel" else [first, mpf(0)]
    coming, t, samples = arrivals(problem), mpf(0), {}
    for sample in SAMPLES:
        while t < mpf(sample):
            while coming and coming[0][0] <= t:
                _, i, plant.targets[i] = coming.pop(0)
            end = min([mpf(sample), *(at for at, _, _ in coming[:1])])
            while t < end:
                until = t + next_wheel_event(plant, y, end - t)
                until = end if end - until < mpf(10) ** (8 - digits) else until
                while t < until:
                    h = min(step, until - t)
                    y = extrapolated(plant.slope, y, h, columns)
                    t = until if until - t - h < mpf(10) ** (8 - digits) else t + h
        samples[sample] = shown(plant, y)
    return samples


def shown(plant, y):
    q = y[3:7]
    size = mp.sqrt(sum(c * c for c in q))
    q, c, w = [a / size for a in q], plant.center, y[10:13]
    levels = [plant.level(i, y) for i in range(len(plant.each))]
    return {
        "position": [a - b for a, b in zip(y[0:3], rotated(q, c), strict=True)],
        "orientation": q,
        "velocity": [a - b for a, b in zip(y[7:10], rotated(q, cross(w, c)), strict=True)],
        "angular_velocity": w,
        "level": levels,
        "spin": y[14::2],
    }


def solved(name):
    """The samples of a problem, and how far two solutions of it differ."""
    accurate, control = (solve(PROBLEMS[name], *how, FINER.get(name, 1)) for how in (ACCURATE, CONTROL))
    mp.dps = ACCURATE[0]
    apart = max(
        abs(a - b)
        for sample in SAMPLES
        for key in accurate[sample]
        for a, b in zip(accurate[sample][key], control[sample][key], strict=True)
    )
    text = {s: {k: [mp.nstr(c, PRINTED_DIGITS) for c in v] for k, v in one.items()} for s, one in accurate.items()}
    return name, text, mp.nstr(apart, 3)


def main():
    with multiprocessing.Pool(2) as pool:
        results = pool.map(solved, PROBLEMS, chunksize=1)
    for name, _, apart in results:
        print(name, "differ by", apart)
        if not mpf(apart) < WANTED_AGREEMENT:
            raise SystemExit(f"{name}: the two solutions differ by {apart}, more than {WANTED_AGREEMENT}")
    problems = {name: {**PROBLEMS[name], "samples": text} for name, text, _ in results}
    FILE.write_text(json.dumps({"problems": problems}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
