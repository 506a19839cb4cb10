"""Our own peer: the public face of ddsi, with the command line and the events of the others.

The network comes from DDSI_URI.
"""

from __future__ import annotations

import os
import signal
import sys
from typing import Annotated, Any

import trio

import ddsi
from ddsi import idl

from .protocol import Arguments, blob_octets, describe, open_fields, parse_arguments, say

REVOCATION_LIST = "identity_ca.crl.pem"


@idl.struct(extensibility=idl.FINAL)
class ShapeType:
    color: Annotated[str, idl.key, idl.bound(128)]
    x: idl.int32
    y: idl.int32
    shapesize: idl.int32


@idl.struct(extensibility=idl.FINAL)
class PlainShape:
    color: Annotated[str, idl.bound(128)]
    x: idl.int32
    y: idl.int32
    shapesize: idl.int32


@idl.struct(extensibility=idl.APPENDABLE)
class OpenShape:
    color: Annotated[str, idl.key, idl.bound(128)]
    tint: idl.octet
    angle: idl.float64
    stamp: idl.int64
    x: idl.int32
    y: idl.int32
    shapesize: idl.int32


@idl.struct(extensibility=idl.FINAL)
class Blob:
    id: idl.int32
    data: idl.sequence[idl.octet]


@idl.struct(extensibility=idl.FINAL)
class KeyedBlob:
    id: Annotated[idl.int32, idl.key]
    data: idl.sequence[idl.octet]


def kind_of(o: Arguments) -> type[Any]:
    if o.blob_octets >= 0:
        return Blob if o.keyless else KeyedBlob
    if o.appendable:
        return OpenShape
    return PlainShape if o.keyless else ShapeType


def make_sample(o: Arguments, number: int) -> Any:
    kind, color = kind_of(o), o.colors[number % len(o.colors)]
    if o.blob_octets >= 0:
        return kind(number, blob_octets(o.blob_octets, number))
    if o.appendable:
        return kind(color, *open_fields(number), number, 2 * number, o.size)
    return kind(color, number, 2 * number, o.size)


def key_of(sample: Any) -> Any:
    return sample.id if hasattr(sample, "data") else sample.color


def participant_qos(o: Arguments) -> ddsi.Qos:
    """The identity, the rights and the governance in the folder of ``-k``, under the OMG's names."""
    if not o.store:
        return ddsi.Qos()
    files = {
        "dds.sec.auth.identity_ca": "identity_ca.pem",
        "dds.sec.auth.identity_certificate": f"{o.name}.pem",
        "dds.sec.auth.private_key": f"{o.name}.key",
        "dds.sec.access.permissions_ca": "permissions_ca.pem",
        "dds.sec.access.governance": o.governance,
        "dds.sec.access.permissions": f"{o.name}.permissions.p7s",
    }
    if os.path.exists(f"{o.store}/{REVOCATION_LIST}"):
        files["dds.sec.auth.crl"] = REVOCATION_LIST
    properties = {name: f"file:{o.store}/{file}" for name, file in files.items()}
    return ddsi.Qos(properties={**properties, "dds.sec.log.log_level": "WARNING_LEVEL"})


def endpoint_qos(o: Arguments) -> ddsi.Qos:
    qos = ddsi.Qos(
        reliability=ddsi.BestEffort() if o.best_effort else ddsi.Reliable(max_blocking_time=10),
        durability=ddsi.Volatile() if o.volatile else ddsi.TransientLocal(),
        history=ddsi.KeepLast(o.depth) if o.depth else ddsi.KeepAll(),
        writer_data_lifecycle=ddsi.WriterDataLifecycle(autodispose_unregistered_instances=False),
    )
    if o.max_samples:
        qos |= ddsi.Qos(resource_limits=ddsi.ResourceLimits(max_samples=o.max_samples))
    if o.representation:
        chosen = ddsi.XCDR2 if o.representation == 2 else ddsi.XCDR1
        qos |= ddsi.Qos(data_representation=ddsi.DataRepresentation(chosen))
    return qos


def group_qos(o: Arguments) -> ddsi.Qos:
    return ddsi.Qos(partition=ddsi.Partition(*o.partitions))


async def wait_for_input() -> None:
    """Waits until something, or the end, has come on standard input."""
    await trio.lowlevel.wait_readable(sys.stdin.fileno())


async def wait_for_line() -> None:
    """Waits for a line, or the end, on standard input, and reads not an octet beyond it."""
    octet = b" "
    while octet not in (b"\n", b""):
        await wait_for_input()
        octet = os.read(sys.stdin.fileno(), 1)


async def publish(o: Arguments, writer: Any) -> int:
    if o.readers:
        try:
            await writer.wait_for_matched(o.readers, timeout=o.wait_s)
        except ddsi.DdsTimeout:
            say("TIMEOUT 0 of", o.readers, "readers")
            return 1
    say("MATCHED", o.readers)
    if o.gate:
        await wait_for_line()
    sample = None
    for number in range(o.count):
        sample = make_sample(o, number)
        await writer.write(sample)
        say("WROTE", describe(sample))
        await trio.sleep(o.interval_ms / 1000)
    if o.dispose:
        await writer.dispose(sample)
        say("DISPOSED", key_of(sample))
    if o.unregister:
        await writer.unregister(sample)
        say("UNREGISTERED", key_of(sample))
    if not o.best_effort:
        try:
            await writer.wait_for_acknowledgments(o.wait_s)
            say("ACKED")
        except ddsi.DdsTimeout:
            say("NOT-ACKED")
    if o.hold:
        say("HOLDING")
        await wait_for_line()
    else:
        await trio.sleep(o.linger_ms / 1000)
    say("DONE", o.count)
    return 0


class Taker:
    """Says what a reader receives, and knows when that was everything that is expected."""

    def __init__(self, o: Arguments, reader: Any) -> None:
        self.options = o
        self.reader = reader
        self.samples = 0
        self.has_disposed = self.has_no_writers = False
        self.complete = trio.Event()

    async def take_all(self) -> None:
        async for sample in self.reader:
            self._say(sample)
            o = self.options
            if self.samples >= o.count and self.has_disposed >= o.dispose and self.has_no_writers >= o.unregister:
                self.complete.set()
            if o.read_pause_ms:
                await trio.sleep(o.read_pause_ms / 1000)

    def _say(self, sample: Any) -> None:
        if sample.info.valid_data:
            say("SAMPLE", describe(sample.data))
            self.samples += 1
        elif sample.info.instance_state.name == "NOT_ALIVE_DISPOSED":
            say("DISPOSED", key_of(sample.data))
            self.has_disposed = True
        elif sample.info.instance_state.name == "NOT_ALIVE_NO_WRITERS":
            say("NO-WRITERS", key_of(sample.data))
            self.has_no_writers = True

    async def watch_matches(self) -> None:
        async for event in self.reader.events():
            if isinstance(event, ddsi.SubscriptionMatched):
                say("MATCHED", event.current_count)


async def subscribe(o: Arguments, reader: Any) -> int:
    taker = Taker(o, reader)
    async with trio.open_nursery() as nursery:
        nursery.start_soon(taker.take_all)
        nursery.start_soon(taker.watch_matches)
        with trio.move_on_after(o.wait_s):
            await taker.complete.wait()
        if not taker.complete.is_set():
            say("TIMEOUT", taker.samples, "of", o.count)
            nursery.cancel_scope.cancel()
            return 1
        if o.hold:
            say("HOLDING")
            await wait_for_input()  # what still comes is too much, and said
        else:
            await trio.sleep(o.linger_ms / 1000)
        nursery.cancel_scope.cancel()
    say("DONE", taker.samples)
    return 0


async def watch_refusals(entity: Any) -> None:
    """Says whom security refuses, and when it is ourselves, and why."""
    async for event in entity.events():
        if isinstance(event, ddsi.SecurityRefused):
            say("REFUSED", event.reason)
        elif isinstance(event, ddsi.SecurityRevoked):
            say("REVOKED", event.reason)


async def tell_what_was_dropped(participant: ddsi.DomainParticipant) -> None:
    """Whenever somebody asks by SIGUSR1."""
    with trio.open_signal_receiver(signal.SIGUSR1) as requests:
        async for _ in requests:
            say("DROPPED", *(f"{reason}={count}" for reason, count in sorted(participant.drop_counts().items())))


async def main() -> int:
    o = parse_arguments()
    try:
        async with ddsi.DomainParticipant(o.domain, qos=participant_qos(o)) as participant:
            say("GUID", participant.guid.hex())
            async with trio.open_nursery() as nursery:
                nursery.start_soon(watch_refusals, participant)
                nursery.start_soon(tell_what_was_dropped, participant)
                status = await play(o, participant, nursery)
                nursery.cancel_scope.cancel()
            return status
    except ddsi.DdsError as error:
        say("ERROR", " ".join(str(error).split()))
        return 2


async def play(o: Arguments, participant: ddsi.DomainParticipant, nursery: trio.Nursery) -> int:
    topic: Any = ddsi.Topic(participant, o.topic, kind_of(o))
    try:
        entity: Any
        if o.is_publisher:
            entity = ddsi.DataWriter(ddsi.Publisher(participant, group_qos(o)), topic, endpoint_qos(o))
        else:
            entity = ddsi.DataReader(ddsi.Subscriber(participant, group_qos(o)), topic, endpoint_qos(o))
        nursery.start_soon(watch_refusals, entity)
        return await (publish if o.is_publisher else subscribe)(o, entity)
    except ddsi.DdsError as error:
        say("ERROR", " ".join(str(error).split()))
        return 2


if __name__ == "__main__":
    sys.exit(trio.run(main))
