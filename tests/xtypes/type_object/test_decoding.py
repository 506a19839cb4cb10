"""What peers send is read to the values from which it is made, and what is none is malformed, and nothing else."""

from __future__ import annotations

import struct
import time
from typing import Any

import pytest

from ddsi.structure.errors import MalformedMessage
from ddsi.xtypes.definition import struct_type
from ddsi.xtypes.type_object import (
    TypeObject,
    decode_identifier,
    decode_type_information,
    decode_type_object,
    describe,
    encode_identifier,
    encode_type_object,
    equivalence_hash,
)
from ddsi.xtypes.type_object.identifiers import (
    ArrayIdentifier,
    ComponentIdentifier,
    HashIdentifier,
    MapIdentifier,
    PrimitiveIdentifier,
    SequenceIdentifier,
    StringIdentifier,
    TypeIdentifier,
    UnknownIdentifier,
)
from ddsi.xtypes.type_object.information import MOST_DEPENDENCIES
from ddsi.xtypes.type_object.kinds import COMPLETE, MINIMAL, MemberFlag, TypeKind
from ddsi.xtypes.type_object.objects import ArrayObject, BitsetObject, MapObject, SequenceObject

from .vectors import VECTORS, compiled

by_name = pytest.mark.parametrize("vector", VECTORS, ids=[vector["name"] for vector in VECTORS])

INT32 = PrimitiveIdentifier(TypeKind.INT32)
HASH = HashIdentifier(MINIMAL, bytes(range(14)))

IDENTIFIERS: list[tuple[TypeIdentifier, str]] = [
    (PrimitiveIdentifier(TypeKind.NONE), "00"),
    (INT32, "04"),
    (StringIdentifier(), "7000"),
    (StringIdentifier(255), "70ff"),
    (StringIdentifier(256), "7100000000010000"),
    (StringIdentifier(3, wide=True), "7203"),
    # element kind (both), flags, bound, element
    (SequenceIdentifier(INT32), "80f301000004"),
    (SequenceIdentifier(HASH, 1000), "81f10100e8030000f1000102030405060708090a0b0c0d"),
    (ArrayIdentifier(INT32, (2, 3)), "90f3010002000000020304"),
    (ArrayIdentifier(INT32, (300,)), "91f30100010000002c01000004"),
    # ... bound, element, key flags, key
    (MapIdentifier(INT32, StringIdentifier(), 7), "a0f3010007700000010004"),
    (HASH, "f1000102030405060708090a0b0c0d"),
    # DHEADER, kind, hash, length, index
    (
        ComponentIdentifier(COMPLETE, bytes(14), 2, 1),
        "b000000018000000f2" + "00" * 14 + "000200000001000000",
    ),
    (UnknownIdentifier(0xC7), "c700000000000000"),
]


@pytest.mark.parametrize(("identifier", "octets"), IDENTIFIERS, ids=str)
def test_identifiers_both_ways(identifier: TypeIdentifier, octets: str) -> None:
    assert encode_identifier(identifier).hex() == octets
    assert decode_identifier(bytes.fromhex(octets)) == identifier


@pytest.mark.parametrize(("identifier", "octets"), IDENTIFIERS, ids=str)
def test_every_part_of_an_identifier_is_malformed(identifier: TypeIdentifier, octets: str) -> None:
    whole = bytes.fromhex(octets)
    for length in range(len(whole)):
        with pytest.raises(MalformedMessage):
            decode_identifier(whole[:length])


@by_name
def test_type_objects_are_read_to_the_values_that_they_are_made_of(vector: dict[str, Any]) -> None:
    description = describe(struct_type(compiled(vector)))
    for built in description.minimal, description.complete:
        for identifier, octets in built.octets.items():
            found = decode_type_object(octets)
            if not built.objects[identifier].is_complete:  # names are known here by their hashes only
                assert encode_type_object(found) == octets
            else:
                assert found == built.objects[identifier]
            if isinstance(identifier, HashIdentifier):
                assert equivalence_hash(octets) == identifier.hash


@by_name
def test_the_peers_information_is_read(vector: dict[str, Any]) -> None:
    information = decode_type_information(bytes.fromhex(vector["type_information"]))
    assert information == describe(struct_type(compiled(vector))).information
    assert encode_identifier(information.complete).hex() == vector["type_identifier_complete"]


@by_name
def test_every_part_of_them_is_malformed(vector: dict[str, Any]) -> None:
    description = describe(struct_type(compiled(vector)))
    announced = description.information.encode()
    for length in range(len(announced)):
        with pytest.raises(MalformedMessage):
            decode_type_information(announced[:length])
    for octets in (*description.minimal.octets.values(), *description.complete.octets.values()):
        for length in range(len(octets)):
            with pytest.raises(MalformedMessage):
                decode_type_object(octets[:length])


# --- what vendors do differently, and later versions may -----------------------------------------------------


def information(*members: tuple[int, bytes]) -> bytes:
    """Each with an EMHEADER."""
    body = b"".join(struct.pack("<I", header) + octets for header, octets in members)
    return struct.pack("<I", len(body)) + body


ONE = bytes.fromhex("2400000014000000f1000102030405060708090a0b0c0d0057000000000000000400000000000000")


def test_the_length_may_be_that_of_the_object_itself() -> None:
    """Length code 5, as Dust DDS writes it."""
    found = decode_type_information(information((0x50001001, ONE)))
    assert (found.minimal, found.minimal_types.type.size) == (HASH, 0x57)


def test_a_half_may_be_missing() -> None:
    found = decode_type_information(information((0x40001002, struct.pack("<I", len(ONE)) + ONE)))
    assert found.complete == HASH
    assert found.minimal == PrimitiveIdentifier(TypeKind.NONE)
    assert found.minimal_types.dependency_count == -1


def test_unknown_members_are_skipped() -> None:
    unknown = [(0x20000777, b"abcd"), (0x40000778, b"\4\0\0\0abcd"), (0x60000779, b"\1\0\0\0abcd")]
    assert decode_type_information(information(*unknown, (0x50001001, ONE))).minimal == HASH


def test_what_is_appended_to_an_object_is_skipped() -> None:
    longer = struct.pack("<I", 0x28) + ONE[4:] + b"more"
    assert decode_type_information(information((0x50001001, longer))).minimal == HASH


def test_octets_may_be_big_endian() -> None:
    assert decode_identifier(b"\x71\0\0\0" + struct.pack(">I", 300), little_endian=False) == StringIdentifier(300)


def test_annotations_are_skipped() -> None:
    """A complete alias of int32 whose type and body have both kinds of annotations."""
    detail = b"\1\0\0\0\4\0\0\0abcd\1\0\0\0\2\0\0\0xy\0\0\2\0\0\0A\0"
    related = b"\0\0\4\1\4\0\0\0unit\0"
    header = struct.pack("<I", len(detail)) + detail
    body = b"\xf2\x30\0\0" + header + b"\0" * (-len(header) % 4) + struct.pack("<I", len(related)) + related
    found: Any = decode_type_object(struct.pack("<I", len(body)) + body)
    assert (found.body.type_name, found.body.related) == ("A", INT32)


COLLECTIONS: dict[str, SequenceObject | ArrayObject | MapObject] = {
    "f1600000040000000700000003000000010004": SequenceObject(INT32, 7),
    "f16100000c00000002000000020000000300000003000000010004": ArrayObject(INT32, (2, 3)),
    "f16200000400000007000000030000000100040003000000010004": MapObject(INT32, INT32, 7),
    "f2600000050000000700000000000000050000000100040000": SequenceObject(INT32, 7),
}


@pytest.mark.parametrize("octets", COLLECTIONS)
def test_collections_may_have_type_objects(octets: str) -> None:
    body = bytes.fromhex(octets)
    found = decode_type_object(struct.pack("<I", len(body)) + body)
    assert found == TypeObject(octets.startswith("f2"), COLLECTIONS[octets])


def test_a_bitset_both_ways() -> None:
    from ddsi.xtypes import idl

    namespace: Any = idl.loads("bitset B { bitfield<3> a; bitfield<1> b; }; struct S { B b; };")
    description = describe(struct_type(namespace.S))
    _, octets = description.complete.octets.values()
    found = decode_type_object(octets).body
    assert isinstance(found, BitsetObject)
    assert [(field.position, field.width, str(field.name)) for field in found.fields] == [(0, 3, "a"), (3, 1, "b")]


# --- hostile -------------------------------------------------------------------------------------------------

MALFORMED = {
    "a TypeObject of the kind 0x0": "0400000000510000",
    "a TypeObject of a type of the kind 0x50": "04000000f1500000",
    "an object of 4294967295 octets": "fffffffff151",
    "a sequence of 4294967295 elements": "14000000f1510000010000000000000004000000ffffffff",
    "a name of 2 characters": "1c000000f23000000b00000000000000030000000a0a0000050000000000040000",
}


@pytest.mark.parametrize("reason", MALFORMED)
def test_malformed_type_objects(reason: str) -> None:
    octets = bytes.fromhex(MALFORMED[reason])
    with pytest.raises(MalformedMessage, match=reason):
        decode_type_object(octets + bytes(8))


def test_identifiers_that_nest_without_end_are_malformed() -> None:
    identifier: TypeIdentifier = INT32
    for _ in range(34):
        identifier = SequenceIdentifier(identifier)
    with pytest.raises(MalformedMessage, match="nest deeper than 32"):
        decode_identifier(encode_identifier(identifier))


def test_flags_without_a_meaning_are_dropped() -> None:
    octets = bytes.fromhex("80f3ffff0004")
    found = decode_identifier(octets)
    assert isinstance(found, SequenceIdentifier)
    assert found.flags == MemberFlag(0x7F)


def test_dependencies_without_number_are_not_all_kept() -> None:
    sized = struct.pack("<I", 8) + b"\4\0\0\0" + bytes(4)
    count = 5000
    listed = struct.pack("<II", 4 + len(sized) * count, count) + sized * count
    body = sized + struct.pack("<i", count) + listed
    types = struct.pack("<I", len(body)) + body
    started = time.process_time()
    found = decode_type_information(information((0x50001001, types)))
    assert len(found.minimal_types.dependencies) == MOST_DEPENDENCIES
    assert time.process_time() - started < 5
