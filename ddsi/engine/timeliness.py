"""Timeliness: who misses a DEADLINE, and what outlives its LIFESPAN at a reader.  DDS 1.4 §2.2.3.7, §2.2.3.16.

Both are kept by the endpoints themselves, each with one timer for all its instances; this is where it rings.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..structure.guid import Guid
from .local_endpoints import LocalWriter

if TYPE_CHECKING:
    from .participant import Participant

__all__ = ["Timeliness"]


class Timeliness:
    """For the application's endpoints; a status is told for each instance."""

    def __init__(self, engine: Participant) -> None:
        self._engine = engine

    def writer_due(self, writer: LocalWriter, now: float) -> None:
        """The application may not have written all instances in time."""
        watch = writer.behavior.deadline
        if watch is not None and watch.due <= now:
            for key in watch.missed(now):
                self._engine.status(writer.guid, writer.deadline_missed(key))

    def reader_due(self, guid: Guid, now: float) -> None:
        """Samples may have expired, or not have come in time."""
        reader = self._engine.local_readers.get(guid)
        if reader is None or reader.history is None:
            return
        for key in reader.history.handle_timeout(now):
            self._engine.status(guid, reader.deadline_missed(key))
        if reader.history.is_withholding:  # what has expired made room
            reader.history.is_withholding = False
            self._engine.samples_taken(reader, now)
