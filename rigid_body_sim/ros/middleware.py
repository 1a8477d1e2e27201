"""Fast DDS, ROS 2's default middleware, set for messages that are small and many."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..scene.installed import installed

# By library, the variable that names a profile, and ours for it, of which the second is for many writers that are slow.
# Version 3 does not understand a profile of version 2: it complains, as it does of the old variable.
PROFILES = {
    "libfastrtps.so": ("FASTRTPS_DEFAULT_PROFILES_FILE", "fastdds.xml", "fastdds_many.xml"),
    "libfastdds.so": ("FASTDDS_DEFAULT_PROFILES_FILE", "fastdds3.xml", "fastdds3_many.xml"),
}
VARIABLES = tuple(variable for variable, *_ in PROFILES.values())
SLOW = 100.0  # messages a second, up to which a writer is slow
LIBRARIES = Path("/proc/self/maps")
TRANSPORTS = "FASTDDS_BUILTIN_TRANSPORTS"
SHARED_MEMORY = "/dev/shm"
NEEDED = 2**20  # bytes; a node takes 0.6 MB
LEAST = 2**16  # with 4096 it is killed, with 16384 it is not
FOUND_BY_ITSELF = ("DEFAULT_FASTRTPS_PROFILES.xml", "DEFAULT_FASTDDS_PROFILES.xml")  # in the working directory


def libraries() -> str:
    """The names of all libraries that this process has loaded, in lines; "" where that cannot be read."""
    try:
        return LIBRARIES.read_text(encoding="utf-8", errors="replace")
    except OSError:  # not Linux
        return ""


def use_profile(loaded: str, many: bool = False) -> None:
    """Have the Fast DDS that is among the libraries ``loaded`` read our profile for it, unless the user has given one.

    It is the one for ``many`` slow writers, or that for a few quick ones. An empty name means none at all. This must be
    called when rclpy.init has loaded the middleware, and before a node exists. For other middlewares it does nothing.
    """
    if not _given():
        for library, (variable, *files) in PROFILES.items():
            if library in loaded and (profile := installed(files[many])).exists():
                os.environ[variable] = str(profile)
    for variable in VARIABLES:
        if os.environ.get(variable) == "":
            del os.environ[variable]  # Fast DDS would complain about a file of no name


def has_many_writers(given: Mapping[str, Any]) -> bool:
    """Whether a node with these parameters has several bodies, none of which publishes more often than SLOW says."""
    numbers = [given.get("publish_rate", SLOW), given.get("real_time_factor", 1.0)]
    if not all(isinstance(number, int | float) and number > 0.0 for number in numbers) or given.get("lockstep"):
        return False
    has_several = any(name.partition(".")[0] == "bodies" for name in given)
    return has_several and not any("sensors." in name for name in given) and numbers[0] * numbers[1] <= SLOW


def avoid_full_memory() -> str:
    """Where little shared memory is left, have Fast DDS leave it alone; returns a sentence about it, or "".

    Fast DDS sees that it cannot reserve what it needs, but where the last pages are taken the system kills it, when
    rclpy is imported already: this must be called before. Raises ValueError where nothing else is to be expected.
    """
    try:
        found = os.statvfs(SHARED_MEMORY)
    except OSError:  # not Linux: what it uses there is not known here
        return ""
    free = found.f_bavail * found.f_frsize
    if free >= NEEDED or not os.environ.get("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp").startswith("rmw_fastrtps"):
        return ""
    if free < LEAST:
        raise ValueError(
            f"{SHARED_MEMORY} has {free} bytes left, with which Fast DDS cannot start; remove files there that nobody "
            "uses, such as fastrtps_* or fastdds_* of nodes that were killed"
        )
    os.environ.setdefault(TRANSPORTS, "UDPv4")
    return f"{SHARED_MEMORY} has {free} bytes left, and {NEEDED} are needed; messages go by UDP, which costs more"


def _given() -> bool:
    return any(name in os.environ for name in VARIABLES) or any(Path(name).exists() for name in FOUND_BY_ITSELF)
