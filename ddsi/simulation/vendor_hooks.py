"""VendorHooks: the hooks of a participant that plays another vendor's; its quirks change what passes them.

A decorator of :class:`ddsi.spi.SecurityHooks`: those of DDS Security or the plain ones.  What it does not name itself
goes straight to them.  It protects nothing and opens nothing.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from ..messages.header import HEADER_LENGTH
from ..messages.raw_submessage import SubmessageKind, iterate_submessages
from ..messages.submessages import (
    AckNack,
    Data,
    DataFrag,
    Gap,
    Heartbeat,
    HeartbeatFrag,
    NackFrag,
    Submessage,
    decode_submessage,
)
from ..spi import (
    ADMITTED,
    PENDING,
    Admission,
    Decided,
    HookEffect,
    Octets,
    Outcome,
    Parts,
    Rejected,
    SecurityHooks,
)
from ..structure import builtin_entity_ids as ids
from ..structure.cache_change import CacheChange
from ..structure.discovered import DiscoveredReaderData, DiscoveredWriterData
from ..structure.errors import MalformedMessage
from ..structure.guid import EntityId, Guid
from ..trace.generic_message import generic_message_outline
from .quirks import Quirk

if TYPE_CHECKING:
    from ..engine import Participant

__all__ = ["VendorHooks"]

_PREFIX = slice(8, HEADER_LENGTH)
_TALKS_OF_SECURITY = frozenset(
    {
        EntityId.PARTICIPANT,
        *(ids.PARTICIPANT_STATELESS_MESSAGE_WRITER, ids.PARTICIPANT_STATELESS_MESSAGE_READER),
        *(ids.PARTICIPANT_VOLATILE_MESSAGE_SECURE_WRITER, ids.PARTICIPANT_VOLATILE_MESSAGE_SECURE_READER),
    }
)
_EntitySubmessage = AckNack | Data | DataFrag | Gap | Heartbeat | HeartbeatFrag | NackFrag


class VendorHooks:
    """Stands for ``hooks``.  The quirks act in their order.  ``acts`` counts what each has changed, or not heard."""

    def __init__(self, hooks: SecurityHooks, quirks: Iterable[type[Quirk]]) -> None:
        self.acts: Counter[type[Quirk]] = Counter()
        self._hooks = hooks
        self._quirks = [quirk(hooks) for quirk in quirks]
        self._withheld: dict[tuple[Guid, Guid], None] = {}  # a dict serves as an ordered set

    def __getattr__(self, name: str) -> Any:
        return getattr(self._hooks, name)

    def joined(self, engine: Participant) -> None:
        """The participant is there whose hooks these are."""
        for quirk in self._quirks:
            quirk.engine = engine

    def _acts(self, quirk: Quirk, acts: bool) -> bool:
        self.acts[type(quirk)] += acts
        return acts

    # --- matching ----------------------------------------------------------------------------------------

    def match(self, local: Guid, remote: DiscoveredWriterData | DiscoveredReaderData) -> Admission:
        admission = self._hooks.match(local, remote)
        return PENDING if admission is ADMITTED and self._is_withheld(local, remote.guid) else admission

    def unmatch(self, local: Guid, remote: Guid) -> None:
        self._withheld.pop((local, remote), None)
        self._hooks.unmatch(local, remote)

    def remote_participant_lost(self, guid: Guid) -> None:
        self._withheld = {pair: None for pair in self._withheld if pair[1].prefix != guid.prefix}
        self._hooks.remote_participant_lost(guid)

    def receive_message(self, change: CacheChange, now: float) -> None:
        outline = generic_message_outline(change.payload)
        if outline is not None:
            for quirk in self._quirks:
                quirk.told(change.writer_guid[:12], outline)
        self._hooks.receive_message(change, now)

    def _is_withheld(self, local: Guid, remote: Guid) -> bool:
        """Security itself has to talk, whatever this vendor waits for."""
        if local.entity_id in _TALKS_OF_SECURITY:
            return False
        is_withheld = any(self._acts(quirk, quirk.withholds(local, remote)) for quirk in self._quirks)
        if is_withheld:
            self._withheld[local, remote] = None
        return is_withheld

    # --- outwards ----------------------------------------------------------------------------------------

    def drain_effects(self) -> Sequence[HookEffect]:
        effects = [posted for effect in self._hooks.drain_effects() if (posted := self._post(effect)) is not None]
        for pair in list(self._withheld):
            if not any(quirk.withholds(*pair) for quirk in self._quirks):
                del self._withheld[pair]
                effects.append(Decided(*pair, ADMITTED))
        return effects

    def _post(self, effect: HookEffect) -> HookEffect | None:
        if (
            isinstance(effect, Decided)
            and effect.admission is ADMITTED
            and self._is_withheld(effect.local, effect.remote)
        ):
            return None
        for quirk in self._quirks:
            posted = quirk.post(effect)
            self._acts(quirk, posted is not effect)
            if posted is None:
                return None
            effect = posted
        return effect

    def opens_after_joining(self, reader: Guid) -> bool:
        seals = any(quirk.seals_before_cutting for quirk in self._quirks)
        return seals or self._hooks.opens_after_joining(reader)

    def encode_submessage(self, sender: Guid, receivers: tuple[Guid, ...], submessage: Parts) -> Parts:
        said = self._said(sender, receivers, b"".join(submessage))
        encoded = b"".join(self._hooks.encode_submessage(sender, receivers, (said,))) if said else b""
        if encoded[:1] == bytes((SubmessageKind.SEC_PREFIX,)):
            for quirk in self._quirks:
                wrapped = quirk.wrap(sender, receivers, encoded)
                self._acts(quirk, wrapped is not encoded)
                encoded = wrapped
        return (encoded,) if encoded else ()

    def _said(self, sender: Guid, receivers: tuple[Guid, ...], octets: bytes) -> bytes:
        """What is said instead of this submessage; nothing if it is left unsaid."""
        (raw,) = iterate_submessages(octets, start=0)
        submessage = decode_submessage(raw)
        for quirk in self._quirks:
            said = quirk.say(sender, receivers, submessage)
            is_sealed_part = quirk.seals_before_cutting and isinstance(submessage, DataFrag)
            self._acts(quirk, said is not submessage or not quirk.little_endian or is_sealed_part)
            if said is None:
                return b""
            submessage = said
        assert isinstance(submessage, _EntitySubmessage), f"{submessage} is of no endpoint"
        return submessage.encode(little_endian=all(quirk.little_endian for quirk in self._quirks))

    def encode_message(self, receivers: tuple[Guid, ...], message: Parts) -> Parts:
        assembled = b"".join(message)
        for quirk in self._quirks:
            assembled = quirk.assemble(assembled)
        bare = [self._acts(quirk, quirk.bares(receivers[0])) for quirk in self._quirks if receivers]
        parts = (assembled,)
        encoded = b"".join(parts if any(bare) else self._hooks.encode_message(receivers, parts))
        if not encoded:
            return ()
        for quirk in self._quirks:
            finished = quirk.finish(encoded)
            self._acts(quirk, finished is not encoded)
            encoded = finished
        return (encoded,)

    # --- inwards -----------------------------------------------------------------------------------------

    def understood(self, message: Octets) -> Octets:
        """A message as it came, without the submessages that this vendor does not understand."""
        sender = bytes(message[_PREFIX])
        try:
            kept = [
                bytes(message[raw.offset : raw.end])
                for raw in iterate_submessages(message)
                if self._hears(sender, decode_submessage(raw))
            ]
        except MalformedMessage:
            return message  # that is for the engine to find out
        return bytes(message[:HEADER_LENGTH]) + b"".join(kept)

    def decode_message(self, message: Octets, source: bytes) -> Octets | Outcome:
        decoded = self._hooks.decode_message(message, source)
        return decoded if isinstance(decoded, Outcome) else self.understood(decoded)

    def open_envelope(self, message: memoryview, start: int, end: int, source: bytes) -> tuple[Octets, int] | None:
        return None  # all come through decode_submessage

    def decode_submessage(self, protected: Octets, source: bytes) -> Octets | Outcome:
        decoded = self._hooks.decode_submessage(protected, source)
        if isinstance(decoded, Outcome):
            return decoded
        (raw,) = iterate_submessages(decoded, start=0)
        return (
            decoded if self._hears(source, decode_submessage(raw)) else Rejected("this vendor does not understand it")
        )

    def _hears(self, sender: bytes, submessage: Submessage) -> bool:
        return not any(self._acts(quirk, not quirk.hear(sender, submessage)) for quirk in self._quirks)
