"""DOP853: the explicit Runge-Kutta method of Dormand and Prince of order 8(5,3), with error control inside each step.

Source: Hairer, Nørsett & Wanner, Solving Ordinary Differential Equations I, 2nd ed., sections II.5 and II.10; the
coefficients are those of their code DOP853. Twelve evaluations of the twelve unknowns (see substep) a sub-step.

It is no method for stiff scenes: a sub-step is at most about 6 / ρ long, with ρ of kernels.stiffness.spectral_radius.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from ..kernels.arrays import Floats
from ..kernels.compiled import kernel, table
from ..kernels.motion import Acting, Passed
from ..kernels.state import LOW
from .base import SCRATCH, Integrator
from .substep import (
    NO_SEARCH,
    SHORTEST,
    SMALLEST_SHARE,
    UNKNOWNS,
    accept,
    is_hopeless,
    next_size,
    passed,
    searched,
    settle,
    slope,
    usable,
    weighed,
)

ORDER = 8
STAGES = 12
MOST_SUBSTEPS = 100_000  # some tenths of a second of work in one step; more than that is refused
FASTEST_GROWTH = 5.0  # of sub-steps
SLOW_GROWTH = 1.5  # once one was refused in a step: where stability limits the size, the error does not tell how far

# Rows are stages 2 to 12: weights of the slopes before.
A = (
    (5.26001519587677318785587544488e-2,),
    (1.97250569845378994544595329183e-2, 5.91751709536136983633785987549e-2),
    (2.95875854768068491816892993775e-2, 0.0, 8.87627564304205475450678981324e-2),
    (2.41365134159266685502369798665e-1, 0.0, -8.84549479328286085344864962717e-1, 9.24834003261792003115737966543e-1),
    (
        3.7037037037037037037037037037e-2,
        0.0,
        0.0,
        1.70828608729473871279604482173e-1,
        1.25467687566822425016691814123e-1,
    ),
    (3.7109375e-2, 0.0, 0.0, 1.70252211019544039314978060272e-1, 6.02165389804559606850219397283e-2, -1.7578125e-2),
    (
        3.70920001185047927108779319836e-2,
        0.0,
        0.0,
        1.70383925712239993810214054705e-1,
        1.07262030446373284651809199168e-1,
        -1.53194377486244017527936158236e-2,
        8.27378916381402288758473766002e-3,
    ),
    (
        6.24110958716075717114429577812e-1,
        0.0,
        0.0,
        -3.36089262944694129406857109825,
        -8.68219346841726006818189891453e-1,
        2.75920996994467083049415600797e1,
        2.01540675504778934086186788979e1,
        -4.34898841810699588477366255144e1,
    ),
    (
        4.77662536438264365890433908527e-1,
        0.0,
        0.0,
        -2.48811461997166764192642586468,
        -5.90290826836842996371446475743e-1,
        2.12300514481811942347288949897e1,
        1.52792336328824235832596922938e1,
        -3.32882109689848629194453265587e1,
        -2.03312017085086261358222928593e-2,
    ),
    (
        -9.3714243008598732571704021658e-1,
        0.0,
        0.0,
        5.18637242884406370830023853209,
        1.09143734899672957818500254654,
        -8.14978701074692612513997267357,
        -1.85200656599969598641566180701e1,
        2.27394870993505042818970056734e1,
        2.49360555267965238987089396762,
        -3.0467644718982195003823669022,
    ),
    (
        2.27331014751653820792359768449,
        0.0,
        0.0,
        -1.05344954667372501984066689879e1,
        -2.00087205822486249909675718444,
        -1.79589318631187989172765950534e1,
        2.79488845294199600508499808837e1,
        -2.85899827713502369474065508674,
        -8.87285693353062954433549289258,
        1.23605671757943030647266201528e1,
        6.43392746015763530355970484046e-1,
    ),
)
B = (
    5.42937341165687622380535766363e-2,
    0.0,
    0.0,
    0.0,
    0.0,
    4.45031289275240888144113950566,
    1.89151789931450038304281599044,
    -5.8012039600105847814672114227,
    3.1116436695781989440891606237e-1,
    -1.52160949662516078556178806805e-1,
    2.01365400804030348374776537501e-1,
    4.47106157277725905176885569043e-2,
)
EMBEDDED_3 = {
    0: 0.244094488188976377952755905512,
    8: 0.733846688281611857341361741547,
    11: 0.0220588235294117647058823529412,
}
ERROR_3 = tuple(b - EMBEDDED_3.get(stage, 0.0) for stage, b in enumerate(B))
ERROR_5 = (
    0.1312004499419488073250102996e-1,
    0.0,
    0.0,
    0.0,
    0.0,
    -0.1225156446376204440720569753e1,
    -0.4957589496572501915214079952,
    0.1664377182454986536961530415e1,
    -0.3503288487499736816886487290,
    0.3341791187130174790297318841,
    0.8192320648511571246570742613e-1,
    -0.2235530786388629525884427845e-1,
)
_WEIGHTS = table((*A, B, ERROR_3, ERROR_5), STAGES)
_TIMES = table(((0.0, *map(math.fsum, A)),), STAGES)  # of the stages, in sub-steps
_B_ROW = STAGES * len(A)
_ERROR_3_ROW = _B_ROW + STAGES
_ERROR_5_ROW = _ERROR_3_ROW + STAGES


class System(NamedTuple):
    """What moves as one: how many unknowns it has, where they lie in ``work``, and the kernels that know of them.

    They take what acts, states and models, each in the form that the system has it in; the rest is as in substep.
    ``passed`` and ``passes_kink`` are its events and kinks, ``show``, ``pass_time`` and ``settle_drive`` its actuators.
    """

    unknowns: int
    k: int  # slopes, 12 stages of the unknowns
    z: int  # argument of a stage, then the increments
    e: int  # an error estimate
    y: int  # what ``slope`` needs of its own
    settle: Callable[..., None]
    slope: Callable[..., None]
    usable: Callable[..., bool]
    weighed: Callable[..., float]
    passes_kink: Callable[..., bool]
    passed: Callable[..., Passed]
    accept: Callable[..., None]
    show: Callable[..., None]
    pass_time: Callable[..., None]
    settle_drive: Callable[..., None]


def places(unknowns: int, first: int) -> tuple[int, int, int, int, int]:
    """The first five fields of a system of so many unknowns, whose scratch space begins at work[first]."""
    z = first + STAGES * unknowns
    return unknowns, first, z, z + unknowns, z + 2 * unknowns


@kernel
def _passes_kink(acting: Acting, state: Floats, model: Floats, work: Floats, z: int) -> bool:
    return acting.passes_kink(model, state, work, z)


@kernel
def _show(acting: Acting, model: Floats, t: float) -> None:
    acting.drive.show(model, t)


@kernel
def _pass_time(acting: Acting, model: Floats, t: float) -> None:
    acting.drive.advance(model, t)


@kernel
def _settle_drive(acting: Acting, model: Floats) -> None:
    acting.drive.settle(model)


@kernel
def _weighed(
    acting: Acting, state: Floats, model: Floats, work: Floats, z: int, e: int, share: float, rate: float
) -> float:
    return weighed(state, model, work, z, e, share, rate)


@kernel
def _accept(acting: Acting, state: Floats, work: Floats, z: int) -> None:
    accept(state, work, z)


ONE_BODY = System(
    *places(UNKNOWNS, SCRATCH),
    settle,
    slope,
    usable,
    _weighed,
    _passes_kink,
    passed,
    _accept,
    _show,
    _pass_time,
    _settle_drive,
)
WORK_SIZE = ONE_BODY.y + LOW  # the 13-number state of a stage


@kernel
def step(acting: Acting, state: Floats, model: Floats, work: Floats, h: float) -> bool:
    """One step in sub-steps that each keep the estimated error below their share; False when it cannot be done."""
    return step_of(ONE_BODY, acting, state, model, work, h)


@kernel
def step_of(system: System, acting: Any, state: Floats, model: Floats, work: Floats, h: float) -> bool:
    """The same of whatever moves as one."""
    left, trial, growth, event = h, h, FASTEST_GROWTH, NO_SEARCH
    _first_slope(system, acting, state, model, work)
    for tried in range(MOST_SUBSTEPS):
        if trial >= left * (1.0 - 1e-12) and event.beyond == 0.0:
            trial = left
        error = math.inf
        if _stages(system, acting, state, model, work, trial):
            error = _error(system, acting, state, model, work, trial, max(trial / h, SMALLEST_SHARE))
        if error <= 1.0 or (error < math.inf and trial <= SHORTEST * h):
            event = searched(system.passed, acting, state, model, work, system.z, trial, event)
            if event.size != trial:
                trial = event.size
                continue
            system.accept(acting, state, work, system.z)
            system.pass_time(acting, model, trial)
            left -= trial
            if left <= 0.0:
                return True
            system.settle_drive(acting, model)
            _first_slope(system, acting, state, model, work)
            if event.beyond != 0.0:
                trial, event = left, NO_SEARCH
                continue
        else:
            growth, event = SLOW_GROWTH, NO_SEARCH
        trial = next_size(trial, error, ORDER, growth)
        if trial < 0.1 * SHORTEST * h or is_hopeless(h - left, h, tried, MOST_SUBSTEPS):
            return False
    return False


@kernel
def _first_slope(system: System, acting: Any, state: Floats, model: Floats, work: Floats) -> None:
    system.settle(acting, state, model)
    for c in range(system.unknowns):
        work[system.z + c] = 0.0
    system.slope(acting, state, model, work, system.z, system.y, system.k)


@kernel
def _stages(system: System, acting: Any, state: Floats, model: Floats, work: Floats, h: float) -> bool:
    """All slopes but the first, and the increments of a sub-step h into Z; False when they are beyond use."""
    z = system.z
    for i in range(1, STAGES):
        _combine(system, work, STAGES * (i - 1), i, h, z)
        if not system.usable(work, z):
            return False
        system.show(acting, model, h * _TIMES[i])
        system.slope(acting, state, model, work, z, system.y, system.k + system.unknowns * i)
    _combine(system, work, _B_ROW, STAGES, h, z)
    return system.usable(work, z)


@kernel
def _combine(system: System, work: Floats, row: int, count: int, h: float, to: int) -> None:
    """h times the sum of the first ``count`` slopes, weighed with the weights from ``row`` on."""
    for c in range(system.unknowns):
        work[to + c] = 0.0
    for j in range(count):
        weight = h * _WEIGHTS[row + j]
        if weight != 0.0:
            for c in range(system.unknowns):
                work[to + c] += weight * work[system.k + system.unknowns * j + c]


@kernel
def _error(
    system: System, acting: Any, state: Floats, model: Floats, work: Floats, trial: float, share: float
) -> float:
    """Estimated error as a multiple of the sub-step's share: ε₅² / √(ε₅² + 0.01 ε₃²), from two estimates.

    Written with their quotient: the square of a tiny estimate is zero.
    """
    z, e = system.z, system.e
    _combine(system, work, _ERROR_5_ROW, STAGES, trial, e)
    fifth = system.weighed(acting, state, model, work, z, e, share, 1.0 / trial)
    _combine(system, work, _ERROR_3_ROW, STAGES, trial, e)
    third = system.weighed(acting, state, model, work, z, e, share, 1.0 / trial)
    if fifth == 0.0 or system.passes_kink(acting, state, model, work, z):
        return fifth  # at a kink the order is none of a smooth motion's, and the formula makes little of the error
    return fifth / math.sqrt(1.0 + 0.01 * (third / fifth) * (third / fifth))


INTEGRATOR = Integrator(
    name="dop853",
    order=ORDER,
    explicit=True,
    step=step,
    driven=step,
    work_size=WORK_SIZE,
    resisted=True,
    adaptive=True,
    text=(
        "Dormand-Prince of order 8(5,3) with error control inside each step. For drag, tethers and ground that are not "
        "stiff; a step that is too stiff for it is refused."
    ),
)
