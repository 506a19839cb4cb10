"""What the tests of the public face share: they run in trio, on loopback, in domains where nobody else is."""

from __future__ import annotations

import functools
import itertools
import os
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass, replace
from typing import Annotated, Any, ParamSpec

import pytest
import trio

import ddsi
from ddsi import idl

__all__ = ["RELIABLE", "Note", "Pair", "Shape", "config", "domain", "eventually", "in_trio", "pair"]

RELIABLE = ddsi.Qos(reliability=ddsi.Reliable(), history=ddsi.KeepAll())
"""Every sample arrives; the tests that want less say so."""


P = ParamSpec("P")
_counter = itertools.count()
_SECONDS = 20


@idl.struct(extensibility=idl.FINAL)
class Shape:
    """Keyed: each color is an instance."""

    color: Annotated[str, idl.key, idl.bound(128)]
    x: idl.int32 = 0
    y: idl.int32 = 0


@idl.struct(extensibility=idl.FINAL)
class Note:
    """Keyless."""

    number: idl.int32
    octets: idl.sequence[idl.octet] = b""


def in_trio(test: Callable[P, Awaitable[None]]) -> Callable[P, None]:
    """The async test as one that pytest runs.  It fails after twenty seconds rather than hang."""

    @functools.wraps(test)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        async def limited() -> None:
            with trio.fail_after(_SECONDS):
                await test(*args, **kwargs)

        trio.run(limited)

    return run


@pytest.fixture
def domain(monkeypatch: pytest.MonkeyPatch) -> int:
    """A domain of the test's own: on a host where others test too, a domain tag keeps them apart."""
    number = next(_counter)
    tag = f"test-{os.getpid()}-{number}"
    monkeypatch.setenv(
        "DDSI_URI",
        '<DDSI><Domain><General><Interfaces><NetworkInterface name="lo"/></Interfaces></General>'
        f"<Discovery><Tag>{tag}</Tag></Discovery></Domain></DDSI>",
    )
    return 100 + (os.getpid() + number) % 100


def config(**changes: Any) -> ddsi.Config:
    """What ``DDSI_URI`` says now, with these settings changed."""
    return replace(ddsi.Config.from_uri(os.environ["DDSI_URI"]), **changes)


@dataclass
class Pair:
    """A writer and a reader of one topic: ``here`` writes and ``there`` reads, which may be one participant."""

    here: ddsi.DomainParticipant
    there: ddsi.DomainParticipant
    writer: ddsi.DataWriter[Any]
    reader: ddsi.DataReader[Any]

    async def matched(self) -> Pair:
        await self.writer.wait_for_matched(timeout=5)
        await self.reader.wait_for_matched(timeout=5)
        return self


@asynccontextmanager
async def pair(
    domain: int,
    *,
    kind: type[Any] = Shape,
    writer: ddsi.Qos = RELIABLE,
    reader: ddsi.Qos = RELIABLE,
    local: bool = False,
    **settings: Any,
) -> AsyncIterator[Pair]:
    """A matched :class:`Pair`; ``local``: in one participant.  ``settings`` change the Config of both."""
    async with AsyncExitStack() as stack:
        here = await stack.enter_async_context(ddsi.DomainParticipant(domain, config=config(**settings)))
        there = here
        if not local:
            there = await stack.enter_async_context(ddsi.DomainParticipant(domain, config=config(**settings)))
        yield await Pair(
            here,
            there,
            ddsi.DataWriter(here, ddsi.Topic(here, "Square", kind), writer),
            ddsi.DataReader(there, ddsi.Topic(there, "Square", kind), reader),
        ).matched()


async def eventually(holds: Callable[[], object], seconds: float = 5) -> None:
    """Until ``holds()`` is true, looked at every few milliseconds; fails when it does not come true in time."""
    with trio.fail_after(seconds):
        while not holds():
            await trio.sleep(0.002)
