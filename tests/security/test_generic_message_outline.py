"""A generic message as it is shown: written by the security package, outlined by the trace, with no value in it."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.messages.data import Data
from ddsi.structure import builtin_entity_ids as ids
from ddsi.structure.guid import EntityId, Guid, GuidPrefix
from ddsi.trace.generic_message import TokenOutline, generic_message_in, generic_message_outline
from ddsi_security.generic_message import (
    AUTH,
    AUTH_REQUEST,
    DATAREADER_CRYPTO_TOKENS,
    DATAWRITER_CRYPTO_TOKENS,
    PARTICIPANT_CRYPTO_TOKENS,
    GenericMessage,
    MessageIdentity,
    write_generic_message,
)
from ddsi_security.tokens import DataHolder

A, B = (Guid.of(GuidPrefix(bytes([number]) * 12), EntityId.PARTICIPANT) for number in (1, 2))
SECRET = b"what nobody may see"


def written(class_id: str, *tokens: DataHolder, number: int = 1) -> bytes:
    message = GenericMessage(
        message_identity=MessageIdentity(A, number),
        destination_participant_guid=B,
        message_class_id=class_id,
        message_data=tokens,
    )
    return write_generic_message(message)


@pytest.mark.parametrize(
    ("class_id", "token", "kind"),
    [
        (AUTH_REQUEST, "DDS:Auth:PKI-DH:1.0+AuthReq", "auth-request"),
        (AUTH, "DDS:Auth:PKI-DH:1.0+Req", "request"),
        (AUTH, "DDS:Auth:PKI-DH:1.0+Reply", "reply"),
        (AUTH, "DDS:Auth:PKI-DH:1.0+Final", "final"),
        (AUTH, "acme", "dds.sec.auth"),
        (PARTICIPANT_CRYPTO_TOKENS, "DDS:Crypto:AES_GCM_GMAC", "participant-tokens"),
        (DATAWRITER_CRYPTO_TOKENS, "DDS:Crypto:AES_GCM_GMAC", "writer-tokens"),
        (DATAREADER_CRYPTO_TOKENS, "DDS:Crypto:AES_GCM_GMAC", "reader-tokens"),
        ("acme.message", "acme", "acme.message"),
    ],
)
def test_every_message_has_its_kind(class_id: str, token: str, kind: str) -> None:
    outline = generic_message_outline(written(class_id, DataHolder(token)))
    assert outline is not None
    assert outline.kind == kind


def test_of_tokens_only_names_and_sizes_are_kept() -> None:
    token = DataHolder("t", (("name", "text"),), (("key", SECRET), ("empty", b"")))
    payload = written(PARTICIPANT_CRYPTO_TOKENS, token, token)
    outline = generic_message_outline(payload)
    assert outline is not None
    assert outline.tokens == (TokenOutline("t", (("name", 4), ("key", len(SECRET)), ("empty", 0))),) * 2
    assert outline.octets == len(payload)
    assert SECRET.decode() not in repr(outline)


def test_a_repetition_is_known_by_what_it_says_not_by_its_number() -> None:
    once, again, other = (
        generic_message_outline(written(AUTH, DataHolder("t", (), (("challenge1", octets),)), number=number))
        for number, octets in ((1, b"x"), (2, b"x"), (3, b"y"))
    )
    assert once is not None
    assert again is not None
    assert other is not None
    assert once.fingerprint == again.fingerprint != other.fingerprint


@given(st.data())
def test_broken_octets_have_no_outline(data: st.DataObject) -> None:
    payload = bytearray(written(AUTH, DataHolder("t+Req", (("a", "b"),), (("c", b"d"),))))
    payload[data.draw(st.integers(0, len(payload) - 1))] = data.draw(st.integers(0, 255))
    generic_message_outline(payload[: data.draw(st.integers(0, len(payload)))])  # raises nothing


def test_only_the_two_topics_carry_them() -> None:
    payload = written(AUTH_REQUEST, DataHolder("t"))
    for writer, carries in (
        (ids.PARTICIPANT_STATELESS_MESSAGE_WRITER, True),
        (ids.PARTICIPANT_VOLATILE_MESSAGE_SECURE_WRITER, True),
        (ids.SPDP_WRITER, False),
    ):
        data = Data(EntityId.UNKNOWN, writer, 1, None, payload)
        assert (generic_message_in(data) is not None) is carries
