"""What an application notices of its hooks: hidden keys, and the end of its rights."""

from __future__ import annotations

import hashlib
from collections.abc import Awaitable, Callable, Sequence
from typing import Annotated

import pytest
import trio
import trio.testing

import ddsi
from ddsi import idl
from ddsi.spi import HookEffect, ProtectedEndpoint, Revoked
from ddsi.spi.plaintext import Plaintext
from ddsi.structure.discovered import DiscoveredReaderData, DiscoveredWriterData
from ddsi.trace.events import MessageSent
from ddsi.trace.sink import MemorySink

from .running import RELIABLE, eventually, in_trio

KEY_HASH = b"\x70\x00\x10\x00"


class Hooks(Plaintext):
    """``effects`` are given out once."""

    def __init__(self) -> None:
        self.effects: list[HookEffect] = []
        self.protection = ProtectedEndpoint()

    def local_writer(self, data: DiscoveredWriterData) -> ProtectedEndpoint:
        return self.protection

    def local_reader(self, data: DiscoveredReaderData) -> ProtectedEndpoint:
        return self.protection

    def drain_effects(self) -> Sequence[HookEffect]:
        effects, self.effects = self.effects, []
        return effects


@pytest.fixture
def hooks(monkeypatch: pytest.MonkeyPatch) -> Hooks:
    """What every participant of the test has."""
    found = Hooks()
    monkeypatch.setattr("ddsi.transport.pump.load_hooks", lambda properties, **given: found)
    return found


# --- hidden keys ----------------------------------------------------------------------------------------------------


@idl.struct
class Numbered:
    """Its key fits a key hash, so unhidden it is the hash."""

    number: Annotated[idl.int32, idl.key]
    text: str = ""


@pytest.mark.parametrize(("is_hidden", "shown", "digested"), [(False, 1, 0), (True, 0, 2)])
@in_trio
async def test_a_protected_key_shows_only_as_a_digest_and_beside_every_sample(
    domain: int, hooks: Hooks, is_hidden: bool, shown: int, digested: int
) -> None:
    """DDS-Security 1.1 §8.4.2.7 (is_key_protected), RTPS 2.5 §9.6.4.8."""
    hooks.protection = ProtectedEndpoint(key_protected=is_hidden)
    sink = MemorySink()
    async with ddsi.DomainParticipant(domain, trace=sink) as one, ddsi.DomainParticipant(domain) as other:
        writer = ddsi.DataWriter(one, ddsi.Topic(one, "Numbers", Numbered), RELIABLE)
        reader = ddsi.DataReader(other, ddsi.Topic(other, "Numbers", Numbered), RELIABLE)
        await writer.wait_for_matched()
        await reader.wait_for_matched()
        await writer.write(Numbered(7, "seven"))
        await writer.dispose(Numbered(7))
        first, second = await anext(reader), await anext(reader)
        assert (first.data, second.info.valid_data) == (Numbered(7, "seven"), False)
        assert first.info.instance_handle == second.info.instance_handle
    sent = b"".join(event.octets for event in sink if isinstance(event, MessageSent))
    key = b"\0\0\0\7"
    assert sent.count(KEY_HASH + key + bytes(12)) == shown
    assert sent.count(KEY_HASH + hashlib.md5(key, usedforsecurity=False).digest()) == digested


# --- the end of our rights ------------------------------------------------------------------------------------------

REASON = "the certificate ended on 2026-11-22"


async def _revoked(hooks: Hooks, participant: ddsi.DomainParticipant) -> None:
    hooks.effects.append(Revoked(REASON))
    participant.assert_liveliness()  # anything that lets the engine act
    await eventually(lambda: participant.is_closed)


@in_trio
async def test_a_participant_whose_rights_end_says_so_and_closes(domain: int, hooks: Hooks) -> None:
    async with ddsi.DomainParticipant(domain) as other:
        participant = ddsi.DomainParticipant(domain)
        async with participant:
            events = participant.events()
            await eventually(other.discovered_participants)
            await _revoked(hooks, participant)
            assert [event async for event in events] == [ddsi.SecurityRevoked(reason=REASON)]
            assert participant.status(ddsi.SecurityRevoked).reason == REASON
            await eventually(lambda: not other.discovered_participants())


@in_trio
async def test_all_that_is_asked_afterwards_fails_with_the_reason(domain: int, hooks: Hooks) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Numbers", Numbered)
        publisher = ddsi.Publisher(participant)
        writer, reader = ddsi.DataWriter(publisher, topic), ddsi.DataReader(participant, topic)
        await _revoked(hooks, participant)
        for call in (
            lambda: ddsi.DataWriter(participant, topic),
            lambda: ddsi.Topic(participant, "Other", Numbered),
            lambda: ddsi.DataReader(participant, topic),
            participant.discovered_participants,
            participant.assert_liveliness,
            reader.take,
            writer.assert_liveliness,
        ):
            with pytest.raises(ddsi.NotAllowedBySecurity, match=REASON):
                call()
        for waiting in (
            lambda: writer.write(Numbered(1)),
            lambda: writer.dispose(Numbered(1)),
            writer.wait_for_matched,
            reader.wait,
            lambda: anext(reader),
            participant.wait_for_discovery,
        ):
            with pytest.raises(ddsi.NotAllowedBySecurity, match=REASON):
                await waiting()
        participant.close()
        writer.close()


@in_trio
async def test_whoever_waits_when_rights_end_is_woken_with_the_reason(domain: int, hooks: Hooks) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Numbers", Numbered)
        writer, reader = ddsi.DataWriter(participant, topic), ddsi.DataReader(participant, topic)
        woken: list[str] = []

        async def expect(wait: Callable[[], Awaitable[object]]) -> None:
            with pytest.raises(ddsi.NotAllowedBySecurity, match=REASON) as refusal:
                await wait()
            woken.append(str(refusal.value))

        async with trio.open_nursery() as nursery:
            for wait in (
                lambda: writer.wait_for_matched(2),
                lambda: anext(reader),
                reader.wait,
                participant.wait_for_discovery,
            ):
                nursery.start_soon(expect, wait)
            await trio.testing.wait_all_tasks_blocked(0.02)
            await _revoked(hooks, participant)
        assert len(woken) == 4


@in_trio
async def test_rights_that_end_before_the_first_task_runs_end_the_participant_too(domain: int, hooks: Hooks) -> None:
    hooks.effects.append(Revoked(REASON))
    async with ddsi.DomainParticipant(domain) as participant:
        await eventually(lambda: participant.is_closed)


@in_trio
async def test_a_participant_that_the_application_closed_was_not_revoked(domain: int, hooks: Hooks) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        hooks.effects.append(Revoked(REASON))
        participant.assert_liveliness()
        participant.close()
        await trio.testing.wait_all_tasks_blocked()
        with pytest.raises(ddsi.AlreadyDeleted):
            participant.discovered_participants()
