"""The seam to security, seen from the engine: every moment is asked, and every answer is acted upon."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import pytest

from ddsi.behavior.filtering_writer import MAX_CHANGES_PER_DESTINATION
from ddsi.engine import LocalReader, LocalWriter, SendDatagram, StatusChanged
from ddsi.engine.outbound import fragment_octets_for
from ddsi.simulation import Domain, Node, invariants
from ddsi.spi import (
    ADMITTED,
    PENDING,
    Admission,
    Announcement,
    Compute,
    Decided,
    HookEffect,
    LocalParticipant,
    NoKeys,
    NotForUs,
    Octets,
    Outcome,
    Overhead,
    Parts,
    Protection,
    Refused,
    Rejected,
    SendMessage,
)
from ddsi.spi.plaintext import Plaintext
from ddsi.structure.cache_change import CacheChange, ChangeKind
from ddsi.structure.discovered import DiscoveredParticipantData, DiscoveredReaderData, DiscoveredWriterData
from ddsi.structure.errors import NotAllowedBySecurity
from ddsi.structure.guid import Guid, GuidPrefix
from ddsi.structure.qos import Qos, reader_qos, writer_qos
from ddsi.structure.qos_policies import BestEffort, DataTags, KeepAll, Partition, Reliable, TransientLocal
from ddsi.structure.status import SecurityRefused
from ddsi.trace.reasons import DropReason
from tests.engine.wire import Stranger, engine

RELIABLE = Qos(reliability=Reliable(), history=KeepAll())
BEST_EFFORT = Qos(reliability=BestEffort(), history=KeepAll())


class Hooks(Plaintext):
    """Everything passes, unless a test says otherwise; what was asked is written down."""

    def __init__(self) -> None:
        self.asked: list[str] = []
        self.participants: Admission = ADMITTED
        self.matches: Admission = ADMITTED
        self.effects: list[HookEffect] = []
        self.deadline = math.inf

    def local_participant(self, candidate: LocalParticipant) -> Guid:
        self.asked.append("local_participant")
        return super().local_participant(candidate)

    def remote_participant(self, data: DiscoveredParticipantData, now: float) -> Admission:
        self.asked.append("remote_participant")
        return self.participants

    def remote_participant_changed(self, data: DiscoveredParticipantData, now: float) -> Admission:
        self.asked.append("remote_participant_changed")
        return self.participants

    def remote_participant_lost(self, guid: Guid) -> None:
        self.asked.append("remote_participant_lost")

    def local_endpoint_deleted(self, guid: Guid) -> None:
        self.asked.append("local_endpoint_deleted")

    def local_participant_deleted(self) -> None:
        self.asked.append("local_participant_deleted")

    def announcement(self) -> Announcement:
        self.asked.append("announcement")
        return super().announcement()

    def announced(self, parameters: bytes) -> None:
        self.asked.append("announced")
        self.said = parameters

    def match(self, local: Guid, remote: DiscoveredWriterData | DiscoveredReaderData) -> Admission:
        if local.entity_id.is_builtin:
            self.asked.append(f"match {remote.topic_name}")
            return ADMITTED
        self.asked.append("match")
        return self.matches

    def unmatch(self, local: Guid, remote: Guid) -> None:
        self.asked.append("unmatch")

    def handle_timeout(self, now: float) -> None:
        self.asked.append("handle_timeout")
        self.deadline = math.inf

    def next_deadline(self) -> float:
        return self.deadline

    def drain_effects(self) -> Sequence[HookEffect]:
        effects, self.effects = self.effects, []
        return effects


def pair(make_hooks: Callable[[], Hooks] = Hooks) -> tuple[Domain, Node, Node, Hooks]:
    """Two nodes; the second has the hooks."""
    domain = Domain()
    hooks = make_hooks()
    return domain, domain.node(), domain.node(make_hooks=lambda: hooks), hooks


def test_the_moments_of_a_life_are_asked_in_order() -> None:
    domain, a, b, hooks = pair()
    a.writer("Square", RELIABLE)
    reader = b.reader("Square", RELIABLE)
    domain.run_until(domain.all_matched, 1)
    reader.delete()
    a.close()
    domain.run(1)
    assert hooks.asked == [
        "local_participant", "announcement", "announced", "remote_participant",
        "match DCPSPublication", "match DCPSPublication", "match DCPSSubscription", "match DCPSSubscription",
        "match DCPSParticipantMessage", "match DCPSParticipantMessage",
        "match TypeLookupServiceRequest", "match TypeLookupServiceRequest",
        "match TypeLookupServiceReply", "match TypeLookupServiceReply",
        "match", "unmatch", "local_endpoint_deleted", "remote_participant_lost",
    ]  # fmt: skip


def test_the_end_is_told_once_behind_the_last_message_and_nothing_is_asked_after_it() -> None:
    class Counting(Hooks):
        def encode_message(self, receivers: tuple[Guid, ...], message: Parts) -> Parts:
            self.asked.append("encode_message")
            return super().encode_message(receivers, message)

        def drain_effects(self) -> Sequence[HookEffect]:
            self.asked.append("drain_effects")
            return super().drain_effects()

    domain, a, b, hooks = pair(Counting)
    a.reader("Square", RELIABLE)
    writer = b.writer("Square", RELIABLE)
    domain.run_until(domain.all_matched, 1)
    writer.write()
    hooks.asked.clear()
    b.engine.close(b.now)
    assert hooks.asked[-1] == "local_participant_deleted"
    assert "encode_message" in hooks.asked  # "endpoint gone", for one
    told = len(hooks.asked)
    assert any(isinstance(effect, SendDatagram) for effect in b.engine.drain_effects())
    b.engine.handle_timeout(b.now + 10)
    b.engine.close(b.now + 10)
    assert b.engine.drain_effects() == []
    assert len(hooks.asked) == told


def test_the_end_is_told_when_a_participant_cannot_be_made() -> None:
    class Failing(Hooks):
        def announced(self, parameters: bytes) -> None:
            raise OSError("no space left")

    hooks = Failing()
    with pytest.raises(OSError, match="no space left"):
        pair(lambda: hooks)
    assert hooks.asked == ["local_participant", "announcement", "local_participant_deleted"]


def test_a_local_participant_may_be_refused() -> None:
    class Refusing(Hooks):
        def local_participant(self, candidate: LocalParticipant) -> Guid:
            raise NotAllowedBySecurity("no identity")

    with pytest.raises(NotAllowedBySecurity, match="no identity"):
        pair(Refusing)


def test_a_local_participant_may_get_another_guid() -> None:
    class Adjusting(Hooks):
        def local_participant(self, candidate: LocalParticipant) -> Guid:
            return Guid(b"\x80" + candidate.guid[1:])

    _, _, b, _ = pair(Adjusting)
    assert b.engine.guid[0] == 0x80


def test_a_refused_participant_is_known_but_nothing_is_matched() -> None:
    domain, a, b, hooks = pair()
    hooks.participants = Refused("not signed by our authority")
    a.writer("Square", RELIABLE)
    b.reader("Square", RELIABLE)
    domain.run(3)
    assert b.statuses_of(SecurityRefused) == [SecurityRefused(remote=a.guid, reason="not signed by our authority")]
    assert len(b.engine.known_writers) == 0
    assert b.engine.remote_writers == {}


def test_a_pending_participant_is_matched_when_it_is_decided() -> None:
    domain, a, b, hooks = pair()
    hooks.participants = PENDING
    a.writer("Square", RELIABLE)
    reader = b.reader("Square", RELIABLE)
    domain.run(3)
    assert reader.matched_count == 0
    hooks.effects.append(Decided(b.guid, a.guid, ADMITTED))
    b.pump()
    assert domain.run_until(lambda: reader.matched_count == 1, 2)


def test_a_pending_participant_that_is_refused_in_the_end_is_known_as_such() -> None:
    """It stays in the table, so that its announcements are no news; and it may be admitted later."""
    domain, a, b, hooks = pair()
    hooks.participants = PENDING
    domain.run(1)
    refused = Decided(b.guid, a.guid, Refused("wrong signature"))
    hooks.effects += [refused, refused]
    b.pump()
    assert b.statuses_of(SecurityRefused) == [SecurityRefused(remote=a.guid, reason="wrong signature")]
    assert not b.engine.participants[a.guid.prefix].is_admitted
    hooks.effects.append(Decided(b.guid, a.guid, ADMITTED))
    b.pump()
    assert b.engine.participants[a.guid.prefix].is_admitted


def test_an_admitted_participant_that_is_refused_is_gone() -> None:
    domain, a, b, hooks = pair()
    a.writer("Square", RELIABLE)
    reader = b.reader("Square", RELIABLE)
    assert domain.run_until(domain.all_matched, 1)
    hooks.participants = Refused("its certificate was revoked")
    hooks.effects.append(Decided(b.guid, a.guid, hooks.participants))
    b.pump()
    assert (reader.matched_count, len(b.engine.known_writers), a.guid.prefix in b.engine.participants) == (0, 0, False)
    domain.run(100)
    assert not b.engine.participants[a.guid.prefix].is_admitted, "it is known again, and refused"
    revoked = SecurityRefused(remote=a.guid, reason="its certificate was revoked")
    assert b.statuses_of(SecurityRefused) == [revoked, revoked]


def test_a_refused_participant_is_asked_about_whenever_it_announces_itself() -> None:
    """So that security may let it try again after a while."""
    domain, a, b, hooks = pair()
    hooks.participants = Refused("it did not answer for 100 s")
    domain.run(100)
    asked = hooks.asked.count("remote_participant_changed")
    assert asked > 3
    assert len(b.statuses_of(SecurityRefused)) == 1
    hooks.participants = ADMITTED
    assert domain.run_until(lambda: b.engine.participants[a.guid.prefix].is_admitted, 40)
    asked = hooks.asked.count("remote_participant_changed")
    domain.run(100)
    assert hooks.asked.count("remote_participant_changed") == asked


@pytest.mark.parametrize("admission", [ADMITTED, Refused("topic Square is denied to it")])
def test_a_pending_pair_waits_for_its_decision(admission: Admission) -> None:
    domain, a, b, hooks = pair()
    hooks.matches = PENDING
    writer = a.writer("Square", RELIABLE)
    reader = b.reader("Square", RELIABLE)
    domain.run(1)
    assert reader.matched_count == 0
    hooks.effects.append(Decided(reader.guid, writer.guid, admission))
    b.pump()
    domain.run(1)
    assert reader.matched_count == (admission is ADMITTED)
    refused = b.statuses_of(SecurityRefused)
    assert len(refused) == (admission is not ADMITTED)
    hooks.effects.append(Decided(reader.guid, writer.guid, ADMITTED))  # nobody waits any more
    b.pump()
    assert reader.matched_count == (admission is ADMITTED)


@pytest.mark.parametrize("event", ["remote gone", "local gone", "no longer fits"])
def test_a_pair_that_ends_while_it_is_pending_is_unmatched_and_never_matched(event: str) -> None:
    domain, a, b, hooks = pair()
    hooks.matches = PENDING
    writer = a.writer("Square", RELIABLE)
    reader = b.reader("Square", RELIABLE)
    domain.run(1)
    assert "unmatch" not in hooks.asked
    match event:
        case "remote gone":
            writer.delete()
        case "local gone":
            reader.delete()
        case _:
            qos = replace(writer.local.data.qos, partition=Partition("elsewhere"))
            writer.local.data = replace(writer.local.data, qos=qos)
            a.engine.discovery.announce_writer(writer.local, a.now)
            a.pump()
    domain.run(1)
    assert hooks.asked.count("unmatch") == 1
    hooks.effects.append(Decided(reader.guid, writer.guid, ADMITTED))
    b.pump()
    assert reader.matched_count == 0
    assert writer.guid not in b.engine.remote_writers


def test_a_refused_pair_is_kept_with_its_reason() -> None:
    domain, a, b, hooks = pair()
    hooks.matches = Refused("partition p is not in its permissions")
    writer = a.writer("Square", RELIABLE)
    reader = b.reader("Square", RELIABLE)
    domain.run(1)
    refusal = b.engine.matchmaker.refusals[(reader.guid, writer.guid)]
    assert refusal.offered == "partition p is not in its permissions"
    assert b.statuses_of(SecurityRefused) == [
        SecurityRefused(remote=writer.guid, reason="partition p is not in its permissions")
    ]


@pytest.mark.parametrize("is_writer", [False, True])
def test_a_matched_endpoint_that_announces_something_else_is_asked_about_again(is_writer: bool) -> None:
    """Else it could be let in with one partition, or one data tag, and go on with another."""
    hooks = Hooks()
    participant, stranger = engine(hooks=hooks), Stranger()
    own: LocalWriter | LocalReader
    if is_writer:
        own = participant.create_reader("Square", "T", reader_qos(RELIABLE), 0.0, is_keyed=False)
    else:
        own = participant.create_writer("Square", "T", writer_qos(RELIABLE), 0.0, is_keyed=False)
    announce = stranger.sedp_writer if is_writer else stranger.sedp_reader
    stranger.introduce(participant)
    for admission, qos, matched, asked in (
        (ADMITTED, RELIABLE, 1, 1),
        (ADMITTED, RELIABLE, 1, 1),  # the same again
        (PENDING, RELIABLE | Qos(data_tags=DataTags(("colour", "red"))), 1, 2),
        (Refused("not blue"), RELIABLE | Qos(data_tags=DataTags(("colour", "blue"))), 0, 3),
        (ADMITTED, RELIABLE | Qos(data_tags=DataTags(("colour", "green"))), 1, 4),
    ):
        hooks.matches = admission
        participant.receive_datagram(announce(qos=qos), stranger.address, 1.0)
        assert (own.matched.current_count, hooks.asked.count("match")) == (matched, asked)
    refusals = [
        (effect.entity, effect.status.reason)
        for effect in participant.drain_effects()
        if isinstance(effect, StatusChanged) and isinstance(effect.status, SecurityRefused)
    ]
    assert refusals == [(own.guid, "not blue")]
    assert hooks.asked.count("unmatch") == 1


def test_slow_work_is_computed_elsewhere_and_comes_back() -> None:
    class Computing(Hooks):
        result: object = None

        def computed(self, effect: Compute, result: object, now: float) -> None:
            self.result = (effect, result, now)

    domain, _, b, hooks = pair(Computing)
    domain.run(1)
    effect = Compute(subject=b.guid, generation=3, job=lambda: 6 * 7)
    hooks.effects.append(effect)
    b.pump()
    assert isinstance(hooks, Computing)
    assert hooks.result == (effect, 42, domain.now)


def test_the_hooks_have_their_deadline() -> None:
    domain, _, b, hooks = pair()
    domain.run(1)
    hooks.deadline = 5.0
    b.pump()
    domain.run(3)
    assert "handle_timeout" not in hooks.asked
    domain.run(2)
    assert hooks.asked.count("handle_timeout") == 1


def test_who_has_said_goodbye_says_nothing_more() -> None:
    domain, sender, listeners, hooks = _messenger()
    sender.engine.close(domain.now)
    sender.engine.drain_effects()
    hooks.effects.append(_message(sender, listeners[0], b"too late"))
    assert sender.engine.drain_effects() == []


# --- transform ------------------------------------------------------------------------------------------------------


class Masking(Hooks):
    """Each submessage of a user writer or reader is wrapped into SEC_PREFIX ... SEC_POSTFIX, each payload inverted."""

    def encode_payload(self, writer: Guid, payload: Octets) -> Octets:
        return payload if writer.entity_id.is_builtin else _inverted(payload)

    def decode_payload(self, writer: Guid, payload: Octets, place: memoryview | None = None) -> Octets | Outcome:
        return payload if writer.entity_id.is_builtin else _inverted(payload)

    def encode_submessage(self, sender: Guid, receivers: tuple[Guid, ...], submessage: Parts) -> Parts:
        if sender.entity_id.is_builtin:
            return submessage
        body = b"".join(submessage)
        wrapped = b"\x30\x01" + len(body).to_bytes(2, "little") + body
        return (b"\x31\x01\x04\0prot", wrapped, b"\x32\x01\x04\0stop")

    def decode_submessage(self, protected: Octets, source: bytes) -> Octets | Outcome:
        return bytes(protected[12:-8])

    def overhead(self, sender: Guid, receivers: tuple[Guid, ...]) -> Overhead:
        return Overhead(submessage=20)

    def admits(self, sender: bytes, protection: int) -> bool:
        return bool(protection & Protection.SUBMESSAGE) or Guid(sender).entity_id.is_builtin


def _inverted(octets: Octets) -> bytes:
    return bytes(octet ^ 0xFF for octet in bytes(octets))


def secured(make: Callable[[], Hooks] = Masking) -> tuple[Domain, Node, Node]:
    domain = Domain()
    return domain, domain.node(make_hooks=make), domain.node(make_hooks=make)


def test_protected_samples_and_fragments_arrive_and_messages_keep_their_size() -> None:
    domain, a, b = secured()
    writer, reader = a.writer("Square", RELIABLE), b.reader("Square", RELIABLE)
    assert domain.run_until(domain.all_matched, 1)
    sizes: list[int] = []
    seen: list[bytes] = []

    def watch(sender: bytes, octets: bytes) -> None:
        sizes.append(len(octets))
        seen.append(octets)

    domain.network.watch = watch
    for size in (3, 1003, 10_003):
        writer.write(size)
    domain.run(2)
    assert [len(change.payload) for _, change in reader.taken] == [8, 1008, 10_008]
    assert reader.session(writer.guid).numbers == [1, 2, 3]
    assert max(sizes) <= 1452
    assert not any(bytes(writer.written[1].payload) in octets for octets in seen)


def test_what_comes_in_clear_but_should_not_is_dropped_and_counted() -> None:
    class Lax(Masking):
        def encode_submessage(self, sender: Guid, receivers: tuple[Guid, ...], submessage: Parts) -> Parts:
            return submessage

    domain = Domain()
    a, b = domain.node(make_hooks=Lax), domain.node(make_hooks=Masking)
    writer, reader = a.writer("Square", RELIABLE), b.reader("Square", RELIABLE)
    domain.run(1)
    writer.write()
    writer.write(10_000)
    domain.run(1)
    assert reader.taken == []
    assert b.engine.drops[DropReason.CLEAR_TEXT] > 3


@pytest.mark.parametrize(
    ("outcome", "reason"),
    [
        (NotForUs(), DropReason.NOT_FOR_US),
        (NoKeys(b"\1\2"), DropReason.NO_KEYS),
        (Rejected("the MAC is wrong"), DropReason.REJECTED_BY_SECURITY),
    ],
)
@pytest.mark.parametrize("level", ["decode_payload", "decode_submessage"])
def test_what_does_not_decode_is_dropped_with_its_outcome(outcome: Outcome, reason: DropReason, level: str) -> None:
    class Failing(Masking):
        pass

    def fail(self: Failing, subject: Guid | Octets, other: Octets | GuidPrefix) -> Octets | Outcome:
        is_builtin = isinstance(subject, Guid) and subject.entity_id.is_builtin
        return bytes(other) if is_builtin else outcome

    setattr(Failing, level, fail)
    domain = Domain()
    a, b = domain.node(make_hooks=Masking), domain.node(make_hooks=Failing)
    writer, reader = a.writer("Square", RELIABLE), b.reader("Square", RELIABLE)
    domain.run(1)
    writer.write()
    domain.run(0.2)
    assert reader.taken == []
    assert b.engine.drops[reason] > 0


def test_a_whole_message_that_does_not_decode_is_dropped() -> None:
    class Wrapping(Hooks):
        def encode_message(self, receivers: tuple[Guid, ...], message: Parts) -> Parts:
            octets = b"".join(message)
            return (octets[:20], b"\x33\x01\x04\0wrap", octets[20:])

    class Unwrapping(Hooks):
        def decode_message(self, message: Octets, source: bytes) -> Octets | Outcome:
            return bytes(message[:20]) + bytes(message[28:])

    for receiving, expected in ((Hooks, 0), (Unwrapping, 1)):
        domain = Domain()
        a, b = domain.node(make_hooks=Wrapping), domain.node(make_hooks=receiving)
        writer, reader = a.writer("Square", RELIABLE), b.reader("Square", RELIABLE)
        domain.run(2)
        writer.write()
        domain.run(2)
        assert len(reader.taken) == expected
        assert (b.engine.drops[DropReason.NOT_FOR_US] > 0) is (expected == 0)


def watched(domain: Domain) -> list[tuple[bytes, bytes]]:
    """Every datagram from here on, with its sender's prefix."""
    seen: list[tuple[bytes, bytes]] = []
    domain.network.watch = lambda sender, octets: seen.append((sender, octets))
    return seen


def test_what_must_not_leave_is_not_sent_in_any_form() -> None:
    """The hooks have no key for it: neither the submessage, nor a message without it."""

    class Silent(Masking):
        is_silent = False

        def encode_submessage(self, sender: Guid, receivers: tuple[Guid, ...], submessage: Parts) -> Parts:
            if self.is_silent and not sender.entity_id.is_builtin:
                return ()
            return super().encode_submessage(sender, receivers, submessage)

    domain, a, b = secured(Silent)
    writer, reader = a.writer("Square", RELIABLE), b.reader("Square", RELIABLE)
    assert domain.run_until(domain.all_matched, 1)
    domain.run(1)
    hooks = a.engine.hooks
    assert isinstance(hooks, Silent)
    hooks.is_silent = True
    seen = watched(domain)
    for size in (3, 10_000):
        writer.write(size)
    writer.end(ChangeKind.NOT_ALIVE_DISPOSED)
    domain.run(1)
    assert not [octets for sender, octets in seen if sender == a.guid.prefix and writer.guid[12:] in octets]
    hooks.is_silent = False
    assert domain.run_until(lambda: len(reader.session(writer.guid).numbers) == 3, 20), "and later it is repaired"


def test_a_message_that_must_not_leave_is_not_sent() -> None:
    class Mute(Hooks):
        is_mute = False

        def encode_message(self, receivers: tuple[Guid, ...], message: Parts) -> Parts:
            return () if self.is_mute else message

    domain, a, b = secured(Mute)
    writer, reader = a.writer("Square", RELIABLE), b.reader("Square", RELIABLE)
    assert domain.run_until(domain.all_matched, 1)
    hooks = a.engine.hooks
    assert isinstance(hooks, Mute)
    hooks.is_mute = True
    seen = watched(domain)
    writer.write()
    domain.run(0.5)
    assert not [octets for sender, octets in seen if sender == a.guid.prefix and writer.guid[12:] in octets]
    hooks.is_mute = False
    assert domain.run_until(lambda: len(reader.taken) == 1, 20)


@pytest.mark.parametrize("receivers", [1, 12])
def test_messages_and_fragments_leave_room_for_what_each_receiver_adds(receivers: int) -> None:
    """DDS-Security 1.1 §8.5.1.9: with origin authentication each receiver has a MAC of 20 octets, at both levels."""

    class Costly(Masking):
        def overhead(self, sender: Guid, receivers: tuple[Guid, ...]) -> Overhead:
            return Overhead(submessage=20 + 20 * len(receivers), message=28 + 20 * len(receivers))

        def encode_submessage(self, sender: Guid, receivers: tuple[Guid, ...], submessage: Parts) -> Parts:
            parts = super().encode_submessage(sender, receivers, submessage)
            if sender.entity_id.is_builtin:
                return parts
            macs = 20 * len(receivers)
            return (*parts[:-1], b"\x32\x01" + (4 + macs).to_bytes(2, "little") + bytes(macs) + b"stop")

        def decode_submessage(self, protected: Octets, source: bytes) -> Octets | Outcome:
            size = int.from_bytes(protected[10:12], "little")
            return bytes(protected[12 : 12 + size])

        def encode_message(self, receivers: tuple[Guid, ...], message: Parts) -> Parts:
            return (
                *message,
                b"\x34\x01" + (24 + 20 * len(receivers)).to_bytes(2, "little"),
                bytes(24 + 20 * len(receivers)),
            )

    domain = Domain()
    a = domain.node(make_hooks=Costly)
    others = [domain.node(make_hooks=Costly) for _ in range(receivers)]
    writer = a.writer("Square", RELIABLE)
    readers = [node.reader("Square", RELIABLE) for node in others]
    assert domain.run_until(domain.all_matched, 2)
    seen = watched(domain)
    for size in (3, 700, 900, 1003, 1300, 10_003, *[20] * 50):
        writer.write(size)
    assert domain.run_until(lambda: all(len(reader.taken) == 56 for reader in readers), 5)
    sizes = [len(octets) for sender, octets in seen if sender == a.guid.prefix]
    assert 1300 < max(sizes) <= 1452


def test_where_macs_would_fill_messages_they_become_larger_and_fragments_not_tiny() -> None:
    """A hundred receivers with a MAC each at both levels: 4000 octets."""
    assert fragment_octets_for(1452, None, Overhead(submessage=2000, message=2000)) == 512
    assert fragment_octets_for(1452, None, Overhead(submessage=100, message=100)) == 1136
    assert fragment_octets_for(1452, 100, Overhead(submessage=2000)) == 96
    assert fragment_octets_for(500, None, Overhead(submessage=2000)) == 384, "as much as without protection"
    assert fragment_octets_for(65_507, None, Overhead()) == 65_000


def test_fragments_of_one_sample_keep_their_size_when_receivers_come() -> None:
    """A reader that has some of them could not join them with others."""

    class Growing(Hooks):
        def overhead(self, sender: Guid, receivers: tuple[Guid, ...]) -> Overhead:
            return Overhead(message=200 * len(receivers))

    domain, a, b = secured(Growing)
    writer, reader = a.writer("Square", RELIABLE | Qos(durability=TransientLocal())), b.reader("Square", RELIABLE)
    assert domain.run_until(domain.all_matched, 1)
    before = writer.local.behavior.fragment_octets
    domain.network.conditions = replace(domain.network.conditions, loss=0.5)
    for _ in range(5):
        writer.write(20_000)
    domain.run(0.01)
    c = domain.node(make_hooks=Growing)
    late = c.reader("Square", RELIABLE | Qos(durability=TransientLocal()))
    domain.network.conditions = replace(domain.network.conditions, loss=0.1)
    assert domain.run_until(lambda: len(reader.taken) == len(late.taken) == 5, 60)
    assert writer.local.behavior.fragment_octets == before - 200
    assert b.engine.drops[DropReason.TABLE_FULL_FRAGMENTS] == 0


class Sealing(Masking):
    """Payloads are inverted, and 40 octets longer: of each run of fragments, or of a whole sample before it is cut."""

    def encode_payload(self, writer: Guid, payload: Octets) -> Octets:
        return payload if writer.entity_id.is_builtin else _inverted(payload) + bytes(40)

    def decode_payload(self, writer: Guid, payload: Octets, place: memoryview | None = None) -> Octets | Outcome:
        if writer.entity_id.is_builtin:
            return payload
        return _inverted(payload[:-40]) if bytes(payload[-40:]) == bytes(40) else Rejected("the MAC is wrong")

    def protects_payload(self, writer: Guid) -> bool:
        return not writer.entity_id.is_builtin

    def overhead(self, sender: Guid, receivers: tuple[Guid, ...]) -> Overhead:
        return Overhead(payload=40, submessage=20)


class SealingWhole(Sealing):
    """As OpenDDS does: what is cut into fragments is the protected form."""

    def encode_payload(self, writer: Guid, payload: Octets) -> Octets:
        return payload  # see below: the sample is protected before it is written


@pytest.mark.parametrize("size", [20, 5000, 9999])
@pytest.mark.parametrize("loss", [0.0, 0.3])
def test_a_sample_may_be_protected_by_fragments_or_as_a_whole(size: int, loss: float) -> None:
    domain = Domain()
    a, whole, b = (domain.node(make_hooks=hooks) for hooks in (Sealing, SealingWhole, Sealing))
    writer, other = a.writer("Square", RELIABLE), whole.writer("Square", RELIABLE)
    reader = b.reader("Square", RELIABLE)
    assert domain.run_until(domain.all_matched, 2)
    domain.network.conditions = replace(domain.network.conditions, loss=loss)
    plain = b"\0\1\0\0" + bytes(range(256)) * 50
    for _ in range(3):
        a.engine.write(writer.local, ChangeKind.ALIVE, plain[:size], b"", domain.now)
        sealed = _inverted(plain[:size]) + bytes(40)
        whole.engine.write(other.local, ChangeKind.ALIVE, sealed, b"", domain.now)
        a.pump()
        whole.pump()
    assert domain.run_until(lambda: len(reader.taken) == 6, 60)
    assert {bytes(change.payload[:size]) for _, change in reader.taken} == {plain[:size]}


class Joining(Sealing):
    """Opens what it has joined: a run that was protected by itself is of no use to it."""

    def decode_payload(self, writer: Guid, payload: Octets, place: memoryview | None = None) -> Octets | Outcome:
        is_run = len(payload) < 5000 and not writer.entity_id.is_builtin
        return Rejected("a part of a sample") if is_run else super().decode_payload(writer, payload)


@pytest.mark.parametrize("lacking", [0, 1, 40, 41, 500])
@pytest.mark.parametrize("loss", [0.0, 0.3])
def test_a_reader_that_joins_before_it_opens_gets_parts_of_what_was_protected_as_a_whole(
    lacking: int, loss: float
) -> None:
    """And the others, in the same moment, runs that can be opened one by one."""
    domain = Domain()
    joining, other = domain.node(make_hooks=Joining), domain.node(make_hooks=Sealing)

    class Knowing(Sealing):
        def opens_after_joining(self, reader: Guid) -> bool:
            return reader.prefix == joining.guid.prefix

    a = domain.node(make_hooks=Knowing)
    late_history = RELIABLE | Qos(durability=TransientLocal())
    writer = a.writer("Square", late_history)
    readers = [node.reader("Square", RELIABLE) for node in (joining, other)]
    assert domain.run_until(domain.all_matched, 2)
    domain.network.conditions = replace(domain.network.conditions, loss=loss)
    for _ in range(3):  # what protection adds fits into the last fragment, or makes one more
        writer.write(7 * writer.local.behavior.fragment_octets - lacking - 5)
    assert domain.run_until(lambda: all(len(reader.taken) == 3 for reader in readers), 60)
    readers.append(joining.reader("Square", late_history))
    assert domain.run_until(lambda: len(readers[-1].taken) == 3, 60), "a late joiner too"
    assert invariants.in_order(domain) == []
    assert all(change.sealed is not None for change in writer.written.values())


def test_a_whole_sample_that_does_not_open_is_dropped_and_asked_for_again() -> None:
    domain = Domain()
    whole, b = domain.node(make_hooks=SealingWhole), domain.node(make_hooks=Sealing)
    writer, reader = whole.writer("Square", RELIABLE), b.reader("Square", RELIABLE)
    assert domain.run_until(domain.all_matched, 2)
    whole.engine.write(writer.local, ChangeKind.ALIVE, bytes(5000) + b"not a MAC", b"", domain.now)
    whole.pump()
    domain.run(1)
    assert reader.taken == []
    assert b.engine.drops[DropReason.REJECTED_BY_SECURITY] > 1


# --- messages to one participant ------------------------------------------------------------------------------------


def _messenger() -> tuple[Domain, Node, list[Node], Hooks]:
    """A node whose hooks can send by a filtering writer, and three that listen."""
    domain = Domain()
    hooks = Hooks()
    sender = domain.node(make_hooks=lambda: hooks)
    sender.writer("keys", RELIABLE, filters=True)
    listeners = [domain.node() for _ in range(3)]
    for node in listeners:
        node.reader("keys", RELIABLE, uses_filter=True)
    assert domain.run_until(domain.all_matched, 2)
    return domain, sender, listeners, hooks


def _message(sender: Node, to: Node, text: bytes) -> SendMessage:
    writer = sender.writers[0]
    change = CacheChange(ChangeKind.ALIVE, writer.guid, 0, b"\0\1\0\0" + text, destination=to.guid)
    return SendMessage(writer.guid.entity_id, change)


def test_a_message_of_the_hooks_goes_to_its_participant_alone() -> None:
    domain, sender, listeners, hooks = _messenger()
    hooks.effects += [_message(sender, node, b"to" + node.name.encode()) for node in listeners]
    sender.pump()
    domain.run(1)
    for node in listeners:
        (received,) = node.readers[0].taken
        assert bytes(received[1].payload[4:7]) == b"to" + node.name.encode()


def test_a_message_given_again_is_completed_by_its_fragments_and_has_no_new_number() -> None:
    """What of it came first and what comes now make up one sample, though nobody asks for what is missing."""
    domain = Domain()
    hooks = Hooks()
    sender = domain.node(make_hooks=lambda: hooks)
    sender.writer("keys", BEST_EFFORT, filters=True)
    listener = domain.node()
    reader = listener.reader("keys", BEST_EFFORT, uses_filter=True)
    assert domain.run_until(domain.all_matched, 2)
    fragments: list[int] = []

    def loses(source: GuidPrefix, destination: GuidPrefix, octets: bytes) -> bool:
        """Of the first three fragments the first, of the next three the last."""
        is_fragment = len(octets) > 500
        fragments.extend([len(fragments)] * is_fragment)
        return is_fragment and fragments[-1] in (0, 5)

    domain.network.loses = loses
    message = _message(sender, listener, bytes(3500))
    hooks.effects += [message]
    sender.pump()
    domain.run(1)
    assert not reader.taken
    hooks.effects += [message]
    sender.pump()
    domain.run(1)
    ((_, change),) = reader.taken
    assert len(fragments) == 6
    assert change.sequence_number == 1


def test_a_participant_that_never_acknowledges_is_given_up_and_nobody_else_waits() -> None:
    """Its share of the history is full: what was begun with it is dropped, as if it had gone."""
    domain, sender, listeners, hooks = _messenger()
    silent, *others = listeners
    domain.network.unplug(silent.host)
    for number in range(MAX_CHANGES_PER_DESTINATION + 2):
        assert silent.guid.prefix in sender.engine.participants
        if number > MAX_CHANGES_PER_DESTINATION:
            domain.run(10.5)  # until then it may be slow
        hooks.effects.append(_message(sender, silent, b"%04d" % number))
        sender.pump()
        if number % 50 == 0:
            hooks.effects.append(_message(sender, others[0], b"%04d" % number))
            sender.pump()
    assert silent.guid.prefix not in sender.engine.participants
    assert "remote_participant_lost" in hooks.asked
    behavior = sender.writers[0].local.behavior
    assert silent.readers[0].guid not in behavior.readers
    domain.run(1)
    assert len(others[0].readers[0].taken) == 6
    assert len(behavior.cache) == 0
    domain.network.heal()
    assert domain.run_until(domain.all_matched, 30), "it may begin anew"
