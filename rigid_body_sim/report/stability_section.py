"""The section "stability": its maps and long runs, and the sentence under each picture."""

import csv
import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .. import integrators
from .section import Block, Heading, Measurement, Paragraph, Result, Results, Settings, Table, finished
from .stability import (
    actuator,
    added_mass,
    controller,
    damping,
    ground,
    long_run,
    maps,
    matrix,
    plots,
    step_size,
    tether,
    turning,
)
from .stability.outcome import ACCURATE, Outcome

AUTO = integrators.AUTO

# Every map by its name, in the order of the page: a function of ``quick``.
MAPS: dict[str, Callable[[bool], maps.Map[Any]]] = {
    "damping": damping.build,
    "tether_damped": functools.partial(tether.build, damped=True),
    "tether_undamped": functools.partial(tether.build, damped=False),
    "ground_stiffness": ground.bounce,
    "ground_friction": ground.slide,
    "added_mass": added_mass.build,
    "controller": controller.build,
    "actuator": actuator.build,
    "step_size": step_size.build,
    **{name: functools.partial(turning.build, name=name) for name in turning.NAMES},
}

# What is run for long: name, what is measured, integrator, how many random states and steps, in full and quick.
ENERGY, ATTITUDE = long_run.energy_errors, long_run.attitude_errors
LONG_RUNS = {
    ("energy", "taylor"): (ENERGY, (2, 10**8), (2, 10**6)),
    ("energy", "rk4"): (ENERGY, (1, 10**7), (1, 10**5)),
    ("energy", "splitting4"): (ENERGY, (1, 10**7), (1, 10**5)),
    ("attitude", "taylor"): (ATTITUDE, (2, 10**8), (2, 10**6)),
    ("attitude", "exact"): (ATTITUDE, (2, 10**8), (2, 10**6)),
    ("attitude", "rk4"): (ATTITUDE, (1, 10**7), (1, 10**5)),
    ("attitude", "splitting4"): (ATTITUDE, (1, 10**7), (1, 10**5)),
}
SETTLED = 100  # the growth of an error is fitted from this share of its steps on: over the last two decades
LAW = {"energy": 0.5, "attitude": 1.5}  # powers of n by Brouwer's law: what is conserved, and what follows from it
SCATTER = 0.25  # of fitted powers
NOT_GROWING = 0.15  # fitted powers below it are scatter
MATRIX_STEPS = (10_000, 2_000)  # full, quick


class Stability:
    """Section 2 of the report."""

    name = "stability"
    title = "Stability: stiff and extreme cases"

    def measurements(self, settings: Settings) -> list[Measurement]:
        """One a map and integrator, one a long run, one a kind of matrix or quaternion."""
        made = [
            Measurement(f"map/{name}/{integrator}", functools.partial(_map, name, integrator, settings.quick))
            for name in MAPS
            for integrator in settings.integrators
        ]
        for (what, integrator), (errors, *amounts) in LONG_RUNS.items():
            seeds, most = amounts[settings.quick]
            made += [
                Measurement(
                    f"long_run/{what}/{integrator}/{k}",
                    functools.partial(errors, integrator, settings.seed + k, most),
                    weight=most / 4e6,
                )
                for k in range(seeds)
                if integrator in settings.integrators
            ]
        steps = MATRIX_STEPS[settings.quick]
        made += [Measurement(f"matrix/{k}", functools.partial(matrix.measure, k, steps)) for k in matrix.KINDS]
        return made

    def headlines(self, results: Results) -> list[str]:
        """Whether ``auto`` is in the red anywhere."""
        of_auto = {name: one[AUTO] for name, one in _maps(results).items() if AUTO in one}
        if not of_auto:
            return []
        red = {name: len(maps.bad_cells(one)) for name, one in of_auto.items() if maps.bad_cells(one)}
        if red:
            where = ", ".join(f"{name} ({count} cells)" for name, count in red.items())
            return [f"`auto` is wrong or diverges on {len(red)} of {len(of_auto)} stability maps: {where}."]
        every = [outcome for one in of_auto.values() for outcome in maps.outcomes(one)]
        worst = max(maps.worst_error(one) for one in of_auto.values())
        refused = every.count(Outcome.REFUSED)
        return [
            f"`auto` is never wrong and never diverges on {len(of_auto)} stability maps with {len(every)} cells, of "
            f"which it refuses {refused}; its largest error is {worst:.1e} of the motion's own scale."
        ]

    def render(self, results: Results, folder: Path) -> list[Block]:
        """A picture with its sentence for every map, then the long runs and the matrix."""
        blocks: list[Block] = [Paragraph(_how_to_read())]
        of_maps = _maps(results)
        for name, measured in of_maps.items():
            blocks += _map_blocks(name, measured, folder)
        if of_maps:
            blocks.append(_summary(of_maps))
            _write_cells(of_maps, folder)
        return blocks + _long_run_blocks(results, folder) + _matrix_blocks(results, folder)


def _how_to_read() -> str:
    return (
        "A cell is one run. Stable and accurate (•): its error is at most "
        f"{ACCURATE:g} of the motion's own length, angle, speed and spin. Stable but wrong (▼): larger. Diverged (×): "
        "faster than a hundred times the true motion, or beyond the range of floats. Refused (–): the integrator says "
        "that it cannot, and why. Those that refuse a whole map have no panel."
    )


def _map(name: str, integrator: str, quick: bool) -> Result:
    return maps.measure(MAPS[name](quick), integrator)


def _maps(results: Results) -> dict[str, dict[str, Result]]:
    """Results by map and integrator, in the order of the page, of the maps that have any."""
    found: dict[str, dict[str, Result]] = {name: {} for name in MAPS}
    for key, result in finished(results, "map/").items():
        _, name, integrator = key.split("/")
        found[name][integrator] = result
    return {name: one for name, one in found.items() if any(map(maps.takes_part, one.values()))}


def _map_blocks(name: str, measured: dict[str, Result], folder: Path) -> list[Block]:
    drawn = MAPS[name](False)
    return [
        Heading(drawn.title),
        plots.draw_map(drawn, measured, folder, f"stability_{name}", drawn.text),
        Paragraph(maps.conclusion(drawn, measured)),
    ]


def _summary(of_maps: dict[str, dict[str, Result]]) -> Table:
    """Outcomes counted, by map and integrator."""
    rows = []
    for name, measured in of_maps.items():
        for integrator, one in measured.items():
            found = maps.outcomes(one)
            counts = [found.count(outcome) for outcome in Outcome]
            rows.append((name, integrator, *counts, maps.worst_error(one) if counts[0] else None))
    columns = ("map", "integrator", *(outcome.value for outcome in Outcome), "largest error where accurate")
    return Table("stability_maps", columns, rows, "Cells of all maps, by outcome.")


def _write_cells(of_maps: dict[str, dict[str, Result]], folder: Path) -> None:
    """Every cell, with what was said where a run stopped."""
    with (folder / "stability_cells.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(("map", "integrator", "row", "column", "outcome", "error", "said"))
        for name, measured in of_maps.items():
            for integrator, one in measured.items():
                for cell in maps.flat(one):
                    place = (cell["row"], cell["column"])
                    writer.writerow((name, integrator, *place, cell["outcome"], cell["error"], cell["said"]))


def _long_runs(results: Results, what: str) -> dict[str, tuple[list[int], list[float]]]:
    """Steps and root mean square errors by integrator."""
    runs: dict[str, list[Result]] = {}
    for key, result in finished(results, f"long_run/{what}/").items():
        runs.setdefault(key.split("/")[2], []).append(result)
    return {integrator: long_run.together(each) for integrator, each in runs.items()}


def _long_run_blocks(results: Results, folder: Path) -> list[Block]:
    energy, attitude = _long_runs(results, "energy"), _long_runs(results, "attitude")
    if not (energy and attitude):
        return []
    picture = plots.draw_growth(
        ("energy error, relative", [(name, *one) for name, one in energy.items()]),
        ("attitude error [rad]", [(name, *one) for name, one in attitude.items()]),
        folder,
        "stability_long_run",
        f"Steps of {long_run.SPIN / long_run.RATE:g} rad. Left: a heavy asymmetric top, whose energy is constant. "
        f"Right: a symmetric body without torque, against its closed form at {long_run.DIGITS} digits. Root mean "
        "square of runs from random states; grey lines: growth as the powers of n written at them.",
    )
    said = [growth_sentence("energy", energy), growth_sentence("attitude", attitude)]
    return [Heading("Many steps: how errors grow"), picture, Paragraph(" ".join(said))]


def growth_sentence(what: str, runs: dict[str, tuple[list[int], list[float]]]) -> str:
    """How the error of each integrator grows."""
    parts, faster = [], []
    for name, (steps, errors) in runs.items():
        power = long_run.exponent(steps, errors, steps[-1] // SETTLED)
        growth = f"growing as n^{power:.2f}" if power > NOT_GROWING else "not growing"
        parts.append(f"`{name}` {errors[-1]:.1e} after {steps[-1]:.0e} steps, {growth}")
        faster += [f"`{name}`"] * (power > LAW[what] + SCATTER)
    unit = " [rad]" if what == "attitude" else ""
    law = f"round-off alone would grow as n^{LAW[what]:g} (Brouwer's law)"
    kept = f"faster than that, so by something systematic: {', '.join(faster)}" if faster else "none grows faster"
    return (
        f"Error of the {what}{unit}: {'; '.join(parts)}. The powers are those of the last two decades; {law}; {kept}."
    )


def _matrix_blocks(results: Results, folder: Path) -> list[Block]:
    measured = {key.split("/")[1]: result for key, result in finished(results, "matrix/").items()}
    if set(measured) != set(matrix.KINDS):
        return []
    picture = plots.draw_decay(
        measured,
        folder,
        "stability_matrix",
        f"The same explicit Euler step of {matrix.H * matrix.SPIN:g} rad for a rotation matrix and a quaternion. Left: "
        "|det R − 1|, or ||q|² − 1|; right: attitude error of the nearest rotation, where the two lines of a pair lie "
        "on each other.",
    )
    return [Heading("A rotation matrix and a quaternion"), picture, Paragraph(matrix_sentence(measured))]


def matrix_sentence(measured: dict[str, Result]) -> str:
    """Whether theory 2.7's claim holds: what becomes of each after the last step."""
    plain, righted, quaternion, normalised = (measured[kind] for kind in matrix.KINDS)
    stretched, shared = plain["departures"][-1], quaternion["departures"][-1]
    kept = max(righted["departures"] + normalised["departures"])
    error, less = righted["errors"][-1], normalised["errors"][-1]
    return (
        f"After {plain['angles'][-1]:.3g} rad the matrix's determinant is off by {stretched:.2g} and the quaternion's "
        f"squared length by {shared:.2g}, {stretched / shared:.2g} times less: both decay where nothing is done, but "
        "the quaternion's length can be divided out at any time and changes no attitude. Made rotations again after "
        f"each step, both stay so to {kept:.0e}; that does not mend the attitude, by which the matrix is off by "
        f"{error:.2g} rad, {error / less:.2g} times as far as the quaternion."
    )
