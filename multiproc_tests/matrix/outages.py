"""Plays in which somebody goes away for a while: a cable is pulled, a process is killed or stands still.

What is promised: a reliable, transient-local, KEEP_ALL pair delivers everything once and in order, also to those who
were away for longer than their lease, so that each side has forgotten the other.  Of a writer that is killed nobody can
promise what it had not yet sent.
"""

from __future__ import annotations

from itertools import takewhile

import trio

from ..framework import ExpectationFailed, Process
from .stories import Cast, dismiss, written

__all__ = ["kill_publisher", "kill_subscriber", "pull_cable", "stop_publisher", "stop_subscriber"]

FIRST_SAMPLES = 5
REPEATING = frozenset({"cyclone", "cyclone11"})
"""A reader of Cyclone DDS forgets all of a writer whose lease ended, and delivers its history again when it returns."""


async def pull_cable(cast: Cast, *, seconds: float) -> None:
    """The subscriber's interface goes away while the publisher writes, and returns."""
    publisher, subscriber = await _begin(cast)
    cast.subscriber_host.interface_down()
    await trio.sleep(seconds)  # the outage itself: there is nothing else to wait for
    cast.subscriber_host.interface_up()
    await _end(cast, publisher, subscriber)


async def kill_publisher(cast: Cast) -> None:
    """It dies while it writes; the subscriber notices when the lease ends, and gets all that the next one writes."""
    first, subscriber = await _begin(cast)
    first.kill()
    await first.wait()
    await subscriber.expect("MATCHED 0", timeout=cast.patience)
    second = await cast.start_publisher()
    await second.expect("HOLDING", timeout=cast.patience)
    await subscriber.expect(f"SAMPLE {written(second)[-1]}", timeout=cast.patience)
    await dismiss(second)
    await dismiss(subscriber)
    heard = _heard(cast, subscriber)
    # It was killed, maybe, when it had written one more and not said so: all write the same.
    told = written(first)
    both = zip(heard, [*told, *written(second)[len(told) :][:1]], strict=False)
    count = sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], both))
    repeated = count if cast.subscriber.name in REPEATING else 0  # then these were said before
    if heard[count:] != written(second)[repeated:]:
        raise ExpectationFailed(f"{count} samples of the first, and then not all of the second but {heard[count:]}")


async def kill_subscriber(cast: Cast) -> None:
    """It dies while it reads; the publisher waits for it no longer than its lease, and keeps all for the next one."""
    publisher, first = await _begin(cast)
    first.kill()
    await first.wait()
    await publisher.expect("ACKED", timeout=cast.patience)
    second = await cast.start_subscriber()
    await second.expect("HOLDING", timeout=cast.patience)
    await dismiss(second)
    await dismiss(publisher)
    _check_heard(cast, second, written(publisher))


async def stop_publisher(cast: Cast, *, seconds: float) -> None:
    """It stands still (SIGSTOP) for longer than its lease, and goes on: the subscriber loses it and finds it again."""
    publisher, subscriber = await _begin(cast)
    publisher.suspend()
    await subscriber.expect("MATCHED 0", timeout=seconds)
    publisher.resume()
    await subscriber.expect("MATCHED 1", timeout=cast.patience)
    await _end(cast, publisher, subscriber)


async def stop_subscriber(cast: Cast, *, seconds: float) -> None:
    """It stands still for longer than its lease, and goes on: the publisher has forgotten it, and finds it again."""
    publisher, subscriber = await _begin(cast)
    subscriber.suspend()
    await trio.sleep(seconds)  # as long as it stands still it says nothing that could be waited for
    subscriber.resume()
    await _end(cast, publisher, subscriber)


async def _begin(cast: Cast) -> tuple[Process, Process]:
    """Both are there, and writing has begun."""
    subscriber = await cast.start_subscriber()
    publisher = await cast.start_publisher()
    for _ in range(FIRST_SAMPLES):
        await subscriber.expect("SAMPLE .*", timeout=cast.patience)
    return publisher, subscriber


async def _end(cast: Cast, publisher: Process, subscriber: Process) -> None:
    """All that was written is there, once and in order, and acknowledged."""
    await publisher.expect("HOLDING", timeout=cast.patience)
    if not publisher.matches("ACKED"):
        raise ExpectationFailed("the publisher's samples were not all acknowledged")
    await subscriber.expect("HOLDING", timeout=cast.patience)
    await dismiss(publisher)
    await dismiss(subscriber)
    _check_heard(cast, subscriber, written(publisher))


def _check_heard(cast: Cast, subscriber: Process, expected: list[str]) -> None:
    heard = _heard(cast, subscriber)
    if heard != expected:
        raise ExpectationFailed(f"written: {expected}, received: {heard}")


def _heard(cast: Cast, subscriber: Process) -> list[str]:
    """The samples in the order in which they came; of a peer that is known to repeat, each when it came first."""
    heard = [match[1] for match in subscriber.matches("SAMPLE (.*)")]
    return list(dict.fromkeys(heard)) if cast.subscriber.name in REPEATING else heard
