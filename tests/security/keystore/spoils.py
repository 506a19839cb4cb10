"""Ways to spoil a keystore, each of which exactly one rule of the linter is for."""

from __future__ import annotations

from collections.abc import Callable

from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec, rsa
from cryptography.hazmat.primitives.serialization import Encoding, pkcs7
from cryptography.x509.oid import ExtendedKeyUsageOID

from ddsi_security.keystore.authority import Authority
from ddsi_security.keystore.distinguished_name import parse_name
from ddsi_security.keystore.identity import Identity
from ddsi_security.keystore.key_pair import Algorithm, generate_key, private_key_pem

from .keystores import ALICE, Workshop

__all__ = ["PERMISSIONS_CA", "SPOILS", "Spoil", "add_rule", "certificate", "section"]

IDENTITY_CA, PERMISSIONS_CA = "CN=Identity CA,O=Example", "CN=Permissions CA,O=Example"
KINDS = ("discovery_protection_kind", "liveliness_protection_kind", "rtps_protection_kind")
ALL_NONE = [
    ("ENCRYPT</", "NONE</"),
    ("SIGN</", "NONE</"),
    ("<enable_discovery_protection>true", "<enable_discovery_protection>false"),
    ("<enable_liveliness_protection>true", "<enable_liveliness_protection>false"),
]

CERTIFICATES_ALONE = x509.KeyUsage(
    digital_signature=False, content_commitment=False, key_encipherment=False, data_encipherment=False,
    key_agreement=False, key_cert_sign=True, crl_sign=True, encipher_only=False, decipher_only=False,
)  # fmt: skip


def certificate(
    workshop: Workshop,
    subject: str,
    key: rsa.RSAPrivateKey | ec.EllipticCurvePrivateKey,
    *,
    ca: bool | None,
    issuer: Authority | None = None,
    usage: x509.KeyUsage | x509.ExtendedKeyUsage | None = None,
    digest: hashes.SHA256 | hashes.SHA384 | hashes.SHA512 | None = None,
) -> x509.Certificate:
    """One from the workshop's identity CA, or another ``issuer``; ``ca`` None: without basicConstraints.

    It is signed with SHA-256, or another ``digest``.
    """
    issuer = issuer or workshop.identity_ca
    builder = (
        x509.CertificateBuilder()
        .subject_name(x509.Name.from_rfc4514_string(subject))
        .issuer_name(issuer.certificate.subject)
        .public_key(key.public_key())
        .serial_number(7)
        .not_valid_before(workshop.validity.not_before)
        .not_valid_after(workshop.validity.not_after)
    )
    if ca is not None:
        builder = builder.add_extension(x509.BasicConstraints(ca=ca, path_length=None), critical=True)
    if usage is not None:
        builder = builder.add_extension(usage, critical=True)
    return builder.sign(issuer.private_key, digest or hashes.SHA256())


# --- how to spoil a keystore ---------------------------------------------------------------------------------

Spoil = Callable[[Workshop], object]
SPOILS: dict[str, list[tuple[Spoil, str, str]]] = {}
"""By rule: what to do, the file that it is about, and what its line must hold ("" for the first)."""


def spoils(rule: str, file: str, line: str = "") -> Callable[[Spoil], Spoil]:
    def register(spoil: Spoil) -> Spoil:
        SPOILS.setdefault(rule, []).append((spoil, file, line))
        return spoil

    return register


def governance(rule: str, line: str, *changes: tuple[str, str]) -> None:
    """One that governance gets by these changes."""
    spoils(rule, "governance.p7s", line)(lambda workshop: workshop.replace("governance", *changes))


def permissions(rule: str, line: str, *changes: tuple[str, str]) -> None:
    spoils(rule, "permissions.p7s", line)(lambda workshop: workshop.replace("permissions", *changes))


for name in (
    "identity_ca.cert.pem",
    "cert.pem",
    "key.pem",
    "permissions_ca.cert.pem",
    "governance.p7s",
    "permissions.p7s",
):

    @spoils("file-missing", name)
    def _(workshop: Workshop, name: str = name) -> None:
        (workshop.write() / name).unlink()


@spoils("key-exposed", "key.pem")
def _(workshop: Workshop) -> None:
    (workshop.write() / "key.pem").chmod(0o644)


@spoils("key-exposed", "key.pem")
def _(workshop: Workshop) -> None:
    (workshop.write() / "key.pem").chmod(0o640)


@spoils("key-exposed", "authority.key")
def _(workshop: Workshop) -> None:
    """An authority's key beside it is no less secret."""
    workshop.write()
    workshop.file("authority.key", private_key_pem(workshop.identity_ca.private_key)).chmod(0o604)


@spoils("file-writable", "governance.p7s")
def _(workshop: Workshop) -> None:
    (workshop.write() / "governance.p7s").chmod(0o646)


@spoils("certificate-unreadable", "cert.pem")
def _(workshop: Workshop) -> None:
    workshop.write()
    workshop.file("cert.pem", b"-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n")


@spoils("key-unreadable", "key.pem")
def _(workshop: Workshop) -> None:
    workshop.write()
    workshop.file("key.pem", b"-----BEGIN PRIVATE KEY-----\nAAAA\n-----END PRIVATE KEY-----\n")


@spoils("key-has-password", "key.pem")
def _(workshop: Workshop) -> None:
    workshop.write()
    workshop.file("key.pem", private_key_pem(workshop.identity.private_key, b"open sesame"))


@spoils("key-mismatch", "key.pem")
def _(workshop: Workshop) -> None:
    workshop.write()
    workshop.file("key.pem", private_key_pem(generate_key(Algorithm.EC)))


@spoils("certificate-expired", "cert.pem")
def _(workshop: Workshop) -> None:
    workshop.identity = workshop.make_identity(ALICE, workshop.days(-1, -1))


@spoils("certificate-not-yet-valid", "cert.pem")
def _(workshop: Workshop) -> None:
    workshop.identity = workshop.make_identity(ALICE, workshop.days(1, 100))


@spoils("certificate-expires-soon", "cert.pem")
def _(workshop: Workshop) -> None:
    workshop.identity = workshop.make_identity(ALICE, workshop.days(0, 29))


@spoils("certificate-expired", "permissions_ca.cert.pem")
def _(workshop: Workshop) -> None:
    subject = workshop.permissions_ca.certificate.subject
    expired = Authority.create(subject, Algorithm.EC, workshop.days(-2, -1))
    workshop.permissions_ca = workshop.document_signer = expired


@spoils("identity-wrong-ca", "cert.pem")
def _(workshop: Workshop) -> None:
    workshop.identity_ca = workshop.authority("Another CA")


@spoils("identity-wrong-ca", "cert.pem")
def _(workshop: Workshop) -> None:
    """Of the same name, but not the same."""
    workshop.identity_ca = workshop.authority("Identity CA")


@spoils("weak-algorithm", "cert.pem")
def _(workshop: Workshop) -> None:
    key = rsa.generate_private_key(public_exponent=65537, key_size=1024)
    workshop.identity = Identity(certificate(workshop, ALICE, key, ca=False), key)


@spoils("unsupported-key", "cert.pem")
def _(workshop: Workshop) -> None:
    key = ec.generate_private_key(ec.SECP521R1())
    workshop.identity = Identity(certificate(workshop, ALICE, key, ca=False), key)


@spoils("p384-key", "cert.pem")
def _(workshop: Workshop) -> None:
    key = generate_key(Algorithm.EC_P384)
    workshop.identity = Identity(certificate(workshop, ALICE, key, ca=False), key)


@spoils("p384-key", "identity_ca.cert.pem")
def _(workshop: Workshop) -> None:
    """Signed with SHA-256, so that nothing but the key is unusual."""
    own, key = workshop.authority("Identity CA", Algorithm.EC_P384), workshop.identity.private_key
    made = certificate(workshop, IDENTITY_CA, own.private_key, ca=True, issuer=own)
    workshop.identity_ca = Authority(made, own.private_key)
    workshop.identity = Identity(certificate(workshop, ALICE, key, ca=False), key)


@spoils("rsa-key", "cert.pem")
def _(workshop: Workshop) -> None:
    key = rsa.generate_private_key(public_exponent=65537, key_size=3072)
    workshop.identity = Identity(certificate(workshop, ALICE, key, ca=False), key)


@spoils("certificate-signature", "cert.pem")
def _(workshop: Workshop) -> None:
    key = workshop.identity.private_key
    workshop.identity = Identity(certificate(workshop, ALICE, key, ca=False, digest=hashes.SHA384()), key)


@spoils("certificate-signature", "identity_ca.cert.pem")
def _(workshop: Workshop) -> None:
    """An authority's own signature, though nobody needs it to believe the authority."""
    key = workshop.identity_ca.private_key
    made = certificate(workshop, IDENTITY_CA, key, ca=True, digest=hashes.SHA512())
    workshop.identity_ca = Authority(made, key)


@spoils("certificate-signature", "permissions_ca.cert.pem")
def _(workshop: Workshop) -> None:
    own, key = workshop.permissions_ca, workshop.permissions_ca.private_key
    made = certificate(workshop, PERMISSIONS_CA, key, ca=True, issuer=own, digest=hashes.SHA384())
    workshop.permissions_ca = workshop.document_signer = Authority(made, key)


@spoils("ca-not-authority", "identity_ca.cert.pem")
def _(workshop: Workshop) -> None:
    key = workshop.identity_ca.private_key
    workshop.identity_ca = Authority(certificate(workshop, IDENTITY_CA, key, ca=None), key)


@spoils("ca-intermediate", "identity_ca.cert.pem")
def _(workshop: Workshop) -> None:
    root = Authority.create(parse_name("/O=Example/CN=Root"), Algorithm.EC, workshop.validity)
    key = workshop.identity_ca.private_key
    workshop.identity_ca = Authority(certificate(workshop, IDENTITY_CA, key, ca=True, issuer=root), key)


for usage in (CERTIFICATES_ALONE, x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH])):

    @spoils("ca-may-not-sign", "permissions_ca.cert.pem")
    def _(workshop: Workshop, usage: x509.KeyUsage | x509.ExtendedKeyUsage = usage) -> None:
        own, key = workshop.permissions_ca, workshop.permissions_ca.private_key
        made = certificate(workshop, PERMISSIONS_CA, key, ca=True, issuer=own, usage=usage)
        workshop.permissions_ca = workshop.document_signer = Authority(made, key)


@spoils("identity-is-ca", "cert.pem")
def _(workshop: Workshop) -> None:
    key = workshop.identity.private_key
    workshop.identity = Identity(certificate(workshop, ALICE, key, ca=True), key)


@spoils("shared-ca", "permissions_ca.cert.pem")
def _(workshop: Workshop) -> None:
    workshop.permissions_ca = workshop.document_signer = workshop.identity_ca


@spoils("subject-repeats", "cert.pem")
def _(workshop: Workshop) -> None:
    workshop.identity = workshop.make_identity("CN=alice,OU=a,OU=b")
    workshop.replace("permissions", (ALICE, "CN=alice,OU=a,OU=b"))


for spelling in ("O=Example,CN=alice", "CN = alice, O = Example", "/O=Example/CN=alice"):
    permissions("subject-spelling", "<grant", (ALICE, spelling))


for name in ("governance", "permissions"):

    @spoils("document-unsigned", f"{name}.p7s")
    def _(workshop: Workshop, name: str = name) -> None:
        workshop.write()
        workshop.file(f"{name}.p7s", getattr(workshop, name).encode())


@spoils("document-altered", "governance.p7s")
def _(workshop: Workshop) -> None:
    path = workshop.write() / "governance.p7s"
    path.write_bytes(path.read_bytes().replace(b"<rtps_protection_kind>SIGN", b"<rtps_protection_kind>NONE"))


@spoils("document-wrong-signer", "permissions.p7s")
def _(workshop: Workshop) -> None:
    workshop.write()
    workshop.file("permissions.p7s", workshop.identity_ca.sign_document(workshop.permissions.encode()))


@spoils("document-wrong-signer", "permissions.p7s")
def _(workshop: Workshop) -> None:
    """By the bearer of the permissions, in the permissions CA's place: CVE-2023-24010 to -24012."""
    workshop.write()
    self_signed = Authority(workshop.identity.certificate, workshop.identity.private_key)
    workshop.file("permissions.p7s", self_signed.sign_document(workshop.permissions.encode()))


@spoils("document-wrong-signer", "governance.p7s")
def _(workshop: Workshop) -> None:
    workshop.write()
    workshop.file("governance.p7s", workshop.authority("Stranger").sign_document(workshop.governance.encode()))


@spoils("document-no-text-header", "governance.p7s")
def _(workshop: Workshop) -> None:
    workshop.write()
    builder = pkcs7.PKCS7SignatureBuilder().set_data(workshop.governance.encode())
    signer = workshop.permissions_ca
    builder = builder.add_signer(signer.certificate, signer.private_key, hashes.SHA256())
    workshop.file("governance.p7s", builder.sign(Encoding.SMIME, [pkcs7.PKCS7Options.DetachedSignature]))


@spoils("source-differs", "permissions.xml")
def _(workshop: Workshop) -> None:
    workshop.write()
    workshop.file("permissions.xml", workshop.permissions.replace("Square", "Squire").encode())


governance("document-invalid", "<rtps_protection_kind>SING<", (">SIGN<", ">SING<"))
governance(
    "document-invalid", "<domain_rule>", ("      <enable_join_access_control>true</enable_join_access_control>\n", "")
)
governance("document-invalid", "<id_range>", ("<min>0</min><max>230</max>", "<min>5</min><max>3</max>"))
governance(
    "document-invalid",
    "<rtps_protection_kind>",
    ("<allow_unauthenticated_participants>false", "<allow_unauthenticated_participants>true"),
)
governance("document-invalid", "</dds", ("</domain_access_rules>", ""))
permissions("document-invalid", "<not_after>", ("<not_after>", "<not_after>soon "))
governance("domain-too-high", "<max>232<", ("<max>230", "<max>232"))
permissions("domain-too-high", "<max>231<", ("<max>230", "<max>231"))
governance("range-without-max", "<id_range>", ("<max>230</max>", ""))
permissions("range-without-max", "<id_range>", ("<max>230</max>", ""))
governance("bracket-expression", "<topic_expression>[A-z]*<", ("expression>*", "expression>[A-z]*"))
permissions("bracket-expression", "<topic>[SC]quare<", ("Square", "[SC]quare"))
for kind in (*KINDS, "metadata_protection_kind"):
    plain = "SIGN" if kind == "rtps_protection_kind" else "ENCRYPT"
    for word in ("SIGN", "ENCRYPT"):
        origin = f"<{kind}>{word}_WITH_ORIGIN_AUTHENTICATION<"
        governance("origin-authentication", origin, (f"<{kind}>{plain}<", origin))
governance(
    "data-without-metadata",
    "<data_protection_kind>ENCRYPT",
    ("<metadata_protection_kind>ENCRYPT", "<metadata_protection_kind>NONE"),
)
governance(
    "rtps-without-discovery",
    "<rtps_protection_kind>SIGN",
    ("<discovery_protection_kind>ENCRYPT", "<discovery_protection_kind>NONE"),
    ("<enable_discovery_protection>true", "<enable_discovery_protection>false"),
)
governance(
    "flag-without-kind",
    "<enable_liveliness_protection>true",
    ("<liveliness_protection_kind>ENCRYPT", "<liveliness_protection_kind>NONE"),
)
governance("control-without-protection", "<topic_rule>", *ALL_NONE)
governance(
    "open-to-strangers",
    "<topic_rule>",
    *ALL_NONE,
    ("<allow_unauthenticated_participants>false", "<allow_unauthenticated_participants>true"),
    ("<enable_read_access_control>true", "<enable_read_access_control>false"),
)
governance(
    "unsupported-element",
    "<rtps_psk_protection_kind>",
    ("<topic_access_rules>", "<rtps_psk_protection_kind>SIGN</rtps_psk_protection_kind><topic_access_rules>"),
)


def section(text: str, tag: str) -> str:
    """The element with all that is in it."""
    return text[text.index(f"<{tag}>") : text.index(f"</{tag}>") + len(tag) + 3]


@spoils("topic-rule-shadowed", "governance.p7s", "<topic_rule>")
def _(workshop: Workshop) -> None:
    rule = section(workshop.governance, "topic_rule")
    second = rule.replace("expression>*<", "expression>Square<")
    workshop.replace("governance", (rule, f"{rule}\n{second}"))


@spoils("domain-rule-shadowed", "governance.p7s", "<domain_rule>")
def _(workshop: Workshop) -> None:
    rule = section(workshop.governance, "domain_rule")
    second = rule.replace("<max>230</max>", "<max>7</max>")
    workshop.replace("governance", (rule, f"{rule}\n{second}"))


NOT_BEFORE, NOT_AFTER = "2026-06-30T12:00:00", "2029-03-27T12:00:00"
permissions("grant-expired", "<not_after>2026-07-01T12:00:00<", (NOT_AFTER, "2026-07-01T12:00:00"))
permissions("grant-not-yet-valid", "<not_before>2026-07-01T12:00:01<", (NOT_BEFORE, "2026-07-01T12:00:01"))
permissions("grant-expires-soon", "<not_after>2026-07-31T11:59:59<", (NOT_AFTER, "2026-07-31T11:59:59"))
permissions("default-allow", "<default>ALLOW", ("DENY", "ALLOW"))
permissions("relay-right", "<relay>", ("<subscribe>", "<relay><topics><topic>*</topic></topics></relay>\n<subscribe>"))
permissions("subject-mismatch", "<grant", (f"{ALICE}<", "CN=alicia,O=Example<"))
TAGS = "<data_tags><tag><name>a</name><value>b</value></tag></data_tags>"
permissions("data-tags", "<data_tags>", ("</partitions>\n        </publish>", f"</partitions>\n{TAGS}</publish>"))


@spoils("grant-without-rights", "permissions.p7s", "<grant")
def _(workshop: Workshop) -> None:
    workshop.replace("permissions", (section(workshop.permissions, "allow_rule"), ""))


@spoils("grant-shadowed", "permissions.p7s", "<grant")
def _(workshop: Workshop) -> None:
    """The second spells the subject otherwise, and it is the same nevertheless."""
    text = workshop.permissions
    grant = text[text.index("<grant") : text.index("</grant>") + len("</grant>")]
    workshop.replace("permissions", (grant, f"{grant}\n{grant.replace(ALICE, 'O = Example, CN = alice')}"))


def add_rule(workshop: Workshop, decision: str, verb: str, topic: str, partition: str = "", *, last: int = 230) -> None:
    """A rule after those that are there."""
    partitions = f"<partitions><partition>{partition}</partition></partitions>" if partition else ""
    rule = (
        f"<{decision}_rule>\n<domains><id_range><min>0</min><max>{last}</max></id_range></domains>\n"
        f"<{verb}><topics>\n<topic>{topic}</topic></topics>{partitions}</{verb}></{decision}_rule>\n"
    )
    workshop.replace("permissions", ("<default>", f"{rule}<default>"))


@spoils("deny-rule", "permissions.p7s", "<deny_rule>")
def _(workshop: Workshop) -> None:
    add_rule(workshop, "deny", "publish", "Secret")


@spoils("rule-never-matches", "permissions.p7s", "<topic>Square<")
def _(workshop: Workshop) -> None:
    add_rule(workshop, "allow", "publish", "Square", "A")


@spoils("partition-order", "permissions.p7s", "<topic>Squ*<")
def _(workshop: Workshop) -> None:
    workshop.replace("permissions", ("<partition>*", "<partition>A"))
    add_rule(workshop, "allow", "publish", "Squ*", "B")


@spoils("bracket-expression", "permissions.p7s", "<partition>[a-c]<")
def _(workshop: Workshop) -> None:
    add_rule(workshop, "allow", "publish", "Triangle", "[a-c]")


@spoils("topic-without-rule", "permissions.p7s", "<topic>Circle<")
def _(workshop: Workshop) -> None:
    workshop.replace("governance", ("<topic_expression>*<", "<topic_expression>S*<"))


@spoils("domain-without-rule", "permissions.p7s", "<domains>")
def _(workshop: Workshop) -> None:
    workshop.replace("governance", ("<min>0</min><max>230</max>", "<min>0</min><max>4</max>"))
    workshop.replace("permissions", ("<min>0</min><max>230</max>", "<min>5</min><max>9</max>"))
