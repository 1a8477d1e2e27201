"""Triangle meshes from files, read with trimesh (an optional dependency) and checked here."""

import io
import logging
import os
import re
from typing import Any

import numpy as np

from ..kernels.arrays import Floats, Integers
from ..values.parameter import shown
from . import mesh_corners, schema

# Of what else trimesh reads, GLB may ask for any amount of memory in a few bytes, and 3MF and DAE need more packages.
FORMATS = ("stl", "obj", "ply", "off")
MOST_BYTES = 1_000_000_000  # of a file: twenty million triangles
_HEAD, _RECORD = 84, 50  # bytes of a binary STL, whose head ends with the count of records


def read(path: str | os.PathLike[str]) -> tuple[Floats, Integers, str]:
    """Vertices as in the file, shape (n, 3), and triangles, shape (m, 3), for ``mass.mesh.of_mesh``, and a note.

    Files have no unit. Corners become one vertex where they are one, see ``mesh_corners.joined``, because STL repeats
    them in each triangle; the note is a sentence about what was merged beyond equal ones, mostly empty. Several objects
    in one file become one mesh, and polygons triangles.

    Raises OSError when the file cannot be read and ValueError for another format, a file that holds no triangles or
    cannot be understood, and where trimesh is not installed.
    """
    shown = schema.shown_name(os.fspath(path))
    kind = os.path.splitext(path)[1][1:].lower()
    if kind not in FORMATS:
        known = ", ".join(f".{name}" for name in FORMATS[:-1])
        raise ValueError(
            f"file {shown} is neither {known} nor .{FORMATS[-1]}; save the mesh in one of these: Blender, MeshLab and "
            "FreeCAD (which reads STEP too) write STL"
        )
    with open(path, "rb") as file:
        content = file.read(MOST_BYTES + 1)
    if len(content) > MOST_BYTES:
        raise ValueError(f"file {shown} has more than {MOST_BYTES} bytes; give a coarser mesh")
    try:
        corners, triangles = _READERS.get(kind, _by_trimesh)(content, kind)
    except ValueError as reason:
        raise ValueError(f"file {shown} cannot be read as {kind.upper()}: {reason}") from None
    if not len(triangles):
        raise ValueError(f"file {shown} holds no triangles; a solid has at least four")
    vertices, triangles, note = mesh_corners.joined(corners, triangles)
    if not len(triangles):
        raise ValueError(f"file {shown} holds only triangles that have a corner twice; a solid has four that have not")
    return vertices, triangles, note


def _by_trimesh(content: bytes, kind: str) -> tuple[Floats, Integers]:
    try:
        import trimesh
    except ImportError:
        raise ValueError("a mesh file is read with trimesh, which is not installed: pip install trimesh") from None
    log = logging.getLogger("trimesh")  # would print tracebacks of what it tries first
    disabled, log.disabled = log.disabled, True
    try:
        mesh = trimesh.load(io.BytesIO(content), file_type=kind, force="mesh", process=False, skip_materials=True)
        corners, triangles = np.array(mesh.vertices, float), np.array(mesh.faces, np.int64)
    except IndexError:
        raise ValueError("a face has a corner that is none of its vertices") from None
    except Exception as reason:  # whatever a bad file makes of trimesh's readers
        raise ValueError(shown(" ".join(str(reason).split()))) from None
    finally:
        log.disabled = disabled
    if corners.shape != (len(corners), 3):
        raise ValueError("a vertex has not three coordinates")
    if triangles.size and not 0 <= triangles.min() <= triangles.max() < len(corners):
        raise ValueError("a face has a corner that is none of its vertices")
    return corners, triangles


def _stl(content: bytes, kind: str) -> tuple[Floats, Integers]:
    """Text has no byte of zero, and a binary file has many, whatever its head says."""
    if b"\0" not in content:
        return _text_stl(content)
    count, held = int.from_bytes(content[_HEAD - 4 : _HEAD], "little"), (len(content) - _HEAD) // _RECORD
    told, count = count, count or held  # 0 where a program did not know it when it began
    end = _HEAD + count * _RECORD
    if not 0 < count <= held or (held > count and content[end:].strip(b"\0")):
        raise ValueError(
            f"its head says {told} triangles, and its {len(content)} bytes hold {max(held, 0)}; "
            "it is cut off or damaged: save it anew"
        )
    return _by_trimesh(content[: _HEAD - 4] + count.to_bytes(4, "little") + content[_HEAD:end], kind)


def _text_stl(content: bytes) -> tuple[Floats, Integers]:
    """Of any number of solids, in any case and with any white space; only the corners count."""
    text = _NAMES.sub(b" ", content)
    corners = _VERTEX.findall(text)
    facets, vertices = len(_FACET.findall(text)), len(_WORD.findall(text))
    if not facets or not vertices == len(corners) == 3 * facets:
        raise ValueError(
            f"it has the word vertex {vertices} times, {len(corners)} times before three numbers, in {facets} facets; "
            "each facet has three"
        )
    return np.array(corners).astype(float), np.arange(len(corners)).reshape(-1, 3)


_NAMES = re.compile(
    rb"(?im)(?:^|(?<=[\r\n]))[ \t\xef\xbb\xbf]*(?:end)?solid\b[^\r\n]*?(?=\bfacet\s+normal\b|[\r\n]|\Z)"
)
_NUMBER = rb"\s+([-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:e[-+]?\d+)?)"
_VERTEX = re.compile(rb"(?i)\bvertex" + 3 * _NUMBER + rb"(?!\S)")
_WORD = re.compile(rb"(?i)\bvertex\b")
_FACET = re.compile(rb"(?i)\bfacet\s+normal\b")


def _obj(content: bytes, kind: str) -> tuple[Floats, Integers]:
    """Lines that go on, comments behind numbers and tabs are put as trimesh knows them."""
    text = re.sub(rb"\\[ \t]*\r?\n", b" ", content)
    text = re.sub(rb"#[^\r\n]*", b"", text).replace(b"\t", b" ").replace(b"\r", b"\n")
    text = re.sub(rb"(?m)^ +", b"", text)
    if bad := re.search(rb"(?m)^f(?: .*)? [-+]?0+(?![0-9]).*$", text):
        line = shown(bad[0].decode("latin-1"))
        raise ValueError(f"the face {line} has the corner 0; numbers of vertices begin at 1")
    return _by_trimesh(_counted_from_the_first(text), kind)


def _counted_from_the_first(text: bytes) -> bytes:
    """Corners -1, -2 are counted back from the vertices read so far; trimesh counts from the end of the file."""
    if not re.search(rb"(?m)^f .*-", text):
        return text
    lines, read = text.split(b"\n"), 0

    def absolute(corner: re.Match[bytes]) -> bytes:
        if (number := read + 1 - int(corner[1])) < 1:
            raise ValueError("a face has a corner that is none of its vertices")
        return b" %d" % number

    for i, line in enumerate(lines):
        read += line.startswith(b"v ")
        if line.startswith(b"f "):
            lines[i] = re.sub(rb" +-(\d+)(?:/\S*)?", absolute, line)
    return b"\n".join(lines)


_READERS: dict[str, Any] = {"stl": _stl, "obj": _obj}
