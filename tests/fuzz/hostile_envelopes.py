"""Hostile key material and envelopes, for ``make_corpus``."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from tests.fuzz.envelopes import receiver, sealed, sender_material
from tests.fuzz.hostile_messages import Made, submessage
from tests.security.captured.straight import SEC_BODY, SEC_POSTFIX, SEC_PREFIX, SRTPS_POSTFIX, SRTPS_PREFIX
from tests.security.cryptographic import vectors as v

__all__ = ["ENVELOPE_MAKERS"]

MALFORMED = "MalformedMessage"
ORIGIN, ENCRYPTED, SIGNED = b"\0", b"\1", b"\2"
"""The receivers: with origin authentication, with encryption alone, and with signatures."""


def key_materials() -> Iterator[Made]:
    """What one stack parsed without looking whether it was all there."""
    good = v.MATERIAL_256_WITH_RECEIVER
    plain = v.MATERIAL_256
    yield "nothing", b"", MALFORMED
    yield "one-octet-short", good[:-1], MALFORMED
    yield "one-octet-long", good + b"\0", MALFORMED
    yield "kind-5", b"\0\0\0\5" + good[4:], MALFORMED
    yield "kind-with-a-revision", b"\0\0\1\4" + good[4:], MALFORMED
    yield "salt-of-31-octets", good[:4] + b"\0\0\0\x1f" + good[9:], MALFORMED
    yield "salt-of-4-gigabytes", good[:4] + b"\xff" * 4 + good[8:], MALFORMED
    yield "salt-of-0-octets", good[:4] + bytes(4) + good[40:], MALFORMED
    yield "key-of-4-gigabytes", good[:44] + b"\xff" * 4 + good[48:], MALFORMED
    yield "key-of-16-octets-of-a-kind-with-32", good[:44] + b"\0\0\0\x10" + good[64:], MALFORMED
    yield "key-of-zeros", good[:48] + bytes(32) + good[80:], MALFORMED
    yield "salt-of-zeros", good[:8] + bytes(32) + good[40:], MALFORMED
    yield "receiver-key-of-zeros", good[:88] + bytes(32), MALFORMED
    yield "receiver-key-of-4-gigabytes", good[:84] + b"\xff" * 4 + good[88:], MALFORMED
    yield "receiver-key-without-id", good[:80] + bytes(4) + good[84:], MALFORMED
    yield "receiver-id-without-key", plain[:80] + b"\0\0\0\1" + bytes(4), MALFORMED
    yield "key-id-0", good[:40] + bytes(4) + good[44:], MALFORMED
    yield "none", bytes(24), "accepted"
    yield "none-of-44-octets", bytes(44), "accepted"
    yield "none-of-5000-octets", bytes(5000), MALFORMED


def crypto_tokens() -> Iterator[Made]:
    keymat = v.MATERIAL_256_WITH_RECEIVER
    for what, number in (("participant", 0), ("writer", 4), ("reader", 8)):
        yield f"{what}-without-key", ORIGIN + bytes([number | 1]) + bytes(24), "Refused"
        yield f"{what}-with-3-tokens", ORIGIN + bytes([number | 3]) + keymat, "Refused"
        yield f"{what}-without-receiver-key", ORIGIN + bytes([number | 1]) + v.MATERIAL_256, "Refused"
        yield (
            f"{what}-that-signs-where-it-should-encrypt",
            ENCRYPTED + bytes([number | 1, 0, 0, 0, 3]) + keymat[4:],
            "Refused",
        )
        yield f"{what}-malformed", ENCRYPTED + bytes([number | 1]) + keymat[:60], "Refused"


# --- from outside ---------------------------------------------------------------------------------------------------


def captured(which: bytes, kind: str) -> bytes:
    """The shortest envelope of a kind that the receiver opened."""
    found = [opened for entries in receiver(which[0]).opened.values() for opened in entries if opened.kind == kind]
    return min((bytes(opened.encoded) for opened in found), key=len)


def envelopes(which: bytes, good: bytes, at: int, prefix: int, postfix: int) -> Iterator[Made]:
    """Things that may be wrong with an encrypted envelope that begins at ``at``; what is inside is beside the point."""
    head, envelope = which + good[:at], good[at:]
    length = int.from_bytes(envelope[26:28], "little")
    first, body, last = envelope[:24], envelope[24 : 28 + length], envelope[28 + length :]
    last = last[: 4 + int.from_bytes(last[2:4], "little")]
    assert (first[0], body[0], last[0]) == (prefix, SEC_BODY, postfix)
    rejected = "Rejected"
    yield "prefix-alone", head + first, rejected
    yield "prefix-cut-off", head + first[:20], rejected
    yield "prefix-of-length-0", head + first[:2] + bytes(2) + first[4:] + body + last, rejected
    yield "without-body", head + first + last, rejected
    yield "without-postfix", head + first + body, rejected
    yield "two-bodies", head + first + body + body + last, rejected
    yield "two-prefixes", head + first + first + body + last, rejected
    yield "body-length-beyond-the-end", head + first + body[:2] + b"\xfc\xff" + body[4:] + last, rejected
    yield "content-length-4-gigabytes", head + first + body[:4] + b"\xff" * 4 + body[8:] + last, rejected
    yield "content-length-0", head + first + body[:4] + bytes(4) + body[8:] + last, rejected
    yield "body-of-no-octets", head + first + submessage(SEC_BODY, b"\0\0\0\0") + last, rejected
    yield "macs-4-billion", head + first + body + last[:20] + b"\xff" * 4 + last[24:], rejected
    yield "macs-fewer-than-octets", head + first + body + last[:20] + bytes(4) + bytes(20) + last[24:], rejected
    many = submessage(postfix, last[4:20] + (3000).to_bytes(4, "big") + bytes(60_000))
    yield "macs-3000-of-nobody", head + first + body + many, "NotForUs"
    yield "footer-of-4-octets", head + first + body + submessage(postfix, bytes(4)), rejected
    yield "key-unknown", head + first[:8] + b"\xde\xad\xbe\xef" + first[12:] + body + last, "NoKeys"
    yield "kind-none", head + first[:4] + bytes(4) + first[8:] + body + last, f"{rejected} ~ kind"
    yield "kind-of-a-signature", head + first[:4] + b"\0\0\0\3" + first[8:] + body + last, f"{rejected} ~ kind"
    yield "another-session", head + first[:12] + b"\xff" * 4 + first[16:] + body + last, rejected
    yield "mac-of-zeros", head + first + body + last[:4] + bytes(16) + last[20:], rejected
    yield "big-endian-lengths-said-to-be-little", head + first[:2] + first[3:1:-1] + first[4:] + body + last, rejected


def messages() -> Iterator[Made]:
    good = captured(ORIGIN, "rtps_messages")
    yield from envelopes(ORIGIN, good, 20, SRTPS_PREFIX, SRTPS_POSTFIX)
    yield "nothing", b"", "Rejected"
    yield "header-alone", ORIGIN + good[:20], "Rejected"
    yield "not-protected", ORIGIN + good[:20] + submessage(0x01, bytes(4)), "Rejected"
    yield "source-of-somebody-else", ORIGIN + good[:8] + bytes(12) + good[20:], "Rejected"
    signed = captured(SIGNED, "rtps_messages")
    yield "signed-without-postfix", SIGNED + signed[:44] + submessage(0x01, bytes(16)), "Rejected"
    yield "signed-by-somebody-else", ENCRYPTED + signed, "NoKeys"


def submessages() -> Iterator[Made]:
    good = captured(ORIGIN, "datawriter_submessages")
    yield from envelopes(ORIGIN, good, 0, SEC_PREFIX, SEC_POSTFIX)
    yield "nothing", b"", "Rejected"
    yield "volatile-of-somebody-else", ORIGIN + good[:8] + bytes(4) + good[12:], "Rejected"
    signed = captured(SIGNED, "datawriter_submessages")
    yield "signed-of-10000-submessages", SIGNED + signed[:24] + submessage(0x01, b"") * 10_000, "Rejected"


def payloads() -> Iterator[Made]:
    good = captured(ENCRYPTED, "payloads")
    yield "nothing", b"", "Rejected"
    yield "header-alone", ENCRYPTED + good[:20], "Rejected"
    yield "39-octets", ENCRYPTED + good[:39], "Rejected"
    yield "content-length-4-gigabytes", ENCRYPTED + good[:20] + b"\xff" * 4 + good[24:], "Rejected"
    yield "content-length-0", ENCRYPTED + good[:20] + bytes(4) + good[24:], "Rejected"
    yield "receiver-macs", ENCRYPTED + good[:-4] + b"\0\0\0\1" + bytes(20), "Rejected"
    yield "macs-4-billion", ENCRYPTED + good[:-4] + b"\xff" * 4, "Rejected"
    yield "not-protected", ENCRYPTED + b"\0\1\0\0" + bytes(60), "NoKeys"
    yield "key-unknown", ENCRYPTED + good[:4] + b"\xde\xad\xbe\xef" + good[8:], "NoKeys"
    signed = captured(SIGNED, "payloads")
    yield "signed-of-no-octets", SIGNED + signed[:20] + signed[-20:], "Rejected"


# --- from inside ----------------------------------------------------------------------------------------------------


def sealed_messages() -> Iterator[Made]:
    """By a participant that was admitted."""
    role = receiver(0)
    prefix = bytes(next(iter(role.remotes)))
    info_src = submessage(0x0C, bytes(4) + b"\2\1\1\x10" + prefix)
    other = submessage(0x0C, bytes(4) + b"\2\1\1\x10" + bytes(12))
    pad = submessage(0x01, bytes(4))
    inner = sealed(info_src + pad, sender_material(0, "participant"), SRTPS_PREFIX, SRTPS_POSTFIX)
    for name, which in (("origin", ORIGIN), ("encrypted", ENCRYPTED)):
        yield f"{name}-empty", which, "Rejected"
        yield f"{name}-of-3-octets", which + bytes(3), "Rejected"
        yield f"{name}-without-info-src", which + pad * 8, "Rejected"
        yield f"{name}-in-the-name-of-another", which + other + pad, "Rejected"
        yield f"{name}-info-src-too-short", which + submessage(0x0C, bytes(8)) + pad, "Rejected"
    yield "message-in-a-message", ORIGIN + info_src + inner, "accepted"
    long = submessage(0x15, bytes(20), length=0xFFFF)
    yield "length-beyond-the-end", ORIGIN + info_src + long, MALFORMED
    everything = bytes.fromhex("00000204000001030000000001000000ffffff7fffffffff00000000")
    yield "gap-of-everything", ORIGIN + info_src + submessage(0x08, everything), "accepted"
    spoofed = info_src + other + pad
    yield "another-source-behind-the-first", ORIGIN + spoofed, "accepted"


def sealed_submessages() -> Iterator[Made]:
    pad = submessage(0x01, bytes(4))
    triple = sealed(pad, sender_material(0, "datawriter"), SEC_PREFIX, SEC_POSTFIX)
    yield "empty", ORIGIN, "Rejected"
    yield "of-3-octets", ORIGIN + bytes(3), "Rejected"
    yield "two-submessages", ORIGIN + pad + pad, "Rejected"
    yield "prefix-inside", ORIGIN + triple[:24], "Rejected"
    yield "triple-inside", ORIGIN + triple, "Rejected"
    yield "postfix-inside", ORIGIN + submessage(SEC_POSTFIX, bytes(20)), "Rejected"
    yield "message-inside", ORIGIN + submessage(SRTPS_PREFIX, bytes(20)), "Rejected"
    yield "length-beyond-the-end", ORIGIN + submessage(0x15, bytes(20), length=0xFFFF), "Rejected"
    yield "data-malformed", ORIGIN + submessage(0x15, bytes(20)), MALFORMED
    yield "signed-postfix-inside", SIGNED + submessage(SEC_POSTFIX, bytes(20)), "Rejected"
    yield "signed-empty", SIGNED, "Rejected"


ENVELOPE_MAKERS: dict[str, Callable[[], Iterator[Made]]] = {
    "key_material": key_materials,
    "crypto_tokens": crypto_tokens,
    "secured_message": messages,
    "secured_submessage": submessages,
    "secured_payload": payloads,
    "sealed_message": sealed_messages,
    "sealed_submessage": sealed_submessages,
}
