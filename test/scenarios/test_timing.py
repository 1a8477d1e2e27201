"""At which step a stamp belongs, also where neither it nor that of step 0 can be exact."""

import numpy as np
import pytest

from rigid_body_sim.rate import Rate
from rigid_body_sim.scenarios import timing

pytestmark = pytest.mark.no_numba


@pytest.mark.parametrize("rate", [0.7, 30.0, 300.0, 333.3, 1000.0, 7e5, 1e6])
@pytest.mark.parametrize("first", [0, 1, 2, 50, 12_345, 10**9 + 7])
def test_stamp_of_a_step_is_of_that_step(rate, first):
    """Counted from the stamp of another one, as of a bag that begins late: both are rounded to nanoseconds."""
    steps = np.concatenate((np.arange(1000), 10 ** np.arange(4, 9)))
    steps = steps[(first + steps) / rate < 2**31]
    stamps = np.array([Rate(rate).nanoseconds(first + step) for step in steps.tolist()], np.int64)
    since = stamps - Rate(rate).nanoseconds(first)
    np.testing.assert_array_equal(timing.steps_at(since, rate), steps)
    np.testing.assert_array_equal(timing.nearest_steps(since, rate), steps)
    between = since[1:] - int(0.5e9 / rate)
    np.testing.assert_array_equal(timing.steps_at(between, rate), steps[1:] - 1)
