"""RODAS: a Rosenbrock method of order 4(3), L-stable and stiffly accurate, with error control inside each step.

Source: Hairer & Wanner, Solving Ordinary Differential Equations II, 2nd ed., section IV.7; the coefficients are those
of their code RODAS (method 1). Six linear systems with one matrix a step, no iteration.

The attitude is counted from the beginning of the sub-step by a rotation vector θ in world axes, q = exp(θ) q₀, with
θ' = dexp⁻¹_θ ω, so the unknowns are twelve, (x, θ, P, L), and the quaternion stays of unit length. The Jacobian is
exact: column by column from physics.motion.change.
"""

import math

from ..physics.compiled import kernel
from ..physics.forces import MASS, MOMENTS, RTOL, reduce_wrench
from ..physics.motion import change, loads, rates_world
from ..physics.rotation import cross, qmultiply
from ..physics.state import LOW, SIZE, L, P, Q, X, copy, is_finite
from .base import Integrator

GAMMA = 0.25
_N = 12
_STAGES = 6
MOST_SUBSTEPS = 100_000
LARGEST_TURN = 1.0  # rad in one sub-step: beyond it the rotation vector is a poor coordinate
SLOWEST = 1e-3  # 1/s: motions slower than this (times the radius of gyration) count as rest when errors are weighed

# Rows are stages 2 to 6: weights of the earlier stages in the argument (A) and on the right-hand side (C).
_A = (
    (1.544, 0.0, 0.0, 0.0),
    (0.9466785280815826, 0.2557011698983284, 0.0, 0.0),
    (3.314825187068521, 2.896124015972201, 0.9986419139977817, 0.0),
    (1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950),
)
_C = (
    (-5.6688, 0.0, 0.0, 0.0, 0.0),
    (-2.430093356833875, -0.2063599157091915, 0.0, 0.0, 0.0),
    (-0.1073529058151375, -9.594562251023355, -20.47028614809616, 0.0, 0.0),
    (7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160, 0.0),
    (8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054),
)

_BACKUP = 0  # the state before the step, 26
_MATRIX = SIZE  # 12 x 12, column by column, then its LU factors
_PIVOT = _MATRIX + _N * _N  # row exchanges, 12
_U = _PIVOT + _N  # stages, 6 x 12
_Z = _U + _STAGES * _N  # argument of a stage, 12
_Y = _Z + _N  # its 13-number state
_D = _Y + LOW  # a direction, 12
WORK_SIZE = _D + _N


@kernel
def steps(state, model, work, h, n):
    """Advance by up to n steps of h [s]; see base.Integrator."""
    reduce_wrench(model)
    for done in range(n):
        copy(state, 0, work, _BACKUP)
        if not _step(state, model, work, h):
            copy(work, _BACKUP, state, 0)
            return done
    return n


@kernel
def _step(state, model, work, h):
    """One step in sub-steps that each keep the estimated error below the tolerance; False when it cannot be done."""
    left, trial = h, h
    for _ in range(MOST_SUBSTEPS):
        trial = min(trial, left)
        if trial >= left * (1.0 - 1e-12):
            trial = left
        if not _stages(state, model, work, trial):
            return False
        error = _error(state, model, work)
        if not error < math.inf:
            trial *= 0.1
        elif error <= 1.0:
            _accept(state, work)
            left -= trial
            if left <= 0.0:
                return is_finite(state)
            trial *= min(5.0, 0.9 * max(error, 1e-8) ** -0.25)
        else:
            trial *= max(0.1, 0.9 * error**-0.25)
        if not trial > 1e-14 * h:
            return False
    return False


@kernel
def _stages(state, model, work, h):
    """All six stages of a sub-step h into ``work``; False when the matrix is singular."""
    if not _factorise(state, model, work, h):
        return False
    for i in range(_STAGES):
        for c in range(_N):
            z = 0.0
            if i == _STAGES - 1:
                z = work[_Z + c] + work[_U + _N * (i - 1) + c]
            elif i > 0:
                for j in range(i):
                    z += _A[i - 1][j] * work[_U + _N * j + c]
            work[_Z + c] = z
        u = _U + _N * i
        _slope(state, model, work, u)
        if i > 0:
            for c in range(_N):
                for j in range(i):
                    work[u + c] += _C[i - 1][j] * work[_U + _N * j + c] / h
        _solve(work, u)
    return True


@kernel
def _slope(state, model, work, to):
    """Time derivative of (x, θ, P, L) at the stage argument Z, into work[to:to + 12]."""
    _displaced(state, work)
    qw, qx, qy, qz = work[_Y + Q], work[_Y + Q + 1], work[_Y + Q + 2], work[_Y + Q + 3]
    wx, wy, wz = rates_world(model, work, _Y, qw, qx, qy, qz)
    for i in range(3):
        work[to + i] = work[_Y + P + i] / model[MASS]
    tx, ty, tz = work[_Z + 3], work[_Z + 4], work[_Z + 5]
    work[to + 3], work[to + 4], work[to + 5] = _inverse_dexp(tx, ty, tz, wx, wy, wz)
    p = to + 6
    work[p], work[p + 1], work[p + 2], work[p + 3], work[p + 4], work[p + 5] = loads(model, work, _Y, qw, qx, qy, qz)


@kernel
def _inverse_dexp(tx, ty, tz, wx, wy, wz):
    """dexp⁻¹_θ ω = ω − ½ θ × ω + (1 − ½ t cot ½t) / t² θ × (θ × ω), t = |θ| (Iserles et al., Acta Numerica 2000)."""
    square = tx * tx + ty * ty + tz * tz
    if square < 1e-4:
        factor = 1.0 / 12.0 + square * (1.0 / 720.0 + square / 30240.0)
    else:
        half = 0.5 * math.sqrt(square)
        factor = (1.0 - half * math.cos(half) / math.sin(half)) / square
    ax, ay, az = cross(tx, ty, tz, wx, wy, wz)
    bx, by, bz = cross(tx, ty, tz, ax, ay, az)
    return wx - 0.5 * ax + factor * bx, wy - 0.5 * ay + factor * by, wz - 0.5 * az + factor * bz


@kernel
def _displaced(state, work):
    """The state displaced by Z = (δx, θ, δP, δL) into work[Y:]."""
    for i in range(3):
        work[_Y + X + i] = state[X + i] + work[_Z + i]
        work[_Y + P + i] = state[P + i] + work[_Z + 6 + i]
        work[_Y + L + i] = state[L + i] + work[_Z + 9 + i]
    tx, ty, tz = work[_Z + 3], work[_Z + 4], work[_Z + 5]
    angle = math.sqrt(tx * tx + ty * ty + tz * tz)
    if angle == 0.0:
        for i in range(4):
            work[_Y + Q + i] = state[Q + i]
        return
    s = math.sin(0.5 * angle) / angle
    q = _Y + Q
    w, x, y, z = qmultiply(
        math.cos(0.5 * angle), s * tx, s * ty, s * tz, state[Q], state[Q + 1], state[Q + 2], state[Q + 3]
    )
    unit = 1.0 / math.sqrt(w * w + x * x + y * y + z * z)
    work[q], work[q + 1], work[q + 2], work[q + 3] = unit * w, unit * x, unit * y, unit * z


@kernel
def _factorise(state, model, work, h):
    """LU factors with row exchanges of 1/(γ h) − Jacobian at ``state``; False when it is singular."""
    for c in range(_N):
        for i in range(_N):
            work[_D + i] = 0.0
        work[_D + c] = 1.0
        change(model, state, 0, work, _D, work, _MATRIX + _N * c)
    for c in range(_N):
        for r in range(_N):
            m = _MATRIX + _N * c + r
            work[m] = -work[m]
        work[_MATRIX + _N * c + c] += 1.0 / (GAMMA * h)
    regular = True
    for k in range(_N):
        regular = regular and _eliminate(work, k)
    return regular


@kernel
def _eliminate(work, k):
    """Step k of Gauss elimination with partial pivoting, in place."""
    column = _MATRIX + _N * k
    best = k
    for r in range(k + 1, _N):
        if abs(work[column + r]) > abs(work[column + best]):
            best = r
    work[_PIVOT + k] = best
    if work[column + best] == 0.0 or not abs(work[column + best]) < math.inf:
        return False
    for c in range(_N):
        i = _MATRIX + _N * c
        work[i + k], work[i + best] = work[i + best], work[i + k]
    for r in range(k + 1, _N):
        work[column + r] /= work[column + k]
        for c in range(k + 1, _N):
            work[_MATRIX + _N * c + r] -= work[column + r] * work[_MATRIX + _N * c + k]
    return True


@kernel
def _solve(work, at):
    """Replace the right-hand side work[at:at + 12] by the solution."""
    for k in range(_N):
        p = at + int(work[_PIVOT + k])
        work[at + k], work[p] = work[p], work[at + k]
    for k in range(_N):
        for r in range(k + 1, _N):
            work[at + r] -= work[_MATRIX + _N * k + r] * work[at + k]
    for k in range(_N - 1, -1, -1):
        work[at + k] /= work[_MATRIX + _N * k + k]
        for r in range(k):
            work[at + r] -= work[_MATRIX + _N * k + r] * work[at + k]


@kernel
def _error(state, model, work):
    """Estimated error of the sub-step as a multiple of the tolerance: of the last stage, part by part.

    Lengths are weighed against the radius of gyration, angles against 1 rad, momenta against the larger of the present
    one, the one after the sub-step, and what SLOWEST amounts to.
    """
    m = model[MASS]
    radius = math.sqrt((model[MOMENTS] + model[MOMENTS + 1] + model[MOMENTS + 2]) / (2.0 * m))
    u = _U + _N * (_STAGES - 1)
    momentum, spin = 0.0, 0.0
    for i in range(3):
        momentum = max(momentum, abs(state[P + i]), abs(state[P + i] + work[_Z + 6 + i]))
        spin = max(spin, abs(state[L + i]), abs(state[L + i] + work[_Z + 9 + i]))
    size = momentum + spin / radius + m * radius * SLOWEST
    worst, turn = 0.0, 0.0
    for i in range(3):
        worst = max(worst, abs(work[u + i]) / radius, abs(work[u + 3 + i]))
        worst = max(worst, abs(work[u + 6 + i]) / size, abs(work[u + 9 + i]) / (size * radius))
        turn = max(turn, abs(work[_Z + 3 + i] + work[u + 3 + i]))
        if not abs(work[u + i] + work[u + 3 + i] + work[u + 6 + i] + work[u + 9 + i]) < math.inf:
            return math.inf
    if turn > LARGEST_TURN:
        return max(worst / model[RTOL], 16.0)
    return worst / model[RTOL]


@kernel
def _accept(state, work):
    """Take the sub-step: the sixth argument plus the sixth stage."""
    u = _U + _N * (_STAGES - 1)
    for i in range(_N):
        work[_Z + i] += work[u + i]
    _displaced(state, work)
    for i in range(LOW):
        state[i] = work[_Y + i]


INTEGRATOR = Integrator(
    name="rosenbrock",
    order=4,
    explicit=False,
    steps=steps,
    work_size=WORK_SIZE,
    resisted=True,
    adaptive=True,
    text=(
        "RODAS, a Rosenbrock method of order 4(3): L-stable, with error control inside each step. For stiff drag and "
        "tethers, which a Simulation takes and a scene does not name yet."
    ),
)
