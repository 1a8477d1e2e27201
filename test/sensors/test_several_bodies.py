"""Sensors of several bodies: the same for all, with noise of each body's own."""

import pytest
from numpy.testing import assert_array_equal

from rigid_body_sim import Simulation
from rigid_body_sim.scene.fleet import FleetScene

pytestmark = pytest.mark.no_numba

GIVEN = {
    "bodies": ["red", "blue"],
    "sensors.imu.type": "imu",
    "sensors.imu.seed": 5,
    "sensors.imu.gyroscope.noise_density": 0.1,
}


def shown(scene, name):
    return Simulation.from_scene(scene.scenes[name]).sense("imu")


def test_each_body_has_noise_of_its_own_unless_it_is_given_a_seed():
    scene = FleetScene(GIVEN)
    assert [one["sensors.imu.seed"] for one in scene.scenes.values()] == [5, 6]
    assert (shown(scene, "red") != shown(scene, "blue")).any()
    alike = FleetScene({**GIVEN, "blue.sensors.imu.seed": 5})
    assert_array_equal(shown(alike, "red"), shown(alike, "blue"))


def test_a_bad_seed_of_all_is_refused_by_a_sentence():
    with pytest.raises(ValueError, match=r"parameter sensors\.imu\.seed = 'x': is not of type integer"):
        FleetScene({**GIVEN, "sensors.imu.seed": "x"})
