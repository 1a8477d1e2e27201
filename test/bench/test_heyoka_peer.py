"""heyoka's equations, where it is installed: each form of them leads to the reference, and as far as round-off."""

import pytest

from rigid_body_sim.report.problems import TITLES, errors, problem

pytest.importorskip("heyoka")
from bench.peers import heyoka_peer
from bench.peers.heyoka_equations import Equations

SENSITIVE = {"tumble": 1e-10, "fast_spin": 1e-11}  # measured 1.3e-11, 7e-13
ROUND_OFF = 3e-13  # of the others; measured 6e-14


def error(name, rtol, *bodies, **options):
    run = heyoka_peer.Run(problem(name), rtol, *bodies, **options)
    run.restart()
    return errors(problem(name), run.advance())


@pytest.mark.parametrize("name", TITLES)
def test_the_error_falls_with_the_tolerance_down_to_round_off(name):
    coarse, fine = (error(name, rtol) for rtol in (1e-5, heyoka_peer.RTOLS[-1]))
    bound = SENSITIVE.get(name, ROUND_OFF)
    assert max(fine.values()) < bound
    assert coarse["error"] > fine["error"] or coarse["error"] < bound  # of free fall, and between quick commands
    assert coarse["error"] < 1e-2


@pytest.mark.parametrize("name", ["commands", "damped_vehicle"])
def test_a_second_run_is_as_the_first_also_in_a_batch(name):
    """Signs, cooldowns, time and parameters begin anew; bodies of a batch are equal, and as one alone."""
    alone = error(name, 1e-9)["error"]
    run = heyoka_peer.Run(problem(name), 1e-9, 8)
    for _ in range(2):
        run.restart()
        assert errors(problem(name), run.advance())["error"] == pytest.approx(alone, rel=0.1, abs=1e-13)
        assert (run.states == run.states[0]).all()
    assert run.counts()["steps"] >= len(problem(name).wrenches)


def test_what_is_known_in_closed_form_is_no_state():
    states = {name: len(Equations(problem(name)).start) for name in TITLES}
    assert states == {
        "tumble": 6,  # ω, one axis
        "symmetric_top": 8,  # two of ω, two axes
        "asymmetric_top": 9,
        "body_wrench": 15,  # and the way
        "commands": 15,
        "fast_spin": 9,
        "free_fall": 6,  # the way alone
        "damped_vehicle": 15,
    }


def test_options_reach_it():
    run = heyoka_peer.Run(problem("tumble"), 1e-9, high_accuracy=True)
    assert run.integrator.high_accuracy and run.integrator.tol == 1e-9 and run.compile_seconds > 0.0
