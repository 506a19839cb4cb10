"""Arrays of numbers, whatever holds the numbers, and sequences of strings: the quick ways give the same octets."""

from __future__ import annotations

import struct
from array import array
from collections import UserList
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt
import pytest

from ddsi.structure.errors import BadParameter, MalformedSample
from ddsi.structure.qos_policies import DataRepresentationId
from ddsi.xtypes import deserialize, idl, serialize
from ddsi.xtypes.careful_reader import read_carefully
from ddsi.xtypes.definition import struct_type

XCDR1, XCDR2 = DataRepresentationId.XCDR1, DataRepresentationId.XCDR2


@idl.struct(extensibility=idl.FINAL)
class Small:
    head: idl.int8
    values: Annotated[idl.sequence[idl.float64], idl.array(3)]
    counts: Annotated[idl.sequence[idl.uint16], idl.array(3)]


@idl.struct(extensibility=idl.FINAL)
class Large:
    head: idl.int8
    values: Annotated[idl.sequence[idl.float64], idl.array(30)]
    counts: Annotated[idl.sequence[idl.uint16], idl.array(40)]


FORMS: list[Any] = [
    list,
    tuple,
    UserList,
    lambda numbers: array("d", numbers),
    lambda numbers: array("H", numbers),
    lambda numbers: array("b", numbers),
    lambda numbers: memoryview(array("q", numbers)),
    lambda numbers: np.array(numbers, dtype="<u2"),
    lambda numbers: np.array(numbers, dtype=">f8"),
]


@pytest.mark.parametrize("class_", [Small, Large])
@pytest.mark.parametrize("byteorder", ["little", "big"])
@pytest.mark.parametrize("form", FORMS)
def test_every_form_of_the_numbers_gives_the_same_octets(class_: Any, byteorder: Any, form: Any) -> None:
    values, counts = ([0, 1, 2], [7, 8, 9]) if class_ is Small else (list(range(30)), list(range(40)))
    order = "<" if byteorder == "little" else ">"
    body = struct.pack(f"{order}b7x{len(values)}d{len(counts)}H", 1, *values, *counts)
    expected = bytes((0, byteorder == "little", 0, 0)) + body
    assert serialize(class_(1, form(values), tuple(counts)), byteorder=byteorder, representation=XCDR1) == expected
    again = deserialize(class_, expected)
    assert (again.values, again.counts) == (array("d", values), array("H", counts))


@pytest.mark.parametrize("class_", [Small, Large])
@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ([1.0, 2.0], "values: 2 elements where the array has"),
        ((1.0,) * 41, "values: 41 elements where the array has"),
        (array("d", [1.0] * 4), "values: 4 elements where the array has"),
        (np.zeros(5), "values: 5 elements where the array has"),
        ({1: 1, 2: 2, 3: 3}, "values: {1: 1, 2: 2, 3: 3} is no sequence of float64"),
        ({1.0, 2.0, 3.0}, "is no sequence of float64"),
        ("123", "values: '123' is a string"),
        (None, "values: None is no sequence of float64"),
    ],
)
def test_what_is_no_such_array_is_named(class_: Any, values: Any, reason: str) -> None:
    counts = [1] * (3 if class_ is Small else 40)
    with pytest.raises(BadParameter, match=reason.replace("{", r"\{")):
        serialize(class_(1, values, counts))


@pytest.mark.parametrize(("class_", "length"), [(Small, 3), (Large, 40)])
@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        (65536, r"counts\[1\]: 65536 does not fit uint16"),
        (-1, r"counts\[1\]: -1 does not fit uint16"),
        (1.5, r"counts\[1\]: 1.5 is no integer"),
        ("1", r"counts\[1\]: '1' is no integer"),
    ],
)
@pytest.mark.parametrize("form", [list, tuple, UserList])
def test_an_element_that_does_not_fit_is_named(class_: Any, length: int, wrong: Any, reason: str, form: Any) -> None:
    values = [0.0] * (3 if class_ is Small else 30)
    with pytest.raises(BadParameter, match=reason):
        serialize(class_(1, values, form([0, wrong, *[0] * (length - 2)])))


@idl.struct(extensibility=idl.FINAL)
class Names:
    head: idl.int8
    names: Annotated[idl.sequence[Annotated[str, idl.bound(5)]], idl.bound(4)]
    pair: Annotated[idl.sequence[str], idl.array(2)]
    tail: idl.int8


@pytest.mark.parametrize("representation", [XCDR1, XCDR2])
@pytest.mark.parametrize("names", [[], [""], ["a", "bc"], ("abcde", "", "\u20ac", "abcd"), ["abc", "xyz"]])
def test_strings_lie_as_the_careful_reader_expects(names: Any, representation: DataRepresentationId) -> None:
    for pair in (["", ""], ["abc", "d"], ["defgh", "abc"]):
        sample = Names(1, names, pair, -1)
        octets = serialize(sample, representation=representation)
        assert read_carefully(struct_type(Names), octets) == Names(1, list(names), pair, -1)
        assert deserialize(Names, octets) == Names(1, list(names), pair, -1)


@pytest.mark.parametrize(
    ("names", "reason"),
    [
        (["a", "abcdef"], r"names\[1\]: a string of 6 octets exceeds its bound of 5"),
        (["a", "b\0"], r"names\[1\]: 'b\\x00' contains a NUL"),
        (["a", None], r"names\[1\]: None is no string"),
        (["a", b"b"], r"names\[1\]: b'b' is no string"),
        ("ab", "names: 'ab' is a string, not a sequence"),
        ({"a": 1}, "is no sequence of string"),
        (["a"] * 5, "names: 5 elements exceed the bound of 4"),
        (["\ud800"], "has no UTF-8 form"),
    ],
)
def test_a_string_that_does_not_fit_is_named(names: Any, reason: str) -> None:
    with pytest.raises(BadParameter, match=reason):
        serialize(Names(1, names, ["", ""], 1))


@idl.struct(extensibility=idl.FINAL)
class Arrays:
    mask: Annotated[npt.NDArray[np.bool_], idl.sequence_of(idl.boolean)]
    matrix: Annotated[npt.NDArray[np.float32], idl.array_of(idl.float32, 2, 3)]
    series: Annotated[npt.NDArray[np.int64], idl.sequence_of(idl.int64)]


@pytest.mark.parametrize("byteorder", ["little", "big"])
@pytest.mark.parametrize("length", [0, 1, 5])
def test_numpy_arrays_are_the_readers_own(byteorder: Any, length: int) -> None:
    sample = Arrays(np.arange(length) % 2 == 0, np.eye(2, 3, dtype=np.float32), np.arange(length))
    octets = serialize(sample, byteorder=byteorder)
    for read in (deserialize(Arrays, octets), read_carefully(struct_type(Arrays), octets)):
        assert read == sample
        for name in ("mask", "matrix", "series"):
            found = getattr(read, name)
            assert found.dtype is getattr(sample, name).dtype
            found[...] = 1  # neither the payload's memory nor another sample's
    assert deserialize(Arrays, octets) == sample


def test_a_boolean_of_two_is_malformed() -> None:
    octets = bytearray(serialize(Arrays(np.array([True, False]), np.zeros((2, 3), np.float32), np.arange(3))))
    octets[9] = 2
    for length in (len(octets), len(octets) - 8):
        with pytest.raises(MalformedSample, match="mask"):
            deserialize(Arrays, bytes(octets[:length]))


@pytest.mark.parametrize("byteorder", ["little", "big"])
def test_numpy_arrays_of_any_memory_give_the_same_octets(byteorder: Any) -> None:
    matrix, series = np.arange(6, dtype=np.float32).reshape(2, 3), np.arange(4)
    expected = serialize(Arrays([True], matrix.tolist(), series.tolist()), byteorder=byteorder)  # type: ignore[arg-type]
    for order in "<>":
        for same in (matrix, matrix.astype(order + "f4"), np.asfortranarray(matrix), matrix.astype("i2")):
            sample = Arrays(np.array([True]), same, np.arange(0, 8, 2)[:4] // 2)
            assert serialize(sample, byteorder=byteorder) == expected
    sliced = Arrays(np.array([True]), np.array([matrix, matrix])[1], np.array([series, series]).T[:, 0])
    assert serialize(sliced, byteorder=byteorder) == expected
    wrong: Any
    for wrong in (matrix.T, series, np.zeros((2, 3, 1), np.float32)):
        with pytest.raises(BadParameter, match="matrix"):
            serialize(Arrays(np.array([True]), wrong, series), byteorder=byteorder)
