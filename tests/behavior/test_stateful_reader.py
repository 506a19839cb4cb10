"""StatefulReader and its WriterProxies: order, loss, what is asked for, and the ACKNACK that each vendor takes."""

from __future__ import annotations

import math

import pytest

from ddsi.behavior.defrag import FRAGMENT_SILENCE, DefragBudget, Defragmenter, Keep
from ddsi.behavior.schedules import NACK_DELAY, NACK_REPEAT_FIRST, NACK_REPEAT_MIN
from ddsi.behavior.stateful_reader import RemoteWriter, StatefulReader
from ddsi.behavior.transmissions import SendAckNack, SendNackFrag
from ddsi.behavior.writer_proxy import WriterProxy
from ddsi.structure.guid import Guid
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import BestEffort, TransientLocal
from ddsi.structure.sequence_number import NumberSet
from ddsi.structure.vendor import CYCLONE, FAST_DDS, OPENDDS, OUR_VENDOR_ID, RTI, TWINOAKS
from tests.behavior.builders import (
    LOCATOR,
    RELIABLE_QOS,
    Sink,
    change,
    numbers,
    reader_guid,
    stateful_reader,
    writer_data,
)

BEST_EFFORT = Qos(reliability=BestEffort())


class Pair:
    """A reader, its history, and one writer that it is matched with."""

    def __init__(
        self,
        qos: Qos = RELIABLE_QOS,
        *,
        room: int = 1 << 30,
        greeted: bool = True,
        vendor_id: bytes = OUR_VENDOR_ID,
        uses_filter: bool = False,
        max_samples: int = 100,
    ) -> None:
        """``greeted``: the writer's first HEARTBEAT has come; it was empty."""
        self.sink = Sink(room)
        self.reader: StatefulReader = stateful_reader(self.sink, qos, max_samples=max_samples)
        self.data = writer_data(vendor_id=vendor_id)
        self.proxy: WriterProxy = self.reader.matched_writer_add(self.data, (LOCATOR,), 0.0, uses_filter=uses_filter)
        self.remote = RemoteWriter(self.data, Defragmenter(DefragBudget(1 << 20), max_samples=100, keep=Keep.LOWEST))
        self.remote.readers.append((self.reader, self.proxy))
        self.remote.readers_changed()
        self._count = 0
        if greeted and self.proxy.is_reliable:
            self.heartbeat(1, 0, final=True)

    @property
    def keep(self) -> Keep:
        return self.remote.defragmenter.keep

    def data_in(self, *sequence_numbers: int, now: float = 0.0) -> list[int]:
        """Changes arrive; returns how many were lost before each."""
        return [self.reader.receive_data(self.proxy, change(number), now) for number in sequence_numbers]

    def heartbeat(self, first: int, last: int, *, now: float = 0.0, final: bool = False) -> int:
        self._count += 1
        return self.reader.receive_heartbeat(self.proxy, first, last, self._count, now, final=final)

    def gap(self, start: int, base: int, *more: int, now: float = 0.0) -> None:
        self.reader.receive_gap(self.proxy, start, numbers(base, *more), now)

    def fragment(self, number: int, fragment: int, *, of: int = 4, now: float = 0.0, reader: bytes = bytes(4)) -> bool:
        """One fragment of 10 octets arrives; returns whether the sample was wanted at all."""
        if not self.reader.fragment_received(self.proxy, number, now):
            return False
        self.remote.defragmenter.add(
            number, reader, sample_size=of * 10, fragment_size=10, first=fragment, count=1, fragments=bytes(10), now=now
        )
        return True

    def due(self, now: float) -> list[str]:
        """What the reader answers now: ``ACK 3``, ``ACK 3 lacks 3 5``, ``FRAG 3 lacks 1``; ? is not final."""
        out = []
        for answer in self.reader.handle_timeout(self.proxy, self.remote, now):
            match answer:
                case SendAckNack(missing, _, final):
                    lacks = " lacks " + " ".join(map(str, missing)) if missing else ""
                    out.append(f"ACK {missing.base}{lacks}{'' if final else ' ?'}")
                case SendNackFrag(number, missing, _):
                    out.append(f"FRAG {number} lacks " + " ".join(map(str, missing)))
        return out

    @property
    def next_due(self) -> float:
        return self.proxy.schedule.due


# --- order ----------------------------------------------------------------------------------------------------------


def test_changes_are_delivered_in_order_and_once() -> None:
    pair = Pair()
    pair.data_in(1, 3, 3, 2, 2, 1, 4)
    assert pair.sink.numbers == [1, 2, 3, 4]


def test_nothing_is_delivered_before_the_first_heartbeat() -> None:
    """Only it tells what comes first: a writer may have begun long ago."""
    pair = Pair(greeted=False)
    pair.data_in(8, 7)
    assert pair.sink.numbers == []
    assert pair.heartbeat(7, 8) == 0, "what came before the first one was never for this reader"
    assert pair.sink.numbers == [7, 8]


def test_best_effort_takes_what_comes_and_tells_what_did_not() -> None:
    pair = Pair(BEST_EFFORT)
    assert pair.data_in(5, 6, 9, 7, 9, 10) == [0, 0, 2, 0, 0, 0]
    assert pair.sink.numbers == [5, 6, 9, 10], "what comes late is dropped, and nothing comes twice"
    assert pair.next_due == math.inf


def test_best_effort_does_not_count_what_a_gap_named() -> None:
    pair = Pair(BEST_EFFORT)
    pair.data_in(1)
    pair.gap(3, 5)
    assert pair.data_in(7) == [3], "2, 5 and 6"
    assert pair.data_in(8) == [0]
    assert not pair.proxy.reorder, "nothing is kept that would slow the next ones down"


def test_a_gap_makes_a_best_effort_reader_say_nothing() -> None:
    """It has nothing to ask for, so it must not answer: a writer would take that for a reliable reader."""
    pair = Pair(BEST_EFFORT)
    pair.gap(1, 10)
    assert pair.next_due == math.inf
    assert pair.heartbeat(1, 20) == 0
    assert pair.next_due == math.inf


def test_gaps_are_stepped_over() -> None:
    pair = Pair()
    pair.data_in(4, 6, 9)
    pair.gap(1, 4, 5)
    assert pair.sink.numbers == [4, 6]
    pair.gap(7, 7, 7, 8)  # base = gapStart: only the bits count
    assert pair.sink.numbers == [4, 6, 9]
    assert pair.proxy.available_changes_max() == 9


@pytest.mark.parametrize(
    ("start", "base", "more", "next_sn", "last_seq"),
    [
        (1, 4, (), 4, 3),  # [1, 3]
        (1, 1, (1, 2), 3, 2),  # only the set
        (1, 2, (2, 3), 4, 3),
        (1, 3, (4,), 3, 4),  # [1, 2] and 4
        (3, 2, (4,), 1, 4),  # a base below the start: only the set
    ],
)
def test_forms_of_gap(start: int, base: int, more: tuple[int, ...], next_sn: int, last_seq: int) -> None:
    pair = Pair()
    pair.gap(start, base, *more)
    assert (pair.proxy.next_sn, pair.proxy.last_seq) == (next_sn, last_seq)


def test_what_the_writer_no_longer_has_is_lost() -> None:
    pair = Pair()
    pair.data_in(1, 4)
    assert pair.heartbeat(4, 6) == 2, "2 and 3"
    assert pair.sink.numbers == [1, 4]
    assert pair.heartbeat(3, 6) == 0, "a writer never has more than before"


def test_numbers_that_a_filtering_writer_skips_are_no_loss() -> None:
    pair = Pair(uses_filter=True)
    pair.data_in(1)
    assert pair.heartbeat(9, 9) == 0
    pair.data_in(9)
    assert pair.sink.numbers == [1, 9]


@pytest.mark.parametrize(
    ("counts", "accepted"),
    [
        ([1, 2, 3], [True, True, True]),
        ([5, 5, 4, 6], [True, False, False, True]),
        ([0xFFFFFFFF, 0, 1], [True, True, True]),
        ([0, 0], [True, False]),
    ],
)
def test_old_heartbeats_are_ignored(counts: list[int], accepted: list[bool]) -> None:
    proxy = Pair(greeted=False).proxy
    assert [proxy.accepts_heartbeat(count, now=1.0) for count in counts] == accepted


def test_a_writer_that_counts_anew_is_heard_again() -> None:
    proxy = Pair(greeted=False).proxy
    assert proxy.accepts_heartbeat(100, now=1.0)
    assert not proxy.accepts_heartbeat(1, now=1.4)
    assert proxy.accepts_heartbeat(1, now=1.6)


def test_when_the_writer_goes_what_waited_behind_a_hole_is_delivered() -> None:
    pair = Pair()
    pair.data_in(1, 3, 5)
    pair.reader.matched_writer_remove(pair.data.guid, 0.0)
    assert pair.sink.numbers == [1, 3, 5]


# --- asking ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("vendor_id", "first", "second"),
    [
        (CYCLONE, (1, 0), (1, 0)),  # base 0 is malformed for it; only count 0 takes its preemptive path
        (FAST_DDS, (0, 1), (0, 2)),  # base 1 merely restarts its timer
        (RTI, (0, 1), (0, 2)),
        (OPENDDS, (0, 1), (0, 2)),
        (TWINOAKS, (0, 1), (0, 2)),
        (b"\x01\x12", (1, 1), (1, 2)),  # RustDDS
        (b"\x01\x14", (1, 1), (1, 2)),  # Dust DDS drops count 0
        (OUR_VENDOR_ID, (1, 1), (1, 2)),
        (b"\x77\x77", (1, 1), (1, 2)),
    ],
)
def test_the_preemptive_acknack_has_the_form_that_the_vendor_takes(
    vendor_id: bytes, first: tuple[int, int], second: tuple[int, int]
) -> None:
    pair = Pair(greeted=False, vendor_id=vendor_id)
    for expected in (first, second):
        (answer,) = pair.reader.handle_timeout(pair.proxy, pair.remote, pair.next_due)
        assert answer == SendAckNack(NumberSet(expected[0]), expected[1], final=False)


def test_a_heartbeat_that_asks_is_answered_at_once_and_another_not() -> None:
    pair = Pair()
    pair.data_in(1)
    pair.heartbeat(1, 1, now=1.0, final=True)
    assert pair.next_due == math.inf
    pair.heartbeat(1, 1, now=1.0)
    assert pair.next_due == 1.0
    assert pair.due(1.0) == ["ACK 2"]
    assert pair.next_due == math.inf


def test_missing_changes_are_asked_for_after_a_moment() -> None:
    pair = Pair()
    pair.data_in(1, 4, now=1.0)
    assert pair.next_due == 1.0 + NACK_DELAY
    assert pair.due(1.0) == [], "not yet"
    assert pair.due(pair.next_due) == ["ACK 2 lacks 2 3"]


def test_a_little_reordering_is_not_answered() -> None:
    pair = Pair()
    pair.data_in(2, now=1.0)
    pair.data_in(1, now=1.0 + NACK_DELAY / 2)
    assert pair.next_due == math.inf


def test_a_final_heartbeat_is_answered_when_something_is_missing() -> None:
    pair = Pair()
    pair.heartbeat(1, 2, now=1.0, final=True)
    assert pair.due(1.0 + NACK_DELAY) == ["ACK 1 lacks 1 2"]


def test_what_was_asked_for_is_left_out_until_it_is_overdue() -> None:
    """Its repair is under way; only what is newly missing is asked for, and the base still says what is not here."""
    pair = Pair()
    pair.data_in(2, now=0.0)
    assert pair.due(NACK_DELAY) == ["ACK 1 lacks 1"]
    pair.data_in(5, now=0.01)
    assert pair.due(0.01 + NACK_DELAY) == ["ACK 1 lacks 3 4"]
    pair.heartbeat(1, 5, now=0.02)
    assert pair.due(0.02) == ["ACK 1"], "asked whether it is here: no, but that is known"
    assert pair.due(pair.next_due) == ["ACK 1 lacks 1 3 4"]
    assert pair.next_due > 0.05


def test_a_reader_never_stalls_while_something_is_missing() -> None:
    """Whatever gets lost, it asks again, ever slower but for ever."""
    pair = Pair()
    pair.heartbeat(1, 3)
    now = 0.0
    asked = 0
    while now < 60:
        now = pair.next_due
        assert now < math.inf
        asked += "lacks" in " ".join(pair.due(now))
    assert 30 < asked < 60


def test_progress_lets_it_ask_soon_again() -> None:
    pair = Pair()
    pair.heartbeat(1, 3, final=True)
    for _ in range(6):
        now = pair.next_due
        pair.due(now)
    assert pair.next_due - now > 1.0
    pair.data_in(1, now=now + 0.001)
    pair.due(now + 0.001 + NACK_DELAY)
    assert pair.next_due - now <= NACK_REPEAT_FIRST + NACK_REPEAT_MIN


def test_the_bitmap_ends_after_256_numbers() -> None:
    pair = Pair()
    pair.heartbeat(1, 1000, final=True)
    (answer,) = pair.reader.handle_timeout(pair.proxy, pair.remote, NACK_DELAY)
    assert isinstance(answer, SendAckNack)
    assert (answer.missing.base, answer.missing.num_bits, list(answer.missing)[-1]) == (1, 256, 256)
    pair.data_in(*range(1, 257), now=0.01)
    assert pair.due(0.01 + NACK_DELAY) == ["ACK 257 lacks " + " ".join(map(str, range(257, 513)))]


def test_every_acknack_has_a_count_of_its_own() -> None:
    pair = Pair()
    counts = []
    for number in range(1, 5):
        pair.heartbeat(1, number)
        for answer in pair.reader.handle_timeout(pair.proxy, pair.remote, float(number)):
            counts.append(answer.count)
    assert counts == [1, 2, 3, 4]


def test_what_does_not_fit_the_buffer_is_asked_for_again() -> None:
    pair = Pair(max_samples=3)
    pair.data_in(2, 3, 4, 5, now=0.0)
    assert pair.due(NACK_DELAY) == ["ACK 1 lacks 1 5"]
    pair.data_in(1, now=0.01)
    assert pair.sink.numbers == [1, 2, 3, 4]
    pair.data_in(5, now=0.02)
    assert pair.sink.numbers == [1, 2, 3, 4, 5]


# --- a full history -------------------------------------------------------------------------------------------------


def test_a_full_reader_withholds_acknowledgment() -> None:
    """What the history did not take waits here, and the writer is not told that it arrived."""
    pair = Pair(room=2)
    pair.data_in(1, 2, 3, 4)
    pair.heartbeat(1, 4, now=1.0)
    assert pair.due(1.0) == ["ACK 3"]
    assert pair.sink.numbers == [1, 2]
    assert pair.next_due == math.inf, "it has nothing to ask for"
    pair.sink.room = 3
    assert pair.reader.resume(2.0) == [pair.proxy]
    assert pair.due(2.0) == ["ACK 4"]
    pair.sink.room = 10
    pair.reader.resume(3.0)
    assert pair.sink.numbers == [1, 2, 3, 4]
    assert pair.due(3.0) == ["ACK 5"]


def test_a_full_reader_still_asks_for_what_is_missing() -> None:
    pair = Pair(room=1)
    pair.data_in(1, 2, 5, now=0.0)
    assert pair.due(NACK_DELAY) == ["ACK 2 lacks 3 4"]


def test_resuming_without_anything_to_hand_over_says_nothing() -> None:
    pair = Pair()
    pair.data_in(1, 3)
    assert pair.reader.resume(1.0) == []


# --- fragments ------------------------------------------------------------------------------------------------------


def test_missing_fragments_are_asked_for_by_number_when_it_is_silent() -> None:
    """The sample as a whole is not asked for: the ACKNACK leaves it out, a NACK_FRAG names what is missing."""
    pair = Pair()
    pair.fragment(1, 1, now=0.0)
    pair.fragment(1, 3, now=0.0)
    pair.heartbeat(1, 2, now=0.0)
    assert pair.due(0.0) == ["ACK 1 lacks 2"], "fragments may still be coming"
    pair.heartbeat(1, 2, now=FRAGMENT_SILENCE)
    assert pair.due(FRAGMENT_SILENCE) == ["ACK 1", "FRAG 1 lacks 2 4"]


def test_fragments_that_were_asked_for_are_waited_for() -> None:
    pair = Pair()
    pair.fragment(1, 1, now=0.0)
    pair.heartbeat(1, 1, now=1.0)
    assert pair.due(1.0) == ["ACK 1", "FRAG 1 lacks 2 3 4"]
    pair.heartbeat(1, 1, now=1.01)
    assert pair.due(1.01) == ["ACK 1"]
    pair.fragment(1, 2, now=1.02)
    assert pair.due(1.02 + FRAGMENT_SILENCE) == ["ACK 1", "FRAG 1 lacks 3 4"], "part of the answer was lost"


def test_a_sample_that_is_known_already_takes_no_memory() -> None:
    pair = Pair()
    pair.data_in(1)
    assert not pair.fragment(1, 1)
    assert len(pair.remote.defragmenter) == 0


def test_unfinished_samples_that_became_irrelevant_are_forgotten() -> None:
    """Else, as the lowest numbers, they would keep every later one out."""
    pair = Pair()
    pair.fragment(1, 1)
    pair.fragment(3, 1)
    pair.gap(1, 2)
    pair.remote.forget_settled()
    assert list(pair.remote.defragmenter.partial_for(pair.reader.guid.entity_id)) == [3]
    pair.heartbeat(4, 4)
    pair.remote.forget_settled()
    assert len(pair.remote.defragmenter) == 0


def test_a_best_effort_reader_of_a_reliable_writer_keeps_the_newest() -> None:
    """It asks for nothing, so what is not finished when a later sample is, never will be."""
    pair = Pair(BEST_EFFORT)
    assert not pair.remote.is_reliable
    assert pair.keep is Keep.HIGHEST
    for number in range(1, 10):
        pair.fragment(number, 1)
    pair.data_in(9)
    pair.remote.forget_settled(9)
    assert list(pair.remote.defragmenter.partial_for(pair.reader.guid.entity_id)) == [9]


def test_what_is_kept_follows_the_readers_that_are_there() -> None:
    pair = Pair(BEST_EFFORT)
    other = stateful_reader(Sink())
    pair.remote.readers.append((other, other.matched_writer_add(pair.data, (LOCATOR,), 0.0)))
    pair.remote.readers_changed()
    kept = [pair.keep]
    pair.remote.readers.pop()
    pair.remote.readers_changed()
    kept.append(pair.keep)
    assert kept == [Keep.LOWEST, Keep.HIGHEST]


# --- history --------------------------------------------------------------------------------------------------------


def test_historical_data_is_there_when_what_the_first_heartbeat_named_is() -> None:
    reader = stateful_reader(Sink(), RELIABLE_QOS | Qos(durability=TransientLocal()))
    proxy = reader.matched_writer_add(writer_data(RELIABLE_QOS | Qos(durability=TransientLocal())), (LOCATOR,), 0.0)
    assert not proxy.has_historical_data, "nothing was heard yet"
    reader.receive_heartbeat(proxy, 1, 2, 1, 0.0, final=False)
    assert not proxy.has_historical_data
    for number in (1, 2):
        reader.receive_data(proxy, change(number), 0.0)
    assert proxy.has_historical_data
    reader.receive_heartbeat(proxy, 1, 5, 2, 0.0, final=False)
    assert proxy.has_historical_data, "what is written later is no history"


def test_a_volatile_reader_waits_for_no_history() -> None:
    reader = stateful_reader(Sink())
    proxy = reader.matched_writer_add(writer_data(), (LOCATOR,), 0.0)
    assert proxy.has_historical_data


def test_two_writers_do_not_disturb_each_other() -> None:
    sink = Sink()
    reader = stateful_reader(sink)
    proxies = []
    for participant in (7, 8):
        guid = Guid.of(bytes((participant,)) * 12, reader_guid(1).entity_id)
        proxy = reader.matched_writer_add(writer_data(of=guid), (LOCATOR,), 0.0)
        reader.receive_heartbeat(proxy, 1, 0, 1, 0.0, final=True)
        proxies.append(proxy)
    reader.receive_data(proxies[0], change(2), 0.0)
    reader.receive_data(proxies[1], change(1), 0.0)
    assert [proxy.next_sn for proxy in proxies] == [1, 2]
