"""Targets of the secured engine: messages of a handshake and of a key exchange in each state, and a whole session.

The session's keys follow from a seed (``session``), so that what was recorded of it opens again.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from itertools import islice

from ddsi.spi import ADMITTED, Outcome, Refused
from ddsi.structure.builtin_entity_ids import PARTICIPANT_STATELESS_MESSAGE_WRITER as STATELESS
from ddsi.structure.builtin_entity_ids import PARTICIPANT_VOLATILE_MESSAGE_SECURE_WRITER as VOLATILE
from ddsi.structure.cache_change import CacheChange, ChangeKind
from ddsi.structure.guid import EntityId
from tests.fuzz.session import Ear, Session, recorded
from tests.fuzz.target import ACCEPTED, Target, verdict
from tests.security.seam import Side, match_builtin_topics

__all__ = ["SECURED_TARGETS", "said_to_bob"]


# --- messages between the two services ------------------------------------------------------------------------------


def security_message(octets: bytes) -> str:
    """The first octet says how many of Alice's messages came before, the second on which topic this one comes."""
    before = octets[0] % (len(said_to_bob()) + 1) if octets else 0
    writer_id = VOLATILE if octets[1:2] > b"\x7f" else STATELESS
    alice, bob = Side("alice"), Side("bob")
    _introduce(alice, bob)
    for known_id, payload in islice(said_to_bob(), before):
        _hear(bob, alice, known_id, payload)
        _match_if_admitted(alice, bob)
    bob.under_way.clear()
    state, decided = bob.hooks.handshake_state(alice.guid.prefix), bob.decided.copy()
    outcome = _hear(bob, alice, writer_id, octets[2:])
    assert bob.hooks.next_deadline() >= 0
    refusals = [
        made for pair, made in bob.decided.items() if decided.get(pair) is not made and isinstance(made, Refused)
    ]
    if refusals:
        return verdict(lambda: refusals[0])
    if outcome is not None:
        return verdict(lambda: outcome)
    has_moved = bob.hooks.handshake_state(alice.guid.prefix) is not state or bob.decided != decided
    return ACCEPTED if has_moved or bob.under_way else "ignored: nothing has changed"


@cache
def said_to_bob() -> tuple[tuple[EntityId, bytes], ...]:
    """All that Alice tells Bob until both have each other's keys: by which writer, and what."""
    alice, bob = Side("alice"), Side("bob")
    _introduce(alice, bob)
    said: list[tuple[EntityId, bytes]] = []
    while alice.under_way or bob.under_way:
        for sender, receiver in ((alice, bob), (bob, alice)):
            under_way, sender.under_way = sender.under_way, []
            for message in under_way:
                if sender is alice:
                    said.append((message.writer, bytes(message.change.payload)))
                _hear(receiver, sender, message.writer, bytes(message.change.payload))
            _match_if_admitted(alice, bob)
    return tuple(said)


def _introduce(alice: Side, bob: Side) -> None:
    for one, other in ((alice, bob), (bob, alice)):
        one.hooks.remote_participant(other.data, 0.0)
        one.act()


def _hear(receiver: Side, sender: Side, writer_id: EntityId, payload: bytes) -> Outcome | None:
    change = CacheChange(ChangeKind.ALIVE, sender.endpoint(writer_id), 1, payload, destination=receiver.guid)
    outcome = receiver.hooks.receive_message(change, 0.0)
    receiver.act()
    return outcome


def _match_if_admitted(alice: Side, bob: Side) -> None:
    """As the engine does it."""
    if bob.has_admitted(alice) and (bob.endpoint(VOLATILE), alice.endpoint(VOLATILE)) not in bob.decided:
        bob.decided[(bob.endpoint(VOLATILE), alice.endpoint(VOLATILE))] = ADMITTED
        match_builtin_topics(alice, bob)
        alice.act()
        bob.act()


def security_messages() -> Iterator[bytes]:
    """The true ones, each when its time has come."""
    for number, (writer_id, payload) in enumerate(said_to_bob()):
        yield bytes([number, 0xFF if writer_id == VOLATILE else 0]) + payload


# --- a whole engine -------------------------------------------------------------------------------------------------

MOST_DATAGRAMS = 16
MOST_USES = 100


class Standing:
    """A session whose last word is said.  It is used again as long as nothing has moved: to make one takes long."""

    kept: Standing | None = None

    def __init__(self) -> None:
        self.session = Session.make()
        self.ear = Ear(self.session.bob.engine)
        self.uses = 0
        (self.reader,) = self.session.bob.readers
        self.written = [bytes(change.payload) for change in self.session.alice.writers[0].written.values()]
        self.position = self.where()

    @classmethod
    def one(cls) -> Standing:
        found, cls.kept = cls.kept or cls(), None
        found.uses += 1
        return found

    def hear(self, octets: bytes) -> None:
        self.ear.hear(octets, self.session.alice.port.locator)

    def where(self) -> object:
        """Everything that a datagram may have changed, but for timers."""
        engine = self.ear.engine
        return (
            [(prefix, proxy.is_admitted, proxy.refusal) for prefix, proxy in engine.participants.items()],
            [(guid, len(remote.defragmenter)) for guid, remote in engine.remote_writers.items()],
            [
                (proxy.guid, proxy.next_sn, proxy.last_seq, len(proxy.reorder), proxy.contradictions)
                for reader in engine.local_readers.values()
                for proxy in reader.behavior.writers.values()
            ],
            [
                (proxy.guid, proxy.acked_sn, proxy.lst_seq)
                for writer in engine.local_writers.values()
                for proxy in writer.behavior.readers.values()
            ],
        )

    def put_back(self) -> None:
        if self.uses < MOST_USES and self.where() == self.position:
            Standing.kept = self


def secured_conversation(octets: bytes) -> str:
    """Datagrams, each up to the next "RTPS", to Bob's engine that has read all that Alice wrote; and what follows."""
    bob = Standing.one()
    bob.hear(recorded()[0])  # Alice lives
    engine = bob.ear.engine
    drops = engine.drops.total()
    for piece in octets.removeprefix(b"RTPS").split(b"RTPS", MOST_DATAGRAMS):
        bob.hear(b"RTPS" + piece)
    bob.ear.wait(1)
    assert engine.participants[recorded()[0][8:20]].is_admitted
    taken = [bytes(change.payload) for _, change in [*bob.reader.taken, *bob.reader.history.read()]]
    true = zip(taken, bob.written, strict=True)
    assert all(found.startswith(payload) for found, payload in true), "nobody else can write"
    assert len(engine.participants) <= MOST_DATAGRAMS + 1
    answer = "dropped" if engine.drops.total() > drops else ACCEPTED
    bob.put_back()
    return answer


def secured_conversations() -> Iterator[bytes]:
    """What Alice said, from the first announcement to the last sample."""
    said = recorded()
    for start in range(0, len(said), 6):
        yield b"".join(said[start : start + 3])


SECURED_TARGETS = {
    "security_message": Target(security_message, security_messages, 4096, enormous=1 << 20),
    "secured_conversation": Target(secured_conversation, secured_conversations, 4096, enormous=60_000),
}
