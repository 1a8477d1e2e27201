"""Many runs of one bag at once: the poses and states of each run by itself, to the bit, or not at once."""

import numpy as np
import pytest

pytest.importorskip("rosbags")

from rigid_body_sim import Scene
from rigid_body_sim.bags.reading import read
from rigid_body_sim.kernels import compiled
from rigid_body_sim.resim import resimulating, together
from rigid_body_sim.scenarios import scenario as scenarios

from ..bags import making
from . import runs

pytestmark = pytest.mark.skipif(not compiled.ENABLED, reason="without numba runs are done one by one")
SECONDS = 2.0
FRAMES = ("base_link", "world", "")  # in none of them a command is a force at a point


def made(tmp_path, changes=None, frames=FRAMES, start=None):
    """What a bag says, and the scenes of five runs of it: of other masses, and of one with drag."""
    base = Scene({**runs.SCENE, **(changes or {})})
    making.make(tmp_path / "run", runs.in_real_time(base, runs.sends(base, SECONDS, frames=frames), SECONDS))
    scenario = scenarios.prepare(read(tmp_path / "run"), base, scenarios.Choices(start=start))
    scenes = [base.changed({"body.mass": mass}) for mass in (1.0, 2.0, 2.5, 3.0)]
    return scenario, [*scenes, base.changed({"drag.linear": [0.1, 0.0, 0.2]})]


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"wrench.timeout": 0.004},
        {"wrench.max_torque": 0.5},
        {"integrator.name": "rk4"},
        {"rate": 125.0, "publish_rate": 25.0},
    ],
    ids=["as it is", "with timeouts", "with limits", "rk4", "another rate"],
)
def test_runs_at_once_are_those_one_by_one(tmp_path, monkeypatch, changes):
    monkeypatch.setattr(together, "KEPT_AT_ONCE", 37)  # several pieces
    scenario, scenes = made(tmp_path, changes)
    scenes = scenes[: 4 if "integrator.name" in changes else 5]
    found = together.run(scenario, scenes)
    for scene, outcome in zip(scenes, found, strict=True):
        alone = resimulating.run(scenario, scene)
        assert outcome.state == alone.state and outcome.refusal == ""
        assert np.array_equal(outcome.poses, alone.poses)
    assert np.array_equal(found[1].poses, scenario.recorded)  # what was recorded is one of them


def test_runs_begin_where_the_bag_does(tmp_path):
    scenario, scenes = made(tmp_path, start="bag")
    assert scenario.start is not None
    for scene, outcome in zip(scenes, together.run(scenario, scenes), strict=True):
        assert outcome.state == resimulating.run(scenario, scene).state


def test_a_run_that_cannot_go_on_says_why_and_the_others_go_on(tmp_path):
    scenario, scenes = made(tmp_path)
    tiny = scenes[0].changed({"body.inertia": [1e-15, 2e-15, 2.5e-15, 0.0, 0.0, 0.0]})
    found = together.run(scenario, [scenes[0], tiny, scenes[1]])
    with pytest.raises(Exception, match="cannot be done") as alone:
        resimulating.run(scenario, tiny)
    assert found[1].refusal == str(alone.value)
    assert [found[0].state, found[2].state] == [resimulating.run(scenario, one).state for one in scenes[:2]]


def test_what_cannot_be_done_at_once(tmp_path):
    scenario, scenes = made(tmp_path, frames=("hook",))
    assert together.run(scenario, scenes) is None  # forces at points
    (tmp_path / "other").mkdir()
    scenario, scenes = made(tmp_path / "other")
    assert together.run(scenario, [scenes[0], scenes[1].changed({"integrator.name": "rk4"})]) is None
    assert together.run(scenario, [one.changed({"start_on_command": True}) for one in scenes]) is None


def test_how_many_at_once(tmp_path):
    scenario, _ = made(tmp_path)
    assert together.most(scenario) == together.MOST
    assert together.most(scenarios.replace(scenario, stamp_ns=np.arange(60_000))) == 16
    assert together.most(scenarios.replace(scenario, stamp_ns=np.arange(10**7))) == 8
