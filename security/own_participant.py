"""Our participant and its endpoints, from security's side: identity, permissions, attributes, keys.

DDS-Security 1.1 §8.8.1 (creating a participant), §8.8.5 (creating endpoints).  What governance and permissions forbid
fails here, in the very call that asked for it, and leaves nothing behind.
"""

from __future__ import annotations

from contextlib import ExitStack
from typing import Final, TypeVar, cast

from ddsi.serialization import ParameterId
from ddsi.spi import Announcement, LocalParticipant, ProtectedEndpoint, Refused
from ddsi.structure.builtin_entity_ids import BuiltinEndpoints
from ddsi.structure.discovered import DiscoveredReaderData, DiscoveredWriterData
from ddsi.structure.errors import NotAllowedBySecurity
from ddsi.structure.guid import Guid
from ddsi.structure.qos_policies import Partition, Properties

from .announced import endpoint_info, info_parameter, participant_info, token_parameter
from .attributes import DataTags, EndpointSecurityAttributes
from .handles import Pending
from .loading import Plugins
from .local_endpoint import BUILTIN_SECURE_TOPICS, PLAIN_BUILTIN, LocalEndpoint
from .properties import BUILTIN_ENDPOINT_NAME
from .tokens import NIL

__all__ = ["OwnParticipant", "settled"]

T = TypeVar("T")

_SECURE_BUILTIN_ENDPOINTS: Final = BuiltinEndpoints(0x0FFF << 16 | 0xF << 32)
"""Bits 16 to 27: all of them, as others take a participant that announces fewer for an unsecured one (Cyclone DDS).
And those of DDS-Security 1.2, for type lookup, which have a parameter of their own."""


class OwnParticipant:
    """Made from a candidate; raises NotAllowedBySecurity or ConfigurationError.  ``guid`` is the one to be used."""

    def __init__(self, plugins: Plugins, candidate: LocalParticipant) -> None:
        authentication, access = plugins.authentication, plugins.access_control
        self._plugins = plugins
        self.domain_id = candidate.domain_id
        properties = candidate.properties
        identity = settled(authentication.validate_local_identity(candidate.domain_id, properties, candidate.guid))
        self.identity = identity.handle
        self.guid = identity.adjusted_participant_guid
        with ExitStack() as undo:
            undo.callback(authentication.return_identity_handle, self.identity)
            self.permissions = settled(
                access.validate_local_permissions(
                    authentication, self.identity, candidate.domain_id, properties, domain_tag=candidate.domain_tag
                )
            )
            undo.callback(access.return_permissions_handle, self.permissions)
            _insist(access.check_create_participant(self.permissions, candidate.domain_id, properties))
            self.permissions_token = access.get_permissions_token(self.permissions)
            authentication.set_permissions_credential_and_token(
                self.identity, access.get_permissions_credential_token(self.permissions), self.permissions_token
            )
            self.attributes = access.get_participant_sec_attributes(self.permissions)
            self.info = participant_info(self.attributes)
            self.crypto = plugins.cryptographic.register_local_participant(
                self.identity, self.permissions, properties, self.attributes
            )
            undo.callback(plugins.cryptographic.unregister_participant, self.crypto)
            self.endpoints: dict[Guid, LocalEndpoint] = {}
            self._register_builtin_endpoints()
            self._undo = undo.pop_all()

    def close(self) -> None:
        """Give back keys, permissions and identity, in this order, as each was derived from the next."""
        self.endpoints.clear()
        self._undo.close()

    def announcement(self) -> Announcement:
        authentication = self._plugins.authentication
        status = authentication.get_identity_status_token(self.identity)
        return Announcement(
            parameters=(
                token_parameter(ParameterId.IDENTITY_TOKEN, authentication.get_identity_token(self.identity)),
                token_parameter(ParameterId.PERMISSIONS_TOKEN, self.permissions_token),
                info_parameter(ParameterId.PARTICIPANT_SECURITY_INFO, self.info),
            ),
            builtin_endpoints=_SECURE_BUILTIN_ENDPOINTS,
            protected_parameters=(
                (token_parameter(ParameterId.IDENTITY_STATUS_TOKEN, status),) if status != NIL else ()
            ),
        )

    # --- endpoints of the application ----------------------------------------------------------------------

    def writer_created(self, data: DiscoveredWriterData) -> ProtectedEndpoint:
        tags = self._check_writer(data)
        attributes = self._plugins.access_control.get_datawriter_sec_attributes(
            self.permissions, data.topic_name, data.qos.partition, tags
        )
        endpoint = LocalEndpoint(data.guid, data.topic_name, attributes)
        if attributes.is_submessage_protected or attributes.is_payload_protected:
            endpoint.handle = self._plugins.cryptographic.register_local_datawriter(
                self.crypto, data.qos.properties, attributes
            )
        self.endpoints[data.guid] = endpoint
        return _protected(attributes)

    def reader_created(self, data: DiscoveredReaderData) -> ProtectedEndpoint:
        tags = self._check_reader(data)
        attributes = self._plugins.access_control.get_datareader_sec_attributes(
            self.permissions, data.topic_name, data.qos.partition, tags
        )
        endpoint = LocalEndpoint(data.guid, data.topic_name, attributes)
        if attributes.is_submessage_protected or attributes.is_payload_protected:
            endpoint.handle = self._plugins.cryptographic.register_local_datareader(
                self.crypto, data.qos.properties, attributes
            )
        self.endpoints[data.guid] = endpoint
        return _protected(attributes)

    def endpoint_changed(self, data: DiscoveredWriterData | DiscoveredReaderData) -> ProtectedEndpoint:
        """Rights are checked again; how the endpoint is protected depends on its topic alone, so keys stay."""
        if isinstance(data, DiscoveredWriterData):
            self._check_writer(data)
        else:
            self._check_reader(data)
        return _protected(self.endpoints[data.guid].attributes)

    def _check_writer(self, data: DiscoveredWriterData) -> DataTags:
        access, tags = self._plugins.access_control, self._tags(data)
        _insist(access.check_create_topic(self.permissions, self.domain_id, data.topic_name, data.qos))
        _insist(
            access.check_create_datawriter(
                self.permissions, self.domain_id, data.topic_name, data.qos, data.qos.partition, tags
            )
        )
        return tags

    def _check_reader(self, data: DiscoveredReaderData) -> DataTags:
        access, tags = self._plugins.access_control, self._tags(data)
        _insist(access.check_create_topic(self.permissions, self.domain_id, data.topic_name, data.qos))
        _insist(
            access.check_create_datareader(
                self.permissions, self.domain_id, data.topic_name, data.qos, data.qos.partition, tags
            )
        )
        return tags

    def _tags(self, data: DiscoveredWriterData | DiscoveredReaderData) -> DataTags:
        return self._plugins.data_tagging.get_data_tags(data.qos)

    # --- builtin endpoints -------------------------------------------------------------------------------

    def _register_builtin_endpoints(self) -> None:
        """Keys for the secure ones; the plain ones are entered as unprotected, so that all are treated alike."""
        access, cryptographic = self._plugins.access_control, self._plugins.cryptographic
        for topic in BUILTIN_SECURE_TOPICS:
            writer = LocalEndpoint(
                Guid.of(self.guid.prefix, topic.writer_id),
                topic.name,
                access.get_datawriter_sec_attributes(self.permissions, topic.name, Partition(), ()),
            )
            reader = LocalEndpoint(
                Guid.of(self.guid.prefix, topic.reader_id),
                topic.name,
                access.get_datareader_sec_attributes(self.permissions, topic.name, Partition(), ()),
            )
            if writer.attributes.is_submessage_protected:
                writer.handle = cryptographic.register_local_datawriter(
                    self.crypto, _named(topic.writer_name), writer.attributes
                )
                reader.handle = cryptographic.register_local_datareader(
                    self.crypto, _named(topic.reader_name), reader.attributes
                )
            self.endpoints[writer.guid] = writer
            self.endpoints[reader.guid] = reader
        for entity_id in sorted(PLAIN_BUILTIN):
            guid = Guid.of(self.guid.prefix, entity_id)
            self.endpoints[guid] = LocalEndpoint(guid, "", EndpointSecurityAttributes())


def settled(result: T | Pending[T]) -> T:
    """While a participant is being created there is nobody else to serve: slow work is done on the spot."""
    return cast(T, result.job() if isinstance(result, Pending) else result)


def _insist(refusal: Refused | None) -> None:
    if refusal is not None:
        raise NotAllowedBySecurity(refusal.reason)


def _named(builtin_endpoint: str) -> Properties:
    return {BUILTIN_ENDPOINT_NAME: builtin_endpoint} if builtin_endpoint else {}


def _protected(attributes: EndpointSecurityAttributes) -> ProtectedEndpoint:
    return ProtectedEndpoint(
        parameters=(info_parameter(ParameterId.ENDPOINT_SECURITY_INFO, endpoint_info(attributes)),),
        discovery_protected=attributes.is_discovery_protected,
        liveliness_protected=attributes.is_liveliness_protected,
        key_protected=attributes.is_key_protected,
    )
