"""Hostile octets into an engine that is matched with peers: nothing raises, drops are counted, memory stays bounded.

The raw material is what real stacks sent, and what our own engines say to each other; it is cut, joined and altered.
"""

from __future__ import annotations

from collections.abc import Iterator
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.config import Config
from ddsi.engine import LocalReader, LocalWriter, Participant
from ddsi.messages.acknack import AckNack, NackFrag
from ddsi.messages.data_frag import DataFrag
from ddsi.messages.gap import Gap
from ddsi.messages.heartbeat import Heartbeat, HeartbeatFrag
from ddsi.messages.interpreter import InfoDestination
from ddsi.messages.raw_submessage import iterate_submessages
from ddsi.simulation import Domain
from ddsi.structure.cache_change import ChangeKind
from ddsi.structure.guid import EntityId, Guid
from ddsi.structure.locator import Locator
from ddsi.structure.qos import Qos, reader_qos, writer_qos
from ddsi.structure.qos_policies import KeepAll, Reliable, TransientLocal
from ddsi.structure.sequence_number import NumberSet
from ddsi.trace.reasons import DropReason
from tests.captures.capture import PLAIN, load
from tests.engine.wire import Stranger, engine, sent

RELIABLE = Qos(reliability=Reliable(), history=KeepAll())
HISTORY = RELIABLE | Qos(durability=TransientLocal())
BOUNDS = Config(
    max_participants=10, max_endpoints=40, max_instances=20, max_sample_size=1 << 16, max_defrag_octets=1 << 18,
    max_reorder_samples=64, reader_octets=1 << 18,
)  # fmt: skip


class Target:
    """An engine with a reliable writer and reader, matched with a stranger's."""

    def __init__(self) -> None:
        self.participant: Participant = engine(config=BOUNDS)
        self.stranger = Stranger()
        self.writer: LocalWriter = self.participant.create_writer("Out", "T", writer_qos(HISTORY), 0.0, is_keyed=False)
        self.reader: LocalReader = self.participant.create_reader("In", "T", reader_qos(RELIABLE), 0.0, is_keyed=False)
        self.stranger.introduce(self.participant)
        for octets in (self.stranger.sedp_writer(1, "In", RELIABLE), self.stranger.sedp_reader(1, "Out", HISTORY)):
            self.participant.receive_datagram(octets, self.stranger.address, 0.0)
        assert self.writer.behavior.readers
        assert self.reader.behavior.writers
        for number in range(5):
            self.participant.write(self.writer, ChangeKind.ALIVE, b"\0\1\0\0" + bytes(number * 700), b"", 0.0)
        self.participant.drain_effects()
        self.now = 0.0

    def hear(self, octets: bytes, source: Locator | None = None) -> None:
        """One datagram; then the engine does whatever it wants to do about it for a while."""
        self.now += 0.01
        self.participant.receive_datagram(octets, source or self.stranger.address, self.now)
        self.run(self.now)

    def run(self, until: float) -> int:
        """Let its timers run; returns how often it woke up.  It must not be kept busy."""
        woken = 0
        self.participant.drain_effects()
        while self.participant.next_deadline() <= until:
            woken += 1
            assert woken < 5000, "timers without end"
            self.now = max(self.now, self.participant.next_deadline())
            self.participant.handle_timeout(self.now)
            self.participant.drain_effects()
        return woken

    def check_bounds(self) -> None:
        participant = self.participant
        assert len(participant.participants) <= BOUNDS.max_participants
        assert len(participant.known_writers) + len(participant.known_readers) <= BOUNDS.max_endpoints
        assert participant.defrag_budget.octets <= BOUNDS.max_defrag_octets
        for reader in participant.local_readers.values():
            for proxy in reader.behavior.writers.values():
                assert len(proxy.reorder) <= BOUNDS.max_reorder_samples + 1
                assert len(proxy.reorder._range_starts) <= 512
                assert len(proxy.schedule._asked) <= 1024
        assert self.reader.history is not None
        assert self.reader.history.octets <= BOUNDS.reader_octets + BOUNDS.max_sample_size
        for writer in participant.local_writers.values():
            for reader_proxy in writer.behavior.readers.values():
                assert len(reader_proxy._resent) <= 1024
        assert len(participant.alarms._timers._heap) <= 64 + 5 * len(participant.alarms._timers)


# --- what real stacks and our own said, altered ---------------------------------------------------------------------


def _our_own() -> list[bytes]:
    """A conversation of two of our engines, with fragments, repairs, disposes and goodbyes in it."""
    domain = Domain(seed=5)
    seen: list[bytes] = []
    domain.network.watch = lambda sender, octets: seen.append(octets)
    a, b = domain.node(), domain.node()
    writer = a.writer("In", HISTORY, keyed=True)
    b.reader("In", HISTORY, keyed=True)
    domain.run_until(domain.all_matched, 1)
    for size in (10, 5000, 20_000):
        writer.write(size)
        domain.run(0.1)
    writer.end(ChangeKind.NOT_ALIVE_DISPOSED)
    domain.run(1)
    writer.delete()
    a.close()
    domain.run(1)
    return seen


def _captured(names: list[str]) -> list[bytes]:
    return [octets for name in names for octets in load(name).datagrams]


def _altered(octets: bytes, random: Random, prefix: bytes) -> bytes:
    """Some octets changed, cut or doubled; sent in the name of the peer that is known."""
    out = bytearray(octets)
    if random.random() < 0.8:
        out[8:20] = prefix
    for _ in range(random.choice((0, 1, 1, 2, 5))):
        position = random.randrange(len(out))
        kind = random.random()
        if kind < 0.5:
            out[position] = random.choice((0, 1, 0x7F, 0x80, 0xFF, random.randrange(256)))
        elif kind < 0.7:
            del out[position : position + random.randrange(1, 9)]
        elif kind < 0.9:
            out[position:position] = random.randbytes(random.randrange(1, 9))
        else:
            out[position : position + 4] = random.choice((b"\xff\xff\xff\x7f", b"\xff" * 4, b"\0\0\0\x80", bytes(4)))
    return bytes(out)


@pytest.mark.parametrize("name", ["ours", *PLAIN])
def test_altered_conversations_do_no_harm(name: str) -> None:
    target = Target()
    random = Random(name)
    originals = _our_own() if name == "ours" else _captured([name])
    writer_ids = [target.reader.behavior.writers[guid].entity_id for guid in target.reader.behavior.writers]
    for _ in range(4):
        for octets in originals[:150]:
            altered = _altered(octets, random, target.stranger.prefix)
            if random.random() < 0.5:
                altered = _readdressed(altered, target, writer_ids[0])
            target.hear(altered)
    target.run(target.now + 30)
    target.check_bounds()
    assert target.participant.drops.total() > 0


def _readdressed(octets: bytes, target: Target, writer_id: EntityId) -> bytes:
    """Let submessages of user writers and readers be about the matched ones."""
    out = bytearray(octets)
    reader_id = Stranger().endpoint(1, is_writer=False).entity_id
    own_writer = target.writer.guid.entity_id
    try:
        for raw in iterate_submessages(octets):
            body = raw.offset + 4
            if raw.kind in (0x07, 0x08, 0x13) and len(raw.body) >= 8:
                out[body + 4 : body + 8] = writer_id
            elif raw.kind in (0x15, 0x16) and len(raw.body) >= 12:
                out[body + 8 : body + 12] = writer_id
            elif raw.kind in (0x06, 0x12) and len(raw.body) >= 8:
                out[body : body + 8] = reader_id + own_writer
            elif raw.kind == 0x0E and len(raw.body) == 12:
                out[body : body + 12] = target.participant.guid.prefix
    except Exception:
        pass
    return bytes(out)


@given(st.binary(max_size=200), st.booleans())
def test_any_octets_do_no_harm(octets: bytes, headed: bool) -> None:
    target = Target()
    target.hear(target.stranger.message(octets) if headed else octets)
    target.check_bounds()


# --- well-formed and malicious --------------------------------------------------------------------------------------

EXTREMES = [1, 2, 5, 255, 256, 257, 2**31 - 1, 2**31, 2**32, 2**62, 2**63 - 1]
numbers = st.one_of(st.integers(1, 20), st.sampled_from(EXTREMES))
counts = st.one_of(st.integers(0, 5), st.sampled_from([2**31 - 1, 2**31, 2**32 - 1]))
sets = st.builds(
    lambda base, bits, bitmap: NumberSet(base, bits, bitmap & ((1 << bits) - 1)),
    numbers,
    st.integers(0, 256),
    st.integers(0, (1 << 256) - 1),
)
WRITER_ID = Stranger().endpoint(1, is_writer=True).entity_id
READER_ID = Stranger().endpoint(1, is_writer=False).entity_id
OUR_WRITER_ID = EntityId(b"\0\0\1\3")
OUR_READER_ID = EntityId(b"\0\0\2\4")


def _heartbeat(first: int, length: int, count: int, final: bool) -> bytes:
    last = min(first + length - 1, 2**63 - 1)
    return Heartbeat(EntityId.UNKNOWN, WRITER_ID, first, last, count, final).encode()


def _fragment(number: int, first: int, size: int, sample_size: int, reader: EntityId) -> bytes:
    """A DATA_FRAG whose announced sizes are the sender's choice, with as few octets as the rules allow."""
    first = max(1, min(first, -(-sample_size // size)))
    length = min(size, sample_size - (first - 1) * size)
    return DataFrag(reader, WRITER_ID, number, first, 1, size, sample_size, None, bytes(length)).encode()


malicious = st.one_of(
    st.builds(_heartbeat, numbers, st.one_of(st.integers(0, 10), st.sampled_from(EXTREMES)), counts, st.booleans()),
    st.builds(lambda start, irrelevant: Gap(OUR_READER_ID, WRITER_ID, start, irrelevant).encode(), numbers, sets),
    st.builds(
        lambda state, count, final: AckNack(READER_ID, OUR_WRITER_ID, state, count, final).encode(),
        sets,
        counts,
        st.booleans(),
    ),
    st.builds(
        lambda number, state, count: NackFrag(READER_ID, OUR_WRITER_ID, number, state, count).encode(),
        numbers,
        sets.filter(lambda state: state.base < 2**32),
        counts,
    ),
    st.builds(
        lambda number, last, count: HeartbeatFrag(EntityId.UNKNOWN, WRITER_ID, number, last, count).encode(),
        numbers,
        st.sampled_from([1, 2, 2**32 - 1]),
        counts,
    ),
    st.builds(
        _fragment,
        numbers,
        st.integers(1, 2**16),
        st.sampled_from([1, 100, 1000]),
        st.sampled_from([1, 100, 1001, 65_536, 65_537, 2**32 - 1]),
        st.sampled_from([EntityId.UNKNOWN, OUR_READER_ID]),
    ),
)


@given(st.lists(malicious, min_size=1, max_size=20))
def test_well_formed_lies_do_no_harm(lies: list[bytes]) -> None:
    """Numbers at the ends of their ranges, sizes that are not there, sets of anything, by a peer that is matched."""
    target = Target()
    head = InfoDestination(target.participant.guid.prefix).encode()
    for lie in lies:
        target.hear(target.stranger.message(head, lie))
    assert target.run(target.now + 20) < 2000
    target.check_bounds()


def test_promises_of_large_samples_take_no_more_memory_than_allowed() -> None:
    """A datagram of a hundred octets may announce a sample of gigabytes."""
    target = Target()
    for number in range(1, 200):
        for size in (2**32 - 1, 65_536, 65_536):
            target.hear(target.stranger.message(_fragment(number, 1, 100, size, EntityId.UNKNOWN)))
    assert target.participant.drops[DropReason.SAMPLE_TOO_LARGE] == 199
    assert target.participant.drops[DropReason.TABLE_FULL_FRAGMENTS] > 0
    target.check_bounds()


def test_a_writer_that_runs_ahead_fills_its_buffer_and_no_more() -> None:
    target = Target()
    beat = Heartbeat(EntityId.UNKNOWN, WRITER_ID, 1, 0, 1, final=True).encode()
    target.hear(target.stranger.message(beat))
    for number in range(2, 2000):
        gap_and_data = Gap(EntityId.UNKNOWN, WRITER_ID, number * 10, NumberSet(number * 10 + 2)).encode()
        target.hear(target.stranger.message(gap_and_data, _data(number * 10 + 5)))
    target.check_bounds()
    assert target.reader.history is not None
    assert len(target.reader.history) == 0, "the first is still missing"


def _data(number: int) -> bytes:
    from ddsi.messages.data import Data

    return Data(EntityId.UNKNOWN, WRITER_ID, number, None, b"\0\1\0\0" + bytes(1000)).encode()


def test_a_reader_that_asks_and_asks_gets_a_bounded_answer() -> None:
    """However often it asks for everything within a moment."""
    target = Target()
    head = InfoDestination(target.participant.guid.prefix).encode()
    total = 0
    for count in range(1, 200):
        ask = AckNack(READER_ID, OUR_WRITER_ID, NumberSet(1, 5, 0b11111), count, True).encode()
        target.now += 0.00001
        octets = target.stranger.message(head, ask)
        target.participant.receive_datagram(octets, target.stranger.address, target.now)
        total += sum(len(datagram) for _, datagram in sent(target.participant))
    assert total < 20_000, "7,000 octets are in the history"


def _instances() -> Iterator[bytes]:
    for number in range(1, 400):
        yield _data(number)


def test_a_reader_that_nobody_empties_holds_what_it_may_and_acknowledges_no_more() -> None:
    target = Target()
    target.hear(target.stranger.message(Heartbeat(EntityId.UNKNOWN, WRITER_ID, 1, 0, 1, final=True).encode()))
    for octets in _instances():
        target.hear(target.stranger.message(octets))
    target.check_bounds()
    proxy = next(iter(target.reader.behavior.writers.values()))
    assert proxy.next_sn < 300
    assert isinstance(proxy.guid, Guid)
