"""FilteringWriter: to each reader its own samples, GAPs for all other numbers, and HEARTBEATs of its own.

Whole domains with such writers: ``test_filtered_path``.
"""

from __future__ import annotations

import math

from ddsi.behavior.filtered import gap_before, gap_for, is_irrelevant
from ddsi.behavior.filtering_writer import MAX_CHANGES_PER_DESTINATION, MAX_CHANGES_UNDER_WAY, FilteringWriter
from ddsi.behavior.reader_proxy import ReaderProxy
from ddsi.behavior.transmissions import SendHeartbeat
from ddsi.structure.guid import GUID_UNKNOWN, Guid
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import BestEffort, KeepAll, Lifespan, TransientLocal
from tests.behavior.builders import (
    LOCATOR,
    RELIABLE_QOS,
    numbers,
    reader_data,
    reader_guid,
    shape,
    write,
)
from tests.behavior.builders import (
    filtering_writer as make_writer,
)

A, B = reader_guid(2), reader_guid(3)
BEST_EFFORT = Qos(reliability=BestEffort(), history=KeepAll())


def match(writer: FilteringWriter, guid: Guid, qos: Qos = RELIABLE_QOS, now: float = 0.0) -> ReaderProxy:
    writer.matched_reader_add(reader_data(qos, of=guid), (LOCATOR,), now)
    return writer.readers[guid]


def send(writer: FilteringWriter, *destinations: Guid, payload: bytes = b"", now: float = 0.0) -> list[str]:
    for destination in destinations:
        write(writer, payload, now, to=destination.participant if destination != GUID_UNKNOWN else destination)
    return shape(writer.unsent_changes(now))


def acknack(
    writer: FilteringWriter, proxy: ReaderProxy, base: int, *missing: int, count: int, final: bool = True
) -> list[str]:
    return shape(writer.receive_acknack(proxy, numbers(base, *missing), count, 10.0 + count, final=final))


def held(writer: FilteringWriter) -> list[int]:
    return [change.sequence_number for change in writer.cache.changes()]


def test_each_sample_goes_to_its_reader_alone_behind_a_gap_for_the_others() -> None:
    writer = make_writer()
    match(writer, A)
    match(writer, B)
    assert send(writer, A) == ["DATA 1 to 2", "HB 1-1 ? to 2"]
    assert send(writer, B) == ["GAP 1-1 to 3", "DATA 2 to 3", "HB 2-2 ? to 3"]
    assert send(writer, B, B) == ["DATA 3 to 3", "HB 2-3 ? to 3", "DATA 4 to 3", "HB 2-4 ? to 3"]
    assert send(writer, A) == ["GAP 2-4 to 2", "DATA 5 to 2", "HB 1-5 ? to 2"]


def test_what_has_no_destination_goes_to_everybody() -> None:
    writer = make_writer()
    match(writer, A)
    match(writer, B)
    send(writer, A)
    assert send(writer, GUID_UNKNOWN) == [
        "DATA 2 to 2", "HB 1-2 ? to 2", "GAP 1-1 to 3", "DATA 2 to 3", "HB 2-2 ? to 3",
    ]  # fmt: skip


def test_without_acknowledgments_fragments_go_again_under_their_number_and_whole_messages_do_not() -> None:
    writer = make_writer(BEST_EFFORT)
    match(writer, A, BEST_EFFORT)
    match(writer, B, BEST_EFFORT)
    small = write(writer, b"x", to=A.participant)
    large = write(writer, bytes(3 * writer.fragment_octets), to=A.participant)
    assert shape(writer.unsent_changes(0.0)) == ["DATA 1 to 2", "FRAG 2.1-3 to 2"]
    assert shape(writer.fragments_again(large)) == ["FRAG 2.1-3 to 2"]
    assert shape(writer.fragments_again(small)) == []


def test_lst_seq_is_the_highest_number_sent_to_one_reader() -> None:
    writer = make_writer()
    a, b = match(writer, A), match(writer, B)
    send(writer, A, B, B)
    assert (a.lst_seq, b.lst_seq) == (1, 3)


def test_the_heartbeat_of_one_reader_speaks_of_its_own_numbers_only() -> None:
    writer = make_writer()
    a, b = match(writer, A), match(writer, B)
    send(writer, A, B, B, A)
    acknack(writer, a, 2, count=1)
    for proxy, expected in ((a, (4, 4)), (b, (2, 3))):
        heartbeat = writer.directed_heartbeat(proxy)
        assert (heartbeat.first, heartbeat.last, heartbeat.readers) == (*expected, (proxy,))


def test_periodic_heartbeats_stop_when_the_reader_has_acknowledged_lst_seq() -> None:
    """No endless heartbeats: that others lack something is nothing to this reader."""
    writer = make_writer()
    a, b = match(writer, A), match(writer, B)
    send(writer, A, B)
    assert shape(writer.handle_timeout(writer.next_deadline())) == ["HB 1-1 ? to 2", "HB 2-2 ? to 3"]
    assert acknack(writer, a, 2, count=1) == []
    assert shape(writer.handle_timeout(writer.next_deadline())) == ["HB 2-2 ? to 3"]
    acknack(writer, b, 3, count=1)
    assert writer.next_deadline() == math.inf


def test_every_acknack_that_is_not_final_gets_one_directed_heartbeat() -> None:
    """first = last + 1 when nothing is there."""
    writer = make_writer()
    a, b = match(writer, A), match(writer, B)
    assert acknack(writer, a, 1, count=1, final=False) == ["HB 1-0 to 2"]
    send(writer, A, B, B)
    assert acknack(writer, a, 2, count=2, final=False) == ["HB 2-1 to 2"], "it has what was sent to it"
    assert acknack(writer, b, 4, count=1, final=False) == ["HB 4-3 to 3"]
    assert acknack(writer, b, 4, count=2, final=True) == []


def test_only_relevant_samples_are_sent_again_and_a_gap_for_the_others() -> None:
    writer = make_writer()
    match(writer, A)
    b = match(writer, B)
    send(writer, A, B, A, A, B, A)
    assert acknack(writer, b, 1, 1, 2, 3, 4, 5, count=1) == [
        "GAP 1-1+3+4 to 3", "DATA 2 to 3", "DATA 5 to 3", "HB 2-5 ? to 3",
    ]  # fmt: skip


def test_a_long_past_of_others_is_one_gap() -> None:
    writer = make_writer()
    match(writer, A)
    b = match(writer, B)
    send(writer, *[A] * 600, B)
    out = acknack(writer, b, 1, *range(1, 257), count=1)
    assert out[0] == "GAP 1-600 to 3"


def test_irrelevant_is_also_what_is_gone_and_what_was_before_the_match() -> None:
    writer = make_writer(RELIABLE_QOS | Qos(durability=TransientLocal()))
    match(writer, A)
    send(writer, A, A, A)
    b = match(writer, B)
    b.history_sn = 1
    writer.cache.remove(3)
    send(writer, B)
    assert [is_irrelevant(writer.cache, b, number) for number in (1, 2, 3, 4)] == [True, True, True, False]
    assert [shape([gap]) for gap in gap_for(writer.cache, b, [1, 3], 5)] == [["GAP 1-3 to 3"]]
    assert gap_for(writer.cache, b, [], 5) == []


def test_no_gap_is_needed_between_neighbours() -> None:
    writer = make_writer()
    a = match(writer, A)
    send(writer, A)
    assert gap_before(a, write(writer, to=A.participant)) is None


def test_all_acknowledged_is_judged_per_reader() -> None:
    """A reader that has all that was meant for it holds nothing up, whatever its ACKNACK's base is."""
    writer = make_writer()
    a, b = match(writer, A), match(writer, B)
    send(writer, A, B, B, B)
    acknack(writer, b, 5, count=1)
    assert writer.min_acked_sn() == 0, "the first is still for A"
    acknack(writer, a, 2, count=1)
    assert writer.min_acked_sn() == 4


def test_a_change_goes_when_the_reader_it_is_for_has_it() -> None:
    writer = make_writer()
    a, b = match(writer, A), match(writer, B)
    send(writer, A, B, GUID_UNKNOWN)
    acknack(writer, b, 4, count=1)
    assert held(writer) == [1, 3], "2 was for B alone, 3 is for A as well"
    acknack(writer, a, 4, count=1)
    assert held(writer) == []


def test_a_change_for_a_participant_is_for_all_its_readers() -> None:
    writer = make_writer()
    one, other = match(writer, A), match(writer, reader_guid(2, key=9))
    assert send(writer, A) == ["DATA 1 to 2", "HB 1-1 ? to 2"] * 2
    acknack(writer, one, 2, count=1)
    assert held(writer) == [1]
    writer.matched_reader_remove(one.guid, 0.0)
    assert held(writer) == [1], "the other still lacks it"
    acknack(writer, other, 2, count=1)
    assert held(writer) == []


def test_a_change_for_nobody_who_is_there_is_not_kept() -> None:
    writer = make_writer()
    match(writer, A)
    assert send(writer, B) == []
    assert held(writer) == []
    assert writer.next_unsent_sn == 2


def test_what_was_for_a_reader_alone_goes_with_it() -> None:
    writer = make_writer()
    a, b = match(writer, A), match(writer, B)
    send(writer, A, B, GUID_UNKNOWN)
    acknack(writer, b, 4, count=1)
    writer.matched_reader_remove(a.guid, 0.0)
    assert held(writer) == []
    assert writer.next_deadline() == math.inf


def test_what_only_a_reader_that_goes_lacked_goes_with_it() -> None:
    """The other reader of its participant has acknowledged the change, and nobody else will."""
    writer = make_writer()
    one, other = match(writer, A), match(writer, reader_guid(2, key=9))
    send(writer, A)
    acknack(writer, one, 2, count=1)
    writer.matched_reader_remove(other.guid, 0.0)
    assert held(writer) == []


def test_a_reader_that_comes_back_finds_its_part_of_the_history() -> None:
    """As from any writer that keeps history: losing a reader says nothing about who comes later."""
    history = RELIABLE_QOS | Qos(durability=TransientLocal())
    writer = make_writer(history)
    match(writer, A, history)
    send(writer, A, B, A)
    writer.matched_reader_remove(A, 0.0)
    assert held(writer) == [1, 2, 3]
    again = writer.matched_reader_add(reader_data(history, of=A), (LOCATOR,), 1.0)
    assert shape(again) == ["HB 1-3 ? to 2"]


def test_the_history_is_bounded_per_reader_and_blocks_nobody_else() -> None:
    writer = make_writer()
    match(writer, A)
    b = match(writer, B)
    for _ in range(MAX_CHANGES_PER_DESTINATION):
        assert not writer.has_overflow(A.participant)
        send(writer, A, payload=bytes(1 << 20))
    assert writer.has_overflow(A.participant)
    assert not writer.has_overflow(B.participant)
    assert writer.lacks_room(1 << 20, b"") is None, "the others write on"
    assert send(writer, B)[1:] == [f"DATA {MAX_CHANGES_PER_DESTINATION + 1} to 3", "HB 257-257 ? to 3"]
    acknack(writer, b, MAX_CHANGES_PER_DESTINATION + 2, count=1)
    assert len(held(writer)) == MAX_CHANGES_PER_DESTINATION
    writer.matched_reader_remove(A, 0.0)
    assert not writer.has_overflow(A.participant)


def test_who_goes_on_acknowledging_is_not_given_up() -> None:
    """Two large participants have a key for each of thousands of pairs to send at once."""
    writer = make_writer()
    a = match(writer, A)
    for number in range(1, 2 * MAX_CHANGES_PER_DESTINATION):
        send(writer, A)
        if number > MAX_CHANGES_PER_DESTINATION:
            assert not writer.is_given_up(A.participant, now=9.0 * number)
            acknack(writer, a, number - MAX_CHANGES_PER_DESTINATION + 1, count=number)
    last = 9.0 * (2 * MAX_CHANGES_PER_DESTINATION - 1)
    send(writer, A, A)
    assert not writer.is_given_up(A.participant, now=last + 1.0), "it has acknowledged since it was asked about last"
    assert not writer.is_given_up(A.participant, now=last + 10.9)
    assert writer.is_given_up(A.participant, now=last + 11.0)


def test_nobody_may_be_sent_without_end_what_he_does_not_acknowledge() -> None:
    writer = make_writer()
    match(writer, A)
    send(writer, *[A] * MAX_CHANGES_UNDER_WAY)
    assert writer.is_given_up(A.participant, now=0.0)


def test_what_has_expired_is_announced_no_more() -> None:
    writer = make_writer(RELIABLE_QOS | Qos(lifespan=Lifespan(1.0)))
    a = match(writer, A)
    send(writer, A, A)
    assert shape(writer.handle_timeout(1.0)) == ["HB 3-2 ? to 2"], "it still has to hear that they are gone"
    assert acknack(writer, a, 3, count=1) == []
    assert writer.next_deadline() == math.inf


def test_what_has_expired_fills_up_nobodys_share() -> None:
    """Though nobody is there to hear of it."""
    writer = make_writer(RELIABLE_QOS | Qos(lifespan=Lifespan(1.0), durability=TransientLocal()))
    for destination in (A, GUID_UNKNOWN):
        send(writer, *[destination] * MAX_CHANGES_PER_DESTINATION)
        assert writer.has_overflow(destination.participant if destination == A else destination)
    writer.handle_timeout(1.0)
    assert held(writer) == []
    assert not writer.has_overflow(A.participant)
    assert not writer.has_overflow(GUID_UNKNOWN)


def test_a_late_joiner_of_a_volatile_topic_gets_nothing_of_the_past() -> None:
    writer = make_writer()
    a = match(writer, A)
    send(writer, A, B, A)
    late = writer.matched_reader_add(reader_data(of=B), (LOCATOR,), 0.0)
    assert shape(late) == ["HB 4-3 to 3"]
    assert (writer.readers[B].lst_seq, a.lst_seq) == (3, 3)


def test_a_late_joiner_of_a_topic_with_history_gets_its_own_part_of_it() -> None:
    """What a writer-side content filter needs: the mechanism is not only for the volatile topic."""
    history = RELIABLE_QOS | Qos(durability=TransientLocal())
    writer = make_writer(history)
    a = match(writer, A, history)
    send(writer, A, B, A, B, A)
    acknack(writer, a, 6, count=1)
    late = writer.matched_reader_add(reader_data(history, of=B), (LOCATOR,), 0.0)
    assert shape(late) == ["HB 2-4 ? to 3"]
    b = writer.readers[B]
    assert acknack(writer, b, 2, 2, 3, 4, count=1) == ["GAP 3-3 to 3", "DATA 2 to 3", "DATA 4 to 3", "HB 2-4 ? to 3"]
    assert acknack(writer, b, 5, count=2) == []
    assert held(writer) == [1, 2, 3, 4, 5]


def test_large_samples_go_in_fragments_to_their_reader() -> None:
    writer = make_writer(fragment_octets=100)
    match(writer, A)
    b = match(writer, B)
    send(writer, A)
    assert send(writer, B, payload=bytes(250)) == ["GAP 1-1 to 3", "FRAG 2.1-3 to 3", "HB 2-2 ? to 3"]
    out = shape(writer.receive_nack_frag(b, 2, numbers(2, 2), 1, 1.0))
    assert out == ["FRAG 2.2-2 to 3", "HB 2-2 ? to 3"]
    assert shape(writer.receive_nack_frag(b, 1, numbers(1, 1), 2, 1.0)) == ["GAP 1-1 to 3"], "not for it"


def test_best_effort_readers_get_their_samples_and_neither_gaps_nor_heartbeats() -> None:
    writer = make_writer()
    match(writer, A, BEST_EFFORT)
    match(writer, B, BEST_EFFORT)
    assert send(writer, A, B, A) == ["DATA 1 to 2", "DATA 2 to 3", "DATA 3 to 2"]
    assert (held(writer), writer.next_deadline()) == ([], math.inf)


def test_an_assertion_of_liveliness_is_directed_too() -> None:
    """A HEARTBEAT to all would tell each reader of numbers that are not its own."""
    writer = make_writer()
    match(writer, A)
    match(writer, B)
    send(writer, A)
    beats = writer.assert_liveliness()
    assert all(isinstance(beat, SendHeartbeat) and beat.liveliness for beat in beats)
    assert shape(beats) == ["HB 1-1 ? L to 2", "HB 1-0 L to 3"]


def test_the_piggybacked_heartbeat_and_the_fast_path_are_not_for_it() -> None:
    writer = make_writer()
    match(writer, A)
    assert not writer.sends_directly(write(writer))
    assert writer.piggyback_heartbeat() is None
