"""A trace as plain lines, for ``grep``: time, whose engine, what happened."""

from __future__ import annotations

from collections.abc import Collection

from ..structure.guid import GuidPrefix
from ..trace.describe import Describer
from ..trace.event import Category, TraceEvent
from ..trace.event_text import event_text
from ..trace.events import LinkDelayed, LinkDropped, LinkDuplicated, MessageReceived, MessageSent
from ..trace.message_parts import message_parts

__all__ = ["TraceText"]


class TraceText:
    """Line by line, for events as they come; participants are named by letters, as in the diagram."""

    def __init__(self, categories: Collection[Category]) -> None:
        self._categories = frozenset(categories)
        self._describer = Describer()
        self._origin: float | None = None
        self._introduced = 0

    def lines(self, event: TraceEvent) -> list[str]:
        """What is to be said of this event: nothing if its category is not wanted."""
        names = self._describer.names
        names.learn_event(event)
        if self._origin is None:
            self._origin = event.now
        said = self._said(event)
        if event.CATEGORY not in self._categories:
            return []
        time = f"{event.now - self._origin:12.6f}"
        return [*self._introductions(), *(f"{time}  {names.letter(event.participant)} {text}" for text in said)]

    def _introductions(self) -> list[str]:
        """Who the letters are, for those who have turned up since these were last asked for."""
        known = list(self._describer.names.participants.items())
        new = known[self._introduced :]
        self._introduced = len(known)
        return [f"{name.letter} = {prefix}  {name}".rstrip() for prefix, name in new]

    def _said(self, event: TraceEvent) -> list[str]:
        match event:
            case MessageSent(octets=octets, destinations=destinations):
                where = ", ".join(map(str, destinations))
                return [f"sent to {where}: {text}" for text in self._parts(octets, teller=event.participant)]
            case MessageReceived(octets=octets, source=source):
                parts = self._parts(octets, receiver=event.participant)
                return [f"received from {source}: {text}" for text in parts]
            case LinkDropped(octets=octets) | LinkDelayed(octets=octets) | LinkDuplicated(octets=octets):
                fate = event_text(event, self._describer.names)
                return [f"{fate}: {text}" for text in self._parts(octets, teller=event.participant)]
            case _:
                return [event_text(event, self._describer.names)]

    def _parts(
        self, octets: bytes, *, teller: GuidPrefix = GuidPrefix.UNKNOWN, receiver: GuidPrefix = GuidPrefix.UNKNOWN
    ) -> list[str]:
        """The message's parts with whom they are from and for; ``teller`` need not be told that it is from itself."""
        message = message_parts(octets, self._describer, receiver=receiver)
        letter = self._describer.names.letter
        sender = "" if message.source in (GuidPrefix.UNKNOWN, teller) else f"{letter(message.source)} "
        texts = []
        for part in message.parts:
            whom = "" if part.destination == GuidPrefix.UNKNOWN else f"to {letter(part.destination)} "
            texts.append(f"{sender}{whom}{', '.join(part.texts)}")
        return texts
