"""Mass properties of a link in a URDF file."""

import math
import os
from collections import Counter
from collections.abc import Iterable
from xml.etree import ElementTree

from ..physics import rotation
from ..physics.arrays import Floats
from ..physics.mass_properties import MassProperties
from . import schema

MOST_BYTES = 100_000_000  # of a file: large robots have some millions
_ENTRIES = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
_ATTRIBUTES = {  # what URDF has under <inertial>, the only thing that is read
    "inertial": (),
    "origin": ("xyz", "rpy", "quat_xyzw"),
    "mass": ("value",),
    "inertia": _ENTRIES,
}
_COUNTS = {3: "three", 4: "four"}
_VERSIONS = ("1.0", "1.1", "1.2")  # as urdfdom 6 knows them; a file that says none has the first one


def read(path: str | os.PathLike[str], link: str = "") -> MassProperties:
    """Mass, centre of mass and inertia of a link, in the link's frame.

    ``<inertial>`` gives the centre of mass (``origin xyz`` [m]), the axes of the tensor (``origin rpy`` [rad], about
    the link's fixed axes x, y, z, or ``origin quat_xyzw``, normalised, in URDF 1.1 and later), ``mass`` [kg] and
    ``inertia`` [kg m²]. Without ``link``, the file must have exactly one link with ``<inertial>``.

    Nothing under ``<inertial>`` is left out in silence: what URDF does not have there is refused, apart from comments
    and attributes of other XML namespaces. So is ``quat_xyzw`` in a file of version 1.0, or that says no version:
    urdfdom warns and takes the link as not turned.

    Raises OSError when the file cannot be read and ValueError, beginning with its path, when it is not UTF-8, has a
    DOCTYPE, is not a URDF of a known version, has no such link, or that link has no inertial properties or bad ones.
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


def _version(root: ElementTree.Element) -> str:
    version = root.get("version", _VERSIONS[0]).strip()
    if version not in _VERSIONS:
        raise ValueError(f"has the URDF version {schema.shown(version)}; known are {', '.join(_VERSIONS)}")
    return version


def _of_link(root: ElementTree.Element, name: str) -> MassProperties:
    version = _version(root)
    found = root.findall("link")
    links = {link.get("name", ""): link.findall("inertial") for link in found}
    if len(links) < len(found):
        twice, _ = Counter(link.get("name", "") for link in found).most_common(1)[0]
        raise ValueError(f"has two links of the name {schema.shown(twice)}; give each a name of its own")
    with_mass = [link for link, inertials in links.items() if inertials]
    if name and name not in links:
        raise ValueError(f"has no link {schema.shown(name)}; its links are {_listed(links)}")
    if not name and len(with_mass) != 1:
        raise ValueError(f"has {len(with_mass)} links with <inertial>; name one: {_listed(with_mass)}")
    inertials = links[name or with_mass[0]]
    if not inertials:
        raise ValueError(f"link {schema.shown(name)} has no <inertial>; those that have one: {_listed(with_mass)}")
    try:
        if len(inertials) > 1:
            raise ValueError(f"<inertial> stands there {len(inertials)} times; a link has one")
        return _of_inertial(inertials[0], version)
    except ValueError as reason:
        raise ValueError(f"link {schema.shown(name or with_mass[0])}: {reason}") from None


def _listed(names: Iterable[str]) -> str:
    return schema.shown_name(", ".join(names) or "none")


def _of_inertial(inertial: ElementTree.Element, version: str) -> MassProperties:
    parts = _parts(inertial)
    mass = _number(parts["mass"], "value")
    about_center = MassProperties(mass, [_number(parts["inertia"], name) for name in _ENTRIES])
    origin = parts.get("origin")
    if origin is None:
        return about_center
    return about_center.placed(_numbers(origin, "xyz", 3), _attitude(origin, version))


def _parts(inertial: ElementTree.Element) -> dict[str, ElementTree.Element]:
    """The elements of ``<inertial>`` by name. Raises ValueError for one that is missing and for all that is unknown."""
    _refuse_unknown(inertial)
    parts = {part.tag: part for part in inertial}
    for part in inertial:
        if part.tag not in _ATTRIBUTES or part.tag == "inertial":
            raise ValueError(f"<inertial> has <{part.tag}>; URDF has <origin>, <mass> and <inertia> there")
        if parts[part.tag] is not part:
            raise ValueError(f"<inertial> has <{part.tag}> more than once; give each element once")
        _refuse_unknown(part)
        if len(part):
            raise ValueError(f"<{part.tag}> has <{part[0].tag}> inside; URDF has attributes there, no elements")
    for tag in ("mass", "inertia"):
        if tag not in parts:
            raise ValueError(f"<inertial> has no <{tag}>; it needs <mass> and <inertia>")
    return parts


def _refuse_unknown(element: ElementTree.Element) -> None:
    """Refuse attributes that URDF does not have in this element, and text. Other XML namespaces have their own."""
    known = _ATTRIBUTES[element.tag]
    for name in element.attrib:
        if name not in known and not name.startswith("{"):
            has = f"attributes {', '.join(known)}" if known else "no attributes"
            raise ValueError(f"<{element.tag}> has an attribute {schema.shown(name)}; URDF has {has} there")
    text = "".join([element.text or "", *(part.tail or "" for part in element)]).strip()
    if text:
        raise ValueError(f"<{element.tag}> has the text {schema.shown(text)} inside; URDF has no text there")


def _number(element: ElementTree.Element, name: str) -> float:
    text = element.get(name)
    if text is None:
        raise ValueError(f"<{element.tag}> has no attribute {name}; give it a number")
    return _float(text, f"{element.tag} {name}")


def _attitude(origin: ElementTree.Element, version: str) -> Floats:
    """Quaternion, shape (4,), of the tensor's axes in the link's. One of any length is normalised, as by urdfdom.

    A quaternion without direction is refused; urdfdom takes it as no turn.
    """
    if "quat_xyzw" not in origin.attrib:
        return rotation.from_roll_pitch_yaw(*_numbers(origin, "rpy", 3))
    if version == _VERSIONS[0]:
        raise ValueError(
            "<origin> has quat_xyzw, which URDF 1.0 does not know and its readers leave out; "
            'give rpy, or write <robot version="1.1"> where that is what the file is'
        )
    if "rpy" in origin.attrib:
        raise ValueError("<origin> has both rpy and quat_xyzw; give one of them")
    x, y, z, w = _numbers(origin, "quat_xyzw", 4)
    if math.hypot(x, y, z, w) < rotation.SMALLEST_NORM:
        raise ValueError(f"origin quat_xyzw = {[x, y, z, w]} has no direction; give x, y, z, w such as 0 0 0 1")
    return rotation.normalize((w, x, y, z))


def _numbers(origin: ElementTree.Element, name: str, count: int) -> tuple[float, ...]:
    """So many numbers from an attribute of ``<origin>``: zeros where there is no such attribute."""
    text = origin.get(name, " ".join(["0"] * count))
    if len(text.split()) != count:
        raise ValueError(
            f"origin {name} = {schema.shown(text)} is not {_COUNTS[count]} numbers with spaces between them"
        )
    return tuple(_float(part, f"origin {name}") for part in text.split())


def _float(text: str, name: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise ValueError(f"{name} = {schema.shown(text)} is not a finite number")
    return number
