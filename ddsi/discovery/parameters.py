"""What discovery says on the wire, in one place: announcements of participants, writers and readers, and their end.

RTPS 2.5 §9.6.3.  A payload is PL_CDR: encapsulation header, parameters, sentinel.  We send little endian and read both.
"""

from __future__ import annotations

from ..serialization.cursor import Octets, Reader
from ..serialization.parameter_id import ParameterId
from ..serialization.parameter_list import ParameterList
from ..structure.guid import Guid
from ..structure.vendor import OUR_VENDOR_ID, PROTOCOL_VERSION
from .endpoint_parameters import decode_reader, decode_writer, encode_reader, encode_writer
from .parameter_values import ParameterValues, open_payload, seal_payload
from .participant_parameters import decode_participant, encode_participant, participant_parameters, read_participant

__all__ = [
    "decode_key",
    "decode_participant",
    "decode_reader",
    "decode_writer",
    "encode_key",
    "encode_participant",
    "encode_reader",
    "encode_writer",
    "participant_parameters",
    "read_participant",
]


def encode_key(guid: Guid, pid: ParameterId) -> bytes:
    """The payload that names what is gone: ``pid`` is PARTICIPANT_GUID or ENDPOINT_GUID."""
    return seal_payload(ParameterList([(pid, guid)]))


def decode_key(payload: Octets, pid: ParameterId, *, key_hash: Octets = b"") -> Guid:
    """The Guid of what a dispose is about: ``pid`` in the payload, else KEY_HASH there, else the inline ``key_hash``.

    Fast DDS disposes without any payload; the key hash of these topics is the Guid itself (RTPS 2.5 §9.6.4.8).
    """
    if not payload and key_hash:
        return Reader(key_hash, little_endian=True).guid()
    values = ParameterValues(open_payload(payload), vendor_id=OUR_VENDOR_ID, protocol_version=PROTOCOL_VERSION)
    if pid not in values and ParameterId.KEY_HASH in values:
        pid = ParameterId.KEY_HASH
    return values.require(pid, Reader.guid)
