"""Request and reply over topics.  DDS-RPC 1.0: requests and replies in the basic and the enhanced service mapping.

    client = ddsi.rpc.Client(participant, "Adder", Numbers, Sum)
    reply = await client.call(Numbers(2, 3), timeout=1)

    service = ddsi.rpc.Service(participant, "Adder", Numbers, Sum)
    async for request in service:
        await request.reply(Sum(request.data.a + request.data.b))

or, of a class ``Adder`` with ``async def add(self, a: idl.int32, b: idl.int32) -> idl.int32``:

    await ddsi.rpc.InterfaceService(participant, Adder).serve(implementation)

    total = await ddsi.rpc.InterfaceClient(participant, Adder).calls.add(2, 3)

Not here: discovery of services by their instance names.
"""

from .client import Client
from .identity import RemoteError, RemoteExceptionCode, ReplyHeader, RequestHeader, SampleIdentity
from .interface import InterfaceClient, InterfaceService
from .mapping import Mapping
from .service import Request, Service

__all__ = [
    "Client",
    "InterfaceClient",
    "InterfaceService",
    "Mapping",
    "RemoteError",
    "RemoteExceptionCode",
    "ReplyHeader",
    "Request",
    "RequestHeader",
    "SampleIdentity",
    "Service",
]
