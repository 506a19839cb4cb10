"""Key payloads as they come on the wire: with and without DHEADER, and filled up.

Cyclone DDS 0.10.2 writes the key of an appendable type in XCDR2 without its DHEADER: these octets are those of its
dispose of ShapeType BLUE; release 11.0.1 writes what the specification says.
"""

from __future__ import annotations

from typing import Annotated

import pytest

from ddsi.structure.qos_policies import DataRepresentationId
from ddsi.xtypes import idl, type_support

FROM_0_10 = bytes.fromhex("00090003 05000000 424c554500 000000")
FROM_11 = bytes.fromhex("00090000 09000000 05000000 424c554500 000000")


@idl.struct(extensibility=idl.APPENDABLE)
class ShapeType:
    color: Annotated[str, idl.key, idl.bound(128)]
    x: idl.int32 = 0


@idl.struct(extensibility=idl.APPENDABLE)
class Numbered:
    number: Annotated[idl.int32, idl.key]
    text: str = ""


@pytest.mark.parametrize("payload", [FROM_0_10, FROM_11])
def test_a_key_is_read_with_and_without_its_dheader(payload: bytes) -> None:
    support = type_support(ShapeType)
    assert support.deserialize_key(payload) == ShapeType("BLUE")
    assert support.key_from_key_payload(payload) == support.key(ShapeType("BLUE"))


@pytest.mark.parametrize("number", [0, 4, 8, -1])
def test_a_number_is_not_taken_for_a_dheader(number: int) -> None:
    support = type_support(Numbered)
    octets = number.to_bytes(4, "little", signed=True)
    for payload in (b"\0\x09\0\0" + octets, b"\0\x09\0\0\x04\0\0\0" + octets):
        assert support.deserialize_key(payload) == Numbered(number)


@idl.struct(extensibility=idl.FINAL)
class Short:
    a: Annotated[idl.int32, idl.key]
    b: Annotated[str, idl.key]


@pytest.mark.parametrize("representation", [0, 2])
@pytest.mark.parametrize("sample", [ShapeType("B"), ShapeType("BLUE"), Numbered(7), Short(1, ""), Short(1, "abc")])
def test_a_key_payload_filled_up_to_twenty_octets_is_the_same_key(sample: object, representation: int) -> None:
    """Writers here do so, as Fast DDS takes 16 octets or less for the hash of the key."""
    support = type_support(type(sample))
    payload = support.key_serializer(DataRepresentationId(representation))(sample)
    if len(payload) <= 16:
        assert support.key_from_key_payload(payload.ljust(20, b"\0")) == support.key(sample)
        assert support.key_from_key_payload(payload) == support.key(sample)
