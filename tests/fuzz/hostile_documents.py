"""Hostile documents, signed and not, and hostile expressions, for ``make_corpus``."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding, pkcs7

from tests.fuzz.documents import cms_blocks, permissions_authority, signed, xml_of
from tests.fuzz.hostile_messages import Made
from tests.fuzz.identities import owner
from tests.security.authentication.material import Issued, ec_key, issue

__all__ = ["DOCUMENT_MAKERS"]

UNTRUSTED = "UntrustedDocument"
DOCUMENT = "DocumentError"
GOOD = "alice.permissions.xml"


def one_line(xml: bytes) -> bytes:
    """Without the white space between elements, so that what is kept stays small."""
    return re.sub(rb">\s+<", b"><", xml).strip()


# --- S/MIME ---------------------------------------------------------------------------------------------------------


def signed_documents() -> Iterator[Made]:
    """The trusted signer is the permissions CA itself: CVE-2023-24010, -24011 and -24012 were about a chain."""
    good = signed(one_line(xml_of(GOOD)))
    yield "nothing", b"", UNTRUSTED
    yield "xml-without-signature", xml_of(GOOD), f"{UNTRUSTED} ~ without a signature"
    yield "html", b"<html></html>", UNTRUSTED
    yield "signed-by-a-stranger", signed(xml_of(GOOD), _stranger()), f"{UNTRUSTED} ~ signed by"
    yield "signed-by-an-impostor", signed(xml_of(GOOD), _impostor()), UNTRUSTED
    yield "signed-by-a-certificate-of-the-ca", signed(xml_of(GOOD), _issued_by_the_ca()), f"{UNTRUSTED} ~ signed by"
    yield "altered", good.replace(b"DENY", b"ALLOW"), UNTRUSTED
    yield "cut-off", good[: len(good) // 2], UNTRUSTED
    yield "without-the-second-part", good[: good.index(b"base64")], UNTRUSTED
    boundary = re.search(rb'boundary="([^"]+)"', good)
    assert boundary is not None
    mark = boundary.group(1)
    yield "boundary-empty", good.replace(mark, b""), UNTRUSTED
    yield "boundary-of-2000-octets", good.replace(mark, mark * 50), UNTRUSTED
    yield "boundary-a-regular-expression", good.replace(mark, b"(.*)*(.*)*(.*)*x"), "accepted"
    yield "boundaries-1000", good + b"\r\n".join([b"--" + mark] * 1000), UNTRUSTED
    yield (
        "three-parts",
        good.replace(b"--" + mark + b"\r\n", b"--" + mark + b"\r\n\r\n--" + mark + b"\r\n", 1),
        UNTRUSTED,
    )
    yield "headers-5000", b"X: y\r\n" * 5000 + good, f"{UNTRUSTED} ~ header"
    yield "header-of-20000-octets", b"X: " + b"y" * 20_000 + b"\r\n" + good, f"{UNTRUSTED} ~ header"
    yield "header-without-end", b"Content-Type: multipart/signed", f"{UNTRUSTED} ~ header"
    yield "content-type-twice", b"Content-Type: text/plain\r\n" + good, UNTRUSTED
    yield "base64-with-holes", re.sub(rb"\r\nM", b"\r\n!M", good), UNTRUSTED
    yield "nul-octets-behind", good + bytes(1000), "accepted"
    stripped = good.replace(b"Content-Type: text/plain\r\n\r\n", b"")
    yield "header-of-the-text-taken-away", stripped, UNTRUSTED


def _stranger() -> Issued:
    return owner("bob")


def _impostor() -> Issued:
    """With the name and the serial number of the permissions CA, and another key."""
    real = permissions_authority().certificate
    return issue("CN=permissions_ca,O=Tests", ec_key("impostor"), serial=real.serial_number)


def _issued_by_the_ca() -> Issued:
    return issue("CN=alice,O=Peers", ec_key("alice signs for herself"), permissions_authority())


def cms() -> Iterator[Made]:
    """SignedData in DER."""
    malformed = "MalformedMessage"
    good = next(cms_blocks())
    yield "nothing", b"", malformed
    yield "cut-off", good[:-1], malformed
    yield "one-octet-more", good + b"\0", malformed
    yield "length-of-4-gigabytes", b"\x30\x84\xff\xff\xff\xff" + good[4:], malformed
    yield "length-of-9-octets", b"\x30\x89" + b"\xff" * 9 + good[4:], malformed
    yield "length-of-127-octets", b"\x30\xff" + b"\xff" * 127, malformed
    yield "indefinite-length", b"\x30\x80" + good[4:] + bytes(2), malformed
    yield "nested-20000-deep", b"\x30\x80" * 20_000, malformed
    yield "sequences-in-sequences", _nested(500), malformed
    # The identifier of another digest, of the same length.
    sha_256, whirlpool = bytes.fromhex("608648016503040201"), bytes.fromhex("60864801650304027f")
    yield "digest-unknown", good.replace(sha_256, whirlpool), "NotSignedBy"
    yield "two-signers", _two_signers(), "NotSignedBy ~ more than one"
    yield "digest-of-something-else", _signed_by_the_ca(b"<dds>\r\n"), "NotSignedBy"
    yield "signed-by-a-stranger", next(_blocks_of(_stranger())), "NotSignedBy"


def _nested(depth: int) -> bytes:
    octets = b""
    for _ in range(depth):
        length = len(octets)
        octets = b"\x30\x82" + length.to_bytes(2, "big") + octets
    return octets


def _blocks_of(*signers: Issued, content: bytes = b"<dds/>\r\n") -> Iterator[bytes]:
    builder = pkcs7.PKCS7SignatureBuilder().set_data(content)
    for signer in signers:
        assert isinstance(signer.key, ec.EllipticCurvePrivateKey)
        builder = builder.add_signer(signer.certificate, signer.key, hashes.SHA256())
    yield builder.sign(Encoding.DER, [pkcs7.PKCS7Options.DetachedSignature, pkcs7.PKCS7Options.Binary])


def _signed_by_the_ca(content: bytes) -> bytes:
    return next(_blocks_of(permissions_authority(), content=content))


def _two_signers() -> bytes:
    return next(_blocks_of(_stranger(), permissions_authority()))


# --- XML ------------------------------------------------------------------------------------------------------------


def bombs(good: bytes) -> Iterator[Made]:
    """What any XML may be.  ``good`` is a document of the kind that is expected."""
    declaration = b'<?xml version="1.0" encoding="UTF-8"?>'
    body = good.partition(b"?>")[2] if good.startswith(b"<?xml") else good
    laughs = b"".join(b'<!ENTITY l%d "%s">' % (n, b"&l%d;" % (n - 1) * 10) for n in range(1, 10))
    yield "entity-bomb", declaration + b'<!DOCTYPE dds [<!ENTITY l0 "lol">' + laughs + b"]><dds>&l9;</dds>", DOCUMENT
    quadratic = b'<!DOCTYPE dds [<!ENTITY a "' + b"a" * 10_000 + b'">]><dds>' + b"&a;" * 1000 + b"</dds>"
    yield "entity-repeated", declaration + quadratic, DOCUMENT
    yield "entity-of-itself", declaration + b'<!DOCTYPE dds [<!ENTITY a "&a;">]><dds>&a;</dds>', DOCUMENT
    external = b'<!DOCTYPE dds [<!ENTITY x SYSTEM "file:///etc/passwd">]><dds>&x;</dds>'
    yield "entity-from-a-file", declaration + external, DOCUMENT
    yield (
        "entity-of-a-parameter",
        declaration + b'<!DOCTYPE dds [<!ENTITY % p SYSTEM "http://[::1]/">%p;]><dds/>',
        DOCUMENT,
    )
    yield "document-type-elsewhere", declaration + b'<!DOCTYPE dds SYSTEM "http://[::1]/dds.dtd">' + body, DOCUMENT
    utf_16 = b"\xff\xfe" + '<!DOCTYPE dds [<!ENTITY a "a">]><dds>&a;</dds>'.encode("utf-16-le")
    yield "entity-in-utf-16", utf_16, DOCUMENT
    utf_7 = b'<?xml version="1.0" encoding="UTF-7"?>+ADwAIQ-DOCTYPE dds+AD4-' + body
    yield "encoding-utf-7", utf_7, DOCUMENT
    yield "encoding-unknown", b'<?xml version="1.0" encoding="x-none"?>' + body, DOCUMENT
    yield "nested-20000-deep", b"<dds>" * 20_000, DOCUMENT
    yield "nested-and-closed-200-deep", b"<dds>" * 200 + b"</dds>" * 200, DOCUMENT
    yield "attributes-3000", b"<dds " + b"".join(b'a%d="" ' % n for n in range(3000)) + b"/>", DOCUMENT
    yield "attribute-twice", b'<dds a="" a=""/>', DOCUMENT
    yield "name-of-60000-characters", b"<" + b"d" * 60_000 + b"/>", DOCUMENT
    yield "not-closed", good[: len(good) // 2], DOCUMENT
    yield "two-roots", b"<dds/><dds/>", DOCUMENT
    yield "nothing", b"", DOCUMENT
    yield "nul-inside", good.replace(b"<dds", b"\0<dds", 1), DOCUMENT
    yield "latin-1-unsaid", b"<dds>\xe4</dds>", DOCUMENT
    yield "another-root", b"<governance/>", DOCUMENT
    yield "root-alone", b"<dds/>", DOCUMENT
    yield (
        "include",
        b'<dds xmlns:xi="http://www.w3.org/2001/XInclude"><xi:include href="file:///etc/passwd"/></dds>',
        DOCUMENT,
    )
    yield "style-sheet", declaration + b'<?xml-stylesheet href="file:///etc/passwd"?><dds/>', DOCUMENT


def without(xml: bytes, element: str) -> bytes:
    name = element.encode()
    changed = re.sub(rb"<" + name + rb">.*?</" + name + rb">", b"", xml, count=1, flags=re.DOTALL)
    assert changed != xml, element
    return changed


def governance() -> Iterator[Made]:
    good = one_line(xml_of("governance.xml"))
    yield from bombs(good)
    for element in (
        "domain_access_rules",
        "domains",
        "allow_unauthenticated_participants",
        "enable_join_access_control",
        "discovery_protection_kind",
        "liveliness_protection_kind",
        "rtps_protection_kind",
        "topic_access_rules",
        "topic_rule",
        "topic_expression",
        "enable_discovery_protection",
        "enable_liveliness_protection",
        "enable_read_access_control",
        "enable_write_access_control",
        "metadata_protection_kind",
        "data_protection_kind",
    ):
        yield f"without-{element}", without(good, element), f"{DOCUMENT} ~ line"
    kind = b"<rtps_protection_kind>ENCRYPT"
    yield "kind-unknown", good.replace(kind, b"<rtps_protection_kind>ENCYRPT"), f"{DOCUMENT} ~ ENCRYPT"
    yield "kind-of-control-characters", good.replace(kind, b"<rtps_protection_kind>\xc2\x9b31m"), DOCUMENT
    data = b"<data_protection_kind>ENCRYPT"
    origin = data + b"_WITH_ORIGIN_AUTHENTICATION"
    yield "data-with-origin-authentication", good.replace(data, origin), DOCUMENT
    boolean = b"<enable_join_access_control>true"
    yield "boolean-perhaps", good.replace(boolean, b"<enable_join_access_control>perhaps"), DOCUMENT
    for name, number in [("negative", b"-1"), ("of-5000-digits", b"9" * 5000), ("a-word", b"all"), ("empty", b"")]:
        yield f"domain-{name}", good.replace(b"<max>230</max>", b"<max>" + number + b"</max>"), DOCUMENT
    rule = good[good.index(b"<topic_rule>") : good.index(b"</topic_rule>") + len(b"</topic_rule>")]
    yield "rules-200", good.replace(rule, rule * 200), "accepted"
    expression = b"<topic_expression>*"
    yield "expression-of-10000-stars", good.replace(expression, expression * 1 + b"*a" * 5000), DOCUMENT
    yield "expression-that-is-none", good.replace(expression, b"<topic_expression>[[.a.]]"), DOCUMENT
    yield "unknown-element", good.replace(rule, rule + b"<enforce>1</enforce>"), DOCUMENT
    skipped = b'<enforce must_interpret="false"><x/></enforce>'
    yield "unknown-element-to-be-skipped", good.replace(rule, rule + skipped), "accepted"
    yield "permissions-instead", one_line(xml_of(GOOD)), f"{DOCUMENT} ~ permissions"


def permissions() -> Iterator[Made]:
    good = one_line(xml_of(GOOD))
    yield from bombs(good)
    for element in ("subject_name", "validity", "not_before", "not_after", "domains", "topics", "default"):
        yield f"without-{element}", without(good, element), f"{DOCUMENT} ~ line"
    for name, old, new, expected in [
        ("not-yet-valid", b"2020-01-01", b"2036-01-01", "Refused ~ not valid before"),
        ("expired", b"2037-12-31", b"2021-01-01", "Refused ~ expired"),
        ("ends-before-it-begins", b"2037-12-31", b"2019-01-01", f"{DOCUMENT} ~ ends"),
    ]:
        yield name, good.replace(old, new), expected
    for name, date in [
        ("the-99th", b"2020-01-99T00:00:00"),
        ("year-99999", b"99999-01-01T00:00:00"),
        ("year-0", b"0000-01-01T00:00:00"),
        ("zone-of-99-hours", b"2020-01-01T00:00:00+99:99"),
        ("fraction-of-5000-digits", b"2020-01-01T00:00:00." + b"9" * 5000),
        ("empty", b""),
        ("arabic-digits", "٢٠٢٠-٠١-٠١T٠٠:٠٠:٠٠".encode()),
    ]:
        yield f"date-{name}", good.replace(b"2020-01-01T00:00:00", date), f"{DOCUMENT} ~ not_before"
    subject = b"CN=alice,O=Peers"
    for name, new, expected in [
        ("of-somebody-else", b"CN=bob,O=Peers", "Refused ~ subject"),
        ("empty", b"", f"{DOCUMENT} ~ subject_name"),
        ("of-2000-attributes", b",".join([b"CN=alice"] * 2000), f"{DOCUMENT} ~ characters"),
        ("with-a-nul-escape", b"CN=alice\\00,O=Peers", "Refused ~ subject"),
        ("of-control-characters", b"CN=alice,O=Peers,OU=\xc2\x9b31m\xe2\x80\xae", "Refused ~ subject"),
        ("of-one-attribute-more", b"CN=alice,O=Peers,OU=x", "Refused ~ subject"),
        ("of-one-attribute-less", b"CN=alice", "Refused ~ subject"),
        ("of-alike-letters", "CN=аlice,O=Peers".encode(), "Refused ~ subject"),
    ]:
        yield f"subject-{name}", good.replace(subject, new), expected
    grant = good[good.index(b"<grant") : good.index(b"</grant>") + len(b"</grant>")]
    yield "grants-100", good.replace(grant, grant * 100), "accepted"
    topic = b"<topic>Square</topic>"
    yield "topics-2000", good.replace(topic, topic * 2000), "accepted"
    yield "topic-of-20000-characters", good.replace(topic, b"<topic>" + b"S" * 20_000 + b"</topic>"), DOCUMENT
    yield "default-maybe", good.replace(b"DENY</default>", b"MAYBE</default>"), DOCUMENT
    yield "governance-instead", one_line(xml_of("governance.xml")), f"{DOCUMENT} ~ governance"


def remote_permissions() -> Iterator[Made]:
    """``c.perm``: signed by the right authority, but for the last few."""
    good = one_line(xml_of(GOOD))
    yield "nothing", b"", "Refused"
    yield "expired", signed(good.replace(b"2037-12-31", b"2021-01-01")), "Refused"
    yield "not-yet-valid", signed(good.replace(b"2020-01-01", b"2036-01-01")), "Refused"
    yield "of-somebody-else", signed(good.replace(b"CN=alice", b"CN=bob")), "Refused ~ subject"
    yield "governance-instead", signed(one_line(xml_of("governance.xml"))), "Refused"
    bomb = {name: octets for name, octets, _ in bombs(good)}["entity-bomb"]
    yield "entity-bomb", signed(bomb), "Refused"
    yield "nul-behind", signed(good) + b"\0", "accepted"
    yield "signed-by-themselves", signed(good, _issued_by_the_ca()), "Refused ~ signed by"
    yield "not-signed", good, "Refused ~ signature"
    yield "entity-bomb-not-signed", bomb, "Refused ~ signature"


# --- words ----------------------------------------------------------------------------------------------------------


def topic_expressions() -> Iterator[Made]:
    """Those that take exponential time in some matchers, and those that are none."""
    name = b"\0" + b"a" * 250
    yield "many-stars", b"*a" * 120 + b"b" + name, "accepted"
    yield "stars-alone", b"*" * 1000 + name, "accepted"
    yield "stars-and-questions", b"*?" * 120 + b"b" + name, "accepted"
    yield "stars-and-brackets", b"*[a-z]" * 60 + b"b" + name, "accepted"
    yield "beyond-all-bounds", b"*a" * 10_000 + name, "MalformedMessage"
    yield "bracket-open", b"[a" + name, "accepted"
    yield "brackets-open-1000", b"[" * 1000 + name, "accepted"
    yield "bracket-of-itself", b"[]]" + name, "accepted"
    yield "bracket-backwards", b"[z-a]" + name, "accepted"
    yield "bracket-of-100-ranges", b"[" + b"a-z" * 100 + b"]" + name, "accepted"
    yield "class-unknown", b"[[:evil:]]" + name, "MalformedMessage"
    yield "collating-symbol", b"[[.a.]]" + name, "MalformedMessage"
    yield "regular-expression", b"(a+)+$" + name, "accepted"
    yield "backslashes", b"\\" * 100 + name, "accepted"


def subject_names() -> Iterator[Made]:
    malformed = "MalformedMessage"
    yield "nothing", b"", malformed
    yield "no-attribute", b"alice", malformed
    yield "commas-4000", b"," * 4000, malformed
    yield "attributes-1000", b",".join([b"CN=a"] * 1000), malformed
    yield "escape-at-the-end", b"CN=alice\\", malformed
    yield "escape-of-no-utf-8", b"CN=\\ff\\fe", malformed
    yield "hex-of-control-characters", b"CN=#\0\x1b[31m", malformed
    yield "hex-cut-off", b"CN=#0c0", malformed
    yield "hex-of-4-gigabytes", b"CN=#0c84ffffffff41", malformed
    yield "quote-open", b'CN="alice', malformed
    yield "type-unknown", b"XYZ=alice", "accepted"
    yield "identifier-of-1000-arcs", b"1." * 1000 + b"1=a", malformed
    yield "identifier-of-3000-digits", b"2.5." + b"9" * 3000 + b"=a", malformed
    yield "equals-4000", b"CN" + b"=" * 3000, "accepted"


DOCUMENT_MAKERS: dict[str, Callable[[], Iterator[Made]]] = {
    "signed_document": signed_documents,
    "cms": cms,
    "governance": governance,
    "permissions": permissions,
    "remote_permissions": remote_permissions,
    "topic_expression": topic_expressions,
    "subject_name": subject_names,
}
