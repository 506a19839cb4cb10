"""Who real participants are, what they may do and how they are protected: by our plugins, and by what they say."""

from __future__ import annotations

import struct
from dataclasses import replace
from functools import cache

import pytest
from cryptography import x509

from ddsi.discovery.parameters import decode_reader, decode_writer
from ddsi.serialization import ParameterId
from ddsi.spi import Refused
from ddsi.structure.builtin_entity_ids import (
    SEDP_PUBLICATIONS_SECURE_WRITER,
    SEDP_PUBLICATIONS_WRITER,
    SEDP_SUBSCRIPTIONS_SECURE_WRITER,
    SEDP_SUBSCRIPTIONS_WRITER,
)
from ddsi.structure.discovered import DiscoveredReaderData, DiscoveredWriterData
from ddsi.structure.guid import EntityId, GuidPrefix
from ddsi.structure.qos_policies import Partition
from ddsi_security.access_control import PermissionsAccessControl
from ddsi_security.access_control.governance import Governance
from ddsi_security.access_control.permissions import Permissions
from ddsi_security.access_control.smime import verify
from ddsi_security.access_control.subject_name import SubjectName
from ddsi_security.access_control_plugin import ReaderAdmission
from ddsi_security.announced import info, token, vouched
from ddsi_security.attributes import EndpointSecurityAttributes, ParticipantSecurityAttributes
from ddsi_security.authentication.identities import RemoteIdentityHandle
from ddsi_security.cryptographic.key_material import exchange_key_material
from ddsi_security.handles import Pending, PermissionsHandle
from tests.captures.capture import HERE, SECURED, load
from tests.security.captured.authenticated import (
    NOON,
    Believer,
    announced_participants,
    believers,
    judge_reply,
    judge_request_and_final,
    token_of,
)
from tests.security.captured.handshakes import handshakes
from tests.security.captured.role import endpoint_attributes, participant_attributes
from tests.security.captured.whole import decoded

WRITERS = {SEDP_PUBLICATIONS_WRITER: False, SEDP_PUBLICATIONS_SECURE_WRITER: True}
READERS = {SEDP_SUBSCRIPTIONS_WRITER: False, SEDP_SUBSCRIPTIONS_SECURE_WRITER: True}
"""Which announces endpoints whose discovery is protected."""


@cache
def everybody(name: str) -> tuple[Believer, ...]:
    return tuple(believers(name))


@cache
def admitted(name: str, index: int) -> tuple[PermissionsAccessControl, PermissionsHandle, PermissionsHandle]:
    """Our own permissions and those of the peer, of one of :func:`everybody`."""
    believer = everybody(name)[index]
    plugin = PermissionsAccessControl(believer.properties, entropy=bytes, wall_clock=lambda: NOON)
    local = plugin.validate_local_permissions(believer.plugin, believer.local, 1, believer.properties)
    credential = believer.plugin.get_authenticated_peer_credential_token(believer.handshake)
    token = token_of(believer.peer_data, ParameterId.PERMISSIONS_TOKEN)
    remote = plugin.validate_remote_permissions(believer.plugin, believer.local, believer.peer, token, credential)
    if isinstance(remote, Pending):
        remote = remote.job()
    assert not isinstance(remote, Refused), remote
    return plugin, local, remote


@pytest.mark.parametrize("name", SECURED)
def test_all_believe_each_other_and_agree_on_the_keys(name: str) -> None:
    """Each handshake twice: with the Request and the Final judged as its replier, with the Reply as its initiator."""
    assert len(everybody(name)) == 2 * load(name).facts["counts"]["handshakes"]
    for believer in everybody(name):
        secret = believer.plugin.get_shared_secret(believer.handshake)
        material = exchange_key_material(secret)
        assert secret.shared_secret.hex() == believer.kx["shared_secret"]
        assert bytes(material.master_salt).hex() == believer.kx["master_salt"]
        assert bytes(material.master_sender_key).hex() == believer.kx["master_sender_key"]
        assert believer.plugin.get_subject_name(believer.peer) == f"CN={believer.peer_name},O=Peers"


@pytest.mark.parametrize("name", ["sec-optional-cyclone-cyclone", "sec-rsa-all-cyclone-cyclone"])
def test_each_property_of_a_handshake_counts(name: str) -> None:
    """One octet changed in the middle, before or after what was signed: nobody believes it."""
    as_initiator, as_replier = everybody(name)
    (handshake,) = handshakes(decoded(name).messages)
    for believer, judge, step in (
        (as_initiator, judge_reply, "reply"),
        (as_replier, judge_request_and_final, "request"),
        (as_replier, judge_request_and_final, "final"),
    ):
        assert isinstance(believer.peer, RemoteIdentityHandle)
        for key, value in getattr(handshake, step).items():
            middle = len(value) // 2
            changed = value[:middle] + bytes([value[middle] ^ 1]) + value[middle + 1 :]
            tokens = {"request": handshake.request, "reply": handshake.reply, "final": handshake.final}
            tokens[step] = {**tokens[step], key: changed}
            altered = replace(handshake, request=tokens["request"], reply=tokens["reply"], final=tokens["final"])
            assert isinstance(judge(believer.plugin, believer.peer, altered, believer.kx), Refused), (step, key)


@pytest.mark.parametrize("keystore", ["keystore", "keystore_rsa"])
def test_every_document_of_the_keystores_is_read(keystore: str) -> None:
    folder = HERE / keystore
    authority = x509.load_pem_x509_certificate((folder / "permissions_ca.pem").read_bytes())
    signed = sorted(folder.glob("*.p7s"))
    assert len(signed) in (4, 11)
    for path in signed:
        found = verify(path.read_bytes(), authority, name=path.name)
        clear = path.with_suffix(".xml").read_bytes()
        assert found.xml.replace(b"\r\n", b"\n").strip() == clear.strip()
        if path.name.startswith("governance"):
            rule = Governance.parse(found.xml, name=path.name).domain_rule(1)
            assert rule is not None
            assert rule.topic_rule("Square") is not None
        else:
            subject = SubjectName.parse(f"CN={path.name.partition('.')[0]},O=Peers")
            assert not isinstance(Permissions.parse(found.xml, name=path.name).grant_for(subject, NOON), Refused)


@pytest.mark.parametrize("name", SECURED)
def test_the_rights_of_all_are_verified_and_suffice(name: str) -> None:
    facts = load(name).facts
    for index, believer in enumerate(everybody(name)):
        plugin, local, remote = admitted(name, index)
        assert plugin.check_create_participant(local, 1, believer.properties) is None
        assert plugin.check_remote_participant(remote, 1, believer.peer_data) is None
        assert plugin.check_remote_topic(remote, 1, facts["topic"]) is None
        assert isinstance(plugin.check_remote_topic(remote, 1, "Triangle"), Refused)
        for writer, _ in announced_writers(name, believer.peer_data.guid.prefix):
            assert plugin.check_remote_datawriter(remote, 1, writer) is None
        for reader, _ in announced_readers(name, believer.peer_data.guid.prefix):
            assert plugin.check_remote_datareader(remote, 1, reader) == ReaderAdmission()


@pytest.mark.parametrize("name", SECURED)
def test_participants_announce_the_attributes_that_we_derive(name: str) -> None:
    """DDS-Security 1.1 §7.4.1.6: both masks of PID_PARTICIPANT_SECURITY_INFO."""
    plugin, local, _ = admitted(name, 0)
    ours = masks(plugin.get_participant_sec_attributes(local))
    announced = announced_participants(name)
    assert len(announced) == len(load(name).facts["guids"])
    assert masks(participant_attributes(load(name).facts["governance"])) == ours, "what the crypto plugin was told"
    for data in announced.values():
        assert dict(data.security_parameters)[ParameterId.PARTICIPANT_SECURITY_INFO] == ours


@pytest.mark.parametrize("name", SECURED)
def test_endpoints_announce_the_attributes_that_we_derive(name: str) -> None:
    """§7.4.1.5: both masks of PID_ENDPOINT_SECURITY_INFO; and they are announced where we would look for them."""
    plugin, local, _ = admitted(name, 0)
    prefixes = [GuidPrefix(bytes.fromhex(peer["guid"])[:12]) for peer in load(name).facts["guids"]]
    writers = [found for prefix in prefixes for found in announced_writers(name, prefix)]
    readers = [found for prefix in prefixes for found in announced_readers(name, prefix)]
    assert writers
    assert readers
    for data, is_secure in [*writers, *readers]:
        derive = (
            plugin.get_datawriter_sec_attributes
            if isinstance(data, DiscoveredWriterData)
            else plugin.get_datareader_sec_attributes
        )
        attributes = derive(local, data.topic_name, Partition(), ())
        assert dict(data.security_parameters)[ParameterId.ENDPOINT_SECURITY_INFO] == masks(attributes)
        told = endpoint_attributes(load(name).facts["governance"], data.guid.entity_id)
        assert told.plugin_endpoint_attributes == attributes.plugin_endpoint_attributes
        assert told.is_submessage_protected == attributes.is_submessage_protected
        assert told.is_payload_protected == attributes.is_payload_protected
        assert attributes.is_discovery_protected == is_secure


def masks(attributes: ParticipantSecurityAttributes | EndpointSecurityAttributes) -> bytes:
    if isinstance(attributes, ParticipantSecurityAttributes):
        return struct.pack("<II", attributes.mask, attributes.plugin_participant_attributes)
    return struct.pack("<II", attributes.mask, attributes.plugin_endpoint_attributes)


def announced_writers(name: str, prefix: GuidPrefix) -> list[tuple[DiscoveredWriterData, bool]]:
    """A participant's writers, and whether they were announced on the secure topic."""
    return [
        (decode_writer(payload, b"\0\0"), WRITERS[EntityId(writer_id)])
        for writer_id, source, payload in decoded(name).announcements
        if writer_id in WRITERS and source == prefix
    ]


def announced_readers(name: str, prefix: GuidPrefix) -> list[tuple[DiscoveredReaderData, bool]]:
    return [
        (decode_reader(payload, b"\0\0"), READERS[EntityId(writer_id)])
        for writer_id, source, payload in decoded(name).announcements
        if writer_id in READERS and source == prefix
    ]


@pytest.mark.parametrize("name", SECURED)
def test_what_they_say_in_the_handshake_is_what_they_announced(name: str) -> None:
    """So no vendor's honest participant is another one for what it signed."""
    for believer in everybody(name):
        announced = believer.peer_data.security_parameters
        credential = believer.plugin.get_authenticated_peer_credential_token(believer.handshake)
        said = vouched((), credential.binary_property("c.pdata") or b"")
        assert {pid for pid, _ in said} == {pid for pid, _ in announced}
        for pid in (ParameterId.IDENTITY_TOKEN, ParameterId.PERMISSIONS_TOKEN):
            assert token(said, pid) == token(announced, pid)
        assert info(said, ParameterId.PARTICIPANT_SECURITY_INFO) == info(
            announced, ParameterId.PARTICIPANT_SECURITY_INFO
        )
