"""The peer's vectors once more, their types compiled from the IDL that the peer had."""

from __future__ import annotations

from typing import Any

import pytest

from ddsi.structure.qos_policies import DataRepresentationId
from ddsi.xtypes import deserialize, idl, serialize
from ddsi.xtypes.definition import struct_type
from tests.xtypes.vector_types import TYPES
from tests.xtypes.vectors import ALL, sample_of

from .same_types import difference


def _compiled(entry: dict[str, Any]) -> type[Any]:
    found: Any = idl.loads(entry["idl"])
    for part in entry["topic_type"].split("::"):
        found = getattr(found, part)
    assert isinstance(found, type)
    return found


by_name = pytest.mark.parametrize("entry", ALL, ids=[entry["name"] for entry in ALL])


@by_name
def test_the_compiled_type_writes_and_reads_the_peers_octets(entry: dict[str, Any]) -> None:
    type_ = _compiled(entry)
    checked = 0
    for sample in entry["samples"]:
        value = sample_of(struct_type(type_), sample["value"])
        for representation in DataRepresentationId.XCDR1, DataRepresentationId.XCDR2:
            expected = sample.get(f"{representation.name.lower()}_le")
            if expected is not None:
                octets = bytes.fromhex(expected)
                assert serialize(value, representation=representation) == octets
                assert deserialize(type_, octets) == value
                checked += 1
    assert checked


@by_name
def test_the_compiled_type_is_the_handwritten_one(entry: dict[str, Any]) -> None:
    """Ids, keys, flags and extensibility agree; nested types may have other names in the handwritten one."""
    compiled, written = struct_type(_compiled(entry)), struct_type(TYPES[entry["name"][:3]])
    assert compiled.type_name == written.type_name
    assert compiled.extensibility is written.extensibility
    for mine, theirs in zip(compiled.members, written.members, strict=True):
        assert (mine.name, mine.id, mine.is_key, mine.is_optional) == (
            theirs.name,
            theirs.id,
            theirs.is_key,
            theirs.is_optional,
        )
        assert (mine.must_understand, mine.is_external) == (theirs.must_understand, theirs.is_external)


@by_name
def test_the_type_survives_being_said_in_idl(entry: dict[str, Any]) -> None:
    type_ = _compiled(entry)
    again = _compiled({**entry, "idl": idl.to_idl(type_)})
    assert difference(struct_type(type_), struct_type(again)) == ""
