"""A handshake with another implementation of which one message or another is lost, some times: it is repaired."""

from __future__ import annotations

from dataclasses import replace

import pytest

from .framework import async_test, relayed_namespaces, scenario
from .matrix import find_case
from .matrix.stories import Cast, deliver
from .peers.catalogue import CYCLONE_C, FAST_DDS, OURS
from .peers.peer import Peer

WE_BEGIN, PEER_BEGINS = "encrypt-all", "encrypt-all-reversed"


@pytest.mark.peers
@pytest.mark.parametrize(
    ("message", "times", "who_begins", "peer"),
    [
        ("1.0+Req", 1, WE_BEGIN, CYCLONE_C),
        ("1.0+Req", 3, PEER_BEGINS, FAST_DDS),
        ("1.0+Reply", 3, WE_BEGIN, FAST_DDS),
        ("1.0+Reply", 1, PEER_BEGINS, CYCLONE_C),
        ("1.0+Final", 2, WE_BEGIN, CYCLONE_C),
        ("1.0+Final", 1, PEER_BEGINS, FAST_DDS),
        # Not the final of Cyclone DDS: where RTPS messages are protected it sends that once, whatever becomes of it.
        # Only while it works on the reply, for two milliseconds, would it answer another, and often in one datagram.
    ],
)
@async_test
async def test_a_lost_handshake_message_is_made_good(message: str, times: int, who_begins: str, peer: Peer) -> None:
    """Whoever waits says again what it said last, and the other answers again."""
    OURS.locate()
    peer.locate()
    case = find_case(who_begins)
    written, read = (replace(options, wait_s=30) for options in (case.publisher_options(), case.subscriber_options()))
    with relayed_namespaces("pub", "sub") as (hosts, relay):
        relay.drop(message.encode(), times)
        async with scenario(f"{message} lost", deadline=90) as stage:
            await deliver(Cast(stage, hosts["pub"], hosts["sub"], OURS, peer, written, read))
    assert relay.dropped == times
