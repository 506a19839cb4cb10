"""The short forms of what makes up nearly all traffic say the same octets as the classes do."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.messages import fast
from ddsi.messages.submessages import Data, DataFrag, Heartbeat, InfoTimestamp, decode_submessage, iterate_submessages
from ddsi.structure.guid import EntityId

entity_ids = st.binary(min_size=4, max_size=4).map(EntityId)
sequence_numbers = st.integers(1, (1 << 63) - 1)
words = st.integers(1, 8)


@given(st.integers(0, (1 << 64) - 1))
def test_timestamp(ticks: int) -> None:
    assert fast.timestamp(ticks) == InfoTimestamp(ticks).encode()


@given(entity_ids, entity_ids, sequence_numbers, words)
def test_data(reader_id: EntityId, writer_id: EntityId, writer_sn: int, count: int) -> None:
    payload = bytes(range(4 * count))
    octets = fast.data_head(reader_id, writer_id, writer_sn, len(payload)) + payload
    assert octets == Data(reader_id, writer_id, writer_sn, serialized_payload=payload).encode()
    assert fast.SUBMESSAGE_HEAD.unpack_from(octets) == (0x15, 0x05, len(octets) - 4)
    assert fast.DATA_BODY.unpack_from(octets, 4) == (
        0,
        16,
        reader_id,
        writer_id,
        writer_sn >> 32,
        writer_sn & 0xFFFFFFFF,
    )


@pytest.mark.parametrize("length", [65508, 65512, 65516, 65520])
def test_data_too_long_for_the_length_field_reaches_to_the_end(length: int) -> None:
    reader_id, writer_id = EntityId(b"\0\0\1\7"), EntityId(b"\0\0\1\2")
    octets = fast.data_head(reader_id, writer_id, 1, length) + bytes(length)
    (raw,) = iterate_submessages(octets, start=0)
    assert decode_submessage(raw) == Data(reader_id, writer_id, 1, serialized_payload=bytes(length))


@given(entity_ids, entity_ids, sequence_numbers, st.integers(0, (1 << 32) - 1), st.booleans())
def test_heartbeat(reader_id: EntityId, writer_id: EntityId, first: int, count: int, final: bool) -> None:
    octets = fast.heartbeat(reader_id, writer_id, first, first - 1, count, final=final)
    assert octets == Heartbeat(reader_id, writer_id, first, first - 1, count, final).encode()


def test_head_of_a_fragment_that_is_sent_in_parts() -> None:
    run = DataFrag(EntityId(b"\0\0\1\7"), EntityId(b"\0\0\1\2"), 1, 2, 1, 8, 20, serialized_payload=b"fragment")
    assert run.encode_head(8) + b"fragment" == run.encode()
