"""Files with pictures: looked at before anything slow is done, and written whole or not at all."""

from pathlib import Path
from typing import Any


def check(path: Path, option: str) -> None:
    """Raise ValueError when a picture cannot be drawn there: before minutes of work, not after."""
    try:
        from matplotlib.figure import Figure
    except ImportError as reason:
        raise ValueError(f"{option} needs matplotlib ({reason}); pip install matplotlib") from None
    known = Figure().canvas.get_supported_filetypes()
    if path.suffix[1:] not in known:
        raise ValueError(f"{option} {path}: its ending names no known format; give one of {', '.join(sorted(known))}")
    if not path.absolute().parent.is_dir():
        raise ValueError(f"{option} {path}: there is no such folder")


def save(figure: Any, path: Path) -> None:
    """Write a matplotlib Figure to ``path``; its ending tells the format."""
    beside = path.with_name(f".{path.name}")
    figure.savefig(beside, format=path.suffix[1:])
    beside.replace(path)


def of_body(path: Path, name: str) -> Path:
    """Where the picture of one of several bodies goes; that of an only one, without a name, stays."""
    return path.with_name(f"{path.stem}.{name}{path.suffix}") if name else path


def stem(bag: Path) -> str:
    """Name of a bag without its ending, for files in the working directory."""
    return bag.absolute().name.split(".")[0]
