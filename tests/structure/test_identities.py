"""Guids are octets; sets of numbers are bitmaps."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.structure.builtin_entity_ids import SEDP_PUBLICATIONS_WRITER, SPDP_READER
from ddsi.structure.guid import EntityId, EntityKind, Guid, GuidPrefix
from ddsi.structure.locator import Locator
from ddsi.structure.sequence_number import MAX_SET_BITS, NumberSet


def test_a_slice_of_a_datagram_finds_a_guid_in_a_dict() -> None:
    guid = Guid.of(GuidPrefix(bytes(range(12))), SPDP_READER)
    datagram = b"xx" + guid + b"yy"
    assert {guid: "found"}[datagram[2:18]] == "found"  # type: ignore[index]
    assert guid.prefix == bytes(range(12))
    assert guid.entity_id == SPDP_READER
    assert guid.participant.entity_id == EntityId.PARTICIPANT


def test_octets_of_another_length_are_no_guid() -> None:
    with pytest.raises(ValueError, match="16 octets, not 15"):
        Guid(bytes(15))


def test_the_kind_octet_tells_writer_from_reader_keyed_from_keyless_builtin_from_user() -> None:
    writer = EntityId.user(1, EntityKind.WRITER_WITH_KEY)
    assert writer == bytes.fromhex("00000102")
    assert writer.is_writer
    assert writer.is_keyed
    assert not writer.is_builtin
    assert SEDP_PUBLICATIONS_WRITER.is_builtin
    assert SPDP_READER.is_reader
    assert not EntityId.user(1, EntityKind.READER_NO_KEY).is_keyed


def test_the_bitmap_begins_with_its_most_significant_bit() -> None:
    numbers = NumberSet.of(12, [13, 15])
    assert (numbers.num_bits, numbers.bitmap) == (4, 0b0101)
    assert list(numbers) == [13, 15]
    assert numbers.end == 16


@given(st.integers(1, 1 << 40), st.sets(st.integers(0, 600)))
def test_a_set_holds_what_fits_from_its_base_on(base: int, offsets: set[int]) -> None:
    numbers = sorted(base + offset for offset in offsets)
    held = NumberSet.of(base, numbers)
    assert list(held) == [number for number in numbers if number < base + MAX_SET_BITS]
    assert all((number in held) == (number in set(held)) for number in range(base, base + 300, 7))


def test_locators_say_what_they_are() -> None:
    assert str(Locator.udp_v4("127.0.0.1", 7410)) == "udpv4/127.0.0.1:7410"
    assert Locator.udp_v4("127.0.0.1", 1).is_loopback
    assert Locator.udp_v4("239.255.0.1", 1).is_multicast
    assert not Locator.udp_v4("10.0.0.1", 1).is_multicast
