"""The plays: a publisher and a subscriber, step by step, and what each must have said in the end.

Both hold when they are done, until they are told to leave.  So no step depends on who is faster, and whatever comes
too late or twice is still seen.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass, replace

from ..framework import ExpectationFailed, Namespace, Process, Scenario
from ..peers.options import Options
from ..peers.peer import Peer

__all__ = [
    "Cast",
    "Story",
    "deliver",
    "deliver_late",
    "deliver_some",
    "deliver_to_all",
    "deliver_to_newcomer",
    "deliver_to_two",
    "dismiss",
    "refuse",
    "restart_publisher",
    "restart_subscriber",
    "say_goodbye",
    "written",
]

STEP_TIMEOUT = 20.0
"""Seconds for a step on a quiet host; a step also gets what the programs' own option ``-w`` gives them."""


@dataclass(frozen=True, slots=True)
class Cast:
    """Who plays, where, and with what options each."""

    stage: Scenario
    publisher_host: Namespace
    subscriber_host: Namespace
    publisher: Peer
    subscriber: Peer
    publisher_options: Options
    subscriber_options: Options

    @property
    def patience(self) -> float:
        return max(STEP_TIMEOUT, self.publisher_options.wait_s + 2, self.subscriber_options.wait_s + 2)

    async def start_publisher(self) -> Process:
        here, there = self.publisher_host, self.subscriber_host
        return await self.publisher.start(self.stage, "pub", self.publisher_options, host=here, others=[there])

    async def start_subscriber(self) -> Process:
        here, there = self.subscriber_host, self.publisher_host
        return await self.subscriber.start(self.stage, "sub", self.subscriber_options, host=here, others=[there])


Story = Callable[[Cast], Awaitable[None]]


async def deliver(cast: Cast) -> None:
    """Everything written is received, once and in order, and acknowledged; so are a dispose and an unregister."""
    subscriber = await cast.start_subscriber()
    await _deliver(cast, await cast.start_publisher(), subscriber)


async def deliver_to_newcomer(cast: Cast) -> None:
    """The same where the publisher is there first."""
    publisher = await cast.start_publisher()
    await publisher.expect("GUID .*", timeout=cast.patience)
    await _deliver(cast, publisher, await cast.start_subscriber())


async def _deliver(cast: Cast, publisher: Process, subscriber: Process) -> None:
    await _open_gate(cast, publisher, subscriber)
    await publisher.expect("HOLDING", timeout=cast.patience)
    await subscriber.expect("HOLDING", timeout=cast.patience)
    _check_acknowledged(cast, publisher)
    _check_gone(cast, publisher, subscriber)
    await dismiss(publisher)
    await dismiss(subscriber)
    _check_received(subscriber, written(publisher))


async def deliver_to_two(cast: Cast) -> None:
    """Two subscribers, as bob and as dave where they are secured, each get everything."""
    as_dave = replace(cast.subscriber_options, identity="dave")
    await deliver_to_all(cast, replace(cast, subscriber_options=as_dave))


async def deliver_to_all(*casts: Cast) -> None:
    """One publisher, that of the first cast, and the subscribers of all of them, who each get everything."""
    subscribers = [await cast.start_subscriber() for cast in casts]
    cast = casts[0]
    publisher = await cast.start_publisher()
    for process in (publisher, *subscribers):
        await process.expect("HOLDING", timeout=cast.patience)
    _check_acknowledged(cast, publisher)
    for process in (publisher, *subscribers):
        await dismiss(process)
    for subscriber in subscribers:
        _check_received(subscriber, written(publisher))


async def restart_subscriber(cast: Cast) -> None:
    """A subscriber that dies without a word comes back, and gets what is kept; nobody has forgotten anybody yet."""
    first = await cast.start_subscriber()
    publisher = await cast.start_publisher()
    await publisher.expect("HOLDING", timeout=cast.patience)
    await first.expect("HOLDING", timeout=cast.patience)
    first.kill()
    await first.wait()
    second = await cast.start_subscriber()
    await second.expect("HOLDING", timeout=cast.patience)
    await dismiss(second)
    await dismiss(publisher)
    _check_received(second, written(publisher))


async def restart_publisher(cast: Cast) -> None:
    """A publisher that dies without a word comes back: the subscriber gets all that both write."""
    options = replace(cast.subscriber_options, count=2 * cast.subscriber_options.count)
    subscriber = await replace(cast, subscriber_options=options).start_subscriber()
    first = await cast.start_publisher()
    await first.expect("HOLDING", timeout=cast.patience)
    first.kill()
    await first.wait()
    second = await cast.start_publisher()
    await second.expect("HOLDING", timeout=cast.patience)
    await subscriber.expect("HOLDING", timeout=cast.patience)
    await dismiss(second)
    await dismiss(subscriber)
    _check_received(subscriber, written(first) + written(second))


async def deliver_some(cast: Cast) -> None:
    """Best effort: what is received was written, once and in order; on a quiet host little is lost."""
    subscriber = await cast.start_subscriber()
    publisher = await cast.start_publisher()
    await _open_gate(cast, publisher, subscriber)
    await subscriber.expect("HOLDING", timeout=cast.patience)
    await publisher.expect("HOLDING", timeout=cast.patience)
    await dismiss(publisher)
    await dismiss(subscriber)
    samples = iter(written(publisher))
    for sample in [match[1] for match in subscriber.matches("SAMPLE (.*)")]:
        if sample not in samples:  # `in` moves the iterator on: order and number matter
            raise ExpectationFailed(f"{sample!r} was not written, or received twice, or out of order")


async def deliver_late(cast: Cast) -> None:
    """A subscriber that comes after the last write gets what the publisher's history keeps."""
    publisher = await cast.start_publisher()
    await publisher.expect("HOLDING", timeout=cast.patience)
    subscriber = await cast.start_subscriber()
    await subscriber.expect("HOLDING", timeout=cast.patience)
    await dismiss(subscriber)
    await dismiss(publisher)
    _check_received(subscriber, _latest(written(publisher), cast.publisher_options.depth), in_any_order=True)


async def say_goodbye(cast: Cast) -> None:
    """A publisher that leaves is gone at once for the subscriber: it says so, no lease has to run out."""
    subscriber = await cast.start_subscriber()
    publisher = await cast.start_publisher()
    await publisher.expect("HOLDING", timeout=cast.patience)
    await subscriber.expect("HOLDING", timeout=cast.patience)
    await dismiss(publisher)
    await subscriber.expect("MATCHED 0", timeout=3)
    await dismiss(subscriber)


async def refuse(cast: Cast) -> None:
    """Two that do not fit never match, and nothing is delivered."""
    subscriber = await cast.start_subscriber()
    publisher = await cast.start_publisher()
    await publisher.expect("TIMEOUT 0 .*", timeout=cast.patience)
    await subscriber.expect("TIMEOUT 0 .*", timeout=cast.patience)
    if subscriber.matches("MATCHED .*"):
        raise ExpectationFailed("the subscriber matched")


# --- steps and checks ----------------------------------------------------------------------------------------


async def _open_gate(cast: Cast, publisher: Process, subscriber: Process) -> None:
    """Where nothing is kept for late joiners, writing begins when each side has found the other."""
    if cast.publisher_options.gate:
        await publisher.expect("MATCHED 1", timeout=cast.patience)
        await subscriber.expect("MATCHED 1", timeout=cast.patience)
        await publisher.send("write")


async def dismiss(process: Process) -> None:
    await process.send("leave")
    await process.expect("DONE .*")
    await process.expect_exit(0)


def written(publisher: Process) -> list[str]:
    return [match[1] for match in publisher.matches("WROTE (.*)")]


def _check_received(subscriber: Process, expected: list[str], *, in_any_order: bool = False) -> None:
    received = [match[1] for match in subscriber.matches("SAMPLE (.*)")]
    if in_any_order:  # the order between instances is nobody's promise
        received, expected = sorted(received), sorted(expected)
    if received != expected:
        raise ExpectationFailed(f"written and kept: {expected}, received: {received}")


def _check_acknowledged(cast: Cast, publisher: Process) -> None:
    if not cast.publisher_options.best_effort and not publisher.matches("ACKED"):
        raise ExpectationFailed("the publisher's samples were not all acknowledged")


def _check_gone(cast: Cast, publisher: Process, subscriber: Process) -> None:
    """The subscriber names the instances that the publisher disposed and unregistered."""
    for said, heard in (("DISPOSED", "DISPOSED"), ("UNREGISTERED", "NO-WRITERS")):
        keys = [match[1] for match in publisher.matches(f"{said} (.*)")]
        received = [match[1] for match in subscriber.matches(f"{heard} (.*)")]
        if keys != received:
            raise ExpectationFailed(f"the publisher said {said} {keys}, the subscriber heard {heard} {received}")


def _latest(samples: list[str], depth: int) -> list[str]:
    """What KEEP_LAST ``depth`` keeps of shapes, instance by instance; everything if 0 (KEEP_ALL)."""
    if not depth:
        return samples
    by_color: dict[str, list[str]] = {}
    for sample in samples:
        by_color.setdefault(sample.split()[0], []).append(sample)
    return [sample for kept in by_color.values() for sample in kept[-depth:]]
