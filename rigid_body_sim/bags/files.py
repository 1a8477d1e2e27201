"""Which files a bag has, and their messages. What is there and not read, or not there, is told."""

import re
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path

from . import database, description, records, unpacking
from .content import Contents, DamagedError, Losses, Topic
from .description import Description
from .rosbags_support import BagError

_ENDS = (".mcap", ".db3")
_PACKED = (".zstd", ".zst")
_LIKE_A_BAG = re.compile(r".+\.(mcap|db3)\W.*")
_NUMBER = re.compile(r"_(\d{1,5})\.(?:mcap|db3)")  # longer ones are dates
_TO_GIVE = "give the folder of a bag, or its .mcap or .db3 file"


def gather(path: Path, losses: Losses) -> Contents:
    """All topics of a bag, file after file. Raises BagError and DamagedError."""
    if path.name == description.NAME:
        path = path.parent
    if not path.exists():
        raise BagError(f"{path}: does not exist; {_TO_GIVE}")
    contents = Contents()
    if not path.is_dir():
        _scan([_lone(path)], contents, losses)
        return contents
    described = description.read(path / description.NAME) if (path / description.NAME).exists() else None
    _scan(_in_folder(path, described, losses), contents, losses)
    if described is not None:
        _compare_counts(path, described, contents, losses)
    return contents


# Which files ----------------------------------------------------------------------------------------------------------


def _lone(path: Path) -> Path:
    if path.suffix == ".bag":
        raise BagError(f"{path}: is a bag of ROS 1; convert it (rosbags-convert, from pip install rosbags)")
    with path.open("rb") as file:
        begin = file.read(len(database.MAGIC))
    if not _is_stored(path.name) and not begin.startswith((records.MAGIC, database.MAGIC, unpacking.ZSTD)):
        raise BagError(f"{path}: is no bag; {_TO_GIVE}")
    return path


def _in_folder(path: Path, described: Description | None, losses: Losses) -> list[Path]:
    """The files to read, in the order in which they were written where that is told, and what else is there."""
    # What begins with a dot is of an editor, or of a file system without room for what it knows of a file.
    names = sorted(file.name for file in path.iterdir() if file.is_file() and not file.name.startswith("."))
    stored = {name for name in names if _is_stored(name)}
    if described is None and not stored:
        raise BagError(f"{path}: is a folder without metadata.yaml, .mcap or .db3 file, so no bag; {_TO_GIVE}")
    chosen = _not_twice(stored, losses) if described is None else _named(path, described, stored, losses)
    if described is None:
        losses.notes.append(f"The folder has no metadata.yaml: its files are read one by one, {', '.join(chosen)}.")
        _tell_gaps(chosen, losses)
    _tell_left_out(path, names, {_plain(name) for name in chosen}, losses)
    return [path / name for name in chosen]


def _named(path: Path, described: Description, stored: set[str], losses: Losses) -> list[str]:
    """The files that the description names, and, to recover what is whole, others."""
    chosen = []
    for name in described.files:
        if not (path / name).exists():
            twins = sorted(other for other in stored if _plain(other) == _plain(name))
            if not twins:
                losses.tell(path, f"lacks {name}", "which metadata.yaml names")
                continue
            losses.notes.append(f"{twins[0]} is read in place of {name}, which is not there.")
            name = twins[0]
        elif not _is_stored(name):
            raise BagError(f"{path}: {name} is packed in a way that is not known; convert the bag (ros2 bag convert)")
        chosen.append(name)
    plain = {_plain(name) for name in chosen}
    for name in sorted(stored - set(chosen)):
        if _plain(name) in plain:
            losses.notes.append(f"{name} is left out: another file is the same, packed or not.")
    others = _not_twice((name for name in stored if _plain(name) not in plain), losses)
    if others:
        losses.tell(
            path, f"has {', '.join(others)}", "which metadata.yaml does not name; move it away if it is another bag's"
        )
    return list(dict.fromkeys([*chosen, *others]))


def _not_twice(stored: Iterable[str], losses: Losses) -> list[str]:
    """Of files that are there packed and not, the latter: while it packs a file, rosbag2 has both."""
    chosen: dict[str, str] = {}
    for name in sorted(stored, key=lambda name: (_number(name), name)):
        if chosen.setdefault(_plain(name), name) != name:
            losses.notes.append(f"{name} is left out: {_plain(name)} is the same, unpacked.")
    return list(chosen.values())


def _number(name: str) -> int:
    """The number of a file among those of its bag, which rosbag2 counts from 0."""
    found = _NUMBER.search(name)
    return int(found[1]) if found else 0


def _tell_gaps(chosen: Sequence[str], losses: Losses) -> None:
    """Without a description, the numbers of the files tell which are not there."""
    numbers = sorted(set(map(_number, chosen)))
    if numbers != list(range(len(numbers))):
        losses.notes.append(f"The files are numbered {', '.join(map(str, numbers))}: the others are not there.")


def _tell_left_out(path: Path, names: Iterable[str], plain: set[str], losses: Losses) -> None:
    """Tell of files that look as if they were of a bag, and are not read."""
    for name in names:
        if _is_stored(name) or name == description.NAME:
            continue
        beside = next((name.removesuffix(end) for end in database.BESIDE[:2] if name.endswith(end)), "")
        if beside and beside not in plain:
            losses.tell(path, f"has {name} without {beside}", "so that its messages are not there")
        elif not beside and not name.endswith(database.BESIDE) and _LIKE_A_BAG.fullmatch(name):
            losses.notes.append(f"{name} is left out: files of a bag are .mcap or .db3, or packed ones .zstd.")


def _is_stored(name: str) -> bool:
    return _plain(name).endswith(_ENDS)


def _plain(name: str) -> str:
    """The name of a file when it is unpacked."""
    return next((name.removesuffix(end) for end in _PACKED if name.endswith(end)), name)


# What is in them ------------------------------------------------------------------------------------------------------


def _scan(files: Iterable[Path], contents: Contents, losses: Losses) -> None:
    for file in files:
        with tempfile.TemporaryDirectory() as folder:
            try:
                _scan_file(file, Path(folder), contents, losses)
            except DamagedError as reason:
                raise DamagedError(f"{file.name}: {reason}") from None


def _scan_file(file: Path, folder: Path, contents: Contents, losses: Losses) -> None:
    with file.open("rb") as begin:
        packed = begin.read(len(unpacking.ZSTD)) == unpacking.ZSTD
    plain = unpacking.file(file, folder) if packed else file
    with plain.open("rb") as begin:
        magic = begin.read(len(database.MAGIC))
    if magic.startswith(records.MAGIC):
        if records.lacks_end(plain):
            losses.tell(file, "has no end", "its writer was killed or the file was cut")
        records.scan(plain, contents)
    elif magic == database.MAGIC:
        database.scan(file, plain, folder, contents, losses)
    elif plain.stat().st_size:
        raise DamagedError("it begins neither as an MCAP nor as an SQLite file")
    else:
        losses.tell(file, "is empty", "so it cannot be read")


def _compare_counts(path: Path, described: Description, contents: Contents, losses: Losses) -> None:
    """Tell where the files hold another number of messages than the description says."""
    others = []
    for key in {**described.counts, **contents}:
        topic, told = contents.get(key) or Topic(*key), described.counts.get(key, 0)
        if topic.wanted and len(topic) < told:
            what = f"holds {len(topic)} of the {told} messages on {topic.name} that metadata.yaml tells of"
            losses.tell(path, what, "so files are not whole, or not there")
        elif len(topic) != told:
            others.append(f"{len(topic)} for {told} on {topic.name}")
    if others:
        losses.notes.append(f"The files hold other messages than metadata.yaml tells of: {', '.join(others)}.")
