"""Mass properties of a link in a URDF file."""

import math
import os
from collections import Counter
from collections.abc import Iterable
from xml.etree import ElementTree

from ..physics import rotation
from ..physics.mass_properties import MassProperties
from . import schema

MOST_BYTES = 100_000_000  # of a file: large robots have some millions
_ENTRIES = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


def read(path: str | os.PathLike[str], link: str = "") -> MassProperties:
    """Mass, centre of mass and inertia of a link, in the link's frame.

    ``<inertial>`` gives the centre of mass (``origin xyz`` [m]), the axes of the tensor (``origin rpy`` [rad], about
    the link's fixed axes x, y, z), ``mass`` [kg] and ``inertia`` [kg m²]. Without ``link``, the file must have exactly
    one link with ``<inertial>``.

    Raises OSError when the file cannot be read and ValueError, beginning with its path, when it is not UTF-8, has a
    DOCTYPE, is not a URDF, has no such link, or that link has no inertial properties or bad ones.
    """
    with open(path, "rb") as file:
        content = file.read(MOST_BYTES + 1)
    try:
        if len(content) > MOST_BYTES:
            raise ValueError(f"has more than {MOST_BYTES} bytes; a URDF has a few million at most")
        return _of_link(_parsed(content), link)
    except ValueError as reason:
        raise ValueError(f"file {schema.shown_name(os.fspath(path))}: {reason}") from None


def _parsed(content: bytes) -> ElementTree.Element:
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = "\0"
    if "\0" in text:  # what looks like UTF-16 is read as such, with a DOCTYPE that is not seen here
        raise ValueError("is not UTF-8 text; URDF is XML in UTF-8")
    # Entities can only be declared in a DOCTYPE: without one there is nothing to expand or to fetch.
    if "<!DOCTYPE" in text:
        raise ValueError("has a DOCTYPE, which URDF does not need; remove it")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as reason:
        raise ValueError(f"is not XML: {reason}") from None
    if root.tag != "robot":
        raise ValueError(f"begins with <{root.tag}>; a URDF begins with <robot> (expand xacro files first)")
    return root


def _of_link(root: ElementTree.Element, name: str) -> MassProperties:
    found = root.findall("link")
    links = {link.get("name", ""): link.find("inertial") for link in found}
    if len(links) < len(found):
        twice, _ = Counter(link.get("name", "") for link in found).most_common(1)[0]
        raise ValueError(f"has two links of the name {schema.shown(twice)}; give each a name of its own")
    with_mass = [link for link, inertial in links.items() if inertial is not None]
    if name and name not in links:
        raise ValueError(f"has no link {schema.shown(name)}; its links are {_listed(links)}")
    if not name and len(with_mass) != 1:
        raise ValueError(f"has {len(with_mass)} links with <inertial>; name one: {_listed(with_mass)}")
    inertial = links[name or with_mass[0]]
    if inertial is None:
        raise ValueError(f"link {schema.shown(name)} has no <inertial>; those that have one: {_listed(with_mass)}")
    try:
        return _of_inertial(inertial)
    except ValueError as reason:
        raise ValueError(f"link {schema.shown(name or with_mass[0])}: {reason}") from None


def _listed(names: Iterable[str]) -> str:
    return schema.shown_name(", ".join(names) or "none")


def _of_inertial(inertial: ElementTree.Element) -> MassProperties:
    origin = inertial.find("origin")
    xyz, rpy = (_three(origin, name) for name in ("xyz", "rpy"))
    mass = _number(_child(inertial, "mass"), "value")
    tensor = _child(inertial, "inertia")
    about_center = MassProperties(mass, [_number(tensor, name) for name in _ENTRIES])
    return about_center.placed(xyz, rotation.from_roll_pitch_yaw(*rpy))


def _child(inertial: ElementTree.Element, tag: str) -> ElementTree.Element:
    child = inertial.find(tag)
    if child is None:
        raise ValueError(f"<inertial> has no <{tag}>; it needs <mass> and <inertia>")
    return child


def _number(element: ElementTree.Element, name: str) -> float:
    text = element.get(name)
    if text is None:
        raise ValueError(f"<{element.tag}> has no attribute {name}; give it a number")
    return _float(text, f"{element.tag} {name}")


def _three(origin: ElementTree.Element | None, name: str) -> tuple[float, ...]:
    text = "0 0 0" if origin is None else origin.get(name, "0 0 0")
    if len(text.split()) != 3:
        raise ValueError(f"origin {name} = {schema.shown(text)} is not three numbers with spaces between them")
    return tuple(_float(part, f"origin {name}") for part in text.split())


def _float(text: str, name: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise ValueError(f"{name} = {schema.shown(text)} is not a finite number")
    return number
