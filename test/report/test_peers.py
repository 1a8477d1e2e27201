"""Peers are found in a checkout and in other distributions, and the report says which, and why the others are not."""

import sys

import pytest

from rigid_body_sim.report import main, peers
from rigid_body_sim.report.error_section import ErrorSection
from rigid_body_sim.report.machine import facts
from rigid_body_sim.report.section import Settings

ADAPTER = """
from rigid_body_sim.report import ours
MODULE, PACKAGE = "{module}", "gazebo-sim"
def methods():
    import {module}
    return [ours.method("rk4")]
"""


@pytest.fixture(autouse=True)
def looked_for_anew(monkeypatch):
    """What was found before is forgotten, before a test and after it."""
    peers._modules.cache_clear()
    yield
    monkeypatch.undo()
    peers._modules.cache_clear()


@pytest.fixture
def no_checkout(monkeypatch, tmp_path):
    """As where the package was installed from a wheel."""
    monkeypatch.setattr(peers, "CHECKOUT", tmp_path)


@pytest.fixture
def distribution(monkeypatch, tmp_path):
    """A function: install a distribution with the adapter ``gazebo``, of this text."""

    def install(text):
        about = tmp_path / "rigid_body_gazebo-1.0.dist-info"
        about.mkdir()
        (about / "METADATA").write_text("Metadata-Version: 2.1\nName: rigid_body_gazebo\nVersion: 1.0\n")
        (about / "entry_points.txt").write_text(f"[{peers.GROUP}]\ngazebo = gazebo_adapter\n")
        (tmp_path / "gazebo_adapter.py").write_text(text)
        monkeypatch.syspath_prepend(tmp_path)
        monkeypatch.delitem(sys.modules, "gazebo_adapter", raising=False)

    return install


def measured(peer):
    """What the section ``error`` finds out about a peer on one problem, in a quick report."""
    wanted = ErrorSection().measurements(Settings(True, problems=("body_wrench",), integrators=(), peers=(peer,)))
    return [one.run() for one in wanted]


def test_a_checkout_has_adapters_of_all_that_are_known():
    assert peers.names()[: len(peers.KNOWN)] == peers.KNOWN
    for peer in peers.KNOWN:
        adapter = peers._adapter(peer)
        assert adapter.__name__ == f"bench.peers.{peer}_peer" and adapter.MODULE and adapter.PACKAGE


def test_what_is_not_installed_is_told_with_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    monkeypatch.setitem(sys.modules, "pinocchio", None)
    said = peers.told()
    assert "mujoco (pip install mujoco)" in said and "pinocchio (pip install pin)" in said
    with pytest.raises(ImportError, match=r"mujoco.*; pip install mujoco"):
        peers.methods("mujoco")
    (result,) = measured("mujoco")
    assert result["missing"].endswith("; pip install mujoco")


def test_what_is_installed_is_found():
    pytest.importorskip("scipy")
    found, _, _ = peers.told().partition(";")
    assert found.startswith("found: ") and "scipy" in found
    assert [one.name for one in peers.methods("scipy")] == ["SciPy DOP853", "SciPy LSODA", "SciPy Radau"]


def test_without_a_checkout_it_is_said_where_the_adapters_are(no_checkout):
    every = ", ".join(peers.KNOWN)
    assert peers.told() == f"found: none; not found: {every} ({peers.ELSEWHERE})"
    for peer in peers.KNOWN:
        with pytest.raises(ImportError, match="adapter in bench/peers of the repository"):
            peers.methods(peer)
    assert measured("scipy") == [{"missing": peers.ELSEWHERE}]


def test_the_adapter_of_another_distribution_is_found(no_checkout, distribution):
    distribution(ADAPTER.format(module="math"))
    assert peers.names() == (*peers.KNOWN, "gazebo")
    assert peers.told().startswith("found: gazebo; not found: jax, ")
    (result,) = measured("gazebo")
    assert len(result["methods"]["rk4"]["points"]) > 2


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (ADAPTER.format(module="no_such_simulator"), "gazebo (pip install gazebo-sim)"),
        ("import no_such_module", "gazebo (No module named 'no_such_module')"),
        ("methods = list", "gazebo (module 'gazebo_adapter' has no attribute 'MODULE')"),
        ("raise RuntimeError", "gazebo (RuntimeError)"),
    ],
)
def test_an_adapter_that_does_not_work_is_told_and_ends_nothing(distribution, text, said):
    distribution(text)
    assert said in peers.told()


def test_a_peer_may_have_methods_for_many_bodies(distribution):
    distribution(ADAPTER.format(module="math") + "def batch_methods():\n    return ours.batch_methods()[:1]\n")
    assert peers.batch_methods("scipy") == []  # whether it is installed or not
    assert [one.name for one in peers.batch_methods("gazebo")] == ["Ensemble"]


def test_who_is_missing_for_many_bodies_is_told_with_what_to_install(monkeypatch):
    for peer in ("jax", "heyoka", "mujoco"):
        monkeypatch.setitem(sys.modules, peer, None)
        with pytest.raises(ImportError, match=f"{peer}.*; pip install {peer}"):
            peers.batch_methods(peer)


def test_help_and_page_tell_which_are_there(capsys):
    with pytest.raises(SystemExit):
        main.main(["--help"])
    assert f"Peers {peers.told()}" in " ".join(capsys.readouterr().out.split())
    assert facts([], 1)["peers"] == peers.told()


def test_unknown_peer_is_refused_with_those_there_are():
    with pytest.raises(ValueError, match="'gazebo' is not known; choose one of jax, diffrax, heyoka"):
        peers.methods("gazebo")
    with pytest.raises(ValueError, match="'gazebo' is not known; choose one of jax, diffrax, heyoka"):
        measured("gazebo")
