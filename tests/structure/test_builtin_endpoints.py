"""The set of builtin endpoints that a stranger announces: any of it is read, and little of it is remembered."""

from __future__ import annotations

import random

from ddsi.structure.builtin_entity_ids import BuiltinEndpoints

KNOWN = int(BuiltinEndpoints.PARTICIPANT_ANNOUNCER | BuiltinEndpoints.TYPE_LOOKUP_REPLY_SECURE_READER)


def test_any_number_is_a_set_and_only_some_are_remembered() -> None:
    numbers = random.Random(1)
    for _ in range(5000):
        number = numbers.getrandbits(64) | KNOWN
        found = BuiltinEndpoints.received(number)
        assert isinstance(found, BuiltinEndpoints)
        assert found == number
        assert found & BuiltinEndpoints.PARTICIPANT_ANNOUNCER
        assert BuiltinEndpoints.TYPE_LOOKUP_REPLY_SECURE_READER in found
        assert repr(found)
    assert len(BuiltinEndpoints._value2member_map_) < 1200


def test_what_is_known_is_the_same_object() -> None:
    assert BuiltinEndpoints.received(1) is BuiltinEndpoints.PARTICIPANT_ANNOUNCER
