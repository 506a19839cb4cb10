"""Keys that we send with: no nonce is ever made twice, whatever sessions do."""

from __future__ import annotations

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi_security.cryptographic.key_material import KeyMaterial
from ddsi_security.cryptographic.session_keys import LARGEST_MAX_BLOCKS, NONCE_AT, SendingKey, session_key
from tests.security.cryptographic import vectors
from tests.security.cryptographic.keys import Entropy, entropy_of, material, receiver_key, sending_key

TOP_BIT = 1 << 63


def key(max_blocks: int = 1 << 32, *, seed: int = 1, replier: bool = False) -> SendingKey:
    return SendingKey(material(), random.Random(seed).randbytes, max_blocks=max_blocks, replier=replier)


def header(of: SendingKey, octets: int = 16) -> bytes:
    found = of.next_header(octets)
    assert found is not None
    return found


def suffix(found: bytes) -> int:
    return int.from_bytes(found[12:], "big")


def test_the_header_holds_kind_key_session_and_suffix() -> None:
    found = header(sending_key())
    assert found == b"\0\0\0\4" + vectors.SENDER_KEY_ID + vectors.SESSION_ID + vectors.SUFFIX
    assert found[NONCE_AT:] == vectors.SESSION_ID + vectors.SUFFIX


def test_the_suffix_counts() -> None:
    of = key()
    assert suffix(header(of)) + 1 == suffix(header(of))


@given(st.lists(st.integers(0, 70_000), min_size=1, max_size=200), st.integers(1, 5_000), st.booleans())
def test_no_nonce_is_made_twice_over_any_number_of_sessions(lengths: list[int], max_blocks: int, replier: bool) -> None:
    of = key(max_blocks, replier=replier)
    nonces = [header(of, length)[NONCE_AT:] for length in lengths]
    assert len(set(nonces)) == len(nonces)


@pytest.mark.parametrize(
    ("octets", "per_session"), [(0, 10), (15, 10), (16, 5), (17, 5), (144, 1), (160, 1), (9999, 1)]
)
def test_a_session_ends_after_so_many_blocks(octets: int, per_session: int) -> None:
    """A block of ten goes to each begun 16 octets and one to the tag; what is larger has a session to itself."""
    of = key(10)
    sessions = [header(of, octets)[8:12] for _ in range(3 * per_session)]
    assert [sessions.count(one) for one in dict.fromkeys(sessions)] == [per_session] * 3
    numbers = [int.from_bytes(one, "big") for one in dict.fromkeys(sessions)]
    assert [(number - numbers[0]) % 2**32 for number in numbers] == [0, 1, 2]


def test_the_session_key_changes_with_the_session() -> None:
    of = key(1)
    header(of)
    before = of.aead
    found = header(of)
    assert of.aead is not before
    assert of.session_id == found[8:12]
    sealed = of.aead.encrypt(bytes(12), b"x", None)
    same = SendingKey(material(), entropy_of(of.session_id, vectors.SUFFIX))
    assert same.aead.encrypt(bytes(12), b"x", None) == sealed
    assert session_key(material(), of.session_id) != session_key(material(), vectors.SESSION_ID)


def test_session_ids_come_round_through_zero_and_then_the_key_is_used_up() -> None:
    of = SendingKey(material(), Entropy(bytes(8), b"\xff\xff\xff\xff"), max_blocks=1)
    assert header(of, 0)[8:12] == b"\xff\xff\xff\xff"
    assert header(of, 0)[8:12] == b"\0\0\0\0"
    of._session = 0xFFFFFFFD  # as if the sessions between had been spent
    assert header(of, 0)[8:12] == b"\xff\xff\xff\xfe"
    assert of.next_header(0) is None
    assert of.next_header(0) is None, "and stays so"


def test_the_counter_comes_round_within_its_side() -> None:
    for replier in (False, True):
        of = SendingKey(material(), Entropy(b"\xff" * 8, bytes(4)), replier=replier)
        assert suffix(header(of)) == (TOP_BIT if replier else 0)


def test_a_counter_that_came_round_is_an_error_of_ours() -> None:
    of = key(LARGEST_MAX_BLOCKS)
    of._count = of._session_began_at - 1
    with pytest.raises(AssertionError, match="twice"):
        of.next_header(16)


@given(st.integers(0, 2**32), st.integers(0, 2**32))
def test_the_two_sides_of_a_pairwise_key_never_meet(first_seed: int, second_seed: int) -> None:
    """Even where both begin at the same session: chance is kind to nobody."""
    initiator = SendingKey(material(), Entropy(random.Random(first_seed).randbytes(8), bytes(4)), max_blocks=3)
    replier = SendingKey(
        material(), Entropy(random.Random(second_seed).randbytes(8), bytes(4)), max_blocks=3, replier=True
    )
    ours, theirs = ({header(one) for _ in range(20)} for one in (initiator, replier))
    assert not ours & theirs
    assert not any(suffix(found) & TOP_BIT for found in ours)
    assert all(suffix(found) & TOP_BIT for found in theirs)


def test_keys_begin_anywhere() -> None:
    starts = {header(key(seed=seed))[8:] for seed in range(50)}
    assert len({found[:4] for found in starts}) == len({found[4:] for found in starts}) == 50


@pytest.mark.parametrize("blocks", [0, -1, LARGEST_MAX_BLOCKS + 1])
def test_sessions_without_end_cannot_be_had(blocks: int) -> None:
    with pytest.raises(AssertionError):
        key(blocks)


def test_a_wiped_key_protects_nothing() -> None:
    of = key()
    of.wipe()
    assert of.next_header(16) is None
    assert not any(of.material.master_sender_key)


def test_a_receivers_mac_follows_the_session() -> None:
    of, receiver = key(1), receiver_key()
    macs = set()
    for _ in range(3):
        found = header(of)
        macs.add(receiver.mac(of, bytes(12), bytes(16)))
        assert receiver.mac(of, bytes(12), bytes(16)) in macs, "the same within a session"
        assert found[8:12] == of.session_id
    assert len(macs) == 3


def test_a_receivers_token_differs_in_its_receivers_key_alone() -> None:
    found: KeyMaterial = receiver_key().token_material(sending_key())
    assert found == material(for_receiver=True)


def test_reprs_show_ids_alone() -> None:
    assert repr(sending_key()) == "<SendingKey AES256_GCM 0a0b0c0d>"
    assert repr(receiver_key()) == "<ReceiverKey 0e0f1011>"
