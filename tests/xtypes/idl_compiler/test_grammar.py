"""What IDL says and what becomes of it: each row a text, a path into it, and the type or value that is there."""

from __future__ import annotations

from typing import Any

import pytest

from ddsi import idl
from ddsi.xtypes.definition import struct_type
from ddsi.xtypes.model import ArrayType, Extensibility, IdlType, Member, SequenceType, StructType, UnionType
from ddsi.xtypes.resolution import named_type

TYPES: dict[str, str] = {
    "boolean": "boolean",
    "octet": "octet",
    "char": "char",
    "wchar": "wchar",
    "int8": "int8",
    "uint8": "uint8",
    "short": "int16",
    "int16": "int16",
    "unsigned short": "uint16",
    "uint16": "uint16",
    "long": "int32",
    "int32": "int32",
    "unsigned long": "uint32",
    "uint32": "uint32",
    "long long": "int64",
    "int64": "int64",
    "unsigned long long": "uint64",
    "uint64": "uint64",
    "float": "float32",
    "double": "float64",
    "string": "string",
    "string<2 + 3>": "string<5>",
    "wstring": "wstring",
    "wstring<7>": "wstring<7>",
    "sequence<long>": "sequence<int32>",
    "sequence<long, 4>": "sequence<int32, 4>",
    "sequence<sequence<string<3>>, (8 >> 1)>": "sequence<sequence<string<3>>, 4>",
    "map<string, long>": "map<string, int32>",
    "map<short, sequence<double>, 9>": "map<int16, sequence<float64>, 9>",
    "Text": "string<9>",
    "Rows": "int16[2][3]",
    "sequence<Rows>": "sequence<int16[2][3]>",
    "::Text": "string<9>",
}


@pytest.mark.parametrize("spelt", TYPES)
def test_types(spelt: str) -> None:
    types = idl.loads(f"typedef string<9> Text; typedef short Rows[2][3]; struct A {{ {spelt} x; }};")
    assert str(member(types.A, "x").type) == TYPES[spelt]


def member(type_: Any, name: str) -> Member:
    found = named_type(type_)
    assert isinstance(found, (StructType, UnionType))
    return next(member for member in found.members if member.name == name)


CONSTANTS: dict[str, Any] = {
    "long N = 1 + 2 * 3": 7,
    "long N = (1 + 2) * 3": 9,
    "long N = -7 / 2": -3,
    "long N = -7 % 3": -1,
    "long N = 7 - 3 - 2": 2,
    "long N = 1 | 6 ^ 3 & 2": 1 | 6 ^ 3 & 2,
    "long N = ~0": -1,
    "long N = 0x1F": 31,
    "long N = 017": 15,
    "long N = 1 << 4 >> 2": 4,
    "uint64 N = 0xFFFFFFFFFFFFFFFF": 2**64 - 1,
    "int64 N = -9223372036854775808": -(2**63),
    "double N = 1": 1.0,
    "double N = 2.5e-1 * 4": 1.0,
    "float N = .5": 0.5,
    "boolean N = TRUE": True,
    "char N = '\\x41'": "A",
    "char N = '\\101'": "A",
    "wchar N = L'\\u20ac'": "\u20ac",
    'string N = "a" "b\\tc"': "ab\tc",
    'wstring N = L"wide"': "wide",
    "unsigned long N = ~0": 0xFFFFFFFF,
    "octet N = (~1 & ~2) >> 1": 0x7E,
    "unsigned long long N = ~~5": 5,
    "octet N = M + inner::M": 5,
    "octet N = ::M": 2,
}


@pytest.mark.parametrize("spelt", CONSTANTS)
def test_constants(spelt: str) -> None:
    found = idl.loads(f"const short M = 2; module inner {{ const short M = 3; }}; const {spelt};").N
    assert found == CONSTANTS[spelt]
    assert type(found) is type(CONSTANTS[spelt])


FLAGS: dict[str, dict[str, Any]] = {
    "@key": {"is_key": True},
    "@key(FALSE)": {"is_key": False},
    "@key(true)": {"is_key": True},
    "@optional": {"is_optional": True},
    "@must_understand": {"must_understand": True},
    "@external": {"is_external": True},
    "@id(7)": {"id": 7},
    "@id(0x10)": {"id": 16},
    '@hashid("color")': {"id": 0x0FA5DD70},
    "@hashid": {"id": 0x01E4D49D},
    "@min(1) @max(5) @range(min=1, max=5)": {"id": 1},
    '@verbatim(language="c++", placement=BEFORE_DECLARATION, text="x")': {"id": 1},
    "@try_construct(USE_DEFAULT)": {"id": 1},
}


@pytest.mark.parametrize("annotations", FLAGS)
def test_annotations_of_members(annotations: str) -> None:
    found = member(idl.loads(f"struct A {{ long before; {annotations} long x; }};").A, "x")
    assert {attribute: getattr(found, attribute) for attribute in FLAGS[annotations]} == FLAGS[annotations]


EXTENSIBILITIES = {
    "": Extensibility.APPENDABLE,
    "@final": Extensibility.FINAL,
    "@appendable": Extensibility.APPENDABLE,
    "@mutable": Extensibility.MUTABLE,
    "@extensibility(FINAL)": Extensibility.FINAL,
    "@extensibility(MUTABLE)": Extensibility.MUTABLE,
}


@pytest.mark.parametrize("annotation", EXTENSIBILITIES)
def test_extensibility(annotation: str) -> None:
    types = idl.loads(f"{annotation} struct A {{ long x; }}; {annotation} union U switch (long) {{ case 1: long x; }};")
    for type_ in types.A, types.U:
        found = named_type(type_)
        assert isinstance(found, (StructType, UnionType))
        assert found.extensibility is EXTENSIBILITIES[annotation]


def test_the_default_extensibility_is_a_choice() -> None:
    types = idl.loads("struct A { long x; }; @mutable struct B { long x; };", default_extensibility=idl.FINAL)
    assert struct_type(types.A).extensibility is Extensibility.FINAL
    assert struct_type(types.B).extensibility is Extensibility.MUTABLE


def test_modules_are_namespaces_and_may_be_opened_again() -> None:
    types = idl.loads(
        "module a { struct P { long x; }; module b { struct P { short x; }; }; };"
        "module a { typedef P Mine; struct Q { P p; b::P q; ::a::b::P r; Mine s; }; };"
    )
    assert [str(found.type) for found in struct_type(types.a.Q).members] == ["a::P", "a::b::P", "a::b::P", "a::P"]
    assert list(types) == ["a"]
    assert list(types.a) == ["P", "b", "Mine", "Q"]
    assert types.a.b.P(3).x == 3
    with pytest.raises(AttributeError, match="the IDL module a has no R; it has P, b, Mine, Q"):
        _ = types.a.R


def test_the_innermost_name_is_meant() -> None:
    types = idl.loads(
        "struct P { long x; }; module a { struct P { short x; }; struct Q { P mine; ::P outer; }; }; struct R { P p; };"
    )
    assert [str(found.type) for found in struct_type(types.a.Q).members] == ["a::P", "P"]
    assert str(struct_type(types.R).members[0].type) == "P"


def test_a_typedef_may_define_its_type() -> None:
    types = idl.loads("typedef @final struct P { long x; } Q, R[2]; typedef enum E { A, B } F; struct T { R r; F f; };")
    assert struct_type(types.P).extensibility is Extensibility.FINAL
    assert [str(found.type) for found in struct_type(types.T).members] == ["P[2]", "E"]


def test_complements_in_labels_are_those_of_the_discriminator() -> None:
    types = idl.loads("union U switch (unsigned short) { case ~0: long x; };")
    assert types.U(x=1).discriminator == 0xFFFF


def test_annotations_may_have_scoped_names_and_named_arguments() -> None:
    types = idl.loads(
        "module m { @annotation Mark { }; };"
        "@::m::Mark @data_representation(allowed_kinds=XCDR2) struct T { @m::Mark @id(value=3) long x; };"
    )
    assert types.idl_warnings == ()
    assert member(types.T, "x").id == 3
    assert struct_type(types.T).representations == (idl.XCDR2,)


def test_a_base_of_another_extensibility_is_warned_of() -> None:
    types = idl.loads("@final struct B { long x; };\n@appendable struct D : B { long y; };")
    (warning,) = types.idl_warnings
    assert str(warning) == "<text>:2:20: D is appendable, and its base final: other compilers refuse that"


def test_a_byte_order_mark_is_no_text() -> None:
    assert list(idl.loads("\ufeffstruct T { long x; };")) == ["T"]


def test_a_default_that_shares_its_case_may_be_one_of_all_labels() -> None:
    types = idl.loads("union U switch (boolean) { case TRUE: long x; case FALSE: default: string y; };")
    assert types.U(y="").discriminator is False


def test_inheritance_continues_the_ids() -> None:
    types = idl.loads("struct A { @key long a; @id(5) long b; }; struct B : A { long c; };")
    assert [(found.name, found.id) for found in struct_type(types.B).members] == [("a", 0), ("b", 5), ("c", 6)]
    assert issubclass(types.B, types.A)
    assert types.B(1, 2, 3).c == 3


def test_annotations_of_modules_hold_inside() -> None:
    types = idl.loads(
        "@autoid(HASH) @default_nested module a { struct A { long color; };"
        "@topic @autoid(SEQUENTIAL) struct B { long x; }; };"
    )
    inner, topic = struct_type(types.a.A), struct_type(types.a.B)
    assert (inner.members[0].id, inner.is_nested) == (0x0FA5DD70, True)
    assert (topic.members[0].id, topic.is_nested) == (0, False)


def test_unions() -> None:
    types = idl.loads(
        "enum E { A, B, C, D };"
        "union U switch (@key E) { case A: case B: @id(9) long x; default: string y; case C: octet z[2]; };"
    )
    union = named_type(types.U)
    assert isinstance(union, UnionType)
    assert union.discriminator.is_key
    described = [(case.name, case.id, [label.name for label in case.labels], case.is_default) for case in union.cases]
    assert described == [("x", 9, ["A", "B"], False), ("y", 10, [], True), ("z", 11, ["C"], False)]
    assert types.U(x=1).discriminator is types.E.A


@pytest.mark.parametrize(
    ("discriminator", "label", "value"),
    [
        ("boolean", "TRUE", True),
        ("char", "'x'", "x"),
        ("octet", "1 + 1", 2),
        ("long long", "-1", -1),
        ("wchar", "L'y'", "y"),
    ],
)
def test_discriminators(discriminator: str, label: str, value: Any) -> None:
    types = idl.loads(f"typedef {discriminator} D; union U switch (D) {{ case {label}: long x; }};")
    assert types.U(x=1).discriminator == value


def test_a_bitmask_may_be_a_discriminator_as_fast_dds_has_it() -> None:
    types = idl.loads(
        "module m { bitmask M { A, @position(3) B }; union U switch (M) { case A: long x; case B: long y; }; };"
    )
    assert types.m.U(y=1).discriminator is types.m.M.B


def test_enums_bitmasks_and_bitsets() -> None:
    types = idl.loads(
        "@bit_bound(16) enum E { A, @value(5) B, @default_literal C }; enum F { X = 3, Y };"
        "@bit_bound(8) bitmask M { P, @position(4) Q }; bitset S { bitfield<4> a; bitfield<3>; bitfield<1> b, c; };"
    )
    assert {literal.name: literal.value for literal in types.E} == {"A": 0, "B": 5, "C": 6}
    assert str(named_type(types.E).default.name) == "C"  # type: ignore[union-attr]
    assert [literal.value for literal in types.F] == [3, 4]
    assert {flag.name: flag.value for flag in types.M} == {"P": 1, "Q": 16}
    assert [(field.name, field.position, field.width) for field in named_type(types.S).fields] == [  # type: ignore[union-attr]
        ("a", 0, 4),
        ("b", 7, 1),
        ("c", 8, 1),
    ]


def test_recursive_types() -> None:
    types = idl.loads(
        "struct Node; typedef sequence<Node> Nodes;"
        "struct Node { long n; Nodes kids; @optional Nodes more; @optional Node next; };"
    )
    found = struct_type(types.Node)
    assert [str(inner.type) for inner in found.members] == ["int32", "sequence<Node>", "sequence<Node>", "Node"]
    assert types.Node(1, [types.Node(2, [], None, None)], None, None).kids[0].n == 2


def test_names_that_python_keeps_get_an_underscore() -> None:
    types = idl.loads(
        "struct class_ { long x; }; struct lambda { long from; long _long; long ___x; }; enum E { None, name };"
    )
    found = struct_type(types.lambda_)
    assert [(inner.name, inner.name_in_idl) for inner in found.members] == [
        ("from_", "from"),
        ("long", "long"),
        ("_x", "__x"),
    ]
    assert types.E.None_ == 0
    assert types.E.name_ == 1
    assert getattr(types, "lambda") is types.lambda_


def test_defaults_are_those_of_the_class() -> None:
    types = idl.loads(
        "enum E { A, B }; const long N = 5;"
        'struct S { @default(N + 1) long a; long b; @default(B) E e; @default("x") string s; @optional long o; };'
        "struct T : S { long c; @default(1.5) double d; };"
    )
    assert types.T(2, None, 3) == types.T(b=2, o=None, c=3, a=6, e=types.E.B, s="x", d=1.5)


def test_legacy_keys() -> None:
    types = idl.loads(
        "module m { struct In { long x; long y; }; struct A { In i; long k; };\n#pragma keylist A k i.y\n};\n"
        'struct B { @Key long z; };\nstruct C { long z; };\n#pragma DCPS_DATA_KEY "C z"\n#pragma DCPS_DATA_TYPE "C"\n'
    )
    assert [inner.is_key for inner in struct_type(types.m.A).members] == [True, True]
    assert [inner.is_key for inner in struct_type(types.m.In).members] == [False, True]
    assert struct_type(types.B).members[0].is_key
    assert struct_type(types.C).members[0].is_key


def test_what_is_no_data_is_left_out_with_a_warning() -> None:
    types = idl.loads(
        "interface I { struct X { long x; } a(); }; local interface J; exception E { long x; }; native N;"
        "valuetype V { public long x; }; @annotation mine { long value default 3; }; struct A { long x; };"
    )
    assert list(types) == ["A"]
    assert [warning.reason.split(" is ")[0] for warning in types.idl_warnings] == [
        "the interface I",
        "the interface J",
        "the exception E",
        "the native N",
        "the valuetype V",
    ]


def test_several_declarators_share_a_type() -> None:
    types = idl.loads("typedef long A, B[2]; struct S { @key A x, y[3]; B z; };")
    found = [(inner.name, str(inner.type), inner.is_key) for inner in struct_type(types.S).members]
    assert found == [("x", "int32", True), ("y", "int32[3]", True), ("z", "int32[2]", False)]


def test_an_array_of_sequences_keeps_them_apart() -> None:
    type_: IdlType = member(idl.loads("struct S { sequence<long> x[2]; };").S, "x").type
    assert isinstance(type_, ArrayType)
    assert isinstance(type_.element, SequenceType)
    assert (type_.dimensions, type_.element.bound) == ((2,), None)


def test_an_annotation_may_stand_before_an_absolute_name() -> None:
    assert member(idl.loads("struct P { long x; }; struct S { @key ::P p; };").S, "p").is_key
