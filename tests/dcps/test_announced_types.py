"""What peers are told of types, and what applications learn of theirs.  DDS-XTypes 1.3 §7.6.3."""

from __future__ import annotations

from dataclasses import replace

import pytest

import ddsi
from ddsi import idl
from ddsi.xtypes.type_object import HashIdentifier, decode_type_information, describe
from ddsi.xtypes.type_object.identifiers import PrimitiveIdentifier
from ddsi.xtypes.type_object.kinds import TypeKind
from ddsi.xtypes.type_support import type_support

from .running import Note, Shape, domain, eventually, in_trio, pair

__all__ = ["domain"]


@idl.struct
class Point:
    x: idl.float64
    y: idl.float64


@idl.struct
class Route:
    name: str
    points: idl.sequence[Point]


@in_trio
async def test_types_are_announced(domain: int) -> None:
    """By writers and readers, keyed and keyless; what arrives is what ``ddsi.type_information`` says."""
    for kind in (Shape, Note):
        async with pair(domain, kind=kind) as both:
            await eventually(both.here.discovered_subscriptions)
            await eventually(both.there.discovered_publications)
            for data in (*both.here.discovered_subscriptions(), *both.there.discovered_publications()):
                assert decode_type_information(data.type_information) == ddsi.type_information(kind)


@in_trio
async def test_types_are_matched_by_name_on_demand(domain: int) -> None:
    async with pair(domain, announce_types=False) as both:
        for data in (*both.here.discovered_subscriptions(), *both.there.discovered_publications()):
            assert data.type_information == b""
        with pytest.raises(ddsi.PreconditionNotMet, match="announces no type information, but only the type's name"):
            await both.there.type_objects(both.there.discovered_publications()[0])


@in_trio
async def test_the_type_of_an_endpoint_is_fetched_with_all_that_it_needs(domain: int) -> None:
    """The other process may know nothing of the type: here it has no endpoint of the topic."""
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as there:
        ddsi.DataWriter(here, ddsi.Topic(here, "Route", Route))
        await eventually(there.discovered_publications)
        (endpoint,) = there.discovered_publications()
        types = await there.type_objects(endpoint)
        assert types == describe(type_support(Route).struct).complete
        assert await there.type_object(types.root, endpoint.guid) == types.objects[types.root]
        minimal = ddsi.type_information(Route).minimal
        assert not (await there.type_object(minimal, endpoint.guid)).is_complete


@in_trio
async def test_what_cannot_be_fetched_is_refused_with_its_reason(domain: int) -> None:
    async with pair(domain) as both:
        (endpoint,) = both.there.discovered_publications()
        unknown = HashIdentifier(0xF2, bytes(14))
        with pytest.raises(ddsi.PreconditionNotMet, match="did not give the TypeObject"):
            await both.there.type_object(unknown, endpoint.guid)
        with pytest.raises(ddsi.PreconditionNotMet, match="answers no questions about types"):
            await both.there.type_object(unknown, ddsi.Guid(bytes(16)))
        with pytest.raises(ddsi.BadParameter, match="says itself what type it is"):
            await both.there.type_object(PrimitiveIdentifier(TypeKind.INT32), endpoint.guid)
        with pytest.raises(ddsi.PreconditionNotMet, match="is none"):
            await both.there.type_objects(replace(endpoint, type_information=b"nonsense"))
        with pytest.raises(ddsi.DdsTimeout, match="within 0 s"):
            await both.there.type_object(HashIdentifier(0xF1, bytes(14)), endpoint.guid, timeout=0)
