"""Order by source: DESTINATION_ORDER BY_SOURCE_TIMESTAMP within one instance.  DDS 1.4 §2.2.3.17.

Samples are in order while they are in the reader.  ``Instance.settled`` is the stamp of the latest that has left, or of
the dispose behind it: what is older comes too late.
"""

from __future__ import annotations

from ..structure.cache_change import CacheChange
from ..structure.sample_info import SampleInfo
from .instance import Instance

__all__ = ["comes_too_late", "is_latest", "left", "place_of"]


def _stamp(change: CacheChange | None) -> tuple[int, bytes]:
    """What is ordered by: where two writers wrote at once, all readers decide alike."""
    assert change is not None
    return change.source_timestamp, change.writer_guid


def comes_too_late(instance: Instance, change: CacheChange, depth: int) -> bool:
    """Is the sample older than what the application has seen already, or than all that KEEP_LAST (``depth``) keeps?"""
    stamp = _stamp(change)
    if stamp < instance.settled:
        return True
    samples = instance.samples
    if not depth or len(samples) - instance.end_count < depth:
        return False
    return stamp < next(_stamp(info._change) for info in samples if info.valid_data)


def is_latest(instance: Instance, change: CacheChange) -> bool:
    """A dispose: nothing that was written later may be here, or have been.  If so, it ends what came before."""
    stamp = _stamp(change)
    latest = max((_stamp(info._change) for info in instance.samples if info.valid_data), default=instance.settled)
    if stamp < max(latest, instance.settled):
        return False
    instance.settled = stamp
    return True


def place_of(instance: Instance, change: CacheChange) -> int:
    """Where the sample goes: before the first of the instance's that was written later, which most often is none."""
    stamp, place = _stamp(change), len(instance.samples)
    for info in reversed(instance.samples):
        if not info.valid_data or _stamp(info._change) <= stamp:
            break
        place -= 1
    return place


def left(instance: Instance, info: SampleInfo) -> None:
    """A sample with data is taken, or pushed out."""
    instance.settled = max(instance.settled, _stamp(info._change))
