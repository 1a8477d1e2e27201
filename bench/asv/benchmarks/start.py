"""What a program waits for before it can simulate: imports, and a mesh that is read."""

import tempfile
import time
from pathlib import Path

from rigid_body_sim import Scene


def timeraw_import() -> str:
    """All that a simulation needs, in a Python of its own, kernels not compiled."""
    return "from rigid_body_sim import Simulation"


class MeshRead:
    """A scene whose mass properties follow from a binary STL of 20480 triangles."""

    timer = time.process_time

    def setup(self) -> None:
        import trimesh

        self.folder = tempfile.TemporaryDirectory()
        self.file = Path(self.folder.name) / "ball.stl"
        trimesh.creation.icosphere(subdivisions=5).export(self.file)

    def teardown(self) -> None:
        self.folder.cleanup()

    def time_mesh_of_20480_triangles(self) -> None:
        self.scene = Scene({"body.mesh_file": str(self.file), "body.mass": 2.0})
