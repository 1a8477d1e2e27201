"""How stiff a scene is: the fastest rate at which anything in it decays, swings or turns."""

import math

import numpy as np

from .arrays import Floats
from .compiled import kernel
from .motion import jacobian
from .wrench import reduce_wrench


@kernel
def _taut_jacobian(state: Floats, model: Floats, out: Floats) -> None:
    reduce_wrench(model)
    jacobian(model, state, 0, True, out, 0)


def spectral_radius(state: Floats, model: Floats) -> float:
    """Largest modulus [1/s] of the eigenvalues of the Jacobian at a flat state, with every tether counted as taut.

    So a tether that is slack now, and will pull later, counts; quadratic drag counts at the present speed, and a spin
    with its angular velocity. Infinite where an entry of the Jacobian is beyond the range of floats. ``model`` is that
    that kernels.model lays out, ``state`` that of kernels.state.
    """
    matrix = np.zeros(144)
    with np.errstate(over="ignore", invalid="ignore"):  # plain Python would warn
        _taut_jacobian(state, model.copy(), matrix)
    if not np.isfinite(matrix).all():
        return math.inf
    radius = float(np.abs(np.linalg.eigvals(matrix.reshape(12, 12))).max())
    return math.inf if math.isnan(radius) else radius
