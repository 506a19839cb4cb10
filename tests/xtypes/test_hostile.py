"""Octets meant to harm: huge counts, deep nesting, lengths that disagree.  Refused quickly, and with little memory."""

from __future__ import annotations

import enum
import re
import struct
import time
import tracemalloc
from typing import Annotated, Any

import pytest

from ddsi.structure.errors import BadParameter, MalformedSample
from ddsi.xtypes import deserialize, idl, serialize, type_support
from ddsi.xtypes.enumerations import bitmask_from


class Color(enum.IntEnum):
    RED = 0


class Many(enum.IntFlag):
    A = 1


@idl.struct(extensibility=idl.FINAL)
class Item:
    x: idl.octet


@idl.struct
class Tree:
    kids: idl.sequence[Tree]


@idl.struct(extensibility=idl.FINAL)
class Choice:
    inner: Choice | None


SEQUENCES: dict[str, Any] = {
    "octets": idl.sequence[idl.octet],
    "numbers": idl.sequence[idl.float64],
    "booleans": idl.sequence[idl.boolean],
    "wchars": idl.sequence[idl.wchar],
    "strings": idl.sequence[str],
    "enums": idl.sequence[Color],
    "structs": idl.sequence[Item],
    "sequences": idl.sequence[idl.sequence[idl.octet]],
    "large arrays": idl.sequence[Annotated[idl.sequence[idl.octet], idl.array(1000)]],
    "string": str,
}


@pytest.mark.parametrize("count", [1 << 16, 0x7FFFFFFF, 0xFFFFFFFF])
@pytest.mark.parametrize("name", SEQUENCES)
def test_a_huge_count_allocates_nothing(name: str, count: int) -> None:
    class_: Any = idl.struct(type("Victim", (), {"__annotations__": {"it": SEQUENCES[name], "after": idl.int32}}))
    body = struct.pack("<III", count, count, count) + bytes(20)
    payloads = [b"\0\1\0\0" + body, b"\0\x09\0\0" + struct.pack("<I", len(body)) + body]
    support: Any = type_support(class_)
    for payload in payloads:
        with pytest.raises(MalformedSample):  # the codec is generated here, and not measured
            support.deserialize(payload)
    tracemalloc.start()
    for payload in payloads:
        with pytest.raises(MalformedSample, match="Victim: it"):
            support.deserialize(payload)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 200_000


@pytest.mark.parametrize("levels", [60, 70, 200, 5000])
def test_nesting_is_bounded(levels: int) -> None:
    payload = b"\0\1\0\0" + struct.pack("<I", 1) * levels + bytes(4)
    if levels < 64:
        tree = deserialize(Tree, payload)
        assert serialize(tree, representation=type_support(Tree).representations[1]) == payload
        return
    with pytest.raises(MalformedSample, match="structs are nested too deep"):
        deserialize(Tree, b"\0\1\0\0" + struct.pack("<I", 1) * levels * 3)
    with pytest.raises(MalformedSample, match="structs are nested too deep"):
        deserialize(Choice, b"\0\7\0\0" + b"\1" * levels * 3)


def test_breadth_is_read_in_linear_time() -> None:
    """Each octet of the payload is an element; twice the octets take about twice the time, not four times."""
    payload = b"\0\x07\0\0" + struct.pack("<II", 4 + 100_000, 100_000) + bytes(100_000)

    @idl.struct(extensibility=idl.FINAL)
    class Wide:
        items: idl.sequence[Item]

    assert len(deserialize(Wide, payload).items) == 100_000
    began = time.perf_counter()
    with pytest.raises(MalformedSample):
        deserialize(Wide, payload[:-1])
    assert time.perf_counter() - began < 5  # some 0.3 s; a quadratic reader would take minutes


def test_defaults_cannot_be_multiplied() -> None:
    """Each delimiter of 0 stands for an element of which all is default, here a million values."""

    @idl.struct
    class Tile:
        pixels: Annotated[idl.sequence[idl.uint16], idl.array(1000, 1000)]

    @idl.struct
    class Image:
        tiles: idl.sequence[Tile]
        one: Tile

    def payload(count: int) -> bytes:
        body = struct.pack("<II", 4 + 4 * count, count) + bytes(4 * count)
        return b"\0\x09\0\0" + struct.pack("<I", len(body)) + body

    assert len(deserialize(Image, payload(1)).one.pixels) == 1000
    with pytest.raises(MalformedSample, match=r"tiles\[2\]: too much is left out: pixels and others"):
        deserialize(Image, payload(10_000))


DELIMITERS = [
    ("00090000 ffffffff 00000000", "a length of 4294967295 octets where 4 are left"),
    ("00090000 08000000 00000000 00000000", "kids: 4 octets are needed, 0 are left"),
    ("00090000 04000000 00000000", "kids: 4 octets are needed, 0 are left"),
    ("00090000 08000000 08000000 01000000", "kids: a length of 8 octets where 4 are left"),
    ("00090000 08000000 04000000 01000000", "1 elements of Tree where 0 octets are left"),
    ("00090000 08000000 04000000 00000000 00000000", "4 octets too many"),
    ("00070000 00000000", "the encapsulation 0007 is not that of a type which is appendable"),
    ("00040000 00000000", "the encapsulation 0004 is unknown"),
    ("01090000 00000000", "the encapsulation 0109 is unknown"),
    ("00090003 0000", "3 octets of padding in a payload of 2"),
    ("0009", "no encapsulation header"),
]


@pytest.mark.parametrize(("octets", "reason"), DELIMITERS)
def test_delimiters_that_lie(octets: str, reason: str) -> None:
    with pytest.raises(MalformedSample, match=re.escape(reason)):
        deserialize(Tree, bytes.fromhex(octets))


def test_a_delimiter_that_does_not_lie() -> None:
    assert deserialize(Tree, bytes.fromhex("00090000 08000000 04000000 00000000")) == Tree([])


VALUES: dict[str, tuple[Any, str, str]] = {
    "boolean": (idl.boolean, "02", "it: a boolean of 2"),
    "booleans": (idl.sequence[idl.boolean], "01000000 02", "it: a boolean of 2"),
    "enum": (Color, "05000000", "it: 5 is no literal of Color"),
    "unterminated": (str, "02000000 6161", "it: a string without its terminating NUL"),
    "not utf-8": (str, "02000000 ff00", "it: a string is not UTF-8 (invalid start byte)"),
    "surrogate": (str, "04000000 eda08000", "it: a string is not UTF-8"),
    "long string": (Annotated[str, idl.bound(1)], "03000000 616100", "it: a string of 2 octets exceeds its bound of 1"),
    "long sequence": (Annotated[bytes, idl.bound(1)], "02000000 0000", "it: 2 elements exceed the bound of 1"),
    "element": (idl.sequence[str], "02000000 01000000 00 000000 02000000 6161", "it[1]: a string without"),
}


@pytest.mark.parametrize("name", VALUES)
def test_values_outside_their_type_are_malformed_with_member_and_offset(name: str) -> None:
    annotation, octets, reason = VALUES[name]
    class_: Any = idl.struct(type("Victim", (), {"__annotations__": {"before": idl.octet, "it": annotation}}))
    aligned = "ff" if name == "boolean" else "ff000000"
    payload = bytes.fromhex("00010000" + aligned + octets)
    with pytest.raises(MalformedSample, match=r"Victim: " + re.escape(reason) + r".*\(octet \d+\)") as malformed:
        deserialize(class_, payload)
    assert malformed.value.path == reason.partition(":")[0]
    assert len(payload) - len(bytes.fromhex(octets)) <= malformed.value.offset <= len(payload)


def test_an_element_of_an_array_is_named_by_all_its_indices() -> None:
    @idl.struct
    class Table:
        names: Annotated[idl.sequence[idl.sequence[str]], idl.array(2, 3)]

    octets = serialize(Table([["a", "b", "c"], ["d", "e", "f"]]))
    with pytest.raises(MalformedSample, match=r"a string without its terminating NUL") as malformed:
        deserialize(Table, octets.replace(b"e\0", b"e!"))
    assert malformed.value.path == "names[1][1]"


def test_a_string_of_length_zero_is_empty() -> None:
    @idl.struct
    class Victim:
        text: Annotated[str, idl.key]

    for payload in (b"\0\1\0\0" + bytes(4), b"\0\0\0\0" + bytes(4)):
        assert deserialize(Victim, payload) == Victim("")
        assert type_support(Victim).key_from_payload(payload) == b"\0\0\0\1\0"


def test_bits_without_a_flag_are_kept_but_not_remembered_for_ever() -> None:
    """``IntFlag`` caches every combination that it makes; a stranger must not fill the memory with them."""
    for number in range(10_000):
        flags = bitmask_from(Many, number)
        assert (flags, type(flags)) == (number, Many)
    assert len(Many._value2member_map_) <= 4097
    assert bitmask_from(Many, 9_999) & Many.A == Many.A
    assert "9998" in repr(bitmask_from(Many, 9_998))


def test_flags_that_a_strict_class_does_not_know_are_malformed() -> None:
    class Strict(enum.IntFlag, boundary=enum.STRICT):
        LOW = 1

    @idl.struct()
    class Flagged:
        flags: Strict

    assert deserialize(Flagged, b"\0\1\0\0\1\0\0\0") == Flagged(Strict.LOW)
    with pytest.raises(MalformedSample, match="flags: 0x3 has flags that Strict does not know"):
        deserialize(Flagged, b"\0\1\0\0\3\0\0\0")


def test_a_bitmask_without_flags_is_refused() -> None:
    class Nothing(enum.IntFlag):
        pass

    with pytest.raises(BadParameter, match="Nothing: a bitmask has one flag at least"):

        @idl.struct()
        class Flagged:
            flags: Nothing


def test_a_post_init_that_refuses_makes_the_sample_malformed() -> None:
    @idl.struct
    class Positive:
        x: idl.int32

        def __post_init__(self) -> None:
            if self.x < 0:
                raise ValueError("x is negative")

    assert deserialize(Positive, bytes.fromhex("00010000 05000000")) == Positive(5)
    with pytest.raises(MalformedSample, match=r"Positive\.__post_init__ refused the sample: x is negative"):
        deserialize(Positive, bytes.fromhex("00010000 ffffffff"))
