"""ReaderProxy: a local writer's view of one matched reader.  Other names: wr_prd_match, rd match.

RTPS 2.5 §8.4.7.5 (RTPS ReaderProxy).  Counters instead of a status per change: all up to ``acked_sn`` is
acknowledged or was never for this reader; from there to ``lst_seq`` it was sent; beyond, not yet.
``match_sn`` is how far the writer had sent when they matched: a late joiner's requests up to there are no losses.
"""

from __future__ import annotations

import math

from ..structure.builtin_entity_ids import SPDP_SECURE_READER
from ..structure.cache_change import CacheChange
from ..structure.discovered import DiscoveredReaderData
from ..structure.guid import GUID_UNKNOWN, EntityId, Guid
from ..structure.locator import Locator
from ..structure.vendor import CYCLONE
from .content_filter import ContentFilter
from .schedules import NACK_RESPONSE_SUPPRESSION, heartbeat_period

__all__ = ["ReaderProxy"]

_PREEMPTIVE_ANSWER_INTERVAL_S = 0.005
_STALE_COUNT_S = 0.5
_ANSWERS_IN_VAIN = 3


class ReaderProxy:
    """``lst_seq`` (Last SenT): the highest number sent, or told by GAP, to this reader.  Writer side only."""

    __slots__ = (
        "_last_acknack_count",
        "_last_acknack_time",
        "_last_nack_frag_count",
        "_last_nack_frag_time",
        "_last_preemptive",
        "_never_acknowledges",
        "_participant",
        "_resends",
        "_resent",
        "_unanswered",
        "acked_sn",
        "content_filter",
        "data",
        "guid",
        "heartbeat_due",
        "history_sn",
        "is_reliable",
        "is_stalled",
        "locators",
        "lst_seq",
        "match_sn",
        "progress_time",
    )

    def __init__(
        self, data: DiscoveredReaderData, locators: tuple[Locator, ...], *, history_sn: int, now: float
    ) -> None:
        """``history_sn``: the highest number that was written before the match and that this reader must not
        get (a volatile one gets none of the history); 0 when it is to have all that the cache holds."""
        self.data = data
        self.guid: Guid = data.guid
        self.locators = locators
        self.content_filter: ContentFilter | None = None  # what the writer evaluates for it
        self.is_reliable = data.qos.is_reliable
        self.history_sn = history_sn
        self.acked_sn = history_sn
        self.lst_seq = history_sn
        self.match_sn = history_sn
        self.is_stalled = False
        self.progress_time = now
        self._participant = data.guid.participant
        self._last_acknack_count = 0
        self._last_acknack_time = -math.inf
        self._last_nack_frag_count = 0
        self._last_nack_frag_time = -math.inf
        self._last_preemptive = -math.inf
        self._resent: dict[int, float] = {}
        self._resends = 0  # since something was acknowledged
        # Cyclone DDS takes what comes for this reader as it comes, past what counts, and asks for it for ever.
        self._never_acknowledges = data.vendor_id == CYCLONE and data.guid.entity_id == SPDP_SECURE_READER
        self._unanswered = 0
        self.heartbeat_due = -math.inf  # not to be asked again before

    def __repr__(self) -> str:
        return f"<ReaderProxy {self.guid} acked {self.acked_sn} sent {self.lst_seq}>"

    @property
    def entity_id(self) -> EntityId:
        return self.guid.entity_id

    @property
    def participant_guid(self) -> Guid:
        return self._participant

    @property
    def holds_window(self) -> bool:
        """Does what it lacks hold back what is new?  Not if it is silent, nor while it lacks older history."""
        return not self.is_stalled and self.acked_sn >= self.match_sn

    def is_relevant(self, change: CacheChange) -> bool:
        """Is the change meant for this reader?  RTPS 2.5 §8.4.7.5 (DDS_FILTER), DDS-Security 1.1 §7.4.4.4.

        Its destination is nobody in particular, this reader, or this reader's participant; and it passes the reader's
        content filter, where the writer evaluates that.
        """
        if self.content_filter is not None and not self.content_filter.passes(change):
            return False
        destination = change.destination
        return destination == GUID_UNKNOWN or destination == self._participant or destination == self.guid

    def acked_changes_set(self, committed_sn: int) -> bool:
        """All up to ``committed_sn`` (inclusive) is acknowledged.  Returns whether that is news.

        RTPS 2.5 §8.4.7.5.2.  Never moves backwards.
        """
        if committed_sn <= self.acked_sn:
            return False
        for number in [sn for sn in self._resent if sn <= committed_sn]:
            del self._resent[number]
        self.acked_sn = committed_sn
        self._resends = 0
        return True

    def asked(self, now: float) -> None:
        """A periodic HEARTBEAT wants its answer: the more of them it leaves unanswered, the longer the next one waits.

        Each reader for itself.  In a crowd somebody acknowledges all the time, and keeps the writer's own schedule at
        its quickest; if each time all others were asked too, those who are behind would drown in questions.
        """
        self._unanswered += 1
        self.heartbeat_due = now + heartbeat_period(self._unanswered)

    def answered(self, now: float) -> None:
        """An ACKNACK came, whatever it says."""
        self.progress_time = now
        self._unanswered = 0
        self.heartbeat_due = -math.inf

    def accepts_acknack(self, count: int, now: float) -> bool:
        """Is this ACKNACK newer than the last?  Counts compare as serial numbers (RTPS 2.5 §8.3.8.1.3).

        After half a second any count is taken: a peer that counts anew must not be ignored for ever.
        """
        age = _serial_difference(count, self._last_acknack_count)
        if age <= 0 and now - self._last_acknack_time < _STALE_COUNT_S:
            return False
        self._last_acknack_count = count
        self._last_acknack_time = now
        return True

    def accepts_preemptive(self, now: float) -> bool:
        """A preemptive ACKNACK (its count is 0 from some stacks) is always answered, at a bounded rate."""
        if now - self._last_preemptive < _PREEMPTIVE_ANSWER_INTERVAL_S:
            return False
        self._last_preemptive = now
        return True

    def accepts_nack_frag(self, count: int, now: float) -> bool:
        """The same for NACK_FRAG, which is counted apart."""
        age = _serial_difference(count, self._last_nack_frag_count)
        if age <= 0 and now - self._last_nack_frag_time < _STALE_COUNT_S:
            return False
        self._last_nack_frag_count = count
        self._last_nack_frag_time = now
        return True

    def may_resend(self, sequence_number: int, now: float) -> bool:
        """Was this change not sent again to this reader just now (nackSuppressionDuration)?"""
        if now - self._resent.get(sequence_number, -math.inf) < NACK_RESPONSE_SUPPRESSION:
            return False
        if len(self._resent) >= 1024:  # bounded: forgetting only costs a resend
            self._resent.clear()
        self._resent[sequence_number] = now
        self._resends += 1
        return True

    def asks_in_vain(self) -> bool:
        """Has it had what it asks for, in all likelihood, and cannot say so?  A GAP lets it."""
        return self._never_acknowledges and self._resends >= _ANSWERS_IN_VAIN


def _serial_difference(newer: int, older: int) -> int:
    """How far ``newer`` is ahead on the circle of 32-bit counts; negative when it is behind."""
    return ((newer - older + 0x80000000) & 0xFFFFFFFF) - 0x80000000
