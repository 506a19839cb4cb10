"""The IDL files that other implementations install, where they are installed, load whole."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from ddsi import idl
from ddsi.xtypes import type_support
from ddsi.xtypes.definition import struct_type
from ddsi.xtypes.idl_compiler.loading import Namespace
from ddsi.xtypes.model import StructType
from ddsi.xtypes.resolution import STRUCT_ATTRIBUTE

INSTALLED = [
    "/usr/include/dds/ddsi/ddsi_xt_typeinfo.idl",
    "/usr/include/dds/ddsi/ddsi_xt_typemap.idl",
    "/usr/include/dds/ddsi/ddsi_xt_typelookup.idl",
    "/usr/include/fastdds/statistics/types.idl",
]
"""Of Debian's cyclonedds-dev and libfastrtps-dev."""


def _types(namespace: Namespace) -> list[type[Any]]:
    found: list[type[Any]] = []
    for name in namespace:
        member = getattr(namespace, name)
        found += _types(member) if isinstance(member, Namespace) else [member] if isinstance(member, type) else []
    return found


@pytest.mark.peers
@pytest.mark.parametrize("path", INSTALLED)
def test_installed_files_load(path: str) -> None:
    if not Path(path).is_file():
        pytest.skip(f"{path} is not installed")
    types = _types(idl.load(path))
    structs = [type_ for type_ in types if isinstance(type_.__dict__.get(STRUCT_ATTRIBUTE), StructType)]
    assert len(structs) >= 10
    for type_ in structs:
        assert type_support(type_).type_name == struct_type(type_).type_name


SHAPE = """
@appendable
struct ShapeType
{
    @key
    string<128> color;
    int32 x;
    int32 y;
    int32 shapesize;
    sequence<uint8> additional_payload_size;
};
"""
"""What the OMG's interoperability suite sends, in words of our own."""


def test_the_shape_of_the_omg_loads() -> None:
    shape = idl.loads(SHAPE).ShapeType
    assert type_support(shape).is_keyed
    assert shape("BLUE", 1, 2, 3, b"").color == "BLUE"
