"""``c.pdata``: the participant data inside a handshake, of which the Guid is checked.  DDS-Security 1.1 §9.3.2.5.1.

A big-endian parameter list with its sentinel and without encapsulation, as Cyclone DDS, Fast DDS and OpenDDS write it;
an encapsulation header that others may put before it is tolerated.  Hostile until the handshake is done; for hashes the
octets are opaque.
"""

from __future__ import annotations

from ddsi.serialization import ParameterId, ParameterList
from ddsi.structure.errors import MalformedMessage
from ddsi.structure.guid import Guid

from .not_trusted import NotTrusted

__all__ = ["guid_in_participant_data"]

_PL_CDR_BE, _PL_CDR_LE = b"\x00\x02\x00\x00", b"\x00\x03\x00\x00"


def guid_in_participant_data(octets: bytes) -> Guid:
    """Raises NotTrusted when there is none, or the octets are no parameter list."""
    # Neither header begins a list of a participant's: it would be an empty parameter 2 or 3.
    headed = octets[:4] in (_PL_CDR_BE, _PL_CDR_LE)
    try:
        parameters, _ = ParameterList.decode(
            octets, little_endian=octets[:4] == _PL_CDR_LE, start=len(_PL_CDR_BE) if headed else 0
        )
    except MalformedMessage as error:
        raise NotTrusted("its participant data (c.pdata) is no parameter list") from error
    value = parameters.get(ParameterId.PARTICIPANT_GUID)
    if value is None or len(value) != Guid.LENGTH:
        raise NotTrusted("its participant data (c.pdata) does not tell its Guid")
    return Guid(value)
