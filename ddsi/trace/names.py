"""Names: short names for the GUIDs in a trace: A, B, ... for participants, topics and builtin topics for endpoints.

They are learnt from what goes by, events and messages alike, so that a trace, or a capture of strangers, explains
itself.  What is learnt comes from the network: every table has a bound, and beyond it things keep their numbers.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..messages.data import Data
from ..messages.submessages import Submessage
from ..structure import builtin_entity_ids as ids
from ..structure.guid import EntityId, Guid, GuidPrefix
from ..structure.locator import Locator
from ..structure.vendor import vendor_name
from .announcement import Announcement, announcement_in
from .event import TraceEvent
from .events import (
    EndpointChanged,
    EndpointCreated,
    EndpointDiscovered,
    ParticipantChanged,
    ParticipantCreated,
    ParticipantDiscovered,
)
from .wording import printable

__all__ = ["BUILTIN_NAMES", "Names", "ParticipantName"]

MAX_PARTICIPANTS = 4096
MAX_ENDPOINTS = 65536

BUILTIN_NAMES: dict[EntityId, str] = {
    entity_id: name
    for name, *entity_ids in (
        ("SPDP", ids.SPDP_WRITER, ids.SPDP_READER),
        ("SEDP pub", ids.SEDP_PUBLICATIONS_WRITER, ids.SEDP_PUBLICATIONS_READER),
        ("SEDP sub", ids.SEDP_SUBSCRIPTIONS_WRITER, ids.SEDP_SUBSCRIPTIONS_READER),
        ("SEDP topic", EntityId(b"\x00\x00\x02\xc2"), EntityId(b"\x00\x00\x02\xc7")),
        ("ParticipantMessage", ids.PARTICIPANT_MESSAGE_WRITER, ids.PARTICIPANT_MESSAGE_READER),
        ("TypeLookup request", ids.TYPE_LOOKUP_REQUEST_WRITER, ids.TYPE_LOOKUP_REQUEST_READER),
        ("TypeLookup reply", ids.TYPE_LOOKUP_REPLY_WRITER, ids.TYPE_LOOKUP_REPLY_READER),
        (
            "TypeLookup request secure",
            ids.TYPE_LOOKUP_REQUEST_SECURE_WRITER,
            ids.TYPE_LOOKUP_REQUEST_SECURE_READER,
        ),
        ("TypeLookup reply secure", ids.TYPE_LOOKUP_REPLY_SECURE_WRITER, ids.TYPE_LOOKUP_REPLY_SECURE_READER),
        ("SPDP secure", ids.SPDP_SECURE_WRITER, ids.SPDP_SECURE_READER),
        ("SEDP pub secure", ids.SEDP_PUBLICATIONS_SECURE_WRITER, ids.SEDP_PUBLICATIONS_SECURE_READER),
        ("SEDP sub secure", ids.SEDP_SUBSCRIPTIONS_SECURE_WRITER, ids.SEDP_SUBSCRIPTIONS_SECURE_READER),
        (
            "ParticipantMessage secure",
            ids.PARTICIPANT_MESSAGE_SECURE_WRITER,
            ids.PARTICIPANT_MESSAGE_SECURE_READER,
        ),
        (
            "Stateless",
            ids.PARTICIPANT_STATELESS_MESSAGE_WRITER,
            ids.PARTICIPANT_STATELESS_MESSAGE_READER,
        ),
        (
            "Volatile secure",
            ids.PARTICIPANT_VOLATILE_MESSAGE_SECURE_WRITER,
            ids.PARTICIPANT_VOLATILE_MESSAGE_SECURE_READER,
        ),
        ("participant", EntityId.PARTICIPANT),
    )
    for entity_id in entity_ids
}
"""The builtin endpoints, writer and reader alike, by the topic they serve; RTPS 2.5 §9.3.1.5."""


@dataclass(slots=True)
class ParticipantName:
    """``letter`` is unique in the trace; the others are empty until they are known."""

    letter: str
    vendor: str = ""
    entity_name: str = ""

    def __str__(self) -> str:
        """``Cyclone DDS "ticker"``"""
        return f'{self.vendor} "{self.entity_name}"' if self.entity_name else self.vendor


class Names:
    """Who is who so far.  Letters are given in the order in which prefixes are first seen."""

    def __init__(self) -> None:
        self.participants: dict[GuidPrefix, ParticipantName] = {}
        self._endpoints: dict[Guid, str] = {}
        self._endpoint_counts: dict[tuple[GuidPrefix, bool, str], int] = {}
        self._locators: dict[Locator, GuidPrefix] = {}

    def participant(self, prefix: GuidPrefix) -> ParticipantName:
        """The participant's name, given to it now if it has none yet.

        Beyond MAX_PARTICIPANTS the name is its prefix, and is not kept.
        """
        known = self.participants.get(prefix)
        if known is None:
            if len(self.participants) >= MAX_PARTICIPANTS:
                return ParticipantName(str(prefix))
            known = self.participants[prefix] = ParticipantName(_letter(len(self.participants)))
        return known

    def letter(self, prefix: GuidPrefix) -> str:
        return self.participant(prefix).letter

    def entity(self, prefix: GuidPrefix, entity_id: EntityId) -> str:
        """A builtin endpoint's topic, the topic of an endpoint that was announced, or ``writer 1``."""
        known = self._endpoints.get(Guid.of(prefix, entity_id)) or BUILTIN_NAMES.get(entity_id)
        if known is not None:
            return known
        role = "writer" if entity_id.is_writer else "reader" if entity_id.is_reader else "entity"
        return f"{role} {int.from_bytes(entity_id[:3], 'big'):x}"

    def knows(self, prefix: GuidPrefix, entity_id: EntityId) -> bool:
        """Has the entity a name better than its number?"""
        return entity_id in BUILTIN_NAMES or Guid.of(prefix, entity_id) in self._endpoints

    def guid(self, guid: Guid) -> str:
        """An entity with its participant: ``Square@B``, and ``B`` for a participant itself."""
        letter = self.letter(guid.prefix)
        return (
            letter if guid.entity_id == EntityId.PARTICIPANT else f"{self.entity(guid.prefix, guid.entity_id)}@{letter}"
        )

    def participant_at(self, locator: Locator) -> GuidPrefix | None:
        """Who announced that it receives there."""
        return self._locators.get(locator)

    def learn_event(self, event: TraceEvent) -> None:
        """Take from an event whatever names it holds; the messages in events are ``learn_submessage``'s."""
        self.participant(event.participant)
        match event:
            case ParticipantCreated(_, prefix, _, vendor_id, entity_name):
                self._learn_participant(prefix, vendor_id, entity_name)
            case ParticipantDiscovered() | ParticipantChanged():
                self._learn_participant(event.remote.prefix, event.vendor_id, event.entity_name)
                self._learn_locators(event.remote.prefix, event.locators)
            case EndpointCreated() | EndpointDiscovered() | EndpointChanged():
                self._learn_endpoint(event.endpoint, event.topic_name)

    def learn_header(self, prefix: GuidPrefix, vendor_id: bytes) -> None:
        """Take the vendor from a message's header, unless it is known."""
        if not self.participant(prefix).vendor:
            self._learn_participant(prefix, vendor_id, "")

    def learn_submessage(self, submessage: Submessage) -> None:
        """Take from SPDP and SEDP what they announce."""
        announced = announcement_in(submessage) if isinstance(submessage, Data) else None
        if announced is not None:
            self._learn_announcement(announced)

    def _learn_announcement(self, announced: Announcement) -> None:
        prefix = announced.guid.prefix
        if announced.guid.entity_id != EntityId.PARTICIPANT:
            self._learn_endpoint(announced.guid, announced.topic_name)
            return
        if announced.entity_name:
            self.participant(prefix).entity_name = printable(announced.entity_name)
        self._learn_locators(prefix, announced.unicast)

    def _learn_participant(self, prefix: GuidPrefix, vendor_id: bytes, entity_name: str) -> None:
        participant = self.participant(prefix)
        participant.vendor = vendor_name(vendor_id)
        participant.entity_name = printable(entity_name)

    def _learn_locators(self, prefix: GuidPrefix, locators: tuple[Locator, ...]) -> None:
        for locator in locators:
            if not locator.is_multicast and (locator in self._locators or len(self._locators) < MAX_PARTICIPANTS):
                self._locators[locator] = prefix

    def _learn_endpoint(self, guid: Guid, topic_name: str) -> None:
        """An endpoint is called after its topic; a second writer (or reader) of it there gets a number."""
        if not topic_name or guid in self._endpoints or len(self._endpoints) >= MAX_ENDPOINTS:
            return
        topic = printable(topic_name)
        key = (guid.prefix, guid.entity_id.is_writer, topic)
        number = self._endpoint_counts[key] = self._endpoint_counts.get(key, 0) + 1
        self._endpoints[guid] = topic if number == 1 else f"{topic}({number})"


def _letter(index: int) -> str:
    """A to Z, then AA, AB, ..."""
    letters = ""
    index += 1
    while index:
        index, digit = divmod(index - 1, 26)
        letters = chr(ord("A") + digit) + letters
    return letters
