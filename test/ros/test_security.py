"""Who may command: the policy in security/ is what the programs use, and a node told to be secure never runs open."""

import importlib.util
from xml.etree import ElementTree

import pytest

from . import policy
from .node_process import ROOT

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros

CONTROLLERS = {  # and the arguments without which they do not start
    "pointing_controller": [],
    "actuator_controller": ["-p", f"plant:={ROOT / 'config/quadrotor.yaml'}"],
}
HAS_TF = importlib.util.find_spec("tf2_msgs") is not None
ALL_OUTPUTS = ["odom", "accel", "imu", "wrench_applied", "actuator_states", "marker", "clock", *["tf"] * HAS_TF]
ACTUATED = {"actuators": {"names": ["jet"], "jet": {"type": "thruster", "min": 0.0, "max": 1.0}}}
STANDARD = ("simulat", "entit")  # what is there only with simulation_interfaces: see test_standard_services
KEYSTORE = (
    "identity_ca.cert.pem",
    "cert.pem",
    "key.pem",
    "permissions_ca.cert.pem",
    "governance.p7s",
    "permissions.p7s",
)


@pytest.fixture(scope="module")
def observer(context):
    from rclpy.node import Node

    node = Node("observer_of_names", context=context, enable_rosout=False)
    yield node
    node.destroy_node()


def always_there(name):
    """Whether it is there on every machine; ``actuators`` needs actuator_msgs."""
    standard = any(part in name.rsplit("/", 1)[-1] for part in STANDARD)
    return not standard and "/_action/" not in name and (HAS_TF or name != "/tf") and not name.endswith("/actuators")


def test_policy_allows_the_node_what_it_uses_and_nothing_else(connect, observer):
    given = {"outputs": ALL_OUTPUTS, "start_paused": True, "fluid.velocity": [0.0, 0.0, 0.0], **ACTUATED}
    remote = connect(given).ready()
    # It makes the simulated time and never follows another's, so that it needs no right to listen to /clock.
    assert not remote.set_parameter("use_sim_time", True).successful
    namespace = remote.name.rsplit("/", 1)[0]
    allowed = policy.allowed("rigid_body_node", namespace)
    used = policy.used(observer, "rigid_body_node", namespace, allowed.only(always_there))
    for what in policy.KINDS:
        may, does = getattr(allowed, what), getattr(used, what)
        assert does <= may, f"not in the policy, {what}: {does - may}"


@pytest.mark.parametrize("name", CONTROLLERS)
def test_policy_allows_a_controller_what_it_uses_and_nothing_else(run_node, observer, name):
    namespace = f"/{name}"
    arguments = ["-r", f"__ns:={namespace}", "-p", "use_sim_time:=true", *CONTROLLERS[name]]
    process = run_node(None, arguments=arguments, module=f"rigid_body_sim.tools.{name}")
    allowed = policy.allowed(name, namespace)
    used = policy.used(observer, name, namespace, allowed)
    assert used == allowed
    process.assert_stopped_cleanly()


def test_only_those_who_command_may_publish_a_command():
    tree = ElementTree.parse(policy.FILE)
    publishers = [
        profile.get("node")
        for profile in tree.iterfind(".//profile")
        if any(
            topic.text in ("wrench", "actuator_commands")
            for topic in profile.iterfind("topics[@publish='ALLOW']/topic")
        )
    ]
    assert publishers == list(CONTROLLERS)
    assert not [rule for rule in tree.iter() if "*" in (rule.text or "")], "a wildcard allows more than is used"


@pytest.mark.parametrize("keystore", ["missing", "of no use"])
def test_node_told_to_be_secure_does_not_run_open(run_node, tmp_path, keystore):
    """The wheels' middleware has no security; that of the Debian packages finds no certificate."""
    if keystore == "of no use":
        for name in KEYSTORE:
            (tmp_path / "enclaves").mkdir(exist_ok=True)
            (tmp_path / "enclaves" / name).touch()
    environment = {
        "ROS_SECURITY_ENABLE": "true",
        "ROS_SECURITY_STRATEGY": "Enforce",
        "ROS_SECURITY_KEYSTORE": str(tmp_path),
    }
    process = run_node({}, environment=environment)
    assert process.wait_end(60.0) == 1
    assert "security" in process.stderr.lower() and "Traceback" not in process.stderr
