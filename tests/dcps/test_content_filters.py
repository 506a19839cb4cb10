"""Content-filtered topics as applications use them: within a participant, and between two of them.

DDS 1.4 §2.2.2.3.3; RTPS 2.5 §8.7.3.
"""

from __future__ import annotations

from typing import Annotated, Any

import pytest

import ddsi
from ddsi import idl
from ddsi.engine.content_filters import MAX_FILTERS_OF_A_WRITER
from ddsi.spi import Overhead
from ddsi.spi.plaintext import Plaintext
from ddsi.structure.guid import Guid

from .running import RELIABLE, Shape, config, eventually, in_trio

HISTORY = RELIABLE | ddsi.Qos(durability=ddsi.TransientLocal())


def xs(reader: ddsi.DataReader[Shape]) -> list[int]:
    return [sample.data.x for sample in reader.take() if sample.info.valid_data]


def filtered(
    participant: ddsi.DomainParticipant,
    expression: str,
    *parameters: str,
    kind: type[Any] = Shape,
    qos: ddsi.Qos = RELIABLE,
) -> tuple[ddsi.ContentFilteredTopic[Any], ddsi.DataReader[Any]]:
    topic = ddsi.Topic(participant, "Square", kind)
    small = ddsi.ContentFilteredTopic(participant, "Filtered", topic, expression, parameters)
    return small, ddsi.DataReader(participant, small, qos)


def written(participant: ddsi.DomainParticipant, qos: ddsi.Qos = RELIABLE) -> ddsi.DataWriter[Shape]:
    return ddsi.DataWriter(participant, ddsi.Topic(participant, "Square", Shape), qos)


async def matched(writer: ddsi.DataWriter[Any], *readers: ddsi.DataReader[Any]) -> None:
    await writer.wait_for_matched(len(readers), timeout=5)
    for reader in readers:
        await reader.wait_for_matched(timeout=5)


async def write(writer: ddsi.DataWriter[Shape], *values: int, color: str = "RED") -> None:
    for x in values:
        await writer.write(Shape(color, x))
    await writer.wait_for_acknowledgments(5)


def filters_of(writer: ddsi.DataWriter[Any]) -> list[bool]:
    """For each reader in another participant: does the writer filter for it?"""
    return [proxy.content_filter is not None for proxy in writer._writer.behavior.readers.values()]


def told(reader: ddsi.DataReader[Any], writer: ddsi.DataWriter[Any]) -> int:
    """The highest number that the reader has heard of from the writer."""
    return reader._reader.behavior.writers[writer.guid].last_seq


@in_trio
async def test_a_reader_of_the_same_participant_sees_only_what_passes(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        writer = written(participant)
        small, reader = filtered(participant, "x < %0", "3")
        await write(writer, *range(6))
        assert xs(reader) == [0, 1, 2]
        assert reader.content_filtered_topic is small
        assert reader.topic is small.related_topic
        small.set_expression_parameters(["5"])
        assert small.expression_parameters == ("5",)
        await write(writer, *range(3, 6))
        assert xs(reader) == [3, 4]


@in_trio
async def test_a_writer_elsewhere_does_not_send_what_does_not_pass(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as there:
        writer = written(here)
        _, few = filtered(there, "x BETWEEN 2 AND 3 OR x = 9")
        every = ddsi.DataReader(there, few.topic, RELIABLE)
        await matched(writer, few, every)
        await write(writer, *range(9))
        assert (xs(few), xs(every)) == ([2, 3], [*range(9)])
        assert (told(few, writer), told(every, writer)) == (4, 9)
        await write(writer, 9, 10)
        assert (xs(few), xs(every)) == ([9], [9, 10])
        assert few.status(ddsi.SampleLost).total_count == 0


@in_trio
async def test_parameters_that_change_reach_the_writer(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as there:
        writer = written(here)
        topic, reader = filtered(there, "color = %0", "'RED'")
        await matched(writer, reader)
        await write(writer, 1, 2, color="BLUE")
        topic.set_expression_parameters(["'BLUE'"])

        def is_known() -> bool:
            data = next(iter(writer._writer.behavior.readers.values())).data
            return data.content_filter is not None and data.content_filter.expression_parameters == ("'BLUE'",)

        await eventually(is_known)
        await write(writer, 3)
        await write(writer, 4, color="BLUE")
        await write(writer, 5)
        assert xs(reader) == [4]
        assert told(reader, writer) == 4


@in_trio
async def test_a_late_joiner_gets_the_history_that_passes(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as there:
        writer = written(here, HISTORY)
        await write(writer, *range(600))
        _, reader = filtered(there, "x >= 595 OR x = 3", qos=HISTORY)
        await reader.wait_for_matched(timeout=5)
        await reader.wait_for_historical_data(5)
        assert xs(reader) == [3, *range(595, 600)]
        await writer.wait_for_acknowledgments(5)


@in_trio
async def test_an_instance_that_passed_is_seen_to_end_and_one_that_never_did_is_not(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as there:
        writer = written(here)
        _, reader = filtered(there, "color = 'RED'")
        await matched(writer, reader)
        await write(writer, 1)
        await write(writer, 1, color="BLUE")
        await writer.dispose(Shape("BLUE"))
        await writer.dispose(Shape("RED"))
        await writer.wait_for_acknowledgments(5)
        samples = reader.take()
        assert [(sample.data.color, sample.info.valid_data) for sample in samples] == [("RED", True), ("RED", False)]


@in_trio
async def test_best_effort_skips_are_no_losses(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as there:
        best_effort = ddsi.Qos(reliability=ddsi.BestEffort(), history=ddsi.KeepAll())
        writer = written(here, best_effort)
        _, reader = filtered(there, "x = 1 OR x = 8", qos=best_effort)
        await matched(writer, reader)
        for x in range(10):
            await writer.write(Shape("RED", x))
        found: list[int] = []
        while found != [1, 8]:
            await reader.wait()
            found += xs(reader)
        assert reader.status(ddsi.SampleLost).total_count == 0


@in_trio
async def test_a_crowd_of_filters_is_sent_everything_beyond_a_number_and_filters_itself(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as there:
        writer = written(here)
        topic = ddsi.Topic(there, "Square", Shape)
        count = MAX_FILTERS_OF_A_WRITER + 3
        readers = [
            ddsi.DataReader(there, ddsi.ContentFilteredTopic(there, "F", topic, "x = %0", [str(x)]), RELIABLE)
            for x in range(count)
        ]
        await matched(writer, *readers)
        assert sum(filters_of(writer)) == MAX_FILTERS_OF_A_WRITER
        await write(writer, *range(count))
        assert [xs(reader) for reader in readers] == [[x] for x in range(count)]


@idl.struct(extensibility=idl.APPENDABLE, typename="Grown")
class Before:
    x: idl.int32 = 0


@idl.struct(extensibility=idl.APPENDABLE, typename="Grown")
class After:
    x: idl.int32 = 0
    y: idl.int32 = 7


@in_trio
async def test_a_writer_that_does_not_know_a_member_sends_everything(domain: int) -> None:
    """What it would have by default is known to the reader alone."""
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as there:
        writer = ddsi.DataWriter(here, ddsi.Topic(here, "Square", Before), RELIABLE)
        _, reader = filtered(there, "y = 7 AND x > 1", kind=After)
        await matched(writer, reader)
        for x in range(4):
            await writer.write(Before(x))
        await writer.wait_for_acknowledgments(5)
        assert filters_of(writer) == [False]
        assert xs(reader) == [2, 3]


class Protecting(Plaintext):
    """Says that payloads are protected."""

    def overhead(self, sender: Guid, receivers: tuple[Guid, ...]) -> Overhead:
        return Overhead(payload=44)


@in_trio
async def test_where_payloads_are_protected_no_writer_filters(domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Else everybody could tell by what leaves what is inside."""
    monkeypatch.setattr("ddsi.transport.pump.load_hooks", lambda properties, **given: Protecting())
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as there:
        writer = written(here)
        _, reader = filtered(there, "x = 2")
        await matched(writer, reader)
        await write(writer, *range(5))
        assert filters_of(writer) == [False]
        assert xs(reader) == [2]


@in_trio
async def test_a_sample_that_does_not_decode_is_told_of_though_nobody_knows_whether_it_passes(domain: int) -> None:
    @idl.struct(extensibility=idl.FINAL, typename="Shape")
    class Stunted:
        color: Annotated[str, idl.key]

    by_name = config(announce_types=False)  # else the two would not match
    async with ddsi.DomainParticipant(domain, config=by_name) as here, ddsi.DomainParticipant(domain) as there:
        writer = ddsi.DataWriter(here, ddsi.Topic(here, "Square", Stunted), RELIABLE)
        _, reader = filtered(there, "x = 2")
        await matched(writer, reader)
        await writer.write(Stunted("RED"))
        await writer.wait_for_acknowledgments(5)
        assert xs(reader) == []
        assert reader.status(ddsi.SampleLost).total_count == 1


@pytest.mark.parametrize(
    ("expression", "parameters", "reason"),
    [
        ("sise = 1", (), "Shape has no member 'sise'"),
        ("x = %1", ["1"], "parameter %1 has no value; given were %0 alone"),
        ("x = 1", "1", "the parameters are a list of str"),
        ("x = %0", [1], "parameter %0 is a str, as '1', not 1"),
        ("x = 1", ["1"] * 101, "101 parameters; 100 at most"),
        ("color = 'é\ud800'", (), "an expression or parameter is no text"),
        ("color = '" + "𝄞" * 8100 + "'", (), "at most 32000 octets"),
        ("x = ", (), "expected a member, a value or a parameter, found the end"),
        (None, (), "an expression is a str, not None"),
    ],
)
@in_trio
async def test_what_cannot_be_meant_is_refused(domain: int, expression: Any, parameters: Any, reason: str) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        with pytest.raises(ddsi.BadParameter, match=reason):
            ddsi.ContentFilteredTopic(participant, "F", topic, expression, parameters)


@in_trio
async def test_a_change_that_is_refused_changes_nothing(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        writer = written(participant)
        topic, reader = filtered(participant, "x < %0", "3")
        with pytest.raises(ddsi.BadParameter, match="x is a number; parameter %0, 'a' is a text"):
            topic.set_expression_parameters(["'a'"])
        assert topic.expression_parameters == ("3",)
        await write(writer, 2, 3)
        assert xs(reader) == [2]
        topic.close()
        with pytest.raises(ddsi.AlreadyDeleted):
            topic.set_expression_parameters(["4"])
        with pytest.raises(ddsi.AlreadyDeleted):
            ddsi.DataReader(participant, topic)


@in_trio
async def test_a_reader_that_is_not_enabled_is_announced_with_the_parameters_that_it_has_then(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as there:
        writer = written(here)
        later = ddsi.Subscriber(there, ddsi.Qos(entity_factory=ddsi.EntityFactory(autoenable_created_entities=False)))
        topic = ddsi.Topic(there, "Square", Shape)
        small = ddsi.ContentFilteredTopic(there, "Filtered", topic, "x = %0", ["1"])
        reader = ddsi.DataReader(later, small, RELIABLE)
        small.set_expression_parameters(["2"])
        await eventually(lambda: here.discovered_participants() and here.knows_all_announced())
        assert here.discovered_subscriptions() == []
        reader.enable()
        await matched(writer, reader)
        await write(writer, 1, 2, 3)
        assert (xs(reader), told(reader, writer)) == ([2], 2)


@in_trio
async def test_it_belongs_to_its_participant_and_is_for_readers(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as one, ddsi.DomainParticipant(domain) as other:
        topic = ddsi.Topic(one, "Square", Shape)
        with pytest.raises(ddsi.PreconditionNotMet, match="make one with"):
            ddsi.ContentFilteredTopic(other, "F", topic, "x = 1")
        with pytest.raises(ddsi.BadParameter, match=r"is made of a ddsi\.Topic"):
            ddsi.ContentFilteredTopic(one, "F", "Square", "x = 1")  # type: ignore[arg-type]
        with pytest.raises(ddsi.BadParameter, match="a topic's name is a str of 1 to 255 octets"):
            ddsi.ContentFilteredTopic(one, "", topic, "x = 1")
        small = ddsi.ContentFilteredTopic(one, "F", topic, "x = 1")
        assert (small.name, small.type, small.type_name) == ("F", Shape, "Shape")
        with pytest.raises(ddsi.BadParameter, match=r"the second argument is a ddsi\.Topic"):
            ddsi.DataWriter(one, small)  # type: ignore[arg-type]
