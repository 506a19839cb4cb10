"""The census: who fits whom, and choosing from it."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Annotated

import pytest
import trio

import ddsi
from ddsi import idl
from ddsi.cli.census import Census, Selection, take_census
from ddsi.cli.census_changes import changes
from ddsi.cli.census_json import census_json, topics_json
from ddsi.cli.census_tables import census_lines, who
from ddsi.cli.listening import with_types
from ddsi.dcps.explaining import pairs_seen
from ddsi.structure.qos import EndpointQos
from ddsi.structure.vendor import FAST_DDS

from .seen import census, participant, reader, writer

LOOPBACK = ddsi.Config(interfaces=("127.0.0.1",))


def _guids(census: Census) -> list[str]:
    return [f"{endpoint.kind} {endpoint.data.topic_name}" for _, endpoint in census.endpoints()]


@pytest.mark.parametrize(
    ("selection", "expected"),
    [
        (Selection(), ["writer Square", "reader Square", "writer Circle"]),
        (Selection(topic="Sq*"), ["writer Square", "reader Square"]),
        (Selection(topic="sq*"), []),
        (Selection(type_name="Other"), ["writer Circle"]),
        (Selection(vendor="fast"), ["reader Square"]),
        (Selection(vendor="cyclone"), ["writer Square", "writer Circle"]),
        (Selection(participant="alice"), ["writer Square"]),
        (Selection(participant="al"), []),
        (Selection(participant="al*"), ["writer Square"]),
        (Selection(participant="robot?"), ["reader Square"]),
        (Selection(participant="01100000:00000000:00000003"), ["writer Circle"]),
        (Selection(participant="0110"), ["writer Square", "reader Square", "writer Circle"]),
        (Selection(participant="alice", topic="Circle"), []),
    ],
)
def test_selection(selection: Selection, expected: list[str]) -> None:
    seen = Census(
        0,
        (
            participant(1, writer("Square"), name="alice"),
            participant(2, reader("Square"), host="robot1", vendor_id=FAST_DDS),
            participant(3, writer("Circle", of=3, type_name="Other")),
        ),
    )
    assert _guids(seen.select(selection)) == expected


def test_participants_without_endpoints_are_left_out_only_where_endpoints_are_asked_for() -> None:
    seen = Census(0, (participant(1, writer("Square")), participant(2)))
    assert len(seen.select(Selection(vendor="Cyclone")).participants) == 2
    assert len(seen.select(Selection(topic="*")).participants) == 1


def test_who() -> None:
    assert who(participant(1)) == "Cyclone DDS"
    assert who(participant(1, name="a\x1b[2J", host="robot:123")) == 'Cyclone DDS "a?[2J" on robot'


def test_changes() -> None:
    """``+`` came, ``-`` went, ``~`` is another than before; nothing for what stayed."""
    square, circle = writer("Square"), writer("Circle", number=2)
    before = Census(0, (participant(1, square, circle), participant(2, reader("Square"))))
    changed = writer("Square", qos=EndpointQos())
    after = Census(0, (participant(1, changed, name="new"), participant(3, reader("Square", of=3))))
    lines = [line.split() for line in changes(before, after)]
    assert [(line[0], line[1], line[2][24:26] or line[2]) for line in lines] == [
        ("~", "participant", "01"),
        ("+", "participant", "03"),
        ("~", "writer", "01"),
        ("+", "reader", "03"),
        ("-", "writer", "01"),
        ("-", "reader", "02"),
        ("-", "participant", "02"),
    ]
    assert list(changes(after, after)) == []


def test_topics_with_two_types_show_both() -> None:
    offered, requested = writer("A"), reader("A", type_name="Other")
    seen = replace(census(offered, requested, writer("B", number=2)), refused=((offered.guid, requested.guid),))
    assert [(topic["topic"], topic["types"]) for topic in topics_json(seen)] == [
        ("A", ["ShapeType", "Other"]),
        ("B", ["ShapeType"]),
    ]
    lines = census_lines(seen, ("topics",))
    assert lines[2].split() == ["A", "ShapeType,", "Other", "1", "1", "1", "(see:", "ddsi", "why)"]
    assert lines[3].split() == ["B", "ShapeType", "1", "0", "-"]
    apart = seen.select(Selection(participant="01100000:00000000:00000001"))
    assert census_lines(apart, ("topics",))[2].split() == ["A", "ShapeType", "1", "0", "-"], "the reader is not chosen"


def test_what_was_not_compared_is_told() -> None:
    seen = replace(census(writer()), left_out=7)
    assert census_lines(seen, ("topics",))[-1] == (
        "Not compared: 7 more pairs of a writer and a reader; choose a topic (--topic)."
    )
    assert census_json(seen)["left_out"] == 7
    assert not any("Not compared" in line for line in census_lines(census(writer()), ("topics",)))


def test_drop_counters_most_first() -> None:
    lines = census_lines(Census(0, ()), (), {"own_message": 3, "not_rtps": 7})
    assert lines[0] == "Not acted upon: 10"
    assert [line.split()[0] for line in lines[2:]] == ["not_rtps", "own_message"]


@idl.struct
class Reading:
    sensor: Annotated[idl.int32, idl.key]
    value: idl.float64


async def _look(domain: int) -> Census:
    """A participant with endpoints, and another one that looks at it."""
    qos = ddsi.Qos(entity_name="sensors", user_data=ddsi.UserData(b"\x01\x02"))
    async with ddsi.DomainParticipant(domain, qos=qos, config=LOOPBACK) as other:
        topic = ddsi.Topic(other, "Reading", Reading)
        ddsi.DataWriter(other, topic, ddsi.Qos(deadline=ddsi.Deadline(0.5)))
        ddsi.DataReader(other, topic)
        ddsi.DataReader(other, topic, ddsi.Qos(partition=ddsi.Partition("elsewhere")))
        async with ddsi.DomainParticipant(domain, config=LOOPBACK) as observer:
            with trio.fail_after(10):
                while not observer.discovered_participants() or not observer.knows_all_announced():
                    await trio.sleep(0.01)
            return take_census(observer, *pairs_seen(observer))


def test_a_census_of_real_participants() -> None:
    """Fits are counted within a participant too; who looks is not listed."""
    seen = trio.run(_look, 171)
    (found,) = seen.participants
    assert found.data.entity_name == "sensors"
    assert found.vendor == "ddsi"
    assert [(endpoint.kind, len(endpoint.matches)) for endpoint in found.endpoints] == [
        ("writer", 1),
        ("reader", 1),
        ("reader", 0),
    ]
    assert found.endpoints[0].matches == (found.endpoints[1].data.guid,)


@idl.struct(typename="Celsius")
class Renamed:
    sensor: Annotated[idl.int32, idl.key]
    value: idl.float64


@idl.struct(typename="Reading")
class Changed:
    sensor: Annotated[idl.int32, idl.key]
    value: str


async def _look_at_types(domain: int) -> tuple[list[bool], Census]:
    async with (
        ddsi.DomainParticipant(domain, config=LOOPBACK) as other,
        ddsi.DomainParticipant(domain, config=LOOPBACK) as observer,
    ):
        ddsi.DataWriter(other, ddsi.Topic(other, "Reading", Reading))
        for kind in (Reading, Renamed, Changed):
            ddsi.DataReader(other, ddsi.Topic(other, "Reading", kind))
        completeness: list[bool] = []

        def look() -> Census:
            seen = take_census(observer, *pairs_seen(observer))
            completeness.append(seen.is_complete)
            return seen

        with trio.fail_after(10):
            while len(observer.discovered_subscriptions()) < 3 or not observer.discovered_publications():
                await trio.sleep(0.01)
            return completeness, await with_types(observer, look)


def test_types_are_compared_by_what_they_are_made_of() -> None:
    """One of another name fits, one of the same name with another member does not; both sides are asked first."""
    completeness, seen = trio.run(_look_at_types, 173)
    (found,) = seen.participants
    offering, same, renamed, changed = found.endpoints
    assert [endpoint.data.type_name for endpoint in found.endpoints] == ["Reading", "Reading", "Celsius", "Reading"]
    assert offering.matches == (same.data.guid, renamed.data.guid)
    assert seen.refused == ((offering.data.guid, changed.data.guid),)
    assert (completeness[0], completeness[-1]) == (False, True)


def test_the_json_of_a_census() -> None:
    """The structure that docs/cli.md promises: every member, with its type."""
    seen = trio.run(_look, 172)
    form = json.loads(json.dumps(census_json(seen, {"own_message": 2}), allow_nan=False))
    assert list(form) == ["domain_id", "participants", "topics", "complete", "left_out", "stats"]
    assert (form["complete"], form["left_out"]) == (True, 0)
    assert form["stats"] == {"dropped": {"own_message": 2}}
    (found,) = form["participants"]
    writer_form, reader_form, apart = found.pop("endpoints")
    prefix = found["prefix"]
    locators = found.pop("locators")
    assert found == {
        "guid": f"{prefix}:000001c1",
        "prefix": prefix,
        "vendor": "ddsi",
        "vendor_id": "01dd",
        "protocol_version": "2.4",
        "domain_id": 172,
        "domain_tag": "",
        "entity_name": "sensors",
        "host": "",
        "process": "",
        "pid": None,
        "lease": 20.0,
        "secured": False,
        "user_data": "0102",
        "properties": {},
    }
    assert set(locators) == {
        "metatraffic_unicast", "metatraffic_multicast", "default_unicast", "default_multicast"
    }  # fmt: skip
    assert locators["metatraffic_unicast"][0].startswith("udpv4/127.0.0.1:")
    assert writer_form == {
        "guid": writer_form["guid"],
        "kind": "writer",
        "topic": "Reading",
        "type": "Reading",
        "keyed": True,
        "qos": {
            "reliability": {"kind": "Reliable", "max_blocking_time": 0.1},
            "durability": {"kind": "Volatile"},
            "deadline": {"period": 0.5},
            "data_representation": writer_form["qos"]["data_representation"],
        },
        "locators": {"unicast": [], "multicast": []},
        "matched": [reader_form["guid"]],
    }
    assert reader_form["matched"] == [writer_form["guid"]]
    assert apart["matched"] == []
    assert apart["qos"]["partition"] == {"names": ["elsewhere"]}
    assert form["topics"] == [
        {
            "topic": "Reading",
            "types": ["Reading"],
            "writers": [writer_form["guid"]],
            "readers": [reader_form["guid"], apart["guid"]],
        }
    ]
