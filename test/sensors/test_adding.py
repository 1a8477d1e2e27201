"""docs/how-to/adding_a_sensor.md: one file and one line, added to a copy of the package, keep the contract."""

import pytest

from ..page_copy import copy_with, passed, run

TURNING = """
from rigid_body_sim import Body, Scene, Simulation

scene = Scene({"sensors.air.type": "airspeed", "sensors.air.position": [0.0, -0.5, 0.0],
               "initial.linear_velocity": [3.0, 0.0, 0.0], "initial.angular_velocity": [0.0, 0.0, 2.0]})
print(*Simulation.from_scene(scene).sense("air"))
"""


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """A copy of package and tests with the file and the line of the page."""
    folder = tmp_path_factory.mktemp("copy")
    entries = ("import barometer,", "import airspeed, barometer,"), ("pose.TYPE)", "pose.TYPE, airspeed.TYPE)")
    copy_with(folder, "adding_a_sensor.md", "rigid_body_sim/sensors/airspeed.py", entries)
    return folder


def test_sensor_of_the_page_keeps_the_contract(copy):
    assert passed(copy, "test/sensors/test_contract.py", "airspeed") >= 8


def test_sensor_of_the_page_measures_where_it_is(copy):
    """3 m/s forwards, and half a metre to the right of an axis that turns by 2 rad/s."""
    done = run(copy, "-c", TURNING)
    assert done.stdout == "4.0\n", done.stderr
