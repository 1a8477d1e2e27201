"""The section "left out": scenes with fewer terms move as the full equations say, and costs are told."""

import json
from pathlib import Path

import pytest

from rigid_body_sim import Scene, Simulation, load_scene
from rigid_body_sim.report import cost, left_out_section
from rigid_body_sim.report.section import Paragraph, Settings, Table
from rigid_body_sim.scene.fleet import load_any
from rigid_body_sim.scene.installed import installed_scene, installed_scenes

pytest.importorskip("matplotlib")

SCENES = [path.stem for path in installed_scenes() if isinstance(load_any(path), Scene)]


@pytest.fixture(scope="module")
def results():
    """Every scene, with and without a command, in one round."""
    return {
        f"plan/{name}/{command}": json.loads(json.dumps(left_out_section.measure(installed_scene(name), command, 1)))
        for name in SCENES
        for command in left_out_section.COMMANDS
    }


def test_every_scene_is_measured_with_and_without_a_command():
    keys = [one.key for one in left_out_section.LeftOut().measurements(Settings(quick=True))]
    assert keys == [f"plan/{name}/{command}" for name in SCENES for command in left_out_section.COMMANDS] + ["node"]


@pytest.mark.parametrize("command", left_out_section.COMMANDS)
@pytest.mark.parametrize("name", SCENES)
def test_what_is_left_out_changes_nothing(results, name, command):
    """To round-off for what is exact; where an error is controlled, to what its tolerance of 1e-9 a step allows."""
    one = results[f"plan/{name}/{command}"]
    controlled = one["plan"]["integrator"] in ("dop853", "rosenbrock")
    assert one["attitude"] < (
        1e-6 if controlled else 1e-14
    )  # rad; measured 1.6e-7, on the cord that goes slack, and 7.8e-16
    assert one["position"] < (1e-6 if controlled else 3e-13)  # m; measured 2.7e-8 and 2.9e-14


def test_plans_are_those_of_the_scenes(results):
    for name in SCENES:
        plan = Simulation.from_scene(load_scene(installed_scene(name))).plan
        one = results[f"plan/{name}/no command"]
        assert (one["described"], one["left_out"]) == (str(plan), list(plan.left_out))
        held = results[f"plan/{name}/command held"]["left_out"]
        assert not {"body-axes force", "body-axes torque"} & set(held) or name == "point_mass"


def test_full_equations_leave_nothing_out_but_what_is_said():
    for name in SCENES:
        full = left_out_section.full_equations(load_scene(installed_scene(name)))
        for kind, simulation in full.items():
            simulation.set_wrench(cost.FULL_WRENCH)
            allowed = {"gyroscopic term", "ground", "flow of the fluid", "added mass", "actuators"} | (
                {"drag", "tethers"} if kind == "full" and len(full) == 2 else {"drag"}
            )
            assert set(simulation.plan.left_out) <= allowed


def test_page_shows_plans_costs_and_the_missing_benchmark(results, tmp_path):
    blocks = left_out_section.LeftOut().render({**results, "node": {"figures": []}}, tmp_path)
    (table,) = (block for block in blocks if isinstance(block, Table))
    assert len(table.rows) == 2 * len(SCENES)
    assert (tmp_path / "left_out_costs.png").stat().st_size > 10_000  # bytes
    said = [block.text for block in blocks if isinstance(block, Paragraph)]
    attitude = max(one["attitude"] for one in results.values())
    assert f"at most {attitude:.1e} rad" in said[1]
    costs = [one["plan"]["each"] / one["full"]["each"] for one in results.values()]
    assert f"costs {min(costs):.2g} times" in said[1] and f"and {max(costs):.2g} times at worst" in said[1]
    assert "`exact` is taken for its error" in said[1]
    assert "not measured" in said[-1]
    (headline,) = left_out_section.LeftOut().headlines(results)
    assert f"more than {attitude:.1e} rad" in headline
    assert left_out_section.LeftOut().headlines({}) == [] == left_out_section.LeftOut().render({}, tmp_path)


def test_costs_of_the_node_are_read_from_its_benchmark(tmp_path, results):
    figures = [
        {
            "name": "CPU per published step, all outputs",
            "value": 12.5,
            "unit": "us",
            "goal": None,
            "met": None,
            "how": "",
        },
        {
            "name": "start to first pose",
            "value": None,
            "unit": "",
            "goal": "below 2",
            "met": None,
            "how": "not measured",
        },
    ]
    path = tmp_path / "node.json"
    path.write_text(json.dumps({"machine": {}, "figures": figures}), encoding="utf-8")
    section = left_out_section.LeftOut()
    node = section.measurements(Settings(quick=True, node_bench=path))[-1].run()
    *_, paragraph, table = section.render({**results, "node": node}, tmp_path)
    assert paragraph.text == "The node's cost per published step: CPU per published step, all outputs: 12.5 us."
    assert list(table.rows[1]) == ["start to first pose", None, "", "below 2"]


@pytest.mark.parametrize("text", ["{}", "[1]", '{"figures": [3]}', "no JSON"])
def test_file_that_is_no_benchmark_is_refused(tmp_path, text):
    path = tmp_path / "node.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match="is not what `make bench-node` writes"):
        left_out_section.node_figures(path)
    assert left_out_section.node_figures(None) == {"figures": []}


def test_missing_file_is_an_error():
    with pytest.raises(OSError):
        left_out_section.node_figures(Path("no_such_file.json"))
