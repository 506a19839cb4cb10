"""Samples of random types come back equal from every encoding; random and damaged octets raise MalformedSample only."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ddsi.structure.errors import MalformedSample
from ddsi.structure.qos_policies import DataRepresentationId
from ddsi.xtypes import type_support
from ddsi.xtypes.careful_reader import read_carefully
from ddsi.xtypes.layout import encapsulations
from ddsi.xtypes.read_source import generate_reader

from .random_types import samples
from .vectors import VECTORS

REPRESENTATIONS = (DataRepresentationId.XCDR1, DataRepresentationId.XCDR2)

FORMS = [(representation, order) for representation in REPRESENTATIONS for order in (True, False)]


@settings(max_examples=60, report_multiple_bugs=False)
@given(samples())
def test_what_is_written_is_read(sample: Any) -> None:
    """By the straight reader alone, by the careful one alone, and by both together."""
    support = type_support(sample.__class__)
    for representation, little_endian in FORMS:
        octets = support.serializer(representation, little_endian)(sample)
        assert support.deserialize(octets) == sample
        assert read_carefully(support.struct, octets) == sample
        encoding = encapsulations(support.extensibility)[octets[:2]]
        assert generate_reader(support.struct, encoding)[0](octets) == sample
        assert generate_reader(support.struct, encoding, view=True)[0](memoryview(octets)) == sample


@settings(max_examples=60, report_multiple_bugs=False)
@given(samples(keyed=True))
def test_the_key_is_the_same_wherever_it_comes_from(sample: Any) -> None:
    support = type_support(sample.__class__)
    key = support.key(sample)
    for representation, little_endian in FORMS:
        assert support.key_from_payload(support.serializer(representation, little_endian)(sample)) == key
        payload = support.key_serializer(representation, little_endian)(sample)
        assert support.key_from_key_payload(payload) == key
        if support.is_keyed:
            assert support.key(support.deserialize_key(payload)) == key
            assert support.key(support.sample_from_key(key)) == key
        key_hash = support.key_hash(key, representation)
        assert len(key_hash) == 16
        assert support.key_from_key_hash(key_hash, representation) in (None, key)


@settings(max_examples=40)
@given(samples(), st.data())
def test_damaged_octets_are_malformed_or_another_sample(sample: Any, data: st.DataObject) -> None:
    """A changed octet, a piece cut out, a piece put in: a sample of the type, or MalformedSample."""
    support = type_support(sample.__class__)
    for representation, little_endian in FORMS:
        octets = bytearray(support.serializer(representation, little_endian)(sample))
        for _ in range(data.draw(st.integers(1, 4))):
            index = data.draw(st.integers(2, max(2, len(octets) - 1)))
            end = index + data.draw(st.integers(0, 4))
            octets[index:end] = data.draw(st.sampled_from([b"", b"\xff", b"\x00", b"\x80\x00\x00\x00", b"\x01\x02"]))
        read_or_refused(support.deserialize, bytes(octets))
        read_or_refused(support.key_from_payload, bytes(octets))


@settings(max_examples=200)
@given(st.sampled_from(VECTORS), st.binary(max_size=64), st.integers(0, 3))
def test_random_octets_are_malformed_or_a_sample(vector: Any, body: bytes, options: int) -> None:
    support = type_support(vector.type)
    for identifier in (*encapsulations(support.extensibility), b"\0\4", b"\1\0", b""):
        octets = identifier + bytes([0, options]) + body
        for read in (
            support.deserialize,
            support.key_from_payload,
            support.deserialize_key,
            support.key_from_key_payload,
        ):
            read_or_refused(read, octets)
            read_or_refused(read, memoryview(octets))


@pytest.mark.parametrize("vector", VECTORS, ids=str)
def test_every_proper_prefix_is_malformed_or_a_shorter_sample(vector: Any) -> None:
    """A type that is appendable at the top may end early in XCDR1; nothing else may."""
    support = type_support(vector.type)
    for name in ("xcdr1_le", "xcdr2_be"):
        octets = vector.octets.get(name, b"")
        may_be_short = support.extensibility.name == "APPENDABLE" and name.startswith("xcdr1")
        for length in range(len(octets)):
            read = read_or_refused(support.deserialize, octets[:length])
            assert read is None or may_be_short or length >= len(octets) - 3
            if read is None:
                with pytest.raises(MalformedSample, match=support.type_name):
                    support.deserialize(octets[:length])


def read_or_refused(read: Any, octets: Any) -> Any:
    try:
        return read(octets)
    except MalformedSample:
        return None
