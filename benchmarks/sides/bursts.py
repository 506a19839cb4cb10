"""Bursts: operations that take turns in short bursts, of each of which the quickest counts.

The others waited for the processor, or for the memory.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

__all__ = ["Operation", "quickest", "quickest_burst"]

Operation = Callable[[], object]
_BURST_S = 100e-6


def quickest(operations: Mapping[str, Operation], bursts: int) -> dict[str, float]:
    """Seconds that one of each takes; between bursts, the others have their turn."""
    calls = {name: max(int(_BURST_S / _seconds(operation, 3)), 1) for name, operation in operations.items()}
    found = dict.fromkeys(operations, float("inf"))
    for _ in range(bursts):
        for name, operation in operations.items():
            found[name] = min(found[name], _seconds(operation, calls[name]))
    return found


def quickest_burst(burst: Callable[[int], object], count: int) -> float:
    """Microseconds of processor time that one of ``count`` calls takes, in the quickest of bursts of a millisecond.

    ``burst(n)`` makes ``n`` calls.  Processor time, as a burst of one long call cannot be quicker than who waits.
    """

    def seconds_of_each(calls: int) -> float:
        start = time.process_time()
        burst(calls)
        return (time.process_time() - start) / calls

    first_s = min(seconds_of_each(1) for _ in range(3))
    calls = min(max(int(1e-3 / first_s), 1), count)
    return min(seconds_of_each(calls) for _ in range(max(count // calls, 3))) * 1e6


def _seconds(operation: Operation, calls: int) -> float:
    start = time.perf_counter()
    for _ in range(calls):
        operation()
    return (time.perf_counter() - start) / calls
