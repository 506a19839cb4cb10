"""Instance: one instance of a topic, as a reader sees it.  DDS 1.4 §2.2.2.5.1 (Access to the data), figure 2.11."""

from __future__ import annotations

import math
from collections import deque

from ..structure.sample_info import InstanceState, SampleInfo, ViewState

__all__ = ["Instance"]


class Instance:
    """One instance: its samples (oldest first), who writes it, and its states.

    ``end_count``: how many of the samples have no data, but tell of an end.  ``owner``: the writer that owns it, where
    ownership is exclusive.  ``accepted_at``: when the time-based filter last let a sample pass.  ``settled``: where the
    order is by source, the stamp of the latest sample that has left: what is older comes too late.
    """

    __slots__ = (
        "accepted_at",
        "disposed_generation_count",
        "end_count",
        "key",
        "no_writers_generation_count",
        "owner",
        "rank",
        "samples",
        "settled",
        "state",
        "view_state",
        "writers",
    )

    def __init__(self, key: bytes) -> None:
        self.key = key
        self.samples: deque[SampleInfo] = deque()
        self.writers: set[bytes] = set()
        self.state = InstanceState.ALIVE
        self.view_state = ViewState.NEW
        self.end_count = 0
        self.disposed_generation_count = 0
        self.no_writers_generation_count = 0
        self.rank = 0
        self.owner: bytes | None = None
        self.accepted_at = -math.inf
        self.settled: tuple[int, bytes] = (-1, b"")

    @property
    def generation(self) -> int:
        return self.disposed_generation_count + self.no_writers_generation_count
