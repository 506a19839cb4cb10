"""``c.pdata``: the participant data inside a handshake.  DDS-Security 1.1 §9.3.2.5.1.

A big-endian parameter list with its sentinel and without encapsulation, as Cyclone DDS, Fast DDS and OpenDDS write it;
an encapsulation header that others may put before it is tolerated.  Hostile until the handshake is done; for hashes the
octets are opaque.  Read is only what can be compared with what the plugin was told of the participant; the service
compares the rest.
"""

from __future__ import annotations

from dataclasses import dataclass

from ddsi.serialization import ParameterId, ParameterList, Reader
from ddsi.structure.errors import MalformedMessage
from ddsi.structure.guid import Guid

from ..tokens import IdentityToken, read_data_holder
from .not_trusted import NotTrusted

__all__ = ["ParticipantData"]

_PL_CDR_BE, _PL_CDR_LE = b"\x00\x02\x00\x00", b"\x00\x03\x00\x00"


@dataclass(frozen=True, slots=True)
class ParticipantData:
    """``identity_token`` is None where the list does not hold one."""

    guid: Guid
    identity_token: IdentityToken | None

    @classmethod
    def read(cls, octets: bytes) -> ParticipantData:
        """Raises NotTrusted when the octets are no parameter list, or do not tell the Guid."""
        # Neither header begins a list of a participant's: it would be an empty parameter 2 or 3.
        start = len(_PL_CDR_BE) if octets[:4] in (_PL_CDR_BE, _PL_CDR_LE) else 0
        little_endian = octets[:4] == _PL_CDR_LE
        try:
            parameters, _ = ParameterList.decode(octets, little_endian=little_endian, start=start)
            token = parameters.get(ParameterId.IDENTITY_TOKEN)
            identity_token = None if token is None else read_data_holder(Reader(token, little_endian=little_endian))
        except MalformedMessage as error:
            raise NotTrusted("its participant data (c.pdata) is no parameter list") from error
        guid = parameters.get(ParameterId.PARTICIPANT_GUID)
        if guid is None or len(guid) != Guid.LENGTH:
            raise NotTrusted("its participant data (c.pdata) does not tell its Guid")
        return cls(Guid(guid), identity_token)
