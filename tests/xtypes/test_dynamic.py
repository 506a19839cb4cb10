"""Types from TypeObjects: the same type again, whose samples are the same octets."""

from __future__ import annotations

import enum
from typing import Annotated, Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import ddsi
from ddsi import idl
from ddsi.structure.errors import BadParameter
from ddsi.xtypes import type_support
from ddsi.xtypes.model import StructType
from ddsi.xtypes.resolution import named_type
from ddsi.xtypes.type_object import BuiltTypes, decode_type_object
from ddsi.xtypes.type_object.builder import build

from .random_idl import RandomIdl
from .random_types import samples
from .type_object.vectors import VECTORS, compiled

FORMS = [(representation, order) for representation in (ddsi.XCDR1, ddsi.XCDR2) for order in (True, False)]


def received(python_class: type[Any], *, complete: bool = True) -> BuiltTypes:
    """What a peer has of a type: octets, and what they decode to."""
    types = ddsi.type_objects(python_class, complete=complete)
    objects = {identifier: decode_type_object(octets) for identifier, octets in types.octets.items()}
    return BuiltTypes(types.root, objects, types.octets)


def rebuilt(python_class: type[Any], *, complete: bool = True) -> BuiltTypes:
    """The TypeObjects that follow from the class itself, not those that it was made of."""
    struct = named_type(python_class)
    assert isinstance(struct, StructType)
    return build(struct, is_complete=complete)


def assert_same_samples(sample: Any, dynamic: type[Any]) -> None:
    """Octets that one class makes of its sample, the other makes of what it reads in them; keys are the same."""
    ours, theirs = type_support(type(sample)), type_support(dynamic)
    assert (ours.is_keyed, ours.representations) == (theirs.is_keyed, theirs.representations)
    for representation, little_endian in FORMS:
        octets = ours.serializer(representation, little_endian)(sample)
        found = theirs.deserialize(octets)
        assert theirs.serializer(representation, little_endian)(found) == octets
        assert ours.deserialize(theirs.serializer(representation, little_endian)(found)) == sample
        assert theirs.key(found) == ours.key(sample)


# --- the same type -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("vector", VECTORS, ids=[vector["name"] for vector in VECTORS])
def test_every_vector_becomes_the_same_type_again(vector: dict[str, Any]) -> None:
    """A class made of a peer's complete TypeObjects has both its identifiers, and its IDL."""
    original = compiled(vector)
    dynamic = ddsi.dynamic_type(received(original))
    for kind in (True, False):
        assert rebuilt(dynamic, complete=kind).octets == ddsi.type_objects(original, complete=kind).octets
    if vector["name"] != "s36_modules":  # TypeObjects do not tell of @default
        assert idl.to_idl(dynamic) == idl.to_idl(original)


@settings(max_examples=60, report_multiple_bugs=False)
@given(samples(keyed=True))
def test_random_types_become_the_same_type_again(sample: Any) -> None:
    dynamic = ddsi.dynamic_type(received(type(sample)))
    assert rebuilt(dynamic).root == ddsi.type_objects(type(sample)).root
    assert rebuilt(dynamic, complete=False).root == ddsi.type_objects(type(sample), complete=False).root
    assert_same_samples(sample, dynamic)


@settings(max_examples=30, report_multiple_bugs=False)
@given(samples())
def test_minimal_type_objects_are_enough_for_samples(sample: Any) -> None:
    assert_same_samples(sample, ddsi.dynamic_type(received(type(sample), complete=False)))


@settings(max_examples=40)
@given(st.integers(0, 10**9), st.booleans())
def test_types_of_random_idl_become_the_same_type_again(seed: int, keys: bool) -> None:
    top: Any = idl.loads(RandomIdl(seed, keys=keys, enums=True).text()).m.Top
    dynamic = ddsi.dynamic_type(received(top))
    for kind in (True, False):
        assert rebuilt(dynamic, complete=kind).octets == ddsi.type_objects(top, complete=kind).octets
    assert idl.to_idl(dynamic) == idl.to_idl(top)


EVERYTHING = """
module m {
  enum Colour { @value(-1) from, @value(3) RED, @default_literal GREEN };
  @bit_bound(9) bitmask Flags { low, @position(8) None };
  bitset Fields { bitfield<3, uint8> a; bitfield<4>; bitfield<5, int8> b; };
  typedef sequence<Colour, 300> Colours;
  typedef Colours Table[2][3];
  typedef map<string<4>, Table, 7> Atlas;
  @final @nested struct Base { @key long id; @optional double weight; };
  struct Node;
  @mutable struct Link { @hashid("to") sequence<Node> nodes; @id(77) @must_understand long cost; };
  @appendable struct Node { @external @optional Link link; string name; };
  union Choice switch (@key Colour) { case RED: Node node; case from: wstring<5> class; default: octet raw[3]; };
  typedef long Row[2];
  @final struct Noted {
    @unit("m/s") @range(min=-1.5, max=9.0) double speed; @try_construct(TRIM) string<3> tag; @max(4) Row rows[3];
    @try_construct(USE_DEFAULT) @min(1) sequence<short, 2> few;
  };
  @appendable @autoid(HASH) struct Top : Base {
    Noted noted; Atlas atlas; Choice choice; Flags flags; Fields fields; Node tree;
  };
};
"""


def test_every_kind_of_type_together() -> None:
    top: Any = idl.loads(EVERYTHING).m.Top
    dynamic = ddsi.dynamic_type(received(top))
    assert rebuilt(dynamic).octets == ddsi.type_objects(top).octets
    assert rebuilt(dynamic, complete=False).octets == ddsi.type_objects(top, complete=False).octets
    assert idl.to_idl(dynamic) == idl.to_idl(top)
    assert ddsi.type_information(dynamic) == ddsi.type_information(top)


def test_samples_are_like_those_of_any_other_class() -> None:
    m: Any = idl.loads(EVERYTHING).m
    dynamic = ddsi.dynamic_type(ddsi.type_objects(m.Node))
    assert repr(dynamic(None, "a")) == "Node(link=None, name='a')"
    assert dynamic(None, "a") == dynamic(link=None, name="a")
    assert not hasattr(dynamic(None, "a"), "__dict__")
    with pytest.raises(ddsi.BadParameter, match="name: 5 is no string"):
        ddsi.serialize(dynamic(None, 5))
    assert ddsi.deserialize(dynamic, ddsi.serialize(m.Node(None, "b"))) == dynamic(None, "b")


def test_limits_and_what_becomes_of_unfit_values_are_known() -> None:
    m: Any = idl.loads(EVERYTHING).m
    dynamic = ddsi.dynamic_type(received(m.Noted))
    with pytest.raises(ddsi.BadParameter, match=r"speed: .* is beyond its range"):
        ddsi.serialize(dynamic(10.0, "", [[0, 0]] * 3, [1]))

    @idl.struct(typename="m::Noted", extensibility=idl.FINAL)
    class Loose:
        speed: idl.float64
        tag: str
        rows: Annotated[idl.sequence[idl.sequence[idl.int32]], idl.array(3, 2)]
        few: idl.sequence[idl.int16]

    octets = ddsi.serialize(Loose(1.0, "abcdef", [[0, 0]] * 3, [1, 2, 3]))
    assert ddsi.deserialize(dynamic, octets) == dynamic(1.0, "abc", [[0, 0]] * 3, [])


def test_optional_members_may_be_left_out_where_nothing_follows_them() -> None:
    @idl.struct
    class Late:
        first: Annotated[idl.int32, idl.optional]
        second: idl.int32
        third: idl.int32 | None = None

    dynamic = ddsi.dynamic_type(ddsi.type_objects(Late))
    assert dynamic(None, 2) == dynamic(first=None, second=2, third=None)
    with pytest.raises(TypeError):
        dynamic(1)


def test_bases_are_bases() -> None:
    m: Any = idl.loads(EVERYTHING).m
    dynamic = ddsi.dynamic_type(ddsi.type_objects(m.Top))
    assert [base.__name__ for base in dynamic.__mro__] == ["Top", "Base", "object"]
    assert dynamic.__match_args__[:2] == ("id", "weight")


# --- names ---------------------------------------------------------------------------------------------------


def test_names_that_python_cannot_have_are_changed_and_remembered() -> None:
    @idl.struct(typename="odd::1 class")
    class Odd:
        a: Annotated[idl.int32, idl.name("from")]
        b: Annotated[idl.int32, idl.name("__init__")]
        c: Annotated[idl.int32, idl.name("größe")]
        d: Annotated[idl.int32, idl.name("gr__e")]
        e: Annotated[idl.int32, idl.name("x = 1; import os")]
        f: Annotated[idl.int32, idl.name("9")]

    dynamic = ddsi.dynamic_type(received(Odd))
    assert dynamic.__match_args__ == ("from_", "_init__", "gr__e", "gr__e_member_3", "x___1__import_os", "_9")
    assert dynamic.__name__ == "_1_class"
    assert type_support(dynamic).type_name == "odd::1 class"
    assert rebuilt(dynamic).octets == ddsi.type_objects(Odd).octets
    assert_same_samples(Odd(1, 2, 3, 4, 5, 6), dynamic)


def test_literals_that_pythons_enums_keep_for_themselves_are_changed() -> None:
    @idl.enum(typename="E")
    class Names(enum.IntEnum):
        mro_ = 1
        None_ = 2
        plain = 3

    @idl.struct
    class Holder:
        e: Names

    dynamic = ddsi.dynamic_type(received(Holder))
    assert list(type(dynamic_zero(dynamic).e).__members__) == ["mro_", "None_", "plain"]
    assert rebuilt(dynamic).octets == ddsi.type_objects(Holder).octets
    assert "enum E {\n  @value(1) mro,\n  None,\n  plain\n};" in idl.to_idl(dynamic)


def dynamic_zero(dynamic: type[Any]) -> Any:
    return type_support(dynamic).deserialize(b"\0\1\0\0\1\0\0\0")


def test_a_union_has_a_name_for_each_member_beside_its_discriminator() -> None:
    @idl.union
    class U:
        kind: idl.uint32 = idl.switch
        a: Annotated[idl.int32, idl.name("discriminator")] = idl.case(1)
        b: Annotated[idl.int32, idl.name("_idl_value")] = idl.case(0xFFFFFFFF)

    @idl.struct
    class S:
        u: U

    dynamic = ddsi.dynamic_type(received(S))
    found = type_support(dynamic).deserialize(ddsi.serialize(S(U(b=5))))
    assert repr(found) == "S(u=U(_idl_value_=5))"
    assert found.u.discriminator == 0xFFFFFFFF
    assert rebuilt(dynamic).octets == ddsi.type_objects(S).octets


def test_minimal_types_are_called_after_their_hashes_and_ids() -> None:
    m: Any = idl.loads(EVERYTHING).m
    types = received(m.Node, complete=False)
    dynamic = ddsi.dynamic_type(types, type_name="m::Node")
    assert dynamic.__match_args__ == ("member_0", "member_1")
    assert type_support(dynamic).type_name == "m::Node"
    text = idl.to_idl(dynamic)
    assert "struct Type_" in text
    assert "@id(77) @must_understand int32 member_77;" in text


# --- what is announced ---------------------------------------------------------------------------------------


def test_the_type_is_announced_as_its_author_did() -> None:
    """Also where we would have set other flags, and so have another hash: here an enum without any, as Fast DDS."""

    @idl.struct
    class Plain:
        x: idl.int32

    types = ddsi.type_objects(Plain)
    information = ddsi.type_information(idl.loads("@final struct Other { double d; };").Other)
    dynamic = ddsi.dynamic_type(types, information=information)
    assert ddsi.type_information(dynamic) is information
    assert ddsi.type_objects(dynamic) is types


def test_a_derived_class_is_described_by_itself() -> None:
    @idl.struct
    class Plain:
        x: idl.int32

    dynamic: Any = ddsi.dynamic_type(ddsi.type_objects(Plain))

    @idl.struct
    class Derived(dynamic):  # type: ignore[misc]
        y: idl.int32

    assert ddsi.type_objects(Derived).root != ddsi.type_objects(dynamic).root


def test_what_is_no_topic_type_has_no_type_objects() -> None:
    with pytest.raises(BadParameter, match="int does not say its width"):
        ddsi.type_objects(int)
