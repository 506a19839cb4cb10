"""Messages as strangers send them: for tests in which nobody but the engine under test is real."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

from ddsi.config import Config
from ddsi.discovery.builtin_endpoints import ANNOUNCED_ENDPOINTS
from ddsi.discovery.parameters import encode_key, encode_participant, encode_reader, encode_writer
from ddsi.engine import Participant, ParticipantSetup, SendDatagram
from ddsi.messages.data import Data
from ddsi.messages.header import Header
from ddsi.messages.heartbeat import Heartbeat
from ddsi.messages.interpreter import InfoDestination
from ddsi.serialization.parameter_id import ParameterId
from ddsi.serialization.parameter_list import ParameterList
from ddsi.spi import PLAINTEXT, SecurityHooks
from ddsi.structure import builtin_entity_ids as ids
from ddsi.structure.discovered import DiscoveredParticipantData, DiscoveredReaderData, DiscoveredWriterData
from ddsi.structure.guid import EntityId, EntityKind, Guid, GuidPrefix
from ddsi.structure.locator import Locator
from ddsi.structure.qos import Qos, reader_qos, writer_qos
from ddsi.structure.vendor import PROTOCOL_VERSION

VENDOR = b"\x01\x55"
OUR_ADDRESS = Locator.udp_v4("10.0.0.1", 7410)
OUR_USER_ADDRESS = Locator.udp_v4("10.0.0.1", 7411)
GROUP = Locator.udp_v4("239.255.0.1", 7400)


def engine(
    *,
    multicast: bool = True,
    config: Config | None = None,
    hooks: SecurityHooks = PLAINTEXT,
    send: Callable[[SendDatagram], None] | None = None,
) -> Participant:
    """A participant that was just started, its first announcement drained."""
    participant = Participant(
        ParticipantSetup(
            domain_id=0,
            guid_prefix=GuidPrefix(b"\x01\xdd" + b"E" * 10),
            config=config or Config(),
            metatraffic_unicast=(OUR_ADDRESS,),
            default_unicast=(OUR_USER_ADDRESS,),
            metatraffic_multicast=(GROUP,) if multicast else (),
            announce_to=(GROUP,) if multicast else (),
        ),
        random=Random(1),
        wall_clock=lambda: 1_700_000_000 * 10**9,
        hooks=hooks,
        send=send,
    )
    participant.start(0.0)
    participant.handle_timeout(0.0)
    participant.drain_effects()
    return participant


def sent(participant: Participant) -> list[tuple[tuple[Locator, ...], bytes]]:
    """The datagrams that it wants sent, with their destinations."""
    return [
        (effect.destinations, b"".join(effect.parts))
        for effect in participant.drain_effects()
        if isinstance(effect, SendDatagram)
    ]


class Stranger:
    """A participant that exists on paper.  ``address`` is what it announces and sends from."""

    def __init__(self, number: int = 1, *, address: Locator | None = None) -> None:
        self.prefix = GuidPrefix(VENDOR + number.to_bytes(10, "big"))
        self.guid = Guid.of(self.prefix, EntityId.PARTICIPANT)
        self.address = address or Locator.udp_v4(f"10.9.{number >> 8 & 255}.{number & 255}", 7410)
        self._sn: dict[EntityId, int] = {}

    def message(self, *submessages: bytes) -> bytes:
        return Header(PROTOCOL_VERSION, VENDOR, self.prefix).encode() + b"".join(submessages)

    def data(self, **changes: object) -> DiscoveredParticipantData:
        fields: dict[str, object] = {
            "guid": self.guid,
            "vendor_id": VENDOR,
            "metatraffic_unicast": (self.address,),
            "default_unicast": (self.address,),
            "metatraffic_multicast": (GROUP,),
            "builtin_endpoints": ANNOUNCED_ENDPOINTS,
            "lease_duration": 20.0,
            **changes,
        }
        return DiscoveredParticipantData(**fields)  # type: ignore[arg-type]

    def spdp(self, **changes: object) -> bytes:
        """Its announcement; ``changes`` are fields of DiscoveredParticipantData."""
        payload = encode_participant(self.data(**changes))
        return self.message(Data(ids.SPDP_READER, ids.SPDP_WRITER, 1, None, payload).encode())

    def goodbye(self) -> bytes:
        inline = ParameterList([(ParameterId.KEY_HASH, self.guid), (ParameterId.STATUS_INFO, b"\0\0\0\3")])
        payload = encode_key(self.guid, ParameterId.PARTICIPANT_GUID)
        return self.message(Data(ids.SPDP_READER, ids.SPDP_WRITER, 2, inline, payload, is_key=True).encode())

    def first_heartbeats(self) -> bytes:
        """The builtin writers say that they are there, so that what they send is in step."""
        writers = (
            *(ids.SEDP_PUBLICATIONS_WRITER, ids.SEDP_SUBSCRIPTIONS_WRITER, ids.PARTICIPANT_MESSAGE_WRITER),
            *(ids.TYPE_LOOKUP_REQUEST_WRITER, ids.TYPE_LOOKUP_REPLY_WRITER),
        )
        beats = [Heartbeat(EntityId.UNKNOWN, writer, 1, 0, 1, final=True).encode() for writer in writers]
        return self.message(*beats)

    def endpoint(self, key: int, *, is_writer: bool, keyed: bool = False) -> Guid:
        kinds = {
            (True, True): EntityKind.WRITER_WITH_KEY,
            (True, False): EntityKind.WRITER_NO_KEY,
            (False, True): EntityKind.READER_WITH_KEY,
            (False, False): EntityKind.READER_NO_KEY,
        }
        return Guid.of(self.prefix, EntityId.user(key, kinds[is_writer, keyed]))

    def sedp_writer(self, key: int = 1, topic: str = "Square", qos: Qos = Qos(), *, of: Guid | None = None) -> bytes:
        data = DiscoveredWriterData(
            guid=of or self.endpoint(key, is_writer=True), topic_name=topic, type_name="T", qos=writer_qos(qos)
        )
        return self._sedp(ids.SEDP_PUBLICATIONS_WRITER, ids.SEDP_PUBLICATIONS_READER, encode_writer(data))

    def sedp_reader(self, key: int = 1, topic: str = "Square", qos: Qos = Qos()) -> bytes:
        data = DiscoveredReaderData(
            guid=self.endpoint(key, is_writer=False), topic_name=topic, type_name="T", qos=reader_qos(qos)
        )
        return self._sedp(ids.SEDP_SUBSCRIPTIONS_WRITER, ids.SEDP_SUBSCRIPTIONS_READER, encode_reader(data))

    def _sedp(self, writer_id: EntityId, reader_id: EntityId, payload: bytes) -> bytes:
        number = self._sn[writer_id] = self._sn.get(writer_id, 0) + 1
        return self.message(Data(reader_id, writer_id, number, None, payload).encode())

    def directed(self, to: GuidPrefix, *submessages: bytes) -> bytes:
        return self.message(InfoDestination(to).encode(), *submessages)

    def introduce(self, to: Participant, now: float = 0.0, **changes: object) -> None:
        """It announces itself and is heard; everything that this causes is drained."""
        to.receive_datagram(self.spdp(**changes), self.address, now)
        to.receive_datagram(self.first_heartbeats(), self.address, now)
        to.drain_effects()
