"""Joining a domain to look around, and knowing when one has looked long enough."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Protocol, TypeVar

import trio

from ..dcps import DomainParticipant
from ..structure.qos import Qos
from .arguments import DEFAULT_LISTENING_S

__all__ = ["listen", "observer", "with_types"]

_LOOK_S = 0.05
_TYPES_S = 4.0
"""How long to wait for what others' types are made of: longer than their participants are asked for them."""


class _Judged(Protocol):
    @property
    def is_complete(self) -> bool: ...


Judged = TypeVar("Judged", bound=_Judged)


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


async def with_types(participant: DomainParticipant, look: Callable[[], Judged]) -> Judged:
    """What ``look`` says when everybody has told what types are made of, or had the time to.  Looking asks them."""
    seen = look()
    with trio.move_on_after(_TYPES_S):
        while not seen.is_complete:
            with trio.move_on_after(0.25):
                await participant.wait_for_discovery()
            seen = look()
    return seen
