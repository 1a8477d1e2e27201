"""Many runs of one bag, a grid of parameters: in processes of this machine or on a Dask cluster, a row of CSV each."""

import contextlib
import csv
import functools
import hashlib
import io
import itertools
import json
import math
import os
import pickle
import re
import signal
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent import futures
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__, first_start, integrators
from ..bags.rosbags_support import BagError
from ..kernels import compiled
from ..kernels.arrays import Floats
from ..resim import resimulating, together
from ..resim.comparison import Comparison
from ..scenarios.scenario import Scenario
from ..scene import schema
from ..scene.loader import Scene
from ..simulation import SimulationError
from ..values.parameter import TYPES

RESULTS = ("position_max", "position_rms", "attitude_max", "attitude_rms", "state", "refusal")
CONNECT_WITHIN = 10.0  # s
TELL_EVERY = 30.0  # s, how far the runs are, where no terminal shows a bar
WITHOUT_EFFECT = (  # parameters on which the motion does not depend
    "publish_rate",
    "real_time_factor",
    "realtime_priority",
    "world_frame_id",
    "twist_frame",
    "body.frame_id",
    "record.path",
)
IN_JOURNAL = ("wrench.", "frames.", "steps_per_command")  # begins of names of those whose effect a journal has noted
MOST_RUNS = 1_000_000
_VARIED = re.compile(r"(?P<name>[^\[\]=]+)(\[(?P<index>\d+)\])?=(?P<values>.+)")

Values = tuple[Any, ...]  # of the varied parameters, in the order of the variations
Work = tuple[Scenario, Scene, "Sequence[Variation]"]
Outcome = tuple[Values, "dict[str, Any] | None", str]  # results, or why the run was lost
Runs = Callable[[Work, Sequence[Values]], Iterator[Outcome]]


@dataclass(frozen=True)
class Variation:
    """The values that one parameter takes, or one entry of an array."""

    text: str  # as given
    name: str
    index: int | None
    values: Values

    @property
    def column(self) -> str:
        """What stands above its values."""
        return self.name if self.index is None else f"{self.name}[{self.index}]"


def variation(text: str) -> Variation:
    """The variation that ``name=first:last:count`` or ``name[index]=a,b,c`` asks for.

    Raises ValueError for what is no such text, a parameter that is unknown or does not change the motion, and values
    that it cannot have, whatever the others are, or that are the same.
    """
    match = _VARIED.fullmatch(text)
    if match is None:
        raise ValueError(f"--vary {text}: is not NAME=first:last:count or NAME=a,b,c; give one such as body.mass=1:3:9")
    name, index = match["name"], None if match["index"] is None else int(match["index"])
    parameter = schema.find(name)
    if name in WITHOUT_EFFECT:
        raise ValueError(f"--vary {text}: {name} does not change the motion; give a parameter that does")
    if (parameter.type is tuple) != (index is not None):
        entry = f"one entry, such as {name}[0]=..." if parameter.type is tuple else f"no [{index}]: it is no array"
        raise ValueError(f"--vary {text}: give {entry}")
    if index is not None and parameter.length and index >= parameter.length:
        raise ValueError(f"--vary {text}: {name} has the entries 0 to {parameter.length - 1}")
    one = parameter if index is None else replace(parameter, type=float, length=None)
    column = name if index is None else f"{name}[{index}]"
    values = tuple(one.read(column, value) for value in _values(text, match["values"], parameter.type))
    _check_values(text, name, values)
    return Variation(text, name, index, values)


def _check_values(text: str, name: str, values: Values) -> None:
    if name == "integrator.name" and (unknown := [value for value in values if value not in integrators.CHOICES]):
        raise ValueError(f"parameter integrator.name = {unknown[0]!r}: give {integrators.RULE}")
    twice = [first for first, second in itertools.pairwise(sorted(values)) if first == second]
    if twice:
        raise ValueError(f"--vary {text}: has the value {twice[0]} twice; give each once")


def check(variations: Sequence[Variation]) -> None:
    """Raise ValueError for variations that do not make a grid: of the same parameter, or of too many runs."""
    columns = [varied.column for varied in variations]
    if twice := [column for column in columns if columns.count(column) > 1]:
        raise ValueError(f"--vary {twice[0]} is given twice; give all its values at once")
    count = math.prod(len(varied.values) for varied in variations)
    if count > MOST_RUNS:
        raise ValueError(f"--vary asks for {count} runs; give at most {MOST_RUNS}")


def _values(text: str, given: str, kind: type) -> Values:
    if kind is str:
        return tuple(given.split(","))
    if kind not in (int, float, tuple):
        raise ValueError(f"--vary {text}: is of type {TYPES[kind]}; numbers and texts can be varied")
    convert = int if kind is int else float
    try:
        if ":" not in given:
            return tuple(map(convert, given.split(",")))
        first, last, count = map(float, given.split(":"))
        if count < 1 or count != int(count) or not math.isfinite(first + last):
            raise ValueError
    except (ValueError, OverflowError):
        raise ValueError(f"--vary {text}: {given} is not first:last:count or numbers such as 1,2.5") from None
    if count > MOST_RUNS:
        raise ValueError(f"--vary {text}: asks for {count:.0f} runs; give at most {MOST_RUNS}")
    return tuple(map(convert, np.linspace(first, last, int(count)).tolist()))


def changed(scene: Scene, variations: Sequence[Variation], values: Values) -> Scene:
    """The scene with these values. Raises ValueError when they do not go together."""
    changes: dict[str, Any] = {}
    for varied, value in zip(variations, values, strict=True):
        if varied.index is None:
            changes[varied.name] = value
        else:
            array = changes.setdefault(varied.name, list(scene.given(varied.name)))
            if varied.index >= len(array):
                raise ValueError(
                    f"parameter {varied.name} has {len(array)} entries in this scene; there is no [{varied.index}]"
                )
            array[varied.index] = value
    return scene.changed(changes)


# The table ------------------------------------------------------------------------------------------------------------


class Table:
    """The CSV file: a comment that tells what was run, the names, and a row for each run, on the disk when it is done.

    ``rows`` are those there, by their varied values as text; ``grid`` is all that are wanted. A last row that was cut
    off is dropped. Raises ValueError for a file of another command, and for parameters that cannot be varied here.
    """

    def __init__(self, path: Path, scenario: Scenario, scene: Scene, variations: Sequence[Variation]):
        self.path, self.variations = path, variations
        columns = [varied.column for varied in variations]
        check(variations)
        if scenario.start is not None and any(column.startswith("initial.") for column in columns):
            raise ValueError(
                "--vary initial.*: the run starts from the recorded pose and twist; give --start scene, too"
            )
        if scenario.journal and (told := [column for column in columns if column.startswith(IN_JOURNAL)]):
            raise ValueError(
                f"--vary {told[0]}: the journal holds the commands as they took effect, so {told[0]} does not change "
                "the motion; give a parameter that does"
            )
        if "steps_per_command" in columns and not scene["lockstep"]:
            raise ValueError(
                "--vary steps_per_command: a command advances nothing in real time, so it does not change the motion; "
                "give a scene with lockstep"
            )
        self.grid = list(itertools.product(*(varied.values for varied in variations)))
        self._columns = [*columns, *RESULTS]
        self._about = {
            "vary": [varied.text for varied in variations],
            "bag": _digest(scenario),
            "scene": _digest(scene.values),
            "version": __version__,
            "kernels": compiled.sources_digest(),
        }
        self.rows: dict[tuple[str, ...], list[str]] = {}
        if path.is_dir():
            raise ValueError(f"--csv {path}: is a folder; give a file, such as {path / 'runs.csv'}")
        if not path.absolute().parent.is_dir():
            raise ValueError(f"--csv {path}: there is no such folder")
        if path.exists() and path.stat().st_size:
            self._read()
        else:
            self._write_lines([self._header(), _line(self._columns)], "w")

    def missing(self) -> list[Values]:
        """What is wanted and not there."""
        return [values for values in self.grid if _key(values) not in self.rows]

    def add(self, values: Values, results: dict[str, Any]) -> None:
        """Keep a row: when this returns, it is on the disk."""
        row = [*_key(values), *(_shown(results.get(name, "")) for name in RESULTS)]
        self._write_lines([_line(row)], "a")
        self.rows[_key(values)] = row

    def _header(self) -> str:
        return f"# {json.dumps(self._about)}\n"

    def _read(self) -> None:
        text = self.path.read_text(encoding="utf-8")
        first = text.partition("\n")[0]
        try:
            found = json.loads(first.removeprefix("# "))
            differing = [name for name in self._about if found.get(name) != self._about[name]]
        except (AttributeError, ValueError):
            raise ValueError(f"--csv {self.path}: is no table of runs; give a file that does not exist yet") from None
        if differing:
            raise ValueError(
                f"--csv {self.path}: is of another command, with another {' and '.join(differing)}; give another file"
            )
        whole = text[: text.rfind("\n") + 1]
        rows = list(csv.reader(io.StringIO(whole.partition("\n")[2])))[1:]
        self.rows = {tuple(row[: len(self.variations)]): row for row in rows if len(row) == len(self._columns)}
        lines = [self._header(), _line(self._columns), *map(_line, self.rows.values())]
        if "".join(lines) != text:
            replacement = self.path.with_name(f".{self.path.name}.new")
            replacement.write_text("".join(lines), encoding="utf-8")
            replacement.replace(self.path)

    def _write_lines(self, lines: Sequence[str], mode: str) -> None:
        with self.path.open(mode, encoding="utf-8") as file:
            file.writelines(lines)
            file.flush()
            os.fsync(file.fileno())


def _line(row: Sequence[str]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(row)
    return text.getvalue()


def _key(values: Values) -> tuple[str, ...]:
    return tuple(map(_shown, values))


def _shown(value: Any) -> str:
    return repr(value) if isinstance(value, float) else " ".join(str(value).split())


def _digest(content: Any) -> str:
    """Of a scenario, or of parameters: the same for the same content, on every run."""
    digest = hashlib.sha256()
    for name, value in sorted(vars(content).items() if isinstance(content, Scenario) else content.items()):
        digest.update(f"{name}:".encode())
        if name not in ("notes",):
            digest.update(_bytes(value))
    return digest.hexdigest()[:16]


def _bytes(value: Any) -> bytes:
    if isinstance(value, np.ndarray):
        return "\n".join(value).encode() if value.dtype == object else value.tobytes()
    if hasattr(value, "__dict__"):
        return b"".join(_bytes(part) for part in vars(value).values())
    return repr(getattr(value, "values", value)).encode()


# Running --------------------------------------------------------------------------------------------------------------


def run(table: Table, scenario: Scenario, scene: Scene, runs: Runs) -> list[str]:
    """Run what the table lacks and show how far it is. Returns why runs were lost, for each that was."""
    from tqdm import tqdm

    missing, lost, told = table.missing(), [], time.monotonic()
    with tqdm(total=len(table.grid), initial=len(table.rows), unit="run", file=sys.stderr, disable=None) as bar:
        for values, results, why in runs((scenario, scene, table.variations), missing) if missing else ():
            if results is None:
                lost.append(why)
            else:
                table.add(values, results)
            bar.update()
            if bar.disable and time.monotonic() - told >= TELL_EVERY:
                print(f"rigid_body_resim: {len(table.rows)} of {len(table.grid)} runs", file=sys.stderr, flush=True)
                told = time.monotonic()
    return lost


def some_runs(work: Work, wanted: Sequence[Values]) -> list[dict[str, Any]]:
    """The results of runs that take the commands alike, as the bodies of an ensemble where that can be."""
    _warm()
    scenario, scene, variations = work
    try:
        scenes = [changed(scene, variations, values) for values in wanted]
        outcomes = together.run(scenario, scenes) if len(wanted) > 1 and compiled.ENABLED else None
    except ValueError:
        outcomes = None
    if outcomes is None:
        return [one_run(work, values) for values in wanted]
    return [_results(scenario, one.poses, one.state, one.refusal) for one in outcomes]


def _results(scenario: Scenario, poses: Floats, state: str, refusal: str = "") -> dict[str, Any]:
    if refusal:
        return {"refusal": refusal}
    if scenario.recorded is None:
        return {"state": state}
    return {**Comparison(scenario.stamp_ns, scenario.recorded, poses).figures(), "state": state}


def one_run(work: Work, values: Values) -> dict[str, Any]:
    """The results of one run; a sentence in place of them when it is refused or fails."""
    scenario, scene, variations = work
    try:
        track = resimulating.run(scenario, changed(scene, variations, values))
    except (BagError, SimulationError, ValueError) as reason:
        return {"refusal": str(reason)}
    return _results(scenario, track.poses, track.state)


def batches(work: Work, wanted: Sequence[Values], workers: int) -> list[list[Values]]:
    """What is given to a worker at a time: runs that take the commands alike, of which few are lost with a worker."""
    scenario, _, variations = work
    alike: dict[Values, list[Values]] = {}
    for values in wanted:
        key = tuple(
            v for varied, v in zip(variations, values, strict=True) if not varied.name.startswith(together.OF_A_BODY)
        )
        alike.setdefault(key, []).append(values)
    size = max(1, min(together.most(scenario), len(wanted) // (2 * workers)))
    return [group[first : first + size] for group in alike.values() for first in range(0, len(group), size)]


@functools.cache
def _warm() -> None:
    """Once a worker, before its first run: then no run waits for a compiler."""
    for requests in first_start.of_parameters({}):
        first_start.compile_together(requests)


_work: Work | None = None  # of a worker process


def _begin(work: Work) -> None:
    global _work
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGTERM})
    _work = work
    _warm()


def _some_runs_here(wanted: Sequence[Values]) -> list[dict[str, Any]]:
    assert _work is not None  # since _begin
    return some_runs(_work, wanted)


def processes(count: int) -> Runs:
    """Runs in so many processes of this machine."""

    def runs(work: Work, wanted: Sequence[Values]) -> Iterator[Outcome]:
        pool = futures.ProcessPoolExecutor(min(count, len(wanted)), get_context("spawn"), _begin, (work,))
        try:
            with _signals_put_off():
                running = {pool.submit(_some_runs_here, some): some for some in batches(work, wanted, count)}
            for future in futures.as_completed(running):
                yield from _outcomes(future, running[future])
        finally:
            pool.shutdown(cancel_futures=True)

    return runs


@contextlib.contextmanager
def _signals_put_off() -> Iterator[None]:
    """Ctrl-C and SIGTERM are heard at the end, and never by processes that start meanwhile: this one ends them.

    Python itself has no quiet answer to Ctrl-C while it imports what a new process needs. The mask is for those
    processes, which inherit it; here another thread, such as one of numpy's, may take the signal all the same.
    """
    numbers, heard = (signal.SIGINT, signal.SIGTERM), list[int]()
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, numbers)
    handlers = {number: signal.signal(number, lambda taken, _: heard.append(taken)) for number in numbers}
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        for taken in heard[:1]:  # what one of them asks for is what they all do
            signal.raise_signal(taken)


def dask(address: str) -> Runs:
    """Runs on the Dask cluster whose scheduler has that address. What a worker that dies had begun, others do again."""

    def runs(work: Work, wanted: Sequence[Values]) -> Iterator[Outcome]:
        with _client(address) as client:
            from distributed import as_completed

            # Data that is part of a task: unlike scattered data, the scheduler can have it made again.
            warnings.filterwarnings("ignore", message="Sending large graph")
            shared = client.submit(pickle.loads, pickle.dumps(work), pure=False)
            several = batches(work, wanted, len(client.nthreads()))
            running = {client.submit(some_runs, shared, some, pure=False): some for some in several}
            for future in as_completed(running):
                yield from _outcomes(future, running[future])

    return runs


@contextlib.contextmanager
def _client(address: str) -> Iterator[Any]:
    """A client of the cluster, whose workers have been seen to have this very package."""
    try:
        from distributed import Client
    except ImportError as reason:
        raise ValueError(
            f"--dask needs the package distributed ({reason}); pip install '.[dask]' in the folder of rigid_body_sim"
        ) from None
    try:
        client = Client(address, timeout=CONNECT_WITHIN)
    except (OSError, ValueError, TypeError) as reason:
        raise ValueError(
            f"--dask {address}: no scheduler answers there ({reason}); start one with `dask scheduler`"
        ) from None
    with client:
        mine = about()
        try:
            theirs = client.run(about)
        except Exception as reason:  # whatever importing the package raises there
            raise ValueError(
                f"--dask {address}: a worker cannot import this package ({reason}); install it there"
            ) from None
        if not theirs:
            raise ValueError(f"--dask {address}: the cluster has no workers; start some with `dask worker {address}`")
        if others := [worker for worker, its in theirs.items() if its != mine]:
            raise ValueError(
                f"--dask {address}: worker {others[0]} has {theirs[others[0]]}, here is {mine}; install the same"
            )
        yield client


def about() -> str:
    """What decides the bits of a result."""
    return f"rigid_body_sim {__version__} with kernels {compiled.sources_digest()}"


def _outcomes(future: Any, wanted: Sequence[Values]) -> Iterator[Outcome]:
    try:
        results = future.result()
    except Exception as reason:  # the runs themselves tell what they refuse: here a process or a machine has failed
        yield from ((values, None, f"{type(reason).__name__}: {reason}") for values in wanted)
    else:
        yield from ((values, one, "") for values, one in zip(wanted, results, strict=True))
