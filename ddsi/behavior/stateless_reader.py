"""StatelessReader: takes every change that comes, and keeps no account of what came before.

RTPS 2.5 §8.4.11 (RTPS StatelessReader); DDS-Security 1.1 §7.4.3, where ParticipantStatelessMessage is the user.  Before
anybody is authenticated anybody can have sent anything.  A reader that remembered numbers could be stopped by one
forged DATA with a huge one: all that the true writer says afterwards would seem old.  So order, repetition and sense
are left to whoever reads the changes.

It is a StatefulReader in this alone, that the engine finds it by the writers it is matched with, and that each
has a proxy, whose numbers never move.
"""

from __future__ import annotations

from ..structure.cache_change import CacheChange
from ..structure.sequence_number import NumberSet
from .stateful_reader import StatefulReader
from .writer_proxy import WriterProxy

__all__ = ["StatelessReader"]


class StatelessReader(StatefulReader):
    """Best effort whatever the writer offers; its history gets every change once for each time that it comes."""

    def receive_data(self, proxy: WriterProxy, change: CacheChange, now: float) -> int:
        self.history.add(change, now)
        return 0

    def fragment_received(self, proxy: WriterProxy, sequence_number: int, now: float) -> bool:
        return True

    def receive_gap(self, proxy: WriterProxy, start: int, numbers: NumberSet, now: float) -> None:
        """No number is waited for."""
