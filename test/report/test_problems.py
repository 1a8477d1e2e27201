"""The report's problems, their reference solutions, and how errors are taken from them."""

import dataclasses
import math

import numpy as np
import pytest

from bench.reference import make_report
from bench.reference.make_reference import as_strings
from rigid_body_sim.report import method, ours
from rigid_body_sim.report.problems import TITLES, End, errors, problem
from rigid_body_sim.report.reference import load


def true_end(name):
    """The reference end state, rounded to doubles."""
    end = problem(name).end
    return End(*(tuple(map(float, end[part.name])) for part in dataclasses.fields(End)))


@pytest.mark.parametrize("name", TITLES)
def test_the_reference_has_no_error(name):
    assert max(errors(problem(name), true_end(name)).values()) < 4e-16  # measured 2.3e-16


def test_the_file_holds_the_problems_of_the_script():
    stored = load.stored(load.REPORT)["problems"]
    assert set(stored) == set(TITLES) == set(make_report.PROBLEMS)
    for name, data in make_report.PROBLEMS.items():
        expected = as_strings({key: value for key, value in data.items() if key != "times"})
        assert {key: stored[name][key] for key in expected} == expected


@pytest.mark.parametrize("name", TITLES)
def test_two_solutions_agree_and_the_balances_close(name):
    stored = load.stored(load.REPORT)["problems"][name]
    assert float(stored["agreement"]) < 1e-32  # measured 1.7e-33 (fast_spin, in 500 rad/s)
    assert max(map(float, stored["balance"].values())) < 1e-50


def test_free_fall_is_a_parabola():
    fall = problem("free_fall")
    t, g = fall.duration, np.array(fall.gravity)
    assert fall.end["position"] == pytest.approx(fall.initial.velocity * t + g * t * t / 2, rel=1e-15)
    assert fall.end["velocity"] == pytest.approx(fall.initial.velocity + g * t, rel=1e-15)


def error_of(integrator, name, pick):
    """Error of an integrator at the coarsest (0) or finest (-1) value of its knob."""
    candidate = ours.method(integrator)
    run = candidate.start(problem(name), [*candidate.values(problem(name), False)][pick])
    run.restart()
    return errors(problem(name), run.advance())["error"]


@pytest.mark.parametrize("name", TITLES)
def test_auto_agrees_with_the_reference(name):
    """The reference knows nothing of the simulator, so this checks both."""
    # Measured 3e-11 with drag, whose third derivative jumps where a velocity changes sign, 2.0e-12 after 1000 rad of a
    # needle, and 5e-13 at most elsewhere.
    assert error_of("auto", name, -1) < {"damped_vehicle": 1e-10, "fast_spin": 5e-12}.get(name, 2e-12)


def test_the_implicit_method_agrees_with_the_reference_of_the_damped_vehicle():
    assert error_of("rosenbrock", "damped_vehicle", -1) < 1e-13  # measured 1e-14


def test_one_step_of_many_turns_is_as_exact_as_many_steps():
    """The sub-steps of 400 rad add up to the step; when their lengths were rounded, the error was 1.2e-12."""
    assert error_of("taylor", "symmetric_top", 0) < 5e-13  # measured 1.6e-13


@pytest.mark.parametrize("angle", [1e-12, 1e-3, 2.0])
def test_a_turned_attitude_has_the_error_of_the_angle(angle):
    end = true_end("free_fall")
    turned = dataclasses.replace(end, orientation=(math.cos(angle / 2), 0.0, math.sin(angle / 2), 0.0))
    assert errors(problem("free_fall"), turned)["attitude"] == pytest.approx(angle, rel=1e-12)
    opposite = dataclasses.replace(turned, orientation=tuple(-7.0 * c for c in turned.orientation))
    assert errors(problem("free_fall"), opposite)["attitude"] == pytest.approx(angle, rel=1e-12)


def test_error_is_the_worse_of_attitude_and_position_relative_to_the_way():
    end = true_end("free_fall")
    way = float(np.linalg.norm(problem("free_fall").end["position"].astype(float)))
    x, y, z = end.position
    found = errors(problem("free_fall"), dataclasses.replace(end, position=(x + 1e-3, y, z)))
    assert found["error"] == found["position"] == pytest.approx(1e-3 / way, rel=1e-9)
    faster = dataclasses.replace(end, velocity=tuple(1.01 * v for v in end.velocity))
    found = errors(problem("free_fall"), faster)
    assert found["momentum"] == pytest.approx(0.01, rel=1e-9)
    assert found["energy"] == pytest.approx(0.0201, rel=1e-9)


def test_an_end_that_is_not_finite_has_no_error():
    end = dataclasses.replace(true_end("tumble"), angular_velocity=(math.nan,) * 3, orientation=(math.inf,) * 4)
    assert errors(problem("tumble"), end)["error"] is None


def test_an_unknown_problem_is_refused_with_those_there_are():
    with pytest.raises(ValueError, match=r"'top' is not known; choose one of tumble, symmetric_top"):
        problem("top")


@pytest.mark.parametrize("name", TITLES)
def test_steps_share_the_time_a_command_is_held(name):
    one = problem(name)
    for h in method.step_sizes(one, 1e-6, quick=False):
        steps = method.steps_held(one, h)
        assert steps * h == pytest.approx(one.hold, rel=1e-15) and steps >= 1


@pytest.mark.parametrize("name", TITLES)
def test_auto_reaches_1e_12(name):
    """Measured 4e-17 to 9e-14, with drag 5e-14."""
    measured = method.measure(ours.method("auto"), problem(name), quick=False)
    assert min(point["error"] for point in measured["points"]) < 1e-12
