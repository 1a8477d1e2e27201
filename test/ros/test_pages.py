"""What the documentation tells to run is run as it is printed, a tutorial from its first block to its last."""

import pytest
import yaml

from rigid_body_sim import Scene

from ..bags import making
from ..doc_pages import PAGES, TUTORIALS, blocks, named
from ..resim import runs
from .reader import UNTIL_CTRL_C, Reader

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros


@pytest.fixture
def reader(tmp_path):
    reader = Reader(tmp_path)
    yield reader
    reader.leave()


@pytest.fixture
def height(context):
    """A function: the height [m] in the last odometry heard."""
    from nav_msgs.msg import Odometry
    from rclpy.node import Node

    from rigid_body_sim.ros.executor import executor_for

    node, heard = Node("reader", context=context), [0.0]
    node.create_subscription(Odometry, "odom", lambda message: heard.append(message.pose.pose.position.z), 10)
    executor = executor_for(node)

    def last():
        executor.spin_once(timeout_sec=0.01)
        return heard[-1]

    yield last
    executor.shutdown()
    node.destroy_node()


def to_run(page):
    return [block for block in blocks(page) if not block.fragment]


def follow(reader, page, until=None):
    for block in to_run(page):
        reader.do(block, until)


def page_named(name):
    (page,) = (page for page in TUTORIALS if page.stem == name)
    return page


def test_first_controller_and_check_of_a_change(reader, height):
    """The second of these pages begins where the first one ends."""
    follow(reader, page_named("first_controller"), lambda: abs(height() - 2.0) < 0.02)
    assert (reader.folder / "flight.png").exists() and (reader.folder / "lockstep_flight.png").exists()
    follow(reader, page_named("check_a_change"))
    assert len((reader.folder / "masses.csv").read_text().splitlines()) == 7  # comment, header, 5 masses
    assert (reader.folder / "today.png").exists()


def test_satellite_with_wheels(reader):
    follow(reader, page_named("satellite_with_wheels"))
    assert (reader.folder / "turn.svg").exists()


def test_rov_in_a_current(reader):
    follow(reader, page_named("rov_in_a_current"))
    assert (reader.folder / "with_integral.png").exists() and (reader.folder / "without_integral.png").exists()


def test_every_tutorial_is_followed():
    assert {page.stem for page in TUTORIALS} == {
        *("first_controller", "check_a_change", "satellite_with_wheels", "rov_in_a_current"),
    }


# The other pages ------------------------------------------------------------------------------------------------------


def commands():
    others = [page for page in PAGES if page not in TUTORIALS]
    found = [(page, block) for page in others for block in to_run(page) if block.language in ("bash", "console")]
    return [pytest.param(page, block, id=f"{named(page)}-{i}") for i, (page, block) in enumerate(found)]


@pytest.fixture
def bags(reader):
    """The bags and scenes of which the pages speak, though shorter."""
    scene, folder = Scene(runs.SCENE), reader.folder
    sends = runs.sends(scene, 0.5)
    for name in ("run1", "night_run"):
        making.make(folder / name, runs.with_journal(scene, sends, 0.5))
    making.make(folder / "others_run", runs.in_real_time(scene, sends, 0.5))
    (folder / "satellite.yaml").write_text(yaml.safe_dump({"/**": {"ros__parameters": runs.SCENE}}))


@pytest.mark.parametrize(("page", "block"), commands())
def test_commands_run_as_printed(page, block, reader, bags):
    for other in to_run(page):  # what the page has made before
        if other.language == "python" and "to_bag(" in other.text:
            reader.do(other._replace(text=f"# made.py\n{other.text}"))
            reader.do(other._replace(language="bash", text="python made.py"))
        elif other.language == "yaml" and (name := other.text.splitlines()[0].partition("  # ")[2]):
            (reader.folder / name).write_text(other.text)
    reader.do(block)
    if block.text.startswith(UNTIL_CTRL_C):
        reader.wait_ready()
        reader.stop()
