"""The fluid around the body, and how fast it moves: what drag and added mass depend on.

To the velocity that is given come gusts by the Dryden model (kernels.dryden), a field that does not change while the
mean flow, at its speed V, carries it past. They are held over a step, and are a function of the seed and of how many
steps have passed.
"""

import math
from dataclasses import dataclass

import numpy as np

from ..kernels import dryden
from ..kernels.arrays import Floats, Vector
from ..kernels.compiled import kernel
from ..kernels.model import FLUID
from ..values.body import Body
from ..values.parameter import Parameter
from ..values.wrench import ZERO, number, three_finite
from .base import MediumEffect
from .drag import Drag

# Of gusts, in the model: the mean flow; the gust's axes, along it and across it, times the intensity; V / L; the seed
_AXES = 3
_RATE = 12
_SEED = 13
SIZE = 14
_FILTERS = 3  # in its memory, after the velocity
MEMORY_SIZE = _FILTERS + dryden.SIZE
LARGEST_SEED = 1_000_000_000
_LENGTH = 200.0


@dataclass(frozen=True)
class Fluid:
    """Velocity [m/s, world axes] of the fluid that flows past the body, and its gusts.

    It acts through drag and added mass alone, which go by the velocity through the fluid. It is the same everywhere,
    and what a change of it by itself does to a body (Froude and Krylov's force) is left out. ``gust_intensity`` [m/s]
    is the standard deviation of each component of the gusts, ``gust_length_scale`` [m] is L of the Dryden model.

    Raises ValueError for what is not finite or not in range, and for gusts in a fluid at rest, which carries none past.
    """

    velocity: Vector = ZERO
    gust_intensity: float = 0.0
    gust_length_scale: float = _LENGTH
    gust_seed: int = 0

    def __post_init__(self) -> None:
        object.__setattr__(self, "velocity", three_finite(self.velocity, "fluid velocity"))
        given = (number(getattr(self, name), name) for name in ("gust_intensity", "gust_length_scale", "gust_seed"))
        intensity, scale, seed = given
        if not 0.0 <= intensity < math.inf:
            raise ValueError(f"gust_intensity {intensity:g} is not a finite number of at least 0")
        if not 0.0 < scale < math.inf:
            raise ValueError(f"gust_length_scale {scale:g} is not a finite number above 0")
        if not (0.0 <= seed <= LARGEST_SEED and seed == math.floor(seed)):
            raise ValueError(f"gust_seed {self.gust_seed} is not a whole number from 0 to {LARGEST_SEED}")
        if intensity > 0.0 and not any(self.velocity):
            raise ValueError(
                f"gust_intensity {intensity:g} in a fluid at rest: the mean flow carries gusts past; give it a velocity"
                ", or 0"
            )
        object.__setattr__(self, "gust_intensity", intensity)
        object.__setattr__(self, "gust_length_scale", scale)
        object.__setattr__(self, "gust_seed", int(seed))


STILL = Fluid()


def _row(fluid: Fluid, body: Body) -> Floats:
    speed = math.hypot(*fluid.velocity)
    along = np.array(fluid.velocity) / speed
    level = np.array((-along[1], along[0], 0.0))  # across it and level, or to the left where it is upright
    size = math.hypot(*level)
    left = level / size if size > 1e-9 else np.array((0.0, 1.0, 0.0))
    axes = fluid.gust_intensity * np.array((along, left, np.cross(along, left)))
    return np.array((*fluid.velocity, *axes.ravel(), speed / fluid.gust_length_scale, fluid.gust_seed))


def _memory(fluid: Fluid, body: Body, h: float) -> Floats:
    """The velocity now, and the filters."""
    numbers = np.concatenate((_row(fluid, body), np.zeros(MEMORY_SIZE)))
    dryden.begin(numbers, SIZE + _FILTERS, fluid.gust_seed)
    show(numbers, 0, SIZE)
    return numbers[SIZE:]


@kernel
def show(model: Floats, at: int, memory: int) -> None:
    """Work out the velocity now: the mean one and the gust."""
    gust = dryden.gust(model, memory + _FILTERS)
    for i in range(3):
        a = at + _AXES + i
        model[memory + i] = model[at + i] + (gust.x * model[a] + gust.y * model[a + 3] + gust.z * model[a + 6])


@kernel
def advance(model: Floats, at: int, memory: int, h: float) -> None:
    """Let a step of h [s] pass."""
    dryden.advance(model, memory + _FILTERS, model[at + _RATE] * h, int(model[at + _SEED]))
    show(model, at, memory)


EFFECT = MediumEffect(
    name="fluid",
    make=Fluid,
    zero=STILL,
    example=Fluid((0.7, -1.5, 0.4)),  # without gusts, whose axes across the flow are those of the world
    acts=lambda fluid: any(fluid.velocity),
    world=("velocity",),
    left_out="flow of the fluid",
    parameters=(
        Parameter(
            "fluid.velocity",
            tuple,
            ZERO,
            "Velocity of the fluid, world axes: drag and added mass go by the velocity through it.",
            "m/s",
            length=3,
            dynamic=True,
        ),
        Parameter(
            "fluid.gust.intensity",
            float,
            0.0,
            "Gusts by the Dryden model: standard deviation of each component; 0 = none.",
            "m/s",
            least=0.0,
        ),
        Parameter(
            "fluid.gust.length_scale",
            float,
            _LENGTH,
            "Their length scale L; 200 m is usual for aircraft 50 m above the ground.",
            "m",
            above=0.0,
        ),
        Parameter(
            "fluid.gust.seed",
            int,
            0,
            "Another one gives other gusts, the same one the same.",
            least=0,
            most=LARGEST_SEED,
        ),
    ),
    beside={"drag": Drag((0.5, 0.8, 1.0), (0.2, 0.0, 0.4))},
    place=FLUID,
    numbers=lambda fluid: fluid.velocity,
    stirs=lambda fluid: fluid.gust_intensity > 0.0,
    size=SIZE,
    row=_row,
    memory_size=MEMORY_SIZE,
    memory=_memory,
    advance=advance,
    show=show,
)
