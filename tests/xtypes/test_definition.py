"""``idl.struct``: what a class becomes, and which classes are refused, naming member and reason."""

from __future__ import annotations

import enum
import re
import typing
from array import array
from collections.abc import Callable
from dataclasses import InitVar, dataclass, field, fields
from typing import Annotated, Any, ClassVar

import numpy as np
import numpy.typing as npt
import pytest

from ddsi.structure.errors import BadParameter
from ddsi.xtypes import deserialize, idl, model, serialize, type_support
from ddsi.xtypes.definition import struct_type
from ddsi.xtypes.model import FLOAT64, INT16, INT32, OCTET, UINT8, ArrayType, Primitive, SequenceType, String


@idl.struct
class Plain:
    number: idl.int32 = 7
    text: str = "seven"
    SHARED: ClassVar[int] = 3


class Untyped:
    pass


def types_of(class_: type[Any]) -> list[Any]:
    return [member.type for member in struct_type(class_).members]


# --- what a struct is --------------------------------------------------------------------------------------


def test_a_struct_is_a_slotted_dataclass_with_equality_and_repr() -> None:
    assert [field.name for field in fields(Plain)] == ["number", "text"]
    assert not hasattr(Plain(), "__dict__")
    assert Plain() == Plain(7, "seven") != Plain(8)
    assert repr(Plain()) == "Plain(number=7, text='seven')"
    assert Plain.SHARED == 3
    with pytest.raises(TypeError, match="unhashable"):
        hash(Plain())


def test_names_and_extensibility_default_to_the_class_and_to_appendable() -> None:
    assert (struct_type(Plain).type_name, struct_type(Plain).extensibility) == ("Plain", idl.APPENDABLE)

    @idl.struct(typename="a::B", extensibility=idl.FINAL)
    class Other:
        x: idl.int8

    assert (struct_type(Other).type_name, struct_type(Other).extensibility) == ("a::B", idl.FINAL)
    assert type_support(Other).type_name == "a::B"
    assert type_support(Other) is type_support(Other)


def test_equality_sees_elements_not_containers() -> None:
    @idl.struct
    class Held:
        numbers: idl.sequence[idl.int32]
        octets: idl.sequence[idl.octet]
        points: Annotated[npt.NDArray[np.float64], idl.array_of(idl.float64, 2, 2)]

    one = Held([1, 2], [3, 4], np.eye(2))
    other = Held(array("i", [1, 2]), b"\3\4", np.eye(2))
    assert one == other
    assert one != Held([1, 2, 3], [3, 4], np.eye(2))
    assert one != Held([1, 2], [3, 4], np.zeros((2, 2)))
    assert one.__eq__(3) is NotImplemented


def test_an_own_equality_is_kept() -> None:
    @idl.struct
    class Odd:  # noqa: PLW1641
        x: idl.int32

        def __eq__(self, other: object) -> bool:
            return True

    assert Odd(1) == 5


def test_annotations_say_types() -> None:
    @idl.struct
    class All:
        text: Annotated[str, idl.bound(8)]
        flag: bool
        real: float
        octets: bytes
        named: Annotated[bytes, idl.sequence_of(idl.uint8)]
        listed: list[idl.int16]
        bounded: Annotated[idl.sequence[idl.int32], idl.bound(3)]
        rows: Annotated[idl.sequence[idl.sequence[idl.int32]], idl.array(3, 4)]
        by_element: Annotated[idl.int32, idl.array(3, 4)]
        of_sequences: Annotated[list[list[idl.int16]], idl.array(5)]
        bounded_elements: Annotated[Annotated[idl.sequence[idl.int16], idl.bound(2)], idl.array(5)]
        strings: Annotated[Annotated[str, idl.bound(5)], idl.array(2)]
        numpy: npt.NDArray[np.float64]
        numpy_rows: Annotated[npt.NDArray[np.float64], idl.array(3, 4)]
        quoted: idl.sequence["idl.int16"]  # noqa: UP037 - the quotes are what is tested

    by_name = {member.name: member.type for member in struct_type(All).members}
    assert str(by_name.pop("flag")) == "boolean"
    assert by_name == {
        "text": String(8),
        "real": FLOAT64,
        "octets": SequenceType(OCTET),
        "named": SequenceType(UINT8),
        "listed": SequenceType(INT16),
        "bounded": SequenceType(INT32, 3),
        "rows": ArrayType(INT32, (3, 4)),
        "by_element": ArrayType(INT32, (3, 4)),
        "of_sequences": ArrayType(SequenceType(INT16), (5,)),
        "bounded_elements": ArrayType(SequenceType(INT16, 2), (5,)),
        "strings": ArrayType(String(5), (2,)),
        "numpy": SequenceType(FLOAT64, numpy=True),
        "numpy_rows": ArrayType(FLOAT64, (3, 4), numpy=True),
        "quoted": SequenceType(INT16),
    }


def test_member_ids_go_on_from_the_one_before() -> None:
    @idl.struct
    class Base:
        a: idl.int32
        b: Annotated[idl.int32, idl.id(9)]
        c: idl.int32

    @idl.struct
    class Derived(Base):
        d: idl.int32
        e: Annotated[idl.int32, idl.hashid("shapesize")]
        f: Annotated[idl.int32, idl.hashid]

    ids = [member.id for member in struct_type(Derived).members]
    assert ids[:5] == [0, 9, 10, 11, 0x047790DA]
    assert struct_type(Derived).base is struct_type(Base)
    assert Derived(1, 2, 3, 4, 5, 6).a == 1


def test_generics_of_typing_are_those_of_the_language() -> None:
    @idl.struct
    class Old:
        numbers: typing.List[idl.int8]  # noqa: UP006
        names: typing.Dict[str, idl.int8]  # noqa: UP006
        maybe: typing.Optional[typing.Sequence[str]]  # noqa: UP045
        other: typing.Union[idl.int8, None]  # noqa: UP007

    assert [str(type_) for type_ in types_of(Old)] == [
        "sequence<int8>",
        "map<string, int8>",
        "sequence<string>",
        "int8",
    ]
    assert [member.is_optional for member in struct_type(Old).members] == [False, False, True, True]


def test_local_classes_may_name_each_other_and_themselves() -> None:
    @idl.struct
    class Tree:
        leaf: Leaf
        children: idl.sequence[Tree]

    @idl.struct
    class Leaf:
        x: idl.int32

    tree = Tree(Leaf(1), [Tree(Leaf(2), [])])
    assert deserialize(Tree, serialize(tree)) == tree


def test_defaults_come_from_the_dataclass() -> None:
    @idl.struct
    class Defaults:
        numbers: idl.sequence[idl.int32] = field(default_factory=lambda: [1, 2])
        count: idl.int32 = field(default=4, kw_only=True)

    assert Defaults() == Defaults([1, 2], count=4)


def test_post_init_is_called_for_samples_that_are_read() -> None:
    @idl.struct
    class Angle:
        degrees: idl.float64

        def __post_init__(self) -> None:
            self.degrees %= 360

    octets = serialize(Angle(90))
    octets = octets[:4] + np.array([450.0]).tobytes()
    assert deserialize(Angle, octets) == Angle(90)


def test_metadata_of_other_libraries_is_ignored() -> None:
    @idl.struct
    class Documented:
        x: Annotated[idl.int32, "how far", 3]

    assert types_of(Documented) == [INT32]


# --- what is refused ---------------------------------------------------------------------------------------


class Untitled(enum.Enum):
    A = 1


class Large(enum.IntEnum):
    A = 2**31


@dataclass
class Ordinary:
    x: int


MEMBERS: dict[str, tuple[Any, str]] = {
    "int": (int, "does not say its width; use idl.int32"),
    "class": (Untyped, "class Untyped is no IDL type; decorate it with @idl.struct"),
    "object": (object, "object is no IDL type"),
    "map": (dict[str, int], "int does not say its width"),
    "bare map": (dict, "dict does not say of what; use idl.map[key, value]"),
    "map by list": (dict[bytes, idl.int32], "a map's key is a number, a string, a character, a boolean or an enum"),
    "union": (str | float, "a choice of types is an IDL union: a class decorated with @idl.union"),
    "tuple": (tuple[float, ...], "a tuple is no IDL type"),
    "bare list": (list, "does not say of what"),
    "bare list of typing": (typing.List, "List does not say of what; use idl.sequence[...]"),  # noqa: UP006
    "bare map of typing": (typing.Dict, "Dict does not say of what; use idl.map[key, value]"),  # noqa: UP006
    "any": (Any, "Any says no type"),
    "type variable": (typing.TypeVar("T"), "T is a type variable, "),
    "bare sequence": (idl.sequence, "as of a bare idl.sequence; say of what: idl.sequence[...]"),
    "marker in quotes": (Annotated[str, "key"], "'key' is a text, which says nothing here; idl.key is meant"),
    "set": (set[int], "set is no IDL type"),
    "literal": (typing.Literal[1], "Literal is no IDL type"),
    "complex": (complex, "complex is no IDL type"),
    "enum": (Untitled, "IDL enums are enum.IntEnum"),
    "wide enum": (Large, "Large.A: 2147483648 does not fit 32 bits"),
    "bound on int": (Annotated[idl.int32, idl.bound(3)], "idl.bound fits strings, sequences and maps, not int32"),
    "two bounds": (Annotated[str, idl.bound(3), idl.bound(4)], "given twice"),
    "bound uncalled": (Annotated[str, idl.bound], "idl.bound needs its argument"),
    "marker alone": (idl.key, "stands inside Annotated"),
    "optional key": (Annotated[str | None, idl.key], "a key member cannot be optional"),
    "key element": (list[Annotated[str, idl.key]], "idl.key belongs to the member"),
    "numpy of objects": (npt.NDArray[np.object_], "does not say its element"),
    "numpy of strings": (Annotated[npt.NDArray[np.str_], idl.sequence_of(str)], "a numpy array of string"),
    "broken": ("idl.int32[", "its annotation cannot be read"),
}


@pytest.mark.parametrize("name", MEMBERS)
def test_members_that_cannot_be_are_refused_by_name(name: str) -> None:
    annotation, reason = MEMBERS[name]
    class_ = type("Wrong", (), {"__annotations__": {"fine": idl.int32, "odd": annotation}})
    with pytest.raises(BadParameter, match=r"Wrong\.odd: .*" + re.escape(reason)):
        idl.struct(class_)


def test_texts_for_other_readers_of_annotations_are_let_alone() -> None:
    class_ = type("Noted", (), {"__annotations__": {"x": Annotated[idl.int32, "in metres"]}})
    assert types_of(idl.struct(class_)) == [INT32]


def test_decorators_without_options_need_no_parentheses() -> None:
    @idl.enum
    class Color(enum.IntEnum):
        RED = 0

    @idl.bitmask
    class Flags(enum.IntFlag):
        UP = 1

    @idl.bitset
    class Bits:
        low: Annotated[idl.uint8, idl.bits(3)]

    @idl.struct
    class All:
        color: Color
        flags: Flags
        bits: Bits

    assert deserialize(All, serialize(All(Color.RED, Flags.UP, Bits(5)))) == All(Color.RED, Flags.UP, Bits(5))


def test_a_struct_may_be_empty_but_no_element_of_a_sequence() -> None:
    """Else a count of four billion elements would take no octets, and reading them all the time."""
    empty: type[Any] = idl.struct(type("Empty", (), {}))
    holder: type[Any] = idl.struct(type("Holder", (), {"__annotations__": {"e": empty, "n": idl.int32}}))
    assert deserialize(holder, serialize(holder(empty(), 3))) == holder(empty(), 3)
    many: Any = {"es": idl.sequence[empty]}  # type: ignore[valid-type]
    with pytest.raises(BadParameter, match=r"Many\.es: its elements are of Empty, which has no members"):
        idl.struct(type("Many", (), {"__annotations__": many}))
    with pytest.raises(BadParameter, match=r"Choice\.es: its elements are of Empty, which has no members"):
        idl.union(type("Choice", (), {"k": idl.switch, "es": idl.case(1), "__annotations__": {"k": idl.int8, **many}}))


def _same_id() -> None:
    @idl.struct
    class Wrong:
        a: idl.int32
        b: Annotated[idl.int32, idl.id(0)]


def _init_variable() -> None:
    @idl.struct
    class Wrong:
        a: idl.int32
        b: InitVar[int]


def _undecorated_base() -> None:
    @idl.struct
    class Wrong(Ordinary):
        b: idl.int32


def _member_twice() -> None:
    @idl.struct
    class Wrong(Plain):
        number: idl.int32 = 1


def _second_key() -> None:
    @idl.struct
    class Base:
        a: Annotated[idl.int32, idl.key]

    @idl.struct
    class Wrong(Base):
        b: Annotated[idl.int32, idl.key]


def _mutable_default() -> None:
    @idl.struct
    class Wrong:
        a: idl.sequence[idl.int32] = []  # noqa: RUF012


def _unfit_default() -> None:
    @idl.struct
    class Wrong:
        a: idl.int8 = 300


def _order_of_defaults() -> None:
    @idl.struct
    class Wrong:
        a: idl.int8 = 3
        b: idl.int8  # type: ignore[misc]


def _extensibility() -> None:
    @idl.struct(extensibility="final")  # type: ignore[call-overload]
    class Wrong:
        a: idl.int8


def _positional_name() -> None:
    idl.struct("name")  # type: ignore[call-overload]


def _enumeration() -> None:
    @idl.struct
    class Wrong(enum.Enum):
        a: idl.int8 = 1  # type: ignore[misc]


def _own_slots() -> None:
    @idl.struct
    class Wrong:
        __slots__ = ("a",)
        a: idl.int8


def _bit_bound() -> None:
    idl.enum(bit_bound=33)(Large)


def _no_default_literal() -> None:
    idl.enum(default="B")(Large)


@pytest.mark.parametrize(
    ("define", "reason"),
    [
        (_same_id, "Wrong.b: its member id 0x0 is that of a"),
        (_init_variable, "Wrong.b: an InitVar does not travel"),
        (_undecorated_base, "Wrong: its base Ordinary is not decorated"),
        (_member_twice, "Wrong.number: its base has a member of that name"),
        (_second_key, "Wrong.b: the key is that of the base Base"),
        (_mutable_default, "Wrong: mutable default"),
        (_unfit_default, "Wrong: the default of a: 300 does not fit int8 (-128 to 127)"),
        (_order_of_defaults, "Wrong: non-default argument 'b' follows default argument"),
        (_extensibility, "Wrong: extensibility is idl.FINAL"),
        (_enumeration, "Wrong: "),
        (_own_slots, "Wrong: Wrong already specifies __slots__"),
        (_positional_name, "idl.struct decorates a class, not 'name'"),
        (_bit_bound, "Large: bit_bound is a number from 1 to 32, not 33"),
        (_no_default_literal, "Large: the default 'B' is none of its literals"),
    ],
)
def test_classes_that_cannot_be_are_refused(define: Callable[[], None], reason: str) -> None:
    with pytest.raises(BadParameter, match=re.escape(reason)):
        define()


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda: idl.bound(0), "idl.bound takes"),
        (lambda: idl.bound("8"), "idl.bound takes"),  # type: ignore[arg-type]
        (idl.array, "at least one dimension"),
        (lambda: idl.array(3, -1), "dimensions of 1 or more"),
        (lambda: idl.id(1 << 28), "idl.id takes"),
        (idl.key, "without parentheses"),
        (lambda: idl.hashid(3), "idl.hashid takes a name"),  # type: ignore[arg-type]
    ],
)
def test_markers_check_their_arguments(make: Callable[[], Any], reason: str) -> None:
    with pytest.raises(BadParameter, match=re.escape(reason)):
        make()


def test_a_name_that_never_comes_is_refused_at_first_use() -> None:
    @idl.struct
    class Waiting:
        x: NeverDefined  # type: ignore[name-defined]  # noqa: F821

    with pytest.raises(BadParameter, match=r"Waiting: .*NeverDefined"):
        type_support(Waiting)


def test_a_struct_that_holds_itself_by_value_is_refused() -> None:
    with pytest.raises(BadParameter, match=r"Itself\.again: Itself would contain itself without end"):

        @idl.struct
        class Itself:
            again: Annotated[idl.sequence[Itself], idl.array(2)]


def test_structs_that_hold_each_other_by_value_are_refused_at_first_use() -> None:
    @idl.struct
    class Endless:
        inner: Middle

    @idl.struct
    class Middle:
        again: Annotated[idl.sequence[Endless], idl.array(2)]

    with pytest.raises(BadParameter, match=r"Middle\.again: Endless would contain itself without end"):
        type_support(Endless)


def test_a_subclass_that_is_not_decorated_is_no_topic_type() -> None:
    class Derived(Plain):
        pass

    with pytest.raises(BadParameter, match="Derived is no topic type"):
        type_support(Derived)
    with pytest.raises(BadParameter, match="3 is no topic type"):
        type_support(3)  # type: ignore[arg-type]


def test_primitives_have_their_sizes() -> None:
    sizes = {p.name: p.size for p in vars(model).values() if isinstance(p, Primitive)}
    assert len(sizes) == 14
    assert {name: size for name, size in sizes.items() if size * 8 != int(re.sub(r"\D", "", name) or 0)} == {
        "boolean": 1,
        "octet": 1,
        "char": 1,
        "wchar": 2,
    }
