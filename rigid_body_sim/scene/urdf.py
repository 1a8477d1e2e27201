"""Mass properties of a link in a URDF file."""

import math
import os
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from ..kernels.arrays import Floats
from ..mass.mass_properties import MassProperties
from ..values import inertia, rotation
from ..values.parameter import shown
from . import schema

MOST_BYTES = 100_000_000  # of a file: large robots have some millions
_ENTRIES = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
_BELOW = {"iyx": "ixy", "izx": "ixz", "izy": "iyz"}  # some exporters write the lower half of the matrix, too
_ATTRIBUTES = {  # what URDF has under <inertial>, the only thing that is read
    "inertial": (),
    "origin": ("xyz", "rpy", "quat_xyzw"),
    "mass": ("value",),
    "inertia": (*_ENTRIES, *_BELOW),
}
# What Python would read besides, such as 1_000, inf and digits of other scripts, is a mistake.
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_THREE_DIGITS = 0.005  # of 1.00, half a unit of the last one
_EXPAND = "expand it first: xacro in.urdf.xacro > out.urdf"
_COUNTS = {3: "three", 4: "four"}
_VERSIONS = ("1.0", "1.1", "1.2")  # as urdfdom 6 knows them; a file that says none has the first one


class _DeclaresError(ValueError):
    """A file that declares entities, or may."""


def read(path: str | os.PathLike[str], link: str = "") -> MassProperties:
    """Mass, centre of mass and inertia of a link, in the link's frame.

    ``<inertial>`` gives the centre of mass (``origin xyz`` [m]), the axes of the tensor (``origin rpy`` [rad], about
    the link's fixed axes x, y, z, or ``origin quat_xyzw``, normalised, in URDF 1.1 and later), ``mass`` [kg] and
    ``inertia`` [kg m²]. Without ``link``, the file must have exactly one link with ``<inertial>`` and mass.
    xacro must be expanded before, but for a file in which the ``link`` that is named is there in full.

    Nothing under ``<inertial>`` is left out in silence: what URDF does not have there is refused, apart from comments
    and attributes of other XML namespaces. So is ``quat_xyzw`` in a file of version 1.0, or that says no version:
    urdfdom warns and takes the link as not turned.

    Raises OSError when the file cannot be read and ValueError, beginning with its path, when it is not XML, declares
    anything in a DOCTYPE, is not a URDF of a known version, has no such link, or that link has no inertial properties
    or bad ones.
    """
    with open(path, "rb") as file:
        content = file.read(MOST_BYTES + 1)
    try:
        if len(content) > MOST_BYTES:
            raise ValueError(f"has more than {MOST_BYTES} bytes; a URDF has a few million at most")
        return _read(_parsed(content), link)
    except ValueError as reason:
        shown = schema.shown_name(os.fspath(path))
        hint = f"; {_EXPAND}" if os.fspath(path).endswith(".xacro") and _EXPAND not in str(reason) else ""
        raise ValueError(f"file {shown}: {reason}{hint}") from None


def _read(root: ElementTree.Element, link: str) -> MassProperties:
    """Of a link that is there in full, whatever xacro is left elsewhere; but xacro may say which is the only one."""
    if not link:
        _refuse_xacro(root)
    try:
        return _of_link(root, link)
    except ValueError:
        _refuse_xacro(root)
        raise


def _parsed(content: bytes) -> ElementTree.Element:
    root = _tree(content)
    if root.tag != "robot":
        _refuse_xacro(root)
        raise ValueError(f"begins with <{schema.shown_name(root.tag)}>; a URDF begins with <robot>")
    return root


def _refuse_xacro(root: ElementTree.Element) -> None:
    """Refuse a file of which xacro would make another one. A namespace that is only declared is what it leaves."""
    prefixes = {name[6:] for name, uri in root.attrib.items() if name[:6] == "xmlns:" and "xacro" in uri}
    for element in root.iter():
        prefix, colon, _ = element.tag.partition(":")
        if colon and (prefix == "xacro" or prefix in prefixes):
            raise ValueError(f"has <{schema.shown_name(element.tag)}>, so it is xacro and no URDF yet; {_EXPAND}")
    for name in (link.get("name", "") for link in root.iterfind("link")):
        if _is_xacro(name):
            raise ValueError(f"has a link {shown(name)}, so it is xacro and no URDF yet; {_EXPAND}")


def _is_xacro(text: str) -> bool:
    return "${" in text or "$(" in text


def _tree(content: bytes) -> ElementTree.Element:
    """The elements of an XML file, with prefixes of namespaces as they stand, declared or not, as urdfdom reads them.

    What is UTF-8 is read so, whatever it declares, as by urdfdom; else what the file declares or its first bytes say.
    """
    builder, parser = ElementTree.TreeBuilder(), expat.ParserCreate()
    parser.buffer_text = True
    parser.StartDoctypeDeclHandler = _refuse_declarations
    parser.StartElementHandler, parser.EndElementHandler = builder.start, builder.end
    parser.CharacterDataHandler = builder.data
    text = _utf8(content)
    try:
        parser.Parse(content if text is None else text, True)
    except _DeclaresError:
        raise
    except (expat.ExpatError, LookupError, ValueError) as reason:  # the last two: an encoding that it cannot read
        what = "XML" if text is not None else "UTF-8 text, nor XML in an encoding that it declares"
        raise ValueError(f"is not {what}: {schema.one_line(reason)}") from None
    return builder.close()


def _utf8(content: bytes) -> str | None:
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return None
    return None if "\0" in text else text  # UTF-16 in which all is ASCII


def _refuse_declarations(_: str, system: str | None, public: str | None, inside: bool) -> None:
    """Entities can only be declared in a DOCTYPE, or where it points: without, none is expanded and none is fetched."""
    if system or public or inside:
        raise _DeclaresError("has a DOCTYPE, which URDF does not need; remove it")


def _version(root: ElementTree.Element) -> str:
    version = root.get("version", _VERSIONS[0]).strip()
    if version not in _VERSIONS:
        raise ValueError(f"has the URDF version {shown(version)}; known are {', '.join(_VERSIONS)}")
    return version


def _of_link(root: ElementTree.Element, name: str) -> MassProperties:
    version = _version(root)
    links = _links(root)
    name = name or _only_one(root, links)
    if name not in links:
        raise ValueError(f"has no link {shown(name)}; its links are {_listed(links)}{_deeper(root)}")
    inertials = links[name].findall("inertial")
    if not inertials:
        those = f"those that have one: {_listed(_with_mass(links))}{_mesh_instead(links[name])}"
        raise ValueError(f"link {shown(name)} has no <inertial>; {those}")
    try:
        if len(inertials) > 1:
            raise ValueError(f"<inertial> stands there {len(inertials)} times; a link has one")
        return _of_inertial(inertials[0], version)
    except ValueError as reason:
        raise ValueError(f"link {shown(name)}: {reason}") from None


def _mesh_instead(link: ElementTree.Element) -> str:
    """The link's mesh, by the parameters that take one."""
    for kind in ("collision", "visual"):
        mesh = link.find(f"{kind}/geometry/mesh[@filename]")
        if mesh is not None:
            file = schema.shown_name(mesh.attrib["filename"])
            moved = ", placed as its <origin> says," if link.find(f"{kind}/origin") is not None else ""
            return f"; the mesh of its <{kind}>{moved} can stand in: body.mesh_file: {file}{_scale_of(mesh)}"
    return ""


def _scale_of(mesh: ElementTree.Element) -> str:
    """Its scale as a parameter: some write one number for three, and a negative one is no scale but a mirror."""
    scale = mesh.get("scale", "").split()
    if not all(_NUMBER.fullmatch(number) for number in scale) or len(scale) not in (1, 3):
        return ""
    if any(number.startswith("-") for number in scale):
        return f", mirrored as its scale {' '.join(scale)} says"
    return f" and body.mesh_scale: [{', '.join(scale * (3 // len(scale)))}]"


def _links(root: ElementTree.Element) -> dict[str, ElementTree.Element]:
    found = root.findall("link")
    links = {link.get("name", ""): link for link in found}
    if len(links) < len(found):
        twice, _ = Counter(link.get("name", "") for link in found).most_common(1)[0]
        raise ValueError(f"has two links of the name {shown(twice)}; give each a name of its own")
    return links


def _only_one(root: ElementTree.Element, links: Mapping[str, ElementTree.Element]) -> str:
    """The name of the only link with mass."""
    with_mass = _with_mass(links)
    if not with_mass:
        raise ValueError(f"has 0 links with <inertial> and a mass greater than zero; a body is one{_deeper(root)}")
    if len(with_mass) > 1:
        raise ValueError(
            f"has {len(with_mass)} links with <inertial>; name one: {_listed(with_mass)} (parameter body.urdf_link)"
        )
    return with_mass[0]


def _with_mass(links: Mapping[str, ElementTree.Element]) -> list[str]:
    """Names of the links with ``<inertial>``, but for those of mass 0, which other readers take as massless, too."""
    return [name for name, link in links.items() if link.find("inertial") is not None and not _is_massless(link)]


def _is_massless(link: ElementTree.Element) -> bool:
    value = link.find("inertial/mass[@value]")
    text = "" if value is None else value.attrib["value"].strip()
    return bool(_NUMBER.fullmatch(text)) and float(text) == 0.0


def _deeper(root: ElementTree.Element) -> str:
    """What to say of links elsewhere in the file, where urdfdom does not see them either."""
    for element in root.iter():
        if element is not root and element.find("link") is not None:
            return f"; a <link> inside <{schema.shown_name(element.tag)}> is none; URDF has links right inside <robot>"
    return ""


def _listed(names: Iterable[str]) -> str:
    return schema.shown_name(", ".join(names) or "none")


def _of_inertial(inertial: ElementTree.Element, version: str) -> MassProperties:
    parts = _parts(inertial)
    mass = _number(parts["mass"], "value")
    about_center = MassProperties(mass, _tensor(parts["inertia"]))
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
            raise ValueError(
                f"<inertial> has <{schema.shown_name(part.tag)}>; URDF has <origin>, <mass> and <inertia> there"
            )
        if parts[part.tag] is not part:
            raise ValueError(f"<inertial> has <{part.tag}> more than once; give each element once")
        _refuse_unknown(part)
        if len(part):
            inside = schema.shown_name(part[0].tag)
            raise ValueError(f"<{part.tag}> has <{inside}> inside; URDF has attributes there, no elements")
    for tag in ("mass", "inertia"):
        if tag not in parts:
            raise ValueError(f"<inertial> has no <{tag}>; it needs <mass> and <inertia>")
    return parts


def _refuse_unknown(element: ElementTree.Element) -> None:
    """Refuse attributes that URDF does not have in this element, and text. Other XML namespaces have their own."""
    known = _ATTRIBUTES[element.tag]
    for name in element.attrib:
        if name not in known and ":" not in name and name != "xmlns":
            has = f"attributes {', '.join(known)}" if known else "no attributes"
            raise ValueError(f"<{element.tag}> has an attribute {shown(name)}; URDF has {has} there")
    text = "".join([element.text or "", *(part.tail or "" for part in element)]).strip()
    if text:
        raise ValueError(f"<{element.tag}> has the text {shown(text)} inside; URDF has no text there")


def _number(element: ElementTree.Element, name: str) -> float:
    text = element.get(name)
    if text is None:
        raise ValueError(f"<{element.tag}> has no attribute {name}; give it a number")
    return _float(text, f"{element.tag} {name}")


def _tensor(element: ElementTree.Element) -> Floats:
    """The tensor [kg m²], shape (3, 3), of ``<inertia>``, or the nearest that a body can have within its digits.

    Exporters print 3 to 6 digits, with which that of a plate or a rod may miss the triangle inequality, or that a rod
    has a moment about its axis. Each entry is known to half a unit of its last digit; three digits of the largest entry
    are the coarsest that count, as 1, 1 and 3 are no plate.
    """
    matrix = inertia.as_matrix([_number(element, name) for name in _ENTRIES])
    for below, above in _BELOW.items():
        if below in element.attrib and _number(element, below) != _number(element, above):
            raise ValueError(
                f"inertia {below} = {shown(element.attrib[below])} is not {above}, "
                f"{shown(element.attrib[above])}; the matrix is symmetric, give {above} alone"
            )
    half_units = np.array([_half_unit(element.attrib[name]) for name in _ENTRIES])
    coarsest = _THREE_DIGITS * np.abs(matrix).max()
    return inertia.within_rounding(matrix, inertia.as_matrix(half_units.clip(max=coarsest)))


def _half_unit(text: str) -> float:
    """Half a unit of the last digit that is printed: 0.0005 of 0.250, 5e-7 of -2.5e-5, 0.5 of 3."""
    digits, e, exponent = text.strip().lower().partition("e")
    zeros = re.sub(r"\d", "0", digits.lstrip("+-"))
    return float(f"{zeros}{'' if '.' in zeros else '.'}5{e}{exponent}")


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
    if _is_xacro(text):  # with spaces or without
        raise _no_number(text, f"origin {name}")
    if len(text.split()) != count:
        hint = ", not commas" if "," in text else ""
        raise ValueError(
            f"origin {name} = {shown(text)} is not {_COUNTS[count]} numbers with spaces between them{hint}"
        )
    return tuple(_float(part, f"origin {name}") for part in text.split())


def _float(text: str, name: str) -> float:
    number = float(text) if _NUMBER.fullmatch(text.strip()) else math.nan
    if not math.isfinite(number):
        raise _no_number(text, name)
    return number


def _no_number(text: str, name: str) -> ValueError:
    right = "write it in SI units, as in 0.25 or 2.5e-1" + (", with a point and no comma" if "," in text else "")
    if _is_xacro(text):
        right = f"it is xacro; {_EXPAND}"
    return ValueError(f"{name} = {shown(text)} is not a finite number; {right}")
