"""TypeObjects that are no type, or far too much of one: refused by name and reason, and before they cost anything."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import ddsi
from ddsi.structure.errors import BadParameter, MalformedMessage
from ddsi.xtypes import type_support
from ddsi.xtypes.dynamic_graph import DEEPEST_TYPE, MOST_MEMBERS_OF_ONE, MOST_TYPES
from ddsi.xtypes.model import Limits
from ddsi.xtypes.type_object import BuiltTypes, HashIdentifier, TypeIdentifier, TypeObject, decode_type_object
from ddsi.xtypes.type_object.identifiers import (
    ArrayIdentifier,
    MapIdentifier,
    PrimitiveIdentifier,
    SequenceIdentifier,
    StringIdentifier,
    UnknownIdentifier,
)
from ddsi.xtypes.type_object.kinds import COMPLETE, MemberFlag, TypeFlag, TypeKind
from ddsi.xtypes.type_object.objects import (
    AliasObject,
    ArrayObject,
    BitfieldObject,
    BitflagObject,
    BitmaskObject,
    BitsetObject,
    CaseObject,
    EnumObject,
    LiteralObject,
    MapObject,
    MemberObject,
    SequenceObject,
    StructObject,
    TypeBody,
    UnionObject,
    named,
)

from .random_types import samples

INT32 = PrimitiveIdentifier(TypeKind.INT32)
FINAL = TypeFlag.FINAL
PLAIN = MemberFlag.TRY_CONSTRUCT_1


def hash_of(number: int) -> HashIdentifier:
    return HashIdentifier(COMPLETE, number.to_bytes(14, "big"))


def types_of(*bodies: TypeBody) -> BuiltTypes:
    """Type 0 is the root; ``hash_of(n)`` names the n-th."""
    objects: Any = {hash_of(number): TypeObject(True, body) for number, body in enumerate(bodies)}
    return BuiltTypes(hash_of(0), objects, dict.fromkeys(objects, b""))


def struct(
    *members: TypeIdentifier | MemberObject, base: TypeIdentifier | None = None, name: str = "S"
) -> StructObject:
    """Members m0, m1 and so on with these types."""
    return StructObject(
        FINAL,
        base,
        tuple(
            member if isinstance(member, MemberObject) else MemberObject(number, PLAIN, member, named(f"m{number}"))
            for number, member in enumerate(members)
        ),
        name,
    )


def member(id_: int, name: str, type_: TypeIdentifier = INT32, flags: MemberFlag = PLAIN) -> MemberObject:
    return MemberObject(id_, flags, type_, named(name))


def case(number: int, *labels: int, type_: TypeIdentifier = INT32, flags: MemberFlag = PLAIN) -> CaseObject:
    return CaseObject(number, flags, type_, labels, named(f"c{number}"))


def union(discriminator: TypeIdentifier, *cases: CaseObject) -> UnionObject:
    return UnionObject(FINAL, PLAIN, discriminator, cases, "U")


def enumeration(*values: int, bits: int = 32) -> EnumObject:
    return EnumObject(
        FINAL, bits, tuple(LiteralObject(value, MemberFlag(0), named(f"L{value}")) for value in values), "E"
    )


def holding(body: TypeBody) -> list[TypeBody]:
    return [struct(hash_of(1)), body]


ALONE: TypeIdentifier = hash_of(0)

INCONSISTENT: dict[str, tuple[Sequence[TypeBody], str]] = {
    "missing": ([struct(hash_of(9))], "the TypeObject of <complete 0+09> is missing"),
    "one id twice": ([struct(member(1, "a"), member(1, "b"))], "type S cannot be used: S.b: its member id 0x1 is that"),
    "one name twice": ([struct(member(1, "a"), member(2, "a"))], "type S cannot be used: it has two members a"),
    "an id too large": ([struct(member(1 << 28, "a"))], "type S cannot be used: idl.id takes a number from 0"),
    "an optional key": (
        [struct(member(1, "a", flags=MemberFlag.KEY | MemberFlag.OPTIONAL))],
        "S.a: a key member cannot be optional",
    ),
    "two extensibilities": ([StructObject(FINAL | TypeFlag.MUTABLE, None, (), "S")], "two kinds of extensibility"),
    "itself": ([struct(ALONE)], "type S cannot be used: it would contain itself without end"),
    "itself in an array": ([struct(ArrayIdentifier(ALONE, (2,)))], "it would contain itself without end"),
    "each other": ([struct(hash_of(1)), struct(ALONE, name="T")], "it would contain itself without end"),
    "its own base": ([struct(base=ALONE)], "type S cannot be used: it is its own base"),
    "a base of the base": ([struct(base=hash_of(1)), struct(base=ALONE)], "it is its own base"),
    "a base that is no struct": ([struct(base=hash_of(1)), enumeration(1)], "type S cannot be used: its base is no"),
    "a base that is a number": ([struct(base=INT32)], "its base is no struct"),
    "a base with the same member": ([struct(member(3, "a"), base=hash_of(1)), struct(member(3, "b"))],
                                    "S.a: its member id 0x3"),
    "aliases without end": (holding(AliasObject(hash_of(1), "A")), "aliases follow one another without end"),
    "a sequence of itself": (
        holding(AliasObject(SequenceIdentifier(hash_of(1)), "A")),
        "type S cannot be used: m0: sequences, arrays and maps nest deeper than 12",
    ),
    "no type": ([struct(PrimitiveIdentifier(TypeKind.NONE))], "m0: it has no type"),
    "long double": ([struct(PrimitiveIdentifier(TypeKind.FLOAT128))], "m0: long double is not supported"),
    "unknown": ([struct(UnknownIdentifier(0xC7))], "m0: its type is of a kind that this release does not know"),
    "an array of nothing": ([struct(ArrayIdentifier(INT32, (3, 0)))], "m0: an array without elements"),
    "an array without dimensions": ([struct(ArrayIdentifier(INT32, ()))], "m0: an array without elements"),
    "a map by lists": ([struct(MapIdentifier(SequenceIdentifier(INT32), INT32))], "m0: the key of a map is a number"),
    "a map by structs": ([struct(MapIdentifier(hash_of(1), INT32)), struct(INT32)], "m0: the key of a map is"),
    "a union by floats": (
        holding(union(PrimitiveIdentifier(TypeKind.FLOAT32), case(1, 1))),
        "float32 cannot be a discriminator",
    ),
    "a union by strings": (holding(union(StringIdentifier(), case(1, 1))), "cannot be a discriminator"),
    "a union by structs": ([struct(hash_of(1)), union(hash_of(2), case(1, 1)), struct(INT32)], "cannot be a discrim"),
    "one label twice": (holding(union(INT32, case(1, 5), case(2, 5))), "U.c2: the label 5 is also that of c1"),
    "a case without a label": (holding(union(INT32, case(1))), "type U cannot be used: c1 has no label"),
    "two default cases": (
        holding(union(INT32, case(1, flags=MemberFlag.DEFAULT), case(2, flags=MemberFlag.DEFAULT))),
        "one default case",
    ),
    "a label that is no boolean": (
        holding(union(PrimitiveIdentifier(TypeKind.BOOLEAN), case(1, 2))),
        "the label 2 is no boolean",
    ),
    "a label that is no character": (
        holding(union(PrimitiveIdentifier(TypeKind.CHAR8), case(1, -2))),
        "the label -2 is no character",
    ),
    "a label that is no literal": ([struct(hash_of(1)), union(hash_of(2), case(1, 7)), enumeration(1)], "7 is no lit"),
    "a label out of range": (holding(union(PrimitiveIdentifier(TypeKind.INT8), case(1, 300))), "300 is no int8"),
    "one value twice": (holding(enumeration(4, 4)), "type E cannot be used: two literals have the value 4"),
    "an enum of no bits": (holding(enumeration(4, bits=0)), "bit_bound is a number from 1 to 32"),
    "an enum that does not fit": (holding(enumeration(300, bits=8)), "300 does not fit 8 bits"),
    "a flag too high": (
        holding(BitmaskObject(FINAL, 32, (BitflagObject(60000, named("f")),), "B")),
        "a flag is at bit 60000; a bitmask has 64",
    ),
    "a flag beyond its bound": (holding(BitmaskObject(FINAL, 8, (BitflagObject(9, named("f")),), "B")), "bit 9 is not"),
    "one bit twice": (
        holding(BitmaskObject(FINAL, 8, (BitflagObject(1, named("f")), BitflagObject(1, named("g"))), "B")),
        "two flags are at bit 1",
    ),
    "bits that overlap": (
        holding(BitsetObject((BitfieldObject(0, 4, TypeKind.UINT8, named("a")),
                              BitfieldObject(3, 4, TypeKind.UINT8, named("b"))), "B")),
        "B.b: its bits are also those of a",
    ),
    "bits of a float": (holding(BitsetObject((BitfieldObject(0, 4, TypeKind.FLOAT32, named("a")),), "B")), "a boolean"),
    "bits of a struct": (
        holding(BitsetObject((BitfieldObject(0, 4, TypeKind.STRUCTURE, named("a")),), "B")),
        "a bit field is of the kind STRUCTURE",
    ),
    "more bits than there are": (
        holding(BitsetObject((BitfieldObject(65535, 255, TypeKind.UINT64, named("a")),), "B")),
        "a bitset has bits 0 to 63",
    ),
    "a sequence of structs without members": ([struct(SequenceIdentifier(hash_of(1))), struct(name="T")], "no members"),
    "a collection alone": ([SequenceObject(INT32, 4)], "is an alias or a collection"),
}  # fmt: skip


@pytest.mark.parametrize("what", INCONSISTENT)
def test_what_is_no_type_is_refused_by_name_and_reason(what: str) -> None:
    bodies, reason = INCONSISTENT[what]
    with pytest.raises(BadParameter, match=reason):
        ddsi.dynamic_type(types_of(*bodies))


def doubled(count: int, make: Callable[[TypeIdentifier], TypeBody]) -> list[TypeBody]:
    return [*(make(hash_of(number + 1)) for number in range(count)), struct(INT32)]


EXCESSIVE: dict[str, tuple[Sequence[TypeBody], str]] = {
    "structs of two structs": (doubled(40, lambda inner: struct(inner, inner)), "a sample would have"),
    "of none in the end": (
        [*(struct(hash_of(n + 1), hash_of(n + 1)) for n in range(40)), struct(name="Empty")],
        "a sample would have",
    ),
    "unions of structs of two": (
        [
            struct(hash_of(1), hash_of(1)),
            *(
                body
                for n in range(1, 61, 2)
                for body in (union(INT32, case(1, 0, type_=hash_of(n + 1))), struct(hash_of(n + 2), hash_of(n + 2)))
            ),
            struct(INT32),
        ],
        "a sample would have",
    ),
    "arrays of arrays": (
        doubled(8, lambda inner: struct(ArrayIdentifier(inner, (1000,)))),
        "a sample would have 10 members and more than a thousand million values",
    ),
    "one array": ([struct(ArrayIdentifier(INT32, (0xFFFFFFFF,)))], "more than a thousand million values"),
    "deep": ([*(struct(hash_of(n + 1)) for n in range(DEEPEST_TYPE)), struct(INT32)], "nest deeper than 64"),
    "deep by optional members": (
        [*(struct(member(1, "a", hash_of(n + 1), MemberFlag.OPTIONAL)) for n in range(400)), struct(INT32)],
        "nest deeper than 64",
    ),
    "deep by aliases": ([struct(hash_of(1)), *(AliasObject(hash_of(n + 1), f"A{n}") for n in range(1, 300)),
                         struct(INT32)], "nest deeper than 64"),
    "maps of maps": (
        [struct(hash_of(1)), *(AliasObject(MapIdentifier(hash_of(n + 1), hash_of(n + 1)), "A") for n in range(1, 60)),
         struct(INT32)],
        "the key of a map|nest deeper than 12",
    ),
    "heirs": ([*(struct(base=hash_of(n + 1), name=f"S{n}") for n in range(20)),
               struct(*[INT32] * MOST_MEMBERS_OF_ONE)], "members together; 16384 are possible"),
    "many members": ([struct(*[INT32] * 5000)], "it has 5000 members; 2048 are possible"),
    "many literals": (holding(enumeration(*range(20_000))), "members together; 16384"),
    "many types": ([struct(*map(hash_of, range(1, 700))), *[struct(INT32)] * 700], "needs 700 types cannot be used"),
    "deep collections": (
        [struct(SequenceIdentifier(SequenceIdentifier(hash_of(1)))),
         *(AliasObject(SequenceIdentifier(SequenceIdentifier(hash_of(n + 1))), f"A{n}") for n in range(1, 8)),
         AliasObject(INT32, "A")],
        "nest deeper than 12",
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", EXCESSIVE)
def test_what_would_cost_too_much_is_refused_before_it_does(what: str) -> None:
    """Were it not, none of these would end within the test's time, or within the machine's memory."""
    bodies, reason = EXCESSIVE[what]
    with pytest.raises(BadParameter, match=reason):
        ddsi.dynamic_type(types_of(*bodies))


def layers() -> list[TypeBody]:
    """As many types as are possible, each naming all of the next layer: 2^40 ways from the first to the last."""
    width, depth = 8, 60
    bodies: list[TypeBody] = [struct(*(SequenceIdentifier(hash_of(1 + n)) for n in range(width)))]
    for layer in range(depth):
        following = 1 + (layer + 1) * width
        inner = [SequenceIdentifier(hash_of(following + n)) for n in range(width)] if layer < depth - 1 else [INT32]
        bodies += [struct(*inner, name=f"S{layer}_{n}") for n in range(width)]
    return bodies


def test_the_largest_types_are_usable() -> None:
    bodies = layers()
    assert len(bodies) < MOST_TYPES
    dynamic = ddsi.dynamic_type(types_of(*bodies))
    sample = dynamic(*[[]] * 8)
    assert ddsi.deserialize(dynamic, ddsi.serialize(sample)) == sample
    with pytest.raises(ddsi.MalformedSample):
        ddsi.deserialize(dynamic, b"\0\1\0\0")


def test_a_struct_with_as_many_members_as_are_possible_is_usable() -> None:
    dynamic = ddsi.dynamic_type(types_of(struct(*[INT32] * MOST_MEMBERS_OF_ONE)))
    sample = dynamic(*range(MOST_MEMBERS_OF_ONE))
    assert ddsi.deserialize(dynamic, ddsi.serialize(sample)) == sample


# --- what is strange, but a type -----------------------------------------------------------------------------


def test_names_may_be_anything() -> None:
    """Names that would be code, were they believed; none of them runs, and all differ."""
    names = [
        "__class__",
        "__slots__",
        "__idl_struct__",
        "self",
        "x; import os",
        "\N{KELVIN SIGN}",
        "K",
        "_",
        "",
        "1",
        "*",
    ]
    members = [member(number, name) for number, name in enumerate(names)]
    dynamic = ddsi.dynamic_type(types_of(struct(*members, name="a::(lambda: 1)()")))
    attributes = dynamic.__match_args__
    assert len(set(attributes)) == len(names)
    assert all(attribute.isascii() and attribute.isidentifier() for attribute in attributes)
    sample = dynamic(*range(len(names)))
    assert ddsi.deserialize(dynamic, ddsi.serialize(sample)) == sample
    assert type_support(dynamic).type_name == "a::(lambda: 1)()"


def test_literals_may_have_any_names() -> None:
    names = ["name", "value", "mro", "_sunder_", "__dunder__", "_E__private", "_", "9", "a b", "a_b", "None"]
    literals = tuple(LiteralObject(number, MemberFlag(0), named(name)) for number, name in enumerate(names))
    flags = tuple(BitflagObject(number, named(name)) for number, name in enumerate(names))
    dynamic = ddsi.dynamic_type(
        types_of(
            struct(hash_of(1), hash_of(2)), EnumObject(FINAL, 32, literals, "E"), BitmaskObject(FINAL, 16, flags, "B")
        )
    )
    found = type_support(dynamic).deserialize(b"\0\1\0\0\5\0\0\0\xff\0")
    assert len(type(found.m0).__members__) == len(names)
    assert len(type(found.m1).__members__) == len(names)
    assert (int(found.m0), int(found.m1)) == (5, 0xFF)


@pytest.mark.parametrize("limits", [Limits(float("nan")), Limits(0, float("inf")), Limits(2, 1), Limits(0, 9)], ids=str)
@pytest.mark.parametrize(
    "type_",
    [
        *(INT32, StringIdentifier(), SequenceIdentifier(hash_of(1)), hash_of(1)),
        *(SequenceIdentifier(ArrayIdentifier(INT32, (2,))), ArrayIdentifier(SequenceIdentifier(INT32), (1,))),
    ],
    ids=repr,
)
def test_limits_that_make_no_sense_are_left_out(limits: Limits, type_: TypeIdentifier) -> None:
    annotated = MemberObject(1, PLAIN, type_, named("a"), limits=limits)
    dynamic = ddsi.dynamic_type(types_of(struct(annotated), enumeration(0, 1)))
    value: Any = type_support(dynamic).deserialize(b"\0\1\0\0\0\0\0\0")
    assert len(ddsi.serialize(value)) > 4


def test_an_enum_without_literals_is_a_number() -> None:
    """Dust DDS leaves the literals out."""
    dynamic = ddsi.dynamic_type(types_of(struct(hash_of(1), SequenceIdentifier(hash_of(2))), enumeration(bits=8),
                                         enumeration(bits=32)))  # fmt: skip
    sample = dynamic(-3, [1, 1 << 30])
    assert ddsi.serialize(sample).hex() == "00010000fd000000" + "02000000" + "01000000" + "00000040"


def test_a_bitmask_without_flags_is_a_number() -> None:
    masks = [BitmaskObject(FINAL, bits, (), "M") for bits in (3, 16, 17, 64)]
    dynamic: Any = ddsi.dynamic_type(types_of(struct(*map(hash_of, (1, 2, 3, 4))), *masks))
    octets = ddsi.serialize(dynamic(0xFF, 2, 3, 1 << 63), representation=ddsi.XCDR2)
    assert octets.hex() == "00070000" + "ff00" + "0200" + "03000000" + "0000000000000080"
    assert ddsi.deserialize(dynamic, octets) == dynamic(0xFF, 2, 3, 1 << 63)


def test_collections_may_have_type_objects() -> None:
    dynamic: Any = ddsi.dynamic_type(
        types_of(struct(*map(hash_of, (1, 2, 3))), SequenceObject(INT32, 2), ArrayObject(INT32, (2, 2)),
                 MapObject(StringIdentifier(), hash_of(1), 0))
    )  # fmt: skip
    sample = dynamic([1], [[1, 2], [3, 4]], {"a": [5, 6]})
    assert ddsi.deserialize(dynamic, ddsi.serialize(sample)) == sample
    with pytest.raises(BadParameter, match="m0: 3 elements exceed the bound of 2"):
        ddsi.serialize(dynamic([1, 2, 3], [[1, 2], [3, 4]], {}))


def test_the_topics_type_may_be_an_alias() -> None:
    dynamic = ddsi.dynamic_type(types_of(AliasObject(hash_of(1), "A"), struct(INT32)), type_name="Other")
    assert type_support(dynamic).type_name == "Other"


@settings(max_examples=60)
@given(samples(), st.data())
def test_damaged_type_objects_are_refused_or_another_type(sample: Any, data: st.DataObject) -> None:
    """Nothing but MalformedMessage, BadParameter, or a class that works."""
    types = ddsi.type_objects(type(sample))
    objects: Any = {}
    for identifier, octets in types.octets.items():
        changed = bytearray(octets)
        for _ in range(data.draw(st.integers(0, 2))):
            changed[data.draw(st.integers(0, len(changed) - 1))] = data.draw(st.integers(0, 255))
        try:
            objects[identifier] = decode_type_object(bytes(changed))
        except MalformedMessage:
            return
    try:
        dynamic = ddsi.dynamic_type(BuiltTypes(types.root, objects, types.octets))
    except BadParameter:
        return
    with pytest.raises(ddsi.MalformedSample):
        ddsi.deserialize(dynamic, b"\0\1\0\0"[: data.draw(st.integers(0, 3))])
