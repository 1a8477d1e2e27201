"""Fast DDS, ROS 2's default middleware, set for messages that are small and many."""

import os
from pathlib import Path

from ..scene.installed import installed

PROFILE = "fastdds.xml"
VARIABLE = "FASTRTPS_DEFAULT_PROFILES_FILE"
OTHER_WAYS = ("FASTDDS_DEFAULT_PROFILES_FILE",)  # to name a file, in later versions
TRANSPORTS = "FASTDDS_BUILTIN_TRANSPORTS"
SHARED_MEMORY = "/dev/shm"
NEEDED = 2**20  # bytes; a node takes 0.6 MB
LEAST = 2**16  # with 4096 it is killed, with 16384 it is not
FOUND_BY_ITSELF = ("DEFAULT_FASTRTPS_PROFILES.xml", "DEFAULT_FASTDDS_PROFILES.xml")  # in the working directory


def use_profile() -> None:
    """Have Fast DDS read config/fastdds.xml, unless the user has given a profile; an empty name means none at all.

    It must be called before a node exists. Other middlewares do not look at this.
    """
    if os.environ.get(VARIABLE) == "":
        del os.environ[VARIABLE]  # Fast DDS would complain about a file of no name
    elif not _given() and (profile := installed(PROFILE)).exists():
        os.environ[VARIABLE] = str(profile)


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
            "uses, such as fastrtps_* of nodes that were killed"
        )
    os.environ.setdefault(TRANSPORTS, "UDPv4")
    return f"{SHARED_MEMORY} has {free} bytes left, and {NEEDED} are needed; messages go by UDP, which costs more"


def _given() -> bool:
    named = any(name in os.environ for name in (VARIABLE, *OTHER_WAYS))
    return named or any(Path(name).exists() for name in FOUND_BY_ITSELF)
