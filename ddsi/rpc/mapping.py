"""How a service lies on topics.  DDS-RPC 1.0 §7.4.2 (topic names), §7.5.1 (basic and enhanced service mapping).

In the basic mapping, which any DDS implementation can speak, a request's topic type is a header and the data.  In the
enhanced one it is the data alone, and who answers whom stands beside the sample, in its inline QoS: there a reply has
no place for a remote exception.  Not here: mapping of interfaces to such types.
"""

from __future__ import annotations

from contextlib import suppress
from enum import Enum
from typing import Any, Generic, Protocol, TypeVar

from ..structure.errors import BadParameter
from ..structure.guid import Guid
from ..xtypes import idl
from ..xtypes.defaults import zero_value
from ..xtypes.definition import struct_type
from ..xtypes.unions import union_type
from .correlation import CorrelatedSample, Identity
from .identity import RemoteError, RemoteExceptionCode, ReplyHeader, RequestHeader, SampleIdentity

__all__ = ["Mapping", "Wire", "wire"]

Req = TypeVar("Req")
Rep = TypeVar("Rep")


class Mapping(Enum):
    """DDS-RPC 1.0 §7.5.1."""

    BASIC = "basic"
    ENHANCED = "enhanced"


class Wire(Protocol[Req, Rep]):
    """What a mapping makes of requests and replies."""

    @property
    def request_type(self) -> type[Any]:
        """The type of the topic of requests."""
        ...

    @property
    def reply_type(self) -> type[Any]:
        """The type of the topic of replies."""
        ...

    def request(self, data: Req, client: Guid, number: int, instance_name: str) -> Any:
        """The sample that asks, and is ``client``'s request of that number."""

    def identity_of_request(self, written: Identity, client: Guid, number: int) -> Identity:
        """What the request is known by, which was ``written`` as that sample."""
        ...

    def request_in(self, sample: CorrelatedSample[Any]) -> tuple[Identity, str, Req]:
        """Its identity, the instance that it is for, and the data."""
        ...

    def reply(self, data: Rep, request: Identity) -> Any:
        """The sample that answers."""

    def failure(self, code: RemoteExceptionCode, request: Identity) -> Any:
        """The sample that answers without data.  Raises BadParameter where the mapping has none."""

    def reply_in(self, sample: CorrelatedSample[Any]) -> tuple[Identity | None, Rep | RemoteError]:
        """The request that it answers, if it says so, and the answer."""
        ...


def wire(mapping: Mapping, name: str, request_type: type[Req], reply_type: type[Rep]) -> Wire[Req, Rep]:
    """Raises BadParameter when one of the types is neither an IDL struct nor union."""
    for type_ in (request_type, reply_type):
        with suppress(BadParameter):
            union_type(type_)
            continue
        struct_type(type_)
    if mapping is Mapping.ENHANCED:
        return _Enhanced(request_type, reply_type)
    if mapping is Mapping.BASIC:
        return _Basic(name, request_type, reply_type)
    raise BadParameter(f"the mapping of a service is rpc.Mapping.BASIC or ENHANCED, not {mapping!r}")


class _Basic(Generic[Req, Rep]):
    """§7.5.1.1: ``struct Name_Request { RequestHeader header; RequestType data; }``, and a reply alike."""

    def __init__(self, name: str, request_type: type[Req], reply_type: type[Rep]) -> None:
        self.request_type: type[Any] = _with_header(f"{name}_Request", RequestHeader, request_type)
        self.reply_type: type[Any] = _with_header(f"{name}_Reply", ReplyHeader, reply_type)

    def request(self, data: Req, client: Guid, number: int, instance_name: str) -> Any:
        return self.request_type(RequestHeader(SampleIdentity.of(client, number), instance_name), data)

    def identity_of_request(self, written: Identity, client: Guid, number: int) -> Identity:
        return client, number

    def request_in(self, sample: CorrelatedSample[Any]) -> tuple[Identity, str, Req]:
        header: RequestHeader = sample.data.header
        return header.request_id.key, header.instance_name, sample.data.data

    def reply(self, data: Rep, request: Identity) -> Any:
        return self.reply_type(ReplyHeader(SampleIdentity.of(*request)), data)

    def failure(self, code: RemoteExceptionCode, request: Identity) -> Any:
        sample = zero_value(struct_type(self.reply_type))
        sample.header = ReplyHeader(SampleIdentity.of(*request), code)
        return sample

    def reply_in(self, sample: CorrelatedSample[Any]) -> tuple[Identity | None, Rep | RemoteError]:
        header: ReplyHeader = sample.data.header
        code = header.remote_ex
        answer = sample.data.data if code is RemoteExceptionCode.REMOTE_EX_OK else RemoteError(code)
        return header.related_request_id.key, answer


class _Enhanced(Generic[Req, Rep]):
    """§7.5.1.2: the data alone; a request is known by its own identity."""

    def __init__(self, request_type: type[Req], reply_type: type[Rep]) -> None:
        self.request_type: type[Any] = request_type
        self.reply_type: type[Any] = reply_type

    def request(self, data: Req, client: Guid, number: int, instance_name: str) -> Any:
        return data

    def identity_of_request(self, written: Identity, client: Guid, number: int) -> Identity:
        return written

    def request_in(self, sample: CorrelatedSample[Any]) -> tuple[Identity, str, Req]:
        return sample.identity, "", sample.data

    def reply(self, data: Rep, request: Identity) -> Any:
        return data

    def failure(self, code: RemoteExceptionCode, request: Identity) -> Any:
        raise BadParameter(
            f"{code.name}: a reply of the enhanced mapping has no place for it; let the reply's type say it, or use "
            "rpc.Mapping.BASIC"
        )

    def reply_in(self, sample: CorrelatedSample[Any]) -> tuple[Identity | None, Rep | RemoteError]:
        return sample.related, sample.data


def _with_header(name: str, header: type[Any], data: type[Any]) -> type[Any]:
    annotations = {"header": header, "data": data}
    fields = {"__annotations__": annotations, "__doc__": f"The topic type of {name}s.", "__module__": __name__}
    made: type[Any] = idl.struct(typename=name, extensibility=idl.FINAL)(type(name, (), fields))
    return made
