"""Somebody goes away, longer than anybody waits, and returns: nothing is lost, nothing comes twice, all match again.

The plays are in ``matrix/outages.py``.  An ordinary run plays them among ours, and some with others; ``--all-peers``
plays each with everybody on either side.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterator
from dataclasses import dataclass, replace

import pytest

from .framework import ExpectationFailed, async_test, namespace_pair, scenario
from .matrix import outages
from .matrix.stories import Cast
from .peers.catalogue import CYCLONE_C, FAST_DDS, FOREIGN, OURS
from .peers.keystore import shared_keystore
from .peers.options import Options
from .peers.peer import Peer

LEASE_S = 3
WRITING = Options(count=60, interval_ms=100, wait_s=40, lease_s=LEASE_S)


@dataclass(frozen=True)
class Outage:
    """A play; ``quick`` lists the pairs of an ordinary run, by their names."""

    name: str
    play: Callable[[Cast], Awaitable[None]]
    quick: tuple[str, ...] = ("ddsi-ddsi",)
    takes_any: bool = False
    """The subscriber does not wait for a number of samples, but goes on until it is told."""


def _pull_briefly(cast: Cast) -> Awaitable[None]:
    return outages.pull_cable(cast, seconds=1)


def _pull(cast: Cast) -> Awaitable[None]:
    return outages.pull_cable(cast, seconds=LEASE_S + 1.5)


def _stop_publisher(cast: Cast) -> Awaitable[None]:
    return outages.stop_publisher(cast, seconds=4 * LEASE_S)


def _stop_subscriber(cast: Cast) -> Awaitable[None]:
    return outages.stop_subscriber(cast, seconds=LEASE_S + 1.5)


OUTAGES = (
    Outage("cable-pulled-briefly", _pull_briefly),
    Outage("cable-pulled", _pull, ("ddsi-ddsi", "ddsi-cyclone", "cyclone-ddsi")),
    Outage("publisher-killed", outages.kill_publisher, ("ddsi-ddsi", "cyclone-ddsi"), takes_any=True),
    Outage("subscriber-killed", outages.kill_subscriber, ("ddsi-ddsi", "ddsi-fastdds")),
    Outage("publisher-stopped", _stop_publisher, ("ddsi-ddsi", "fastdds-ddsi")),
    Outage("subscriber-stopped", _stop_subscriber, ("ddsi-ddsi", "ddsi-fastdds")),
)
PARTNERS = (OURS, CYCLONE_C, FAST_DDS)
SECURED = ("cable-pulled", "publisher-stopped")
_NO_SECOND_HANDSHAKE = (
    "Fast DDS 2.9.1 does not notice that it stood still, and answers no second handshake; to itself neither"
)
"""No matter of luck: it stands still for longer than its lease, so it is forgotten each time.  A Fast DDS that passes
has learnt it, and is then to be played like the others."""


def _pairs(outage: Outage, *, plays_all: bool) -> Iterator[tuple[Peer, Peer]]:
    for publisher in PARTNERS:
        for subscriber in PARTNERS:
            is_quick = f"{publisher}-{subscriber}" in outage.quick
            if OURS in (publisher, subscriber) and (plays_all or is_quick):
                yield publisher, subscriber


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if metafunc.fixturenames[:3] != ["outage", "publisher", "subscriber"]:
        return
    plays_all = bool(metafunc.config.getoption("--all-peers", default=False))
    is_secured = metafunc.function is test_outage_of_a_secured_pair
    chosen = [
        pytest.param(
            outage, *pair, id=f"{outage.name}-{pair[0]}-{pair[1]}", marks=_marks(outage, pair, is_secured=is_secured)
        )
        for outage in OUTAGES
        if not is_secured or plays_all or outage.name in SECURED
        for pair in _pairs(outage, plays_all=plays_all)
        if not is_secured or plays_all or pair == (OURS, OURS)
    ]
    metafunc.parametrize(("outage", "publisher", "subscriber"), chosen)


def _marks(outage: Outage, pair: tuple[Peer, Peer], *, is_secured: bool) -> list[pytest.MarkDecorator]:
    marks = [pytest.mark.peers] if set(pair) & set(FOREIGN) else []
    publisher, subscriber = pair
    stopped = {"publisher-stopped": publisher, "subscriber-stopped": subscriber}.get(outage.name)
    if is_secured and stopped is FAST_DDS:
        marks.append(pytest.mark.xfail(reason=_NO_SECOND_HANDSHAKE, raises=ExpectationFailed, strict=True))
    return marks


@async_test
async def test_outage(outage: Outage, publisher: Peer, subscriber: Peer) -> None:
    await play(outage, publisher, subscriber, WRITING, WRITING)


@async_test
async def test_outage_of_a_secured_pair(outage: Outage, publisher: Peer, subscriber: Peer) -> None:
    """Who was forgotten authenticates anew."""
    secured = replace(WRITING, keystore=str(shared_keystore().folder), governance="encrypt-all.p7s")
    await play(outage, publisher, subscriber, secured, replace(secured, identity="bob"))


async def play(outage: Outage, publisher: Peer, subscriber: Peer, publishing: Options, subscribing: Options) -> None:
    publisher.locate()
    subscriber.locate()
    if outage.takes_any:
        subscribing = replace(subscribing, count=1)
    with namespace_pair() as (left, right):
        async with scenario(f"{outage.name} {publisher}-{subscriber}", deadline=100) as stage:
            await outage.play(Cast(stage, left, right, publisher, subscriber, publishing, subscribing))
