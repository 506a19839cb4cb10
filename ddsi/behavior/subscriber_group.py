"""SubscriberGroup: what the writers of one publisher wrote, in one order and in whole sets, for the readers of one
subscriber.

DDS 1.4 §2.2.3.6 (PRESENTATION with access scope GROUP), §2.2.2.5.2.8-10 (begin_access, end_access, get_datareaders);
RTPS 2.5 §8.7.5 (Group Ordered Access), §8.7.6 (Coherent Sets).

The changes of a publisher bear numbers of the publisher's, group numbers, which go over all its writers.  They come to
several readers on several ways, so that a later one may be here first.  Each publisher therefore has a queue by group
number; a set stands in it as one unit, under the number of its first change.  Only the head of the queue may become
visible:

- A set, when each of the writers that are read here has ended its part, or is known to have had none: because what it
  sent since, or a HEARTBEAT, speaks of a later group number.
- A change, where order was asked for, when it is the next one, or when the numbers before it are known not to come:
  those of writers that are not read here, say.  A writer that tells nothing of its publisher is given half a second;
  more while something of it is known to be under way.  Best effort is not waited for.

While the application accesses the readers nothing becomes visible: what it reads from one fits what it reads from the
others.  A unit becomes visible whole or not at all; where a reader has no room for it, everything behind it waits.

What waits is bounded.  Where the bound is reached an unfinished set is given up, and order is given up, rather than
memory; but what the application itself holds up is left with its writers, unacknowledged.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable
from itertools import count

from ..structure.cache_change import CacheChange
from ..structure.discovered import DiscoveredWriterData
from ..structure.guid import Guid
from ..structure.qos_policies import Presentation
from .coherent_sets import OCTETS_BESIDE_PAYLOAD, Part, WhenLost
from .reader_history_cache import ReaderHistoryCache
from .stateful_reader import ChangeSink
from .writer_proxy import WriterProxy

__all__ = ["PATIENCE_S", "SubscriberGroup"]

PATIENCE_S = 0.5
"""How long a change waits for what may come before it, of a writer that says nothing of its publisher."""

_MAX_PAST_SETS = 1024  # of each publisher: late parts of these are known to be too late

_MAX_IDLE_PUBLISHERS = 64  # lost ones, of which parts of sets that are over may come once more

_PairKey = tuple[Guid, Guid]  # reader, writer


class _Pair:
    """A reader of ours and a writer of the publisher's that it reads."""

    __slots__ = ("delivered_sn", "group_sn", "past", "proxy", "told")

    def __init__(self, proxy: WriterProxy) -> None:
        self.proxy = proxy
        self.group_sn = 0  # all of its changes up to this group number have come
        self.delivered_sn = 0
        # Up to that number, which has that group number, it has all that it wrote up to the last one.
        self.told: tuple[int, int, int] | None = None
        self.past = (0, 0)  # what the writer wrote last that is not for this reader: its number, and group number

    def progress(self) -> int:
        """The group number up to which nothing more is to come from this writer."""
        if self.told is not None and max(self.delivered_sn + 1, self.proxy.next_sn) > self.told[0]:
            self.group_sn = max(self.group_sn, self.told[2])
        return self.group_sn

    def has_lost_before(self, number: int) -> bool:
        """Are numbers missing between the last one and this?

        Those of the time before the match do not count.  A writer keeps no more of its history than it has to: where
        all of its part in a set was replaced since, the set is what is left of it.
        """
        return not self.proxy.is_local and number > max(self.delivered_sn, self.proxy.historical_sn) + 1

    def settle_past(self) -> None:
        """Nothing has come yet, and what is known to be there is not for this reader."""
        if self.told is not None and not self.delivered_sn and self.told[0] < self.proxy.next_sn:
            self.past = self.told[:2]

    def may_have_missed(self, group_set_sn: int, end_sn: int) -> bool:
        """The writer ends a set under this number, and nothing of it came: was its part written before the match?

        Where that is not told, the worst is assumed; but one that tells nothing of its publisher is believed.
        """
        if self.told is None or self.delivered_sn or end_sn == 1 or self.proxy.needs_historical_data:
            return False
        past_sn, past_group_sn = self.past
        return past_sn != end_sn - 1 or past_group_sn >= group_set_sn

    @property
    def is_behind(self) -> bool:
        """Is something known to be under way?"""
        return not self.proxy.is_local and (
            self.proxy.schedule.is_preemptive or max(self.delivered_sn + 1, self.proxy.next_sn) <= self.proxy.last_seq
        )


class _Unit:
    """What becomes visible together: one change, or a set with the parts of all its writers."""

    __slots__ = ("begun", "changes", "end_sn", "ended", "group_sn", "is_gone", "is_set", "octets", "since")

    def __init__(self, group_sn: int, now: float, *, is_set: bool) -> None:
        self.group_sn = group_sn
        self.since = now
        self.is_set = is_set
        self.changes: list[tuple[_Member, CacheChange]] = []
        self.octets = OCTETS_BESIDE_PAYLOAD  # an empty one has a place in the queue too
        self.begun: dict[_PairKey, None] = {}
        self.ended: dict[_PairKey, None] = {}
        self.end_sn = group_sn
        self.is_gone = False

    def put(self, member: _Member, changes: list[CacheChange]) -> int:
        """Returns what they cost."""
        self.changes.extend((member, change) for change in changes)
        octets = sum(len(change.payload) + OCTETS_BESIDE_PAYLOAD for change in changes)
        self.octets += octets
        return octets


class _Publisher:
    """One publisher's queue.  ``position``: the highest group number that has become visible, or was given up."""

    __slots__ = ("_order", "is_blocked", "name", "pairs", "past_sets", "position", "queue", "sets")

    def __init__(self, name: bytes) -> None:
        self.name = name
        self.is_blocked = False  # a reader has no room for what stands at the head
        self.pairs: dict[_PairKey, _Pair] = {}
        self.queue: list[tuple[int, int, _Unit]] = []
        self.sets: dict[int, _Unit] = {}
        self.past_sets: dict[int, None] = {}
        self.position = 0
        self._order = 0

    def push(self, unit: _Unit) -> None:
        self._order += 1
        heapq.heappush(self.queue, (unit.group_sn, self._order, unit))
        if unit.is_set:
            self.sets[unit.group_sn] = unit

    def pop(self) -> _Unit:
        unit = heapq.heappop(self.queue)[2]
        self.position = max(self.position, unit.end_sn)
        self.forget_set(unit)
        return unit

    def forget_set(self, unit: _Unit) -> None:
        """Parts of it that are yet to come are too late."""
        if unit.is_set and self.sets.get(unit.group_sn) is unit:
            del self.sets[unit.group_sn]
            self.past_sets[unit.group_sn] = None
            if len(self.past_sets) > _MAX_PAST_SETS:
                del self.past_sets[next(iter(self.past_sets))]

    def highest(self) -> int:
        """Where a change without a group number stands: behind all that is here."""
        return max((unit.group_sn for _, _, unit in self.queue), default=self.position)


class SubscriberGroup:
    """``on_timer`` is told when :meth:`release` is wanted, at the latest."""

    def __init__(self, guid: Guid, *, max_octets: int, on_timer: Callable[[float], None]) -> None:
        """``max_octets``: what may wait here, of all publishers together."""
        self.guid = guid
        self.octets = 0
        self.is_ordered = False
        self._max_octets = max_octets
        self._on_timer = on_timer
        self._members: dict[Guid, _Member] = {}
        self._publishers: dict[bytes, _Publisher] = {}
        self._of_pair: dict[_PairKey, _Publisher] = {}
        self._timer_due = math.inf
        self._access_depth = 0
        self._withheld: dict[Guid, None] = {}
        self._arrivals = count(1)

    def __repr__(self) -> str:
        waiting = sum(len(publisher.queue) for publisher in self._publishers.values())
        return f"<SubscriberGroup {self.guid}, {len(self._members)} readers, {waiting} units wait>"

    # --- access ------------------------------------------------------------------------------------------

    @property
    def is_accessed(self) -> bool:
        """Is the application in the middle of reading?"""
        return self._access_depth > 0

    def begin_access(self) -> None:
        self._access_depth += 1

    def end_access(self) -> None:
        """Ask :attr:`is_accessed` before, and :meth:`release` behind it."""
        assert self._access_depth
        self._access_depth -= 1

    # --- who belongs to it -------------------------------------------------------------------------------

    def join(
        self, reader: Guid, policy: Presentation, history: ReaderHistoryCache, sink: ChangeSink, on_lost: WhenLost
    ) -> _Member:
        """A reader's outlet into the group; ``sink`` leads to its history."""
        member = self._members[reader] = _Member(self, reader, policy, history, sink, on_lost)
        if policy.ordered_access:
            self.is_ordered = True
            history.arrivals = self._arrivals
        return member

    def leave(self, reader: Guid) -> None:
        """The reader is closed: what waited for it alone is forgotten."""
        member = self._members.pop(reader, None)
        self._withheld.pop(reader, None)
        for publisher in self._publishers.values():
            for _, _, unit in publisher.queue:
                unit.changes = [entry for entry in unit.changes if entry[0] is not member]
        for key in [key for key in self._of_pair if key[0] == reader]:
            publisher = self._of_pair.pop(key)
            del publisher.pairs[key]
            for unit in publisher.sets.values():
                unit.begun.pop(key, None)
            if not publisher.pairs:
                self._forget_sets(publisher)

    def writer_matched(self, reader: Guid, proxy: WriterProxy) -> None:
        """``proxy`` is what ``reader`` knows of the writer."""
        publisher = self._publisher(_publisher_of(proxy.data))
        publisher.pairs[(reader, proxy.guid)] = _Pair(proxy)
        self._of_pair[(reader, proxy.guid)] = publisher

    def writer_unmatched(
        self, reader: Guid, writer: Guid, now: float, *, has_said_all: bool, may_return: bool = False
    ) -> None:
        """It is waited for no more.  A set whose part it has not ended will never be whole.

        Nor will one that it may have had a part in, unless it ``has_said_all``, being closed in good order.  If it
        ``may_return``, parts of those sets may come once more, and are too late.
        """
        key = (reader, writer)
        publisher = self._of_pair.pop(key, None)
        if publisher is None:
            return
        pair = publisher.pairs.pop(key)
        for unit in list(publisher.sets.values()):
            is_past = bool(unit.ended) and self._has_passed(pair, unit, now)  # till then nobody knows where the end is
            may_lack = key in unit.begun or not (has_said_all or is_past)
            if key not in unit.ended and may_lack:
                self._give_up(publisher, unit, "a writer was gone before the end of its coherent set")
        if not may_return and not publisher.pairs:
            self._forget_sets(publisher)
        self._release_of(publisher, now)

    def _forget_sets(self, publisher: _Publisher) -> None:
        """Nobody here reads it any more: who does later begins anew."""
        for unit in list(publisher.sets.values()):
            if not unit.ended:
                self._give_up(publisher, unit, "its publisher was gone before the end of its coherent set")
        publisher.past_sets.clear()

    def told(self, reader: Guid, writer: Guid, last_sn: int, last_group_sn: int, group_sn: int) -> None:
        """A HEARTBEAT, before anything is delivered for it: up to ``last_sn``, which has ``last_group_sn``, the writer
        has all that it wrote up to ``group_sn``.  :meth:`passed` is to follow."""
        publisher = self._of_pair.get((reader, writer))
        if publisher is not None:
            publisher.pairs[(reader, writer)].told = (last_sn, last_group_sn, group_sn)

    def passed(self, reader: Guid, writer: Guid, now: float) -> None:
        """Numbers of this writer are known not to come, or nothing more is known to be under way."""
        publisher = self._of_pair.get((reader, writer))
        if publisher is not None:
            publisher.pairs[(reader, writer)].settle_past()
            if publisher.queue:
                self._release_of(publisher, now)

    def withheld(self) -> list[Guid]:
        """The readers for whose samples there was no room here, which may be given again."""
        withheld, self._withheld = list(self._withheld), {}
        return withheld

    # --- what comes in -----------------------------------------------------------------------------------

    def take_in(self, member: _Member, changes: list[CacheChange], now: float) -> bool:
        """A change, or the set of a writer that knows of no other parts; False where it has to wait outside."""
        last = changes[-1]
        publisher = self._find(member, last.writer_guid)
        if self._has_to_wait(member, publisher):
            return False
        group_sn = last.coherence.group_sn if last.coherence is not None else 0
        unit = _Unit(group_sn or publisher.highest(), now, is_set=False)
        unit.put(member, changes)
        self._push(publisher, unit)
        self._note(publisher, member, last, since=changes[0], before_sn=unit.group_sn)
        self._release_of(publisher, now)
        return True

    def begun(self, member: _Member, part: Part, now: float) -> None:
        publisher = self._find(member, part.first.writer_guid)
        self._note(publisher, member, part.first, since=part.first, before_sn=part.group_set_sn)
        unit = self._unit_of(publisher, part.group_set_sn, now)
        if unit is not None:
            unit.begun[(member.reader, part.first.writer_guid)] = None

    def complete(self, member: _Member, part: Part, end: CacheChange, now: float) -> bool:
        first, last = part.changes[0], part.changes[-1]
        publisher = self._find(member, first.writer_guid)
        if self._has_to_wait(member, publisher):
            return False
        unit = self._unit_of(publisher, part.group_set_sn, now)
        if unit is None:
            member.on_lost(first.writer_guid, first.sequence_number, len(part.changes), "its coherent set is over")
        else:
            self.octets += unit.put(member, part.changes)
        self._ended(publisher, unit, member, last, end)
        self._release_of(publisher, now)
        return True

    def spoilt(self, member: _Member, part: Part, end: CacheChange | None, now: float) -> None:
        publisher = self._find(member, part.first.writer_guid)
        unit = publisher.sets.get(part.group_set_sn)
        if unit is not None:
            self._give_up(publisher, unit, f"another part of the coherent set is not whole: {part.flaw}")
        pair = publisher.pairs.get((member.reader, part.first.writer_guid))
        if pair is not None and end is not None:
            pair.delivered_sn = end.sequence_number - 1
            if end.is_end_of_set:
                self._note(publisher, member, end, since=end, before_sn=0)
        self._release_of(publisher, now)

    def nothing(self, member: _Member, end: CacheChange, now: float) -> bool:
        """A mark without a part: the writer has passed the set."""
        coherence = end.coherence
        assert coherence is not None
        publisher = self._find(member, end.writer_guid)
        if self._has_to_wait(member, publisher):
            return False
        if member.policy.coherent_access:
            unit = self._unit_of(publisher, coherence.group_set_sn, now)
            pair = publisher.pairs.get((member.reader, end.writer_guid))
            if unit is not None and pair is not None and pair.may_have_missed(unit.group_sn, end.sequence_number):
                self._give_up(publisher, unit, "a reader came in the middle of the coherent set")
            self._note(publisher, member, end, since=end, before_sn=coherence.group_set_sn + 1)
            self._ended(publisher, unit, member, end, end)
        else:  # all that it means here is its place in the order
            self._push(publisher, _Unit(coherence.group_sn or publisher.highest(), now, is_set=False))
            self._note(publisher, member, end, since=end, before_sn=coherence.group_sn)
        self._release_of(publisher, now)
        return True

    def _publisher(self, name: bytes) -> _Publisher:
        publisher = self._publishers.get(name)
        if publisher is None:
            idle = [known.name for known in self._publishers.values() if not known.pairs and not known.queue]
            for forgotten in idle[: max(len(idle) - _MAX_IDLE_PUBLISHERS, 0)]:
                del self._publishers[forgotten]
            publisher = self._publishers[name] = _Publisher(name)
        return publisher

    def _find(self, member: _Member, writer: Guid) -> _Publisher:
        """A writer whose match has just ended, so that what waited behind a gap is handed over, stands for itself."""
        return self._of_pair.get((member.reader, writer)) or self._publisher(bytes(writer))

    def _unit_of(self, publisher: _Publisher, group_set_sn: int, now: float) -> _Unit | None:
        """The set of that number, begun if need be; None if it is over, or if there is none."""
        unit = publisher.sets.get(group_set_sn)
        if unit is None and group_set_sn and group_set_sn not in publisher.past_sets:
            unit = _Unit(group_set_sn, now, is_set=True)
            self._push(publisher, unit)
        return unit

    def _push(self, publisher: _Publisher, unit: _Unit) -> None:
        publisher.push(unit)
        self.octets += unit.octets

    def _ended(
        self, publisher: _Publisher, unit: _Unit | None, member: _Member, last: CacheChange, end: CacheChange
    ) -> None:
        """A writer has ended its part, of which ``last`` was the last change; ``end`` told so."""
        self._note(publisher, member, last, since=last, before_sn=0)
        if end.is_end_of_set:
            self._note(publisher, member, end, since=end, before_sn=0)
        if unit is not None:
            unit.ended[(member.reader, last.writer_guid)] = None
            end_sn = end.coherence.group_sn if end.coherence is not None else 0
            unit.end_sn = max(unit.end_sn, end_sn - (not end.is_end_of_set))

    def _note(
        self, publisher: _Publisher, member: _Member, change: CacheChange, *, since: CacheChange, before_sn: int
    ) -> None:
        """A writer has come so far.  Had it more to say before ``since``, then sets that began before that group number
        may lack what it wrote in them."""
        key = (member.reader, change.writer_guid)
        pair = publisher.pairs.get(key)
        if pair is None:
            return
        if pair.has_lost_before(since.sequence_number):
            for unit in list(publisher.sets.values()):
                if unit.group_sn < before_sn and key not in unit.ended:
                    self._give_up(publisher, unit, "numbers are missing that may have belonged to its coherent set")
        pair.delivered_sn = max(pair.delivered_sn, change.sequence_number)
        pair.group_sn = max(pair.group_sn, change.coherence.group_sn if change.coherence is not None else 0)

    def _has_to_wait(self, member: _Member, publisher: _Publisher) -> bool:
        """The application holds everything up, and enough waits for it here."""
        if self.octets < self._max_octets or not (self.is_accessed or publisher.is_blocked):
            return False
        member.history.is_withholding = True
        self._withheld[member.reader] = None
        return True

    # --- what becomes visible ----------------------------------------------------------------------------

    def release(self, now: float) -> None:
        """Let become visible what may."""
        self._timer_due = math.inf
        for publisher in list(self._publishers.values()):
            self._release_of(publisher, now)

    def _release_of(self, publisher: _Publisher, now: float) -> None:
        publisher.is_blocked = False
        while publisher.queue and not self.is_accessed:
            unit = publisher.queue[0][2]
            if not unit.is_gone and not self._may_become_visible(publisher, unit, now):
                if self.octets <= self._max_octets:
                    self._wait_until(unit.since + PATIENCE_S, now)
                    return
                if unit.is_set:
                    self._give_up(publisher, unit, f"more than {self._max_octets} octets waited for its coherent set")
            if not unit.is_gone and not self._make_visible(unit, now):
                publisher.is_blocked = True
                return
            publisher.pop()
            self.octets -= unit.octets
        if not publisher.queue and not publisher.pairs and not publisher.past_sets:
            self._publishers.pop(publisher.name, None)

    def _wait_until(self, due: float, now: float) -> None:
        """See to it that :meth:`release` is called; where patience is over, only what comes can help."""
        if now < due < self._timer_due:
            self._timer_due = due
            self._on_timer(due)

    def _may_become_visible(self, publisher: _Publisher, unit: _Unit, now: float) -> bool:
        if unit.is_set:
            return (
                bool(unit.ended)
                and all(key in unit.ended for key in unit.begun)
                and all(key in unit.ended or self._has_passed(pair, unit, now) for key, pair in publisher.pairs.items())
            )
        if not self.is_ordered or unit.group_sn <= publisher.position + 1:
            return True
        return all(self._has_passed(pair, unit, now) for pair in publisher.pairs.values())

    def _has_passed(self, pair: _Pair, unit: _Unit, now: float) -> bool:
        """Has this writer nothing to send any more that belongs into the unit, or before it?"""
        if pair.progress() >= (unit.end_sn if unit.is_set else unit.group_sn - 1):
            return True
        if pair.proxy.is_local and not unit.is_set:
            return True
        if not pair.proxy.is_reliable:
            return not unit.is_set
        if unit.is_set and pair.told is not None:
            return False  # it will say so
        return now - unit.since >= PATIENCE_S and not pair.is_behind

    def _make_visible(self, unit: _Unit, now: float) -> bool:
        """All of it or nothing; False where an application has to take something before."""
        by_member: dict[_Member, list[CacheChange]] = {}
        for member, change in unit.changes:
            by_member.setdefault(member, []).append(change)
        for member, changes in by_member.items():
            limit = member.history.lacks_room_for(changes)
            if limit is not None:
                is_rejected = member.history.no_room_for(changes, limit)
                if is_rejected:
                    self._lose(unit, f"there is no room for its coherent set: {limit}", besides=member)
                return is_rejected
        for member, change in sorted(unit.changes, key=_group_sn_of) if unit.is_set else unit.changes:
            member.sink.add(change, now)
        return True

    def _give_up(self, publisher: _Publisher, unit: _Unit, why: str) -> None:
        unit.is_gone = True
        publisher.forget_set(unit)
        self._lose(unit, why)
        self.octets += OCTETS_BESIDE_PAYLOAD - unit.octets
        unit.octets = OCTETS_BESIDE_PAYLOAD  # it stays in the queue until its turn comes
        unit.changes.clear()

    def _lose(self, unit: _Unit, why: str, *, besides: _Member | None = None) -> None:
        """Tell the readers of what they will not see; all but one, which was told in another way."""
        lost: dict[tuple[_Member, Guid], list[int]] = {}
        for member, change in unit.changes:
            if member is not besides:
                lost.setdefault((member, change.writer_guid), []).append(change.sequence_number)
        for (member, writer), numbers in lost.items():
            member.on_lost(writer, numbers[0], len(numbers), why)


class _Member:
    """A reader of the group: the Outlet of its CoherentSets."""

    __slots__ = ("_group", "history", "on_lost", "policy", "reader", "sink")

    def __init__(
        self,
        group: SubscriberGroup,
        reader: Guid,
        policy: Presentation,
        history: ReaderHistoryCache,
        sink: ChangeSink,
        on_lost: WhenLost,
    ) -> None:
        self._group = group
        self.reader = reader
        self.policy = policy
        self.history = history
        self.sink = sink
        self.on_lost = on_lost

    def sample(self, change: CacheChange, now: float) -> bool:
        return self._group.take_in(self, [change], now)

    def begun(self, part: Part, now: float) -> None:
        if part.group_set_sn:
            self._group.begun(self, part, now)

    def complete(self, part: Part, end: CacheChange, now: float) -> bool:
        if not part.group_set_sn:
            return self._group.take_in(self, part.changes, now)
        return self._group.complete(self, part, end, now)

    def spoilt(self, part: Part, end: CacheChange | None, now: float) -> None:
        if part.group_set_sn:
            self._group.spoilt(self, part, end, now)

    def nothing(self, end: CacheChange, now: float) -> bool:
        return self._group.nothing(self, end, now)


def _publisher_of(data: DiscoveredWriterData) -> bytes:
    """Whose queue a writer's changes stand in.  One that does not say counts as of the one publisher of its
    participant; nobody can speak for a publisher of another."""
    return bytes(data.guid[:12]) + bytes(data.group_entity_id)


def _group_sn_of(entry: tuple[_Member, CacheChange]) -> int:
    coherence = entry[1].coherence
    return coherence.group_sn if coherence is not None else 0
