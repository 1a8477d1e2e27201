"""Where results are kept: a line of JSON each, on the disk as soon as its measurement is finished."""

import json
import os
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .section import Result

FILE = "results.jsonl"


class StoreError(Exception):
    """Results that cannot be continued, as a sentence."""


class Store:
    """The results in one folder.

    The first line says what was measured (``about``); a run that continues must have the same, or StoreError says what
    differs. A last line that was cut off when the machine stopped is dropped. A run that begins anew in a folder with
    results puts those aside, under the time of the last of them.
    """

    def __init__(self, folder: Path, about: Mapping[str, Any], resume: bool):
        self.results: dict[str, Result] = {}
        self._path = folder / FILE
        folder.mkdir(parents=True, exist_ok=True)
        if resume and self._path.exists():
            self._read(dict(about))
        else:
            self._put_aside()
            self._write([{"about": about}])

    def _put_aside(self) -> None:
        if self._path.exists():
            when = time.strftime("%Y%m%dT%H%M%S", time.localtime(self._path.stat().st_mtime))
            aside, number = self._path.with_stem(f"{self._path.stem}-{when}"), 1
            while aside.exists():
                aside, number = self._path.with_stem(f"{self._path.stem}-{when}-{number}"), number + 1
            self._path.rename(aside)

    def add(self, key: str, result: Result) -> None:
        """Keep a result: when this returns, it is on the disk. Raises ValueError for infinity, NaN and a key taken."""
        if key in self.results:
            raise ValueError(f"measurement {key!r} has a result already; keys must differ")
        line = json.dumps({"key": key, "result": result}, allow_nan=False) + "\n"
        with self._path.open("a", encoding="utf-8") as file:
            file.write(line)
            file.flush()
            os.fsync(file.fileno())
        self.results[key] = json.loads(line)["result"]  # what a later run will read

    def _read(self, about: dict[str, Any]) -> None:
        *lines, cut_off = self._path.read_text(encoding="utf-8").split("\n")
        if not lines:
            return self._write([{"about": about}])
        found = json.loads(lines[0])["about"]
        if changed := [name for name in about if found.get(name) != about[name]]:
            said = ", ".join(f"{name} {found.get(name)!r}, now {about[name]!r}" for name in changed)
            raise StoreError(f"{self._path} was measured with {said}: leave out --resume, or give another folder")
        self.results = {entry["key"]: entry["result"] for entry in map(json.loads, lines[1:])}
        if cut_off:
            self._write([json.loads(line) for line in lines])
        return None

    def _write(self, entries: list[dict[str, Any]]) -> None:
        replacement = self._path.with_suffix(".new")
        replacement.write_text("".join(json.dumps(entry) + "\n" for entry in entries), encoding="utf-8")
        replacement.replace(self._path)
