"""ParticipantMessageData: how a participant says that its writers are alive.  RTPS 2.5 §8.4.13.5, §9.6.3.1.

When to send it, and what follows from its absence, is not here.
"""

from __future__ import annotations

from ..serialization.cursor import Octets, Reader, Writer
from ..serialization.encapsulation import HEADER_LENGTH, Encapsulation, decode_encapsulation, encode_encapsulation
from ..structure.dataclass import dataclass
from ..structure.errors import MalformedMessage
from ..structure.guid import GuidPrefix

__all__ = ["AUTOMATIC_LIVELINESS_UPDATE", "MANUAL_LIVELINESS_UPDATE", "ParticipantMessageData"]

AUTOMATIC_LIVELINESS_UPDATE = b"\x00\x00\x00\x01"
"""All writers of the participant with automatic liveliness are alive."""
MANUAL_LIVELINESS_UPDATE = b"\x00\x00\x00\x02"
"""All writers of the participant with manual-by-participant liveliness are alive."""

_ENCAPSULATIONS = frozenset(
    (Encapsulation.CDR_BE, Encapsulation.CDR_LE, Encapsulation.PL_CDR_BE, Encapsulation.PL_CDR_LE)
)


@dataclass(frozen=True, slots=True)
class ParticipantMessageData:
    """The sample of the builtin topic ParticipantMessage; ``prefix`` and ``kind`` together are its key.

        +--------+--------+--------+--------+
        | encapsulation: CDR                |
        +-----------------------------------+
        | participantGuidPrefix          12 |
        | kind, 4 octets                    |
        | data: count, octets               |
        +-----------------------------------+

    ``kind`` is 4 octets without byte order; those from 0x80 on are the vendors'.  ``data`` has no meaning.
    """

    prefix: GuidPrefix
    kind: bytes
    data: bytes = b""

    @property
    def key(self) -> bytes:
        """The key's 16 octets, which also are its hash."""
        return self.prefix + self.kind

    def encode(self) -> bytes:
        """The payload, CDR_LE, padded to a multiple of 4."""
        writer = Writer()
        writer.octets(self.key)
        writer.octet_sequence(self.data)
        writer.align(4)
        return encode_encapsulation(Encapsulation.CDR_LE) + writer.getvalue()

    @classmethod
    def decode(cls, payload: Octets) -> ParticipantMessageData:
        """Read a payload of either byte order; octets behind the data are padding.

        Fast DDS (2.9) calls the same octets a parameter list.
        """
        encapsulation = decode_encapsulation(payload).encapsulation
        if encapsulation not in _ENCAPSULATIONS:
            reason = f"{encapsulation.name} where plain CDR belongs"
            raise MalformedMessage(reason, element="ParticipantMessageData", offset=0)
        reader = Reader(payload, little_endian=encapsulation.little_endian, start=HEADER_LENGTH)
        prefix, kind = reader.guid_prefix(), bytes(reader.octets(4))
        return cls(prefix, kind, bytes(reader.octet_sequence()))
