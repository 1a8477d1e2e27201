"""The profile that the programs give Fast DDS: whose it is, and that it is read."""

import os
import time
from pathlib import Path

import pytest

from rigid_body_sim.ros import middleware
from rigid_body_sim.ros.middleware import FOUND_BY_ITSELF, OTHER_WAYS, VARIABLE

WAKE_UPS = 4000  # of the loop: two seconds of it


@pytest.fixture(autouse=True)
def _no_profile(monkeypatch, tmp_path):
    for name in (VARIABLE, *OTHER_WAYS):
        monkeypatch.setenv(name, "to be put back")
        monkeypatch.delenv(name)
    monkeypatch.chdir(tmp_path)


def test_the_profile_is_ours_when_nobody_gives_one():
    middleware.use_profile()
    assert "nackSupressionDuration" in Path(os.environ[VARIABLE]).read_text(encoding="utf-8")


@pytest.mark.parametrize("name", [VARIABLE, *OTHER_WAYS])
def test_a_profile_of_the_users_stays(monkeypatch, name):
    monkeypatch.setenv(name, "mine.xml")
    middleware.use_profile()
    assert [os.environ.get(each) for each in (VARIABLE, *OTHER_WAYS) if each in os.environ] == ["mine.xml"]


@pytest.mark.parametrize("name", FOUND_BY_ITSELF)
def test_so_does_one_that_fast_dds_finds_by_itself(tmp_path, name):
    (tmp_path / name).touch()
    middleware.use_profile()
    assert VARIABLE not in os.environ


def test_an_empty_name_means_none(monkeypatch):
    monkeypatch.setenv(VARIABLE, "")
    middleware.use_profile()
    assert VARIABLE not in os.environ


def _wake_ups(process):
    """How often the event thread of Fast DDS and the loop were woken since the process began."""
    found = {"dds.ev": 0, "": 0}
    for task in Path(f"/proc/{process.pid}/task").iterdir():
        woken = int((task / "status").read_text().rpartition("\nvoluntary_ctxt_switches:")[2].split()[0])
        name = "dds.ev" if (task / "comm").read_text().startswith("dds.ev") else ""
        if name or task.name == str(process.pid):
            found[name] += woken
    return found["dds.ev"], found[""]


@pytest.fixture
def bystander(context):
    """Somebody who is sent poses and reads none of them."""
    from geometry_msgs.msg import PoseStamped
    from rclpy.node import Node

    node = Node("bystander", namespace="/middleware", context=context)
    node.create_subscription(PoseStamped, "pose", lambda _: None, 1)
    yield node
    node.destroy_node()


def _wait(condition, what, seconds=60.0):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, f"no {what} within {seconds} s"
        time.sleep(0.01)


@pytest.mark.ros
def test_with_it_the_event_thread_of_fast_dds_is_woken_less_often(run_node, bystander):
    """Measured 0.4 times for each wake-up of the loop with the profile, 3.3 times without."""
    if os.environ.get("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp") != "rmw_fastrtps_cpp":
        pytest.skip("the middleware is not Fast DDS")
    ratios = []
    for environment in ({}, {VARIABLE: ""}):
        scene = {"rate": 2000.0, "publish_rate": 0.0}
        process = run_node(scene, arguments=["-r", "__ns:=/middleware"], environment=environment)
        process.wait_ready()
        _wait(lambda: bystander.count_publishers("pose"), "publisher of pose")
        before = _wake_ups(process.popen)
        _wait(lambda p=process.popen, loop=before[1]: _wake_ups(p)[1] - loop > WAKE_UPS, "wake-ups of the loop")
        events, loop = (now - then for now, then in zip(_wake_ups(process.popen), before, strict=True))
        ratios.append(events / loop)
        process.assert_stopped_cleanly()
        _wait(lambda: not bystander.count_publishers("pose"), "end of the publisher")
    assert ratios[0] < ratios[1] / 2
