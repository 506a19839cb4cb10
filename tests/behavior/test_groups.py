"""PublisherGroup and SubscriberGroup: numbers, sets and order over several writers.  RTPS 2.5 §8.7.5, §8.7.6."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ddsi.behavior.coherent_sets import OCTETS_BESIDE_PAYLOAD, CoherentSets
from ddsi.behavior.publisher_group import PublisherGroup, group_digest
from ddsi.behavior.reader_history_cache import ReaderHistoryCache
from ddsi.behavior.subscriber_group import PATIENCE_S, SubscriberGroup
from ddsi.behavior.writer_proxy import WriterProxy
from ddsi.structure.cache_change import CacheChange, ChangeKind
from ddsi.structure.coherence import Coherence
from ddsi.structure.discovered import DiscoveredWriterData
from ddsi.structure.guid import EntityId, EntityKind, Guid
from ddsi.structure.qos import Qos, reader_qos, writer_qos
from ddsi.structure.qos_policies import AccessScope, KeepAll, Presentation, Reliable, ResourceLimits
from tests.behavior.builders import guid, reader_guid

TOPIC, GROUP = AccessScope.TOPIC, AccessScope.GROUP
COHERENT = Presentation(GROUP, coherent_access=True)
ORDERED = Presentation(GROUP, ordered_access=True)
BOTH = Presentation(GROUP, True, True)
PUBLISHER = EntityId.user(9, EntityKind.WRITER_GROUP)
W = [guid(1, key) for key in (1, 2, 3)]
R = [reader_guid(2, key) for key in (1, 2, 3)]


# --- the publisher ---------------------------------------------------------------------------------------


def test_each_writer_ends_the_sets_of_its_group_also_those_it_had_no_part_in() -> None:
    group = PublisherGroup(PUBLISHER)
    for writer in W[:2]:
        group.writer_added(writer, COHERENT)
    assert group.next_place(W[0], 1) == Coherence(group_sn=1)
    group.begin_coherent_changes()
    assert group.next_place(W[0], 2) == Coherence(set_sn=2, group_sn=2, group_set_sn=2)
    assert group.next_place(W[0], 3) == Coherence(set_sn=2, group_sn=3, group_set_sn=2)
    ends = group.end_coherent_changes()
    assert ends == {
        W[0]: Coherence(2, 4, 2, is_end=True, writer_set=group.writer_set),
        W[1]: Coherence(0, 4, 2, is_end=True, writer_set=group.writer_set),
    }
    assert group.next_place(W[1], 7) == Coherence(group_sn=5)


def test_with_topic_scope_only_those_who_wrote_end_their_parts() -> None:
    group = PublisherGroup(PUBLISHER)
    for writer in W[:2]:
        group.writer_added(writer, Presentation(TOPIC, coherent_access=True))
    assert group.next_place(W[0], 1) is None
    group.begin_coherent_changes()
    group.begin_coherent_changes()
    assert group.next_place(W[0], 2) == Coherence(set_sn=2)
    assert group.end_coherent_changes() == {}, "the outermost counts"
    assert group.end_coherent_changes() == {W[0]: Coherence(2, is_end=True)}
    assert not group.is_open


def test_an_empty_set_has_no_end() -> None:
    group = PublisherGroup(PUBLISHER)
    group.writer_added(W[0], COHERENT)
    group.begin_coherent_changes()
    assert group.end_coherent_changes() == {}
    assert group.group_sn == 0


def test_the_digest_is_of_who_belongs_to_the_group_whatever_came_first() -> None:
    one, other = {W[0]: COHERENT, W[1]: COHERENT}, {W[1]: COHERENT, W[0]: COHERENT}
    assert group_digest(one) == group_digest(other) != group_digest({W[0]: COHERENT})
    assert len(group_digest(one)) == 4
    assert group_digest({}) == bytes(4)


# --- the subscriber --------------------------------------------------------------------------------------


@dataclass
class Bench:
    """Three readers of a subscriber, each matched with one writer of the same publisher."""

    policy: Presentation = COHERENT
    max_octets: int = 1 << 20
    limits: ResourceLimits = ResourceLimits()
    is_reliable: bool = True
    lost: int = 0
    due: float = math.inf
    now: float = 0.0
    numbers: list[int] = field(default_factory=lambda: [0, 0, 0])

    def __post_init__(self) -> None:
        self.group = SubscriberGroup(Guid(bytes(16)), max_octets=self.max_octets, on_timer=self._arm)
        self.histories: list[ReaderHistoryCache] = []
        self.sinks: list[CoherentSets] = []
        self.proxies: list[WriterProxy] = []
        qos = Qos(history=KeepAll(), reliability=Reliable(), resource_limits=self.limits, presentation=self.policy)
        for reader, writer in zip(R, W, strict=True):
            history = ReaderHistoryCache(reader_qos(qos), max_octets=1 << 20, max_instances=10)
            outlet = self.group.join(reader, self.policy, history, history, self._lose)
            sets = CoherentSets(
                outlet, assembles=self.policy.coherent_access, max_octets=self.max_octets, on_lost=self._lose
            )
            data = DiscoveredWriterData(
                guid=writer, topic_name="t", type_name="T", qos=writer_qos(qos), group_entity_id=PUBLISHER
            )
            proxy = WriterProxy(data, (), is_reliable=self.is_reliable, max_samples=10, max_octets=1 << 20)
            proxy.receive_heartbeat(1, 0, 0.0, final=True)
            self.group.writer_matched(reader, proxy)
            self.histories.append(history)
            self.sinks.append(sets)
            self.proxies.append(proxy)

    def _arm(self, due: float) -> None:
        self.due = due

    def _lose(self, writer: Guid, first: int, count: int, why: str) -> None:
        self.lost += count

    def put(self, who: int, group_sn: int, group_set: int = 0, *, set_sn: int = 0, end: bool = False) -> bool:
        """The next change of a writer, by its group number; in a set if one is named."""
        number = self.numbers[who] + 1
        set_sn = set_sn or (number if group_set and not end else 0)
        coherence = Coherence(set_sn, group_sn, group_set, is_end=end)
        payload = b"" if end else group_sn.to_bytes(4, "big")
        taken = self.sinks[who].add(
            CacheChange(ChangeKind.ALIVE, W[who], number, payload, coherence=coherence), self.now
        )
        if taken:
            self.numbers[who] = self.proxies[who].last_seq = number
            self.proxies[who].reorder.next_sn = number + 1
        return taken

    def told(self, who: int, group_sn: int) -> None:
        self.group.told(R[who], W[who], self.numbers[who], group_sn, group_sn)
        self.group.passed(R[who], W[who], self.now)

    def seen(self) -> list[int]:
        """Group numbers of what became visible, in that order; taken."""
        found = [(info.arrival, change) for history in self.histories for info, change in history.take()]
        return [int.from_bytes(change.payload, "big") for _, change in sorted(found, key=lambda entry: entry[0])]


def test_a_set_is_seen_when_every_writer_has_ended_it() -> None:
    bench = Bench()
    bench.put(0, 1, 1)
    bench.put(1, 2, 1)
    for who in (0, 1):
        bench.put(who, 3, 1, end=True)
        assert bench.seen() == []
    bench.put(2, 3, 1, end=True)
    assert sorted(bench.seen()) == [1, 2]


def test_a_writer_without_a_part_may_show_in_other_ways_that_it_has_passed_the_set() -> None:
    for is_told in (True, False):
        bench = Bench()
        for who in (0, 1):
            bench.put(who, 1 + who, 1)
            bench.put(who, 3, 1, end=True)
        assert bench.seen() == []
        if is_told:
            bench.told(2, 3)
        else:
            bench.put(2, 9)
        assert sorted(bench.seen())[:2] == [1, 2]


def test_a_writer_that_tells_nothing_of_its_group_is_given_half_a_second() -> None:
    """Not all stacks end a set with every writer."""
    bench = Bench()
    bench.put(0, 1, 1)
    bench.put(0, 2, 1, end=True)
    assert bench.due == PATIENCE_S
    bench.group.release(PATIENCE_S / 2)
    assert bench.seen() == []
    bench.group.release(PATIENCE_S)
    assert bench.seen() == [1]


def test_patience_is_not_for_writers_that_are_known_to_have_more() -> None:
    bench = Bench()
    bench.put(0, 1, 1)
    bench.put(0, 2, 1, end=True)
    bench.proxies[1].last_seq = 1  # a HEARTBEAT has announced it
    bench.told(2, 2)
    bench.group.release(10 * PATIENCE_S)
    assert bench.seen() == []


def test_a_part_that_is_not_whole_spoils_the_others() -> None:
    bench = Bench()
    bench.put(0, 1, 1)
    bench.put(0, 5, 1, end=True)
    bench.numbers[1] = 1
    bench.put(1, 3, 1, set_sn=1)  # its first is missing
    bench.put(1, 5, 1, end=True)
    bench.put(2, 5, 1, end=True)
    assert bench.seen() == []
    assert bench.lost == 2
    bench.put(0, 6)
    assert bench.seen() == [6], "and what comes behind it is seen"


def test_what_a_writer_wrote_behind_a_set_is_not_seen_before_it() -> None:
    bench = Bench()
    bench.put(0, 1, 1)
    bench.put(0, 3, 1, end=True)
    bench.put(0, 4)
    assert bench.seen() == []
    for who in (1, 2):
        bench.put(who, 3, 1, end=True)
    assert bench.seen() == [1, 4]


def test_a_writer_that_is_gone_spoils_the_sets_that_it_had_begun_and_is_waited_for_no_more() -> None:
    bench = Bench()
    bench.put(0, 1, 1)
    bench.put(1, 2, 1)
    bench.put(0, 3, 1, end=True)
    bench.sinks[1].writer_unmatched(W[1], 0.0)
    bench.group.writer_unmatched(R[1], W[1], 0.0, has_said_all=True)
    assert (bench.seen(), bench.lost) == ([], 2)
    bench.put(0, 4, 4)
    bench.put(0, 5, 4, end=True)
    bench.put(2, 5, 4, end=True)
    assert bench.seen() == [4]


def test_a_writer_that_is_lost_may_have_had_a_part_that_never_came() -> None:
    for has_said_all, expected in ((True, [1]), (False, [])):
        bench = Bench()
        bench.put(0, 1, 1)
        for who in (0, 2):
            bench.put(who, 2, 1, end=True)
        bench.group.writer_unmatched(R[1], W[1], 0.0, has_said_all=has_said_all)
        assert bench.seen() == expected


def test_a_writer_that_is_lost_before_anyone_ended_the_set_may_have_had_more_to_say() -> None:
    bench = Bench()
    bench.put(0, 1, 1)
    bench.told(1, 1)  # nothing so far
    bench.group.writer_unmatched(R[1], W[1], 0.0, has_said_all=False)
    for who in (0, 2):
        bench.put(who, 3, 1, end=True)
    assert (bench.seen(), bench.lost) == ([], 1)


def test_a_reader_that_is_closed_takes_its_part_of_a_set_with_it_and_no_more() -> None:
    bench = Bench()
    bench.put(0, 1, 1)
    bench.put(1, 2, 1)
    bench.group.leave(R[1])
    bench.sinks[1].writer_unmatched(W[1], 0.0)
    for who in (0, 2):
        bench.put(who, 3, 1, end=True)
    assert bench.seen() == [1]


def test_when_all_readers_are_closed_nothing_is_left_of_an_open_set() -> None:
    bench = Bench()
    bench.put(0, 1, 1)
    for reader in R:
        bench.group.leave(reader)
    bench.group.release(0.0)
    assert (bench.group.octets, bench.group._publishers) == (0, {})


@pytest.mark.parametrize(
    ("is_told", "last_group_sn", "expected"),
    [(True, 2, []), (True, 0, [1]), (False, 0, [1])],
)
def test_what_a_reader_missed_of_a_set_before_its_match_keeps_the_others_from_it(
    is_told: bool, last_group_sn: int, expected: list[int]
) -> None:
    """Its writer says how far it was; one that does not is believed to have had no part."""
    bench = Bench()
    bench.put(0, 1, 1)
    bench.numbers[1], proxy = 4, bench.proxies[1]  # 4 were written before
    proxy.reorder.next_sn, proxy.last_seq, proxy.historical_sn = 5, 4, 4
    if is_told:
        bench.group.told(R[1], W[1], 4, last_group_sn, 2)
        bench.group.passed(R[1], W[1], bench.now)
    for who in range(3):
        bench.put(who, 3, 1, end=True)
    assert bench.seen() == expected
    bench.put(0, 4, 4)
    for who in range(3):
        bench.put(who, 5, 4, end=True)
    assert bench.seen() == [4], "and the next is seen"


def test_a_part_that_lacks_a_number_for_good_holds_nobody_up() -> None:
    bench = Bench()
    bench.put(0, 1, 1)
    bench.put(1, 2, 1)
    for who in (0, 2):
        bench.put(who, 4, 1, end=True)
    bench.put(0, 5)
    assert bench.seen() == []
    bench.sinks[1].passed(W[1], 3, bench.now)  # a GAP; the end was in it too
    assert (bench.seen(), bench.lost) == ([5], 2)


def test_lost_publishers_are_remembered_up_to_a_bound() -> None:
    bench = Bench()
    for number in range(500):
        stranger = guid(3 + number % 200, 1000 + number)
        data = DiscoveredWriterData(guid=stranger, topic_name="t", type_name="T", qos=writer_qos(Qos()))
        proxy = WriterProxy(data, (), is_reliable=True, max_samples=10, max_octets=100)
        bench.group.writer_matched(R[0], proxy)
        end = Coherence(0, 2, 1, is_end=True)
        bench.sinks[0].add(CacheChange(ChangeKind.ALIVE, stranger, 1, b"", coherence=end), 0.0)
        bench.group.writer_unmatched(R[0], stranger, 0.0, has_said_all=False, may_return=True)
    assert len(bench.group._publishers) <= 70


def test_during_access_nothing_becomes_visible() -> None:
    bench = Bench()
    bench.group.begin_access()
    bench.put(0, 1)
    assert bench.seen() == []
    bench.group.end_access()
    bench.group.release(0.0)
    assert bench.seen() == [1]


def test_what_the_application_holds_up_stays_with_its_writers() -> None:
    bench = Bench(max_octets=4 * OCTETS_BESIDE_PAYLOAD)
    bench.group.begin_access()
    taken = [bench.put(0, number) for number in range(1, 10)]
    assert 0 < taken.count(True) < 6
    bench.group.end_access()
    bench.group.release(0.0)
    assert bench.group.withheld() == [R[0]]
    assert bench.seen() == list(range(1, taken.count(True) + 1))
    assert bench.put(0, taken.count(True) + 1)


def test_a_reader_without_room_holds_up_the_set_and_not_a_part_of_it() -> None:
    bench = Bench(limits=ResourceLimits(max_samples=1, max_samples_per_instance=1))
    bench.put(1, 1)
    bench.put(0, 2, 2)
    bench.put(1, 3, 2)
    for who in range(3):
        bench.put(who, 4, 2, end=True)
    assert [len(history) for history in bench.histories] == [0, 1, 0]
    assert bench.seen() == [1]
    bench.group.release(0.0)
    assert sorted(bench.seen()) == [2, 3]


def test_what_strangers_never_end_is_bounded() -> None:
    bench = Bench(max_octets=100 * OCTETS_BESIDE_PAYLOAD)
    bench.put(0, 1, 1)
    for number in range(3, 2000):
        assert bench.put(1, number)
        assert bench.group.octets <= 103 * (OCTETS_BESIDE_PAYLOAD + 4)
    assert len(bench.seen()) > 1000, "the set was given up"
    for number in range(1, 3000):
        bench.put(2, 2 * number + 4000, 2 * number + 4000, end=True)
    publisher = next(iter(bench.group._publishers.values()))
    assert len(publisher.past_sets) <= 1024
    assert len(publisher.queue) <= 100, "marks of sets that nobody else has part in"
    assert len(publisher.sets) <= 100


def test_sets_that_were_given_up_behind_one_that_goes_on_are_bounded_too() -> None:
    bench = Bench(max_octets=100 * OCTETS_BESIDE_PAYLOAD)
    bench.put(0, 1, 1)
    for number in range(1, 1000):
        bench.put(1, 10 * number, 10 * number)
        bench.numbers[1] += 1  # the next one is missing
        bench.put(1, 10 * number + 2, 10 * number, end=True)
    publisher = next(iter(bench.group._publishers.values()))
    assert len(publisher.queue) <= 102
    assert bench.seen() == []


def test_order_waits_for_what_is_missing_and_not_for_what_nobody_here_reads() -> None:
    bench = Bench(ORDERED)
    bench.put(1, 2)
    assert bench.seen() == []
    bench.put(0, 1)
    assert bench.seen() == [1, 2]
    bench.put(0, 4)  # 3 may be anybody's
    assert bench.seen() == []
    bench.told(1, 3)
    bench.told(2, 3)
    assert bench.seen() == [4]


def test_best_effort_is_not_waited_for() -> None:
    bench = Bench(ORDERED, is_reliable=False)
    bench.put(1, 5)
    assert bench.seen() == [5]


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_however_writers_overtake_each_other_all_is_seen_in_order_and_sets_whole(data: st.DataObject) -> None:
    """The model: what the publisher wrote, in its order; each writer's changes come in theirs, interleaved at will."""
    group = PublisherGroup(PUBLISHER)
    for writer in W:
        group.writer_added(writer, BOTH)
    numbers = [0, 0, 0]
    queues: list[list[tuple[int, int, int, bool]]] = [[], [], []]
    written: list[int] = []
    units: list[set[int]] = []

    def write(who: int) -> int:
        numbers[who] += 1
        place = group.next_place(W[who], numbers[who])
        assert place is not None
        queues[who].append((place.group_sn, place.group_set_sn, place.set_sn, False))
        written.append(place.group_sn)
        return place.group_sn

    for who_writes in data.draw(st.lists(st.lists(st.integers(0, 2), min_size=1, max_size=4), max_size=6)):
        if data.draw(st.booleans()):
            group.begin_coherent_changes()
            units.append({write(who) for who in who_writes})
            for guid_, end in group.end_coherent_changes().items():
                numbers[W.index(guid_)] += 1
                queues[W.index(guid_)].append((end.group_sn, end.group_set_sn, 0, True))
        else:
            units.extend({write(who)} for who in who_writes)
    bench = Bench(BOTH)
    seen: list[int] = []
    while any(queues):
        who = data.draw(st.sampled_from([who for who, queue in enumerate(queues) if queue]))
        group_sn, group_set_sn, set_sn, is_end = queues[who].pop(0)
        assert bench.put(who, group_sn, group_set_sn, set_sn=set_sn, end=is_end)
        look = bench.seen()
        assert all(not unit & set(look) or unit <= set(look) for unit in units)
        seen += look
    assert seen == written
    assert bench.group.octets == 0
