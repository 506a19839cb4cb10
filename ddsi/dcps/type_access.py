"""What types on the network are made of, for applications: TypeObjects, fetched from those who announced them.

DDS-XTypes 1.3 §7.6.3.3 (the builtin TypeLookup service).  How to use it::

    endpoint = participant.discovered_publications()[0]  # or subscriptions; or a sample of the builtin topics
    types = await participant.type_objects(endpoint)  # asks the endpoint's participant where it must
    types.root  # the complete TypeIdentifier of the topic's type
    types.objects[types.root].body  # StructObject: members, names, types
    types.objects, types.octets  # it and all types that it needs, by identifier

    await participant.type_object(identifier, endpoint.guid)  # one TypeObject alone; minimal or complete

:func:`ddsi.xtypes.type_object.decode_type_information` reads ``endpoint.type_information``, the octets that were
announced.  ``types`` is a :class:`~ddsi.xtypes.type_object.BuiltTypes`, as ``describe(...)`` makes of a type of this
program, so what works with one works with the other.  What a peer said is decoded, bounded, and no other than the
identifiers name; but it is still a stranger's: names in it may be anything that can be printed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeVar

import trio

from ..structure.builtin_topic_data import PublicationBuiltinTopicData, SubscriptionBuiltinTopicData
from ..structure.discovered import DiscoveredReaderData, DiscoveredWriterData
from ..structure.errors import BadParameter, DdsTimeout, MalformedMessage, PreconditionNotMet
from ..structure.guid import Guid
from ..xtypes.type_object import (
    BuiltTypes,
    ComponentIdentifier,
    HashedIdentifier,
    HashIdentifier,
    TypeIdentifier,
    TypeInformation,
    TypeObject,
    decode_type_information,
)
from .entity import deadline_scope

if TYPE_CHECKING:
    from .participant import DomainParticipant

__all__ = ["AnnouncedEndpoint", "fetch_type_object", "fetch_type_objects", "information_of_endpoint"]

AnnouncedEndpoint = (
    DiscoveredWriterData | DiscoveredReaderData | PublicationBuiltinTopicData | SubscriptionBuiltinTopicData
)
"""Whatever tells of a remote endpoint."""

T = TypeVar("T")


async def fetch_type_objects(
    participant: DomainParticipant, endpoint: AnnouncedEndpoint, timeout: float | None
) -> BuiltTypes:
    """See :meth:`DomainParticipant.type_objects`."""
    guid = endpoint.guid if isinstance(endpoint, (DiscoveredWriterData, DiscoveredReaderData)) else endpoint.key
    information = information_of_endpoint(endpoint)
    root = next((one for one in (information.complete, information.minimal) if _is_hashed(one)), None)
    if not isinstance(root, (HashIdentifier, ComponentIdentifier)):
        raise PreconditionNotMet(f"what {guid} announces of its type {endpoint.type_name!r} names no TypeObject")
    needed: HashedIdentifier = root
    engine = participant._running_pump().engine
    return await _fetched(
        participant,
        lambda now: engine.types.fetch_all(guid, needed, information, now),
        f"the type {endpoint.type_name!r} of topic {endpoint.topic_name!r}",
        timeout,
    )


async def fetch_type_object(
    participant: DomainParticipant, identifier: TypeIdentifier, owner: Guid, timeout: float | None
) -> TypeObject:
    """See :meth:`DomainParticipant.type_object`."""
    if not isinstance(identifier, (HashIdentifier, ComponentIdentifier)):
        raise BadParameter(f"{identifier!r} stands for no TypeObject: it says itself what type it is")
    needed: HashedIdentifier = identifier
    engine = participant._running_pump().engine
    return await _fetched(
        participant, lambda now: engine.types.fetch(owner, needed, now), f"the type {identifier!r}", timeout
    )


async def _fetched(
    participant: DomainParticipant, ask: Callable[[float], T | str | None], what: str, timeout: float | None
) -> T:
    """What ``ask`` returns once it is there: None while it is under way, a str where it will not come."""
    pump = participant._running_pump()
    await trio.lowlevel.checkpoint()
    with deadline_scope(timeout):
        while True:
            answer = ask(pump.now())
            pump.settle()
            if isinstance(answer, str):
                raise PreconditionNotMet(f"{what} cannot be fetched: {answer}")
            if answer is not None:
                return answer
            await participant.wait_for_discovery()
    raise DdsTimeout(f"{what} did not come within {timeout} s")


def information_of_endpoint(endpoint: AnnouncedEndpoint) -> TypeInformation:
    """What it announces of its type.  PreconditionNotMet where that is nothing."""
    if not endpoint.type_information:
        raise PreconditionNotMet(
            f"the endpoint of topic {endpoint.topic_name!r} announces no type information, but only the type's name, "
            f"{endpoint.type_name!r}"
        )
    try:
        return decode_type_information(endpoint.type_information)
    except MalformedMessage as error:
        raise PreconditionNotMet(
            f"what the endpoint of topic {endpoint.topic_name!r} announces as type information is none: {error}"
        ) from error


def _is_hashed(identifier: TypeIdentifier) -> bool:
    return isinstance(identifier, (HashIdentifier, ComponentIdentifier))
