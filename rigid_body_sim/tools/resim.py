"""What rigid_body_resim does: simulate again what a bag holds, write it, compare, draw, or vary the scene."""

import argparse
import contextlib
import math
import os
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple, TypeGuard

from ..bags.journal import read as read_journal
from ..bags.reading import Bag, read
from ..bags.rosbags_support import HOW_TO_INSTALL, BagError
from ..command_line import INTERRUPTED, Parser
from ..resim import resimulating
from ..resim.comparison import Comparison, Tolerance
from ..scenarios import scenario as scenarios
from ..scenarios import several, timing
from ..scenarios.command_feed import Progress
from ..scenarios.scenario import Choices, Scenario
from ..scenarios.topics import A_POSE, there
from ..scene.fleet import FleetScene, load_any
from ..scene.loader import Scene
from ..scene.schema import one_line
from ..simulation import SimulationError
from . import bag_options, picture, resim_output, resim_plot, sweep
from .resim_output import Run

SAME, FAILED, DIFFERS = 0, 1, 2
USUAL_TOLERANCE = Tolerance(1e-9, 1e-9)


class Prepared(NamedTuple):
    """What a bag holds of one body; ``name`` is empty where it is the only one."""

    name: str
    bag: Bag
    scene: Scene
    scenario: Scenario


def main(arguments: Sequence[str] | None = None) -> int:
    """Do what the command line asks for. Returns the exit status: 0 same, 1 failed, 2 differs, 130 stopped."""
    options = None
    try:
        options = _parser().parse_args(arguments)
        return _vary(options) if options.vary else _simulate_again(options)
    except KeyboardInterrupt:
        text, status = "interrupted", INTERRUPTED
        if options is not None and options.vary:
            text += "; the same command goes on with the runs that are left"
    except ImportError as reason:
        text, status = f"{reason}; {HOW_TO_INSTALL}", FAILED
    except (BagError, OSError, SimulationError, ValueError) as reason:
        text, status = one_line(reason), FAILED
    print(f"rigid_body_resim: {text}", file=sys.stderr)
    return status


def _parser() -> argparse.ArgumentParser:
    parser = Parser(
        "rigid_body_resim",
        "Simulates again, offline and at full speed, what a bag holds, and compares with the poses in it. "
        "Exit status: 0 the same within the tolerance, 2 different, 1 an error, 130 after Ctrl-C or SIGTERM.",
        wrong=FAILED,
    )
    parser.add_argument("bag", type=Path, metavar="IN", help="a bag: its folder, or a lone .mcap or .db3 file")
    bag_options.add(parser)
    parser.add_argument(
        "--out",
        type=Path,
        metavar="BAG",
        help="write pose and twist at the recorded stamps, as a bag; compares only with --compare",
    )
    parser.add_argument(
        "--compare",
        action="store_true",
        help="compare with the recorded poses (what is done when nothing else is asked)",
    )
    parser.add_argument(
        "--plot",
        type=Path,
        nargs="?",
        const=Path(),
        metavar="FILE",
        help="compare, and draw the errors, or the motion where all is equal (default: IN.png in this folder)",
    )
    parser.add_argument(
        "--tolerance",
        type=_distance,
        nargs=2,
        metavar=("M", "RAD"),
        help="compare: position [m] and attitude [rad] within which poses count as the same "
        f"(default {USUAL_TOLERANCE.position:g} {USUAL_TOLERANCE.attitude:g})",
    )
    parser.add_argument(
        "--topic",
        action="append",
        default=[],
        metavar="NAME",
        help="topic with commands (default: those of wrench.topics, or the only one); several times for several",
    )
    parser.add_argument(
        "--times",
        choices=(timing.HEADER, timing.RECEIVE),
        help="when commands took effect: by the stamps in their headers, or as received (default: header stamps that "
        "can be right, else as received)",
    )
    parser.add_argument(
        "--start",
        choices=(scenarios.SCENE, scenarios.BAG),
        help="initial state: the scene's, or the first recorded pose and twist (default: the scene's when the first "
        "pose is that)",
    )
    group = parser.add_argument_group("many runs")
    group.add_argument(
        "--vary",
        action="append",
        default=[],
        metavar="NAME=VALUES",
        help="run every value of a parameter of the scene, first:last:count or a,b,c; several times for a grid",
    )
    group.add_argument(
        "--csv",
        type=Path,
        metavar="FILE",
        help="a row for each run (default: IN.csv in the working directory); goes on with it",
    )
    group.add_argument("--workers", type=_count, metavar="N", help="processes (default: one for each processor)")
    group.add_argument("--dask", metavar="ADDRESS", help="run on the Dask cluster whose scheduler is there")
    return parser


def _distance(text: str) -> float:
    with contextlib.suppress(ValueError):
        if 0.0 <= float(text) < math.inf:
            return float(text)
    raise argparse.ArgumentTypeError(f"{text} is not a finite number of at least 0")


def _count(text: str) -> int:
    with contextlib.suppress(ValueError):
        if int(text) > 0:
            return int(text)
    raise argparse.ArgumentTypeError(f"{text} is not a whole number of at least 1")


# One run --------------------------------------------------------------------------------------------------------------


def _simulate_again(options: argparse.Namespace) -> int:
    for name in ("csv", "workers", "dask"):
        if getattr(options, name) is not None:
            raise ValueError(f"--{name} is for many runs; give --vary, too")
    drawing = _picture(options)
    compared = options.compare or drawing is not None or options.tolerance is not None or options.out is None
    if options.out is not None:
        resim_output.check(options.out)
    bag, scene, prepared = _prepared(options)
    for one in prepared:
        _need_poses(one, compared)
    runs = _together(bag, scene, prepared) if _are_linked(scene) else [_again(one) for one in prepared]
    if options.out is not None:
        resim_output.write(options.out, runs)
        print(f"Written: {options.out}")
    return max([SAME, *(_compare(run, options, drawing) for run in runs if compared)])


def _need_poses(prepared: Prepared, compared: bool) -> None:
    if compared and prepared.scenario.recorded is None:
        bag = prepared.bag
        raise BagError(
            f"{bag.path}: has no topic with poses to compare with, of type {A_POSE}; it has {there(bag)}; "
            "give --out alone"
        )


def _again(prepared: Prepared) -> Run:
    """Simulate one body again."""
    name, _, scene, scenario = prepared
    return Run(name, scenario, scene, _timed_run(scenario, scene))


def _are_linked(scene: Scene | FleetScene) -> TypeGuard[FleetScene]:
    return isinstance(scene, FleetScene) and bool(scene.links)


def _together(bag: Bag, scene: FleetScene, prepared: list[Prepared]) -> list[Run]:
    """Simulate all bodies again, as links hold some of them together."""
    if not bag.journal:
        raise BagError(f"{bag.path}: has no journal, which alone tells when what is linked was commanded; record one")
    begin = time.perf_counter()
    tracks = resimulating.run_together({one.name: one.scenario for one in prepared}, scene, read_journal(bag.journal))
    for one in prepared:
        _tell_run(tracks[one.name], one.scene, time.perf_counter() - begin)
    return [Run(one.name, one.scenario, one.scene, tracks[one.name]) for one in prepared]


def _picture(options: argparse.Namespace) -> Path | None:
    if options.plot is None:
        return None
    path = Path(f"{picture.stem(options.bag)}.png") if options.plot == Path() else options.plot
    picture.check(path, "--plot")
    return path


def _prepared(options: argparse.Namespace) -> tuple[Bag, Scene | FleetScene, list[Prepared]]:
    """Read the bag and say what is in it, of each body that is wanted."""
    bag = read(options.bag, recover=options.recover)
    if bag.journal and (options.topic or options.times or options.start):
        raise ValueError(
            "--topic, --times and --start are for bags without a journal, which this bag has; leave them out"
        )
    scene: Scene | FleetScene | None
    if options.scene is not None:
        scene, told = _scene_in(options.scene, options.node), f"Scene: {options.scene}."
    else:
        scene, told = scenarios.scene_of(bag), "Scene: as the node recorded it."
    if scene is None:
        scene, told = Scene(), "Scene: the node's defaults, because neither --scene nor a journal gives one."
    choices = Choices(tuple(options.topic), options.pose, options.times, options.start)
    prepared = []
    for name, part, its_scene in several.each(bag, scene, options.body):
        scenario = scenarios.prepare(part, its_scene, choices)
        _tell(part, scenario, told, name)
        prepared.append(Prepared(name, part, its_scene, scenario))
    return bag, scene, prepared


def _scene_in(path: Path, node: str) -> Scene | FleetScene:
    try:
        return load_any(path, node)
    except OSError as reason:
        raise ValueError(
            f"--scene {path}: cannot be read ({reason.strerror}); give a parameter file of the node"
        ) from None


def _tell(bag: Bag, scenario: Scenario, told: str, name: str) -> None:
    commands = _counted(len(scenario.journal) - 1, "journal entry", "journal entries")
    if scenario.commands is not None:
        commands = _counted(len(scenario.commands.values), "command", "commands")
        commands = f"{commands} on {', '.join(scenario.commands.topics)}" if scenario.commands.topics else "no commands"
    poses = "no poses"
    if scenario.recorded is not None:
        poses = f"{_counted(len(scenario.recorded), 'pose', 'poses')} on {scenario.pose_topic}"
    print(f"{bag.path}: {f'{name}: ' if name else ''}{commands}, {poses}")
    for sentence in (told, *scenario.notes):
        print(f"  {sentence}")


def _counted(count: int, one: str, more: str) -> str:
    return f"{count} {one if count == 1 else more}"


def _timed_run(scenario: Scenario, scene: Scene) -> resimulating.Track:
    begin = time.perf_counter()
    with _bar((int(scenario.stamp_ns.max()) - scenario.epoch_ns) / timing.NANOSECONDS) as progress:
        track = resimulating.run(scenario, scene, progress)
    _tell_run(track, scene, time.perf_counter() - begin)
    return track


def _tell_run(track: resimulating.Track, scene: Scene, seconds: float) -> None:
    if track.refused:
        commands = _counted(track.refused, "command is", "commands are")
        print(f"  {commands} left out, as the node does; the first: {track.reason}")
    print(
        f"Simulated {track.steps / scene['rate']:.9g} s, {track.steps} steps, in {seconds:.3g} s; state {track.state}"
    )


@contextlib.contextmanager
def _bar(total: float) -> Iterator[Progress]:
    from tqdm import tqdm

    shape = "simulated {n:.0f} of {total:.0f} s |{bar}| {elapsed} gone, {remaining} left"
    with tqdm(total=total, bar_format=shape, file=sys.stderr, disable=None, leave=False) as bar:
        yield lambda now: bar.update(min(now, total) - bar.n)


def _compare(run: Run, options: argparse.Namespace, drawing: Path | None) -> int:
    name, scenario, _, track = run
    tolerance = Tolerance(*options.tolerance) if options.tolerance else USUAL_TOLERANCE
    assert scenario.recorded is not None  # looked at before
    comparison = Comparison(scenario.stamp_ns, scenario.recorded, track.poses)
    if name:
        print(f"{name}:")
    if drawing is not None:
        path = picture.of_body(drawing, name)
        resim_plot.draw(
            comparison, tolerance, " ".join(filter(None, (options.bag.name, name, "simulated again"))), path
        )
        print(f"Picture: {path}")
    _tell_errors(comparison)
    status = _verdict(comparison, tolerance)
    if status == DIFFERS and track.doubt:
        print(f"  {track.doubt}")
    return status


def _tell_errors(comparison: Comparison) -> None:
    if (unequal := comparison.first_unequal) is None:
        print(f"Equal to the bit: {_counted(len(comparison.recorded), 'pose', 'poses')}")
        return
    print(f"Not equal to the bit from {_moment(comparison, unequal)} on")
    figures = comparison.figures()
    for what, unit, errors in (
        ("Position", "m", comparison.position_error),
        ("Attitude", "rad", comparison.attitude_error),
    ):
        largest = int(errors.argmax())
        rms, when = figures[f"{what.lower()}_rms"], comparison.time[largest]
        print(f"{what} error: rms {rms:.3g} {unit}, largest {errors[largest]:.3g} {unit} at {when:.6g} s")


def _verdict(comparison: Comparison, tolerance: Tolerance) -> int:
    diverged = comparison.divergence(tolerance)
    if diverged is None:
        print(f"Same within {tolerance}")
        return SAME
    print(
        f"Different: above {tolerance} from {_moment(comparison, diverged)} on, there by "
        f"{comparison.position_error[diverged]:.3g} m, {comparison.attitude_error[diverged]:.3g} rad"
    )
    return DIFFERS


def _moment(comparison: Comparison, index: int) -> str:
    return f"{comparison.time[index]:.9g} s (pose {index + 1}, stamp {comparison.stamp_ns[index]} ns)"


# Many runs ------------------------------------------------------------------------------------------------------------


def _vary(options: argparse.Namespace) -> int:
    for name in ("out", "plot", "tolerance"):
        if getattr(options, name) is not None:
            raise ValueError(f"--{name} is for one run; leave it or --vary out")
    if options.workers is not None and options.dask is not None:
        raise ValueError("--workers is for processes of this machine; leave it or --dask out")
    variations = [sweep.variation(text) for text in options.vary]
    sweep.check(variations)
    _, whole, prepared = _prepared(options)
    if _are_linked(whole):
        raise ValueError("--vary is for bodies without links, which are simulated one by one")
    if len(prepared) != 1:
        names = ", ".join(one.name for one in prepared)
        raise ValueError(f"--vary is for one body, and the bag has {names}; choose one with --body")
    ((_, _, scene, scenario),) = prepared
    path = options.csv or Path(f"{picture.stem(options.bag)}.csv")
    table = sweep.Table(path, scenario, scene, variations)
    runs = sweep.processes(options.workers or os.cpu_count() or 1) if options.dask is None else sweep.dask(options.dask)
    lost = sweep.run(table, scenario, scene, runs)
    print(f"Rows: {len(table.rows)} of {len(table.grid)}, in {path}")
    if lost:
        raise BagError(f"{len(lost)} runs were lost ({lost[0]}); the same command runs them again")
    return SAME
