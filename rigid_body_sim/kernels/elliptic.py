"""Elliptic integrals and functions, in terms of the complementary parameter 1 − k², which keeps its digits near k = 1.

Sources: Carlson, Numerical Algorithms 10 (1995) 13 (symmetric integrals, by duplication); Bulirsch, Numerische
Mathematik 7 (1965) 78 (Jacobi's functions, by descending Landen transformations).
"""

import math

from .arrays import Floats
from .compiled import kernel

MOST_STEPS = 40  # of each iteration; arguments as far apart as 1e-300 and 1 take 16
JACOBI_WORK = 2 * MOST_STEPS  # floats of scratch space that ``jacobi`` needs


@kernel
def quarter_period(mc: float) -> float:
    """K(k), the quarter period, from mc = 1 − k² in (0, 1]: π / 2 over the arithmetic-geometric mean of 1 and √mc."""
    a, b = 1.0, math.sqrt(mc)
    for _ in range(MOST_STEPS):
        if abs(a - b) <= 1e-8 * a:  # the next mean is right to 1e-17
            break
        a, b = 0.5 * (a + b), math.sqrt(a * b)
    return math.pi / (a + b)


@kernel
def carlson_rf(x: float, y: float, z: float) -> float:
    """R_F(x, y, z) for arguments that are not negative, at most one of them zero."""
    a0 = (x + y + z) / 3.0
    a, spread = a0, 400.0 * max(abs(a0 - x), abs(a0 - y), abs(a0 - z))  # (3 · 2⁻⁵⁶)^(−1/6) ≈ 540 with room
    dx, dy, power = a0 - x, a0 - y, 1.0
    for _ in range(MOST_STEPS):
        if power * spread <= a:
            break
        root_x, root_y, root_z = math.sqrt(x), math.sqrt(y), math.sqrt(z)
        shift = root_x * root_y + root_x * root_z + root_y * root_z
        a, x, y, z = 0.25 * (a + shift), 0.25 * (x + shift), 0.25 * (y + shift), 0.25 * (z + shift)
        power *= 0.25
    dx, dy = power * dx / a, power * dy / a
    dz = -(dx + dy)
    e2, e3 = dx * dy - dz * dz, dx * dy * dz
    return (1.0 - e2 / 10.0 + e3 / 14.0 + e2 * e2 / 24.0 - 3.0 * e2 * e3 / 44.0) / math.sqrt(a)


@kernel
def carlson_rj(x: float, y: float, z: float, p: float, delta: float) -> float:
    """R_J(x, y, z, p) for p > 0 and delta = (p − x)(p − y)(p − z) ≥ 0, which the caller knows without cancellation."""
    a0 = (x + y + z + 2.0 * p) / 5.0
    a, spread = a0, 500.0 * max(abs(a0 - x), abs(a0 - y), abs(a0 - z), abs(a0 - p))
    dx, dy, dz = a0 - x, a0 - y, a0 - z
    power, total = 1.0, 0.0
    for _ in range(MOST_STEPS):
        if power * spread <= a:
            break
        root_x, root_y, root_z, root_p = math.sqrt(x), math.sqrt(y), math.sqrt(z), math.sqrt(p)
        shift = root_x * root_y + root_x * root_z + root_y * root_z
        d = (root_p + root_x) * (root_p + root_y) * (root_p + root_z)
        total += power / d * _arctan_over_root(delta / d / d)
        a, x, y = 0.25 * (a + shift), 0.25 * (x + shift), 0.25 * (y + shift)
        z, p, delta = 0.25 * (z + shift), 0.25 * (p + shift), delta / 64.0
        power *= 0.25
    dx, dy, dz = power * dx / a, power * dy / a, power * dz / a
    dp = -0.5 * (dx + dy + dz)
    e2 = dx * dy + dx * dz + dy * dz - 3.0 * dp * dp
    e3 = dx * dy * dz + 2.0 * e2 * dp + 4.0 * dp * dp * dp
    e4 = (2.0 * dx * dy * dz + e2 * dp + 3.0 * dp * dp * dp) * dp
    e5 = dx * dy * dz * dp * dp
    series = 1.0 - 3.0 * e2 / 14.0 + e3 / 6.0 + 9.0 * e2 * e2 / 88.0 - 3.0 * e4 / 22.0 - 9.0 * e2 * e3 / 52.0
    return power * (series + 3.0 * e5 / 26.0) / (a * math.sqrt(a)) + 6.0 * total


@kernel
def _arctan_over_root(e: float) -> float:
    """arctan(√e) / √e = R_C(1, 1 + e) for e ≥ 0."""
    if e < 1e-9:
        return 1.0 - e / 3.0
    root = math.sqrt(e)
    return math.atan(root) / root


@kernel
def jacobi(u: float, mc: float, work: Floats) -> tuple[float, float, float]:
    """sn, cn and dn of u, |u| ≤ K, from mc = 1 − k² in [0, 1]; ``work`` is scratch space of JACOBI_WORK floats."""
    if mc == 0.0:
        e = math.exp(-abs(u))
        sech = 2.0 * e / (1.0 + e * e)
        tanh = (1.0 - e) * (1.0 + e) / (1.0 + e * e)
        return math.copysign(tanh, u), sech, sech
    a, b, mean, last = 1.0, mc, 1.0, 0
    for i in range(MOST_STEPS):
        b = math.sqrt(b)
        work[2 * i], work[2 * i + 1] = a, b
        mean, last = 0.5 * (a + b), i
        if abs(a - b) <= 1e-8 * a:
            break
        a, b = mean, a * b
    sine, cosine = math.sin(mean * u), math.cos(mean * u)
    if abs(sine) < 1e-20:  # the next term is smaller than round-off, and the squares below would overflow
        return u, 1.0, 1.0
    ratio, dn = cosine / sine, 1.0
    c = mean * ratio
    for i in range(last, -1, -1):
        a = work[2 * i]
        ratio *= c
        c *= dn
        dn = (work[2 * i + 1] + ratio) / (a + ratio)
        ratio = c / a
    sn = math.copysign(1.0 / math.sqrt(1.0 + c * c), sine)
    return sn, c * sn, dn
