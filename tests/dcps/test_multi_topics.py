"""Multi-topics: samples of several topics joined, as an application reads them.  DDS 1.4 §2.2.2.3.5."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Annotated, Any

import pytest
import trio
import trio.testing

import ddsi
from ddsi import idl

from .running import RELIABLE, in_trio


@idl.struct
class Position:
    flight: Annotated[idl.int32, idl.key]
    x: idl.int32 = 0


@idl.struct
class Plan:
    flight: Annotated[idl.int32, idl.key]
    airline: str = ""


@idl.struct
class Airline:
    airline: Annotated[str, idl.key]
    country: str = ""


@idl.struct
class Seen:
    flight: Annotated[idl.int32, idl.key]
    x: idl.int32
    name: str = ""
    country: str = "?"


@idl.struct
class Apart:
    other: idl.int32 = 0


@idl.struct
class Clash:
    flight: str = ""


TWO = "SELECT flight, x, airline AS name FROM Position NATURAL JOIN Plan WHERE x < %0"
THREE = "SELECT flight, x, airline AS name, country FROM Position NATURAL JOIN Plan NATURAL JOIN Airline"
KINDS: dict[str, type[Any]] = {"Position": Position, "Plan": Plan, "Airline": Airline, "Apart": Apart, "Clash": Clash}


@dataclass
class Stage:
    participant: ddsi.DomainParticipant
    topics: dict[str, ddsi.Topic[Any]]
    writers: dict[str, ddsi.DataWriter[Any]]

    async def write(self, *samples: Any) -> None:
        for sample in samples:
            await self.writers[type(sample).__name__].write(sample)

    def reader(self, expression: str, *parameters: str) -> ddsi.MultiTopicReader[Seen]:
        topic = ddsi.MultiTopic(self.participant, "Seen", Seen, expression, parameters)
        return ddsi.MultiTopicReader(self.participant, topic, RELIABLE)


@asynccontextmanager
async def stage(domain: int) -> AsyncIterator[Stage]:
    async with ddsi.DomainParticipant(domain) as participant:
        topics = {name: ddsi.Topic(participant, name, kind) for name, kind in KINDS.items()}
        writers = {name: ddsi.DataWriter(participant, topic, RELIABLE) for name, topic in topics.items()}
        yield Stage(participant, topics, writers)


def rows(samples: list[ddsi.Sample[Seen]]) -> list[tuple[Any, ...]]:
    return [
        (s.data.flight, s.data.x, s.data.name, s.data.country) if s.info.valid_data else (s.data.flight, "ended")
        for s in samples
    ]


@in_trio
async def test_two_topics_are_joined_as_their_samples_come(domain: int) -> None:
    async with stage(domain) as here:
        reader = here.reader(TWO, "100")
        await here.write(Position(1, 10), Position(2, 20))
        assert reader.take() == []
        await here.write(Plan(1, "Ours"))
        assert rows(reader.take()) == [(1, 10, "Ours", "?")]
        await here.write(Position(1, 11), Position(3, 30), Position(1, 12))
        assert rows(reader.take()) == [(1, 11, "Ours", "?"), (1, 12, "Ours", "?")]
        await here.write(Plan(3, "Theirs"))
        taken = reader.take()
        assert rows(taken) == [(3, 30, "Theirs", "?")]
        assert taken[0].info.publication_handle == here.writers["Plan"].guid


@in_trio
async def test_events_begin_with_what_is_joined_already(domain: int) -> None:
    async with stage(domain) as here:
        reader = here.reader(TWO, "100")
        await here.write(Position(1, 10), Plan(1, "Ours"))
        with trio.fail_after(5):
            assert isinstance(await anext(reader.events()), ddsi.DataAvailable)
        assert rows(reader.take()) == [(1, 10, "Ours", "?")]


@in_trio
async def test_a_row_ends_with_a_part_of_it_or_when_the_condition_no_longer_holds(domain: int) -> None:
    async with stage(domain) as here:
        reader = here.reader(TWO, "100")
        await here.write(Plan(1, "Ours"), Plan(2, "Ours"), Position(1, 10), Position(2, 20))
        assert len(reader.take()) == 2
        await here.write(Position(1, 100))
        assert rows(reader.take()) == [(1, "ended")]
        await here.write(Position(1, 99))
        assert rows(reader.take()) == [(1, 99, "Ours", "?")]
        await here.writers["Plan"].dispose(Plan(2))
        assert rows(reader.take()) == [(2, "ended")]
        await here.write(Plan(2, "New"))
        assert rows(reader.take()) == [(2, 20, "New", "?")]


@in_trio
async def test_three_topics_are_joined_by_what_each_has_in_common_with_the_others(domain: int) -> None:
    """Position and Airline have nothing in common but through Plan."""
    async with stage(domain) as here:
        reader = here.reader(THREE)
        await here.write(Airline("Ours", "CH"), Position(1, 10), Position(2, 20), Plan(2, "Ours"), Plan(1, "Ours"))
        assert sorted(rows(reader.take())) == [(1, 10, "Ours", "CH"), (2, 20, "Ours", "CH")]
        await here.write(Airline("Ours", "AT"))
        assert sorted(rows(reader.take())) == [(1, 10, "Ours", "AT"), (2, 20, "Ours", "AT")]
        await here.writers["Airline"].dispose(Airline("Ours"))
        assert sorted(rows(reader.take())) == [(1, "ended"), (2, "ended")]


@in_trio
async def test_a_star_fills_what_has_the_same_name(domain: int) -> None:
    async with stage(domain) as here:
        reader = here.reader("SELECT * FROM Position")
        await here.write(Position(7, 70))
        assert rows(reader.take()) == [(7, 70, "", "?")]


@in_trio
async def test_parameters_may_change_and_what_it_holds_follows(domain: int) -> None:
    async with stage(domain) as here:
        reader = here.reader(TWO, "15")
        await here.write(Plan(1, "Ours"), Plan(2, "Ours"), Position(1, 10), Position(2, 20))
        assert rows(reader.take()) == [(1, 10, "Ours", "?")]
        reader.topic.set_expression_parameters(["5"])
        assert rows(reader.take()) == [(1, "ended")]
        reader.topic.set_expression_parameters(["25"])
        assert sorted(rows(reader.take())) == [(1, 10, "Ours", "?"), (2, 20, "Ours", "?")]


@in_trio
async def test_waiting_iterating_and_conditions_are_as_with_any_reader(domain: int) -> None:
    async with stage(domain) as here:
        reader = here.reader(TWO, "100")
        await reader.wait_for_matched(timeout=5)
        found: list[tuple[Any, ...]] = []

        async def iterate() -> None:
            async for sample in reader:
                found.extend(rows([sample]))

        async with trio.open_nursery() as nursery:
            nursery.start_soon(iterate)
            await trio.testing.wait_all_tasks_blocked(0.01)
            await here.write(Plan(1, "Ours"), Position(1, 10))
            await trio.testing.wait_all_tasks_blocked(0.05)
            nursery.cancel_scope.cancel()
        assert found == [(1, 10, "Ours", "?")]
        query = ddsi.QueryCondition(reader, expression="x > 50 ORDER BY x")
        async with trio.open_nursery() as nursery:

            async def write() -> None:
                await trio.testing.wait_all_tasks_blocked(0.01)
                await here.write(Plan(2, "Ours"), Position(1, 60), Position(2, 55))

            nursery.start_soon(write)
            assert await ddsi.WaitSet(query).wait(5) == [query]
        assert rows(reader.take(condition=query)) == [(2, 55, "Ours", "?"), (1, 60, "Ours", "?")]


@in_trio
async def test_rows_come_and_go_without_end(domain: int) -> None:
    """Else the instances of the result would be used up, and no row be shown any more."""
    async with stage(domain) as s:
        reader = s.reader(TWO, "100")
        for flight in range(5):
            await s.write(Position(flight, 1), Plan(flight, "LH"))
            await s.writers["Plan"].dispose(Plan(flight))
            assert [sample.info.valid_data for sample in reader.take()] == [True, False]
        assert not reader._history.instances
        await s.write(Plan(4, "BA"))
        (row,) = reader.take()
        assert (row.data, row.info.instance_state) == (Seen(4, 1, "BA"), ddsi.InstanceState.ALIVE)


@in_trio
async def test_it_ends_with_its_readers_or_alone(domain: int) -> None:
    async with stage(domain) as here:
        reader = here.reader(TWO, "100")
        parts = reader.readers
        assert [part.topic.name for part in parts] == ["Position", "Plan"]
        reader.close()
        assert all(part.is_closed for part in parts)
        with pytest.raises(ddsi.AlreadyDeleted):
            reader.take()


@pytest.mark.parametrize(
    ("expression", "reason"),
    [
        ("SELECT * FROM Positions", "has no topic 'Positions'; did you mean 'Position'?"),
        ("SELECT flight, y FROM Position", "has no member 'y'"),
        ("SELECT flight, x AS z FROM Position", "Seen has no member 'z'"),
        ("SELECT flight, x AS name FROM Position", "x is int32, and name of Seen is string"),
        ("SELECT flight FROM Position", "nothing is selected for x of Seen"),
        ("SELECT * FROM Position NATURAL JOIN Apart", "Apart has no member in common with the others"),
        ("SELECT * FROM Position NATURAL JOIN Clash", "flight is int32 in Position and string in Clash"),
        ("SELECT * FROM Position WHERE y = 1", "has no member 'y'"),
        ("SELECT * FROM Position WHERE x = %0", "parameter %0 has no value"),
        ("FROM Position", "expected SELECT, found FROM"),
    ],
)
@in_trio
async def test_what_cannot_be_joined_is_refused(domain: int, expression: str, reason: str) -> None:
    async with stage(domain) as here:
        with pytest.raises(ddsi.BadParameter) as caught:
            ddsi.MultiTopic(here.participant, "Seen", Seen, expression)
        assert reason in str(caught.value)
