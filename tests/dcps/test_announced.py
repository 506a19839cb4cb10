"""``DomainParticipant.knows_all_announced``: has the discovery of endpoints caught up?"""

from __future__ import annotations

from collections.abc import Awaitable, Callable

import trio

import ddsi
from ddsi import idl

DOMAIN = 163


@idl.struct
class Reading:
    value: idl.int32


def _run(test: Callable[[], Awaitable[None]]) -> None:
    trio.run(test)


def test_alone_there_is_nothing_to_come() -> None:
    async def test() -> None:
        async with ddsi.DomainParticipant(DOMAIN) as participant:
            assert participant.knows_all_announced()

    _run(test)


def test_a_participant_is_known_before_its_endpoints_are() -> None:
    """Right after SPDP the answer is no; once it is yes, every endpoint that was there is in the tables."""

    async def test() -> None:
        async with ddsi.DomainParticipant(DOMAIN + 1) as other:
            for number in range(30):
                ddsi.DataWriter(other, ddsi.Topic(other, f"Topic{number}", Reading))
            async with ddsi.DomainParticipant(DOMAIN + 1) as participant:
                with trio.fail_after(5):
                    while not participant.discovered_participants():
                        await participant.wait_for_discovery()
                    assert not participant.knows_all_announced()
                    while not participant.knows_all_announced():
                        await participant.wait_for_discovery()
                assert len(participant.discovered_publications()) == 30

    _run(test)
