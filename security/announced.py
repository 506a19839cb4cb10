"""What SPDP and SEDP say about security: tokens and attribute masks, as parameters.  DDS-Security 1.1 §7.4.1, §9.3.4.

Values in little-endian octets, as the core carries them.  Those of a peer are untrusted until its handshake is done:
then :func:`vouched` puts what it said under its signature in the place of what anybody may have said in its name.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntFlag
from typing import Final

from ddsi.serialization import ParameterId, ParameterList, Reader, Writer
from ddsi.spi import Octets
from ddsi.structure.discovered import Parameter
from ddsi.structure.errors import MalformedMessage

from .attributes import (
    EndpointSecurityAttributes,
    EndpointSecurityAttributesMask,
    ParticipantSecurityAttributes,
    ParticipantSecurityAttributesMask,
    PluginEndpointSecurityAttributesMask,
    PluginParticipantSecurityAttributesMask,
)
from .tokens import NIL, DataHolder, read_data_holder, write_data_holder

__all__ = [
    "SecurityInfo",
    "endpoint_info",
    "endpoint_refusal",
    "info",
    "info_parameter",
    "participant_info",
    "participant_parameters",
    "participant_refusal",
    "token",
    "token_parameter",
    "vouched",
]

_VALID: Final = 1 << 31
_MASKS: Final = struct.Struct("<II")
_BIG_ENDIAN_MASKS: Final = struct.Struct(">II")
_PL_CDR_BE, _PL_CDR_LE = b"\x00\x02\x00\x00", b"\x00\x03\x00\x00"


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
            return _data_holder(value, little_endian=True)
    return NIL


def _data_holder(octets: Octets, *, little_endian: bool) -> DataHolder:
    try:
        return read_data_holder(Reader(octets, little_endian=little_endian))
    except MalformedMessage:
        return NIL


def participant_parameters(participant_data: bytes) -> ParameterList:
    """The parameters of ``c.pdata``, by which a participant says in the handshake what SPDP says of it (§9.3.2.5.1).

    A big-endian list with its sentinel and without encapsulation, as Cyclone DDS, Fast DDS and OpenDDS write it; an
    encapsulation header that others may put before it is tolerated.  Untrusted.  Raises MalformedMessage.
    """
    # Neither header begins a list of a participant's: it would be an empty parameter 2 or 3.
    head = participant_data[:4]
    start = len(head) if head in (_PL_CDR_BE, _PL_CDR_LE) else 0
    parameters, _ = ParameterList.decode(participant_data, little_endian=head == _PL_CDR_LE, start=start)
    return parameters


def vouched(announced: Iterable[Parameter], participant_data: bytes) -> tuple[Parameter, ...]:
    """What a participant announced in the clear, corrected by what it said in the handshake, under its signature.

    Only what security decides by, and nobody changes who lives: tokens and masks.  Anybody can announce in its name, so
    a difference tells nothing of the participant, and must not shut it out.  A plugin may know no ``participant_data``.
    """
    found: dict[int, Parameter] = {}
    try:
        said = participant_parameters(participant_data)
    except MalformedMessage:
        return tuple(announced)
    for pid in (ParameterId.IDENTITY_TOKEN, ParameterId.PERMISSIONS_TOKEN):
        if (value := said.get(pid)) is not None:
            found[pid] = token_parameter(pid, _data_holder(value, little_endian=said.little_endian))
    pid = ParameterId.PARTICIPANT_SECURITY_INFO
    if (value := said.get(pid)) is not None and len(value) >= _MASKS.size:
        masks = _MASKS if said.little_endian else _BIG_ENDIAN_MASKS
        found[pid] = info_parameter(pid, SecurityInfo(*masks.unpack_from(value)))
    return (*(parameter for parameter in announced if parameter[0] not in found), *found.values())


def participant_refusal(ours: SecurityInfo, theirs: SecurityInfo) -> str:
    return _info_refusal(ours, theirs, ParticipantSecurityAttributesMask, PluginParticipantSecurityAttributesMask)


def endpoint_refusal(ours: SecurityInfo, theirs: SecurityInfo) -> str:
    return _info_refusal(ours, theirs, EndpointSecurityAttributesMask, PluginEndpointSecurityAttributesMask)


def _info_refusal(ours: SecurityInfo, theirs: SecurityInfo, names: type[IntFlag], plugin_names: type[IntFlag]) -> str:
    """Why two announcements do not go together, by what differs; empty if they do.

    Each of the two masks counts only where both sides declare it valid, and must then be the same (§7.4.1.5).
    """
    here: list[str] = []
    there: list[str] = []
    for our_mask, their_mask, flags in (
        (ours.attributes, theirs.attributes, names),
        (ours.plugin_attributes, theirs.plugin_attributes, plugin_names),
    ):
        if our_mask & their_mask & _VALID:
            here += _names(our_mask & ~their_mask, flags)
            there += _names(their_mask & ~our_mask, flags)
    texts = [f"{' and '.join(here)} here, not there"] if here else []
    texts += [f"{' and '.join(there)} there, not here"] if there else []
    return ", ".join(texts)


def _names(mask: int, flags: type[IntFlag]) -> list[str]:
    """Each set bit in words, as "submessage encrypted"; one that is not known, as plugins may have, by its value."""
    known = {flag.value: (flag.name or "").removeprefix("IS_").replace("_", " ").lower() for flag in flags}
    bits = [1 << place for place in range(32) if mask >> place & 1]
    return [known.get(bit, f"attribute {bit:#x}") for bit in bits]
