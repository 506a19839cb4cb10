"""TypeAnswers: what others are told of our types when they ask (DDS-XTypes 1.3 §7.6.3.3.4).

Only our own types are told, so that nobody can use us to send others what a third party said.  Whoever may ask is
matched with our endpoints of the service: known, heard from where it says it is, and admitted by security.  An answer
never exceeds a bound, and neither do the answers that one participant leaves unacknowledged; questions beyond that are
dropped and counted, and asked again by who meant them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..discovery.type_lookup import (
    FoundDependencies,
    FoundTypes,
    GetDependencies,
    GetTypes,
    TypeLookupReply,
    decode_request,
    encode_reply,
)
from ..structure import builtin_entity_ids as ids
from ..structure.builtin_entity_ids import BuiltinEndpoints
from ..structure.cache_change import CacheChange, ChangeKind
from ..structure.errors import MalformedMessage
from ..structure.guid import EntityId, Guid
from ..trace.reasons import DropReason
from ..xtypes.type_object import HashedIdentifier, TypeIdentifier
from ..xtypes.type_object.information import SizedIdentifier
from ..xtypes.type_object.references import hashes_in
from .type_quirks import knows_old_kinds_alone
from .type_registry import TypeRegistry

if TYPE_CHECKING:
    from .participant import Participant

__all__ = ["MOST_ANSWER_OCTETS", "MOST_UNACKNOWLEDGED", "TypeAnswers"]

MOST_ANSWER_OCTETS = 1 << 20
"""Of TypeObjects in one answer; the first is sent whatever its size."""

MOST_UNACKNOWLEDGED = 16
"""Answers that one participant may have under way."""

_PAGE = 256
"""Dependencies in one answer."""


class TypeAnswers:
    """Of one participant."""

    def __init__(self, engine: Participant, registry: TypeRegistry) -> None:
        self._engine = engine
        self._registry = registry
        self._under_way: dict[bytes, list[tuple[EntityId, int]]] = {}

    def receive_request(self, change: CacheChange, now: float, *, is_secure: bool) -> None:
        """A question; every one gets an answer, though it may be that there is nothing.

        The answer goes to who wrote the question.  Who that is by the question's own id does not matter: Cyclone DDS
        0.10 swaps the octets of its Guid there.
        """
        engine = self._engine
        prefix = change.writer_guid.prefix
        if change.kind is not ChangeKind.ALIVE:
            return
        try:
            request = decode_request(change.payload)
        except MalformedMessage as error:
            engine.dropped_discovery(change, str(error))
            return
        writer_id = ids.TYPE_LOOKUP_REPLY_SECURE_WRITER if is_secure else ids.TYPE_LOOKUP_REPLY_WRITER
        if not is_secure and self._has_secure(prefix):
            engine.dropped(DropReason.CLEAR_TEXT, None, f"{change.writer_guid} asks in clear, and need not")
        elif not self._may_answer(prefix):
            engine.dropped(DropReason.RATE_LIMITED, None, f"{change.writer_guid} acknowledges no answers")
        else:
            self._answer(
                writer_id, prefix, TypeLookupReply(request.request_id, self._result(request.call, prefix)), now
            )

    def participant_lost(self, prefix: bytes) -> None:
        self._under_way.pop(prefix, None)

    def _has_secure(self, prefix: bytes) -> bool:
        """Does it have the secure endpoints, as we have?"""
        proxy = self._engine.participants.get(prefix)
        ours = self._engine.builtin.reader(ids.TYPE_LOOKUP_REQUEST_SECURE_READER) is not None
        bit = BuiltinEndpoints.TYPE_LOOKUP_REQUEST_SECURE_WRITER
        return ours and proxy is not None and bit in proxy.data.builtin_endpoints

    def _may_answer(self, prefix: bytes) -> bool:
        """Are few enough answers to it under way?"""
        waiting = self._under_way.get(prefix, [])
        builtin = self._engine.builtin
        waiting[:] = [
            (writer_id, number)
            for writer_id, number in waiting
            if (writer := builtin.writer(writer_id)) is not None and writer.behavior.cache.get(number) is not None
        ]
        return len(waiting) < MOST_UNACKNOWLEDGED

    def _answer(self, writer_id: EntityId, prefix: bytes, reply: TypeLookupReply, now: float) -> None:
        writer = self._engine.builtin.writer(writer_id)
        if writer is None or not any(guid.startswith(prefix) for guid in writer.behavior.readers):
            return  # it does not listen, or not yet; it will ask again
        destination = Guid.of(prefix, EntityId.PARTICIPANT)
        change = self._engine.write(writer, ChangeKind.ALIVE, encode_reply(reply), b"", now, destination=destination)
        self._under_way.setdefault(prefix, []).append((writer_id, change.sequence_number))

    def _result(self, call: GetTypes | GetDependencies, prefix: bytes) -> FoundTypes | FoundDependencies:
        if isinstance(call, GetTypes):
            proxy = self._engine.participants.get(prefix)
            is_old = proxy is not None and knows_old_kinds_alone(proxy.data)
            registry = self._registry
            return self._types([one for one in call.type_ids if not (is_old and registry.has_new_kinds(one))])
        return self._dependencies(call.type_ids, call.continuation_point)

    def _types(self, type_ids: Sequence[TypeIdentifier]) -> FoundTypes:
        found: list[tuple[TypeIdentifier, bytes]] = []
        room = MOST_ANSWER_OCTETS
        for identifier in dict.fromkeys(type_ids):
            octets = self._registry.own_octets(identifier)
            if octets is None:
                continue
            room -= len(octets)
            if room < 0 and found:
                break
            found.append((identifier, octets))
        return FoundTypes(tuple(found), self._registry.minimal_of(identifier for identifier, _ in found))

    def _dependencies(self, type_ids: tuple[TypeIdentifier, ...], continuation_point: bytes) -> FoundDependencies:
        """One page.  The order is always the same, so a number suffices to say where the next begins."""
        begin = int.from_bytes(continuation_point[:4], "big")
        needed: dict[HashedIdentifier, bytes] = {}
        asked = dict.fromkeys(one for identifier in type_ids for one in hashes_in(identifier))
        for identifier in asked:
            if identifier not in needed and self._registry.own_octets(identifier) is not None:
                needed |= self._registry.collect(identifier, b"")[0].octets
        listed = [SizedIdentifier(one, len(octets)) for one, octets in needed.items() if one not in asked]
        is_last = begin + _PAGE >= len(listed)
        return FoundDependencies(
            tuple(listed[begin : begin + _PAGE]), b"" if is_last else (begin + _PAGE).to_bytes(4, "big")
        )
