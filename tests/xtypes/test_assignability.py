"""The tables of DDS-XTypes 1.3 §7.2.4.4, row by row: which types a reader takes, and what it says of the others."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import pytest

from ddsi.structure.qos_policies import TypeConsistency
from ddsi.xtypes import idl
from ddsi.xtypes.assignability import MOST_COMPARISONS, MissingType, TypeMismatch, type_mismatch
from ddsi.xtypes.definition import struct_type
from ddsi.xtypes.type_object import HashedIdentifier, HashIdentifier, TypeObject, decode_type_object, describe
from ddsi.xtypes.type_object.identifiers import (
    PrimitiveIdentifier,
    SequenceIdentifier,
    StringIdentifier,
    TypeIdentifier,
    UnknownIdentifier,
)
from ddsi.xtypes.type_object.kinds import MINIMAL, MemberFlag, TypeFlag, TypeKind
from ddsi.xtypes.type_object.objects import AliasObject, MemberObject, StructObject, named

DEFAULT = TypeConsistency()
BOUNDS_COUNT = replace(DEFAULT, ignore_sequence_bounds=False, ignore_string_bounds=False)
NAMES_IGNORED = replace(DEFAULT, ignore_member_names=True)
NO_WIDENING = replace(DEFAULT, prevent_type_widening=True)
NO_COERCION = replace(DEFAULT, kind=TypeConsistency.DISALLOW_TYPE_COERCION)


def verdict(
    reader: str, writer: str, policy: TypeConsistency = DEFAULT, *, is_complete: bool = False
) -> TypeMismatch | MissingType | None:
    """Of the types T in two IDL texts."""
    sides = []
    for text in reader, writer:
        namespace: Any = idl.loads(text)
        description = describe(struct_type(namespace.T))
        sides.append(description.complete if is_complete else description.minimal)
    return type_mismatch(sides[0].root, sides[1].root, {**sides[0].objects, **sides[1].objects}, policy)


def members(text: str, extensibility: str = "appendable") -> str:
    return f"@{extensibility} struct T {{ {text} }};"


FITS = [
    # reader, writer
    (members("long a;"), members("long a;")),
    (members("string<5> a;"), members("string a;")),
    (members("sequence<long, 5> a;"), members("sequence<long> a;")),
    # appendable: the longer one may be on either side
    (members("long a;"), members("long a; long b;")),
    (members("long a; long b;"), members("long a;")),
    # mutable: any members, in any order, as long as one is common
    (members("@id(1) long a; @id(2) long b;", "mutable"), members("@id(3) long c; @id(1) long a;", "mutable")),
    (members("@id(1) @optional long a;", "mutable"), members("@id(1) long a;", "mutable")),
    # aliases are transparent
    ("typedef long N; " + members("N a; sequence<N> b;"), members("long a; sequence<long> b;")),
    ("typedef long Row[2]; " + members("Row a;"), members("long a[2];")),
    # bases are as members at the beginning
    ("@appendable struct B { long a; }; @appendable struct T : B { long b; };", members("long a; long b;")),
    # unsigned integers and bitmasks of their size
    ("@bit_bound(8) bitmask M { x }; " + members("M a;"), members("uint8 a;")),
    (members("unsigned long a;"), "bitmask M { x }; " + members("M a;")),
    # nested
    (
        "@appendable struct P { long x; }; " + members("sequence<P> a;"),
        "@appendable struct P { long x; long y; }; " + members("sequence<P> a;"),
    ),
    (
        "@final struct P { string<3> x; }; " + members("sequence<P> a;"),
        "@final struct P { string<4> x; }; " + members("sequence<P> a;"),
    ),
    # recursive
    (
        "struct T; typedef sequence<T> S; @appendable struct T { long a; S b; };",
        "struct T; typedef sequence<T> S; @appendable struct T { long a; S b; long c; };",
    ),
    (members("map<long, string<3>> a;"), members("map<long, string> a;")),
    # unions: labels that both have, with the same names; defaults
    (
        "@appendable union U switch (long) { case 1: long a; case 2: float b; }; " + members("U u;"),
        "@appendable union U switch (long) { case 1: long a; }; " + members("U u;"),
    ),
    (
        "@appendable union U switch (long) { default: long d; }; " + members("U u;"),
        "@appendable union U switch (long) { case 7: long a; default: long d; }; " + members("U u;"),
    ),
    # what is marked as key inside a member that is none is no key
    (
        "@appendable struct P { @key string<3> x; long y; }; " + members("P a; sequence<P> b;"),
        "@appendable struct P { string<4> x; @key long y; @key long z; }; " + members("P a; sequence<P> b;"),
    ),
    (
        "@appendable union U switch (@key long) { case 1: long a; }; " + members("U u;"),
        "@appendable union U switch (long) { case 1: long a; }; " + members("U u;"),
    ),
    ("@appendable enum E { A }; " + members("E e;"), "@appendable enum E { A, B }; " + members("E e;")),
    ("@appendable enum E { A, B }; " + members("@key E e;"), "@appendable enum E { A }; " + members("@key E e;")),
    # To Cyclone DDS 0.10 a uint8 is an octet; and a bitmask travels as one.
    (members("octet a; sequence<uint8> b;"), members("uint8 a; sequence<octet> b;")),
    ("@bit_bound(8) bitmask M { x }; " + members("M m;"), members("octet m;")),
]


@pytest.mark.parametrize("is_complete", [False, True], ids=["minimal", "complete"])
@pytest.mark.parametrize(("reader", "writer"), FITS)
def test_assignable(reader: str, writer: str, is_complete: bool) -> None:
    assert verdict(reader, writer, is_complete=is_complete) is None


ENUM = "@bit_bound({}) enum E {{ {} }}; @appendable struct T {{ E e; }};"
UNION = "@{} union U switch ({}) {{ {} }}; @appendable struct T {{ U u; }};"

DIFFERS = [
    # reader, writer, path, reason; names as complete TypeObjects have them
    (members("long a;"), members("unsigned long a;"), "a", "int32 in the reader's type, uint32 in the writer's"),
    (members("long a;"), members("long long a;"), "a", "int32 in the reader's type, int64 in the writer's"),
    (members("octet a;"), members("int8 a;"), "a", "byte in the reader's type, int8 in the writer's"),
    (members("string a;"), members("wstring a;"), "a", "string in the reader's type, wstring in the writer's"),
    (members("sequence<long> a;"), members("sequence<float> a;"), "a[]", "int32 in the reader's"),
    (members("long a[2][3];"), members("long a[3][2];"), "a", "arrays of 2 x 3 and of 3 x 2 elements"),
    (members("long a[2];"), members("sequence<long, 2> a;"), "a", "an array in the reader's type, a sequence in"),
    (members("map<long, long> a;"), members("map<short, long> a;"), "a[key]", "int32 in the reader's type, int16"),
    (members("map<long, long> a;"), members("map<long, short> a;"), "a[]", "int32 in the reader's type, int16"),
    ("@final struct T { long a; };", members("long a;"), "", "final for the reader, appendable for the writer"),
    (members("long a;", "final"), members("long a; long b;", "final"), "", "final types of 1 and of 2 members"),
    (members("long a;"), members("long b;"), "a", "the writer names it b"),
    (members("@id(1) long a;"), members("@id(2) long a;"), "a", "its member id is 0x1 for the reader, 0x2 for the"),
    (members("@optional long a;"), members("long a;"), "a", "it is optional in one of the types only"),
    (
        members("@id(1) long a; @id(2) long c;", "mutable"),
        members("@id(3) long a; @id(2) long c;", "mutable"),
        "a",
        "its member id is 0x1 for the reader, 0x3 for the writer",
    ),
    (members("@id(1) long a;", "mutable"), members("@id(2) long b;", "mutable"), "", "no member in common"),
    (members("@key long a;"), members("long a;"), "a", "it is part of the key in the reader's type only"),
    (members("long a;"), members("@key long a;"), "a", "it is part of the key in the writer's type only"),
    (members("long a; @key long b;"), members("long a;"), "b", "part of the key, and the writer's type lacks it"),
    (members("long a;"), members("long a; @key long b;"), "b", "part of the key, and the reader's type lacks it"),
    (
        members("@id(1) long a;", "mutable"),
        members("@id(1) long a; @id(2) @must_understand long b;", "mutable"),
        "b",
        "it must be understood, and the reader's type lacks it",
    ),
    (
        members("@key string<5> a;"),
        members("@key string a;"),
        "a",
        "the reader takes 5 at most, the writer may send any",
    ),
    (
        "struct P { @key long x; long y; }; " + members("@key P p;"),
        "struct P { @key long x; @key long y; }; " + members("@key P p;"),
        "p.y",
        "it is part of the key in the writer's type only",
    ),
    (
        "struct P { @key string<5> x; string<5> y; }; " + members("@key P p;"),
        "struct P { @key string<6> x; string<6> y; }; " + members("@key P p;"),
        "p.x",
        "the reader takes 5 at most, the writer may send 6",
    ),
    (
        "@appendable enum E { A }; " + members("@key E e;"),
        "@appendable enum E { A, B }; " + members("@key E e;"),
        "e",
        "it is key, and the reader does not know the literal B",
    ),
    # enums
    (ENUM.format(32, "A, B"), ENUM.format(16, "A, B"), "e", "enums of 32 and of 16 bits"),
    (ENUM.format(32, "A, B"), ENUM.format(32, "A, C"), "e", "the literal 1 is B for the reader, C for the writer"),
    (ENUM.format(32, "A, B"), ENUM.format(32, "A, @value(5) B"), "e", "the literal B has other values in the two"),
    (ENUM.format(32, "A, B"), ENUM.format(32, "A"), "e", "a final enum has other literals in the two types"),
    (
        "@bit_bound(8) bitmask M { x }; " + members("M m;"),
        "@bit_bound(7) bitmask M { x }; " + members("M m;"),
        "m",
        "bitmasks of 8 and of 7 bits",
    ),
    (
        "@bit_bound(8) bitmask M { x }; " + members("M m;"),
        members("int8 m;"),
        "m",
        "a bitmask of 8 bits M in the reader",
    ),
    (
        "bitset B { bitfield<3> a; }; " + members("B b;"),
        "bitset B { bitfield<4> a; }; " + members("B b;"),
        "b",
        "a bitset B",
    ),
    # nested
    (
        "struct P { long x; }; struct L { sequence<P> points; }; " + members("long n; L line;"),
        "struct P { float x; }; struct L { sequence<P> points; }; " + members("long n; L line;"),
        "line.points[].x",
        "int32 in the reader's type, float32 in the writer's",
    ),
    # unions
    (
        UNION.format("appendable", "long", "case 1: long a;"),
        UNION.format("final", "long", "case 1: long a;"),
        "u",
        "append",
    ),
    (
        UNION.format("appendable", "long", "case 1: long a;"),
        UNION.format("appendable", "short", "case 1: long a;"),
        "u.discriminator",
        "int32 in the reader's type, int16 in the writer's",
    ),
    (
        UNION.format("appendable", "long", "case 1: long a;"),
        UNION.format("appendable", "long", "case 1: short a;"),
        "u.a",
        "int32 in the reader's type, int16 in the writer's",
    ),
    (
        UNION.format("appendable", "long", "case 1: long a;"),
        UNION.format("appendable", "long", "case 1: long b;"),
        "u.a",
        "the writer names it b",
    ),
    (
        UNION.format("appendable", "long", "case 1: long a;"),
        UNION.format("appendable", "long", "case 2: long a;"),
        "u",
        "the unions have no label in common",
    ),
    (
        UNION.format("final", "long", "case 1: long a;"),
        UNION.format("final", "long", "case 1: long a; case 3: long b;"),
        "u",
        "the label 3 is in one of the types only",
    ),
    (
        UNION.format("appendable", "long", "case 1: long a; default: short d;"),
        UNION.format("appendable", "long", "case 1: long a; case 2: long b;"),
        "u.d",
        "int16 in the reader's type, int32 in the writer's",
    ),
    (
        UNION.format("appendable", "long", "case 1: long a; default: short d;"),
        UNION.format("appendable", "long", "case 1: long a; default: long d;"),
        "u.d",
        "int16 in the reader's type, int32 in the writer's",
    ),
]


@pytest.mark.parametrize(("reader", "writer", "path", "reason"), DIFFERS)
def test_not_assignable(reader: str, writer: str, path: str, reason: str) -> None:
    found = verdict(reader, writer, is_complete=True)
    assert isinstance(found, TypeMismatch)
    assert found.path == path
    assert reason in found.reason


def test_names_are_those_of_the_side_that_knows_them() -> None:
    """Minimal TypeObjects of peers have hashes for names; that of "a" is 0cc175b9, its MD5's beginning."""
    ours, theirs = (
        describe(struct_type(namespace.T)).minimal for namespace in (_loaded("long a;"), _loaded("float a;"))
    )
    heard = {**ours.objects, theirs.root: decode_type_object(theirs.octets[theirs.root])}
    reason = "in the reader's type"
    assert str(type_mismatch(ours.root, theirs.root, heard)).startswith(f"a: int32 {reason}")
    assert str(type_mismatch(theirs.root, ours.root, heard)).startswith(f"a: float32 {reason}")
    heard[ours.root] = decode_type_object(ours.octets[ours.root])
    assert str(type_mismatch(ours.root, theirs.root, heard)).startswith(f"(name with hash 0cc175b9): int32 {reason}")


def _loaded(text: str) -> Any:
    return idl.loads(members(text))


# --- TypeConsistencyEnforcement --------------------------------------------------------------------------------

POLICIES = [
    # policy, reader, writer, reason of the policy; with the default policy the two fit, or the other way round
    (
        BOUNDS_COUNT,
        members("string<5> a;"),
        members("string<6> a;"),
        "the reader takes 5 at most, the writer may send 6",
    ),
    (BOUNDS_COUNT, members("sequence<long, 5> a;"), members("sequence<long> a;"), "the writer may send any number"),
    (BOUNDS_COUNT, members("map<long, long, 5> a;"), members("map<long, long, 6> a;"), "the writer may send 6"),
    (
        NO_WIDENING,
        members("long a; long b;"),
        members("long a;"),
        "the writer's type lacks it, and the reader prevents",
    ),
    (
        NO_WIDENING,
        UNION.format("appendable", "long", "case 1: long a; case 2: long b;"),
        UNION.format("appendable", "long", "case 1: long a;"),
        "the label 2 is in one of the types only",
    ),
    (NO_COERCION, members("long a; long b;"), members("long a;"), "the reader takes no type but its own"),
]


@pytest.mark.parametrize(("policy", "reader", "writer", "reason"), POLICIES)
def test_policies_that_refuse(policy: TypeConsistency, reader: str, writer: str, reason: str) -> None:
    assert verdict(reader, writer) is None
    found = verdict(reader, writer, policy)
    assert isinstance(found, TypeMismatch)
    assert reason in found.reason
    assert verdict(reader, reader, policy) is None, "equal types fit under every policy"


@pytest.mark.parametrize("policy", [BOUNDS_COUNT, NO_WIDENING])
def test_policies_that_have_nothing_against_it(policy: TypeConsistency) -> None:
    assert verdict(members("string a;"), members("string<6> a;"), policy) is None
    assert verdict(members("sequence<long, 6> a;"), members("sequence<long, 5> a;"), policy) is None
    assert verdict(members("long a; @optional long b;"), members("long a;"), policy) is None
    assert verdict(members("long a;"), members("long a; long b;"), policy) is None


def test_names_may_be_ignored() -> None:
    assert verdict(members("long a;"), members("long b;"), NAMES_IGNORED) is None
    union = UNION.format("appendable", "long", "case 1: long a;")
    assert verdict(union, union.replace(" a;", " b;"), NAMES_IGNORED) is None


# --- what peers may say ------------------------------------------------------------------------------------------

INT32 = PrimitiveIdentifier(TypeKind.INT32)


def numbered(number: int) -> HashIdentifier:
    return HashIdentifier(MINIMAL, number.to_bytes(14, "big"))


def struct_of(*types: TypeIdentifier, base: TypeIdentifier | None = None) -> TypeObject:
    fields = tuple(
        MemberObject(number, MemberFlag.TRY_CONSTRUCT_1, type_, named(f"m{number}"))
        for number, type_ in enumerate(types)
    )
    return TypeObject(False, StructObject(TypeFlag.APPENDABLE, base, fields))


def test_a_type_that_is_not_known_is_asked_for() -> None:
    objects: dict[HashedIdentifier, TypeObject] = {numbered(1): struct_of(INT32, numbered(7))}
    assert type_mismatch(numbered(1), numbered(2), objects) == MissingType(numbered(2))
    objects[numbered(2)] = struct_of(INT32, numbered(8))
    assert type_mismatch(numbered(1), numbered(2), objects) == MissingType(numbered(7))
    assert type_mismatch(numbered(3), numbered(3), {}) is None, "equal hashes are equal types, known or not"


def test_identifiers_of_later_versions_fit_nothing_not_even_themselves() -> None:
    found = type_mismatch(UnknownIdentifier(0xC7), UnknownIdentifier(0xC7), {})
    assert found == TypeMismatch("", "a type of an unknown kind (0xc7)")


def test_aliases_and_bases_without_end_are_refused() -> None:
    loop: dict[HashedIdentifier, TypeObject] = {
        numbered(1): TypeObject(False, AliasObject(numbered(2))),
        numbered(2): TypeObject(False, AliasObject(numbered(1))),
        numbered(3): struct_of(INT32, base=numbered(3)),
        numbered(4): struct_of(INT32),
    }
    assert str(type_mismatch(INT32, numbered(1), loop)) == "its aliases have no end"
    assert "no end of bases" in str(type_mismatch(numbered(4), numbered(3), loop))


def test_types_that_nest_too_deep_are_refused() -> None:
    one: TypeIdentifier = StringIdentifier(1)
    two: TypeIdentifier = StringIdentifier(2)
    for _ in range(100):
        one, two = SequenceIdentifier(one), SequenceIdentifier(two)
    assert "nest deeper than 64" in str(type_mismatch(one, two, {}))


def test_the_work_has_a_bound() -> None:
    """Our recursive type against a peer's thousand, each of a thousand members."""
    count = 1000
    objects: dict[HashedIdentifier, TypeObject] = {numbered(0): struct_of(*[numbered(0)] * 40)}
    for number in range(1, count):
        others = [numbered((number * 31 + index * 17) % (count - 1) + 1) for index in range(count)]
        objects[numbered(number)] = struct_of(*others)
    begin = time.process_time()
    found = type_mismatch(numbered(0), numbered(1), objects)
    assert isinstance(found, TypeMismatch)
    assert f"more than {MOST_COMPARISONS} members" in found.reason or "nest deeper" in found.reason
    assert time.process_time() - begin < 10
