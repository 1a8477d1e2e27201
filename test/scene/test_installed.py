"""The scenes that come with the package are found wherever it is installed."""

from pathlib import Path

import pytest

from rigid_body_sim import load_scene
from rigid_body_sim.scene import attitude, installed
from rigid_body_sim.values import rotation

CONFIG = Path(__file__).parents[2] / "config"


def test_scene_is_found_by_its_name():
    scene = load_scene(installed.installed_scene("satellite"))
    assert rotation.norm(attitude.quaternion(scene.values, "initial")) == pytest.approx(1.0)
    assert installed.installed_scene("no_such_scene").name == "no_such_scene.yaml"


def test_all_are_found():
    found = [path.name for path in installed.installed_scenes()]
    assert found == sorted(path.name for path in CONFIG.glob("*.yaml"))


def test_share_folder_of_an_installation_is_found(tmp_path, monkeypatch):
    """As colcon and pip leave it: lib/python3/site-packages beside share."""
    module = tmp_path / "lib/python3/site-packages/rigid_body_sim/scene/installed.py"
    config = tmp_path / "share/rigid_body_sim/config"
    config.mkdir(parents=True)
    (config / "one.yaml").touch()
    monkeypatch.setattr(installed, "__file__", str(module))
    assert installed.installed_scenes() == [config / "one.yaml"]
