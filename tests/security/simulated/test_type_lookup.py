"""Types between secured participants are asked for and told on the secure topics (DDS-Security 1.2 §7.5.9)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from ddsi import idl
from ddsi.discovery.type_lookup import GetTypes, TypeLookupRequest, encode_request
from ddsi.simulation import Domain, Node
from ddsi.structure import builtin_entity_ids as ids
from ddsi.structure.builtin_entity_ids import BuiltinEndpoints
from ddsi.structure.cache_change import CacheChange, ChangeKind
from ddsi.structure.discovered import DiscoveredParticipantData
from ddsi.structure.guid import EntityId, Guid
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import Reliable
from ddsi.trace.reasons import DropReason
from ddsi.xtypes.type_object import TypeDescription
from ddsi.xtypes.type_support import type_support

from .keystores import make_identities

RELIABLE = Qos(reliability=Reliable())
SECURE_BITS = BuiltinEndpoints(0xF << 32)


@idl.struct(typename="T")
class Old:
    secret_member: idl.int32


@idl.struct(typename="T")
class New:
    secret_member: idl.int32
    other_secret: str = ""


def of(class_: type[Any]) -> TypeDescription:
    return type_support(class_).type_description


def written(node: Node, writer_id: EntityId) -> int:
    """How many questions, or answers."""
    writer = node.engine.builtin.writer(writer_id)
    assert writer is not None
    return writer.behavior.cache.last_sn


@pytest.mark.parametrize("governance", ["encrypt", "encrypt all", "sign", "payload", "nothing"])
def test_types_travel_on_the_secure_topics(tmp_path: Path, governance: str) -> None:
    alice, bob, _ = make_identities(tmp_path, governance)
    domain = Domain()
    on_the_wire: list[bytes] = []
    domain.network.watch = lambda sender, octets: on_the_wire.append(bytes(octets))
    here, there = domain.node(properties=alice), domain.node(properties=bob)
    writer = here.writer("Square", RELIABLE, types=of(New))
    reader = there.reader("Square", RELIABLE, types=of(Old))
    assert domain.run_until(lambda: bool(writer.local.behavior.readers and reader.local.behavior.writers), 20)
    for node in (here, there):
        assert written(node, ids.TYPE_LOOKUP_REQUEST_SECURE_WRITER) == 1
        assert written(node, ids.TYPE_LOOKUP_REQUEST_WRITER) == written(node, ids.TYPE_LOOKUP_REPLY_WRITER) == 0
    fetched = there.engine.types.fetch_all(writer.local.guid, of(New).complete.root, of(New).information, there.now)
    assert fetched is None, "the complete type, with its names, is asked for"
    there.pump()
    domain.run(2)
    is_readable = any(b"other_secret" in octets for octets in on_the_wire)
    assert is_readable == (governance in ("sign", "payload", "nothing"))


def test_who_could_ask_in_secret_is_not_answered_in_clear(tmp_path: Path) -> None:
    alice, bob, _ = make_identities(tmp_path, "encrypt")
    domain = Domain()
    here, there = domain.node(properties=alice), domain.node(properties=bob)
    here.writer("Square", RELIABLE, types=of(New))
    domain.run(5)
    engine, asker = here.engine, Guid.of(there.engine.guid.prefix, ids.TYPE_LOOKUP_REQUEST_WRITER)
    request = TypeLookupRequest((asker, 1), "", GetTypes((of(New).minimal.root,)))
    change = CacheChange(ChangeKind.ALIVE, asker, 1, encode_request(request))
    engine.types.receive_request(change, here.now, is_secure=False)
    assert written(here, ids.TYPE_LOOKUP_REPLY_WRITER) == 0
    assert engine.drops[DropReason.CLEAR_TEXT] == 1


def test_a_peer_without_the_secure_topics_is_asked_and_answered_in_clear(tmp_path: Path) -> None:
    """As Cyclone DDS and Fast DDS: otherwise types that differ a little would not match."""
    alice, bob, _ = make_identities(tmp_path, "encrypt")
    domain = Domain()
    here, there = domain.node(properties=alice), domain.node(properties=bob)
    domain.run(5)
    for node, other in ((here, there), (there, here)):
        proxy = node.engine.participants[other.engine.guid.prefix]
        proxy.data = _without(proxy.data)
    writer = here.writer("Square", RELIABLE, types=of(New))
    reader = there.reader("Square", RELIABLE, types=of(Old))
    assert domain.run_until(lambda: bool(writer.local.behavior.readers and reader.local.behavior.writers), 20)
    assert written(here, ids.TYPE_LOOKUP_REPLY_WRITER) == written(there, ids.TYPE_LOOKUP_REPLY_WRITER) == 1


def _without(data: DiscoveredParticipantData) -> DiscoveredParticipantData:
    return replace(data, builtin_endpoints=data.builtin_endpoints & ~SECURE_BITS)
