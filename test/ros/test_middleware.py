"""The profile that the programs give Fast DDS: whose it is, and that it is read."""

import os
import time
from pathlib import Path
from xml.etree import ElementTree

import pytest

from rigid_body_sim.ros import middleware
from rigid_body_sim.ros.middleware import FOUND_BY_ITSELF, PROFILES, VARIABLES
from rigid_body_sim.scene.installed import installed

BODIES = ["one", "two", "three", "four"]
WAKE_UPS = 4000  # of the loop: two seconds of it
LIBRARIES = """7f0e1000-7f0e2000 r-xp 00000000 08:01 1234 /opt/ros/lib/librmw_fastrtps_cpp.so
7f0e3000-7f0e4000 r-xp 00000000 08:01 1234 /opt/ros/lib/{library}.3.2.2
"""


@pytest.fixture(autouse=True)
def _no_profile(monkeypatch, tmp_path):
    for name in VARIABLES:
        monkeypatch.setenv(name, "to be put back")
        monkeypatch.delenv(name)
    monkeypatch.chdir(tmp_path)


@pytest.fixture(params=PROFILES)
def loaded(request):
    """What /proc says of a process that has loaded one Fast DDS or the other."""
    return LIBRARIES.format(library=request.param)


def named():
    """The profiles that the environment names, by variable."""
    return {name: os.environ[name] for name in VARIABLES if name in os.environ}


@pytest.mark.parametrize(
    ("library", "variable", "word"),
    [
        ("libfastrtps.so", "FASTRTPS_DEFAULT_PROFILES_FILE", "nackSupressionDuration"),
        ("libfastdds.so", "FASTDDS_DEFAULT_PROFILES_FILE", "nack_supression_duration"),
    ],
)
def test_the_profile_is_ours_in_the_words_of_the_fast_dds_that_is_loaded(library, variable, word):
    middleware.use_profile(LIBRARIES.format(library=library))
    [(name, file)] = named().items()
    assert name == variable and f"<{word}>" in Path(file).read_text(encoding="utf-8")


@pytest.mark.parametrize("which", [0, 1], ids=["few quick writers", "many slow writers"])
def test_both_profiles_say_the_same(which):
    elements = [
        [
            (element.tag.replace("_", "").lower(), element.attrib, (element.text or "").strip())
            for element in ElementTree.parse(installed(files[which])).iter()
        ]
        for _, *files in PROFILES.values()
    ]
    assert elements[0] == elements[1]


def test_many_slow_writers_pause_for_longer(loaded):
    middleware.use_profile(loaded)
    few = Path(*named().values()).read_text()
    middleware.use_profile(loaded, many=True)  # the first is given by then, and stays
    assert Path(*named().values()).read_text() == few
    os.environ.pop(*named())
    middleware.use_profile(loaded, many=True)
    assert "<nanosec>50000000<" in Path(*named().values()).read_text() and "<nanosec>2000000<" in few


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({}, False),
        ({"bodies": ["red", "blue"]}, True),
        ({"bodies.count": 50, "publish_rate": 20.0}, True),
        ({"bodies.count": 50, "publish_rate": 0.0}, False),
        ({"bodies.count": 50, "publish_rate": 200.0}, False),
        ({"bodies.count": 50, "publish_rate": 200.0, "real_time_factor": 0.5}, True),
        ({"bodies.count": 50, "real_time_factor": 0.0}, False),
        ({"bodies.count": 50, "lockstep": True}, False),
        ({"bodies.count": 50, "sensors.imu.type": "imu"}, False),
        ({"bodies.count": 50, "publish_rate": "often"}, False),
    ],
)
def test_several_bodies_that_publish_slowly_have_many_slow_writers(given, expected):
    assert middleware.has_many_writers(given) == expected


def test_other_middlewares_get_none():
    middleware.use_profile(LIBRARIES.format(library="libddsc.so"))
    assert not named()


@pytest.mark.parametrize("name", VARIABLES)
def test_a_profile_of_the_users_stays(monkeypatch, loaded, name):
    monkeypatch.setenv(name, "mine.xml")
    middleware.use_profile(loaded)
    assert named() == {name: "mine.xml"}


@pytest.mark.parametrize("name", FOUND_BY_ITSELF)
def test_so_does_one_that_fast_dds_finds_by_itself(tmp_path, loaded, name):
    (tmp_path / name).touch()
    middleware.use_profile(loaded)
    assert not named()


@pytest.mark.parametrize("name", VARIABLES)
def test_an_empty_name_means_none(monkeypatch, loaded, name):
    monkeypatch.setenv(name, "")
    middleware.use_profile(loaded)
    assert not named()


def test_where_libraries_cannot_be_read_there_are_none(monkeypatch, tmp_path):
    monkeypatch.setattr(middleware, "LIBRARIES", tmp_path / "missing")
    assert middleware.libraries() == ""


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
    for topic in ("pose", *(f"{name}/pose" for name in BODIES)):
        node.create_subscription(PoseStamped, topic, lambda _: None, 1)
    yield node
    node.destroy_node()


def _wait(condition, what, seconds=60.0):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, f"no {what} within {seconds} s"
        time.sleep(0.01)


FEW = {"rate": 2000.0, "publish_rate": 0.0}, "pose", {}
MANY = {"bodies": BODIES, "rate": 1000.0}, "one/pose", {PROFILES["libfastrtps.so"][0]: str(installed("fastdds.xml"))}


@pytest.mark.ros
@pytest.mark.parametrize(("scene", "topic", "other"), [FEW, MANY], ids=["few quick writers", "many slow writers"])
def test_with_it_the_event_thread_of_fast_dds_is_woken_less_often(run_node, bystander, scene, topic, other):
    """For each wake-up of the loop. Measured 0.4, and 1.2 to 3.3 without; of many 0.07, and 0.37 with what few have."""
    if os.environ.get("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp") != "rmw_fastrtps_cpp":
        pytest.skip("the middleware is not Fast DDS")
    ratios = []
    for environment in ({}, {**dict.fromkeys(VARIABLES, ""), **other}):
        process = run_node(scene, arguments=["-r", "__ns:=/middleware"], environment=environment)
        process.wait_ready()
        _wait(lambda: bystander.count_publishers(topic), "publisher of pose")
        before = _wake_ups(process.popen)
        _wait(lambda p=process.popen, loop=before[1]: _wake_ups(p)[1] - loop > WAKE_UPS, "wake-ups of the loop")
        events, loop = (now - then for now, then in zip(_wake_ups(process.popen), before, strict=True))
        ratios.append(events / loop)
        process.assert_stopped_cleanly()
        _wait(lambda: not bystander.count_publishers(topic), "end of the publisher")
    assert ratios[0] < ratios[1] / 2
