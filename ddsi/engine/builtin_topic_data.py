"""Builtin topic data: what was announced of an entity, with what security knows of it, for applications to read.

DDS 1.4 §2.2.5, DDS-Security 1.1 §7.4.1.4 to §7.4.1.8.  For our own entities as for remote ones.
"""

from __future__ import annotations

from hashlib import md5

from ..spi import SecurityHooks
from ..structure.builtin_topic_data import (
    ParticipantBuiltinTopicData,
    PublicationBuiltinTopicData,
    SubscriptionBuiltinTopicData,
    TopicBuiltinTopicData,
)
from ..structure.discovered import (
    DiscoveredEndpointData,
    DiscoveredParticipantData,
    DiscoveredReaderData,
    DiscoveredWriterData,
)
from ..structure.guid import Guid

__all__ = ["participant_data", "publication_data", "subscription_data", "topic_data"]


def participant_data(announced: DiscoveredParticipantData, hooks: SecurityHooks) -> ParticipantBuiltinTopicData:
    """The data of DCPSParticipant."""
    return ParticipantBuiltinTopicData(
        key=announced.guid,
        user_data=announced.user_data,
        entity_name=announced.entity_name,
        vendor_id=announced.vendor_id,
        protocol_version=announced.protocol_version,
        domain_id=announced.domain_id,
        lease_duration=announced.lease_duration,
        properties=announced.properties,
        security=hooks.participant_security(announced.guid),
    )


def topic_data(announced: DiscoveredEndpointData) -> TopicBuiltinTopicData:
    """The data of DCPSTopic, as far as one of its endpoints tells."""
    names = f"{announced.topic_name}\0{announced.type_name}".encode()
    return TopicBuiltinTopicData(
        key=Guid(md5(names, usedforsecurity=False).digest()),
        name=announced.topic_name,
        type_name=announced.type_name,
        qos=announced.qos,
        type_information=announced.type_information,
    )


def publication_data(announced: DiscoveredWriterData, hooks: SecurityHooks) -> PublicationBuiltinTopicData:
    """The data of DCPSPublication."""
    return PublicationBuiltinTopicData(
        key=announced.guid,
        topic_name=announced.topic_name,
        type_name=announced.type_name,
        qos=announced.qos,
        vendor_id=announced.vendor_id,
        type_information=announced.type_information,
        security=hooks.endpoint_security(announced),
    )


def subscription_data(announced: DiscoveredReaderData, hooks: SecurityHooks) -> SubscriptionBuiltinTopicData:
    """The data of DCPSSubscription."""
    return SubscriptionBuiltinTopicData(
        key=announced.guid,
        topic_name=announced.topic_name,
        type_name=announced.type_name,
        qos=announced.qos,
        vendor_id=announced.vendor_id,
        type_information=announced.type_information,
        security=hooks.endpoint_security(announced),
        content_filter=announced.content_filter,
    )
