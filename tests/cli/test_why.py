"""``ddsi why``: every reason has its remedy, and topics that miss their other half are found."""

from __future__ import annotations

import dataclasses

import pytest

from ddsi.cli import why
from ddsi.discovery import explanation
from ddsi.discovery.explanation import Explanation, PairExplanation, explained_pairs, lonely_topics
from ddsi.discovery.matching import names_refusal
from ddsi.discovery.remedies import Disagreement, disagreements, participant_remedy
from ddsi.serialization.parameter_id import ParameterId
from ddsi.structure import qos_policies as p
from ddsi.structure.discovered import DiscoveredReaderData, DiscoveredWriterData
from ddsi.structure.guid import Guid
from ddsi.structure.qos import EndpointQos

from .seen import census, reader, writer

Endpoint = DiscoveredWriterData | DiscoveredReaderData


def _disagreements(one: DiscoveredWriterData, other: DiscoveredReaderData) -> tuple[Disagreement, ...]:
    """With types compared by name."""
    return disagreements(one, other, names_refusal(one, other))


def _explained(*endpoints: Endpoint, topic: str = "") -> Explanation:
    writers = [data for data in endpoints if isinstance(data, DiscoveredWriterData)]
    readers = [data for data in endpoints if isinstance(data, DiscoveredReaderData)]

    def judge(one: DiscoveredWriterData, other: DiscoveredReaderData) -> PairExplanation:
        return PairExplanation(one, other, _disagreements(one, other))

    pairs, left_out = explained_pairs(writers, readers, judge, topic)
    lonely = lonely_topics(writers, readers, topic)
    return Explanation((topic,) if topic else (), pairs, lonely, left_out=left_out)


def _text(*endpoints: Endpoint, topic: str = "") -> list[str]:
    return list(why._lines(census(*endpoints), _explained(*endpoints, topic=topic)))


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
    ("one", "other", "policy", "remedy"),
    [
        (writer(), reader(keyed=False), "key", "the writer's type has key members, the reader's has none"),
        (writer(keyed=False), reader(), "key", "the reader's type has key members, the writer's has none"),
        (
            writer(type_name="m::msg::dds_::String_"),
            reader(type_name="m/msg/String"),
            "type",
            "full name on both sides",
        ),
        (writer(type_name="Shape"), reader(type_name="Image"), "type", "different types"),
    ],
)
def test_types(one: DiscoveredWriterData, other: DiscoveredReaderData, policy: str, remedy: str) -> None:
    (found,) = _disagreements(one, other)
    assert found.policy == policy
    assert remedy in found.remedy


def test_everything_is_told_at_once() -> None:
    """Topic, key, type, partition and policy of one pair: nobody has to come back for the next cause."""
    there = EndpointQos(partition=p.Partition("a"))
    wants = EndpointQos(reliability=p.Reliable())
    found = _disagreements(
        writer("Square", qos=there, type_name="A"), reader("square", qos=wants, type_name="B", keyed=False)
    )
    assert [one.policy for one in found] == ["topic", "key", "type", "partition", "reliability"]


def _protected(attributes: int, plugin: int = 0) -> tuple[tuple[int, bytes], ...]:
    valid = 1 << 31
    value = b"".join((mask | valid).to_bytes(4, "little") for mask in (attributes, plugin))
    return ((ParameterId.ENDPOINT_SECURITY_INFO, value),)


def test_governance_that_differs_is_told_by_what_is_protected() -> None:
    one = dataclasses.replace(writer(), security_parameters=_protected(0b1000))
    other = dataclasses.replace(reader(), security_parameters=_protected(0b11000, 1))
    (found,) = _disagreements(one, other)
    assert (found.policy, found.offered) == ("security", "submessage protected")
    assert found.requested == "submessage and payload protected, submessage encrypted"
    assert "one governance document" in found.remedy
    assert _disagreements(one, dataclasses.replace(other, security_parameters=one.security_parameters)) == ()


@pytest.mark.parametrize(
    ("plugin", "text"),
    [
        (0b110, "payload encrypted, origin authenticated"),
        (0b101000, "plugin attributes 0x28"),  # of somebody else's plugin
    ],
)
def test_how_a_plugin_protects_is_told_in_words(plugin: int, text: str) -> None:
    one = dataclasses.replace(writer(), security_parameters=_protected(0b11000))
    other = dataclasses.replace(reader(), security_parameters=_protected(0b11000, plugin))
    (found,) = _disagreements(one, other)
    assert found.requested == f"submessage and payload protected, {text}"


@pytest.mark.parametrize(
    ("reason", "has_identity", "remedy"),
    [
        (
            "it announces no identity, and governance admits only authenticated participants",
            False,
            "give it an identity",
        ),
        ("its governance protects participants otherwise: rtps encrypted here, not there", True, "one governance"),
        ("permissions of 'CN=bob', as received, grant 'bob': no allow rule lets it join domain 1", True, "permissions"),
        ("the certificate of CN=bob was issued by CN=x, which is none of the identity CAs", True, "one CA has signed"),
        ("it is not authenticated yet", True, "one CA has signed"),
    ],
)
def test_the_remedy_for_a_participant_follows_from_the_reason(reason: str, has_identity: bool, remedy: str) -> None:
    assert remedy in participant_remedy(reason, has_identity=has_identity)


def test_what_fits_is_counted_too() -> None:
    found = _explained(writer(), reader(), reader(number=2, qos=EndpointQos()), reader(number=3, keyed=False))
    assert found.matching_count == 2
    assert len(found.mismatches) == 1
    assert found.lonely == ()


def test_one_topic_of_many() -> None:
    seen = writer("A"), reader("A", keyed=False), writer("B", number=2), reader("B", number=2, keyed=False)
    assert [found.writer.topic_name for found in _explained(*seen, topic="B").mismatches] == ["B"]
    assert _text(*seen, topic="C")[0].startswith("Nobody was seen with a writer or reader of C")
    assert not _text(*seen)[0].startswith("Nobody")


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
    seen: list[Endpoint] = [writer(topic), *(reader(name, number=number) for number, name in enumerate(others, 1))]
    lonely = {found.topic: found for found in _explained(*seen).lonely}
    assert lonely[topic].kind == "writer"
    assert lonely[topic].similar == similar


@pytest.mark.parametrize(
    ("offered", "requested", "how"),
    [
        ("Square", "square", "upper and lower case"),
        ("Square", "Square ", "blanks"),
        ("chatter", "rt/chatter", "ROS 2"),
        ("/chatter", "rt/chatter", "ROS 2"),
    ],
)
def test_topics_that_were_meant_to_be_one_are_compared(offered: str, requested: str, how: str) -> None:
    (pair,) = _explained(writer(offered), reader(requested, qos=EndpointQos(durability=p.TransientLocal()))).pairs
    topic, durability = pair.disagreements
    assert (topic.policy, topic.offered, topic.requested) == ("topic", repr(offered), repr(requested))
    assert how in topic.remedy
    assert durability.policy == "durability"


def test_topics_that_have_their_own_other_half_are_left_alone() -> None:
    """Two pairs whose topics differ by case alone are nobody's mistake."""
    seen = writer("A"), reader("A"), writer("a", number=2), reader("a", number=2)
    assert [pair.is_matching for pair in _explained(*seen).pairs] == [True, True]


def test_pairs_are_bounded_and_what_was_left_out_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """In the value, the text, the JSON and the status: nobody shall take silence for a match."""
    monkeypatch.setattr(explanation, "MOST_EXPLAINED", 10)
    many: list[Endpoint] = [*(writer(number=n) for n in range(1, 5)), *(reader(number=n) for n in range(1, 5))]
    found = _explained(*many)
    assert (len(found.pairs), found.left_out) == (10, 6)
    assert list(why._lines(census(*many), found))[-1].startswith("6 more pairs were not looked at: ask about one topic")
    assert why._explanation_json(census(*many), found)["left_out"] == 6
    assert not why._is_well(found)
    whole = _explained(*many[:2], *many[4:])
    assert (len(whole.pairs), whole.left_out) == (8, 0)
    assert list(why._lines(census(), whole))[-1] == "8 pairs of a writer and a reader fit, none do not."
    assert why._is_well(whole)


def test_the_pairs_of_one_endpoint_are_found_however_many_others_there_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(explanation, "MOST_EXPLAINED", 10)
    writers = [writer(number=n) for n in range(1, 9)]
    readers = [reader(number=n) for n in range(1, 9)]
    for of in (writers[-1].guid, readers[-1].guid):
        pairs, left_out = explained_pairs(writers, readers, PairExplanation, of=of)
        assert (len(pairs), left_out) == (8, 0)
        assert all(of in (pair.writer.guid, pair.reader.guid) for pair in pairs)


def test_pairs_with_the_same_reasons_are_told_of_together() -> None:
    """Fifty readers with one problem make one paragraph, and only some are named."""
    lines = _text(writer(), *(reader(number=number, keyed=False) for number in range(1, 51)))
    assert lines[0] == "Square: 1 writer and 50 readers do not match"
    assert sum(line.startswith("  reader ") for line in lines) == 4
    assert "  and 46 more readers" in lines
    assert lines[-1] == "0 pairs of a writer and a reader fit, 50 do not."


def test_pairs_that_match_are_listed_where_somebody_asks_about_the_topic() -> None:
    assert _text(writer(), reader()) == ["1 pair of a writer and a reader fit, none do not."]
    assert _text(writer(), reader(), topic="Square")[0] == "Square: 1 writer and 1 reader match"


def test_a_guid_that_nobody_announces_is_not_discovered() -> None:
    guid = Guid(bytes(15) + b"\x02")
    lines = list(why._lines(census(), Explanation((str(guid),), (), unknown=(guid,))))
    assert lines[0].startswith(f"{guid}: not discovered")
    assert "ddsi doctor" in lines[1]


def test_text_from_the_network_is_made_safe() -> None:
    seen = writer("\x1b[2J"), reader("\x1b[2J", keyed=False), writer("\x1b]0;x", number=2)
    assert not any("\x1b" in line for line in _text(*seen))
