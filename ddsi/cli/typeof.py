"""``ddsi typeof``: what a topic's samples are made of, as IDL, by those who write and read it.

The type is fetched from whoever announces it (DDS-XTypes 1.3 §7.6.3.3).  The output is IDL as a whole: what is no IDL
stands in comments, so that ``ddsi typeof Square > square.idl`` gives a file to compile.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from fnmatch import fnmatchcase
from typing import Any

import trio

from ..dcps import DomainParticipant
from ..structure.discovered import DiscoveredReaderData, DiscoveredWriterData
from ..structure.errors import BadParameter, DdsTimeout, MalformedMessage, PreconditionNotMet
from ..xtypes import idl
from ..xtypes.type_object import TypeIdentifier, decode_type_information, encode_identifier
from ..xtypes.type_object.identifiers import PrimitiveIdentifier
from .arguments import add_domain, add_json, add_listening
from .census import Census, SeenEndpoint, SeenParticipant, take_census
from .census_tables import who
from .exit_status import ExitStatus
from .listening import listen
from .runner import run as run_async
from .tables import shown
from .topic_session import add_security, participant_qos

__all__ = ["SUMMARY", "add_arguments", "run"]

SUMMARY = "show the IDL of a topic's type, as those who use it announce it"

_FETCHING_S = 10.0
_MOST_NAMED = 8
_MOST_ASKED = 3
"""Participants, for one type."""
_MOST_TYPES = 64
_ADVICE = "Take its IDL from whoever made it; then --type FILE.idl::NAME tells `ddsi echo` and `ddsi pub`."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("topic", metavar="TOPIC", help="the topic's name, or a pattern as in a shell: * ? [abc]")
    add_domain(parser)
    add_listening(parser)
    add_json(parser)
    add_security(parser)


def run(arguments: argparse.Namespace) -> int:
    return run_async(lambda: _show(arguments))


async def _show(arguments: argparse.Namespace) -> int:
    qos = participant_qos(arguments, "ddsi typeof")
    async with DomainParticipant(arguments.domain, qos=qos) as participant:
        await listen(participant, arguments.time)
        found = announced_types(take_census(participant), arguments.topic)
        async with trio.open_nursery() as nursery:
            for announced in found:
                nursery.start_soon(announced.fetch, participant)
    if arguments.json:
        document = {"domain_id": arguments.domain, "topic": arguments.topic, "types": [one.json() for one in found]}
        print(json.dumps(document, indent=2))
    elif found:
        print("\n".join(line for one in found for line in one.lines()))
    else:
        print(f"// Nobody was seen with a writer or reader of {shown(arguments.topic)}.")
        print("// `ddsi ls topics` shows what there is.")
    return ExitStatus.OK if found and all(one.idl for one in found) else ExitStatus.NOT_AS_HOPED


def announced_types(census: Census, topic: str) -> list[AnnouncedType]:
    """The types of the topic that has this name, or of all that fit the pattern; different ones apart, 64 at most."""
    endpoints = list(census.endpoints())
    names = {endpoint.data.topic_name for _, endpoint in endpoints}
    chosen = {topic} if topic in names else {name for name in names if fnmatchcase(name, topic)}
    found: dict[tuple[str, str, bytes], AnnouncedType] = {}
    for participant, endpoint in endpoints:
        data = endpoint.data
        if data.topic_name in chosen:
            key = data.topic_name, data.type_name, data.type_information
            found.setdefault(key, AnnouncedType(*key)).endpoints.append((participant, endpoint))
    return sorted(found.values(), key=lambda one: (one.topic, one.type_name, not one.information))[:_MOST_TYPES]


class AnnouncedType:
    """A type by which endpoints announce a topic.  Where its ``idl`` is None, ``reason`` says why."""

    def __init__(self, topic: str, type_name: str, information: bytes) -> None:
        self.topic = topic
        self.type_name = type_name
        self.information = information
        self.endpoints: list[tuple[SeenParticipant, SeenEndpoint]] = []
        self.idl: str | None = None
        self.reason = ""

    async def fetch(self, participant: DomainParticipant) -> None:
        """Ask those who announce it, one after the other, until one answers."""
        asked: set[bytes] = set()
        for _, endpoint in self.endpoints:
            data = endpoint.data
            if data.guid.prefix in asked or not isinstance(data, (DiscoveredWriterData, DiscoveredReaderData)):
                continue
            asked.add(data.guid.prefix)
            if len(asked) > _MOST_ASKED:
                return
            try:
                self.idl = idl.to_idl(await participant.endpoint_type(data, timeout=_FETCHING_S))
                return
            except (PreconditionNotMet, DdsTimeout, BadParameter) as error:
                self.reason = self.reason or str(error)

    def identifiers(self) -> dict[str, TypeIdentifier]:
        """``minimal`` and ``complete``, as far as they are announced."""
        try:
            information = decode_type_information(self.information)
        except MalformedMessage:
            return {}
        both = {"minimal": information.minimal, "complete": information.complete}
        return {kind: one for kind, one in both.items() if not isinstance(one, PrimitiveIdentifier)}

    # --- for people --------------------------------------------------------------------------------------

    def lines(self) -> Iterator[str]:
        yield f"// Topic {shown(self.topic)}, type {shown(self.type_name)}"
        identifiers = ", ".join(f"{kind} {identifier.hex()}" for kind, identifier in self.identifiers().items())
        yield f"//   {identifiers or 'no type information'}"
        for participant, endpoint in self.endpoints[:_MOST_NAMED]:
            yield f"//   {endpoint.kind} {endpoint.data.guid} of {who(participant)}"
        if len(self.endpoints) > _MOST_NAMED:
            yield f"//   and {len(self.endpoints) - _MOST_NAMED} more"
        if self.idl is not None:
            if "complete" not in self.identifiers():
                yield "//   which tell no names: types are called by their hashes here, members by their ids"
            yield self.idl
            return
        yield f"// Its IDL is not to be had: {shown(self.reason)}."
        yield f"// {_ADVICE}"
        yield ""

    # --- for programs ------------------------------------------------------------------------------------

    def json(self) -> dict[str, Any]:
        return {
            "topic": self.topic,
            "type": self.type_name,
            "identifiers": {kind: encode_identifier(one).hex() for kind, one in self.identifiers().items()},
            "idl": self.idl,
            "reason": "" if self.idl is not None else self.reason,
            "endpoints": [
                {
                    "kind": endpoint.kind,
                    "guid": str(endpoint.data.guid),
                    "vendor": participant.vendor,
                    "entity_name": participant.data.entity_name,
                    "host": participant.host,
                    "pid": participant.pid,
                }
                for participant, endpoint in self.endpoints
            ],
        }
