"""``serialize`` and ``deserialize`` find again what they found before, and nothing else."""

from __future__ import annotations

from typing import Any

import pytest

from ddsi.structure.errors import BadParameter
from ddsi.structure.qos_policies import DataRepresentationId
from ddsi.xtypes import deserialize, idl, serialize, type_support

XCDR1, XCDR2 = DataRepresentationId.XCDR1, DataRepresentationId.XCDR2


@idl.struct(extensibility=idl.FINAL)
class Base:
    x: idl.int32
    y: idl.float64 = 0.0


@idl.struct(extensibility=idl.FINAL)
class Derived(Base):
    z: idl.int32 = 0


class Undecorated(Base):
    pass


@pytest.mark.parametrize("representation", [None, XCDR1, XCDR2])
@pytest.mark.parametrize("byteorder", ["little", "big"])
def test_a_second_call_gives_what_the_first_gave(representation: DataRepresentationId | None, byteorder: Any) -> None:
    support = type_support(Base)
    chosen = support.representations[0] if representation is None else representation
    expected = support.serializer(chosen, byteorder == "little", padded=False)(Base(1, 2.5))
    for _ in range(2):
        assert serialize(Base(1, 2.5), representation=representation, byteorder=byteorder) == expected
        assert deserialize(Base, expected) == Base(1, 2.5)


def test_mistakes_are_refused_by_a_type_in_use() -> None:
    octets = serialize(Base(1))
    assert serialize(Base(1), representation=XCDR1) == octets
    wrong: Any
    for wrong in (DataRepresentationId.XML, "XCDR1", 7, [], True):
        with pytest.raises(BadParameter, match="XCDR1 or XCDR2"):
            serialize(Base(1), representation=wrong)
    for wrong in ("middle", None, {}):
        with pytest.raises(BadParameter, match="byteorder"):
            serialize(Base(1), byteorder=wrong)
    with pytest.raises(BadParameter, match="not the class Base"):
        serialize(Base)


def test_a_class_does_not_use_the_codec_of_its_base() -> None:
    octets = serialize(Base(1))
    assert deserialize(Base, octets) == Base(1)
    assert len(serialize(Derived(1))) == len(octets) + 4
    assert deserialize(Derived, serialize(Derived(1, 2.0, 3))) == Derived(1, 2.0, 3)
    with pytest.raises(BadParameter, match="Undecorated is no topic type"):
        serialize(Undecorated(1))
    with pytest.raises(BadParameter, match="Undecorated is no topic type"):
        deserialize(Undecorated, octets)
