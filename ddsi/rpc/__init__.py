"""Request and reply over topics.  DDS-RPC 1.0: the request-reply style, in the basic and the enhanced service mapping.

    client = ddsi.rpc.Client(participant, "Adder", Numbers, Sum)
    reply = await client.call(Numbers(2, 3), timeout=1)

    service = ddsi.rpc.Service(participant, "Adder", Numbers, Sum)
    async for request in service:
        await request.reply(Sum(request.data.a + request.data.b))

Not here: the function-call style with interfaces, and discovery of services by their instance names.
"""

from .client import Client
from .identity import RemoteError, RemoteExceptionCode, ReplyHeader, RequestHeader, SampleIdentity
from .mapping import Mapping
from .service import Request, Service

__all__ = [
    "Client",
    "Mapping",
    "RemoteError",
    "RemoteExceptionCode",
    "ReplyHeader",
    "Request",
    "RequestHeader",
    "SampleIdentity",
    "Service",
]
