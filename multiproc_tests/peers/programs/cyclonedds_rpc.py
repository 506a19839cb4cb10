"""The other end of DDS-RPC's basic mapping over the `cyclonedds` package of PyPI, written by hand as for any DDS.

    cyclonedds_rpc serve|call DOMAIN

It says READY; `serve` adds, and refuses negative numbers; `call` asks whoever serves for 20+3, 21+3 and -1+3, prints
the answers and ends.  A line on standard input ends it.  The types are those that DDS-RPC 1.0 §7.5.1.1.1 gives in IDL.
"""

# The package's annotations (array[...]) mean something at run time only.
# mypy: ignore-errors
# pyright: basic, reportInvalidTypeForm=false, reportInvalidTypeArguments=false, reportArgumentType=false
# pyright: reportGeneralTypeIssues=false, reportCallIssue=false, reportIndexIssue=false, reportUndefinedVariable=false

import sys
import threading
import time
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlEnum, IdlStruct
from cyclonedds.idl.annotations import appendable, final
from cyclonedds.idl.types import array, bounded_str, byte, int32, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration


@dataclass
@final
class EntityId(IdlStruct, typename="dds::EntityId_t"):
    entityKey: array[byte, 3]  # noqa: N815
    entityKind: byte  # noqa: N815


@dataclass
@final
class Guid(IdlStruct, typename="dds::GUID_t"):
    guidPrefix: array[byte, 12]  # noqa: N815
    entityId: EntityId  # noqa: N815


@dataclass
@final
class SequenceNumber(IdlStruct, typename="dds::SequenceNumber_t"):
    high: int32
    low: uint32


@dataclass
@final
class SampleIdentity(IdlStruct, typename="dds::SampleIdentity"):
    writer_guid: Guid
    sequence_number: SequenceNumber


@dataclass
@final
class RequestHeader(IdlStruct, typename="dds::rpc::RequestHeader"):
    requestId: SampleIdentity  # noqa: N815
    instanceName: bounded_str[255]  # noqa: N815


class RemoteExceptionCode(IdlEnum, typename="dds::rpc::RemoteExceptionCode_t"):
    REMOTE_EX_OK = 0
    REMOTE_EX_UNSUPPORTED = 1
    REMOTE_EX_INVALID_ARGUMENT = 2
    REMOTE_EX_OUT_OF_RESOURCES = 3
    REMOTE_EX_UNKNOWN_OPERATION = 4
    REMOTE_EX_UNKNOWN_EXCEPTION = 5


@dataclass
@final
class ReplyHeader(IdlStruct, typename="dds::rpc::ReplyHeader"):
    relatedRequestId: SampleIdentity  # noqa: N815
    remoteEx: RemoteExceptionCode  # noqa: N815


@dataclass
@appendable
class Numbers(IdlStruct, typename="Numbers"):
    a: int32
    b: int32


@dataclass
@appendable
class Sum(IdlStruct, typename="Sum"):
    total: int32


@dataclass
@final
class AdderRequest(IdlStruct, typename="Adder_Request"):
    header: RequestHeader
    data: Numbers


@dataclass
@final
class AdderReply(IdlStruct, typename="Adder_Reply"):
    header: ReplyHeader
    data: Sum


QOS = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepAll)
_LOOK_S = 0.005


def serve(requests: DataReader, replies: DataWriter, is_over: threading.Event) -> None:
    while not is_over.wait(_LOOK_S):
        for request in requests.take(N=16):
            if isinstance(request, AdderRequest):
                is_right = request.data.a >= 0
                code = RemoteExceptionCode.REMOTE_EX_OK if is_right else RemoteExceptionCode.REMOTE_EX_INVALID_ARGUMENT
                total = request.data.a + request.data.b if is_right else 0
                replies.write(AdderReply(ReplyHeader(request.header.requestId, code), Sum(total)))


def call(requests: DataWriter, replies: DataReader, is_over: threading.Event) -> None:
    while not (requests.get_matched_subscriptions() and replies.get_matched_publications()):
        if is_over.wait(_LOOK_S):
            return
    asker = Guid(bytes(range(12)), EntityId(bytes(3), 2))
    for number, a in enumerate((20, 21, -1), 1):
        identity = SampleIdentity(asker, SequenceNumber(0, number))
        requests.write(AdderRequest(RequestHeader(identity, ""), Numbers(a, 3)))
        answer = None
        while answer is None and not is_over.wait(_LOOK_S):
            found = [each for each in replies.take(N=16) if isinstance(each, AdderReply)]
            answer = next((each for each in found if each.header.relatedRequestId == identity), None)
        if answer is not None:
            print("ANSWER", answer.header.remoteEx.name, answer.data.total, flush=True)


def main(role: str, domain: int) -> None:
    participant = DomainParticipant(domain)
    requests = Topic(participant, "Adder_Request", AdderRequest, qos=QOS)
    replies = Topic(participant, "Adder_Reply", AdderReply, qos=QOS)
    is_over = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.readline(), is_over.set()), daemon=True).start()
    if role == "serve":
        writer, reader = DataWriter(participant, replies, qos=QOS), DataReader(participant, requests, qos=QOS)
        print("READY", flush=True)
        serve(reader, writer, is_over)
    else:
        writer, reader = DataWriter(participant, requests, qos=QOS), DataReader(participant, replies, qos=QOS)
        print("READY", flush=True)
        call(writer, reader, is_over)
    time.sleep(0.1)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
