"""What a recording shows at a time, and what a level of an actuator is."""

import numpy as np
import pytest

from rigid_body_sim.effects.actuators import Actuator
from rigid_body_sim.view.moment import Levels, Recording, Wrenches, level, span

MOTION = Recording(np.array([1.0, 2.0, 4.0]), np.arange(9.0).reshape(3, 3), np.tile([1.0, 0.0, 0.0, 0.0], (3, 1)))
WRENCHES = Wrenches(np.array([2.5]), np.array([[3.0, 0.0, 0.0]]), np.array([[0.0, 0.0, 4.0]]))


@pytest.mark.parametrize(("time", "shown"), [(0.0, 1.0), (1.0, 1.0), (1.99, 1.0), (2.0, 2.0), (3.9, 2.0), (9.0, 4.0)])
def test_the_latest_state_is_shown_and_nothing_between_two(time, shown):
    moment = MOTION.at(time)
    assert moment.time == shown
    assert np.array_equal(moment.position, MOTION.position[MOTION.time == shown][0])


def test_a_command_shows_from_its_time_on():
    recording = MOTION._replace(wrenches=WRENCHES, levels=Levels(np.array([1.5]), np.array([[0.5, -1.0]])))
    assert not any(recording.at(2.4).force)
    assert recording.at(2.5).force[0] == 3.0 and recording.at(4.0).torque[2] == 4.0
    assert len(recording.at(1.0).levels) == 0 and list(recording.at(1.5).levels) == [0.5, -1.0]


def test_span_is_that_of_all():
    assert span({"a": MOTION, "b": MOTION._replace(time=MOTION.time + 3.0)}) == (1.0, 7.0)


@pytest.mark.parametrize(
    ("kind", "value", "share"),
    [("thruster", -5.0, -0.5), ("thruster", 20.0, 1.0), ("rotor", 5.0, 0.25), ("rotor", 10.0, 1.0)],
)
def test_level_is_the_share_of_the_most(kind, value, share):
    least, coefficient = (-10.0, 0.0) if kind == "thruster" else (0.0, 1e-5)
    assert level(Actuator("one", kind, least, 10.0, thrust_coefficient=coefficient), value) == share
