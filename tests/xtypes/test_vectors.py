"""Samples, key payloads and key hashes of a real peer, both ways, in both representations and byte orders."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from typing import Any, Literal

import pytest

from ddsi.structure.qos_policies import DataRepresentationId
from ddsi.xtypes import deserialize, serialize, type_support
from ddsi.xtypes.careful_reader import read_carefully
from ddsi.xtypes.definition import struct_type
from ddsi.xtypes.layout import encapsulations
from ddsi.xtypes.read_source import generate_reader

from .vector_types import TYPES
from .vectors import ALL, VECTORS, Vector

ENCODINGS = {
    "xcdr1_le": (DataRepresentationId.XCDR1, True),
    "xcdr1_be": (DataRepresentationId.XCDR1, False),
    "xcdr2_le": (DataRepresentationId.XCDR2, True),
    "xcdr2_be": (DataRepresentationId.XCDR2, False),
}

CASES = [(vector, name) for vector in VECTORS for name in ENCODINGS if name in vector.octets]
case = pytest.mark.parametrize(("vector", "encoding"), CASES, ids=str)


def test_every_vector_is_driven() -> None:
    assert len(ALL) == 37
    assert {entry["name"][:3] for entry in ALL} == TYPES.keys()
    assert len(CASES) == 211


@case
def test_serialize_gives_the_peers_octets(vector: Vector, encoding: str) -> None:
    representation, little_endian = ENCODINGS[encoding]
    byteorder: Literal["little", "big"] = "little" if little_endian else "big"
    octets = serialize(vector.value, representation=representation, byteorder=byteorder)
    assert octets.hex() == vector.octets[encoding].hex()


@case
def test_a_writer_adds_padding_and_tells_of_it(vector: Vector, encoding: str) -> None:
    """XCDR2: zeros up to a multiple of 4, their number in the options.  XCDR1: neither."""
    representation, little_endian = ENCODINGS[encoding]
    expected = vector.octets[encoding]
    if representation is DataRepresentationId.XCDR2:
        padding = -len(expected) % 4
        expected = expected[:3] + bytes([padding]) + expected[4:] + bytes(padding)
    assert type_support(vector.type).serializer(representation, little_endian)(vector.value) == expected


@case
def test_deserialize_gives_the_value(vector: Vector, encoding: str) -> None:
    octets = vector.octets[encoding]
    assert deserialize(vector.type, octets) == vector.value
    assert deserialize(vector.type, memoryview(octets)) == vector.value


@case
def test_the_straight_reader_takes_the_peers_octets(vector: Vector, encoding: str) -> None:
    """The generated code reads them itself, without falling back on the careful reader; both agree."""
    support = type_support(vector.type)
    straight = straight_reader(vector.type, vector.octets[encoding])
    assert straight(vector.octets[encoding]) == vector.value
    assert read_carefully(support.struct, vector.octets[encoding]) == vector.value


@case
def test_up_to_three_octets_more_do_no_harm(vector: Vector, encoding: str) -> None:
    octets = vector.octets[encoding]
    for count in (1, 2, 3):
        assert deserialize(vector.type, octets + bytes(count)) == vector.value
        assert deserialize(vector.type, octets[:3] + bytes([count]) + octets[4:] + bytes(count)) == vector.value


def straight_reader(type_: type, octets: bytes) -> Callable[[Any], Any]:
    struct = struct_type(type_)
    return generate_reader(struct, encapsulations(struct.extensibility)[octets[:2]])[0]


# --- keys --------------------------------------------------------------------------------------------------

KEYED = [vector for vector in VECTORS if "key_xcdr2_le" in vector.octets]
keyed = pytest.mark.parametrize("vector", KEYED, ids=str)


@keyed
@pytest.mark.parametrize("encoding", ["xcdr1_le", "xcdr2_le"])
def test_key_payload_both_ways(vector: Vector, encoding: str) -> None:
    support = type_support(vector.type)
    representation, little_endian = ENCODINGS[encoding]
    payload = support.key_serializer(representation, little_endian, padded=False)(vector.value)
    assert payload[4:].hex() == vector.octets[f"key_{encoding}"].hex()
    assert payload[:2] == vector.octets[encoding][:2]
    assert support.key_from_key_payload(payload) == support.key(vector.value)
    assert support.key(support.deserialize_key(payload)) == support.key(vector.value)


@keyed
def test_the_key_is_the_input_of_the_xcdr2_key_hash(vector: Vector) -> None:
    assert type_support(vector.type).key(vector.value).hex() == vector.octets["keyhash_input_xcdr2_be"].hex()


@keyed
@pytest.mark.parametrize("representation", [DataRepresentationId.XCDR1, DataRepresentationId.XCDR2])
def test_key_hash(vector: Vector, representation: DataRepresentationId) -> None:
    expected = vector.octets.get(f"keyhash_{representation.name.lower()}")
    if expected is None:
        assert vector.name.startswith(("s27", "s33"))  # which the peer's core does not offer in XCDR1
        return
    support = type_support(vector.type)
    key = support.key(vector.value)
    assert support.key_hash(key, representation).hex() == expected.hex()
    hashed = vector.octets[f"keyhash_input_{representation.name.lower()}_be"]
    is_digest = hashlib.md5(hashed, usedforsecurity=False).digest() == expected
    assert support.key_from_key_hash(expected, representation) == (None if is_digest else key)


@pytest.mark.parametrize(("vector", "encoding"), [pair for pair in CASES if pair[0] in KEYED], ids=str)
def test_key_from_payload(vector: Vector, encoding: str) -> None:
    support = type_support(vector.type)
    octets = vector.octets[encoding]
    assert support.key_from_payload(octets) == support.key(vector.value)
    assert support.key_from_payload(memoryview(octets)) == support.key(vector.value)


@pytest.mark.parametrize("vector", [vector for vector in VECTORS if vector not in KEYED], ids=str)
def test_keyless_types_have_the_empty_key(vector: Vector) -> None:
    support = type_support(vector.type)
    assert not support.is_keyed
    assert support.key(vector.value) == b""
    assert support.key_from_payload(vector.octets["xcdr2_le"]) == b""
    assert support.key_hash(b"", DataRepresentationId.XCDR1) == bytes(16)
