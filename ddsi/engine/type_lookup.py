"""TypeLookup: asks other participants what types are made of, and answers them.

DDS-XTypes 1.3 §7.6.3.3; the messages are those of ``discovery.type_lookup``, what is learnt goes into the registry.

A participant is asked one question at a time, for all types that are wanted of it, and again with the next when it has
answered: a TypeObject names the types that it needs.  The service is reliable, but the server's answers are volatile
and may come before we are matched with their writer; so a question is repeated.  What was not answered, or not with
what was asked for, counts as unavailable for a while, so that nobody can make us ask for ever; matching then goes by
names.

To a participant that has the secure endpoints (DDS-Security 1.2 §7.5.9) everything goes by those, as long as we have
them too, and it is answered there alone.  Cyclone DDS and Fast DDS have none: with them, types are exchanged in clear
whatever governance says of discovery, or not at all.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

from ..discovery.type_lookup import (
    FoundDependencies,
    FoundTypes,
    GetDependencies,
    GetTypes,
    TypeLookupReply,
    TypeLookupRequest,
    decode_reply,
    encode_request,
    instance_name,
)
from ..structure import builtin_entity_ids as ids
from ..structure.builtin_entity_ids import BuiltinEndpoints
from ..structure.cache_change import CacheChange, ChangeKind
from ..structure.errors import MalformedMessage
from ..structure.guid import EntityId, Guid
from ..trace.reasons import DropReason
from ..xtypes.type_object import (
    BuiltTypes,
    HashedIdentifier,
    TypeDescription,
    TypeIdentifier,
    TypeInformation,
    TypeObject,
)
from ..xtypes.type_object.references import hashed_only
from .type_answers import TypeAnswers
from .type_registry import MOST_NEEDED, TypeRegistry

if TYPE_CHECKING:
    from .participant import Participant

__all__ = ["TypeLookup"]

_PATIENCE_S = (0.5, 1.0, 2.0)
"""How long each attempt at a question waits for the answer."""
_UNAVAILABLE_S = 60.0
_MOST_IN_QUESTION = 64
_MOST_PAGES = 32
"""How many parts a list of dependencies may have; each has its own question."""

_PLAIN = BuiltinEndpoints.TYPE_LOOKUP_REQUEST_READER | BuiltinEndpoints.TYPE_LOOKUP_REPLY_WRITER
_SECURE = BuiltinEndpoints.TYPE_LOOKUP_REQUEST_SECURE_READER | BuiltinEndpoints.TYPE_LOOKUP_REPLY_SECURE_WRITER


class _Inquiry:
    """What is wanted of one participant, and how far the asking is.

    ``numbers``: those of the question's attempts; an answer to any of them serves.  ``lists``: the types of which it is
    to say first what they need, with the place where it is to go on.
    """

    __slots__ = ("asked", "attempt", "lists", "numbers", "pages", "unavailable", "wanted")

    def __init__(self) -> None:
        self.wanted: dict[HashedIdentifier, None] = {}  # a dict serves as an ordered set
        self.lists: dict[HashedIdentifier, bytes] = {}
        self.asked: GetTypes | GetDependencies | None = None
        self.attempt = 0
        self.numbers: list[int] = []
        self.pages = 0
        self.unavailable: dict[HashedIdentifier, float] = {}  # until when


class TypeLookup:
    """Of one participant."""

    def __init__(self, engine: Participant) -> None:
        self._engine = engine
        self.registry = TypeRegistry()
        self._answers = TypeAnswers(engine, self.registry)
        self.receive_request = self._answers.receive_request
        self._inquiries: dict[bytes, _Inquiry] = {}

    def announced(self, description: TypeDescription | None) -> bytes:
        """What an endpoint of ours says of its type: its TypeInformation, about which others may ask; or nothing."""
        if description is None:
            return b""
        self.registry.add_own(description)
        return description.information.encode()

    # --- what is wanted ----------------------------------------------------------------------------------

    def fetch(self, owner: Guid, identifier: HashedIdentifier, now: float) -> TypeObject | str | None:
        """The TypeObject; None while the participant that ``owner`` belongs to is asked; or why it will not come."""
        found = self.registry.known_to(owner.prefix).get(identifier)
        return found if found is not None else self._ask(owner.prefix, [identifier], now)

    def fetch_all(
        self, owner: Guid, root: HashedIdentifier, information: TypeInformation, now: float
    ) -> BuiltTypes | str | None:
        """The same with all that it needs.  ``information``: what was announced, which may list these."""
        types, missing = self.registry.collect(root, owner.prefix)
        if not missing:
            return types
        known = self.registry.known_to(owner.prefix)
        listed = information.complete_types if root == information.complete else information.minimal_types
        dependencies = [one.identifier for one in listed.dependencies]
        missing += [one for one in hashed_only(dependencies) if one not in known and one not in missing]
        is_listed = len(dependencies) == listed.dependency_count
        return self._ask(owner.prefix, missing, now, None if is_listed or root in known else root)

    def _ask(
        self, prefix: bytes, missing: list[HashedIdentifier], now: float, unlisted: HashedIdentifier | None = None
    ) -> str | None:
        """Have the participant asked for what is missing, and first for the dependencies of ``unlisted``.

        Returns why it is of no use, or None while it is under way.
        """
        if self._server(prefix) is None:
            return "its participant answers no questions about types"
        inquiry = self._inquiries.setdefault(prefix, _Inquiry())
        for identifier in missing:
            if inquiry.unavailable.get(identifier, 0.0) > now:
                return f"its participant did not give the TypeObject {identifier!r} when asked"
        if unlisted is not None and unlisted not in inquiry.wanted:
            inquiry.lists.setdefault(unlisted, b"")
        for identifier in missing:
            if len(inquiry.wanted) < MOST_NEEDED:
                inquiry.wanted[identifier] = None
        if inquiry.asked is None:
            self._next_question(prefix, inquiry, now)
        return None

    def _server(self, prefix: bytes) -> EntityId | None:
        """Our writer by which the participant is asked; None when it would not answer, or may not be asked."""
        proxy = self._engine.participants.get(prefix)
        if proxy is None or not proxy.is_admitted:
            return None
        announced = proxy.data.builtin_endpoints
        if _SECURE in announced and self._engine.builtin.writer(ids.TYPE_LOOKUP_REQUEST_SECURE_WRITER) is not None:
            return ids.TYPE_LOOKUP_REQUEST_SECURE_WRITER
        return ids.TYPE_LOOKUP_REQUEST_WRITER if _PLAIN in announced else None

    # --- questions ---------------------------------------------------------------------------------------

    def _next_question(self, prefix: bytes, inquiry: _Inquiry, now: float) -> None:
        """Ask for what is wanted now, if anything is."""
        inquiry.attempt = 0
        inquiry.numbers.clear()
        if inquiry.lists:
            root, continuation_point = next(iter(inquiry.lists.items()))
            inquiry.asked = GetDependencies((root,), continuation_point)
        elif inquiry.wanted:
            inquiry.asked = GetTypes(tuple(inquiry.wanted)[:_MOST_IN_QUESTION])
        else:
            inquiry.asked = None
            self._engine.alarms.type_lookup(prefix, math.inf)
            return
        self._send(prefix, inquiry, now)

    def _send(self, prefix: bytes, inquiry: _Inquiry, now: float) -> None:
        """One attempt.  While keys for it are under way it stays with the attempt."""
        assert inquiry.asked is not None
        engine = self._engine
        self._engine.alarms.type_lookup(prefix, now + _PATIENCE_S[inquiry.attempt])
        writer_id = self._server(prefix)
        writer = engine.builtin.writer(writer_id) if writer_id is not None else None
        server = Guid.of(prefix, EntityId.PARTICIPANT)
        if writer is None or not any(guid.startswith(prefix) for guid in writer.behavior.readers):
            return
        number = writer.behavior.cache.last_sn + 1
        request = TypeLookupRequest((writer.guid, number), instance_name(server), inquiry.asked)
        inquiry.numbers.append(number)
        engine.write(writer, ChangeKind.ALIVE, encode_request(request), b"", now, destination=server)

    def answer_overdue(self, prefix: bytes, now: float) -> None:
        """The participant has not answered in time: once more, or never mind."""
        inquiry = self._inquiries.get(prefix)
        if inquiry is None or inquiry.asked is None:
            return
        inquiry.attempt += 1
        is_list = isinstance(inquiry.asked, GetDependencies)  # of which we can do without
        if inquiry.attempt < len(_PATIENCE_S) and not is_list and self._server(prefix) is not None:
            self._send(prefix, inquiry, now)
        elif is_list:
            inquiry.lists.clear()
            self._next_question(prefix, inquiry, now)
        else:
            self._give_up(inquiry, list(inquiry.wanted), now)
            self._next_question(prefix, inquiry, now)
            self._changed(prefix, now)

    def _give_up(self, inquiry: _Inquiry, identifiers: Iterable[HashedIdentifier], now: float) -> None:
        if len(inquiry.unavailable) > MOST_NEEDED:
            inquiry.unavailable.clear()
        for identifier in identifiers:
            inquiry.wanted.pop(identifier, None)
            inquiry.unavailable[identifier] = now + _UNAVAILABLE_S

    # --- answers -----------------------------------------------------------------------------------------

    def receive_reply(self, change: CacheChange, now: float) -> None:
        """An answer; all participants may hear those to others.

        Whose it is, Cyclone DDS 0.10 does not say: it puts its own Guid there, with octets swapped.  So one that brings
        what was asked for serves, whoever asked: it is taken by its hash.
        """
        engine = self._engine
        if change.kind is not ChangeKind.ALIVE:
            return
        try:
            reply = decode_reply(change.payload)
        except MalformedMessage as error:
            engine.dropped_discovery(change, str(error))
            return
        prefix = change.writer_guid.prefix
        inquiry = self._inquiries.get(prefix)
        guid, number = reply.request_id
        if inquiry is None or inquiry.asked is None:
            engine.dropped(DropReason.NOT_FOR_US, None, f"{change.writer_guid} answers {guid}, and was not asked")
        elif guid.prefix != engine.guid.prefix and not _answers(reply, inquiry):
            engine.dropped(DropReason.NOT_FOR_US, None, f"{change.writer_guid} answers {guid}")
        elif guid.prefix == engine.guid.prefix and number not in inquiry.numbers:
            engine.dropped(DropReason.DUPLICATE, None, f"{change.writer_guid} answers question {number} once more")
        else:
            self._take(prefix, inquiry, reply, now)
            self._next_question(prefix, inquiry, now)
            self._changed(prefix, now)

    def _take(self, prefix: bytes, inquiry: _Inquiry, reply: TypeLookupReply, now: float) -> None:
        match inquiry.asked, reply.result:
            case GetTypes(type_ids=asked), FoundTypes(types=types):
                self._take_types(prefix, inquiry, asked, types, now)
            case GetDependencies(type_ids=(root,)), FoundDependencies() as found if isinstance(root, HashedIdentifier):
                self._take_dependencies(prefix, inquiry, root, found)
            case GetDependencies(), _:
                inquiry.lists.clear()
            case GetTypes(type_ids=asked), _:
                self._give_up(inquiry, hashed_only(asked), now)

    def _take_types(
        self,
        prefix: bytes,
        inquiry: _Inquiry,
        asked: tuple[TypeIdentifier, ...],
        types: tuple[tuple[TypeIdentifier, bytes], ...],
        now: float,
    ) -> None:
        """What was not asked for is not taken.  What is lacking is asked for again, unless nothing came at all."""
        came = 0
        for identifier, octets in types:
            if not isinstance(identifier, HashedIdentifier) or identifier not in inquiry.wanted:
                continue
            try:
                self.registry.add(prefix, identifier, octets)
            except MalformedMessage as error:
                self._engine.dropped(DropReason.MALFORMED_DISCOVERY_DATA, None, f"a type of {prefix.hex()}: {error}")
                self._give_up(inquiry, [identifier], now)
                continue
            came += 1
            inquiry.wanted.pop(identifier)
            inquiry.unavailable.pop(identifier, None)
        if not came:
            self._give_up(inquiry, hashed_only(asked), now)

    def _take_dependencies(
        self, prefix: bytes, inquiry: _Inquiry, root: HashedIdentifier, found: FoundDependencies
    ) -> None:
        known = self.registry.known_to(prefix)
        for identifier in hashed_only(dependency.identifier for dependency in found.dependencies):
            if identifier not in known and len(inquiry.wanted) < MOST_NEEDED:
                inquiry.wanted[identifier] = None
        inquiry.pages += 1
        if found.continuation_point and inquiry.pages < _MOST_PAGES:
            inquiry.lists[root] = found.continuation_point
        else:
            inquiry.pages = 0
            inquiry.lists.pop(root, None)

    def _changed(self, prefix: bytes, now: float) -> None:
        """Something came, or will not come: who waits for it is to look."""
        self._engine.matchmaker.types_learnt(prefix, now)
        self._engine.discovery_changed()

    # --- the end -----------------------------------------------------------------------------------------

    def participant_lost(self, prefix: bytes) -> None:
        """Who asked it is told that nothing will come."""
        self._answers.participant_lost(prefix)
        self.registry.participant_lost(prefix)
        if self._inquiries.pop(prefix, None) is not None:
            self._engine.alarms.type_lookup(prefix, math.inf)


def _answers(reply: TypeLookupReply, inquiry: _Inquiry) -> bool:
    """Does it bring a type that is wanted?"""
    match reply.result:
        case FoundTypes(types=types):
            return any(identifier in inquiry.wanted for identifier in hashed_only(one for one, _ in types))
        case _:
            return False
