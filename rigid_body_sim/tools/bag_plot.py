"""What rigid_body_plot does: draws the motion that a bag has recorded. It simulates nothing."""

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from ..bags.reading import read
from ..bags.rosbags_support import HOW_TO_INSTALL, BagError
from ..command_line import INTERRUPTED, Parser
from ..runs import plot
from ..scenarios import scenario, several
from ..scenarios.motion import Command, RecordedMotion, motion_in
from ..scene.fleet import load_any
from ..scene.loader import Scene
from ..scene.schema import one_line
from ..theory import invariants
from . import bag_options, picture

NAME = "rigid_body_plot"
DRAWN, FAILED = 0, 1
MOST_ACTUATORS = len(plot.COLOURS)


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw what the command line asks for. Returns the exit status: 0 drawn, 1 failed, 130 stopped."""
    try:
        return _draw(_parser().parse_args(arguments))
    except KeyboardInterrupt:
        text, status = "interrupted", INTERRUPTED
    except ImportError as reason:
        text, status = f"{reason}; {HOW_TO_INSTALL}", FAILED
    except (BagError, OSError, ValueError) as reason:
        text, status = one_line(reason), FAILED
    print(f"{NAME}: {text}", file=sys.stderr)
    return status


def _parser() -> argparse.ArgumentParser:
    parser = Parser(
        NAME,
        "Draws the motion in a bag over time: position, attitude, velocities, what was commanded, and the energy where "
        "the scene is known. Exit status: 0 drawn, 1 an error, 130 after Ctrl-C.",
        wrong=FAILED,
    )
    parser.add_argument("bag", type=Path, metavar="BAG", help="its folder, or a lone .mcap or .db3 file")
    parser.add_argument(
        "--out",
        type=Path,
        action="append",
        metavar="FILE",
        help="picture to write, .png, .svg or .pdf; may be given several times (default: BAG.png in this folder)",
    )
    bag_options.add(parser)
    return parser


def _draw(options: argparse.Namespace) -> int:
    pictures = options.out or [Path(f"{picture.stem(options.bag)}.png")]
    for path in pictures:
        picture.check(path, "--out")
    bag = read(options.bag, recover=options.recover)
    scene = scenario.scene_of(bag) if options.scene is None else load_any(options.scene, options.node)
    for name, part, its_scene in several.each(bag, scene, options.body):
        motion = motion_in(part, its_scene or Scene(), options.pose)
        for sentence in _sentences(motion, its_scene):
            print(f"  {sentence}")
        title = f"{options.bag.name}: {motion.topic}, {len(motion)} poses"
        figure = plot.stacked(list(panels(motion, its_scene)), title)
        for path in pictures:
            own = picture.of_body(path, name)
            picture.save(figure, own)
            print(f"Picture: {own}")
    return DRAWN


def _sentences(motion: RecordedMotion, scene: Scene | None) -> Iterator[str]:
    """What the picture does not tell."""
    yield from motion.notes
    if not motion.measured:
        yield f"No twist has the stamps of {motion.topic}: velocities are differences of the poses."
    if scene is None:
        yield "The energy is not drawn: no journal tells mass and inertia; give --scene."
    for command in motion.actuators:
        if command.values.shape[1] > MOST_ACTUATORS:
            yield f"Of {command.values.shape[1]} actuators on {command.topic} the first {MOST_ACTUATORS} are drawn."


def panels(motion: RecordedMotion, scene: Scene | None) -> Iterator[plot.Panel]:
    """All panels of a motion; that of the energy where the scene of the body is known."""
    time = motion.time
    yield from plot.poses(time, motion)
    yield plot.Panel("velocity\n[m/s, world axes]", time, motion.velocity, plot.AXES)
    yield plot.turning(time, motion)
    for wrench in motion.wrenches:
        yield from _wrench(wrench, motion)
    for command in motion.actuators:
        names = scene["actuators.names"] if scene is not None else ()
        yield _actuators(command, names, motion)
    if scene is not None:
        terms = scene.terms()
        kinetic, potential = invariants.energy_of_motion(terms, motion), invariants.potential_energy(terms, motion)
        yield plot.energy(time, kinetic, potential)


def _named(command: Command, motion: RecordedMotion) -> str:
    """Its topic, without the namespace that it has in common with the poses."""
    return command.topic.removeprefix(motion.topic.rpartition("/")[0] + "/")


def _wrench(wrench: Command, motion: RecordedMotion) -> Iterator[plot.Panel]:
    for name, unit, part in (("force", "N", slice(0, 3)), ("torque", "N m", slice(3, 6))):
        where = ", ".join(filter(None, (unit, *wrench.frames)))
        title = f"{name} on {_named(wrench, motion)}\n[{where}]"
        yield plot.Panel(title, wrench.time, wrench.values[:, part], plot.AXES, held=True)


def _actuators(command: Command, names: Sequence[str], motion: RecordedMotion) -> plot.Panel:
    drawn = command.values[:, :MOST_ACTUATORS]
    if len(names) != command.values.shape[1]:
        names = [f"number {i}" for i in range(command.values.shape[1])]
    lines = list(zip(names, plot.COLOURS, strict=False))
    return plot.Panel(f"commands on\n{_named(command, motion)}", command.time, drawn, lines, held=True)


if __name__ == "__main__":
    sys.exit(main())
