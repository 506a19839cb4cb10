"""Memory: how much of this process is resident."""

from __future__ import annotations

from pathlib import Path

__all__ = ["Growth", "resident_mib"]


class Growth:
    """Tells from what is measured again and again when it has come to its end: it grew, and does so no more."""

    INTERVAL_S = 0.2
    _STILL_S = 2.0
    _LEAST_MIB = 0.1

    def __init__(self) -> None:
        self.latest = 0.0
        self._unchanged = 0

    def is_over(self, mib: float) -> bool:
        """``mib``: how much it is now; asked every INTERVAL_S."""
        self._unchanged = self._unchanged + 1 if mib == self.latest >= self._LEAST_MIB else 0
        self.latest = mib
        return self._unchanged * self.INTERVAL_S >= self._STILL_S


def resident_mib() -> float:
    """As the kernel says, in MiB; where there is no /proc, the most that it ever was."""
    try:
        status = Path("/proc/self/status").read_text(encoding="ascii")
    except OSError:
        import resource
        import sys

        unit = 1 if sys.platform == "darwin" else 1024
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / (1 << 20)
    line = next(line for line in status.splitlines() if line.startswith("VmRSS:"))
    return int(line.split()[1]) / 1024
