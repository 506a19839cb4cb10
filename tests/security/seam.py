"""Two secured participants without a core: what the engine would do at the seam, done by hand and step by step."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from random import Random

from ddsi.discovery.parameters import participant_parameters
from ddsi.spi import ADMITTED, Admission, Compute, Decided, LocalParticipant, Octets, Outcome, Revoked, SendMessage
from ddsi.structure.discovered import DiscoveredParticipantData, DiscoveredReaderData, DiscoveredWriterData
from ddsi.structure.guid import EntityId, Guid
from ddsi.structure.qos import EndpointQos
from ddsi_security.local_endpoint import BUILTIN_SECURE_TOPICS
from ddsi_security.service import SecurityService, load

__all__ = ["KEYSTORE", "NOW_NS", "Side", "deliver", "introduce", "match_builtin_topics", "properties_of"]

KEYSTORE = Path(__file__).parent.parent / "captures" / "keystore"
NOW_NS = 1_800_000_000 * 1_000_000_000  # in 2027: what the keystore holds is valid
DOMAIN = 1


def properties_of(identity: str, governance: str = "governance") -> dict[str, str]:
    return {
        "dds.sec.auth.identity_ca": f"file:{KEYSTORE}/identity_ca.pem",
        "dds.sec.auth.identity_certificate": f"file:{KEYSTORE}/{identity}.pem",
        "dds.sec.auth.private_key": f"file:{KEYSTORE}/{identity}.key",
        "dds.sec.access.permissions_ca": f"file:{KEYSTORE}/permissions_ca.pem",
        "dds.sec.access.governance": f"file:{KEYSTORE}/{governance}.p7s",
        "dds.sec.access.permissions": f"file:{KEYSTORE}/{identity}.permissions.p7s",
    }


class Side:
    """One participant: its hooks, what it announces, what was decided, and its messages that are under way."""

    def __init__(
        self,
        identity: str,
        governance: str = "governance",
        *,
        seed: int = 0,
        keys_seed: int = 0,
        extra: Mapping[str, str] | None = None,
    ) -> None:
        """``seed`` decides the Guid; ``keys_seed`` what is drawn after it; ``extra`` are further properties."""
        self.clock_ns = NOW_NS
        properties = {**properties_of(identity, governance), **(extra or {})}
        entropy: Callable[[int], bytes] = Random(f"{identity}{seed} {keys_seed}").randbytes
        self.hooks: SecurityService = load(properties, entropy=entropy, wall_clock=lambda: self.clock_ns)
        candidate = Guid(Random(f"{identity}{seed}").randbytes(12) + EntityId.PARTICIPANT)
        self.guid = self.hooks.local_participant(
            LocalParticipant(guid=candidate, domain_id=DOMAIN, domain_tag="", properties=properties)
        )
        announcement = self.hooks.announcement()
        self.data = DiscoveredParticipantData(
            guid=self.guid,
            builtin_endpoints=announcement.builtin_endpoints,
            security_parameters=announcement.parameters,
        )
        self.hooks.announced(participant_parameters(self.data, little_endian=False).encode())
        self.decided: dict[tuple[Guid, Guid], Admission] = {}
        self.revoked: list[str] = []
        self.under_way: list[SendMessage] = []

    def act(self, now: float = 0.0) -> None:
        """Do what the hooks want done, as the engine would; messages stay :attr:`under_way`."""
        while effects := self.hooks.drain_effects():
            for effect in effects:
                match effect:
                    case SendMessage():
                        self.under_way.append(effect)
                    case Compute():
                        self.hooks.computed(effect, effect.job(), now)
                    case Decided(local, remote, admission):
                        self.decided[(local, remote)] = admission
                    case Revoked(reason):
                        self.revoked.append(reason)

    def endpoint(self, entity_id: EntityId) -> Guid:
        return Guid.of(self.guid.prefix, entity_id)

    def match(self, own: EntityId, other: Side, theirs: EntityId, topic: str = "") -> Admission:
        """What the engine asks before it matches an endpoint of ours with one of the other."""
        kind = DiscoveredWriterData if theirs.is_writer else DiscoveredReaderData
        data = kind(guid=other.endpoint(theirs), topic_name=topic, type_name=topic, qos=EndpointQos())
        admission = self.hooks.match(self.endpoint(own), data)
        self.decided[(self.endpoint(own), other.endpoint(theirs))] = admission
        return admission

    def has_admitted(self, other: Side) -> bool:
        return self.decided.get((self.guid, other.guid)) is ADMITTED

    def protect(self, sender: EntityId, receiver: Guid, submessage: bytes) -> bytes:
        return b"".join(self.hooks.encode_submessage(self.endpoint(sender), (receiver,), (submessage,)))

    def open(self, octets: Octets, source: Side) -> Octets | Outcome:
        """As the engine does: the short way first."""
        prefix = source.guid.prefix
        opened = self.hooks.open_envelope(memoryview(octets), 0, len(octets), prefix)
        return self.hooks.decode_submessage(octets, prefix) if opened is None else opened[0]


def deliver(*sides: Side, dice: Random | None = None, now: float = 0.0) -> None:
    """Until nothing is under way any more; with ``dice`` in any order that they like."""
    for side in sides:
        side.act(now)
    while senders := [side for side in sides if side.under_way]:
        sender = dice.choice(senders) if dice is not None else senders[0]
        message = sender.under_way.pop(dice.randrange(len(sender.under_way)) if dice is not None else 0)
        for receiver in sides:
            if receiver.guid == message.change.destination:
                receiver.hooks.receive_message(message.change, now)
                receiver.act(now)


def introduce(first: Side, second: Side, now: float = 0.0) -> None:
    """Each discovers the other, and they say to each other what there is to say."""
    first.hooks.remote_participant(second.data, now)
    second.hooks.remote_participant(first.data, now)
    deliver(first, second, now=now)


def match_builtin_topics(first: Side, second: Side) -> None:
    """As the engine does once both have admitted each other.  Keys are exchanged by the next :func:`deliver`."""
    for topic in reversed(BUILTIN_SECURE_TOPICS):  # the volatile secure topic before what needs it
        for one, other in ((first, second), (second, first)):
            one.match(topic.writer_id, other, topic.reader_id)
            one.match(topic.reader_id, other, topic.writer_id)
