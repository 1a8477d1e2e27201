"""Unpacks what is packed in bags: never more than a limit, whatever the packed bytes claim or hold."""

import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .content import DamagedError

MOST_AT_ONCE = 1 << 28  # bytes of a chunk: what is read at once. rosbag2 makes chunks of 0.8 MB, or of one message
MOST_MESSAGE = 1 << 24  # bytes of a message that is read; those known here have some hundreds
MOST_OF_FILE = 1 << 30  # bytes of a file that is small when packed,
MOST_RATIO = 1000  # and so many times the packed size of another one: numbers are packed to a tenth or so
ZSTD = b"\x28\xb5\x2f\xfd"  # begin of whatever zstd has packed
_AT_A_TIME = 1 << 20


def chunk(packed: bytes, packing: str, size: int, checksum: int) -> bytes:
    """The records in a chunk of MCAP, which claims a size and has a checksum (CRC-32), or 0 for none.

    Raises DamagedError unless it has that size, which must be at most MOST_AT_ONCE, and that checksum.
    """
    check_size("a chunk", size)
    if packing not in ("", "zstd", "lz4"):
        raise DamagedError(f"a chunk is packed by {packing!r}; zstd and lz4 are known")
    plain = packed if not packing else _limited(_unpackers()[packing], packed, size, "a chunk")
    if len(plain) != size:
        found = f"more than {size}" if len(plain) > size else len(plain)
        raise DamagedError(f"a chunk claims {size} bytes and has {found}")
    if checksum and zlib.crc32(plain) != checksum:
        raise DamagedError("a chunk does not have its checksum")
    return plain


def check_size(what: str, size: int, most: int = MOST_AT_ONCE) -> None:
    """Raise DamagedError where a size is beyond the limit."""
    if size > most:
        raise DamagedError(f"{what} claims {size} bytes; at most {most} are taken")


def message(packed: bytes) -> bytes:
    """A message that rosbag2 has packed by itself. Raises DamagedError for one of more than MOST_MESSAGE bytes."""
    what = "a packed message"
    check_size(what, _claimed(packed), MOST_MESSAGE)
    plain = _limited(_unpackers()["zstd"], packed, MOST_MESSAGE, what)
    if len(plain) > MOST_MESSAGE:
        raise DamagedError(f"{what} has more than {MOST_MESSAGE} bytes, which is the most that is taken")
    return plain


def file(packed: Path, folder: Path) -> Path:
    """The file in ``folder`` into which a packed one (zstd) is unpacked. Raises DamagedError for a too large one."""
    from backports import zstd  # rosbags needs it, too

    most = max(MOST_OF_FILE, MOST_RATIO * packed.stat().st_size)
    path = folder / packed.stem
    with packed.open("rb") as begin:
        claimed = _claimed(begin.read(18))
    left = -1 if claimed > most else most
    with zstd.open(packed) as source, path.open("wb") as plain:
        while left >= 0 and (block := source.read(_AT_A_TIME)):
            left -= len(block)
            plain.write(block)
    if left < 0:
        size = f"{claimed}" if claimed else f"more than {most}"
        raise DamagedError(
            f"it has {packed.stat().st_size} bytes and unpacks to {size}; at most {most} are taken; unpack it (zstd -d)"
        )
    return path


def _claimed(packed: bytes) -> int:
    """Bytes that packed ones claim to be when they are unpacked; 0 where they do not tell."""
    from backports import zstd

    try:
        return zstd.get_frame_info(packed).decompressed_size or 0
    except zstd.ZstdError:
        return 0


def _limited(unpacker: Callable[[], Any], packed: bytes, most: int, what: str) -> bytes:
    """What is packed, in one frame or several: all of it, or the first ``most + 1`` bytes."""
    plain = bytearray()
    while packed and len(plain) <= most:
        frame = unpacker()
        plain += frame.decompress(packed, max_length=most + 1 - len(plain))
        if not frame.eof and len(plain) <= most:
            raise DamagedError(f"{what} is packed and has no end")
        packed = frame.unused_data or b""
    return bytes(plain)


def _unpackers() -> dict[str, Callable[[], Any]]:
    from backports import zstd
    from lz4.frame import LZ4FrameDecompressor

    return {"zstd": zstd.ZstdDecompressor, "lz4": LZ4FrameDecompressor}
