"""Where keys are found, what is jumped over before them, and what a key hash holds."""

from __future__ import annotations

import enum
import hashlib
import struct
from typing import Annotated, Any

import pytest

from ddsi.structure.errors import BadParameter, MalformedSample
from ddsi.structure.qos_policies import DataRepresentationId
from ddsi.xtypes import idl, key_hash, type_support
from ddsi.xtypes.key_source import generate_key_extractor
from ddsi.xtypes.keys import canonical_key_type
from ddsi.xtypes.layout import encapsulations

from .vectors import VECTORS, Vector

XCDR1, XCDR2 = DataRepresentationId.XCDR1, DataRepresentationId.XCDR2
FORMS = [(representation, order) for representation in (XCDR1, XCDR2) for order in (True, False)]


def extract(sample: Any, representation: DataRepresentationId, little_endian: bool) -> bytes | None:
    """The key by the generated extractor alone; None where there is none."""
    support = type_support(sample.__class__)
    canonical = canonical_key_type(support.struct)
    assert canonical is not None
    octets = support.serializer(representation, little_endian)(sample)
    encoding = encapsulations(support.extensibility)[octets[:2]]
    generated = generate_key_extractor(support.struct, canonical, encoding)
    return None if generated is None else generated[0](octets)


# --- extractors --------------------------------------------------------------------------------------------

WITHOUT = ("s16", "s17", "s23", "s24", "s37")  # mutable: the whole sample is read

KEYED = [vector for vector in VECTORS if "key_xcdr2_le" in vector.octets]


@pytest.mark.parametrize("vector", KEYED, ids=str)
@pytest.mark.parametrize(("representation", "little_endian"), FORMS)
def test_extractors_find_the_keys_of_the_vectors(
    vector: Vector, representation: DataRepresentationId, little_endian: bool
) -> None:
    found = extract(vector.value, representation, little_endian)
    expected = None if vector.name.startswith(WITHOUT) else type_support(vector.type).key(vector.value)
    assert found == expected


class Color(enum.IntEnum):
    RED = 0
    BLUE = 2


@idl.struct(extensibility=idl.FINAL)
class Fixed:
    a: idl.octet
    b: idl.float64


@idl.struct(extensibility=idl.FINAL)
class Texts:
    one: str
    other: str


@idl.struct(extensibility=idl.APPENDABLE)
class Tagged:
    ignored: str
    tag: Annotated[idl.int64, idl.key]
    behind: str


@idl.struct(extensibility=idl.FINAL)
class FinalTagged:
    ignored: str
    tag: Annotated[idl.int16, idl.key]
    behind: str


@idl.struct(extensibility=idl.FINAL)
class Everything:
    octet: idl.octet
    fixed: Fixed
    first: Annotated[idl.int16, idl.key, idl.id(90)]
    text: str
    numbers: idl.sequence[idl.int32]
    texts: Texts
    pair: Annotated[idl.sequence[Fixed], idl.array(2)]
    large: Annotated[idl.sequence[idl.int64], idl.array(100)]
    tagged: Annotated[Tagged, idl.key, idl.id(50)]
    final_tagged: Annotated[FinalTagged, idl.key, idl.id(40)]
    whole: Annotated[Fixed, idl.key, idl.id(30)]
    color: Annotated[Color, idl.key, idl.id(20)]
    id: Annotated[bytes, idl.array(3), idl.key, idl.id(10)]
    name: Annotated[str, idl.key, idl.id(60)]
    rest: idl.sequence[str]


EVERYTHING = Everything(
    *(1, Fixed(2, 3.5), -4, "five", [6, 7, 8], Texts("9", "ten"), [Fixed(1, 1), Fixed(2, 2)], range(100)),
    *(Tagged("abc", 11, "defg"), FinalTagged("a", 12, "bcd"), Fixed(13, 14.5), Color.BLUE, b"xyz", "name", ["rest"]),
)


@pytest.mark.parametrize(("representation", "little_endian"), FORMS)
def test_what_lies_before_and_between_is_jumped_over(representation: DataRepresentationId, little_endian: bool) -> None:
    key = struct.pack(">3sxiB3xdh2xqI5sxh", b"xyz", 2, 13, 14.5, 12, 11, 5, b"name", -4)
    assert type_support(Everything).key(EVERYTHING) == type_support(Everything).key_from_payload(
        type_support(Everything).serializer(representation, little_endian)(EVERYTHING)
    )
    assert extract(EVERYTHING, representation, little_endian) == type_support(Everything).key(EVERYTHING) == key


@pytest.mark.parametrize(("representation", "little_endian"), FORMS)
def test_a_string_key_that_is_not_there_whole_is_malformed(
    representation: DataRepresentationId, little_endian: bool
) -> None:
    @idl.struct(extensibility=idl.FINAL)
    class Named:
        name: Annotated[str, idl.key, idl.bound(4)]
        x: idl.int32 = 0

    support = type_support(Named)
    octets = support.serializer(representation, little_endian)(Named("name"))
    assert support.key_from_payload(octets[:13]) == support.key(Named("name"))  # the rest is not looked at
    for wrong in (octets[:12], octets[:12] + b"x" + octets[13:], octets[:6]):
        with pytest.raises(MalformedSample):
            support.key_from_payload(wrong)


def test_a_key_beyond_its_delimiter_is_not_taken() -> None:
    support = type_support(Tagged)
    octets = type_support(Tagged).serializer(XCDR2, padded=False)(Tagged("abc", 1, ""))
    cut = octets[:4] + struct.pack("<I", 8) + octets[8:16]
    assert support.key_from_payload(cut) == bytes(8)  # a member that is not there has its default
    with pytest.raises(MalformedSample):
        support.key_from_payload(octets[:4] + struct.pack("<I", 8) + octets[8:])


# --- key hashes --------------------------------------------------------------------------------------------


@idl.struct(extensibility=idl.FINAL)
class Exactly16:
    name: Annotated[str, idl.bound(11), idl.key]


@idl.struct(extensibility=idl.FINAL)
class Beyond16:
    name: Annotated[str, idl.bound(12), idl.key]


def test_the_largest_key_decides_between_octets_and_digest() -> None:
    assert key_hash(Exactly16("ab")) == b"\0\0\0\3ab\0" + bytes(9)
    assert key_hash(Beyond16("ab")) == hashlib.md5(b"\0\0\0\3ab\0", usedforsecurity=False).digest()
    support = type_support(Exactly16)
    for name in ("", "a", "abc", "elevenchars"):
        key = support.key(Exactly16(name))
        assert support.key_from_key_hash(support.key_hash(key, XCDR1)) == key
        assert support.sample_from_key(key) == Exactly16(name)
    assert type_support(Beyond16).key_from_key_hash(key_hash(Beyond16("ab"))) is None


@pytest.mark.parametrize("key_hash_octets", [b"", bytes(15), b"\xff" * 16, b"\0\0\0\3ab\0" + b"\1" * 9])
def test_a_key_hash_that_holds_no_key_gives_none(key_hash_octets: bytes) -> None:
    assert type_support(Exactly16).key_from_key_hash(key_hash_octets) is None


def test_alignment_makes_the_hashes_of_the_representations_differ() -> None:
    @idl.struct(extensibility=idl.FINAL)
    class Mixed:
        a: Annotated[idl.octet, idl.key]
        b: Annotated[idl.int64, idl.key]

    sample = Mixed(1, 2)
    support = type_support(Mixed)
    assert key_hash(sample) == key_hash(sample, XCDR1) == struct.pack(">B7xq", 1, 2)
    assert key_hash(sample, XCDR2) == struct.pack(">B3xq4x", 1, 2)
    for representation in (XCDR1, XCDR2):
        assert support.key_from_key_hash(key_hash(sample, representation), representation) == support.key(sample)


def test_an_unfit_key_is_refused_by_name() -> None:
    with pytest.raises(BadParameter, match="name: 5 is no string"):
        key_hash(Exactly16(5))  # type: ignore[arg-type]


def test_key_payloads_of_keyless_types() -> None:
    support = type_support(Fixed)
    assert support.key_serializer(XCDR1)(Fixed(1, 2)) == b"\0\1\0\0"
    assert support.key_serializer(XCDR2, False)(Fixed(1, 2)) == b"\0\6\0\0"
    assert support.key_from_key_payload(b"\0\1\0\0") == b""
    assert support.key_from_key_hash(bytes(16)) is None
    for read in (support.deserialize_key, support.sample_from_key):
        with pytest.raises(MalformedSample, match="a key, for a type that has none"):
            read(b"\0\1\0\0")


def test_what_is_no_key_has_its_default_in_a_sample_made_from_a_key() -> None:
    @idl.struct
    class Defaults:
        id: Annotated[idl.int32, idl.key]
        inner: Fixed
        text: str = "default"
        maybe: idl.int32 | None = 5
        numbers: idl.sequence[idl.int16] = ()

    sample = type_support(Defaults).sample_from_key(b"\0\0\0\7")
    assert sample == Defaults(7, Fixed(0, 0.0))
    assert type_support(Defaults).sample_from_key(b"\0\0\0\7").inner is not sample.inner


@idl.struct(typename="Part")
class ShortPart:
    a: idl.int32


@idl.struct(typename="Part")
class LongPart:
    a: idl.int32
    b: idl.int32


@idl.struct(typename="Loose", extensibility=idl.MUTABLE)
class ShortLoose:
    a: Annotated[idl.int32, idl.id(1)]


@idl.struct(typename="Loose", extensibility=idl.MUTABLE)
class LongLoose:
    b: Annotated[idl.int32, idl.id(2)]
    a: Annotated[idl.int32, idl.id(1)]


@idl.struct(extensibility=idl.FINAL)
class OfShort:
    part: ShortPart
    parts: Annotated[idl.sequence[ShortPart], idl.array(2)]
    loose: ShortLoose
    key: Annotated[idl.int32, idl.key]


@idl.struct(extensibility=idl.FINAL)
class OfLong:
    part: LongPart
    parts: Annotated[idl.sequence[LongPart], idl.array(2)]
    loose: LongLoose
    key: Annotated[idl.int32, idl.key]


@pytest.mark.parametrize("little_endian", [True, False])
def test_the_key_is_found_behind_what_has_grown(little_endian: bool) -> None:
    """All sizes in a type may be fixed; those in another version of it are others."""
    short = OfShort(ShortPart(1), [ShortPart(2), ShortPart(3)], ShortLoose(4), 5)
    long = OfLong(LongPart(1, 9), [LongPart(2, 9), LongPart(3, 9)], LongLoose(9, 4), 5)
    for sample, reader in ((short, OfLong), (long, OfShort)):
        octets = type_support(sample.__class__).serializer(DataRepresentationId.XCDR2, little_endian)(sample)
        assert type_support(reader).key_from_payload(octets) == b"\0\0\0\5"


def test_the_key_is_found_behind_a_parameter_list_that_has_grown() -> None:
    @idl.struct(extensibility=idl.FINAL)
    class Before:
        loose: ShortLoose
        key: Annotated[idl.int32, idl.key]

    @idl.struct(extensibility=idl.FINAL)
    class After:
        loose: LongLoose
        key: Annotated[idl.int32, idl.key]

    octets = type_support(After).serializer(DataRepresentationId.XCDR1)(After(LongLoose(9, 4), 5))
    assert type_support(Before).key_from_payload(octets) == b"\0\0\0\5"


@pytest.mark.parametrize(("representation", "little_endian"), FORMS)
def test_bits_of_no_field_are_no_part_of_the_key(representation: DataRepresentationId, little_endian: bool) -> None:
    @idl.bitset()
    class Bits:
        low: Annotated[idl.uint8, idl.bits(3)]

    @idl.struct(extensibility=idl.FINAL)
    class Marked:
        bits: Annotated[Bits, idl.key]

    support = type_support(Marked)
    octets = support.serializer(representation, little_endian)(Marked(Bits(5)))
    noisy = octets[:4] + bytes([octets[4] | 0xF8]) + octets[5:]
    assert support.key_from_payload(noisy) == support.key(Marked(Bits(5))) == support.key(support.deserialize(noisy))
