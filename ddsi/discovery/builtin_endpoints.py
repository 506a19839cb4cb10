"""The builtin topics in one table: who writes, who reads, which bits announce them, and when they are matched.

RTPS 2.5 §8.5.3-8.5.5, §8.4.13; DDS-Security 1.1 §7.3.7.1, §7.4.  SPDP in clear has no place here: it is stateless and
matched with nobody.  Which of the secure ones a participant has, its hooks say.
"""

from __future__ import annotations

from enum import Enum

from ..structure import builtin_entity_ids as ids
from ..structure.builtin_entity_ids import BuiltinEndpoints
from ..structure.dataclass import dataclass
from ..structure.guid import EntityId
from ..structure.qos import EndpointQos
from ..structure.qos_policies import BestEffort, KeepAll, KeepLast, Reliable, TransientLocal, Volatile

__all__ = ["ANNOUNCED_ENDPOINTS", "BUILTIN_QOS", "BUILTIN_TOPICS", "BuiltinTopic", "Delivery", "Stage"]

BUILTIN_QOS = EndpointQos(reliability=Reliable(), durability=TransientLocal(), history=KeepLast(1))
"""RTPS 2.5 §8.5.4.2: reliable, transient-local, the latest sample of each instance."""
_STATELESS_QOS = EndpointQos(reliability=BestEffort(), durability=Volatile(), history=KeepAll())
_VOLATILE_QOS = EndpointQos(reliability=Reliable(), durability=Volatile(), history=KeepAll())


class Stage(Enum):
    """How far two participants must be with each other before a topic's endpoints are matched."""

    IDENTIFIED = "it has said who it is, and is being authenticated"
    ADMITTED = "security has nothing against it"


class Delivery(Enum):
    """What goes to whom."""

    TO_ALL = "each reader gets every change, in order"
    DIRECTED = "each change is for one participant, and in order (DDS-Security 1.1 §7.4.4)"
    STATELESS = "each change is for one participant, and nobody keeps account (DDS-Security 1.1 §7.4.3)"
    ADDRESSED = "each change is for one participant; but others' writers send all to all, as readers must expect"


@dataclass(frozen=True, slots=True)
class BuiltinTopic:
    """``announcer`` and ``detector``: the bits by which a participant says that it has the writer, the reader."""

    name: str
    writer_id: EntityId
    reader_id: EntityId
    announcer: BuiltinEndpoints
    detector: BuiltinEndpoints
    qos: EndpointQos = BUILTIN_QOS
    stage: Stage = Stage.ADMITTED
    delivery: Delivery = Delivery.TO_ALL

    @property
    def filters(self) -> bool:
        """Does our writer send each participant its own changes only?"""
        return self.delivery is not Delivery.TO_ALL

    @property
    def is_directed(self) -> bool:
        """Do the writers of all vendors?  It is by these topics that security itself talks."""
        return self.delivery in (Delivery.DIRECTED, Delivery.STATELESS)

    @property
    def is_plain(self) -> bool:
        """Does every participant have it, secured or not?"""
        return self.announcer in ANNOUNCED_ENDPOINTS


_Bits = BuiltinEndpoints
# The order is that of matching: what carries the others' keys comes before them.
BUILTIN_TOPICS = (
    BuiltinTopic(
        "DCPSParticipantStatelessMessage",
        ids.PARTICIPANT_STATELESS_MESSAGE_WRITER,
        ids.PARTICIPANT_STATELESS_MESSAGE_READER,
        _Bits.PARTICIPANT_STATELESS_MESSAGE_WRITER,
        _Bits.PARTICIPANT_STATELESS_MESSAGE_READER,
        _STATELESS_QOS,
        Stage.IDENTIFIED,
        Delivery.STATELESS,
    ),
    BuiltinTopic(
        "DCPSParticipantVolatileMessageSecure",
        ids.PARTICIPANT_VOLATILE_MESSAGE_SECURE_WRITER,
        ids.PARTICIPANT_VOLATILE_MESSAGE_SECURE_READER,
        _Bits.PARTICIPANT_VOLATILE_MESSAGE_SECURE_WRITER,
        _Bits.PARTICIPANT_VOLATILE_MESSAGE_SECURE_READER,
        _VOLATILE_QOS,
        Stage.ADMITTED,
        Delivery.DIRECTED,
    ),
    BuiltinTopic(
        "DCPSPublication",
        ids.SEDP_PUBLICATIONS_WRITER,
        ids.SEDP_PUBLICATIONS_READER,
        _Bits.PUBLICATIONS_ANNOUNCER,
        _Bits.PUBLICATIONS_DETECTOR,
    ),
    BuiltinTopic(
        "DCPSSubscription",
        ids.SEDP_SUBSCRIPTIONS_WRITER,
        ids.SEDP_SUBSCRIPTIONS_READER,
        _Bits.SUBSCRIPTIONS_ANNOUNCER,
        _Bits.SUBSCRIPTIONS_DETECTOR,
    ),
    BuiltinTopic(
        "DCPSParticipantMessage",
        ids.PARTICIPANT_MESSAGE_WRITER,
        ids.PARTICIPANT_MESSAGE_READER,
        _Bits.PARTICIPANT_MESSAGE_WRITER,
        _Bits.PARTICIPANT_MESSAGE_READER,
    ),
    BuiltinTopic(
        "DCPSParticipantsSecure",
        ids.SPDP_SECURE_WRITER,
        ids.SPDP_SECURE_READER,
        _Bits.PARTICIPANT_SECURE_WRITER,
        _Bits.PARTICIPANT_SECURE_READER,
    ),
    BuiltinTopic(
        "DCPSPublicationsSecure",
        ids.SEDP_PUBLICATIONS_SECURE_WRITER,
        ids.SEDP_PUBLICATIONS_SECURE_READER,
        _Bits.PUBLICATIONS_SECURE_WRITER,
        _Bits.PUBLICATIONS_SECURE_READER,
    ),
    BuiltinTopic(
        "DCPSSubscriptionsSecure",
        ids.SEDP_SUBSCRIPTIONS_SECURE_WRITER,
        ids.SEDP_SUBSCRIPTIONS_SECURE_READER,
        _Bits.SUBSCRIPTIONS_SECURE_WRITER,
        _Bits.SUBSCRIPTIONS_SECURE_READER,
    ),
    BuiltinTopic(
        "DCPSParticipantMessageSecure",
        ids.PARTICIPANT_MESSAGE_SECURE_WRITER,
        ids.PARTICIPANT_MESSAGE_SECURE_READER,
        _Bits.PARTICIPANT_MESSAGE_SECURE_WRITER,
        _Bits.PARTICIPANT_MESSAGE_SECURE_READER,
    ),
    BuiltinTopic(
        "TypeLookupServiceRequest",
        ids.TYPE_LOOKUP_REQUEST_WRITER,
        ids.TYPE_LOOKUP_REQUEST_READER,
        _Bits.TYPE_LOOKUP_REQUEST_WRITER,
        _Bits.TYPE_LOOKUP_REQUEST_READER,
        _VOLATILE_QOS,
        delivery=Delivery.ADDRESSED,
    ),
    BuiltinTopic(
        "TypeLookupServiceReply",
        ids.TYPE_LOOKUP_REPLY_WRITER,
        ids.TYPE_LOOKUP_REPLY_READER,
        _Bits.TYPE_LOOKUP_REPLY_WRITER,
        _Bits.TYPE_LOOKUP_REPLY_READER,
        _VOLATILE_QOS,
        delivery=Delivery.ADDRESSED,
    ),
    BuiltinTopic(
        "TypeLookupServiceRequestSecure",
        ids.TYPE_LOOKUP_REQUEST_SECURE_WRITER,
        ids.TYPE_LOOKUP_REQUEST_SECURE_READER,
        _Bits.TYPE_LOOKUP_REQUEST_SECURE_WRITER,
        _Bits.TYPE_LOOKUP_REQUEST_SECURE_READER,
        _VOLATILE_QOS,
        delivery=Delivery.ADDRESSED,
    ),
    BuiltinTopic(
        "TypeLookupServiceReplySecure",
        ids.TYPE_LOOKUP_REPLY_SECURE_WRITER,
        ids.TYPE_LOOKUP_REPLY_SECURE_READER,
        _Bits.TYPE_LOOKUP_REPLY_SECURE_WRITER,
        _Bits.TYPE_LOOKUP_REPLY_SECURE_READER,
        _VOLATILE_QOS,
        delivery=Delivery.ADDRESSED,
    ),
)

ANNOUNCED_ENDPOINTS = (
    _Bits.PARTICIPANT_ANNOUNCER
    | _Bits.PARTICIPANT_DETECTOR
    | _Bits.PUBLICATIONS_ANNOUNCER
    | _Bits.PUBLICATIONS_DETECTOR
    | _Bits.SUBSCRIPTIONS_ANNOUNCER
    | _Bits.SUBSCRIPTIONS_DETECTOR
    | _Bits.PARTICIPANT_MESSAGE_WRITER
    | _Bits.PARTICIPANT_MESSAGE_READER
    | _Bits.TYPE_LOOKUP_REQUEST_WRITER
    | _Bits.TYPE_LOOKUP_REQUEST_READER
    | _Bits.TYPE_LOOKUP_REPLY_WRITER
    | _Bits.TYPE_LOOKUP_REPLY_READER
)
"""What every participant has; its hooks add the secure ones."""
