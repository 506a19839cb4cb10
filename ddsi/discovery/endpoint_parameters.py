"""DiscoveredWriterData and DiscoveredReaderData as parameter lists, and back.

RTPS 2.5 §8.5.4.4, §9.6.3 (tables of SEDP), DDS-XTypes 1.3 §7.6.3.2.2 (type information), DDS-Security 1.1 §7.4.1.2.
"""

from __future__ import annotations

from typing import NamedTuple

from ..serialization.cursor import Octets, Reader, Writer
from ..serialization.parameter_id import ParameterId
from ..structure.discovered import (
    ContentFilterProperty,
    DiscoveredEndpointData,
    DiscoveredReaderData,
    DiscoveredWriterData,
)
from ..structure.errors import MalformedMessage
from ..structure.guid import EntityId, Guid
from ..structure.locator import Locator
from ..structure.vendor import PROTOCOL_VERSION, VendorId
from .parameter_values import ParameterValues, ParameterWriter, open_payload, seal_payload
from .qos_parameters import read_reader_qos, read_writer_qos, write_reader_qos, write_writer_qos

__all__ = ["MAX_NAME_LENGTH", "decode_reader", "decode_writer", "encode_reader", "encode_writer"]

MAX_NAME_LENGTH = 4096
"""Characters in the name of a topic or type.  The specification's 256 is too short for some C++ type names."""
_MAX_FILTER_PARAMETERS = 256

_PID = ParameterId
_USER_BITS = 0xC0


def encode_writer(data: DiscoveredWriterData) -> bytes:
    """The payload that announces a writer, PL_CDR_LE.  ValueError if a value is too long for a parameter (65532)."""
    out = ParameterWriter()
    _write_identity(out, data)
    write_writer_qos(out, data.qos)
    if data.max_serialized_size is not None:
        out.write(_PID.TYPE_MAX_SIZE_SERIALIZED, Writer.u32, data.max_serialized_size)
    _write_rest(out, data)
    return seal_payload(out.parameters)


def encode_reader(data: DiscoveredReaderData) -> bytes:
    """The payload that announces a reader, as :func:`encode_writer`.

    EXPECTS_INLINE_QOS is never sent: Cyclone DDS refuses readers that do, and we have no need of it.
    """
    out = ParameterWriter()
    _write_identity(out, data)
    write_reader_qos(out, data.qos)
    if data.content_filter is not None:
        out.write(_PID.CONTENT_FILTER_PROPERTY, _write_content_filter, data.content_filter)
    _write_rest(out, data)
    return seal_payload(out.parameters)


def _write_identity(out: ParameterWriter, data: DiscoveredEndpointData) -> None:
    out.octets(_PID.ENDPOINT_GUID, data.guid)
    out.octets(_PID.PARTICIPANT_GUID, data.guid.participant)
    # RustDDS and Dust DDS want these two here also.
    out.octets(_PID.PROTOCOL_VERSION, bytes(PROTOCOL_VERSION))
    out.octets(_PID.VENDORID, data.vendor_id)
    out.write(_PID.TOPIC_NAME, Writer.string, data.topic_name)
    out.write(_PID.TYPE_NAME, Writer.string, data.type_name)


def _write_rest(out: ParameterWriter, data: DiscoveredEndpointData) -> None:
    out.locators(_PID.UNICAST_LOCATOR, data.unicast)
    out.locators(_PID.MULTICAST_LOCATOR, data.multicast)
    if data.group_entity_id != EntityId.UNKNOWN:
        out.octets(_PID.GROUP_ENTITYID, data.group_entity_id)
    if data.type_information:
        out.octets(_PID.TYPE_INFORMATION, data.type_information)
    out.security_parameters(data.security_parameters)


def decode_writer(payload: Octets, vendor_id: VendorId) -> DiscoveredWriterData:
    """What the payload says of a writer; ``vendor_id`` is the participant's, if it does not say.

    Malformed unless it names a topic, a type, and a Guid of an application's writer.
    """
    values = _endpoint_values(payload, vendor_id)
    common = _read_common(values, vendor_id)
    if not common.guid.entity_id.is_writer:
        raise MalformedMessage(f"{common.guid} is not a writer's", element="ENDPOINT_GUID")
    return DiscoveredWriterData(
        **common._asdict(),
        qos=read_writer_qos(values),
        max_serialized_size=values.read(_PID.TYPE_MAX_SIZE_SERIALIZED, Reader.u32, None),
    )


def decode_reader(payload: Octets, vendor_id: VendorId) -> DiscoveredReaderData:
    """What the payload says of a reader, as :func:`decode_writer`."""
    values = _endpoint_values(payload, vendor_id)
    common = _read_common(values, vendor_id)
    if not common.guid.entity_id.is_reader:
        raise MalformedMessage(f"{common.guid} is not a reader's", element="ENDPOINT_GUID")
    return DiscoveredReaderData(
        **common._asdict(),
        qos=read_reader_qos(values, vendor_id=common.vendor_id),
        expects_inline_qos=values.read(_PID.EXPECTS_INLINE_QOS, Reader.boolean, False),
        content_filter=values.read(_PID.CONTENT_FILTER_PROPERTY, _read_content_filter, None),
    )


class _Common(NamedTuple):
    """What writers and readers announce alike, under the names of DiscoveredEndpointData's fields."""

    guid: Guid
    topic_name: str
    type_name: str
    vendor_id: VendorId
    unicast: tuple[Locator, ...]
    multicast: tuple[Locator, ...]
    group_entity_id: EntityId
    type_information: bytes
    security_parameters: tuple[tuple[int, bytes], ...]


def _endpoint_values(payload: Octets, vendor_id: VendorId) -> ParameterValues:
    parameters = open_payload(payload)
    version = parameters.get(_PID.PROTOCOL_VERSION)
    protocol_version = PROTOCOL_VERSION if version is None or len(version) < 2 else (version[0], version[1])
    return ParameterValues(parameters, vendor_id=vendor_id, protocol_version=protocol_version)


def _read_common(values: ParameterValues, vendor_id: VendorId) -> _Common:
    guid = values.require(_PID.ENDPOINT_GUID, Reader.guid)
    if guid.entity_id[3] & _USER_BITS:
        # Builtin endpoints are known from SPDP; one that is announced here could take the place of a real one.
        raise MalformedMessage(f"{guid} is no application's endpoint", element="ENDPOINT_GUID")
    return _Common(
        guid=guid,
        topic_name=values.require(_PID.TOPIC_NAME, _read_name),
        type_name=values.require(_PID.TYPE_NAME, _read_name),
        vendor_id=values.read(_PID.VENDORID, lambda reader: bytes(reader.octets(2)), vendor_id),
        unicast=values.locators(_PID.UNICAST_LOCATOR, multicast=False),
        multicast=values.locators(_PID.MULTICAST_LOCATOR, multicast=True),
        group_entity_id=_read_group(values),
        type_information=_read_type_information(values),
        security_parameters=values.security_parameters(),
    )


def _read_group(values: ParameterValues) -> EntityId:
    """By its entity id, or by its whole Guid, of which nothing but that can be news."""
    group = values.read(_PID.GROUP_GUID, Reader.guid, None)
    return values.read(_PID.GROUP_ENTITYID, Reader.entity_id, group.entity_id if group else EntityId.UNKNOWN)


def _read_name(reader: Reader) -> str:
    name = reader.string()
    if len(name) > MAX_NAME_LENGTH:
        raise reader.malformed(f"a name of {len(name)} characters")
    return name


def _read_type_information(values: ParameterValues) -> bytes:
    """The octets, little endian; from a big-endian list none, so that the types are matched by their names.

    No stack sends such a list, and to swap it one would have to read it, which is for ``xtypes``.
    """
    if not values.little_endian:
        return b""
    return values.read(_PID.TYPE_INFORMATION, lambda reader: bytes(reader.octets(reader.remaining)), b"")


def _write_content_filter(writer: Writer, content_filter: ContentFilterProperty) -> None:
    writer.string(content_filter.content_filtered_topic_name)
    writer.string(content_filter.related_topic_name)
    writer.string(content_filter.filter_class_name)
    writer.string(content_filter.filter_expression)
    writer.sequence_length(len(content_filter.expression_parameters))
    for parameter in content_filter.expression_parameters:
        writer.string(parameter)


def _read_content_filter(reader: Reader) -> ContentFilterProperty:
    # Keyword arguments are evaluated from left to right, so that the cursor meets the fields in wire order.
    return ContentFilterProperty(
        content_filtered_topic_name=reader.string(),
        related_topic_name=reader.string(),
        filter_class_name=reader.string(),
        filter_expression=reader.string(),
        expression_parameters=tuple(
            reader.string() for _ in range(reader.sequence_length(most=_MAX_FILTER_PARAMETERS))
        ),
    )
