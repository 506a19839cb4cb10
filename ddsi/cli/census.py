"""Census: who was seen in a domain, with all endpoints, and who of them fits whom.

Made from what discovery (RTPS 2.5 §8.5) has brought so far.  Whom a remote endpoint really matched, only its own
participant knows; what is said here follows from what both sides announce, as ``ddsi why`` explains it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from typing import Literal

from ..dcps import DomainParticipant
from ..discovery.explanation import PairExplanation
from ..structure.discovered import DiscoveredEndpointData, DiscoveredParticipantData, DiscoveredWriterData
from ..structure.guid import Guid, GuidPrefix
from ..structure.qos_policies import Property
from ..structure.vendor import vendor_name

__all__ = ["Census", "EndpointKind", "SeenEndpoint", "SeenParticipant", "Selection", "take_census"]

EndpointKind = Literal["writer", "reader"]

# How vendors announce host, process name and process id: Cyclone DDS, Fast DDS, RTI Connext.
_HOST_PROPERTIES = ("__Hostname", "fastdds.physical_data.host", "dds.sys_info.hostname")
_PROCESS_PROPERTIES = ("__ProcessName", "dds.sys_info.executable_filepath")
_PID_PROPERTIES = ("__Pid", "fastdds.physical_data.process", "dds.sys_info.process_id")


@dataclass(frozen=True, slots=True)
class SeenEndpoint:
    """A remote writer or reader; ``matches``: the endpoints seen that it fits."""

    data: DiscoveredEndpointData
    matches: tuple[Guid, ...]

    @property
    def kind(self) -> EndpointKind:
        return "writer" if isinstance(self.data, DiscoveredWriterData) else "reader"


@dataclass(frozen=True, slots=True)
class SeenParticipant:
    """A remote participant with its endpoints, writers first."""

    data: DiscoveredParticipantData
    endpoints: tuple[SeenEndpoint, ...]

    @property
    def prefix(self) -> GuidPrefix:
        return self.data.guid.prefix

    @property
    def vendor(self) -> str:
        return vendor_name(self.data.vendor_id)

    @property
    def host(self) -> str:
        """The name of its host as announced; empty if it does not say.  Fast DDS appends a number to it."""
        return self._announced(_HOST_PROPERTIES).partition(":")[0]

    @property
    def process(self) -> str:
        return self._announced(_PROCESS_PROPERTIES)

    @property
    def pid(self) -> str:
        return self._announced(_PID_PROPERTIES)

    @property
    def is_secured(self) -> bool:
        """Does it announce security, as DDS Security 1.1 §7.4.1 adds it to SPDP?"""
        return bool(self.data.security_parameters)

    def _announced(self, names: tuple[str, ...]) -> str:
        for name, value in self.data.properties:
            if name in names and isinstance(value, Property):
                return value.value
        return ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Selection:
    """What of a census is wanted; texts are shell patterns, empty for anything."""

    topic: str = ""
    type_name: str = ""
    participant: str = ""
    vendor: str = ""

    @property
    def is_of_endpoints(self) -> bool:
        return bool(self.topic or self.type_name)

    def has_endpoint(self, endpoint: SeenEndpoint) -> bool:
        return _fits(self.topic, endpoint.data.topic_name) and _fits(self.type_name, endpoint.data.type_name)

    def has_participant(self, participant: SeenParticipant) -> bool:
        """By vendor's name (a part of it will do), and by GUID prefix (its beginning will do), name or host."""
        if self.vendor.lower() not in participant.vendor.lower():
            return False
        if not self.participant or participant.prefix.hex().startswith(self.participant.replace(":", "").lower()):
            return True
        return any(_fits(self.participant, text) for text in (participant.data.entity_name, participant.host) if text)


def _fits(pattern: str, text: str) -> bool:
    return not pattern or fnmatchcase(text, pattern)


@dataclass(frozen=True, slots=True)
class Census:
    """``participants`` in the order in which they were discovered.

    ``refused``: the writers and readers of one topic that do not fit.  ``left_out``: how many pairs nobody looked at.
    ``is_complete``: False while others are being asked what their types are made of; their pairs are neither matches
    nor refused until then.
    """

    domain_id: int
    participants: tuple[SeenParticipant, ...]
    refused: tuple[tuple[Guid, Guid], ...] = ()
    left_out: int = 0
    is_complete: bool = True

    def endpoints(self) -> Iterator[tuple[SeenParticipant, SeenEndpoint]]:
        """Every endpoint with its participant."""
        return ((participant, endpoint) for participant in self.participants for endpoint in participant.endpoints)

    def participant_of(self, guid: Guid) -> SeenParticipant | None:
        return next((found for found in self.participants if found.prefix == guid.prefix), None)

    def select(self, selection: Selection) -> Census:
        """What is wanted of it.  Where endpoints are selected, participants without any are left out."""
        chosen = []
        for participant in self.participants:
            if selection.has_participant(participant):
                endpoints = tuple(filter(selection.has_endpoint, participant.endpoints))
                if endpoints or not selection.is_of_endpoints:
                    chosen.append(replace(participant, endpoints=endpoints))
        return replace(self, participants=tuple(chosen))


def take_census(participant: DomainParticipant, pairs: Iterable[PairExplanation] = (), left_out: int = 0) -> Census:
    """What ``participant`` knows of the others in its domain; itself it leaves out.

    ``pairs``: who fits whom, and how many more pairs there are; see ``dcps.explaining.pairs_seen``.
    """
    endpoints: list[DiscoveredEndpointData] = [
        *participant.discovered_publications(),
        *participant.discovered_subscriptions(),
    ]
    matches: dict[Guid, list[Guid]] = {data.guid: [] for data in endpoints}
    refused: list[tuple[Guid, Guid]] = []
    is_complete = True
    for pair in pairs:
        writer, reader = pair.writer.guid, pair.reader.guid
        if pair.writer.topic_name != pair.reader.topic_name or writer not in matches or reader not in matches:
            continue  # two topics that were probably meant to be one; the participant's own
        if pair.is_matching:
            matches[writer].append(reader)
            matches[reader].append(writer)
        elif pair.disagreements:
            refused.append((writer, reader))
        else:
            is_complete = False
    by_prefix: dict[GuidPrefix, list[SeenEndpoint]] = {}
    for data in endpoints:
        by_prefix.setdefault(data.guid.prefix, []).append(SeenEndpoint(data, tuple(matches[data.guid])))
    participants = tuple(
        SeenParticipant(data, tuple(by_prefix.get(data.guid.prefix, ())))
        for data in participant.discovered_participants()
    )
    return Census(participant.domain_id, participants, tuple(refused), left_out, is_complete)
