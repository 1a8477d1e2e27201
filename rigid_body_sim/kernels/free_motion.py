"""Rotation without torque in closed form: the attitude after any time in one evaluation.

With G = |L| and the moments of inertia sorted, l = Rᵀ L circulates about the axis of the smallest or of the largest
moment, called s; b is the middle one and r the other. In axes 1, 2, 3 along r, b, s, right-handed with l₃ > 0,

    l₁ = A₁ cn u,   l₂ = A₂ sn u,   l₃ = A₃ dn u,   u = u₀ ± λ t,

and the attitude is ``C ⊗ turn(e₃, ψ) ⊗ p(l)``, where p is the shortest rotation of l onto e₃ (never near its
singularity, as l₃ > 0), C is constant, and ψ = Φ − φ: φ is the azimuth of l about e₃, a closed form, and

    Φ = G t / I_b + (G δ_rb / λ) ∫ cn² / (1 + ν sn²) du,   δ_ij = |1/I_i − 1/I_j|,   ν = δ_rb / δ_sb,

a Legendre integral of the third kind. The formulae are those of Celledoni, Fassò, Säfström, Zanna, SIAM J. Sci. Comput.
30 (2008) 2084, and van Zon, Schofield, J. Comput. Phys. 225 (2007) 145, written such that nothing cancels: 1 − k² comes
from the distance to the separatrix, worked out in twice the precision, and the integral is a sum of positive terms.
Multiplied by I_r I_b I_s, the differences of inverse moments are d_sb = |I_b − I_s| I_r and so on.
"""

import math

from .arrays import Floats
from .compiled import kernel
from .elliptic import JACOBI_WORK, carlson_rf, carlson_rj, jacobi, quarter_period
from .extended import two_sum, xadd, xdot, xmultiply, xrotate_back
from .model import MOMENTS
from .state import LOW, L, Q, align, is_thin
from .tuples import NO_TURN, Quat
from .vectors import power_of_two, qmultiply

MOST_TURNS = 1e15  # rad: after a larger angle no digit of the attitude is left
NO_TILT = 1e-130  # relative to |L|: a spin nearer to the middle axis, whose squares would underflow, counts as along it
_SPIN = JACOBI_WORK  # angular momentum in principal axes times |q|², high parts, 3
_SPIN_LOW = _SPIN + 3  # low parts, 3
_MOMENTS = _SPIN + 6  # scaled moments, 3
_MOTION = _SPIN + 9  # what _circulation finds
_DELTA = _MOTION + 10  # vector part of the rotation, principal axes, 3
WORK_SIZE = _DELTA + 3
_A1, _A2, _A3, _LAMBDA, _K2, _MC, _NU, _WEIGHT = range(_MOTION, _MOTION + 8)


@kernel
def turn_freely(state: Floats, model: Floats, work: Floats, t: float) -> bool:
    """Turn the attitude in the flat state by a torque-free motion of t [s]; False when the angle is too large.

    L is not touched. A body at rest keeps its attitude to the bit.
    """
    largest = max(abs(state[L]), abs(state[L + 1]), abs(state[L + 2]))
    if largest == 0.0:
        return True
    if model[MOMENTS] == model[MOMENTS + 1] == model[MOMENTS + 2]:
        return _turn_sphere(state, largest, largest / model[MOMENTS] * t)
    # Units in which |L| and the largest moment are about 1, by powers of two: nothing underflows, nothing is rounded.
    unit_l = math.frexp(largest)[1] + 0  # of 64 bits for numba, like other whole numbers
    unit_i = math.frexp(max(model[MOMENTS], model[MOMENTS + 1], model[MOMENTS + 2]))[1]
    time = t * power_of_two(unit_l - unit_i)
    for i in range(3):
        work[_MOMENTS + i] = model[MOMENTS + i] * power_of_two(-unit_i)
    qq, g = _body_momentum(state, work, power_of_two(-unit_l))
    rate = 0.0
    for i in range(3):
        rate += abs(work[_SPIN + i]) / work[_MOMENTS + i]
    if not rate * time / qq < MOST_TURNS:
        return False
    r, b, s, distance = _sides(work)
    dw, d1, d2, d3, tau, sigma = _relative_turn(work, r, b, s, qq, distance / (qq * qq), g, time)
    work[_DELTA + r], work[_DELTA + b], work[_DELTA + s] = d1, tau * d2, sigma * d3
    _replace_attitude(state, NO_TURN, Quat(dw, work[_DELTA], work[_DELTA + 1], work[_DELTA + 2]))
    if is_thin(model):
        unit = power_of_two(unit_l)
        align(state, unit * work[_SPIN], 0.0, unit * work[_SPIN + 1], 0.0, unit * work[_SPIN + 2], 0.0)
    return True


@kernel
def _turn_sphere(state: Floats, largest: float, turn: float) -> bool:
    """All moments equal: the axis of L stays in the body and in the world, q ← exp(½ ω t) ⊗ q.

    ``largest`` is the largest component of L and ``turn`` [rad] what that of ω turns by.
    """
    x, y, z = state[L] / largest, state[L + 1] / largest, state[L + 2] / largest
    norm = math.sqrt(x * x + y * y + z * z)
    angle = norm * turn
    if not abs(angle) < MOST_TURNS:
        return False
    sine = math.sin(0.5 * angle) / norm
    _replace_attitude(state, Quat(math.cos(0.5 * angle), sine * x, sine * y, sine * z), NO_TURN)
    return True


@kernel
def _body_momentum(state: Floats, work: Floats, scale: float) -> tuple[float, float]:
    """Put |q|² Rᵀ L, scaled, into ``work``; return |q|² and scaled |L|.

    In twice the precision: close to the separatrix, the last bit of a component decides when the body turns over.
    """
    i = LOW
    w, x, y, z = state[Q], state[Q + 1], state[Q + 2], state[Q + 3]
    wl, xl, yl, zl = state[i + Q], state[i + Q + 1], state[i + Q + 2], state[i + Q + 3]
    a, b, c = scale * state[L], scale * state[L + 1], scale * state[L + 2]
    al, bl, cl = scale * state[i + L], scale * state[i + L + 1], scale * state[i + L + 2]
    h, k = _SPIN, _SPIN_LOW
    qq, _, work[h], work[k], work[h + 1], work[k + 1], work[h + 2], work[k + 2] = xrotate_back(
        w, wl, x, xl, y, yl, z, zl, a, al, b, bl, c, cl
    )
    gg, _ = xdot(a, al, a, al, b, bl, b, bl, c, cl, c, cl)
    return qq, math.sqrt(gg)


@kernel
def _sides(work: Floats) -> tuple[int, int, int, float]:
    """The axes r, b, s, and |q|⁴ (d_sb l_s² − d_rb l_r²) ≥ 0, which vanishes on the separatrix."""
    m = _MOMENTS
    a, b, c = 0, 1, 2
    if work[m + a] > work[m + b]:
        a, b = b, a
    if work[m + b] > work[m + c]:
        b, c = c, b
    if work[m + a] > work[m + b]:
        a, b = b, a
    ch, cl = _weighted_square(work, c, b, a)
    ah, al = _weighted_square(work, a, b, c)
    distance, _ = xadd(ch, cl, -ah, -al)
    if distance >= 0.0:
        return a, b, c, distance
    return c, b, a, -distance


@kernel
def _weighted_square(work: Floats, i: int, j: int, k: int) -> tuple[float, float]:
    """|I_i − I_j| I_k l_i² in twice the precision, l with the factor |q|²."""
    m = _MOMENTS
    dh, dl = two_sum(work[m + i], -work[m + j])
    if dh < 0.0:
        dh, dl = -dh, -dl
    dh, dl = xmultiply(dh, dl, work[m + k], 0.0)
    lh, ll = work[_SPIN + i], work[_SPIN_LOW + i]
    lh, ll = xmultiply(lh, ll, lh, ll)
    return xmultiply(dh, dl, lh, ll)


@kernel
def _relative_turn(
    work: Floats, r: int, b: int, s: int, qq: float, distance: float, g: float, time: float
) -> tuple[float, float, float, float, float, float]:
    """The rotation from the attitude at 0 to that at ``time``, in axes 1, 2, 3, and the signs of axes 2 and 3.

    The rotation is not normalised. The angular momentum at ``time``, scaled, principal axes, takes the place of that at
    0 in ``work``. ``distance`` is d_sb l₃² − d_rb l₁².
    """
    sigma = -1.0 if work[_SPIN + s] < 0.0 else 1.0
    tau = sigma if (b - r) % 3 == 1 else -sigma
    l1, l2, l3 = work[_SPIN + r] / qq, tau * (work[_SPIN + b] / qq), abs(work[_SPIN + s]) / qq
    mr, mb, ms = work[_MOMENTS + r], work[_MOMENTS + b], work[_MOMENTS + s]
    if _circulation(work, mr, mb, ms, l1, l2, l3, distance, g):
        direction = 1.0 if ms >= mb else -1.0
        psi, e1, e2, e3 = _advance(work, l1, l2, l3, direction * time)
        psi += g * time / mb
    else:
        psi = time * ((l1 * l1 / mr + l2 * l2 / mb + l3 * l3 / ms) + g * l3 / ms) / (g + l3)
        e1, e2, e3 = l1, l2, l3
    work[_SPIN + r], work[_SPIN + b], work[_SPIN + s] = e1, tau * e2, sigma * e3
    sine, cosine = math.sin(0.5 * psi), math.cos(0.5 * psi)
    dw, d1, d2, d3 = qmultiply(g + l3, -l2, l1, 0.0, cosine, 0.0, 0.0, sine)
    dw, d1, d2, d3 = qmultiply(dw, d1, d2, d3, g + e3, e2, -e1, 0.0)
    return dw, d1, d2, d3, tau, sigma


@kernel
def _circulation(
    work: Floats, mr: float, mb: float, ms: float, l1: float, l2: float, l3: float, distance: float, g: float
) -> bool:
    """Amplitudes, rate and moduli of the circulation of l into ``work``; False when l stays where it is."""
    d_sb, d_rb, d_sr = abs(mb - ms) * mr, abs(mb - mr) * ms, abs(mr - ms) * mb
    e_s, e_r = d_sb * l2 * l2 + d_sr * l1 * l1, d_rb * l2 * l2 + d_sr * l3 * l3
    rate = math.sqrt(d_sb) * math.sqrt(e_r)
    if rate == 0.0 or e_s == 0.0 or max(abs(l1), l3) < NO_TILT * g:
        return False
    work[_A1], work[_A2], work[_A3] = math.sqrt(e_s / d_sr), math.sqrt(e_s / d_sb), math.sqrt(e_r / d_sr)
    work[_LAMBDA] = rate / (mr * mb * ms)
    work[_K2] = d_rb * e_s / (d_sb * e_r)
    work[_MC] = min(1.0, d_sr * distance / (d_sb * e_r))
    work[_NU] = d_rb / d_sb
    work[_WEIGHT] = g * d_rb / rate
    return True


@kernel
def _advance(work: Floats, l1: float, l2: float, l3: float, time: float) -> tuple[float, float, float, float]:
    """ψ − G t / I_b and l after ``time``, which counts in the direction of u."""
    mc, weight = work[_MC], work[_WEIGHT]
    side = -1.0 if l1 < 0.0 else 1.0  # l = (side A₁ cn v, side A₂ sn v, A₃ dn v) with |v| ≤ K
    s, c, d = side * l2 / work[_A2], abs(l1) / work[_A1], l3 / work[_A3]
    v = _phase(s, c, d, mc) + work[_LAMBDA] * time
    psi = math.atan2(work[_A2] * s, work[_A1] * c) - weight * _third_kind(work, s, c, d)
    if mc > 0.0:
        half = 2.0 * quarter_period(mc)
        halves = math.floor(v / half + 0.5)
        v -= halves * half
        psi += halves * (2.0 * weight * _third_kind(work, 1.0, 0.0, math.sqrt(mc)) - math.pi)
        side = side if halves % 2 == 0 else -side
    s, c, d = jacobi(v, mc, work)
    psi += weight * _third_kind(work, s, c, d) - math.atan2(work[_A2] * s, work[_A1] * c)
    return psi, side * work[_A1] * c, side * work[_A2] * s, work[_A3] * d


@kernel
def _phase(s: float, c: float, d: float, mc: float) -> float:
    """u in [−K, K] with sn u = s, cn u = c ≥ 0, dn u = d."""
    if mc == 0.0:
        return math.asinh(s / c)
    return s * carlson_rf(c * c, d * d, 1.0)


@kernel
def _third_kind(work: Floats, s: float, c: float, d: float) -> float:
    """∫ cn² / (1 + ν sn²) du from 0 to the u in [−K, K] with sn u = s, cn u = c ≥ 0, dn u = d.

    In Carlson's form it is a difference of two integrals; his relation between two values of the parameter p (DLMF
    19.21.12) turns it into a sum of positive terms.
    """
    mc, nu = work[_MC], work[_NU]
    if nu == 0.0:
        return 0.0  # the symmetric body: its weight is zero
    h2 = nu * (nu + work[_K2]) / (1.0 + nu)
    h = math.sqrt(h2)
    plain = math.atan2(s * c * h, d) / h
    if mc == 0.0 or s == 0.0:
        return plain
    share = mc / (1.0 + nu)
    ss = s * s
    rj = carlson_rj(c * c, d * d, 1.0, c * c + share * ss, share * share * h2 * ss * ss * ss)
    return plain + share * ss * s / 3.0 * rj


@kernel
def _replace_attitude(state: Floats, a: Quat, b: Quat) -> None:
    """q ← a ⊗ q ⊗ b, scaled to unit length, with the low-order parts of q taken in."""
    q, i = Q, LOW + Q
    w, x, y, z = qmultiply(a.w, a.x, a.y, a.z, state[q], state[q + 1], state[q + 2], state[q + 3])
    w, x, y, z = qmultiply(w, x, y, z, b.w, b.x, b.y, b.z)
    c, d, e, f = qmultiply(a.w, a.x, a.y, a.z, state[i], state[i + 1], state[i + 2], state[i + 3])
    c, d, e, f = qmultiply(c, d, e, f, b.w, b.x, b.y, b.z)
    w, x, y, z = w + c, x + d, y + e, z + f
    unit = 1.0 / math.sqrt(w * w + x * x + y * y + z * z)
    state[q], state[q + 1], state[q + 2], state[q + 3] = unit * w, unit * x, unit * y, unit * z
    state[i], state[i + 1], state[i + 2], state[i + 3] = 0.0, 0.0, 0.0, 0.0
