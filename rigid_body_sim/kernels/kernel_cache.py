"""Where compiled kernels are kept from one run to the next, and what happens when they cannot be.

What lies there is run, so it is looked for only where nobody but the user and root can have put it, and each file
begins with the digest of what follows: one that was cut or altered is compiled anew. numba's own cache trusts its
files, and one that it cannot read or write ends the program.
"""

import hashlib
import logging
import os
import pickle
import stat
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

_DIGEST_SIZE = 32
_MOST_LINKS = 40  # on one way, as Linux has it
_log = logging.getLogger("rigid_body_sim")


def choose(name: str) -> tuple[Path | None, str]:
    """The folder called ``name`` in which kernels are kept, made where it is missing; None and why when there is none.

    It is below the first of ``NUMBA_CACHE_DIR``, and ``XDG_CACHE_HOME`` or else ``~/.cache``, that can be trusted and
    made; one that is there may be read-only.
    """
    home = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    reasons = [] if os.path.isabs(home) else ["there is no home folder"]
    for base in filter(None, (os.environ.get("NUMBA_CACHE_DIR"), home if os.path.isabs(home) else "")):
        try:
            folder = Path(os.path.abspath(base), "rigid_body_sim", name)
            _make(folder)
            reason = distrust(folder)
        except OSError as failure:
            reason = f"{failure.filename or base}: {failure.strerror}"
        if not reason:
            return folder, ""
        reasons.append(reason)
    return None, f"{'; '.join(reasons)}; set NUMBA_CACHE_DIR to a folder that only you can write"


def distrust(folder: Path) -> str:
    """Why somebody else may have put there what lies in an absolute ``folder``; empty when nobody can have.

    Every folder and every link on the way to it must belong to the user or root, and nobody else may write into the
    folders; into those above the last one others may where the sticky bit keeps them from replacing what is not theirs.
    Raises OSError where the way cannot be followed.
    """
    return _distrust_way(folder) or _others_write(folder, folder.stat().st_mode)


def _distrust_way(path: Path) -> str:
    """The same of what leads to a folder, be that one shared itself."""
    trusted = (0, os.getuid())
    for place, status in _way(path):
        if status.st_uid not in trusted:
            return f"{place} belongs to another user"
        is_open = not (stat.S_ISLNK(status.st_mode) or status.st_mode & stat.S_ISVTX)
        if is_open and (reason := _others_write(place, status.st_mode)):
            return reason
    return ""


def _others_write(folder: Path, mode: int) -> str:
    return f"{folder} can be written by others" if mode & (stat.S_IWGRP | stat.S_IWOTH) else ""


def _way(path: Path) -> Iterator[tuple[Path, os.stat_result]]:
    """All folders and links through which the system goes to ``path``, and what they are."""
    here, ahead, links = Path("/"), list(path.parts[1:]), 0
    yield here, here.lstat()
    while ahead:
        part = ahead.pop(0)
        if part == "..":
            here = here.parent
            continue
        place = here / part
        status = place.lstat()
        yield place, status
        if not stat.S_ISLNK(status.st_mode):
            here = place
            continue
        if (links := links + 1) > _MOST_LINKS:
            raise OSError(0, "too many links on the way", str(path))
        target = Path(os.readlink(place))
        if target.is_absolute():
            here = Path("/")
        ahead = [*target.parts[target.is_absolute() :], *ahead]


def _make(folder: Path) -> None:
    """Make what is missing of the way, for the user alone, unless what is there cannot be trusted already."""
    missing = [place for place in (folder, *folder.parents) if not os.path.lexists(place)]
    if missing and _distrust_way(missing[-1].parent):
        return
    for place in reversed(missing):
        place.mkdir(mode=0o700, exist_ok=True)


def identity(function: Any) -> str:
    """A name of a function that is the same in every process: with those of the kernels over which it is a closure."""
    closed = [cell.cell_contents for cell in getattr(function, "__closure__", None) or ()]
    return f"{function.__module__}.{function.__qualname__}{_names(closed) if closed else ''}"


def _names(value: Any) -> str:
    if isinstance(value, list | tuple):
        return f"({', '.join(map(_names, value))})"
    return identity(value) if callable(value) else repr(value)


class KernelCache:
    """The compiled forms of one kernel, as numba's dispatcher asks for them: one file for each types of arguments.

    It raises nothing. What cannot be read is compiled anew, what cannot be written is not kept, and the first time a
    line in the log of the name ``rigid_body_sim`` says so.
    """

    _told: ClassVar[set[str]] = set()  # of all kernels of the process

    def __init__(self, function: Any, folder: Path | None, why_not: str = ""):
        self._function, self._folder, self._why_not = function, folder, why_not
        self._prefix = f"{function.__module__.removeprefix('rigid_body_sim.')}.{function.__name__}-"

    @property
    def cache_path(self) -> str:
        """As the statistics of numba's dispatcher show it."""
        return str(self._folder or "")

    def has(self, signature: Any, codegen: Any) -> bool:
        """Whether a file is kept of this kernel for the types of ``signature``."""
        return self._folder is not None and self._path(signature, codegen).exists()

    def load_overload(self, signature: Any, context: Any) -> Any:
        """What numba compiled for the signature, or None."""
        if self._folder is None:
            return None
        path = self._path(signature, context.codegen())
        try:
            content = path.read_bytes()
        except FileNotFoundError:
            return None
        except OSError as reason:
            return self._tell("read", f"{path} cannot be read ({reason.strerror}): compiling anew")
        if _digest(content[_DIGEST_SIZE:]) != content[:_DIGEST_SIZE]:
            return self._tell("damaged", f"{path} is damaged: compiling anew what is")
        try:
            from numba.core.compiler import CompileResult
            from numba.core.runtime import rtsys

            # All that compiled code calls. numba's own cache loads what compiling needs, too: 0.4 s, with scipy.linalg.
            rtsys.initialize(context)
            return CompileResult._rebuild(context, *pickle.loads(content[_DIGEST_SIZE:]))
        except Exception as reason:  # of another llvmlite, say, or another numba
            return self._tell("use", f"{path} cannot be used ({type(reason).__name__}): compiling anew")

    def save_overload(self, signature: Any, result: Any) -> None:
        """Keep what numba compiled for the signature."""
        if self._folder is None:
            self._tell("none", f"compiled kernels are not kept, each start compiles them: {self._why_not}")
            return
        from numba.core.serialize import dumps

        content = dumps(result._reduce())
        try:
            _write(self._path(signature, result.codegen), _digest(content) + content)
        except OSError as reason:
            self._tell("write", f"compiled kernels cannot be kept in {self._folder} ({reason.strerror})")

    def _path(self, signature: Any, codegen: Any) -> Path:
        """The file for a signature on this processor, with this Python, numba and text of the kernel."""
        import numba

        code = self._function.__code__
        about = codegen.magic_tuple(), sys.version, numba.__version__, code.co_firstlineno
        key = repr((identity(self._function), signature, *about))
        name = _digest(key.encode() + code.co_code).hex()[:24]
        return Path(self._folder or "", f"{self._prefix}{name}.nbc")

    def _tell(self, kind: str, text: str) -> None:
        if kind not in self._told:
            self._told.add(kind)
            _log.warning("%s", text)


def _digest(content: bytes) -> bytes:
    return hashlib.blake2b(content, digest_size=_DIGEST_SIZE).digest()


def _write(path: Path, content: bytes) -> None:
    """Whole or not at all, also when several processes write at once."""
    with tempfile.NamedTemporaryFile(dir=path.parent, prefix=".", delete=False) as file:
        try:
            file.write(content)
            file.close()
            os.replace(file.name, path)
        except OSError:
            os.unlink(file.name)
            raise
