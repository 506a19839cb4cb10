"""Types said in IDL and read again are the same types."""

from __future__ import annotations

import enum
from dataclasses import field
from pathlib import Path
from typing import Annotated, Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import ddsi
from ddsi import BadParameter, idl
from ddsi.xtypes.definition import struct_type
from ddsi.xtypes.model import StructType, reachable_structs
from ddsi.xtypes.resolution import named_type
from ddsi.xtypes.type_object import BuiltTypes, HashedIdentifier, HashIdentifier, TypeObject
from ddsi.xtypes.type_object.identifiers import PrimitiveIdentifier
from ddsi.xtypes.type_object.kinds import COMPLETE, MemberFlag, TypeFlag, TypeKind
from ddsi.xtypes.type_object.objects import MemberObject, StructObject, UnionObject, named
from tests.xtypes.random_types import structs

from .same_types import difference

EVERYTHING = Path(__file__).with_name("everything.idl")


def test_the_text_of_a_type() -> None:
    loaded = idl.load(EVERYTHING)
    assert idl.to_idl(loaded.a.Again) == (
        "module a {\n"
        "  module b {\n"
        "    @final @nested\n"
        "    struct Point {\n"
        "      double x;\n"
        "      double y;\n"
        "    };\n"
        "  };\n"
        "\n"
        "  @final\n"
        "  struct Again {\n"
        "    @key ::a::b::Point p;\n"
        "    ::a::b::Point q;\n"
        "    @default(-5) int32 n;\n"
        "    @optional string s;\n"
        "  };\n"
        "};\n"
    )


@pytest.mark.parametrize("path", ["a.Derived", "a.Node", "a.Words", "a.More", "a.Flags", "a.b.U", "c.V"])
def test_everything_survives(path: str) -> None:
    loaded: Any = idl.load(EVERYTHING)
    text = idl.to_idl(_found(loaded, path))
    again: Any = idl.loads(text)
    assert difference(named_type(_found(loaded, path)), named_type(_found(again, path))) == ""
    assert idl.to_idl(_found(again, path)) == text
    assert again.idl_warnings == ()


def _found(namespace: Any, path: str) -> Any:
    for part in path.split("."):
        namespace = getattr(namespace, part)
    return namespace


@st.composite
def types(draw: st.DrawFn) -> StructType:
    """A random struct whose types have names of their own, some of them in modules."""
    random: type[Any] = draw(structs(2, keyed=draw(st.booleans()))).annotation
    root = struct_type(random)
    modules = st.sampled_from(["", "m::", "m::n::", "string_::", "long::"])
    for number, composite in enumerate(reachable_structs(root)):
        if composite.type_name.startswith("Random"):
            composite.type_name = f"{draw(modules)}Type{number}"
    return root


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
@given(types())
def test_random_types_survive(type_: StructType) -> None:
    """But for the names that arrays inside sequences get."""
    text = idl.to_idl(type_.python_class)
    again = _found(idl.loads(text), type_.type_name.replace("::", "."))
    assert difference(type_, struct_type(again), typedefs=False) == ""


@idl.enum(typename="m::module")
class Words(enum.IntEnum):
    struct = 0
    None_ = 1
    plain_ = 2


@idl.struct(typename="m::Awkward")
class Awkward:
    string: Words
    text: str = 'a"b\\c\n\u20ac\x07' + "8"
    quote: idl.char = "'"
    accent: idl.char = "\xe9"
    wide: idl.wchar = "\u20ac"
    word: Words = Words.None_
    yes: idl.boolean = True
    tiny: idl.float32 = -1e-30
    low: idl.int64 = -(2**63)
    nested: Annotated[idl.sequence[idl.sequence[idl.sequence[idl.int16]]], idl.array(2)] = ((), ())
    rows: idl.sequence[Annotated[bytes, idl.array(4)]] = ()
    by_name: idl.map[str, Annotated[idl.sequence[Words], idl.array(2)]] = field(default_factory=dict)


def test_awkward_names_and_defaults_survive() -> None:
    text = idl.to_idl(Awkward)
    assert "_string" in text
    assert "enum _module" in text
    again = struct_type(idl.loads(text).m.Awkward)
    for mine, theirs in zip(struct_type(Awkward).members[1:9], again.members[1:9], strict=True):
        assert mine.default is not None
        assert theirs.default is not None
        assert mine.default() == theirs.default(), mine.name
    assert [str(member.type) for member in again.members[9:]] == [
        "sequence<sequence<int16>>[2]",
        "sequence<octet[4]>",
        "map<string, m::module[2]>",
    ]


ALIASES = """
module a {
  typedef int32 Num;
  typedef Num Number;
  typedef sequence<Number, 3> Numbers;
  typedef Num Row[4];

  @final
  struct Inner {
    Num x;
  };

  typedef Inner Renamed;
};

module b {
  typedef ::a::Row Line;

  typedef Line Page[2];

  @appendable
  union Either switch (::a::Num) {
    case 1:
      Page page;
  };

  @mutable
  struct Aliased {
    @key ::a::Number number;
    ::a::Numbers numbers;
    ::a::Row rows[2];
    Line lines[5][6];
    map<::a::Num, sequence<Line> > table;
    ::a::Renamed inner;
    Either either;
  };
};
"""


def test_typedefs_survive() -> None:
    type_ = struct_type(idl.loads(ALIASES).b.Aliased)
    text = idl.to_idl(type_.python_class)
    assert difference(type_, struct_type(idl.loads(text).b.Aliased)) == ""
    for line in filter(None, ALIASES.splitlines()):
        assert line in text.splitlines()


RECURSIVE = """
struct Derived;
struct Holder;
struct Base { sequence<Derived> below; sequence<Holder> holders; };
struct Derived : Base { long x; };
struct Holder { Base base; Derived derived[2]; };
struct Node { long x; };
union Leafy;
struct Branch { sequence<Leafy> leaves; @optional Branch next; map<string, Leafy> named; };
union Leafy switch (boolean) { case TRUE: Branch branch; case FALSE: Node leaf; };
"""


@pytest.mark.parametrize("name", ["Base", "Derived", "Holder", "Branch", "Leafy"])
def test_types_that_name_each_other_survive(name: str) -> None:
    """Whichever comes first: a base and what is held by value must be complete, the others are announced."""
    type_ = named_type(getattr(idl.loads(RECURSIVE), name))
    again = idl.loads(idl.to_idl(type_.python_class))
    assert difference(type_, named_type(getattr(again, name))) == ""


def test_an_alias_whose_name_is_taken_is_left_out() -> None:
    @idl.struct(typename="Taken")
    class Taken:
        x: Annotated[idl.int32, idl.typedef("Taken")]
        y: Annotated[idl.int32, idl.typedef("no name")]
        z: Annotated[idl.int32, idl.typedef("Good")]

    assert idl.to_idl(Taken) == (
        "typedef int32 Good;\n\n@appendable\nstruct Taken {\n  int32 x;\n  int32 y;\n  Good z;\n};\n"
    )


def test_what_idl_cannot_name_is_refused() -> None:
    @idl.struct(typename="no name")
    class Unnamed:
        x: idl.int32

    with pytest.raises(BadParameter, match="no name: 'no name' is no name in IDL"):
        idl.to_idl(Unnamed)
    with pytest.raises(BadParameter, match="'Unnamed' is no IDL type"):
        idl.to_idl("Unnamed")  # type: ignore[arg-type]


def test_a_union_of_a_peer_without_cases_is_refused() -> None:
    flags, number = MemberFlag.TRY_CONSTRUCT_1, PrimitiveIdentifier(TypeKind.INT32)
    union, top = HashIdentifier(COMPLETE, bytes(14)), HashIdentifier(COMPLETE, bytes(13) + b"1")
    objects: dict[HashedIdentifier, TypeObject] = {
        top: TypeObject(True, StructObject(TypeFlag.FINAL, None, (MemberObject(0, flags, union, named("u")),), "T")),
        union: TypeObject(True, UnionObject(TypeFlag.FINAL, flags, number, (), "U")),
    }
    type_ = ddsi.dynamic_type(BuiltTypes(top, objects, dict.fromkeys(objects, b"")))
    with pytest.raises(BadParameter, match="U: a union without cases cannot be said in IDL"):
        idl.to_idl(type_)


def test_literals_of_two_enums_beside_each_other_are_refused() -> None:
    class One(enum.IntEnum):
        SAME = 0

    class Other(enum.IntEnum):
        SAME = 0

    @idl.struct
    class Both:
        one: One
        other: Other

    with pytest.raises(BadParameter, match=r"Other\.SAME and One\.SAME have one name in IDL"):
        idl.to_idl(Both)


def test_a_module_named_as_a_type_but_for_case_is_refused() -> None:
    @idl.struct(typename="thing::Inner")
    class Inner:
        x: idl.int32

    @idl.struct
    class Thing:
        inner: Inner

    with pytest.raises(BadParameter, match="Thing and the module thing have one name in IDL"):
        idl.to_idl(Thing)


@pytest.mark.parametrize(
    "text",
    [
        "@autoid(HASH) @mutable struct T { long color; @id(3) long b; @hashid long c; long d; };",
        '@mutable struct T { long color; @hashid("x") long b; @hashid long c; long d; };',
        "@autoid(HASH) union T switch (long) { case 1: long a; case 2: @id(5) long b; };",
    ],
)
def test_how_ids_were_given_survives(text: str) -> None:
    """A complete TypeObject tells it, so the identifier shows whether it is the same."""
    type_ = idl.loads(text).T
    holder: Any = idl.struct(type("Holder", (), {"__annotations__": {"held": type_}}))
    again: Any = idl.loads(idl.to_idl(holder)).Holder
    assert ddsi.type_information(again).encode() == ddsi.type_information(holder).encode()
