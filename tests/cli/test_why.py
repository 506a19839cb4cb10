"""``ddsi why``: every reason has its remedy, and topics that miss their other half are found."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ddsi.cli import why
from ddsi.cli.remedies import Disagreement, disagreements
from ddsi.cli.why import diagnose
from ddsi.discovery.matching import judge
from ddsi.structure import qos_policies as p
from ddsi.structure.discovered import DiscoveredReaderData, DiscoveredWriterData
from ddsi.structure.qos import EndpointQos
from ddsi.xtypes.assignability import TypeMismatch

from .seen import census, reader, writer


def _disagreements(one: DiscoveredWriterData, other: DiscoveredReaderData) -> tuple[Disagreement, ...]:
    refusal = judge(one, other)
    assert refusal is not None
    return disagreements(one, other, refusal)


@pytest.mark.parametrize(
    ("policy", "offered", "requested", "remedy"),
    [
        ("reliability", p.BestEffort(), p.Reliable(), "make the writer Reliable()"),
        ("durability", p.Volatile(), p.TransientLocal(), "with TransientLocal(), or let the reader ask for Volatile()"),
        ("durability", p.TransientLocal(), p.Persistent(), "with Persistent(), or let the reader ask for Tran"),
        ("presentation", p.Presentation(), p.Presentation(p.AccessScope.GROUP), "access scope"),
        ("deadline", p.Deadline(2), p.Deadline(0.5), "promise Deadline(0.5) or shorter, or the reader wait 2 s or"),
        ("deadline", p.Deadline(), p.Deadline(1), "promise Deadline(1) or shorter, or the reader do without"),
        ("latency_budget", p.LatencyBudget(1), p.LatencyBudget(0), "offer LatencyBudget(0) or less"),
        ("ownership", p.Shared(), p.Exclusive(), "same kind on both sides"),
        ("liveliness", p.Automatic(5), p.ManualByTopic(5), "at least as ManualByTopic with a lease of 5 s"),
        ("liveliness", p.Automatic(), p.Automatic(1), "at least as Automatic with a lease of 1 s"),
        ("destination_order", p.ByReceptionTimestamp(), p.BySourceTimestamp(), "BySourceTimestamp()"),
        ("data_representation", p.DataRepresentation(2), p.DataRepresentation(0),
         "use DataRepresentation(XCDR1), or let the reader accept XCDR2"),
        ("data_representation", p.DataRepresentation(), p.DataRepresentation(2),
         "use DataRepresentation(XCDR2), or let the reader accept XCDR1"),
    ],
)  # fmt: skip
def test_every_policy_has_its_remedy(policy: str, offered: object, requested: object, remedy: str) -> None:
    (found,) = _disagreements(
        writer(qos=EndpointQos(**{policy: offered})),  # type: ignore[arg-type]
        reader(qos=EndpointQos(**{policy: requested})),  # type: ignore[arg-type]
    )
    assert found.policy == policy
    assert remedy in found.remedy


def test_all_policies_that_stand_between_are_named() -> None:
    wants = EndpointQos(reliability=p.Reliable(), durability=p.TransientLocal(), deadline=p.Deadline(1))
    found = _disagreements(writer(qos=EndpointQos()), reader(qos=wants))
    assert [one.policy for one in found] == ["reliability", "durability", "deadline"]


@pytest.mark.parametrize(
    ("offered", "requested", "remedy"),
    [
        (("a",), (), "put the reader into Partition('a') too"),
        ((), ("b",), "put the writer into Partition('b') too"),
        (("a",), ("b",), "one partition name in common"),
        (("", "a"), ("b",), "one partition name in common"),
    ],
)
def test_partitions(offered: tuple[str, ...], requested: tuple[str, ...], remedy: str) -> None:
    (found,) = _disagreements(
        writer(qos=EndpointQos(partition=p.Partition(*offered))),
        reader(qos=EndpointQos(partition=p.Partition(*requested))),
    )
    assert found.policy == "partition"
    assert remedy in found.remedy


def test_what_would_keep_them_apart_within_one_partition_is_told_at_once() -> None:
    there = EndpointQos(partition=p.Partition("a"))
    found = _disagreements(writer(qos=there), reader(qos=EndpointQos(reliability=p.Reliable())))
    assert [one.policy for one in found] == ["partition", "reliability"]


@pytest.mark.parametrize(
    ("one", "other", "remedy"),
    [
        (writer(), reader(keyed=False), "the writer's type has key members, the reader's has none"),
        (writer(keyed=False), reader(), "the reader's type has key members, the writer's has none"),
        (writer(type_name="m::msg::dds_::String_"), reader(type_name="m/msg/String"), "one full name on both sides"),
        (writer(type_name="Shape"), reader(type_name="Image"), "different types"),
    ],
)
def test_types(one: DiscoveredWriterData, other: DiscoveredReaderData, remedy: str) -> None:
    (found,) = _disagreements(one, other)
    assert found.policy == "type"
    assert remedy in found.remedy


def test_a_diagnosis_counts_what_fits_too() -> None:
    seen = census(writer(), reader(), reader(number=2, qos=EndpointQos()), reader(number=3, keyed=False))
    diagnosis = diagnose(seen)
    assert diagnosis.matching == 2
    assert len(diagnosis.mismatches) == 1
    assert diagnosis.lonely == ()


def test_one_topic_of_many() -> None:
    seen = census(writer("A"), reader("A", keyed=False), writer("B", number=2), reader("B", number=2, keyed=False))
    assert [found.pair.writer.topic_name for found in diagnose(seen, "B").mismatches] == ["B"]
    assert diagnose(seen, "C").is_empty
    assert not diagnose(seen).is_empty


@pytest.mark.parametrize(
    ("topic", "others", "similar"),
    [
        ("Square", ["square"], ("square",)),
        ("Square", ["Sqaure"], ("Sqaure",)),
        ("chatter", ["rt/chatter", "chat"], ("rt/chatter", "chat")),
        ("Square", ["Circle", "Triangle"], ()),
    ],
)
def test_a_lonely_topic_and_what_may_have_been_meant(topic: str, others: list[str], similar: tuple[str, ...]) -> None:
    seen = census(writer(topic), *(reader(name, number=number) for number, name in enumerate(others, 1)))
    lonely = {found.topic: found for found in diagnose(seen).lonely}
    assert lonely[topic].kind == "writer"
    assert lonely[topic].similar == similar


def test_pairs_with_the_same_reasons_are_told_of_together() -> None:
    """Fifty readers with one problem make one paragraph, and only some are named."""
    readers = [reader(number=number, keyed=False) for number in range(1, 51)]
    lines = list(why._lines(diagnose(census(writer(), *readers))))
    assert lines[0] == "Square: 1 writer and 50 readers do not match"
    assert sum(line.startswith("  reader ") for line in lines) == 4
    assert "  and 46 more readers" in lines
    assert lines[-1] == "0 pairs of a writer and a reader fit, 50 do not."


def test_text_from_the_network_is_made_safe() -> None:
    seen = census(writer("\x1b[2J"), reader("\x1b[2J", keyed=False), writer("\x1b]0;x", number=2))
    assert not any("\x1b" in line for line in why._lines(diagnose(seen)))


def test_types_that_were_fetched_are_judged_by_what_they_are_made_of() -> None:
    one, other = writer("x", type_name="T"), reader("x", type_name="U")
    one, other = replace(one, type_information=b"1"), replace(other, type_information=b"2")
    question = (b"1", b"2", other.qos.type_consistency)
    seen = census(one, other)
    assert [mismatch.disagreements[0].policy for mismatch in diagnose(seen).mismatches] == ["type"]
    assert diagnose(seen, judgements={question: None}).matching == 1
    (mismatch,) = diagnose(seen, judgements={question: TypeMismatch("pose.x", "int32 there")}).mismatches
    (told,) = mismatch.disagreements
    assert told.requested == "U; pose.x: int32 there"
    final = TypeMismatch("", "final for the reader, appendable for the writer")
    (mismatch,) = diagnose(seen, judgements={question: final}).mismatches
    assert "say @final, @appendable or @mutable" in mismatch.disagreements[0].remedy
