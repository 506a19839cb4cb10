"""Memory: how much of this process is resident."""

from __future__ import annotations

from pathlib import Path

__all__ = ["resident_mib"]


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
