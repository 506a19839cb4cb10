"""What applications may know of participants and endpoints: answered from identities, governance and announcements.

DDS-Security 1.1 §7.4.1.4 to §7.4.1.8 (the secure builtin topics), §8.4.2.4, §8.4.2.7 (security attributes).  How an
entity is protected is what our own governance says, as that is what is enforced here; what a peer announces of itself
must agree before anything is matched, but is not shown: on a topic that discovery does not protect, anybody may have
announced it in the peer's name.
"""

from __future__ import annotations

from collections.abc import Mapping

from ddsi.serialization import ParameterId
from ddsi.structure.discovered import DiscoveredReaderData, DiscoveredWriterData
from ddsi.structure.errors import NotAllowedBySecurity
from ddsi.structure.guid import Guid
from ddsi.structure.security_information import EndpointSecurity, ParticipantSecurity, SecurityToken

from .announced import token
from .attributes import EndpointSecurityAttributes, TopicSecurityAttributes
from .loading import Plugins
from .own_participant import OwnParticipant
from .remote_participant import RemoteParticipant, Standing
from .tokens import DataHolder

__all__ = ["SecurityInformation"]

_NOTHING = ParticipantSecurity()


class SecurityInformation:
    """Of one participant of ours and all that it knows."""

    def __init__(self, plugins: Plugins, own: OwnParticipant, remotes: Mapping[bytes, RemoteParticipant]) -> None:
        self._plugins = plugins
        self._own = own
        self._remotes = remotes

    def participant(self, guid: Guid) -> ParticipantSecurity:
        """Empty unless it is our own, or is authenticated and admitted."""
        authentication, own = self._plugins.authentication, self._own
        if guid.prefix == own.guid.prefix:
            return self._of(
                authentication.get_subject_name(own.identity),
                authentication.get_identity_token(own.identity),
                own.permissions_token,
                authentication.get_identity_status_token(own.identity),
            )
        remote = self._authenticated(guid)
        if remote is None:
            return _NOTHING
        announced = remote.data.security_parameters
        return self._of(
            self._subject_name(remote),
            token(announced, ParameterId.IDENTITY_TOKEN),
            token(announced, ParameterId.PERMISSIONS_TOKEN),
            token(announced, ParameterId.IDENTITY_STATUS_TOKEN),
        )

    def endpoint(self, data: DiscoveredWriterData | DiscoveredReaderData) -> EndpointSecurity:
        """Empty unless its participant is our own, or is authenticated and admitted."""
        own = self._own
        if data.guid.prefix == own.guid.prefix:
            subject_name = self._plugins.authentication.get_subject_name(own.identity)
        else:
            remote = self._authenticated(data.guid)
            if remote is None:
                return EndpointSecurity()
            subject_name = self._subject_name(remote)
        attributes = self._attributes(data)
        return EndpointSecurity(
            is_authenticated=True,
            subject_name=subject_name,
            is_read_protected=attributes.is_read_protected,
            is_write_protected=attributes.is_write_protected,
            is_discovery_protected=attributes.is_discovery_protected and own.attributes.is_discovery_protected,
            is_liveliness_protected=attributes.is_liveliness_protected and own.attributes.is_liveliness_protected,
            is_submessage_protected=attributes.is_submessage_protected,
            is_payload_protected=attributes.is_payload_protected,
            is_key_protected=attributes.is_key_protected,
            plugin_attributes=attributes.plugin_endpoint_attributes,
        )

    def _authenticated(self, guid: Guid) -> RemoteParticipant | None:
        remote = self._remotes.get(guid.prefix)
        return remote if remote is not None and remote.standing is Standing.ADMITTED else None

    def _subject_name(self, remote: RemoteParticipant) -> str:
        assert remote.handshake is not None, "who is admitted has been authenticated by a handshake"
        assert remote.handshake.remote_identity is not None
        return self._plugins.authentication.get_subject_name(remote.handshake.remote_identity)

    def _of(
        self, subject_name: str, identity: DataHolder, permissions: DataHolder, status: DataHolder
    ) -> ParticipantSecurity:
        """All participants of a domain are protected alike: whoever announces otherwise is not admitted."""
        attributes = self._own.attributes
        return ParticipantSecurity(
            is_authenticated=True,
            subject_name=subject_name,
            is_rtps_protected=attributes.is_rtps_protected,
            is_discovery_protected=attributes.is_discovery_protected,
            is_liveliness_protected=attributes.is_liveliness_protected,
            plugin_attributes=attributes.plugin_participant_attributes,
            identity_token=_shown(identity),
            permissions_token=_shown(permissions),
            identity_status_token=_shown(status),
        )

    def _attributes(self, data: DiscoveredWriterData | DiscoveredReaderData) -> EndpointSecurityAttributes:
        access, permissions = self._plugins.access_control, self._own.permissions
        find = (
            access.get_datawriter_sec_attributes
            if isinstance(data, DiscoveredWriterData)
            else access.get_datareader_sec_attributes
        )
        try:
            return find(permissions, data.topic_name, data.qos.partition, data.qos.data_tags.tags)
        except NotAllowedBySecurity:  # a topic that governance has no rule for: nobody here can ever use it
            topic = access.get_topic_sec_attributes(permissions, data.topic_name)
            return _of_topic(topic)


def _of_topic(topic: TopicSecurityAttributes) -> EndpointSecurityAttributes:
    return EndpointSecurityAttributes(
        is_read_protected=topic.is_read_protected,
        is_write_protected=topic.is_write_protected,
        is_discovery_protected=topic.is_discovery_protected,
        is_liveliness_protected=topic.is_liveliness_protected,
    )


def _shown(holder: DataHolder) -> SecurityToken:
    return SecurityToken(holder.class_id, holder.properties)
