"""What SPDP and SEDP say about security: tokens and attribute masks, as parameters.  DDS-Security 1.1 §7.4.1, §9.3.4.

Values in little-endian octets, as the core carries them.  Those of a peer are untrusted until its handshake is done.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntFlag
from typing import Final

from ddsi.serialization import ParameterId, Reader, Writer
from ddsi.structure.discovered import Parameter
from ddsi.structure.errors import MalformedMessage

from .attributes import (
    EndpointSecurityAttributes,
    EndpointSecurityAttributesMask,
    ParticipantSecurityAttributes,
    ParticipantSecurityAttributesMask,
)
from .tokens import NIL, DataHolder, read_data_holder, write_data_holder

__all__ = [
    "SecurityInfo",
    "endpoint_info",
    "endpoint_refusal",
    "info",
    "info_parameter",
    "participant_info",
    "participant_refusal",
    "token",
    "token_parameter",
]

_VALID: Final = 1 << 31
_MASKS: Final = struct.Struct("<II")


@dataclass(frozen=True, slots=True)
class SecurityInfo:
    """ParticipantSecurityInfo or EndpointSecurityInfo (§7.4.1.5): the mask of attributes, and the plugin's own."""

    attributes: int = 0
    plugin_attributes: int = 0


def participant_info(attributes: ParticipantSecurityAttributes) -> SecurityInfo:
    return SecurityInfo(int(attributes.mask), attributes.plugin_participant_attributes)


def endpoint_info(attributes: EndpointSecurityAttributes) -> SecurityInfo:
    return SecurityInfo(int(attributes.mask), attributes.plugin_endpoint_attributes)


def info_parameter(parameter_id: ParameterId, info: SecurityInfo) -> Parameter:
    return int(parameter_id), _MASKS.pack(info.attributes, info.plugin_attributes)


def info(parameters: Iterable[Parameter], parameter_id: ParameterId) -> SecurityInfo:
    """What was announced; zeros, which say nothing, where it is absent or cut off."""
    for pid, value in parameters:
        if pid == parameter_id and len(value) >= _MASKS.size:
            return SecurityInfo(*_MASKS.unpack_from(value))
    return SecurityInfo()


def token_parameter(parameter_id: ParameterId, holder: DataHolder) -> Parameter:
    writer = Writer(little_endian=True)
    write_data_holder(writer, holder)
    writer.align(4)
    return int(parameter_id), writer.getvalue()


def token(parameters: Iterable[Parameter], parameter_id: ParameterId) -> DataHolder:
    """The token that was announced; NIL where there is none, or none that can be read."""
    for pid, value in parameters:
        if pid == parameter_id:
            try:
                return read_data_holder(Reader(value, little_endian=True))
            except MalformedMessage:
                return NIL
    return NIL


def participant_refusal(ours: SecurityInfo, theirs: SecurityInfo) -> str:
    return _info_refusal(ours, theirs, ParticipantSecurityAttributesMask)


def endpoint_refusal(ours: SecurityInfo, theirs: SecurityInfo) -> str:
    return _info_refusal(ours, theirs, EndpointSecurityAttributesMask)


def _info_refusal(ours: SecurityInfo, theirs: SecurityInfo, names: type[IntFlag]) -> str:
    """Why two announcements do not go together; empty if they do.

    Each of the two masks counts only where both sides declare it valid, and must then be the same (§7.4.1.5).
    """
    for our_mask, their_mask, flags in (
        (ours.attributes, theirs.attributes, names),
        (ours.plugin_attributes, theirs.plugin_attributes, None),
    ):
        if our_mask & their_mask & _VALID and our_mask != their_mask:
            return f"ours has {_names(our_mask, flags)}, the peer's {_names(their_mask, flags)}"
    return ""


def _names(mask: int, flags: type[IntFlag] | None) -> str:
    if flags is None:
        return f"plugin attributes {mask & ~_VALID:#x}"
    set_flags = [flag.name or "" for flag in flags if flag & mask & ~_VALID]
    return " and ".join(set_flags) if set_flags else "nothing protected"
