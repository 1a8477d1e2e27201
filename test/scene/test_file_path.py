"""Files that parameters name: found by path or in an installed package, and nowhere else."""

import os
import socket
import sys

import pytest

from rigid_body_sim import Scene
from rigid_body_sim.scene import schema
from rigid_body_sim.scene.file_path import located, url

pytestmark = pytest.mark.no_numba


@pytest.fixture
def prefixes(tmp_path, monkeypatch):
    """Two sourced prefixes: both have the package ``hull``, each its own file a.urdf, the second one b.urdf too."""
    folders = [tmp_path / "overlay", tmp_path / "underlay"]
    for folder, names in zip(folders, (("a",), ("a", "b")), strict=True):
        marker = folder / "share/ament_index/resource_index/packages/hull"
        marker.parent.mkdir(parents=True)
        marker.touch()
        share = folder / "share/hull/urdf"
        share.mkdir(parents=True)
        for name in names:
            (share / f"{name}.urdf").write_text("<robot/>", encoding="utf-8")
    monkeypatch.setenv("AMENT_PREFIX_PATH", os.pathsep.join(map(str, folders)))
    return folders


def test_path_begins_at_the_folder_unless_it_is_absolute(tmp_path):
    assert located("a/b.stl", tmp_path) == f"{tmp_path}/a/b.stl"
    assert located("../b.stl", tmp_path) == f"{tmp_path}/../b.stl"
    assert located("/a/b.stl", tmp_path) == "/a/b.stl"


def test_package_is_that_of_the_first_prefix(prefixes):
    assert located("package://hull/urdf/a.urdf") == f"{prefixes[0]}/share/hull/urdf/a.urdf"
    # As in ROS, an overlay hides the whole package below it, not file by file.
    assert located("package://hull/urdf/b.urdf", "/elsewhere") == f"{prefixes[0]}/share/hull/urdf/b.urdf"


def test_package_installed_by_pip_is_found_without_a_sourced_ros(prefixes, monkeypatch):
    monkeypatch.delenv("AMENT_PREFIX_PATH")
    monkeypatch.setattr(sys, "prefix", str(prefixes[1]))
    assert located("package://hull/urdf/b.urdf") == f"{prefixes[1]}/share/hull/urdf/b.urdf"


def test_link_inside_a_package_is_followed(prefixes, tmp_path):
    """colcon's --symlink-install makes every shared file a link into the source tree."""
    (tmp_path / "source.urdf").touch()
    (prefixes[0] / "share/hull/linked.urdf").symlink_to(tmp_path / "source.urdf")
    assert os.path.samefile(located("package://hull/linked.urdf"), tmp_path / "source.urdf")


OUT = ["hull/../../../secret", "hull/urdf/../a", "hull/./a", "hull//etc/passwd", "hull", "hull/", "", "/a", "../a", ".",
       "..", "hu ll/a", "../../etc/passwd", "hull/urdf/..", "\0/a", "hull\n/a"]  # fmt: skip


@pytest.mark.parametrize("rest", OUT)
def test_package_path_cannot_leave_its_package(prefixes, rest):
    with pytest.raises(ValueError, match=r"is no file of a package; give package://package/path, without '\.\.'"):
        located(f"package://{rest}")


def test_escaped_characters_mean_themselves(prefixes):
    assert located("package://hull/%2e%2e/a").endswith("/share/hull/%2e%2e/a")


def test_unknown_package_says_where_it_was_looked_for(prefixes):
    with pytest.raises(ValueError, match=rf"package 'none_such' is not installed in any of {prefixes[0]}, .*source"):
        located("package://none_such/a.urdf")


@pytest.mark.parametrize("name", ["http://a/b.stl", "HTTPS://a/b", "ftp://a/b", "file:///etc/passwd", "Package://a/b"])
@pytest.mark.parametrize("parameter", ["body.mesh_file", "body.urdf_file"])
def test_nothing_is_fetched(monkeypatch, parameter, name):
    def refuse(*_):
        raise AssertionError("a socket was opened")

    monkeypatch.setattr(socket, "socket", refuse)
    with pytest.raises(ValueError, match=rf"parameter {parameter} = '{name}': {name.split(':')[0]}:// is not supp"):
        Scene({parameter: name})


@pytest.mark.parametrize("parameter", ["body.mesh_file", "body.urdf_file"])
def test_pipe_and_device_are_refused_without_being_opened(tmp_path, parameter):
    """Reading them would have no end: nobody writes to the pipe, and /dev/zero is never over."""
    os.mkfifo(tmp_path / "pipe.stl")
    for name in ("pipe.stl", "/dev/zero"):
        with pytest.raises(ValueError, match=rf"{parameter} = .* is a directory, a device or a pipe; give the path of"):
            Scene({parameter: name}, tmp_path)


def test_viewers_get_an_absolute_url(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert url("a.stl") == f"file://{tmp_path}/a.stl"
    assert url("package://hull/a.stl") == "package://hull/a.stl"


def test_nobody_on_the_network_can_name_a_file():
    """A dynamic parameter may be set by whoever reaches the node."""
    assert not [p.name for p in schema.TABLE if p.dynamic and ("file" in p.name or "path" in p.name)]
    assert {p.name for p in schema.TABLE if "file" in p.name or "path" in p.name} == {
        "body.mesh_file",
        "body.urdf_file",
        "record.path",
    }
