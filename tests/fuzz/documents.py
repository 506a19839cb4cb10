"""Targets of access control: signed documents, what is in them, and the expressions that they use."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding, pkcs7

from ddsi.spi import Refused
from ddsi.structure.errors import MalformedMessage
from ddsi_security.access_control import PermissionsAccessControl
from ddsi_security.access_control.cms import NotSignedBy, verify_signed_data
from ddsi_security.access_control.decision import decide, decide_participant
from ddsi_security.access_control.document_error import DocumentError
from ddsi_security.access_control.governance import Governance
from ddsi_security.access_control.permissions import ActionKind, Permissions
from ddsi_security.access_control.smime import sign_document, verify
from ddsi_security.access_control.subject_name import SubjectName
from ddsi_security.access_control.wildcard import check_expression, matches
from ddsi_security.handles import IdentityHandle
from ddsi_security.tokens import DataHolder
from tests.captures.capture import HERE
from tests.fuzz.identities import owner
from tests.fuzz.target import Target, verdict
from tests.security.authentication.material import NOW_S, SECOND, Issued, settle

__all__ = ["DOCUMENT_TARGETS", "SUBJECT", "permissions_authority", "signed"]

KEYSTORE = HERE / "keystore"
SUBJECT = "CN=alice,O=Peers"
NOW = NOW_S * SECOND


def permissions_authority() -> Issued:
    """Whose signature counts."""
    return owner("permissions_ca")


def signed(xml: bytes, by: Issued | None = None) -> bytes:
    signer = by or permissions_authority()
    assert isinstance(signer.key, ec.EllipticCurvePrivateKey)
    return sign_document(xml, signer.certificate, signer.key)


def xml_of(name: str) -> bytes:
    return (KEYSTORE / name).read_bytes()


# --- around the document --------------------------------------------------------------------------------------------


def signed_document(octets: bytes) -> str:
    """S/MIME, as it comes in a handshake.  What is accepted is what was signed."""
    return verdict(lambda: verify(octets, permissions_authority().certificate, name="it"), DocumentError)


def signed_documents() -> Iterator[bytes]:
    yield signed(xml_of("alice.permissions.xml"))
    yield signed(xml_of("alice.permissions.xml")).replace(b"\r\n", b"\n")
    yield signed(b"<dds/>")


def cms(octets: bytes) -> str:
    """SignedData in DER, over no more than one line."""
    certificate = permissions_authority().certificate
    return verdict(lambda: verify_signed_data(octets, b"<dds/>\r\n", certificate), MalformedMessage, NotSignedBy)


def cms_blocks() -> Iterator[bytes]:
    signer = permissions_authority()
    assert isinstance(signer.key, ec.EllipticCurvePrivateKey)
    builder = pkcs7.PKCS7SignatureBuilder().set_data(b"<dds/>\r\n")
    builder = builder.add_signer(signer.certificate, signer.key, hashes.SHA256())
    options = [pkcs7.PKCS7Options.DetachedSignature, pkcs7.PKCS7Options.Binary]
    yield builder.sign(Encoding.DER, options)
    yield builder.sign(Encoding.DER, [*options, pkcs7.PKCS7Options.NoCerts])


# --- inside ---------------------------------------------------------------------------------------------------------


def governance(octets: bytes) -> str:
    """XML that was signed, or that a person wrote; then what it says of some domains and topics."""

    def judge() -> None:
        document = Governance.parse(octets, name="governance.xml")
        for domain_id in (0, 1, 231):
            rule = document.domain_rule(domain_id)
            for topic in ("Square", "DCPSTopic", "", "*", "[a"):
                if rule is not None:
                    rule.topic_rule(topic)

    return verdict(judge, DocumentError)


def permissions(octets: bytes) -> str:
    """XML that was signed by somebody whom we believe; then what it allows."""

    def judge() -> object:
        document = Permissions.parse(octets, name="permissions.xml")
        grant = document.grant_for(SubjectName.parse(SUBJECT), NOW)
        if not isinstance(grant, Refused):
            decide_participant(grant, domain_id=1)
            for kind in ActionKind:
                decide(grant, domain_id=1, kind=kind, topic="Square", partitions=("", "p"), data_tags=(("a", "b"),))
        return grant

    return verdict(judge, DocumentError)


@cache
def access_control() -> tuple[PermissionsAccessControl, IdentityHandle]:
    """A participant of ours, whose permissions are in order."""
    plugin = PermissionsAccessControl({}, entropy=bytes, wall_clock=lambda: NOW)
    handle = IdentityHandle()
    authority = permissions_authority().pem
    governance_text, permissions_text = signed(xml_of("governance.xml")), signed(xml_of("alice.permissions.xml"))
    properties = {
        "dds.sec.access.permissions_ca": f"data:,{authority}",
        "dds.sec.access.governance": f"data:,{governance_text.decode()}",
        "dds.sec.access.permissions": f"data:,{permissions_text.decode()}",
    }
    plugin.validate_local_permissions(_Names(), handle, 1, properties)  # type: ignore[arg-type]
    return plugin, handle


class _Names:
    """As much of authentication as access control asks for."""

    def get_subject_name(self, handle: object) -> str:
        return SUBJECT


def remote_permissions(octets: bytes) -> str:
    """``c.perm`` of an authenticated stranger."""
    plugin, local = access_control()
    credential = DataHolder("DDS:Auth:PKI-DH:1.0", (), (("c.id", owner("alice").pem.encode()), ("c.perm", octets)))
    token = DataHolder("DDS:Access:Permissions:1.0")
    validate = plugin.validate_remote_permissions
    return verdict(
        lambda: settle(validate(_Names(), local, IdentityHandle(), token, credential))  # type: ignore[arg-type]
    )


# --- words ----------------------------------------------------------------------------------------------------------


def topic_expression(octets: bytes) -> str:
    """An expression and, behind a NUL, the name that it may match."""
    text = octets.decode("latin-1")
    expression, _, name = text.partition("\0")
    found = matches(expression, name)
    if "[" not in expression and len(expression) + len(name) < 500:
        assert found == _matches_step_by_step(expression, name)
    return verdict(lambda: check_expression(expression), MalformedMessage)


def _matches_step_by_step(expression: str, name: str) -> bool:
    """The same, in the plainest way: which beginnings of the name may have been matched so far?"""
    ends = {0}
    for character in expression:
        if character == "*":
            ends = set(range(min(ends, default=len(name) + 1), len(name) + 1))
        else:
            ends = {end + 1 for end in ends if end < len(name) and character in ("?", name[end])}
    return len(name) in ends


def topic_expressions() -> Iterator[bytes]:
    for expression, name in [
        ("Square", "Square"),
        ("S*e", "Square"),
        ("?[a-z]*[!x]", "Square"),
        ("[[:alpha:]]*", "Square"),
        ("*a*b*c*", "aabbcc"),
        ("rt/[!a-c]*/x?", "rt/d/x1"),
    ]:
        yield f"{expression}\0{name}".encode("latin-1")


def subject_name(octets: bytes) -> str:
    """What is read is the same when it is written and read again."""
    text = octets.decode("utf-8", "replace")
    found = verdict(lambda: SubjectName.parse(text), MalformedMessage)
    if found == "accepted":
        name = SubjectName.parse(text)
        assert SubjectName.parse(name.text) == name
    return found


def subject_names() -> list[bytes]:
    return [
        b"CN=alice,O=Example Org,C=US",
        b"C = US, O = Example Org, CN = alice",
        b"/C=US/O=Example Org/CN=alice",
        b"CN=a\\,b\\+c\\22 d,2.5.4.10=#0c0141",
        b'emailAddress=a@b+CN=x,O="a, b"',
    ]


DOCUMENT_TARGETS = {
    "signed_document": Target(signed_document, signed_documents, is_text=True),
    "cms": Target(cms, cms_blocks, 2048),
    "governance": Target(
        governance, lambda: [xml_of(path.name) for path in sorted(KEYSTORE.glob("governance*.xml"))], is_text=True
    ),
    "permissions": Target(permissions, lambda: [xml_of("alice.permissions.xml")], is_text=True),
    "remote_permissions": Target(
        remote_permissions, lambda: [signed(xml_of("alice.permissions.xml"))], 8192, is_text=True
    ),
    "topic_expression": Target(topic_expression, topic_expressions, 512),
    "subject_name": Target(subject_name, subject_names, 512, is_text=True),
}
