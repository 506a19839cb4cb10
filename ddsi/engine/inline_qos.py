"""InlineQos: what stands beside the payload of a DATA, or of the first DATA_FRAG, as far as it concerns receiving it.

RTPS 2.5 §8.7, §9.6.4.  What is written beside a payload is made in :mod:`.outbound`.
"""

from __future__ import annotations

import struct
from dataclasses import replace

from ..messages.content_filter_info import decode_content_filter_info
from ..serialization.parameter_id import ParameterId
from ..serialization.parameter_list import ParameterList
from ..spi import Octets
from ..structure.cache_change import StatusInfo
from ..structure.coherence import Coherence
from ..structure.guid import Guid

__all__ = ["NUMBERS_END", "InlineQos"]

_NUMBER = {True: struct.Struct("<iI"), False: struct.Struct(">iI")}
_GUID_OCTETS = 16
_KEY_HASH = int(ParameterId.KEY_HASH)
_KEY_HASH_OCTETS = 16
_COHERENCE = (ParameterId.COHERENT_SET, ParameterId.GROUP_SEQ_NUM, ParameterId.GROUP_COHERENT_SET)
# No writer gets that far in 100,000 years at a million samples a second.  Beyond it, what we add to a peer's numbers
# might no longer fit the wire.
NUMBERS_END = 1 << 62


class InlineQos:
    """What a DATA's inline QoS says that concerns receiving it.  RTPS 2.5 §8.7, §9.6.4."""

    __slots__ = ("coherence", "key_hash", "original", "related", "status", "verdicts")

    def __init__(self, status: int = 0, key_hash: bytes = b"", related: tuple[Guid, int] | None = None) -> None:
        self.status = status
        self.coherence: Coherence | None = None
        self.key_hash = key_hash
        self.related = related
        self.original: tuple[Guid, int] | None = None  # whose sample a persistence service hands on
        self.verdicts: dict[bytes, bool] | None = None  # what content filters say, by their signatures

    @classmethod
    def read(cls, parameters: object) -> InlineQos:
        """Unknown parameters are skipped, but one that must be understood makes the sample void (RTPS 2.5 §9.6.3)."""
        if not isinstance(parameters, ParameterList):
            return _NO_INLINE_QOS
        if len(parameters) == 1:  # the one that stands with every sample of a keyed topic whose payload is protected
            ((pid, value),) = parameters
            if pid == _KEY_HASH and len(value) >= _KEY_HASH_OCTETS:
                return cls(0, bytes(value[:_KEY_HASH_OCTETS]))
        parameters.require_understood()
        status = parameters.get(ParameterId.STATUS_INFO)
        key_hash = parameters.get(ParameterId.KEY_HASH)
        inline = cls(
            status[3] if status is not None and len(status) >= 4 else 0,
            bytes(key_hash[:_KEY_HASH_OCTETS]) if key_hash is not None and len(key_hash) >= _KEY_HASH_OCTETS else b"",
            _identity(parameters, ParameterId.RELATED_SAMPLE_IDENTITY),
        )
        filter_info = parameters.get(ParameterId.CONTENT_FILTER_INFO)
        if filter_info is not None:
            inline.verdicts = decode_content_filter_info(filter_info, little_endian=parameters.little_endian)
        inline.coherence = _coherence(parameters)
        inline.original = _identity(parameters, ParameterId.ORIGINAL_WRITER_INFO)
        return inline

    def coherence_of(self, *, has_sample: bool) -> Coherence | None:
        """What speaks of a coherent set, and stands with no sample, is the end of one; whatever number it bears."""
        coherence = self.coherence
        if coherence is None or has_sample or self.status & StatusInfo.FILTERED:
            return coherence
        return replace(coherence, is_end=True)


def _identity(parameters: ParameterList, parameter: ParameterId) -> tuple[Guid, int] | None:
    """A sample, by its writer and number.  RTPS 2.5 §8.7.9, DDS-RPC 1.0 §7.8.2."""
    value = parameters.get(parameter)
    if value is None:
        return None
    number = _number(value[_GUID_OCTETS:], parameters)
    return (Guid(bytes(value[:_GUID_OCTETS])), number) if number else None


def _coherence(parameters: ParameterList) -> Coherence | None:
    """Its place in a set and in its publisher, if it says so.  RTPS 2.5 §8.7.5, §8.7.6, §9.6.4."""
    if not any(parameters.get(parameter) is not None for parameter in _COHERENCE):
        return None
    set_sn, group_sn, group_set_sn = (_sequence_number(parameters, parameter) for parameter in _COHERENCE)
    return Coherence(set_sn, group_sn, group_set_sn)


def _sequence_number(parameters: ParameterList, parameter: ParameterId) -> int:
    """0 where it is not there, or cannot be."""
    value = parameters.get(parameter)
    return 0 if value is None else _number(value, parameters)


def _number(value: Octets, parameters: ParameterList) -> int:
    if len(value) < _NUMBER[True].size:
        return 0
    high, low = _NUMBER[parameters.little_endian].unpack_from(value)
    number: int = high << 32 | low
    return number if 0 < number < NUMBERS_END else 0


_NO_INLINE_QOS = InlineQos()
