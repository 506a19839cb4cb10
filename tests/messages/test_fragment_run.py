"""FragmentRun: the short way of DATA_FRAG says what the general one says, of whatever comes."""

from __future__ import annotations

import struct

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from ddsi.messages.data_frag import DataFrag
from ddsi.messages.fragment_run import FragmentRun
from ddsi.serialization.parameter_id import ParameterId
from ddsi.serialization.parameter_list import ParameterList
from ddsi.structure.errors import MalformedMessage
from ddsi.structure.guid import EntityId

READER, WRITER = EntityId(b"\0\0\1\4"), EntityId(b"\0\0\1\3")
KEY_HASH = bytes(range(16))
SOME_QOS = ParameterList([(ParameterId.STATUS_INFO, bytes(4)), (ParameterId.KEY_HASH, KEY_HASH)])


def general_of(flags: int, body: memoryview) -> dict[str, object] | str:
    """What the general way makes of it, by the short one's names."""
    try:
        found = DataFrag.decode(flags, body)
    except MalformedMessage as error:
        return str(error)
    inline_qos = found.inline_qos
    is_key_hash_alone = inline_qos is not None and flags & 1 and list(inline_qos) == [(ParameterId.KEY_HASH, KEY_HASH)]
    return {
        "reader_id": found.reader_id,
        "writer_id": found.writer_id,
        "writer_sn": found.writer_sn,
        "first": found.fragment_starting_num,
        "count": found.fragments_in_submessage,
        "fragment_size": found.fragment_size,
        "sample_size": found.sample_size,
        "length": found.run_length,
        "payload": found.serialized_payload,
        "key_hash": KEY_HASH if is_key_hash_alone else b"",
        "inline_qos": None if is_key_hash_alone else inline_qos,
        "is_key": found.is_key,
        "non_standard_payload": found.non_standard_payload,
    }


def short_of(flags: int, body: memoryview) -> dict[str, object] | str:
    try:
        found = FragmentRun(flags, body)
    except MalformedMessage as error:
        return str(error)
    return {name: getattr(found, name) for name in FragmentRun.__slots__}


@pytest.mark.parametrize("inline_qos", [None, ParameterList([(ParameterId.KEY_HASH, KEY_HASH)]), SOME_QOS])
@pytest.mark.parametrize("first", [1, 2, 3])
@pytest.mark.parametrize("flags", [0, 4, 8, 12])
def test_runs_as_they_are_sent(inline_qos: ParameterList | None, first: int, flags: int) -> None:
    length = 4 if first == 3 else 8
    run = DataFrag(READER, WRITER, 7, first, 1, 8, 20, inline_qos, bytes(length), bool(flags & 4), bool(flags & 8))
    octets = run.encode()
    found = short_of(octets[1], memoryview(octets)[4:])
    assert found == general_of(octets[1], memoryview(octets)[4:])
    assert isinstance(found, dict)
    assert (found["writer_sn"], found["first"], found["length"], found["payload"]) == (7, first, length, bytes(length))


SMALL = st.integers(0, 5)
INLINE_QOS = (b"", struct.pack("<HH16sI", 0x70, 16, KEY_HASH, 1), struct.pack("<HH4sI", 0x71, 4, bytes(4), 1))


@given(
    flags=st.integers(0, 15),
    to_inline_qos=st.sampled_from((28, 28, 28, 0, 24, 30, 32, 52, 2000)),
    number=st.sampled_from((1, 7, 0, -1, 1 << 40)),
    first=SMALL,
    count=SMALL,
    size=SMALL,
    sample_size=st.integers(0, 24),
    qos=st.sampled_from(
        (b"", struct.pack("<HH16sI", 0x70, 16, KEY_HASH, 1), struct.pack("<HH4sI", 0x71, 4, b"\0" * 4, 1))
    ),
    payload=st.integers(0, 24),
    cut=st.sampled_from((0, 0, 0, 1, 4, 24)),
)
@example(1, 28, 1, 1, 1, 4, 4, b"", 4, 0)
@example(1, 28, 0, 1, 1, 4, 4, b"", 4, 0)
@example(1, 28, -1, 1, 1, 4, 4, b"", 4, 0)
def test_whatever_comes_is_judged_alike(
    flags: int, to_inline_qos: int, number: int, first: int, count: int, size: int, sample_size: int, qos: bytes,
    payload: int, cut: int,
) -> None:  # fmt: skip
    order = "<" if flags & 1 else ">"
    fixed = struct.pack(
        f"{order}HH4s4siIIHHI",
        0, to_inline_qos, READER, WRITER, number >> 32, number & 0xFFFFFFFF, first, count, size, sample_size,
    )  # fmt: skip
    octets = fixed + qos + bytes(payload)
    body = memoryview(octets)[: len(octets) - cut]
    assert short_of(flags, body) == general_of(flags, body)
