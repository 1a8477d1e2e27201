"""Triangle meshes from STL and OBJ files, read with trimesh (an optional dependency) and checked here."""

import io
import logging
import os

import numpy as np

from ..physics.arrays import Floats, Integers
from . import mesh_corners, schema

FORMATS = ("stl", "obj")
MOST_BYTES = 1_000_000_000  # of a file: twenty million triangles


def read(path: str | os.PathLike[str]) -> tuple[Floats, Integers, str]:
    """Vertices as in the file, shape (n, 3), and triangles, shape (m, 3), for ``physics.mesh.of_mesh``, and a note.

    Files have no unit. Corners become one vertex where they are one, see ``mesh_corners.joined``, because STL repeats
    them in each triangle; the note is a sentence about what was merged beyond equal ones, mostly empty. Several objects
    in one file become one mesh.

    Raises OSError when the file cannot be read and ValueError for another format, a file that holds no triangles or
    cannot be understood, and where trimesh is not installed.
    """
    shown = schema.shown_name(os.fspath(path))
    kind = os.path.splitext(path)[1][1:].lower()
    if kind not in FORMATS:
        raise ValueError(f"file {shown} is neither .stl nor .obj; save the mesh in one of these formats")
    try:
        import trimesh
    except ImportError:
        raise ValueError("a mesh file is read with trimesh, which is not installed: pip install trimesh") from None
    with open(path, "rb") as file:
        content = file.read(MOST_BYTES + 1)
        if len(content) > MOST_BYTES:
            raise ValueError(f"file {shown} has more than {MOST_BYTES} bytes; give a coarser mesh")
        log = logging.getLogger("trimesh")  # would print tracebacks of what it tries first
        disabled, log.disabled = log.disabled, True
        try:
            mesh = trimesh.load(io.BytesIO(content), file_type=kind, force="mesh", process=False, skip_materials=True)
            corners, triangles = np.array(mesh.vertices, float), np.array(mesh.faces, np.int64)
        except Exception as reason:  # whatever a bad file makes of trimesh's readers
            text = schema.shown(" ".join(str(reason).split()))
            raise ValueError(f"file {shown} cannot be read as {kind.upper()}: {text}") from None
        finally:
            log.disabled = disabled
    if not len(triangles):
        raise ValueError(f"file {shown} holds no triangles; a solid has at least four")
    return mesh_corners.joined(corners, triangles)
