"""Conditions and wait sets.  DDS 1.4 §2.2.2.1.6-8 (WaitSet, GuardCondition, StatusCondition), §2.2.2.5.8-9."""

from __future__ import annotations

from typing import Any

import pytest
import trio
import trio.testing

import ddsi
from ddsi import InstanceState, SampleState

from .running import RELIABLE, Note, Pair, Shape, eventually, in_trio, pair


async def arrived(p: Pair, *samples: Any) -> None:
    for sample in samples:
        await p.writer.write(sample)
    await eventually(lambda: len(p.reader._history) >= len(samples))


def found(samples: list[ddsi.Sample[Shape]]) -> list[tuple[str, int]]:
    return [(sample.data.color, sample.data.x) for sample in samples]


# --- queries ---------------------------------------------------------------------------------------------------


@in_trio
async def test_a_query_reads_takes_and_waits_by_an_expression(domain: int) -> None:
    async with pair(domain) as p:
        query = ddsi.QueryCondition(p.reader, expression="x > %0 AND color = 'RED'", parameters=["5"])
        assert (query.query_expression, query.query_parameters) == ("x > %0 AND color = 'RED'", ("5",))
        await arrived(p, *(Shape(color, x) for color in ("RED", "BLUE") for x in (4, 6, 8)))
        assert query.trigger_value
        assert found(p.reader.read(condition=query)) == [("RED", 6), ("RED", 8)]
        query.set_query_parameters(["7"])
        assert found(p.reader.take(condition=query)) == [("RED", 8)]
        assert not query.trigger_value
        async with trio.open_nursery() as nursery:
            nursery.start_soon(p.reader.wait, query)
            await p.writer.write(Shape("BLUE", 9))
            await p.writer.write(Shape("RED", 9))
        assert found(p.reader.take(condition=query)) == [("RED", 9)]


@in_trio
async def test_a_query_has_masks_besides(domain: int) -> None:
    async with pair(domain, local=True) as p:
        unread = ddsi.QueryCondition(p.reader, sample_states=SampleState.NOT_READ, expression="x < 2")
        await arrived(p, Shape("RED", 0), Shape("RED", 1), Shape("RED", 2))
        assert found(p.reader.read(1, condition=unread)) == [("RED", 0)]
        assert found(p.reader.read(condition=unread)) == [("RED", 1)]
        assert p.reader.read(condition=unread) == []


@pytest.mark.parametrize("is_taking", [True, False])
@in_trio
async def test_order_by_sorts_and_the_first_of_that_order_are_taken(domain: int, is_taking: bool) -> None:
    async with pair(domain, local=True) as p:
        await arrived(p, Shape("RED", 3), Shape("BLUE", 1), Shape("RED", 2), Shape("BLUE", 2), Shape("RED", 9))
        query = ddsi.QueryCondition(p.reader, expression="x < 5 ORDER BY x, color")
        access = p.reader.take if is_taking else p.reader.read
        first = access(3, condition=query)
        assert found(first) == [("BLUE", 1), ("BLUE", 2), ("RED", 2)]
        assert [sample.info.sample_rank for sample in first] == [1, 0, 0]
        left = found(p.reader.take(sample_states=SampleState.NOT_READ))
        assert sorted(left) == [("RED", 3), ("RED", 9)]


@in_trio
async def test_order_by_alone_wants_everything(domain: int) -> None:
    async with pair(domain, local=True) as p:
        await arrived(p, Shape("RED", 3), Shape("BLUE", 1))
        assert found(p.reader.take(condition=ddsi.QueryCondition(p.reader, expression="ORDER BY x"))) == [
            ("BLUE", 1), ("RED", 3),
        ]  # fmt: skip


@in_trio
async def test_the_end_of_an_instance_is_found_by_its_key_alone(domain: int) -> None:
    async with pair(domain, local=True) as p:
        await p.writer.write(Shape("RED", 1))
        await p.writer.dispose(Shape("RED"))
        by_key = ddsi.QueryCondition(p.reader, expression="color = 'RED'")
        other = ddsi.QueryCondition(p.reader, expression="color = 'BLUE'")
        by_data = ddsi.QueryCondition(p.reader, expression="x < 5")
        assert [sample.info.valid_data for sample in p.reader.read(condition=by_data)] == [True]
        assert p.reader.read(condition=other) == []
        assert [sample.info.valid_data for sample in p.reader.read(condition=by_key)] == [True, False]


@in_trio
async def test_a_query_that_cannot_be_meant_is_refused_and_a_change_that_cannot_changes_nothing(domain: int) -> None:
    async with pair(domain, local=True) as p:
        for expression, reason in (
            ("sise = 1", "has no member 'sise'"),
            ("x = %0", "parameter %0 has no value"),
            ("ORDER BY z", "has no member 'z'"),
            ("x = 1 ORDER", "expected AND, OR, ORDER BY or the end"),
        ):
            with pytest.raises(ddsi.BadParameter, match=reason):
                ddsi.QueryCondition(p.reader, expression=expression)
        query = ddsi.QueryCondition(p.reader, expression="x < %0", parameters=["2"])
        with pytest.raises(ddsi.BadParameter, match="x is a number"):
            query.set_query_parameters(["'two'"])
        await arrived(p, Shape("RED", 1), Shape("RED", 2))
        assert query.query_parameters == ("2",)
        assert found(p.reader.take(condition=query)) == [("RED", 1)]
        known = ddsi.BuiltinTopicReader(p.there, ddsi.PublicationBuiltinTopicData)
        with pytest.raises(ddsi.BadParameter, match="is of a DataReader"):
            ddsi.QueryCondition(known, expression="x = 1")


@in_trio
async def test_a_condition_serves_its_own_reader(domain: int) -> None:
    async with pair(domain, local=True) as p:
        other = ddsi.DataReader(p.there, p.reader.topic, RELIABLE)
        condition = ddsi.ReadCondition(p.reader, SampleState.NOT_READ)
        with pytest.raises(ddsi.PreconditionNotMet, match="cannot serve"):
            other.take(condition=condition)
        with pytest.raises(ddsi.PreconditionNotMet, match="has no reader"):
            _ = ddsi.ReadCondition().trigger_value
        with pytest.raises(ddsi.BadParameter, match="the reader of a condition is"):
            ddsi.ReadCondition(p.writer)  # type: ignore[arg-type]


# --- wait sets ---------------------------------------------------------------------------------------------------


@in_trio
async def test_a_wait_set_returns_what_holds_whoever_it_belongs_to(domain: int) -> None:
    async with pair(domain) as p:
        notes = ddsi.DataReader(p.there, ddsi.Topic(p.there, "Notes", Note), RELIABLE)
        writer = ddsi.DataWriter(p.here, ddsi.Topic(p.here, "Notes", Note), RELIABLE)
        await writer.wait_for_matched()
        red = ddsi.QueryCondition(p.reader, expression="color = 'RED'")
        blue = ddsi.QueryCondition(p.reader, expression="color = 'BLUE'")
        noted = ddsi.ReadCondition(notes, SampleState.NOT_READ)
        guard = ddsi.GuardCondition()
        waiting = ddsi.WaitSet(red, blue, noted, guard)
        assert waiting.conditions == (red, blue, noted, guard)

        async def woken_by(action: Any) -> list[ddsi.Condition]:
            holding: list[ddsi.Condition] = []
            async with trio.open_nursery() as nursery:

                async def wait() -> None:
                    holding.extend(await waiting.wait(5))

                nursery.start_soon(wait)
                await trio.testing.wait_all_tasks_blocked(0.01)
                await action()
            return holding

        assert await woken_by(lambda: p.writer.write(Shape("BLUE", 1))) == [blue]
        assert await woken_by(trio.lowlevel.checkpoint) == [blue]
        p.reader.take()
        assert await woken_by(lambda: writer.write(Note(1))) == [noted]
        notes.read()

        async def set_guard() -> None:
            guard.set_trigger_value(True)

        assert await woken_by(set_guard) == [guard]
        await arrived(p, Shape("RED", 1))
        assert await waiting.wait() == [red, guard]
        guard.set_trigger_value(False)
        waiting.detach(red)
        with pytest.raises(ddsi.DdsTimeout, match="none of 3 conditions"):
            await waiting.wait(0.01)
        with pytest.raises(ddsi.PreconditionNotMet, match="is not attached"):
            waiting.detach(red)


@in_trio
async def test_a_condition_attached_while_somebody_waits_wakes_him(domain: int) -> None:
    waiting = ddsi.WaitSet(ddsi.GuardCondition())
    late = ddsi.GuardCondition()
    late.set_trigger_value(True)
    async with trio.open_nursery() as nursery:

        async def attach() -> None:
            await trio.testing.wait_all_tasks_blocked(0.01)
            waiting.attach(late)

        nursery.start_soon(attach)
        assert await waiting.wait(5) == [late]


@in_trio
async def test_a_status_condition_holds_until_the_status_is_read(domain: int) -> None:
    async with pair(domain) as p:
        condition = ddsi.StatusCondition(p.reader, ddsi.SubscriptionMatched)
        assert condition.entity is p.reader
        assert condition.enabled_statuses == {ddsi.SubscriptionMatched}
        assert await ddsi.WaitSet(condition).wait(5) == [condition]
        p.reader.status(ddsi.SubscriptionMatched)
        assert not condition.trigger_value
        async with trio.open_nursery() as nursery:

            async def end() -> None:
                await trio.testing.wait_all_tasks_blocked(0.01)
                p.writer.close()

            nursery.start_soon(end)
            assert await ddsi.WaitSet(condition).wait(5) == [condition]
        assert p.reader.status(ddsi.SubscriptionMatched).current_count == 0
        with pytest.raises(ddsi.BadParameter, match="has the statuses"):
            ddsi.StatusCondition(p.reader, ddsi.PublicationMatched)


@in_trio
async def test_who_waits_for_an_entity_that_is_closed_is_told(domain: int) -> None:
    async with pair(domain) as p:
        waiting = ddsi.WaitSet(ddsi.GuardCondition(), ddsi.ReadCondition(p.reader))
        async with trio.open_nursery() as nursery:

            async def end() -> None:
                await trio.testing.wait_all_tasks_blocked(0.01)
                p.reader.close()

            nursery.start_soon(end)
            with pytest.raises(ddsi.AlreadyDeleted):
                await waiting.wait(5)
        with pytest.raises(ddsi.AlreadyDeleted):
            await waiting.wait(5)


@in_trio
async def test_a_wait_set_takes_conditions_that_can_hold_by_themselves(domain: int) -> None:
    with pytest.raises(ddsi.BadParameter, match="a WaitSet waits for conditions"):
        ddsi.WaitSet("x")  # type: ignore[arg-type]
    with pytest.raises(ddsi.BadParameter, match="has no reader; make it with one"):
        ddsi.WaitSet(ddsi.ReadCondition(instance_states=InstanceState.ALIVE))
    with pytest.raises(ddsi.BadParameter, match="a StatusCondition is of an entity"):
        ddsi.StatusCondition("x")  # type: ignore[arg-type]
