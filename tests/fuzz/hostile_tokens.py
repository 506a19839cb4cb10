"""Hostile tokens, certificates and public keys, for ``make_corpus``."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from dataclasses import replace

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import dsa, ec, rsa

from ddsi.structure.guid import Guid
from ddsi_security.authentication.algorithms import ECDH_P256
from ddsi_security.authentication.key_agreement import EphemeralKey
from ddsi_security.generic_message import AUTH, GenericMessage, MessageIdentity, write_generic_message
from ddsi_security.tokens import DataHolder
from tests.fuzz.hostile_messages import U32_MAX, Made, text
from tests.fuzz.identities import owner
from tests.fuzz.tokens import known_pair, octets_of, waiting
from tests.security.authentication.material import DAY_S, NOW_S, ec_key, issue, participant_data

__all__ = ["TOKEN_MAKERS"]

MALFORMED = "MalformedMessage"
CLASS_ID = b"DDS:Auth:PKI-DH:1.0"
LE = b"\1"


# --- DataHolder -----------------------------------------------------------------------------------------------------


def data_holders() -> Iterator[Made]:
    """Lengths and counts that are not true: CVE-2025-62599, -62600, -62602 of another stack were of this kind."""
    nothing = struct.pack("<I", 0)
    yield "empty", b"", MALFORMED
    yield "nil", octets_of(DataHolder()), "accepted"
    yield "class-id-length-4-gigabytes", LE + text(CLASS_ID, length=0xFFFFFFFF), MALFORMED
    yield "class-id-length-0", LE + nothing * 3, "accepted"
    yield "class-id-length-just-beyond", LE + text(CLASS_ID, length=25) + bytes(0), MALFORMED
    yield "class-id-not-utf-8", LE + text(b"\xff\xfe\xfd\xfc") + nothing * 2, MALFORMED
    yield "class-id-with-nul", LE + text(b"DDS\0Auth") + nothing * 2, "accepted"
    yield "properties-4-billion", LE + text(CLASS_ID) + U32_MAX, MALFORMED
    yield "properties-as-many-as-octets", LE + text(CLASS_ID) + struct.pack("<I", 4000) + bytes(4000), MALFORMED
    yield "properties-65", LE + text(CLASS_ID) + struct.pack("<I", 65) + text(b"a") * 130 + nothing, MALFORMED
    yield "property-value-cut-off", LE + text(CLASS_ID) + struct.pack("<I", 1) + text(b"name"), MALFORMED
    value = LE + text(CLASS_ID) + nothing + struct.pack("<I", 1) + text(b"c.id")
    yield "octets-4-gigabytes", value + U32_MAX, MALFORMED
    yield "octets-2-gigabytes", value + struct.pack("<I", 0x7FFFFFFF) + bytes(16), MALFORMED
    yield "octets-cut-off", value + struct.pack("<I", 5) + b"abcd", MALFORMED
    yield "binary-properties-4-billion", LE + text(CLASS_ID) + nothing + U32_MAX, MALFORMED
    yield "binary-properties-as-of-1.0", LE + text(CLASS_ID) + nothing, "accepted"


def generic_messages() -> Iterator[Made]:
    both, (request, *_) = known_pair(), waiting()
    message = GenericMessage(
        message_identity=MessageIdentity(both.initiator.guid, 1),
        destination_participant_guid=both.replier.guid,
        message_class_id=AUTH,
        message_data=(request,),
    )
    whole = write_generic_message(message)
    at_class_id = 4 + 96
    yield "empty", b"", MALFORMED
    yield "header-alone", whole[:4], MALFORMED
    yield "parameter-list", b"\0\3" + whole[2:], MALFORMED
    yield "cut-off-in-the-guids", whole[:60], MALFORMED
    yield "class-id-length-4-gigabytes", whole[:at_class_id] + U32_MAX + whole[at_class_id + 4 :], MALFORMED
    at_count = at_class_id + len(text(AUTH.encode()))
    # All of it parsed before anything was known of it: CVE-2025-62603.
    yield "tokens-4-billion", whole[:at_count] + U32_MAX + whole[at_count + 4 :], MALFORMED
    yield "tokens-9", whole[:at_count] + struct.pack("<I", 9) + whole[at_count + 4 :] * 9, MALFORMED
    none = replace(message, message_data=())
    yield "no-token", write_generic_message(none), "accepted"
    yield "big-endian-octets-said-to-be-little", b"\0\0" + whole[2:], MALFORMED


# --- identities -----------------------------------------------------------------------------------------------------


def identity_tokens() -> Iterator[Made]:
    yield "another-plugin", octets_of(DataHolder("DDS:Auth:PSK:1.2")), "Refused"
    yield "major-version-2", octets_of(DataHolder("DDS:Auth:PKI-DH:2.0")), "Refused"
    yield "nil", octets_of(DataHolder()), "Refused"
    yield "version-of-many-digits", octets_of(DataHolder("DDS:Auth:PKI-DH:1." + "9" * 3000)), "Refused"
    yield "handshake-token", octets_of(DataHolder("DDS:Auth:PKI-DH:1.0+Req")), "Refused"
    yield "control-characters", octets_of(DataHolder("DDS:Auth\n\x1b[31m:1.0")), "Refused"


def auth_requests() -> Iterator[Made]:
    class_id = "DDS:Auth:PKI-DH:1.0+AuthReq"
    yield "challenge-missing", octets_of(DataHolder(class_id)), "Refused"
    for length in (0, 31, 33, 60_000):
        holder = DataHolder(class_id, (), (("future_challenge", bytes(length)),))
        yield f"challenge-of-{length}-octets", octets_of(holder), "Refused"
    holder = DataHolder("DDS:Auth:PKI-DH:1.0+Req", (), (("future_challenge", bytes(32)),))
    yield "another-token", octets_of(holder), "Refused"


def altered(token: DataHolder, **values: bytes | None) -> bytes:
    """With other values; None for none.  ``c_id`` stands for ``c.id``."""
    new = {name.replace("c_", "c.", 1) if name.startswith("c_") else name: value for name, value in values.items()}
    properties = [(name, new.pop(name, value)) for name, value in token.binary_properties]
    properties += list(new.items())
    return octets_of(replace(token, binary_properties=tuple((n, v) for n, v in properties if v is not None)))


def requests() -> Iterator[Made]:
    """To one who waits for any: certificates, participant data, algorithms and keys of all kinds."""
    request, both = waiting()[0], known_pair()

    def changed(**values: bytes | None) -> bytes:
        return altered(request, hash_c1=None, **values)

    for name, pem, words in hostile_certificates():
        yield f"certificate-{name}", changed(c_id=pem), f"Refused ~ {words}"
    for name in ("c.id", "c.pdata", "c.dsign_algo", "c.kagree_algo", "dh1", "challenge1"):
        yield f"without-{name}", changed(**{name.replace(".", "_"): None}), f"Refused ~ {name}"
    yield "hash-of-something-else", altered(request, hash_c1=bytes(32)), "Refused ~ hash_c1"
    yield "hash-of-no-octets", altered(request, hash_c1=b""), "Refused ~ hash_c1"
    yield "challenge-of-31-octets", changed(challenge1=bytes(31)), "Refused ~ challenge1"
    yield "guid-of-the-replier", changed(c_pdata=participant_data(both.replier.guid)), "Refused ~ c.pdata"
    yield "guid-missing", changed(c_pdata=b"\0\1\0\0"), "Refused ~ c.pdata"
    # Its certificate's key alone decides: some say there how their authority signs (Fast DDS).
    yield "signs-by-rsa-with-an-ec-key", changed(c_dsign_algo=b"RSASSA-PSS-SHA256"), "accepted"
    yield "signs-by-nothing-known", changed(c_dsign_algo=b"\xff" * 3000), "Refused"
    yield "agrees-by-nothing-known", changed(c_kagree_algo=b"X25519\n\x1b[31m"), "Refused ~ key agreement"
    for name, public in hostile_points():
        yield f"ecdh-{name}", changed(dh1=public), "Refused ~ public key"
    for name, public in hostile_modp_numbers():
        yield f"modp-{name}", changed(dh1=public, c_kagree_algo=b"DH+MODP-2048-256"), "Refused ~ public key"
    yield "reply-instead", octets_of(waiting()[2]), "Refused"
    yield "class-id-of-2.0", octets_of(replace(request, class_id="DDS:Auth:PKI-DH:2.0+Req")), "Refused"
    twice = replace(request, binary_properties=request.binary_properties * 2)
    # The first of the same name counts, for the hash as for everything else.
    yield "all-properties-twice", octets_of(twice), "accepted"


def replies() -> Iterator[Made]:
    reply = waiting()[2]
    yield "without-signature", altered(reply, signature=None), "Refused ~ signature"
    yield "signature-of-no-octets", altered(reply, signature=b""), "Refused"
    yield "signature-of-zeros", altered(reply, signature=bytes(72)), "Refused"
    huge_r = b"\x30\x82\x20\x00\x02\x82\x10\x00" + b"\x7f" * 200
    yield "signature-der-longer-than-it-is", altered(reply, signature=huge_r), "Refused"
    yield "another-dh1", altered(reply, dh1=EphemeralKey(ECDH_P256, 7).public), "Refused ~ dh1"
    yield "another-challenge1", altered(reply, challenge1=bytes(32)), "Refused ~ challenge1"
    yield "without-challenge2", altered(reply, challenge2=None), "Refused ~ challenge2"
    yield "another-key-agreement", altered(reply, c_kagree_algo=b"DH+MODP-2048-256", hash_c2=None), "Refused"
    yield "request-instead", octets_of(waiting()[0]), "Refused"


def finals() -> Iterator[Made]:
    final = waiting()[4]
    yield "without-signature", altered(final, signature=None), "Refused ~ signature"
    yield "signature-of-the-reply", altered(final, signature=waiting()[2].binary_property("signature")), "Refused"
    yield "another-challenge2", altered(final, challenge2=bytes(32)), "Refused ~ challenge2"
    yield "another-hash", altered(final, hash_c2=bytes(32)), "Refused ~ hash_c2"
    yield "without-challenges", altered(final, challenge1=None, challenge2=None), "Refused ~ challenge1"


# --- certificates ---------------------------------------------------------------------------------------------------


def hostile_certificates() -> Iterator[tuple[str, bytes, str]]:
    """All for alice, whose Guid goes with her subject: what is wrong is something else.  Name, PEM, words of why."""
    key, subject = owner("alice").key, "CN=alice,O=Peers"
    ca, other_ca = owner("identity_ca"), issue("CN=identity_ca,O=Tests", ec_key("an impostor"))

    def pem(certificate: x509.Certificate) -> bytes:
        return certificate.public_bytes(serialization.Encoding.PEM)

    def issued(**how: object) -> bytes:
        return pem(issue(subject, key, ca, **how).certificate)  # type: ignore[arg-type]

    good = owner("alice").pem.encode()
    yield "nothing", b"", "certificate"
    yield "no-pem", b"-----BEGIN CERTIFICATE-----\n-----END CERTIFICATE-----\n", "certificate"
    yield "cut-off", good[:200] + b"\n-----END CERTIFICATE-----\n", "certificate"
    yield "expired", issued(not_before=NOW_S - 9 * DAY_S, not_after=NOW_S - DAY_S), "expired"
    yield "not-yet-valid", issued(not_before=NOW_S + DAY_S, not_after=NOW_S + 9 * DAY_S), "valid only from"
    yield "of-another-authority-of-that-name", pem(issue(subject, key, other_ca).certificate), "signature"
    yield "self-signed", pem(issue(subject, key).certificate), "issued by"
    shouting = "CN=a\n\x1b[2Jkernel: all is well,O=\u202e"
    yield "self-signed-with-control-characters", pem(issue(shouting, key).certificate), "issued by"
    below = issue("CN=intermediate,O=Tests", ec_key("intermediate"), ca)
    yield "of-an-intermediate", pem(issue(subject, key, below).certificate), "issued by"
    yield "of-somebody-else", owner("bob").pem.encode(), "Guid"
    yield "key-on-p-521", pem(issue(subject, ec_key("alice", ec.SECP521R1()), ca).certificate), "521"
    small = rsa.generate_private_key(65537, 1024)
    yield "key-of-1024-bits", pem(issue(subject, small, ca).certificate), "1024"
    yield "key-of-dsa", _with_dsa_key(subject), ""
    unknown = x509.UnrecognizedExtension(x509.ObjectIdentifier("1.2.3.4.5"), bytes(8))
    yield "unknown-critical-extension", issued(extensions=[(unknown, True)]), "extension"
    long_name = "CN=" + "a" * 60 + "".join(f",OU={number}" + "b" * 50 for number in range(200))
    yield "of-a-long-name", pem(issue(long_name, key, ca).certificate), ""
    altered_good = bytearray(good)
    middle = good.index(b"\n", 300) - 20
    altered_good[middle] = ord("A") if good[middle] != ord("A") else ord("B")
    yield "altered", bytes(altered_good), ""
    yield "of-a-mebibyte", b"-----BEGIN CERTIFICATE-----\n" + b"A" * 60_000, ""


def _with_dsa_key(subject: str) -> bytes:
    signer = owner("identity_ca")
    assert isinstance(signer.key, ec.EllipticCurvePrivateKey)
    template = owner("alice").certificate
    builder = x509.CertificateBuilder(
        issuer_name=signer.certificate.subject,
        subject_name=x509.Name.from_rfc4514_string(subject),
        public_key=dsa.generate_private_key(2048).public_key(),
        serial_number=7,
        not_valid_before=template.not_valid_before_utc,
        not_valid_after=template.not_valid_after_utc,
    )
    return builder.sign(signer.key, hashes.SHA256()).public_bytes(serialization.Encoding.PEM)


def certificates() -> Iterator[Made]:
    for name, pem, words in hostile_certificates():
        if name != "of-somebody-else":  # which is a good one
            yield name, pem, f"NotTrusted ~ {words}" if name != "of-a-long-name" else "accepted"
    der = owner("alice").certificate.public_bytes(serialization.Encoding.DER)
    yield "der-with-a-longer-length", b"\x30\x84\x7f\xff\xff\xff" + der[4:], "NotTrusted"
    yield "der-of-indefinite-length", b"\x30\x80" + der[4:] + bytes(2), "NotTrusted"
    yield "der-nested-1000-deep", b"\x30\x80" * 1000, "NotTrusted"


# --- public keys ----------------------------------------------------------------------------------------------------

P = int(
    "87A8E61DB4B6663CFFBBD19C651959998CEEF608660DD0F25D2CEED4435E3B00E00DF8F1D61957D4FAF7DF4561B2AA30"
    "16C3D91134096FAA3BF4296D830E9A7C209E0C6497517ABD5A8A9D306BCF67ED91F9E6725B4758C022E0B1EF4275BF7B"
    "6C5BFC11D45F9088B941F54EB1E59BB8BC39A0BF12307F5C4FDB70C581B23F76B63ACAE1CAA6B7902D52526735488A0E"
    "F13C6D9A51BFA4AB3AD8347796524D8EF6A167B5A41825D967E144E5140564251CCACB83E6B486F6B3CA3F7971506026"
    "C0B857F689962856DED4010ABD0BE621C3A3960A54E710C375F26375D7014103A4B54330C198AF126116D2276E11715F"
    "693877FAD7EF09CADB094AE91E1A1597",
    16,
)


def hostile_points() -> Iterator[tuple[str, bytes]]:
    good = EphemeralKey(ECDH_P256, 99).public
    yield "nothing", b""
    yield "infinity", b"\0"
    yield "infinity-in-65-octets", bytes(65)
    yield "off-the-curve", good[:-1] + bytes([good[-1] ^ 1])
    yield "coordinates-0", b"\4" + bytes(64)
    yield "coordinates-beyond-the-field", b"\4" + b"\xff" * 64
    yield "compressed", bytes([2 + good[-1] % 2]) + good[1:33]
    yield "one-octet-short", good[:-1]
    yield "one-octet-long", good + b"\0"
    twist = next(x for x in range(2, 100) if not _is_on_curve(x))
    yield "x-of-the-twist", b"\4" + twist.to_bytes(32, "big") + bytes(31) + b"\1"
    yield (
        "of-p-384",
        ec_key("alice", ec.SECP384R1())
        .public_key()
        .public_bytes(serialization.Encoding.X962, serialization.PublicFormat.UncompressedPoint),
    )


def _is_on_curve(x: int) -> bool:
    try:
        ec.EllipticCurvePublicKey.from_encoded_point(ec.SECP256R1(), b"\2" + x.to_bytes(32, "big"))
    except ValueError:
        return False
    return True


def hostile_modp_numbers() -> Iterator[tuple[str, bytes]]:
    """Elements of small subgroups give away the private key, or a shared secret that can be guessed."""
    yield "nothing", b""
    for name, number in [("0", 0), ("1", 1), ("p-1", P - 1), ("p", P), ("p+1", P + 1)]:
        yield f"number-{name}", number.to_bytes(256, "big")
    yield "number-of-order-3-or-so", _of_small_order().to_bytes(256, "big")
    outside = next(number for number in range(2, 100) if pow(number, _Q, P) != 1)
    yield "number-outside-the-subgroup", outside.to_bytes(256, "big")
    yield "number-of-4096-bits", b"\xff" * 512
    yield "der-negative", b"\x02\x82\x01\x00" + b"\xff" * 256
    yield "der-longer-than-it-is", b"\x02\x82\xff\xff" + b"\1" * 300
    yield "der-of-no-octets", b"\x02\x00"


_Q = int("8CF83642A709A097B447997640129DA299B1A47D1EB3750BA308B0FE64F5FBD3", 16)


def _of_small_order() -> int:
    """An element whose order is a small factor of p - 1 other than 2."""
    order = next(factor for factor in range(3, 100_000, 2) if (P - 1) % factor == 0)
    return next(element for base in range(2, 50) if (element := pow(base, (P - 1) // order, P)) != 1)


def public_keys() -> Iterator[Made]:
    for name, public in hostile_points():
        yield f"ecdh-{name}", b"\0" + public, "NotTrusted"
    for name, public in hostile_modp_numbers():
        yield f"modp-{name}", b"\1" + public, "NotTrusted"


def pdatas() -> Iterator[Made]:
    guid = known_pair().initiator.guid
    yield "nothing", b"", "NotTrusted"
    yield "without-end", b"\0\x50\0\x10" + guid, "NotTrusted"
    yield "without-guid", b"\0\1\0\0", "NotTrusted"
    yield "guid-of-12-octets", b"\0\x50\0\x0c" + guid[:12] + b"\0\1\0\0", "NotTrusted"
    yield "length-beyond-the-end", b"\x80\1\xff\xfc" + participant_data(guid), "NotTrusted"
    yield "parameters-15000", b"\x80\1\0\0" * 15_000 + participant_data(guid), "NotTrusted"
    other = Guid(bytes(15) + b"\1")
    # The first counts, and is compared with the Guid that was announced.
    yield "two-guids", b"\0\x50\0\x10" + other + participant_data(guid), "accepted"
    token = b"\x10\1\0\x08" + b"\x7f\xff\xff\xff" + bytes(4)
    yield "identity-token-of-2-gigabytes", token + participant_data(guid), "NotTrusted"


TOKEN_MAKERS: dict[str, Callable[[], Iterator[Made]]] = {
    "data_holder": data_holders,
    "generic_message": generic_messages,
    "identity_token": identity_tokens,
    "auth_request": auth_requests,
    "handshake_request": requests,
    "handshake_reply": replies,
    "handshake_final": finals,
    "certificate": certificates,
    "public_key": public_keys,
    "pdata": pdatas,
}
