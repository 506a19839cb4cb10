"""The participant's verbs: writing and waiting for acknowledgment, lingering, goodbye, endpoints without a wire."""

from __future__ import annotations

import math

import pytest

from ddsi.config import Config
from ddsi.engine import DataAvailable, Participant, SendDatagram, StatusChanged, WriterProgress
from ddsi.messages.data import Data
from ddsi.messages.interpreter import InfoTimestamp
from ddsi.messages.raw_submessage import iterate_submessages
from ddsi.simulation import Domain, LinkConditions, invariants
from ddsi.spi import Octets
from ddsi.spi.plaintext import Plaintext
from ddsi.structure.cache_change import ChangeKind
from ddsi.structure.guid import Guid
from ddsi.structure.qos import Qos, reader_qos, writer_qos
from ddsi.structure.qos_policies import (
    BestEffort,
    KeepAll,
    KeepLast,
    Partition,
    Reliable,
    ResourceLimits,
    TransientLocal,
)
from ddsi.structure.status import SampleLost, SampleRejected
from tests.engine.wire import Stranger, engine, sent

RELIABLE = Qos(reliability=Reliable(), history=KeepAll())
LATE = RELIABLE | Qos(durability=TransientLocal())


def write(participant: Participant, writer: object, payload: bytes = b"\0\1\0\0", now: float = 0.0) -> None:
    participant.write(writer, ChangeKind.ALIVE, payload, b"", now)  # type: ignore[arg-type]


# --- the driving contract -------------------------------------------------------------------------------------------


def test_consecutive_small_writes_share_a_datagram() -> None:
    """They leave when their message is full, when effects are drained, or after a millisecond."""
    participant = engine()
    writer = participant.create_writer("Square", "T", writer_qos(RELIABLE), 0.0, is_keyed=False)
    stranger = Stranger()
    stranger.introduce(participant)
    participant.receive_datagram(stranger.sedp_reader(1, "Square", RELIABLE), stranger.address, 0.0)
    participant.drain_effects()
    for _ in range(10):
        write(participant, writer)
    assert not participant.has_effects, "they wait for each other"
    assert participant.next_deadline() <= 0.001
    participant.handle_timeout(0.001)
    (datagram,) = [octets for _, octets in sent(participant)]
    kinds = [raw.kind for raw in iterate_submessages(datagram)]
    assert kinds.count(0x15) == 10


def test_a_full_message_leaves_at_once() -> None:
    participant = engine()
    writer = participant.create_writer("Square", "T", writer_qos(RELIABLE), 0.0, is_keyed=False)
    stranger = Stranger()
    stranger.introduce(participant)
    participant.receive_datagram(stranger.sedp_reader(1, "Square", RELIABLE), stranger.address, 0.0)
    participant.drain_effects()
    for _ in range(20):
        write(participant, writer, bytes(200))
    full = [effect for effect in participant.take_finished() if isinstance(effect, SendDatagram)]
    assert len(full) == 3
    assert all(sum(map(len, effect.parts)) <= 1452 for effect in full)


def test_a_fragment_leaves_before_the_next_is_protected() -> None:
    """Told where datagrams go, it has none among its effects, and they are those that it would have there."""
    steps: list[str | bytes] = []

    class Watched(Plaintext):
        def encode_payload(self, writer: Guid, payload: Octets) -> Octets:
            steps.append("protected")
            return payload

    def play(participant: Participant) -> list[bytes]:
        writer = participant.create_writer("Square", "T", writer_qos(RELIABLE), 0.0, is_keyed=False)
        stranger = Stranger()
        stranger.introduce(participant)
        participant.receive_datagram(stranger.sedp_reader(1, "Square", RELIABLE), stranger.address, 0.0)
        participant.drain_effects()
        steps.clear()
        write(participant, writer, bytes(range(250)) * 20)
        return [octets for _, octets in sent(participant)]

    listed = play(engine())
    assert len(listed) == 4
    assert play(engine(hooks=Watched(), send=lambda effect: steps.append(b"".join(effect.parts)))) == []
    datagrams = [step for step in steps if isinstance(step, bytes)]
    assert datagrams == listed
    assert steps == [
        "protected",
        datagrams[0],
        "protected",
        datagrams[1],
        "protected",
        datagrams[2],
        "protected",
        datagrams[3],
    ]


def test_source_timestamps_travel_with_each_sample() -> None:
    participant = engine()
    writer = participant.create_writer("Square", "T", writer_qos(RELIABLE), 0.0, is_keyed=False)
    stranger = Stranger()
    stranger.introduce(participant)
    participant.receive_datagram(stranger.sedp_reader(1, "Square", RELIABLE), stranger.address, 0.0)
    participant.drain_effects()
    stamps = [5 << 32, 5 << 32, 6 << 32, 1 << 32]
    for ticks in stamps:
        participant.write(writer, ChangeKind.ALIVE, b"\0\1\0\0", b"", 0.0, source_timestamp=ticks)
    seen, ticks_now = [], None
    for _, octets in sent(participant):
        for raw in iterate_submessages(octets):
            if raw.kind == 0x09:
                ticks_now = InfoTimestamp.decode(raw.flags, raw.body).timestamp
            elif raw.kind == 0x15:
                seen.append((Data.decode(raw.flags, raw.body).writer_sn, ticks_now))
    assert seen == list(enumerate(stamps, 1))


def test_a_participant_that_is_closed_wants_nothing_more() -> None:
    participant = engine()
    participant.create_writer("Square", "T", writer_qos(RELIABLE), 0.0, is_keyed=False)
    stranger = Stranger()
    stranger.introduce(participant)
    participant.close(1.0)
    destinations = {locator for each, _ in sent(participant) for locator in each}
    assert stranger.address in destinations, "a goodbye"
    participant.close(1.0)
    assert participant.drain_effects() == []
    assert participant.next_deadline() == math.inf
    participant.receive_datagram(stranger.spdp(entity_name="x"), stranger.address, 2.0)
    participant.handle_timeout(100.0)
    assert participant.drain_effects() == []


def test_effects_name_what_is_to_be_woken() -> None:
    domain = Domain()
    a, b = domain.node(), domain.node()
    writer, reader = a.writer("Square", RELIABLE), b.reader("Square", RELIABLE, takes=False)
    assert domain.run_until(domain.all_matched, 1)
    seen: list[object] = []
    for node in (a, b):
        original = node.engine.drain_effects

        def drain(original: object = original) -> list[object]:
            effects = original()  # type: ignore[operator]
            seen.extend(effects)
            return effects  # type: ignore[no-any-return]

        node.engine.drain_effects = drain  # type: ignore[method-assign,assignment]
    writer.local.wants_acknowledgment += 1
    writer.write()
    domain.run(1)
    assert DataAvailable(reader.guid) in seen
    assert WriterProgress(writer.guid) in seen
    assert sum(isinstance(effect, DataAvailable) for effect in seen) == 1
    writer.write()
    domain.run(1)
    assert sum(isinstance(effect, DataAvailable) for effect in seen) == 1, "nobody has looked yet"


# --- acknowledgment and its absence ---------------------------------------------------------------------------------


def test_who_waits_for_acknowledgment_gets_it_in_a_round_trip() -> None:
    domain = Domain(conditions=LinkConditions(delay=0.01))
    a, b = domain.node(), domain.node()
    writer, _ = a.writer("Square", RELIABLE), b.reader("Square", RELIABLE)
    assert domain.run_until(domain.all_matched, 1)
    domain.run(1)
    writer.write()
    begin = domain.now
    writer.local.wants_acknowledgment += 1
    a.engine.request_acknowledgment(writer.local, domain.now)
    a.pump()
    behavior = writer.local.behavior
    assert domain.run_until(lambda: behavior.min_acked_sn() == 1, 1)
    assert domain.now - begin < 0.025


def test_a_full_reader_stops_its_writer_and_frees_it_by_taking() -> None:
    """From the application that does not take, through both histories, to the one that cannot write: back-pressure."""
    domain = Domain()
    a, b = domain.node(), domain.node()
    limits = RELIABLE | Qos(resource_limits=ResourceLimits(max_samples=10))
    writer, reader = a.writer("Square", limits), b.reader("Square", limits, takes=False)
    assert domain.run_until(domain.all_matched, 1)
    written = 0
    for _ in range(60):
        written += writer.write() is not None
        domain.run(0.2)
    assert written == 20
    domain.run(30)
    assert len(reader.history) == 10
    taken = 0
    for _ in range(10):
        taken += len(reader.take())
        domain.run(3)
    assert taken == 20
    assert reader.session(writer.guid).numbers == list(range(1, 21))
    assert writer.write() is not None
    assert len(reader.node.statuses_of(SampleLost)) == 0


def test_a_full_best_effort_reader_says_what_it_rejected() -> None:
    domain = Domain()
    a, b = domain.node(), domain.node()
    writer = a.writer("Square", RELIABLE)
    reader = b.reader(
        "Square", Qos(reliability=BestEffort(), history=KeepAll(), resource_limits=ResourceLimits(max_samples=2)),
        takes=False,
    )  # fmt: skip
    assert domain.run_until(domain.all_matched, 1)
    for _ in range(5):
        writer.write()
    domain.run(1)
    rejected = b.statuses_of(SampleRejected)
    assert [status.total_count for status in rejected if isinstance(status, SampleRejected)] == [1, 2, 3]
    assert reader.local.rejected.reason == "max_samples"


def test_samples_that_are_lost_are_counted_with_their_reason() -> None:
    domain = Domain(conditions=LinkConditions(loss=0.5))
    a, b = domain.node(), domain.node()
    writer, reader = a.writer("Square", RELIABLE), b.reader("Square", Qos(reliability=BestEffort(), history=KeepAll()))
    domain.run_until(domain.all_matched, 30)
    for _ in range(200):
        writer.write()
        domain.run(0.01)
    domain.network.conditions = LinkConditions()
    writer.write()
    domain.run(1)
    got = reader.session(writer.guid).numbers
    assert reader.local.lost.total_count == got[-1] - got[0] + 1 - len(got) > 0
    assert reader.local.lost.reason == "skipped by a best-effort stream"


# --- deleting -------------------------------------------------------------------------------------------------------


def test_a_deleted_writer_lingers_for_who_lacks_something() -> None:
    domain = Domain(seed=2, conditions=LinkConditions(loss=0.3))
    a, b = domain.node(), domain.node()
    writer, reader = a.writer("Square", RELIABLE), b.reader("Square", RELIABLE)
    domain.run_until(domain.all_matched, 10)
    for _ in range(30):
        writer.write(100)
    writer.delete()
    assert domain.run_until(lambda: writer.guid not in a.engine.local_writers, 2)
    domain.run(5)
    assert reader.session(writer.guid).numbers == list(range(1, 31))
    assert reader.matched_count == 0


def test_a_deleted_writer_does_not_wait_for_the_dead() -> None:
    domain = Domain()
    a, b = domain.node(), domain.node()
    writer, _ = a.writer("Square", RELIABLE), b.reader("Square", RELIABLE)
    domain.run_until(domain.all_matched, 1)
    b.kill()
    writer.write()
    writer.delete()
    assert writer.guid in a.engine.local_writers
    domain.run(1.1)
    assert writer.guid not in a.engine.local_writers
    assert a.engine.closing == set()


def test_a_writer_with_nothing_to_repair_goes_at_once() -> None:
    domain = Domain()
    a, b = domain.node(), domain.node()
    writer, _ = a.writer("Square", RELIABLE), b.reader("Square", RELIABLE)
    domain.run_until(domain.all_matched, 1)
    writer.delete()
    assert writer.guid not in a.engine.local_writers
    writer.delete()  # twice is no harm


def test_no_new_reader_is_matched_with_a_writer_that_lingers() -> None:
    domain = Domain()
    a, b = domain.node(), domain.node()
    writer, _ = a.writer("Square", LATE), b.reader("Square", LATE)
    domain.run_until(domain.all_matched, 1)
    domain.network.unplug(b.host)
    writer.write()
    writer.delete()
    local = a.reader("Square", LATE)
    assert local.matched_count == 0
    domain.network.heal()
    domain.run(2)
    assert invariants.matched(domain) == []


# --- without the wire -----------------------------------------------------------------------------------------------


def test_endpoints_of_one_participant_match_by_the_same_rules() -> None:
    domain = Domain()
    node = domain.node()
    writer = node.writer("Square", Qos(partition=Partition("p")))
    for qos, expected in (
        (Qos(partition=Partition("p")), 1),
        (Qos(partition=Partition("q")), 0),
        (Qos(partition=Partition("p"), durability=TransientLocal()), 0),
        (Qos(partition=Partition("*"), reliability=Reliable()), 1),
    ):
        assert node.reader("Square", qos).matched_count == expected
    assert node.reader("Square", Qos(partition=Partition("p")), type_name="U").matched_count == 0
    assert node.reader("Square", Qos(partition=Partition("p")), keyed=True).matched_count == 0
    assert writer.matched_count == 2
    assert writer.local.incompatible.total_count == 1


def test_a_late_local_reader_gets_the_history_that_is_there() -> None:
    domain = Domain()
    node = domain.node()
    writer = node.writer("Square", Qos(durability=TransientLocal(), history=KeepLast(3)))
    for _ in range(10):
        writer.write()
    late = node.reader("Square", Qos(durability=TransientLocal(), reliability=Reliable(), history=KeepAll()))
    volatile = node.reader("Square", Qos(reliability=Reliable(), history=KeepAll()))
    assert late.session(writer.guid).numbers == [8, 9, 10]
    writer.write()
    assert late.session(writer.guid).numbers == [8, 9, 10, 11]
    assert volatile.session(writer.guid).numbers == [11]


@pytest.mark.parametrize("count", [30, 2000])
def test_a_full_local_reader_holds_its_writer_and_loses_nothing(count: int) -> None:
    """However much waits for it: what it has no room for stays in the writer's cache, not in a buffer of its own."""
    domain = Domain()
    node = domain.node()
    writer = node.writer("Square", RELIABLE)
    reader = node.reader("Square", RELIABLE | Qos(resource_limits=ResourceLimits(max_samples=10)), takes=False)
    for _ in range(count):
        assert writer.write() is not None
    assert len(reader.history) == 10
    assert writer.local.behavior.min_acked_sn() == 10
    while reader.take():
        pass
    assert reader.session(writer.guid).numbers == list(range(1, count + 1))
    assert len(writer.local.behavior.cache) == 0


def test_a_local_reader_does_not_hide_losses_from_remote_ones() -> None:
    domain = Domain(seed=3, conditions=LinkConditions(loss=0.5))
    a, b = domain.node(), domain.node()
    writer, near, far = a.writer("Square", RELIABLE), a.reader("Square", RELIABLE), b.reader("Square", RELIABLE)
    domain.run_until(domain.all_matched, 30)
    for _ in range(20):
        writer.write()
        domain.run(0.5)
    domain.run(20)
    assert near.session(writer.guid).numbers == far.session(writer.guid).numbers == list(range(1, 21))


def _status_names(participant: Participant) -> list[str]:
    effects = participant.drain_effects()
    return [type(effect.status).__name__ for effect in effects if isinstance(effect, StatusChanged)]


def test_statuses_of_local_matches_are_those_of_remote_ones() -> None:
    participant = engine()
    writer = participant.create_writer("Square", "T", writer_qos(RELIABLE), 0.0, is_keyed=False)
    reader = participant.create_reader("Square", "T", reader_qos(RELIABLE), 0.0, is_keyed=False)
    names = [
        type(effect.status).__name__ for effect in participant.drain_effects() if isinstance(effect, StatusChanged)
    ]
    assert sorted(names) == ["LivelinessChanged", "PublicationMatched", "SubscriptionMatched"]
    participant.delete_reader(reader, 1.0)
    names = [
        type(effect.status).__name__ for effect in participant.drain_effects() if isinstance(effect, StatusChanged)
    ]
    assert "PublicationMatched" in names
    assert writer.matched.current_count == 0


def test_large_samples_go_whole_to_local_readers() -> None:
    domain = Domain()
    node = domain.node(config=Config(max_sample_size=1 << 20))
    writer, reader = node.writer("Blob", RELIABLE), node.reader("Blob", RELIABLE)
    writer.write(3 << 20)
    ((_, change),) = reader.taken
    assert len(change.payload) == (3 << 20) + 5
