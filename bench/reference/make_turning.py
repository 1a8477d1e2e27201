"""
Solve rotations of extreme bodies with mpmath to more than 30 digits and write turning.json, for the report's maps.

Run `python -m bench.reference.make_turning` (some minutes). Nothing that simulates is imported. Euler's equations in
principal axes with a constant torque t in body axes, and q' = 1/2 q (0, w), are integrated by their Taylor series from
q = 1, in SI units and with exact doubles for moments, rates, torque and time:

    I w' = (I w) x w + t

Every case is solved twice, with different order, step and number of digits; both must agree.
"""

import json
import multiprocessing

import mpmath
from mpmath import mp, mpf

from rigid_body_sim.report.reference.quaternions import product, unit

from . import DATA
from .make_torque_free import series, step_size

FILE = DATA / "turning.json"
ACCURATE = (64, 50)  # decimal digits, order
CONTROL = (58, 46)
WANTED_AGREEMENT = mpf("1e-30")
UNIT = (mpf(1), mpf(0), mpf(0), mpf(0))
ANGLE = 100.0  # rad, at the first spin


def cases():
    """Return moments, rates, torque by map and row."""
    w, t = (0.5, 0.7, -0.4), (1e-3, -2e-3, 1.5e-3)
    found = {"common": {"1.0": ((1.0, 2.0, 2.5), w, t)}}
    found["inertia"] = {
        repr(r): ((1.0, r, r), (1.0, 0.3 / r, 0.0), (1e-3, 0.0, 2e-3)) for r in (1.0, 10.0, 1e2, 1e3, 1e4, 1e5, 1e6)
    }
    found["edge"] = {repr(d): ((1.0, 2.0, 3.0 - d), w, t) for d in (1.0, 1e-1, 1e-2, 1e-4, 1e-8, 1e-12, 1e-15, 0.0)}
    found["separatrix"] = {
        repr(e): ((1.0, 2.0, 2.5), (e, 1.0, 0.5 * e), (0.0, 0.0, 0.0))
        for e in (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-15)
    }
    return found


def solve(moments, w, torque, t, digits, order):
    """Return the unit quaternion and the rates at the time t."""
    mp.dps = digits
    moments, w, torque, t = [mpf(i) for i in moments], [mpf(c) for c in w], [mpf(c) for c in torque], mpf(t)
    ratios = [(moments[(i + 1) % 3] - moments[(i + 2) % 3]) / moments[i] for i in range(3)]
    accelerations = [a / i for a, i in zip(torque, moments, strict=True)]
    q, done = UNIT, mpf(0)
    while done < t:
        Q, W = series(UNIT, w, ratios, order, accelerations)
        h = min(t - done, step_size(Q, W, digits, order))
        q = product(q, [mpmath.polyval(c[::-1], h) for c in Q])
        w = [mpmath.polyval(c[::-1], h) for c in W]
        done += h
    return unit(q) + w


def entry(item):
    """Solve one case twice and return its JSON."""
    name, row, (moments, rates, torque) = item
    mp.dps = ACCURATE[0]
    time = float(ANGLE / mpmath.sqrt(mpmath.fsum(mpf(c) ** 2 for c in rates)))
    end, control = (solve(moments, rates, torque, time, *how) for how in (ACCURATE, CONTROL))
    mp.dps = ACCURATE[0]
    difference = max(abs(a - b) for a, b in zip(end, control, strict=True))
    assert difference < WANTED_AGREEMENT, f"{name} {row}: {difference}"
    values = {"moments": moments, "rates": rates, "torque": torque, "time": time}
    return name, row, {**values, "end": [mpmath.nstr(c, 35) for c in end], "agreement": mpmath.nstr(difference, 2)}


def main():
    items = [(name, row, one) for name, rows in cases().items() for row, one in rows.items()]
    entries = {name: {} for name in cases()}
    with multiprocessing.Pool(2) as pool:
        for name, row, found in pool.imap(entry, items):
            entries[name][row] = found
            print(name, row, found["agreement"], flush=True)
    maps = []
    for name, rows in entries.items():
        lines = ",\n".join(f"{json.dumps(row)}: {json.dumps(one)}" for row, one in rows.items())
        maps.append(f"{json.dumps(name)}: {{\n{lines}\n}}")
    FILE.write_text("{\n" + ",\n".join(maps) + "\n}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
