"""The section "left out": what each scene's plan leaves out, what that saves, and what it changes.

Costs are measured by cost.costs. The node's own costs come from the JSON that its benchmark wrote, when given.
"""

import functools
import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..effects.tether import Tether
from ..scene.fleet import load_any
from ..scene.installed import installed_scenes
from ..scene.loader import Scene, load_scene
from ..simulation import Simulation
from ..values import rotation
from ..values.wrench import Wrench, total
from . import style
from .cost import FULL_WRENCH, TINY, costs
from .section import FAILED, Block, Measurement, Paragraph, Picture, Result, Results, Settings, Table, finished

ROUNDS, QUICK_ROUNDS = 20, 7
SPAN = 5.0  # s, after which results are compared
COMMANDS = ("no command", "command held")
ACCELERATION = (0.1, -0.2, 0.3)  # m/s², of the command's force
ANGULAR_ACCELERATION = (0.02, -0.01, 0.03)  # rad/s², of its torque
FOR_ITS_ERROR = "`exact` is taken for its error, and for many steps in one call, not for one"
PER_STEP = "published step"  # part of the names of the figures that belong here, in the node's benchmark


class LeftOut:
    """Section 3 of the report."""

    name = "left_out"
    title = "What was left out"

    def measurements(self, settings: Settings) -> list[Measurement]:
        """One a scene and command, and one that reads the node's costs."""
        rounds = QUICK_ROUNDS if settings.quick else ROUNDS
        made = [
            Measurement(f"plan/{path.stem}/{command}", functools.partial(measure, path, command, rounds))
            for path in installed_scenes()
            if isinstance(load_any(path), Scene)
            for command in COMMANDS
        ]
        return [*made, Measurement("node", functools.partial(node_figures, settings.node_bench))]

    def headlines(self, results: Results) -> list[str]:
        """What the plans save, and what they change."""
        plans = finished(results, "plan/").values()
        if not plans:
            return []
        cost = [one["plan"]["each"] / one["full"]["each"] for one in plans]
        changed = max(one["attitude"] for one in plans)
        return [
            f"By the plans of the scenes a step called alone costs {min(cost):.2g} to {max(cost):.2g} times what it "
            f"costs by the full equations ({FOR_ITS_ERROR}), and no attitude differs by more than {changed:.1e} rad "
            f"after {SPAN:g} s."
        ]

    def render(self, results: Results, folder: Path) -> list[Block]:
        """A table of plans, a picture of their costs, the difference in the result, and what the node adds."""
        plans = {_scene_and_command(key): one for key, one in finished(results, "plan/").items()}
        if not plans:
            return []
        return [
            Paragraph(
                "The full equations are the scene with every term switched on at (next to) zero: by `taylor` where no "
                "drag and no tether acts, else by what `auto` chooses; with drag and a tether besides in the third bar."
            ),
            _table(plans),
            _picture(plans, folder),
            Paragraph(conclusion(plans)),
            *_node_blocks(results.get("node", {})),
        ]


def _scene_and_command(key: str) -> tuple[str, str]:
    _, scene, command = key.split("/")
    return scene, command


def measure(path: Path, command: str, rounds: int) -> Result:
    """Plan, costs per step [s] and the difference in the result, for a scene with or without a command."""
    scene = load_scene(path)
    wrench = wrench_of(scene) if command == COMMANDS[1] else Wrench()
    candidates = {"plan": Simulation.from_scene(scene), **full_equations(scene)}
    for name, simulation in candidates.items():
        simulation.set_wrench(wrench if name == "plan" else total((wrench, FULL_WRENCH)))
    told = candidates["plan"].plan
    by = {name: simulation.plan.integrator for name, simulation in candidates.items()}
    each = costs(candidates, rounds)
    attitude, position = difference(candidates["plan"], candidates["full"], SPAN)
    return {
        **{name: {"integrator": by[name], "one_call": each[name][0], "each": each[name][1]} for name in candidates},
        "described": str(told),
        "left_out": list(told.left_out),
        "attitude": attitude,
        "position": position,
    }


def wrench_of(scene: Scene) -> Wrench:
    """A command as the scene expects it: force and torque in the axes of ``wrench.frame``."""
    body = scene.body()
    force = [body.mass * a for a in ACCELERATION]
    if scene["wrench.frame"] == "world":
        return Wrench(force_world=force)
    return Wrench(force_body=force, torque_body=(body.principal_moments * ANGULAR_ACCELERATION).tolist())


def full_equations(scene: Scene) -> dict[str, Simulation]:
    """The scene with gravity and every term of the wrench (``full``), and with drag and a tether too (``everything``).

    Where it has drag or a tether both are the same, and only ``full`` is given. The wrench is for the caller to set.
    """
    terms = scene.terms()
    given = {**terms.optional(), "gravity": [g or TINY for g in terms.gravity]}
    loads = {**given, "tethers": given["tethers"] or (Tether(),)}
    begin = terms.body, scene.initial_state()
    everything = Simulation(*begin, rate=scene["rate"], **loads)
    if terms.loads:
        return {"full": everything}
    return {"full": Simulation(*begin, rate=scene["rate"], integrator="taylor", **given), "everything": everything}


def difference(one: Simulation, other: Simulation, span: float) -> tuple[float, float]:
    """Attitude [rad] and position [m] by which two simulations differ after ``span`` [s]."""
    for simulation in (one, other):
        simulation.step(round(span * simulation.rate))
    a, b = one.state, other.state
    return rotation.angle_between(a.orientation, b.orientation), float(np.linalg.norm(a.position - b.position))


def node_figures(path: Path | None) -> Result:
    """The figures of the node's benchmark: name, value, unit and goal of each; none without its file.

    Raises ValueError for a file that is no such JSON, and OSError when it cannot be read.
    """
    if path is None:
        return {"figures": []}
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        kept = ("name", "value", "unit", "goal", "met")
        return {"figures": [{name: figure.get(name) for name in kept} for figure in content["figures"]]}
    except (KeyError, TypeError, AttributeError, json.JSONDecodeError) as reason:
        raise ValueError(f"{path} is not what `make bench-node` writes with --out: {reason!r}") from None


# What is shown ------------------------------------------------------------------------------------------------------

Plans = Mapping[tuple[str, str], Result]  # by scene and command


def _table(plans: Plans) -> Table:
    columns = ("scene", "command", "integrator", "left out", "plan [ns]", "full [ns]", "full / plan", "rad", "m")
    rows = [
        (
            scene,
            command,
            one["plan"]["integrator"],
            ", ".join(one["left_out"]),
            round(1e9 * one["plan"]["each"]),
            round(1e9 * one["full"]["each"]),
            round(one["full"]["each"] / one["plan"]["each"], 2),
            one["attitude"],
            one["position"],
        )
        for (scene, command), one in plans.items()
    ]
    caption = (
        "A step by each scene's plan and by the full equations, called one by one; and by how much attitude [rad] and "
        f"position [m] differ after {SPAN:g} s."
    )
    return Table("left_out_plans", columns, rows, caption)


def _picture(plans: Plans, folder: Path) -> Picture:
    """Bars: a step by plan, by the full wrench, and with drag and a tether."""
    kinds = (
        ("plan", style.BLUE, "the plan"),
        ("full", style.ORANGE, "the full equations"),
        ("everything", style.GREY, "with drag and a tether besides"),
    )
    with style.figure(9.0, 0.62 * len(plans) + 1.4) as figure:
        panel = figure.subplots()
        for k, (kind, colour, label) in enumerate(kinds):
            there = [(row, 1e9 * one[kind]["each"]) for row, one in enumerate(plans.values()) if kind in one]
            places = [row + 0.27 * (k - 1) for row, _ in there]
            bars = panel.barh(places, [cost for _, cost in there], height=0.25, color=colour, label=label)
            panel.bar_label(bars, fmt="%.0f", padding=3, fontsize=9)
        panel.set_yticks(range(len(plans)), [f"{scene}\n{command}" for scene, command in plans], fontsize=9)
        panel.invert_yaxis()
        panel.grid(False, axis="y")
        panel.set_xscale("log")
        panel.margins(x=0.12)
        panel.set_xlabel("processor time of a step, called one by one [ns]")
        figure.legend(loc="outside upper center", ncols=3, fontsize=10)
        return style.save(figure, folder, "left_out_costs", "What a step costs by each plan and by the full equations.")


def conclusion(plans: Plans) -> str:
    """What the plans save and change, from the numbers alone."""
    (most, saved), (least, lost) = (
        pick(((key, one["full"]["each"] / one["plan"]["each"]) for key, one in plans.items()), key=lambda item: item[1])
        for pick in (max, min)
    )
    attitude, position = (max(one[field] for one in plans.values()) for field in ("attitude", "position"))
    return (
        f"A step called alone costs {1.0 / saved:.2g} times what it costs by the full equations at best "
        f"(`{most[0]}`, {most[1]}) and {1.0 / lost:.2g} times at worst (`{least[0]}`, {least[1]}): {FOR_ITS_ERROR}. "
        f"After {SPAN:g} s it differs from the full equations by at most {attitude:.1e} rad and {position:.1e} m."
    )


def _node_blocks(result: Result) -> list[Block]:
    """The node's cost per published step, or that it was not measured."""
    figures = result.get("figures", [])
    if not figures:
        why = result.get(FAILED, "run `make bench-node` with --out, and give this report its file")
        return [Paragraph(f"The node's cost per published step, with outputs on and off: not measured ({why}).")]
    said = [
        f"{figure['name']}: {figure['value']:.4g} {figure['unit']}"
        for figure in figures
        if PER_STEP in figure["name"] and figure["value"] is not None
    ]
    rows = [[figure[name] for name in ("name", "value", "unit", "goal")] for figure in figures]
    told = "; ".join(said) if said else f"the file has no figure with {PER_STEP!r} in its name"
    return [
        Paragraph(f"The node's cost per published step: {told}."),
        Table("left_out_node", ("figure", "value", "unit", "goal"), rows, "All figures of the node's benchmark."),
    ]
