"""What a wrench command means, without ROS: limits keep its direction, lengths are right to the last bits."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigid_body_sim.commands import scaled_down

components = st.floats(-1.7e308, 1.7e308)


@given(st.tuples(components, components, components), st.floats(1e-300, 1e307))
def test_length_of_what_is_scaled_down_is_the_limit_to_round_off(vector, most):
    limited = scaled_down(vector, most)
    if math.hypot(*vector) <= most:
        assert limited == vector
        return
    assert math.hypot(*limited) == pytest.approx(most, rel=1e-15)  # measured 2.2e-16
    one, other = (np.array([c / max(map(abs, v)) for c in v]) for v in (vector, limited))
    assert one == pytest.approx(other, rel=1e-15, abs=1e-15)  # measured 1.4e-16
