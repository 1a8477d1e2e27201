"""How time advances: one file per integrator, and the registry that names them."""

from . import dop853, exact, matrix_euler, rk4, rkmk4, rosenbrock, semi_implicit_euler, splitting, taylor
from .base import Integrator

_ALL = (
    taylor.INTEGRATOR,
    exact.INTEGRATOR,
    rk4.INTEGRATOR,
    rkmk4.INTEGRATOR,
    splitting.INTEGRATOR,
    splitting.INTEGRATOR4,
    semi_implicit_euler.INTEGRATOR,
    dop853.INTEGRATOR,
    rosenbrock.INTEGRATOR,
    matrix_euler.INTEGRATOR,
)
REGISTRY: dict[str, Integrator] = {integrator.name: integrator for integrator in _ALL}


def get(name: str) -> Integrator:
    """The integrator of that name. Raises ValueError, naming those there are, for any other."""
    if name not in REGISTRY:
        raise ValueError(f"integrator {name!r} is not known; choose one of {', '.join(REGISTRY)}")
    return REGISTRY[name]


__all__ = ["REGISTRY", "Integrator", "get"]
