"""How time advances: one file per integrator, and the registry that names them."""

from ..effects import REGISTRY as EFFECTS
from ..effects.base import DriveEffect, Effect, LoadEffect, SeriesEffect, TransformEffect
from ..terms import Terms
from . import dop853, exact, matrix_euler, rk4, rkmk4, rosenbrock, semi_implicit_euler, splitting, taylor
from .base import Integrator, script_of, steps_of

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
AUTO = "auto"  # no integrator: the choice of one by what a scene uses, which scene.plan makes
REGISTRY: dict[str, Integrator] = {integrator.name: integrator for integrator in _ALL}
CHOICES = (AUTO, *REGISTRY)
RULE = "one of " + ", ".join(CHOICES)  # for the parameter integrator.name, which the schema cannot know


def get(name: str) -> Integrator:
    """The integrator of that name. Raises ValueError, naming those there are, for any other."""
    if name not in REGISTRY:
        raise ValueError(f"integrator {name!r} is not known; choose {RULE}")
    return REGISTRY[name]


def shortfall(name: str, terms: Terms) -> str:
    """What of ``terms`` the integrator of that name leaves out, as a sentence; empty when it is right for them."""
    integrator = get(name)
    if terms.loads and not integrator.resisted:
        able = [AUTO, *(other for other, one in REGISTRY.items() if one.resisted)]
        return f"integrator {name!r} leaves out {_words(LoadEffect, TransformEffect)}; choose one of {', '.join(able)}"
    if terms.actuated and integrator.driven is None:
        able = [AUTO, *(other for other, one in REGISTRY.items() if one.driven)]
        return f"integrator {name!r} leaves out {_words(DriveEffect)}; choose one of {', '.join(able)}"
    if terms.turning and integrator.torque_free_only:
        able = [AUTO, *(other for other, one in REGISTRY.items() if not one.torque_free_only)]
        return f"integrator {name!r} leaves out {_words(SeriesEffect)}; choose one of {', '.join(able)}"
    return ""


def _words(*kinds: type[Effect]) -> str:
    *others, last = (effect.left_out for effect in EFFECTS.values() if isinstance(effect, kinds))
    return f"{', '.join(others)} and {last}" if others else last


__all__ = ["AUTO", "CHOICES", "REGISTRY", "RULE", "Integrator", "get", "script_of", "shortfall", "steps_of"]
