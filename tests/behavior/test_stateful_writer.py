"""StatefulWriter: what it sends first, what it repairs, to whom it heartbeats, and what it frees.

Transmissions read as words, see ``builders.shape``: ``DATA 3 to 2`` is change 3 to the reader of participant 2; a
HEARTBEAT with ``?`` asks for an answer.
"""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from ddsi.behavior.reader_proxy import ReaderProxy
from ddsi.behavior.schedules import HEARTBEAT_PERIOD_MIN
from ddsi.behavior.stateful_writer import StatefulWriter
from ddsi.behavior.transmissions import SendHeartbeat
from ddsi.structure.builtin_entity_ids import SPDP_SECURE_READER
from ddsi.structure.cache_change import ChangeKind
from ddsi.structure.guid import GUID_UNKNOWN, Guid
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import BestEffort, KeepAll, KeepLast, Lifespan, TransientLocal
from ddsi.structure.vendor import CYCLONE, FAST_DDS
from tests.behavior.builders import (
    LOCATOR,
    RELIABLE_QOS,
    change,
    numbers,
    reader_data,
    reader_guid,
    shape,
    stateful_writer,
    write,
)

HISTORY = RELIABLE_QOS | Qos(durability=TransientLocal())
BEST_EFFORT = Qos(reliability=BestEffort(), history=KeepAll())


def match(writer: StatefulWriter, participant: int = 2, qos: Qos = RELIABLE_QOS, now: float = 0.0) -> ReaderProxy:
    guid = reader_guid(participant)
    writer.matched_reader_add(reader_data(qos, of=guid), (LOCATOR,), now)
    return writer.readers[guid]


def send(writer: StatefulWriter, *payloads: bytes, now: float = 0.0) -> list[str]:
    for payload in payloads or (b"",):
        write(writer, payload, now)
    return shape(writer.unsent_changes(now))


def acknack(
    writer: StatefulWriter,
    proxy: ReaderProxy,
    base: int,
    *missing: int,
    count: int,
    now: float = 0.0,
    final: bool = True,
) -> list[str]:
    return shape(writer.receive_acknack(proxy, numbers(base, *missing), count, now, final=final))


# --- first transmission -------------------------------------------------------------------------------------------


def test_changes_go_to_all_readers_at_once() -> None:
    writer = stateful_writer()
    match(writer, 2)
    match(writer, 3)
    assert send(writer, b"", b"") == ["DATA 1", "DATA 2"]
    assert shape(writer.unsent_changes(0.0)) == []


def test_without_readers_nothing_is_sent_nor_kept() -> None:
    writer = stateful_writer()
    assert send(writer, b"", b"") == []
    assert (len(writer.cache), writer.next_unsent_sn, writer.min_acked_sn()) == (0, 3, 2)


def test_numbers_that_keep_last_has_replaced_are_stepped_over() -> None:
    writer = stateful_writer(Qos(history=KeepLast(1)))
    match(writer)
    assert send(writer, b"1", b"2", b"3") == ["DATA 3"]


def test_the_fast_path_agrees_with_the_general_one() -> None:
    """Wherever it takes a change, the general form would send that one as one DATA, and keep the same account."""
    for qos, readers in (
        (RELIABLE_QOS, ()),
        (RELIABLE_QOS, (RELIABLE_QOS,)),
        (RELIABLE_QOS, (BEST_EFFORT,)),
        (RELIABLE_QOS, (RELIABLE_QOS, BEST_EFFORT)),
        (BEST_EFFORT, (BEST_EFFORT,)),
        (HISTORY, (RELIABLE_QOS,)),
        (Qos(history=KeepLast(2)), (RELIABLE_QOS,)),
    ):
        fast, general = stateful_writer(qos), stateful_writer(qos)
        for participant, reader in enumerate(readers, 2):
            match(fast, participant, reader)
            match(general, participant, reader)
        taken_directly = 0
        # The large one goes in fragments; then the window fills up.
        for size in (0, 10, 999, 1000, 1001, 10, *[1000] * 200):
            written = write(fast, bytes(size))
            if fast.sends_directly(written):
                taken_directly += 1
                sent_fast = [f"DATA {written.sequence_number}"] if readers else []
            else:
                sent_fast = shape(fast.unsent_changes(0.0))
            assert sent_fast == send(general, bytes(size)), f"{size} octets, {qos}, {readers}"
            for name in ("next_unsent_sn", "in_flight_octets", "min_acked_sn"):
                one, other = getattr(fast, name), getattr(general, name)
                assert (one() if callable(one) else one) == (other() if callable(other) else other), name
            assert [kept.sequence_number for kept in fast.cache.changes()] == [
                kept.sequence_number for kept in general.cache.changes()
            ]
        assert taken_directly > 5


def test_large_changes_go_in_fragments_with_a_pause_between_bursts() -> None:
    """No reader acknowledges fragments; behind each burst a HEARTBEAT_FRAG lets it ask early."""
    writer = stateful_writer(fragment_octets=1000)
    match(writer)
    window = writer.window.octets // 1000
    write(writer, bytes(1000 * (window + 10) - 1))
    assert shape(writer.unsent_changes(0.0)) == [f"FRAG 1.1-{window}", f"HB_FRAG 1.{window}"]
    write(writer, b"small")
    assert shape(writer.unsent_changes(0.0)) == [], "it waits behind the large one"
    assert writer.next_deadline() == pytest.approx(0.001)
    assert shape(writer.handle_timeout(0.001)) == [f"FRAG 1.{window + 1}-{window + 10}"]
    assert writer.next_unsent_sn == 2, "the window is full now"
    assert acknack(writer, next(iter(writer.readers.values())), 2, count=1) == ["DATA 2"]


def test_the_window_holds_back_until_acknowledged() -> None:
    writer = stateful_writer()
    proxy = match(writer)
    per_window = writer.window.octets // 1000
    sent = send(writer, *[bytes(1000)] * (per_window + 5))
    assert 0 < len(sent) <= per_window + 1
    assert writer.in_flight_octets == 1000 * len(sent)
    more = acknack(writer, proxy, 11, count=1)
    assert more[0] == f"DATA {len(sent) + 1}"
    assert writer.in_flight_octets <= writer.window.octets + 1000


def test_a_silent_reader_holds_the_window_for_a_moment_only() -> None:
    """The others are not to wait for one that has gone; it can ask for everything when it comes back."""
    writer = stateful_writer()
    alive, gone = match(writer, 2), match(writer, 3)
    per_window = writer.window.octets // 1000
    sent = len(send(writer, *[bytes(1000)] * (3 * per_window)))
    assert acknack(writer, alive, sent + 1, count=1) == []
    now = 0.0
    while not gone.is_stalled:
        now = writer.next_deadline()
        assert now < 2
        alive.progress_time = now
        out = shape(writer.handle_timeout(now))
    assert 0.5 < now < 1
    assert f"DATA {sent + 1}" in out
    assert acknack(writer, gone, 1, 1, 2, count=1, now=now + 1)[:2] == ["DATA 1 to 3", "DATA 2 to 3"]
    assert not gone.is_stalled


def test_best_effort_readers_get_data_and_nothing_else() -> None:
    writer = stateful_writer()
    match(writer, 2, BEST_EFFORT)
    assert send(writer, b"x") == ["DATA 1"]
    assert writer.piggyback_heartbeat() is None
    assert (writer.next_deadline(), len(writer.cache), writer.in_flight_octets) == (math.inf, 0, 0)


# --- matching -------------------------------------------------------------------------------------------------------


def test_a_reliable_reader_is_told_at_once_what_there_is() -> None:
    """Lest it waits or asks: a HEARTBEAT to it alone, that excludes what is not for it."""
    writer = stateful_writer(HISTORY)
    match(writer, 9)
    send(writer, b"", b"", b"")
    late_volatile = writer.matched_reader_add(reader_data(of=reader_guid(2)), (LOCATOR,), 0.0)
    assert shape(late_volatile) == ["HB 4-3 to 2"]
    late = writer.matched_reader_add(reader_data(HISTORY, of=reader_guid(3)), (LOCATOR,), 0.0)
    assert shape(late) == ["HB 1-3 ? to 3"]
    best_effort = writer.matched_reader_add(reader_data(BEST_EFFORT, of=reader_guid(4)), (LOCATOR,), 0.0)
    assert best_effort == []


def test_a_late_joiner_gets_its_history_by_asking() -> None:
    writer = stateful_writer(HISTORY)
    send(writer, b"", b"", b"")
    proxy = match(writer, 2, HISTORY)
    assert acknack(writer, proxy, 1, 1, 2, 3, count=1) == ["DATA 1 to 2", "DATA 2 to 2", "DATA 3 to 2", "HB 1-3 ? to 2"]
    assert acknack(writer, proxy, 4, count=2, now=1.0) == []
    assert len(writer.cache) == 3, "for the next late joiner"
    before = writer.window.octets
    assert before == stateful_writer().window.octets, "asking for history is no sign of loss"


def test_a_volatile_reader_gets_none_of_the_history() -> None:
    """It may ask for it (it cannot know); the answer is one GAP, however long the past is."""
    writer = stateful_writer(HISTORY)
    match(writer, 9, HISTORY)
    send(writer, *[b""] * 600)
    proxy = match(writer, 2)
    asked = tuple(range(1, 257))
    assert acknack(writer, proxy, 1, *asked, count=1)[0] == "GAP 1-600 to 2"
    assert send(writer, b"") == ["DATA 601"]


def test_what_waits_for_the_window_is_for_a_new_volatile_reader_too() -> None:
    """It will be sent to it with the others; were it not its to ask for, a loss would be a hole in its stream."""
    writer = stateful_writer()
    match(writer, 2)
    sent = len(send(writer, *[bytes(1000)] * 300))
    assert sent < 300
    newcomer = match(writer, 3)
    assert newcomer.history_sn == sent


def test_a_best_effort_reader_that_wants_history_gets_none() -> None:
    """Nobody repairs for it, so there is no way to give it history."""
    writer = stateful_writer(HISTORY)
    send(writer, b"")
    proxy = match(writer, 2, Qos(reliability=BestEffort(), durability=TransientLocal()))
    assert proxy.history_sn == 1


def test_what_only_the_lost_reader_lacked_is_free_with_it() -> None:
    writer = stateful_writer()
    stays, goes = match(writer, 2), match(writer, 3)
    send(writer, b"", b"")
    acknack(writer, stays, 3, count=1)
    assert len(writer.cache) == 2
    writer.matched_reader_remove(goes.guid, 0.0)
    assert (len(writer.cache), writer.min_acked_sn(), writer.next_deadline()) == (0, 2, math.inf)
    writer.matched_reader_remove(goes.guid, 0.0)  # twice is no harm


def test_a_reader_that_moved_is_sent_to_where_it_is_now() -> None:
    writer = stateful_writer()
    proxy = match(writer)
    elsewhere = LOCATOR._replace(port=9)
    writer.matched_reader_update(proxy.guid, proxy.data, (elsewhere,))
    assert writer.locators == (elsewhere,)


# --- repair ---------------------------------------------------------------------------------------------------------


def test_missing_changes_are_sent_again_to_who_asked() -> None:
    writer = stateful_writer()
    proxy = match(writer)
    send(writer, b"", b"", b"")
    assert acknack(writer, proxy, 1, 1, 3, count=1) == ["DATA 1 to 2", "DATA 3 to 2", "HB 1-3 ? to 2"]


def test_numbers_that_are_gone_are_explained_by_a_gap() -> None:
    """GAP: gapStart is the first, the base is behind the run that it begins, later ones are bits."""
    writer = stateful_writer(Qos(history=KeepLast(1)))
    proxy = match(writer)
    for key in (b"a", b"a", b"a", b"b", b"a", b"c", b"a"):
        writer.new_change(ChangeKind.ALIVE, b"", key, 0, 0.0)
    writer.unsent_changes(0.0)
    # What is left: b's 4, c's 6 and a's 7.
    assert acknack(writer, proxy, 1, 1, 2, 3, 4, 5, 6, count=1) == [
        "GAP 1-3+5 to 2", "DATA 4 to 2", "DATA 6 to 2", "HB 4-7 ? to 2",
    ]  # fmt: skip


def test_the_same_is_not_sent_again_within_a_moment() -> None:
    """nackSuppressionDuration: two ACKNACKs that crossed the repair."""
    writer = stateful_writer()
    proxy = match(writer)
    send(writer, b"")
    assert "DATA 1 to 2" in acknack(writer, proxy, 1, 1, count=1, now=1.0)
    assert acknack(writer, proxy, 1, 1, count=2, now=1.004) == []
    assert "DATA 1 to 2" in acknack(writer, proxy, 1, 1, count=3, now=1.006)


@pytest.mark.parametrize(("vendor", "answer"), [(CYCLONE, "GAP 1-1 to 2"), (FAST_DDS, "DATA 1 to 2")])
def test_who_cannot_acknowledge_secure_spdp_is_let_off_by_a_gap(vendor: bytes, answer: str) -> None:
    """Cyclone DDS takes what comes there and does not count it; seen to ask ten times a second for ever."""
    writer = stateful_writer(HISTORY)
    guid = Guid.of(reader_guid(2).prefix, SPDP_SECURE_READER)
    data = replace(reader_data(HISTORY, of=guid), vendor_id=vendor)
    writer.matched_reader_add(data, (LOCATOR,), 0.0)
    send(writer, b"")
    proxy = writer.readers[guid]
    for count in range(1, 4):
        assert "DATA 1 to 2" in acknack(writer, proxy, 1, 1, count=count, now=float(count))
    assert answer in acknack(writer, proxy, 1, 1, count=4, now=4.0)
    acknack(writer, proxy, 2, count=5, now=5.0)
    send(writer, b"news", now=6.0)
    assert "DATA 2 to 2" in acknack(writer, proxy, 2, 2, count=6, now=7.0)


def test_one_acknack_does_not_cause_more_than_a_window_of_repairs() -> None:
    writer = stateful_writer(HISTORY, fragment_octets=2000)
    send(writer, *[bytes(2000)] * 200)
    proxy = match(writer, 2, HISTORY)
    repairs = acknack(writer, proxy, 1, *range(1, 201), count=1)
    assert len(repairs) - 1 <= writer.window.octets // 2000 + 1


def test_what_was_not_sent_yet_is_not_repaired() -> None:
    writer = stateful_writer()
    proxy = match(writer)
    sent = len(send(writer, *[bytes(1000)] * 300))
    assert acknack(writer, proxy, sent + 1, sent + 1, sent + 2, count=1)[0] == f"DATA {sent + 1}", "its first time"
    assert "GAP" not in " ".join(acknack(writer, proxy, sent + 1, 5000, count=2, now=1.0))


def test_missing_fragments_are_sent_again_to_who_asked() -> None:
    writer = stateful_writer(fragment_octets=100)
    proxy = match(writer)
    send(writer, bytes(1000))
    out = shape(writer.receive_nack_frag(proxy, 1, numbers(2, 2, 3, 7), 1, 0.0))
    assert out == ["FRAG 1.2-3 to 2", "FRAG 1.7-7 to 2", "HB 1-1 ? to 2"]


@pytest.mark.parametrize(
    ("asked", "expected"),
    [
        ((11, 12), []),  # there are ten
        ((10, 11), ["FRAG 1.10-10 to 2", "HB 1-1 ? to 2"]),
    ],
)
def test_fragments_that_do_not_exist_are_ignored(asked: tuple[int, ...], expected: list[str]) -> None:
    writer = stateful_writer(fragment_octets=100)
    proxy = match(writer)
    send(writer, bytes(1000))
    assert shape(writer.receive_nack_frag(proxy, 1, numbers(asked[0], *asked), 1, 0.0)) == expected


def test_fragments_of_a_change_that_is_gone_are_explained_by_a_gap() -> None:
    writer = stateful_writer(Qos(history=KeepLast(1)), fragment_octets=100)
    proxy = match(writer)
    send(writer, bytes(1000))
    send(writer, bytes(1000))
    assert shape(writer.receive_nack_frag(proxy, 1, numbers(1, 1), 1, 0.0)) == ["GAP 1-1 to 2"]


def test_fragments_that_were_not_sent_yet_are_not_repaired() -> None:
    writer = stateful_writer(fragment_octets=1000)
    proxy = match(writer)
    window = writer.window.octets // 1000
    send(writer, bytes(1000 * window * 2))
    assert shape(writer.receive_nack_frag(proxy, 1, numbers(window, window, window + 1), 1, 0.0))[0] == (
        f"FRAG 1.{window}-{window} to 2"
    )


def test_a_change_of_which_nothing_was_sent_is_neither_repaired_nor_explained() -> None:
    """A GAP for a number that is still to be written would make the reader skip it when it comes."""
    writer = stateful_writer(fragment_octets=1000)
    proxy = match(writer)
    send(writer, bytes(1000 * writer.window.octets // 500), bytes(2000))
    for number, count in ((2, 1), (3, 2)):
        assert writer.receive_nack_frag(proxy, number, numbers(1, 1), count, 0.0) == []


# --- what ACKNACKs mean ---------------------------------------------------------------------------------------------


def test_every_acknack_that_is_not_final_gets_one_heartbeat() -> None:
    writer = stateful_writer()
    proxy = match(writer)
    assert acknack(writer, proxy, 1, count=1, final=False) == ["HB 1-0 to 2"], "nothing is there, and it is told so"
    send(writer, b"")
    assert acknack(writer, proxy, 2, count=2, final=False) == ["HB 2-1 to 2"]


@pytest.mark.parametrize(("base", "count"), [(0, 1), (1, 0), (1, 1), (0, 0)])
def test_preemptive_acknacks_of_all_vendors_are_answered(base: int, count: int) -> None:
    """Base 0 (Fast DDS, RTI) or 1, count 0 (Cyclone DDS, each time) or more: always answered, at a bounded rate."""
    writer = stateful_writer(HISTORY)
    send(writer, b"")
    proxy = match(writer, 2, HISTORY)
    assert acknack(writer, proxy, base, count=count, now=1.0, final=False) == ["HB 1-1 ? to 2"]
    assert acknack(writer, proxy, base, count=count, now=1.001, final=False) == []
    assert acknack(writer, proxy, base, count=count, now=1.1, final=False) == ["HB 1-1 ? to 2"]
    assert proxy.acked_sn == 0


@pytest.mark.parametrize(
    ("counts", "accepted"),
    [
        ([1, 2, 3], [True, True, True]),
        ([5, 5, 4, 6], [True, False, False, True]),
        ([0x7FFFFFFF, 0x80000000, 0x7FFFFFFF], [True, True, False]),
        ([0xFFFFFFFF, 0, 1], [True, True, True]),  # on from the largest: counts go round
    ],
)
def test_counts_compare_as_serial_numbers(counts: list[int], accepted: list[bool]) -> None:
    proxy = match(stateful_writer())
    assert [proxy.accepts_acknack(count, now=1.0) for count in counts] == accepted
    proxy = match(stateful_writer())
    assert [proxy.accepts_nack_frag(count, now=1.0) for count in counts] == accepted


def test_a_peer_that_counts_anew_is_not_ignored_for_ever() -> None:
    """It lost us and found us again, and we never noticed: its counts begin at 1."""
    proxy = match(stateful_writer())
    for accepts in (proxy.accepts_acknack, proxy.accepts_nack_frag):
        assert accepts(500, 1.0)
        assert not accepts(1, 1.4)
        assert accepts(1, 1.6)
        assert accepts(2, 1.61)


def test_acknowledgment_never_goes_back_nor_beyond_what_was_written() -> None:
    writer = stateful_writer()
    proxy = match(writer)
    send(writer, b"", b"")
    acknack(writer, proxy, 10**12, count=1)
    assert (proxy.acked_sn, writer.min_acked_sn()) == (0, 0), "whoever says so knows nothing of this writer"
    acknack(writer, proxy, 3, count=2)
    assert (proxy.acked_sn, writer.min_acked_sn()) == (2, 2)
    acknack(writer, proxy, 1, count=3)
    assert proxy.acked_sn == 2


def test_all_acknowledged_means_every_reliable_reader() -> None:
    writer = stateful_writer()
    one, other = match(writer, 2), match(writer, 3)
    match(writer, 4, BEST_EFFORT)
    send(writer, b"", b"", b"")
    acknack(writer, one, 4, count=1)
    assert writer.min_acked_sn() == 0
    acknack(writer, other, 3, count=1)
    assert writer.min_acked_sn() == 2
    assert [kept.sequence_number for kept in writer.cache.changes()] == [3]


def test_the_unacknowledged_octets_have_a_bound() -> None:
    writer = stateful_writer(bound=1000)
    assert writer.lacks_room(5000, b"") is None, "without a reliable reader nothing is waited for"
    proxy = match(writer)
    send(writer, bytes(600))
    assert writer.lacks_room(400, b"") is None
    reason = writer.lacks_room(401, b"")
    assert reason is not None
    assert "600 octets are not acknowledged" in reason
    acknack(writer, proxy, 2, count=1)
    assert writer.lacks_room(5000, b"") is None, "one change always fits"


# --- heartbeats -----------------------------------------------------------------------------------------------------


def test_heartbeats_go_to_who_lacks_something_and_stop_with_the_last() -> None:
    writer = stateful_writer()
    one, other = match(writer, 2), match(writer, 3)
    send(writer, b"")
    assert shape(writer.handle_timeout(HEARTBEAT_PERIOD_MIN)) == ["HB 1-1 ?"], "all lack it: to all"
    acknack(writer, one, 2, count=1, now=HEARTBEAT_PERIOD_MIN)
    now = writer.next_deadline()
    assert shape(writer.handle_timeout(now)) == ["HB 1-1 ? to 3"]
    acknack(writer, other, 2, count=1, now=now)
    assert writer.next_deadline() == math.inf


def asked_of(writer: StatefulWriter, proxy: ReaderProxy, begin: float, end: float) -> int:
    """How many HEARTBEATs that want an answer go to the reader meanwhile."""
    count = 0
    while (now := writer.next_deadline()) < end:
        count += any(
            isinstance(item, SendHeartbeat) and (item.readers is None or proxy in item.readers)
            for item in writer.handle_timeout(max(now, begin))
        )
    return count


def test_who_is_slow_is_not_asked_more_often_because_others_are_quick() -> None:
    """In a crowd somebody acknowledges all the time; who is behind must not drown in questions."""
    writer = stateful_writer()
    quick, slow = match(writer, 2), match(writer, 3)
    count = 0
    for round_ in range(100):
        now = 0.02 * round_
        send(writer, b"", now=now)
        acknack(writer, quick, round_ + 2, count=round_ + 1, now=now)
        count += asked_of(writer, slow, now, now + 0.02)
    assert 8 <= count <= 15  # in two seconds: 3 at 50 ms, 3 at 100 ms, ...


def test_who_answers_is_asked_quickly_again() -> None:
    writer = stateful_writer()
    proxy = match(writer)
    send(writer, b"")
    asked_of(writer, proxy, 0.0, 60.0)
    acknack(writer, proxy, 1, 1, count=1, now=60.0)
    assert asked_of(writer, proxy, 60.0, 60.2) >= 3


def test_the_piggybacked_heartbeat_asks_when_the_window_fills_up() -> None:
    writer = stateful_writer()
    match(writer)
    for _ in range(writer.window.octets // 1000 // 2 - 1):
        send(writer, bytes(1000))
    quiet = writer.piggyback_heartbeat()
    assert quiet is None or quiet.final
    send(writer, bytes(1000), bytes(1000))
    asking = writer.piggyback_heartbeat()
    assert asking is not None
    assert not asking.final


def test_an_assertion_is_a_heartbeat_with_the_liveliness_flag() -> None:
    writer = stateful_writer()
    assert writer.assert_liveliness() == []
    match(writer)
    assert shape(writer.assert_liveliness()) == ["HB 1-0 L"]


def test_who_waits_for_acknowledgment_asks_those_that_lack_something() -> None:
    writer = stateful_writer()
    one = match(writer, 2)
    match(writer, 3)
    send(writer, b"")
    acknack(writer, one, 2, count=1)
    assert shape(writer.request_acknowledgment()) == ["HB 1-1 ? to 3"]


def test_a_local_readers_progress_does_not_end_the_heartbeats_of_the_others() -> None:
    """A reader of this participant takes a change before it even leaves for the others."""
    writer = stateful_writer()
    remote = match(writer)
    local = writer.matched_local_reader_add(reader_data(of=reader_guid(1)), 0.0)
    written = write(writer, b"x")
    writer.local_reader_progress(local, 1, 0.0)
    assert writer.sends_directly(written)
    assert writer.next_deadline() == HEARTBEAT_PERIOD_MIN
    assert shape(writer.handle_timeout(HEARTBEAT_PERIOD_MIN)) == ["HB 1-1 ?"]
    acknack(writer, remote, 2, count=1)
    assert (len(writer.cache), writer.next_deadline()) == (0, math.inf)


def test_a_change_stays_until_the_local_reader_has_room_for_it() -> None:
    writer = stateful_writer()
    local = writer.matched_local_reader_add(reader_data(of=reader_guid(1)), 0.0)
    send(writer, b"", b"")
    writer.local_reader_progress(local, 1, 0.0)
    assert [kept.sequence_number for kept in writer.cache.changes()] == [2]
    assert writer.min_acked_sn() == 1


# --- LIFESPAN -------------------------------------------------------------------------------------------------------


def test_what_outlives_its_lifespan_is_neither_sent_nor_repaired() -> None:
    writer = stateful_writer(RELIABLE_QOS | Qos(lifespan=Lifespan(1.0)))
    proxy = match(writer)
    send(writer, b"1", now=0.0)
    send(writer, b"2", now=0.5)
    assert acknack(writer, proxy, 1, 1, 2, count=1, now=0.9)[:2] == ["DATA 1 to 2", "DATA 2 to 2"]
    while writer.next_deadline() <= 1.0:
        writer.handle_timeout(writer.next_deadline())
    assert [kept.sequence_number for kept in writer.cache.changes()] == [2]
    assert acknack(writer, proxy, 1, 1, 2, count=2, now=1.2)[:2] == ["GAP 1-1 to 2", "DATA 2 to 2"]


def test_ends_of_instances_outlive_everything() -> None:
    """DDS 1.4 §2.2.3.16: data expires, not what became of the instance."""
    writer = stateful_writer(RELIABLE_QOS | Qos(lifespan=Lifespan(1.0), durability=TransientLocal()))
    writer.new_change(ChangeKind.ALIVE, b"", b"k", 0, 0.0)
    writer.new_change(ChangeKind.NOT_ALIVE_DISPOSED, b"", b"k", 0, 0.0)
    writer.unsent_changes(0.0)
    writer.handle_timeout(5.0)
    assert [kept.kind for kept in writer.cache.changes()] == [ChangeKind.NOT_ALIVE_DISPOSED]


# --- relevance ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("destination", "expected"),
    [
        (GUID_UNKNOWN, True),
        (reader_guid(2), True),
        (reader_guid(2).participant, True),
        (reader_guid(2, key=7), False),
        (reader_guid(3), False),
        (reader_guid(3).participant, False),
    ],
)
def test_relevant_is_what_is_for_everybody_for_this_reader_or_for_its_participant(
    destination: Guid, expected: bool
) -> None:
    proxy = match(stateful_writer(), 2)
    assert proxy.is_relevant(change(1, destination=destination)) is expected


@pytest.mark.parametrize("offered", [RELIABLE_QOS, BEST_EFFORT])
def test_a_best_effort_reader_has_nothing_to_ask(offered: Qos) -> None:
    """No reader of that kind sends ACKNACK or NACK_FRAG; whoever does in its name gets no answer."""
    writer = stateful_writer(offered, fragment_octets=100)
    proxy = match(writer, qos=BEST_EFFORT)
    send(writer, b"", bytes(1000))
    assert acknack(writer, proxy, 1, 1, 2, count=1, final=False) == []
    assert writer.receive_nack_frag(proxy, 2, numbers(1, 1), 1, 0.0) == []
    assert writer.next_deadline() == math.inf
