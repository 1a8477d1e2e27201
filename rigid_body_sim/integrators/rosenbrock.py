"""RODAS: a Rosenbrock method of order 4(3), L-stable and stiffly accurate, with error control inside each step.

Source: Hairer & Wanner, Solving Ordinary Differential Equations II, 2nd ed., section IV.7; the coefficients are those
of their code RODAS (method 1). Six linear systems with one matrix a sub-step, no iteration.

The Jacobian of the twelve unknowns (see substep) is exact: kernels.motion.jacobian. Its rows of x and θ are simple, so
those unknowns are eliminated by hand, and what is factorised is the matrix 6 x 6 of the momenta.
"""

import math

from ..kernels.arrays import Floats
from ..kernels.compiled import kernel, table
from ..kernels.model import MASS, MOMENTS
from ..kernels.motion import Acting, jacobian
from ..kernels.state import LOW
from ..kernels.vectors import cross
from .base import SCRATCH, Integrator
from .substep import (
    NO_SEARCH,
    SHORTEST,
    SMALLEST_SHARE,
    UNKNOWNS,
    accept,
    is_hopeless,
    next_size,
    radius_of_gyration,
    settle,
    slope,
    sought,
    usable,
    weighed,
)

ORDER = 4
GAMMA = 0.25
FASTEST_GROWTH = 90.0  # of sub-steps, and no slower than that: what is fast has soon died away
_STAGES = 6
DAMPED_SHARE = 0.1  # of rtol for a sub-step, at least, where nothing rings: most errors die away with what made them
MOST_SUBSTEPS = 1_000_000  # some seconds of work in one step; what would take more is refused

# Rows are stages 2 to 6: weights of the earlier stages in the argument (A) and on the right-hand side (C).
_A = table(
    (
        (1.544,),
        (0.9466785280815826, 0.2557011698983284),
        (3.314825187068521, 2.896124015972201, 0.9986419139977817),
        (1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950),
    ),
    _STAGES,
)
_C = table(
    (
        (-5.6688,),
        (-2.430093356833875, -0.2063599157091915),
        (-0.1073529058151375, -9.594562251023355, -20.47028614809616),
        (7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160, 0.0),
        (8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054),
    ),
    _STAGES,
)
_TIMES = table(((0.0, 0.386, 0.21, 0.63, 1.0, 1.0),), _STAGES)  # of the stages, in sub-steps
_DRIFTS = table(((0.25, -0.1043, 0.1035, -0.0362, 0.0, 0.0),), _STAGES)  # weights of what changes with time alone

_JACOBIAN = SCRATCH  # J at the beginning of the sub-step, 12 rows of 12
_SLOPE = _JACOBIAN + UNKNOWNS * UNKNOWNS  # slope there, 12
_TURNED = _SLOPE + UNKNOWNS  # T = (1/(γ h) − J_θθ)⁻¹, 3 rows of 3
_FED = _TURNED + 9  # J_Pθ T, 6 rows of 3
_MATRIX = _FED + 18  # 6 x 6, column by column, then its LU factors
_PIVOT = _MATRIX + 36  # row exchanges, 6
_U = _PIVOT + 6  # stages, 6 x 12
_Z = _U + _STAGES * UNKNOWNS  # argument of a stage, 12
_E = _Z + UNKNOWNS  # amplitudes of vibrations, 12
_Y = _E + UNKNOWNS  # its 13-number state
_DRIFT = _Y + LOW  # derivative of the slope by time alone, where there are actuators, 12
WORK_SIZE = _DRIFT + UNKNOWNS
_LAST = _U + UNKNOWNS * (_STAGES - 1)


@kernel
def step(acting: Acting, state: Floats, model: Floats, work: Floats, h: float) -> bool:
    """One step in sub-steps that each keep the estimated error below their share; False when it cannot be done."""
    _linearise(acting, state, model, work)
    left, trial, event = h, _first_size(acting, state, model, work, h), NO_SEARCH
    share = DAMPED_SHARE if trial == h else SMALLEST_SHARE
    for tried in range(MOST_SUBSTEPS):
        if trial >= left * (1.0 - 1e-12) and event.beyond == 0.0:
            trial = left
        error = math.inf
        if _stages(acting, state, model, work, trial):
            rate = min(_stiffness(model, work) * trial, 1.0 / trial)
            error = weighed(state, model, work, _Z, _LAST, max(trial / h, share), rate)
        if error <= 1.0 or (error < math.inf and trial <= SHORTEST * h):
            event = sought(acting, state, model, work, _Z, trial, event)
            if event.size != trial:
                trial = event.size
                continue
            accept(state, work, _Z)
            acting.drive.advance(model, trial)
            left -= trial
            if left <= 0.0:
                return True
            acting.drive.settle(model)
            _linearise(acting, state, model, work)
            if event.beyond != 0.0:
                trial, share, event = _first_size(acting, state, model, work, left), SMALLEST_SHARE, NO_SEARCH
                continue
        else:
            event = NO_SEARCH
        trial = next_size(trial, error, ORDER, FASTEST_GROWTH)
        if trial < 0.1 * SHORTEST * h or is_hopeless(h - left, h, tried, MOST_SUBSTEPS):
            return False
    return False


@kernel
def _linearise(acting: Acting, state: Floats, model: Floats, work: Floats) -> None:
    """Jacobian and slope at the beginning of a sub-step."""
    settle(acting, state, model)
    jacobian(acting, model, state, 0, False, work, _JACOBIAN)
    for c in range(UNKNOWNS):
        work[_Z + c] = 0.0
    slope(acting, state, model, work, _Z, _Y, _SLOPE)
    _find_drift(acting, state, model, work)


@kernel
def _find_drift(acting: Acting, state: Floats, model: Floats, work: Floats) -> None:
    """What actuators change with time alone, from the slopes shortly before and after."""
    moment = acting.drive.moment(model)
    if moment > 0.0:
        acting.drive.show(model, -moment)
        slope(acting, state, model, work, _Z, _Y, _E)
        acting.drive.show(model, moment)
        slope(acting, state, model, work, _Z, _Y, _DRIFT)
        for c in range(UNKNOWNS):
            work[_DRIFT + c] = (work[_DRIFT + c] - work[_E + c]) / (2.0 * moment)


@kernel
def _add_drift(acting: Acting, model: Floats, work: Floats, to: int, weight: float) -> None:
    if acting.drive.moment(model) > 0.0:
        for c in range(UNKNOWNS):
            work[to + c] += weight * work[_DRIFT + c]


@kernel
def _stiffness(model: Floats, work: Floats) -> float:
    """About ω² [1/s²] of the fastest vibration: a norm of the stiffness, with lengths in radii of gyration."""
    radius = radius_of_gyration(model)
    smallest = min(model[MOMENTS], model[MOMENTS + 1], model[MOMENTS + 2])
    worst = 0.0
    for r in range(6):
        row = _JACOBIAN + UNKNOWNS * (6 + r)
        total = 0.0
        for c in range(3):
            total += radius * abs(work[row + c]) + abs(work[row + 3 + c])
        worst = max(worst, total / (model[MASS] * radius if r < 3 else smallest))
    return worst


@kernel
def _ringing(acting: Acting, state: Floats, model: Floats, h: float) -> float:
    """Largest ω [rad/s] of what vibrates fast in a step h and still does at its end; 0 when nothing does."""
    fastest = math.sqrt(acting.ringing(model, state, h))
    return fastest if fastest * h > 10.0 else 0.0


@kernel
def _first_size(acting: Acting, state: Floats, model: Floats, work: Floats, h: float) -> float:
    """The whole step h, unless something rings in it: an L-stable method damps that away without an error to be seen.

    Momenta that vibrate at ω with the amplitude a have slopes up to a ω and second derivatives up to a ω². Where those
    say that a is above the tolerance, the first sub-step is short enough to see the vibration.
    """
    fastest = _ringing(acting, state, model, h)
    if fastest == 0.0:
        return h
    for r in range(UNKNOWNS):
        work[_E + r] = 0.0
        if r >= 6:
            curvature = 0.0
            for c in range(UNKNOWNS):
                curvature += work[_JACOBIAN + UNKNOWNS * r + c] * work[_SLOPE + c]
            work[_E + r] = (abs(work[_SLOPE + r]) + abs(curvature) / fastest) / fastest
    amplitude = weighed(state, model, work, _Z, _E, 1.0, 1.0 / h)
    return h if amplitude <= 1.0 else 0.5 / fastest


@kernel
def _stages(acting: Acting, state: Floats, model: Floats, work: Floats, h: float) -> bool:
    """All six stages of a sub-step h, and the increments, which are the sixth argument plus the sixth stage, into Z.

    False when the matrix is singular or the increments are beyond use.
    """
    if not _factorise(model, work, h):
        return False
    for c in range(UNKNOWNS):
        work[_U + c] = work[_SLOPE + c]
        work[_Z + c] = 0.0
    _add_drift(acting, model, work, _U, h * _DRIFTS[0])
    _solve(model, work, _U, GAMMA * h)
    for i in range(1, _STAGES):
        if i < _STAGES - 1:
            for c in range(UNKNOWNS):
                work[_Z + c] = 0.0
            for j in range(i):
                _add_stage(work, _Z, _A[_STAGES * (i - 1) + j], j)
        else:
            _add_stage(work, _Z, 1.0, i - 1)
        if not usable(work, _Z):
            return False
        u = _U + UNKNOWNS * i
        acting.drive.show(model, h * _TIMES[i])
        slope(acting, state, model, work, _Z, _Y, u)
        _add_drift(acting, model, work, u, h * _DRIFTS[i])
        for j in range(i):
            _add_stage(work, u, _C[_STAGES * (i - 1) + j] / h, j)
        _solve(model, work, u, GAMMA * h)
    _add_stage(work, _Z, 1.0, _STAGES - 1)
    return usable(work, _Z)


@kernel
def _add_stage(work: Floats, to: int, weight: float, j: int) -> None:
    """work[to:to + 12] += weight times stage j."""
    u = _U + UNKNOWNS * j
    for c in range(UNKNOWNS):
        work[to + c] += weight * work[u + c]


@kernel
def _factorise(model: Floats, work: Floats, h: float) -> bool:
    """LU factors, with row exchanges, of what is left of 1/(γ h) − J without x and θ; False when it is singular.

    The first rows give u_x = γ h (r_x + u_P / m) and u_θ = T (r_θ + J_θL u_L).
    """
    if not _invert(work, 1.0 / (GAMMA * h)):
        return False
    for r in range(6):
        row = _JACOBIAN + UNKNOWNS * (6 + r)
        for k in range(3):
            f = 0.0
            for j in range(3):
                f += work[row + 3 + j] * work[_TURNED + 3 * j + k]
            work[_FED + 3 * r + k] = f
        for c in range(3):
            work[_MATRIX + 6 * c + r] = -work[row + 6 + c] - work[row + c] * (GAMMA * h / model[MASS])
            f = -work[row + 9 + c]
            for k in range(3):
                f -= work[_FED + 3 * r + k] * work[_JACOBIAN + UNKNOWNS * (3 + k) + 9 + c]
            work[_MATRIX + 6 * (3 + c) + r] = f
        work[_MATRIX + 7 * r] += 1.0 / (GAMMA * h)
    regular = True
    for k in range(6):
        regular = regular and _eliminate(work, k)
    return regular


@kernel
def _invert(work: Floats, diagonal: float) -> bool:
    """T = (diagonal − J_θθ)⁻¹ by cofactors; False when there is none."""
    b = _JACOBIAN + 3 * UNKNOWNS + 3
    ax, ay, az = diagonal - work[b], -work[b + 1], -work[b + 2]
    bx, by, bz = -work[b + 12], diagonal - work[b + 13], -work[b + 14]
    cx, cy, cz = -work[b + 24], -work[b + 25], diagonal - work[b + 26]
    px, py, pz = cross(bx, by, bz, cx, cy, cz)
    qx, qy, qz = cross(cx, cy, cz, ax, ay, az)
    rx, ry, rz = cross(ax, ay, az, bx, by, bz)
    determinant = ax * px + ay * py + az * pz
    if determinant == 0.0 or not abs(determinant) < math.inf:
        return False
    t, s = _TURNED, 1.0 / determinant
    work[t], work[t + 1], work[t + 2] = s * px, s * qx, s * rx
    work[t + 3], work[t + 4], work[t + 5] = s * py, s * qy, s * ry
    work[t + 6], work[t + 7], work[t + 8] = s * pz, s * qz, s * rz
    return True


@kernel
def _eliminate(work: Floats, k: int) -> bool:
    """Step k of Gauss elimination with partial pivoting, in place."""
    column = _MATRIX + 6 * k
    best = k
    for r in range(k + 1, 6):
        if abs(work[column + r]) > abs(work[column + best]):
            best = r
    work[_PIVOT + k] = best
    if work[column + best] == 0.0 or not abs(work[column + best]) < math.inf:
        return False
    for c in range(6):
        i = _MATRIX + 6 * c
        work[i + k], work[i + best] = work[i + best], work[i + k]
    for r in range(k + 1, 6):
        work[column + r] /= work[column + k]
    for c in range(k + 1, 6):
        i = _MATRIX + 6 * c
        for r in range(k + 1, 6):
            work[i + r] -= work[column + r] * work[i + k]
    return True


@kernel
def _solve(model: Floats, work: Floats, at: int, gamma_h: float) -> None:
    """Replace the right-hand side work[at:at + 12] by the solution."""
    p = at + 6
    for r in range(6):
        row, fed = _JACOBIAN + UNKNOWNS * (6 + r), _FED + 3 * r
        for k in range(3):
            work[p + r] += gamma_h * work[row + k] * work[at + k] + work[fed + k] * work[at + 3 + k]
    for k in range(6):
        other = p + int(work[_PIVOT + k])
        work[p + k], work[other] = work[other], work[p + k]
    for k in range(6):
        for r in range(k + 1, 6):
            work[p + r] -= work[_MATRIX + 6 * k + r] * work[p + k]
    for k in range(5, -1, -1):
        work[p + k] /= work[_MATRIX + 6 * k + k]
        for r in range(k):
            work[p + r] -= work[_MATRIX + 6 * k + r] * work[p + k]
    _back_to_pose(model, work, at, gamma_h)


@kernel
def _back_to_pose(model: Floats, work: Floats, at: int, gamma_h: float) -> None:
    """u_x and u_θ from u_P and u_L, in place of r_x and r_θ."""
    for k in range(3):
        work[at + k] = gamma_h * (work[at + k] + work[at + 6 + k] / model[MASS])
        row = _JACOBIAN + UNKNOWNS * (3 + k) + 9
        for c in range(3):
            work[at + 3 + k] += work[row + c] * work[at + 9 + c]
    rx, ry, rz = work[at + 3], work[at + 4], work[at + 5]
    for k in range(3):
        t = _TURNED + 3 * k
        work[at + 3 + k] = work[t] * rx + work[t + 1] * ry + work[t + 2] * rz


INTEGRATOR = Integrator(
    name="rosenbrock",
    order=ORDER,
    explicit=False,
    step=step,
    driven=step,
    work_size=WORK_SIZE,
    resisted=True,
    adaptive=True,
    text=(
        "RODAS, a Rosenbrock method of order 4(3): L-stable, with error control inside each step. For stiff drag, "
        "tethers and ground; what `auto` takes when they are stiff."
    ),
)
