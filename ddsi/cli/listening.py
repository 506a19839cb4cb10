"""Joining a domain to look around, and knowing when one has looked long enough."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import trio

from ..dcps import DomainParticipant
from ..structure.qos import Qos
from .arguments import DEFAULT_LISTENING_S

__all__ = ["listen", "observer"]

_LOOK_S = 0.05


@asynccontextmanager
async def observer(domain_id: int, qos: Qos) -> AsyncIterator[DomainParticipant]:
    """A participant; ``qos`` has the command's name, which it announces: who looks is seen too."""
    async with DomainParticipant(domain_id, qos=qos) as participant:
        yield participant


async def listen(participant: DomainParticipant, duration: float | None) -> None:
    """Wait for announcements: exactly ``duration`` seconds, or, if None, the default time and up to as long again.

    The second half is for participants that were discovered while their endpoints are still coming in (a busy host,
    thousands of endpoints): RTPS tells how many there will be.
    """
    await trio.sleep(duration if duration is not None else DEFAULT_LISTENING_S)
    if duration is None:
        with trio.move_on_after(DEFAULT_LISTENING_S):
            while not participant.knows_all_announced():
                await trio.sleep(_LOOK_S)
