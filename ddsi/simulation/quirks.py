"""Quirks: habits of other vendors' stacks, to be played by a participant of a simulation.

Those stacks cannot be installed everywhere, and where they can, they do not show each habit on demand.  A quirk stands
at the seam of the engine (:class:`ddsi.spi.SecurityHooks`), where every submessage passes before it is protected and
every message before it leaves, and changes there what our own engine would say, hear or leave out.  So it works with
security and without, and knows nothing of keys.  Which vendor has which: :mod:`.vendors`; how one is played:
:mod:`.vendor_hooks`.

Not here: timing, QoS defaults and types of other vendors, and what only their handshake does.
"""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from typing import TYPE_CHECKING

from ..messages.acknack import AckNack
from ..messages.data import Data
from ..messages.data_frag import DataFrag
from ..messages.gap import Gap
from ..messages.header import HEADER_LENGTH
from ..messages.heartbeat import Heartbeat
from ..messages.interpreter import InfoTimestamp
from ..messages.raw_submessage import LITTLE_ENDIAN, SubmessageKind, iterate_submessages
from ..messages.submessages import Submessage
from ..serialization.parameter_id import ParameterId
from ..spi import HookEffect, Plaintext, SecurityHooks, SendMessage
from ..structure import builtin_entity_ids as ids
from ..structure.guid import GUID_UNKNOWN, Guid
from ..structure.sequence_number import NumberSet
from ..structure.vendor import FAST_DDS, RTI, RTI_MICRO, TWINOAKS
from ..trace.generic_message import GenericMessageOutline, generic_message_outline

if TYPE_CHECKING:
    from ..engine import Participant

__all__ = [
    "AckNackCountZero",
    "AckNackFromZero",
    "BigEndianEnvelopes",
    "BigEndianSubmessages",
    "DisposeByKeyHash",
    "DropsCountZero",
    "GapWhenAsked",
    "HeartbeatForAll",
    "KeysForEverybody",
    "LengthlessPostfix",
    "NeedsParticipantToken",
    "NeedsReaderToken",
    "NoParticipantTokens",
    "NonStandardPayload",
    "OpensAfterJoining",
    "PlainTopicsInClear",
    "ProtectedTimestamp",
    "Quirk",
    "RefusesAckNackFromZero",
    "SealsBeforeCutting",
    "VendorSubmessageBehind",
]

_ENVELOPE = frozenset({SubmessageKind.SEC_PREFIX, SubmessageKind.SEC_BODY, SubmessageKind.SEC_POSTFIX})
_MESSAGE_ENVELOPE = frozenset({SubmessageKind.SRTPS_PREFIX, SubmessageKind.SEC_BODY, SubmessageKind.SRTPS_POSTFIX})
_POSTFIXES = frozenset({SubmessageKind.SEC_POSTFIX, SubmessageKind.SRTPS_POSTFIX})
_LEAST_PAYLOAD_OVERHEAD = 40  # CryptoHeader and CryptoFooter (DDS-Security 1.1 §9.5.2.3, §9.5.2.5); padding: 3 at most
_VENDOR_SUBMESSAGE = b"\x80\x01\x3c\x00" + bytes(60)
_PLAIN_READERS_AND_WRITERS = frozenset(
    {
        *(ids.SEDP_PUBLICATIONS_READER, ids.SEDP_PUBLICATIONS_WRITER),
        *(ids.SEDP_SUBSCRIPTIONS_READER, ids.SEDP_SUBSCRIPTIONS_WRITER),
        *(ids.PARTICIPANT_MESSAGE_READER, ids.PARTICIPANT_MESSAGE_WRITER),
        *(ids.TYPE_LOOKUP_REQUEST_READER, ids.TYPE_LOOKUP_REQUEST_WRITER),
        *(ids.TYPE_LOOKUP_REPLY_READER, ids.TYPE_LOOKUP_REPLY_WRITER),
    }
)
_BYTE_ORDER_FREE = frozenset({ParameterId.KEY_HASH, ParameterId.STATUS_INFO})


class Quirk:
    """One habit of one participant.  Each method is a moment; what a quirk does not override stays as it is.

    ``hooks``: those of the participant, without any quirk.  ``engine`` is there when the first moment comes.
    """

    little_endian = True
    seals_before_cutting = False
    engine: Participant

    def __init__(self, hooks: SecurityHooks) -> None:
        self.hooks = hooks

    def say(self, sender: Guid, receivers: tuple[Guid, ...], submessage: Submessage) -> Submessage | None:
        """A submessage before it is protected; None leaves it unsaid."""
        return submessage

    def bares(self, receiver: Guid) -> bool:
        """Does a message to this endpoint leave without the protection of messages, where there is one?"""
        return False

    def wrap(self, sender: Guid, receivers: tuple[Guid, ...], envelope: bytes) -> bytes:
        """What became of it: SEC_PREFIX to SEC_POSTFIX.  Only asked where submessages are protected."""
        return envelope

    def assemble(self, message: bytes) -> bytes:
        """A whole message with its header, before it is protected itself."""
        return message

    def finish(self, message: bytes) -> bytes:
        """A whole message, protected or not, with its header."""
        return message

    def post(self, effect: HookEffect) -> HookEffect | None:
        """What security wants done: a handshake message, a token.  None leaves it undone."""
        return effect

    def told(self, sender: bytes, message: GenericMessageOutline) -> None:
        """A handshake message, or keys, of this participant."""

    def withholds(self, local: Guid, remote: Guid) -> bool:
        """Does this vendor not match the two yet, though security would let it?  Asked again after what it was told."""
        return False

    def hear(self, sender: bytes, submessage: Submessage) -> bool:
        """Does this vendor understand a submessage, now that it is in clear?  ``sender``: the participant's prefix."""
        return True


# --- repair --------------------------------------------------------------------------------------------------------


class AckNackFromZero(Quirk):
    """ "What have you?" is an ACKNACK with base 0, where the specification has 1 (RTPS 2.5 §8.3.8.1.3)."""

    def say(self, sender: Guid, receivers: tuple[Guid, ...], submessage: Submessage) -> Submessage | None:
        if isinstance(submessage, AckNack) and submessage.reader_sn_state == NumberSet(1):
            return replace(submessage, reader_sn_state=NumberSet(0))
        return submessage


class HeartbeatForAll(Quirk):
    """A writer whose samples have destinations tells each reader of all its numbers, others' too.

    Who is told asks for them, and gets a GAP.
    """

    def say(self, sender: Guid, receivers: tuple[Guid, ...], submessage: Submessage) -> Submessage | None:
        writer = self.engine.local_writers.get(sender)
        if not isinstance(submessage, Heartbeat) or writer is None or len(receivers) != 1:
            return submessage
        proxy = writer.behavior.readers.get(receivers[0])
        last_sn = writer.behavior.next_unsent_sn - 1
        if proxy is None or submessage.last_sn >= last_sn:
            return submessage
        proxy.lst_seq = last_sn  # so far it may be asked from now on, and will answer
        return replace(submessage, last_sn=last_sn, final=False)


class GapWhenAsked(Quirk):
    """The GAP that ought to go with a sample stays away; an ACKNACK has to ask for it."""

    def __init__(self, hooks: SecurityHooks) -> None:
        super().__init__(hooks)
        self._kept_back: set[tuple[Guid, tuple[Guid, ...], int]] = set()

    def say(self, sender: Guid, receivers: tuple[Guid, ...], submessage: Submessage) -> Submessage | None:
        if isinstance(submessage, Gap):
            gap = (sender, tuple(receivers), submessage.gap_start)
            if gap not in self._kept_back:
                self._kept_back.add(gap)
                return None
        return submessage


class DisposeByKeyHash(Quirk):
    """The end of an instance names it by its key hash alone, without a payload (RTPS 2.5 §9.6.4.8)."""

    def say(self, sender: Guid, receivers: tuple[Guid, ...], submessage: Submessage) -> Submessage | None:
        if not isinstance(submessage, Data) or not submessage.is_key:
            return submessage
        assert submessage.inline_qos is not None
        assert submessage.inline_qos.get(ParameterId.KEY_HASH) is not None, "we always send it"
        return replace(submessage, serialized_payload=b"", is_key=False)


class AckNackCountZero(Quirk):
    """ "What have you?" is an ACKNACK with count 0, again and again, where counts ascend (RTPS 2.5 §8.3.8.1.3)."""

    def say(self, sender: Guid, receivers: tuple[Guid, ...], submessage: Submessage) -> Submessage | None:
        if isinstance(submessage, AckNack) and submessage.reader_sn_state == NumberSet(1) and not submessage.final:
            return replace(submessage, count=0)
        return submessage


class RefusesAckNackFromZero(Quirk):
    """Base 0 is malformed, unless one of the vendors sent it that are known for it."""

    def hear(self, sender: bytes, submessage: Submessage) -> bool:
        if not isinstance(submessage, AckNack) or submessage.reader_sn_state.base != 0:
            return True
        participant = self.engine.participants.get(sender)
        return participant is not None and participant.vendor_id in (FAST_DDS, RTI, RTI_MICRO, TWINOAKS)


class DropsCountZero(Quirk):
    """HEARTBEAT and ACKNACK are compared with a count that begins at 0, so those that have it are never new."""

    def hear(self, sender: bytes, submessage: Submessage) -> bool:
        return not (isinstance(submessage, AckNack | Heartbeat) and submessage.count == 0)


class BigEndianSubmessages(Quirk):
    """As a host of that byte order sends them; payloads keep the order that their encapsulation names."""

    little_endian = False

    def say(self, sender: Guid, receivers: tuple[Guid, ...], submessage: Submessage) -> Submessage | None:
        if not isinstance(submessage, Data | DataFrag) or submessage.inline_qos is None:
            return submessage
        swapped = type(submessage.inline_qos)(submessage.inline_qos, little_endian=False)
        assert _BYTE_ORDER_FREE.issuperset(parameter.pid for parameter in swapped), "others would have to be swapped"
        return replace(submessage, inline_qos=swapped)


class VendorSubmessageBehind(Quirk):
    """Every message ends with a submessage of the vendor's own, in clear even where the message is protected."""

    def finish(self, message: bytes) -> bytes:
        *_, last = iterate_submessages(message)
        size = len(last.body).to_bytes(2, "little" if last.little_endian else "big")
        closed = message[: last.offset + 2] + size + message[last.offset + 4 :]  # it is not the last any more
        return closed + _VENDOR_SUBMESSAGE


# --- protection ------------------------------------------------------------------------------------------------------


class SealsBeforeCutting(Quirk):
    """A sample is protected whole and cut into fragments then; §8.5.1.9.1 means each run to be protected by itself."""

    seals_before_cutting = True


class OpensAfterJoining(Quirk):
    """The receiving side of the same: runs that were protected by themselves are joined, and cannot be opened."""

    def hear(self, sender: bytes, submessage: Submessage) -> bool:
        if not isinstance(submessage, DataFrag):
            return True
        return len(submessage.serialized_payload) < submessage.run_length + _LEAST_PAYLOAD_OVERHEAD


class NonStandardPayload(Quirk):
    """A payload that is protected is called non-standard (flag N), as it begins with no encapsulation header."""

    def say(self, sender: Guid, receivers: tuple[Guid, ...], submessage: Submessage) -> Submessage | None:
        if not isinstance(submessage, Data | DataFrag) or not submessage.serialized_payload:
            return submessage
        is_protected = self.hooks.overhead(sender, receivers).payload > 0
        return replace(submessage, non_standard_payload=True) if is_protected else submessage


class BigEndianEnvelopes(Quirk):
    """The headers of SEC_ and SRTPS_ submessages are big-endian, whatever is in them (RTPS 2.5 §9.4.5.1.2)."""

    def wrap(self, sender: Guid, receivers: tuple[Guid, ...], envelope: bytes) -> bytes:
        return _big_endian(envelope, 0, _ENVELOPE)

    def finish(self, message: bytes) -> bytes:
        if len(message) > HEADER_LENGTH and message[HEADER_LENGTH] == SubmessageKind.SRTPS_PREFIX:
            return _big_endian(message, HEADER_LENGTH, _MESSAGE_ENVELOPE)
        return message


class LengthlessPostfix(Quirk):
    """A postfix that ends the message has length 0, "to the end of the message" (RTPS 2.5 §9.4.5.1.3)."""

    def finish(self, message: bytes) -> bytes:
        *_, last = iterate_submessages(message)
        if last.kind not in _POSTFIXES:
            return message
        return message[: last.offset + 2] + bytes(2) + message[last.offset + 4 :]


class ProtectedTimestamp(Quirk):
    """Where submessages are protected, the INFO_TS of a sample is one more, under the key of the writer."""

    def __init__(self, hooks: SecurityHooks) -> None:
        super().__init__(hooks)
        self._ticks: int | None = None  # of the sample that is being protected

    def say(self, sender: Guid, receivers: tuple[Guid, ...], submessage: Submessage) -> Submessage | None:
        self._ticks = None
        if isinstance(submessage, Data | DataFrag):
            change = self.engine.local_writers[sender].behavior.cache.get(submessage.writer_sn)
            self._ticks = change.source_timestamp if change is not None else None
        return submessage

    def wrap(self, sender: Guid, receivers: tuple[Guid, ...], envelope: bytes) -> bytes:
        if self._ticks is None:
            return envelope
        info = InfoTimestamp(self._ticks).encode()
        return b"".join((*self.hooks.encode_submessage(sender, receivers, (info,)), envelope))

    def assemble(self, message: bytes) -> bytes:
        """Then there is none in clear."""
        kept, is_inside, has_envelope = [message[:HEADER_LENGTH]], False, False
        for raw in iterate_submessages(message):
            is_inside = raw.kind == SubmessageKind.SEC_PREFIX or (is_inside and raw.kind != SubmessageKind.SEC_POSTFIX)
            has_envelope = has_envelope or is_inside
            if is_inside or raw.kind != SubmessageKind.INFO_TS:
                kept.append(message[raw.offset : raw.end])
        return b"".join(kept) if has_envelope else message


class PlainTopicsInClear(Quirk):
    """What the plain builtin topics carry leaves unprotected, though messages are to be protected (§8.4.2.4)."""

    def bares(self, receiver: Guid) -> bool:
        return receiver.entity_id in _PLAIN_READERS_AND_WRITERS


class KeysForEverybody(Quirk):
    """Each message of the volatile topic goes to all participants, under the key shared with each."""

    def post(self, effect: HookEffect) -> HookEffect | None:
        if not isinstance(effect, SendMessage) or effect.writer != ids.PARTICIPANT_VOLATILE_MESSAGE_SECURE_WRITER:
            return effect
        change = copy(effect.change)
        change.destination = GUID_UNKNOWN  # what it says in its payload stays
        return replace(effect, change=change)


class NoParticipantTokens(Quirk):
    """Where messages are not protected, no key of the participant is sent; others send one of kind NONE (§8.8.9)."""

    def post(self, effect: HookEffect) -> HookEffect | None:
        if not isinstance(effect, SendMessage):
            return effect
        outline = generic_message_outline(effect.change.payload)
        is_token = outline is not None and outline.kind == "participant-tokens"
        sender = effect.change.writer_guid.participant
        return None if is_token and not self.hooks.overhead(sender, ()).message else effect


class NeedsParticipantToken(Quirk):
    """Nothing is matched with a participant before keys of it have come, be it one of kind NONE (§8.8.9)."""

    def __init__(self, hooks: SecurityHooks) -> None:
        super().__init__(hooks)
        self._heard_from: set[bytes] = set()

    def told(self, sender: bytes, message: GenericMessageOutline) -> None:
        if message.kind in ("participant-tokens", "writer-tokens", "reader-tokens"):
            self._heard_from.add(sender)

    def withholds(self, local: Guid, remote: Guid) -> bool:
        return remote[:12] not in self._heard_from and not isinstance(self.hooks, Plaintext)


class NeedsReaderToken(Quirk):
    """A writer that protects anything matches no reader before a key of it has come, be it one of kind NONE."""

    def __init__(self, hooks: SecurityHooks) -> None:
        super().__init__(hooks)
        self._keyed: set[tuple[Guid, Guid]] = set()

    def told(self, sender: bytes, message: GenericMessageOutline) -> None:
        if message.kind == "reader-tokens":
            self._keyed.add((message.destination_endpoint, message.source_endpoint))

    def withholds(self, local: Guid, remote: Guid) -> bool:
        added = self.hooks.overhead(local, (remote,))
        is_protected = bool(added.payload or added.submessage)
        return local.entity_id.is_writer and is_protected and (local, remote) not in self._keyed


def _big_endian(octets: bytes, start: int, kinds: frozenset[SubmessageKind]) -> bytes:
    """Swap the lengths in the headers of these kinds.  What a signature covers stands between them and stays."""
    changed = bytearray(octets)
    previous: int | None = None
    for raw in iterate_submessages(octets, start=start):
        # Within a signed message there are envelopes of submessages, and their SEC_BODY is signed with all the rest.
        is_body = raw.kind == SubmessageKind.SEC_BODY
        if raw.kind in kinds and raw.little_endian and (not is_body or previous in kinds):
            at = raw.offset
            changed[at + 1] &= ~LITTLE_ENDIAN
            changed[at + 2 : at + 4] = octets[at + 3], octets[at + 2]
        previous = raw.kind
    return bytes(changed)
