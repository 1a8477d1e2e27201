"""Files that parameters name: a path, or package:// for what an installed ROS package shares. Nothing is fetched."""

import os
import re
import sys

SCHEME = "package://"
_MARKER = "share/ament_index/resource_index/packages"  # a file of the package's name lies there in its prefix


def located(name: str, folder: str | os.PathLike[str] = "") -> str:
    """Path of the file that a parameter names. A relative path begins at ``folder``.

    ``package://package/path`` is a file below the share folder of that package, found as ROS does: in the prefixes of
    AMENT_PREFIX_PATH, first one first, then in Python's own.

    Raises ValueError for any other URL, for one that leads out of its package or to none, and for what is there but no
    file: a pipe or a device would be read without an end.
    """
    path = _in_package(name) if name.startswith(SCHEME) else os.path.join(folder, _plain(name))
    if os.path.exists(path) and not os.path.isfile(path):
        raise ValueError(f"{path} is a directory, a device or a pipe; give the path of a file")
    return path


def beside(name: str, folder: str | os.PathLike[str]) -> str:
    """The name of a file that a parameter in a file in ``folder`` gives, as it is from the working directory."""
    return name if not name or "://" in name else os.path.join(folder, name)


def url(name: str) -> str:
    """What RViz loads: the same file for a path that begins at the working directory, and package:// as it is."""
    return name if name.startswith(SCHEME) else f"file://{os.path.abspath(name)}"


def _plain(name: str) -> str:
    if "://" in name:
        raise ValueError(
            f"{name.split('://')[0]}:// is not supported, as files are read and never fetched; "
            "give the path of a file, or package://package/path"
        )
    return name


def _in_package(name: str) -> str:
    package, *parts = name.removeprefix(SCHEME).split("/")
    if not re.fullmatch(r"\w[\w-]*", package) or not parts or not {"", ".", ".."}.isdisjoint(parts):
        raise ValueError(f"{name} is no file of a package; give package://package/path, without '..'")
    return os.path.join(_prefix(package), "share", package, *parts)


def _prefix(package: str) -> str:
    prefixes = [*filter(None, os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)), sys.prefix]
    for prefix in prefixes:
        if os.path.isfile(os.path.join(prefix, _MARKER, package)):
            return prefix
    raise ValueError(f"package {package!r} is not installed in any of {', '.join(prefixes)}; source its setup file")
