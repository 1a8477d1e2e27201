"""Where compiled kernels are kept."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from rigid_body_sim.kernels import compiled

pytest.importorskip("numba")

PACKAGE = Path(compiled.__file__).parents[1]


def test_another_installation_has_a_cache_of_its_own(tmp_path):
    """numba finds only what was compiled from the same path, so what the other has compiled must not count."""
    for folder in ("kernels", "effects", "integrators"):
        shutil.copytree(PACKAGE / folder, tmp_path / "rigid_body_sim" / folder)
    (tmp_path / "rigid_body_sim" / "__init__.py").touch()
    script = "from rigid_body_sim.kernels import compiled as c; print(c.sources_digest(), c.FOLDER)"
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    other = subprocess.run(
        [sys.executable, "-c", script], env=environment, cwd=tmp_path, capture_output=True, text=True, check=True
    )
    digest, folder = other.stdout.split(maxsplit=1)
    assert digest == compiled.sources_digest()
    assert digest in folder and Path(folder.strip()) != compiled.FOLDER
