"""Lead: a leader whose waits are brief stays where it is, unless anybody else has something to do."""

from __future__ import annotations

import functools
import socket
from collections.abc import Awaitable, Callable, Iterator
from typing import Any, cast

import pytest
import trio

from ddsi.transport.lead import Lead

Sockets = tuple[socket.socket, socket.socket]
Case = Callable[[Lead, socket.socket, socket.socket], Awaitable[None]]


@pytest.fixture
def sockets(monkeypatch: pytest.MonkeyPatch) -> Iterator[Sockets]:
    """What is sent into the first can be read from the second.  A moment is long, as this machine may be busy."""
    monkeypatch.setattr("ddsi.transport.lead._MOMENT_S", 0.1)
    there, here = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    with there, here:
        there.setblocking(False)
        here.setblocking(False)
        yield there, here


def after_a_brief_wait(case: Case) -> Callable[[Sockets], None]:
    """The leader has just waited for a datagram that was there at once, and read it."""

    @functools.wraps(case)
    def run(sockets: Sockets) -> None:
        async def limited() -> None:
            there, here = sockets
            lead = Lead(lambda: None)
            lead.take(cast(Any, object()))
            there.send(b"first")
            with trio.fail_after(10):
                assert await lead.wait(here)
                here.recv(100)
                await case(lead, there, here)

        trio.run(limited)

    del run.__wrapped__  # pytest would look for its parameters among the fixtures
    return run


@after_a_brief_wait
async def test_it_waits_again_without_a_round_of_the_scheduler(
    lead: Lead, there: socket.socket, here: socket.socket
) -> None:
    for _ in range(3):
        there.send(b"next")
        assert not await lead.wait(here)
        here.recv(100)


@after_a_brief_wait
async def test_whoever_wants_to_run_has_a_turn(lead: Lead, there: socket.socket, here: socket.socket) -> None:
    async with trio.open_nursery() as nursery:
        nursery.start_soon(trio.lowlevel.checkpoint)
        there.send(b"next")
        assert await lead.wait(here)


@after_a_brief_wait
async def test_a_deadline_that_is_near_is_kept(lead: Lead, there: socket.socket, here: socket.socket) -> None:
    with trio.move_on_after(0.01) as scope:
        assert await lead.wait(here)
    assert scope.cancelled_caught


@after_a_brief_wait
async def test_a_call_from_another_thread_is_served(lead: Lead, there: socket.socket, here: socket.socket) -> None:
    called: list[int] = []
    trio.lowlevel.current_trio_token().run_sync_soon(called.append, 1)
    there.send(b"next")
    assert await lead.wait(here)
    while not called:
        await trio.lowlevel.checkpoint()


@after_a_brief_wait
async def test_where_nothing_comes_within_a_moment_others_have_their_turn(
    lead: Lead, there: socket.socket, here: socket.socket
) -> None:
    with trio.move_on_after(0.3) as scope:
        await lead.wait(here)
    assert scope.cancelled_caught
    there.send(b"late")
    assert await lead.wait(here), "as the wait before was a long one"
