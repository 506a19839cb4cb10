"""The QoS policies as parameters of SEDP: one table, read in both directions.

RTPS 2.5 §9.6.4 (table of parameters and their types), DDS-XTypes 1.3 §7.6.3.1 and §7.6.3.4, DDS-Security 1.1 §7.2.5
(data tags).  A policy that a peer
leaves out has that policy's default.  We announce each policy, defaults too: stacks differ in theirs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, TypeVar

from ..serialization.cursor import Reader, Writer
from ..serialization.parameter_id import ParameterId
from ..structure import qos_policies as p
from ..structure.dataclass import dataclass
from ..structure.qos import EndpointQos
from ..structure.vendor import OPENDDS, VendorId
from .parameter_values import ParameterValues, ParameterWriter

__all__ = ["MAX_PARTITIONS", "read_reader_qos", "read_writer_qos", "write_reader_qos", "write_writer_qos"]

MAX_PARTITIONS = 256
_MAX_REPRESENTATIONS = 64
_MAX_TAGS = 256

_DEFAULT = EndpointQos()
# RTPS 2.5 §9.6.4 with DDS-XTypes 1.3 §7.6.3.1.1: who names no representation has XCDR1 and nothing else.
_PEER_WRITER = EndpointQos(
    reliability=p.Reliable(), data_representation=p.DataRepresentation(p.DataRepresentationId.XCDR1)
)
_PEER_READER = EndpointQos(
    reliability=p.BestEffort(), data_representation=p.DataRepresentation(p.DataRepresentationId.XCDR1)
)

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class _PolicyCodec:
    """One line of the table: a field of EndpointQos, its parameter, and how its value is laid out.

    Where ``unless_default`` is set, absence says the same as the default to every stack, and nothing is sent.
    """

    name: str
    pid: ParameterId
    write: Callable[[Writer, Any], None]
    read: Callable[[Reader], Any]
    unless_default: bool = False


def write_writer_qos(out: ParameterWriter, qos: EndpointQos) -> None:
    """Append the policies that a publication announces."""
    _write(out, qos, _COMMON + _WRITER_ONLY)


def write_reader_qos(out: ParameterWriter, qos: EndpointQos) -> None:
    """Append the policies that a subscription announces."""
    _write(out, qos, _COMMON + _READER_ONLY)


def _write(out: ParameterWriter, qos: EndpointQos, codecs: tuple[_PolicyCodec, ...]) -> None:
    for codec in codecs:
        policy = getattr(qos, codec.name)
        if not codec.unless_default or policy != getattr(_DEFAULT, codec.name):
            out.write(codec.pid, codec.write, policy)
    out.properties(qos.properties.items())


def read_writer_qos(values: ParameterValues) -> EndpointQos:
    """The policies of a peer's writer."""
    return _read(values, _PEER_WRITER, _COMMON + _WRITER_ONLY + _LOCAL_ONLY)


def read_reader_qos(values: ParameterValues, *, vendor_id: VendorId) -> EndpointQos:
    """The policies of a peer's reader."""
    qos = _read(values, _PEER_READER, _COMMON + _READER_ONLY + _LOCAL_ONLY)
    if vendor_id == OPENDDS and ParameterId.TYPE_CONSISTENCY in values:
        policy = values.require(ParameterId.TYPE_CONSISTENCY, _read_opendds_type_consistency)
        qos = replace(qos, type_consistency=policy)
    return qos


def _read(values: ParameterValues, default: EndpointQos, codecs: tuple[_PolicyCodec, ...]) -> EndpointQos:
    given = {codec.name: values.require(codec.pid, codec.read) for codec in codecs if codec.pid in values}
    properties = values.properties()
    if properties:
        given["properties"] = MappingProxyType(dict(properties))
    return replace(default, **given)


# --- kinds -----------------------------------------------------------------------------------------------


def _kind(reader: Reader, kinds: Mapping[int, T]) -> T:
    """What the uint32 that comes next stands for."""
    number = reader.u32()
    try:
        return kinds[number]
    except KeyError:
        raise reader.malformed(f"there is no kind {number}") from None


def _by_kind(*classes: type[T]) -> dict[int, type[T]]:
    return {cls.KIND: cls for cls in classes}  # type: ignore[attr-defined]  # every kind has its number


_DURABILITY: dict[int, type[p.Durability]] = _by_kind(p.Volatile, p.TransientLocal, p.Transient, p.Persistent)
_OWNERSHIP: dict[int, type[p.Ownership]] = _by_kind(p.Shared, p.Exclusive)
_DESTINATION_ORDER: dict[int, type[p.DestinationOrder]] = _by_kind(p.ByReceptionTimestamp, p.BySourceTimestamp)
_RELIABILITY: dict[int, type[p.Reliability]] = _by_kind(p.BestEffort, p.Reliable)
_LIVELINESS: dict[int, type[p.Liveliness]] = _by_kind(p.Automatic, p.ManualByParticipant, p.ManualByTopic)
_ACCESS_SCOPE = {int(scope): scope for scope in p.AccessScope}

# --- policies of more than one element -------------------------------------------------------------------


def _write_reliability(writer: Writer, policy: p.Reliability) -> None:
    writer.u32(policy.KIND)
    writer.duration(policy.max_blocking_time)


def _read_reliability(reader: Reader) -> p.Reliability:
    return _kind(reader, _RELIABILITY)(reader.duration())


def _write_liveliness(writer: Writer, policy: p.Liveliness) -> None:
    writer.u32(policy.KIND)
    writer.duration(policy.lease_duration)


def _read_liveliness(reader: Reader) -> p.Liveliness:
    return _kind(reader, _LIVELINESS)(reader.duration())


def _write_presentation(writer: Writer, policy: p.Presentation) -> None:
    writer.u32(policy.access_scope)
    writer.boolean(policy.coherent_access)
    writer.boolean(policy.ordered_access)


def _read_presentation(reader: Reader) -> p.Presentation:
    return p.Presentation(_kind(reader, _ACCESS_SCOPE), reader.boolean(), reader.boolean())


def _write_partition(writer: Writer, policy: p.Partition) -> None:
    writer.sequence_length(len(policy.names))
    for name in policy.names:
        writer.string(name)


def _read_partition(reader: Reader) -> p.Partition:
    return p.Partition(*(reader.string() for _ in range(reader.sequence_length(most=MAX_PARTITIONS))))


def _write_data_tags(writer: Writer, policy: p.DataTags) -> None:
    writer.sequence_length(len(policy.tags))
    for name, value in policy.tags:
        writer.string(name)
        writer.string(value)


def _read_data_tags(reader: Reader) -> p.DataTags:
    return p.DataTags(*((reader.string(), reader.string()) for _ in range(reader.sequence_length(most=_MAX_TAGS))))


def _write_history(writer: Writer, policy: p.History) -> None:
    writer.u32(policy.KIND)
    writer.i32(policy.depth if isinstance(policy, p.KeepLast) else 1)


def _read_history(reader: Reader) -> p.History:
    # Never compared with ours, so that a depth without a meaning is no reason to refuse the endpoint.
    kind, depth = reader.u32(), reader.i32()
    return p.KeepAll() if kind == p.KeepAll.KIND else p.KeepLast(max(depth, 1))


def _write_durability_service(writer: Writer, policy: p.DurabilityService) -> None:
    writer.duration(policy.service_cleanup_delay)
    _write_history(writer, policy.history)
    writer.i32(policy.max_samples)
    writer.i32(policy.max_instances)
    writer.i32(policy.max_samples_per_instance)


def _read_durability_service(reader: Reader) -> p.DurabilityService:
    return p.DurabilityService(reader.duration(), _read_history(reader), reader.i32(), reader.i32(), reader.i32())


def _write_resource_limits(writer: Writer, policy: p.ResourceLimits) -> None:
    writer.i32(policy.max_samples)
    writer.i32(policy.max_instances)
    writer.i32(policy.max_samples_per_instance)


def _read_resource_limits(reader: Reader) -> p.ResourceLimits:
    # As with history: some stacks write 0 for no limit.
    limits = (reader.i32(), reader.i32(), reader.i32())
    return p.ResourceLimits(*(limit if limit > 0 else p.LENGTH_UNLIMITED for limit in limits))


def _write_representation(writer: Writer, policy: p.DataRepresentation) -> None:
    writer.sequence_length(len(policy.ids))
    for representation in policy.ids:
        writer.i16(representation)


def _read_representation(reader: Reader) -> p.DataRepresentation:
    """The ids that we know.  An empty list means XCDR1; one of unknown ids alone cannot be talked to."""
    ids = [reader.i16() for _ in range(reader.sequence_length(most=_MAX_REPRESENTATIONS))]
    if not ids:
        return _PEER_READER.data_representation
    known = [number for number in dict.fromkeys(ids) if number in tuple(p.DataRepresentationId)]
    if not known:
        raise reader.malformed(f"none of the representations {ids} is known")
    return p.DataRepresentation(*known)


# --- type consistency ------------------------------------------------------------------------------------


def _write_type_consistency(writer: Writer, policy: p.TypeConsistency) -> None:
    writer.u16(policy.kind)
    writer.boolean(policy.ignore_sequence_bounds)
    writer.boolean(policy.ignore_string_bounds)
    writer.boolean(policy.ignore_member_names)
    writer.boolean(policy.prevent_type_widening)
    writer.boolean(policy.force_type_validation)


def _read_type_consistency(reader: Reader) -> p.TypeConsistency:
    """Cyclone DDS, Fast DDS and Dust DDS number the kinds 0 and 1; a 2 can only be meant as 'allow'."""
    return _type_consistency(reader, {0: False, 1: True, 2: True})


def _read_opendds_type_consistency(reader: Reader) -> p.TypeConsistency:
    """OpenDDS numbers them 1 and 2."""
    return _type_consistency(reader, {0: False, 1: False, 2: True})


def _type_consistency(reader: Reader, allows: Mapping[int, bool]) -> p.TypeConsistency:
    """DDS-XTypes 1.3 §7.6.3.4.  The five options may be missing, and mean nothing where coercion is not allowed."""
    kind = reader.u16()
    if kind not in allows:
        raise reader.malformed(f"there is no kind {kind}")
    options = [reader.boolean() for _ in range(5)] if reader.remaining >= 5 else []
    if not allows[kind]:
        return p.TypeConsistency(
            p.TypeConsistency.DISALLOW_TYPE_COERCION,
            ignore_sequence_bounds=False,
            ignore_string_bounds=False,
            ignore_member_names=False,
            prevent_type_widening=True,
            # The one option that also has a meaning here: is a peer without type information refused?
            force_type_validation=bool(options) and options[4],
        )
    return p.TypeConsistency(p.TypeConsistency.ALLOW_TYPE_COERCION, *options)


# --- the table -------------------------------------------------------------------------------------------

_PID = ParameterId


def _duration(name: str, pid: ParameterId, policy: Callable[[float], Any], field: str) -> _PolicyCodec:
    """A policy that is one duration."""
    return _PolicyCodec(
        name,
        pid,
        lambda writer, value: writer.duration(getattr(value, field)),
        lambda reader: policy(reader.duration()),
    )


def _kinds(name: str, pid: ParameterId, kinds: Mapping[int, Callable[[], Any]]) -> _PolicyCodec:
    """A policy that is one of several kinds, and nothing else."""
    return _PolicyCodec(
        name,
        pid,
        lambda writer, value: writer.u32(value.KIND),
        lambda reader: _kind(reader, kinds)(),
    )


def _octets(name: str, pid: ParameterId, policy: Callable[[bytes], Any]) -> _PolicyCodec:
    """A policy that is a sequence of octets."""
    return _PolicyCodec(
        name,
        pid,
        lambda writer, value: writer.octet_sequence(value.value),
        lambda reader: policy(bytes(reader.octet_sequence())),
        unless_default=True,
    )


def _number(name: str, pid: ParameterId, policy: Callable[[int], Any], *, unless_default: bool) -> _PolicyCodec:
    """A policy that is an int32."""
    return _PolicyCodec(
        name,
        pid,
        lambda writer, value: writer.i32(value.value),
        lambda reader: policy(reader.i32()),
        unless_default=unless_default,
    )


_COMMON = (
    _PolicyCodec("reliability", _PID.RELIABILITY, _write_reliability, _read_reliability),
    _kinds("durability", _PID.DURABILITY, _DURABILITY),
    _duration("deadline", _PID.DEADLINE, p.Deadline, "period"),
    _duration("latency_budget", _PID.LATENCY_BUDGET, p.LatencyBudget, "duration"),
    _PolicyCodec("liveliness", _PID.LIVELINESS, _write_liveliness, _read_liveliness),
    _kinds("ownership", _PID.OWNERSHIP, _OWNERSHIP),
    _kinds("destination_order", _PID.DESTINATION_ORDER, _DESTINATION_ORDER),
    _PolicyCodec("presentation", _PID.PRESENTATION, _write_presentation, _read_presentation),
    _PolicyCodec("partition", _PID.PARTITION, _write_partition, _read_partition, unless_default=True),
    _octets("user_data", _PID.USER_DATA, p.UserData),
    _octets("topic_data", _PID.TOPIC_DATA, p.TopicData),
    _octets("group_data", _PID.GROUP_DATA, p.GroupData),
    _PolicyCodec("data_tags", _PID.DATA_TAGS, _write_data_tags, _read_data_tags, unless_default=True),
    _PolicyCodec(
        "data_representation",
        _PID.DATA_REPRESENTATION,
        _write_representation,
        _read_representation,
        unless_default=True,
    ),
    _PolicyCodec("entity_name", _PID.ENTITY_NAME, Writer.string, Reader.string, unless_default=True),
)
_WRITER_ONLY = (
    _duration("lifespan", _PID.LIFESPAN, p.Lifespan, "duration"),
    _number("ownership_strength", _PID.OWNERSHIP_STRENGTH, p.OwnershipStrength, unless_default=False),
    _PolicyCodec("durability_service", _PID.DURABILITY_SERVICE, _write_durability_service, _read_durability_service),
    _number("transport_priority", _PID.TRANSPORT_PRIORITY, p.TransportPriority, unless_default=True),
)
_READER_ONLY = (
    _duration("time_based_filter", _PID.TIME_BASED_FILTER, p.TimeBasedFilter, "minimum_separation"),
    _PolicyCodec(
        "type_consistency",
        _PID.TYPE_CONSISTENCY,
        _write_type_consistency,
        _read_type_consistency,
        unless_default=True,
    ),
)
# Nobody's business but the endpoint's own: never sent, but shown when a peer tells.
_LOCAL_ONLY = (
    _PolicyCodec("history", _PID.HISTORY, _write_history, _read_history),
    _PolicyCodec("resource_limits", _PID.RESOURCE_LIMITS, _write_resource_limits, _read_resource_limits),
)
