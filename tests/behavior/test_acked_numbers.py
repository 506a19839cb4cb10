"""AckedNumbers: always the lowest of all readers, and work that does not grow with them."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.behavior.acked_numbers import NOBODY, AckedNumbers
from ddsi.behavior.stateful_writer import StatefulWriter
from ddsi.structure.guid import Guid
from ddsi.structure.locator import Locator
from tests.behavior.builders import LOCATOR, guid, numbers, reader_data, reader_guid, stateful_writer, write
from tests.engine.steps import steps_of


@given(st.lists(st.tuples(st.integers(0, 4), st.integers(0, 6))))
def test_the_lowest_is_that_of_all_who_are_left(moves: list[tuple[int, int]]) -> None:
    """Each move: who, and how far he comes by it; 0 sends him away."""
    acked, readers = AckedNumbers(), dict[int, int]()
    for who, number in moves:
        if who in readers:
            acked.remove(readers.pop(who))
        if number:
            readers[who] = number
            acked.add(number)
        assert acked.lowest == min(readers.values(), default=NOBODY)


def crowded(count: int) -> StatefulWriter:
    """A writer that has sent one sample to so many readers, of which all but the last have acknowledged it."""
    writer = stateful_writer()
    guids = [reader_guid(1, key) for key in range(count)]
    for each in guids:
        writer.matched_reader_add(reader_data(of=each), (LOCATOR,), 0.0)
    write(writer, b"data", 0.0)
    writer.unsent_changes(0.0)
    for each in guids[:-1]:
        acknowledge(writer, each)
    return writer


def acknowledge(writer: StatefulWriter, reader: Guid) -> None:
    writer.receive_acknack(writer.readers[reader], numbers(2), 1, 1.0, final=True)


@pytest.mark.parametrize("count", [10, 300])
def test_what_all_have_acknowledged_is_freed_with_the_last(count: int) -> None:
    writer = crowded(count)
    assert writer.min_acked_sn() == 0
    assert writer.in_flight_octets == 4
    acknowledge(writer, reader_guid(1, count - 1))
    assert writer.min_acked_sn() == 1
    assert writer.in_flight_octets == len(writer.cache) == 0


def test_an_acknowledgment_costs_the_same_among_many_readers() -> None:
    """Else the discovery of N participants would cost the cube of N."""

    def steps(count: int) -> int:
        writer = crowded(count)
        return steps_of(lambda: acknowledge(writer, reader_guid(1, count - 1)))

    assert steps(300) <= steps(10)


def test_a_match_costs_the_same_among_many_readers() -> None:
    def steps(count: int) -> int:
        writer = crowded(count)
        newcomer = guid(9)
        return steps_of(lambda: writer.matched_reader_add(reader_data(of=newcomer), (LOCATOR,), 2.0))

    assert steps(300) <= steps(10)


def test_readers_at_one_place_are_sent_to_once_until_the_last_of_them_leaves() -> None:
    writer = stateful_writer()
    elsewhere = Locator.udp_v4("10.0.0.3", 7411)
    for key, locator in ((1, LOCATOR), (2, LOCATOR), (3, elsewhere)):
        writer.matched_reader_add(reader_data(of=reader_guid(1, key)), (locator,), 0.0)
    assert list(writer.locators) == [LOCATOR, elsewhere]
    writer.matched_reader_remove(reader_guid(1, 1), 0.0)
    assert list(writer.locators) == [LOCATOR, elsewhere]
    writer.matched_reader_update(reader_guid(1, 2), reader_data(of=reader_guid(1, 2)), (elsewhere,))
    assert list(writer.locators) == [elsewhere]
    writer.matched_reader_remove(reader_guid(1, 2), 0.0)
    writer.matched_reader_remove(reader_guid(1, 3), 0.0)
    assert list(writer.locators) == []
