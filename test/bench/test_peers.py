"""Peers solve the same problems: where installed, each method comes closer to the reference with a finer knob.

Those for many bodies bring each of them to its reference.
"""

import importlib
import math

import pytest

from rigid_body_sim.report import batch, method, peers
from rigid_body_sim.report.problems import problem

GOOD = 1e-4  # reached by some method of every peer
CLOSE = 0.004  # reached by every method, those of order 1 too, where the way is short; measured 0.0024 at most
SHORT_WAY = ("commands", "damped_vehicle")


def installed(peer):
    try:
        return peers.methods(peer)
    except ImportError as reason:
        pytest.skip(f"{peer} is not installed: {reason}")


@pytest.mark.parametrize("name", ["body_wrench", "symmetric_top", "commands", "damped_vehicle"])
@pytest.mark.parametrize("peer", peers.KNOWN)
def test_peer_comes_close_with_a_fine_knob(peer, name):
    """So the wrench is understood as it is meant: a wrong one leaves an error that does not fall."""
    best = {
        one.name: min(errors_until(one, problem(name), GOOD))
        for one in installed(peer)
        if not one.refusal(problem(name))
    }
    if best:
        assert min(best.values()) < GOOD, best
    if name in SHORT_WAY:
        assert max(best.values(), default=0.0) < CLOSE, best


def errors_until(one, problem, enough):
    """The errors for finer and finer knobs up to the first that is small enough."""
    found = []
    for value in one.values(problem, False):
        run = one.start(problem, value)
        run.restart()
        try:
            error = method.errors(problem, run.advance())["error"]
        except ArithmeticError:  # it diverged, and said so
            error = None
        found.append(math.inf if error is None else error)
        if found[-1] < enough:
            break
    return found


@pytest.mark.parametrize("n", [1, 21])
@pytest.mark.parametrize("peer", ["jax", "heyoka", "mujoco"])
def test_many_bodies_come_to_their_ends(peer, n, monkeypatch):
    """Each of them, also those beyond the last whole batch or in the larger part, in one call, in two, and again."""
    installed(peer)
    if peer == "jax":
        monkeypatch.setattr("bench.peers.jax_peer.WORTH_A_THREAD", 4)
    given = batch.batch(n, 1.0, 1)
    for one in peers.batch_methods(peer):
        run = one.start(given)
        for calls in ((50,), (20, 30)):
            run.restart()
            for steps in calls:
                run.advance(steps)
            error = given.error(range(n), run.ends(range(n)), 50)
            assert error < 2e-12, one.name  # measured 5.1e-13, at order 4


@pytest.mark.parametrize("peer", peers.KNOWN)
def test_every_peer_says_what_to_install_and_is_in_the_extra(peer, pytestconfig):
    adapter = importlib.import_module(f"bench.peers.{peer}_peer")
    assert f'"{adapter.PACKAGE}"' in (pytestconfig.rootpath / "setup.py").read_text(encoding="utf-8")
