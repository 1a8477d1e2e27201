"""How busy other programs keep the machine while something is measured."""

import os
import sys
import time
from pathlib import Path


class Busy:
    """What other programs do, from when this is made."""

    def __init__(self) -> None:
        self._begin = time.perf_counter(), time.process_time(), _worked()

    def others(self) -> float | None:
        """Cores that they kept busy so far, on average; None where that cannot be known."""
        begin, used, worked = self._begin
        if worked is None or (now := _worked()) is None:
            return None
        mine = time.process_time() - used
        return max(0.0, now - worked - mine) / (time.perf_counter() - begin)


def _worked() -> float | None:
    """Seconds for which cores have worked since the system began, or were taken away by a host; None but on Linux."""
    if sys.platform != "linux":
        return None
    user, nice, system, _, _, *interrupted = Path("/proc/stat").read_text(encoding="utf-8").split()[1:9]
    return float(sum(map(int, (user, nice, system, *interrupted)))) / os.sysconf("SC_CLK_TCK")
