"""The messages of SQLite files (.db3), with those still in a log beside them (-wal). Nothing of a bag is written to.

rosbags reads the file as if nothing could lie beside it, so without its last messages.
"""

import contextlib
import shutil
import sqlite3
import struct
from collections.abc import Iterator
from pathlib import Path

from . import unpacking
from .content import Channel, Contents, DamagedError, Losses, Topic

MAGIC = b"SQLite format 3\0"
BESIDE = ("-wal", "-journal", "-shm")  # ends of names of the files that SQLite has beside one
_LOG_HEAD = struct.Struct(">8I")  # magic, version, size of a page, number, two salts, two sums
_LOG_MAGIC = 0x377F0682  # and one more where sums are of big-endian words
_FRAME_HEAD = struct.Struct(">6I")  # page, size of the file, two salts, two sums; then a page


def scan(file: Path, plain: Path, folder: Path, contents: Contents, losses: Losses) -> None:
    """Add the messages of a file, from ``plain``, which is the same unpacked; ``folder`` is for what must be copied.

    Raises DamagedError for a file that does not hold what a bag must, and BagError for what is beside it and not whole.
    """
    real = file.resolve()  # SQLite looks beside the file to which a link leads
    name = real.name if plain == file else real.stem  # without what says that it is packed
    log, journal, index = (real.with_name(name + end) for end in BESIDE)
    if _size(log) or _is_hot(journal):
        plain = _completed(file, plain, folder, log, journal, losses)
    elif index.exists() and not log.exists():  # SQLite removes both when it ends
        losses.tell(index, f"is there without {log.name}", "so the last messages may be missing")
    with _opened(f"{plain.absolute().as_uri()}?mode=ro&immutable=1") as database:
        _take(database, contents)


@contextlib.contextmanager
def _opened(uri: str) -> Iterator[sqlite3.Connection]:
    with contextlib.closing(sqlite3.connect(uri, uri=True, isolation_level=None)) as database:
        yield database


def _size(file: Path) -> int:
    return file.stat().st_size if file.exists() else 0


# What is beside the file ----------------------------------------------------------------------------------------------


def _is_hot(journal: Path) -> bool:
    """Whether a rollback journal tells of changes that were begun and not ended: of another one, zeros are left."""
    if not _size(journal):
        return False
    with journal.open("rb") as file:
        return file.read(1) != b"\0"


def _completed(file: Path, plain: Path, folder: Path, log: Path, journal: Path, losses: Losses) -> Path:
    """A copy of the file in which everything is that was committed to the log, and nothing that was not."""
    beside = log if _size(log) else journal
    copy = folder / f"{plain.name}.completed"
    before = _stamps(plain, beside)
    shutil.copyfile(plain, copy)
    shutil.copyfile(beside, copy.with_name(copy.name + next(end for end in BESIDE if beside.name.endswith(end))))
    if _stamps(plain, beside) != before:
        raise DamagedError(f"{file.name} is being written; end its recorder first")
    with _opened(copy.absolute().as_uri()) as database:
        database.execute("SELECT count(*) FROM sqlite_master").fetchone()  # makes SQLite look at what is beside
        (_, committed, _) = database.execute("PRAGMA wal_checkpoint(PASSIVE)").fetchone()
        database.execute("PRAGMA journal_mode = DELETE").fetchone()
        ((sound,),) = database.execute("PRAGMA quick_check(1)").fetchall()
    if sound != "ok":
        raise DamagedError(f"{file.name} and {beside.name} do not go together")
    if beside == journal:
        losses.tell(journal, f"tells of messages that {file.name} has in part", "its writer was killed")
    elif committed != _frames(log):
        losses.tell(log, "does not end with a whole transaction", "its writer was killed or the file is damaged")
    else:
        losses.notes.append(f"{log.name}: what its writer had not yet moved to {file.name} is read, too.")
    return copy


def _stamps(*files: Path) -> list[tuple[int, int]]:
    return [(stat.st_size, stat.st_mtime_ns) for stat in (file.stat() for file in files)]


def _frames(log: Path) -> int | None:
    """How many pages a log tells of that are not from before it was begun anew; None where it does not begin as one."""
    with log.open("rb") as file:
        head = file.read(_LOG_HEAD.size)
        if len(head) < _LOG_HEAD.size:
            return None
        magic, _, page, _, *salts, first, second = _LOG_HEAD.unpack(head)
        if magic & ~1 != _LOG_MAGIC or _sums(head[:24], ">" if magic & 1 else "<") != (first, second):
            return None
        count = place = 0
        while frame := file.read(_FRAME_HEAD.size):
            place += 1
            rest = file.seek(page, 1)
            is_cut = len(frame) < _FRAME_HEAD.size or rest > log.stat().st_size
            if is_cut or list(_FRAME_HEAD.unpack(frame)[2:4]) == salts:
                count = place
        return count


def _sums(data: bytes, order: str) -> tuple[int, int]:
    """SQLite's sums over the head of a log."""
    first = second = 0
    for even, odd in struct.iter_unpack(f"{order}2I", data):
        first = (first + even + second) & 0xFFFFFFFF
        second = (second + odd + first) & 0xFFFFFFFF
    return first, second


# What is in it --------------------------------------------------------------------------------------------------------


def _take(database: sqlite3.Connection, contents: Contents) -> None:
    topics = {number: contents.of(channel) for number, channel in _channels(database).items()}
    counts = database.execute("SELECT topic_id, count(*), max(length(data)) FROM messages GROUP BY topic_id").fetchall()
    for number, count, longest in counts:
        if number not in topics:
            raise DamagedError(f"{count} messages are of topic {number}, of which it does not tell")
        if topics[number].wanted:
            unpacking.check_size(f"a message on {topics[number].name}", longest, unpacking.MOST_MESSAGE)
        else:
            topics[number].not_taken += count
    _take_messages(database, {number: topic for number, topic in topics.items() if topic.wanted})


def _take_messages(database: sqlite3.Connection, topics: dict[int, Topic]) -> None:
    takers = {number: topic.takers() for number, topic in topics.items()}
    chosen = ",".join("?" * len(takers))
    query = f"SELECT topic_id, timestamp, data FROM messages WHERE topic_id IN ({chosen}) ORDER BY id"
    for number, receive_ns, data in database.execute(query, list(takers)):
        if type(receive_ns) is not int or type(data) is not bytes:
            raise DamagedError(f"a message on {topics[number].name} has no time or no bytes")
        takers[number][0](receive_ns)
        takers[number][1](data)


def _channels(database: sqlite3.Connection) -> dict[int, Channel]:
    """What is told of topics, by their number. Definitions of messages are in bags of Iron and later."""
    tables = {name for (name,) in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
    if not {"topics", "messages"} <= tables:
        raise DamagedError("it has no tables of topics and messages")
    definitions = {}
    if "message_definitions" in tables:
        found = database.execute("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions")
        definitions = {kind: (written, definition) for kind, written, definition in found}
    topics = database.execute("SELECT id, name, type, serialization_format FROM topics").fetchall()
    return {number: Channel(*texts, *definitions.get(texts[1], ())) for number, *texts in topics}
