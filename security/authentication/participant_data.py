"""``c.pdata``: the participant data inside a handshake.  DDS-Security 1.1 §9.3.2.5.1.

Hostile until the handshake is done; for hashes the octets are opaque.  Read is only what can be compared with what the
plugin was told of the participant; the service looks at the rest when it is proven (:func:`..announced.vouched`).
"""

from __future__ import annotations

from dataclasses import dataclass

from ddsi.serialization import ParameterId, Reader
from ddsi.structure.errors import MalformedMessage
from ddsi.structure.guid import Guid

from ..announced import participant_parameters
from ..tokens import IdentityToken, read_data_holder
from .not_trusted import NotTrusted

__all__ = ["ParticipantData"]


@dataclass(frozen=True, slots=True)
class ParticipantData:
    """``identity_token`` is None where the list does not hold one."""

    guid: Guid
    identity_token: IdentityToken | None

    @classmethod
    def read(cls, octets: bytes) -> ParticipantData:
        """Raises NotTrusted when the octets are no parameter list, or do not tell the Guid."""
        try:
            parameters = participant_parameters(octets)
            token = parameters.get(ParameterId.IDENTITY_TOKEN)
            reader = None if token is None else Reader(token, little_endian=parameters.little_endian)
            identity_token = None if reader is None else read_data_holder(reader)
        except MalformedMessage as error:
            raise NotTrusted("its participant data (c.pdata) is no parameter list") from error
        guid = parameters.get(ParameterId.PARTICIPANT_GUID)
        if guid is None or len(guid) != Guid.LENGTH:
            raise NotTrusted("its participant data (c.pdata) does not tell its Guid")
        return cls(Guid(guid), identity_token)
