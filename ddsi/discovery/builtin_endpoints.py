"""The builtin endpoints without security, in one table: who writes, who reads, which bits announce it.

RTPS 2.5 §8.5.3-8.5.5, §8.4.13.  SPDP has no place here: it is stateless and matched with nobody.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..structure import builtin_entity_ids as ids
from ..structure.builtin_entity_ids import BuiltinEndpoints
from ..structure.guid import EntityId
from ..structure.qos import EndpointQos
from ..structure.qos_policies import KeepLast, Reliable, TransientLocal

__all__ = ["ANNOUNCED_ENDPOINTS", "BUILTIN_QOS", "BUILTIN_TOPICS", "BuiltinTopic"]

BUILTIN_QOS = EndpointQos(reliability=Reliable(), durability=TransientLocal(), history=KeepLast(1))
"""RTPS 2.5 §8.5.4.2: reliable, transient-local, the latest sample of each instance."""


@dataclass(frozen=True, slots=True)
class BuiltinTopic:
    """``announcer`` and ``detector``: the bits by which a peer says that it has the writer, the reader."""

    name: str
    writer_id: EntityId
    reader_id: EntityId
    announcer: BuiltinEndpoints
    detector: BuiltinEndpoints


BUILTIN_TOPICS = (
    BuiltinTopic(
        "DCPSPublication",
        ids.SEDP_PUBLICATIONS_WRITER,
        ids.SEDP_PUBLICATIONS_READER,
        BuiltinEndpoints.PUBLICATIONS_ANNOUNCER,
        BuiltinEndpoints.PUBLICATIONS_DETECTOR,
    ),
    BuiltinTopic(
        "DCPSSubscription",
        ids.SEDP_SUBSCRIPTIONS_WRITER,
        ids.SEDP_SUBSCRIPTIONS_READER,
        BuiltinEndpoints.SUBSCRIPTIONS_ANNOUNCER,
        BuiltinEndpoints.SUBSCRIPTIONS_DETECTOR,
    ),
    BuiltinTopic(
        "DCPSParticipantMessage",
        ids.PARTICIPANT_MESSAGE_WRITER,
        ids.PARTICIPANT_MESSAGE_READER,
        BuiltinEndpoints.PARTICIPANT_MESSAGE_WRITER,
        BuiltinEndpoints.PARTICIPANT_MESSAGE_READER,
    ),
)

ANNOUNCED_ENDPOINTS = BuiltinEndpoints.PARTICIPANT_ANNOUNCER | BuiltinEndpoints.PARTICIPANT_DETECTOR
for _topic in BUILTIN_TOPICS:
    ANNOUNCED_ENDPOINTS |= _topic.announcer | _topic.detector
