"""A recording with a time line: played, stopped, moved to any moment, and saved as a page that plays by itself."""

import math
import os
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from ..kernels.arrays import Floats
from . import page
from .look import Look
from .moment import Recording, span
from .stage import Stage

SPEEDS = {"1/100": 0.01, "1/10": 0.1, "1/2": 0.5, "1": 1.0, "2": 2.0, "10": 10.0, "100": 100.0}
PERIOD = 1.0 / page.RATE
MOST_SAVED = 12_000  # pictures: ten minutes


class Player:
    """Recordings by the name of their body, on a page with a time line.

    ``url`` is the page's address. ``run`` plays until told to stop; ``start`` does that in the background, ``close``
    ends the page. Raises ViewError without viser, and where nothing can listen on ``host`` and ``port`` (0 = any).
    """

    def __init__(
        self,
        recordings: Mapping[str, Recording],
        looks: Mapping[str, Look],
        title: str,
        host: str = page.HOST,
        port: int = 0,
    ):
        self._recordings = dict(recordings)
        self._first, self._last = span(recordings)
        self._stage = Stage(title, host, port)
        self.url = self._stage.url
        self._now, self._shown, self.playing = self._first, math.nan, False
        self._asked: float | None = None
        self._add_panel()
        for name, look in looks.items():
            self._stage.add(name, look)
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._show(self._first)

    def _add_panel(self) -> None:
        gui, seconds = self._stage.server.gui, max(self._last - self._first, 1e-9)
        self._line = gui.add_slider("Time [s]", 0.0, seconds, seconds / 1000.0, 0.0)
        self._line.on_update(self._on_line)
        self._play = gui.add_button("Play", icon="player-play")
        self._play.on_click(lambda _: self._switch(not self.playing))
        self._speed = gui.add_dropdown("Speed", tuple(SPEEDS), initial_value="1")
        self._repeat = gui.add_checkbox("Repeat", False)
        self._stage.add_switches()

    def _on_line(self, event: object) -> None:
        """Somebody has moved the time line; what the player itself sets comes from nobody's page."""
        if getattr(event, "client", None) is not None:
            self._asked = self._first + float(self._line.value)

    def _switch(self, playing: bool) -> None:
        if playing and self._now >= self._last:
            self._asked = self._first
        self.playing = playing
        self._play.label, self._play.icon = ("Pause", "player-pause") if playing else ("Play", "player-play")

    def play(self) -> None:
        """As the button does."""
        self._switch(True)

    def run(self, stopped: Callable[[], bool]) -> None:
        """Play what the page asks for until ``stopped()``, and end the page."""
        before = time.monotonic()
        try:
            while not stopped() and not self._stop.is_set():
                now = time.monotonic()
                self._advance(now - before)
                before = now
                self._stop.wait(max(0.0, PERIOD - (time.monotonic() - now)))
        finally:
            self._stage.close()

    def start(self) -> None:
        """Run in a thread that ends with the program."""
        self._thread = threading.Thread(target=self.run, args=(lambda: False,), daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the page."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join()

    def _advance(self, seconds: float) -> None:
        if self._asked is not None:
            self._now, self._asked = self._asked, None
        elif self.playing:
            self._now += seconds * SPEEDS[self._speed.value]
            if self._now >= self._last:
                self._now = self._first if self._repeat.value else self._last
                self._switch(self._repeat.value)
            self._line.value = self._now - self._first
        self._show(self._now)

    def _show(self, now: float) -> None:
        if now != self._shown:
            self._shown = now
            self._stage.show({name: one.at(now) for name, one in self._recordings.items()})
            self._stage.tell(f"**{now - self._first:.3f} s** of {self._last - self._first:.3f} s")

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a page that plays by itself, in any browser, without a server or a network. Raises OSError."""
        self._switch(False)
        self._show(self._first)
        self._stage.put_camera(self._stage.server.initial_camera, self._path())
        recorder = self._stage.server.get_scene_serializer()
        count = min(MOST_SAVED, int((self._last - self._first) * page.RATE) + 1)
        for i in range(count):
            self._show(self._first + i * (self._last - self._first) / max(1, count - 1))
            recorder.insert_sleep(PERIOD)
        Path(path).write_text(recorder.as_html(), encoding="utf-8")

    def _path(self) -> Floats:
        """All positions [m], shape (n, 3)."""
        return np.concatenate([one.position for one in self._recordings.values()])

    def _repr_html_(self) -> str:
        """In a notebook: the page itself."""
        return f'<iframe src="{self.url}" width="100%" height="480" style="border: none"></iframe>'

    def __repr__(self) -> str:
        return f"Player({self.url}: {self._last - self._first:.6g} s of {', '.join(self._recordings)})"
