"""The sensors that scenes of the package have to switch on."""

from pathlib import Path

import pytest
from numpy.testing import assert_allclose

from rigid_body_sim import Simulation, load_scene

pytestmark = pytest.mark.no_numba

QUADROTOR = Path(__file__).parents[2] / "config" / "quadrotor.yaml"


def test_the_imu_of_the_quadrotor_shows_its_weight_once_it_is_switched_on(tmp_path):
    text = QUADROTOR.read_text(encoding="utf-8")
    before, _, rest = text.partition("    # sensors:\n")
    commented, _, after = rest.partition("\n\n")
    lines = [line.replace("    # ", "    ", 1) for line in commented.splitlines()]
    scene = tmp_path / "quadrotor.yaml"
    scene.write_text("\n".join((before + "    sensors:", *lines, "", after)), encoding="utf-8")
    (imu,) = load_scene(scene).sensors()
    assert (imu.name, imu.rate, imu.gyroscope.range) == ("imu", 1000.0, 34.9066)
    shown = Simulation.from_scene(load_scene(scene)).sense("imu")
    offset = (*imu.gyroscope.bias, *imu.accelerometer.bias)
    assert_allclose(shown - offset, (0.0, 0.0, 0.0, 0.0, 0.0, 9.80665), rtol=0, atol=0.1)  # measured: 0.03
    assert load_scene(QUADROTOR).sensors() == ()
