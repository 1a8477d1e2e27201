"""Fast DDS, ROS 2's default middleware, set for messages that are small and many."""

import os
from pathlib import Path

from ..scene.installed import installed

PROFILE = "fastdds.xml"
VARIABLE = "FASTRTPS_DEFAULT_PROFILES_FILE"
OTHER_WAYS = ("FASTDDS_DEFAULT_PROFILES_FILE",)  # to name a file, in later versions
FOUND_BY_ITSELF = ("DEFAULT_FASTRTPS_PROFILES.xml", "DEFAULT_FASTDDS_PROFILES.xml")  # in the working directory


def use_profile() -> None:
    """Have Fast DDS read config/fastdds.xml, unless the user has given a profile; an empty name means none at all.

    It must be called before a node exists. Other middlewares do not look at this.
    """
    if os.environ.get(VARIABLE) == "":
        del os.environ[VARIABLE]  # Fast DDS would complain about a file of no name
    elif not _given() and (profile := installed(PROFILE)).exists():
        os.environ[VARIABLE] = str(profile)


def _given() -> bool:
    named = any(name in os.environ for name in (VARIABLE, *OTHER_WAYS))
    return named or any(Path(name).exists() for name in FOUND_BY_ITSELF)
