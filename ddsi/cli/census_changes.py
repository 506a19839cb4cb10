"""What is new between two censuses, one line each: for ``ddsi ls --watch`` where there is no terminal to redraw."""

from __future__ import annotations

from collections.abc import Iterator

from .census import Census, SeenEndpoint, SeenParticipant
from .census_tables import locators_text, who
from .qos_words import qos_words
from .tables import shown

__all__ = ["changes"]


def changes(before: Census, after: Census) -> Iterator[str]:
    """``+`` came, ``-`` went, ``~`` announces something else, or fits others than before."""
    old = {participant.data.guid: participant for participant in before.participants}
    new = {participant.data.guid: participant for participant in after.participants}
    for guid, participant in new.items():
        if guid not in old:
            yield f"+ {_participant_text(participant)}"
        elif participant.data != old[guid].data:
            yield f"~ {_participant_text(participant)}"
    yield from _endpoint_changes(before, after)
    for guid, participant in old.items():
        if guid not in new:
            yield f"- {_participant_text(participant)}"


def _endpoint_changes(before: Census, after: Census) -> Iterator[str]:
    old = {endpoint.data.guid: endpoint for _, endpoint in before.endpoints()}
    new = {endpoint.data.guid: endpoint for _, endpoint in after.endpoints()}
    for guid, endpoint in new.items():
        if guid not in old:
            yield f"+ {_endpoint_text(endpoint)}"
        elif endpoint != old[guid]:
            yield f"~ {_endpoint_text(endpoint)}"
    for guid, endpoint in old.items():
        if guid not in new:
            yield f"- {_endpoint_text(endpoint)}"


def _participant_text(participant: SeenParticipant) -> str:
    address = locators_text(participant.data.metatraffic_unicast or participant.data.default_unicast)
    return f"participant {participant.prefix} {who(participant)} at {address or 'no address'}"


def _endpoint_text(endpoint: SeenEndpoint) -> str:
    data = endpoint.data
    fits = f"fits {len(endpoint.matches)}"
    return f"{endpoint.kind} {data.guid} {shown(data.topic_name)} {shown(data.type_name)} {fits}: {qos_words(data.qos)}"
