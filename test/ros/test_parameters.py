"""What a user sees for a bad parameter: exit status 1 and one sentence on stderr that names the parameter."""

import pytest
import yaml

from . import many_nodes

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros

# Parameters, and what the sentence must say after "rigid_body_node: ".
REFUSED = {
    "unknown name": ({"body.mas": 2.0}, "parameter body.mas is not known; did you mean body.mass?"),
    "unknown in a frame": (
        {"frames": {"arm": {"axis": "world"}}},
        "parameter frames.arm.axis is not known; did you mean frames.<name>.axes?",
    ),
    "NaN mass": ({"body.mass": float("nan")}, "parameter body.mass = nan: is not finite"),
    "zero mass": ({"body.mass": 0.0}, "parameter body.mass = 0.0: is out of range"),
    "negative inertia": ({"body.inertia": [0.1, 0.1, -0.1, 0.0, 0.0, 0.0]}, "parameter body.inertia = "),
    "triangle inequality": ({"body.inertia": [0.1, 0.1, 0.3, 0.0, 0.0, 0.0]}, "parameter body.inertia = "),
    "zero quaternion": ({"initial.orientation": dict.fromkeys("wxyz", 0.0)}, "parameter initial.orientation"),
    "wrong length": ({"gravity": [0.0, -9.81]}, "parameter gravity = [0.0, -9.81]: has 2 entries; give 3"),
    "empty array": ({"gravity": []}, "parameter gravity"),
    "string for a number": ({"body.mass": "2.0"}, "parameter body.mass = '2.0': '2.0' is not a number"),
    "number for an array": ({"gravity": -9.81}, "parameter gravity = -9.81: is not an array"),
    "bad choice": ({"twist_frame": "bdoy"}, "parameter twist_frame = 'bdoy': is not allowed; give one of body, world"),
    "name used twice": ({"world_frame_id": "base_link"}, "frame name 'base_link' is used twice"),
    "publish_rate": (
        {"rate": 1000.0, "publish_rate": 300.0},
        "parameter publish_rate = 300: does not divide rate = 1000 Hz into whole steps; the nearest that does is 333.3",
    ),
    "unknown integrator": ({"integrator.name": "tailor"}, "integrator.name"),
    "output that cannot be": (
        {"outputs": ["pose"]},
        "parameter outputs = ['pose']: 'pose' is not allowed; give any of ",
    ),
    "no topic for wrenches": ({"wrench.topics": []}, "parameter wrench.topics = []: is empty; give at least one name"),
    "impossible topic": (
        {"wrench.topics": ["bad name!"]},
        "parameter wrench.topics: 'bad name!' cannot be the name of",
    ),
    "empty topic": ({"wrench.topics": ["wrench", ""]}, "parameter wrench.topics = ['wrench', '']: '' is not allowed"),
    "topic that is one by another name": (
        {"wrench.topics": ["wrench", "/wrench"]},
        "parameter wrench.topics: '/wrench' is /wrench, which this node uses already; give each source a topic of its",
    ),
    "topic of impulses": ({"wrench.topics": ["impulse"]}, "wrench.topics: 'impulse' is /impulse, which this node uses"),
    "topic of an output": ({"wrench.topics": ["pose"]}, "wrench.topics: 'pose' is /pose, which this node uses already"),
    "use_sim_time": ({"use_sim_time": True}, "parameter use_sim_time = true: this node makes the simulated time"),
    "use_sim_time of a wrong type": (
        {"use_sim_time": 3},
        "parameter 'use_sim_time' to '3' of type 'INTEGER', expecting type 'BOOL'",
    ),
    "QoS that no topic can have": (
        {"qos_overrides./wrench.subscription.history": "unknown"},
        "qos_overrides./wrench.subscription.history = 'unknown': is not allowed; give one of system_default, keep_last",
    ),
    "QoS of a misspelt topic": (
        {"qos_overrides./pos.publisher.depth": 5},
        "parameter qos_overrides./pos.publisher.depth is not known; did you mean qos_overrides./pose.publisher.depth?",
    ),
    "bad QoS": (
        {"qos_overrides./pose.publisher.reliability": "sometimes"},
        "qos_overrides./pose.publisher.reliability",
    ),
}

# Files that cannot be read, by their text, and the sentence; test_arguments has them all.
FILES = {
    "no value": (
        "/**:\n  ros__parameters:\n    body.mass:\n",
        "file.yaml: parameter body.mass has no value; write one",
    ),
    "not YAML": ("a: [1, 2", "file.yaml: is not YAML: "),
    "missing": (None, "file.yaml: cannot be read (No such file or directory); give a parameter file"),
}
# Arguments that are no parameters, status and sentence; test_command_line and test_arguments have them all.
ARGUMENTS = {
    "file without --ros-args": (["scene.yaml"], 2, "rigid_body_node --ros-args --params-file scene.yaml"),
    "unknown after --ros-args": (["--ros-args", "--helo", "x"], 1, "'--helo', 'x' after --ros-args is none of ROS's"),
    "no remapping": (["--ros-args", "-r", "wrench=a"], 1, "-r wrench=a: renames nothing; write -r FROM:=TO, such as"),
    "namespace without a slash": (["--ros-args", "-r", "__ns:=a"], 1, "-r __ns:=a: renames nothing; write -r FROM"),
    "file that is a folder": (
        ["--ros-args", "--params-file", "/"],
        1,
        "--params-file /: cannot be read (Is a directory)",
    ),
    "twice": (["--ros-args", "-p", "rate:=5.0", "-p", "rate:=6.0"], 1, "parameter rate is given twice, first as 5.0"),
    "unknown name": (["--ros-args", "-p", "body.mas:=2.0"], 1, "body.mas is not known; did you mean body.mass?"),
    "wrong case": (["--ros-args", "-p", "Body.Mass:=2.0"], 1, "Body.Mass is not known; did you mean body.mass?"),
    "equals sign": (["--ros-args", "-p", "rate=5"], 1, "-p rate=5: has '=' where ':=' is needed; write -p rate:=5"),
}
SECTIONS = """
/rigid_body_node:
  ros__parameters: {body: {mass: 2.0, inertia: [1, 1.5, 2, 0, 0, 0]}, gravity: [0, 0, -9.81], rate: 1e2}
/controller:
  ros__parameters: {gain: 3.0}
"""


@pytest.fixture(scope="module")
def ended(context, tmp_path_factory):
    """(exit status, stdout, stderr) by name, for everything in REFUSED, FILES and ARGUMENTS."""
    folder = tmp_path_factory.mktemp("nodes")
    asked = {}
    asked.update((name, args) for name, (args, *_) in ARGUMENTS.items())
    for number, name in enumerate((*REFUSED, *FILES)):
        (folder / str(number)).mkdir()
        file = folder / str(number) / "file.yaml"
        text = FILES[name][0] if name in FILES else yaml.safe_dump({"/**": {"ros__parameters": REFUSED[name][0]}})
        if text is not None:
            file.write_text(text)
        asked[name] = ["--ros-args", "--params-file", str(file)]
    return many_nodes.run(asked, folder)


@pytest.mark.parametrize("name", REFUSED)
def test_bad_parameter_refuses_to_start(ended, name):
    status, stdout, stderr = ended[name]
    assert status == 1, stderr
    assert "Traceback" not in stderr and stdout == ""
    (line,) = stderr.splitlines()
    assert line.startswith("rigid_body_node: ") and REFUSED[name][1] in line


def test_inertia_refusals_name_the_rule(ended):
    assert "not positive definite" in ended["negative inertia"][2]
    assert "triangle inequality" in ended["triangle inequality"][2]


def test_unknown_integrator_lists_the_known(ended):
    from rigid_body_sim.integrators import REGISTRY

    assert all(name in ended["unknown integrator"][2] for name in REGISTRY)


@pytest.mark.parametrize("name", FILES)
def test_bad_file_refuses_to_start(ended, name):
    status, stdout, stderr = ended[name]
    assert status == 1, stderr
    assert stdout == ""
    (line,) = stderr.splitlines()
    assert line.startswith("rigid_body_node: ") and FILES[name][1] in line


@pytest.mark.parametrize("name", ARGUMENTS)
def test_bad_argument_refuses_to_start(ended, name):
    status, stdout, stderr = ended[name]
    _, wanted, said = ARGUMENTS[name]
    assert (status, stdout) == (wanted, "")
    (line,) = (line for line in stderr.splitlines() if "[rcl]" not in line)  # which logs what it then raises
    assert line.startswith("rigid_body_node: ") and said in line and "lexeme" not in line


def test_node_takes_its_section_and_the_command_line_over_it(run_node, tmp_path):
    """Another node's is not its concern, unless it has that name."""
    file = tmp_path / "two_nodes.yaml"
    file.write_text(SECTIONS)
    given = ["--params-file", str(file), "-p", "rate:=200"]
    own, other = run_node(arguments=given), run_node(arguments=[*given, "-r", "__node:=controller"])
    lost, bare = run_node(arguments=[*given[:2], "-r", "__ns:=/a"]), run_node()
    own.wait_ready()
    assert "ready: mass 2 kg, principal moments [1, 1.5, 2] kg m2, rate 200 Hz" in own.stderr
    other.wait_end(30.0)
    assert "parameter gain is not known" in other.stderr
    assert "no parameters" not in own.stderr
    for node in (lost, bare):
        node.wait_ready()
        assert "]: no parameters were given: simulating the default body" in node.stderr
    found = "/rigid_body_node, /controller"
    assert f"{file} has nothing for this node, /a/rigid_body_node: it has parameters for {found}" in lost.stderr
    for node in (own, lost, bare):
        node.assert_stopped_cleanly()
