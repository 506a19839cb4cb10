"""Which Python values a member takes, in which form they come back, and how unfit ones are refused by path."""

from __future__ import annotations

import enum
import re
import sys
from array import array
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt
import pytest

from ddsi.structure.errors import BadParameter
from ddsi.structure.qos_policies import DataRepresentationId
from ddsi.xtypes import deserialize, idl, serialize, type_support

BOTH_ORDERS = pytest.mark.parametrize("byteorder", ["little", "big"])


class Color(enum.IntEnum):
    RED = 0
    GREEN = 1


class Flags(enum.IntFlag):
    A = 1
    B = 2


@idl.struct
class Point:
    x: idl.int32 = 0
    y: idl.float32 = 0.0


@idl.struct
class Pose:
    position: Point
    path: idl.sequence[Point]


@idl.struct
class Everything:
    boolean: idl.boolean = False
    octet: idl.octet = 0
    char: idl.char = "a"
    wchar: idl.wchar = "a"
    int8: idl.int8 = 0
    uint64: idl.uint64 = 0
    float32: idl.float32 = 0.0
    float64: idl.float64 = 0.0
    text: str = ""
    short: Annotated[str, idl.bound(3)] = ""
    color: Color = Color.RED
    flags: Flags = Flags(0)
    octets: idl.sequence[idl.octet] = b""
    few: Annotated[idl.sequence[idl.octet], idl.bound(2)] = b""
    numbers: idl.sequence[idl.int32] = ()
    reals: Annotated[idl.sequence[idl.float32], idl.bound(3)] = ()
    booleans: idl.sequence[idl.boolean] = ()
    chars: idl.sequence[idl.char] = ""
    wchars: idl.sequence[idl.wchar] = ""
    colors: idl.sequence[Color] = ()
    masks: idl.sequence[Flags] = ()
    texts: Annotated[idl.sequence[str], idl.bound(2)] = ()
    pose: Pose | None = None
    grid: Annotated[idl.sequence[idl.sequence[idl.int16]], idl.array(2, 2)] = ((0, 0), (0, 0))
    four: Annotated[bytes, idl.array(4)] = b"\0\0\0\0"
    names: Annotated[idl.sequence[str], idl.array(2)] = ("", "")
    flat: Annotated[idl.sequence[idl.boolean], idl.array(2)] = (False, False)
    code: Annotated[str, idl.sequence_of(idl.char), idl.array(2)] = "--"
    board: Annotated[idl.sequence[idl.sequence[idl.wchar]], idl.array(2, 2)] = ("ab", "cd")


def changed(**members: Any) -> Everything:
    return Everything(**members)


def there_and_back(byteorder: Any = "little", **members: Any) -> Any:
    """The value of the one member given, after a round trip in both representations."""
    (name,) = members
    values = []
    for representation in (DataRepresentationId.XCDR1, DataRepresentationId.XCDR2):
        octets = serialize(changed(**members), representation=representation, byteorder=byteorder)
        values.append(getattr(deserialize(Everything, octets), name))
    assert repr(values[0]) == repr(values[1])
    return values[0]


# --- what is taken, and what comes back --------------------------------------------------------------------


@pytest.mark.parametrize(
    "value",
    [
        *(b"\1\2\3", bytearray(b"\1\2\3"), memoryview(b"\1\2\3"), memoryview(b"\1_\2_\3")[::2]),
        *([1, 2, 3], (1, 2, 3), array("B", [1, 2, 3]), array("H", [1, 2, 3])),
        *(np.array([1, 2, 3], np.uint8), np.array([1, 2, 3])),
    ],
    ids=lambda value: type(value).__name__,
)
def test_octets_are_any_buffer_and_come_back_as_bytes(value: Any) -> None:
    assert there_and_back(octets=value) == b"\1\2\3"


@BOTH_ORDERS
@pytest.mark.parametrize(
    "value",
    [[1, -2, 3], (1, -2, 3), array("i", [1, -2, 3]), array("q", [1, -2, 3]), array("h", [1, -2, 3])]
    + [np.array([1, -2, 3], kind) for kind in ("i4", "i8", "i2", ">i4", "<i4")]
    + [memoryview(array("i", [1, -2, 3])), memoryview(array("i", [1, 9, -2, 9, 3]))[::2]]
    + [np.array([1, 9, -2, 9, 3], "i4")[::2], np.array([1, 9, -2, 9, 3], "i8")[::2]],
    ids=lambda value: type(value).__name__ + str(getattr(value, "typecode", getattr(value, "dtype", ""))),
)
def test_numbers_are_any_buffer_or_sequence_and_come_back_as_an_array(value: Any, byteorder: str) -> None:
    assert there_and_back(byteorder, numbers=value) == array("i", [1, -2, 3])


@BOTH_ORDERS
def test_numbers_of_another_kind_are_taken_by_value(byteorder: str) -> None:
    assert there_and_back(byteorder, numbers=b"\1\2") == array("i", [1, 2])
    assert there_and_back(byteorder, reals=np.array([0.5, 1.5])) == array("f", [0.5, 1.5])
    assert there_and_back(byteorder, reals=[1, np.float64(2)]) == array("f", [1, 2])
    assert there_and_back(byteorder, int8=np.int64(-3)) == -3
    assert there_and_back(byteorder, float32=3) == 3.0


@BOTH_ORDERS
def test_characters_and_booleans(byteorder: str) -> None:
    assert there_and_back(byteorder, booleans=[True, False]) == [True, False]
    assert there_and_back(byteorder, booleans=np.array([True, False])) == [True, False]
    assert there_and_back(byteorder, flat=np.array([True, False])) == [True, False]
    assert there_and_back(byteorder, chars=["a", "\xff"]) == "a\xff"
    assert there_and_back(byteorder, chars="ab") == "ab"
    assert there_and_back(byteorder, wchars=["a", "\u20ac"]) == "a\u20ac"
    assert there_and_back(byteorder, code=["x", "y"]) == "xy"
    assert there_and_back(byteorder, code="xy") == "xy"
    assert there_and_back(byteorder, board=[["x", "y"], "z\u20ac"]) == ["xy", "z\u20ac"]
    assert there_and_back(byteorder, char="\xff") == "\xff"
    assert there_and_back(byteorder, wchar="\u20ac") == "\u20ac"
    assert there_and_back(byteorder, boolean=np.bool_(True)) is True


@BOTH_ORDERS
def test_enums_and_bitmasks_come_back_as_their_classes(byteorder: str) -> None:
    assert there_and_back(byteorder, color=1) is Color.GREEN
    assert there_and_back(byteorder, colors=[Color.GREEN, 0]) == [Color.GREEN, Color.RED]
    flags = there_and_back(byteorder, flags=Flags.A | Flags.B)
    assert (flags, type(flags)) == (Flags(3), Flags)
    assert there_and_back(byteorder, masks=[Flags.A, 2]) == [Flags.A, Flags.B]


@BOTH_ORDERS
def test_arrays_of_several_dimensions_are_rows_of_rows(byteorder: str) -> None:
    rows = [array("h", [1, 2]), array("h", [3, 4])]
    assert there_and_back(byteorder, grid=[[1, 2], (3, 4)]) == rows
    assert there_and_back(byteorder, grid=[array("h", [1, 2]), [3, 4]]) == rows
    assert there_and_back(byteorder, grid=np.array([[1, 2], [3, 4]], "i2")) == rows
    assert there_and_back(byteorder, grid=np.array([[1, 2], [3, 4]], "f4").astype("i8").T.copy().T) == rows
    assert there_and_back(byteorder, grid=[1, 2, 3, 4]) == rows
    assert there_and_back(byteorder, four=[1, 2, 3, 4]) == b"\1\2\3\4"


def test_values_do_not_share_memory_with_the_octets_that_they_came_from() -> None:
    octets = bytearray(serialize(changed(octets=bytes(8000), numbers=[7] * 8000)))
    sample = deserialize(Everything, octets)
    octets[:] = b"\xff" * len(octets)
    assert sample.octets == bytes(8000)
    assert sample.numbers == array("i", [7] * 8000)


@BOTH_ORDERS
@pytest.mark.parametrize("representation", [DataRepresentationId.XCDR1, DataRepresentationId.XCDR2])
def test_numpy_where_the_member_says_so(byteorder: Any, representation: DataRepresentationId) -> None:
    @idl.struct
    class Arrays:
        head: idl.int32
        points: Annotated[npt.NDArray[np.float64], idl.sequence_of(idl.float64)]
        matrix: Annotated[npt.NDArray[np.int16], idl.array_of(idl.int16, 2, 3)]
        mask: Annotated[npt.NDArray[np.bool_], idl.sequence_of(idl.boolean)]
        octets: npt.NDArray[np.uint8]

    matrix = np.arange(6, dtype=np.int16).reshape(2, 3)
    sample = Arrays(1, np.linspace(0, 1, 1000), matrix, np.array([True, False]), np.arange(9, dtype=np.uint8))
    again = deserialize(Arrays, serialize(sample, representation=representation, byteorder=byteorder))
    assert again == sample
    assert (again.points.dtype, again.matrix.shape, again.mask.dtype) == (np.dtype("f8"), (2, 3), np.dtype(bool))
    assert again.octets.dtype == np.dtype("u1")
    again.points[0] = 5  # of its own memory
    careful = type_support(Arrays).deserialize(serialize(sample) + b"\0")
    assert careful == sample


def test_unicode_keeps_its_octets() -> None:
    assert there_and_back(text="\u20ac\U0001f600") == "\u20ac\U0001f600"
    with pytest.raises(BadParameter, match="short: a string of 4 octets exceeds its bound of 3"):
        serialize(changed(short="\U0001f600"))


# --- what is refused ---------------------------------------------------------------------------------------

UNFIT: list[tuple[dict[str, Any], str]] = [
    ({"boolean": 2}, "boolean: 2 is no boolean"),
    ({"boolean": "yes"}, "boolean: 'yes' is no boolean"),
    ({"octet": 256}, "octet: 256 does not fit octet (0 to 255)"),
    ({"octet": b"a"}, "octet: b'a' is no integer, as octet needs"),
    ({"char": "ab"}, "char: 'ab' is no char"),
    ({"char": "\u20ac"}, "char: '\u20ac' is no char"),
    ({"wchar": "\U0001f600"}, "is no wchar"),
    ({"int8": -129}, "int8: -129 does not fit int8 (-128 to 127)"),
    ({"int8": 1.0}, "int8: 1.0 is no integer, as int8 needs"),
    ({"int8": None}, "int8: None is no integer"),
    ({"uint64": -1}, "uint64: -1 does not fit uint64 (0 to 18446744073709551615)"),
    ({"float32": 1e300}, "float32: 1e+300 is too large for a float32"),
    ({"float64": "1"}, "float64: '1' is no number"),
    ({"text": b"bytes"}, "text: b'bytes' is no string"),
    ({"text": "a\0b"}, r"text: 'a\x00b' contains a NUL, which ends a string for others; cut it there"),
    ({"text": "a\0b"}, "or make the member an idl.sequence[idl.uint8]"),
    ({"text": "\ud800"}, "has no UTF-8 form"),
    ({"short": "four"}, "short: a string of 4 octets exceeds its bound of 3"),
    ({"color": 7}, "color: 7 is no literal of Color (RED, GREEN)"),
    ({"color": "RED"}, "color: 'RED' is no literal of Color"),
    ({"flags": -1}, "flags: -1 does not fit flags of Flags"),
    ({"flags": "A"}, "flags: 'A' is no integer"),
    ({"octets": "text"}, "octets: 'text' is a string, not a sequence of octet"),
    ({"octets": 5}, "octets: 5 is no sequence of octet"),
    ({"octets": [1, 256]}, "octets[1]: 256 does not fit octet"),
    ({"octets": array("b", [-1])}, "octets[0]: -1 does not fit octet"),
    ({"few": b"abc"}, "few: 3 elements exceed the bound of 2"),
    ({"numbers": [1, 2**31]}, "numbers[1]: 2147483648 does not fit int32"),
    ({"numbers": [1, 2.5]}, "numbers[1]: 2.5 is no integer"),
    ({"numbers": np.array([0.5])}, "numbers[0]: 0.5 is no integer"),
    ({"numbers": np.array([1, 2**31])}, "numbers[1]: 2147483648 does not fit int32"),
    ({"numbers": "12"}, "numbers: '12' is a string"),
    ({"numbers": {1: 2}}, "numbers: {1: 2} is no sequence of int32"),
    ({"numbers": (n for n in (1, 2))}, "is no sequence of int32"),
    ({"numbers": None}, "numbers: None is no sequence of int32"),
    ({"reals": [1e300]}, "reals[0]: 1e+300 is too large for a float32"),
    ({"reals": [0.0] * 4}, "reals: 4 elements exceed the bound of 3"),
    ({"booleans": [True, 3]}, "booleans[1]: 3 is no boolean"),
    ({"chars": ["ab"]}, "chars[0]: 'ab' is no char"),
    ({"wchars": ["a", 5]}, "wchars[1]: 5 is no wchar"),
    ({"colors": [Color.RED, 5]}, "colors[1]: 5 is no literal of Color"),
    ({"masks": [1, 2**32]}, "masks[1]: 4294967296 does not fit flags of Flags"),
    ({"texts": ["a", 5]}, "texts[1]: 5 is no string"),
    ({"texts": "ab"}, "texts: 'ab' is a string, not a sequence of string"),
    ({"texts": ["", "", ""]}, "texts: 3 elements exceed the bound of 2"),
    ({"pose": 5}, "pose: 5 is no Pose"),
    ({"pose": Pose(Point("1"), [])}, "pose.position.x: '1' is no integer, as int32 needs"),  # type: ignore[arg-type]
    ({"pose": Pose(Point(), [Point(), Point(y=1e40)])}, "pose.path[1].y: 1e+40 is too large for a float32"),
    ({"pose": Pose(Point(), [None])}, "pose.path[0]: None is no Point"),  # type: ignore[list-item]
    ({"pose": Pose(None, [])}, "pose.position: None is no Point"),  # type: ignore[arg-type]
    ({"grid": [[1, 2], [3]]}, "grid: 2 elements where the array has 2x2"),
    ({"grid": [[1, 2], [3, 70000]]}, "grid[1][1]: 70000 does not fit int16"),
    ({"grid": np.zeros((4, 1), "i2")}, "grid: 4x1 elements where the array has 2x2"),
    ({"four": b"abc"}, "four: 3 elements where the array has 4"),
    ({"names": ["a"]}, "names: 1 elements where the array has 2"),
    ({"names": "ab"}, "names: 'ab' is a string"),
    ({"texts": {"a": 1}}, "texts: {'a': 1} is no sequence of string"),
    ({"octets": {1, 2}}, "octets: {1, 2} is no sequence of octet"),
    ({"chars": {"a": 1}}, "chars: {'a': 1} is no sequence of char"),
    ({"code": "abc"}, "code: 3 elements where the array has 2"),
    ({"code": {"a": 1, "b": 2}}, "code: {'a': 1, 'b': 2} is no sequence of char"),
    ({"board": [["x", "y"], ["x", "yz"]]}, "board[1][1]: 'yz' is no wchar"),
    ({"flat": [True]}, "flat: 1 elements where the array has 2"),
]


@pytest.mark.parametrize("representation", [DataRepresentationId.XCDR1, DataRepresentationId.XCDR2])
@pytest.mark.parametrize(("members", "reason"), UNFIT, ids=[reason for _, reason in UNFIT])
def test_unfit_values_are_refused_with_their_path(
    members: dict[str, Any], reason: str, representation: DataRepresentationId
) -> None:
    with pytest.raises(BadParameter, match=re.escape(reason)) as refused:
        serialize(changed(**members), representation=representation)
    assert str(refused.value).startswith(next(iter(members)))


def test_a_sample_of_another_class_is_refused() -> None:
    with pytest.raises(BadParameter, match="Point: a Color was given for a Point"):
        type_support(Point).serializer(DataRepresentationId.XCDR1)(Color.RED)  # type: ignore[arg-type]
    with pytest.raises(BadParameter, match="str is no topic type"):
        serialize("text")
    with pytest.raises(BadParameter, match="a sample is asked for, not the class Point"):
        serialize(Point)


def test_a_member_that_was_never_set_is_refused() -> None:
    pose = Pose(Point(), [])
    del pose.position.y
    with pytest.raises(BadParameter, match=r"position\.y: it was never set"):
        serialize(pose)


def test_values_that_hold_themselves_are_refused() -> None:
    @idl.struct
    class Node:
        kids: idl.sequence[Node]

    node = Node([])
    node.kids = [node]
    for representation in (DataRepresentationId.XCDR1, DataRepresentationId.XCDR2):
        with pytest.raises(BadParameter, match="nested deeper than 64"):
            serialize(node, representation=representation)


def test_arguments_of_the_public_functions_are_checked() -> None:
    with pytest.raises(BadParameter, match='byteorder is "little" or "big", not \'middle\''):
        serialize(Point(), byteorder="middle")  # type: ignore[arg-type]
    with pytest.raises(BadParameter, match="XCDR1 or XCDR2"):
        serialize(Point(), representation=DataRepresentationId.XML)
    with pytest.raises(BadParameter, match="data are octets"):
        deserialize(Point, "text")  # type: ignore[arg-type]
    with pytest.raises(BadParameter, match="int is no topic type"):
        deserialize(int, b"")


def test_numpy_is_imported_by_those_only_who_use_it() -> None:
    """A program without numpy arrays does not load numpy (nor fails where it is not installed)."""
    import subprocess

    program = (
        "import sys\n"
        "from ddsi.xtypes import idl, serialize, deserialize\n"
        "@idl.struct\n"
        "class T:\n"
        "    numbers: idl.sequence[idl.int32]\n"
        "assert deserialize(T, serialize(T([1, 2]))) == T([1, 2])\n"
        "assert 'numpy' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60)
