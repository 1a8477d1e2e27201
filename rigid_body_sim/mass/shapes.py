"""The usual shapes: inertia in closed form, about the centre of mass, in the axes of symmetry.

``SHAPES`` is the one table; the scene's parameter, its messages and the table in docs/reference/conventions.md follow
from it.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ..values.body import positive
from .mass_properties import MassProperties, mass_of


@dataclass(frozen=True)
class Shape:
    """A shape: ``moments`` gives (I_x, I_y, I_z) per mass [m²], ``volume`` [m³]; both from the dimensions [m].

    A dimension whose name begins with ``inner`` may be anything from zero to the one before it; the others are greater
    than zero. Without ``volume`` the shape has none, whatever its dimensions.
    """

    name: str
    dimensions: tuple[str, ...]
    text: str
    moments: Callable[..., tuple[float, float, float]]
    volume: Callable[..., float] | None = None

    def mass_properties(
        self, dimensions: Sequence[float], mass: float | None = None, density: float | None = None
    ) -> MassProperties:
        """Of this shape, with its centre of mass at the origin, from its mass [kg] or its density [kg/m³].

        Raises ValueError for a wrong number of dimensions [m], one that breaks its rule, mass and density both given or
        both missing, a density for a shape without volume, or anything beyond the range of ``body.positive``.
        """
        sizes = self._checked(dimensions)
        volume = self.volume(*sizes) if self.volume else 0.0
        moments = self.moments(*sizes)
        if density is not None and volume == 0.0:
            raise ValueError(f"{self.name} with dimensions {list(sizes)} m has no volume for a density; give its mass")
        total = mass_of(volume, mass, density)
        return MassProperties(total, [total * moment for moment in moments])

    def _checked(self, dimensions: Sequence[float]) -> tuple[float, ...]:
        sizes = tuple(float(size) for size in dimensions)
        if len(sizes) != len(self.dimensions):
            wanted = ", ".join(self.dimensions) or "none"
            raise ValueError(f"{self.name} is given {len(sizes)} dimensions; it needs {len(self.dimensions)}: {wanted}")
        for k, (name, size) in enumerate(zip(self.dimensions, sizes, strict=True)):
            if not name.startswith("inner"):
                positive(size, f"{self.name}: {name}", "m")
            elif not 0.0 <= size <= sizes[k - 1]:
                raise ValueError(
                    f"{self.name}: {name} {size:g} m is not between 0 and {self.dimensions[k - 1]} {sizes[k - 1]:g} m"
                )
        return sizes


def _ellipsoid(x: float, y: float, z: float) -> tuple[float, float, float]:
    return (y * y + z * z) / 5, (z * z + x * x) / 5, (x * x + y * y) / 5


def _hollow_sphere(outer: float, inner: float) -> tuple[float, float, float]:
    # (R⁵ − r⁵) / (R³ − r³) with the factor R − r taken out: a thin shell loses no digits, and r = R is one.
    ratio = inner / outer
    moment = 0.4 * outer**2 * sum(ratio**k for k in range(5)) / (1 + ratio + ratio**2)
    return moment, moment, moment


def _hollow_sphere_volume(outer: float, inner: float) -> float:
    return 4 / 3 * math.pi * (outer - inner) * (outer * outer + outer * inner + inner * inner)


def _box(x: float, y: float, z: float) -> tuple[float, float, float]:
    return (y * y + z * z) / 12, (z * z + x * x) / 12, (x * x + y * y) / 12


def _tube(outer: float, inner: float, length: float) -> tuple[float, float, float]:
    squares = outer * outer + inner * inner
    across = squares / 4 + length * length / 12
    return across, across, squares / 2


def _tube_volume(outer: float, inner: float, length: float) -> float:
    return math.pi * (outer - inner) * (outer + inner) * length


def _capsule(radius: float, length: float) -> tuple[float, float, float]:
    balls = 4 * radius / (4 * radius + 3 * length)  # the two half balls' share of the mass
    # A half ball's own centre of mass lies 3/8 of the radius beyond the end of the cylinder.
    across = (1 - balls) * _tube(radius, 0.0, length)[0] + balls * (
        0.4 * radius**2 + length**2 / 4 + 3 / 8 * length * radius
    )
    return across, across, (1 - balls) * radius**2 / 2 + balls * 0.4 * radius**2


def _cone(radius: float, height: float) -> tuple[float, float, float]:
    across = 3 / 20 * radius**2 + 3 / 80 * height**2
    return across, across, 3 / 10 * radius**2


_ALL = (
    Shape("sphere", ("radius",), "A ball.", lambda r: _ellipsoid(r, r, r), lambda r: 4 / 3 * math.pi * r**3),
    Shape(
        "hollow_sphere",
        ("outer radius", "inner radius"),
        "A ball with a round hole at its centre; a thin shell when both radii are equal.",
        _hollow_sphere,
        _hollow_sphere_volume,
    ),
    Shape("box", ("size x", "size y", "size z"), "A box along the axes.", _box, lambda x, y, z: x * y * z),
    Shape(
        "ellipsoid",
        ("semi-axis x", "semi-axis y", "semi-axis z"),
        "An ellipsoid along the axes.",
        _ellipsoid,
        lambda x, y, z: 4 / 3 * math.pi * x * y * z,
    ),
    Shape(
        "cylinder",
        ("radius", "length"),
        "A cylinder along z.",
        lambda r, length: _tube(r, 0.0, length),
        lambda r, length: _tube_volume(r, 0.0, length),
    ),
    Shape(
        "tube",
        ("outer radius", "inner radius", "length"),
        "A cylinder along z with a round hole along its axis.",
        _tube,
        _tube_volume,
    ),
    Shape(
        "capsule",
        ("radius", "length"),
        "A cylinder of that length along z, with a half ball on each end.",
        _capsule,
        lambda r, length: math.pi * r * r * (4 / 3 * r + length),
    ),
    Shape(
        "cone",
        ("radius", "height"),
        "A cone along z; its centre of mass is a quarter of the height above the base.",
        _cone,
        lambda r, height: math.pi / 3 * r * r * height,
    ),
    Shape("thin_rod", ("length",), "A rod along z without thickness.", lambda a: (a * a / 12, a * a / 12, 0.0)),
    Shape("thin_disc", ("radius",), "A disc across z without thickness.", lambda r: (r * r / 4, r * r / 4, r * r / 2)),
    Shape("point", (), "A point mass.", lambda: (0.0, 0.0, 0.0)),
)

SHAPES = {shape.name: shape for shape in _ALL}
