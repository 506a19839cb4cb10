"""The short ways of sealing: each makes, octet by octet, what its general way makes."""

from __future__ import annotations

from itertools import pairwise

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
SIZES = (4, 400, LARGE - 4, LARGE, LARGE + 40, 65_000)


def split(octets: bytes, *at: int) -> Parts:
    ends = (0, *at, len(octets))
    return tuple(octets[start:end] for start, end in pairwise(ends))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("at", [(), (4,), (0, 4)])
def test_submessages(kind: TransformationKind, size: int, at: tuple[int, ...]) -> None:
    parts = split(bytes(range(256)) * (size // 256) + bytes(size % 256), *at)
    seal, key = submessage_sealer(sending_key(material(kind))), sending_key(material(kind))
    for _ in range(3):
        assert octets_of(seal(parts)) == octets_of(seal_submessage(parts, key, ()))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("at", [(), (4,), (20,), (20, 24), (LARGE,)])
def test_messages(kind: TransformationKind, size: int, at: tuple[int, ...]) -> None:
    parts = split(HEADER + bytes(size), *at)
    seal, key = message_sealer(sending_key(material(kind))), sending_key(material(kind))
    for _ in range(3):
        assert octets_of(seal(parts)) == octets_of(seal_message(parts, key, ()))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("size", [0, 1, 2, 3, *SIZES, 65_001, 100_000])
def test_payloads(kind: TransformationKind, size: int) -> None:
    plain = bytes(range(256)) * (size // 256) + bytes(size % 256)
    seal, key = payload_sealer(sending_key(material(kind)), Rooms()), sending_key(material(kind))
    for _ in range(3):
        assert octets_of(seal(plain)) == octets_of(encode_payload(plain, key, Rooms()))
        assert octets_of(seal(memoryview(plain))) == octets_of(encode_payload(plain, key, Rooms()))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("size", [21, 22, 23, 70_000, 70_001])
def test_odd_and_overlong_ones_end_as_they_do_in_the_general_way(kind: TransformationKind, size: int) -> None:
    for seal, general in (
        (submessage_sealer(sending_key(material(kind))), seal_submessage),
        (message_sealer(sending_key(material(kind))), seal_message),
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
    seal, payload = make(key), payload_sealer(key, Rooms())
    assert not isinstance(seal((HEADER + bytes(4),)), Refused)
    key.wipe()
    assert seal((HEADER + bytes(4),)) is USED_UP
    assert payload(bytes(4)) is USED_UP
