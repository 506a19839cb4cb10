"""A topic's type, for who knows the topic's name and nothing else: found in discovery, fetched, and made a class.

DDS-XTypes 1.3 §7.6.4.  Several endpoints of one topic may announce several types; :func:`find_type` takes the first
that can be had, of writers before readers.  Classes are kept as long as somebody uses them: asking twice gives one.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import trio

from ..structure.discovered import DiscoveredReaderData, DiscoveredWriterData
from ..structure.errors import BadParameter, DdsTimeout, PreconditionNotMet
from .entity import deadline_scope
from .topic_description import check_topic_name
from .type_access import AnnouncedEndpoint, information_of_endpoint

if TYPE_CHECKING:
    from .participant import DomainParticipant

__all__ = ["endpoint_type", "find_type"]

_GRACE_S = 2.0
"""How long somebody who tells the type is waited for, once others were found who do not."""


async def find_type(participant: DomainParticipant, topic_name: str, timeout: float | None) -> type[Any]:
    """See :meth:`DomainParticipant.discover_type`."""
    check_topic_name(topic_name)
    tried: set[tuple[bytes, bytes]] = set()
    reasons: dict[str, None] = {}  # in order, each once

    async def usable() -> type[Any] | None:
        for endpoint in _endpoints(participant, topic_name):
            attempt = (endpoint.guid.prefix, endpoint.type_information)
            if attempt not in tried:
                tried.add(attempt)
                try:
                    return await endpoint_type(participant, endpoint, None)
                except PreconditionNotMet as error:
                    reasons[str(error)] = None
        return None

    with deadline_scope(timeout):
        while True:
            found = await usable()
            if found is not None:
                return found
            if reasons:
                break
            await participant.wait_for_discovery()
        with trio.move_on_after(_GRACE_S):
            while True:
                await participant.wait_for_discovery()
                found = await usable()
                if found is not None:
                    return found
    if reasons:
        raise PreconditionNotMet(f"the type of topic {topic_name!r} cannot be found out: {'; '.join(reasons)}")
    raise DdsTimeout(f"nobody announced a writer or reader of topic {topic_name!r} within {timeout} s")


async def endpoint_type(
    participant: DomainParticipant, endpoint: AnnouncedEndpoint, timeout: float | None
) -> type[Any]:
    """See :meth:`DomainParticipant.endpoint_type`."""
    from ..xtypes import dynamic_type  # few programs meet types that they do not know

    information = information_of_endpoint(endpoint)
    known = participant._dynamic_types
    key = endpoint.type_name, endpoint.type_information
    python_class = known.get(key)
    if python_class is None:
        types = await participant.type_objects(endpoint, timeout=timeout)
        try:
            python_class = dynamic_type(types, type_name=endpoint.type_name, information=information)
        except BadParameter as error:
            raise PreconditionNotMet(
                f"what was told of the type {endpoint.type_name!r} is of no use: {error}"
            ) from error
        known[key] = python_class
    return python_class


def _endpoints(
    participant: DomainParticipant, topic_name: str
) -> Iterable[DiscoveredWriterData | DiscoveredReaderData]:
    """Those of the topic, writers first, and before all others those that tell something of their type."""
    endpoints: list[DiscoveredWriterData | DiscoveredReaderData] = [
        *participant.discovered_publications(),
        *participant.discovered_subscriptions(),
    ]
    found = [endpoint for endpoint in endpoints if endpoint.topic_name == topic_name]
    return sorted(found, key=lambda endpoint: not endpoint.type_information)
