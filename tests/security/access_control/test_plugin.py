"""The plugin: documents in, answers out, for several participants with rights of their own, and until they expire."""

from __future__ import annotations

import inspect
import itertools
from collections.abc import Mapping
from pathlib import Path

import pytest
from cryptography.hazmat.primitives.serialization import Encoding
from hypothesis import given
from hypothesis import strategies as st

from ddsi.spi import Refused
from ddsi.structure.discovered import DiscoveredParticipantData, DiscoveredReaderData, DiscoveredWriterData
from ddsi.structure.errors import ConfigurationError, NotAllowedBySecurity
from ddsi.structure.guid import Guid
from ddsi.structure.qos import EndpointQos
from ddsi.structure.qos_policies import DataTags as DataTagsPolicy
from ddsi.structure.qos_policies import Partition
from ddsi_security.access_control import PermissionsAccessControl
from ddsi_security.access_control.document_error import DocumentError, UntrustedDocument
from ddsi_security.access_control.sec_attributes import BUILTIN_TOPICS
from ddsi_security.access_control.smime import sign_document
from ddsi_security.access_control.validity import parse_instant
from ddsi_security.access_control_plugin import AccessControl, ReaderAdmission
from ddsi_security.attributes import DataTags, EndpointSecurityAttributes
from ddsi_security.authentication_plugin import Authentication
from ddsi_security.conformance import objections
from ddsi_security.handles import IdentityHandle, Pending, PermissionsHandle
from ddsi_security.tokens import NIL, DataHolder
from tests.security.access_control.documents import NOW, authority, governance_xml, permissions_xml

KEYSTORE = Path(__file__).parents[2] / "captures" / "keystore"
CLASS_ID = "DDS:Access:Permissions:1.0"
TOKEN = DataHolder(CLASS_ID)
UNSPECIFIED = Partition()
QOS = EndpointQos()
END = parse_instant("2037-12-31T00:00:00Z")
DOMAINS = "<domains><id_range><min>0</min><max>230</max></id_range></domains>"


def rules(**topics: str) -> str:
    """``rules(publish="Square")``: an allow rule for each."""
    return "".join(
        f"<allow_rule>{DOMAINS}<{kind}><topics><topic>{topic}</topic></topics></{kind}></allow_rule>"
        for kind, topic in topics.items()
    )


def sign(xml: bytes, ca: str = "ec") -> bytes:
    return sign_document(xml, *authority(ca))


def properties(governance: bytes | None = None, permissions: bytes | None = None, ca: str = "ec") -> dict[str, str]:
    documents = {
        "dds.sec.access.permissions_ca": authority(ca)[0].public_bytes(Encoding.PEM),
        "dds.sec.access.governance": sign(governance if governance is not None else governance_xml(), ca),
        "dds.sec.access.permissions": sign(permissions if permissions is not None else permissions_xml(), ca),
    }
    return {name: f"data:,{octets.decode()}" for name, octets in documents.items()}


class Subjects:
    """As much of an Authentication plugin as access control asks: whose subject name is it?"""

    def __init__(self) -> None:
        self.names: dict[IdentityHandle, str] = {}

    def identity(self, name: str) -> IdentityHandle:
        handle = IdentityHandle()
        self.names[handle] = name
        return handle

    def get_subject_name(self, handle: IdentityHandle) -> str:
        return self.names[handle]


class Party:
    """A participant in domain 0 with a plugin of its own."""

    def __init__(
        self,
        configuration: Mapping[str, str] | None = None,
        *,
        name: str = "CN=alice,O=Tests",
        domain_id: int = 0,
        domain_tag: str = "",
        now: int = NOW,
    ) -> None:
        self.now = now
        self.domain_id = domain_id
        self.subjects = Subjects()
        self.plugin = PermissionsAccessControl({}, entropy=bytes, wall_clock=lambda: self.now)
        self.identity = self.subjects.identity(name)
        self.local = self.plugin.validate_local_permissions(
            self.authentication,
            self.identity,
            domain_id,
            configuration if configuration is not None else properties(),
            domain_tag=domain_tag,
        )

    @property
    def authentication(self) -> Authentication:
        return self.subjects  # type: ignore[return-value]

    def joins(self) -> Refused | None:
        return self.plugin.check_create_participant(self.local, self.domain_id, {})

    def writes(self, topic: str, *partitions: str, tags: DataTags = ()) -> Refused | None:
        return self.plugin.check_create_datawriter(self.local, 0, topic, QOS, Partition(*partitions), tags)

    def reads(self, topic: str, *partitions: str, tags: DataTags = ()) -> Refused | None:
        return self.plugin.check_create_datareader(self.local, 0, topic, QOS, Partition(*partitions), tags)

    def meets(
        self, document: bytes, *, name: str = "CN=bob,O=Tests", token: DataHolder = TOKEN, as_text: bool = False
    ) -> PermissionsHandle | Refused:
        """Validate a remote's permissions, running the job."""
        text = (("c.perm", document.decode()),) if as_text else ()
        binary = () if as_text else (("c.perm", document),)
        credential = DataHolder("DDS:Auth:PKI-DH:1.0+AuthPeerCred", text, binary)
        pending = self.plugin.validate_remote_permissions(
            self.authentication, self.identity, self.subjects.identity(name), token, credential
        )
        assert isinstance(pending, Pending)
        result = pending.job()
        assert not isinstance(result, Pending)
        return result

    def admits(self, handle: PermissionsHandle) -> Refused | None:
        return self.plugin.check_remote_participant(handle, 0, DiscoveredParticipantData(guid=GUID))

    def met(self, permissions: str, **options: str) -> PermissionsHandle:
        """A remote that may do what the rules say."""
        result = self.meets(sign(permissions_xml(permissions, subject="CN=bob,O=Tests", name="bob", **options)))
        assert isinstance(result, PermissionsHandle), result
        assert self.admits(result) is None
        return result


GUID = Guid(bytes(range(16)))


def writer(topic: str, *partitions: str, tags: DataTags = ()) -> DiscoveredWriterData:
    return DiscoveredWriterData(
        guid=GUID,
        topic_name=topic,
        type_name="T",
        qos=EndpointQos(partition=Partition(*partitions), data_tags=DataTagsPolicy(*tags)),
    )


def reader(topic: str, *partitions: str) -> DiscoveredReaderData:
    return DiscoveredReaderData(
        guid=GUID, topic_name=topic, type_name="T", qos=EndpointQos(partition=Partition(*partitions))
    )


def refusal(answer: object) -> str:
    assert isinstance(answer, Refused), answer
    return answer.reason


# --- the interface -------------------------------------------------------------------------------------------


def test_it_is_an_access_control_plugin() -> None:
    plugin: AccessControl = PermissionsAccessControl({}, entropy=bytes, wall_clock=lambda: 0)
    assert objections(plugin, AccessControl) == []
    assert PermissionsAccessControl.plugin_version == 1
    assert "entropy" in inspect.signature(PermissionsAccessControl).parameters


# --- local documents -----------------------------------------------------------------------------------------


def captured(folder: Path, name: str) -> dict[str, str]:
    return {
        "dds.sec.access.permissions_ca": f"file:{folder / 'permissions_ca.pem'}",
        "dds.sec.access.governance": f"file:{folder / 'governance.p7s'}",
        "dds.sec.access.permissions": f"file:{folder / name}.permissions.p7s",
    }


@pytest.mark.parametrize("keystore", ["keystore", "keystore_rsa"])
@pytest.mark.parametrize("name", ["alice", "bob", "carol"])
def test_the_keystores_of_the_captures_are_usable(keystore: str, name: str) -> None:
    folder = KEYSTORE.parent / keystore
    party = Party(captured(folder, name), name=f"CN={name},O=Peers")
    assert party.joins() is None
    assert party.reads("Square", "any") is None
    denied = party.writes("Square", "any")
    assert (denied is None) == (name != "carol")
    if denied is not None:
        assert f"{name}.permissions.p7s, grant 'carol' (line 12): no allow rule lets it publish" in denied.reason
        assert "Missing right: publish 'Square'" in denied.reason
    assert "Missing right: publish 'Other'" in refusal(party.writes("Other"))


def test_fast_dds_spellings_of_the_properties_serve() -> None:
    prefix = "dds.sec.access.builtin.Access-Permissions."
    assert Party({prefix + name.rpartition(".")[2]: value for name, value in properties().items()}).joins() is None


DOCUMENTS = {"permissions_ca", "governance", "permissions"}


@pytest.mark.parametrize("left_out", [{"permissions_ca"}, {"governance", "permissions"}, DOCUMENTS])
@pytest.mark.parametrize("how", ["absent", "empty"])
def test_missing_documents_are_named(left_out: set[str], how: str) -> None:
    given_properties = properties()
    for name in left_out:
        given_properties.pop(f"dds.sec.access.{name}")
        if how == "empty":
            given_properties[f"dds.sec.access.{name}"] = ""
    with pytest.raises(ConfigurationError) as caught:
        Party(given_properties)
    for name in DOCUMENTS:
        assert (f"dds.sec.access.{name} " in f"{caught.value} ".replace(":", " ")) == (name in left_out)


BROKEN = {
    "unsigned governance": ({"dds.sec.access.governance": f"data:,{governance_xml().decode()}"}, "without a signature"),
    "no certificate": ({"dds.sec.access.permissions_ca": "data:,x"}, "no certificate in PEM"),
    "two certificates": (
        {"dds.sec.access.permissions_ca": "data:," + authority()[0].public_bytes(Encoding.PEM).decode() * 2},
        "has 2 certificates",
    ),
    "no such file": ({"dds.sec.access.governance": "file:/no/such.p7s"}, "cannot read /no/such.p7s"),
    "another CA": (
        {"dds.sec.access.permissions_ca": "data:," + authority("rsa")[0].public_bytes(Encoding.PEM).decode()},
        "another certificate",
    ),
    "exchanged": ({"dds.sec.access.governance": properties()["dds.sec.access.permissions"]}, "not governance"),
    "unknown property": ({"dds.sec.access.goverance": "x"}, "did you mean dds.sec.access.governance"),
}


@pytest.mark.parametrize(("change", "reason"), BROKEN.values(), ids=BROKEN)
def test_documents_that_cannot_be_used_are_configuration_errors(change: dict[str, str], reason: str) -> None:
    with pytest.raises(ConfigurationError, match=reason):
        Party(properties() | change)


@pytest.mark.parametrize(
    ("governance", "permissions", "reason"),
    [
        (governance_xml(domains="<id>7</id>"), None, "no domain_rule for domain 0, only for line 12: domains 7"),
        (
            governance_xml(unauthenticated="true", rtps="SIGN"),
            None,
            "domain_rule 1: rtps_protection_kind SIGN",
        ),
        (governance_xml(more="<rtps_psk_protection_kind>SIGN</rtps_psk_protection_kind>"), None, "is not implemented"),
        (governance_xml(more="<enable_key_revision>TRUE</enable_key_revision>"), None, "is not implemented"),
        (None, permissions_xml(subject="CN=bob"), "no grant is for the subject CN=alice,O=Tests"),
        (None, permissions_xml(end="2025-01-01T00:00:00Z"), "expired at 2025-01-01T00:00:00Z"),
        (None, permissions_xml(begin="2030-01-01T00:00:00Z"), "not valid before 2030-01-01T00:00:00Z"),
    ],
)
def test_documents_that_do_not_fit_are_configuration_errors(
    governance: bytes | None, permissions: bytes | None, reason: str
) -> None:
    with pytest.raises(ConfigurationError, match=reason):
        Party(properties(governance, permissions))


def test_what_of_1_2_is_turned_off_is_no_hindrance() -> None:
    more = """<rtps_psk_protection_kind>NONE</rtps_psk_protection_kind><enable_key_revision>0</enable_key_revision>
        <allowed_crypto_algorithms must_interpret="false"><symmetric_cipher><algorithm>AES128+GCM</algorithm>
        </symmetric_cipher></allowed_crypto_algorithms>"""
    assert Party(properties(governance_xml(more=more))).joins() is None


def test_no_error_shows_what_a_data_uri_holds() -> None:
    with pytest.raises(UntrustedDocument) as caught:
        Party(properties() | {"dds.sec.access.governance": "data:,Content-Type: text/plain\n\nsecret\n"})
    assert "secret" not in str(caught.value)
    assert caught.value.document == "governance in the data: URI"


# --- local checks ----------------------------------------------------------------------------------------------


def test_an_endpoint_needs_the_right_for_its_topic_and_all_of_its_partitions() -> None:
    party = Party(properties(permissions=permissions_xml(rules(publish="Square", subscribe="Circle"))))
    assert party.writes("Square") is None
    assert party.reads("Circle") is None
    assert "Missing right: publish 'Circle'" in refusal(party.writes("Circle"))
    assert "Missing right: subscribe 'Square'" in refusal(party.reads("Square"))
    assert "Missing right: publish 'Square' in partition 'p'" in refusal(party.writes("Square", "p"))
    assert "with data tags 'a=b'" in refusal(party.writes("Square", tags=(("a", "b"),)))
    assert party.plugin.check_create_topic(party.local, 0, "Circle", QOS) is None
    assert "Missing right" in refusal(party.plugin.check_create_topic(party.local, 0, "Other", QOS))


def test_a_reader_may_exist_to_relay() -> None:
    party = Party(properties(permissions=permissions_xml(rules(relay="Square"))))
    assert party.reads("Square") is None
    assert "Missing right: publish 'Square'" in refusal(party.writes("Square"))


@pytest.mark.parametrize(("read", "write"), list(itertools.product(["true", "false"], repeat=2)))
@pytest.mark.parametrize("join", ["true", "false"])
def test_what_governance_leaves_open_needs_no_permission(read: str, write: str, join: str) -> None:
    """The table of 8.4.2.9.3: joining is open as soon as one topic is, or join access control is off."""
    governance = governance_xml(read=read, write=write, join=join)
    party = Party(properties(governance, permissions_xml("")))
    assert (party.reads("Any", "p") is None) == (read == "false")
    assert (party.writes("Any", "p") is None) == (write == "false")
    assert (party.plugin.check_create_topic(party.local, 0, "Any", QOS) is None) == ("false" in (read, write))
    assert (party.joins() is None) == ("false" in (read, write, join))


def test_a_topic_without_a_rule_is_for_nobody() -> None:
    party = Party(properties(governance_xml(topics=("Square", "S*"), read="false", write="false")))
    reason = refusal(party.writes("Circle"))
    assert "no topic_rule matches topic 'Circle'; its topic_expressions are 'Square', 'S*'" in reason
    with pytest.raises(NotAllowedBySecurity, match="no topic_rule matches topic 'Circle'"):
        party.plugin.get_datawriter_sec_attributes(party.local, "Circle", UNSPECIFIED, ())
    # Peers may announce such topics, so that the core's question is no mistake of the application's.
    assert party.plugin.get_topic_sec_attributes(party.local, "Circle").is_discovery_protected


@pytest.mark.parametrize("topic", sorted(BUILTIN_TOPICS))
def test_builtin_topics_are_not_for_applications(topic: str) -> None:
    party = Party(properties(governance_xml(read="false", write="false")))
    remote = party.met(rules(publish="*", subscribe="*"))
    for answer in (
        party.writes(topic),
        party.reads(topic),
        party.plugin.check_create_topic(party.local, 0, topic, QOS),
        party.plugin.check_remote_datawriter(remote, 0, writer(topic)),
        party.plugin.check_remote_datareader(remote, 0, reader(topic)),
        party.plugin.check_remote_topic(remote, 0, topic),
    ):
        assert "is a builtin one" in refusal(answer)


def test_the_log_topic_has_a_rule_of_its_own() -> None:
    """Everybody may log, whatever the documents say; reading needs the right."""
    party = Party(properties(governance_xml(topics=("Square",)), permissions_xml(rules(subscribe="Square"))))
    for topic in ("DDS:Security:LogTopic", "DDS:Security:LogTopicV2"):
        assert party.writes(topic) is None
        assert f"Missing right: subscribe '{topic}'" in refusal(party.reads(topic))
        attributes = party.plugin.get_datareader_sec_attributes(party.local, topic, UNSPECIFIED, ())
        assert attributes.is_read_protected
        assert not attributes.is_write_protected
        assert not attributes.is_discovery_protected
        assert (attributes.mask, attributes.plugin_endpoint_attributes) == (0x80000039, 0x80000002)


def test_instances_are_free() -> None:
    party = Party()
    remote = party.met(rules(publish="*"))
    assert party.plugin.check_local_datawriter_register_instance(party.local, GUID, b"k") is None
    assert party.plugin.check_local_datawriter_dispose_instance(party.local, GUID, b"k") is None
    assert party.plugin.check_remote_datawriter_register_instance(remote, GUID, GUID, b"k") is None
    assert party.plugin.check_remote_datawriter_dispose_instance(remote, GUID, GUID, b"k") is None
    assert party.plugin.check_local_datawriter_match(party.local, remote, writer("T"), reader("T")) is None
    assert party.plugin.check_local_datareader_match(party.local, remote, reader("T"), writer("T")) is None


def test_rules_for_domain_tags() -> None:
    governance = governance_xml(domains="<id>0</id><tag>red</tag>")
    assert Party(properties(governance), domain_tag="red").joins() is None
    with pytest.raises(ConfigurationError, match="no domain_rule for domain 0 with the tag 'blue'"):
        Party(properties(governance), domain_tag="blue")


# --- peers -------------------------------------------------------------------------------------------------------


def test_a_peer_is_checked_by_our_governance_and_its_permissions() -> None:
    party = Party()
    remote = party.met(rules(publish="Square", subscribe="Circle", relay="Triangle"))
    check_writer, check_reader = party.plugin.check_remote_datawriter, party.plugin.check_remote_datareader
    assert check_writer(remote, 0, writer("Square")) is None
    assert check_reader(remote, 0, reader("Circle")) == ReaderAdmission()
    assert check_reader(remote, 0, reader("Triangle")) == ReaderAdmission(relay_only=True)
    assert party.plugin.check_remote_topic(remote, 0, "Circle") is None
    reason = refusal(check_writer(remote, 0, writer("Circle")))
    assert reason.startswith("permissions of 'CN=bob,O=Tests', as received, grant 'bob' (line 12): no allow rule")
    assert "Missing right: subscribe 'Square'" in refusal(check_reader(remote, 0, reader("Square")))
    assert "in partition 'p'" in refusal(check_writer(remote, 0, writer("Square", "p")))
    assert "with data tags 'a=b'" in refusal(check_writer(remote, 0, writer("Square", tags=(("a", "b"),))))
    assert "Missing right" in refusal(party.plugin.check_remote_topic(remote, 0, "Other"))


def test_a_partition_that_changed_is_checked_anew() -> None:
    party = Party()
    remote = party.met(rules(publish="Square"))
    assert party.plugin.check_remote_datawriter(remote, 0, writer("Square")) is None
    assert party.plugin.check_remote_datawriter(remote, 0, writer("Square", "elsewhere")) is not None


@pytest.mark.parametrize("keystore", ["keystore", "keystore_rsa"])
@pytest.mark.parametrize("end", [b"", b"\0", b"\r\n\0"])
def test_documents_as_vendors_send_them_are_read(keystore: str, end: bytes) -> None:
    """Cyclone DDS and OpenDDS send a NUL behind the document."""
    folder = KEYSTORE.parent / keystore
    party = Party(captured(folder, "alice"), name="CN=alice,O=Peers")
    document = (folder / "carol.permissions.p7s").read_bytes() + end
    for as_text in (False, True):
        remote = party.meets(document, name="O=Peers,CN=carol", as_text=as_text)
        assert isinstance(remote, PermissionsHandle)
        assert party.plugin.check_remote_datareader(remote, 0, reader("Square")) == ReaderAdmission()
        assert party.plugin.check_remote_datawriter(remote, 0, writer("Square")) is not None


BOB = permissions_xml(subject="CN=bob,O=Tests")
REFUSED_PEERS = {
    "no document": (b"", TOKEN, "there are none"),
    "blank": (b" \0", TOKEN, "there are none"),
    "unsigned": (BOB, TOKEN, "without a signature"),
    "another CA": (sign(BOB, "rsa"), TOKEN, "another certificate"),
    "another's": (sign(permissions_xml()), TOKEN, "no grant is for the subject CN=bob,O=Tests"),
    "governance": (sign(governance_xml()), TOKEN, "it is a governance document"),
    "expired": (sign(BOB.replace(b"2037-12", b"2025-12")), TOKEN, "expired at 2025"),
    "not yet": (
        sign(BOB.replace(b"2020-01", b"2030-01")),
        TOKEN,
        "not valid before",
    ),
    "an entity": (sign(BOB.replace(b"<dds", b"<!DOCTYPE dds><dds")), TOKEN, "line 10: a document type declaration"),
    "no token": (sign(BOB), NIL, "announces no permissions token"),
    "another plugin": (
        sign(BOB),
        DataHolder("Acme:Access:1.0"),
        "is 'Acme:Access:1.0', ours is DDS:Access:Perm",
    ),
    "another major": (sign(BOB), DataHolder("DDS:Access:Permissions:2.0"), "ours is"),
    "a hostile class id": (sign(BOB), DataHolder(":" * 9000 + "9" * 9000), "ours is"),
}


@pytest.mark.parametrize(("document", "token", "reason"), REFUSED_PEERS.values(), ids=REFUSED_PEERS)
def test_peers_without_usable_permissions_are_refused(document: bytes, token: DataHolder, reason: str) -> None:
    assert reason in refusal(Party().meets(document, token=token))
    # Without join access control they come in, and may do what everybody may.
    open_to_all = Party(properties(governance_xml(join="false", read="false")))
    remote = open_to_all.meets(document, token=token)
    assert isinstance(remote, PermissionsHandle)
    assert open_to_all.admits(remote) is None
    assert open_to_all.plugin.check_remote_datareader(remote, 0, reader("T")) == ReaderAdmission()
    assert reason in refusal(open_to_all.plugin.check_remote_datawriter(remote, 0, writer("T")))


@pytest.mark.parametrize(
    "class_id", ["DDS:Access:Permissions", "DDS:Access:Permissions:1.2", "dds:access:permissions:1.0", CLASS_ID + "+x"]
)
def test_other_minor_versions_are_welcome(class_id: str) -> None:
    assert isinstance(Party().meets(sign(BOB), token=DataHolder(class_id)), PermissionsHandle)


def test_a_peer_without_an_allow_rule_for_the_domain_may_not_join() -> None:
    """Nor where some topic is open to all, though a local participant may then (DDSSEC12-85)."""
    elsewhere = rules(publish="*").replace("<min>0</min>", "<min>1</min>")
    document = sign(permissions_xml(elsewhere, subject="CN=bob,O=Tests"))
    for party in (Party(), Party(properties(governance_xml(read="false")))):
        remote = party.meets(document)
        assert isinstance(remote, PermissionsHandle)
        assert "its allow rules are for domains 1 to 230. Missing right: join domain 0" in refusal(party.admits(remote))


_PARTY = (lambda party: (party, party.met(rules(publish="*"))))(Party())


def test_endless_partitions_are_refused() -> None:
    party, remote = _PARTY
    names = [str(number) for number in range(300)]
    assert "has 300 partitions" in refusal(party.plugin.check_remote_datawriter(remote, 0, writer("T", *names)))


@given(st.binary(max_size=300), st.text(max_size=30), st.text(max_size=30))
def test_hostile_credentials_are_refused(document: bytes, name: str, class_id: str) -> None:
    refusal(_PARTY[0].meets(document, name=name))
    refusal(_PARTY[0].meets(sign(BOB), name=name, token=DataHolder(class_id)))


# --- tokens --------------------------------------------------------------------------------------------------------


def test_tokens_are_those_that_every_vendor_takes() -> None:
    configuration = properties()
    party = Party(configuration)
    assert party.plugin.get_permissions_token(party.local) == TOKEN
    credential = party.plugin.get_permissions_credential_token(party.local)
    assert credential.class_id == "DDS:Access:PermissionsCredential"
    document = configuration["dds.sec.access.permissions"].removeprefix("data:,")
    assert credential.property("dds.perm.cert") == document
    assert credential.binary_property("dds.perm.cert") == document.encode()


# --- attributes ----------------------------------------------------------------------------------------------------

KINDS = {
    # kind: (is protected, is encrypted, is origin authenticated)
    "NONE": (0, 0, 0),
    "SIGN": (1, 0, 0),
    "ENCRYPT": (1, 1, 0),
    "SIGN_WITH_ORIGIN_AUTHENTICATION": (1, 0, 1),
    "ENCRYPT_WITH_ORIGIN_AUTHENTICATION": (1, 1, 1),
}


@pytest.mark.parametrize(("what", "bit"), [("rtps", 0), ("discovery", 1), ("liveliness", 2)])
@pytest.mark.parametrize(("kind", "bits"), KINDS.items())
def test_participant_masks(what: str, bit: int, kind: str, bits: tuple[int, int, int]) -> None:
    governance = governance_xml(rtps="NONE", discovery="NONE", liveliness="NONE")
    element = f"<{what}_protection_kind>".encode()
    party = Party(properties(governance.replace(element + b"NONE", element + kind.encode())))
    attributes = party.plugin.get_participant_sec_attributes(party.local)
    assert attributes.mask == 1 << 31 | bits[0] << bit
    assert attributes.plugin_participant_attributes == 1 << 31 | bits[1] << bit | bits[2] << bit + 3


@pytest.mark.parametrize(("kind", "bits"), KINDS.items())
@pytest.mark.parametrize("data", ["NONE", "SIGN", "ENCRYPT"])
def test_endpoint_masks(kind: str, bits: tuple[int, int, int], data: str) -> None:
    party = Party(properties(governance_xml(metadata=kind, data=data, read="true", write="false")))
    attributes = party.plugin.get_datawriter_sec_attributes(party.local, "T", UNSPECIFIED, ())
    assert attributes == party.plugin.get_datareader_sec_attributes(party.local, "T", UNSPECIFIED, ())
    protected, encrypted, _ = KINDS[data]
    # read, discovery and liveliness are on in the document, and write is off
    assert attributes.mask == 0x80000045 | bits[0] << 3 | protected << 4 | encrypted << 5
    assert attributes.plugin_endpoint_attributes == 1 << 31 | bits[1] | encrypted << 1 | bits[2] << 2


def test_participant_attributes_that_stay_at_home() -> None:
    party = Party(properties(governance_xml(unauthenticated="TRUE", join="0")))
    attributes = party.plugin.get_participant_sec_attributes(party.local)
    assert attributes.allow_unauthenticated_participants
    assert not attributes.is_access_protected
    assert Party().plugin.get_participant_sec_attributes(Party().local).is_access_protected


PROTECTED, SIGNED, CLEAR = (0x80000008, 0x80000001), (0x80000008, 0x80000004), (0x80000000, 0x80000000)


@pytest.mark.parametrize(
    ("topic", "masks"),
    [
        ("DCPSParticipantsSecure", PROTECTED),
        ("DCPSParticipantSecure", PROTECTED),
        ("DCPSPublicationsSecure", PROTECTED),
        ("DCPSSubscriptionsSecure", PROTECTED),
        ("TypeLookupServiceRequestSecure", PROTECTED),
        ("TypeLookupServiceReplySecure", PROTECTED),
        ("DCPSParticipantMessageSecure", SIGNED),
        ("DCPSParticipantVolatileMessageSecure", PROTECTED),
        ("DCPSParticipantStatelessMessage", CLEAR),
        ("DCPSParticipant", CLEAR),
        ("DCPSPublication", CLEAR),
        ("DCPSSubscription", CLEAR),
        ("DCPSParticipantMessage", CLEAR),
    ],
)
def test_builtin_endpoint_masks(topic: str, masks: tuple[int, int]) -> None:
    governance = governance_xml(discovery="ENCRYPT", liveliness="SIGN_WITH_ORIGIN_AUTHENTICATION", rtps="SIGN")
    party = Party(properties(governance))
    for attributes in (
        party.plugin.get_datawriter_sec_attributes(party.local, topic, UNSPECIFIED, ()),
        party.plugin.get_datareader_sec_attributes(party.local, topic, UNSPECIFIED, ()),
    ):
        assert (attributes.mask, attributes.plugin_endpoint_attributes) == masks


def test_with_nothing_protected_only_the_volatile_topic_is() -> None:
    party = Party(properties(governance_xml(discovery="NONE", liveliness="NONE")))
    attributes_of = party.plugin.get_datawriter_sec_attributes
    found = {topic: attributes_of(party.local, topic, UNSPECIFIED, ()) for topic in BUILTIN_TOPICS}
    volatile = found.pop("DCPSParticipantVolatileMessageSecure")
    assert volatile.is_submessage_protected
    assert set(found.values()) == {EndpointSecurityAttributes(plugin_endpoint_attributes=1 << 31)}


def test_topic_attributes() -> None:
    party = Party(properties(governance_xml(write="false")))
    attributes = party.plugin.get_topic_sec_attributes(party.local, "T")
    assert attributes.is_read_protected
    assert not attributes.is_write_protected
    assert attributes.is_discovery_protected
    assert attributes.is_liveliness_protected


# --- several in one process, and expiry ------------------------------------------------------------------------------


def test_participants_of_one_process_have_rights_of_their_own() -> None:
    """Different subjects, governance and CAs: nothing of the one reaches the other."""
    alice = Party(properties(permissions=permissions_xml(rules(publish="A"))))
    permissions = permissions_xml(rules(publish="B"), subject="CN=eve")
    other = Party(properties(governance_xml(discovery="NONE"), permissions, "rsa"), name="CN=eve")
    assert (alice.writes("A"), other.writes("B")) == (None, None)
    assert alice.writes("B") is not None
    assert other.writes("A") is not None
    assert "another certificate" in refusal(other.meets(sign(BOB)))
    assert alice.plugin.get_participant_sec_attributes(alice.local).is_discovery_protected
    assert not other.plugin.get_participant_sec_attributes(other.local).is_discovery_protected


class Listener:
    def __init__(self) -> None:
        self.revoked: list[PermissionsHandle] = []
        self.ended_at: list[int] = []

    def on_revoke_permissions(self, plugin: AccessControl, handle: PermissionsHandle, ended_at: int) -> None:
        self.revoked.append(handle)
        self.ended_at.append(ended_at)
        plugin.return_permissions_handle(handle)


def test_permissions_expire_one_after_the_other() -> None:
    party, listener = Party(), Listener()
    party.plugin.set_listener(listener)
    assert party.plugin.next_deadline() is None
    assert party.joins() is None
    assert party.plugin.next_deadline() == END
    remote = party.met(rules(publish="*"), end="2027-01-01T00:00:00Z")
    deadline = parse_instant("2027-01-01T00:00:00Z")
    assert party.plugin.next_deadline() == deadline
    party.now = deadline - 1
    party.plugin.handle_timeout()
    assert listener.revoked == []
    assert party.plugin.check_remote_datawriter(remote, 0, writer("T")) is None
    party.now = deadline
    assert "expired at 2027-01-01T00:00:00Z" in refusal(party.plugin.check_remote_datawriter(remote, 0, writer("T")))
    party.plugin.handle_timeout()
    assert listener.revoked == [remote]
    assert party.plugin.next_deadline() == END
    party.now = END
    assert "expired at 2037-12-31" in refusal(party.writes("T"))
    assert "expired at 2037-12-31" in refusal(party.joins())
    party.plugin.handle_timeout()
    assert listener.revoked == [remote, party.local]
    assert listener.ended_at == [deadline, END]
    assert party.plugin.next_deadline() is None


def test_what_is_returned_does_not_expire() -> None:
    party, listener = Party(), Listener()
    party.plugin.set_listener(listener)
    remote = party.met(rules(publish="*"), end="2027-01-01T00:00:00Z")
    party.plugin.return_permissions_handle(remote)
    assert party.plugin.next_deadline() is None
    party.now = END + 1
    party.plugin.handle_timeout()
    assert listener.revoked == []


def test_peers_that_come_and_go_leave_nothing_behind() -> None:
    party = Party()
    assert party.joins() is None
    document = sign(BOB)
    first = party.meets(document)
    assert isinstance(first, PermissionsHandle)
    for _ in range(300):
        remote = type(first)(first.local, first.grant)  # type: ignore[attr-defined, call-arg]
        assert party.admits(remote) is None
        party.plugin.return_permissions_handle(remote)
    assert len(party.plugin._expiries) < 100
    assert party.plugin.next_deadline() == END


def test_handles_are_shown_without_documents() -> None:
    party = Party()
    assert repr(party.local) == "<LocalPermissions permissions in the data: URI, grant 'alice' (line 12)>"


def test_errors_of_documents_are_errors_of_the_configuration() -> None:
    assert issubclass(UntrustedDocument, DocumentError)
    assert issubclass(DocumentError, ConfigurationError)
