"""What acts on the body beside a held wrench: one file an effect, and the registry that names them."""

from . import actuators, added_mass, constant_force, drag, fluid, ground, tether
from .base import Effect, Lever

_ALL = (
    drag.EFFECT,
    tether.EFFECT,
    constant_force.EFFECT,
    ground.EFFECT,
    actuators.EFFECT,
    fluid.EFFECT,
    added_mass.EFFECT,
)
REGISTRY: dict[str, Effect] = {effect.name: effect for effect in _ALL}

__all__ = ["REGISTRY", "Effect", "Lever"]
