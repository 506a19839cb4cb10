"""Identities and permissions that end while they are used: the one who has them is taken out, and says so himself.

DDS-Security 1.1 §8.3.2.11.12, §8.4.2.9.22 (on_revoke_identity, on_revoke_permissions).  All pairs run at the same time,
each on a loopback of its own, since all of them wait for the same moment.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
import trio

from ddsi_security.keystore.validity import Validity

from .framework import Namespace, Process, Scenario, async_test, namespace, scenario
from .matrix.refusals import until_said
from .matrix.stories import Cast
from .peers.catalogue import CYCLONE_C, FAST_DDS, OURS
from .peers.keystore import PeerKeystore
from .peers.options import Options
from .peers.peer import Peer

LIFE = timedelta(seconds=25)
"""Of what ends: on a busy machine, programs need some seconds until they have met."""
PATIENCE = 40.0
CONTINUAL = Options(governance="encrypt-all.p7s", count=1000, interval_ms=200, wait_s=90)
IDENTITY_ENDED, PERMISSIONS_ENDED = (
    rf"the {what} ended at [\d-]+T[\d:]+Z" for what in ("identity certificate", "permissions")
)


@dataclass(frozen=True, slots=True)
class Ending:
    """A publisher whose rights end, a subscriber whose rights do not, and what is then said."""

    publisher: Peer
    subscriber: Peer
    reason: str

    def cast(self, host: Namespace, stage: Scenario, keystore: Path) -> Cast:
        options = replace(CONTINUAL, keystore=str(keystore))
        written = replace(options, identity="brief" if self.reason == IDENTITY_ENDED else "licensed")
        read = replace(options, identity="bob")
        return Cast(stage, host, host, self.publisher, self.subscriber, written, read)


PEERS_THAT_END = (
    Ending(CYCLONE_C, OURS, IDENTITY_ENDED),
    Ending(FAST_DDS, OURS, PERMISSIONS_ENDED),
)
OURS_THAT_END = (
    Ending(OURS, CYCLONE_C, PERMISSIONS_ENDED),
    Ending(OURS, FAST_DDS, IDENTITY_ENDED),
)


@pytest.mark.peers
@async_test
async def test_what_ends_while_it_is_used_takes_its_owner_out(tmp_path_factory: pytest.TempPathFactory) -> None:
    for peer in (OURS, CYCLONE_C, FAST_DDS):
        peer.locate()
    keystore = _keystore(tmp_path_factory.mktemp("expiring"))
    with ExitStack() as stack:
        hosts = [stack.enter_context(namespace()) for _ in (*PEERS_THAT_END, *OURS_THAT_END)]
        async with scenario("rights that end", deadline=100) as stage:
            failures: list[AssertionError] = []

            async def play(story: Callable[[Cast, str], Awaitable[None]], ending: Ending, host: Namespace) -> None:
                try:
                    await story(ending.cast(host, stage, keystore), ending.reason)
                except AssertionError as error:
                    error.add_note(f"{ending.publisher} to {ending.subscriber}")
                    failures.append(error)

            stories = [(_peer_is_taken_out, ending) for ending in PEERS_THAT_END]
            stories += [(_ours_takes_itself_out, ending) for ending in OURS_THAT_END]
            async with trio.open_nursery() as nursery:
                for (story, ending), host in zip(stories, hosts, strict=True):
                    nursery.start_soon(play, story, ending, host)
            if failures:
                raise failures[0]


def _keystore(folder: Path) -> Path:
    """With ``brief``, whose certificate ends soon, and ``licensed``, whose permissions do."""
    keystore = PeerKeystore.create(folder)
    now = datetime.now(UTC).replace(microsecond=0)
    long, brief = (Validity(now - timedelta(days=1), now + life) for life in (timedelta(days=1), LIFE))
    keystore.add_identity("brief", validity=brief, granted=long)
    keystore.add_identity("licensed", validity=long, granted=brief)
    return folder


async def _peer_is_taken_out(cast: Cast, reason: str) -> None:
    """Ours says why, in an event and in its log, and receives nothing more of what the other goes on to write."""
    subscriber, publisher = await _until_they_talk(cast)
    await until_said(subscriber, f"REFUSED {reason}", timeout=PATIENCE)
    await until_said(subscriber, f"is refused: {reason}", timeout=5)
    await subscriber.expect("MATCHED 0", timeout=5)
    received, written = len(subscriber.matches("SAMPLE .*")), len(publisher.matches("WROTE .*"))
    await trio.sleep(2)
    assert len(publisher.matches("WROTE .*")) > written, "nothing is shown if the publisher stopped by itself"
    assert len(subscriber.matches("SAMPLE .*")) == received


async def _ours_takes_itself_out(cast: Cast, reason: str) -> None:
    """It says so, in an event, in its log and to whom it was writing; its next write fails, and it is gone."""
    subscriber, publisher = await _until_they_talk(cast)
    await until_said(publisher, f"REVOKED {reason}: renew what has ended", timeout=PATIENCE)
    await until_said(publisher, f"^{reason}: renew what has ended", timeout=5)
    await until_said(publisher, f"ERROR .*{reason}", timeout=5)
    await publisher.expect_exit(2)
    await subscriber.expect("MATCHED 0", timeout=5)


async def _until_they_talk(cast: Cast) -> tuple[Process, Process]:
    subscriber = await cast.start_subscriber()
    publisher = await cast.start_publisher()
    for _ in range(3):
        await subscriber.expect("SAMPLE .*", timeout=LIFE.total_seconds())
    return subscriber, publisher
