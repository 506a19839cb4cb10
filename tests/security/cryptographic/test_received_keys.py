"""Keys of peers: which sessions are kept, and what becomes of a key that another replaced."""

from __future__ import annotations

import random

from ddsi.spi import NoKeys, Rejected
from ddsi_security.cryptographic import payload
from ddsi_security.cryptographic.key_material import NO_KEY_MATERIAL, KeyMaterial
from ddsi_security.cryptographic.received_keys import KeyRing
from ddsi_security.cryptographic.rooms import Rooms
from ddsi_security.cryptographic.session_keys import SendingKey
from ddsi_security.cryptographic.transformation import TransformationKind
from tests.security.cryptographic import vectors
from tests.security.cryptographic.keys import material, octets_of, ring

SECOND = 10**9


def another(key_id: bytes = b"\0\0\0\x09") -> KeyMaterial:
    return KeyMaterial(TransformationKind.AES256_GCM, bytearray(b"s" * 32), key_id, bytearray(b"k" * 32))


def protected(of: KeyMaterial, *, seed: int = 1, max_blocks: int = 1 << 32, count: int = 1) -> list[bytes]:
    key = SendingKey(of, random.Random(seed).randbytes, max_blocks=max_blocks)
    found = []
    for _ in range(count):
        buffer = octets_of(payload.encode_payload(vectors.PAYLOAD, key, Rooms()))
        found.append(buffer)
    return found


class Clock:
    now = 0

    def __call__(self) -> int:
        return self.now


def test_any_session_is_opened_and_a_few_are_kept() -> None:
    keys = ring(material())
    received = protected(material(), max_blocks=1, count=50)
    for octets in [*received, *reversed(received)]:
        assert payload.decode_payload(octets, keys, None) == vectors.PAYLOAD
    assert keys.current is not None
    assert 0 < len(keys.current.sessions) <= 8


def test_sessions_that_an_attacker_names_are_not_kept() -> None:
    keys = ring(material())
    [octets] = protected(material())
    payload.decode_payload(octets, keys, None)
    assert keys.current is not None
    before = dict(keys.current.sessions)
    for number in range(100):
        forged = octets[:8] + number.to_bytes(4, "big") + octets[12:]
        assert isinstance(payload.decode_payload(forged, keys, None), Rejected)
    assert keys.current.sessions == before


def test_a_replaced_key_opens_for_a_minute_what_was_under_way() -> None:
    clock = Clock()
    keys = KeyRing(clock)
    keys.replace(material())
    keys.replace(another())
    [old], [new] = protected(material()), protected(another())
    clock.now = 59 * SECOND
    assert payload.decode_payload(old, keys, None) == payload.decode_payload(new, keys, None) == vectors.PAYLOAD
    previous = keys.previous
    clock.now = 60 * SECOND
    assert payload.decode_payload(old, keys, None) == NoKeys(vectors.SENDER_KEY_ID)
    assert payload.decode_payload(new, keys, None) == vectors.PAYLOAD
    assert previous is not None
    assert not any(previous.material.master_sender_key), "it was wiped"


def test_both_may_have_one_id() -> None:
    keys = ring(material(), another(vectors.SENDER_KEY_ID))
    for found in (material(), another(vectors.SENDER_KEY_ID)):
        [octets] = protected(found)
        assert payload.decode_payload(octets, keys, None) == vectors.PAYLOAD


def test_both_may_have_one_id_and_two_kinds() -> None:
    signs = material(TransformationKind.AES256_GMAC)
    keys = ring(material(), signs)
    for found in (material(), signs):
        [octets] = protected(found)
        assert payload.decode_payload(octets, keys, None) == vectors.PAYLOAD


def test_a_third_key_drives_out_the_oldest() -> None:
    keys = ring(material(), another(), another(b"\0\0\0\x0a"))
    assert set(keys.by_id) == {b"\0\0\0\x09", b"\0\0\0\x0a"}


def test_a_token_that_comes_twice_changes_nothing() -> None:
    keys = ring(material(), another())
    current, previous = keys.current, keys.previous
    keys.replace(another())
    assert (keys.current, keys.previous) == (current, previous)


def test_a_key_in_two_rings_is_wiped_in_one() -> None:
    """A writer may protect submessages and payload with one key, and later change that of the payload."""
    shared = material()
    ring_of_submessages, ring_of_payloads = ring(shared), ring(shared)
    ring_of_payloads.wipe()
    assert payload.decode_payload(protected(material())[0], ring_of_submessages, None) == vectors.PAYLOAD


def test_the_kind_none_is_no_key() -> None:
    keys = ring(material(), NO_KEY_MATERIAL)
    assert keys.current is None
    assert keys.previous is not None


def test_a_wiped_ring_is_empty() -> None:
    keys = ring(material(), another())
    found = [key for key in (keys.current, keys.previous) if key is not None]
    keys.wipe()
    assert not any(any(key.material.master_sender_key) for key in found)
    assert payload.decode_payload(protected(material())[0], keys, None) == NoKeys(vectors.SENDER_KEY_ID)


def test_reprs_show_ids_alone() -> None:
    assert repr(ring(material())) == "<KeyRing <ReceivedKey AES256_GCM 0a0b0c0d>>"
