"""Schedules of commands: what they hold, and the sentence for what they cannot."""

import numpy as np
import pytest

from rigid_body_sim import Wrench, WrenchSchedule

pytestmark = pytest.mark.no_numba


def test_rows_are_the_wrenches_of_their_steps():
    schedule = WrenchSchedule([0, 4, 9], force_body=(1, 2, 3), torque_world=np.arange(9.0).reshape(3, 3))
    assert len(schedule) == 3
    assert schedule.wrench(1) == Wrench(force_body=(1, 2, 3), torque_world=(3, 4, 5))
    assert repr(schedule) == "WrenchSchedule(3 commands from step 0 to 9: force_body, torque_world)"
    assert repr(WrenchSchedule([])) == "WrenchSchedule(no commands)"


def test_it_is_made_of_wrenches():
    wrenches = [Wrench(torque_body=(0.1, 0, 0)), Wrench(), Wrench(force_world=(0, 0, 9.8))]
    schedule = WrenchSchedule.of([1, 2, 3], wrenches)
    assert [schedule.wrench(row) for row in range(3)] == wrenches
    assert schedule.turns.tolist() == [wrench.turns for wrench in wrenches]


def test_arrays_that_were_given_may_change_afterwards():
    forces = np.ones((2, 3))
    schedule = WrenchSchedule([0, 1], force_body=forces)
    forces[:] = 7.0
    assert schedule.wrench(0) == Wrench(force_body=(1, 1, 1))
    with pytest.raises(ValueError, match="read-only"):
        schedule.values[0, 0] = 2.0


def test_rows_of_one_kind():
    torque = np.zeros((6, 3))
    torque[[1, 2, 5]] = 1.0
    schedule = WrenchSchedule(range(6), torque_body=torque)
    assert [schedule.same_kind_up_to(row) for row in range(6)] == [1, 3, 3, 5, 5, 6]


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"steps": [0, 5, 5]}, r"rows 1 and 2 of the schedule: step 5 follows step 5; give steps in order, each once"),
        ({"steps": [0, 5, 3]}, r"rows 1 and 2 of the schedule: step 3 follows step 5"),
        ({"steps": [-1, 5]}, r"row 0 of the schedule: step -1 is no whole number from 0"),
        ({"steps": [0, 1.5]}, r"row 1 of the schedule: step 1\.5 is no whole number"),
        ({"steps": [0, np.nan]}, r"row 1 of the schedule: step nan is no whole number"),
        ({"steps": [0, 1e300]}, r"row 1 of the schedule: step 1e\+300 is no whole number"),
        ({"steps": ["0", "1"]}, r"row 0 of the schedule: step 0 is no whole number"),
        ({"steps": 3}, r"steps of the schedule have shape \(\)"),
        ({"steps": [[0, 1]]}, r"steps of the schedule have shape \(1, 2\)"),
        (
            {"steps": [0, 1], "force_body": np.ones((3, 3))},
            r"force_body of the schedule has shape \(3, 3\); its 2 steps need shape \(2, 3\), or \(3,\)",
        ),
        ({"steps": [0, 1], "torque_body": [1.0, 2.0]}, r"torque_body of the schedule has shape \(2,\)"),
        ({"steps": [0, 1], "torque_body": ["a", "b", "c"]}, r"torque_body of the schedule holds what is no number"),
        (
            {"steps": [3, 8], "torque_world": [[0, 0, 0], [0, np.nan, 0]]},
            r"row 1 of the schedule, for step 8: .*nan.* must be finite",
        ),
        (
            {"steps": [3, 8], "force_world": [[1e308, 1e308, 0], [0, 0, 0]]},
            r"row 0 of the schedule, for step 3: .* must be finite, and so must their sum",
        ),
    ],
)
def test_what_cannot_be_held_is_refused_with_its_row(given, sentence):
    with pytest.raises(ValueError, match=sentence):
        WrenchSchedule(**given)


def test_forces_at_points_are_refused():
    with pytest.raises(ValueError, match=r"row 0 of the schedule: .* has forces at points; a schedule takes none"):
        WrenchSchedule.of([0], [Wrench(points=[((0, 0, 1), (1, 0, 0))])])


def test_what_is_no_wrench_is_refused():
    with pytest.raises(TypeError, match="row 1 of the schedule: 3 is no Wrench"):
        WrenchSchedule.of([0, 1], [Wrench(), 3])
