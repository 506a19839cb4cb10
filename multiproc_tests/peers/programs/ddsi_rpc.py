"""A client or a service of ``ddsi.rpc``, for another vendor's at the other end: see ``cyclonedds_rpc``.

ddsi_rpc serve|call DOMAIN
"""

from __future__ import annotations

import sys

import trio

import ddsi
from ddsi import idl, rpc


@idl.struct
class Numbers:
    a: idl.int32
    b: idl.int32


@idl.struct
class Sum:
    total: idl.int32


async def add(numbers: Numbers) -> Sum:
    if numbers.a < 0:
        raise rpc.RemoteError(rpc.RemoteExceptionCode.REMOTE_EX_INVALID_ARGUMENT)
    return Sum(numbers.a + numbers.b)


async def call(participant: ddsi.DomainParticipant) -> None:
    client = rpc.Client(participant, "Adder", Numbers, Sum)
    print("READY", flush=True)
    for a in (20, 21, -1):
        try:
            print("ANSWER REMOTE_EX_OK", (await client.call(Numbers(a, 3), timeout=20)).total, flush=True)
        except rpc.RemoteError as error:
            print("ANSWER", error.code.name, 0, flush=True)


async def serve(participant: ddsi.DomainParticipant) -> None:
    service = rpc.Service(participant, "Adder", Numbers, Sum)
    async with trio.open_nursery() as nursery:
        nursery.start_soon(service.serve, add)
        print("READY", flush=True)
        await trio.to_thread.run_sync(sys.stdin.readline)
        service.close()


async def main(role: str, domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        await (serve if role == "serve" else call)(participant)


if __name__ == "__main__":
    trio.run(main, sys.argv[1], int(sys.argv[2]))
