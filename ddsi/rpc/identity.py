"""Who asked, which answer it is, and what became of it: the headers of requests and replies.

DDS-RPC 1.0 §7.5.1.1.1 (common types), as IDL types of the same names.  In CDR a SampleIdentity is 24 octets: a Guid,
and a sequence number as two halves.  None of them is ``@nested``, as the specification's are not: peers that compare
types tell the difference.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Annotated

from ..structure.errors import DdsError
from ..structure.guid import Guid
from ..xtypes import idl

__all__ = ["RemoteError", "RemoteExceptionCode", "ReplyHeader", "RequestHeader", "SampleIdentity"]


@idl.enum(typename="dds::rpc::RemoteExceptionCode_t")
class RemoteExceptionCode(IntEnum):
    """What a reply says of the request.  DDS-RPC 1.0 §7.5.1.1.1."""

    REMOTE_EX_OK = 0
    REMOTE_EX_UNSUPPORTED = 1
    REMOTE_EX_INVALID_ARGUMENT = 2
    REMOTE_EX_OUT_OF_RESOURCES = 3
    REMOTE_EX_UNKNOWN_OPERATION = 4
    REMOTE_EX_UNKNOWN_EXCEPTION = 5


class RemoteError(DdsError):
    """The service answered that it could not do what was asked: :attr:`code`, never REMOTE_EX_OK."""

    def __init__(self, code: RemoteExceptionCode, what: str = "") -> None:
        super().__init__(what or f"the service answered {code.name}")
        self.code = code


@idl.struct(typename="dds::EntityId_t", extensibility=idl.FINAL)
class _EntityId:
    entity_key: Annotated[idl.sequence[idl.octet], idl.array(3), idl.name("entityKey")]
    entity_kind: Annotated[idl.octet, idl.name("entityKind")]


@idl.struct(typename="dds::GUID_t", extensibility=idl.FINAL)
class _Guid:
    guid_prefix: Annotated[idl.sequence[idl.octet], idl.array(12), idl.name("guidPrefix")]
    entity_id: Annotated[_EntityId, idl.name("entityId")]


@idl.struct(typename="dds::SequenceNumber_t", extensibility=idl.FINAL)
class _SequenceNumber:
    high: idl.int32
    low: idl.uint32


@idl.struct(typename="dds::SampleIdentity", extensibility=idl.FINAL)
class SampleIdentity:
    """One sample of one writer: what a request is known by."""

    writer_guid: _Guid
    sequence_number: _SequenceNumber

    @classmethod
    def of(cls, writer: Guid, number: int) -> SampleIdentity:
        """``number``: 1 or more."""
        guid = _Guid(bytes(writer[:12]), _EntityId(bytes(writer[12:15]), writer[15]))
        return cls(guid, _SequenceNumber(number >> 32, number & 0xFFFF_FFFF))

    @property
    def key(self) -> tuple[Guid, int]:
        """The same as plain values, which can be compared and looked up."""
        guid, number = self.writer_guid, self.sequence_number
        octets = bytes(guid.guid_prefix) + bytes(guid.entity_id.entity_key) + bytes((guid.entity_id.entity_kind,))
        return Guid(octets), (number.high << 32) + number.low


@idl.struct(typename="dds::rpc::RequestHeader", extensibility=idl.FINAL)
class RequestHeader:
    """``instance_name``: which of several services of one name is meant; empty for any."""

    request_id: Annotated[SampleIdentity, idl.name("requestId")]
    instance_name: Annotated[str, idl.bound(255), idl.name("instanceName")] = ""


@idl.struct(typename="dds::rpc::ReplyHeader", extensibility=idl.FINAL)
class ReplyHeader:
    related_request_id: Annotated[SampleIdentity, idl.name("relatedRequestId")]
    remote_ex: Annotated[RemoteExceptionCode, idl.name("remoteEx")] = RemoteExceptionCode.REMOTE_EX_OK
