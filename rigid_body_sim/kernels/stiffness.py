"""How stiff a scene is: the fastest rate at which anything in it decays, swings or turns."""

import math

import numpy as np

from .arrays import Floats, python_floats
from .motion import Acting, jacobian
from .wrench import reduce_wrench


def spectral_radius(acting: Acting, state: Floats, model: Floats) -> float:
    """Largest modulus [1/s] of the eigenvalues of the Jacobian at a flat state, with every tether counted as taut.

    So a tether that is slack now, and will pull later, counts, and a contact as one on which the body rests; quadratic
    drag counts at the present speed, and a spin with its angular velocity. Infinite where an entry of the Jacobian is
    beyond the range of floats. ``model`` is that which kernels.model lays out, ``state`` that of kernels.state. It is
    called when terms or state are changed from outside, so the kernels run as plain Python: 0.2 ms each time, where
    compiling them would take each first start most of a second.
    """
    numbers, matrix = python_floats(model.copy()), np.zeros(144)
    try:
        reduce_wrench(numbers)
        jacobian(acting, numbers, python_floats(state), 0, True, python_floats(matrix), 0)
    except (ArithmeticError, ValueError):  # where IEEE rules would give infinity or NaN
        return math.inf
    if not np.isfinite(matrix).all():
        return math.inf
    radius = float(np.abs(np.linalg.eigvals(matrix.reshape(12, 12))).max())
    return math.inf if math.isnan(radius) else radius
