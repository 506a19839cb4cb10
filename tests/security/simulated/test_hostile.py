"""Somebody on the network who knows everything but the keys: what he repeats, alters, forges or floods changes nothing.

He reads and writes on every host's ports, from an address of his own.  After each attack the honest pair must still
talk, no reader may have anything that its writer did not write, and no table may have grown beyond its bound.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from random import Random

import pytest

from ddsi.discovery.parameters import encode_key, encode_participant
from ddsi.messages.acknack import AckNack
from ddsi.messages.data import Data
from ddsi.messages.gap import Gap
from ddsi.messages.heartbeat import Heartbeat
from ddsi.messages.interpreter import InfoDestination
from ddsi.serialization import ParameterId, ParameterList
from ddsi.simulation import Domain, Node
from ddsi.simulation.endpoints import NodeReader, NodeWriter
from ddsi.simulation.network import Port
from ddsi.structure import builtin_entity_ids as ids
from ddsi.structure.cache_change import CacheChange, ChangeKind
from ddsi.structure.guid import EntityId, Guid, GuidPrefix
from ddsi.structure.locator import Locator
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import KeepAll, Properties, Reliable, TransientLocal
from ddsi.structure.sequence_number import NumberSet
from ddsi.trace.reasons import DropReason
from ddsi_security.generic_message import read_generic_message, write_generic_message
from ddsi_security.tokens import DataHolder

from .keystores import make_identities

RELIABLE = Qos(reliability=Reliable(), history=KeepAll(), durability=TransientLocal())
GOVERNANCES = ("encrypt", "origin", "sign", "submessage", "message")
HUGE = 1 << 40


class Scene:
    """Alice writes and Bob reads; the intruder has recorded everything from the first announcement on."""

    def __init__(self, identities: list[Properties]) -> None:
        self.domain = Domain(3)
        self.recorded: list[tuple[GuidPrefix, bytes]] = []
        self.domain.network.watch = lambda owner, octets: self.recorded.append((owner, octets))
        self.alice: Node = self.domain.node(properties=identities[0])
        self.bob: Node = self.domain.node(properties=identities[1])
        self.writer: NodeWriter = self.alice.writer("Square", RELIABLE)
        self.reader: NodeReader = self.bob.reader("Square", RELIABLE)
        self.written: list[CacheChange] = []
        self.port = Port(Locator.udp_v4("10.9.9.9", 7999), GuidPrefix(b"\x01\xdd" + b"\x66" * 10), lambda *_: None)
        self.domain.network.open(self.port)
        self.talk()
        self.before = list(self.recorded)

    def inject(self, octets: bytes) -> None:
        """To every port of both."""
        for node in (self.alice, self.bob):
            for port in (node.port, node._user_port):
                self.domain.network.send(self.port, [port.locator], octets)

    def talk(self, count: int = 3) -> None:
        """Honest samples, which arrive once, in order, and with nothing between them."""
        for _ in range(count):
            change = self.writer.write(100)
            assert change is not None
            self.written.append(change)
        assert self.domain.run_until(lambda: len(self.reader.taken) >= len(self.written), 30.0)
        self.domain.run(1.0)
        received = [bytes(change.payload) for _, change in self.reader.taken]
        assert [octets[:100] for octets in received] == [bytes(change.payload)[:100] for change in self.written]
        assert self.reader.local.lost.total_count == 0

    def unmoved(self) -> None:
        """Each still knows the other and nobody else, and their tables are as small as they were."""
        for node in (self.alice, self.bob):
            engine = node.engine
            assert [proxy.is_admitted for proxy in engine.participants.values()].count(True) == 1
            assert engine.stateless_defrag_budget.octets <= 4 << 20
            assert engine.defrag_budget.octets <= 1 << 20


@pytest.fixture(scope="module")
def identities(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Properties]]:
    folder: Path = tmp_path_factory.mktemp("keystores")
    return {name: make_identities(folder / name, name) for name in GOVERNANCES}


@pytest.fixture(params=GOVERNANCES)
def scene(request: pytest.FixtureRequest, identities: dict[str, list[Properties]]) -> Scene:
    return Scene(identities[request.param])


def message(prefix: GuidPrefix, *submessages: bytes) -> bytes:
    return b"RTPS\x02\x04\x01\xdd" + prefix + b"".join(submessages)


def test_a_forged_end_of_an_instance_is_not_believed_where_only_payloads_are_protected(tmp_path: Path) -> None:
    """All else of such a DATA is in clear, so the key hash that anybody can read must not be enough."""
    alice_properties, bob_properties, _ = make_identities(tmp_path / "keystore", "payload")
    domain = Domain(3)
    alice, bob = domain.node(properties=alice_properties), domain.node(properties=bob_properties)
    writer = alice.writer("Square", RELIABLE, keyed=True)
    reader = bob.reader("Square", RELIABLE, keyed=True)
    assert domain.run_until(domain.all_matched, 30.0)
    writer.write(100, key=7)
    assert domain.run_until(lambda: len(reader.taken) == 1, 5.0)
    keys = reader.local.keys
    assert keys is not None
    inline = ParameterList(
        [
            (ParameterId.KEY_HASH, keys.to_key_hash(reader.taken[0][1].key)),
            (ParameterId.STATUS_INFO, bytes((0, 0, 0, ChangeKind.NOT_ALIVE_DISPOSED))),
        ]
    )
    forged = Data(EntityId.UNKNOWN, writer.guid.entity_id, 2, inline, b"")
    intruder = Port(Locator.udp_v4("10.9.9.9", 7999), GuidPrefix(b"\x01\xdd" + b"\x66" * 10), lambda *_: None)
    domain.network.open(intruder)
    for port in (bob.port, bob._user_port):
        domain.network.send(intruder, [port.locator], message(alice.guid.prefix, forged.encode()))
    domain.run(1.0)
    assert bob.engine.drops[DropReason.REJECTED_BY_SECURITY] > 0
    assert [change.kind for _, change in reader.taken] == [ChangeKind.ALIVE]
    for _ in range(2):  # the forged one had the number of the first; a GAP could have taken that from it as well
        writer.end(ChangeKind.NOT_ALIVE_DISPOSED, key=7)
    domain.run(5.0)
    assert [change.kind for _, change in reader.taken] == [ChangeKind.ALIVE, ChangeKind.NOT_ALIVE_DISPOSED]


# --- what was sent before -------------------------------------------------------------------------------------------


def test_everything_again(scene: Scene) -> None:
    for _, octets in scene.before:
        scene.inject(octets)
    scene.talk()
    scene.unmoved()


def test_everything_again_in_any_order_while_they_talk(scene: Scene) -> None:
    dice = Random(1)
    for _ in range(300):
        scene.inject(dice.choice(scene.before)[1])
        if dice.random() < 0.05:
            scene.talk(1)
    scene.talk()
    scene.unmoved()


def _flipped(octets: bytes, dice: Random) -> bytes:
    changed = bytearray(octets)
    for _ in range(dice.randrange(1, 4)):
        changed[dice.randrange(len(changed))] ^= 1 << dice.randrange(8)
    return bytes(changed)


def _cut(octets: bytes, dice: Random) -> bytes:
    return octets[: dice.randrange(len(octets) + 1)]


def _spliced(octets: bytes, dice: Random, others: list[bytes]) -> bytes:
    """The first submessages of one message behind the header of another, cut at any multiple of four."""
    other = dice.choice(others)
    at, to = (4 * dice.randrange(5, len(one) // 4 + 1) for one in (octets, other))
    return octets[:at] + other[to:]


def test_everything_altered_cut_and_spliced(scene: Scene) -> None:
    dice = Random(2)
    others = [octets for _, octets in scene.before]
    for _ in range(1500):
        octets = dice.choice(others)
        kind = dice.randrange(3)
        scene.inject((_flipped(octets, dice), _cut(octets, dice), _spliced(octets, dice, others))[kind])
        if dice.random() < 0.01:
            scene.domain.run(0.01)
    scene.talk()
    scene.unmoved()


# --- what nobody sent -----------------------------------------------------------------------------------------------

_WRITERS_AND_READERS = (
    (ids.SEDP_PUBLICATIONS_WRITER, ids.SEDP_PUBLICATIONS_READER),
    (ids.SEDP_SUBSCRIPTIONS_WRITER, ids.SEDP_SUBSCRIPTIONS_READER),
    (ids.PARTICIPANT_MESSAGE_WRITER, ids.PARTICIPANT_MESSAGE_READER),
    (ids.SEDP_PUBLICATIONS_SECURE_WRITER, ids.SEDP_PUBLICATIONS_SECURE_READER),
    (ids.SEDP_SUBSCRIPTIONS_SECURE_WRITER, ids.SEDP_SUBSCRIPTIONS_SECURE_READER),
    (ids.SPDP_SECURE_WRITER, ids.SPDP_SECURE_READER),
    (ids.PARTICIPANT_MESSAGE_SECURE_WRITER, ids.PARTICIPANT_MESSAGE_SECURE_READER),
    (ids.PARTICIPANT_VOLATILE_MESSAGE_SECURE_WRITER, ids.PARTICIPANT_VOLATILE_MESSAGE_SECURE_READER),
)


def _forgeries(sender: Node, receiver: Node, pairs: list[tuple[EntityId, EntityId]]) -> Iterator[bytes]:
    """In clear, in the name of ``sender``: new data, "all before this is gone", "I have all of it"."""
    destination = InfoDestination(receiver.guid.prefix).encode()
    for writer, reader in pairs:
        for number in (1, 2, 50, HUGE):
            payload = b"\0\1\0\0" + b"\x42" * 96
            yield message(sender.guid.prefix, destination, Data(reader, writer, number, None, payload).encode())
            yield message(
                sender.guid.prefix, destination, Heartbeat(reader, writer, number, number, number & 0xFFFF).encode()
            )
            yield message(sender.guid.prefix, destination, Gap(reader, writer, 1, NumberSet(number + 1)).encode())
            yield message(sender.guid.prefix, destination, AckNack(reader, writer, NumberSet(number), 99).encode())


def test_forged_submessages_in_clear(scene: Scene) -> None:
    user = (scene.writer.guid.entity_id, scene.reader.guid.entity_id)
    for sender, receiver in ((scene.alice, scene.bob), (scene.bob, scene.alice)):
        pairs = [user, *_WRITERS_AND_READERS]
        if not sender.engine.hooks.announcement().parameters[2][1][0] & 1:  # messages are not protected
            pairs = [pair for pair in pairs if pair[0] not in [plain for plain, _ in _WRITERS_AND_READERS[:3]]]
        for octets in _forgeries(sender, receiver, pairs):
            scene.inject(octets)
        scene.domain.run(0.2)
    scene.talk()
    scene.unmoved()


def test_forged_announcements_and_goodbyes(scene: Scene) -> None:
    """SPDP in clear is anybody's; of an authenticated participant it shows only that something lives."""
    for node in (scene.alice, scene.bob):
        data = node.engine.discovery.data
        moved = (Locator.udp_v4("10.6.6.6", 7411),)
        for forged in (
            replace(data, metatraffic_unicast=moved, default_unicast=moved),
            replace(data, security_parameters=()),
            replace(data, lease_duration=0.01),
            replace(data, domain_tag="elsewhere"),
        ):
            sample = Data(ids.SPDP_READER, ids.SPDP_WRITER, HUGE, None, encode_participant(forged))
            scene.inject(message(node.guid.prefix, sample.encode()))
        gone = ParameterList([(ParameterId.KEY_HASH, node.guid), (ParameterId.STATUS_INFO, b"\0\0\0\3")])
        key = encode_key(node.guid, ParameterId.PARTICIPANT_GUID)
        goodbye = Data(ids.SPDP_READER, ids.SPDP_WRITER, HUGE + 1, gone, key, is_key=True)
        scene.inject(message(node.guid.prefix, goodbye.encode()))
    scene.domain.run(1.0)
    for node, other in ((scene.alice, scene.bob), (scene.bob, scene.alice)):
        proxy = node.engine.participants[other.guid.prefix]
        assert proxy.data.metatraffic_unicast == other.engine.discovery.data.metatraffic_unicast
    scene.talk()
    scene.unmoved()


def _handshake_tokens(scene: Scene) -> Iterator[tuple[GuidPrefix, bytes, bytes]]:
    """Sender, stateless writer's message before its payload, and the payload, of each handshake message in sight."""
    for _, octets in scene.before:
        position = octets.find(ids.PARTICIPANT_STATELESS_MESSAGE_READER + ids.PARTICIPANT_STATELESS_MESSAGE_WRITER)
        start = octets.find(b"\0\1\0\0", position) if position >= 0 else -1
        if start >= 0 and b"dds.sec.auth" in octets[start:]:
            yield GuidPrefix(octets[8:20]), octets[:start], octets[start:]


def _with_property(payload: bytes, name: str, change: Callable[[bytes], bytes]) -> bytes:
    read = read_generic_message(payload)
    token = read.message_data[0]
    properties = tuple((key, change(value) if key == name else value) for key, value in token.binary_properties)
    changed = DataHolder(token.class_id, token.properties, properties)
    return write_generic_message(replace(read, message_data=(changed,)))


def test_handshakes_with_a_stolen_certificate(identities: dict[str, list[Properties]]) -> None:
    """Certificates and permissions cross in clear; without the key they are worth nothing."""
    scene = Scene(identities["encrypt"])
    seen = 0
    for prefix, _, payload in list(_handshake_tokens(scene)):
        try:
            names = [name for name, _ in read_generic_message(payload).message_data[0].binary_properties]
        except Exception:
            continue  # the rest of it is in other fragments
        for number, name in enumerate(names):
            seen += 1
            forged = _with_property(payload, name, lambda value: bytes((value[0] ^ 1,)) + value[1:] if value else b"x")
            data = Data(
                ids.PARTICIPANT_STATELESS_MESSAGE_READER,
                ids.PARTICIPANT_STATELESS_MESSAGE_WRITER,
                HUGE + number,
                None,
                forged,
            )
            scene.inject(message(prefix, data.encode()))
            scene.domain.run(0.05)
    assert seen > 3
    scene.talk()
    scene.unmoved()


# --- too much of everything -----------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_flood_of_participants_that_want_to_be_authenticated(identities: dict[str, list[Properties]]) -> None:
    scene = Scene(identities["encrypt"])
    data = scene.alice.engine.discovery.data
    dice = Random(4)
    for _ in range(3000):
        prefix = GuidPrefix(dice.randbytes(12))
        where = (Locator.udp_v4("10.9.9.9", 7999),)
        stranger = replace(
            data, guid=Guid.of(prefix, EntityId.PARTICIPANT), metatraffic_unicast=where, default_unicast=where
        )
        sample = Data(ids.SPDP_READER, ids.SPDP_WRITER, 1, None, encode_participant(stranger))
        scene.domain.network.send(scene.port, [scene.bob.port.locator], message(prefix, sample.encode()))
        scene.domain.run(0.001)
    engine = scene.bob.engine
    assert len(engine.participants) <= engine.config.max_participants
    assert len(engine.hooks._remotes) <= engine.config.max_participants  # type: ignore[attr-defined]
    scene.talk()


def test_a_flood_of_handshake_fragments(identities: dict[str, list[Properties]]) -> None:
    scene = Scene(identities["encrypt"])
    dice = Random(5)
    first, writer = ids.PARTICIPANT_STATELESS_MESSAGE_READER, ids.PARTICIPANT_STATELESS_MESSAGE_WRITER
    for number in range(1, 3000):
        body = first + writer + (0).to_bytes(4, "little") + number.to_bytes(4, "little")
        body += (1).to_bytes(4, "little") + (1).to_bytes(2, "little") + (1300).to_bytes(2, "little")
        body += (60_000).to_bytes(4, "little") + dice.randbytes(1300)
        fragment = b"\x16\x01" + (len(body) + 4).to_bytes(2, "little") + b"\0\0\x1c\0" + body
        scene.domain.network.send(scene.port, [scene.bob.port.locator], message(scene.alice.guid.prefix, fragment))
    assert scene.bob.engine.stateless_defrag_budget.octets <= 4 << 20
    scene.talk()
    scene.unmoved()


def test_nothing_is_left_of_key_messages_kept_for_nobody(scene: Scene) -> None:
    """Replayed key messages are old news to the volatile topic."""
    volatile = bytes(ids.PARTICIPANT_VOLATILE_MESSAGE_SECURE_WRITER)
    assert not any(volatile in octets[20:] for _, octets in scene.before), "its submessages are never in clear"
    assert not scene.bob.engine.hooks._remotes[scene.alice.guid.prefix].early  # type: ignore[attr-defined]
