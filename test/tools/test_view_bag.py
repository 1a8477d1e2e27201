"""What rigid_body_view shows of a bag."""

import numpy as np
import pytest

from rigid_body_sim import Scene, Simulation, WrenchSchedule
from rigid_body_sim.bags.rosbags_support import BagError
from rigid_body_sim.tools.view_bag import shown
from rigid_body_sim.values import rotation

pytest.importorskip("rosbags")
pytest.importorskip("mcap")

SCENE = {"rate": 100.0, "body.center_of_mass": [0.0, 0.0, 0.1], "initial.angular_velocity": [0.0, 0.0, 1.0]}
PUSH = WrenchSchedule([50, 100], force_world=[[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])


@pytest.fixture
def run():
    simulation = Simulation.from_scene(Scene(SCENE))
    return simulation.run(2.0, commands=PUSH)


def test_the_motion_and_the_commands_of_a_bag_are_shown(tmp_path, run):
    run.to_bag(tmp_path / "bag", namespace="/red")
    recordings, looks = shown(tmp_path / "bag", None, ())
    assert list(recordings) == list(looks) == ["red"]
    red = recordings["red"]
    assert np.array_equal(red.position, run.position) and np.array_equal(red.orientation, run.orientation)
    assert np.allclose(red.time, run.time, rtol=0.0, atol=1e-9)  # stamps are whole nanoseconds
    assert not any(red.at(0.49).force)
    pushed = red.at(0.75)
    force = rotation.rotate_back(red.at(0.5).orientation, (1.0, 0.0, 0.0))
    assert np.allclose(pushed.force, force, rtol=0.0, atol=1e-12)  # measured 2e-16
    assert np.allclose(pushed.torque, np.cross((0.0, 0.0, 0.0), force))  # a bag without a scene: the origin's
    assert not any(red.at(1.5).force)


def test_bodies_that_are_not_there_are_refused(tmp_path, run):
    run.to_bag(tmp_path / "bag", namespace="/red")
    with pytest.raises(BagError, match="has no poses of blue; it has those of red"):
        shown(tmp_path / "bag", None, ("blue",))


def test_the_run_itself_shows_its_commands(run):
    pytest.importorskip("viser")
    player = run.view(Scene(SCENE))
    try:
        moment = player._recordings["body"].at(0.75)
        force = rotation.rotate_back(run.orientation[50], (1.0, 0.0, 0.0))
        assert np.allclose(moment.force, force, rtol=0.0, atol=1e-12)  # measured 2e-16
        assert np.allclose(moment.torque, np.cross((0.0, 0.0, 0.1), force), rtol=0.0, atol=1e-12)
    finally:
        player.close()
