"""SPDPdiscoveredParticipantData as a parameter list, and back.  RTPS 2.5 §8.5.3.2, §9.6.3 (table of SPDP).

DDS-Security 1.1 §7.4.1.1 adds parameters that are carried unread.
"""

from __future__ import annotations

from ..serialization.cursor import Octets, Reader, Writer
from ..serialization.parameter_id import ParameterId
from ..serialization.parameter_list import ParameterList
from ..structure.builtin_entity_ids import BuiltinEndpoints
from ..structure.discovered import DiscoveredParticipantData
from ..structure.errors import MalformedMessage
from ..structure.guid import EntityId, GuidPrefix
from ..structure.vendor import VendorId
from .parameter_values import ParameterValues, ParameterWriter, open_payload, seal_payload

__all__ = ["decode_participant", "encode_participant", "participant_parameters", "read_participant"]

_PID = ParameterId
_DEFAULT_LEASE = 100.0
# What every stack has, for a peer that does not say: SPDP and SEDP, without topics.
_DEFAULT_ENDPOINTS = 0x3F

# BuiltinEndpoints holds two sets: the one that there always was, and from this bit on that of DDS-Security 1.2.
_EXTENDED_FROM = 32
_PLAIN_SET = (1 << _EXTENDED_FROM) - 1


def encode_participant(data: DiscoveredParticipantData) -> bytes:
    """The payload of an SPDP announcement, PL_CDR_LE.  ValueError if a value is too long for a parameter (65532)."""
    return seal_payload(participant_parameters(data))


def participant_parameters(data: DiscoveredParticipantData, *, little_endian: bool = True) -> ParameterList:
    """The list inside the announcement; in big endian as the authentication handshake sends it.

    DDS-Security 1.1 §9.3.2.5.1 (c.pdata).
    """
    out = ParameterWriter(little_endian=little_endian)
    out.octets(_PID.PROTOCOL_VERSION, bytes(data.protocol_version))
    out.octets(_PID.VENDORID, data.vendor_id)
    out.octets(_PID.PARTICIPANT_GUID, data.guid)
    out.write(_PID.BUILTIN_ENDPOINT_SET, Writer.u32, data.builtin_endpoints & _PLAIN_SET)
    if data.builtin_endpoints > _PLAIN_SET:
        out.write(_PID.AVAILABLE_EXTENDED_BUILTIN_ENDPOINTS, Writer.u32, data.builtin_endpoints >> _EXTENDED_FROM)
    if data.builtin_endpoint_qos:
        out.write(_PID.BUILTIN_ENDPOINT_QOS, Writer.u32, data.builtin_endpoint_qos)
    if data.domain_id is not None:
        out.write(_PID.DOMAIN_ID, Writer.u32, data.domain_id)
    if data.domain_tag:  # it must be understood, and not every stack does
        out.write(_PID.DOMAIN_TAG, Writer.string, data.domain_tag)
    out.write(_PID.PARTICIPANT_LEASE_DURATION, Writer.duration, data.lease_duration)
    out.locators(_PID.METATRAFFIC_UNICAST_LOCATOR, data.metatraffic_unicast)
    out.locators(_PID.METATRAFFIC_MULTICAST_LOCATOR, data.metatraffic_multicast)
    out.locators(_PID.DEFAULT_UNICAST_LOCATOR, data.default_unicast)
    out.locators(_PID.DEFAULT_MULTICAST_LOCATOR, data.default_multicast)
    if data.manual_liveliness_count:
        out.write(_PID.PARTICIPANT_MANUAL_LIVELINESS_COUNT, Writer.i32, data.manual_liveliness_count)
    if data.entity_name:
        out.write(_PID.ENTITY_NAME, Writer.string, data.entity_name)
    if data.user_data:
        out.write(_PID.USER_DATA, Writer.octet_sequence, data.user_data)
    out.properties(data.properties)
    out.security_parameters(data.security_parameters)
    return out.parameters


def decode_participant(
    payload: Octets, *, source_prefix: GuidPrefix, vendor_id: VendorId, protocol_version: tuple[int, int]
) -> DiscoveredParticipantData:
    """What the payload of an SPDP announcement says; vendor and version are the message's, if it does not say.

    Malformed if it announces another participant than ``source_prefix``, whom it came from: nobody speaks for others.
    """
    return read_participant(
        open_payload(payload), source_prefix=source_prefix, vendor_id=vendor_id, protocol_version=protocol_version
    )


def read_participant(
    parameters: ParameterList, *, source_prefix: GuidPrefix, vendor_id: VendorId, protocol_version: tuple[int, int]
) -> DiscoveredParticipantData:
    """As :func:`decode_participant`, for a list that comes without encapsulation header."""
    values = ParameterValues(parameters, vendor_id=vendor_id, protocol_version=protocol_version)
    guid = values.require(_PID.PARTICIPANT_GUID, Reader.guid)
    if guid.prefix != source_prefix or guid.entity_id != EntityId.PARTICIPANT:
        raise MalformedMessage(f"{guid} announced by {source_prefix}", element="PARTICIPANT_GUID")
    return DiscoveredParticipantData(
        guid=guid,
        vendor_id=values.read(_PID.VENDORID, _read_vendor_id, vendor_id),
        protocol_version=values.read(_PID.PROTOCOL_VERSION, _read_protocol_version, protocol_version),
        domain_id=values.read(_PID.DOMAIN_ID, Reader.u32, None),
        domain_tag=values.read(_PID.DOMAIN_TAG, Reader.string, ""),
        metatraffic_unicast=values.locators(_PID.METATRAFFIC_UNICAST_LOCATOR, multicast=False),
        metatraffic_multicast=values.locators(_PID.METATRAFFIC_MULTICAST_LOCATOR, multicast=True),
        default_unicast=values.locators(_PID.DEFAULT_UNICAST_LOCATOR, multicast=False),
        default_multicast=values.locators(_PID.DEFAULT_MULTICAST_LOCATOR, multicast=True),
        builtin_endpoints=_read_endpoints(values),
        builtin_endpoint_qos=values.read(_PID.BUILTIN_ENDPOINT_QOS, Reader.u32, 0),
        lease_duration=values.read(_PID.PARTICIPANT_LEASE_DURATION, _read_duration, _DEFAULT_LEASE),
        manual_liveliness_count=values.read(_PID.PARTICIPANT_MANUAL_LIVELINESS_COUNT, Reader.i32, 0),
        entity_name=values.read(_PID.ENTITY_NAME, Reader.string, ""),
        user_data=values.read(_PID.USER_DATA, _read_octets, b""),
        properties=values.properties(),
        security_parameters=values.security_parameters(),
    )


def _read_endpoints(values: ParameterValues) -> BuiltinEndpoints:
    """The two sets in one; a participant that announces neither has what every one must have."""
    endpoints = values.read(_PID.BUILTIN_ENDPOINT_SET, Reader.u32, _DEFAULT_ENDPOINTS)
    extended = values.read(_PID.AVAILABLE_EXTENDED_BUILTIN_ENDPOINTS, Reader.u32, 0)
    return BuiltinEndpoints.received(endpoints | extended << _EXTENDED_FROM)


def _read_duration(reader: Reader) -> float:
    # Not Reader.duration itself: the reader for old peers has one of its own.
    return reader.duration()


def _read_vendor_id(reader: Reader) -> VendorId:
    return bytes(reader.octets(2))


def _read_protocol_version(reader: Reader) -> tuple[int, int]:
    return reader.u8(), reader.u8()


def _read_octets(reader: Reader) -> bytes:
    return bytes(reader.octet_sequence())
