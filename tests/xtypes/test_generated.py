"""The generated code as such: readable, generated once, bounded in size and depth whatever the type."""

from __future__ import annotations

import linecache
import traceback
from typing import Annotated, Any

import pytest

from ddsi.structure.errors import BadParameter
from ddsi.structure.qos_policies import DataRepresentationId
from ddsi.xtypes import deserialize, idl, serialize, type_support
from ddsi.xtypes.definition import struct_type
from ddsi.xtypes.layout import Encoding
from ddsi.xtypes.read_source import generate_reader
from ddsi.xtypes.write_source import generate_writer

XCDR1, XCDR2 = DataRepresentationId.XCDR1, DataRepresentationId.XCDR2


@idl.struct
class Shape:
    color: Annotated[str, idl.key, idl.bound(128)]
    x: idl.int32
    y: idl.int32
    shapesize: idl.int32


@idl.struct(extensibility=idl.FINAL)
class Vector:
    x: idl.float64
    y: idl.float64
    z: idl.float64


@idl.struct(extensibility=idl.FINAL)
class Pose:
    position: Vector
    velocity: Vector
    id: idl.uint64


def source_of_writer(class_: type[Any], representation: DataRepresentationId = XCDR1) -> str:
    return generate_writer(struct_type(class_), Encoding(representation, little_endian=True))[1]


def source_of_reader(class_: type[Any], representation: DataRepresentationId = XCDR1) -> str:
    return generate_reader(struct_type(class_), Encoding(representation, little_endian=True))[1]


def test_a_struct_of_fixed_size_is_one_pack_and_one_unpack() -> None:
    assert 'pack_0 = Struct("<4sddddddQ").pack' in source_of_writer(Pose)
    assert "pack_1" not in source_of_writer(Pose)
    assert 'unpack_0 = Struct("<ddddddQ").unpack_from' in source_of_reader(Pose)
    assert "unpack_1" not in source_of_reader(Pose)


def test_a_mutable_struct_of_fixed_size_is_one_pack_as_well() -> None:
    @idl.struct(extensibility=idl.MUTABLE)
    class Mutable:
        a: idl.int32
        b: idl.float64

    for representation in (XCDR1, XCDR2):
        assert "pack_1" not in source_of_writer(Mutable, representation)


def test_the_source_is_there_to_be_read() -> None:
    support = type_support(Shape)
    support.deserialize(support.serializer(XCDR1)(Shape("a", 1, 2, 3)))
    assert '"""write Shape, XCDR1 little endian"""' in support.source
    assert '"""read Shape, XCDR1 little endian"""' in support.source
    assert "pack_1(v.x, v.y, v.shapesize)" in support.source


def test_tracebacks_show_the_generated_lines() -> None:
    write, _ = generate_writer(struct_type(Shape), Encoding(XCDR1, little_endian=True))
    with pytest.raises(TypeError) as refused:
        write(Shape(1, 2, 3, 4))  # type: ignore[arg-type]
    assert "s0 = encode(v.color)" in "".join(traceback.format_exception(refused.value))
    assert any("write Shape" in name for name in linecache.cache)


def test_codecs_are_generated_once() -> None:
    support = type_support(Shape)
    assert support.serializer(XCDR2) is support.serializer(XCDR2, True)
    assert support.serializer(XCDR2) is not support.serializer(XCDR2, False)
    support.key_hash(support.key(Shape("a", 1, 2, 3)), XCDR1)
    before = support.source
    support.key_hash(support.key(Shape("b", 1, 2, 3)), XCDR1)
    assert support.source == before


def nested(levels: int, fields: int, wrap: Any) -> tuple[type[Any], Any]:
    """A chain of structs, each with ``fields`` members of the next; and a value of it."""
    class_: Any = idl.struct(type("Level0", (), {"__annotations__": {"x": idl.int16}}))
    value = class_(7)
    for level in range(1, levels):
        annotations = {f"m{number}": wrap(class_) for number in range(fields)}
        class_ = idl.struct(type(f"Level{level}", (), {"__annotations__": annotations}))
        value = class_(*([[value] if wrap is sequence_of else value] * fields))
    return class_, value


def itself(class_: Any) -> Any:
    return class_


def optional(class_: Any) -> Any:
    return class_ | None


def sequence_of(class_: Any) -> Any:
    return idl.sequence[class_]


@pytest.mark.parametrize("wrap", [itself, optional, sequence_of])
@pytest.mark.parametrize("representation", [XCDR1, XCDR2])
def test_deep_types_stay_within_pythons_blocks(wrap: Any, representation: DataRepresentationId) -> None:
    class_, value = nested(30, 1, wrap)
    assert deserialize(class_, serialize(value, representation=representation)) == value


@pytest.mark.parametrize("representation", [XCDR1, XCDR2])
def test_types_that_multiply_do_not_multiply_their_source(representation: DataRepresentationId) -> None:
    class_, value = nested(12, 2, itself)  # 2,048 leaves
    assert deserialize(class_, serialize(value, representation=representation)) == value
    assert len(source_of_writer(class_, representation)) < 100_000
    assert len(source_of_reader(class_, representation)) < 100_000


def test_codecs_of_types_that_multiply_endlessly_are_made_in_time() -> None:
    """40 levels of two: no value of it could ever be made, its codecs can."""
    class_: Any = Vector
    for level in range(40):
        annotations = {"a": class_, "b": class_, "c": idl.sequence[class_]}
        class_ = idl.struct(type(f"Level{level}", (), {"__annotations__": annotations}))
    for representation in (XCDR1, XCDR2):
        assert len(source_of_writer(class_, representation)) < 200_000
        assert len(source_of_reader(class_, representation)) < 200_000
    assert not type_support(class_).is_keyed


def test_members_may_be_named_like_anything_in_the_generated_code() -> None:
    @idl.struct
    class Names:
        v: idl.int32
        d: str
        parts: idl.sequence[idl.int32]
        new: str
        Struct: idl.sequence[str]
        len: idl.int32
        bytes: bytes
        _private: idl.int32 = 3

    sample = Names(1, "d", [2], "new", ["s"], 4, b"5")
    assert deserialize(Names, serialize(sample)) == sample


def test_a_representation_that_is_none_is_refused() -> None:
    with pytest.raises(BadParameter, match="XCDR1 or XCDR2"):
        type_support(Shape).serializer(DataRepresentationId.XML)
