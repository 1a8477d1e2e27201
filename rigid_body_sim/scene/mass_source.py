"""Where a scene's mass, inertia and centre of mass come from: given as such, a shape, a mesh or a URDF link."""

import os
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from ..mass.mass_properties import MassProperties, mass_of
from ..mass.mesh import of_mesh
from ..mass.shapes import SHAPES
from ..values.parameter import shown
from . import mesh_file, schema, urdf
from .file_path import located

_NEEDS = {  # a parameter, and those of which it needs one
    "body.dimensions": ("body.shape",),
    "body.density": ("body.shape", "body.mesh_file"),
    "body.mesh_scale": ("body.mesh_file",),
    "body.urdf_link": ("body.urdf_file",),
}
# Densities [kg/m³]: osmium, the heaviest solid; and less than the lightest, an aerogel of 0.16. A hull that is mostly
# air, taken as evenly filled, has more than that too; lengths in mm taken as m make a billionth of what is meant.
_HEAVIEST = 22_590.0
_LIGHTEST = 0.1
_MOST = 1e6  # kg: a thousand tonnes is no robot, where the mass follows from a density

_Found = tuple[MassProperties, tuple[str, ...]]  # and notes about it
Files = dict[tuple[Any, ...], _Found]  # what was read, by the values of the parameters that name it


class Source(NamedTuple):
    """What follows from a source by the names of parameters, and sentences about what the user may want to know."""

    followed: dict[str, Any]
    notes: tuple[str, ...] = ()


def resolve(
    values: Mapping[str, Any], given: Mapping[str, Any], folder: str | os.PathLike[str], files: Files
) -> Source:
    """Those of body.mass, body.inertia and body.center_of_mass that follow from another parameter, and notes.

    ``values`` are all parameters, checked; ``given`` those that the user gave; ``folder`` is where the paths of files
    begin. What is in ``files`` is not read again, and what is read is added: a file changes no body that is there.
    A parameter that follows may be given too when it says the same to the last bit, so that what a node holds can be
    given to another one. Raises ValueError when two parameters contradict each other, one lacks another, or a shape or
    file is bad.
    """
    sources = [name for name in _SOURCES if values[name]]
    if len(sources) > 1:
        raise ValueError(f"parameters {' and '.join(sources)} are given; the inertia has one source: give one of them")
    for name, needed in _NEEDS.items():
        if values[name] != schema.BY_NAME[name].default and not any(values[other] for other in needed):
            raise ValueError(
                f"parameter {name} = {_shown(values[name])}: needs {' or '.join(needed)}; give both or neither"
            )
    if not sources:
        return Source({})
    (source,) = sources
    try:
        properties, notes = _SOURCES[source](values, folder, files)
        properties.body()
    except (OSError, ValueError) as reason:
        raise ValueError(f"parameter {source} = {_shown(values[source])}: {_told(reason)}") from None
    followed = _followed(source, values, properties)
    _refuse_contradictions(source, values, given, followed)
    return Source(followed, tuple(f"parameter {source} = {_shown(values[source])}: {note}" for note in notes))


def _followed(source: str, values: Mapping[str, Any], properties: MassProperties) -> dict[str, Any]:
    found: dict[str, Any] = {"body.inertia": tuple(properties.body().inertia_entries.tolist())}
    if source == "body.urdf_file" or values["body.density"]:
        found["body.mass"] = properties.mass
    if source != "body.shape":
        found["body.center_of_mass"] = tuple(properties.center_of_mass.tolist())
    return found


def _refuse_contradictions(
    source: str, values: Mapping[str, Any], given: Mapping[str, Any], followed: Mapping[str, Any]
) -> None:
    for name, value in followed.items():
        if name in given and values[name] != value:
            decider = "body.density" if name == "body.mass" and values["body.density"] else source
            raise ValueError(
                f"parameter {name} = {_shown(values[name])}: contradicts {decider}, from which {_shown(value)} "
                "follows; give one of the two"
            )


def _of_shape(values: Mapping[str, Any], _: str | os.PathLike[str], __: Files) -> _Found:
    shape, dimensions = SHAPES[values["body.shape"]], values["body.dimensions"]
    found = shape.mass_properties(dimensions, *_amount(values))
    return found, _on_density(found.mass, shape.volume(*dimensions) if shape.volume else 0.0, "body.dimensions", values)


def _of_mesh_file(values: Mapping[str, Any], folder: str | os.PathLike[str], files: Files) -> _Found:
    scale = values["body.mesh_scale"]
    key = ("body.mesh_file", values["body.mesh_file"], scale)
    with np.errstate(over="ignore", invalid="ignore"):  # what overflows is refused
        if key not in files:
            vertices, triangles, note = mesh_file.read(located(values["body.mesh_file"], folder))
            files[key] = of_mesh(vertices, triangles, density=1.0, scale=scale), (note,) * bool(note)
        solid, notes = files[key]
        found = solid.with_mass(mass_of(solid.mass, *_amount(values)))
    return found, notes + _on_density(found.mass, solid.mass, "body.mesh_scale", values)


def _on_density(mass: float, volume: float, lengths: str, values: Mapping[str, Any]) -> tuple[str, ...]:
    """A note when no solid has that density, with what would explain it; ``lengths`` is the parameter of these."""
    density = mass / volume if volume else _LIGHTEST
    if _LIGHTEST <= density <= _HEAVIEST:
        return _on_size(mass, volume, lengths, values)
    light = density < _LIGHTEST
    bound = f"less than any solid has, {_LIGHTEST:g}" if light else f"more than any solid has, {_HEAVIEST:g}"
    factor = 1e-3 if light else 1e3
    right = density / factor**3
    advice = "check mass and size"
    if _LIGHTEST <= right <= _HEAVIEST:
        given = f"{lengths}: {[float(f'{length * factor:.15g}') for length in values[lengths]]}"
        also = f" and body.density: {right:.6g}" if values["body.density"] else ""
        advice = f"lengths in {'mm taken as m' if light else 'm taken as mm'} explain it: give {given}{also}"
    told = f"mass {mass:.6g} kg in a volume of {volume:.6g} m³ is a density of {density:.6g} kg/m³"
    return (f"{told}, {bound} kg/m³; {advice}",)


def _on_size(mass: float, volume: float, lengths: str, values: Mapping[str, Any]) -> tuple[str, ...]:
    """A note when a mass that follows from a density is that of a ship: lengths in mm make a billion times of it."""
    if not values["body.density"] or mass < _MOST:
        return ()
    given = [float(f"{length * 1e-3:.15g}") for length in values[lengths]]
    return (
        f"a volume of {volume:.6g} m³ makes a mass of {mass:.6g} kg; lengths in mm taken as m may explain it: then "
        f"give {lengths}: {given}",
    )


def _of_urdf(values: Mapping[str, Any], folder: str | os.PathLike[str], files: Files) -> _Found:
    key = ("body.urdf_file", values["body.urdf_file"], values["body.urdf_link"])
    if key not in files:
        files[key] = urdf.read(located(values["body.urdf_file"], folder), values["body.urdf_link"]), ()
    return files[key]


_SOURCES: dict[str, Callable[[Mapping[str, Any], str | os.PathLike[str], Files], _Found]] = {
    "body.shape": _of_shape,
    "body.mesh_file": _of_mesh_file,
    "body.urdf_file": _of_urdf,
}


def _amount(values: Mapping[str, Any]) -> tuple[float | None, float | None]:
    """Mass [kg] and density [kg/m³], one of them None."""
    density = values["body.density"]
    return (None, density) if density else (values["body.mass"], None)


def _told(reason: Exception) -> str:
    """What it says, with as much of a path as messages show of any text."""
    if isinstance(reason, OSError) and reason.filename is not None:
        return f"{reason.strerror}: {shown(os.fspath(reason.filename))}"
    return str(reason)


def _shown(value: Any) -> str:
    return shown(list(value) if isinstance(value, tuple) else value)
