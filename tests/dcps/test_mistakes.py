"""What beginners get wrong: each error says what was wrong, and what to write instead."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from datetime import UTC, datetime
from functools import partial
from typing import Any

import pytest

import ddsi
from tests.dcps.running import Shape, config, in_trio, pair


def _refuses(call: Callable[[], object], *words: str) -> None:
    with pytest.raises(ddsi.DdsError) as caught:
        call()
    assert all(word in str(caught.value) for word in words), caught.value


def test_a_participant_is_refused_where_trio_does_not_run() -> None:
    async def main() -> None:
        async with ddsi.DomainParticipant(0, config=config()):
            pass

    _refuses(lambda: asyncio.run(main()), "trio.run(main)", "ddsi.aio", "ddsi.blocking")


@in_trio
async def test_a_participant_is_not_entered_by_a_plain_with() -> None:
    participant: Any = ddsi.DomainParticipant(0, config=config())

    def enter() -> None:
        with participant:
            pass

    _refuses(enter, "async with", "ddsi.blocking")


@in_trio
async def test_a_reader_is_not_iterated_by_a_plain_for(domain: int) -> None:
    async with pair(domain) as both:
        reader: Any = both.reader
        _refuses(lambda: list(reader), "async for", "take()")


def test_what_is_no_config_is_refused_before_anything_is_opened() -> None:
    settings: Any = {"interfaces": ("lo",)}
    _refuses(lambda: ddsi.DomainParticipant(0, config=settings), "ddsi.Config(...)", "'interfaces'")


@in_trio
async def test_what_stands_in_a_participants_place_is_refused() -> None:
    anything: Any
    async with ddsi.DomainParticipant(0, config=config()) as participant:
        for anything in ("Square", ddsi.Publisher(participant), ddsi.Qos()):
            for make in (
                partial(ddsi.Topic, anything, "Square", Shape),
                partial(ddsi.Publisher, anything),
                partial(ddsi.BuiltinTopicReader, anything, ddsi.ParticipantBuiltinTopicData),
                partial(ddsi.PersistenceService, anything, "samples.sqlite"),
            ):
                _refuses(make, "the first argument is a ddsi.DomainParticipant", repr(anything)[:10])


@in_trio
async def test_a_type_in_the_names_place_is_told_before_the_name_in_the_types() -> None:
    async with ddsi.DomainParticipant(0, config=config()) as participant:
        make: Any = ddsi.Topic
        _refuses(lambda: make(participant, Shape, "Square"), "name", "Shape")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"max_samples": "1"}, ("max_samples", "'1'")),
        ({"max_samples": -1}, ("max_samples", "-1")),
        ({"sample_states": "NOT_READ"}, ("ddsi.SampleState.NOT_READ", "'NOT_READ'")),
        ({"view_states": "NEW"}, ("ddsi.ViewState.NEW",)),
        ({"instance_states": None}, ("ddsi.InstanceState.NOT_ALIVE_DISPOSED",)),
        ({"condition": "x > 1"}, ("ddsi.ReadCondition", "'x > 1'")),
    ],
)
@in_trio
async def test_read_and_take_refuse_what_they_cannot_mean(
    domain: int, arguments: dict[str, Any], words: tuple[str, ...]
) -> None:
    """Also where no sample is there that would show it."""
    async with pair(domain) as both:
        _refuses(lambda: both.reader.take(**arguments), *words)
        _refuses(lambda: both.reader.read(**arguments), *words)


@in_trio
async def test_waits_refuse_what_they_cannot_mean(domain: int) -> None:
    anything: Any = "1"
    nameless: Any = 5
    async with pair(domain) as both:
        for wait in (
            both.reader.wait(anything),
            both.reader.wait_for_matched(anything),
            both.writer.wait_for_matched(anything),
            both.here.discover_type(nameless),
        ):
            with pytest.raises(ddsi.BadParameter, match=r"not ('1'|5)"):
                await wait


@in_trio
async def test_a_timestamp_is_seconds_or_a_datetime(domain: int) -> None:
    anything: Any = "noon"
    async with pair(domain) as both:
        with pytest.raises(ddsi.BadParameter, match="datetime, not 'noon'"):
            await both.writer.write(Shape("RED"), timestamp=anything)
        await both.writer.write(Shape("RED"), timestamp=datetime(2020, 1, 1, tzinfo=UTC))


def test_a_condition_says_which_states_there_are() -> None:
    anything: Any = "ALIVE"
    _refuses(lambda: ddsi.ReadCondition(instance_states=anything), "ddsi.InstanceState.ALIVE")
