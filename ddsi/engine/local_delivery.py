"""LocalDelivery: what writers and readers of one participant hand over to each other, without the wire.

They match by the same rules as all others (``matchmaker``), and the reader's history makes no difference between what
came this way and what came by datagrams.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..trace.reasons import SampleLossReason
from .local_endpoints import LocalReader, LocalWriter

if TYPE_CHECKING:
    from .participant import Participant

__all__ = ["LocalDelivery"]


class LocalDelivery:
    """One for each participant."""

    def __init__(self, engine: Participant) -> None:
        self._engine = engine

    def written(self, writer: LocalWriter, now: float) -> None:
        """To every reader of ours that is matched with it."""
        for guid in list(writer.behavior.local_readers):
            self.deliver(writer, self._engine.local_readers[guid], now)

    def deliver(self, writer: LocalWriter, reader: LocalReader, now: float) -> None:
        """Hand a reader what the writer holds and it lacks, in order, as far as it has room.

        There is no wire in between, so numbers that are not in the cache, or are for others, are simply stepped over.
        """
        writer_proxy = reader.behavior.writers[writer.guid]
        reader_proxy = writer.behavior.local_readers[reader.guid]
        cache = writer.behavior.cache
        number = max(writer_proxy.next_sn, min(cache.first_sn, cache.last_sn + 1))
        while number <= cache.last_sn:
            change = cache.get(number)
            if change is not None and change.is_end_of_set and reader.sets is None:
                change = None
            if change is not None and reader_proxy.is_relevant(change):
                if reader.keys is not None and not change.key and not change.is_end_of_set:
                    change.key = reader.key_of(change) or b""  # written when nobody here needed it
                if not reader.behavior.history.add(change, now):
                    break
                writer_proxy.latest_timestamp = change.source_timestamp
            number += 1
        writer_proxy.reorder.next_sn = number
        writer_proxy.last_seq = cache.last_sn
        writer.behavior.local_reader_progress(reader_proxy, number - 1, now)

    def given_up(self, writer: LocalWriter, reader: LocalReader) -> None:
        """The two are about to part: what the reader found no room for until now it will not get."""
        proxy = reader.behavior.writers[writer.guid]
        if proxy.next_sn > proxy.last_seq:
            return
        changes = writer.behavior.cache.changes()
        left = [change for change in changes if proxy.next_sn <= change.sequence_number <= proxy.last_seq]
        count = sum(not change.is_end_of_set for change in left)
        self._engine.samples_lost(reader, proxy, count, proxy.next_sn, SampleLossReason.WRITER_LOST)

    def resume(self, reader: LocalReader, now: float) -> None:
        """There may be room for what a reader could not take."""
        engine = self._engine
        for guid, proxy in reader.behavior.writers.items():
            if proxy.is_local and proxy.next_sn <= proxy.last_seq:
                writer = engine.local_writers[guid]
                self.deliver(writer, reader, now)
                engine.writer_answers(writer, ())
