"""The short ways: each opens what its general way opens, and touches nothing else."""

from __future__ import annotations

import struct

import pytest

from ddsi.spi import Octets
from ddsi_security.cryptographic.aes_gcm import LARGE
from ddsi_security.cryptographic.openers import (
    MessageOpener,
    SignedMessageOpener,
    SignedSubmessageOpener,
    SubmessageOpener,
    message_opener,
    payload_opener,
    submessage_opener,
)
from ddsi_security.cryptographic.opening import open_message, open_submessage
from ddsi_security.cryptographic.payload import decode_payload, encode_payload
from ddsi_security.cryptographic.received_keys import KeyRing
from ddsi_security.cryptographic.rooms import Rooms
from ddsi_security.cryptographic.sealing import seal_message, seal_submessage
from ddsi_security.cryptographic.session_keys import SendingKey
from ddsi_security.cryptographic.transformation import Protection, TransformationKind
from tests.security.cryptographic.keys import material, octets_of, ring, sending_key

ENCRYPTED = Protection(encrypted=True)
SIGNED = Protection(encrypted=False)
KINDS = {ENCRYPTED: TransformationKind.AES256_GCM, SIGNED: TransformationKind.AES256_GMAC}
EITHER = pytest.mark.parametrize("expected", [ENCRYPTED, SIGNED], ids=["encrypted", "signed"])
SIZES = (8, 400, LARGE - 60, LARGE - 56, 65_000)
NOBODY = bytes(4)


def submessage(size: int, kind: int = 0x15, flags: int = 5) -> bytes:
    return struct.pack("<BBH", kind, flags, size - 4) + bytes(size - 4)


def sealed(plain: bytes, key: SendingKey) -> bytes:
    return octets_of(seal_submessage((plain,), key, ()))


# --- submessages -----------------------------------------------------------------------------------------------------


def keys_for(expected: Protection) -> tuple[KeyRing, SendingKey]:
    of = material(KINDS[expected])
    return ring(of), sending_key(of)


def opener_for(
    expected: Protection, keys: KeyRing, key: SendingKey, entity_id: bytes = NOBODY
) -> SubmessageOpener | SignedSubmessageOpener:
    first = sealed(submessage(24), key)
    assert open_submessage(first, keys, expected) == submessage(24)
    found = submessage_opener(first, keys, expected, entity_id)
    assert found is not None
    return found


def opened(opener: SubmessageOpener | SignedSubmessageOpener, octets: Octets) -> Octets | None:
    """What is in the envelope that these are."""
    found = opener.open(octets, 0, len(octets))
    if found is None:
        return None
    plain, past = found
    assert past == len(octets)
    return plain


@EITHER
@pytest.mark.parametrize("size", [24, *SIZES[1:]])
@pytest.mark.parametrize("kind", [bytes, bytearray, lambda octets: memoryview(bytearray(octets)), memoryview])
def test_it_opens_what_follows_in_the_same_session(size: int, kind: type, expected: Protection) -> None:
    keys, key = keys_for(expected)
    opener = opener_for(expected, keys, key)
    found = opened(opener, kind(sealed(submessage(size), key)))
    assert found is not None
    assert bytes(found) == submessage(size)


@EITHER
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("at", [12, 24, 26, 28, 40, -24, -20, -5, -1])
def test_what_was_altered_is_left_to_the_general_way_and_as_it_was(size: int, at: int, expected: Protection) -> None:
    keys, key = keys_for(expected)
    opener = opener_for(expected, keys, key)
    altered = bytearray(sealed(submessage(max(size, 16)), key))
    altered[at] ^= 1
    before = bytes(altered)
    assert opened(opener, altered) is None
    assert opened(opener, before) is None
    assert altered == before


@EITHER
@pytest.mark.parametrize("length", [1, 16, 27, 28, 32, 51, 52, 56, 58, 60])
def test_octets_that_end_too_soon_are_none(length: int, expected: Protection) -> None:
    keys, key = keys_for(expected)
    opener = opener_for(expected, keys, key)
    octets = sealed(submessage(24), key)
    assert opened(opener, octets[:length]) is None
    assert opened(opener, octets[-length:]) is None


@EITHER
@pytest.mark.parametrize(
    "plain",
    [
        submessage(24, flags=4),
        submessage(24, kind=0x31),
        submessage(24)[:2] + bytes(2) + submessage(24)[4:],
        submessage(24) + bytes(4),
        submessage(24)[:2] + b"\xff\xff" + submessage(24)[4:],
        submessage(8),
    ],
    ids=[
        "big-endian",
        "an envelope",
        "of length 0",
        "two submessages",
        "longer than it is",
        "too short for its sender",
    ],
)
def test_unusual_submessages_are_left_to_the_general_way(plain: bytes, expected: Protection) -> None:
    keys, key = keys_for(expected)
    opener = opener_for(expected, keys, key)
    assert opened(opener, sealed(plain, key)) is None


@EITHER
@pytest.mark.parametrize("size", SIZES[1:])
def test_it_opens_what_lies_in_the_middle_of_a_message(size: int, expected: Protection) -> None:
    keys, key = keys_for(expected)
    opener = opener_for(expected, keys, key)
    envelope = sealed(submessage(size), key)
    message = memoryview(bytearray(b"before" + envelope + b"behind"))
    end = 6 + len(envelope)
    for last in (end, len(message)):
        found = opener.open(memoryview(bytearray(message)), 6, last)
        assert found is not None
        assert (bytes(found[0]), found[1]) == (submessage(size), end)
    before = bytes(message)
    assert opener.open(message, 6, end - 1) is None
    assert message == before


@EITHER
@pytest.mark.parametrize("size", SIZES[1:])
@pytest.mark.parametrize("kind", [0x15, 0x16, 0x07, 0x13, 0x08, 0x06, 0x12])
def test_it_opens_nothing_that_names_another_sender(size: int, kind: int, expected: Protection) -> None:
    keys, key = keys_for(expected)
    octets = memoryview(bytearray(sealed(submessage(size, kind), key)))
    before = bytes(octets)
    assert opened(opener_for(expected, keys, key, b"\0\0\1\2"), octets) is None
    assert octets == before
    assert opened(opener_for(expected, keys, key), octets) == submessage(size, kind)


@EITHER
def test_what_names_no_sender_is_left_to_the_general_way(expected: Protection) -> None:
    keys, key = keys_for(expected)
    assert opened(opener_for(expected, keys, key), sealed(submessage(12, kind=0x09), key)) is None


@EITHER
def test_the_general_way_opens_large_ones_that_are_big_endian(expected: Protection) -> None:
    keys, key = keys_for(expected)
    plain = struct.pack(">BBH", 0x15, 4, 40_000) + bytes(40_000)
    octets = memoryview(bytearray(sealed(plain, key)))
    before = bytes(octets)
    assert opened(opener_for(expected, keys, key), octets) is None
    assert octets == before
    assert open_submessage(octets, keys, expected) == plain


@EITHER
def test_there_is_none_where_more_is_asked_for_than_protection_for_all(expected: Protection) -> None:
    keys, key = keys_for(expected)
    first = sealed(submessage(24), key)
    assert submessage_opener(first, keys, expected, NOBODY) is None, "nothing was opened in this session yet"
    assert open_submessage(first, keys, expected) is not None
    assert submessage_opener(first, keys, expected, NOBODY) is not None
    assert submessage_opener(first, keys, None, NOBODY) is None
    assert submessage_opener(first, keys, SIGNED if expected is ENCRYPTED else ENCRYPTED, NOBODY) is None
    of_one = Protection(encrypted=expected.encrypted, origin_authenticated=True)
    assert submessage_opener(first, keys, of_one, NOBODY) is None
    assert submessage_opener(first[:8] + b"\x99" * 4 + first[12:], keys, expected, NOBODY) is None


def test_there_is_none_while_a_key_is_being_replaced() -> None:
    keys, first = ring(material()), sealed(submessage(24), sending_key())
    assert open_submessage(first, keys, ENCRYPTED) is not None
    keys.replace(material(TransformationKind.AES256_GMAC))
    assert submessage_opener(first, keys, ENCRYPTED, NOBODY) is None


# --- messages --------------------------------------------------------------------------------------------------------

HEADER = b"RTPS\2\5\1\xdd" + bytes(range(12))


def sealed_message(size: int, key: SendingKey, header: bytes = HEADER) -> bytes:
    return octets_of(seal_message((header + submessage(size),), key, ()))


def message_keys(expected: Protection) -> tuple[KeyRing, SendingKey, MessageOpener | SignedMessageOpener]:
    keys, key = keys_for(expected)
    first = sealed_message(24, key)
    assert open_message(first, keys, expected) == HEADER + submessage(24)
    opener = message_opener(first, keys, expected)
    assert opener is not None
    return keys, key, opener


@EITHER
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("kind", [bytes, bytearray, lambda octets: memoryview(bytearray(octets)), memoryview])
def test_messages_are_opened_in_the_same_session(size: int, kind: type, expected: Protection) -> None:
    _, key, opener = message_keys(expected)
    found = opener.open(kind(sealed_message(size, key)))
    assert found is not None
    assert bytes(found) == HEADER + submessage(size)


@EITHER
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("at", [8, 19, 32, 43, 44, 48, 56, 60, -25, -24, -20, -5, -1])
def test_altered_messages_are_left_to_the_general_way(size: int, at: int, expected: Protection) -> None:
    """The header too, as INFO_SRC repeats it."""
    _, key, opener = message_keys(expected)
    altered = bytearray(sealed_message(size, key))
    altered[at] ^= 1
    before = bytes(altered)
    assert opener.open(altered) is None
    assert opener.open(before) is None
    assert altered == before
    for length in (0, 20, 36, 44, 68, 92, len(before) - 4):
        assert opener.open(before[:length]) is None


@EITHER
def test_what_follows_the_postfix_is_left_to_the_general_way(expected: Protection) -> None:
    keys, key, opener = message_keys(expected)
    with_tail = sealed_message(24, key) + submessage(12)
    assert opener.open(with_tail) is None
    assert open_message(with_tail, keys, expected) == HEADER + submessage(24)


@EITHER
def test_there_is_none_for_messages_where_more_is_asked_for(expected: Protection) -> None:
    keys, key, _ = message_keys(expected)
    first = sealed_message(24, key)
    other = SIGNED if expected is ENCRYPTED else ENCRYPTED
    assert message_opener(first, keys, None) is None
    assert message_opener(first, keys, other) is None
    assert message_opener(first, keys, Protection(expected.encrypted, origin_authenticated=True)) is None
    assert message_opener(first[:24] + b"\x99" * 4 + first[28:], keys, expected) is None
    keys.replace(material(KINDS[other]))
    assert message_opener(first, keys, expected) is None


# --- payloads --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("kind", [bytes, bytearray, lambda octets: memoryview(bytearray(octets)), memoryview])
def test_payloads_are_opened_in_the_same_session(size: int, kind: type) -> None:
    keys, key = ring(material()), sending_key()
    first, second = protected_payload(b"1234", key), protected_payload(bytes(size), key)
    assert decode_payload(first, keys, ENCRYPTED) == b"1234"
    opener = payload_opener(first, keys, ENCRYPTED)
    assert opener is not None
    found = opener.open(kind(second))
    assert found is not None
    assert bytes(found) == bytes(size)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("at", [8, 20, 23, 24, -21, -20, -5, -1])
def test_altered_payloads_are_left_to_the_general_way(size: int, at: int) -> None:
    keys, key = ring(material()), sending_key()
    first, altered = protected_payload(b"1234", key), bytearray(protected_payload(bytes(size), key))
    decode_payload(first, keys, ENCRYPTED)
    opener = payload_opener(first, keys, ENCRYPTED)
    assert opener is not None
    altered[at] ^= 1
    assert opener.open(bytes(altered)) is None
    for length in (0, 12, 24, 43):
        assert opener.open(bytes(altered[:length])) is None


def protected_payload(plain: bytes, key: SendingKey) -> bytes:
    return octets_of(encode_payload(plain, key, Rooms()))
