"""Ours: the roles as an application of this stack would play them, through its public face alone."""

from __future__ import annotations

import time
from collections.abc import Awaitable, Callable
from functools import partial
from typing import Annotated

import trio

import ddsi
from ddsi import idl

from .memory import Growth, resident_mib
from .protocol import PAYLOAD_BYTE, play, say_ready, summarise_round_trips

QOS = ddsi.Qos(reliability=ddsi.Reliable(max_blocking_time=30), history=ddsi.KeepAll())
_WARM_UP = 100
_SETTLE_S = 0.2


@idl.struct(typename="ShapeType", extensibility=idl.FINAL)
class ShapeType:
    color: Annotated[str, idl.key, idl.bound(128)]
    x: idl.int32
    y: idl.int32
    shapesize: idl.int32


@idl.struct(typename="Octets", extensibility=idl.FINAL)
class Octets:
    x: idl.int32
    octets: idl.sequence[idl.uint8]


Sample = ShapeType | Octets


def kind_of(octets: int) -> type[Sample]:
    return Octets if octets else ShapeType


def maker_of(octets: int) -> Callable[[int], Sample]:
    """Makes the sample of a number; ``octets`` 0 stands for a ShapeType."""
    if octets:
        payload = PAYLOAD_BYTE * octets
        return lambda number: Octets(number, payload)
    return lambda number: ShapeType("BLUE", number, 20, 30)


# --- throughput ------------------------------------------------------------------------------------------


def participant_of(domain: int, enclave: str = "") -> ddsi.DomainParticipant:
    """Secured by the keystore folder ``enclave``, if there is one."""
    return ddsi.DomainParticipant(domain, qos=ddsi.secure(enclave) if enclave else None)


async def receive(domain: int, octets: int, count: int, enclave: str = "") -> dict[str, float]:
    async with participant_of(domain, enclave) as participant:
        reader = ddsi.DataReader(participant, ddsi.Topic(participant, "Throughput", kind_of(octets)), QOS)
        say_ready()
        received = 0
        start = processor = 0.0
        async for sample in reader:
            if not received:
                start, processor = time.perf_counter(), time.process_time()
            received += 1
            if sample.data.x == count - 1:
                break
        seconds = time.perf_counter() - start
        processor = time.process_time() - processor
        if received != count:
            raise RuntimeError(f"received {received} samples of {count}")
        return {"per_second": (count - 1) / seconds, "processor_us": processor / count * 1e6}


async def send(domain: int, octets: int, count: int, enclave: str = "") -> dict[str, float]:
    make = maker_of(octets)
    async with participant_of(domain, enclave) as participant:
        topic: ddsi.Topic[Sample] = ddsi.Topic(participant, "Throughput", kind_of(octets))
        writer = ddsi.DataWriter(participant, topic, QOS)
        await writer.wait_for_matched()
        await trio.sleep(_SETTLE_S)
        processor = time.process_time()
        for number in range(count):
            await writer.write(make(number))
        await writer.wait_for_acknowledgments(30)
        return {"processor_us": (time.process_time() - processor) / count * 1e6}


# --- round trip ------------------------------------------------------------------------------------------


async def echo(domain: int, count: int, enclave: str = "") -> None:
    async with participant_of(domain, enclave) as participant:
        reader = ddsi.DataReader(participant, ddsi.Topic(participant, "Ping", ShapeType), QOS)
        writer = ddsi.DataWriter(participant, ddsi.Topic(participant, "Pong", ShapeType), QOS)
        say_ready()
        async for sample in reader:
            await writer.write(sample.data)


async def ping(domain: int, count: int, enclave: str = "") -> dict[str, float]:
    async with participant_of(domain, enclave) as participant:
        writer = ddsi.DataWriter(participant, ddsi.Topic(participant, "Ping", ShapeType), QOS)
        reader = ddsi.DataReader(participant, ddsi.Topic(participant, "Pong", ShapeType), QOS)
        await writer.wait_for_matched()
        await reader.wait_for_matched()
        await trio.sleep(_SETTLE_S)
        seconds: list[float] = []
        processor = 0.0
        for number in range(_WARM_UP + count):
            if number == _WARM_UP:
                processor = time.process_time()
            start = time.perf_counter()
            await writer.write(ShapeType("BLUE", number, 20, 30))
            sample = await anext(reader)
            seconds.append(time.perf_counter() - start)
            if sample.data.x != number:
                raise RuntimeError(f"sent {number}, and {sample.data.x} came back")
        return summarise_round_trips(seconds[_WARM_UP:], time.process_time() - processor)


# --- matching --------------------------------------------------------------------------------------------


async def await_company(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        ddsi.DataReader(participant, ddsi.Topic(participant, "There", ShapeType), QOS)
        ddsi.DataWriter(participant, ddsi.Topic(participant, "Back", ShapeType), QOS)
        await trio.sleep(_SETTLE_S)
        say_ready()
        await trio.sleep_forever()


async def join(domain: int) -> dict[str, float]:
    start = time.perf_counter()
    async with ddsi.DomainParticipant(domain) as participant:
        writer = ddsi.DataWriter(participant, ddsi.Topic(participant, "There", ShapeType), QOS)
        reader = ddsi.DataReader(participant, ddsi.Topic(participant, "Back", ShapeType), QOS)
        await writer.wait_for_matched()
        await reader.wait_for_matched()
        return {"ms": (time.perf_counter() - start) * 1e3}


# --- secured ---------------------------------------------------------------------------------------------

LASTING = QOS | ddsi.Qos(durability=ddsi.TransientLocal())


async def offer_secret(domain: int, enclave: str) -> None:
    """Has written one sample, which lasts for whoever comes."""
    async with participant_of(domain, enclave) as participant:
        writer = ddsi.DataWriter(participant, ddsi.Topic(participant, "Secret", ShapeType), LASTING)
        await writer.write(ShapeType("BLUE", 1, 20, 30))
        await trio.sleep(_SETTLE_S)
        say_ready()
        await trio.sleep_forever()


async def learn_secret(domain: int, enclave: str) -> dict[str, float]:
    start, processor = time.perf_counter(), time.process_time()
    async with participant_of(domain, enclave) as participant:
        reader = ddsi.DataReader(participant, ddsi.Topic(participant, "Secret", ShapeType), LASTING)
        await anext(reader)
        seconds = time.perf_counter() - start
        return {"ms": seconds * 1e3, "processor_ms": (time.process_time() - processor) * 1e3}


# --- footprint -------------------------------------------------------------------------------------------


async def idle(domain: int) -> dict[str, float]:
    async with ddsi.DomainParticipant(domain):
        await trio.sleep(1)
        return {"mib": resident_mib()}


CROWD_TOPICS = 100


async def crowd(domain: int, endpoints: int) -> None:
    """Half writers and half readers, over as many topics as there are, or 100."""
    async with ddsi.DomainParticipant(domain) as participant:
        topics = [
            ddsi.Topic(participant, f"Crowd{number}", ShapeType) for number in range(min(endpoints, CROWD_TOPICS))
        ]
        for number in range(endpoints):
            topic = topics[number // 2 % len(topics)]
            ddsi.DataReader(participant, topic, QOS) if number % 2 else ddsi.DataWriter(participant, topic, QOS)
        say_ready()
        await trio.sleep_forever()


async def watch(domain: int) -> dict[str, float]:
    """What this participant's memory grows by; another one's endpoints come once it is ready."""
    async with ddsi.DomainParticipant(domain):
        await trio.sleep(1)
        before = resident_mib()
        say_ready()
        growth = Growth()
        while not growth.is_over(resident_mib() - before):
            await trio.sleep(Growth.INTERVAL_S)
        return {"mib": growth.latest}


def _run(role: Callable[..., Awaitable[dict[str, float] | None]]) -> Callable[..., dict[str, float] | None]:
    def run(**options: object) -> dict[str, float] | None:
        return trio.run(partial(role, **options))

    return run


if __name__ == "__main__":
    play(
        {
            "receive": _run(receive),
            "send": _run(send),
            "echo": _run(echo),
            "ping": _run(ping),
            "await_company": _run(await_company),
            "join": _run(join),
            "offer_secret": _run(offer_secret),
            "learn_secret": _run(learn_secret),
            "idle": _run(idle),
            "crowd": _run(crowd),
            "watch": _run(watch),
        }
    )
