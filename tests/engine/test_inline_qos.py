"""InlineQos: the short form for a lone key hash says what the general one does."""

from __future__ import annotations

import pytest

from ddsi.engine.inline_qos import InlineQos
from ddsi.serialization.parameter_id import ParameterId
from ddsi.serialization.parameter_list import ParameterList

VENDORS_OWN = (0x8123, b"1234")


@pytest.mark.parametrize("octets", [0, 15, 16, 20])
def test_a_lone_key_hash_is_read_as_one_among_others(octets: int) -> None:
    key_hash = bytes(range(octets))
    alone = InlineQos.read(ParameterList([(ParameterId.KEY_HASH, key_hash)]))
    among_others = InlineQos.read(ParameterList([VENDORS_OWN, (ParameterId.KEY_HASH, key_hash)]))
    for name in InlineQos.__slots__:
        assert getattr(alone, name) == getattr(among_others, name)
    assert alone.key_hash == (key_hash[:16] if octets >= 16 else b"")
