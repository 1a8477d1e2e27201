"""A run is told by its outcome, and the outcomes look different."""

import numpy as np
import pytest

from rigid_body_sim.report.stability import controller, damping, outcome, plots, tether
from rigid_body_sim.report.stability.outcome import Outcome, Scale, attempt

TRUTH = np.array((1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0))


@pytest.mark.parametrize(
    ("case", "integrator", "expected"),
    [
        (damping.case(10.0, 0.01), "rk4", Outcome.ACCURATE),  # λ h = 0.1
        (damping.case(10.0, 0.01), "semi_implicit_euler", Outcome.WRONG),
        (damping.case(1e4, 0.001), "rk4", Outcome.DIVERGED),  # λ h = 10, beyond 2.79
        (damping.case(1e8, 0.001), "semi_implicit_euler", Outcome.DIVERGED),
        (damping.case(1e8, 0.001), "auto", Outcome.ACCURATE),
        (damping.case(1e8, 0.1), "dop853", Outcome.REFUSED),
        (damping.case(10.0, 0.01), "taylor", Outcome.REFUSED),
        (tether.case(1e4, 0.01, 0.0), "auto", Outcome.ACCURATE),
        (controller.case(0.9, 0.1), "semi_implicit_euler", Outcome.WRONG),
        (controller.case(0.9, 0.1), "exact", Outcome.REFUSED),
    ],
)
def test_outcome(case, integrator, expected):
    cell = attempt(case, integrator)
    assert cell["outcome"] == expected.value
    assert bool(cell["said"]) is (expected is Outcome.REFUSED) or expected is Outcome.DIVERGED
    assert (cell["error"] is None) is (expected in (Outcome.REFUSED, Outcome.DIVERGED))


def test_damping_is_stable_for_rk4_where_its_theory_says_so():
    """|1 + z + z²/2 + z³/6 + z⁴/24| ≤ 1 for real z from −2.785 on."""
    below, above = (attempt(damping.case(ratio * 1e4, 1e-4), "rk4")["outcome"] for ratio in (2.7, 2.9))
    assert (below, above) == (Outcome.ACCURATE.value, Outcome.DIVERGED.value)


def test_loop_that_is_stable_in_truth_diverges_with_semi_implicit_euler():
    """With x = ω_n T it needs 4 − 4x − x² > 0, so x < 0.83, where the true loop needs x < 1."""
    inside, outside = (np.linalg.norm(list(controller.states(loop(gain), gain, 1))[-1][10:13]) for gain in (0.8, 0.87))
    assert inside < 1e-2 < 1.0 < outside  # rad/s at the end; measured 2.2e-4 and 25


def loop(gain):
    return controller.case(gain, controller.PERIOD).simulation("semi_implicit_euler")


@pytest.mark.parametrize(
    ("index", "change", "scale", "expected"),
    [
        (0, 0.5, Scale(5.0, 1.0, 1.0, 1.0), 0.1),
        (7, 0.5, Scale(1.0, 1.0, 50.0, 1.0), 0.01),
        (11, 0.5, Scale(1.0, 1.0, 1.0, 0.5), 1.0),
    ],
)
def test_error_is_a_share_of_the_scale(index, change, scale, expected):
    state = TRUTH.copy()
    state[index] += change
    assert outcome.error(state, TRUTH, scale) == pytest.approx(expected)


def test_error_of_the_attitude_is_an_angle():
    state = TRUTH.copy()
    state[3:7] = np.cos(0.05), 0.0, np.sin(0.05), 0.0
    assert outcome.error(state, TRUTH, Scale(1.0, 0.5, 1.0, 1.0)) == pytest.approx(0.2)


def test_outcomes_differ_in_sign_and_in_lightness():
    """Also printed in grey, and with any colour vision."""
    from matplotlib.colors import to_rgb

    lightness = sorted(float(np.dot((0.2126, 0.7152, 0.0722), to_rgb(colour))) for colour, *_ in plots.LOOK.values())
    assert set(plots.LOOK) == set(Outcome)
    assert min(np.diff(lightness)) > 0.15  # measured 0.20
    assert len({marker for _, _, marker, _ in plots.LOOK.values()}) == len(Outcome)
