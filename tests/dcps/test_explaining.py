"""Why endpoints do not match: as a value, and as a line of the log when it happens."""

from __future__ import annotations

import logging

import pytest

import ddsi
from ddsi.dcps import refusal_log
from ddsi.engine.explaining import judged_pair
from ddsi.structure.guid import Guid

from .running import Note, Shape, eventually, in_trio


def _lines(caplog: pytest.LogCaptureFixture, level: int) -> list[str]:
    of_matching = [record for record in caplog.records if record.name == "ddsi.matching"]
    return [record.getMessage() for record in of_matching if record.levelno == level]


@in_trio
async def test_an_application_learns_everything_that_stands_between(domain: int) -> None:
    """Its own writer and another participant's reader: two policies and the partition at once, each with a remedy."""
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as there:
        writer = ddsi.DataWriter(here, ddsi.Topic(here, "Square", Shape), ddsi.Qos(reliability=ddsi.BestEffort()))
        wanted = ddsi.Qos(reliability=ddsi.Reliable(), durability=ddsi.TransientLocal())
        subscriber = ddsi.Subscriber(there, ddsi.Qos(partition=ddsi.Partition("red")))
        reader = ddsi.DataReader(subscriber, ddsi.Topic(there, "Square", Shape), wanted)
        await eventually(lambda: len(here.explain("Square").pairs) == 1)
        (pair,) = here.explain("Square").mismatches
        assert (pair.writer.guid, pair.reader.guid) == (writer.guid, reader.guid)
        assert [one.policy for one in pair.disagreements] == ["partition", "reliability", "durability"]
        assert pair.disagreements[1].offered == "BestEffort"
        assert pair.disagreements[1].requested == "Reliable"
        assert "make the writer Reliable()" in pair.disagreements[1].remedy
        assert here.explain(writer.guid, reader.guid).mismatches == (pair,)
        assert here.explain(reader.guid).mismatches == (pair,)
        assert here.explain("Circle").pairs == ()


@in_trio
async def test_policies_that_mean_nothing_to_an_endpoint_of_ours_are_named(domain: int) -> None:
    shared = ddsi.Qos(lifespan=ddsi.Lifespan(1), time_based_filter=ddsi.TimeBasedFilter(0.1))
    async with ddsi.DomainParticipant(domain) as here:
        square, circle = (ddsi.Topic(here, name, Shape) for name in ("Square", "Circle"))
        writer = ddsi.DataWriter(ddsi.Publisher(here), square, shared)
        reader = ddsi.DataReader(here, circle, shared)
        ddsi.DataReader(here, square)
        assert dict(here.explain().unused) == {writer.guid: ("time_based_filter",), reader.guid: ("lifespan",)}
        for asked in ("Squ*", writer.guid):
            assert here.explain(asked).unused == ((writer.guid, ("time_based_filter",)),)
        assert here.explain("Triangle").unused == ()


@in_trio
async def test_two_guids_are_compared_whatever_their_topics_are(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as here:
        writer = ddsi.DataWriter(here, ddsi.Topic(here, "Square", Shape))
        reader = ddsi.DataReader(here, ddsi.Topic(here, "Circle", Shape))
        (pair,) = here.explain(writer.guid, reader.guid).pairs
        assert [one.policy for one in pair.disagreements] == ["topic"]
        stranger = Guid(bytes(15) + b"\x07")
        assert here.explain(writer.guid, stranger).unknown == (stranger,)


@in_trio
async def test_a_judgement_serves_only_those_that_are_alike(domain: int) -> None:
    """Every policy that the rules look at makes a difference: each pair is judged as if it were the only one."""
    variants = [
        ddsi.Qos(),
        ddsi.Qos(reliability=ddsi.BestEffort()),
        ddsi.Qos(durability=ddsi.TransientLocal()),
        ddsi.Qos(deadline=ddsi.Deadline(1)),
        ddsi.Qos(latency_budget=ddsi.LatencyBudget(1)),
        ddsi.Qos(ownership=ddsi.Exclusive()),
        ddsi.Qos(liveliness=ddsi.ManualByTopic(1)),
        ddsi.Qos(liveliness=ddsi.ManualByTopic(2)),
        ddsi.Qos(destination_order=ddsi.BySourceTimestamp()),
        ddsi.Qos(partition=ddsi.Partition("a")),
        ddsi.Qos(data_representation=ddsi.DataRepresentation(ddsi.XCDR2)),
        ddsi.Qos(presentation=ddsi.Presentation(ddsi.AccessScope.TOPIC)),
    ]
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as there:
        topic = ddsi.Topic(there, "Square", Shape)
        for qos in variants:
            ddsi.DataWriter(ddsi.Publisher(there, qos), topic, qos)
            ddsi.DataReader(ddsi.Subscriber(there, qos), topic, qos)
        await eventually(lambda: len(here.explain("Square").pairs) == len(variants) ** 2)
        pump = here._running_pump()
        pairs = here.explain("Square").pairs
        alone = [judged_pair(pump.engine, pair.writer, pair.reader, pump.now()) for pair in pairs]
        assert list(pairs) == alone
        assert {pair.is_matching for pair in pairs} == {True, False}


@in_trio
async def test_what_cannot_be_asked_is_refused(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as here:
        writer = ddsi.DataWriter(here, ddsi.Topic(here, "Square", Shape))
        with pytest.raises(ddsi.BadParameter, match="one topic's name or pattern, or Guids"):
            here.explain("Square", "Circle")
        with pytest.raises(ddsi.BadParameter, match="one topic's name or pattern, or Guids"):
            here.explain("Square", writer.guid)
        with pytest.raises(ddsi.BadParameter, match="all writers: a writer and a reader are wanted"):
            here.explain(writer.guid, writer.guid)


@in_trio
async def test_a_mismatch_is_a_line_of_the_log_when_it_happens(domain: int, caplog: pytest.LogCaptureFixture) -> None:
    """With the policy, both values and the remedy; once for the pair, and a partition below the level of warnings."""
    caplog.set_level(logging.INFO, "ddsi.matching")
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as there:
        topic = ddsi.Topic(here, "Square", Shape)
        reader = ddsi.DataReader(here, topic, ddsi.Qos(durability=ddsi.TransientLocal()))
        writer = ddsi.DataWriter(there, ddsi.Topic(there, "Square", Shape))
        await eventually(lambda: len(_lines(caplog, logging.WARNING)) == 2)
        for line in _lines(caplog, logging.WARNING):
            assert f"topic Square: writer {writer.guid} and reader {reader.guid} do not match: durability: " in line
            assert "offered Volatile, requested TransientLocal (remedy: let the writer keep" in line
        red = ddsi.Subscriber(here, ddsi.Qos(partition=ddsi.Partition("red")))
        ddsi.DataReader(red, topic)
        await eventually(lambda: any("partition: " in line for line in _lines(caplog, logging.INFO)))
        assert not any("partition: " in line for line in _lines(caplog, logging.WARNING))


@in_trio
async def test_the_log_names_other_types(domain: int, caplog: pytest.LogCaptureFixture) -> None:
    async with ddsi.DomainParticipant(domain) as here:
        ddsi.DataWriter(here, ddsi.Topic(here, "Square", Shape))
        ddsi.DataReader(here, ddsi.Topic(here, "Square", Note))
        await eventually(lambda: len(_lines(caplog, logging.WARNING)) == 1)
        (line,) = _lines(caplog, logging.WARNING)
        assert "type: offered Shape, requested Note" in line


@in_trio
async def test_the_log_is_bounded(
    domain: int, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(refusal_log, "_MOST_LINES", 3)
    async with ddsi.DomainParticipant(domain) as here:
        topic = ddsi.Topic(here, "Square", Shape)
        ddsi.DataWriter(here, topic, ddsi.Qos(reliability=ddsi.BestEffort()))
        for _ in range(10):
            ddsi.DataReader(here, topic, ddsi.Qos(reliability=ddsi.Reliable()))
        await eventually(lambda: len(_lines(caplog, logging.WARNING)) == 4)
        assert "no more of them are told" in _lines(caplog, logging.WARNING)[-1]
