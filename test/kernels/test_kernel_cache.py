"""Compiled kernels that are damaged, cannot be kept, or might have been put there by others."""

import logging
import os
import pickle
import resource
import subprocess
import sys
from pathlib import Path

import pytest

from rigid_body_sim.kernels import kernel_cache
from rigid_body_sim.kernels.kernel_cache import KernelCache

FOREIGN = 12345  # a user who is neither root nor whoever runs the tests
as_root = pytest.mark.skipif(os.getuid() != 0, reason="only root can give files away")


def third(x):
    return x / 3.0


def compiled(folder, why_not=""):
    """A new dispatcher, as another process would have."""
    numba = pytest.importorskip("numba")
    dispatcher = numba.njit(third)
    dispatcher._cache = KernelCache(third, folder, why_not)
    return dispatcher


@pytest.fixture
def told(caplog, monkeypatch):
    """What is said, of a process that has said nothing yet."""
    monkeypatch.setattr(KernelCache, "_told", set())
    caplog.set_level(logging.WARNING, "rigid_body_sim")
    return caplog


@pytest.fixture
def kept(tmp_path, told):
    """The file of a kernel that was compiled."""
    assert compiled(tmp_path)(1.0) == 1.0 / 3.0
    (file,) = tmp_path.iterdir()
    return file


def test_what_is_whole_is_not_compiled_again(kept, told):
    again = compiled(kept.parent)
    assert again(2.0) == 2.0 / 3.0 and told.messages == []
    assert sum(again.stats.cache_hits.values()) == 1 and not again.stats.cache_misses


def test_what_is_kept_is_run_without_loading_what_compiling_needs(tmp_path):
    pytest.importorskip("numba")
    script = """
import sys
from rigid_body_sim.kernels import compiled, vectors
compiled.ready(vectors.qmultiply, *[1.0] * 8)
print("numba.np.linalg" in sys.modules)
"""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    for expected in ("True", "False"):
        run = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True)
        assert (run.stdout.strip(), run.stderr) == (expected, "")


class Planted:
    """A pickle that runs something where it is read."""

    def __init__(self, path):
        self._path = path

    def __reduce__(self):
        return os.mkdir, (str(self._path),)


def _altered(content):
    """One bit of machine code, which numba would run."""
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :]


@pytest.mark.parametrize(
    "damage",
    [lambda content: b"", lambda content: content[:20], lambda content: content[: len(content) // 2], _altered],
    ids=["empty", "only a digest", "half", "one bit"],
)
def test_what_is_damaged_is_compiled_anew(kept, told, damage):
    whole = kept.read_bytes()
    kept.write_bytes(damage(whole))
    assert compiled(kept.parent)(1.0) == 1.0 / 3.0
    assert told.messages == [f"{kept} is damaged: compiling anew what is"]
    again = compiled(kept.parent)
    assert again(1.0) == 1.0 / 3.0 and sum(again.stats.cache_hits.values()) == 1


def test_a_pickle_without_its_digest_is_not_read(kept, tmp_path, told):
    kept.write_bytes(pickle.dumps(Planted(tmp_path / "was_run")))
    assert compiled(kept.parent)(1.0) == 1.0 / 3.0
    assert not (tmp_path / "was_run").exists() and len(told.messages) == 1


def test_what_numba_cannot_use_is_compiled_anew(kept, told):
    content = pickle.dumps(("of", "another", "version"))
    kept.write_bytes(kernel_cache._digest(content) + content)
    assert compiled(kept.parent)(1.0) == 1.0 / 3.0
    assert len(told.messages) == 1 and "cannot be used (TypeError): compiling anew" in told.messages[0]


def test_what_cannot_be_read_is_compiled_anew_and_not_kept(kept, told):
    kept.unlink()
    kept.mkdir()
    assert compiled(kept.parent)(1.0) == 1.0 / 3.0
    assert told.messages == [
        f"{kept} cannot be read (Is a directory): compiling anew",
        f"compiled kernels cannot be kept in {kept.parent} (Is a directory)",
    ]
    assert list(kept.parent.iterdir()) == [kept]


def test_a_full_disk_is_told_once_and_leaves_nothing_half_written(tmp_path, told):
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))
    try:
        results = [compiled(tmp_path)(1.0) for _ in range(2)]
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert results == [1.0 / 3.0] * 2
    assert told.messages == [f"compiled kernels cannot be kept in {tmp_path} (File too large)"]
    assert list(tmp_path.iterdir()) == []


def test_without_a_folder_nothing_is_kept_and_that_is_told(told):
    assert compiled(None, "there is none")(1.0) == 1.0 / 3.0
    assert told.messages == ["compiled kernels are not kept, each start compiles them: there is none"]


# Where ----------------------------------------------------------------------------------------------------------------


def test_folder_is_made_for_the_user_alone(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "a" / "b"))
    folder, reason = kernel_cache.choose("kernels")
    assert (folder, reason) == (tmp_path / "a" / "b" / "rigid_body_sim" / "kernels", "")
    assert {place.stat().st_mode & 0o777 for place in (folder, *list(folder.parents)[:3])} == {0o700}


def test_cache_home_comes_after_what_numba_is_told(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("NUMBA_CACHE_DIR", "/proc/none")
    assert kernel_cache.choose("kernels")[0] == tmp_path / "rigid_body_sim" / "kernels"
    monkeypatch.setenv("XDG_CACHE_HOME", "/proc/neither")
    folder, reason = kernel_cache.choose("kernels")
    assert folder is None
    assert reason.count(": No such file or directory") == 2 and reason.endswith("to a folder that only you can write")


@pytest.mark.parametrize("mode", [0o720, 0o702, 0o1702])
def test_a_folder_that_others_can_write_is_not_used(tmp_path, mode):
    (tmp_path / "shared").mkdir()
    (tmp_path / "shared").chmod(mode)
    assert kernel_cache.distrust(tmp_path / "shared") == f"{tmp_path}/shared can be written by others"


def test_nor_one_below_such_a_folder_unless_that_is_sticky(tmp_path):
    below = tmp_path / "shared" / "mine"
    below.mkdir(parents=True)
    below.chmod(0o700)
    (tmp_path / "shared").chmod(0o777)
    assert kernel_cache.distrust(below) == f"{tmp_path}/shared can be written by others"
    (tmp_path / "shared").chmod(0o1777)
    assert kernel_cache.distrust(below) == ""


def test_links_of_ones_own_are_followed_and_what_they_lead_to_is_looked_at(tmp_path):
    (tmp_path / "common").mkdir()
    (tmp_path / "common" / "real").mkdir(mode=0o700)
    (tmp_path / "link").symlink_to("common/../common/real")
    assert kernel_cache.distrust(tmp_path / "link") == ""
    (tmp_path / "common").chmod(0o777)
    assert kernel_cache.distrust(tmp_path / "link") == f"{tmp_path}/common can be written by others"
    (tmp_path / "circle").symlink_to("circle")
    with pytest.raises(OSError, match="too many links"):
        kernel_cache.distrust(tmp_path / "circle")


@as_root
def test_what_belongs_to_others_is_not_used_nor_made_through(tmp_path, monkeypatch):
    """Neither their folder, nor their link to a folder of ours: they could lead it elsewhere the next time."""
    (tmp_path / "ours").mkdir(mode=0o700)
    (tmp_path / "link").symlink_to("ours")
    (tmp_path / "theirs").mkdir(mode=0o755)
    for name in ("link", "theirs"):
        os.chown(tmp_path / name, FOREIGN, FOREIGN, follow_symlinks=False)
        assert kernel_cache.distrust(tmp_path / name) == f"{tmp_path / name} belongs to another user"
        monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / name))
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / name))
        assert kernel_cache.choose("kernels")[0] is None
    assert list((tmp_path / "ours").iterdir()) == list((tmp_path / "theirs").iterdir()) == []


def test_nothing_is_looked_for_in_the_temporary_directory(tmp_path):
    """Its names can be foreseen: with a link planted there, and no home, there is no cache."""
    (tmp_path / "planted").mkdir()
    (tmp_path / str(os.getuid())).symlink_to("planted")
    environment = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    environment |= {"TMPDIR": str(tmp_path), "HOME": "/proc/none", "XDG_CACHE_HOME": ""}
    script = "from rigid_body_sim.kernels import kernel_cache; print(kernel_cache.choose('kernels')[0])"
    shown = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=True)
    assert shown.stdout == "None\n" and list((tmp_path / "planted").iterdir()) == []


def test_a_foreseeable_relative_home_is_not_made(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(os.path, "expanduser", lambda path: path)  # a user without a home
    assert kernel_cache.choose("kernels")[0] is None and list(Path().iterdir()) == []
