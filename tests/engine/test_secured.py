"""Secured participants, from the first announcement to the last goodbye, with toys in the place of cryptography."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from ddsi.config import Config
from ddsi.discovery.builtin_endpoints import ANNOUNCED_ENDPOINTS, BUILTIN_TOPICS
from ddsi.discovery.parameters import encode_participant
from ddsi.messages.data import Data
from ddsi.messages.header import Header
from ddsi.messages.raw_submessage import SubmessageKind, iterate_submessages
from ddsi.serialization.parameter_id import ParameterId
from ddsi.serialization.parameter_list import ParameterList
from ddsi.simulation import Domain, LinkConditions, Node
from ddsi.simulation.endpoints import NodeReader, NodeWriter
from ddsi.spi import ADMITTED, Decided, Refused
from ddsi.structure import builtin_entity_ids as ids
from ddsi.structure.guid import Guid
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import Automatic, KeepAll, ManualByParticipant, Partition, Reliable, TransientLocal
from ddsi.structure.status import SecurityRefused
from ddsi.structure.vendor import CYCLONE, OUR_VENDOR_ID, PROTOCOL_VERSION, VendorId
from ddsi.trace.events import EndpointLost, ParticipantLost, SecurityEvent
from ddsi.trace.reasons import DropReason, LossReason
from ddsi.trace.sink import MemorySink

from .xor_security import SECURE_BITS, STATUS_TOKEN, STRANGE_ISSUER, XorSecurity

RELIABLE = Qos(reliability=Reliable(), history=KeepAll())
LATE = RELIABLE | Qos(durability=TransientLocal())
TOPIC = "SecretOfTheDay"


def hooks_of(node: Node) -> XorSecurity:
    hooks = node.engine.hooks
    assert isinstance(hooks, XorSecurity)
    return hooks


def node(domain: Domain, **changes: object) -> Node:
    """A secured participant; ``changes`` are fields of its XorSecurity."""
    return domain.node(make_hooks=lambda: XorSecurity(**changes))  # type: ignore[arg-type]


def talking(domain: Domain, topic: str = TOPIC, qos: Qos = RELIABLE) -> tuple[Node, Node, NodeWriter, NodeReader]:
    """Two secured participants, a writer and a reader, all matched."""
    a, b = node(domain), node(domain)
    writer, reader = a.writer(topic, qos), b.reader(topic, qos)
    assert domain.run_until(domain.all_matched, 5)
    return a, b, writer, reader


class Wire:
    """Every datagram of a domain: who sent it, and its octets."""

    def __init__(self, domain: Domain) -> None:
        self.sent: list[tuple[bytes, bytes]] = []
        domain.network.watch = lambda sender, octets: self.sent.append((sender, octets))

    def all(self) -> bytes:
        return b"".join(octets for _, octets in self.sent)

    def kinds_by(self, sender: Node) -> set[int]:
        """The kinds of submessage that it sent outside protected messages."""
        return {
            submessage.kind
            for prefix, octets in self.sent
            if prefix == sender.guid.prefix
            for submessage in iterate_submessages(memoryview(octets), start=20)
        }


# --- all goes well --------------------------------------------------------------------------------------------------


def test_two_authenticate_exchange_keys_match_and_talk() -> None:
    domain = Domain()
    a, b, writer, reader = talking(domain)
    assert domain.now < 0.5, "nobody had to wait for a repetition"
    for size in (8, 700, 20_000):
        writer.write(size)
    assert domain.run_until(lambda: len(reader.taken) == 3, 2)
    for engine in (a.engine, b.engine):
        (proxy,) = engine.participants.values()
        assert proxy.is_admitted
        assert len(engine.builtin.writer(ids.SPDP_SECURE_WRITER).behavior.readers) == 1  # type: ignore[union-attr]
    assert [data.topic_name for data in b.engine.known_writers.all()] == [TOPIC]


def test_nothing_is_said_in_clear_but_who_one_is() -> None:
    """Neither a topic's name nor a sample, and of entity submessages in clear only those that must be."""
    domain = Domain()
    wire = Wire(domain)
    a, _, writer, reader = talking(domain, qos=RELIABLE | Qos(partition=Partition("InnerCircle")))
    for size in (100, 20_000):
        writer.write(size)
    a.engine.liveliness.assert_participant(a.now)
    assert domain.run_until(lambda: len(reader.taken) == 2, 2)
    writer.delete()
    a.close()
    domain.run(1)
    for secret in (TOPIC.encode(), b"InnerCircle", bytes(writer.written[1].payload[4:40])):
        assert secret not in wire.all()
    open_writers = set()
    for _, octets in wire.sent:
        for submessage in iterate_submessages(memoryview(octets), start=20):
            if submessage.kind in (SubmessageKind.DATA, SubmessageKind.DATA_FRAG):
                open_writers.add(bytes(submessage.body[8:12]))
            assert submessage.kind not in (SubmessageKind.HEARTBEAT, SubmessageKind.ACKNACK, SubmessageKind.GAP)
    assert open_writers == {ids.SPDP_WRITER, ids.PARTICIPANT_STATELESS_MESSAGE_WRITER}


def test_messages_of_the_handshake_are_addressed_to_one_reader_of_one_participant() -> None:
    domain = Domain()
    wire = Wire(domain)
    a, b, *_ = talking(domain)
    seen = 0
    for sender, octets in wire.sent:
        first, *others = iterate_submessages(memoryview(octets), start=20)
        for submessage in others:
            if submessage.kind == SubmessageKind.DATA_FRAG:  # nothing else is so large and in clear
                seen += 1
                assert bytes(submessage.body[4:12]) == (
                    ids.PARTICIPANT_STATELESS_MESSAGE_READER + ids.PARTICIPANT_STATELESS_MESSAGE_WRITER
                )
                other = b if sender == a.guid.prefix else a
                assert (first.kind, bytes(first.body)) == (SubmessageKind.INFO_DST, other.guid.prefix)
    assert seen >= 4 * 3, "two greetings and two answers, each in several fragments"


@pytest.mark.parametrize("seed", range(50))
def test_loss_delays_but_never_prevents(seed: int) -> None:
    domain = Domain(seed, conditions=LinkConditions(loss=0.2, reordering=0.1, jitter=0.001))
    a, b = node(domain), node(domain)
    there, back = a.writer(TOPIC, RELIABLE), b.writer("Answers", RELIABLE)
    readers = b.reader(TOPIC, RELIABLE), a.reader("Answers", RELIABLE)
    assert domain.run_until(domain.all_matched, 60)
    for number in range(10):
        there.write(3000 if number == 5 else 8)
        back.write()
    assert domain.run_until(lambda: all(len(reader.taken) == 10 for reader in readers), 60)
    for side in (a, b):
        assert side.engine.drops[DropReason.CLEAR_TEXT] == 0
        assert side.engine.drops[DropReason.REJECTED_BY_SECURITY] == 0


def test_three_talk_to_each_other_and_volatile_keys_reach_only_their_own() -> None:
    domain = Domain(conditions=LinkConditions(loss=0.1))
    nodes = [node(domain) for _ in range(3)]
    writers = [one.writer(TOPIC, RELIABLE) for one in nodes]
    readers = [one.reader(TOPIC, RELIABLE) for one in nodes]
    assert domain.run_until(domain.all_matched, 60)
    for writer in writers:
        writer.write()
    assert domain.run_until(lambda: all(len(reader.taken) == 3 for reader in readers), 60)
    for one in nodes:
        assert {local.prefix for _, local in hooks_of(one).keys} == {one.guid.prefix}


def test_an_unprotected_topic_is_announced_on_the_plain_topic_only() -> None:
    domain = Domain()
    wire = Wire(domain)
    _, b, writer, reader = talking(domain, "OpenNews")
    for reader_id, announced in ((ids.SEDP_PUBLICATIONS_READER, 1), (ids.SEDP_PUBLICATIONS_SECURE_READER, 0)):
        local = b.engine.builtin.reader(reader_id)
        assert local is not None
        assert [proxy.last_seq for proxy in local.behavior.writers.values()] == [announced]
    assert b"OpenNews" not in wire.all(), "though its message is protected"
    writer.delete()
    assert domain.run_until(lambda: reader.matched_count == 0, 2)


# --- what is announced ----------------------------------------------------------------------------------------------


def test_exactly_the_secure_endpoints_of_the_announcement_exist() -> None:
    domain = Domain()
    engine = node(domain).engine
    assert engine.discovery.data.builtin_endpoints == ANNOUNCED_ENDPOINTS | SECURE_BITS
    assert {guid[12:] for guid in engine.local_writers} == {topic.writer_id for topic in BUILTIN_TOPICS}
    assert {guid[12:] for guid in engine.local_readers} == {topic.reader_id for topic in BUILTIN_TOPICS}
    plain = domain.node().engine
    assert len(plain.local_writers) == len(plain.local_readers) == 5


def test_the_hooks_are_told_what_is_announced_in_big_endian() -> None:
    domain = Domain()
    a = node(domain)
    before = hooks_of(a).said
    parameters, length = ParameterList.decode(before, little_endian=False)
    assert length == len(before)
    assert parameters.get(ParameterId.PARTICIPANT_GUID) == a.guid
    assert parameters.get(ParameterId.PARTICIPANT_SECURITY_INFO) == b"\x80\0\0\7" + bytes(4)
    assert ParameterId.IDENTITY_STATUS_TOKEN not in [pid for pid, _ in parameters]
    _announce_user_data(a, b"new")
    assert hooks_of(a).said != before


def _announce_user_data(of: Node, octets: bytes) -> None:
    data = of.engine.discovery.data
    of.engine.discovery.announce_change(replace(data, user_data=octets), of.now)
    of.pump()


def test_a_change_is_believed_on_the_secure_topic_alone() -> None:
    """DDS-Security 1.1 §7.4.1.6; there the identity status token is added."""
    domain = Domain()
    a, b, *_ = talking(domain)
    domain.run(1)
    proxy = b.engine.participants[a.guid.prefix]
    assert STATUS_TOKEN in proxy.data.security_parameters
    _forge_spdp(b, a, b"forged")
    assert proxy.data.user_data == b""
    _announce_user_data(a, b"new")
    domain.run(0.1)
    assert proxy.data.user_data == b"new"
    assert [data.user_data for data in hooks_of(b).changed] == [b"", b"new"]
    assert proxy.is_admitted


def _forge_spdp(at: Node, of: Node, user_data: bytes) -> None:
    payload = encode_participant(replace(of.engine.discovery.data, user_data=user_data))
    data = Data(ids.SPDP_READER, ids.SPDP_WRITER, 99, None, payload)
    at.engine.receive_datagram(_message(of, data.encode()), of.port.locator, at.now)
    at.pump()


def _message(of: Node, *submessages: bytes) -> bytes:
    return Header(PROTOCOL_VERSION, b"\1\xdd", of.guid.prefix).encode() + b"".join(submessages)


def test_a_goodbye_is_believed_on_the_secure_topic_alone() -> None:
    sink = MemorySink()
    domain = Domain(trace=sink)
    a, b, _, reader = talking(domain)
    inline = ParameterList([(ParameterId.KEY_HASH, a.guid), (ParameterId.STATUS_INFO, b"\0\0\0\3")])
    forged = Data(ids.SPDP_READER, ids.SPDP_WRITER, 99, inline, b"", is_key=True).encode()
    b.engine.receive_datagram(_message(a, forged), a.port.locator, b.now)
    assert b.engine.drops[DropReason.CLEAR_TEXT] == 1
    assert reader.matched_count == 1
    a.close()
    domain.run(0.1)
    assert b.engine.participants == {}
    assert b.engine.drops[DropReason.CLEAR_TEXT] == 1, "ours was heard on the secure topic first"
    assert [event.reason for event in sink if isinstance(event, ParticipantLost)] == [LossReason.GOODBYE]


def test_a_protected_endpoint_that_is_announced_in_clear_is_not_heard_of() -> None:
    domain = Domain()
    careless, b = node(domain, announces_openly=True), node(domain)
    careless.writer(TOPIC, RELIABLE)
    reader = b.reader(TOPIC, RELIABLE)
    domain.run(3)
    assert reader.matched_count == 0
    assert len(b.engine.known_writers) == 0
    assert b.engine.drops[DropReason.CLEAR_TEXT] == 1


def test_liveliness_is_asserted_where_it_is_protected() -> None:
    domain = Domain()
    qos = RELIABLE | Qos(liveliness=ManualByParticipant(1.0))
    a, b, _, reader = talking(domain, qos=qos)
    open_reader = b.reader("OpenNews", qos)
    a.writer("OpenNews", qos)
    assert domain.run_until(domain.all_matched, 2)
    for _ in range(4):
        domain.run(0.7)
        a.engine.liveliness.assert_participant(a.now)
        a.pump()
    domain.run(0.1)
    assert (reader.local.liveliness.alive_count, open_reader.local.liveliness.alive_count) == (1, 1)
    proxy = b.engine.participants[a.guid.prefix]
    assert proxy.last_protected_assertion == pytest.approx(b.now, abs=0.2)
    # What an insider without the key says on the plain topic keeps only the unprotected one alive.
    for _ in range(4):
        domain.run(0.5)
        a.engine.user_writers(TOPIC)[0].protection = a.engine.user_writers("OpenNews")[0].protection
        a.engine.liveliness.assert_participant(a.now)
        a.pump()
    domain.run(0.1)
    assert (reader.local.liveliness.alive_count, open_reader.local.liveliness.alive_count) == (0, 1)


@pytest.mark.parametrize(
    ("vendor", "is_protected", "lives"),
    [(OUR_VENDOR_ID, True, False), (OUR_VENDOR_ID, False, True), (CYCLONE, True, True)],
)
def test_a_forged_sign_of_life_keeps_no_writer_alive_whose_liveliness_is_protected(
    vendor: VendorId, is_protected: bool, lives: bool
) -> None:
    """Unless governance protects no liveliness at all, or its vendor says so in clear itself."""
    domain = Domain()
    a, b, _, reader = talking(domain, qos=RELIABLE | Qos(liveliness=Automatic(1.0)))
    hooks_of(b).protects_liveliness = is_protected
    proxy = b.engine.participants[a.guid.prefix]
    proxy.data = replace(proxy.data, vendor_id=vendor)
    domain.run(5)
    assert reader.local.liveliness.alive_count == 1, "it says itself that it lives"
    a.kill()
    for _ in range(30):
        domain.run(0.1)
        forged = Header(PROTOCOL_VERSION, vendor, a.guid.prefix).encode()
        b.engine.receive_datagram(forged, a.port.locator, b.now)
        b.pump()
    assert a.guid.prefix in b.engine.participants, "its lease is another matter"
    assert reader.local.liveliness.alive_count == lives


def test_a_writer_whose_liveliness_is_protected_revives_when_its_participant_proves_that_it_lives() -> None:
    domain = Domain()
    _, _, _, reader = talking(domain, qos=RELIABLE | Qos(liveliness=Automatic(1.0)))
    domain.network.conditions = LinkConditions(loss=1.0)
    domain.run(2)
    assert reader.local.liveliness.alive_count == 0
    domain.network.conditions = LinkConditions()
    domain.run(2)
    assert reader.local.liveliness.alive_count == 1


# --- somebody is refused --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda domain: node(domain, issuer=STRANGE_ISSUER), "somebody else vouches for it"),
        (lambda domain: domain.node(), "it has no identity"),
    ],
)
def test_whoever_is_refused_gets_announcements_and_nothing_else(make: Callable[[Domain], Node], reason: str) -> None:
    sink = MemorySink()
    domain = Domain(trace=sink)
    wire = Wire(domain)
    b, intruder = node(domain), make(domain)
    reader, writer = b.reader(TOPIC, RELIABLE), b.writer("Answers", RELIABLE)
    intruder.writer(TOPIC, RELIABLE)
    intruder.reader("Answers", RELIABLE)
    domain.run(60)
    assert (reader.matched_count, writer.matched_count) == (0, 0)
    assert not b.engine.participants[intruder.guid.prefix].is_admitted
    assert b.statuses_of(SecurityRefused) == [SecurityRefused(remote=intruder.guid, reason=reason)]
    assert wire.kinds_by(b) == {SubmessageKind.DATA}, "SPDP alone"
    refusals = [event for event in sink if isinstance(event, SecurityEvent) and event.participant == b.guid.prefix]
    assert [(event.what, event.remote, event.detail) for event in refusals] == [("refused", intruder.guid, reason)]


def test_a_refused_pair_does_not_hold_up_the_others() -> None:
    domain = Domain()
    a, b = node(domain), node(domain)
    forbidden, fine = a.writer("Forbidden", RELIABLE), a.writer(TOPIC, RELIABLE)
    b.reader("Forbidden", RELIABLE)
    reader = b.reader(TOPIC, RELIABLE)
    assert domain.run_until(lambda: reader.matched_count == fine.matched_count == 1, 5)
    domain.run(3)
    assert forbidden.matched_count == 0
    assert SecurityRefused(remote=forbidden.guid, reason="its permissions do not name topic Forbidden") in (
        b.statuses_of(SecurityRefused)
    )


def test_a_builtin_pair_may_be_refused_after_it_was_pending() -> None:
    domain = Domain()
    a, b = node(domain, withholds=True), node(domain)
    domain.run(2)
    local = Guid.of(b.guid.prefix, ids.SEDP_PUBLICATIONS_SECURE_READER)
    remote = Guid.of(a.guid.prefix, ids.SEDP_PUBLICATIONS_SECURE_WRITER)
    hooks_of(b).effects += [Decided(local, remote, Refused("the attributes differ")), Decided(local, remote, ADMITTED)]
    b.pump()
    assert b.engine.local_readers[local].behavior.writers == {}
    assert b.statuses_of(SecurityRefused) == [SecurityRefused(remote=remote, reason="the attributes differ")]


def test_strangers_do_not_displace_whom_security_admitted() -> None:
    """Anybody can invent participants; those that were authenticated stay, though they have announced no endpoint."""
    domain = Domain()
    a = domain.node(make_hooks=XorSecurity, config=Config(max_participants=4))
    friends = [node(domain) for _ in range(2)]
    domain.run(1)
    strangers = [node(domain, issuer=STRANGE_ISSUER) for _ in range(4)]
    domain.run(100)
    known = set(a.engine.participants)
    assert known >= {friend.guid.prefix for friend in friends}
    assert len(known & {stranger.guid.prefix for stranger in strangers}) == 2


# --- somebody waits, comes back, lies -------------------------------------------------------------------------------


def test_a_pair_is_pending_until_the_others_keys_come() -> None:
    domain = Domain()
    a, b = node(domain), node(domain)
    assert domain.run_until(lambda: all(one.engine.participants for one in (a, b)), 2)
    domain.run(1)
    hooks_of(a).withholds = True
    writer, reader = a.writer(TOPIC, RELIABLE | Qos(durability=TransientLocal())), b.reader(TOPIC, RELIABLE)
    writer.write()
    domain.run(3)
    assert (writer.matched_count, reader.matched_count, len(b.engine.known_writers)) == (1, 0, 1)
    hooks_of(a).release()
    a.pump()
    assert domain.run_until(lambda: reader.matched_count == 1, 1)
    writer.write()
    assert domain.run_until(lambda: len(reader.taken) == 1, 5)


def test_secure_discovery_waits_for_its_keys_too() -> None:
    domain = Domain()
    a, b = node(domain, withholds=True), node(domain)
    reader = b.reader(TOPIC, RELIABLE)
    a.writer(TOPIC, RELIABLE)
    domain.run(3)
    assert (len(b.engine.known_writers), b.engine.participants[a.guid.prefix].is_admitted) == (0, True)
    hooks_of(a).release()
    a.pump()
    assert domain.run_until(lambda: reader.matched_count == 1, 3)


@pytest.mark.parametrize("goodbye", [False, True])
def test_a_participant_that_starts_again_is_authenticated_again(goodbye: bool) -> None:
    domain = Domain()
    a, _, _, reader = talking(domain)
    a.restart(goodbye=goodbye)
    writer = a.writer(TOPIC, RELIABLE)
    assert domain.run_until(lambda: writer.matched_count == 1 and writer.guid in reader.local.behavior.writers, 5)
    writer.write()
    assert domain.run_until(lambda: len(reader.taken) == 1, 5)


def _samples(reader: NodeReader) -> list[int]:
    return [change.sequence_number for info, change in reader.taken if info.valid_data]


@pytest.mark.parametrize("loss", [0.0, 0.2])
def test_a_participant_that_starts_again_under_its_guid_begins_anew(loss: float) -> None:
    """Whoever makes its Guid from host and process comes back so in a container; its numbers begin at 1 again."""
    sink = MemorySink()
    domain = Domain(conditions=LinkConditions(loss=loss), trace=sink)
    a, b, writer, reader = talking(domain, qos=LATE)
    back = b.writer("Answers", LATE)
    writer.write()
    back.write()
    assert domain.run_until(lambda: len(reader.taken) == 1, 5)
    guid = a.guid
    a.kill()
    a.start(guid.prefix)
    writer, answers = a.writer(TOPIC, LATE), a.reader("Answers", LATE)
    assert writer.guid == reader.taken[0][1].writer_guid, "which makes it hard"
    for _ in range(3):
        writer.write()
    back.write()
    assert domain.run_until(lambda: len(answers.taken) == 2 and len(_samples(reader)) == 4, 30)
    assert guid.prefix in b.engine.participants
    losses = [event for event in sink if isinstance(event, EndpointLost) and event.participant == b.guid.prefix]
    assert [(event.endpoint, event.reason) for event in losses] == [(writer.guid, LossReason.RESTARTED)]


def test_a_participant_that_was_lost_and_comes_back_is_authenticated_again() -> None:
    domain = Domain()
    a, b, writer, reader = talking(domain)
    domain.network.unplug(a.host)
    assert domain.run_until(lambda: not a.engine.participants and not b.engine.participants, 300)
    assert not hooks_of(b).keys
    assert not hooks_of(b).participant_keys
    domain.network.heal()
    assert domain.run_until(domain.all_matched, 60)
    writer.write()
    assert domain.run_until(lambda: len(reader.taken) == 1, 5)


def test_keys_that_come_after_a_participant_is_lost_match_nothing() -> None:
    domain = Domain()
    a, b = node(domain, withholds=True), node(domain)
    domain.run(1)
    awaited = list(hooks_of(b).pending)
    assert len(awaited) == 12, "both endpoints of the six secure topics with keys of their own"
    a.close()
    domain.network.unplug(a.host)
    assert domain.run_until(lambda: not b.engine.participants, 300)
    hooks_of(b).effects += [Decided(local, remote, ADMITTED) for local, remote in awaited]
    b.pump()
    assert b.engine.remote_writers == {}


def test_a_forged_huge_number_does_not_stop_the_handshake() -> None:
    """RTPS 2.5 §8.4.11: the reader of the stateless topic has no memory that could be poisoned."""
    domain = Domain()
    a, b = node(domain), node(domain)
    domain.network.partition([a.host], [b.host])
    domain.run(1)
    _forge_spdp(b, a, b"")  # so that b knows a, and waits for what it says
    forged = Data(
        ids.PARTICIPANT_STATELESS_MESSAGE_READER,
        ids.PARTICIPANT_STATELESS_MESSAGE_WRITER,
        (1 << 62) - 1,
        None,
        bytes(40),
    ).encode()
    b.engine.receive_datagram(_message(a, forged), a.port.locator, b.now)
    b.pump()
    domain.network.heal()
    a.writer(TOPIC, RELIABLE)
    b.reader(TOPIC, RELIABLE)
    assert domain.run_until(domain.all_matched, 40)
