"""Record while something else runs: who has a message only puts it into a buffer, a thread writes the bag."""

import os
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from ..messages.cdr import serialised_text
from . import journal
from .writing import BagWriter, Topic

CAPACITY = 16_000_000  # bytes in the buffer: 3 s of pose and twist at 10 kHz
_BESIDE_DATA = 100  # bytes that an entry of the buffer has beside those of its message, about
_ENTRY = 1000  # bytes, about, that an entry of the journal has before it is a text
_WRITE_EVERY = 0.005  # s
_FLUSH_EVERY = 0.5  # s
_PATIENCE = 1.0  # s
_CLOSE_WITHIN = 5.0  # s


class Recorder:
    """Records messages of some topics, and a journal, as a bag at ``folder``, which must not exist.

    A message that finds the buffer full is dropped and counted, unless ``patient()``: then whoever brings it waits for
    room. One that is larger than the buffer never finds room: it is dropped, and ``too_large`` says so. Entries of the
    journal find room in as much again, and where one does not, an entry says so. When the disk does not take what is
    written, recording ends, ``failure`` says why, and all that comes is dropped. One thread may bring messages.

    Log times are the wall clock's at the start and go on with the monotonic clock, so that they never jump. No two are
    the same: they tell the order in which messages of all topics and entries came.

    Raises BagError as BagWriter does.
    """

    def __init__(
        self,
        folder: str | os.PathLike[str],
        topics: Sequence[Topic],
        journal_topic: str,
        patient: Callable[[], bool] = lambda: False,
        capacity: int = CAPACITY,
    ):
        self._folder, self._names = folder, [topic.name for topic in topics]
        self._writer = BagWriter(folder, [*topics, Topic(journal_topic, journal.TYPE)])
        self._journal_place = len(topics)
        self._patient, self._capacity = patient, capacity
        self._wall_ns = time.time_ns() - time.monotonic_ns()
        self._last_ns = 0
        self._buffer: deque[tuple[int, int, Any, int]] = deque()  # place, time [ns], bytes or call, room taken
        # Each is written by one thread alone, so that there is no lock for the other to wait for.
        self._room_taken = self._accepted = self._refused = 0
        self._room_freed = 0
        self._out_of_patience = self._in_hole = False
        self.failure = self.too_large = ""
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._write_until_the_end, name="recorder", daemon=True)
        self._thread.start()

    @property
    def recorded(self) -> int:
        """Messages, and entries of the journal, that the operating system has."""
        return self._writer.written

    @property
    def dropped(self) -> int:
        """Those that are not in the bag and will not be."""
        return self._refused + (self._accepted - self.recorded if self.failure else 0)

    # Called by the thread that brings messages ------------------------------------------------------------------------

    def put(self, place: int, data: bytes) -> None:
        """Record a serialised message of the topic at ``place``, now."""
        room = len(data) + _BESIDE_DATA
        if room > self._capacity:  # no waiting makes room for it, and what comes after it need not suffer
            self._refused += 1
            self.too_large = (
                f"a message of {len(data)} bytes on {self._names[place]} is not recorded: the recorder's buffer has "
                f"{self._capacity} bytes; all others are recorded"
            )
            return
        self._put(place, data, room, self._capacity)

    def put_entry(self, step: int, call: str, values: journal.Values) -> None:
        """Record an entry of the journal, of a call that decides the motion."""
        fits = self._put(self._journal_place, (step, call, values), _ENTRY, 2 * self._capacity)
        if not fits and not self._in_hole:
            self._append(self._journal_place, (step, journal.LOST, {}), _ENTRY)
        self._in_hole = not fits

    def _put(self, place: int, content: Any, room: int, capacity: int) -> bool:
        full = self._room_taken + room - self._room_freed > capacity
        if self.failure or (full and not self._wait_for(room)):
            self._refused += 1
            return False
        if not full:
            self._out_of_patience = False  # the disk takes something again
        self._append(place, content, room)
        return True

    def _append(self, place: int, content: Any, room: int) -> None:
        now_ns = self._wall_ns + time.monotonic_ns()
        if now_ns <= self._last_ns:
            now_ns = self._last_ns + 1
        self._last_ns = now_ns
        self._room_taken += room
        self._accepted += 1
        self._buffer.append((place, now_ns, content, room))

    def _wait_for(self, room: int) -> bool:
        """Whether there is room now, after waiting where that is wanted; a disk that hangs is not waited for twice."""
        if not self._patient():
            return False
        deadline = time.monotonic() + (0.0 if self._out_of_patience else _PATIENCE)
        while full := self._room_taken + room - self._room_freed > self._capacity:
            if self.failure or time.monotonic() >= deadline:
                break
            time.sleep(0.001)
        self._out_of_patience = full
        return not full

    def close(self) -> None:
        """Write what is in the buffer, and close the bag."""
        self._ending.set()
        self._thread.join(_CLOSE_WITHIN)
        if self._thread.is_alive():
            self.failure = f"recording to {self._folder} has no end: the disk takes nothing for {_CLOSE_WITHIN:g} s"

    # The thread that writes -------------------------------------------------------------------------------------------

    def _write_until_the_end(self) -> None:
        flush_due = time.monotonic() + _FLUSH_EVERY
        try:
            while not self._ending.wait(_WRITE_EVERY):
                self._writer.write(self._taken_out(len(self._buffer)))
                if time.monotonic() >= flush_due:
                    self._writer.flush()
                    flush_due = time.monotonic() + _FLUSH_EVERY
            self._writer.write(self._taken_out(len(self._buffer)))
            self._writer.close()
        except Exception as reason:  # a full disk, mostly; nothing else may end a thread in silence, either
            self.failure = (
                f"recording to {self._folder} has stopped ({reason}), and the simulation goes on; what was written "
                "before can be read"
            )
            self._writer.abandon()
            self._buffer.clear()

    def _taken_out(self, count: int) -> Iterator[tuple[int, int, bytes]]:
        """The oldest entries of the buffer as messages."""
        for _ in range(count):
            place, time_ns, content, room = self._buffer.popleft()
            if place == self._journal_place:
                content = serialised_text(journal.text(time_ns, *content))
            yield place, time_ns, content
            self._room_freed += room
