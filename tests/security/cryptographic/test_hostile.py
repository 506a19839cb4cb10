"""Octets that nobody honest sends: each is answered by an outcome, and none by an exception.

And octets that only others send: big-endian headers, lengths of 0, something in clear behind the end.
"""

from __future__ import annotations

import random
import struct
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.spi import NOT_FOR_US, NoKeys, NotForUs, Octets, Outcome, Rejected
from ddsi_security.cryptographic import opening, payload
from ddsi_security.cryptographic.aes_gcm import LARGE
from ddsi_security.cryptographic.openers import payload_opener, submessage_opener
from ddsi_security.cryptographic.sealing import seal_message, seal_submessage
from ddsi_security.cryptographic.transformation import Protection, TransformationKind
from tests.security.cryptographic import vectors
from tests.security.cryptographic.keys import (
    Kind,
    endpoint_attributes,
    match,
    material,
    octets_of,
    pair,
    receiver_key,
    ring,
    sending_key,
)

GCM, GMAC = TransformationKind.AES256_GCM, TransformationKind.AES256_GMAC
Opener = Callable[[bytes], Octets | Outcome]


def opener(function: Callable[..., Octets | Outcome], kind: TransformationKind, *, origin: bool) -> Opener:
    expected = Protection(kind.encrypts, origin)
    return lambda octets: function(octets, ring(material(kind, for_receiver=origin)), expected)


# Protected octets, what opens them, what comes out, and those of them that nothing depends on.
GENUINE: dict[str, tuple[bytes, Opener, bytes]] = {
    "payload, encrypted": (
        vectors.PAYLOAD_ENCRYPTED_256,
        opener(payload.decode_payload, GCM, origin=False),
        vectors.PAYLOAD,
    ),
    "payload, signed": (
        vectors.PAYLOAD_SIGNED_256,
        opener(payload.decode_payload, GMAC, origin=False),
        vectors.PAYLOAD,
    ),
    "submessage, encrypted": (
        vectors.HEARTBEAT_ENCRYPTED_FOR_ONE,
        opener(opening.open_submessage, GCM, origin=True),
        vectors.HEARTBEAT,
    ),
    "submessage, signed": (
        vectors.HEARTBEAT_SIGNED_FOR_ONE,
        opener(opening.open_submessage, GMAC, origin=True),
        vectors.HEARTBEAT,
    ),
    "message, encrypted": (
        vectors.MESSAGE_ENCRYPTED_FOR_ONE,
        opener(opening.open_message, GCM, origin=True),
        vectors.MESSAGE,
    ),
    "message, signed": (vectors.MESSAGE_SIGNED, opener(opening.open_message, GMAC, origin=False), vectors.MESSAGE),
}
EACH = pytest.mark.parametrize(("octets", "open_it", "plain"), GENUINE.values(), ids=GENUINE)


@EACH
def test_the_genuine_ones_open(octets: bytes, open_it: Opener, plain: bytes) -> None:
    assert open_it(octets) == plain


@EACH
def test_a_flipped_bit_is_noticed_or_changes_nothing(octets: bytes, open_it: Opener, plain: bytes) -> None:
    """Nothing is authenticated of the flags (but the byte order), or of a message's clear header before the prefix."""
    unnoticed = set()
    for at in range(len(octets)):
        for bit in range(8):
            flipped = bytearray(octets)
            flipped[at] ^= 1 << bit
            found = open_it(bytes(flipped))
            if found is NOT_FOR_US:  # whose the last MAC is, was changed
                assert len(octets) - 20 <= at < len(octets) - 16
            elif isinstance(found, Outcome):
                assert isinstance(found, Rejected | NoKeys)
            else:
                assert found == plain
                unnoticed.add(at)
    flags = {at + 1 for at in _heads(octets)}
    clear = set(range(8)) if octets.startswith(b"RTPS") else set()
    assert unnoticed <= flags | clear


def _heads(octets: bytes) -> set[int]:
    """Where the submessages of the envelope begin."""
    if octets[0] == 0:
        return set()
    at = 20 if octets.startswith(b"RTPS") else 0
    found = set()
    while at < len(octets):
        found.add(at)
        at += 4 + int.from_bytes(octets[at + 2 : at + 4], "little")
    return found


@EACH
def test_no_part_of_them_opens(octets: bytes, open_it: Opener, plain: bytes) -> None:
    for length in range(len(octets)):
        assert isinstance(open_it(octets[:length]), Rejected)


@EACH
def test_what_follows_does_not_matter_or_is_rejected(octets: bytes, open_it: Opener, plain: bytes) -> None:
    for more in (b"\0", bytes(4), bytes(60), octets):
        found = open_it(octets + more)
        assert found == plain or isinstance(found, Rejected)


@EACH
@given(data=st.data())
def test_any_octets_have_an_outcome(octets: bytes, open_it: Opener, plain: bytes, data: st.DataObject) -> None:
    """Genuine ones with a few runs overwritten, cut out or repeated."""
    mutant = bytearray(octets)
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(mutant)))
        end = min(start + data.draw(st.integers(0, 24)), len(mutant))
        mutant[start:end] = data.draw(st.binary(max_size=24) | st.just(bytes(mutant[start:end] * 2)))
    found = open_it(bytes(mutant))
    assert isinstance(found, Rejected | NoKeys | NotForUs) or found == plain


@given(data=st.data())
def test_the_short_way_opens_what_the_general_one_opens(data: st.DataObject) -> None:
    """And nothing else.  It is for keys and sessions that were used before."""
    keys, expected = ring(material(GCM)), Protection(encrypted=True)
    genuine = vectors.HEARTBEAT_ENCRYPTED
    assert opening.open_submessage(genuine, keys, expected) == vectors.HEARTBEAT
    opener = submessage_opener(genuine, keys, expected, vectors.HEARTBEAT[8:12])
    assert opener is not None
    assert opener.open(genuine, 0, len(genuine)) == (vectors.HEARTBEAT, len(genuine))
    mutant = bytearray(genuine)
    for _ in range(data.draw(st.integers(1, 3))):
        start = data.draw(st.integers(0, len(mutant)))
        end = min(start + data.draw(st.integers(0, 8)), len(mutant))
        mutant[start:end] = data.draw(st.binary(max_size=8) | st.just(bytes(mutant[start:end] * 2)))
    if mutant[:16] == genuine[:16]:
        short = opener.open(bytes(mutant), 0, len(mutant))
        assert short is None or short[0] == opening.open_submessage(bytes(mutant[: short[1]]), keys, expected)


@given(data=st.data())
def test_the_short_way_of_payloads_opens_what_the_general_one_opens(data: st.DataObject) -> None:
    keys, expected = ring(material(GCM)), Protection(encrypted=True)
    genuine = vectors.PAYLOAD_ENCRYPTED_256
    assert payload_opener(genuine, keys, expected) is None, "its session is new"
    assert payload.decode_payload(genuine, keys, expected) == vectors.PAYLOAD
    opener = payload_opener(genuine, keys, expected)
    assert opener is not None
    assert opener.open(genuine) == vectors.PAYLOAD
    mutant = bytearray(genuine)
    for _ in range(data.draw(st.integers(1, 3))):
        start = data.draw(st.integers(0, len(mutant)))
        end = min(start + data.draw(st.integers(0, 8)), len(mutant))
        mutant[start:end] = data.draw(st.binary(max_size=8) | st.just(bytes(mutant[start:end] * 2)))
    if mutant[:12] == genuine[:12]:
        short = opener.open(bytes(mutant))
        assert short is None or short == payload.decode_payload(bytes(mutant), keys, None)


@given(st.binary(max_size=300))
def test_random_octets_have_an_outcome(octets: bytes) -> None:
    for _, open_it, _ in GENUINE.values():
        assert isinstance(open_it(octets), Rejected | NoKeys)


# --- payloads --------------------------------------------------------------------------------------------------------


def open_payload(octets: bytes) -> Octets | Outcome:
    return GENUINE["payload, encrypted"][1](octets)


@pytest.mark.parametrize("length", [0, 15, 17, 20, 0x7FFFFFFF, 0xFFFFFFFF])
def test_a_cipher_text_of_another_length_is_rejected(length: int) -> None:
    genuine = vectors.PAYLOAD_ENCRYPTED_256
    assert isinstance(open_payload(genuine[:20] + length.to_bytes(4, "big") + genuine[24:]), Rejected)


@pytest.mark.parametrize("count", [1, 0xFFFFFFFF])
def test_a_payload_has_no_receivers(count: int) -> None:
    for name in ("payload, encrypted", "payload, signed"):
        genuine, open_it, _ = GENUINE[name]
        assert isinstance(open_it(genuine[:-4] + count.to_bytes(4, "big")), Rejected)
        assert isinstance(open_it(genuine[:-4] + count.to_bytes(4, "big") + bytes(20)), Rejected)


def test_an_encrypted_payload_may_be_padded_up_to_4() -> None:
    """By the DATA around it, where the peer encrypts payloads of any length."""
    for padding in (1, 2, 3):
        assert open_payload(vectors.PAYLOAD_ENCRYPTED_256 + bytes(padding)) == vectors.PAYLOAD
    assert isinstance(open_payload(vectors.PAYLOAD_ENCRYPTED_256 + bytes(4)), Rejected)


# --- envelopes -------------------------------------------------------------------------------------------------------

PREFIX, BODY, POSTFIX = (
    vectors.HEARTBEAT_ENCRYPTED[:24],
    vectors.HEARTBEAT_ENCRYPTED[24:64],
    vectors.HEARTBEAT_ENCRYPTED[64:],
)
PAD = b"\x01\x01\0\0"
CLEAR_POSTFIX = vectors.HEARTBEAT_SIGNED_FOR_ONE[56:]
SIGNED_PREFIX = vectors.HEARTBEAT_SIGNED_FOR_ONE[:24]


def open_encrypted(octets: bytes) -> Octets | Outcome:
    return opening.open_submessage(octets, ring(material()), Protection(encrypted=True))


def open_signed(octets: bytes) -> Octets | Outcome:
    return opening.open_submessage(octets, ring(material(GMAC, for_receiver=True)), Protection(encrypted=False))


def body(count: int, cipher_text: bytes = BODY[8:], *, length: int | None = None) -> bytes:
    head = struct.pack("<BBH", 0x30, 1, 4 + len(cipher_text) if length is None else length)
    return head + count.to_bytes(4, "big") + cipher_text


def postfix(count: int, macs: bytes = b"", *, length: int | None = None) -> bytes:
    head = struct.pack("<BBH", 0x32, 1, 20 + len(macs) if length is None else length)
    return head + POSTFIX[4:20] + count.to_bytes(4, "big") + macs


MALFORMED = {
    "nothing": b"",
    "a prefix alone": PREFIX,
    "no prefix": BODY + POSTFIX,
    "no body": PREFIX + POSTFIX,
    "no postfix": PREFIX + BODY,
    "two bodies": PREFIX + BODY + BODY + POSTFIX,
    "two prefixes": PREFIX + PREFIX + BODY + POSTFIX,
    "a body before the prefix": BODY + PREFIX + POSTFIX,
    "something else between": PREFIX + BODY + PAD + POSTFIX,
    "the postfix of a message": PREFIX + BODY + b"\x34" + POSTFIX[1:],
    "the prefix of a message": b"\x33" + PREFIX[1:] + BODY + POSTFIX,
    "a prefix of 24 octets": PREFIX[:2] + b"\x18\0" + PREFIX[4:] + bytes(4) + BODY + POSTFIX,
    "a prefix of length 0": PREFIX[:2] + b"\0\0" + PREFIX[4:] + BODY + POSTFIX,
    "a body of length 0": PREFIX + body(32, length=0) + POSTFIX,
    "more cipher text than the body": PREFIX + body(33) + POSTFIX,
    "more cipher text than there is": PREFIX + body(0xFFFFFFFF) + POSTFIX,
    "less cipher text than the body": PREFIX + body(28) + POSTFIX,
    "no cipher text": PREFIX + body(0, b"") + POSTFIX,
    "a body beyond the end": PREFIX + body(32, length=0xFFFC) + POSTFIX,
    "2^32 - 1 receivers": PREFIX + BODY + postfix(0xFFFFFFFF),
    "a receiver too many": PREFIX + BODY + postfix(2, bytes(20)),
    "a receiver too few": PREFIX + BODY + postfix(1, bytes(40)),
    "receivers whose product overflows 32 bits": PREFIX + BODY + postfix(0xCCCCCCCD, bytes(4)),
    "half a receiver": PREFIX + BODY + postfix(1, bytes(10)),
    "a postfix beyond the end": PREFIX + BODY + postfix(0, length=24),
    "a postfix without its count": PREFIX + BODY + postfix(0, length=16),
    "a postfix of length 0 with more behind": PREFIX + BODY + postfix(0, length=0) + bytes(4),
}


def test_the_parts_together_are_genuine() -> None:
    assert PREFIX + body(32) + postfix(0) == vectors.HEARTBEAT_ENCRYPTED
    assert open_encrypted(PREFIX + BODY + POSTFIX) == vectors.HEARTBEAT
    assert open_signed(SIGNED_PREFIX + vectors.HEARTBEAT + CLEAR_POSTFIX) == vectors.HEARTBEAT


@pytest.mark.parametrize("octets", MALFORMED.values(), ids=MALFORMED)
def test_envelopes_of_another_form_are_rejected(octets: bytes) -> None:
    assert isinstance(open_encrypted(octets), Rejected)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        PAD + vectors.HEARTBEAT,
        vectors.HEARTBEAT + PAD,
        SIGNED_PREFIX,
        vectors.HEARTBEAT[:2] + b"\0\0" + vectors.HEARTBEAT[4:],
        vectors.HEARTBEAT[:2] + b"\xff\xff" + vectors.HEARTBEAT[4:],
        b"\x34\x01\x14\x00" + bytes(20),
    ],
)
def test_signed_octets_that_are_no_submessage_are_rejected(content: bytes) -> None:
    """Whatever the MAC says, so these are not forged ones: the key signed them."""
    buffer = octets_of(seal_submessage((content,), sending_key(material(GMAC)), []))
    assert isinstance(open_signed(buffer), Rejected)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\x07\x01",
        PAD + vectors.HEARTBEAT,
        vectors.HEARTBEAT + PAD,
        vectors.HEARTBEAT_ENCRYPTED[:24],
        b"\x30\x01\0\0",
        b"\x33\x01\x14\0" + bytes(20),
        vectors.HEARTBEAT[:2] + b"\xff\xff" + vectors.HEARTBEAT[4:],
    ],
)
def test_encrypted_octets_that_are_no_submessage_are_rejected(content: bytes) -> None:
    buffer = octets_of(seal_submessage((content,), sending_key(), []))
    assert isinstance(open_encrypted(buffer), Rejected)


@pytest.mark.parametrize(
    "content",
    [
        b"\x09\x01\x08\0" + bytes(8),  # INFO_TS, which Fast DDS protects by itself
        b"\x09\x03\0\0",  # INFO_TS without a time
        PAD,
        b"\x07\x00\x00\x1c" + vectors.HEARTBEAT[4:],  # big-endian
    ],
)
def test_any_one_submessage_is_opened(content: bytes) -> None:
    for kind, open_it in ((GCM, open_encrypted), (GMAC, open_signed)):
        buffer = octets_of(seal_submessage((content,), sending_key(material(kind)), []))
        assert open_it(buffer) == content


def _big_endian(octets: bytes, at: int) -> bytes:
    flipped = bytearray(octets)
    while at < len(flipped):
        length = int.from_bytes(flipped[at + 2 : at + 4], "little")
        if 0x30 <= flipped[at] <= 0x34:
            flipped[at + 1] = 0
            flipped[at + 2 : at + 4] = length.to_bytes(2, "big")
        at += 4 + length
    return bytes(flipped)


def _last_length_zero(octets: bytes, footer: int) -> bytes:
    at = len(octets) - footer + 2
    return octets[:at] + b"\0\0" + octets[at + 2 :]


ENVELOPES = [pytest.param(*GENUINE[name], id=name) for name in GENUINE if not name.startswith("payload")]


@pytest.mark.parametrize(("octets", "open_it", "plain"), ENVELOPES)
def test_headers_may_be_big_endian_and_the_last_length_0(octets: bytes, open_it: Opener, plain: bytes) -> None:
    """So OpenDDS writes them."""
    start = 20 if octets.startswith(b"RTPS") else 0
    footer = 24 + (20 if int.from_bytes(octets[-24:-20], "big") == 1 else 0)
    swapped = _big_endian(octets, start)
    assert swapped != octets
    assert open_it(swapped) == plain
    assert open_it(_last_length_zero(octets, footer)) == plain
    assert open_it(_last_length_zero(swapped, footer)) == plain


# --- messages --------------------------------------------------------------------------------------------------------

TRAILER = b"\x80\x01\x3c\0" + bytes(60)
"""As Fast DDS ends its messages, protected or not."""


@pytest.mark.parametrize("name", ["message, encrypted", "message, signed"])
def test_what_stands_in_clear_behind_a_protected_message_is_left_out(name: str) -> None:
    octets, open_it, plain = GENUINE[name]
    assert open_it(octets + TRAILER) == plain
    assert open_it(octets + vectors.HEARTBEAT) == plain
    twice = open_it(octets + octets[20:])
    # What is signed is taken to end with the last postfix of all, and then its MAC is wrong.
    assert twice == plain if name == "message, encrypted" else isinstance(twice, Rejected)


def test_the_header_must_name_whom_the_info_source_names() -> None:
    for name in ("message, encrypted", "message, signed"):
        octets, open_it, _ = GENUINE[name]
        forged = octets[:8] + b"another name" + octets[20:]
        found = open_it(forged)
        assert isinstance(found, Rejected)
        assert "another participant" in found.reason


def test_the_header_returned_is_the_one_that_was_protected() -> None:
    """A vendor id that was changed under way does not change how the message is read."""
    octets, open_it, plain = GENUINE["message, encrypted"]
    assert open_it(octets[:4] + b"\x02\x01\x01\x0f" + octets[8:]) == plain


@pytest.mark.parametrize("encrypted", [False, True])
@pytest.mark.parametrize("size", [0, LARGE])
@pytest.mark.parametrize(
    ("info_source", "accepted"),
    [
        (vectors.INFO_SOURCE, True),
        (vectors.INFO_SOURCE[:4] + b"RTPS" + vectors.INFO_SOURCE[8:], True),  # OpenDDS
        (b"\x0c\0\0\x14" + vectors.INFO_SOURCE[4:], True),
        (b"", False),
        (vectors.INFO_SOURCE[:12], False),
        (PAD + vectors.INFO_SOURCE, False),
        (b"\x0c\x01\x18\0" + vectors.INFO_SOURCE[4:] + bytes(4), False),
        (b"\x0c\0\x14\0" + vectors.INFO_SOURCE[4:], False),
        (vectors.HEARTBEAT, False),
    ],
)
def test_the_first_submessage_must_be_info_source(
    info_source: bytes, accepted: bool, encrypted: bool, size: int
) -> None:
    kind = GCM if encrypted else GMAC
    rest = vectors.HEARTBEAT if not size else b"\x15\x05" + size.to_bytes(2, "little") + bytes(size)
    # A submessage's envelope with the numbers of a message's.
    inner = bytearray(octets_of(seal_submessage((info_source + rest,), sending_key(material(kind)), [])))
    inner[0] = 0x33
    inner[-24] = 0x34
    open_it = opener(opening.open_message, kind, origin=False)
    found = open_it(vectors.MESSAGE_HEADER + inner)
    assert (found == vectors.MESSAGE_HEADER + rest) is accepted
    assert accepted or isinstance(found, Rejected)


def test_a_message_in_a_message_is_not_opened_twice() -> None:
    for kind in (GCM, GMAC):
        inner = octets_of(seal_message((vectors.MESSAGE,), sending_key(material(kind)), []))
        outer = octets_of(seal_message((inner,), sending_key(material(kind)), []))
        assert opener(opening.open_message, kind, origin=False)(outer) == inner


def test_a_signed_message_holds_protected_submessages() -> None:
    inside = vectors.MESSAGE_HEADER + vectors.HEARTBEAT_ENCRYPTED + vectors.HEARTBEAT_SIGNED_FOR_ONE
    buffer = octets_of(seal_message((inside,), sending_key(material(GMAC)), []))
    assert opener(opening.open_message, GMAC, origin=False)(buffer) == inside


# --- receiver-specific MACs ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", [GCM, GMAC])
def test_without_any_mac_it_is_rejected(kind: TransformationKind) -> None:
    open_it = opener(opening.open_submessage, kind, origin=True)
    buffer = octets_of(seal_submessage((vectors.HEARTBEAT,), sending_key(material(kind)), []))
    assert isinstance(open_it(buffer), Rejected)


def test_ours_is_found_among_many_and_the_first_counts() -> None:
    open_it = opener(opening.open_submessage, GCM, origin=True)
    genuine = vectors.HEARTBEAT_ENCRYPTED_FOR_ONE
    start, ours = genuine[:64], genuine[-20:]
    common = genuine[68:84]

    def with_macs(*macs: bytes) -> bytes:
        head = struct.pack("<BBH", 0x32, 1, 20 + 20 * len(macs))
        return start + head + common + len(macs).to_bytes(4, "big") + b"".join(macs)

    others = [random.Random(number).randbytes(20) for number in range(500)]
    assert open_it(with_macs(ours)) == vectors.HEARTBEAT
    assert open_it(with_macs(*others, ours)) == vectors.HEARTBEAT
    assert open_it(with_macs(*others)) is NOT_FOR_US
    assert isinstance(open_it(with_macs(ours[:4] + bytes(16), ours)), Rejected)


def test_what_is_for_others_only_is_so_by_its_common_mac() -> None:
    """Whoever has no key at all cannot make us believe that something was meant for somebody else."""
    open_it = opener(opening.open_submessage, GCM, origin=True)
    genuine = vectors.HEARTBEAT_ENCRYPTED_FOR_ONE
    for_others = genuine[:-20] + b"else" + genuine[-16:]
    assert open_it(for_others) is NOT_FOR_US
    forged = bytearray(for_others)
    forged[68] ^= 1
    assert open_it(bytes(forged)) == Rejected("the common MAC is wrong")


def test_a_key_without_receivers_key_cannot_authenticate_the_origin() -> None:
    buffer = octets_of(seal_submessage((vectors.HEARTBEAT,), sending_key(), [receiver_key()]))
    found = opening.open_submessage(buffer, ring(material()), Protection(encrypted=True, origin_authenticated=True))
    assert isinstance(found, Rejected)


# --- keys ------------------------------------------------------------------------------------------------------------


@EACH
def test_unknown_ids_have_no_keys_and_other_kinds_are_rejected(octets: bytes, open_it: Opener, plain: bytes) -> None:
    at = octets.index(vectors.SENDER_KEY_ID)
    assert open_it(octets[:at] + b"\0\0\0\1" + octets[at + 4 :]) == NoKeys(b"\0\0\0\1")
    for kind in (b"\0\0\0\0", b"\0\0\0\5", b"\0\0\1\4", b"\1\0\0\3"):
        found = open_it(octets[: at - 4] + kind + octets[at:])
        assert isinstance(found, Rejected)


@given(st.binary(max_size=120))
def test_what_cannot_be_told_has_an_outcome(octets: bytes) -> None:
    alice, bob = pair()
    match(alice, bob, endpoint_attributes(Kind.ENCRYPT))
    for found in (octets, PREFIX[:4] + octets):
        assert isinstance(bob.plugin.preprocess_secure_submsg(found, bob.handle, bob.remote(alice)), Rejected | NoKeys)
