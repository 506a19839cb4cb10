"""The short ways of sealing: each makes, octet by octet, what its general way makes."""

from __future__ import annotations

from collections import deque
from itertools import pairwise, product

import pytest

from ddsi.spi import Parts, Refused
from ddsi_security.cryptographic.aes_gcm import LARGE
from ddsi_security.cryptographic.payload import USED_UP, encode_payload
from ddsi_security.cryptographic.rooms import Rooms
from ddsi_security.cryptographic.sealers import message_sealer, payload_sealer, submessage_sealer
from ddsi_security.cryptographic.sealing import seal_message, seal_submessage
from ddsi_security.cryptographic.transformation import TransformationKind
from tests.security.cryptographic.keys import material, octets_of, sending_key

HEADER = b"RTPS\2\5\1\xdd" + bytes(range(12))
KINDS = [kind for kind in TransformationKind if kind is not TransformationKind.NONE]
SHORT_KEYS = (TransformationKind.AES128_GMAC, TransformationKind.AES128_GCM)
SIZES = (4, 400, LARGE - 4, LARGE, LARGE + 40, 65_000)


def split(octets: bytes, *at: int) -> Parts:
    ends = (0, *at, len(octets))
    return tuple(octets[start:end] for start, end in pairwise(ends))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("at", [(), (4,), (0, 4)])
def test_submessages(kind: TransformationKind, size: int, at: tuple[int, ...]) -> None:
    parts = split(bytes(range(256)) * (size // 256) + bytes(size % 256), *at)
    seal, key = submessage_sealer(sending_key(material(kind)), Rooms()), sending_key(material(kind))
    for _ in range(3):
        assert octets_of(seal(parts)) == octets_of(seal_submessage(parts, key, ()))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("at", [(), (4,), (20,), (20, 24), (LARGE,)])
def test_messages(kind: TransformationKind, size: int, at: tuple[int, ...]) -> None:
    parts = split(HEADER + bytes(size), *at)
    seal, key = message_sealer(sending_key(material(kind)), Rooms()), sending_key(material(kind))
    for _ in range(3):
        assert octets_of(seal(parts)) == octets_of(seal_message(parts, key, ()))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("size", [0, 1, 2, 3, *SIZES, 65_001, 100_000])
def test_payloads(kind: TransformationKind, size: int) -> None:
    plain = bytes(range(256)) * (size // 256) + bytes(size % 256)
    seal, key = payload_sealer(sending_key(material(kind)), Rooms()), sending_key(material(kind))
    for _ in range(3):
        for octets in (plain, memoryview(plain)):
            sealed = seal(octets)
            assert not isinstance(sealed, Refused)
            assert sealed == octets_of(encode_payload(plain, key, Rooms()))


@pytest.mark.parametrize("kinds", list(product(SHORT_KEYS, repeat=3)))
@pytest.mark.parametrize("held", [0, 1, 6])
@pytest.mark.parametrize("added", [b"", bytes(24), bytes(300)], ids=len)
def test_all_three_around_each_other_in_shared_rooms(
    kinds: tuple[TransformationKind, ...], held: int, added: bytes
) -> None:
    """Fragments one behind the other, of which the last few are still held while the next ones are sealed."""
    rooms = Rooms()
    short, general = ([sending_key(material(kind)) for kind in kinds] for _ in range(2))
    of_payload = payload_sealer(short[0], rooms)
    of_submessage, of_message = submessage_sealer(short[1], rooms), message_sealer(short[2], rooms)
    expected: deque[bytes] = deque()
    found: deque[Parts] = deque()
    for number, size in enumerate((60_000, 64_000, 60_004, 400, 64_000, LARGE, 63_996)):
        plain, head = bytes([number]) * size, b"head" * (number + 1) + added
        payload = of_payload(memoryview(plain))
        assert not isinstance(payload, Refused)
        submessage = _parts(of_submessage((head, payload, b"")))
        found.append(_parts(of_message([HEADER, b"time", *submessage])))
        payload = octets_of(encode_payload(plain, general[0], Rooms()))
        submessage = _parts(seal_submessage((head, payload), general[1], ()))
        expected.append(octets_of(seal_message((HEADER, b"time", *submessage), general[2], ())))
        while len(found) > held:
            assert octets_of(found.popleft()) == expected.popleft()
    assert [octets_of(each) for each in found] == list(expected)


def _parts(sealed: Parts | Refused) -> Parts:
    assert not isinstance(sealed, Refused)
    return sealed


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("size", [21, 22, 23, 70_000, 70_001])
def test_odd_and_overlong_ones_end_as_they_do_in_the_general_way(kind: TransformationKind, size: int) -> None:
    for seal, general in (
        (submessage_sealer(sending_key(material(kind)), Rooms()), seal_submessage),
        (message_sealer(sending_key(material(kind)), Rooms()), seal_message),
    ):
        parts, key = (HEADER + bytes(size),), sending_key(material(kind))
        found, expected = seal(parts), general(parts, key, ())
        assert isinstance(found, Refused) == isinstance(expected, Refused)
        if isinstance(expected, Refused):
            assert found == expected
        else:
            assert octets_of(found) == octets_of(expected)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("make", [submessage_sealer, message_sealer])
def test_a_key_that_was_wiped_seals_nothing(kind: TransformationKind, make: type) -> None:
    key = sending_key(material(kind))
    seal, payload = make(key, Rooms()), payload_sealer(key, Rooms())
    assert not isinstance(seal((HEADER + bytes(4),)), Refused)
    key.wipe()
    assert seal((HEADER + bytes(4),)) is USED_UP
    assert payload(bytes(4)) is USED_UP
