"""Aliases: no part of the type itself, but a member remembers by which it was said."""

from __future__ import annotations

from typing import Annotated, Any, TypeAlias

import pytest

from ddsi.structure.errors import BadParameter
from ddsi.xtypes import idl
from ddsi.xtypes.definition import struct_type
from ddsi.xtypes.model import INT32, ArrayType, SequenceType, Typedefs

Num: TypeAlias = Annotated[idl.int32, idl.typedef("m::Num")]
Nums: TypeAlias = Annotated[idl.sequence[Num], idl.bound(3), idl.typedef("m::Nums")]
Row: TypeAlias = Annotated[idl.sequence[Num], idl.array(4), idl.typedef("m::Row")]


@idl.struct
class Aliased:
    plain: idl.int32
    number: Annotated[Num, idl.typedef("m::Number"), idl.key]
    numbers: Nums
    perhaps: Nums | None
    rows: Annotated[idl.sequence[Row], idl.array(2)]
    table: idl.map[Num, Nums]


NUM = Typedefs(("m::Num",))
NUMS = Typedefs(("m::Nums",), (NUM,))


def test_members_have_the_types_behind_the_aliases_and_remember_these() -> None:
    found = {member.name: (member.type, member.typedefs) for member in struct_type(Aliased).members}
    assert found["plain"] == (INT32, None)
    assert found["number"] == (INT32, Typedefs(("m::Num", "m::Number")))
    assert found["numbers"] == found["perhaps"] == (SequenceType(INT32, 3), NUMS)
    assert found["rows"] == (ArrayType(INT32, (2, 4)), Typedefs(parts=(Typedefs(("m::Row",), (NUM,)),), rows=1))
    assert found["table"][1] == Typedefs(parts=(NUM, NUMS))


IDL = """
module m {
    typedef long Num; typedef Num Number; typedef sequence<Num, 3> Nums; typedef Num Row[4];
    struct Inner { Num x; }; typedef Inner Renamed;
    struct Aliased {
        long plain; @key Number number; Nums numbers; @optional Nums perhaps; Row rows[2]; map<Num, Nums> table;
        Renamed inner;
    };
};
"""


def test_typedefs_in_idl_are_remembered_too() -> None:
    compiled: Any = idl.loads(IDL).m
    members = {member.name: member for member in struct_type(compiled.Aliased).members}
    for written in struct_type(Aliased).members:
        assert (members[written.name].type, members[written.name].typedefs) == (written.type, written.typedefs)
    assert members["inner"].typedefs == Typedefs(("m::Renamed",))
    assert compiled.Renamed is compiled.Inner, "the alias of a class is a class"


def test_an_alias_has_a_name() -> None:
    with pytest.raises(BadParameter, match=r"idl\.typedef takes the alias's name in IDL, not ''"):
        idl.typedef("")
