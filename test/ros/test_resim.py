"""Runs of a real node are simulated again by rigid_body_resim from their bags, to the bit."""

import numpy as np
import pytest
import yaml
from numpy.testing import assert_array_equal

pytest.importorskip("rclpy")
pytest.importorskip("rosbags")

from rigid_body_sim.bags import journal
from rigid_body_sim.bags.reading import read
from rigid_body_sim.tools import resim

from ..bags import making

pytestmark = pytest.mark.ros

SCENE = {
    "rate": 1000.0,
    "publish_rate": 0.0,
    "wrench.topics": ["wrench", "gust"],
    "wrench.timeout": 0.05,
    "body.mass": 2.0,
    "body.inertia": [0.1, 0.2, 0.25, 0.0, 0.0, 0.0],
    "initial.angular_velocity": [0.3, 1.0, 0.2],
    "gravity": [0.0, 0.0, -9.80665],
}


def send_some(remote, count, each=1):
    """Commands on both topics, on the first ``count`` of them, each followed by so many poses."""
    random = np.random.default_rng(2)
    gust = remote.publisher("gust")
    remote.clear()
    for i in range(count):
        force, torque = random.normal(size=(2, 3)).tolist()
        if i % 7 == 3:
            remote.send("world", force, torque, through=gust)
        remote.send("base_link" if i % 3 else "world", torque, force)
        remote.collect(each * (i + 1))


def test_real_time_with_the_nodes_own_recorder(connect, tmp_path, capfd):
    remote = connect({**SCENE, "record.path": str(tmp_path / "bag")}).ready()
    send_some(remote, 50, each=5)
    remote.send("world", (0.1, 0.0, 0.0), (0.0, 0.02, 0.0), topic="impulse")
    assert remote.set_together({"body.mass": 3.0}).successful
    send_some(remote, 20, each=5)
    remote.process.assert_stopped_cleanly()
    assert resim.main([str(tmp_path / "bag"), "--out", str(tmp_path / "again"), "--compare"]) == resim.SAME
    assert "Equal to the bit" in capfd.readouterr().out
    poses = [next(iter(read(tmp_path / bag).poses.values())) for bag in ("bag", "again")]
    assert len(poses[0]) > 30 and np.ptp(poses[0].values[:, 3]) > 1e-3
    assert_array_equal(poses[0].values, poses[1].values)


def test_tether_and_force_that_were_changed_meanwhile(connect, tmp_path, capfd):
    """An anchor that was moved, and more that was set together with a mass, are in the journal."""
    scene = {
        **SCENE,
        "gravity": [0.0, 0.0, 0.0],
        "tethers.rope.anchor": [0.0, 0.0, 1.0],
        "tethers.rope.body_point": [0.0, 0.1, 0.1],
        "tethers.rope.rest_length": 0.5,
        "tethers.rope.stiffness": 200.0,
        "forces.lift.force": [0.0, 0.0, 3.0],
        "record.path": str(tmp_path / "bag"),
    }
    remote = connect(scene).ready()
    send_some(remote, 10, each=5)
    assert remote.set_parameter("tethers.rope.anchor", [0.3, 0.0, 1.2]).successful
    send_some(remote, 10, each=5)
    changes = {"tethers.rope.damping": 4.0, "tethers.rope.slack": False, "forces.lift.force": [0.1, 0.0, -2.0]}
    assert remote.set_together({**changes, "body.mass": 3.0}).successful
    send_some(remote, 10, each=5)
    remote.process.assert_stopped_cleanly()
    assert resim.main([str(tmp_path / "bag")]) == resim.SAME
    assert "Equal to the bit" in capfd.readouterr().out
    entries = journal.read(read(tmp_path / "bag").journal)
    anchors = [entry.values["tethers"][0]["anchor"] for entry in entries if entry.call == "change"]
    assert anchors == [[0.3, 0.0, 1.2]] * 2


def test_node_that_was_killed(connect, tmp_path, capfd):
    """What is whole in its bag is simulated again to the bit."""
    remote = connect({**SCENE, "record.path": str(tmp_path / "bag")}).ready()
    send_some(remote, 20, each=5)
    recorded = tmp_path / "bag" / "bag_0.mcap"
    size = recorded.stat().st_size
    remote.wait(lambda: recorded.stat().st_size > size, "another chunk")  # what was sent is in it, or before it
    remote.process.kill()
    assert resim.main([str(tmp_path / "bag")]) == resim.FAILED
    assert "--recover takes what is whole in it" in capfd.readouterr().err
    assert resim.main([str(tmp_path / "bag"), "--recover"]) == resim.SAME
    out = capfd.readouterr().out
    assert "has no end: what is whole in it is taken" in out and "Equal to the bit" in out


def test_lockstep_without_a_journal(connect, tmp_path, capfd):
    """From what any recorder has: commands, poses and twists in the order of coming."""
    scene = {**SCENE, "lockstep": True, "steps_per_command": 7}
    remote = connect({**scene, "record.path": str(tmp_path / "own")}).ready()
    remote.settle()
    send_some(remote, 60)
    remote.process.assert_stopped_cleanly()
    making.make(tmp_path / "bag", making.without_journal(tmp_path / "own"), "sqlite3")
    (tmp_path / "scene.yaml").write_text(yaml.safe_dump({"/**": {"ros__parameters": scene}}))
    assert resim.main([str(tmp_path / "bag"), "--scene", str(tmp_path / "scene.yaml")]) == resim.SAME
    out = capfd.readouterr().out
    assert "Lockstep: each command on" in out and "Equal to the bit: 61 poses" in out
