"""Watching for interfaces and addresses that come and go.

Where the system tells of such changes (Linux does) nothing runs until it does; elsewhere the interfaces are looked at
every few seconds.  What a change means is the pump's and the transport's to say.
"""

from __future__ import annotations

import socket
from collections.abc import Callable

import trio

from .platform import open_network_events

__all__ = ["watch_interfaces"]

_POLL_S = 5.0
_MAX_EVENTS = 1000
_SETTLE_S = 0.1  # one change comes as several events, and a host may make many: looking ten times a second will do


async def watch_interfaces(look: Callable[[], None]) -> None:
    """Calls ``look`` after every change, for ever; also once at the start, as changes before it are not told."""
    events = open_network_events()
    try:
        while True:
            look()
            if events is None:
                await trio.sleep(_POLL_S)
            else:
                await trio.lowlevel.wait_readable(events)
                await trio.sleep(_SETTLE_S)
                _discard(events)
    finally:
        if events is not None:
            events.close()


def _discard(events: socket.socket) -> None:
    """What exactly changed is not asked: the interfaces are looked at as they are now.  So a lost event is no harm."""
    for _ in range(_MAX_EVENTS):
        try:
            events.recv(65536)
        except BlockingIOError:
            return
        except OSError:  # ENOBUFS: more events than the socket holds
            continue
