"""The short forms of what makes up nearly all traffic say the same octets as the classes do."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.messages import fast
from ddsi.messages.fragment_run import FragmentRun
from ddsi.messages.raw_submessage import SubmessageKind
from ddsi.messages.submessages import Data, DataFrag, Heartbeat, InfoTimestamp, decode_submessage, iterate_submessages
from ddsi.serialization.parameter_id import ParameterId
from ddsi.serialization.parameter_list import ParameterList
from ddsi.structure.errors import MalformedMessage
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


@given(entity_ids, entity_ids, sequence_numbers, words, st.binary(min_size=16, max_size=16))
def test_data_with_a_key_hash(
    reader_id: EntityId, writer_id: EntityId, writer_sn: int, count: int, key_hash: bytes
) -> None:
    payload = bytes(range(4 * count))
    octets = fast.data_head_with_key_hash(reader_id, writer_id, writer_sn, key_hash, len(payload)) + payload
    inline_qos = ParameterList(little_endian=True)
    inline_qos.add(ParameterId.KEY_HASH, key_hash)
    assert octets == Data(reader_id, writer_id, writer_sn, inline_qos, payload).encode()
    assert fast.key_hash_alone(octets, 4, len(octets)) == key_hash


@given(st.lists(st.sampled_from([ParameterId.KEY_HASH, ParameterId.STATUS_INFO]), max_size=3), st.integers(0, 20))
def test_a_key_hash_is_found_only_where_it_is_alone(parameters: list[int], length: int) -> None:
    inline_qos = ParameterList(little_endian=True)
    for parameter in parameters:
        inline_qos.add(parameter, bytes(range(length)))
    octets = Data(EntityId.UNKNOWN, EntityId.UNKNOWN, 1, inline_qos, b"payload.").encode()
    is_alone = parameters == [ParameterId.KEY_HASH] and 12 < length <= 16  # a parameter is padded to a multiple of 4
    assert fast.key_hash_alone(octets, 4, len(octets)) == (bytes(range(length)).ljust(16, b"\0") if is_alone else b"")


@given(entity_ids, entity_ids, sequence_numbers, words, words, st.just(b"") | st.binary(min_size=16, max_size=16))
def test_fragments_with_and_without_a_key_hash(
    reader_id: EntityId, writer_id: EntityId, writer_sn: int, first: int, count: int, key_hash: bytes
) -> None:
    run, sample_size = bytes(range(8 * count)), 8 * (first + count)
    head = fast.data_frag_head(reader_id, writer_id, writer_sn, first, count, 8, sample_size, key_hash, len(run))
    octets = head + run
    inline_qos = ParameterList([(ParameterId.KEY_HASH, key_hash)]) if key_hash else None
    general = DataFrag(reader_id, writer_id, writer_sn, first, count, 8, sample_size, inline_qos, run)
    assert octets == general.encode()
    assert fast.key_hash_alone(octets, 4, len(octets), 32) == key_hash
    found = FragmentRun(octets[1], memoryview(octets)[4:])
    assert (found.key_hash, found.inline_qos, bytes(found.payload)) == (key_hash, None, run)


submessages = st.builds(
    lambda kind, flags, length: bytes((kind, flags)) + length.to_bytes(2, "little") + bytes(length),
    st.sampled_from([SubmessageKind.SEC_BODY, SubmessageKind.SEC_POSTFIX, SubmessageKind.DATA, SubmessageKind.PAD]),
    st.integers(0, 3),
    st.integers(0, 16),
)


@given(st.lists(submessages, max_size=4), st.integers(0, 8))
def test_the_end_of_an_envelope_is_where_the_general_walk_finds_it(following: list[bytes], cut_off: int) -> None:
    octets = bytes((SubmessageKind.SEC_PREFIX, 1, 20, 0)) + bytes(20) + b"".join(following)
    octets = octets[: len(octets) - cut_off]
    found = fast.envelope_end(octets, 0, len(octets))
    if found:
        try:
            ends = [raw.end for raw in iterate_submessages(octets, start=0) if raw.kind == SubmessageKind.SEC_POSTFIX]
        except MalformedMessage:  # behind it, perhaps
            ends = [raw.end for raw in iterate_submessages(octets[:found], start=0)][-1:]
        assert ends[0] == found


def test_the_end_of_a_usual_envelope_is_found_quickly() -> None:
    inside = bytes((SubmessageKind.SEC_BODY, 1, 8, 0)) + bytes(8)
    octets = bytes((SubmessageKind.SEC_PREFIX, 1, 20, 0)) + bytes(20) + inside
    octets += bytes((SubmessageKind.SEC_POSTFIX, 1, 20, 0)) + bytes(20)
    assert fast.envelope_end(octets + b"more", 0, len(octets) + 4) == len(octets)


@given(entity_ids, entity_ids, sequence_numbers, st.integers(0, (1 << 32) - 1), st.booleans())
def test_heartbeat(reader_id: EntityId, writer_id: EntityId, first: int, count: int, final: bool) -> None:
    octets = fast.heartbeat(reader_id, writer_id, first, first - 1, count, final=final)
    assert octets == Heartbeat(reader_id, writer_id, first, first - 1, count, final).encode()


def test_head_of_a_fragment_that_is_sent_in_parts() -> None:
    run = DataFrag(EntityId(b"\0\0\1\7"), EntityId(b"\0\0\1\2"), 1, 2, 1, 8, 20, serialized_payload=b"fragment")
    assert run.encode_head(8) + b"fragment" == run.encode()
