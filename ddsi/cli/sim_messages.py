"""The messages that ``ddsi sim handshake`` counts: of which kind each is, what it holds, and what repeats it.

DDS-Security 1.1 §7.4.3, §7.4.4 (messages of the handshake and of the key exchange), §7.4.5 (discovery).
"""

from __future__ import annotations

from dataclasses import dataclass

from ..messages.acknack import AckNack
from ..messages.data import Data
from ..messages.submessages import Submessage
from ..serialization import ParameterId, ParameterList
from ..serialization.encapsulation import HEADER_LENGTH, decode_encapsulation
from ..structure import builtin_entity_ids as ids
from ..trace.generic_message import GenericMessageOutline, generic_message_in
from .sim_handshake_words import KINDS
from .sim_seam import Said

__all__ = ["Message", "message_of"]

_DISCOVERY = frozenset(
    {
        ids.SEDP_PUBLICATIONS_WRITER,
        ids.SEDP_SUBSCRIPTIONS_WRITER,
        ids.SPDP_SECURE_WRITER,
        ids.SEDP_PUBLICATIONS_SECURE_WRITER,
        ids.SEDP_SUBSCRIPTIONS_SECURE_WRITER,
    }
)
_BEST_EFFORT = frozenset({ids.SPDP_WRITER, ids.PARTICIPANT_STATELESS_MESSAGE_WRITER})
_SECURITY_PIDS = (ParameterId.IDENTITY_TOKEN, ParameterId.PERMISSIONS_TOKEN, ParameterId.PARTICIPANT_SECURITY_INFO)


@dataclass(frozen=True, slots=True)
class Message:
    """``kind``: its name in KINDS.  ``outline``: None for what is no generic message."""

    number: int
    kind: str
    said: Said
    data: Data
    outline: GenericMessageOutline | None

    @property
    def is_reliable(self) -> bool:
        """Does HEARTBEAT and ACKNACK repair its loss?"""
        return self.data.writer_id not in _BEST_EFFORT

    @property
    def identity(self) -> tuple[object, ...]:
        """The same for all that repeat it.  On reliable topics a sample keeps its number, elsewhere it gets another."""
        if self.is_reliable:
            return self.said.sender, self.data.writer_sn
        return self.said.sender, self.kind, self.outline.fingerprint if self.outline is not None else 0

    def is_asked_for_by(self, submessage: Submessage) -> bool:
        return (
            isinstance(submessage, AckNack)
            and submessage.writer_id == self.data.writer_id
            and self.data.writer_sn in submessage.reader_sn_state
        )

    def contents(self) -> str:
        """Names and sizes of the tokens in it; empty where there are none."""
        if self.kind == "announcement":
            return _announced(self.data)
        if self.outline is None:
            return ""
        tokens = [
            f"{token.class_id} with {', '.join(f'{name} {size}' for name, size in token.sizes)}"
            for token in self.outline.tokens
        ]
        return f"{self.outline.octets} octets: {'; '.join(tokens)} octets"

    def protection(self) -> str:
        return f"protected: {', '.join(self.said.protected)}" if self.said.protected else "in clear"


def message_of(said: Said, number: int) -> Message | None:
    """None for what is not counted: HEARTBEAT, ACKNACK, liveliness."""
    data = said.submessage
    if not isinstance(data, Data):
        return None
    outline = generic_message_in(data)
    if outline is not None:
        kind = outline.kind
    elif data.writer_id == ids.SPDP_WRITER:
        kind = "announcement"
    elif data.writer_id in _DISCOVERY:
        kind = "discovery"
    else:
        kind = "" if data.writer_id.is_builtin else "data"
    return Message(number, kind, said, data, outline) if kind in KINDS else None


def _announced(data: Data) -> str:
    """Which parameters of an announcement are for security, with their sizes."""
    payload = data.serialized_payload
    little_endian = decode_encapsulation(payload).encapsulation.little_endian
    parameters, _ = ParameterList.decode(payload, little_endian=little_endian, start=HEADER_LENGTH)
    sizes = [f"{pid.name} {len(value)}" for pid in _SECURITY_PIDS if (value := parameters.get(pid)) is not None]
    return f"{len(payload)} octets, among them {', '.join(sizes)}" if sizes else ""
