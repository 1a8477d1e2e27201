"""
Solve torque-free rotations with mpmath to more than 30 digits and write torque_free.json.

Run `python -m bench.reference.make_torque_free` (some minutes). Nothing that simulates is imported,
and no elliptic function is used: Euler's equations in principal axes and q' = 1/2 q (0, w) are integrated by their
Taylor series. With moments I [kg m^2], the quaternion q (scalar first, principal axes to world) and the angular
momentum L [kg m^2/s, world], all exact doubles (q is divided by its norm at full precision), w = R(q)^T L / I at the
beginning, and

    I w' = (I w) x w

Every case is solved twice, with different order, step and number of digits; both must agree.
"""

import json
import multiprocessing
import random

import mpmath
from mpmath import mp, mpf

from rigid_body_sim.report.reference.quaternions import conjugate, product, unit

from . import DATA

FILE = DATA / "torque_free.json"
ACCURATE = (54, 46)  # decimal digits, order
CONTROL = (48, 42)
WANTED_AGREEMENT = mpf("1e-30")
UNIT = (1.0, 0.0, 0.0, 0.0)


def cases():
    """Return moments, q, L and time [s] by name."""
    rng = random.Random(11)

    def momentum(moments, size):
        return tuple(i * size * rng.gauss(0, 1) for i in moments)

    def attitude():
        return tuple(rng.gauss(0, 1) for _ in range(4))

    found = {}
    bodies = {
        **{
            f"asymmetric {''.join(order)}": tuple({"a": 0.1, "b": 0.2, "c": 0.25}[axis] for axis in order)
            for order in ("abc", "bca", "cab", "acb", "bac", "cba")
        },
        "plate": (0.5, 0.5000001, 1.0),
        "needle": (1.0, 0.001, 1.0005),
        "needle 1 to 1e6": (1e-6, 1.0, 1.0000005),
        "oblate": (0.2, 0.2, 0.3),
        "prolate": (0.1, 0.3, 0.3),
        "prolate about y": (0.3, 0.1, 0.3),
        "sphere": (0.2, 0.2, 0.2),
        "oblate but for the last digit": (0.2, 0.2 * (1 + 2.0**-52), 0.3),
        "prolate but for the last digit": (0.2, 0.3, 0.3 * (1 + 2.0**-52)),
        "sphere but for the last digits": (0.5 * (1 + 2.0**-52), 0.5, 0.5 * (1 + 2.0**-51)),
    }
    for name, moments in bodies.items():
        for k, (size, t) in enumerate(((1.0, 0.01), (2.0, 4.0))):
            found[f"{name} {k}"] = (moments, attitude(), momentum(moments, size), t * min(moments) / max(moments))
    moments = (0.1, 0.2, 0.25)
    found["long"] = (moments, attitude(), momentum(moments, 3.0), 30.0)
    found["small numbers"] = ((1e-12, 2e-12, 2.5e-12), attitude(), (3e-200, -1e-200, 2e-200), 3e187)
    found["large numbers"] = ((1e12, 2e12, 2.5e12), attitude(), (3e100, -1e100, 2e100), 3e-88)
    for axis in range(3):
        for tilt in (0.0, 1e-200, 1e-12, 1e-6):
            L = [tilt * 0.3] * 3
            L[axis] = (-1) ** axis * 0.6
            found[f"along axis {axis}, tilt {tilt}"] = (moments, UNIT, tuple(L), 8.0)
    found["equator of a prolate body"] = ((0.1, 0.3, 0.3), UNIT, (0.0, 0.3, -0.4), 8.0)
    found["next to the equator of a prolate body"] = ((0.1, 0.3, 0.3), UNIT, (1e-9, 0.3, -0.4), 8.0)
    # With moments 4, 5, 9 the separatrix is w_x = 3 w_z, in doubles too.
    for off in (0.0, 2.0**-52, -(2.0**-52), 1e-12, -1e-6):
        for wy in (0.0, 0.5, -3.0):
            L = (4.0 * 3.0 * (1.0 + off), 5.0 * wy, -9.0)
            found[f"separatrix {off:+.2g}, {wy}"] = ((4.0, 5.0, 9.0), UNIT, L, 12.0)
        found[f"separatrix {off:+.2g}, turned"] = (
            (4.0, 5.0, 9.0), (2.0, 0.0, 0.0, 1.0), (3.0 * (1.0 + off), -1.0, 2.0), 30.0,
        )  # fmt: skip
    return found


def series(q, w, ratios, order, accelerations=(0, 0, 0)):
    """Taylor coefficients of q and w; accelerations [rad/s^2] are those of a constant torque in body axes."""
    Q, W = [[c] for c in q], [[c] for c in w]
    s, x, y, z = Q
    a, b, c = W
    for k in range(order):

        def coefficient(one, other, k=k):
            return mpmath.fdot(one[: k + 1], other[k::-1])

        rates = [ratio * coefficient(W[(i + 1) % 3], W[(i + 2) % 3]) for i, ratio in enumerate(ratios)]
        if k == 0:
            rates = [rate + acceleration for rate, acceleration in zip(rates, accelerations, strict=True)]
        turn = [
            -coefficient(x, a) - coefficient(y, b) - coefficient(z, c),
            coefficient(s, a) + coefficient(y, c) - coefficient(z, b),
            coefficient(s, b) + coefficient(z, a) - coefficient(x, c),
            coefficient(s, c) + coefficient(x, b) - coefficient(y, a),
        ]
        for one, rate in zip(W, rates, strict=True):
            one.append(rate / (k + 1))
        for one, rate in zip(Q, turn, strict=True):
            one.append(rate / (2 * (k + 1)))
    return Q, W


def step_size(Q, W, digits, order):
    """The step [s] at whose end the last terms of the series, W's relative to the rate, are as small as the digits."""
    rate = max(abs(c[0]) for c in W)
    last = max(max(abs(c[k]) ** (mpf(1) / k) for c in Q if c[k]) for k in (order - 1, order))
    last = max(last, *(abs(c[k] / rate) ** (mpf(1) / k) for c in W for k in (order - 1, order)))
    return mpf(10) ** (-mpf(digits - 4) / order) / last


def solve(moments, q, L, t, digits, order):
    """Return the unit quaternion at the time t."""
    mp.dps = digits
    moments, q, L, t = [mpf(i) for i in moments], [mpf(c) for c in q], [mpf(c) for c in L], mpf(t)
    q = unit(q)
    spin = product(product(conjugate(q), [mpf(0), *L]), q)[1:]
    w = [l / i for l, i in zip(spin, moments, strict=True)]
    ratios = [(moments[(i + 1) % 3] - moments[(i + 2) % 3]) / moments[i] for i in range(3)]
    done = mpf(0)
    while done < t:
        Q, W = series(q, w, ratios, order)
        h = min(t - done, step_size(Q, W, digits, order))
        q = [mpmath.polyval(c[::-1], h) for c in Q]
        w = [mpmath.polyval(c[::-1], h) for c in W]
        done += h
    return unit(q)


def entry(item):
    """Solve one case twice and return its JSON."""
    name, (moments, q, L, t) = item
    end, control = solve(moments, q, L, t, *ACCURATE), solve(moments, q, L, t, *CONTROL)
    mp.dps = ACCURATE[0]
    difference = max(abs(a - b) for a, b in zip(end, control, strict=True))
    assert difference < WANTED_AGREEMENT, f"{name}: {difference}"
    values = {"moments": moments, "q": q, "L": L, "time": t}
    return name, {**values, "end": [mpmath.nstr(c, 35) for c in end], "agreement": mpmath.nstr(difference, 2)}


def main():
    with multiprocessing.Pool(2) as pool:
        entries = {}
        for name, found in pool.imap_unordered(entry, cases().items()):
            entries[name] = found
            print(name, found["agreement"], flush=True)
    lines = (f"{json.dumps(name)}: {json.dumps(entries[name])}" for name in cases())
    FILE.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
