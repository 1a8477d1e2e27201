"""Torque-free rotation in closed form, as a part of other closed forms."""

import numpy as np
from numpy.typing import ArrayLike

from ...kernels.arrays import Floats
from ...simulation import Simulation
from ...values.body import Body
from ...values.state import State


def turned(body: Body, w_body: ArrayLike, t: float) -> tuple[Floats, Floats]:
    """Attitude (4,) and angular velocity [rad/s, body axes] (3,) after t [s] without torque, from the world's axes.

    Only ω t counts for the attitude, so one second of ω t is evaluated, whatever t is.
    """
    scaled = Simulation(body, State(angular_velocity=np.multiply(w_body, t)), rate=1.0, integrator="exact")
    scaled.step()
    state = scaled.state
    return state.orientation, state.angular_velocity / t
