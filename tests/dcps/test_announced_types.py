"""``Config.announce_types``: whether peers are told what types are made of."""

from __future__ import annotations

import ddsi
from ddsi.xtypes.type_object import decode_type_information

from .running import Note, Shape, domain, eventually, in_trio, pair

__all__ = ["domain"]


@in_trio
async def test_types_are_announced_on_demand(domain: int) -> None:
    """By writers and readers, keyed and keyless; what arrives is what ``ddsi.type_information`` says."""
    for kind in (Shape, Note):
        async with pair(domain, kind=kind, announce_types=True) as both:
            await eventually(both.here.discovered_subscriptions)
            await eventually(both.there.discovered_publications)
            for data in (*both.here.discovered_subscriptions(), *both.there.discovered_publications()):
                assert decode_type_information(data.type_information) == ddsi.type_information(kind)


@in_trio
async def test_types_are_matched_by_name_otherwise(domain: int) -> None:
    """Peers that know other hashes of the type would ask for TypeObjects, and nobody would answer."""
    async with pair(domain) as both:
        for data in (*both.here.discovered_subscriptions(), *both.there.discovered_publications()):
            assert data.type_information == b""
