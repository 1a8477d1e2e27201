"""Where the files in config/ are that came with the package: installed by colcon or pip, or in the source tree."""

import sys
from pathlib import Path


def installed_scene(name: str) -> Path:
    """Path of the scene of that name, where the others are; a path that does not exist when there is none."""
    return installed(f"{name}.yaml")


def installed(file: str) -> Path:
    """Path of a file in config/; a path that does not exist when there is none."""
    return _folder() / file


def installed_scenes() -> list[Path]:
    """Paths of all of them, sorted by name."""
    return sorted(_folder().glob("*.yaml"))


def _folder() -> Path:
    here = Path(__file__).resolve()
    folders = [here.parents[2] / "config"]
    folders += [parent / "share/rigid_body_sim/config" for parent in (*here.parents, Path(sys.prefix))]
    return next((folder for folder in folders if any(folder.glob("*.yaml"))), folders[-1])
