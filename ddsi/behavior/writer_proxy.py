"""WriterProxy: a local reader's view of one matched writer.  Other names: pwr_rd_match, matched writer.

RTPS 2.5 §8.4.10.4 (RTPS WriterProxy).  It owns what the pair has of its own: the order (ReorderBuffer), what
is known to exist (``last_seq``), and when to answer.  It answers questions and returns transmissions; it
neither delivers nor sends.
"""

from __future__ import annotations

import math
from collections.abc import Container

from ..structure.discovered import DiscoveredWriterData
from ..structure.guid import EntityId, Guid
from ..structure.locator import Locator
from ..structure.sequence_number import NumberSet
from ..structure.vendor import CYCLONE, FAST_DDS, OPENDDS, RTI, RTI_MICRO, TWINOAKS
from .reorder import ReorderBuffer
from .schedules import AckNackSchedule
from .transmissions import SendAckNack, SendNackFrag

__all__ = ["WriterProxy"]

_STALE_HEARTBEAT_S = 0.5
_VAIN_REQUESTS = 3
# These call an ACKNACK with base 0 preemptive; to all others base 0 is malformed.
_BASE_ZERO_VENDORS = frozenset({FAST_DDS, RTI, RTI_MICRO, OPENDDS, TWINOAKS})


class WriterProxy:
    """``last_seq``: the highest number known from this writer, by DATA, GAP or HEARTBEAT.  Reader side only.

    ``uses_filter``: the writer sends each reader its own changes only (the volatile secure endpoint), so
    numbers skipped by it are normal and the first HEARTBEAT says nothing about what was missed.
    """

    __slots__ = (
        "_acknack_count",
        "_asked_in_vain",
        "_asked_sn",
        "_contradicted_sn",
        "_heartbeat_count",
        "_heartbeat_time",
        "_nack_frag_count",
        "contradictions",
        "data",
        "guid",
        "historical_sn",
        "is_alive",
        "is_local",
        "is_reliable",
        "last_seq",
        "latest_timestamp",
        "liveliness_due",
        "locators",
        "needs_historical_data",
        "reorder",
        "resume_sn",
        "schedule",
        "uses_filter",
    )

    def __init__(
        self,
        data: DiscoveredWriterData,
        locators: tuple[Locator, ...],
        *,
        is_reliable: bool,
        needs_historical_data: bool = False,
        uses_filter: bool = False,
        is_local: bool = False,
        max_samples: int,
        max_octets: int,
    ) -> None:
        """``is_reliable``: both sides are.  ``needs_historical_data``: both keep history, so it will be sent."""
        self.data = data
        self.guid: Guid = data.guid
        self.locators = locators
        self.is_reliable = is_reliable
        self.is_local = is_local
        self.uses_filter = uses_filter
        self.needs_historical_data = needs_historical_data and is_reliable
        self.reorder = ReorderBuffer(max_samples=max_samples, max_octets=max_octets)
        self.schedule = AckNackSchedule()
        self.last_seq = 0
        self.latest_timestamp = -1  # source timestamp of what was delivered last; -1: nothing was
        self.historical_sn = -1  # what the first HEARTBEAT said is there; -1: none came yet
        # HEARTBEATs one after the other that do not know what was already delivered; best effort: samples below it.
        self.contradictions = 0
        # Where the reader had come when it lost this writer, which has returned; 0: it lost none, or is past it.
        self.resume_sn = 0
        self.is_alive = True
        self.liveliness_due = math.inf
        self._asked_sn = self._asked_in_vain = 0
        self._contradicted_sn = 0
        self._acknack_count = 0
        self._nack_frag_count = 0
        self._heartbeat_count = 0
        self._heartbeat_time = -math.inf

    def __repr__(self) -> str:
        return f"<WriterProxy {self.guid} next {self.reorder.next_sn} last {self.last_seq}>"

    @property
    def entity_id(self) -> EntityId:
        return self.guid.entity_id

    @property
    def next_sn(self) -> int:
        return self.reorder.next_sn

    @property
    def has_historical_data(self) -> bool:
        """Has all that the writer held when it first spoke come (or is there none to come)?"""
        if not self.needs_historical_data or self.is_local:
            return True
        return self.historical_sn >= 0 and self.reorder.next_sn > self.historical_sn

    def available_changes_max(self) -> int:
        """The highest number such that all up to it were delivered or will never come.  RTPS 2.5 §8.4.10.4.3."""
        return self.reorder.next_sn - 1

    def missing_changes(self, excluded: Container[int] = (), above: int = 0) -> NumberSet:
        """Changes the writer has and we lack, lowest first; at most 256 (one ACKNACK).  RTPS 2.5 §8.4.10.4.5.

        Without those ``excluded`` and those up to ``above``; its base is what must not be acknowledged all the same.
        """
        return self.reorder.missing(self.last_seq, excluded, above)

    def irrelevant_change_set(self, start: int, numbers: NumberSet) -> None:
        """GAP: [start, base) and the members of the set will never come.  RTPS 2.5 §8.4.10.4.1, §8.3.8.4."""
        self.reorder.add_irrelevant(start, numbers.base)
        last = max(start, numbers.base) - 1
        for number in numbers:
            self.reorder.add_irrelevant(number, number + 1)
            last = number
        self.last_seq = max(self.last_seq, last)

    def accepts_heartbeat(self, count: int, now: float) -> bool:
        """Is this HEARTBEAT newer than the last one (serial numbers; after half a second any will do)?"""
        age = ((count - self._heartbeat_count + 0x80000000) & 0xFFFFFFFF) - 0x80000000
        if age <= 0 and now - self._heartbeat_time < _STALE_HEARTBEAT_S:
            return False
        self._heartbeat_count = count
        self._heartbeat_time = now
        return True

    def receive_heartbeat(self, first: int, last: int, now: float, *, final: bool) -> int:
        """The writer has ``first`` to ``last``: returns how many numbers are lost for good.

        RTPS 2.5 §8.4.10.4.2 (lost_changes_update), §8.4.10.4.4 (missing_changes_update), §8.4.12.2.
        Before anything was received, numbers below ``first`` are no loss: they were never for this reader.
        """
        was_first = self.schedule.is_preemptive
        self.schedule.heartbeat_received(now)
        knew_any = self.last_seq > 0 or self.reorder.next_sn > 1
        # A writer that no longer has a number which it has already sent was written anew (RTPS 2.5 §8.2.3: they
        # ascend).
        is_known = last >= self.reorder.next_sn - 1 or self.uses_filter
        if is_known or self._contradicted_sn != self.reorder.next_sn:
            # Nor was it written anew where its samples go on: these have overtaken a HEARTBEAT that was long under way.
            self.contradictions = 0
        self._contradicted_sn = self.reorder.next_sn
        self.contradictions += not is_known
        lost = self.reorder.skip_to(first)
        # Not the most that was ever said, which anybody may have forged: the writer knows best what it has.
        self.last_seq = max(self.reorder.highest_sn, last)
        if self.historical_sn < 0:
            self.historical_sn = last
        if not final or self.contradictions:
            self.schedule.acknowledge(now)
        return lost if knew_any and not was_first and not self.uses_filter else 0

    def note_missing(self, now: float) -> None:
        """Arm the timer if something known to exist has not come."""
        if self.reorder.next_sn <= self.last_seq:
            self.schedule.missing(now, is_news=self.last_seq > self.schedule.asked_sn)
        elif not self.schedule.is_preemptive and not self.schedule.is_wanted:
            self.schedule.complete()

    def will_not_repeat(self) -> bool:
        """To be asked before each repeated request: has the writer left several for an old number unanswered?

        A writer that never lost the reader remembers what that acknowledged, and some then send it no more, whatever is
        asked for (Fast DDS): the reader goes on where it was.  Those who do are asked, as they may have begun anew.
        """
        if self.next_sn >= self.resume_sn:
            self.resume_sn = 0
            return False
        self._asked_in_vain = self._asked_in_vain + 1 if self._asked_sn == self.next_sn else 1
        self._asked_sn = self.next_sn
        return self._asked_in_vain > _VAIN_REQUESTS

    def preemptive_acknack(self, now: float) -> SendAckNack:
        """Before the first HEARTBEAT: "here I am, what have you?", in the form that the writer's vendor takes.

        Cyclone DDS takes its preemptive path only on count 0 and base 1; some want base 0; the others drop count 0.
        """
        self.schedule.preemptive_sent(now)
        if self.data.vendor_id == CYCLONE:
            return SendAckNack(NumberSet(1), 0, final=False)
        self._acknack_count += 1
        base = 0 if self.data.vendor_id in _BASE_ZERO_VENDORS else 1
        return SendAckNack(NumberSet(base), self._acknack_count, final=False)

    def acknack(self, missing: NumberSet) -> SendAckNack:
        """What is here and what is not.

        Final, as no HEARTBEAT is wanted in return but for data that is asked for.  Only a writer that has just
        contradicted itself, or that was asked in vain for long, is to say again what it has.
        """
        self._acknack_count += 1
        is_doubtful = self.contradictions > 0 or self.schedule.is_in_vain
        return SendAckNack(missing, self._acknack_count, final=not is_doubtful)

    def nack_frag(self, sequence_number: int, missing: NumberSet) -> SendNackFrag:
        self._nack_frag_count += 1
        return SendNackFrag(sequence_number, missing, self._nack_frag_count)
