"""Triangle meshes from STL and OBJ files, read with trimesh (an optional dependency) and checked here."""

import os

import numpy as np

from ..physics.arrays import Floats, Integers

FORMATS = ("stl", "obj")


def read(path: str | os.PathLike[str]) -> tuple[Floats, Integers]:
    """Vertices [m], shape (n, 3), and triangles, shape (m, 3), for ``physics.mesh.of_mesh``.

    Files have no unit: their numbers are taken as m. Corners with the same coordinates, to the last bit, become one
    vertex, because STL repeats them in each triangle; triangles that thereby have a corner twice are left out, as they
    enclose nothing. Several objects in one file become one mesh.

    Raises OSError when the file cannot be read and ValueError for another format, a file that holds no triangles or
    cannot be understood, and where trimesh is not installed.
    """
    kind = os.path.splitext(path)[1][1:].lower()
    if kind not in FORMATS:
        raise ValueError(f"file {os.fspath(path)} is neither .stl nor .obj; save the mesh in one of these formats")
    try:
        import trimesh
    except ImportError:
        raise ValueError("a mesh file is read with trimesh, which is not installed: pip install trimesh") from None
    with open(path, "rb") as file:
        try:
            mesh = trimesh.load(file, file_type=kind, force="mesh", process=False, skip_materials=True)
            corners, triangles = np.array(mesh.vertices, float), np.array(mesh.faces, np.int64)
        except Exception as reason:  # whatever a bad file makes of trimesh's readers
            raise ValueError(f"file {os.fspath(path)} cannot be read as {kind.upper()}: {reason}") from None
    if not len(triangles):
        raise ValueError(f"file {os.fspath(path)} holds no triangles; a solid has at least four")
    return _merged(corners, triangles)


def _merged(corners: Floats, triangles: Integers) -> tuple[Floats, Integers]:
    vertices, number = np.unique(corners, axis=0, return_inverse=True)
    triangles = number.ravel()[triangles]
    same = (triangles == np.roll(triangles, 1, axis=1)).any(axis=1)
    return vertices, triangles[~same]
