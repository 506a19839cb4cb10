"""Content filters: one writer, and a participant with several readers that want a share of the samples each."""

from __future__ import annotations

import time
from collections.abc import Awaitable, Callable
from functools import partial

import trio

import ddsi

from .memory import resident_mib
from .ours import QOS, ShapeType
from .protocol import play, say_ready

SHARES = 32
"""Every reader wants one sample in so many, each another one."""
_SETTLE_S = 0.2


async def receive(domain: int, readers: int, count: int) -> dict[str, float]:
    """``readers`` up to SHARES; ``count`` samples are written."""
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Filtered", ShapeType)
        found = [0] * readers
        before_mib = resident_mib()
        filtered = [
            ddsi.ContentFilteredTopic(participant, f"Share{share}", topic, "shapesize = %0", [str(share)])
            for share in range(readers)
        ]
        wanting = [ddsi.DataReader(participant, of_share, QOS) for of_share in filtered]
        say_ready()
        expected = sum(1 for number in range(count) if number % SHARES < readers)
        processor = 0.0

        async def take(share: int) -> None:
            nonlocal processor
            async for sample in wanting[share]:
                if not sample.info.valid_data:  # the writer has left before others had all of theirs
                    continue
                if sample.data.shapesize != share:
                    raise RuntimeError(f"reader {share} was given {sample.data}")
                processor = processor or time.process_time()
                found[share] += 1
                if sum(found) >= expected:
                    nursery.cancel_scope.cancel()

        async with trio.open_nursery() as nursery:
            for share in range(readers):
                nursery.start_soon(take, share)
        return {"processor_us": (time.process_time() - processor) / count * 1e6, "mib": resident_mib() - before_mib}


async def send(domain: int, readers: int, count: int) -> dict[str, float]:
    async with ddsi.DomainParticipant(domain) as participant:
        writer = ddsi.DataWriter(participant, ddsi.Topic(participant, "Filtered", ShapeType), QOS)
        await writer.wait_for_matched(readers)
        await trio.sleep(_SETTLE_S)
        processor = time.process_time()
        for number in range(count):
            await writer.write(ShapeType("BLUE", number, 20, number % SHARES))
        await writer.wait_for_acknowledgments(30)
        return {"processor_us": (time.process_time() - processor) / count * 1e6}


def _run(role: Callable[..., Awaitable[dict[str, float]]]) -> Callable[..., dict[str, float]]:
    def run(**options: object) -> dict[str, float]:
        return trio.run(partial(role, **options))

    return run


if __name__ == "__main__":
    play({"receive": _run(receive), "send": _run(send)})
