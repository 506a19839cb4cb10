"""Hostile octets: whatever comes, the parsers give submessages or raise MalformedMessage, and no other error."""

from __future__ import annotations

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.messages.raw_submessage import RawSubmessage
from ddsi.messages.receiver import MessageReceiver
from ddsi.messages.submessages import (
    AckNack,
    Data,
    DataFrag,
    Gap,
    Heartbeat,
    HeartbeatFrag,
    InfoReply,
    InfoSource,
    InfoTimestamp,
    NackFrag,
    Pad,
    Submessage,
    SubmessageKind,
    decode_submessage,
    iterate_submessages,
)
from ddsi.serialization import ParameterList
from ddsi.structure.errors import MalformedMessage
from ddsi.structure.guid import EntityId, GuidPrefix
from ddsi.structure.locator import Locator
from ddsi.structure.sequence_number import NumberSet
from tests.captures.capture import PLAIN, load

HEADER = b"RTPS\2\4\1\x10" + bytes(12)


def walk(datagram: bytes) -> int:
    """How many submessages come out; writing each of them works too."""
    count = 0
    try:
        for submessage, _ in MessageReceiver(datagram):
            submessage.encode(little_endian=getattr(getattr(submessage, "inline_qos", None), "little_endian", True))
            count += 1
    except MalformedMessage as error:
        malformed = error
    else:
        return count
    assert malformed.offset <= len(datagram)
    assert malformed.element
    return count


@given(st.binary(max_size=300))
def test_any_datagram(octets: bytes) -> None:
    walk(octets)
    walk(HEADER + octets)


@given(st.sampled_from(SubmessageKind), st.integers(0, 255), st.binary(max_size=120))
def test_any_body_of_any_kind(kind: SubmessageKind, flags: int, body: bytes) -> None:
    try:
        decode_submessage(RawSubmessage(kind, flags, memoryview(body), 0))
    except MalformedMessage as error:
        malformed = error
    else:
        return
    assert (malformed.element, 4 <= malformed.offset <= 4 + len(body)) == (kind.name, True)


@pytest.mark.parametrize("name", PLAIN)
def test_captured_datagrams_with_octets_changed(name: str) -> None:
    """Ten variants of each short datagram, one to four octets changed: deeper than random octets ever get."""
    rng = random.Random(name)
    survived = 0
    for datagram in load(name).datagrams:
        if len(datagram) > 1500:
            continue
        for _ in range(10):
            changed = bytearray(datagram)
            for _ in range(rng.randint(1, 4)):
                changed[rng.randrange(20, len(changed))] = rng.choice((0, 1, 0x7F, 0x80, 0xFF, rng.randrange(256)))
            survived += walk(bytes(changed)) > 0
    assert survived > 100


@pytest.mark.parametrize("name", ["fastdds-discovery", "cyclone11-late-joiner", "dust-reliable"])
def test_captured_datagrams_cut_off(name: str) -> None:
    for datagram in load(name).datagrams:
        whole = walk(datagram)
        for length in range(0, len(datagram), 3):
            assert walk(datagram[:length]) <= whole


entity_ids = st.binary(min_size=4, max_size=4).map(EntityId)
sequence_numbers = st.one_of(st.integers(1, 300), st.integers(1, (1 << 63) - 1))
u32 = st.integers(0, (1 << 32) - 1)
locators = st.builds(Locator, st.integers(-(1 << 31), (1 << 31) - 1), u32, st.binary(min_size=16, max_size=16))
payloads = st.integers(1, 30).flatmap(lambda words: st.binary(min_size=4 * words, max_size=4 * words))


@st.composite
def number_sets(draw: st.DrawFn, bases: st.SearchStrategy[int]) -> NumberSet:
    num_bits = draw(st.integers(1, 256))
    return NumberSet(draw(bases), num_bits, draw(st.integers(0, (1 << num_bits) - 1)))


@st.composite
def heartbeats(draw: st.DrawFn) -> Heartbeat:
    first_sn = draw(sequence_numbers)
    last_sn = draw(st.integers(first_sn - 1, (1 << 63) - 1))
    flags = draw(st.booleans()), draw(st.booleans())
    return Heartbeat(draw(entity_ids), draw(entity_ids), first_sn, last_sn, draw(u32), *flags)


@st.composite
def data_frags(draw: st.DrawFn) -> DataFrag:
    size, starting_num, count = draw(st.integers(1, 20)), draw(st.integers(1, 50)), draw(st.integers(1, 5))
    last_is_full = (starting_num + count - 1) * size
    sample_size = draw(st.integers(last_is_full - size + 1, last_is_full + 1000))
    run_length = min(last_is_full, sample_size) - (starting_num - 1) * size
    payload = draw(st.binary(min_size=run_length, max_size=run_length))
    payload += bytes(-run_length % 4)
    return DataFrag(
        draw(entity_ids),
        draw(entity_ids),
        draw(sequence_numbers),
        starting_num,
        count,
        size,
        sample_size,
        draw(inline_qos),
        payload,
        draw(st.booleans()),
    )


inline_qos = st.none() | st.lists(st.tuples(st.integers(2, 0xFFFF), payloads), max_size=4).map(ParameterList)
submessages: st.SearchStrategy[Submessage] = st.one_of(
    st.builds(AckNack, entity_ids, entity_ids, number_sets(sequence_numbers), u32, st.booleans()),
    st.builds(NackFrag, entity_ids, entity_ids, sequence_numbers, number_sets(st.integers(1, (1 << 32) - 1)), u32),
    st.builds(Gap, entity_ids, entity_ids, sequence_numbers, number_sets(sequence_numbers)),
    st.builds(HeartbeatFrag, entity_ids, entity_ids, sequence_numbers, st.integers(1, (1 << 32) - 1), u32),
    st.builds(Data, entity_ids, entity_ids, sequence_numbers, inline_qos, payloads, st.booleans(), st.booleans()),
    st.builds(InfoTimestamp, st.none() | st.integers(0, (1 << 64) - 1)),
    st.builds(
        InfoSource,
        st.tuples(st.integers(0, 255), st.integers(0, 255)),
        st.binary(min_size=2, max_size=2),
        st.binary(min_size=12, max_size=12).map(GuidPrefix),
    ),
    st.builds(
        InfoReply, st.lists(locators, max_size=3).map(tuple), st.none() | st.lists(locators, max_size=3).map(tuple)
    ),
    st.builds(Pad, st.integers(0, 5).map(lambda words: 4 * words)),
    heartbeats(),
    data_frags(),
)


@given(st.lists(submessages, max_size=6))
def test_submessages_round_trip(sent: list[Submessage]) -> None:
    octets = b"".join(submessage.encode() for submessage in sent)
    assert [decode_submessage(raw) for raw in iterate_submessages(octets, start=0)] == sent


@given(submessages)
def test_big_endian_submessages_round_trip(sent: Submessage) -> None:
    if isinstance(sent, (Data, DataFrag)) and sent.inline_qos is not None:
        return  # the values of a list have one byte order
    (raw,) = iterate_submessages(sent.encode(little_endian=False), start=0)
    assert decode_submessage(raw) == sent
