"""Where a scene's mass, inertia and centre of mass come from: given as such, a shape, a mesh or a URDF link."""

import os
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from ..physics.mass_properties import MassProperties, mass_of
from ..physics.mesh import of_mesh
from ..physics.shapes import SHAPES
from . import mesh_file, schema, urdf
from .file_path import located

_NEEDS = {  # a parameter, and those of which it needs one
    "body.dimensions": ("body.shape",),
    "body.density": ("body.shape", "body.mesh_file"),
    "body.urdf_link": ("body.urdf_file",),
}


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
    begin. What is in ``files`` is not read again, and what is read is added: a file changes no body that is there. A
    parameter that follows may be given too when it says the same to the last bit, so that what a node holds can be
    given to another one. Raises ValueError when two parameters contradict each other, one lacks another, or a
    shape or file is bad.
    """
    sources = [name for name in _SOURCES if values[name]]
    if len(sources) > 1:
        raise ValueError(f"parameters {' and '.join(sources)} are given; the inertia has one source: give one of them")
    for name, needed in _NEEDS.items():
        if values[name] and not any(values[other] for other in needed):
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
    return SHAPES[values["body.shape"]].mass_properties(values["body.dimensions"], *_amount(values)), ()


def _of_mesh_file(values: Mapping[str, Any], folder: str | os.PathLike[str], files: Files) -> _Found:
    key = ("body.mesh_file", values["body.mesh_file"])
    with np.errstate(over="ignore", invalid="ignore"):  # what overflows is refused
        if key not in files:
            vertices, triangles, note = mesh_file.read(located(values["body.mesh_file"], folder))
            files[key] = of_mesh(vertices, triangles, density=1.0), (note,) * bool(note)
        solid, notes = files[key]
        return solid.with_mass(mass_of(solid.mass, *_amount(values))), notes


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
        return f"{reason.strerror}: {schema.shown(os.fspath(reason.filename))}"
    return str(reason)


def _shown(value: Any) -> str:
    return schema.shown(list(value) if isinstance(value, tuple) else value)
