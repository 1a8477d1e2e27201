"""Entry point of rigid_body_report: measure, keep every result, draw, and write the page."""

import argparse
import contextlib
import importlib
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from .. import integrators
from ..command_line import INTERRUPTED, Parser
from ..kernels import compiled
from . import machine, page, peers
from .error_section import ErrorSection
from .left_out_section import LeftOut
from .many_bodies_section import ManyBodies
from .problems import TITLES
from .section import FAILED, Measurement, Result, Results, Section, Settings
from .stability_section import Stability
from .store import Store, StoreError

SECTIONS: tuple[Section, ...] = (ErrorSection(), Stability(), LeftOut(), ManyBodies())
HOW_TO_INSTALL = "pip install matplotlib mpmath tqdm"


def main(arguments: Sequence[str] | None = None) -> int:
    """Make the report. Returns the exit status: 0, 1 when it could not be made, 130 after Ctrl-C."""
    given = sys.argv[1:] if arguments is None else list(arguments)
    options = _parser().parse_args(given)
    try:
        _make(options, given)
    except KeyboardInterrupt:
        print("\nrigid_body_report: interrupted; the same command with --resume goes on", file=sys.stderr)
        return INTERRUPTED
    except ImportError as reason:
        print(f"rigid_body_report: {reason}; {HOW_TO_INSTALL}", file=sys.stderr)
        return 1
    except (OSError, ValueError, StoreError) as reason:
        print(f"rigid_body_report: {reason}", file=sys.stderr)
        return 1
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = Parser(
        "rigid_body_report",
        "Measures this package's integrators and other simulators, and writes a page with pictures, tables "
        "and every number into a folder. Every finished measurement is kept at once.",
        epilog=f"Peers {peers.told()}",
    )
    parser.add_argument("--quick", action="store_true", help="under a minute, with fewer points; else under 20 minutes")
    parser.add_argument("--out", type=Path, default=Path("rigid_body_report"), help="the folder (default %(default)s)")
    parser.add_argument("--resume", action="store_true", help="go on with what the folder has already")
    parser.add_argument(
        "--node-bench", type=Path, metavar="JSON", help="figures that `make bench-node` wrote, to be shown"
    )
    parser.add_argument("--seed", type=int, default=1, help="of all random choices (default %(default)s)")
    for name, choices, what in (
        ("only", [section.name for section in SECTIONS], "sections"),
        ("integrators", integrators.CHOICES, "integrators"),
        ("problems", list(TITLES), "problems of the section error"),
        ("peers", [*peers.names(), "none"], "other simulators and libraries"),
    ):
        parser.add_argument(
            f"--{name}", type=_names(choices), metavar="A,B", help=f"{what}, of: {', '.join(choices)} (default: all)"
        )
    return parser


def _names(choices: Sequence[str]) -> Callable[[str], tuple[str, ...]]:
    def read(text: str) -> tuple[str, ...]:
        given = tuple(filter(None, text.split(",")))
        if wrong := [name for name in given if name not in choices]:
            raise argparse.ArgumentTypeError(f"{wrong[0]!r} is not known; choose from {', '.join(choices)}")
        return given

    return read


def _make(options: argparse.Namespace, given: Sequence[str]) -> None:
    for needed in ("matplotlib", "tqdm"):  # missing is told before minutes of measuring, not after
        importlib.import_module(needed)
    settings = Settings(
        options.quick,
        options.seed,
        options.integrators or integrators.CHOICES,
        options.problems,
        () if options.peers == ("none",) else options.peers,
        options.node_bench,
    )
    sections = [section for section in SECTIONS if options.only is None or section.name in options.only]
    about = {"quick": settings.quick, "seed": settings.seed, "kernels": compiled.sources_digest()}
    store = Store(options.out, about, options.resume)
    wanted = [(section, one) for section in sections for one in section.measurements(settings)]
    _measure(store, wanted)
    keys = {f"{section.name}/{one.key}" for section, one in wanted}
    _write(
        options.out, sections, {key: store.results[key] for key in store.results if key in keys}, options.seed, given
    )
    print(f"{options.out / 'report.html'}")


def _measure(store: Store, wanted: Sequence[tuple[Section, Measurement]]) -> None:
    left = [(f"{section.name}/{one.key}", one) for section, one in wanted]
    left = [(key, one) for key, one in left if key not in store.results]
    with _progress(sum(one.weight for _, one in left)) as bar:
        for key, one in left:
            bar.set_description(key[:38].ljust(38))
            store.add(key, _result(one))
            bar.update(one.weight)


@contextlib.contextmanager
def _progress(total: float) -> Iterator[Any]:
    from tqdm import tqdm

    shape = "{desc} {percentage:3.0f}%|{bar}| {elapsed} gone, {remaining} left"
    with tqdm(total=total, bar_format=shape, smoothing=0.05, file=sys.stderr) as bar:
        yield bar


def _result(measurement: Measurement) -> Result:
    """Its result, or what it raised: one measurement that fails does not end the others."""
    try:
        return measurement.run()
    except Exception as reason:
        return {FAILED: f"{type(reason).__name__}: {reason}"}


def _write(folder: Path, sections: Sequence[Section], results: Results, seed: int, given: Sequence[str]) -> None:
    chapters, headlines = [], []
    for section in sections:
        prefix = f"{section.name}/"
        mine = {key[len(prefix) :]: result for key, result in results.items() if key.startswith(prefix)}
        headlines += section.headlines(mine)
        chapters.append((section.title, section.render(mine, folder)))
    page.write(folder, machine.facts(given, seed), headlines, chapters)


if __name__ == "__main__":
    sys.exit(main())
