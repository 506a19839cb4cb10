"""How a submessage arrived decides whether it is acted upon, and nobody borrows another's protection."""

from __future__ import annotations

from hashlib import md5

import pytest

from ddsi.engine import Participant
from ddsi.messages.acknack import AckNack, NackFrag
from ddsi.messages.data import Data
from ddsi.messages.data_frag import DataFrag
from ddsi.messages.gap import Gap
from ddsi.messages.heartbeat import Heartbeat, HeartbeatFrag
from ddsi.messages.interpreter import InfoSource
from ddsi.serialization.parameter_id import ParameterId
from ddsi.serialization.parameter_list import ParameterList
from ddsi.simulation.endpoints import SIMULATED_KEYS
from ddsi.spi import Octets, Outcome, ProtectedEndpoint, Protection
from ddsi.spi.plaintext import Plaintext
from ddsi.structure import builtin_entity_ids as ids
from ddsi.structure.cache_change import ChangeKind
from ddsi.structure.discovered import DiscoveredReaderData
from ddsi.structure.guid import EntityId, Guid
from ddsi.structure.qos import Qos, reader_qos, writer_qos
from ddsi.structure.qos_policies import ManualByTopic, Reliable
from ddsi.structure.sequence_number import NumberSet
from ddsi.structure.vendor import PROTOCOL_VERSION
from ddsi.trace.reasons import DropReason

from .wire import Stranger, engine

RELIABLE = Qos(reliability=Reliable())
WRITER, READER = EntityId(b"\0\0\1\3"), EntityId(b"\0\0\1\4")
SRTPS_PREFIX, SEC_PREFIX, SEC_POSTFIX = b"\x33\x01\4\0mark", b"\x31\x01\4\0mark", b"\x32\x01\4\0mark"


class Wrapped(Plaintext):
    """Marks stand for protection; what was asked is written down, and answered by ``answer``."""

    def __init__(self) -> None:
        self.asked: list[tuple[Guid, Protection]] = []
        self.answer = True
        self.content: bytes | None = None  # of every envelope, whatever it seems to hold

    def decode_message(self, message: Octets, source: bytes) -> Octets | Outcome:
        return bytes(message[:20]) + bytes(message[28:])

    def decode_submessage(self, protected: Octets, source: bytes) -> Octets | Outcome:
        return bytes(protected[8:-8]) if self.content is None else self.content

    def admits(self, sender: bytes, protection: int) -> bool:
        self.asked.append((Guid(sender), Protection(protection)))
        return self.answer


def envelope(*submessages: bytes) -> bytes:
    return SEC_PREFIX + b"".join(submessages) + SEC_POSTFIX


def protected(message: bytes) -> bytes:
    return message[:20] + SRTPS_PREFIX + message[20:]


def info_source(of: Stranger) -> bytes:
    return InfoSource(PROTOCOL_VERSION, b"\x01\x55", of.prefix).encode()


def matched() -> tuple[Participant, Wrapped, Stranger]:
    """A participant with a reliable writer and reader, and a stranger that has both too, all matched."""
    hooks = Wrapped()
    here, there = engine(hooks=hooks), Stranger()
    here.create_reader("Square", "T", reader_qos(RELIABLE), 0.0, is_keyed=False)
    here.create_writer("Circle", "T", writer_qos(RELIABLE), 0.0, is_keyed=False)
    there.introduce(here)
    lively = Qos(reliability=Reliable(), liveliness=ManualByTopic(1.0))
    here.receive_datagram(there.sedp_writer(qos=lively), there.address, 0.0)
    here.receive_datagram(there.sedp_reader(topic="Circle", qos=RELIABLE), there.address, 0.0)
    here.drain_effects()
    hooks.asked.clear()
    return here, hooks, there


def submessages(here: Participant) -> dict[str, bytes]:
    (our_writer,) = here.user_writers()
    one = NumberSet.of(1, [1])
    return {
        "DATA": Data(READER, WRITER, 1, None, b"\0\1\0\0abcd").encode(),
        "DATA with inline QoS": Data(
            READER, WRITER, 1, ParameterList([(ParameterId.STATUS_INFO, bytes(4))]), b"\0\1\0\0abcd"
        ).encode(),
        "DATA_FRAG": DataFrag(READER, WRITER, 1, 1, 1, 8, 16, None, b"\0\1\0\0abcd").encode(),
        "HEARTBEAT": Heartbeat(READER, WRITER, 1, 5, 1, final=False, liveliness=True).encode(),
        "HEARTBEAT_FRAG": HeartbeatFrag(READER, WRITER, 1, 1, 1).encode(),
        "GAP": Gap(READER, WRITER, 1, NumberSet(3)).encode(),
        "ACKNACK": AckNack(READER, our_writer.guid.entity_id, one, 1, final=False).encode(),
        "NACK_FRAG": NackFrag(READER, our_writer.guid.entity_id, 1, one, 1).encode(),
    }


KINDS = list(submessages(matched()[0]))


@pytest.mark.parametrize("kind", KINDS)
def test_every_submessage_of_an_endpoint_is_asked_about_once_with_how_it_came(kind: str) -> None:
    here, hooks, there = matched()
    octets = submessages(here)[kind]
    sender = Guid.of(there.prefix, READER if "ACK" in kind else WRITER)
    both = Protection.MESSAGE | Protection.SUBMESSAGE
    for datagram, protection in (
        (there.message(octets), Protection.NONE),
        (there.message(envelope(octets)), Protection.SUBMESSAGE),
        (protected(there.message(octets)), Protection.MESSAGE),
        (protected(there.message(envelope(octets))), both),
        (protected(there.message(envelope(), octets)), Protection.MESSAGE),
        (there.message(envelope(), octets), Protection.NONE),
    ):
        hooks.asked.clear()
        here.receive_datagram(datagram, there.address, 0.0)
        assert hooks.asked == [(sender, protection)]


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_not_admitted_changes_nothing_and_is_counted(kind: str) -> None:
    here, hooks, there = matched()
    (reader,), (writer,) = here.user_readers(), here.user_writers()
    here.handle_timeout(5.0)  # the stranger's writer has not asserted its liveliness
    here.receive_datagram(there.message(), there.address, 5.0)
    here.drain_effects()
    assert (reader.liveliness.alive_count, reader.liveliness.not_alive_count) == (0, 1)
    hooks.answer = False
    here.receive_datagram(there.message(submessages(here)[kind]), there.address, 5.0)
    assert here.drops[DropReason.CLEAR_TEXT] == 1
    (proxy,) = reader.behavior.writers.values()
    (reader_proxy,) = writer.behavior.readers.values()
    assert (proxy.last_seq, proxy.next_sn, reader_proxy.acked_sn) == (0, 1, 0)
    assert reader.liveliness.alive_count == 0
    assert here.drain_effects() == []


def test_protection_does_not_cover_what_is_said_for_somebody_else() -> None:
    """A participant whose messages we can check sends one in which INFO_SRC names another."""
    here, hooks, there = matched()
    insider = Stranger(2)
    data = submessages(here)["DATA"]
    for forged in (
        protected(insider.message(info_source(there), data)),
        protected(insider.message(info_source(there), info_source(insider), info_source(there), data)),
        protected(insider.message(info_source(there), envelope(), data)),
    ):
        hooks.asked.clear()
        here.receive_datagram(forged, insider.address, 0.0)
        assert hooks.asked == [(Guid.of(there.prefix, WRITER), Protection.NONE)]
    hooks.asked.clear()
    here.receive_datagram(protected(there.message(info_source(there), data)), there.address, 0.0)
    assert hooks.asked == [(Guid.of(there.prefix, WRITER), Protection.MESSAGE)]


def test_an_envelope_holds_neither_another_source_nor_another_envelope() -> None:
    here, hooks, there = matched()
    data = submessages(here)["DATA"]
    for hooks.content in (info_source(Stranger(2)) + data, envelope(data)):
        here.receive_datagram(there.message(envelope()), there.address, 0.0)
    assert here.drops[DropReason.MALFORMED_MESSAGE] == 2
    assert hooks.asked == []


def test_spdp_in_clear_of_a_known_participant_only_shows_that_it_lives() -> None:
    """DDS-Security 1.1 §7.4.1.6: once authenticated, it changes and goes by the secure topic alone."""
    here, hooks, there = matched()
    hooks.answer = False
    here.receive_datagram(there.spdp(user_data=b"new"), there.address, 15.0)
    here.receive_datagram(there.goodbye(), there.address, 15.0)
    assert hooks.asked == [(Guid.of(there.prefix, ids.SPDP_WRITER), Protection.NONE)] * 2
    assert here.participants[there.prefix].data.user_data == b""
    assert here.drops == {DropReason.CLEAR_TEXT: 1}  # the goodbye
    here.handle_timeout(34.9)
    assert there.prefix in here.participants, "its lease of 20 s was renewed"
    here.handle_timeout(35.1)
    assert there.prefix not in here.participants


def test_spdp_of_a_participant_that_is_not_known_is_not_asked_about() -> None:
    hooks = Wrapped()
    hooks.answer = False
    here, there = engine(hooks=hooks), Stranger()
    here.receive_datagram(there.spdp(), there.address, 0.0)
    assert there.prefix in here.participants
    assert hooks.asked == []


class Authenticated(Wrapped):
    """The participant may not say in clear that it changed; its endpoints may speak in clear."""

    def admits(self, sender: bytes, protection: int) -> bool:
        return sender[12:] != ids.SPDP_WRITER


@pytest.mark.parametrize("is_authenticated", [False, True])
def test_an_authenticated_participant_does_not_begin_anew_by_heartbeats_in_clear(is_authenticated: bool) -> None:
    """Nor by protected ones: HEARTBEATs of its past can be sent again by anybody."""
    here, _, there = matched()
    if is_authenticated:
        here.inbound._hooks = Authenticated()
    participant, (reader,) = here.participants[there.prefix], here.user_readers()
    (before,) = reader.behavior.writers.values()
    here.receive_datagram(there.message(Gap(READER, WRITER, 1, NumberSet(50)).encode()), there.address, 0.0)
    for count in range(1, 5):
        beat = Heartbeat(EntityId.UNKNOWN, WRITER, 1, 1, count, final=True).encode()
        here.receive_datagram(there.message(beat), there.address, 0.1 * count)
    assert (here.participants[there.prefix] is participant) is is_authenticated
    if is_authenticated:
        assert list(reader.behavior.writers.values()) == [before]
        assert before.next_sn == 50, "what it told before still holds"


@pytest.mark.parametrize(("is_hidden", "key_hash"), [(False, b"\7".ljust(16, b"\0")), (True, md5(b"\7").digest())])
def test_where_keys_are_hidden_a_key_hash_is_looked_up_and_never_read(is_hidden: bool, key_hash: bytes) -> None:
    """DDS-Security 1.1 §8.4.2.7: Fast DDS disposes with a key hash alone, which is a digest then."""

    class Hiding(Wrapped):
        def local_reader(self, data: DiscoveredReaderData) -> ProtectedEndpoint:
            return ProtectedEndpoint(key_protected=is_hidden)

    here, there = engine(hooks=Hiding()), Stranger()
    remote = there.endpoint(1, is_writer=True, keyed=True)
    reader = here.create_reader("Square", "T", reader_qos(RELIABLE), 0.0, is_keyed=True, keys=SIMULATED_KEYS)
    there.introduce(here)
    here.receive_datagram(there.sedp_writer(qos=RELIABLE, of=remote), there.address, 0.0)
    pair = (reader.guid.entity_id, remote.entity_id)
    inline = ParameterList([(ParameterId.KEY_HASH, key_hash), (ParameterId.STATUS_INFO, b"\0\0\0\1")])
    for submessage in (
        Heartbeat(*pair, 1, 0, 1, final=True).encode(),
        Data(*pair, 1, None, b"\0\1\0\0\7").encode(),
        Data(*pair, 2, inline).encode(),
    ):
        here.receive_datagram(there.message(submessage), there.address, 0.0)
    assert reader.history is not None
    taken = [(change.kind, change.key) for _, change in reader.history.take()]
    assert taken == [(ChangeKind.ALIVE, b"\7"), (ChangeKind.NOT_ALIVE_DISPOSED, b"\7")]
