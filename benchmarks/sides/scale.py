"""Scale: two participants in one process, with many instances, many readers of one topic, or many topics.

Processor time and memory are those of both sides together.
"""

from __future__ import annotations

import math
import time
from collections.abc import Awaitable, Callable
from functools import partial
from typing import Annotated

import trio

import ddsi
from ddsi import idl

from .memory import resident_mib
from .ours import QOS
from .protocol import play

_TIMEOUT_S = 60.0
_ROUNDS = 3
_WRITES = 100
_LATEST = QOS | ddsi.Qos(history=ddsi.KeepLast(1))


@idl.struct(extensibility=idl.FINAL)
class Track:
    """Each ``number`` is an instance."""

    number: Annotated[idl.int32, idl.key]
    x: idl.int32 = 0


async def instances(domain: int, count: int) -> dict[str, float]:
    """A sample to each of so many instances, of which the reader keeps the latest; ``us`` a sample, ``kib`` each."""
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as there:
        writer = ddsi.DataWriter(here, ddsi.Topic(here, "Track", Track), _LATEST)
        reader = ddsi.DataReader(there, ddsi.Topic(there, "Track", Track), _LATEST)
        await writer.wait_for_matched(timeout=_TIMEOUT_S)
        before_mib, best = resident_mib(), math.inf
        for x in range(_ROUNDS):
            start = time.process_time()
            for number in range(count):
                await writer.write(Track(number, x))
            await writer.wait_for_acknowledgments(_TIMEOUT_S)
            best = min(best, time.process_time() - start)
        kib = (resident_mib() - before_mib) * 1024
        if len(reader.read()) != count:
            raise RuntimeError(f"the reader has {len(reader.read())} of {count} instances")
        return {"us": best / count * 1e6, "kib": kib / count}


async def readers(domain: int, count: int) -> dict[str, float]:
    """Samples to so many readers of one topic; ``us`` for each sample at each reader, ``kib`` a reader."""
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as there:
        writer = ddsi.DataWriter(here, ddsi.Topic(here, "Track", Track), QOS)
        before_mib, best = resident_mib(), math.inf
        topic = ddsi.Topic(there, "Track", Track)
        found = [ddsi.DataReader(there, topic, QOS) for _ in range(count)]
        await writer.wait_for_matched(count, timeout=_TIMEOUT_S)
        kib = (resident_mib() - before_mib) * 1024
        for _ in range(_ROUNDS):
            start = time.process_time()
            for x in range(_WRITES):
                await writer.write(Track(1, x))
            await writer.wait_for_acknowledgments(_TIMEOUT_S)
            taken = [len(reader.take()) for reader in found]
            best = min(best, time.process_time() - start)
            if taken != [_WRITES] * count:
                raise RuntimeError(f"some of {count} readers lack samples")
        return {"us": best / count / _WRITES * 1e6, "kib": kib / count}


async def topics(domain: int, count: int) -> dict[str, float]:
    """So many topics with a writer and a reader each, until all are matched; ``us`` and ``kib`` a topic."""
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as there:
        before_mib, start = resident_mib(), time.process_time()
        writers = [ddsi.DataWriter(here, ddsi.Topic(here, f"Track{at}", Track), QOS) for at in range(count)]
        wanting = [ddsi.DataReader(there, ddsi.Topic(there, f"Track{at}", Track), QOS) for at in range(count)]
        for writer, reader in zip(writers, wanting, strict=True):
            await writer.wait_for_matched(timeout=_TIMEOUT_S)
            await reader.wait_for_matched(timeout=_TIMEOUT_S)
        seconds = time.process_time() - start
        return {"us": seconds / count * 1e6, "kib": (resident_mib() - before_mib) * 1024 / count}


def _run(role: Callable[..., Awaitable[dict[str, float]]]) -> Callable[..., dict[str, float]]:
    def run(**options: object) -> dict[str, float]:
        return trio.run(partial(role, **options))

    return run


if __name__ == "__main__":
    play({"instances": _run(instances), "readers": _run(readers), "topics": _run(topics)})
