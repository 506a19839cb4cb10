"""What applications see of secured participants and their endpoints: who they are, how protected, with which tags."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from ddsi.behavior.stateful_reader import StatefulReader
from ddsi.config.secure import secure
from ddsi.engine import (
    BuiltinTopicChange,
    LocalBuiltinTopicReader,
    participant_data,
    publication_data,
    subscription_data,
)
from ddsi.simulation import Domain, Node
from ddsi.structure.builtin_topic_data import (
    ParticipantBuiltinTopicData,
    PublicationBuiltinTopicData,
    SubscriptionBuiltinTopicData,
    TopicBuiltinTopicData,
)
from ddsi.structure.errors import NotAllowedBySecurity
from ddsi.structure.guid import Guid
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import DataTags, Properties, Reliable, TransientLocal
from ddsi.structure.sample_info import InstanceState
from ddsi.structure.security_information import EndpointSecurity, ParticipantSecurity
from ddsi.structure.status import SecurityRefused
from ddsi_security.access_control.smime import sign_document
from ddsi_security.attributes import PluginEndpointSecurityAttributesMask, PluginParticipantSecurityAttributesMask
from ddsi_security.keystore.authority import Authority

from .keystores import make_identities
from .test_unauthenticated import lenient_identities

RELIABLE = Qos(reliability=Reliable(), durability=TransientLocal())
SECRET, OPEN = ("classification", "secret"), ("classification", "open")
TAGGED = RELIABLE | Qos(data_tags=DataTags(SECRET))


@dataclass
class Window:
    """The builtin topics, as the application of one node sees them."""

    participants: LocalBuiltinTopicReader
    publications: LocalBuiltinTopicReader
    subscriptions: LocalBuiltinTopicReader

    @classmethod
    def of(cls, node: Node) -> Window:
        create = node.engine.builtin_readers.create
        return cls(
            create(ParticipantBuiltinTopicData, node.now),
            create(PublicationBuiltinTopicData, node.now),
            create(SubscriptionBuiltinTopicData, node.now),
        )


SecuredData = ParticipantBuiltinTopicData | PublicationBuiltinTopicData | SubscriptionBuiltinTopicData


def taken(reader: LocalBuiltinTopicReader) -> dict[Guid, tuple[SecuredData, InstanceState]]:
    """The latest of each entity."""
    found = {}
    for info, change in reader.history.take():
        assert isinstance(change, BuiltinTopicChange)
        assert not isinstance(change.data, TopicBuiltinTopicData), "topics have no security"
        found[change.data.key] = (change.data, info.instance_state)
    return found


def _signed(folder: Path, document: bytes) -> bytes:
    """By the authority of this keystore."""
    certificate, key = folder / "public/permissions_ca.cert.pem", folder / "private/permissions_ca.key.pem"
    authority = Authority.parse(certificate.read_bytes(), key.read_bytes(), where="the test's")
    return sign_document(document, authority.certificate, authority.private_key)


def publication_of(reader: LocalBuiltinTopicReader, key: Guid) -> PublicationBuiltinTopicData:
    data, _ = taken(reader)[key]
    assert isinstance(data, PublicationBuiltinTopicData)
    return data


# --- who they are, and how protected --------------------------------------------------------------------------------

PARTICIPANT, ENDPOINT = PluginParticipantSecurityAttributesMask, PluginEndpointSecurityAttributesMask

GOVERNANCES = {
    "encrypt": (
        ParticipantSecurity(
            is_rtps_protected=True,
            is_discovery_protected=True,
            is_liveliness_protected=True,
            plugin_attributes=PARTICIPANT.IS_VALID
            | PARTICIPANT.IS_DISCOVERY_ENCRYPTED
            | PARTICIPANT.IS_LIVELINESS_ENCRYPTED,
        ),
        EndpointSecurity(
            is_read_protected=True,
            is_write_protected=True,
            is_discovery_protected=True,
            is_liveliness_protected=True,
            is_submessage_protected=True,
            is_payload_protected=True,
            is_key_protected=True,
            plugin_attributes=ENDPOINT.IS_VALID | ENDPOINT.IS_SUBMESSAGE_ENCRYPTED | ENDPOINT.IS_PAYLOAD_ENCRYPTED,
        ),
    ),
    "payload": (
        ParticipantSecurity(plugin_attributes=PARTICIPANT.IS_VALID),
        EndpointSecurity(
            is_read_protected=True,
            is_write_protected=True,
            is_payload_protected=True,
            is_key_protected=True,
            plugin_attributes=ENDPOINT.IS_VALID | ENDPOINT.IS_PAYLOAD_ENCRYPTED,
        ),
    ),
}


@pytest.mark.parametrize("governance", GOVERNANCES)
def test_identity_and_protection_are_seen_of_others_and_of_oneself(tmp_path: Path, governance: str) -> None:
    """DDS-Security 1.1 §7.4.1.4 to §7.4.1.8."""
    domain = Domain(1)
    alice, bob = (domain.node(properties=properties) for properties in make_identities(tmp_path, governance)[:2])
    window = Window.of(bob)
    writer, reader = alice.writer("Square", RELIABLE), alice.reader("Circle", RELIABLE)
    own = bob.reader("Square", RELIABLE)
    assert domain.run_until(lambda: own.matched_count == 1, 20)
    domain.run(1.0)
    of_participant, of_endpoint = GOVERNANCES[governance]
    ((who, state),) = taken(window.participants).values()
    assert isinstance(who, ParticipantBuiltinTopicData)
    assert (who.key, state) == (alice.guid, InstanceState.ALIVE)
    identity, permissions = who.security.identity_token, who.security.permissions_token
    assert identity.class_id.startswith("DDS:Auth:PKI-DH:1.")
    assert permissions.class_id.startswith("DDS:Access:Permissions:1.")
    assert who.security == replace(
        of_participant,
        is_authenticated=True,
        subject_name="CN=alice",
        identity_token=identity,
        permissions_token=permissions,
    )
    expected = replace(of_endpoint, is_authenticated=True, subject_name="CN=alice")
    publication = publication_of(window.publications, writer.guid)
    ((subscription, _),) = taken(window.subscriptions).values()
    assert subscription.key == reader.guid
    assert publication.security == subscription.security == expected

    hooks, engine = bob.engine.hooks, bob.engine
    assert publication == publication_data(own.local.behavior.writers[writer.guid].data, hooks), "behind the handle"
    of_own = subscription_data(own.local.data, hooks)
    assert of_own.security == replace(expected, subject_name="CN=bob")
    assert participant_data(engine.discovery.data, hooks).security.subject_name == "CN=bob"


def test_who_leaves_is_still_known_by_name(tmp_path: Path) -> None:
    domain = Domain(1)
    alice, bob = (domain.node(properties=properties) for properties in make_identities(tmp_path, "encrypt")[:2])
    window = Window.of(bob)
    domain.run(10.0)
    alice.close()
    domain.run(1.0)
    ((who, state),) = taken(window.participants).values()
    assert isinstance(who, ParticipantBuiltinTopicData)
    assert (who.security.subject_name, state) == ("CN=alice", InstanceState.NOT_ALIVE_DISPOSED)


def test_nobody_is_shown_before_he_has_proved_who_he_is(tmp_path: Path) -> None:
    domain = Domain(1)
    alice = domain.node(properties=make_identities(tmp_path, "encrypt")[0])
    window = Window.of(alice)
    stranger = domain.node()
    stranger.writer("Square", RELIABLE)
    domain.run(5.0)
    assert stranger.guid.prefix in alice.engine.participants
    assert [taken(reader) for reader in (window.participants, window.publications)] == [{}, {}]
    assert alice.engine.hooks.participant_security(stranger.guid) == ParticipantSecurity()


def test_strangers_who_are_let_in_are_shown_as_such(tmp_path: Path) -> None:
    domain = Domain(1)
    alice, bob = (domain.node(properties=properties) for properties in lenient_identities(tmp_path))
    window = Window.of(alice)
    stranger = domain.node()
    claimed = stranger.writer("Open", RELIABLE)
    proved = bob.writer("Closed", RELIABLE)
    proved_openly = bob.writer("Open", RELIABLE)
    domain.run(10.0)
    names = {key: data.security.subject_name for key, (data, _) in taken(window.participants).items()}
    assert names == {bob.guid: "CN=bob", stranger.guid: ""}
    publications = taken(window.publications)
    assert publications[claimed.guid][0].security == EndpointSecurity()
    open_security, closed_security = (publications[key][0].security for key in (proved_openly.guid, proved.guid))
    assert isinstance(open_security, EndpointSecurity)
    assert isinstance(closed_security, EndpointSecurity)
    assert open_security.is_authenticated
    assert not open_security.is_discovery_protected, "anybody could have announced it in his name"
    assert closed_security.is_discovery_protected


def test_an_endpoint_of_a_topic_without_a_rule_is_shown_and_not_said_to_be_protected_on_its_way(tmp_path: Path) -> None:
    """Nobody here can use the topic; but whoever announces it must not hide by that (§9.4.1.2.6)."""
    properties = make_identities(tmp_path, "encrypt")
    xml = (tmp_path / "enclaves/governance.xml").read_bytes()
    everything = b"<topic_expression>*</topic_expression>"
    assert everything in xml
    only_square = xml.replace(everything, b"<topic_expression>Square</topic_expression>")
    (tmp_path / "enclaves/bob/governance.p7s").unlink()
    (tmp_path / "enclaves/bob/governance.p7s").write_bytes(_signed(tmp_path, only_square))
    domain = Domain(1)
    alice, bob = (domain.node(properties=of_identity) for of_identity in properties[:2])
    window = Window.of(bob)
    writer = alice.writer("Circle", RELIABLE)
    domain.run(10.0)
    assert publication_of(window.publications, writer.guid).security == EndpointSecurity(
        is_authenticated=True,
        subject_name="CN=alice",
        is_read_protected=True,
        is_write_protected=True,
        is_discovery_protected=True,
        is_liveliness_protected=True,
    )


# --- data tags ------------------------------------------------------------------------------------------------------


def with_tag(folder: Path, identity: str) -> Properties:
    """The properties of an identity whose permissions are for endpoints that have no tag but SECRET."""
    enclave = folder / "enclaves" / identity
    xml = (enclave / "permissions.xml").read_text(encoding="utf-8")
    name, value = SECRET
    tags = f"<data_tags><tag><name>{name}</name><value>{value}</value></tag></data_tags>"
    for criterion in ("</publish>", "</subscribe>"):
        assert criterion in xml
        xml = xml.replace(criterion, tags + criterion)
    (enclave / "permissions.p7s").write_bytes(_signed(folder, xml.encode()))
    properties = secure(enclave).properties
    assert properties is not None
    return properties


def tagged_domain(folder: Path) -> tuple[Domain, Node, Node]:
    """Alice and Bob, who may publish and subscribe what is tagged SECRET."""
    make_identities(folder, "encrypt")
    domain = Domain(1)
    return domain, domain.node(properties=with_tag(folder, "alice")), domain.node(properties=with_tag(folder, "bob"))


def test_tags_that_permissions_name_match_and_are_seen(tmp_path: Path) -> None:
    """DDS-Security 1.1 §7.2.5, §9.4.1.3.2.3."""
    domain, alice, bob = tagged_domain(tmp_path)
    window = Window.of(bob)
    writer, reader = alice.writer("Square", TAGGED), bob.reader("Square", TAGGED)
    assert domain.run_until(lambda: reader.matched_count == writer.matched_count == 1, 20)
    publication = publication_of(window.publications, writer.guid)
    assert publication.data_tags == (SECRET,)
    assert publication.security.is_discovery_protected
    assert publication_data(reader.local.behavior.writers[writer.guid].data, bob.engine.hooks) == publication


def other_tag() -> Qos:
    return RELIABLE | Qos(data_tags=DataTags(OPEN))


def test_a_local_endpoint_with_another_tag_is_refused_in_the_call(tmp_path: Path) -> None:
    _, alice, _ = tagged_domain(tmp_path)
    engine = alice.engine
    before = len(engine.local_writers), len(engine.local_readers)
    right = "'Square' with data tags 'classification=open'"
    with pytest.raises(NotAllowedBySecurity, match=f"permissions.p7s, grant 'alice' .* Missing right: publish {right}"):
        alice.writer("Square", other_tag())
    with pytest.raises(NotAllowedBySecurity, match=f"grant 'alice' .* Missing right: subscribe {right}"):
        alice.reader("Square", other_tag())
    assert (len(engine.local_writers), len(engine.local_readers)) == before


@pytest.mark.parametrize("action", ["publish", "subscribe"])
def test_a_remote_endpoint_with_another_tag_is_refused_with_the_reason_and_shown_but_not_as_matched(
    tmp_path: Path, action: str
) -> None:
    """Its participant does not check itself; but we ask its permissions, which came with its handshake."""
    domain, alice, bob = tagged_domain(tmp_path)
    window = Window.of(bob)
    own = alice.engine.hooks._own  # type: ignore[attr-defined]
    own._check_writer = own._check_reader = lambda data: data.qos.data_tags.tags
    theirs = alice.writer if action == "publish" else alice.reader
    ours = bob.reader if action == "publish" else bob.writer
    remote, local = theirs("Square", other_tag()), ours("Square", TAGGED)
    domain.run(10.0)
    assert (local.matched_count, remote.matched_count) == (0, 0)
    (refusal,) = bob.statuses_of(SecurityRefused)
    assert isinstance(refusal, SecurityRefused)
    assert refusal.remote == remote.guid
    assert "permissions of 'CN=alice', as received, grant 'alice'" in refusal.reason
    assert refusal.reason.endswith(f"Missing right: {action} 'Square' with data tags 'classification=open'")
    assert bob.engine.matchmaker.refusals[(local.guid, remote.guid)].offered == refusal.reason
    behavior = local.local.behavior
    assert remote.guid not in (behavior.writers if isinstance(behavior, StatefulReader) else behavior.readers)
    ((shown, _),) = taken(window.publications if action == "publish" else window.subscriptions).values()
    assert isinstance(shown, PublicationBuiltinTopicData | SubscriptionBuiltinTopicData)
    assert (shown.key, shown.data_tags) == (remote.guid, (OPEN,))
