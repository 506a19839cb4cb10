"""Bursts: operations that take turns in short bursts.

Of each the quickest counts, as the others waited for the processor, or for the memory; or the average, where that is
what it is set against.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

__all__ = ["Operation", "average", "quickest", "quickest_burst"]

Operation = Callable[[], object]
_BURST_S = 100e-6


def quickest(operations: Mapping[str, Operation], bursts: int) -> dict[str, float]:
    """Seconds that one of each takes; between bursts, the others have their turn."""
    calls = _calls_of_a_burst(operations)
    found = dict.fromkeys(operations, float("inf"))
    for _ in range(bursts):
        for name, operation in operations.items():
            found[name] = min(found[name], _seconds(operation, calls[name]))
    return found


def average(operations: Mapping[str, Operation], bursts: int) -> dict[str, float]:
    """Seconds of processor time that one of each takes, over all bursts."""
    calls = _calls_of_a_burst(operations)
    total = dict.fromkeys(operations, 0.0)
    for _ in range(bursts):
        for name, operation in operations.items():
            total[name] += _seconds(operation, calls[name], time.process_time)
    return {name: seconds / bursts for name, seconds in total.items()}


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


def _calls_of_a_burst(operations: Mapping[str, Operation]) -> dict[str, int]:
    return {name: max(int(_BURST_S / _seconds(operation, 3)), 1) for name, operation in operations.items()}


def _seconds(operation: Operation, calls: int, clock: Callable[[], float] = time.perf_counter) -> float:
    start = clock()
    for _ in range(calls):
        operation()
    return (clock() - start) / calls
