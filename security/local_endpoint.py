"""A writer or reader of ours, builtin ones too, as security sees it.  DDS-Security 1.1 §7.4.5, §8.8.5."""

from __future__ import annotations

from typing import Final

from ddsi.structure import builtin_entity_ids as ids
from ddsi.structure.dataclass import dataclass
from ddsi.structure.guid import EntityId, Guid

from .attributes import EndpointSecurityAttributes
from .handles import DatareaderCryptoHandle, DatawriterCryptoHandle

__all__ = [
    "BUILTIN_SECURE_TOPICS",
    "NEVER_IN_MESSAGES",
    "PLAIN_BUILTIN",
    "SECURE_BUILTIN",
    "VOLATILE",
    "BuiltinSecureTopic",
    "LocalEndpoint",
]


@dataclass(frozen=True, slots=True)
class BuiltinSecureTopic:
    """``name`` is that by which access control tells how the topic is protected (§7.4.5)."""

    name: str
    writer_id: EntityId
    reader_id: EntityId
    writer_name: str = ""  # the value of BUILTIN_ENDPOINT_NAME, where the plugin must know it
    reader_name: str = ""


BUILTIN_SECURE_TOPICS: Final = (
    BuiltinSecureTopic("DCPSParticipantsSecure", ids.SPDP_SECURE_WRITER, ids.SPDP_SECURE_READER),
    BuiltinSecureTopic(
        "DCPSPublicationsSecure", ids.SEDP_PUBLICATIONS_SECURE_WRITER, ids.SEDP_PUBLICATIONS_SECURE_READER
    ),
    BuiltinSecureTopic(
        "DCPSSubscriptionsSecure", ids.SEDP_SUBSCRIPTIONS_SECURE_WRITER, ids.SEDP_SUBSCRIPTIONS_SECURE_READER
    ),
    BuiltinSecureTopic(
        "DCPSParticipantMessageSecure", ids.PARTICIPANT_MESSAGE_SECURE_WRITER, ids.PARTICIPANT_MESSAGE_SECURE_READER
    ),
    BuiltinSecureTopic(
        "DCPSParticipantVolatileMessageSecure",
        ids.PARTICIPANT_VOLATILE_MESSAGE_SECURE_WRITER,
        ids.PARTICIPANT_VOLATILE_MESSAGE_SECURE_READER,
        "BuiltinParticipantVolatileMessageSecureWriter",
        "BuiltinParticipantVolatileMessageSecureReader",
    ),
    BuiltinSecureTopic(
        "TypeLookupServiceRequestSecure", ids.TYPE_LOOKUP_REQUEST_SECURE_WRITER, ids.TYPE_LOOKUP_REQUEST_SECURE_READER
    ),
    BuiltinSecureTopic(
        "TypeLookupServiceReplySecure", ids.TYPE_LOOKUP_REPLY_SECURE_WRITER, ids.TYPE_LOOKUP_REPLY_SECURE_READER
    ),
)

SECURE_BUILTIN: Final = frozenset(
    entity_id for topic in BUILTIN_SECURE_TOPICS for entity_id in (topic.writer_id, topic.reader_id)
)

VOLATILE: Final = {
    ids.PARTICIPANT_VOLATILE_MESSAGE_SECURE_WRITER: ids.PARTICIPANT_VOLATILE_MESSAGE_SECURE_READER,
    ids.PARTICIPANT_VOLATILE_MESSAGE_SECURE_READER: ids.PARTICIPANT_VOLATILE_MESSAGE_SECURE_WRITER,
}
"""The two endpoints of the topic that carries keys: each, and what it talks to."""

NEVER_IN_MESSAGES: Final = frozenset(VOLATILE) | {
    *(ids.SPDP_WRITER, ids.SPDP_READER),
    *(ids.PARTICIPANT_STATELESS_MESSAGE_WRITER, ids.PARTICIPANT_STATELESS_MESSAGE_READER),
}
"""The topics by which two participants come to have keys: never under message protection (§8.4.2.4, table 27)."""

PLAIN_BUILTIN: Final = frozenset(
    (
        *(ids.SEDP_PUBLICATIONS_WRITER, ids.SEDP_PUBLICATIONS_READER),
        *(ids.SEDP_SUBSCRIPTIONS_WRITER, ids.SEDP_SUBSCRIPTIONS_READER),
        *(ids.PARTICIPANT_MESSAGE_WRITER, ids.PARTICIPANT_MESSAGE_READER),
        *(ids.TYPE_LOOKUP_REQUEST_WRITER, ids.TYPE_LOOKUP_REQUEST_READER),
        *(ids.TYPE_LOOKUP_REPLY_WRITER, ids.TYPE_LOOKUP_REPLY_READER),
    )
)
"""Discovery in clear: under message protection where it is on, except that Cyclone DDS never does so."""


@dataclass(slots=True)
class LocalEndpoint:
    """``handle`` is None where neither submessages nor payload are protected: then there are no keys."""

    guid: Guid
    topic_name: str
    attributes: EndpointSecurityAttributes
    handle: DatawriterCryptoHandle | DatareaderCryptoHandle | None = None

    @property
    def is_volatile(self) -> bool:
        return self.guid.entity_id in VOLATILE
