"""The comparison with Radau compares the same motion: right-hand side, Jacobian and end agree."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bench import stiff_cost
from rigid_body_sim.kernels.state import LOW
from rigid_body_sim.terms import Terms
from rigid_body_sim.values.state import flatten
from rigid_body_sim.values.wrench import Wrench

over_scenes = pytest.mark.parametrize("scene", stiff_cost.SCENES.values(), ids=stiff_cost.SCENES)


@over_scenes
def test_jacobian_given_to_radau_is_that_of_its_right_hand_side(scene):
    y = flatten(scene.state, Terms(scene.body, stiff_cost.GRAVITY).model(Wrench()))[:LOW]
    slope, exact = stiff_cost.right_hand_side(scene), stiff_cost.exact_jacobian(scene)(0.0, y)
    # Along the quaternion itself, which no motion changes, the two may differ.
    along = np.delete(np.eye(LOW), slice(3, 7), axis=0).tolist()
    w, x, v, z = y[3:7]
    for turn in ((-x, w, z, -v), (-v, -z, w, x), (-z, v, -x, w)):
        along.append([0.0, 0.0, 0.0, *turn, *(0.0,) * 6])
    for d in np.array(along):
        h = 1e-5
        difference = 8 * (slope(0, y + h * d) - slope(0, y - h * d)) - slope(0, y + 2 * h * d) + slope(0, y - 2 * h * d)
        assert_allclose(exact @ d, difference / (12 * h), rtol=1e-6, atol=1e-8 * np.abs(exact).max())


@over_scenes
def test_rosenbrock_and_radau_end_at_the_same_state(scene):
    assert_allclose(stiff_cost.rosenbrock(scene, 1e-7)(), stiff_cost.radau(scene, 1e-7)(), rtol=0, atol=1e-7)  # 1.1e-8
