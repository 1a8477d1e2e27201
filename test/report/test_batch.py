"""Many bodies at once: references of each, ways of this package that agree, and what is said of ways that do not."""

import math
import sys

import mpmath
import numpy as np
import pytest

from bench.reference import make_report
from bench.reference.make_reference import solve
from rigid_body_sim.report import batch, ours
from rigid_body_sim.report.batch import BatchMethod
from rigid_body_sim.report.busy import Busy
from rigid_body_sim.report.method import OURS
from rigid_body_sim.report.problems import End

ROUND_OFF = 2e-15  # of ends beside the references; measured 1.6e-16


def run_of(method, given, steps):
    run = method.start(given)
    run.restart()
    run.advance(steps)
    return run


@pytest.mark.filterwarnings("ignore:Descending:DeprecationWarning")  # of mpmath, about its own order of coefficients
@pytest.mark.parametrize("spin", [0.1, 10.0])
def test_the_reference_of_a_body_is_true_to_round_off(spin):
    """Against 30 digits from another formulation, after 3 s."""
    given = batch.batch(2, spin, 1)
    data = dict(make_report.PROBLEMS["body_wrench"])
    initial = dict(data["initial"], angular_velocity=tuple(given.spins[1].tolist()))
    with mpmath.workdps(30):
        samples, _ = solve({**data, "initial": initial, "times": ("3",)}, 30, 30, until=3)
    names = ("position", "orientation", "velocity", "angular_velocity")
    true = End(*([float(x) for x in samples["3"][name]] for name in names))
    assert given.error([1], [true], 3000) < 3e-14  # measured 1.5e-16 and 5.8e-15, in 30 rad


def test_bodies_differ_by_their_spins_alone_and_follow_from_the_seed():
    one, more, other = (batch.batch(n, 0.1, seed).starts for n, seed in ((3, 1), (5, 1), (3, 2)))
    assert (one == more[:3]).all() and (one[:, 10:] != other[:, 10:]).all()
    assert (more[:, :10] == more[0, :10]).all() and len(np.unique(more[:, 10:])) == 15


@pytest.mark.parametrize(("n", "which"), [(1, [0]), (5, [0, 1, 2, 3, 4]), (71, [0, 10, 20, 30, 40, 50, 60, 70])])
def test_the_bodies_compared_are_few_and_from_everywhere(n, which):
    assert batch.batch(n, 0.1, 1).compared == which


@pytest.mark.parametrize("method", ours.batch_methods(), ids=lambda method: method.name)
def test_our_ways_lead_to_the_references(method):
    given = batch.batch(11, 1.0, 1)
    run = run_of(method, given, 60)
    run.advance(40)
    assert given.error(given.compared, run.ends(given.compared), 100) < ROUND_OFF
    run.restart()
    run.advance(100)
    assert given.error(range(11), run.ends(range(11)), 100) < ROUND_OFF


def test_our_ways_are_the_same_to_the_bit():
    given = batch.batch(11, 1.0, 1)
    runs = [run_of(method, given, 30) for method in ours.batch_methods()]
    ends = [np.array([np.hstack(tuple(vars(end).values())) for end in run.ends(range(11))]) for run in runs]
    assert all((one == ends[0]).all() for one in ends)


class _Odd:
    """Bodies that stay where they began, or are nowhere."""

    def __init__(self, given, value=0.0):
        self._starts, self._value = given.starts, value

    def restart(self):
        pass

    def advance(self, steps):
        pass

    def ends(self, which):
        return [End(*np.split(self._starts[i] + self._value, (3, 7, 10))) for i in which]


def _refuse(given):
    raise ValueError("not today")


ODD = [
    BatchMethod("still", OURS, _Odd, threads=1),
    BatchMethod("nowhere", OURS, lambda given: _Odd(given, math.nan)),
    BatchMethod("refusing", OURS, _refuse),
    BatchMethod("too many", OURS, _refuse, largest=4),
]


def test_a_way_that_does_not_move_bodies_is_told_by_its_error(monkeypatch):
    monkeypatch.setattr(batch, "LONG_ENOUGH", 1e-9)
    given = batch.batch(5, 1.0, 1)
    found = batch.measure([*ODD, *ours.batch_methods()], given, True)
    assert list(found["methods"]) == ["still", ours.ENSEMBLE, ours.ALONE, ours.LOOP]
    still, ensemble = found["methods"]["still"], found["methods"][ours.ENSEMBLE]
    assert 0.5 < still["error"] < 2.0  # the whole way
    assert ensemble["error"] < ROUND_OFF
    assert {len(one[what]) for one in found["methods"].values() for what in ("seconds", "cpu")} == {batch.QUICK_ROUNDS}
    assert found["refused"] == {
        "nowhere": "ArithmeticError: the states after a call are not finite",
        "refusing": "ValueError: not today",
    }
    assert (still["threads"], still["steps"]) == (1, batch.STEPS)


def test_errors_of_all_after_many_steps():
    found = batch.errors_after([*ODD[:3], *ours.batch_methods()], batch.batch(5, 1.0, 1), 200)
    assert found["errors"].pop("nowhere") is None and found["errors"].pop("still") > 0.5
    assert found["errors"].keys() == {ours.ENSEMBLE, ours.ALONE, ours.LOOP}
    assert max(found["errors"].values()) < ROUND_OFF
    assert found["refused"] == {"refusing": "ValueError: not today"}


def test_slow_methods_do_fewer_steps_in_a_call():
    slow = BatchMethod("slow", OURS, _Odd, most=5000)
    assert [slow.steps(n, False) for n in (1, 50, 100, 10_000)] == [100, 100, 50, 1]
    assert [slow.steps(n, True) for n in (1, 50, 100, 10_000)] == [100, 10, 5, 1]


def test_speeds_and_their_ratio_are_medians_of_rounds():
    one, other = {"steps": 100, "seconds": [1.0, 4.0, 2.0]}, {"steps": 50, "seconds": [2.0, 2.0, 3.0]}
    assert batch.speed(one, 10) == 500.0
    assert batch.times(one, other) == 3.0  # of 4, 1 and 3


def test_what_others_do_is_measured_where_it_can_be(monkeypatch):
    others = Busy().others()
    assert others is None or others >= 0.0
    monkeypatch.setattr(sys, "platform", "darwin")
    assert Busy().others() is None
