"""Whatever octets are: a sample, or MalformedSample that says where, after work that grows with them and no faster."""

from __future__ import annotations

import struct
import sys
from collections.abc import Callable
from typing import Annotated, Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ddsi.structure.errors import MalformedSample
from ddsi.structure.qos_policies import DataRepresentationId
from ddsi.xtypes import idl, type_support

from .random_types import samples

XCDR1, XCDR2 = DataRepresentationId.XCDR1, DataRepresentationId.XCDR2
FORMS = [(representation, order) for representation in (XCDR1, XCDR2) for order in (True, False)]

INSERTED = [b"\xff\xff\xff\xff", b"\x7f\xff\xff\xff", b"\0\0\0\x80", bytes(4), b"\1", b"\2\xfe", b"\x3f\x02"]


@settings(max_examples=80, report_multiple_bugs=False)
@given(samples(keyed=True), st.data())
def test_what_is_malformed_is_so_at_an_octet_and_in_a_member(sample: Any, data: st.DataObject) -> None:
    """Cut off, with a piece replaced or with one put in; read from bytes and from a view, whole or for its key."""
    support = type_support(sample.__class__)
    for representation, little_endian in FORMS:
        octets = bytearray(support.serializer(representation, little_endian)(sample))
        begin = data.draw(st.integers(0, len(octets)))
        end = data.draw(st.sampled_from([begin, begin + 1, begin + 4, len(octets)]))
        octets[begin:end] = data.draw(st.sampled_from([b"", *INSERTED]))
        outcome = read(support.deserialize, bytes(octets), support.struct)
        assert read(support.deserialize, memoryview(octets), support.struct) == outcome
        read(support.key_from_payload, bytes(octets), support.struct)
        if not outcome.startswith("malformed"):
            assert support.deserialize(bytes(octets)).__class__ is sample.__class__


def read(reader: Callable[[Any], Any], octets: Any, struct_type: Any) -> str:
    """What became of it.  The member and the octet that are named must be there."""
    try:
        return repr(reader(octets))
    except MalformedSample as error:
        malformed = error
    assert 0 <= malformed.offset <= len(octets), malformed
    first = malformed.path.partition(".")[0].partition("[")[0]
    assert first in ("", *(member.name for member in struct_type.members)), malformed
    assert malformed.path in str(malformed)
    return f"malformed: {malformed}"


# --- work --------------------------------------------------------------------------------------------------


@idl.struct
class Small:
    x: idl.octet


@idl.union(extensibility=idl.FINAL)
class Either:
    kind: idl.octet = idl.switch
    number: idl.int32 = idl.case(1)


@idl.struct(extensibility=idl.MUTABLE)
class Loose:
    x: Annotated[idl.octet, idl.id(7)]


@idl.struct
class Tree:
    kids: idl.sequence[Tree]


def counted(header: str, each: bytes) -> Callable[[int], bytes]:
    """The payload of a final struct with one sequence: a count, and elements."""
    return lambda count: bytes.fromhex(header) + struct.pack("<I", count) + each * count


def delimited(each: bytes) -> Callable[[int], bytes]:
    """The same with a delimiter, in XCDR2."""
    return lambda count: bytes.fromhex("00070000") + struct.pack("<II", 4 + len(each) * count, count) + each * count


def listed(each: bytes) -> Callable[[int], bytes]:
    """A final struct that holds a mutable one, in XCDR1."""
    return lambda count: bytes.fromhex("00010000") + each * count


def emheaders(each: bytes) -> Callable[[int], bytes]:
    return lambda count: bytes.fromhex("00070000") + struct.pack("<I", len(each) * count) + each * count


def entries(count: int) -> bytes:
    pairs = b"".join(struct.pack("<iB3x", number, 1) for number in range(count))
    return bytes.fromhex("00010000") + struct.pack("<I", count) + pairs


FAMILIES: dict[str, tuple[Any, Callable[[int], bytes]]] = {
    "strings": (idl.sequence[str], counted("00010000", bytes(4))),
    "strings, delimited": (idl.sequence[str], delimited(bytes(4))),
    "wide strings": (idl.sequence[idl.wstring], counted("00010000", bytes(4))),
    "sequences": (idl.sequence[idl.sequence[idl.octet]], counted("00010000", bytes(4))),
    "structs": (idl.sequence[Small], counted("00010000", b"\1")),
    "structs of defaults": (idl.sequence[Small], delimited(bytes(4))),
    "unions without a member": (idl.sequence[Either], counted("00010000", b"\5")),
    "booleans": (idl.sequence[idl.boolean], counted("00010000", b"\1")),
    "a broad tree": (Tree, counted("00010000", bytes(4))),
    "map entries": (idl.map[idl.int32, idl.octet], entries),
    "parameters to be ignored": (Loose, listed(bytes.fromhex("033f0000"))),
    "unknown parameters": (Loose, listed(bytes.fromhex("08000000"))),
    "unknown members": (Loose, emheaders(bytes.fromhex("08000000 01000000"))),
    "lists without anything": (idl.sequence[Loose], counted("00010000", bytes.fromhex("023f0000"))),
}


@pytest.mark.parametrize("name", FAMILIES)
def test_work_grows_with_the_octets(name: str) -> None:
    """Counted in calls of functions, so that no clock is asked: four times the octets, about four times the calls."""
    annotation, payload = FAMILIES[name]
    members = {"it": annotation, "key": Annotated[idl.int32, idl.key]}
    victim: Any = idl.struct(extensibility=idl.FINAL)(type("Victim", (), {"__annotations__": members}))
    support: Any = type_support(victim)
    calls = []
    for count in (10, 200, 800):  # the first makes the codec
        octets = payload(count) + b"\xff"  # too short for the key: understood up to there, and then not

        def attempt(octets: bytes = octets) -> None:
            for reader in (support.deserialize, support.key_from_payload):
                with pytest.raises(MalformedSample):
                    reader(octets)

        calls.append(calls_of(attempt))
    assert calls[2] <= 5 * calls[1]


def calls_of(action: Callable[[], None]) -> int:
    calls = 0

    def count(_frame: Any, event: str, _argument: Any) -> None:
        nonlocal calls
        calls += event in ("call", "c_call")

    sys.setprofile(count)
    try:
        action()
    finally:
        sys.setprofile(None)
    return calls
