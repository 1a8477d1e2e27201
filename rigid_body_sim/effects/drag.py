"""Drag."""

from dataclasses import dataclass

from ..kernels.arrays import Vector
from ..values.wrench import ZERO, three_finite


@dataclass(frozen=True)
class Drag:
    """Coefficients along the body axes: linear [N s/m], quadratic [N s²/m²], angular [N m s/rad], [N m s²/rad²].

    Raises ValueError for a coefficient that is negative or not finite: drag takes energy out.
    """

    linear: Vector = ZERO
    quadratic: Vector = ZERO
    angular_linear: Vector = ZERO
    angular_quadratic: Vector = ZERO

    def __post_init__(self) -> None:
        for name in ("linear", "quadratic", "angular_linear", "angular_quadratic"):
            values = three_finite(getattr(self, name), f"drag {name}")
            if min(values) < 0.0:
                raise ValueError(
                    f"drag {name} {list(values)} has a negative entry; drag takes energy out, so none may be below 0"
                )
            object.__setattr__(self, name, values)

    @property
    def values(self) -> tuple[float, ...]:
        """The twelve coefficients in the order of the fields."""
        return (*self.linear, *self.quadratic, *self.angular_linear, *self.angular_quadratic)


NO_DRAG = Drag()
