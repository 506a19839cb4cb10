"""KeyMaterial and its token: every size, and what is refused."""

from __future__ import annotations

import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.structure.errors import MalformedMessage
from ddsi_security.cryptographic.key_material import NO_KEY_MATERIAL, TOKEN_CLASS_ID, KeyMaterial
from ddsi_security.cryptographic.transformation import TransformationKind
from ddsi_security.tokens import CryptoToken
from tests.security.cryptographic import vectors
from tests.security.cryptographic.keys import material

KINDS = [kind for kind in TransformationKind if kind is not TransformationKind.NONE]
VALID = vectors.MATERIAL_256_WITH_RECEIVER

# What is wrong, and the octets.
MALFORMED = {
    "kind 5": b"\0\0\0\x05" + VALID[4:],
    "a key revision of 1.2": b"\0\0\x01\x04" + VALID[4:],
    "a salt of 31 octets": VALID[:4] + b"\0\0\0\x1f" + VALID[8:39] + VALID[40:],
    "a salt of 2^32 - 1 octets": VALID[:4] + b"\xff\xff\xff\xff" + VALID[8:],
    "lengths of 128 bits in a kind of 256": b"\0\0\0\x04" + vectors.MATERIAL_128[4:],
    "lengths of 256 bits in a kind of 128": b"\0\0\0\x02" + VALID[4:],
    "a salt of zeros": VALID[:8] + bytes(32) + VALID[40:],
    "a key of zeros": VALID[:48] + bytes(32) + VALID[80:],
    "a receiver's key of zeros": VALID[:88] + bytes(32),
    "a key without id": VALID[:40] + bytes(4) + VALID[44:],
    "a receiver's key without id": VALID[:80] + bytes(4) + VALID[84:],
    "a receiver's id without key": vectors.MATERIAL_256[:80] + b"\0\0\0\1" + bytes(4),
    "one octet too many": VALID + b"\0",
    "kind NONE with the rest of a key": bytes(4) + VALID[4:],
    "kind NONE alone": bytes(4),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("for_receiver", "sizes"), [(False, {16: 56, 32: 88}), (True, {16: 72, 32: 120})])
def test_each_kind_has_its_length(kind: TransformationKind, for_receiver: bool, sizes: dict[int, int]) -> None:
    found = material(kind, for_receiver=for_receiver)
    octets = found.encode()
    assert len(octets) == sizes[kind.key_length]
    assert KeyMaterial.decode(octets) == found


@pytest.mark.parametrize("length", [24, 44])
def test_none_comes_in_two_lengths(length: int) -> None:
    assert NO_KEY_MATERIAL.encode() == bytes(24)
    assert KeyMaterial.decode(bytes(length)).kind is TransformationKind.NONE


@pytest.mark.parametrize("octets", MALFORMED.values(), ids=MALFORMED)
def test_malformed_octets_are_refused(octets: bytes) -> None:
    with pytest.raises(MalformedMessage):
        KeyMaterial.decode(octets)


@pytest.mark.parametrize("octets", [VALID, vectors.MATERIAL_256, vectors.MATERIAL_128])
def test_no_prefix_of_it_is_key_material(octets: bytes) -> None:
    for length in range(len(octets)):
        with pytest.raises(MalformedMessage):
            KeyMaterial.decode(octets[:length])


@given(st.binary(max_size=200))
def test_any_octets_are_decoded_or_malformed(octets: bytes) -> None:
    try:
        found = KeyMaterial.decode(octets)
    except MalformedMessage:
        return
    assert found.kind is TransformationKind.NONE or found.encode() == octets


@given(st.integers(0, len(VALID) - 1), st.integers(1, 255))
def test_an_octet_changed_is_another_key_or_malformed(at: int, flip: int) -> None:
    octets = bytearray(VALID)
    octets[at] ^= flip
    with contextlib.suppress(MalformedMessage):
        assert KeyMaterial.decode(octets).encode() == octets


@pytest.mark.parametrize(
    "token",
    [
        CryptoToken(),
        CryptoToken(TOKEN_CLASS_ID),
        CryptoToken("DDS:Crypto:AES-GCM-GMAC", (), (("dds.cryp.keymat", VALID),)),
        CryptoToken(TOKEN_CLASS_ID, (), (("dds.cryp.keymat.2", VALID),)),
        CryptoToken(TOKEN_CLASS_ID, (("dds.cryp.keymat", "text"),), ()),
    ],
)
def test_other_tokens_are_refused(token: CryptoToken) -> None:
    with pytest.raises(MalformedMessage):
        KeyMaterial.from_token(token)


def test_a_repr_tells_kind_and_ids_but_no_key() -> None:
    text = repr(material(for_receiver=True))
    assert "AES256_GCM" in text
    assert repr(vectors.SENDER_KEY_ID) in text
    for secret in (vectors.SALT, vectors.SENDER_KEY, vectors.RECEIVER_KEY):
        assert repr(secret)[2:20] not in text
        assert secret.hex()[:16] not in text


def test_wiped_it_is_all_zero() -> None:
    found = material(for_receiver=True)
    found.wipe()
    assert not any(found.master_salt + found.master_sender_key + found.master_receiver_specific_key)
