"""The types of ``cyclonedds_vectors.json``, written by hand as a user would write them, by vector name."""

from __future__ import annotations

import enum
from collections.abc import Callable
from typing import Annotated, Any, TypeVar

from ddsi.xtypes import idl

T = TypeVar("T")


def final(name: str) -> Callable[[type[T]], type[T]]:
    return idl.struct(typename=name, extensibility=idl.FINAL)


def appendable(name: str) -> Callable[[type[T]], type[T]]:
    return idl.struct(typename=name, extensibility=idl.APPENDABLE)


def mutable(name: str) -> Callable[[type[T]], type[T]]:
    return idl.struct(typename=name, extensibility=idl.MUTABLE)


@appendable("ShapeType")
class S01:
    color: Annotated[str, idl.key, idl.bound(128)]
    x: idl.int32
    y: idl.int32
    shapesize: idl.int32


@appendable("s02::ShapeType")
class S02:
    color: Annotated[str, idl.key, idl.bound(128)]
    x: idl.int32
    y: idl.int32
    shapesize: idl.int32
    additional_payload_size: idl.sequence[idl.uint8]


@final("s03::Prims")
class S03:
    o: idl.octet
    i64: idl.int64
    b: idl.boolean
    d: idl.float64
    c: idl.char
    i16: idl.int16
    u16: idl.uint16
    i8: idl.int8
    u8: idl.uint8
    i32: idl.int32
    u32: idl.uint32
    u64: idl.uint64
    f: idl.float32


@final("s04::Strings")
class S04:
    a: str
    b: Annotated[str, idl.bound(10)]
    c: str
    d: idl.sequence[str]
    e: Annotated[idl.sequence[Annotated[str, idl.bound(5)]], idl.bound(4)]
    tail: idl.octet


@final("s05::PrimSeq")
class S05:
    a: idl.sequence[idl.octet]
    b: idl.sequence[idl.boolean]
    c: Annotated[idl.sequence[idl.int16], idl.bound(8)]
    d: idl.sequence[idl.int32]
    e: idl.sequence[idl.float64]
    f: idl.sequence[idl.char]
    tail: idl.octet


@final("s06::Pt")
class S06Pt:
    x: idl.int16
    y: idl.octet


@final("s06::Arrays")
class S06:
    a: Annotated[idl.sequence[idl.octet], idl.array(5)]
    b: Annotated[idl.sequence[idl.sequence[idl.int32]], idl.array(2, 3)]
    c: Annotated[idl.sequence[str], idl.array(2)]
    d: Annotated[idl.sequence[S06Pt], idl.array(2)]
    e: Annotated[idl.float64, idl.array(1)]  # the element alone, as DESIGN allows


class S07Color(enum.IntEnum):
    RED = 0
    GREEN = 1
    BLUE = 10


@final("s07::EnumT")
class S07:
    pre: idl.octet
    c: S07Color
    s: idl.sequence[S07Color]
    a: Annotated[idl.sequence[S07Color], idl.array(2)]


@idl.enum(bit_bound=8)
class S08E8(enum.IntEnum):
    A8 = 0
    B8 = 1
    C8 = 2


@idl.enum(bit_bound=16)
class S08E16(enum.IntEnum):
    A16 = 0
    B16 = 1


@final("s08::EnumBB")
class S08:
    a: S08E8
    b: S08E16
    c: S08E8
    d: idl.int32


@idl.bitmask(bit_bound=8)
class S09B8(enum.IntFlag):
    f0 = 1 << 0
    f7 = 1 << 7


@idl.bitmask(bit_bound=16)
class S09B16(enum.IntFlag):
    g0 = 1 << 0
    g1 = 1 << 1
    g15 = 1 << 15


class S09B32(enum.IntFlag):
    h0 = 1 << 0
    h31 = 1 << 31


@idl.bitmask(bit_bound=64)
class S09B64(enum.IntFlag):
    k0 = 1 << 0
    k31 = 1 << 31


@final("s09::Bits")
class S09:
    a: S09B8
    b: S09B16
    c: S09B32
    d: S09B64
    e: idl.sequence[S09B8]


@idl.union(typename="s10::U", extensibility=idl.FINAL)
class S10U:
    discriminator: idl.int32 = idl.switch
    i: idl.int32 = idl.case(1)
    s: str = idl.case(2, 3)
    d: idl.float64 = idl.case(4)
    o: idl.octet = idl.case(default=True)


@final("s10::Holder")
class S10:
    pre: idl.octet
    u: S10U
    post: idl.octet


class S11Kind(enum.IntEnum):
    KA = 0
    KB = 1


@idl.union(typename="s11::UE", extensibility=idl.FINAL)
class S11UE:
    kind: S11Kind = idl.switch
    a: idl.int16 = idl.case(S11Kind.KA)
    b: idl.sequence[idl.int32] = idl.case(S11Kind.KB)


@idl.union(typename="s11::UB", extensibility=idl.FINAL)
class S11UB:
    discriminator: idl.boolean = idl.switch
    t: idl.int64 = idl.case(True)


@idl.union(typename="s11::UC", extensibility=idl.FINAL)
class S11UC:
    discriminator: idl.uint8 = idl.switch
    x: idl.float32 = idl.case(7)
    y: idl.int32 = idl.case(8)


@final("s11::Holder")
class S11:
    e: S11UE
    b: S11UB
    c: S11UC


@idl.union(typename="s12::U")
class S12U:
    discriminator: idl.int16 = idl.switch
    i: idl.int32 = idl.case(1)
    s: str = idl.case(2)


@appendable("s12::Holder")
class S12:
    u: S12U
    us: idl.sequence[S12U]
    z: idl.octet


@final("s13::Opt")
class S13:
    a: idl.octet
    b: idl.int32 | None
    c: idl.float64 | None
    d: str | None
    e: idl.int16


@final("s14::In")
class S14In:
    p: idl.int16
    q: idl.int64


@appendable("s14::Opt")
class S14:
    k: Annotated[idl.int32, idl.key]
    n: S14In | None
    s: Annotated[idl.sequence[idl.int16], idl.optional]
    z: idl.octet | None


@mutable("s15::Mut")
class S15:
    a: idl.octet
    b: idl.int16
    c: idl.int32
    d: idl.int64
    e: str
    f: idl.sequence[idl.octet]
    g: idl.sequence[idl.int16]
    h: idl.sequence[idl.int32]
    i: idl.sequence[idl.float64]
    j: Annotated[idl.sequence[idl.int32], idl.array(3)]
    k: idl.sequence[str]


@mutable("s16::Mut")
class S16:
    k: Annotated[idl.int32, idl.id(10), idl.key]
    a: Annotated[idl.int16, idl.id(5)]
    b: Annotated[str, idl.id(1000), idl.must_understand]
    c: Annotated[idl.octet, idl.id(70000)]


@idl.struct(typename="s17::Mut", extensibility=idl.MUTABLE, autoid="hash")
class S17:
    color: Annotated[idl.int32, idl.key]
    shapesize: idl.int32
    renamed: str
    pinned: Annotated[idl.octet, idl.id(3)]


@mutable("s18::Mut")
class S18:
    a: idl.int32
    b: idl.int32 | None
    c: str | None
    d: idl.sequence[idl.int32] | None


@final("s19::Fin")
class S19Fin:
    x: idl.octet
    y: idl.int32


@appendable("s19::App")
class S19App:
    x: idl.octet
    y: idl.int64


@mutable("s19::Mut")
class S19Mut:
    x: idl.octet
    y: idl.int32


@final("s19::Top")
class S19:
    pre: idl.octet
    f: S19Fin
    a: S19App
    mm: S19Mut
    post: idl.octet


@appendable("s20::App")
class S20App:
    x: idl.int16
    y: str


@mutable("s20::Mut")
class S20Mut:
    x: idl.int16
    y: idl.float64


@mutable("s20::Top")
class S20:
    a: S20App
    mm: S20Mut
    sa: idl.sequence[S20App]
    sm: idl.sequence[S20Mut]
    aa: Annotated[idl.sequence[S20App], idl.array(2)]


@final("s21::Base")
class S21Base:
    id: Annotated[idl.int32, idl.key]
    name: str


@final("s21::Derived")
class S21(S21Base):
    v: idl.float64
    w: idl.octet


@appendable("s22::L1")
class S22L1:
    k: Annotated[str, idl.key]
    a: idl.octet


@appendable("s22::L2")
class S22L2(S22L1):
    b: idl.int64


@appendable("s22::L3")
class S22(S22L2):
    c: idl.sequence[idl.octet]


@mutable("s23::B")
class S23Base:
    k: Annotated[idl.int32, idl.key]
    a: idl.int16


@mutable("s23::D")
class S23(S23Base):
    b: idl.int16
    c: str


@mutable("s24::K")
class S24:
    c: Annotated[idl.int16, idl.id(3), idl.key]
    a: Annotated[idl.int32, idl.id(1), idl.key]
    v: Annotated[idl.int32, idl.id(8)]
    b: Annotated[idl.octet, idl.id(2), idl.key]


@final("s25::K")
class S25:
    a: Annotated[idl.octet, idl.key]
    b: Annotated[idl.int64, idl.key]
    v: idl.float64


@final("s26::K")
class S26:
    name: Annotated[str, idl.key]
    n: Annotated[idl.int16, idl.key]
    v: idl.int32


@appendable("s27::In")
class S27In:
    id: Annotated[idl.int16, idl.key]
    text: str


@appendable("s27::All")
class S27All:
    p: idl.int16
    q: idl.octet


@appendable("s27::Top")
class S27:
    i: Annotated[S27In, idl.key]
    a: Annotated[S27All, idl.key]
    v: idl.int32


class S28E(enum.IntEnum):
    E0 = 0
    E1 = 1
    E2 = 2


@final("s28::K")
class S28:
    e: Annotated[S28E, idl.key]
    b: Annotated[idl.boolean, idl.key]
    c: Annotated[idl.char, idl.key]
    o: Annotated[idl.sequence[idl.octet], idl.array(4), idl.key]
    s: Annotated[idl.int16, idl.key]
    v: str


@final("s29::K")
class S29:
    a: Annotated[str, idl.bound(7), idl.key]
    v: idl.int32


@final("s30::P")
class S30P:
    x: idl.int32


@final("s30::T")
class S30:  # typedefs are transparent in the encoding
    n: idl.int32
    l: Annotated[idl.sequence[idl.int32], idl.bound(3)]  # noqa: E741
    b: Annotated[bytes, idl.array(4)]
    q: S30P


@final("s31::P")
class S31P:
    a: idl.octet
    b: idl.int32


@final("s31::T")
class S31:
    ll: idl.sequence[idl.sequence[idl.int16]]
    lp: idl.sequence[S31P]
    lb: Annotated[idl.sequence[S31P], idl.bound(2)]
    e: idl.octet


@appendable("s32::T")
class S32:
    a: Annotated[str, idl.bound(300), idl.key]
    b: Annotated[idl.sequence[idl.int16], idl.bound(1000)]
    c: Annotated[idl.sequence[idl.octet], idl.array(260)]


@appendable("s33::Node")
class S33:
    id: Annotated[idl.int32, idl.key]
    kids: idl.sequence[S33]


@final("s34::P")
class S34P:
    x: idl.int32


@final("s34::T")
class S34:
    p: Annotated[S34P, idl.external]
    q: Annotated[S34P | None, idl.external]
    s: Annotated[str, idl.external]


@mutable("s35::T")
class S35:
    a: Annotated[idl.int32, idl.must_understand]
    b: Annotated[idl.int32 | None, idl.must_understand]
    c: idl.octet


@idl.enum(typename="a::b::L", default="LB")
class S36L(enum.IntEnum):
    LA = 0
    LB = 1
    LC = 2


@appendable("a::b::c::T")
class S36:
    n: idl.int32 = 5
    l: S36L = S36L.LB  # noqa: E741


@mutable("s37::In")
class S37In:
    b: Annotated[idl.int32, idl.id(9), idl.key]
    a: Annotated[idl.int16, idl.id(4), idl.key]
    x: Annotated[idl.octet, idl.id(1)]


@mutable("s37::T")
class S37:
    pre: Annotated[idl.octet, idl.id(7)]
    i: Annotated[S37In, idl.id(6), idl.key]
    z: Annotated[idl.octet, idl.id(2), idl.key]


TYPES: dict[str, type[Any]] = {
    name.lower(): class_ for name, class_ in list(globals().items()) if len(name) == 3 and name[0] == "S"
}
"""``s01`` to ``s37``, without those that are not supported yet."""
