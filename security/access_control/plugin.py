"""PermissionsAccessControl: the builtin plugin DDS:Access:Permissions.  DDS-Security 1.1 §8.4.2, §9.4.

It holds the documents of one participant - its own and those of its peers - and answers by them: local checks by our
governance and our grant, remote ones by *our* governance and *their* grant.  It decides nothing itself: ``checks.py``
does, and says why.  Nothing is shared between instances, so that each participant of a process has its own rights.

Permissions expire.  From its check as a participant on, a handle is watched: :meth:`next_deadline` says when the next
one expires, and :meth:`handle_timeout` tells the listener; meanwhile no check passes that asks what has expired.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable
from typing import Final

from ddsi.spi import Refused
from ddsi.structure.discovered import DiscoveredParticipantData, DiscoveredReaderData, DiscoveredWriterData
from ddsi.structure.errors import NotAllowedBySecurity
from ddsi.structure.guid import Guid
from ddsi.structure.qos import EndpointQos
from ddsi.structure.qos_policies import Partition, Properties

from ..access_control_plugin import AccessControlListener, ReaderAdmission
from ..attributes import DataTags, EndpointSecurityAttributes, ParticipantSecurityAttributes, TopicSecurityAttributes
from ..authentication_plugin import Authentication
from ..handles import IdentityHandle, Pending, PermissionsHandle
from ..properties import security_properties
from ..tokens import AuthenticatedPeerCredentialToken, DataHolder, PermissionsCredentialToken, PermissionsToken
from .checks import may_join, may_use_endpoint, may_use_topic
from .decision import Decision
from .document_error import shown, titled
from .permissions import ActionKind, Grant
from .permissions_handles import (
    PERMISSIONS_CLASS_ID,
    LocalPermissions,
    RemotePermissions,
    load_local_permissions,
    read_remote_permissions,
)
from .sec_attributes import (
    BUILTIN_TOPICS,
    builtin_endpoint_attributes,
    endpoint_attributes,
    participant_attributes,
    topic_attributes,
)

__all__ = ["PermissionsAccessControl"]

_MOST_PARTITIONS = 256  # of an endpoint; DDS has 64
_FEW = 64
_NO_RULE: Final = TopicSecurityAttributes(
    is_read_protected=True, is_write_protected=True, is_discovery_protected=True, is_liveliness_protected=True
)


class PermissionsAccessControl:
    """Implements :class:`ddsi_security.plugins.AccessControl`.

    ``wall_clock``: nanoseconds since 1970.  Neither the properties, which come with each participant, nor entropy are
    needed.
    """

    plugin_version: Final = 1

    def __init__(
        self, properties: Properties, *, entropy: Callable[[int], bytes], wall_clock: Callable[[], int]
    ) -> None:
        self._wall_clock = wall_clock
        self._local: dict[IdentityHandle, LocalPermissions] = {}
        self._listener: AccessControlListener | None = None
        self._watched: dict[PermissionsHandle, None] = {}
        # (when it expires, number, handle): the number keeps the order of equals, and handles from being compared.
        self._expiries: list[tuple[int, int, PermissionsHandle]] = []
        self._watch_count = 0

    # --- documents ---------------------------------------------------------------------------------------

    def validate_local_permissions(
        self,
        auth_plugin: Authentication,
        identity: IdentityHandle,
        domain_id: int,
        participant_properties: Properties,
        *,
        domain_tag: str = "",
    ) -> PermissionsHandle:
        """At once, and no Pending: a participant is created by a call that waits for it."""
        handle = load_local_permissions(
            security_properties(participant_properties),
            auth_plugin.get_subject_name(identity),
            domain_id=domain_id,
            domain_tag=domain_tag,
            now=self._wall_clock(),
        )
        self._local[identity] = handle
        return handle

    def validate_remote_permissions(
        self,
        auth_plugin: Authentication,
        local_identity_handle: IdentityHandle,
        remote_identity_handle: IdentityHandle,
        remote_permissions_token: PermissionsToken,
        remote_credential_token: AuthenticatedPeerCredentialToken,
    ) -> PermissionsHandle | Refused | Pending[PermissionsHandle | Refused]:
        local, now = self._local[local_identity_handle], self._wall_clock()
        subject = auth_plugin.get_subject_name(remote_identity_handle)

        def job() -> PermissionsHandle | Refused:
            return read_remote_permissions(local, subject, remote_permissions_token, remote_credential_token, now=now)

        return Pending(job)

    def get_permissions_token(self, handle: PermissionsHandle) -> PermissionsToken:
        """The class id alone: what else may stand there, peers compare as text, and each writes it in another way."""
        return DataHolder(PERMISSIONS_CLASS_ID)

    def get_permissions_credential_token(self, handle: PermissionsHandle) -> PermissionsCredentialToken:
        """The document as the property of the OMG and, as it is signed and any octet counts, as octets beside it."""
        document = _local(handle).document
        return DataHolder(
            "DDS:Access:PermissionsCredential",
            (("dds.perm.cert", document.decode("utf-8", "replace")),),
            (("dds.perm.cert", document),),
        )

    def return_permissions_handle(self, handle: PermissionsHandle) -> None:
        self._watched.pop(handle, None)
        for identity in [identity for identity, local in self._local.items() if local is handle]:
            del self._local[identity]

    # --- checks of our own participant -------------------------------------------------------------------

    def check_create_participant(
        self, permissions_handle: PermissionsHandle, domain_id: int, participant_properties: Properties
    ) -> Refused | None:
        handle = _local(permissions_handle)
        decision = may_join(
            handle.domain_rule, self._held(handle.grant), domain_id=domain_id, domain_tag=handle.domain_tag
        )
        if decision.allowed:
            self._watch(handle, handle.grant)
        return decision.refusal

    def check_create_datawriter(
        self,
        permissions_handle: PermissionsHandle,
        domain_id: int,
        topic_name: str,
        qos: EndpointQos,
        partition: Partition,
        data_tag: DataTags,
    ) -> Refused | None:
        handle = _local(permissions_handle)
        return self._endpoint(
            handle, handle.grant, domain_id, ActionKind.PUBLISH, topic_name, partition, data_tag
        ).refusal

    def check_create_datareader(
        self,
        permissions_handle: PermissionsHandle,
        domain_id: int,
        topic_name: str,
        qos: EndpointQos,
        partition: Partition,
        data_tag: DataTags,
    ) -> Refused | None:
        handle = _local(permissions_handle)
        decision = self._endpoint(
            handle, handle.grant, domain_id, ActionKind.SUBSCRIBE, topic_name, partition, data_tag
        )
        if decision.allowed:
            return None
        relay = self._endpoint(handle, handle.grant, domain_id, ActionKind.RELAY, topic_name, partition, data_tag)
        return None if relay.allowed else decision.refusal

    def check_create_topic(
        self, permissions_handle: PermissionsHandle, domain_id: int, topic_name: str, qos: EndpointQos
    ) -> Refused | None:
        handle = _local(permissions_handle)
        return self._topic(handle, handle.grant, domain_id, topic_name).refusal

    def check_local_datawriter_register_instance(
        self, permissions_handle: PermissionsHandle, writer: Guid, key: bytes
    ) -> Refused | None:
        return None  # §9.4.3: permissions say nothing of instances

    def check_local_datawriter_dispose_instance(
        self, permissions_handle: PermissionsHandle, writer: Guid, key: bytes
    ) -> Refused | None:
        return None

    # --- checks of peers ---------------------------------------------------------------------------------

    def check_remote_participant(
        self, permissions_handle: PermissionsHandle, domain_id: int, participant_data: DiscoveredParticipantData
    ) -> Refused | None:
        handle = _remote(permissions_handle)
        local = handle.local
        decision = may_join(
            local.domain_rule,
            self._held(handle.grant),
            domain_id=domain_id,
            domain_tag=local.domain_tag,
            is_local=False,
        )
        if decision.allowed and isinstance(handle.grant, Grant):
            self._watch(handle, handle.grant)
        return decision.refusal

    def check_remote_datawriter(
        self, permissions_handle: PermissionsHandle, domain_id: int, publication_data: DiscoveredWriterData
    ) -> Refused | None:
        return self._remote_endpoint(permissions_handle, domain_id, ActionKind.PUBLISH, publication_data).refusal

    def check_remote_datareader(
        self, permissions_handle: PermissionsHandle, domain_id: int, subscription_data: DiscoveredReaderData
    ) -> ReaderAdmission | Refused:
        decision = self._remote_endpoint(permissions_handle, domain_id, ActionKind.SUBSCRIBE, subscription_data)
        if decision.refusal is None:
            return ReaderAdmission()
        relay = self._remote_endpoint(permissions_handle, domain_id, ActionKind.RELAY, subscription_data)
        return ReaderAdmission(relay_only=True) if relay.allowed else decision.refusal

    def check_remote_topic(
        self, permissions_handle: PermissionsHandle, domain_id: int, topic_name: str
    ) -> Refused | None:
        handle = _remote(permissions_handle)
        return self._topic(handle.local, handle.grant, domain_id, topic_name).refusal

    def check_local_datawriter_match(
        self,
        writer_permissions_handle: PermissionsHandle,
        reader_permissions_handle: PermissionsHandle,
        publication_data: DiscoveredWriterData,
        subscription_data: DiscoveredReaderData,
    ) -> Refused | None:
        return None  # §9.4.3: whom each side lets in, it has been asked before

    def check_local_datareader_match(
        self,
        reader_permissions_handle: PermissionsHandle,
        writer_permissions_handle: PermissionsHandle,
        subscription_data: DiscoveredReaderData,
        publication_data: DiscoveredWriterData,
    ) -> Refused | None:
        return None

    def check_remote_datawriter_register_instance(
        self, permissions_handle: PermissionsHandle, reader: Guid, publication: Guid, key: bytes
    ) -> Refused | None:
        return None

    def check_remote_datawriter_dispose_instance(
        self, permissions_handle: PermissionsHandle, reader: Guid, publication: Guid, key: bytes
    ) -> Refused | None:
        return None

    # --- attributes --------------------------------------------------------------------------------------

    def get_participant_sec_attributes(self, permissions_handle: PermissionsHandle) -> ParticipantSecurityAttributes:
        return participant_attributes(_local(permissions_handle).domain_rule)

    def get_topic_sec_attributes(
        self, permissions_handle: PermissionsHandle, topic_name: str
    ) -> TopicSecurityAttributes:
        rule = _local(permissions_handle).domain_rule.topic_rule(topic_name)
        return topic_attributes(rule) if rule is not None else _NO_RULE

    def get_datawriter_sec_attributes(
        self, permissions_handle: PermissionsHandle, topic_name: str, partition: Partition, data_tag: DataTags
    ) -> EndpointSecurityAttributes:
        domain_rule = _local(permissions_handle).domain_rule
        if topic_name in BUILTIN_TOPICS:
            return builtin_endpoint_attributes(domain_rule, topic_name)
        rule = domain_rule.topic_rule(topic_name)
        if rule is None:
            where = f"{titled('governance', domain_rule.document)}, line {domain_rule.line}"
            raise NotAllowedBySecurity(f"{where}: no topic_rule matches topic {shown(topic_name)}")
        return endpoint_attributes(rule)

    def get_datareader_sec_attributes(
        self, permissions_handle: PermissionsHandle, topic_name: str, partition: Partition, data_tag: DataTags
    ) -> EndpointSecurityAttributes:
        return self.get_datawriter_sec_attributes(permissions_handle, topic_name, partition, data_tag)

    # --- expiry ------------------------------------------------------------------------------------------

    def set_listener(self, listener: AccessControlListener | None) -> None:
        self._listener = listener

    def next_deadline(self) -> int | None:
        while self._expiries and self._expiries[0][2] not in self._watched:
            heapq.heappop(self._expiries)
        return self._expiries[0][0] if self._expiries else None

    def handle_timeout(self) -> None:
        now = self._wall_clock()
        while (deadline := self.next_deadline()) is not None and deadline <= now:
            not_after, _, handle = heapq.heappop(self._expiries)
            del self._watched[handle]
            if self._listener is not None:
                self._listener.on_revoke_permissions(self, handle, not_after)

    def _watch(self, handle: PermissionsHandle, grant: Grant) -> None:
        if handle in self._watched:
            return
        if len(self._expiries) > 2 * len(self._watched) + _FEW:
            # Peers come and go, and what was returned waits in the heap for a day that is far away.
            self._expiries = [entry for entry in self._expiries if entry[2] in self._watched]
            heapq.heapify(self._expiries)
        self._watched[handle] = None
        self._watch_count += 1
        heapq.heappush(self._expiries, (grant.validity.not_after, self._watch_count, handle))

    # --- asking the documents ----------------------------------------------------------------------------

    def _held(self, grant: Grant | Refused) -> Grant | Refused:
        """The grant if it holds now."""
        if isinstance(grant, Grant) and (problem := grant.validity.problem(self._wall_clock())):
            return Refused(f"{grant} {problem}")
        return grant

    def _topic(self, local: LocalPermissions, grant: Grant | Refused, domain_id: int, topic: str) -> Decision:
        if topic in BUILTIN_TOPICS:
            return _reserved(topic)
        held = self._held(grant)
        return may_use_topic(local.domain_rule, held, domain_id=domain_id, topic=topic, domain_tag=local.domain_tag)

    def _endpoint(
        self,
        local: LocalPermissions,
        grant: Grant | Refused,
        domain_id: int,
        kind: ActionKind,
        topic: str,
        partition: Partition,
        data_tags: DataTags,
    ) -> Decision:
        if topic in BUILTIN_TOPICS:
            return _reserved(topic)
        if len(partition.names) > _MOST_PARTITIONS:
            return Decision(False, f"an endpoint of topic {shown(topic)} has {len(partition.names)} partitions")
        return may_use_endpoint(
            local.domain_rule,
            self._held(grant),
            domain_id=domain_id,
            kind=kind,
            topic=topic,
            partitions=partition.names,
            data_tags=data_tags,
            domain_tag=local.domain_tag,
        )

    def _remote_endpoint(
        self,
        permissions_handle: PermissionsHandle,
        domain_id: int,
        kind: ActionKind,
        data: DiscoveredWriterData | DiscoveredReaderData,
    ) -> Decision:
        handle = _remote(permissions_handle)
        partition, tags = data.qos.partition, data.qos.data_tags.tags
        return self._endpoint(handle.local, handle.grant, domain_id, kind, data.topic_name, partition, tags)


def _reserved(topic: str) -> Decision:
    """Users' endpoints of builtin topics would be protected by other rules than those of the documents."""
    return Decision(False, f"topic {shown(topic)} is a builtin one; no endpoint of an application may use it")


def _local(handle: PermissionsHandle) -> LocalPermissions:
    assert isinstance(handle, LocalPermissions), "a handle of validate_local_permissions is due"
    return handle


def _remote(handle: PermissionsHandle) -> RemotePermissions:
    assert isinstance(handle, RemotePermissions), "a handle of validate_remote_permissions is due"
    return handle
