"""What metadata.yaml tells of a bag: which files it has, how they are packed, and how many messages are in them."""

from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Any

import yaml

from .content import DamagedError

NAME = "metadata.yaml"
MOST_BYTES = 4_000_000  # of it: a thousand for each topic, and two hundred for each file
MOST_LEVELS = 20
_Loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # ten times as fast, where PyYAML has it


@dataclass(frozen=True)
class Description:
    """Of a bag: names of its files, and how many messages each topic has, by name and type."""

    files: tuple[str, ...]
    counts: dict[tuple[str, str], int]


def read(path: Path) -> Description:
    """What the file tells. Raises DamagedError where it does not tell it as rosbag2 does, in any of its versions."""
    try:
        told = _document(path)["rosbag2_bagfile_information"]
        mode, packing = (told.get(f"compression_{what}") or "" for what in ("mode", "format"))
        # Up to version 3 a name has the folder before it.
        files = tuple(PurePath(_as(str, name)).name for name in _as(list, told["relative_file_paths"]))
        counts = dict(map(_count, _as(list, told.get("topics_with_message_count") or [])))
    except (AttributeError, KeyError, TypeError, ValueError, yaml.YAMLError) as reason:
        text = reason.args[0] if isinstance(reason, DamagedError | TypeError) else type(reason).__name__
        raise DamagedError(f"{NAME} is not as rosbag2 writes it ({text})") from None
    if mode.lower() not in ("", "none") and packing != "zstd":
        raise DamagedError(f"{NAME}: packing by '{packing}' is not supported; convert the bag (ros2 bag convert)")
    return Description(files, counts)


def _document(path: Path) -> Any:
    """The file as YAML: what grows when it is read, as aliases may, is refused."""
    if path.stat().st_size > MOST_BYTES:
        raise DamagedError(f"{NAME} has {path.stat().st_size} bytes; at most {MOST_BYTES} are read")
    text, levels = path.read_text(encoding="utf-8"), 0
    for event in yaml.parse(text, Loader=_Loader):
        levels += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if isinstance(event, yaml.AliasEvent) or levels > MOST_LEVELS:
            what = "has an alias (*name)" if isinstance(event, yaml.AliasEvent) else "is nested too deeply"
            raise DamagedError(f"{NAME} {what}, which rosbag2 does not write")
    return yaml.load(text, Loader=_Loader)


def _count(entry: Any) -> tuple[tuple[str, str], int]:
    topic = entry["topic_metadata"]
    return (_as(str, topic["name"]), _as(str, topic["type"])), _as(int, entry["message_count"])


def _as(kind: type, value: Any) -> Any:
    if not isinstance(value, kind):
        raise TypeError(f"a {type(value).__name__} in place of a {kind.__name__}")
    return value
