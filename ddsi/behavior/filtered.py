"""The filtered path: each reader sees only the changes that are meant for it, and a GAP for all others.

DDS-Security 1.1 §7.4.4 (BuiltinParticipantVolatileMessageSecure) and DDS-RTPS 2.5 §8.4.7.5 (DDS_FILTER).  The
volatile secure topic carries keys from one participant to another over one writer with one sequence of numbers.  A
sample is encrypted for one reader, so no other can read it, and to each of them its number must be explained: by a
GAP in the datagram of the next sample that it does get, or in answer to its ACKNACK when that GAP was lost or never
sent.  Each reader has a HEARTBEAT of its own, under its own key, that speaks of its own numbers only: ``last`` is
``lst_seq``, so a reader that has all of its samples is never asked again because somebody else lacks one.

Here are pure functions over a WriterHistoryCache and a ReaderProxy; :mod:`ddsi.behavior.filtering_writer` is the
writer that uses them, and :mod:`ddsi.behavior.content_filtering_writer` the one for content filters.  On the reader's
side nothing is special but that numbers which are skipped are no loss (``WriterProxy.uses_filter``).
"""

from __future__ import annotations

from collections.abc import Iterable

from ..structure.cache_change import CacheChange
from ..structure.sequence_number import MAX_SET_BITS, NumberSet
from .reader_proxy import ReaderProxy
from .transmissions import SendGap
from .writer_history_cache import WriterHistoryCache

__all__ = ["directed_heartbeat_range", "gap_before", "gap_for", "is_irrelevant"]

_MAX_GAP_SCAN = 4096


def is_irrelevant(cache: WriterHistoryCache, reader: ReaderProxy, sequence_number: int) -> bool:
    """Will this number never come to this reader: history before its match, gone, or meant for another?"""
    if sequence_number <= reader.history_sn:
        return True
    change = cache.get(sequence_number)
    return change is None or not reader.is_relevant(change)


def gap_before(reader: ReaderProxy, change: CacheChange) -> SendGap | None:
    """The GAP that goes with a sample: every number between the last one sent to this reader and this one.

    All of them are irrelevant, as relevant ones are sent in order.
    """
    start = reader.lst_seq + 1
    if start >= change.sequence_number:
        return None
    return SendGap(reader, start, NumberSet(change.sequence_number))


def gap_for(cache: WriterHistoryCache, reader: ReaderProxy, irrelevant: Iterable[int], end_sn: int) -> list[SendGap]:
    """GAPs for numbers (ascending) that the reader asked for in vain.

    A run of irrelevant numbers is followed beyond what was asked, up to ``end_sn`` (exclusive), so that a reader
    which asks for a long past gets one answer instead of one per 256 numbers.
    """
    numbers = list(irrelevant)
    if not numbers:
        return []
    start = numbers[0]
    base = _end_of_run(cache, reader, start, end_sn)
    later = [number for number in numbers if number >= base]
    gap = SendGap(reader, start, NumberSet.of(base, later))
    beyond = [number for number in later if number >= base + MAX_SET_BITS]
    return [gap, *gap_for(cache, reader, beyond, end_sn)]


def directed_heartbeat_range(cache: WriterHistoryCache, reader: ReaderProxy, last_sn: int) -> tuple[int, int]:
    """(first, last) for a HEARTBEAT to one reader; ``first == last + 1`` when there is nothing for it."""
    last = min(last_sn, reader.lst_seq)
    return min(max(cache.first_sn, reader.history_sn + 1), last + 1), last


def _end_of_run(cache: WriterHistoryCache, reader: ReaderProxy, start: int, end_sn: int) -> int:
    """The first number at or after ``start + 1`` that is relevant, or ``end_sn``."""
    number = max(start + 1, min(max(reader.history_sn + 1, cache.first_sn), end_sn))
    scanned = 0
    while number < end_sn and scanned < _MAX_GAP_SCAN and is_irrelevant(cache, reader, number):
        number += 1
        scanned += 1
    return number
