"""Diffie-Hellman at its edges: leading zeros, both forms of a number, and where private keys come from."""

from __future__ import annotations

from collections.abc import Iterator
from hashlib import sha256

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi_security.authentication.algorithms import DH_MODP_2048_256, ECDH_P256, ECDH_P384, KeyAgreement
from ddsi_security.authentication.der import integer_octets, read_element, read_integer
from ddsi_security.authentication.key_agreement import _G, _P, _Q, EphemeralKey, draw_private_key, is_der
from ddsi_security.authentication.not_trusted import NotTrusted

ALL = pytest.mark.parametrize("agreement", [ECDH_P256, ECDH_P384, DH_MODP_2048_256], ids=lambda each: each.name)


def test_a_number_loses_its_leading_zeros_as_in_openssl() -> None:
    """Z of these two has 2037 bits; OpenSSL derives 255 octets of it, and so the hash covers 255."""
    first, second = EphemeralKey(DH_MODP_2048_256, 297), EphemeralKey(DH_MODP_2048_256, 7)
    octets = pow(_G, 297 * 7, _P).to_bytes(256, "big")
    assert octets[0] == 0
    assert octets[1] != 0
    assert first.shared_secret(second.public) == second.shared_secret(first.public) == sha256(octets[1:]).digest()


def test_a_coordinate_keeps_its_leading_zeros() -> None:
    first, second = EphemeralKey(ECDH_P256, 119), EphemeralKey(ECDH_P256, 7)
    coordinate = bytes.fromhex("00f909ebbc5335e5e9dfea6672f753e90db9e56dd1f0c6cae42c928710b141a2")
    assert first.shared_secret(second.public) == sha256(coordinate).digest()


@pytest.mark.parametrize("private_key", [319, 7])
def test_a_short_public_key_is_understood_raw_padded_and_as_der(private_key: int) -> None:
    key, peer = EphemeralKey(DH_MODP_2048_256, private_key), EphemeralKey(DH_MODP_2048_256, 12)
    assert len(key.public) == (255 if private_key == 319 else 256)
    der = EphemeralKey(DH_MODP_2048_256, private_key, der=True).public
    assert is_der(der)
    assert not is_der(key.public)
    forms = [key.public, key.public.rjust(256, b"\0"), key.public.rjust(257, b"\0"), der]
    assert {peer.shared_secret(form) for form in forms} == {key.shared_secret(peer.public)}


def test_256_octets_are_raw_whatever_they_look_like() -> None:
    assert read_integer(b"\x02\x81\xfd" + b"\x01" * 253) is not None
    assert not is_der(b"\x02\x81\xfd" + b"\x01" * 253)


# --- private keys ---------------------------------------------------------------------------------------------


@ALL
def test_private_keys_are_drawn_by_rejection(agreement: KeyAgreement) -> None:
    """What is not in range is thrown away rather than reduced, which would make some keys likelier than others."""
    octets = agreement.public_octets // 2 or 32
    good = (5).to_bytes(octets, "big")
    drawn: Iterator[bytes] = iter([bytes(octets), b"\xff" * octets, good])
    asked = []

    def entropy(count: int) -> bytes:
        asked.append(count)
        return next(drawn)

    assert draw_private_key(agreement, entropy) == 5
    assert asked == [octets] * 3


@ALL
def test_entropy_that_is_none_is_noticed(agreement: KeyAgreement) -> None:
    with pytest.raises(RuntimeError, match="entropy"):
        draw_private_key(agreement, bytes)


def test_the_group_is_what_it_says() -> None:
    assert _P.bit_length() == 2048
    assert (_P - 1) % _Q == 0
    assert pow(_G, _Q, _P) == 1
    assert pow(3, _P - 1, _P) == 1
    assert pow(3, _Q - 1, _Q) == 1


@ALL
def test_a_wiped_key_agrees_on_nothing(agreement: KeyAgreement) -> None:
    key, peer = EphemeralKey(agreement, 5), EphemeralKey(agreement, 6)
    key.wipe()
    with pytest.raises(NotTrusted):
        key.shared_secret(peer.public)


# --- DER ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("number", "octets"),
    [
        (0, "020100"),
        (127, "02017f"),
        (128, "02020080"),
        (256, "02020100"),
        (1 << 1015, "028180" + "0080" + "00" * 126),
        (1 << 2047, "0282010100" + "80" + "00" * 255),
    ],
)
def test_integers(number: int, octets: str) -> None:
    assert integer_octets(number).hex() == octets
    assert read_integer(bytes.fromhex(octets)) == number


@given(number=st.integers(0, 1 << 4096))
def test_integers_come_back(number: int) -> None:
    assert read_integer(integer_octets(number)) == number


@pytest.mark.parametrize(
    "octets", ["", "02", "0201", "0200", "020180", "03010100", "02010000", "0280", "0285ffffffffff", "02840000000101ff"]
)
def test_what_is_no_integer(octets: str) -> None:
    assert read_integer(bytes.fromhex(octets)) is None


@given(octets=st.binary(max_size=40), position=st.integers(-2, 50))
def test_any_octets_are_an_element_inside_or_an_error(octets: bytes, position: int) -> None:
    try:
        element = read_element(octets, position)
    except ValueError:
        return
    assert position < element.start <= element.end <= len(octets)
