"""The census as tables: participants, topics, endpoints, drop counters."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Literal

from ..structure.guid import Guid
from ..structure.locator import Locator, LocatorKind
from ..trace.wording import count_text, seconds_text
from .census import Census, SeenParticipant
from .qos_words import qos_words
from .tables import Table, shown

__all__ = ["View", "census_lines", "locators_text", "who"]

View = Literal["participants", "topics", "endpoints"]
_MOST_LOCATORS = 3


def census_lines(census: Census, views: tuple[View, ...], drop_counts: Mapping[str, int] | None = None) -> list[str]:
    """The tables asked for, with a blank line between two."""
    made = {"participants": _participants, "topics": _topics, "endpoints": _endpoints}
    tables = [made[view](census) for view in views]
    if drop_counts is not None:
        tables.append(_drops(drop_counts))
    lines: list[str] = []
    for table in tables:
        lines += ["", *table.lines()] if lines else table.lines()
    if census.left_out:
        pairs = count_text(census.left_out, "more pair")
        lines += ["", f"Not compared: {pairs} of a writer and a reader; choose a topic (--topic)."]
    return lines


def who(participant: SeenParticipant) -> str:
    """``Cyclone DDS "name" on host, process 123``: what a person knows a participant by."""
    data = participant.data
    name = f' "{shown(data.entity_name, 48)}"' if data.entity_name else ""
    host = f" on {shown(participant.host, 48)}" if participant.host else ""
    pid = f", process {shown(participant.pid, 16)}" if participant.pid else ""
    return f"{participant.vendor}{name}{host}{pid}"


def locators_text(locators: tuple[Locator, ...]) -> str:
    """``127.0.0.1:7410``; of many, the first three."""
    texts = [
        f"{locator.host}:{locator.port}" if locator.kind == LocatorKind.UDPV4 else str(locator) for locator in locators
    ]
    more = len(texts) - _MOST_LOCATORS
    return " ".join([*texts[:_MOST_LOCATORS], *([f"and {more} more"] if more > 0 else [])])


def _participants(census: Census) -> Table:
    table = Table(
        f"Participants of domain {census.domain_id}: {len(census.participants)}",
        ("#", "VENDOR", "NAME", "HOST", "PROCESS", "RTPS", "LEASE", "WRITERS", "READERS", "ADDRESS", "GUID PREFIX"),
        frozenset({"#", "LEASE", "WRITERS", "READERS"}),
        ("RTPS", "LEASE", "GUID PREFIX", "ADDRESS", "HOST", "PROCESS", "READERS", "WRITERS"),
    )
    for number, participant in enumerate(census.participants, 1):
        data = participant.data
        kinds = [endpoint.kind for endpoint in participant.endpoints]
        table.add(
            number,
            participant.vendor + (" (secured)" if participant.is_secured else ""),
            data.entity_name,
            participant.host,
            " ".join(filter(None, (participant.process.rpartition("/")[2], participant.pid))),
            ".".join(map(str, data.protocol_version)),
            seconds_text(data.lease_duration),
            kinds.count("writer"),
            kinds.count("reader"),
            locators_text(data.metatraffic_unicast or data.default_unicast),
            participant.prefix,
        )
    return table


def _topics(census: Census) -> Table:
    types: dict[str, dict[str, None]] = {}
    counts: dict[str, list[int]] = {}
    topic_of: dict[Guid, str] = {}
    for _, endpoint in census.endpoints():
        topic = topic_of[endpoint.data.guid] = endpoint.data.topic_name
        types.setdefault(topic, {})[endpoint.data.type_name] = None
        counts.setdefault(topic, [0, 0])[endpoint.kind == "reader"] += 1
    unmatched = Counter(
        topic_of[writer] for writer, reader in census.refused if writer in topic_of and reader in topic_of
    )
    table = Table(
        f"Topics: {len(types)}",
        ("TOPIC", "TYPE", "WRITERS", "READERS", "NOT MATCHING"),
        frozenset({"WRITERS", "READERS"}),
    )
    for topic in sorted(types):
        refused = f"{unmatched[topic]} (see: ddsi why)" if unmatched[topic] else ""
        table.add(topic, ", ".join(types[topic]), *counts[topic], refused)
    return table


def _endpoints(census: Census) -> Table:
    numbered = [
        (endpoint.data.topic_name, endpoint.kind != "writer", number, endpoint)
        for number, participant in enumerate(census.participants, 1)
        for endpoint in participant.endpoints
    ]
    numbered.sort(key=lambda row: (*row[:3], row[3].data.guid))
    table = Table(
        f"Endpoints: {len(numbered)}",
        ("TOPIC", "KIND", "TYPE", "OF", "FITS", "QOS", "ENTITY"),
        frozenset({"FITS"}),
        ("ENTITY", "TYPE", "QOS"),
    )
    for topic, _, number, endpoint in numbered:
        vendor = census.participants[number - 1].vendor
        data = endpoint.data
        key = "" if data.is_keyed else " (no key)"
        table.add(
            topic, endpoint.kind, data.type_name + key, f"#{number} {vendor}", len(endpoint.matches),
            qos_words(data.qos), data.guid.entity_id,
        )  # fmt: skip
    return table


def _drops(counts: Mapping[str, int]) -> Table:
    """Reasons are explained in docs/trace.md."""
    table = Table(f"Not acted upon: {sum(counts.values())}", ("REASON", "COUNT"), frozenset({"COUNT"}))
    for reason, count in sorted(counts.items(), key=lambda item: (-item[1], item[0])):
        table.add(reason, count)
    return table
